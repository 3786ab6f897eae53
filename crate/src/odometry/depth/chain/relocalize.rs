//! Relocalization: a frame that is not in the map is searched for again.

use super::super::frame_matcher::FrameMatcher;
use super::super::hypotheses;
use super::super::pose_hypothesis::PoseHypothesis;
use super::super::prediction_gate::PredictionGate;
use super::super::second_basin::SearchArea;
use super::super::unregistered_frames::UnregisteredFrame;
use super::{Chain, Member};
use crate::geometry::Pose3;

impl Chain {
    /// Searches for an unregistered frame near the members before and after it in the recording, and near its last pose, then
    /// all around them and near all keyframes.
    pub(in super::super) fn relocalize(&self, frame: &UnregisteredFrame) -> Option<PoseHypothesis> {
        let matcher = self.matcher(&frame.frame);
        let neighbors = self.neighbors(frame.number);
        let is_accepted = |hypothesis: &PoseHypothesis| {
            let gate_from = |member: &&Member| {
                let num_between = member.number.abs_diff(frame.number).max(1) - 1;
                PredictionGate::between(&member.T_world_sensor, hypothesis.T_world_sensor(), num_between)
            };
            neighbors.iter().map(gate_from).any(|gate| hypothesis.is_accepted(gate))
                || hypothesis.is_accepted(PredictionGate::NoPrediction)
        };
        let starts = neighbors.iter().map(|member| member.T_world_sensor).chain([frame.T_world_sensor]);
        let mut found: Vec<PoseHypothesis> = starts.map(|T_world_start| matcher.best_around(&T_world_start)).collect();
        if !found.iter().any(is_accepted) {
            found.extend(
                neighbors.first().map(|member| matcher.best_of(matcher.propose_all_around(&member.T_world_sensor))),
            );
        }
        let best = found.into_iter().max_by(|a, b| a.support.total_cmp(&b.support)).filter(is_accepted);
        let best = best.or_else(|| matcher.best_near_keyframes())?;
        matcher.second_basin(&best, &SearchArea::anywhere(&best)).is_none().then_some(best)
    }

    /// The members directly before and after a frame in the recording.
    fn neighbors(&self, number: u32) -> Vec<&Member> {
        let gap = |member: &&Member| member.number.abs_diff(number);
        let before = self.members.iter().filter(|member| member.number < number).min_by_key(gap);
        let after = self.members.iter().filter(|member| member.number > number).min_by_key(gap);
        before.into_iter().chain(after).collect()
    }
}

impl FrameMatcher<'_> {
    /// The best pose near another one.
    pub(super) fn best_around(&self, T_world_near: &Pose3) -> PoseHypothesis {
        self.best_of(self.propose_near(&hypotheses::near_prediction(T_world_near, &Pose3::identity()), T_world_near))
    }
}
