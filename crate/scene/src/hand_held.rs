//! The sway, nodding and tremor of a hand-held camera, added to a walk.

use nalgebra::{Isometry3, Vector3};

use super::random::Random;
use scanstitch::geometry::{Pose3, RigidMotion};

/// Standard deviation of the tremor of a frame's position (m), ...
const TREMBLE: f64 = 0.004;
/// ... and of its angle (rad).
const TREMBLE_ANGLE: f64 = 0.009;
/// Swaying: the amplitudes of position (m, along the camera's axes) and of angle (rad, about them), ...
const SWAY: [f64; 3] = [0.05, 0.06, 0.03];
const SWAY_ANGLE: [f64; 3] = [0.22, 0.05, 0.08];
/// ... and its period (frames).
const PERIODS: [f64; 6] = [23.0, 17.0, 31.0, 27.0, 19.0, 37.0];

/// The poses of a level walk with the motion of a hand-held camera, in steps of at most `step` (m) and `turn` (rad) besides the sway;
/// each seed gives another motion.
pub fn hand_held(walk: &[Pose3], step: f64, turn: f64, seed: u64) -> Vec<Pose3> {
    let mut random = Random::new(seed);
    let phases: Vec<f64> = (0..6).map(|_| random.uniform(0.0, std::f64::consts::TAU)).collect();
    let mut swayed = |index: usize| {
        let wave = |axis: usize| libm::sin(std::f64::consts::TAU * index as f64 / PERIODS[axis] + phases[axis]);
        let shift = Vector3::from_fn(|axis, _| SWAY[axis] * wave(axis) + TREMBLE * random.normal());
        let turn = Vector3::from_fn(|axis, _| SWAY_ANGLE[axis] * wave(3 + axis) + TREMBLE_ANGLE * random.normal());
        Isometry3::new(shift, turn)
    };
    let mut dense: Vec<Pose3> = walk.first().copied().into_iter().collect();
    for (from, to) in walk.iter().zip(walk.iter().skip(1)) {
        let motion = from.inverse() * to;
        let num_parts = (motion.translation_norm() / step).max(motion.rotation_angle() / turn).ceil().max(1.0) as usize;
        dense.extend((1..=num_parts).map(|part| from.lerp_slerp(to, part as f64 / num_parts as f64)));
    }
    dense.iter().enumerate().map(|(index, pose)| pose * swayed(index)).collect()
}
