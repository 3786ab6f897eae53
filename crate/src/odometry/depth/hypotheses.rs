//! Pose hypotheses: initial poses around a prediction, and the choice of the best distinct ones.

use std::ops::RangeInclusive;

use nalgebra::{Isometry3, Vector3};

use super::evidence::MIN_AGREEMENT_DIFFERENCE;
use super::prediction_gate::MAX_STEP;
use crate::geometry::Pose3;
use crate::map::keyframes::KEYFRAME_SPACING;

/// Translation (m) up to which two hypotheses converge to the same pose, as from one keyframe to the next; few repetitive structures
/// have a period as short; ...
pub(super) const CONVERGING_DISTANCE: f64 = KEYFRAME_SPACING;
/// ... and rotation (rad).
const SAME_HYPOTHESIS_ROTATION: f64 = 0.1;
/// Support subtracted per metre and radian beyond the reach of the search all around.
const PENALTY_PER_METRE_BEYOND_SEARCH: f64 = 0.2;
/// Spacing of the grids of translations (m).
pub(super) const GRID_STEP: f64 = 0.25;
/// Distance (m) from which a position is another one, and spacing of the search anywhere: registration leads from a nearer one to the
/// same.
pub(crate) const MIN_DISTANCE: f64 = GRID_STEP + GRID_STEP;
/// Translations of the search all around, forward, back and to either side (m), ...
pub(super) const REACH_ALL_AROUND: f64 = 1.0;
/// ... and of the search anywhere: all around the end of a largest step.
pub(super) const REACH_ANYWHERE: f64 = MAX_STEP + REACH_ALL_AROUND;
/// Distance up to which two poses are the same (m, two metres per radian).
pub(super) const SAME_POSE_DISTANCE: f64 = 0.05;

/// The last pose, a constant-velocity prediction, rotations about the camera's vertical by up to 30 degrees and translations
/// by up to 0.75 m forward and back and 0.25 m to either side.
pub(super) fn near_prediction(T_world_last: &Pose3, last_motion: &Pose3) -> Vec<Pose3> {
    let mut hypotheses = vec![*T_world_last, T_world_last * last_motion];
    hypotheses.extend(grid_around(T_world_last, -6..=6, 5.0, [0.75, 0.25], GRID_STEP));
    hypotheses
}

/// A grid of poses around a pose: rotations about the camera's vertical by multiples of `rotation_step` (degrees), translations
/// by multiples of `step` (m), this far forward and back, and to either side (m).
pub(super) fn grid_around(
    T_world_camera: &Pose3,
    rotations: RangeInclusive<i32>,
    rotation_step: f64,
    reach: [f64; 2],
    step: f64,
) -> impl Iterator<Item = Pose3> {
    let T = *T_world_camera;
    let [all_forward, all_sideways] = reach.map(|reach| steps_within(reach, step));
    rotations.flat_map(move |rotation| {
        let all_sideways = all_sideways.clone();
        all_forward.clone().flat_map(move |forward| {
            all_sideways.clone().map(move |sideways| {
                let translation = Vector3::new(f64::from(sideways), 0.0, f64::from(forward)) * step;
                T * Isometry3::new(translation, Vector3::y() * (f64::from(rotation) * rotation_step.to_radians()))
            })
        })
    })
}

/// Multiples of a `step` as far as `reach` to either side.
pub(super) fn steps_within(reach: f64, step: f64) -> RangeInclusive<i32> {
    let num_steps = (reach / step).ceil() as i32;
    -num_steps..=num_steps
}

/// A pose translated along a direction (unit vector in the world) by a distance (m).
pub(super) fn translated(T_world_camera: &Pose3, direction: &Vector3<f64>, distance: f64) -> Pose3 {
    let offset = direction * distance;
    Pose3::translation(offset.x, offset.y, offset.z) * T_world_camera
}

/// Support to subtract for the motion from the last pose: of two poses with equal evidence the nearer one is more likely. A metre or a
/// radian counts as much as the least difference in agreement.
pub(super) fn motion_penalty(T_world_last: &Pose3, T_world_camera: &Pose3) -> f64 {
    let motion = T_world_last.inverse() * T_world_camera;
    let extent = motion.translation.vector.norm() + motion.rotation.angle();
    MIN_AGREEMENT_DIFFERENCE * extent + PENALTY_PER_METRE_BEYOND_SEARCH * (extent - REACH_ALL_AROUND).max(0.0)
}

/// The poses with the highest scores, at most `max_count`, each distinct from those before it.
pub(super) fn best_distinct(scored: Vec<(f64, Pose3)>, max_count: usize) -> Vec<Pose3> {
    best_apart(scored, max_count, |pose, other| {
        let between = other.inverse() * pose;
        between.translation.vector.norm() > CONVERGING_DISTANCE || between.rotation.angle() > SAME_HYPOTHESIS_ROTATION
    })
}

/// The same where this says which two are distinct.
pub(super) fn best_apart(
    mut scored: Vec<(f64, Pose3)>,
    max_count: usize,
    is_apart: impl Fn(&Pose3, &Pose3) -> bool,
) -> Vec<Pose3> {
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut best: Vec<Pose3> = Vec::with_capacity(max_count);
    for (_, pose) in scored {
        if best.len() < max_count && best.iter().all(|other| is_apart(&pose, other)) {
            best.push(pose);
        }
    }
    best
}
