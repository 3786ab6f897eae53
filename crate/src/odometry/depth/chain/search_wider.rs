//! The wider search for a frame that the evidence near the prediction contradicts: all around, farther away and near all
//! keyframes. In a video the three are spread over frames, for the next one is nearly at the same place: no frame takes long.

use super::super::evidence::MIN_AGREEMENT_DIFFERENCE;
use super::super::frame_matcher::FrameMatcher;
use super::super::pose_hypothesis::PoseHypothesis;
use super::super::prediction_gate::PredictionGate;
use super::Chain;

/// A search, each wider than the one before it.
#[derive(Clone, Copy, PartialEq)]
enum WiderSearch {
    AllAround,
    Anywhere,
    NearKeyframes,
}

/// In a video, that of a frame by how many before it were rejected.
const IN_TURN: [WiderSearch; 3] = [WiderSearch::AllAround, WiderSearch::Anywhere, WiderSearch::NearKeyframes];

impl Chain {
    /// The best pose all around the last one where that is distinctly better than the best pose `near` the prediction; where
    /// the evidence contradicts both, one farther away or near a keyframe.
    pub(in super::super) fn search_wider(&self, matcher: &FrameMatcher<'_>, near: PoseHypothesis) -> PoseHypothesis {
        let T_world_last = &self.last.T_world_sensor;
        let is_video = self.stays_near(IN_TURN.len() as u32);
        let is_turn_of = |search| !is_video || IN_TURN[self.num_rejected as usize % IN_TURN.len()] == search;
        let mut best = near;
        if is_turn_of(WiderSearch::AllAround) || !best.is_contradicted() {
            best = better_of(best, matcher.best_of(matcher.propose_all_around(T_world_last)));
            if !best.is_contradicted() {
                return self.apply_motion_prior(matcher, best);
            }
        }
        if is_turn_of(WiderSearch::Anywhere) {
            let farther = matcher.best_of(matcher.propose_anywhere(T_world_last));
            if self.is_accepted(&farther) {
                return farther;
            }
        }
        let near_keyframe = is_turn_of(WiderSearch::NearKeyframes).then(|| matcher.best_near_keyframes()).flatten();
        near_keyframe.unwrap_or(best)
    }
}

impl FrameMatcher<'_> {
    /// The best pose near all keyframes, if it is accepted without a prediction.
    pub(super) fn best_near_keyframes(&self) -> Option<PoseHypothesis> {
        let best = self.best_of(self.propose_near_keyframes()?);
        best.is_accepted(PredictionGate::NoPrediction).then_some(best)
    }
}

/// A pose away from the prediction must agree distinctly better and be constrained by the map.
fn better_of(near: PoseHypothesis, away: PoseHypothesis) -> PoseHypothesis {
    let is_better = away.agreement > near.agreement + MIN_AGREEMENT_DIFFERENCE;
    if is_better && away.is_constrained_by_map() { away } else { near }
}
