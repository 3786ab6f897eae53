//! All poses at once: matches between scans that skip frames or close loops, solved jointly.
//!
//! Every edge is a match of a source node with a target node. In each iteration the correspondences of every edge are
//! found anew under the current poses, weighted by the robust kernel, and summed into the normal equations of all poses
//! (Lu and Milios, "Globally consistent range scan alignment for environment mapping", Autonomous Robots 4 (1997), with
//! the correspondences themselves in place of their pairwise summaries, as in Borrmann et al., "Globally consistent 3D
//! mapping with scan matching", RAS 56 (2008)). What a chain adds up in errors, the edges that skip frames take back.

use nalgebra::{DMatrix, DVector};

use crate::geometry::RigidMotion;
use crate::registration::factors::{Correspondence, Metric, NormalEquations, RELATIVE_DAMPING};
use crate::registration::icp::{IcpOptions, IterationRecord, Source, match_points};

/// A scan to place: what it is matched with and what is matched with it.
pub struct Node<'a, const D: usize, T> {
    /// Its points as a source.
    pub source: Source<'a, D>,
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

/// Each node with the `matched` before it, in both directions; 0 means all.
pub fn window_edges(num_nodes: usize, matched: usize) -> Vec<Edge> {
    let reach = if matched == 0 { num_nodes } else { matched };
    let mut edges = Vec::new();
    for later in 0..num_nodes {
        for earlier in later.saturating_sub(reach)..later {
            edges.push(Edge { source: later, target: earlier });
            edges.push(Edge { source: earlier, target: later });
        }
    }
    edges
}

/// The joint solution, one piece of work after the other.
pub struct PoseGraph<const D: usize, const DOF: usize, M> {
    poses: Vec<M>,
    edges: Vec<Edge>,
    /// The edge to be matched next; from here on they are not in the sums yet.
    next_edge: usize,
    H: DMatrix<f64>,
    b: DVector<f64>,
    num_correspondences: usize,
    num_inliers: usize,
    sq_residuals: f64,
    history: Vec<IterationRecord>,
    converged: bool,
    correspondences: Vec<Correspondence<D>>,
}

impl<const D: usize, const DOF: usize, M: RigidMotion<D, DOF>> PoseGraph<D, DOF, M> {
    /// Starts from `poses` (`T_world_node`, the first of which stays as it is) with these edges between them.
    pub fn new(poses: Vec<M>, edges: Vec<Edge>) -> Self {
        let unknowns = DOF * poses.len();
        Self {
            poses,
            edges,
            next_edge: 0,
            H: DMatrix::zeros(unknowns, unknowns),
            b: DVector::zeros(unknowns),
            num_correspondences: 0,
            num_inliers: 0,
            sq_residuals: 0.0,
            history: Vec::new(),
            converged: false,
            correspondences: Vec::new(),
        }
    }

    /// The poses as they are now.
    pub fn poses(&self) -> &[M] {
        &self.poses
    }

    /// One record an iteration; its step is the largest of all poses.
    pub fn history(&self) -> &[IterationRecord] {
        &self.history
    }

    /// Share of the current iteration that is done, as (edges matched, edges in all).
    pub fn progress(&self) -> (usize, usize) {
        (self.next_edge, self.edges.len())
    }

    /// Whether nothing is left to do: converged, out of iterations, or without edges.
    pub fn is_done(&self, options: &IcpOptions) -> bool {
        self.converged || self.edges.is_empty() || self.history.len() >= options.criteria.max_iterations
    }

    /// Matches edges until about `max_points` source points have been looked at, and takes the step when the iteration
    /// is complete.
    pub fn advance<F: Metric<D, DOF, M>>(
        &mut self,
        nodes: &[Node<'_, D, F::Target>],
        options: &IcpOptions,
        max_points: usize,
    ) {
        let mut looked_at = 0;
        while looked_at < max_points && self.next_edge < self.edges.len() {
            let edge = self.edges[self.next_edge];
            self.add_edge::<F>(edge, nodes, options);
            looked_at += nodes[edge.source].source.points.len();
            self.next_edge += 1;
        }
        if self.next_edge == self.edges.len() {
            self.take_step(options);
        }
    }

    /// A match measures T_target_source. Perturbing both poses on the left, exp(d_s) and exp(d_t), perturbs it on the
    /// left by Ad(T_world_target^-1) (d_s - d_t): the edge's normal equations enter with both signs.
    fn add_edge<F: Metric<D, DOF, M>>(&mut self, edge: Edge, nodes: &[Node<'_, D, F::Target>], options: &IcpOptions) {
        let T_target_world = self.poses[edge.target].inverse();
        let T_target_source = T_target_world * self.poses[edge.source];
        let (source, target) = (nodes[edge.source].source, nodes[edge.target].target);
        self.num_correspondences +=
            match_points::<D, DOF, M, F>(source, target, &T_target_source, options, &mut self.correspondences);
        self.num_inliers += self.correspondences.len();
        self.sq_residuals += self.correspondences.iter().map(|c| c.residual * c.residual).sum::<f64>();

        let NormalEquations { H, b } = F::normal_equations(target, &self.correspondences);
        let adjoint = T_target_world.adjoint();
        let H = adjoint.tr_mul(&(H * adjoint));
        let b = adjoint.tr_mul(&b);
        let (s, t) = (DOF * edge.source, DOF * edge.target);
        for (row, column, sign) in [(s, s, 1.0), (t, t, 1.0), (s, t, -1.0), (t, s, -1.0)] {
            let mut block = self.H.fixed_view_mut::<DOF, DOF>(row, column);
            block += H * sign;
        }
        for (row, sign) in [(s, 1.0), (t, -1.0)] {
            let mut block = self.b.fixed_rows_mut::<DOF>(row);
            block += b * sign;
        }
    }

    fn take_step(&mut self, options: &IcpOptions) {
        let damping = RELATIVE_DAMPING * self.H.trace();
        for unknown in 0..self.H.nrows() {
            // The first pose stays: it is where the world is.
            self.H[(unknown, unknown)] += if unknown < DOF { f64::MAX.sqrt() } else { damping };
        }
        let (mut rotation_step, mut translation_step) = (0.0f64, 0.0f64);
        let factor = std::mem::take(&mut self.H).cholesky();
        if let Some(factor) = &factor {
            let delta = factor.solve(&self.b);
            for (node, pose) in self.poses.iter_mut().enumerate().skip(1) {
                let moved = M::exp(&-delta.fixed_rows::<DOF>(DOF * node).into_owned()) * *pose;
                let step = pose.inverse() * moved; // of the sensor itself, whatever its distance from the world's origin
                rotation_step = rotation_step.max(step.rotation_angle());
                translation_step = translation_step.max(step.translation_norm());
                *pose = moved;
            }
        }
        self.history.push(IterationRecord {
            num_correspondences: self.num_correspondences,
            num_inliers: self.num_inliers,
            inlier_rmse: (self.sq_residuals / self.num_inliers.max(1) as f64).sqrt(),
            rotation_step,
            translation_step,
        });
        self.converged =
            rotation_step < options.criteria.rotation_eps && translation_step < options.criteria.translation_eps;
        let unknowns = DOF * self.poses.len();
        self.H = DMatrix::zeros(unknowns, unknowns);
        self.b = DVector::zeros(unknowns);
        (self.next_edge, self.num_correspondences, self.num_inliers, self.sq_residuals) = (0, 0, 0, 0.0);
    }
}
