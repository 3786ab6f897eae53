//! Iterative closest point: one loop for the plane and for space, for every factor.
//!
//! Besl and McKay 1992; reweighting as in Chebrolu et al., "Adaptive robust kernels for non-linear least squares
//! problems", RA-L 2021. Converged means that the step is small, not that the error is: an error can stand still while
//! the estimate still slides.

use serde::Serialize;

use super::correspondences::CorrespondenceSearch;
pub use super::correspondences::{Rejection, Source, Weighting};
use super::degeneracy::{Observability, observability};
use super::factors::{Correspondence, Factor};
use super::solver::Solver;
use super::target::{LastSearch, Target};
use crate::geometry::{RigidMotion, Vector};

/// When the loop ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Criteria {
    /// Most iterations.
    pub max_iterations: usize,
    /// Converged when the step turns less (rad) ...
    pub rotation_eps: f64,
    /// ... and moves less (m).
    pub translation_eps: f64,
}

/// All options of the loop.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct IcpOptions {
    /// When a pair is a correspondence.
    pub rejection: Rejection,
    /// How much it counts.
    pub weighting: Weighting,
    /// When the loop ends.
    pub criteria: Criteria,
}

impl Default for Criteria {
    /// 50 iterations, 0.1 mrad, 0.1 mm.
    fn default() -> Self {
        Self { max_iterations: 50, rotation_eps: 1e-4, translation_eps: 1e-4 }
    }
}

/// One iteration, for the record.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct IterationRecord {
    /// Pairs within the distance limit.
    pub num_correspondences: usize,
    /// Pairs left after the rejection by normals and the trimming.
    pub num_inliers: usize,
    /// Root mean square of the inliers' residuals before the step (m).
    pub inlier_rmse: f64,
    /// Rotation of the step (rad).
    pub rotation_step: f64,
    /// Translation of the step (m).
    pub translation_step: f64,
}

/// Why the loop ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum EndReason {
    /// The last step was below both limits.
    Converged,
    /// The estimate came back to where it was: a few points change partners to and fro.
    Cycle,
    /// The iterations were used up.
    MaxIterations,
    /// The correspondences fixed no step: there were none, for one.
    NoStep,
}

/// A registration with its evidence.
#[derive(Debug, Clone)]
pub struct Registration<M: RigidMotion> {
    /// Maps source points into the target frame.
    pub T_target_source: M,
    /// Whether the last step was below both limits. `false` is no error: the history shows whether the loop was cut off
    /// on its way or went round in a circle.
    pub converged: bool,
    /// Why the loop ended.
    pub end_reason: EndReason,
    /// One record an iteration.
    pub history: Vec<IterationRecord>,
    /// The first guess, and the estimate after each iteration.
    pub trace: Vec<M>,
    /// The correspondences of the last iteration, before its step.
    pub correspondences: Vec<Correspondence<M::Point>>,
    /// Inliers over source points.
    pub fitness: f64,
    /// The record of the last iteration; zeros when there was none.
    pub last: IterationRecord,
    /// Information matrix, by a perturbation on the left of `T_target_source` (rotation first), in 1/rad^2 and 1/m^2:
    /// sum w J^T J over the residuals' weighted variance.
    pub information: M::Matrix,
    /// Which direction, if any, the correspondences leave undetermined.
    pub observability: Observability<M>,
}

/// Lower bound of the residuals' standard deviation (m) in the information matrix: a noise-free cloud would
/// claim to be known without error.
const MIN_RESIDUAL_SIGMA: f64 = 1e-3;

/// Cycles of the loop that are recognised, in iterations.
const LONGEST_CYCLE: usize = 8;
/// Poses closer than this share of the limits of convergence are the same.
const SAME_POSE: f64 = 0.05;

/// Registers `source` to `target` from a first guess, free to move in every way and by plain steps.
pub fn register<M, T, F>(
    source: Source<'_, M::Point>,
    target: &T,
    init_T_target_source: M,
    factor: &F,
    options: &IcpOptions,
) -> Registration<M>
where
    M: RigidMotion,
    T: Target<Point = M::Point>,
    F: Factor<M, T>,
{
    register_with(source, target, init_T_target_source, factor, options, &Solver::default())
}

/// Registers `source` to `target` from a first guess by the steps of `solver`.
pub fn register_with<M, T, F>(
    source: Source<'_, M::Point>,
    target: &T,
    init_T_target_source: M,
    factor: &F,
    options: &IcpOptions,
    solver: &Solver<M>,
) -> Registration<M>
where
    M: RigidMotion,
    T: Target<Point = M::Point>,
    F: Factor<M, T>,
{
    let search =
        CorrespondenceSearch { source, target, factor, rejection: options.rejection, weighting: options.weighting };
    let mut correspondences = Vec::with_capacity(source.points.len());
    let mut last_searches = vec![LastSearch::None; source.points.len()];
    let mut damping = solver.damping.unwrap_or_default();
    let mut path = Path::starting_at(init_T_target_source.renormalized());

    while path.goes_on(&options.criteria) {
        let num_correspondences = search.find(&path.T_target_source, &mut last_searches, &mut correspondences, |_| ());
        let step = solver.step(factor, target, &correspondences, &mut damping);
        path.record(num_correspondences, &correspondences, step.as_ref());
        path.take(step, &options.criteria);
    }

    let H = solver.restricted(factor.normal_equations(target, &correspondences)).H;
    path.into_registration(&H, correspondences, source.points.len())
}

/// The way of the estimate so far.
struct Path<M> {
    /// Where it has come to.
    T_target_source: M,
    trace: Vec<M>,
    history: Vec<IterationRecord>,
    end_reason: EndReason,
}

impl<M: RigidMotion> Path<M> {
    fn starting_at(T_target_source: M) -> Self {
        Self {
            T_target_source,
            trace: vec![T_target_source],
            history: Vec::new(),
            end_reason: EndReason::MaxIterations,
        }
    }

    fn goes_on(&self, criteria: &Criteria) -> bool {
        self.end_reason == EndReason::MaxIterations && self.history.len() < criteria.max_iterations
    }

    /// The registration it has led to; `H` is the normal matrix of the last correspondences.
    fn into_registration(
        self,
        H: &M::Matrix,
        correspondences: Vec<Correspondence<M::Point>>,
        num_source_points: usize,
    ) -> Registration<M> {
        let variance =
            weighted_variance(&correspondences, M::Tangent::LEN).max(MIN_RESIDUAL_SIGMA * MIN_RESIDUAL_SIGMA);
        let last = self.history.last().copied().unwrap_or_default();
        Registration {
            T_target_source: self.T_target_source,
            converged: self.end_reason == EndReason::Converged,
            end_reason: self.end_reason,
            history: self.history,
            trace: self.trace,
            fitness: last.num_inliers as f64 / num_source_points.max(1) as f64,
            last,
            information: *H / variance,
            observability: observability::<M>(H, &correspondences),
            correspondences,
        }
    }

    fn record(&mut self, num_correspondences: usize, inliers: &[Correspondence<M::Point>], step: Option<&M>) {
        self.history.push(IterationRecord {
            num_correspondences,
            num_inliers: inliers.len(),
            inlier_rmse: root_mean_square(inliers),
            rotation_step: step.map_or(0.0, M::rotation_angle),
            translation_step: step.map_or(0.0, M::translation_norm),
        });
    }

    /// Applies a step to the estimate, and notes whether it was the last one.
    fn take(&mut self, step: Option<M>, criteria: &Criteria) {
        let T_target_source = step.map_or(self.T_target_source, |step| (step * self.T_target_source).renormalized());
        if step.is_none() {
            self.end_reason = EndReason::NoStep;
        } else if step.is_some_and(|step| is_below(&step, criteria, 1.0)) {
            self.end_reason = EndReason::Converged;
        } else if self.has_been_at(&T_target_source, criteria) {
            self.end_reason = EndReason::Cycle;
        }
        self.T_target_source = T_target_source;
        self.trace.push(T_target_source);
    }

    /// Whether the estimate was here before: the same steps follow again, for a few points change partners to and fro for ever.
    fn has_been_at(&self, T_target_source: &M, criteria: &Criteria) -> bool {
        let is_here = |seen: &M| is_below(&(seen.inverse() * *T_target_source), criteria, SAME_POSE);
        self.trace.iter().rev().take(LONGEST_CYCLE).any(is_here)
    }
}

/// Whether a motion is below this share of the limits of convergence.
fn is_below<M: RigidMotion>(motion: &M, criteria: &Criteria, share: f64) -> bool {
    motion.rotation_angle() < share * criteria.rotation_eps
        && motion.translation_norm() < share * criteria.translation_eps
}

fn root_mean_square<P>(correspondences: &[Correspondence<P>]) -> f64 {
    let sum: f64 = correspondences.iter().map(|c| c.residual * c.residual).sum();
    (sum / correspondences.len().max(1) as f64).sqrt()
}

/// Unbiased variance of weighted residuals (m^2), `unknowns` of them being used up by the fit.
fn weighted_variance<P>(correspondences: &[Correspondence<P>], unknowns: usize) -> f64 {
    let weights: f64 = correspondences.iter().map(|c| c.weight).sum();
    let sum: f64 = correspondences.iter().map(|c| c.weight * c.residual * c.residual).sum();
    let freedom = weights - unknowns as f64;
    if freedom > 0.0 { sum / freedom } else { 0.0 }
}
