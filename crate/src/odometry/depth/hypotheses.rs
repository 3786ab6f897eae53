//! Where a frame may be: poses to start from, and which of them are worth more work.

use nalgebra::{Isometry3, Vector3};

use crate::geometry::Pose3;
use crate::geometry::rotation::angle_of;

/// Guesses nearer to each other than this (m) ...
const SAME_GUESS_TRANSLATION: f64 = 0.3;
/// ... and this (rad) end in the same place.
const SAME_GUESS_ROTATION: f64 = 0.1;
/// Taken off the support for every metre, and for every radian, from where the last frame was.
const FAR_AWAY: f64 = 0.01;
/// As far (m, and rad added) as guesses near the last frame go ...
const SEARCH_REACH: f64 = 1.3;
/// ... and what is taken off for what is beyond.
const BEYOND_SEARCH: f64 = 0.2;

/// The last pose, the last motion once more, turns about the camera's vertical by up to 30 degrees and moves of up to
/// three quarters of a metre ahead and a quarter aside.
pub(super) fn near(T_world_last: &Pose3, last_motion: &Pose3) -> Vec<Pose3> {
    let mut hypotheses = vec![*T_world_last, T_world_last * last_motion];
    hypotheses.extend(grid_around(T_world_last, -6..=6, 5f64.to_radians(), 3, 1));
    hypotheses
}

/// The same by coarser turns and without moves aside.
pub(super) fn few(T_world_last: &Pose3, last_motion: &Pose3) -> Vec<Pose3> {
    let mut hypotheses = vec![*T_world_last, T_world_last * last_motion];
    hypotheses.extend(grid_around(T_world_last, -4..=4, 7.5f64.to_radians(), 2, 0));
    hypotheses
}

/// Poses around a pose: turns about the camera's vertical by multiples of `turn` (rad), moves by multiples of a quarter of
/// a metre, up to `ahead` of them ahead and back and up to `sideways` of them to either side.
pub(crate) fn grid_around(
    T_world_camera: &Pose3,
    turns: std::ops::RangeInclusive<i32>,
    turn: f64,
    ahead: i32,
    sideways: i32,
) -> impl Iterator<Item = Pose3> {
    const STEP: f64 = 0.25;
    let T = *T_world_camera;
    turns.flat_map(move |turns| {
        (-ahead..=ahead).flat_map(move |ahead| {
            (-sideways..=sideways).map(move |sideways| {
                let translation = Vector3::new(f64::from(sideways) * STEP, 0.0, f64::from(ahead) * STEP);
                T * Isometry3::new(translation, Vector3::y() * (f64::from(turns) * turn))
            })
        })
    })
}

/// What a long way takes off the support: of two places that look the same, the nearer one is the likelier.
pub(super) fn motion_penalty(T_world_last: &Pose3, T_world_camera: &Pose3) -> f64 {
    let moved = T_world_last.inverse() * T_world_camera;
    let far = moved.translation.vector.norm() + angle_of(&moved.rotation);
    FAR_AWAY * far + BEYOND_SEARCH * (far - SEARCH_REACH).max(0.0)
}

/// The best poses by their score, each apart from the ones before it.
pub(crate) fn best_distinct(mut scored: Vec<(f64, Pose3)>, most: usize) -> Vec<Pose3> {
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut best: Vec<Pose3> = Vec::with_capacity(most);
    for (_, pose) in scored {
        let is_new = best.iter().all(|other| {
            let apart = other.inverse() * pose;
            apart.translation.vector.norm() > SAME_GUESS_TRANSLATION || apart.rotation.angle() > SAME_GUESS_ROTATION
        });
        if is_new {
            best.push(pose);
            if best.len() == most {
                break;
            }
        }
    }
    best
}
