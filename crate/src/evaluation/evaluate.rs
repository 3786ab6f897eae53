//! One estimate against the reference: association, alignment, metric and statistics in one call.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::alignment::{Alignment, align};
use super::associate::{Pair, by_index, by_number, by_time, oddities};
use super::drift::{Drift, drift};
use super::metrics::{PoseRelation, ape, rpe};
use super::motion_agreement::misfit_hint;
use super::pairs::{DeltaUnit, PairOptions};
use super::path::Path;
use super::statistics::Statistics;
use super::trajectory_error::{AlignedError, first_row_hint};
use super::umeyama::{Fit, Similarity};
use crate::geometry::Pose3;
use crate::geometry::rotation::nearest_rotation;
use crate::io::trajectory::Trajectory;
use crate::{Error, Result};

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(rename_all = "snake_case")]
pub enum ErrorMetric {
    /// Absolute pose error.
    #[default]
    Ape,
    /// Relative pose error.
    Rpe,
}

/// How corresponding poses are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(rename_all = "snake_case")]
pub enum Association {
    /// By nearest time where both have times, else by index; by number where the times of one are pose numbers of the other.
    #[default]
    Auto,
    /// By nearest time.
    Time,
    /// By equal index.
    Index,
}

/// How an estimate is compared with the reference. The defaults are those of evo's `evo_ape`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(default, deny_unknown_fields)]
pub struct EvaluationOptions {
    /// How corresponding poses are found.
    pub association: Association,
    /// Largest difference of the times of corresponding poses (s).
    pub max_diff: f64,
    /// Added to the estimate's times (s).
    pub offset: f64,
    /// How the estimate is aligned with the reference before they are compared.
    pub alignment: Alignment,
    /// Number of poses, from the first, that the alignment is fitted to; 0: all.
    pub align_first: usize,
    /// What is measured.
    pub metric: ErrorMetric,
    /// The part of the error pose that is measured.
    pub relation: PoseRelation,
    /// rpe: separation of the two poses of a pair, in `delta_unit`.
    pub delta: f64,
    /// rpe: unit of `delta`.
    pub delta_unit: DeltaUnit,
    /// rpe: whether a pair begins at every pose. Otherwise each pair begins where the last one ended.
    pub all_pairs: bool,
    /// rpe with all pairs: largest deviation of a pair's separation from `delta`, as a share of `delta`.
    pub delta_tolerance: f64,
    /// rpe: whether path and angle are measured along the reference rather than the estimate.
    pub pairs_from_reference: bool,
}

impl Default for EvaluationOptions {
    fn default() -> Self {
        let PairOptions { delta, delta_unit, all_pairs, delta_tolerance, pairs_from_reference } =
            PairOptions::default();
        Self {
            association: Association::Auto,
            max_diff: 0.01,
            offset: 0.0,
            alignment: Alignment::None,
            align_first: 0,
            metric: ErrorMetric::Ape,
            relation: PoseRelation::TranslationPart,
            delta,
            delta_unit,
            all_pairs,
            delta_tolerance,
            pairs_from_reference,
        }
    }
}

/// The similarity that the estimate was mapped by: p -> scale * rotation * p + translation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct AlignmentResult {
    /// The rotation, row by row.
    pub rotation: [[f64; 3]; 3],
    /// m.
    pub translation: [f64; 3],
    /// Without unit.
    pub scale: f64,
}

impl From<&Similarity> for AlignmentResult {
    fn from(similarity: &Similarity) -> Self {
        Self {
            rotation: [0, 1, 2].map(|row| [0, 1, 2].map(|column| similarity.rotation[(row, column)])),
            translation: similarity.translation.into(),
            scale: similarity.scale,
        }
    }
}

/// Statistics of an evaluation.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct EvaluationSummary {
    /// Number of poses of the reference.
    pub num_reference: usize,
    /// Number of poses of the estimate.
    pub num_estimate: usize,
    /// Number of pairs of corresponding poses.
    pub num_matched: usize,
    /// Number of errors: of poses (ape) or pairs of poses (rpe).
    pub num_errors: usize,
    /// Unit of the errors, empty where they have none.
    pub unit: String,
    /// Statistics of the errors.
    pub statistics: Statistics,
    /// Mean distance of the positions after the alignment (m): the homework's mean L2 norm.
    pub mean_l2: f64,
    /// Distances of the positions after an alignment of all positions by a rotation and a translation, independent of
    /// `alignment`; null where the positions do not determine it.
    pub aligned: Option<AlignedError>,
    /// KITTI's drift; null where a path is too short or has no orientations.
    pub drift: Option<Drift>,
    /// How the estimate was aligned.
    pub alignment: AlignmentResult,
    /// Path through the matched poses of the reference (m).
    pub path_length_reference: f64,
    /// Path through the matched poses of the estimate, after the alignment (m).
    pub path_length_estimate: f64,
    /// Remarks about the input, in whole sentences.
    pub notes: Vec<String>,
}

/// An evaluation with its errors and matched poses, for plots.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    /// The statistics.
    pub summary: EvaluationSummary,
    /// The errors, in `summary.unit`.
    pub errors: Vec<f64>,
    /// For each error the index of its pose among the matched ones; for a pair of poses that of the second.
    pub error_poses: Vec<usize>,
    /// The pairs of corresponding poses.
    pub matched: Vec<Pair>,
    /// The matched poses of the reference.
    pub reference: Path,
    /// The matched poses of the estimate, aligned.
    pub estimate: Path,
}

/// Most frames, evenly spread, for which the motions of estimate and reference are compared.
const MAX_MISFIT_FRAMES: usize = 5000;

const ABOUT_A_LINE: &str = "The positions lie on a straight line, so the alignment may be turned about it at will: \
    distances between positions are right, but orientations cannot be compared.";

/// Compares an estimate with the reference.
///
/// # Errors
/// When no poses correspond, the positions do not determine the alignment, the metric needs times or orientations that a
/// trajectory lacks, or an option is out of its range.
pub fn evaluate(reference: &Trajectory, estimate: &Trajectory, options: &EvaluationOptions) -> Result<Evaluation> {
    check(options)?;
    let (matched, notes) = associate(reference, estimate, options)?;
    let reference_path = Path::of(reference, matched.iter().map(|pair| pair.reference));
    let unaligned = Path::of(estimate, matched.iter().map(|pair| pair.estimate));
    let align_first = (options.align_first > 0).then_some(options.align_first);
    let Fit { similarity: alignment, is_about_a_line } =
        align(&reference_path, &unaligned, options.alignment, align_first)?;
    let aligned = if alignment == Similarity::identity() { unaligned } else { unaligned.aligned(&alignment) };

    let (errors, error_poses, without_motion) = errors_of(&reference_path, &aligned, options)?;
    let distances = ape(&reference_path, &aligned, PoseRelation::TranslationPart)?;
    let none = || Error::whole("There is no error to sum up", "Give poses that match");
    let mut summary = EvaluationSummary {
        num_reference: reference.len(),
        num_estimate: estimate.len(),
        num_matched: matched.len(),
        num_errors: errors.len(),
        unit: options.relation.unit().to_owned(),
        statistics: Statistics::of(&errors).ok_or_else(none)?,
        mean_l2: Statistics::of(&distances).ok_or_else(none)?.mean,
        aligned: AlignedError::of_positions(&aligned.positions, &reference_path.positions),
        drift: drift(&reference_path, &aligned).ok(),
        alignment: AlignmentResult::from(&alignment),
        path_length_reference: reference_path.length(),
        path_length_estimate: aligned.length(),
        notes,
    };
    if !summary.statistics.sse.is_finite() {
        return Err(Error::whole("The errors are too large for double precision", "Give the positions in metres"));
    }
    let has_orientations = reference.orientations.is_some() && estimate.orientations.is_some();
    summary.notes.extend(fit_hint(&reference_path, &aligned, has_orientations, options, &distances, summary.aligned));
    if is_about_a_line {
        summary.notes.push(ABOUT_A_LINE.to_owned());
    }
    if without_motion > 0 {
        summary.notes.push(format!("In {without_motion} pairs the reference does not move; they were left out."));
    }
    Ok(Evaluation { summary, errors, error_poses, matched, reference: reference_path, estimate: aligned })
}

/// A note where the reference does not fit the estimate at all, or where its first pose alone causes the error. `distances`:
/// of the aligned positions (m).
fn fit_hint(
    reference: &Path,
    estimate: &Path,
    has_orientations: bool,
    options: &EvaluationOptions,
    distances: &[f64],
    aligned: Option<AlignedError>,
) -> Option<String> {
    let misfit = misfit_hint("Ground truth", &sampled_pairs(estimate, reference), has_orientations);
    if misfit.is_some() || options.alignment != Alignment::Origin || options.metric != ErrorMetric::Ape {
        return misfit;
    }
    let pairs: Vec<_> = estimate.poses().into_iter().zip(reference.poses()).collect();
    first_row_hint("Ground truth", Statistics::of(distances)?.rmse, &aligned?, &pairs)
}

/// Pairs of poses of the estimate and the reference, evenly spread.
fn sampled_pairs(estimate: &Path, reference: &Path) -> Vec<(Pose3, Pose3)> {
    let stride = estimate.len().div_ceil(MAX_MISFIT_FRAMES).max(1);
    (0..estimate.len()).step_by(stride).map(|index| (estimate.pose(index), reference.pose(index))).collect()
}

/// The errors, the index of the pose of each, and the number of pairs without motion.
fn errors_of(reference: &Path, estimate: &Path, options: &EvaluationOptions) -> Result<(Vec<f64>, Vec<usize>, usize)> {
    match options.metric {
        ErrorMetric::Ape => {
            let errors = ape(reference, estimate, options.relation)?;
            let poses = (0..errors.len()).collect();
            Ok((errors, poses, 0))
        }
        ErrorMetric::Rpe => {
            let found = rpe(reference, estimate, options.relation, &pair_options(options))?;
            Ok((found.errors, found.pairs.iter().map(|pair| pair.1).collect(), found.num_without_motion))
        }
    }
}

fn pair_options(options: &EvaluationOptions) -> PairOptions {
    let EvaluationOptions { delta, delta_unit, all_pairs, delta_tolerance, pairs_from_reference, .. } = *options;
    PairOptions { delta, delta_unit, all_pairs, delta_tolerance, pairs_from_reference }
}

fn check(options: &EvaluationOptions) -> Result<()> {
    let at_least_zero = |name: &str, value: f64| {
        if value >= 0.0 && value.is_finite() {
            Ok(())
        } else {
            Err(Error::whole(format!("{name} is {value}"), "Give zero or a positive number"))
        }
    };
    at_least_zero("max_diff", options.max_diff)?;
    at_least_zero("delta", options.delta)?;
    at_least_zero("delta_tolerance", options.delta_tolerance)?;
    if options.offset.is_finite() {
        Ok(())
    } else {
        Err(Error::whole(format!("offset is {}", options.offset), "Give a number of seconds"))
    }
}

fn associate(
    reference: &Trajectory,
    estimate: &Trajectory,
    options: &EvaluationOptions,
) -> Result<(Vec<Pair>, Vec<String>)> {
    let mut notes = Vec::new();
    let stamps = reference.stamps.as_ref().zip(estimate.stamps.as_ref());
    let pairs = match (options.association, stamps) {
        (Association::Auto | Association::Time, Some((of_reference, of_estimate))) => {
            for (whose, stamps) in [("reference", of_reference), ("estimate", of_estimate)] {
                notes.extend(oddities(stamps).map(|oddities| format!("In the {whose}, {oddities}.")));
            }
            let timed = by_time(of_reference, of_estimate, options.max_diff, options.offset);
            let is_poor = timed.as_ref().map_or(0, Vec::len) < reference.len().min(estimate.len()).div_ceil(2);
            let counted = (is_poor && options.association == Association::Auto)
                .then(|| by_number(of_reference, of_estimate))
                .flatten();
            if let Some((whose, pairs)) = counted {
                notes.push(format!("The {whose}'s times count the poses of the other: they were matched by number."));
                pairs
            } else {
                timed?
            }
        }
        (Association::Time, None) => {
            let whose = if reference.stamps.is_none() { "reference" } else { "estimate" };
            let problem = format!("The {whose} has no times to associate by");
            return Err(Error::whole(problem, "Associate by index, or give the times in a file of their own"));
        }
        _ => {
            let pair = |rows: Pair| {
                let reference = reference.index_of_row(rows.reference)?;
                Some(Pair { reference, estimate: estimate.index_of_row(rows.estimate)? })
            };
            by_index(reference.num_rows(), estimate.num_rows())?.into_iter().filter_map(pair).collect()
        }
    };
    let fewer = reference.len().min(estimate.len());
    if pairs.len() < fewer {
        notes.push(format!("Of {fewer} poses, {} have a partner.", pairs.len()));
    }
    Ok((pairs, notes))
}

/// Roll, pitch and yaw of each pose (rad): the rotation is Rz(yaw) Ry(pitch) Rx(roll).
pub fn roll_pitch_yaw(path: &Path) -> Option<Vec<Vector3<f64>>> {
    let angles = |rotation: UnitQuaternion<f64>| {
        let (roll, pitch, yaw) = rotation.euler_angles();
        Vector3::new(roll, pitch, yaw)
    };
    path.rotations.as_ref()?.iter().map(|R| nearest_rotation(R).map(angles)).collect()
}
