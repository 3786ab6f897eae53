//! How well a pose agrees with the prediction from neighbouring frames. It decides how much evidence a pose needs.

use crate::geometry::Pose3;
use crate::geometry::pose_distance::pose_distance;

/// Largest step of a camera from one frame to the next (m). Surfaces that repeat at a shorter distance have a second basin within it.
pub(super) const MAX_STEP: f64 = 3.0;
/// Largest number of frames between two poses for which there is a prediction.
const MAX_PREDICTED_GAP: u32 = 2;

/// Where a pose lies relative to the prediction. No more is assumed of the motion: robots stop and turn on the spot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PredictionGate {
    /// Inside the gate around the frame directly before it: half of the largest step away, and as a view (two metres per radian) no farther
    /// than the largest step.
    Inside,
    /// Inside the gate around a frame a few frames before or after it.
    InsideAfterGap,
    /// Outside the gate, but at a distance that a camera can still cover.
    Outside,
    /// Too far away, or too many frames in between: there is no prediction.
    NoPrediction,
}

impl PredictionGate {
    /// Of a pose relative to a registered frame's, with `num_between` frames in between.
    pub(super) fn between(T_world_registered: &Pose3, T_world_sensor: &Pose3, num_between: u32) -> Self {
        let distance = (T_world_registered.translation.vector - T_world_sensor.translation.vector).norm();
        let is_inside = 2.0 * distance <= MAX_STEP && pose_distance(T_world_registered, T_world_sensor) <= MAX_STEP;
        match num_between {
            0 if is_inside => Self::Inside,
            ..=MAX_PREDICTED_GAP if is_inside => Self::InsideAfterGap,
            ..=MAX_PREDICTED_GAP if distance < MAX_STEP => Self::Outside,
            _ => Self::NoPrediction,
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    fn at(metres: f64, degrees: f64) -> Pose3 {
        Isometry3::new(Vector3::z() * metres, Vector3::y() * degrees.to_radians())
    }

    #[test]
    fn the_gate_depends_on_the_motion_and_on_the_gap() {
        let gate = |metres, degrees, num_between| {
            PredictionGate::between(&at(1.0, 10.0), &(at(1.0, 10.0) * at(metres, degrees)), num_between)
        };
        assert_eq!(gate(1.0, 50.0, 0), PredictionGate::Inside);
        assert_eq!(gate(1.0, 50.0, 2), PredictionGate::InsideAfterGap);
        assert_eq!(gate(1.0, 50.0, 3), PredictionGate::NoPrediction);
        assert_eq!(gate(2.0, 0.0, 0), PredictionGate::Outside);
        assert_eq!(gate(0.0, 170.0, 1), PredictionGate::Outside);
        assert_eq!(gate(3.0, 0.0, 0), PredictionGate::NoPrediction);
    }
}
