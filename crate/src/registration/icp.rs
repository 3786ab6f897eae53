//! Iterative closest point: one loop for the plane and for space, for every factor.
//!
//! Besl and McKay 1992; reweighting as in Chebrolu et al., "Adaptive robust kernels for non-linear least squares
//! problems", RA-L 2021. Converged means that the step is small, not that the error is: an error can stand still while
//! the estimate still slides.

use serde::Serialize;

use super::degeneracy::{Observability, observability};
use super::factors::{Correspondence, Factor};
use super::robust_kernel::RobustKernel;
use super::solver::Solver;
use super::target::{LastSearch, Target};
use crate::geometry::{RigidMotion, Vector};

/// What is registered: points (m) and, where known, unit normals, in the source frame.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a, P> {
    /// Points (m).
    pub points: &'a [P],
    /// One entry a point, for the rejection by normals; `None` where there are no normals at all.
    pub normals: Option<&'a [Option<P>]>,
    /// Standard deviation of each point along its normal (m), where known: uncertain pairs count less.
    pub sigmas: Option<&'a [f64]>,
}

/// When a pair of points is taken for a correspondence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rejection {
    /// Pairs further apart than this are no pairs (m).
    pub max_correspondence_distance: f64,
    /// Pairs whose normals differ by more are rejected, where both are known (rad); pi switches it off.
    pub max_normal_angle: f64,
    /// Share of the correspondences with the largest residuals that is dropped, in [0, 1).
    pub trim_fraction: f64,
}

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

/// How correspondences are weighted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weighting {
    /// Shape of the loss.
    pub robust_kernel: RobustKernel,
    /// Width of the kernel (m).
    pub robust_kernel_width: f64,
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

impl Default for Rejection {
    /// 0.5 m, 45 degrees, nothing is dropped.
    fn default() -> Self {
        Self { max_correspondence_distance: 0.5, max_normal_angle: 45f64.to_radians(), trim_fraction: 0.0 }
    }
}

impl Default for Criteria {
    /// 50 iterations, 0.1 mrad, 0.1 mm.
    fn default() -> Self {
        Self { max_iterations: 50, rotation_eps: 1e-4, translation_eps: 1e-4 }
    }
}

impl Default for Weighting {
    /// Cauchy's kernel, 5 cm wide.
    fn default() -> Self {
        Self { robust_kernel: RobustKernel::Cauchy, robust_kernel_width: 0.05 }
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

/// A pair of points that are known this well (m) is as good as any: what remains is not theirs.
const CERTAIN_SIGMA: f64 = 3e-3;

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
    let mut T_target_source = init_T_target_source.renormalized();
    let mut history: Vec<IterationRecord> = Vec::new();
    let mut correspondences = Vec::with_capacity(source.points.len());
    let mut end_reason = EndReason::MaxIterations;
    let mut trace = vec![T_target_source];
    let mut damping = solver.damping.unwrap_or_default();
    let mut searches = vec![LastSearch::None; source.points.len()];

    while end_reason == EndReason::MaxIterations && history.len() < options.criteria.max_iterations {
        let pairing = Pairing { correspondences: &mut correspondences, searches: &mut searches };
        let num_correspondences = pairing.find(source, target, &T_target_source, factor, options, |_| ());
        let step = solver.step(factor, target, &correspondences, &mut damping);
        let (rotation_step, translation_step) =
            step.map_or((0.0, 0.0), |step| (step.rotation_angle(), step.translation_norm()));
        history.push(IterationRecord {
            num_correspondences,
            num_inliers: correspondences.len(),
            inlier_rmse: root_mean_square(&correspondences),
            rotation_step,
            translation_step,
        });
        let Some(step) = step else {
            trace.push(T_target_source);
            end_reason = EndReason::NoStep;
            break;
        };
        T_target_source = (step * T_target_source).renormalized();
        let Criteria { rotation_eps, translation_eps, .. } = options.criteria;
        // A pose seen before leads to the same steps again: a few points change partners to and fro for ever.
        let is_here = |seen: &M| {
            let away = seen.inverse() * T_target_source;
            away.rotation_angle() < SAME_POSE * rotation_eps && away.translation_norm() < SAME_POSE * translation_eps
        };
        if rotation_step < rotation_eps && translation_step < translation_eps {
            end_reason = EndReason::Converged;
        } else if trace.iter().rev().take(LONGEST_CYCLE).any(is_here) {
            end_reason = EndReason::Cycle;
        }
        trace.push(T_target_source);
    }

    let H = solver.restricted(factor.normal_equations(target, &correspondences)).H;
    let variance = weighted_variance(&correspondences, M::Tangent::LEN).max(MIN_RESIDUAL_SIGMA * MIN_RESIDUAL_SIGMA);
    let last = history.last().copied().unwrap_or_default();
    Registration {
        T_target_source,
        converged: end_reason == EndReason::Converged,
        end_reason,
        history,
        trace,
        fitness: last.num_inliers as f64 / source.points.len().max(1) as f64,
        last,
        information: H / variance,
        observability: observability::<M>(&H, &correspondences),
        correspondences,
    }
}

/// Finds, rejects, trims and weights the correspondences under the estimate `T_target_source`. Returns how many pairs lie within the
/// distance limit.
pub fn match_points<M, T, F>(
    source: Source<'_, M::Point>,
    target: &T,
    T_target_source: &M,
    factor: &F,
    options: &IcpOptions,
    correspondences: &mut Vec<Correspondence<M::Point>>,
) -> usize
where
    M: RigidMotion,
    T: Target<Point = M::Point>,
    F: Factor<M, T>,
{
    let searches = &mut vec![LastSearch::None; source.points.len()];
    Pairing { correspondences, searches }.find(source, target, T_target_source, factor, options, |_| ())
}

/// Why a source point has no say in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum RejectionReason {
    /// No target point lies within the distance limit.
    TooFar = 0,
    /// The normals differ by more than the limit.
    Normals = 1,
    /// The residual is among the largest, which are dropped.
    Trimmed = 2,
    /// The target point cannot measure a residual: it has no normal.
    NoResidual = 3,
}

/// A source point without a say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rejected {
    /// Index of the source point.
    pub source: u32,
    /// Index of the target point nearest to it, where one was within the limit.
    pub target: Option<u32>,
    /// Why.
    pub reason: RejectionReason,
}

/// Where correspondences are found.
pub(super) struct Pairing<'a, P> {
    /// Takes the correspondences; what it held before is dropped.
    pub correspondences: &'a mut Vec<Correspondence<P>>,
    /// What is remembered of the last search for each source point: it makes this one quicker and changes nothing.
    pub searches: &'a mut [LastSearch<P>],
}

impl<P: Vector> Pairing<'_, P> {
    /// As [`match_points`]; `reject` is told of every source point that is left out.
    pub(super) fn find<M, T, F>(
        self,
        source: Source<'_, P>,
        target: &T,
        T_target_source: &M,
        factor: &F,
        options: &IcpOptions,
        mut reject: impl FnMut(Rejected),
    ) -> usize
    where
        M: RigidMotion<Point = P>,
        T: Target<Point = P>,
        F: Factor<M, T>,
    {
        let Self { correspondences, searches } = self;
        let Rejection { max_correspondence_distance, max_normal_angle, trim_fraction } = options.rejection;
        let min_normal_cosine = max_normal_angle.cos();
        let mut num_correspondences = 0;
        correspondences.clear();
        for (index, (point, last)) in source.points.iter().zip(searches).enumerate() {
            let mut leave_out = |target, reason| reject(Rejected { source: index as u32, target, reason });
            let moved = T_target_source.act(point);
            let Some(neighbor) = target.nearest_again(&moved, max_correspondence_distance, last) else {
                leave_out(None, RejectionReason::TooFar);
                continue;
            };
            num_correspondences += 1;
            let normal =
                source.normals.and_then(|normals| normals[index].as_ref()).map(|normal| T_target_source.rotate(normal));
            if let (Some(normal), Some(target_normal)) = (&normal, target.normal(neighbor.index))
                && normal.dot(&target_normal) < min_normal_cosine
            {
                leave_out(Some(neighbor.index), RejectionReason::Normals);
                continue;
            }
            let Some(residual) = factor.residual(target, neighbor.index, &moved, normal.as_ref()) else {
                leave_out(Some(neighbor.index), RejectionReason::NoResidual);
                continue;
            };
            let weight = options.weighting.robust_kernel.weight(residual, options.weighting.robust_kernel_width)
                * source.sigmas.map_or(1.0, |sigmas| precision(sigmas[index], target.sigma(neighbor.index)));
            correspondences.push(Correspondence {
                source: index as u32,
                target: neighbor.index,
                moved,
                normal,
                residual,
                weight,
            });
        }
        trim(correspondences, trim_fraction, |c| {
            reject(Rejected { source: c.source, target: Some(c.target), reason: RejectionReason::Trimmed });
        });
        num_correspondences
    }
}

/// The weight of a pair by the uncertainty of its two sides, 1 where both are certain.
fn precision(source_sigma: f64, target_sigma: f64) -> f64 {
    let variance = source_sigma * source_sigma + target_sigma * target_sigma;
    1.0 / (1.0 + variance / (CERTAIN_SIGMA * CERTAIN_SIGMA))
}

/// Drops the share with the largest residuals (Chetverikov et al., "The trimmed iterative closest point algorithm",
/// ICPR 2002). The order of the others stays.
fn trim<P>(
    correspondences: &mut Vec<Correspondence<P>>,
    trim_fraction: f64,
    mut drop_out: impl FnMut(&Correspondence<P>),
) {
    let keep = ((1.0 - trim_fraction) * correspondences.len() as f64).ceil() as usize;
    if keep == 0 || keep >= correspondences.len() {
        return;
    }
    let mut sizes: Vec<f64> = correspondences.iter().map(|c| c.residual.abs()).collect();
    let (_, &mut limit, _) = sizes.select_nth_unstable_by(keep - 1, f64::total_cmp);
    correspondences.retain(|c| {
        let stays = c.residual.abs() <= limit;
        if !stays {
            drop_out(c);
        }
        stays
    });
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
