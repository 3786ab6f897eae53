//! A coarse search over all poses on the floor around a view, for frames without a prediction.

use nalgebra::{Isometry3, Vector3};

use super::evidence::score_within;
use crate::geometry::Pose3;
use crate::registration::projective::{PointBatch, ProjectiveTarget};

/// Rotations about the camera's vertical over a full turn. On pairs of frames, three times as many poses and one and a half
/// times as many points found no more, in four times the time.
const NUM_ROTATIONS: u32 = 36;
/// Translations forward, back and to either side, ...
const NUM_TRANSLATIONS: i32 = 10;
/// ... and their spacing (m).
const TRANSLATION_STEP: f64 = 0.4;

/// The poses of the grid around the view with their scores.
pub(super) fn scored_poses(
    view: &ProjectiveTarget,
    point_batch: &PointBatch,
    T_world_view: &Pose3,
) -> Vec<(f64, Pose3)> {
    let mut scored = Vec::with_capacity(NUM_ROTATIONS as usize * (2 * NUM_TRANSLATIONS as usize + 1).pow(2));
    let steps = -NUM_TRANSLATIONS..=NUM_TRANSLATIONS;
    for index in 0..NUM_ROTATIONS {
        let rotation = Vector3::y() * (std::f64::consts::TAU * f64::from(index) / f64::from(NUM_ROTATIONS));
        for (sideways, forward) in
            steps.clone().flat_map(|sideways| steps.clone().map(move |forward| (sideways, forward)))
        {
            let translation = Vector3::new(f64::from(sideways), 0.0, f64::from(forward)) * TRANSLATION_STEP;
            let pose = T_world_view * Isometry3::new(translation, rotation);
            scored.push((score_within(view, point_batch, &pose, TRANSLATION_STEP / 2.0), pose));
        }
    }
    scored
}
