//! How the camera has moved so far: what it does again where nothing in view tells.
//!
//! Robots take steps that are all alike, hands move much as they did a moment before. No such rule is built in: motions of
//! the recording itself that agree with the new one in all that surfaces do tell say what it was along the rest, and how
//! they differ there says how well that is known (Nadaraya, "On estimating regression", 1964).

use std::collections::VecDeque;

use nalgebra::{Vector3, Vector6};

use crate::geometry::Pose3;

/// So many motions are remembered, the latest.
const MOST: usize = 64;
/// Motions that differ by about this (m, radians counted as metres) are alike.
const ALIKE: f64 = 0.03;
/// Motions that are as alike as this many that are the same make a habit.
const LEAST_WEIGHT: f64 = 0.5;

/// The latest motions from one frame to the next whose places were certain, in the camera's frame.
#[derive(Clone, Default)]
pub(super) struct MotionPrior {
    motions: VecDeque<Vector6<f64>>,
}

/// What is to be expected of a motion along a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PredictedMotion {
    /// How far it goes (m).
    pub(super) along: f64,
    /// How well that is known (m^2).
    pub(super) variance: f64,
}

impl MotionPrior {
    pub(super) fn push(&mut self, motion: &Pose3) {
        if self.motions.len() == MOST {
            self.motions.pop_front();
        }
        self.motions.push_back(twist(motion));
    }

    /// What motions that are like this one in all but how far they go along a `direction` (unit vector in the camera's frame)
    /// tell of that; none where there are none.
    pub(super) fn expected(&self, motion: &Pose3, direction: &Vector3<f64>) -> Option<PredictedMotion> {
        let motion = twist(motion);
        let along = |motion: &Vector6<f64>| motion.fixed_rows::<3>(3).dot(direction);
        let weighted = |known: &Vector6<f64>| {
            let off = known - motion;
            let sq_across = off.norm_squared() - along(&off).powi(2);
            ((-0.5 * sq_across / (ALIKE * ALIKE)).exp(), along(known))
        };
        let weighted: Vec<(f64, f64)> = self.motions.iter().map(weighted).collect();
        let weight: f64 = weighted.iter().map(|(weight, _)| weight).sum();
        if weight < LEAST_WEIGHT {
            return None;
        }
        let mean = weighted.iter().map(|(weight, along)| weight * along).sum::<f64>() / weight;
        let spread = weighted.iter().map(|(weight, along)| weight * (along - mean).powi(2)).sum::<f64>() / weight;
        Some(PredictedMotion { along: mean, variance: spread + ALIKE * ALIKE / weight })
    }
}

fn twist(motion: &Pose3) -> Vector6<f64> {
    let (turn, moved) = (motion.rotation.scaled_axis(), motion.translation.vector);
    Vector6::new(turn.x, turn.y, turn.z, moved.x, moved.y, moved.z)
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;

    fn motion(rival_chain: f64, ahead: f64, turn: f64) -> Pose3 {
        Isometry3::new(Vector3::new(rival_chain, 0.0, ahead), Vector3::y() * turn)
    }

    /// A robot that goes a quarter of a metre ahead or turns by ten degrees.
    fn steps_and_turns() -> MotionPrior {
        let mut motion_prior = MotionPrior::default();
        for index in 0..12 {
            motion_prior.push(&if index % 3 == 0 { motion(0.0, 0.0, 0.17) } else { motion(0.0, 0.25, 0.0) });
        }
        motion_prior
    }

    #[test]
    fn what_was_done_before_is_expected_along_what_nothing_tells() {
        let motion_prior = steps_and_turns();
        // Along a corridor: a frame that has not turned is a step ahead, one that has turned is where it was.
        let ahead = motion_prior.expected(&motion(0.001, 0.6, 0.002), &Vector3::z()).unwrap();
        assert!((ahead.along - 0.25).abs() < 1e-3 && ahead.variance.sqrt() < 0.02, "{ahead:?}");
        let turned = motion_prior.expected(&motion(0.0, -0.3, 0.171), &Vector3::z()).unwrap();
        assert!(turned.along.abs() < 1e-3, "{turned:?}");
        // Beside a wall that is met at an angle, how far it has come nearer tells how far it has gone along it.
        let (sine, cosine) = 0.3f64.sin_cos();
        let beside = Vector3::new(cosine, 0.0, sine);
        let slid = motion(0.0, 0.25, 0.0).translation.vector + 0.12 * beside;
        let beside = motion_prior.expected(&motion(slid.x, slid.z, 0.0), &beside).unwrap();
        assert!((beside.along - 0.25 * sine).abs() < 1e-3, "{beside:?}");
    }

    #[test]
    fn nothing_is_expected_of_a_motion_that_is_new() {
        assert_eq!(MotionPrior::default().expected(&motion(0.0, 0.25, 0.0), &Vector3::z()), None);
        assert_eq!(steps_and_turns().expected(&motion(0.2, 0.25, 0.0), &Vector3::z()), None);
        assert_eq!(steps_and_turns().expected(&motion(0.0, 0.25, 0.5), &Vector3::z()), None);
    }

    #[test]
    fn steps_that_differ_tell_less() {
        let mut motion_prior = MotionPrior::default();
        for ahead in [0.1, 0.3, 0.2, 0.4, 0.0] {
            motion_prior.push(&motion(0.0, ahead, 0.0));
        }
        let PredictedMotion { along, variance } = motion_prior.expected(&motion(0.0, 0.0, 0.0), &Vector3::z()).unwrap();
        assert!((along - 0.2).abs() < 1e-9 && variance > 0.02, "{along}, {variance}");
    }
}
