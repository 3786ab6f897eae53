//! Errors against given relations between poses, loops among them: Kuemmerle et al., "On measuring the accuracy of SLAM
//! algorithms", Autonomous Robots 27 (2009), eq. 5. The metric needs no alignment.
//!
//! With delta the motion from pose i to pose j in the estimate and delta* that of the relation, the error is delta* ⊖ delta =
//! inv(delta*) delta: the norm of its translation and the angle of its rotation. Cartographer's `compute_relations_metrics`
//! uses delta inv(delta*) instead: the same angle, and a translation that also contains the rotation error times the length of
//! the relation. Standard deviations are those of the population here, of a sample (n - 1) there.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use super::interpolate::pose_at;
use super::path::{Path, angle, relative};
use super::relation_times::{PoseLookup, misfit};
use super::statistics::Statistics;
use crate::geometry::Pose3;
use crate::io::relations::Relation;
use crate::{Error, Result};

/// Translation error (m) beyond which a relation is counted as wrong: the estimate is at another place, not merely noisy.
pub const WRONG_TRANSLATION: f64 = 0.5;
/// Rotation error (deg) beyond which a relation is counted as wrong.
pub const WRONG_ROTATION_DEG: f64 = 5.0;

/// Errors of an estimate against given relations.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct RelationErrors {
    /// Number of relations in the list.
    pub num_relations: usize,
    /// Number of relations whose two poses the estimate has.
    pub num_compared: usize,
    /// Number of relations left out because the estimate lacks one of the two poses.
    pub num_left_out: usize,
    /// Largest difference between a relation's time and its pose's (s); null where relations name poses by index.
    pub max_diff: Option<f64>,
    /// |trans(delta* - delta)| of each relation (m).
    pub translation: Statistics,
    /// |rot(delta* - delta)| of each relation (rad).
    pub rotation: Statistics,
    /// The mean of the squared translation errors, eq. 5's first term (m^2).
    pub mean_squared_translation: f64,
    /// The mean of the squared rotation errors, eq. 5's second term (rad^2).
    pub mean_squared_rotation: f64,
    /// Number of relations with an error of more than 0.5 m or 5 degrees.
    pub num_wrong: usize,
    /// Their share of the compared relations, 0..=1.
    pub share_wrong: f64,
    /// Translation error of each relation that was compared (m).
    pub translation_errors: Vec<f64>,
    /// Rotation error of each relation that was compared (rad).
    pub rotation_errors: Vec<f64>,
    /// Remarks in whole sentences: relations that fit no pose, and the remedy.
    pub notes: Vec<String>,
}

/// The errors of an estimate. A relation by indices refers to the poses of these indices in the estimate, one by times to the
/// poses at these times, interpolated where the nearest is within `max_diff` (s), for which [`time_tolerance`](super::relation_times::time_tolerance) gives a value
/// that suits the estimate.
///
/// # Errors
/// When the estimate has no orientations; when relations are by time and the estimate has no times, or pose numbers for
/// times; when no relation can be compared.
pub fn relation_errors(relations: &[Relation], estimate: &Path, max_diff: f64) -> Result<RelationErrors> {
    if estimate.rotations.is_none() {
        let problem = "Relations compare orientations, and the estimate has positions alone";
        return Err(Error::whole(problem, "Give orientations"));
    }
    let lookup = PoseLookup::new(estimate, max_diff);
    lookup.check(relations)?;
    let (mut translation_errors, mut rotation_errors) = (Vec::new(), Vec::new());
    for relation in relations {
        let pose = |key| lookup.find(key).and_then(|place| pose_at(estimate, place));
        let (Some((R_i, p_i)), Some((R_j, p_j))) = (pose(relation.from), pose(relation.to)) else { continue };
        let motion = relative((&R_i, &p_i), (&R_j, &p_j));
        let (translation, rotation) = error_of(&relation.motion, &motion)?;
        translation_errors.push(translation);
        rotation_errors.push(rotation);
    }
    let num_compared = translation_errors.len();
    let misfit = misfit(relations, estimate, max_diff, num_compared);
    let statistics = Statistics::of(&translation_errors).zip(Statistics::of(&rotation_errors));
    let (translation, rotation) = statistics.ok_or_else(|| match &misfit {
        Some((problem, remedy)) => Error::whole(problem, remedy),
        None => Error::whole("There is no relation to compare", "Give relations, loops among them"),
    })?;
    let is_wrong = |(&translation, rotation): (&f64, &f64)| {
        translation > WRONG_TRANSLATION || rotation.to_degrees() > WRONG_ROTATION_DEG
    };
    let num_wrong = translation_errors.iter().zip(&rotation_errors).filter(|&errors| is_wrong(errors)).count();
    let n = num_compared as f64;
    Ok(RelationErrors {
        num_relations: relations.len(),
        num_compared,
        num_left_out: relations.len() - num_compared,
        max_diff: relations.iter().any(|relation| relation.times().is_some()).then_some(max_diff),
        mean_squared_translation: translation.sse / n,
        mean_squared_rotation: rotation.sse / n,
        translation,
        rotation,
        num_wrong,
        share_wrong: num_wrong as f64 / n,
        translation_errors,
        rotation_errors,
        notes: misfit.into_iter().map(|(problem, remedy)| format!("{problem}. {remedy}.")).collect(),
    })
}

/// Norm of the translation (m) and angle of the rotation (rad) of inv(expected) motion.
fn error_of(expected: &Pose3, (R, t): &(Matrix3<f64>, Vector3<f64>)) -> Result<(f64, f64)> {
    let R_expected = expected.rotation.to_rotation_matrix().into_inner();
    let (R_error, t_error) = relative((&R_expected, &expected.translation.vector), (R, t));
    Ok((t_error.norm(), angle(&R_error)?))
}
