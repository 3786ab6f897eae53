//! The wider search for a frame that the evidence near the prediction contradicts: all around, and farther away. In a video the two
//! alternate from frame to frame, for the next one is nearly at the same place: no frame takes long.

use super::super::evidence::MIN_AGREEMENT_DIFFERENCE;
use super::super::frame_matcher::FrameMatcher;
use super::super::pose_hypothesis::PoseHypothesis;
use super::Chain;

impl Chain {
    /// The best pose all around the last one where that is distinctly better than the best pose `near` the prediction; where
    /// the evidence contradicts both, one farther away.
    pub(in super::super) fn search_wider(&self, matcher: &FrameMatcher<'_>, near: PoseHypothesis) -> PoseHypothesis {
        let T_world_last = &self.last.T_world_sensor;
        // One search a frame, where the camera stays near until both have had their turn.
        let (is_video, is_farther_next) = (self.stays_near(2), !self.num_rejected.is_multiple_of(2));
        let mut best = near;
        if !(is_video && is_farther_next && best.is_contradicted()) {
            best = better_of(best, matcher.best_of(matcher.propose_all_around(T_world_last)));
            if !best.is_contradicted() {
                return self.apply_motion_prior(matcher, best);
            }
        }
        let farther = (is_farther_next || !is_video).then(|| matcher.best_of(matcher.propose_anywhere(T_world_last)));
        farther.filter(|farther| self.is_accepted(farther)).unwrap_or(best)
    }
}

/// A pose away from the prediction must agree distinctly better and be constrained by the map.
fn better_of(near: PoseHypothesis, away: PoseHypothesis) -> PoseHypothesis {
    let is_better = away.agreement > near.agreement + MIN_AGREEMENT_DIFFERENCE;
    if is_better && away.is_constrained_by_map() { away } else { near }
}
