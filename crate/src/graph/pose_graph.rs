//! The sparse pose graph: least-squares poses from relative measurements, in the plane and in space.
//!
//! Lu and Milios, "Globally consistent range scan alignment for environment mapping", Autonomous Robots 4 (1997); solved
//! as in Grisetti et al., "A tutorial on graph-based SLAM", ITSM 2 (2010). A factor that may be wrong, such as a loop, is
//! switchable: its weight decreases with its residual (Agarwal et al., "Robust map optimization using dynamic covariance
//! scaling", ICRA 2013, eq. 15), so that a wrong one does not distort the solution.

use crate::geometry::mahalanobis;
use crate::geometry::{Pose2, Pose3, RigidMotion, SquareMatrix, Vector};
use crate::graph::sparse::{BlockCholesky, BlockMatrix};
use crate::registration::solver::DAMPING_FACTOR;

/// A factor in the plane.
pub(crate) type PlanarFactor = BetweenFactor<Pose2>;
/// A factor in space.
pub(crate) type SpatialFactor = BetweenFactor<Pose3>;

/// A measured motion between two nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BetweenFactor<M: RigidMotion> {
    /// Node in whose frame `to` was measured.
    pub from: usize,
    /// The measured node.
    pub to: usize,
    /// Pose of `to` in the frame of `from`.
    pub T_from_to: M,
    /// Information of a perturbation on the left of `T_from_to`, rotation first (1/rad^2, 1/m^2).
    pub information: M::Matrix,
    /// Whether its weight decreases with its residual.
    pub is_switchable: bool,
}

/// Squared Mahalanobis distance up to which a switchable factor has its full weight: the 99 % quantile of right ones.
const fn switch_width(degrees_of_freedom: usize) -> f64 {
    if degrees_of_freedom > 3 { 16.8 } else { mahalanobis::ONE_IN_HUNDRED }
}

/// Converged when the largest step is below this (rad, m).
const SMALLEST_STEP: f64 = 1e-5;
/// Most steps of a solution.
const MAX_STEPS: usize = 20;
/// Initial share of its diagonal that is added to the normal matrix.
const INITIAL_DAMPING: f64 = 1e-6;
/// Lower bound of this share.
const MIN_DAMPING: f64 = 1e-9;
/// Upper bound of this share: if even such a step increases the sum, the minimum is reached to within rounding.
const MAX_DAMPING: f64 = 1e6;

impl<M: RigidMotion> BetweenFactor<M> {
    const SWITCH_WIDTH: f64 = switch_width(M::Tangent::LEN);

    /// log(T_from^-1 T_to T_from_to^-1), the difference of the poses from the measurement, rotation first.
    pub(crate) fn residual(&self, T_world_from: &M, T_world_to: &M) -> M::Tangent {
        (T_world_from.inverse() * *T_world_to * self.T_from_to.inverse()).log()
    }

    /// Squared Mahalanobis distance of the residual.
    pub(crate) fn squared_distance(&self, poses: &[M]) -> f64 {
        let residual = self.residual(&poses[self.from], &poses[self.to]);
        residual.dot(&self.information.apply(&residual))
    }

    /// Its weight, 0..=1, at a squared Mahalanobis distance.
    pub(crate) fn weight(&self, squared_distance: f64) -> f64 {
        if !self.is_switchable {
            return 1.0;
        }
        mahalanobis::dynamic_covariance_scaling(squared_distance, Self::SWITCH_WIDTH)
    }

    /// Its term of the sum that is minimised: the loss whose influence function has that weight.
    fn loss(&self, squared_distance: f64) -> f64 {
        if !self.is_switchable || squared_distance <= Self::SWITCH_WIDTH {
            return squared_distance;
        }
        // The integral of the weight over the squared distance.
        let whole = 4.0 * Self::SWITCH_WIDTH * Self::SWITCH_WIDTH;
        Self::SWITCH_WIDTH + whole * (1.0 / (2.0 * Self::SWITCH_WIDTH) - 1.0 / (Self::SWITCH_WIDTH + squared_distance))
    }
}

/// Optimises the poses (`T_world_node`; the first is fixed) for the factors by Levenberg-Marquardt. Returns the number of steps.
pub(crate) fn optimize_poses<M: RigidMotion>(poses: &mut [M], factors: &[BetweenFactor<M>]) -> usize {
    let num_variables = poses.len().saturating_sub(1);
    if num_variables == 0 || factors.is_empty() {
        return 0;
    }
    let mut H = BlockMatrix::<M::Matrix>::new(num_variables);
    let mut b = vec![M::Tangent::zeros(); num_variables];
    let mut solver: Option<BlockCholesky<M::Matrix>> = None;
    let mut damping = INITIAL_DAMPING;
    let mut present = total_loss(poses, factors);
    for iteration in 0..MAX_STEPS {
        fill_normal_equations(&mut H, &mut b, factors, poses, damping);
        let Ok(factored) = solver.get_or_insert_with(|| BlockCholesky::new(&H)).factor(&H) else {
            damping *= DAMPING_FACTOR;
            continue;
        };
        factored.solve(&mut b);
        let moved = moved_by(poses, &b);
        let next = total_loss(&moved, factors);
        if next > present * (1.0 + 1e-12) {
            damping *= DAMPING_FACTOR;
            if damping > MAX_DAMPING {
                return iteration + 1;
            }
            continue;
        }
        let step = largest_step(poses, &moved);
        poses.copy_from_slice(&moved);
        present = next;
        damping = (damping / DAMPING_FACTOR).max(MIN_DAMPING);
        if step < SMALLEST_STEP {
            return iteration + 1;
        }
    }
    MAX_STEPS
}

/// The sum that is minimised: of the squared Mahalanobis distances, less of what is switched off.
pub(crate) fn total_loss<M: RigidMotion>(poses: &[M], factors: &[BetweenFactor<M>]) -> f64 {
    factors.iter().map(|factor| factor.loss(factor.squared_distance(poses))).sum()
}

/// The poses after a step; the first is fixed.
fn moved_by<M: RigidMotion>(poses: &[M], step: &[M::Tangent]) -> Vec<M> {
    let moved = |(pose, delta): (&M, &M::Tangent)| (M::exp(&-*delta) * *pose).renormalized();
    std::iter::once(poses[0]).chain(poses[1..].iter().zip(step).map(moved)).collect()
}

/// The largest motion (m or rad) of a pose.
fn largest_step<M: RigidMotion>(before: &[M], after: &[M]) -> f64 {
    let step = before.iter().zip(after).map(|(old, new)| {
        let step = old.inverse() * *new;
        step.translation_norm().max(step.rotation_angle())
    });
    step.fold(0.0, f64::max)
}

/// H and b of all factors at these poses, with the damping added to the diagonal of H.
fn fill_normal_equations<M: RigidMotion>(
    H: &mut BlockMatrix<M::Matrix>,
    b: &mut [M::Tangent],
    factors: &[BetweenFactor<M>],
    poses: &[M],
    damping: f64,
) {
    H.clear();
    b.fill(M::Tangent::zeros());
    for factor in factors {
        add(factor, poses, H, b);
    }
    for variable in 0..b.len() {
        let mut damped = H.block(variable, variable).diagonal();
        for axis in 0..M::Tangent::LEN {
            damped[axis] = damping * (damped[axis] + 1.0);
        }
        H.add(variable, variable, &M::Matrix::from_diagonal(&damped));
    }
}

/// Perturbing both poses on the left perturbs the residual by Ad(T_from^-1) (d_to - d_from).
fn add<M: RigidMotion>(factor: &BetweenFactor<M>, poses: &[M], H: &mut BlockMatrix<M::Matrix>, b: &mut [M::Tangent]) {
    let residual = factor.residual(&poses[factor.from], &poses[factor.to]);
    let weighted = factor.information * factor.weight(residual.dot(&factor.information.apply(&residual)));
    let adjoint = poses[factor.from].inverse().adjoint();
    let block = adjoint.tr_mul(&(weighted * adjoint));
    let gradient = adjoint.tr_apply(&weighted.apply(&residual));
    H.add_between(factor.from, factor.to, &block);
    for (node, sign) in [(factor.to, 1.0), (factor.from, -1.0)] {
        // The first pose is no variable.
        if let Some(variable) = node.checked_sub(1) {
            b[variable] += gradient * sign;
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix6, Vector6};

    use super::*;

    fn factor(poses: &[Pose3], from: usize, to: usize, off: &Vector6<f64>) -> SpatialFactor {
        let T_from_to = Pose3::exp(off) * poses[from].inverse() * poses[to];
        let information = Matrix6::from_diagonal(&Vector6::new(1e4, 2e4, 1e4, 400.0, 100.0, 900.0));
        BetweenFactor { from, to, T_from_to, information, is_switchable: false }
    }

    fn path() -> Vec<Pose3> {
        let step = Pose3::exp(&Vector6::new(0.02, 0.25, -0.03, 0.1, 0.05, 0.4));
        std::iter::successors(Some(Pose3::identity()), |pose| Some(pose * step)).take(12).collect()
    }

    #[test]
    fn the_gradient_is_that_of_the_loss() {
        let poses = path();
        let of = [factor(&poses, 3, 7, &Vector6::new(1e-4, -2e-4, 1e-4, 2e-3, -1e-3, 1e-3))];
        let (mut H, mut b) = (BlockMatrix::new(poses.len() - 1), vec![Vector6::zeros(); poses.len() - 1]);
        add(&of[0], &poses, &mut H, &mut b);
        for node in [3, 7] {
            for axis in 0..6 {
                let loss = |size: f64| {
                    let mut moved = poses.clone();
                    moved[node] = Pose3::exp(&(Vector6::ith(axis, size))) * moved[node];
                    total_loss(&moved, &of)
                };
                let numeric = (loss(1e-6) - loss(-1e-6)) / 4e-6; // half of it: the loss has no factor 1/2
                let analytic = b[node - 1][axis];
                assert!((numeric - analytic).abs() < 2e-3 * b[node - 1].norm(), "{node} {axis}: {numeric} {analytic}");
            }
        }
    }

    #[test]
    fn a_loop_in_space_spreads_what_a_chain_added_up() {
        let truth = path();
        let drift = Vector6::new(2e-3, 3e-3, -1e-3, 4e-3, 2e-3, -3e-3);
        let mut factors: Vec<SpatialFactor> = (1..truth.len()).map(|to| factor(&truth, to - 1, to, &drift)).collect();
        let mut poses = vec![truth[0]];
        for factor in &factors {
            poses.push(poses[factor.from] * factor.T_from_to);
        }
        let gap = |poses: &[Pose3]| (truth[11].inverse() * poses[11]).translation_norm();
        let before = gap(&poses);
        let sure = factor(&truth, 0, 11, &Vector6::zeros());
        factors.push(BetweenFactor { information: sure.information * 1e4, ..sure });
        let steps = optimize_poses(&mut poses, &factors);
        assert!(steps < MAX_STEPS && gap(&poses) < 0.01 * before, "{steps} steps, {} m of {before} m", gap(&poses));
    }

    #[test]
    fn a_wrong_loop_in_space_bends_nothing() {
        let truth = path();
        let mut factors: Vec<SpatialFactor> =
            (1..truth.len()).map(|to| factor(&truth, to - 1, to, &Vector6::zeros())).collect();
        let wrong = factor(&truth, 0, 11, &Vector6::new(0.0, 1.0, 0.0, 2.0, 0.0, 0.0));
        factors.push(BetweenFactor { is_switchable: true, ..wrong });
        // From elsewhere: at the truth itself any step would be refused.
        let off = Vector6::new(0.01, -0.02, 0.01, 0.05, 0.03, -0.04);
        let mut poses: Vec<Pose3> = truth.iter().map(|pose| Pose3::exp(&off) * pose).collect();
        poses[0] = truth[0];
        optimize_poses(&mut poses, &factors);
        for (pose, truth) in poses.iter().zip(&truth) {
            assert!((truth.inverse() * pose).translation_norm() < 0.02);
        }
    }
}
