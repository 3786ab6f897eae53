//! How well a pose agrees with the prediction from neighbouring frames. It decides how much evidence a pose needs.

use crate::geometry::Pose3;

/// Largest translation from one frame to the next inside the gate (m).
pub(super) const GATE_TRANSLATION: f64 = 1.5;
/// Largest rotation from one frame to the next inside the gate (rad).
const GATE_ROTATION: f64 = 1.15;
/// Largest translation outside the gate for which the prediction still counts (m), with any rotation.
const MAX_STEP_TRANSLATION: f64 = 2.5;
/// Largest number of frames between two poses for which there is a prediction.
const MAX_PREDICTED_GAP: u32 = 2;

/// Where a pose lies relative to the prediction. No more is assumed of the motion: robots stop and turn on the spot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PredictionGate {
    /// Inside the gate around the frame directly before it.
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
        let motion = T_world_registered.inverse() * T_world_sensor;
        let (distance, angle) = (motion.translation.vector.norm(), motion.rotation.angle());
        let is_outside = distance > GATE_TRANSLATION || angle > GATE_ROTATION;
        match num_between {
            0..=MAX_PREDICTED_GAP if is_outside && distance < MAX_STEP_TRANSLATION => Self::Outside,
            _ if is_outside => Self::NoPrediction,
            0 => Self::Inside,
            1..=MAX_PREDICTED_GAP => Self::InsideAfterGap,
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
