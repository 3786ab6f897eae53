//! Iterative closest point: one loop for the plane and for space, for every factor.
//!
//! Besl and McKay, "A method for registration of 3-D shapes", PAMI 1992; reweighting as in Chebrolu et al., "Adaptive robust
//! kernels for non-linear least squares problems", RA-L 2021. The loop has converged when the step is small, not when the
//! error changes little: the error can be constant while the estimate still moves.

use serde::Serialize;

use super::correspondences::CorrespondenceSearch;
pub use super::correspondences::{Rejection, Source, Weighting};
use super::degeneracy::{Observability, observability};
use super::factors::{Correspondence, Factor};
use super::solver::Solver;
use super::target::{LastSearch, Target};
use crate::geometry::{RigidMotion, Vector};
use crate::preprocess::depth_surfels::MIN_NOISE;

/// When the loop ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Criteria {
    /// Most iterations.
    pub max_iterations: usize,
    /// Rotation of a step below which the loop has converged (rad), if its translation is small as well.
    pub rotation_eps: f64,
    /// Translation of a step below which the loop has converged (m), if its rotation is small as well.
    pub translation_eps: f64,
}

/// Options of the loop, which [`register`] takes. The flat
/// [`RegistrationOptions`](super::RegistrationOptions) of [`align()`](super::align()) contain the same values under the
/// same names, and those of the search for an initial guess.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct IcpOptions {
    /// Which pairs are rejected.
    pub rejection: Rejection,
    /// How the others are weighted.
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

/// Record of one iteration.
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
    /// The estimate has returned to an earlier one, because a few points change their partners back and forth.
    Cycle,
    /// The largest number of iterations was reached.
    MaxIterations,
    /// The correspondences determine no step, for example because there are none.
    NoStep,
}

/// A registration with its evidence.
#[derive(Debug, Clone)]
pub struct Registration<M: RigidMotion> {
    /// Maps source points into the target frame.
    pub T_target_source: M,
    /// Whether the last step was below both limits. `false` is not an error: `end_reason` and the history show whether the loop
    /// was cut off or ran in a cycle.
    pub converged: bool,
    /// Why the loop ended.
    pub end_reason: EndReason,
    /// One record per iteration.
    pub history: Vec<IterationRecord>,
    /// The initial guess, and the estimate after each iteration.
    pub trace: Vec<M>,
    /// The correspondences of the last iteration, before its step.
    pub correspondences: Vec<Correspondence<M::Point>>,
    /// Number of inliers divided by the number of source points, 0..=1.
    pub fitness: f64,
    /// The record of the last iteration; zeros when there was none.
    pub last: IterationRecord,
    /// Information matrix of a perturbation on the left of `T_target_source` (rotation first), in 1/rad^2 and 1/m^2:
    /// sum w J^T J divided by the weighted variance of the residuals.
    pub information: M::Matrix,
    /// The direction of motion that the correspondences determine least.
    pub observability: Observability<M>,
}

/// Longest cycle that is recognised (iterations).
const LONGEST_CYCLE: usize = 8;
/// Share of the limits of convergence below which two poses are the same.
const SAME_POSE: f64 = 0.05;

/// Registers `source` to `target` from an initial guess, with all degrees of freedom and undamped steps.
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

/// Registers `source` to `target` from an initial guess by the steps of `solver`.
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

/// The estimates so far.
struct Path<M> {
    /// The current estimate.
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

    /// The resulting registration; `H` is the normal matrix of the last correspondences.
    fn into_registration(
        self,
        H: &M::Matrix,
        correspondences: Vec<Correspondence<M::Point>>,
        num_source_points: usize,
    ) -> Registration<M> {
        // The information matrix would be infinite for a cloud without noise.
        let variance = weighted_variance(&correspondences, M::Tangent::LEN).max(MIN_NOISE * MIN_NOISE);
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

    /// Applies a step to the estimate, and sets `end_reason` if it was the last one.
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

    /// Whether the estimate equals an earlier one, from which the same steps would follow again.
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

/// Root mean square of the residuals (m); 0 without correspondences.
pub(super) fn root_mean_square<P>(correspondences: &[Correspondence<P>]) -> f64 {
    let sum: f64 = correspondences.iter().map(|c| c.residual * c.residual).sum();
    (sum / correspondences.len().max(1) as f64).sqrt()
}

/// Unbiased variance of weighted residuals (m^2) after a fit of this number of unknowns.
fn weighted_variance<P>(correspondences: &[Correspondence<P>], unknowns: usize) -> f64 {
    let weights: f64 = correspondences.iter().map(|c| c.weight).sum();
    let sum: f64 = correspondences.iter().map(|c| c.weight * c.residual * c.residual).sum();
    let freedom = weights - unknowns as f64;
    if freedom > 0.0 { sum / freedom } else { 0.0 }
}
