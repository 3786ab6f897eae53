//! Bound uncertainty: the largest motion from frame to frame bounds the error of a pose.

use super::super::hypotheses::{CONVERGING_DISTANCE, REACH_ALL_AROUND, SAME_POSE_DISTANCE};
use super::super::pose_hypothesis::{PoseHypothesis, PoseUncertainty};
use super::Chain;
use crate::geometry::Pose3;
use crate::geometry::pose_distance::pose_distance;
use crate::odometry::assessment::Status;

impl Chain {
    /// How the pose of the next frame may be wrong where it is not accepted.
    pub(super) fn uncertainty_of(&self, hypothesis: &PoseHypothesis) -> PoseUncertainty {
        let num_steps = 1 + self.num_rejected;
        match hypothesis.uncertainty() {
            PoseUncertainty::Along(direction, sigma) => {
                // The camera and the pose are both within reach of the last pose: a uniform distribution.
                let step = hypothesis.T_world_sensor().translation.vector - self.last.T_world_sensor.translation.vector;
                let largest_error = self.motion_prior.reach(num_steps).map(|reach| reach + step.dot(&direction).abs());
                let within_reach = largest_error.map_or(f64::INFINITY, |largest| largest / 3.0_f64.sqrt());
                PoseUncertainty::Along(direction, sigma.min(within_reach))
            }
            PoseUncertainty::Unbounded if hypothesis.is_tracked_on_map => PoseUncertainty::Within(SAME_POSE_DISTANCE),
            PoseUncertainty::Unbounded
                if self.stays_near(1) && self.is_near_prediction(hypothesis.T_world_sensor()) =>
            {
                PoseUncertainty::Within(f64::from(num_steps) * CONVERGING_DISTANCE)
            }
            unbounded => unbounded,
        }
    }

    /// Whether a frame goes on from the one before it as in a video, though the evidence for its pose does not suffice: no other
    /// pose is within reach of the camera.
    pub(in super::super) fn goes_on(&self, near: &PoseHypothesis) -> bool {
        self.num_rejected == 0
            && self.stays_near(1)
            && self.is_near_prediction(near.T_world_sensor())
            && near.registration.converged
            && !near.is_degenerate()
            && near.assessment().status != Status::Lost
    }

    /// Whether the camera stays within reach of a search all around in so many steps, as in a video.
    pub(super) fn stays_near(&self, num_steps: u32) -> bool {
        self.motion_prior.reach_with_rotation(num_steps).is_some_and(|reach| reach < REACH_ALL_AROUND)
    }

    /// Whether a pose is as near the last one or the constant-velocity prediction as hypotheses that converge to the same pose, for each
    /// frame since.
    pub(super) fn is_near_prediction(&self, T_world_sensor: &Pose3) -> bool {
        let near = f64::from(1 + self.num_rejected) * CONVERGING_DISTANCE;
        self.last.predictions().iter().any(|T| pose_distance(T, T_world_sensor) < near)
    }
}
