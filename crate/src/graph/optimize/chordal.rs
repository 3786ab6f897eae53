//! A start that does not depend on the poses in the file: Carlone, Tron, Daniilidis and Dellaert, "Initialization techniques for 3D
//! SLAM: a survey on rotation estimation and its use in pose graph optimization", ICRA 2015, section III.B.
//!
//! First the matrices, not bound to be rotations, with the smallest weighted sum of `|R_from R_from_to - R_to|^2`: a linear system.
//! The nearest rotations of these are the rotations. Then the translations for these rotations, a second linear system.

use super::Variables;
use crate::geometry::{RigidMotion, SquareMatrix, Vector};
use crate::graph::sparse::{BlockCholesky, BlockMatrix};
use crate::io::pose_graph::PoseGraph;

/// Poses for the edges alone, each part beginning where its fixed nodes are. `None` where a system has no solution: an information
/// matrix is singular.
pub fn poses<M: RigidMotion>(graph: &PoseGraph<M>) -> Option<Vec<M>> {
    let anchors = Variables::of(graph);
    let rotations = rotations(graph, &anchors)?;
    let translations = translations(graph, &anchors, &rotations)?;
    let placed = |node: usize| {
        let is_fixed = anchors.of_node[node].is_none();
        if is_fixed { graph.poses[node] } else { M::from_parts(&rotations[node], &translations[node]) }
    };
    Some((0..graph.poses.len()).map(placed).collect())
}

/// The matrix of a motion's rotation, and its translation.
fn parts_of<M: RigidMotion>(motion: &M) -> (M::PointMatrix, M::Point) {
    let origin = M::Point::zeros();
    let mut R = M::PointMatrix::zeros();
    for axis in 0..M::Point::LEN {
        let mut unit = M::Point::zeros();
        unit[axis] = 1.0;
        let column = motion.rotate(&unit);
        for row in 0..M::Point::LEN {
            R[(row, axis)] = column[row];
        }
    }
    (R, motion.act(&origin))
}

/// Mean information of an edge's rotation and of its translation.
fn weights<M: RigidMotion>(information: &M::Matrix) -> (f64, f64) {
    let (num, num_translation) = (M::Tangent::LEN, M::Point::LEN);
    let mean = |range: std::ops::Range<usize>| {
        let count = range.len() as f64;
        range.map(|axis| information[(axis, axis)]).sum::<f64>() / count
    };
    (mean(0..num - num_translation), mean(num - num_translation..num))
}

/// Rows of rotation matrices are vectors, and all rows have the same normal matrix: `R_from_to^T r_from = r_to`.
fn rotations<M: RigidMotion>(graph: &PoseGraph<M>, anchors: &Variables) -> Option<Vec<M::PointMatrix>> {
    let fixed: Vec<M::PointMatrix> = graph.poses.iter().map(|pose| parts_of(pose).0).collect();
    let mut H = BlockMatrix::<M::PointMatrix>::new(anchors.count);
    let mut b = vec![vec![M::Point::zeros(); anchors.count]; M::Point::LEN];
    for edge in &graph.edges {
        let weight = weights::<M>(&edge.information).0;
        let R = parts_of(&edge.T_from_to).0 * weight;
        let (from, to) = (anchors.of_node[edge.from], anchors.of_node[edge.to]);
        for variable in [from, to].into_iter().flatten() {
            H.add(variable, variable, &(M::PointMatrix::identity() * weight));
        }
        match (from, to) {
            (Some(from), Some(to)) => H.add(from, to, &-R),
            (Some(from), None) => {
                let known = fixed[edge.to].transpose();
                b.iter_mut().enumerate().for_each(|(row, b)| b[from] += R.apply(&known.column(row)));
            }
            (None, Some(to)) => {
                let known = fixed[edge.from].transpose();
                b.iter_mut().enumerate().for_each(|(row, b)| b[to] += R.tr_apply(&known.column(row)));
            }
            (None, None) => {}
        }
    }
    let mut solver = BlockCholesky::new(&H);
    let factor = solver.factor(&H).ok()?;
    for b in &mut b {
        factor.solve(b);
    }
    let solved = |(node, variable): (usize, &Option<usize>)| {
        let Some(variable) = variable else { return Some(fixed[node]) };
        let mut R = M::PointMatrix::zeros();
        for (row, b) in b.iter().enumerate() {
            for axis in 0..M::Point::LEN {
                R[(row, axis)] = b[*variable][axis];
            }
        }
        M::best_rotation(&R)
    };
    anchors.of_node.iter().enumerate().map(solved).collect()
}

/// The translations with `t_to - t_from = R_from t_from_to`.
fn translations<M: RigidMotion>(
    graph: &PoseGraph<M>,
    anchors: &Variables,
    rotations: &[M::PointMatrix],
) -> Option<Vec<M::Point>> {
    let fixed: Vec<M::Point> = graph.poses.iter().map(|pose| parts_of(pose).1).collect();
    let mut H = BlockMatrix::<M::PointMatrix>::new(anchors.count);
    let mut b = vec![M::Point::zeros(); anchors.count];
    for edge in &graph.edges {
        let weight = weights::<M>(&edge.information).1;
        let block = M::PointMatrix::identity() * weight;
        let between = rotations[edge.from].apply(&parts_of(&edge.T_from_to).1) * weight;
        let ends = [(edge.from, edge.to, -1.0), (edge.to, edge.from, 1.0)];
        for (node, other, sign) in ends {
            let Some(variable) = anchors.of_node[node] else { continue };
            H.add(variable, variable, &block);
            b[variable] += between * sign;
            if anchors.of_node[other].is_none() {
                b[variable] += fixed[other] * weight;
            }
        }
        if let (Some(from), Some(to)) = (anchors.of_node[edge.from], anchors.of_node[edge.to]) {
            H.add(from, to, &-block);
        }
    }
    BlockCholesky::new(&H).factor(&H).ok()?.solve(&mut b);
    let of_node = anchors.of_node.iter().enumerate();
    Some(of_node.map(|(node, variable)| variable.map_or(fixed[node], |variable| b[variable])).collect())
}
