//! One estimate against the reference: association, alignment, metric and statistics in one call.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::alignment::{Alignment, align};
use super::associate::{Pair, by_index, by_number, by_row, by_time, oddities};
use super::clock_offset::clock_offset;
use super::drift::{Drift, drift, drift_of_numbered};
use super::interpolate::interpolated;
use super::metrics::{PoseRelation, ape, rpe};
use super::motion_agreement::{agreement, reversal};
use super::motion_ratio::ratio_of;
use super::pair_conventions::agreed;
use super::pairs::{DeltaUnit, PairOptions};
use super::path::Path;
use super::remarks::{Advice, freedom, identities, other_unit, time_differences};
use super::statistics::Statistics;
use super::trajectory_error::{AlignedError, first_row_hint};
use super::umeyama::Similarity;
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
    /// By nearest time where both have times, else by index; by number where the times or numbers of one count the poses of
    /// the other.
    #[default]
    Auto,
    /// By nearest time.
    Time,
    /// By equal index.
    Index,
}

/// How the poses of files are read that do not tell the order of the quaternions, the directions of the sensor's axes, whether
/// poses map sensor to world, or the handedness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(rename_all = "snake_case")]
pub enum Conventions {
    /// As the motions of both show, where other conventions than those read fit decisively better; a note says so.
    #[default]
    Detected,
    /// As the format has them.
    AsRead,
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
    /// Whether the trajectory with the shorter interval is interpolated at the times of the other.
    pub interpolate: bool,
    /// How the poses are read.
    pub conventions: Conventions,
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
            interpolate: false,
            conventions: Conventions::Detected,
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
    /// `alignment`; null of fewer than three poses.
    pub aligned: Option<AlignedError>,
    /// KITTI's drift; null where a path is too short or has no orientations.
    pub drift: Option<Drift>,
    /// How the estimate was aligned.
    pub alignment: AlignmentResult,
    /// Path through the matched poses of the reference (m).
    pub path_length_reference: f64,
    /// Path through the matched poses of the estimate, after the alignment (m).
    pub path_length_estimate: f64,
    /// Whether the motions between poses are those of one recording; null where the poses move too little to tell.
    pub motions_agree: Option<bool>,
    /// Remarks about the input, in whole sentences.
    pub notes: Vec<String>,
    /// Options that would change what notes report.
    pub advice: Vec<Advice>,
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
    /// The pairs of corresponding poses; the nearest ones, where poses were interpolated.
    pub matched: Vec<Pair>,
    /// The matched poses of the reference.
    pub reference: Path,
    /// The matched poses of the estimate, aligned.
    pub estimate: Path,
}

/// Most frames, evenly spread, for which the motions of estimate and reference are compared.
const MAX_MISFIT_FRAMES: usize = 5000;

/// Compares an estimate with the reference.
///
/// # Errors
/// When no poses correspond, fewer than three are to be aligned, the metric needs times or orientations that a
/// trajectory lacks, or an option is out of its range.
pub fn evaluate(reference: &Trajectory, estimate: &Trajectory, options: &EvaluationOptions) -> Result<Evaluation> {
    check(options)?;
    let Correspondence { matched, is_by_time, reference: reference_path, estimate: unaligned, notes, advice } =
        corresponding(reference, estimate, options)?;
    let align_first = (options.align_first > 0).then_some(options.align_first);
    let fit = align(&reference_path, &unaligned, options.alignment, align_first)?;
    let alignment = fit.similarity;
    let aligned = if alignment == Similarity::identity() { unaligned } else { unaligned.aligned(&alignment) };

    let (errors, error_poses, without_motion) = errors_of(&reference_path, &aligned, options)?;
    let distances = ape(&reference_path, &aligned, PoseRelation::TranslationPart)?;
    let none = || Error::whole("There is no error to sum up", "Give poses that match");
    let of_positions = Statistics::of(&distances).ok_or_else(none)?;
    let has_orientations = reference_path.rotations.is_some() && aligned.rotations.is_some();
    let poses = |count: usize| sampled_pairs(&aligned, &reference_path, count);
    let (motions_agree, misfit) = agreement("Ground truth", &poses(MAX_MISFIT_FRAMES), has_orientations);
    let numbers: Vec<usize> = matched.iter().map(|pair| pair.reference).collect();
    let drift = if is_by_time {
        drift(&reference_path, &aligned)
    } else {
        drift_of_numbered(&reference_path, &aligned, &numbers)
    };
    let mut summary = EvaluationSummary {
        num_reference: reference.len(),
        num_estimate: estimate.len(),
        num_matched: matched.len(),
        num_errors: errors.len(),
        unit: options.relation.unit().to_owned(),
        statistics: Statistics::of(&errors).ok_or_else(none)?,
        mean_l2: of_positions.mean,
        aligned: AlignedError::of_positions(&aligned.positions, &reference_path.positions),
        drift: drift.ok(),
        alignment: AlignmentResult::from(&alignment),
        path_length_reference: reference_path.length(),
        path_length_estimate: aligned.length(),
        motions_agree,
        notes,
        advice,
    };
    if !summary.statistics.sse.is_finite() {
        return Err(Error::whole("The errors are too large for double precision", "Give the positions in metres"));
    }
    let is_anchored = options.alignment == Alignment::Origin && options.metric == ErrorMetric::Ape;
    let of_first_row = || first_row_hint("Ground truth", of_positions.rmse, &summary.aligned?, &poses(usize::MAX));
    let differ = misfit.is_some() && is_by_time;
    let offset = differ.then(|| offset_between(reference, estimate, options)).flatten();
    summary.notes.extend(
        offset.map(|offset| format!("Both move alike with an offset of {offset:.3} s, added to the estimate's times.")),
    );
    let hint = misfit.or_else(|| is_anchored.then(of_first_row).flatten());
    summary.notes.extend(hint);
    let other_unit = ratio_of(&poses(MAX_MISFIT_FRAMES)).translation.and_then(other_unit);
    summary.advice.extend(other_unit.as_ref().map(|_| Advice::FitScale));
    summary.notes.extend(other_unit);
    summary.notes.extend(identities("reference", reference).or_else(|| identities("estimate", estimate)));
    summary.notes.extend(freedom(&fit, &reference_path, options.alignment, of_positions.rmse));
    if without_motion > 0 {
        summary.notes.push(format!("In {without_motion} pairs the reference does not move; they were left out."));
    }
    Ok(Evaluation { summary, errors, error_poses, matched, reference: reference_path, estimate: aligned })
}

/// Pairs of poses of the estimate and the reference, evenly spread, no more than `most`.
fn sampled_pairs(estimate: &Path, reference: &Path, most: usize) -> Vec<(Pose3, Pose3)> {
    let stride = estimate.len().div_ceil(most).max(1);
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

/// The corresponding poses, in common conventions.
struct Correspondence {
    matched: Vec<Pair>,
    /// Whether they were found by their times.
    is_by_time: bool,
    reference: Path,
    estimate: Path,
    notes: Vec<String>,
    advice: Vec<Advice>,
}

fn corresponding(reference: &Trajectory, estimate: &Trajectory, options: &EvaluationOptions) -> Result<Correspondence> {
    let (mut advice, mut notes) = (Vec::new(), Vec::new());
    let (matched, is_by_time, mut paths) = if options.interpolate {
        let all = |trajectory: &Trajectory| Path::of(trajectory, 0..trajectory.len());
        let found = interpolated(&all(reference), &all(estimate), options.offset)?;
        notes.push(found.note);
        (found.pairs, true, [found.reference, found.estimate])
    } else {
        let (matched, is_by_time) = associate(reference, estimate, options, &mut notes)?;
        if let Some([of_reference, of_estimate]) = stamps_of(reference, estimate).filter(|_| is_by_time) {
            let note = time_differences(&matched, [of_reference, of_estimate], options.offset);
            advice.extend(note.as_ref().map(|_| Advice::Interpolate));
            notes.extend(note);
        }
        let of_reference = Path::of(reference, matched.iter().map(|pair| pair.reference));
        let of_estimate = Path::of(estimate, matched.iter().map(|pair| pair.estimate));
        (matched, is_by_time, [of_reference, of_estimate])
    };
    let has_orientations = paths.iter().all(|path| path.rotations.is_some());
    let compared = sampled_pairs(&paths[1], &paths[0], MAX_MISFIT_FRAMES);
    // Other axes explain a part of what the reverse order explains.
    if options.conventions == Conventions::Detected
        && reversal("", &compared, has_orientations).is_none()
        && let Some(found) = agreed(&paths[0], &paths[1], [reference, estimate])
    {
        advice.push(Advice::ConventionsAsRead);
        notes.extend(found.notes);
        paths = [found.reference, found.estimate];
    }
    let [reference, estimate] = paths;
    Ok(Correspondence { matched, is_by_time, reference, estimate, notes, advice })
}

/// Times of both, where both have times.
fn stamps_of<'a>(reference: &'a Trajectory, estimate: &'a Trajectory) -> Option<[&'a [f64]; 2]> {
    Some([reference.stamps.as_deref()?, estimate.stamps.as_deref()?])
}

/// The pairs of corresponding poses, and whether they were found by their times.
fn associate(
    reference: &Trajectory,
    estimate: &Trajectory,
    options: &EvaluationOptions,
    notes: &mut Vec<String>,
) -> Result<(Vec<Pair>, bool)> {
    let mut is_by_time = false;
    let pairs = match (options.association, stamps_of(reference, estimate)) {
        (Association::Auto | Association::Time, Some([of_reference, of_estimate])) => {
            for (whose, stamps) in [("reference", of_reference), ("estimate", of_estimate)] {
                notes.extend(oddities(stamps).map(|oddities| format!("In the {whose}, {oddities}.")));
            }
            let timed = by_time(of_reference, of_estimate, options.max_diff, options.offset);
            let is_poor = timed.as_ref().map_or(0, Vec::len) < reference.len().min(estimate.len()).div_ceil(2);
            let counted = (is_poor && options.association == Association::Auto)
                .then(|| by_number(of_reference, of_estimate))
                .flatten();
            is_by_time = counted.is_none();
            if let Some((whose, pairs)) = counted {
                notes.push(format!("The {whose}'s times count the poses of the other: they were matched by number."));
                pairs
            } else {
                timed.map_err(|error| with_offset(error, reference, estimate, options))?
            }
        }
        (Association::Time, None) => {
            let whose = if reference.stamps.is_none() { "reference" } else { "estimate" };
            let problem = format!("The {whose} has no times to associate by");
            return Err(Error::whole(problem, "Associate by index, or give the times in a file of their own"));
        }
        (Association::Auto, None) if reference.num_rows() != estimate.num_rows() => {
            let (note, pairs) = by_row(reference, estimate)?;
            notes.push(note);
            pairs
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
    Ok((pairs, is_by_time))
}

/// An error about times, with the offset of the clocks where the motions tell it.
fn with_offset(error: Error, reference: &Trajectory, estimate: &Trajectory, options: &EvaluationOptions) -> Error {
    match offset_between(reference, estimate, options) {
        Some(offset) => Error {
            remedy: format!("Both move alike with an offset of {offset:.3} s, added to the estimate's times"),
            ..error
        },
        None => error,
    }
}

/// The offset (s) to add to the estimate's times, by the motions of both, where it is another than the one that is used.
fn offset_between(reference: &Trajectory, estimate: &Trajectory, options: &EvaluationOptions) -> Option<f64> {
    clock_offset([&reference.positions, &estimate.positions], stamps_of(reference, estimate)?)
        .filter(|offset| (offset - options.offset).abs() > options.max_diff)
}

/// Roll, pitch and yaw of each pose (rad): the rotation is Rz(yaw) Ry(pitch) Rx(roll).
pub fn roll_pitch_yaw(path: &Path) -> Option<Vec<Vector3<f64>>> {
    let angles = |rotation: UnitQuaternion<f64>| {
        let (roll, pitch, yaw) = rotation.euler_angles();
        Vector3::new(roll, pitch, yaw)
    };
    path.rotations.as_ref()?.iter().map(|R| nearest_rotation(R).map(angles)).collect()
}
