//! All places on the floor around a view, coarsely: where a frame may be of which nothing is known.

use nalgebra::{UnitQuaternion, Vector3};

use super::evidence::score_turned;
use crate::geometry::Pose3;
use crate::registration::prepared_surfels::SurfelCloud;
use crate::registration::projective::ProjectiveTarget;

/// Turns about the camera's vertical, the whole way round. On pairs of frames, three times as many places and half as many
/// points again found no more, in four times the time.
const TURNS: u32 = 36;
/// Moves ahead and aside, so many either way ...
const MOVES: i32 = 10;
/// ... and so far apart (m).
const STEP: f64 = 0.4;
/// Points that score a place: there are sixteen thousand.
pub(super) const POINTS: usize = 80;
/// Surfaces agree when they are this near (m): half a step.
const TOLERANCE: f64 = 0.2;
/// So many of the best are worth a second look.
const KEPT: usize = 2000;

/// The best places by what speaks for them, best first: turns and moves of the view.
pub(super) fn best_poses(view: &ProjectiveTarget, cloud: &SurfelCloud, T_world_view: &Pose3) -> Vec<(f64, Pose3)> {
    let mut scored = Vec::with_capacity(TURNS as usize * (2 * MOVES as usize + 1).pow(2));
    for turn in 0..TURNS {
        let angle = std::f64::consts::TAU * f64::from(turn) / f64::from(TURNS);
        let turned = T_world_view.rotation * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
        let R = turned.to_rotation_matrix().into_inner();
        let points: Vec<_> = cloud.points.iter().map(|point| R * point).collect();
        let normals: Vec<_> = cloud.normals.iter().map(|normal| R * normal).collect();
        for (sideways, ahead) in
            (-MOVES..=MOVES).flat_map(|sideways| (-MOVES..=MOVES).map(move |ahead| (sideways, ahead)))
        {
            let moved = T_world_view * nalgebra::Point3::new(f64::from(sideways) * STEP, 0.0, f64::from(ahead) * STEP);
            let score = score_turned(view, &points, &normals, &moved.coords, TOLERANCE);
            scored.push((score, Pose3::from_parts(moved.coords.into(), turned)));
        }
    }
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    scored.truncate(KEPT);
    scored
}
