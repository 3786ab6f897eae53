//! The largest distance of correspondences, by how far the predictions of the motion have been off.
//!
//! Vizzo et al., "KISS-ICP", RA-L 8 (2023), section III-D: the deviation of one frame is how far it
//! moves the points that reach furthest (`delta_rot` + `delta_trans`), the threshold three standard deviations of it.

use crate::geometry::{Pose3, RigidMotion};

/// Deviations below this (m) do not count, or a sensor that stands still would narrow the threshold to zero (delta_min in
/// the paper).
const MIN_DEVIATION: f64 = 0.1;
/// The threshold is three standard deviations, tau = 3 sigma.
const SIGMAS: f64 = 3.0;

/// Deviations of the predictions so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptiveThreshold {
    sum_of_squares: f64,
    count: f64,
}

impl AdaptiveThreshold {
    /// Without any frame, the threshold is `initial` (m); it counts as one deviation, as in the authors' code.
    pub fn new(initial: f64) -> Self {
        let sigma = initial / SIGMAS;
        Self { sum_of_squares: sigma * sigma, count: 1.0 }
    }

    /// Takes in the motion by which a frame was off its prediction; `max_range` (m) is how far its points reach.
    pub fn update(&mut self, deviation: &Pose3, max_range: f64) {
        let angle = <Pose3 as RigidMotion>::rotation_angle(deviation);
        let delta_rot = 2.0 * max_range * (0.5 * angle).sin();
        let delta_trans = <Pose3 as RigidMotion>::translation_norm(deviation);
        let delta = delta_rot + delta_trans;
        if delta > MIN_DEVIATION {
            self.sum_of_squares += delta * delta;
            self.count += 1.0;
        }
    }

    /// The threshold (m): three times the root mean square of the deviations that count.
    pub fn threshold(&self) -> f64 {
        SIGMAS * (self.sum_of_squares / self.count).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    #[test]
    fn follows_the_deviations_and_does_not_fall_below_the_informative_ones() {
        let mut threshold = AdaptiveThreshold::new(1.5);
        assert!((threshold.threshold() - 1.5).abs() < 1e-12);
        let small = <Pose3 as RigidMotion>::exp(&Vector6::new(0.0, 0.001, 0.0, 0.01, 0.0, 0.0));
        threshold.update(&small, 10.0);
        assert!((threshold.threshold() - 1.5).abs() < 1e-12);
        // A turn of 0.1 rad moves a point at 4 m by 0.4 m, to which 0.2 m of way are added.
        let turn = Pose3::translation(0.2, 0.0, 0.0) * <Pose3 as RigidMotion>::exp(&(Vector6::y() * 0.1));
        threshold.update(&turn, 4.0);
        let delta = 8.0 * 0.05_f64.sin() + 0.2;
        assert!((threshold.threshold() - 3.0 * (f64::midpoint(0.25, delta * delta)).sqrt()).abs() < 1e-12);
    }
}
