//! Poses from relations between them: the sparse pose graph of relative motions.
//!
//! Lu and Milios, "Globally consistent range scan alignment for environment mapping", Autonomous Robots 4 (1997); solved
//! as in Grisetti et al., "A tutorial on graph-based SLAM", ITSM 2 (2010). A relation that may be wrong, a loop, is
//! switchable: its weight falls with its residual (Agarwal et al., "Robust map optimization using dynamic covariance
//! scaling", ICRA 2013, eq. 15), so that a wrong one bends nothing.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Pose2, RigidMotion};
use crate::sparse::{BlockCholesky, BlockMatrix};

/// A measured motion between two nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseRelation {
    /// Node in whose frame `to` was measured.
    pub from: usize,
    /// The node measured.
    pub to: usize,
    /// Pose of `to` in the frame of `from`.
    pub T_from_to: Pose2,
    /// By a perturbation on the left of `T_from_to`, rotation first (1/rad^2, 1/m^2).
    pub information: Matrix3<f64>,
    /// Whether it counts less where it does not fit.
    pub is_switchable: bool,
}

/// A switchable relation keeps its full weight up to this squared Mahalanobis distance: 99 % of right ones in three
/// dimensions lie below 11.3.
const SWITCH_WIDTH: f64 = 11.3;
/// Converged when the largest step is below this (rad, m).
const SMALLEST_STEP: f64 = 1e-5;
/// A step that makes things worse is taken back and damped this many times more.
const DAMPING_FACTOR: f64 = 10.0;

impl PoseRelation {
    /// log(T_from^-1 T_to T_from_to^-1): what these poses of the world make of it, rotation first.
    pub fn residual(&self, T_world_from: &Pose2, T_world_to: &Pose2) -> Vector3<f64> {
        (T_world_from.inverse() * T_world_to * self.T_from_to.inverse()).log()
    }

    /// Squared Mahalanobis distance of the residual.
    pub fn squared_distance(&self, poses: &[Pose2]) -> f64 {
        let residual = self.residual(&poses[self.from], &poses[self.to]);
        residual.dot(&(self.information * residual))
    }

    /// Its weight, 0..=1, at a squared Mahalanobis distance.
    pub fn weight(&self, squared_distance: f64) -> f64 {
        if !self.is_switchable {
            return 1.0;
        }
        (2.0 * SWITCH_WIDTH / (SWITCH_WIDTH + squared_distance)).min(1.0).powi(2)
    }

    /// Its share of the sum that is made small: the loss whose influence has that weight.
    fn loss(&self, squared_distance: f64) -> f64 {
        if !self.is_switchable || squared_distance <= SWITCH_WIDTH {
            return squared_distance;
        }
        // The integral of the weight over the squared distance.
        let whole = 4.0 * SWITCH_WIDTH * SWITCH_WIDTH;
        SWITCH_WIDTH + whole * (1.0 / (2.0 * SWITCH_WIDTH) - 1.0 / (SWITCH_WIDTH + squared_distance))
    }
}

/// Moves the poses (`T_world_node`; the first stays) to where the relations fit best, in at most `max_iterations` steps
/// of Levenberg and Marquardt. Returns the number of steps.
pub fn solve_relations(poses: &mut [Pose2], relations: &[PoseRelation], max_iterations: usize) -> usize {
    let num_variables = poses.len().saturating_sub(1);
    if num_variables == 0 || relations.is_empty() {
        return 0;
    }
    let mut H = BlockMatrix::<3>::new(num_variables);
    let mut b = vec![Vector3::zeros(); num_variables];
    let mut solver: Option<BlockCholesky<3>> = None;
    let mut damping = 1e-6;
    let mut present = total_loss(poses, relations);
    for iteration in 0..max_iterations {
        H.clear();
        b.fill(Vector3::zeros());
        for relation in relations {
            add(relation, poses, &mut H, &mut b);
        }
        for variable in 0..num_variables {
            let diagonal = H.block(variable, variable).diagonal();
            H.add(variable, variable, &Matrix3::from_diagonal(&diagonal.map(|entry| damping * (entry + 1.0))));
        }
        let Ok(factor) = solver.get_or_insert_with(|| BlockCholesky::new(&H)).factor(&H) else {
            damping *= DAMPING_FACTOR;
            continue;
        };
        factor.solve(&mut b);
        let step = |(pose, delta): (&Pose2, &Vector3<f64>)| {
            let mut moved = Pose2::exp(&-delta) * pose;
            moved.rotation.renormalize();
            moved
        };
        let moved: Vec<Pose2> = std::iter::once(poses[0]).chain(poses[1..].iter().zip(&b).map(step)).collect();
        let next = total_loss(&moved, relations);
        if next > present * (1.0 + 1e-12) {
            damping *= DAMPING_FACTOR;
            if damping > 1e6 {
                return iteration + 1;
            }
            continue;
        }
        let step = poses.iter().zip(&moved).map(|(old, new)| {
            let step = old.inverse() * new;
            step.translation_norm().max(step.rotation_angle())
        });
        let largest = step.fold(0.0, f64::max);
        poses.copy_from_slice(&moved);
        present = next;
        damping = (damping / DAMPING_FACTOR).max(1e-9);
        if largest < SMALLEST_STEP {
            return iteration + 1;
        }
    }
    max_iterations
}

fn total_loss(poses: &[Pose2], relations: &[PoseRelation]) -> f64 {
    relations.iter().map(|relation| relation.loss(relation.squared_distance(poses))).sum()
}

/// Perturbing both poses on the left perturbs the residual by Ad(T_from^-1) (d_to - d_from).
fn add(relation: &PoseRelation, poses: &[Pose2], H: &mut BlockMatrix<3>, b: &mut [Vector3<f64>]) {
    let residual = relation.residual(&poses[relation.from], &poses[relation.to]);
    let weighted = relation.information * relation.weight(residual.dot(&(relation.information * residual)));
    let adjoint = poses[relation.from].inverse().adjoint();
    let block = adjoint.tr_mul(&(weighted * adjoint));
    let gradient = adjoint.tr_mul(&(weighted * residual));
    let variable = |node: usize| node.checked_sub(1); // the first pose is none
    for (node, sign) in [(relation.to, 1.0), (relation.from, -1.0)] {
        if let Some(variable) = variable(node) {
            H.add(variable, variable, &block);
            b[variable] += gradient * sign;
        }
    }
    if let (Some(from), Some(to)) = (variable(relation.from), variable(relation.to)) {
        H.add(from, to, &-block);
    }
}
