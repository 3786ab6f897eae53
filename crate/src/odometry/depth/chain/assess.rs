//! Assess: what becomes of a frame with the pose that was found for it.

use super::super::frame_matcher::FrameMatcher;
use super::super::hypotheses::MIN_DISTANCE;
use super::super::pose_hypothesis::PoseHypothesis;
use super::super::prediction_gate::{MAX_STEP, PredictionGate};
use super::super::second_basin::SearchArea;
use super::Chain;
use crate::geometry::Pose3;
use crate::odometry::assessment::{Assessment, Status};

/// The pose proposed for a frame, by what it was registered to.
pub(in super::super) enum Proposal {
    /// By the map.
    InMap(PoseHypothesis),
    /// By the frame before it, with the evidence of the map, which may give the same pose.
    Tracked(PoseHypothesis),
    /// By a rejected frame before it.
    TrackedFromRejected(PoseHypothesis),
}

/// What becomes of a frame.
pub(in super::super) enum Decision {
    /// Its pose is certain.
    Accept(PoseHypothesis),
    /// Its pose is plausible, but not certain: it begins a tentative branch or goes on with one.
    KeepTentative(PoseHypothesis, Assessment),
    /// It is added to the map where it fits best, with an assessment that is not its own registration's.
    Append(PoseHypothesis, Assessment),
    /// It is not added to the map.
    Reject(PoseHypothesis, Assessment),
}

impl Chain {
    /// Compares the evidence for a pose with what its relation to the prediction asks for.
    pub(in super::super) fn assess(&self, matcher: &FrameMatcher<'_>, proposal: Proposal) -> Decision {
        let (hypothesis, is_tracked) = match proposal {
            Proposal::TrackedFromRejected(hypothesis) => {
                let mut assessment = hypothesis.assessment();
                assessment.mark_dependent_on_uncertain_pose();
                return Decision::Reject(hypothesis, assessment);
            }
            Proposal::InMap(hypothesis) => (hypothesis, false),
            Proposal::Tracked(hypothesis) => (hypothesis, true),
        };
        if self.is_accepted(&hypothesis) {
            let hypothesis = self.with_second_basin(matcher, hypothesis);
            let assessment = self.assessment_of(&hypothesis);
            let is_unique = hypothesis.second_basin.is_none();
            return if is_unique {
                Decision::Accept(hypothesis)
            } else {
                Decision::KeepTentative(hypothesis, assessment)
            };
        }
        let mut assessment = self.assessment_of(&hypothesis);
        if is_tracked {
            if assessment.status == Status::Lost {
                assessment.mark_tracked(hypothesis.overlap);
            }
            return Decision::Append(hypothesis, assessment);
        }
        if hypothesis.is_tentative(self.gate_of(&hypothesis)) || self.goes_on(&hypothesis) {
            return Decision::KeepTentative(hypothesis, assessment);
        }
        Decision::Reject(hypothesis, assessment)
    }

    /// Whether the evidence suffices to accept a pose.
    pub(in super::super) fn is_accepted(&self, hypothesis: &PoseHypothesis) -> bool {
        hypothesis.is_accepted(self.gate_of(hypothesis))
    }

    /// Whether a pose near the prediction is accepted, or undetermined along one direction only.
    pub(in super::super) fn needs_no_wider_search(&self, hypothesis: &PoseHypothesis) -> bool {
        self.is_accepted(hypothesis) || hypothesis.is_degenerate_inside_gate(self.gate_of(hypothesis))
    }

    /// The assessment of a pose, with the reason why it is not accepted.
    pub(in super::super) fn assessment_of(&self, hypothesis: &PoseHypothesis) -> Assessment {
        hypothesis.assessment_at(self.gate_of(hypothesis))
    }

    /// Whether a pose that was rejected lies inside the gate around the last frame of the map.
    pub(in super::super) fn is_near_last(&self, T_world_sensor: &Pose3) -> bool {
        let gate =
            PredictionGate::between(&self.last.T_world_sensor, T_world_sensor, self.num_rejected.saturating_sub(1));
        matches!(gate, PredictionGate::Inside | PredictionGate::InsideAfterGap)
    }

    pub(super) fn gate_of(&self, hypothesis: &PoseHypothesis) -> PredictionGate {
        PredictionGate::between(&self.last.T_world_sensor, hypothesis.T_world_sensor(), self.num_rejected)
    }

    /// Notes another position of an accepted pose where the frame fits about as well, if the camera may be there. How far it may
    /// have come is known from earlier steps between frames with certain poses.
    pub(in super::super) fn with_second_basin(
        &self,
        matcher: &FrameMatcher<'_>,
        mut hypothesis: PoseHypothesis,
    ) -> PoseHypothesis {
        let reach = self.motion_prior.reach(1 + self.num_rejected).map(|reach| reach.max(MIN_DISTANCE));
        let position = |T: &Pose3| T.translation.vector;
        let step = (position(hypothesis.T_world_sensor()) - position(&self.last.T_world_sensor)).norm();
        let radius = reach.filter(|reach| step < *reach).unwrap_or(MAX_STEP).min(MAX_STEP);
        let area = if step < radius {
            SearchArea::from_last(&self.last.T_world_sensor, radius)
        } else {
            SearchArea::anywhere(&hypothesis)
        };
        hypothesis.second_basin = matcher.second_basin(&hypothesis, &area);
        hypothesis
    }
}
