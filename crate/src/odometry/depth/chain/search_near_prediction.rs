//! Predict and propose: the search near the last pose, near the constant-velocity prediction, and near a rejected frame.

use super::super::Effort;
use super::super::frame_matcher::FrameMatcher;
use super::super::hypotheses;
use super::super::pose_hypothesis::PoseHypothesis;
use super::Chain;
use crate::geometry::Pose3;

impl Chain {
    /// The best pose near the last one, and near that of a rejected frame since.
    pub(in super::super) fn search_near_prediction(&self, matcher: &FrameMatcher<'_>) -> PoseHypothesis {
        let T_world_last = &self.last.T_world_sensor;
        let is_quick = self.options.effort == Effort::Quick;
        let (few, many) = (hypotheses::few_near_prediction, hypotheses::near_prediction);
        let first = if is_quick { few } else { many }(T_world_last, &self.last.motion);
        let mut best = matcher.best_near(matcher.propose_near(&first, T_world_last));
        if is_quick && !self.is_accepted(&best) {
            let more = many(T_world_last, &self.last.motion);
            best = matcher.best_near(matcher.propose_near(&more, T_world_last));
        }
        if let Some(rejected) = self.rejected.as_ref().filter(|_| !self.needs_no_wider_search(&best)) {
            let T_world_rejected = &rejected.T_world_sensor;
            let around = many(T_world_rejected, &Pose3::identity());
            let other = matcher.best_near(matcher.propose_near(&around, T_world_rejected));
            if other.support > best.support {
                best = other;
            }
        }
        best
    }
}
