//! Optimises the pose graph of a file: the poses with the smallest sum of squared Mahalanobis distances of its edges.
//!
//! Levenberg-Marquardt on the manifold (Grisetti et al., "A tutorial on graph-based SLAM", ITSM 2, 2010) with the exact derivatives
//! of the residuals, so that the minimum is that of the sum itself. A residual is the logarithm of
//! `T_from_to^-1 T_from^-1 T_to`, as in GTSAM's `BetweenFactor`.
//!
//! A local search from poses with much drift may end in another minimum than the lowest, as from those in the file of the MIT graph:
//! 770 in place of 41. [`chordal`] finds a start that does not depend on the poses in the file.
//!
//! Chi squared of MIT, intel, manhattan, smallGrid3D, sphere2500 and tinyGrid3D from their own poses is GTSAM's to nine digits
//! (`tests/native/pose_graphs.rs`).

use nalgebra::{Matrix2, Matrix3, Matrix6, Vector3, Vector6};
use serde::Serialize;

use crate::geometry::connected_parts::connected_parts;
use crate::geometry::{Pose2, Pose3, RigidMotion, SquareMatrix, Vector};
use crate::graph::sparse::{BlockCholesky, BlockMatrix};
use crate::io::pose_graph::{Edge, PoseGraph};
use crate::registration::solver::DAMPING_FACTOR;

pub mod chordal;
pub mod report;

/// Converged when a step decreases the sum by less than this share of it, which is near the rounding of a sum of thousands of terms.
const MIN_DECREASE: f64 = 1e-12;
/// Share of the mean diagonal that is added to the normal matrix at first.
const INITIAL_DAMPING: f64 = 1e-9;
/// Bounds of this share: below it changes nothing; where even a step this short increases the sum, the minimum is reached to within
/// rounding.
const DAMPING: std::ops::RangeInclusive<f64> = 1e-15..=1e6;

/// How a local search ended.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Optimization {
    /// Sum of the squared Mahalanobis distances of all edges at the start.
    pub initial_chi_squared: f64,
    /// The same at the end.
    pub chi_squared: f64,
    /// Number of steps, those that were refused among them.
    pub num_iterations: usize,
    /// Whether the sum no longer decreased.
    pub converged: bool,
}

/// A group whose graphs files hold.
pub trait GraphMotion: RigidMotion {
    /// The residual of a motion that should be the identity, rotation first.
    fn residual(&self) -> Self::Tangent {
        self.log()
    }

    /// The residual with its derivative with respect to a perturbation on the right.
    fn residual_and_jacobian(&self) -> (Self::Tangent, Self::Matrix);
}

impl GraphMotion for Pose2 {
    /// The translation of the logarithm is `V^-1 t` (Sola, Deray and Atchuthan, eqs. 157 and 158), with `h` and half the angle as the
    /// entries of `V^-1`. A perturbed angle changes `V^-1`, a perturbed translation changes `t` by itself, rotated.
    fn residual_and_jacobian(&self) -> (Vector3<f64>, Matrix3<f64>) {
        let residual = self.log();
        let (theta, t, R) = (residual[0], self.translation.vector, self.rotation.to_rotation_matrix());
        let (h, dh) = if theta.abs() < SMALL_ANGLE {
            (1.0 - theta * theta / 12.0, -theta / 6.0 - theta.powi(3) / 180.0)
        } else {
            let (sin, cos) = (0.5 * theta).sin_cos();
            (0.5 * theta * cos / sin, 0.5 * cos / sin - 0.25 * theta / (sin * sin))
        };
        let moved = Matrix2::new(h, 0.5 * theta, -0.5 * theta, h) * R.matrix();
        let turned = [dh * t.x + 0.5 * t.y, dh * t.y - 0.5 * t.x];
        let jacobian = Matrix3::new(1.0, 0.0, 0.0, turned[0], moved.m11, moved.m12, turned[1], moved.m21, moved.m22);
        (residual, jacobian)
    }
}

impl GraphMotion for Pose3 {
    /// The inverse right Jacobian: that on the left at the negative tangent (Sola, Deray and Atchuthan, eqs. 76 and 179).
    fn residual_and_jacobian(&self) -> (Vector6<f64>, Matrix6<f64>) {
        let residual = self.log();
        let tau = -residual;
        let (omega, rho) = (tau.fixed_rows::<3>(0).into_owned(), tau.fixed_rows::<3>(3).into_owned());
        let inverse = inverse_left_jacobian(&omega);
        let mut jacobian = Matrix6::zeros();
        jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&inverse);
        jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(&inverse);
        jacobian.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-inverse * coupling(&omega, &rho) * inverse));
        (residual, jacobian)
    }
}

/// Angle (rad) below which the series of the coefficients, to their second term, are more accurate than the quotients.
const SMALL_ANGLE: f64 = 1e-2;

/// Of SO(3), eq. 146.
fn inverse_left_jacobian(omega: &Vector3<f64>) -> Matrix3<f64> {
    let (theta, W) = (omega.norm(), omega.cross_matrix());
    let c = if theta < SMALL_ANGLE {
        1.0 / 12.0 + theta * theta / 720.0
    } else {
        1.0 / (theta * theta) - 1.0 / (2.0 * theta * (theta / 2.0).tan())
    };
    Matrix3::identity() - W * 0.5 + W * W * c
}

/// Q of the left Jacobian of SE(3), eq. 180.
fn coupling(omega: &Vector3<f64>, rho: &Vector3<f64>) -> Matrix3<f64> {
    let (W, V, theta) = (omega.cross_matrix(), rho.cross_matrix(), omega.norm());
    let (sin, cos, sq) = (theta.sin(), theta.cos(), theta * theta);
    let [a, b, c] = if theta < SMALL_ANGLE {
        [1.0 / 6.0 - sq / 120.0, 1.0 / 24.0 - sq / 720.0, 1.0 / 120.0 - sq / 2520.0]
    } else {
        [
            (theta - sin) / theta.powi(3),
            (sq + 2.0 * cos - 2.0) / (2.0 * sq * sq),
            (2.0 * theta - 3.0 * sin + theta * cos) / (2.0 * theta.powi(5)),
        ]
    };
    let WVW = W * V * W;
    V * 0.5 + (W * V + V * W + WVW) * a + (W * W * V + V * W * W - WVW * 3.0) * b + (WVW * W + W * WVW) * c
}

/// Squared Mahalanobis distance of an edge at these poses.
pub fn squared_distance<M: GraphMotion>(edge: &Edge<M>, poses: &[M]) -> f64 {
    let residual = (edge.T_from_to.inverse() * poses[edge.from].inverse() * poses[edge.to]).residual();
    residual.dot(&edge.information.apply(&residual))
}

/// Sum of the squared Mahalanobis distances of all edges.
pub fn chi_squared<M: GraphMotion>(graph: &PoseGraph<M>) -> f64 {
    graph.edges.iter().map(|edge| squared_distance(edge, &graph.poses)).sum()
}

/// Optimises the poses of a graph from where they are, in at most `max_iterations` steps. In every part that hangs together the nodes
/// which the file fixes stay where they are; where there are none, its first.
pub fn optimize<M: GraphMotion>(graph: &mut PoseGraph<M>, max_iterations: usize) -> Optimization {
    let variables = Variables::of(graph);
    let initial_chi_squared = chi_squared(graph);
    let mut state = Optimization {
        initial_chi_squared,
        chi_squared: initial_chi_squared,
        num_iterations: 0,
        converged: variables.count == 0,
    };
    let mut H = BlockMatrix::<M::Matrix>::new(variables.count);
    let mut solver = None;
    let mut damping = INITIAL_DAMPING;
    while !state.converged && state.num_iterations < max_iterations {
        state.num_iterations += 1;
        let mut step = fill(&mut H, graph, &variables, damping);
        let solver = solver.get_or_insert_with(|| BlockCholesky::new(&H));
        let before = graph.poses.clone();
        let solved = solver.factor(&H).map(|factor| factor.solve(&mut step)).is_ok();
        if solved {
            variables.moved(&mut graph.poses, &step);
        }
        let next = chi_squared(graph);
        if solved && next < state.chi_squared {
            state.converged = state.chi_squared - next < MIN_DECREASE * state.chi_squared;
            state.chi_squared = next;
            damping = (damping / DAMPING_FACTOR).max(*DAMPING.start());
        } else {
            graph.poses = before;
            damping *= DAMPING_FACTOR;
            state.converged = damping > *DAMPING.end();
        }
    }
    state
}

/// Which nodes are variables of the normal equations.
struct Variables {
    /// For each node its variable, or `None` where it is fixed.
    of_node: Vec<Option<usize>>,
    count: usize,
}

impl Variables {
    fn of<M: RigidMotion>(graph: &PoseGraph<M>) -> Self {
        let mut is_fixed = vec![false; graph.poses.len()];
        for &node in &graph.fixed {
            is_fixed[node] = true;
        }
        let parts = parts(graph);
        let mut is_anchored = vec![false; graph.poses.len()];
        for &node in &graph.fixed {
            is_anchored[parts[node]] = true;
        }
        let mut count = 0;
        let of_node = (0..graph.poses.len()).map(|node| {
            // A part is named after its first node.
            let stays = is_fixed[node] || (parts[node] == node && !is_anchored[node]);
            let variable = count;
            count += usize::from(!stays);
            (!stays).then_some(variable)
        });
        Self { of_node: of_node.collect(), count }
    }

    /// Moves the poses by the negative of a step.
    fn moved<M: RigidMotion>(&self, poses: &mut [M], step: &[M::Tangent]) {
        for (pose, variable) in poses.iter_mut().zip(&self.of_node) {
            if let Some(variable) = variable {
                *pose = (*pose * M::exp(&-step[*variable])).renormalized();
            }
        }
    }
}

/// For each node the first node of the part that it hangs together with.
pub fn parts<M: RigidMotion>(graph: &PoseGraph<M>) -> Vec<usize> {
    connected_parts(graph.poses.len(), graph.edges.iter().map(|edge| [edge.from, edge.to]))
}

/// Fills the normal matrix with its damping; returns the gradient.
fn fill<M: GraphMotion>(
    H: &mut BlockMatrix<M::Matrix>,
    graph: &PoseGraph<M>,
    variables: &Variables,
    damping: f64,
) -> Vec<M::Tangent> {
    H.clear();
    let mut b = vec![M::Tangent::zeros(); variables.count];
    for edge in &graph.edges {
        add(edge, &graph.poses, variables, H, &mut b);
    }
    for variable in 0..variables.count {
        let damped = H.block(variable, variable).diagonal() * damping;
        H.add(variable, variable, &M::Matrix::from_diagonal(&damped));
    }
    b
}

/// Perturbing `to` on the right perturbs `T_from^-1 T_to` on the right; perturbing `from` does so by the negative adjoint of its
/// inverse.
fn add<M: GraphMotion>(
    edge: &Edge<M>,
    poses: &[M],
    variables: &Variables,
    H: &mut BlockMatrix<M::Matrix>,
    b: &mut [M::Tangent],
) {
    let T_from_to = poses[edge.from].inverse() * poses[edge.to];
    let off = edge.T_from_to.inverse() * T_from_to;
    let (residual, J_to) = off.residual_and_jacobian();
    let J_from = -product(&J_to, &T_from_to.inverse().adjoint());
    let weighted = edge.information.apply(&residual);
    let ends = [(edge.from, J_from), (edge.to, J_to)].map(|(node, J)| (variables.of_node[node], J));
    for (variable, J) in ends {
        let Some(variable) = variable else { continue };
        b[variable] += J.tr_apply(&weighted);
        H.add(variable, variable, &product(&J.transpose(), &product(&edge.information, &J)));
    }
    if let [(Some(from), J_from), (Some(to), J_to)] = ends {
        H.add(from, to, &product(&J_from.transpose(), &product(&edge.information, &J_to)));
    }
}

/// `a b`: nalgebra multiplies matrices of six rows by code for large ones, which takes several times as long.
fn product<B: SquareMatrix>(a: &B, b: &B) -> B {
    let mut negative = B::zeros();
    negative.subtract_product(a, &b.transpose());
    -negative
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_jacobian<M: GraphMotion>(motion: &M) {
        for axis in 0..M::Tangent::LEN {
            let moved = |size: f64| {
                let mut step = M::Tangent::zeros();
                step[axis] = size;
                (*motion * M::exp(&step)).residual()
            };
            let numeric = (moved(1e-6) - moved(-1e-6)) / 2e-6;
            let off = (motion.residual_and_jacobian().1.column(axis) - numeric).norm();
            assert!(off < 1e-8, "column {axis} at {motion:?}: off by {off}");
        }
    }

    #[test]
    fn derivatives_of_residuals_are_the_numeric_ones() {
        for scale in [0.0, 1e-4, 9e-3, 1.1e-2, 0.4, 1.0, 2.0] {
            check_jacobian(&Pose2::exp(&(Vector3::new(0.8, -1.2, 2.0) * scale)));
            check_jacobian(&Pose3::exp(&(Vector6::new(0.5, -0.7, 0.9, 1.0, 2.0, -0.5) * scale)));
        }
    }
}
