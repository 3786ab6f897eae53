//! All poses at once: matches between scans that skip frames or close loops, solved jointly.
//!
//! Every edge is a match of a source node with a target node. In each iteration the correspondences of every edge are
//! found anew under the current poses, weighted by the robust kernel, and summed into the normal equations of all poses
//! (Lu and Milios, "Globally consistent range scan alignment for environment mapping", Autonomous Robots 4 (1997), with
//! the correspondences themselves in place of their pairwise summaries, as in Borrmann et al., "Globally consistent 3D
//! mapping with scan matching", RAS 56 (2008)). What a chain adds up in errors, the edges that skip frames take back.

use nalgebra::SVector;

use crate::geometry::{RigidMotion, SquareMatrix, Vector};
use crate::graph::sparse::{BlockCholesky, BlockMatrix};
use crate::registration::factors::{Correspondence, Factor, NormalEquations, RELATIVE_DAMPING};
use crate::registration::icp::{IcpOptions, IterationRecord, Source, match_points};
use crate::registration::target::Target;

/// A scan to place: what it is matched with and what is matched with it.
pub struct Node<'a, P, T> {
    /// Its points as a source.
    pub source: Source<'a, P>,
    /// Its points as a target.
    pub target: &'a T,
}

/// A match: points of node `source` with partners in node `target`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// Index of the node whose points look for partners.
    pub source: usize,
    /// Index of the node they look in.
    pub target: usize,
}

/// A motion between two nodes that is known from elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OdometryFactor<M: RigidMotion> {
    /// Node in whose frame it is.
    pub from: usize,
    /// The other node.
    pub to: usize,
    /// Pose of `to` in the frame of `from`.
    pub T_from_to: M,
    /// By a perturbation on the left, rotation first, in the unit of the matches' normal equations: of residuals in metres.
    pub information: M::Matrix,
}

/// Nodes further apart are no neighbours (m).
const MAX_NEIGHBOR_DISTANCE: f64 = 4.0;

/// Each node with the `matched` before it, and with as many of the nearest among those before these, where a path comes
/// back to a place; both ways. 0 matches all with all. `positions` (m) are the nodes' own.
pub fn edges_between<const D: usize>(positions: &[SVector<f64, D>], matched: usize) -> Vec<Edge> {
    let reach = if matched == 0 { positions.len() } else { matched };
    let mut edges = Vec::new();
    for later in 0..positions.len() {
        let window = later.saturating_sub(reach);
        for earlier in nearest(&positions[..window], &positions[later], matched).into_iter().chain(window..later) {
            edges.push(Edge { source: later, target: earlier });
            edges.push(Edge { source: earlier, target: later });
        }
    }
    edges
}

/// Indices of at most `count` positions, the nearest first.
fn nearest<const D: usize>(positions: &[SVector<f64, D>], to: &SVector<f64, D>, count: usize) -> Vec<usize> {
    let distances = positions.iter().enumerate().map(|(index, position)| ((position - to).norm(), index));
    let mut near: Vec<(f64, usize)> = distances.filter(|(distance, _)| *distance < MAX_NEIGHBOR_DISTANCE).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    near.truncate(count);
    near.into_iter().map(|(_, index)| index).collect()
}

/// The joint solution, one piece of work after the other.
pub struct PoseGraph<M: RigidMotion> {
    poses: Vec<M>,
    edges: Vec<Edge>,
    known: Vec<OdometryFactor<M>>,
    /// The edge to be matched next; from here on they are not in the sums yet.
    next_edge: usize,
    /// Normal equations of all poses but the first, which stays: it is where the world is.
    H: BlockMatrix<M::Matrix>,
    b: Vec<M::Tangent>,
    solver: Option<BlockCholesky<M::Matrix>>,
    num_correspondences: usize,
    num_inliers: usize,
    sq_residuals: f64,
    history: Vec<IterationRecord>,
    converged: bool,
    /// Whether the matches leave the poses undetermined, so that there is no step to take.
    undetermined: bool,
    correspondences: Vec<Correspondence<M::Point>>,
}

impl<M: RigidMotion> PoseGraph<M> {
    /// Starts from `poses` (`T_world_node`, the first of which stays as it is) with these edges between them.
    pub fn new(poses: Vec<M>, edges: Vec<Edge>) -> Self {
        let num_variables = poses.len().saturating_sub(1);
        Self {
            poses,
            edges,
            known: Vec::new(),
            next_edge: 0,
            H: BlockMatrix::new(num_variables),
            b: vec![M::Tangent::zeros(); num_variables],
            solver: None,
            num_correspondences: 0,
            num_inliers: 0,
            sq_residuals: 0.0,
            history: Vec::new(),
            converged: false,
            undetermined: false,
            correspondences: Vec::new(),
        }
    }

    /// The same with motions that are known from elsewhere: they hold where the matches leave something open.
    #[must_use]
    pub(crate) fn with_odometry_factors(mut self, known: Vec<OdometryFactor<M>>) -> Self {
        self.known = known;
        self
    }

    /// The poses as they are now.
    pub fn poses(&self) -> &[M] {
        &self.poses
    }

    /// One record an iteration; its step is the root mean square over all poses. (Of many poses there is always one whose
    /// points change partners to and fro.)
    pub fn history(&self) -> &[IterationRecord] {
        &self.history
    }

    /// Share of the current iteration that is done, as (edges matched, edges in all).
    pub fn progress(&self) -> (usize, usize) {
        (self.next_edge, self.edges.len())
    }

    /// Whether the last step was below both limits.
    pub fn converged(&self) -> bool {
        self.converged
    }

    /// Whether nothing is left to do: converged, out of iterations, or without matches that determine anything.
    pub fn is_done(&self, options: &IcpOptions) -> bool {
        let exhausted = self.history.len() >= options.criteria.max_iterations;
        self.converged || self.undetermined || self.edges.is_empty() || exhausted
    }

    /// Matches edges until about `max_points` source points have been looked at, and takes the step when the iteration
    /// is complete.
    pub fn advance<T: Target<Point = M::Point>, F: Factor<M, T>>(
        &mut self,
        factor: &F,
        nodes: &[Node<'_, M::Point, T>],
        options: &IcpOptions,
        max_points: usize,
    ) {
        let mut looked_at = 0;
        while looked_at < max_points && self.next_edge < self.edges.len() {
            let edge = self.edges[self.next_edge];
            self.add_edge(factor, edge, nodes, options);
            looked_at += nodes[edge.source].source.points.len();
            self.next_edge += 1;
        }
        if self.next_edge == self.edges.len() {
            self.take_step(options);
        }
    }

    /// A match measures T_target_source. Perturbing both poses on the left, exp(d_s) and exp(d_t), perturbs it on the
    /// left by Ad(T_world_target^-1) (d_s - d_t): the edge's normal equations enter with both signs.
    fn add_edge<T: Target<Point = M::Point>, F: Factor<M, T>>(
        &mut self,
        factor: &F,
        edge: Edge,
        nodes: &[Node<'_, M::Point, T>],
        options: &IcpOptions,
    ) {
        let T_target_world = self.poses[edge.target].inverse();
        let T_target_source = T_target_world * self.poses[edge.source];
        let (source, target) = (nodes[edge.source].source, nodes[edge.target].target);
        self.num_correspondences +=
            match_points(source, target, &T_target_source, factor, options, &mut self.correspondences);
        self.num_inliers += self.correspondences.len();
        self.sq_residuals += self.correspondences.iter().map(|c| c.residual * c.residual).sum::<f64>();

        let equations = factor.normal_equations(target, &self.correspondences);
        self.add(edge.target, edge.source, &T_target_world, equations);
    }

    /// Adds the normal equations of the motion from one node to another, `T_from_world` being the first one's pose.
    fn add(&mut self, from: usize, to: usize, T_from_world: &M, NormalEquations { H, b }: NormalEquations<M>) {
        let adjoint = T_from_world.adjoint();
        let H = adjoint.tr_mul(&(H * adjoint));
        let b = adjoint.tr_apply(&b);
        let variable = |node: usize| node.checked_sub(1); // the first pose is none
        for (node, sign) in [(to, 1.0), (from, -1.0)] {
            if let Some(variable) = variable(node) {
                self.H.add(variable, variable, &H);
                self.b[variable] += b * sign;
            }
        }
        if let (Some(to), Some(from)) = (variable(to), variable(from)) {
            self.H.add(to, from, &-H);
        }
    }

    fn add_odometry_factor(&mut self, OdometryFactor { from, to, T_from_to, information }: OdometryFactor<M>) {
        let T_from_world = self.poses[from].inverse();
        let residual = (T_from_world * self.poses[to] * T_from_to.inverse()).log();
        self.add(from, to, &T_from_world, NormalEquations { H: information, b: information.apply(&residual) });
    }

    fn take_step(&mut self, options: &IcpOptions) {
        for known in 0..self.known.len() {
            self.add_odometry_factor(self.known[known]);
        }
        let num_variables = self.b.len();
        let trace: f64 = (0..num_variables).map(|variable| self.H.block(variable, variable).trace()).sum();
        let damping = M::Matrix::identity() * (RELATIVE_DAMPING * trace / num_variables.max(1) as f64);
        for variable in 0..num_variables {
            self.H.add(variable, variable, &damping);
        }
        let (mut sq_rotations, mut sq_translations) = (0.0, 0.0);
        let solver = self.solver.get_or_insert_with(|| BlockCholesky::new(&self.H));
        let factor = solver.factor(&self.H);
        self.undetermined = factor.is_err();
        if let Ok(factor) = factor {
            factor.solve(&mut self.b);
            for (pose, delta) in self.poses.iter_mut().skip(1).zip(&self.b) {
                let moved = M::exp(&-*delta) * *pose;
                let step = pose.inverse() * moved; // of the sensor itself, whatever its distance from the world's origin
                sq_rotations += step.rotation_angle().powi(2);
                sq_translations += step.translation_norm().powi(2);
                *pose = moved;
            }
        }
        let root_mean = |sq_sum: f64| (sq_sum / num_variables.max(1) as f64).sqrt();
        let (rotation_step, translation_step) = (root_mean(sq_rotations), root_mean(sq_translations));
        self.history.push(IterationRecord {
            num_correspondences: self.num_correspondences,
            num_inliers: self.num_inliers,
            inlier_rmse: (self.sq_residuals / self.num_inliers.max(1) as f64).sqrt(),
            rotation_step,
            translation_step,
        });
        let rests =
            rotation_step < options.criteria.rotation_eps && translation_step < options.criteria.translation_eps;
        self.converged = rests && !self.undetermined;
        self.H.clear();
        self.b.fill(M::Tangent::zeros());
        (self.next_edge, self.num_correspondences, self.num_inliers, self.sq_residuals) = (0, 0, 0, 0.0);
    }
}
