//! The motion prior: what earlier motions of the recording predict along a direction that the view does not constrain.
//!
//! Robots take equal steps, hand-held cameras move much as they did a moment before. No motion model is built in: earlier
//! motions of the recording that agree with the new one in all constrained directions predict it along the remaining one, and
//! their spread gives the variance (kernel regression: Nadaraya, "On estimating regression", 1964). Two motions are similar if they differ
//! by no more than two registrations of one pose.

use nalgebra::{Vector3, Vector6};

use super::evidence::FINE_TOLERANCE;
use super::prediction_gate::MAX_STEP;
use crate::geometry::Pose3;
use crate::geometry::pose_distance::METRES_PER_RADIAN;
use crate::geometry::quantile::MIN_SAMPLE;

/// Largest ratio of a motion to the largest one before it.
const FASTER: f64 = 2.0;

/// The motions between consecutive frames with certain poses, in the camera's frame.
#[derive(Clone, Default)]
pub(super) struct MotionPrior {
    motions: Vec<Vector6<f64>>,
}

/// The predicted motion along a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PredictedMotion {
    /// Mean translation along it (m).
    pub(super) along: f64,
    /// Variance of the translation (m^2).
    pub(super) variance: f64,
}

impl MotionPrior {
    pub(super) fn push(&mut self, motion: &Pose3) {
        self.motions.push(twist(motion));
    }

    /// How far (m) the camera may come in a number of steps, where there are enough motions to tell.
    pub(super) fn reach(&self, num_steps: u32) -> Option<f64> {
        self.largest_in(num_steps, |motion| motion.fixed_rows::<3>(3).norm())
    }

    /// How far apart (m, two metres per radian) the poses before and after a number of steps may be.
    pub(super) fn reach_with_rotation(&self, num_steps: u32) -> Option<f64> {
        let rotation = |motion: &Vector6<f64>| motion.fixed_rows::<3>(0).norm();
        self.largest_in(num_steps, |motion| motion.fixed_rows::<3>(3).norm() + METRES_PER_RADIAN * rotation(motion))
    }

    fn largest_in(&self, num_steps: u32, size: impl Fn(&Vector6<f64>) -> f64) -> Option<f64> {
        let largest = || self.motions.iter().map(size).fold(0.0, f64::max);
        (self.motions.len() >= MIN_SAMPLE).then(|| f64::from(num_steps) * FASTER * largest())
    }

    /// The translation along a `direction` (unit vector in the camera's frame), predicted from earlier motions that agree with
    /// this one in everything else; `None` where these leave it as open as the largest step.
    pub(super) fn predict(&self, motion: &Pose3, direction: &Vector3<f64>) -> Option<PredictedMotion> {
        let motion = twist(motion);
        let along = |motion: &Vector6<f64>| motion.fixed_rows::<3>(3).dot(direction);
        let weighted = |earlier: &Vector6<f64>| {
            let difference = earlier - motion;
            let sq_across = difference.norm_squared() - along(&difference).powi(2);
            ((-0.5 * sq_across / (FINE_TOLERANCE * FINE_TOLERANCE)).exp(), along(earlier))
        };
        let weighted: Vec<(f64, f64)> = self.motions.iter().map(weighted).collect();
        let weight: f64 = weighted.iter().map(|(weight, _)| weight).sum();
        if FINE_TOLERANCE * FINE_TOLERANCE > MAX_STEP * MAX_STEP * weight {
            return None;
        }
        let mean = weighted.iter().map(|(weight, along)| weight * along).sum::<f64>() / weight;
        let spread = weighted.iter().map(|(weight, along)| weight * (along - mean).powi(2)).sum::<f64>() / weight;
        Some(PredictedMotion { along: mean, variance: spread + FINE_TOLERANCE * FINE_TOLERANCE / weight })
    }
}

fn twist(motion: &Pose3) -> Vector6<f64> {
    let (rotation, translation) = (motion.rotation.scaled_axis(), motion.translation.vector);
    Vector6::new(rotation.x, rotation.y, rotation.z, translation.x, translation.y, translation.z)
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;

    fn motion(sideways: f64, ahead: f64, turn: f64) -> Pose3 {
        Isometry3::new(Vector3::new(sideways, 0.0, ahead), Vector3::y() * turn)
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
    fn earlier_motions_predict_the_motion_along_an_undetermined_direction() {
        let motion_prior = steps_and_turns();
        // Along a corridor: a frame that has not turned is a step ahead, one that has turned is where it was.
        let ahead = motion_prior.predict(&motion(0.001, 0.6, 0.002), &Vector3::z()).unwrap();
        assert!((ahead.along - 0.25).abs() < 1e-3 && ahead.variance.sqrt() < 0.02, "{ahead:?}");
        let turned = motion_prior.predict(&motion(0.0, -0.3, 0.171), &Vector3::z()).unwrap();
        assert!(turned.along.abs() < 1e-3, "{turned:?}");
        // Beside a wall that is met at an angle, how far it has come nearer tells how far it has gone along it.
        let (sine, cosine) = 0.3f64.sin_cos();
        let beside = Vector3::new(cosine, 0.0, sine);
        let slid = motion(0.0, 0.25, 0.0).translation.vector + 0.12 * beside;
        let beside = motion_prior.predict(&motion(slid.x, slid.z, 0.0), &beside).unwrap();
        assert!((beside.along - 0.25 * sine).abs() < 1e-3, "{beside:?}");
    }

    #[test]
    fn a_camera_comes_as_far_as_twice_its_longest_steps() {
        assert_eq!(MotionPrior::default().reach(1), None);
        let motion_prior = steps_and_turns();
        assert_eq!(motion_prior.reach(3), Some(1.5));
        let with_rotation = motion_prior.reach_with_rotation(3).unwrap();
        assert!((with_rotation - 6.0 * 2.0 * 0.17).abs() < 1e-9, "{with_rotation}");
    }

    #[test]
    fn a_motion_unlike_all_earlier_ones_is_not_predicted() {
        assert_eq!(MotionPrior::default().predict(&motion(0.0, 0.25, 0.0), &Vector3::z()), None);
        assert_eq!(steps_and_turns().predict(&motion(0.2, 0.25, 0.0), &Vector3::z()), None);
        assert_eq!(steps_and_turns().predict(&motion(0.0, 0.25, 0.5), &Vector3::z()), None);
    }

    #[test]
    fn motions_that_vary_predict_with_a_larger_variance() {
        let mut motion_prior = MotionPrior::default();
        for ahead in [0.1, 0.3, 0.2, 0.4, 0.0] {
            motion_prior.push(&motion(0.0, ahead, 0.0));
        }
        let PredictedMotion { along, variance } = motion_prior.predict(&motion(0.0, 0.0, 0.0), &Vector3::z()).unwrap();
        assert!((along - 0.2).abs() < 1e-9 && variance > 0.02, "{along}, {variance}");
    }
}
