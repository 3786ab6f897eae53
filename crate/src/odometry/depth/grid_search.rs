//! A coarse search over all poses on the floor around a view, for frames without a prediction.

use nalgebra::{UnitQuaternion, Vector3};

use super::evidence::score_translated;
use crate::geometry::Pose3;
use crate::registration::prepared_surfels::SurfelCloud;
use crate::registration::projective::ProjectiveTarget;

/// Rotations about the camera's vertical over a full turn. On pairs of frames, three times as many poses and one and a half
/// times as many points found no more, in four times the time.
const NUM_ROTATIONS: u32 = 36;
/// Translations forward, back and to either side, ...
const NUM_TRANSLATIONS: i32 = 10;
/// ... and their spacing (m).
const TRANSLATION_STEP: f64 = 0.4;
/// Number of the best poses that are returned.
const MAX_POSES: usize = 2000;

/// The best poses of the grid around the view with their scores, best first.
pub(super) fn best_poses(view: &ProjectiveTarget, cloud: &SurfelCloud, T_world_view: &Pose3) -> Vec<(f64, Pose3)> {
    let mut scored = Vec::with_capacity(NUM_ROTATIONS as usize * (2 * NUM_TRANSLATIONS as usize + 1).pow(2));
    for index in 0..NUM_ROTATIONS {
        let angle = std::f64::consts::TAU * f64::from(index) / f64::from(NUM_ROTATIONS);
        let rotation = T_world_view.rotation * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
        let R = rotation.to_rotation_matrix().into_inner();
        let points: Vec<_> = cloud.points.iter().map(|point| R * point).collect();
        let normals: Vec<_> = cloud.normals.iter().map(|normal| R * normal).collect();
        let steps = -NUM_TRANSLATIONS..=NUM_TRANSLATIONS;
        for (sideways, forward) in
            steps.clone().flat_map(|sideways| steps.clone().map(move |forward| (sideways, forward)))
        {
            let step = nalgebra::Point3::new(
                f64::from(sideways) * TRANSLATION_STEP,
                0.0,
                f64::from(forward) * TRANSLATION_STEP,
            );
            let position = T_world_view * step;
            let score = score_translated(view, &points, &normals, &position.coords, TRANSLATION_STEP / 2.0);
            scored.push((score, Pose3::from_parts(position.coords.into(), rotation)));
        }
    }
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    scored.truncate(MAX_POSES);
    scored
}
