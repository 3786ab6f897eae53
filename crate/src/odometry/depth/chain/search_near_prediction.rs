//! Predict and propose: the search near the last pose, near the constant-velocity prediction, and near a rejected frame.

use super::super::frame_matcher::FrameMatcher;
use super::super::hypotheses::near_prediction;
use super::super::pose_hypothesis::PoseHypothesis;
use super::Chain;
use crate::geometry::Pose3;

impl Chain {
    /// The best pose near the last one, and near that of a rejected frame since. In a video the registrations from the predictions
    /// suffice where one is accepted, for no other pose is within reach of the camera. Agreement alone does not tell: before bare
    /// walls a turned pose agrees as well.
    pub(in super::super) fn search_near_prediction(&self, matcher: &FrameMatcher<'_>) -> PoseHypothesis {
        let T_world_last = &self.last.T_world_sensor;
        if self.stays_near(1) {
            let predicted = matcher.best_near(matcher.propose_near(&self.last.predictions(), T_world_last));
            if self.is_accepted(&predicted) && self.is_near_prediction(predicted.T_world_sensor()) {
                return predicted;
            }
        }
        let around = near_prediction(T_world_last, &self.last.motion);
        let mut best = matcher.best_near(matcher.propose_near(&around, T_world_last));
        if let Some(rejected) = self.rejected.as_ref().filter(|_| !self.needs_no_wider_search(&best)) {
            let T_world_rejected = &rejected.T_world_sensor;
            let around = near_prediction(T_world_rejected, &Pose3::identity());
            let other = matcher.best_near(matcher.propose_near(&around, T_world_rejected));
            if other.support > best.support {
                best = other;
            }
        }
        best
    }
}
