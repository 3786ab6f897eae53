//! Pose graphs: poses, and measured motions between them with their information.
//!
//! - g2o: `VERTEX_SE2 id x y theta`, `EDGE_SE2 i j dx dy dtheta` and 6 numbers; `VERTEX_SE3:QUAT id x y z qx qy qz qw`,
//!   `EDGE_SE3:QUAT i j dx dy dz qx qy qz qw` and 21 numbers; `FIX id...`;
//! - TORO: `VERTEX2`, `EDGE2` with `Ixx Ixy Iyy Itt Ixt Iyt`; `VERTEX3 id x y z roll pitch yaw`, `EDGE3` and 21 numbers.
//!
//! Numbers of an information matrix are its upper triangle row by row, translation first, but in TORO's `EDGE2`. Lengths in metres,
//! angles in radians. Rotations in space are perturbed on the right by a rotation vector (rad), as GTSAM reads these files.

use std::cmp::Reverse;
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BinaryHeap};
use std::fmt::Write;

use nalgebra::{Isometry2, Isometry3, Matrix3, Matrix6, Quaternion, Translation3, UnitQuaternion, Vector2};

use super::text::{lines, number, quote, refuse_pointer_and_utf16, without_byte_order_mark};
use crate::geometry::{Embedding, Pose2, Pose3, RigidMotion, Vector};
use crate::{Error, Result};

/// A measured motion between two nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge<M: RigidMotion> {
    /// The node in whose frame `to` was measured, as an index of [`PoseGraph::ids`].
    pub from: usize,
    /// The measured node.
    pub to: usize,
    /// Pose of `to` in the frame of `from`.
    pub T_from_to: M,
    /// Information of a perturbation on the right of `T_from_to`, rotation first (1/rad^2, 1/m^2).
    pub information: M::Matrix,
}

/// Poses and measured motions between them.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseGraph<M: RigidMotion> {
    /// The names of the nodes, ascending.
    pub ids: Vec<u64>,
    /// `T_world_node` as in the file; where the file has none, composed along the edges.
    pub poses: Vec<M>,
    /// Number of nodes of which the file has a pose.
    pub num_given: usize,
    /// Nodes that the file fixes, as indices of `ids`.
    pub fixed: Vec<usize>,
    /// The measured motions, in the order of the file.
    pub edges: Vec<Edge<M>>,
}

/// A pose graph in the plane or in space.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyPoseGraph {
    /// Poses x, y, theta.
    Plane(PoseGraph<Pose2>),
    /// Poses in space.
    Space(PoseGraph<Pose3>),
}

const REMEDY: &str = "Give g2o lines (VERTEX_SE2, EDGE_SE2, VERTEX_SE3:QUAT, EDGE_SE3:QUAT) or TORO lines (VERTEX2, EDGE2, VERTEX3, EDGE3)";

/// What one line says.
#[derive(Clone, Copy)]
enum Line<M: RigidMotion> {
    Pose(u64, M),
    Edge(u64, u64, M, M::Matrix),
}

/// Nodes and edges as the lines name them.
struct Parts<M: RigidMotion> {
    poses: BTreeMap<u64, M>,
    edges: Vec<(u64, u64, M, M::Matrix)>,
}

impl<M: RigidMotion> Parts<M> {
    const fn new() -> Self {
        Self { poses: BTreeMap::new(), edges: Vec::new() }
    }

    fn is_empty(&self) -> bool {
        self.poses.is_empty() && self.edges.is_empty()
    }

    fn add(&mut self, line: usize, part: Line<M>) -> Result<()> {
        match part {
            Line::Pose(id, pose) if self.poses.insert(id, pose).is_some() => {
                return Err(Error::line(line, format!("The pose of node {id} is given twice"), "Keep one of them"));
            }
            Line::Pose(..) => {}
            Line::Edge(from, to, ..) if from == to => {
                let problem = format!("The edge leads from node {from} to itself");
                return Err(Error::line(line, problem, "Remove the line"));
            }
            Line::Edge(from, to, motion, information) => self.edges.push((from, to, motion, information)),
        }
        Ok(())
    }

    /// The graph; poses that the file does not give are composed along the edges.
    fn into_graph(mut self, fixed: &[(usize, u64)]) -> Result<PoseGraph<M>> {
        if self.edges.is_empty() {
            return Err(Error::whole("The graph has no edge: nothing to optimise", REMEDY));
        }
        let num_given = self.poses.len();
        self.compose_missing();
        let ids: Vec<u64> = self.poses.keys().copied().collect();
        let named = |&(line, id): &(usize, u64)| {
            ids.binary_search(&id)
                .map_err(|_| Error::line(line, format!("FIX names node {id}, which no line has"), "Remove it"))
        };
        let fixed = fixed.iter().map(named).collect::<Result<_>>()?;
        // Every node of an edge has a pose.
        let index = |id: u64| ids.partition_point(|known| *known < id);
        let edges = self.edges.iter().map(|&(from, to, T_from_to, information)| Edge {
            from: index(from),
            to: index(to),
            T_from_to,
            information,
        });
        let edges = edges.collect();
        Ok(PoseGraph { poses: self.poses.into_values().collect(), ids, num_given, fixed, edges })
    }

    /// Gives every node a pose: of the edges with one end placed, that which the file has first places the other. Where none is
    /// left, the smallest node without a pose begins at the origin.
    fn compose_missing(&mut self) {
        let mut edges_of: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
        for (index, &(from, to, ..)) in self.edges.iter().enumerate() {
            edges_of.entry(from).or_default().push(index);
            edges_of.entry(to).or_default().push(index);
        }
        let of = |id: u64| edges_of.get(&id).into_iter().flatten().copied().map(Reverse);
        let mut open: BinaryHeap<Reverse<usize>> = self.poses.keys().flat_map(|&id| of(id)).collect();
        for &start in edges_of.keys() {
            // What hangs together with given poses comes first.
            while let Some(Reverse(index)) = open.pop() {
                let (from, to, motion, _) = self.edges[index];
                let (node, pose) = match (self.poses.get(&from).copied(), self.poses.get(&to).copied()) {
                    (Some(pose), None) => (to, pose * motion),
                    (None, Some(pose)) => (from, pose * motion.inverse()),
                    _ => continue,
                };
                self.poses.insert(node, pose.renormalized());
                open.extend(of(node));
            }
            if let Entry::Vacant(place) = self.poses.entry(start) {
                place.insert(M::identity());
                open.extend(of(start));
            }
        }
    }
}

/// Reads a pose graph.
///
/// # Errors
/// When a line has too few numbers, a word in the place of a number, a node that is no whole number or a quaternion of length zero;
/// when an information matrix is not positive semidefinite; when a pose is given twice, an edge joins a node with itself, nothing is
/// there to optimise, or the plane and space are mixed.
pub fn read(bytes: &[u8]) -> Result<AnyPoseGraph> {
    refuse_pointer_and_utf16(bytes)?;
    let (mut plane, mut space, mut fixed) = (Parts::<Pose2>::new(), Parts::<Pose3>::new(), Vec::new());
    for (line, text) in lines(without_byte_order_mark(bytes)) {
        let values = text.split(|&byte| byte == b'#').next().unwrap_or_default();
        let mut words = values.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let Some(kind) = words.next() else { continue };
        let words: Vec<&[u8]> = words.collect();
        match kind {
            b"VERTEX_SE2" | b"VERTEX2" | b"VERTEX" => plane.add(line, pose_in_plane(line, &words)?)?,
            b"EDGE_SE2" => plane.add(line, edge_in_plane(line, &words, false)?)?,
            b"EDGE2" | b"EDGE" => plane.add(line, edge_in_plane(line, &words, true)?)?,
            b"VERTEX_SE3:QUAT" | b"VERTEX3" => space.add(line, pose_in_space(line, kind, &words)?)?,
            b"EDGE_SE3:QUAT" | b"EDGE3" => space.add(line, edge_in_space(line, kind, &words)?)?,
            b"FIX" => {
                for word in &words {
                    fixed.push((line, node(line, word)?));
                }
            }
            _ if number(kind).is_some() => {
                return Err(Error::line(line, "The line begins with a number, not with what it is", REMEDY));
            }
            _ => {} // what other programs add: parameters, landmarks
        }
    }
    match (plane.is_empty(), space.is_empty()) {
        (true, true) => Err(Error::whole("This is no pose graph: no line of it is a pose or an edge", REMEDY)),
        (false, false) => Err(Error::whole("The graph has poses in the plane and in space", "Give one kind a file")),
        (false, true) => Ok(AnyPoseGraph::Plane(plane.into_graph(&fixed)?)),
        (true, false) => Ok(AnyPoseGraph::Space(space.into_graph(&fixed)?)),
    }
}

fn node(line: usize, word: &[u8]) -> Result<u64> {
    let id = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
    id.ok_or_else(|| {
        let problem = format!("{} is not the number of a node", quote(word));
        Error::line(line, problem, "Number the nodes with whole numbers from 0")
    })
}

/// Exactly `N` finite numbers.
fn numbers<const N: usize>(line: usize, words: &[&[u8]]) -> Result<[f64; N]> {
    if words.len() != N {
        let problem = format!("The line has {} numbers after its nodes in place of {N}", words.len());
        return Err(Error::line(line, problem, REMEDY));
    }
    let mut values = [0.0; N];
    for (value, word) in values.iter_mut().zip(words) {
        *value = number(word).filter(|value| value.is_finite()).ok_or_else(|| {
            Error::line(line, format!("{} is not a finite number", quote(word)), "Write the line again")
        })?;
    }
    Ok(values)
}

fn nodes<'a, const N: usize>(line: usize, words: &'a [&'a [u8]]) -> Result<([u64; N], &'a [&'a [u8]])> {
    let Some((names, rest)) = words.split_at_checked(N) else {
        return Err(Error::line(line, "The line names too few nodes", REMEDY));
    };
    let mut ids = [0; N];
    for (id, word) in ids.iter_mut().zip(names) {
        *id = node(line, word)?;
    }
    Ok((ids, rest))
}

fn planar(x: f64, y: f64, theta: f64) -> Pose2 {
    Isometry2::new(Vector2::new(x, y), theta)
}

fn pose_in_plane(line: usize, words: &[&[u8]]) -> Result<Line<Pose2>> {
    let ([id], rest) = nodes(line, words)?;
    let [x, y, theta] = numbers(line, rest)?;
    Ok(Line::Pose(id, planar(x, y, theta)))
}

fn edge_in_plane(line: usize, words: &[&[u8]], is_toro: bool) -> Result<Line<Pose2>> {
    let ([from, to], rest) = nodes(line, words)?;
    let [x, y, theta, a, b, c, d, e, f] = numbers(line, rest)?;
    let [xx, xy, xt, yy, yt, tt] = if is_toro { [a, b, e, c, f, d] } else { [a, b, c, d, e, f] };
    let information = Matrix3::new(tt, xt, yt, xt, xx, xy, yt, xy, yy);
    require_semidefinite(line, information.symmetric_eigenvalues().as_slice())?;
    Ok(Line::Edge(from, to, planar(x, y, theta), information))
}

fn spatial(line: usize, kind: &[u8], words: &[&[u8]]) -> Result<Pose3> {
    let (x, y, z, rotation) = if kind.ends_with(b"QUAT") {
        let [x, y, z, qx, qy, qz, qw] = numbers(line, words)?;
        let rotation = UnitQuaternion::try_new(Quaternion::new(qw, qx, qy, qz), 1e-8);
        let zero = || Error::line(line, "The quaternion has the length zero", "Write qx qy qz qw of a rotation");
        (x, y, z, rotation.ok_or_else(zero)?)
    } else {
        let [x, y, z, roll, pitch, yaw] = numbers(line, words)?;
        (x, y, z, UnitQuaternion::from_euler_angles(roll, pitch, yaw))
    };
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
}

fn pose_in_space(line: usize, kind: &[u8], words: &[&[u8]]) -> Result<Line<Pose3>> {
    let ([id], rest) = nodes(line, words)?;
    Ok(Line::Pose(id, spatial(line, kind, rest)?))
}

fn edge_in_space(line: usize, kind: &[u8], words: &[&[u8]]) -> Result<Line<Pose3>> {
    let ([from, to], rest) = nodes(line, words)?;
    let num_pose = if kind.ends_with(b"QUAT") { 7 } else { 6 };
    let (pose, upper) = rest.split_at(num_pose.min(rest.len()));
    let pose = spatial(line, kind, pose)?;
    let upper = numbers::<21>(line, upper)?;
    let mut information = Matrix6::zeros();
    let places = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
    for ((row, column), value) in places.zip(upper) {
        // The file has the translation first, the engine the rotation.
        let (i, j) = ((row + 3) % 6, (column + 3) % 6);
        (information[(i, j)], information[(j, i)]) = (value, value);
    }
    require_semidefinite(line, information.symmetric_eigenvalues().as_slice())?;
    Ok(Line::Edge(from, to, pose, information))
}

/// Files hold a few digits: an eigenvalue of zero may be written as a small negative one.
fn require_semidefinite(line: usize, eigenvalues: &[f64]) -> Result<()> {
    let largest = eigenvalues.iter().copied().fold(0.0, f64::max);
    match eigenvalues.iter().copied().fold(f64::INFINITY, f64::min) {
        smallest if smallest >= -1e-6 * largest && largest > 0.0 => Ok(()),
        smallest => Err(Error::line(
            line,
            format!("The information matrix is not positive: its smallest eigenvalue is {smallest:.3e}"),
            "Write its upper triangle row by row, translation first",
        )),
    }
}

impl AnyPoseGraph {
    /// `T_world_node` of each node; the plane is z = 0.
    pub fn poses_in_space(&self) -> Vec<Pose3> {
        match self {
            Self::Plane(graph) => graph.poses.iter().map(Embedding::in_space).collect(),
            Self::Space(graph) => graph.poses.clone(),
        }
    }

    /// The graph as a g2o file.
    pub fn to_g2o(&self) -> String {
        match self {
            Self::Plane(graph) => write_g2o(
                graph,
                "SE2",
                |pose| format!("{} {} {}", pose.translation.x, pose.translation.y, pose.rotation.angle()),
                &[1, 2, 0],
            ),
            Self::Space(graph) => write_g2o(
                graph,
                "SE3:QUAT",
                |pose| {
                    let (t, q) = (pose.translation.vector, pose.rotation.coords);
                    format!("{} {} {} {} {} {} {}", t.x, t.y, t.z, q.x, q.y, q.z, q.w)
                },
                &[3, 4, 5, 0, 1, 2],
            ),
        }
    }
}

/// `order`: the engine's row of each row of the file's information matrices.
fn write_g2o<M: RigidMotion>(graph: &PoseGraph<M>, kind: &str, pose: impl Fn(&M) -> String, order: &[usize]) -> String {
    let mut text = String::new();
    for (id, T_world_node) in graph.ids.iter().zip(&graph.poses) {
        let _ = writeln!(text, "VERTEX_{kind} {id} {}", pose(T_world_node));
    }
    for &node in &graph.fixed {
        let _ = writeln!(text, "FIX {}", graph.ids[node]);
    }
    for edge in &graph.edges {
        let [from, to] = [edge.from, edge.to].map(|node| graph.ids[node]);
        let _ = write!(text, "EDGE_{kind} {from} {to} {}", pose(&edge.T_from_to));
        for row in 0..M::Tangent::LEN {
            for column in row..M::Tangent::LEN {
                let _ = write!(text, " {}", edge.information[(order[row], order[column])]);
            }
        }
        text.push('\n');
    }
    text
}
