//! One iteration of the loop as plain data: its pairs, its equations, and what they determine.

use serde::Serialize;

use super::motion::LabMotion;
use crate::error::Result;
use crate::geometry::{SquareMatrix, Vector};
use crate::registration::degeneracy::{Directions, UNDETERMINED_SHARE};
use crate::registration::icp::root_mean_square;
use crate::registration::problem::{IcpProblem, Iteration};

/// The figures of one iteration. Tangent vectors and matrices are over (theta, x, y) for planar clouds and over
/// (wx, wy, wz, x, y, z) otherwise: perturbations on the left of `T_target_source`, relative to the target's `origin`.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct IterationSummary {
    /// The pose at which the pairs were found: 4 x 4, row by row.
    pub T_target_source: [f64; 16],
    /// The pose after the step: 4 x 4, row by row; the same pose where there is no step.
    pub T_next: [f64; 16],
    /// Mean robust loss of a source point at `T_target_source` (m^2), as in `cost_landscape`; NaN where there is no pair.
    pub cost: f64,
    /// Pairs within the distance limit.
    pub num_correspondences: usize,
    /// Pairs left after the rejection by normals and the trimming.
    pub num_inliers: usize,
    /// Source points that were used: all, or every `stride`-th one.
    pub num_points: usize,
    /// `num_inliers` divided by `num_points`, 0..=1.
    pub fitness: f64,
    /// Root mean square of the inliers' residuals (m).
    pub inlier_rmse: f64,
    /// Sum of w J^T J over the inliers, row by row (1, m and m^2 by the unknowns).
    pub H: Vec<f64>,
    /// Sum of w J^T r over the inliers.
    pub b: Vec<f64>,
    /// Logarithm of the step: for Gauss-Newton the solution of H x = -b. Null where the pairs do not determine a step.
    pub x: Option<Vec<f64>>,
    /// Rotation of the step (rad).
    pub rotation_step: f64,
    /// Translation of the step (m).
    pub translation_step: f64,
    /// What the pairs determine; null where they have no weight.
    pub degeneracy: Option<Degeneracy>,
}

/// How well the pairs determine each direction of motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Degeneracy {
    /// Weighted mean of the moved source points (m), relative to the target's `origin`: the centre of the directions' rotations.
    pub center: [f64; 3],
    /// Their rms distance from it (m): a rotation (rad) times this is measured in metres.
    pub radius: f64,
    /// Share of the pairs that measure each direction, 0..=1, ascending: the eigenvalues of the normalised H.
    pub shares: Vec<f64>,
    /// Unit directions, one after the other, in the order of `shares`: rotation first, in metres at `radius`.
    pub directions: Vec<f64>,
    /// Share below which a direction is undetermined.
    pub undetermined_below: f64,
}

/// An iteration with its pairs.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct TracedIteration {
    /// Its numbers.
    pub summary: IterationSummary,
    /// Indices of the source points of the pairs.
    pub source: Vec<u32>,
    /// Indices of their partners.
    pub target: Vec<u32>,
    /// Residuals (m).
    pub residual: Vec<f64>,
    /// Weights, 0..=1.
    pub weight: Vec<f64>,
    /// Contribution of each pair to the smallest of the `shares`, which is their sum.
    pub contribution: Vec<f64>,
    /// Indices of source points that were left out.
    pub rejected_source: Vec<u32>,
    /// Their nearest target points; 2^32 - 1 where none is within the distance limit.
    pub rejected_target: Vec<u32>,
    /// 0: no target point within the limit; 1: normals; 2: trimmed; 3: the target point has no normal.
    pub rejected_reason: Vec<u8>,
}

impl TracedIteration {
    pub(crate) fn of<M: LabMotion>(
        iteration: &Iteration<M>,
        problem: &dyn IcpProblem<M>,
        to_absolute: &impl Fn(&M) -> Result<[f64; 16]>,
    ) -> Result<Self> {
        let (pairs, rejected) = (&iteration.correspondences, &iteration.rejected);
        let directions = Directions::<M>::of(&iteration.equations.H, pairs);
        let contribution = directions.as_ref().map_or_else(Vec::new, |directions| {
            let of_pair = |pair| directions.contribution(&problem.normal_equations(&[pair]).H, &directions.pairs[0].1);
            pairs.iter().copied().map(of_pair).collect()
        });
        Ok(Self {
            summary: summary(iteration, directions.as_ref(), to_absolute)?,
            source: pairs.iter().map(|pair| pair.source).collect(),
            target: pairs.iter().map(|pair| pair.target).collect(),
            residual: pairs.iter().map(|pair| pair.residual).collect(),
            weight: pairs.iter().map(|pair| pair.weight).collect(),
            contribution,
            rejected_source: rejected.iter().map(|left_out| left_out.source).collect(),
            rejected_target: rejected.iter().map(|left_out| left_out.target.unwrap_or(u32::MAX)).collect(),
            rejected_reason: rejected.iter().map(|left_out| left_out.reason as u8).collect(),
        })
    }
}

fn summary<M: LabMotion>(
    iteration: &Iteration<M>,
    directions: Option<&Directions<M>>,
    to_absolute: &impl Fn(&M) -> Result<[f64; 16]>,
) -> Result<IterationSummary> {
    let Iteration { T_target_source, step, correspondences, equations, .. } = iteration;
    let num_inliers = correspondences.len();
    Ok(IterationSummary {
        T_target_source: to_absolute(T_target_source)?,
        T_next: to_absolute(&step.map_or(*T_target_source, |step| (step * *T_target_source).renormalized()))?,
        cost: iteration.cost,
        num_correspondences: iteration.num_correspondences,
        num_inliers,
        num_points: iteration.num_points,
        fitness: num_inliers as f64 / iteration.num_points.max(1) as f64,
        inlier_rmse: root_mean_square(correspondences),
        H: equations.H.as_slice().to_vec(), // symmetric: rows are columns
        b: equations.b.as_slice().to_vec(),
        x: step.map(|step| step.log().as_slice().to_vec()),
        rotation_step: step.map_or(0.0, |step| step.rotation_angle()),
        translation_step: step.map_or(0.0, |step| step.translation_norm()),
        degeneracy: directions.map(|directions| Degeneracy {
            center: M::xyz(&directions.center),
            radius: directions.radius,
            shares: directions.pairs.iter().map(|(share, _)| share.clamp(0.0, 1.0)).collect(),
            directions: directions.pairs.iter().flat_map(|(_, direction)| direction.as_slice().to_vec()).collect(),
            undetermined_below: UNDETERMINED_SHARE,
        }),
    })
}
