//! The wider search for a frame that fits the map near the prediction too little: all around, then near all keyframes.

use super::super::frame_matcher::FrameMatcher;
use super::super::pose_hypothesis::PoseHypothesis;
use super::super::prediction_gate::PredictionGate;
use super::super::resolve_degeneracy::MIN_AGREEMENT_DIFFERENCE;
use super::Chain;

impl Chain {
    /// The best pose all around the last one where that is distinctly better than the best pose `near` the prediction; where
    /// the evidence contradicts both, one farther away or near a keyframe.
    pub(in super::super) fn search_wider(&self, matcher: &FrameMatcher<'_>, near: PoseHypothesis) -> PoseHypothesis {
        let T_world_last = &self.last.T_world_sensor;
        let best = better_of(near, matcher.best_of(matcher.propose_all_around(T_world_last)));
        if !best.is_contradicted() {
            return self.apply_motion_prior(matcher, best);
        }
        let farther = matcher.best_of(matcher.propose_anywhere(T_world_last));
        if self.is_accepted(&farther) {
            return farther;
        }
        self.search_near_keyframes(matcher).unwrap_or(best)
    }

    /// The best pose near all keyframes, if it is accepted without a prediction.
    pub(super) fn search_near_keyframes(&self, matcher: &FrameMatcher<'_>) -> Option<PoseHypothesis> {
        let best = matcher.best_of(matcher.propose_near_keyframes()?);
        self.is_accepted_at(&best, PredictionGate::NoPrediction).then_some(best)
    }
}

/// A pose away from the prediction must agree distinctly better and be constrained by the map.
fn better_of(near: PoseHypothesis, away: PoseHypothesis) -> PoseHypothesis {
    let is_better = away.agreement > near.agreement + MIN_AGREEMENT_DIFFERENCE;
    if is_better && away.is_constrained_by_map() { away } else { near }
}
