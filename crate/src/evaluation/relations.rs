//! Errors of relations between poses that are known to be right, loops among them: Kuemmerle et al., "On measuring the
//! accuracy of SLAM algorithms", Autonomous Robots 27 (2009), eq. 5. No frame has to be made common.

use nalgebra::Vector3;
use serde::Serialize;

use super::metrics::{angle, relative};
use super::path::Path;
use super::statistics::Statistics;
use crate::io::relations::{Place, Relation};
use crate::{Error, Result};

/// How far the poses of an estimate are from known relations.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct RelationErrors {
    /// Number of relations in the list.
    pub num_relations: usize,
    /// Number of those whose two poses the estimate has.
    pub num_compared: usize,
    /// |trans(delta* - delta)| of each relation (m).
    pub translation: Statistics,
    /// |rot(delta* - delta)| of each relation (rad).
    pub rotation: Statistics,
    /// The mean of the squared translation errors, eq. 5's first term (m^2).
    pub mean_squared_translation: f64,
    /// The mean of the squared rotation errors, eq. 5's second term (rad^2).
    pub mean_squared_rotation: f64,
    /// Translation error of each relation that was compared (m).
    pub translation_errors: Vec<f64>,
    /// Rotation error of each relation that was compared (rad).
    pub rotation_errors: Vec<f64>,
}

/// The errors of an estimate. A relation by indices names poses by their place in the estimate, one by times names the
/// poses nearest to them, no further away than `max_diff` (s).
///
/// # Errors
/// Without orientations; when relations are by time and the estimate has none; when none can be compared.
pub fn relation_errors(relations: &[Relation], estimate: &Path, max_diff: f64) -> Result<RelationErrors> {
    let rotations = estimate.rotations.as_ref().ok_or_else(|| {
        Error::whole("Relations compare orientations, and the estimate has positions alone", "Give orientations")
    })?;
    let mut order: Vec<usize> = (0..estimate.len()).collect();
    if let Some(stamps) = &estimate.stamps {
        order.sort_by(|&a, &b| stamps[a].total_cmp(&stamps[b]));
    }
    let find = |place: Place| match place {
        Place::Index(index) => (index < estimate.len()).then_some(index),
        Place::Time(time) => {
            let stamps = estimate.stamps.as_ref()?;
            let after = order.partition_point(|&index| stamps[index] < time);
            let candidates = order[after.saturating_sub(1)..].iter().take(2);
            let off = |index: usize| (stamps[index] - time).abs();
            let nearest = candidates.copied().min_by(|&a, &b| off(a).total_cmp(&off(b)))?;
            (off(nearest) <= max_diff).then_some(nearest)
        }
    };
    let (mut translation_errors, mut rotation_errors) = (Vec::new(), Vec::new());
    for relation in relations {
        let (Some(i), Some(j)) = (find(relation.from), find(relation.to)) else { continue };
        let (R, t) = relative((&rotations[i], &estimate.positions[i]), (&rotations[j], &estimate.positions[j]));
        let expected = relation.motion;
        let (R_expected, t_expected): (_, Vector3<f64>) =
            (expected.rotation.to_rotation_matrix().into_inner(), expected.translation.vector);
        let (R_error, t_error) = relative((&R_expected, &t_expected), (&R, &t));
        translation_errors.push(t_error.norm());
        rotation_errors.push(angle(&R_error)?);
    }
    let statistics = Statistics::of(&translation_errors).zip(Statistics::of(&rotation_errors));
    let (translation, rotation) = statistics.ok_or_else(|| {
        let problem = format!("The estimate has the poses of none of the {} relations", relations.len());
        Error::whole(problem, "Both have to count or time the poses in the same way")
    })?;
    let n = translation_errors.len() as f64;
    Ok(RelationErrors {
        num_relations: relations.len(),
        num_compared: translation_errors.len(),
        mean_squared_translation: translation.sse / n,
        mean_squared_rotation: rotation.sse / n,
        translation,
        rotation,
        translation_errors,
        rotation_errors,
    })
}
