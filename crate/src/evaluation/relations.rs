//! Errors of relations between poses that are known to be right, loops among them: Kuemmerle et al., "On measuring the
//! accuracy of SLAM algorithms", Autonomous Robots 27 (2009), eq. 5. No frame has to be made common.
//!
//! delta is the motion from pose i to pose j in the estimate, delta* the relation's; the error is delta* ⊖ delta, which is
//! inv(delta*) delta: its translation's norm and its rotation's angle. Cartographer's `compute_relations_metrics` takes
//! delta inv(delta*): the same rotation, and a translation that holds in addition the rotation's error times the length of
//! the relation. Standard deviations are of the population here, of a sample (n - 1) there.

use nalgebra::Vector3;
use serde::Serialize;

use super::path::{Path, angle, relative};
use super::relation_times::{PoseLookup, misfit};
use super::statistics::Statistics;
use crate::io::relations::Relation;
use crate::{Error, Result};

/// A relation whose translation is off by more than this (m) is wrong: another place, not noise.
pub(crate) const WRONG_TRANSLATION: f64 = 0.5;
/// A relation whose rotation is off by more than this (deg) is wrong.
pub(crate) const WRONG_ROTATION_DEG: f64 = 5.0;

/// How far the poses of an estimate are from known relations.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct RelationErrors {
    /// Number of relations in the list.
    pub num_relations: usize,
    /// Number of those whose two poses the estimate has.
    pub num_compared: usize,
    /// Number of those that were left out, because the estimate lacks one of the two poses.
    pub num_left_out: usize,
    /// Poses no further than this (s) from a relation's times are its poses; null where relations name poses by index.
    pub max_diff: Option<f64>,
    /// |trans(delta* - delta)| of each relation (m).
    pub translation: Statistics,
    /// |rot(delta* - delta)| of each relation (rad).
    pub rotation: Statistics,
    /// The mean of the squared translation errors, eq. 5's first term (m^2).
    pub mean_squared_translation: f64,
    /// The mean of the squared rotation errors, eq. 5's second term (rad^2).
    pub mean_squared_rotation: f64,
    /// Number of relations that are off by more than 0.5 m or 5 degrees.
    pub num_wrong: usize,
    /// Their share of the compared relations, 0..=1.
    pub share_wrong: f64,
    /// Translation error of each relation that was compared (m).
    pub translation_errors: Vec<f64>,
    /// Rotation error of each relation that was compared (rad).
    pub rotation_errors: Vec<f64>,
    /// What is worth knowing, in whole sentences: relations that fit no pose, and what would help.
    pub notes: Vec<String>,
}

/// The errors of an estimate. A relation by indices names poses by their place in the estimate, one by times names the
/// poses nearest to them, no further away than `max_diff` (s); [`time_tolerance`](super::relation_times::time_tolerance)
/// gives one that suits the estimate.
///
/// # Errors
/// Without orientations; when relations are by time and the estimate has none, or counts its poses; when none can be
/// compared.
pub fn relation_errors(relations: &[Relation], estimate: &Path, max_diff: f64) -> Result<RelationErrors> {
    let rotations = estimate.rotations.as_ref().ok_or_else(|| {
        Error::whole("Relations compare orientations, and the estimate has positions alone", "Give orientations")
    })?;
    let lookup = PoseLookup::new(estimate, max_diff);
    lookup.check(relations)?;
    let (mut translation_errors, mut rotation_errors) = (Vec::new(), Vec::new());
    for relation in relations {
        let (Some(i), Some(j)) = (lookup.find(relation.from), lookup.find(relation.to)) else { continue };
        let (R, t) = relative((&rotations[i], &estimate.positions[i]), (&rotations[j], &estimate.positions[j]));
        let expected = relation.motion;
        let (R_expected, t_expected): (_, Vector3<f64>) =
            (expected.rotation.to_rotation_matrix().into_inner(), expected.translation.vector);
        let (R_error, t_error) = relative((&R_expected, &t_expected), (&R, &t));
        translation_errors.push(t_error.norm());
        rotation_errors.push(angle(&R_error)?);
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
        max_diff: relations.iter().any(Relation::is_by_time).then_some(max_diff),
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
