//! What becomes of a frame: it is added to the map with a certain or an uncertain pose, or rejected and searched for again later.

use nalgebra::Matrix3;

use super::super::frame_matcher::FrameMatcher;
use super::super::hypotheses::SAME_POSE_DISTANCE;
use super::super::pose_hypothesis::PoseHypothesis;
use super::super::prediction_gate::PredictionGate;
use super::super::reference_map::ReferenceMap;
use super::super::second_basin::SearchArea;
use super::super::{DepthOptions, SpatialEstimate};
use super::track::PosedFrame;
use super::{Chain, Decision, Member};
use crate::geometry::Pose3;
use crate::geometry::pose_distance::pose_distance;
use crate::odometry::assessment::{Assessment, Status};
use crate::registration::prepared_surfels::PreparedSurfels;

/// Largest number of tentative branches; each stores the blocks of the map that have changed since.
const MAX_BRANCHES: usize = 4;

/// The members since one with an uncertain pose. An error of that pose carries over to all poses after it, until a frame is
/// registered to the map from before the branch and thereby resolves it.
#[derive(Clone)]
pub(super) struct Branch {
    pub(super) map_before: ReferenceMap,
    /// How many members are in that map.
    num_before: usize,
}

impl Branch {
    /// The registration of a frame near a pose to the map from before the branch; `None` where it does not determine the pose. One that
    /// refutes others must be well constrained itself: along a bare wall, free space at the borders of objects tells positions
    /// apart, but not reliably.
    fn anchored(
        &self,
        frame: &PreparedSurfels,
        T_world_sensor: &Pose3,
        options: DepthOptions,
    ) -> Option<PoseHypothesis> {
        let matcher = FrameMatcher::new(&self.map_before, frame, options);
        let anchored = matcher.register_at(*T_world_sensor);
        let is_accepted = anchored.is_constrained_by_map() && anchored.is_accepted(PredictionGate::InsideAfterGap);
        let is_reliable =
            is_same(&anchored, T_world_sensor) || anchored.photometric_ncc.is_some() || anchored.is_well_constrained();
        let is_anchored =
            is_accepted && is_reliable && matcher.second_basin(&anchored, &SearchArea::anywhere(&anchored)).is_none();
        is_anchored.then_some(anchored)
    }
}

fn is_same(hypothesis: &PoseHypothesis, T_world_sensor: &Pose3) -> bool {
    pose_distance(hypothesis.T_world_sensor(), T_world_sensor) < SAME_POSE_DISTANCE
}

impl Chain {
    /// Does with a frame what was decided, and tells its estimate. Members that turn out to be wrong are `dropped`.
    pub(in super::super) fn conclude(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        decision: Decision,
        dropped: &mut Vec<Member>,
    ) -> SpatialEstimate {
        match decision {
            Decision::Accept(hypothesis) => self.accept(number, frame, hypothesis, dropped),
            Decision::KeepTentative(hypothesis, why) => self.keep_tentative(number, frame, hypothesis, why),
            Decision::Append(hypothesis, why) => self.append(number, frame, hypothesis, Some(why)),
            Decision::Reject(hypothesis, why) => self.reject(number, frame, hypothesis, why),
        }
    }

    /// Adds a frame with a certain pose. Its registration to the map from before a tentative branch resolves the branch: if that is
    /// wrong, its members are `dropped`.
    fn accept(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        mut hypothesis: PoseHypothesis,
        dropped: &mut Vec<Member>,
    ) -> SpatialEstimate {
        // Elsewhere its pose does not tell whether the branch is right.
        let is_next = self.num_rejected == 0 && self.gate_of(&hypothesis) != PredictionGate::NoPrediction;
        while let Some(branch) = self.branches.pop() {
            let Some(anchored) = branch.anchored(frame, hypothesis.T_world_sensor(), self.options) else {
                self.branches.push(branch);
                break;
            };
            if !is_next || !is_same(&anchored, hypothesis.T_world_sensor()) {
                dropped.extend(self.drop_branch(branch));
                hypothesis = anchored;
                break;
            }
            for member in &mut self.members[branch.num_before..] {
                member.open = Some(Matrix3::zeros());
            }
        }
        self.append(number, frame, hypothesis, None)
    }

    /// Goes back to the map from before a branch that is wrong.
    fn drop_branch(&mut self, branch: Branch) -> Vec<Member> {
        self.reference = branch.map_before;
        let mut dropped = self.members.split_off(branch.num_before);
        for member in &mut dropped {
            member.assessment.status = Status::Doubtful;
            "it was registered through a frame with an uncertain pose, and a later frame showed that this pose was wrong"
                .clone_into(&mut member.assessment.reason);
        }
        dropped
    }

    /// Adds a frame with an uncertain pose, and begins a tentative branch unless the last frame is uncertain, too.
    fn keep_tentative(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        hypothesis: PoseHypothesis,
        assessment: Assessment,
    ) -> SpatialEstimate {
        self.surfaces_repeat |= hypothesis.second_basin.is_some();
        let goes_on = !self.branches.is_empty() && self.members.last().is_some_and(|last| !last.is_certain());
        if !goes_on && self.branches.len() < MAX_BRANCHES {
            self.branches.push(Branch { map_before: self.reference.clone(), num_before: self.members.len() });
        }
        self.append(number, frame, hypothesis, Some(assessment))
    }

    /// Adds the frame after the last one; with an assessment if its own registration is uncertain.
    fn append(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        hypothesis: PoseHypothesis,
        uncertain: Option<Assessment>,
    ) -> SpatialEstimate {
        let T_world_sensor = *hypothesis.T_world_sensor();
        let open = if uncertain.is_some() { self.open_covariance(&hypothesis) } else { Some(Matrix3::zeros()) };
        let motion = self.last.T_world_sensor.inverse() * T_world_sensor;
        if uncertain.is_none() && self.num_rejected == 0 {
            self.motion_prior.push(&motion);
            self.reference.normal_repeatability.push(hypothesis.normal_repeatability);
        }
        (self.last, self.rejected, self.num_rejected) =
            (PosedFrame::new(number, frame, T_world_sensor, motion), None, 0);
        let assessment = uncertain.unwrap_or_else(|| hypothesis.assessment());
        let estimate = self.insert(number, frame, hypothesis, assessment, open);
        if let (Some(member), false) = (self.members.last_mut(), self.branches.is_empty()) {
            member.open = open;
        }
        estimate
    }

    /// Adds a frame to the map, with the covariance of the position that its own registration leaves open; `None` where nothing bounds it.
    pub(in super::super) fn insert(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        hypothesis: PoseHypothesis,
        assessment: Assessment,
        open: Option<Matrix3<f64>>,
    ) -> SpatialEstimate {
        let T_world_sensor = *hypothesis.T_world_sensor();
        let covariance = Some(self.errors.add_registered(number, &hypothesis, &self.reference, open));
        self.reference.insert(frame, number, &T_world_sensor, &hypothesis.view);
        self.members.push(Member::new(number, T_world_sensor, assessment.clone()));
        SpatialEstimate { covariance, is_in_map: true, ..SpatialEstimate::outside_map(hypothesis, assessment) }
    }

    /// The estimate of a frame that is not added to the map. If it is doubtful, the next frame is searched near it, too.
    fn reject(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        hypothesis: PoseHypothesis,
        assessment: Assessment,
    ) -> SpatialEstimate {
        self.count_rejected();
        if assessment.status == Status::Lost {
            return self.lost(assessment.reason, hypothesis.overlap);
        }
        let T_world_sensor = *hypothesis.T_world_sensor();
        // The frame before it is the one that was rejected before, or else the last of the map.
        let before = match self.num_rejected {
            1 => Some(&self.last),
            _ => self.rejected.as_ref(),
        };
        let motion = before.map_or_else(Pose3::identity, |before| before.T_world_sensor.inverse() * T_world_sensor);
        self.rejected = Some(PosedFrame::new(number, frame, T_world_sensor, motion));
        SpatialEstimate::outside_map(hypothesis, assessment)
    }

    /// Counts a frame that is not added to the map: the sensor may have moved further until the next one.
    pub(in super::super) fn count_rejected(&mut self) {
        self.num_rejected += 1;
    }

    /// The estimate of a lost frame: the last known pose.
    pub(in super::super) fn lost(&self, reason: String, overlap: f64) -> SpatialEstimate {
        let T_world_sensor = self.rejected.as_ref().unwrap_or(&self.last).T_world_sensor;
        SpatialEstimate::lost(T_world_sensor, reason, overlap)
    }
}
