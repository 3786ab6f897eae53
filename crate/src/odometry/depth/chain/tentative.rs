//! Members of a chain on tentative branches, and what becomes of them.

use super::super::frame_matcher::FrameMatcher;
use super::super::pose_hypothesis::PoseHypothesis;
use super::super::prediction_gate::PredictionGate;
use super::super::second_basin::Reach;
use super::super::tentative_branch::{BranchCorrection, TentativeBranch};
use super::localize::{MAX_AMBIGUOUS_AGREEMENT_LOSS, best_near};
use super::{Chain, Member, Outcome};
use crate::geometry::Pose3;
use crate::odometry::assessment::{Assessment, Status};
use crate::registration::prepared_surfels::PreparedSurfels;

impl Chain {
    /// Whether the last members may still be dropped.
    pub(in super::super) fn has_tentative_branches(&self) -> bool {
        !self.tentative_branches.is_empty()
    }

    /// Whether an uncertain member may have made the poses after it wrong.
    pub(in super::super) fn has_uncertain_member(&self) -> bool {
        self.tentative_branches.iter().any(TentativeBranch::is_uncertain)
    }

    /// Whether surfaces repeat where members are whose place is uncertain for that.
    pub(super) fn is_in_repetitive_place(&self) -> bool {
        self.tentative_branches.iter().any(TentativeBranch::is_in_repetitive_place)
    }

    /// The pose of a frame in the map from before a tentative branch, whose surfaces may contradict it. It is preferred only if
    /// it agrees distinctly better than the pose `with` the branch.
    pub(super) fn localize_without_branches(
        &self,
        frame: &PreparedSurfels,
        with: &PoseHypothesis,
    ) -> Option<(usize, PoseHypothesis)> {
        let without = |(level, branch): (usize, &TentativeBranch)| {
            let matcher = FrameMatcher::new(branch.map_before(), frame, self.options);
            let starts = [self.last.T_world_sensor, branch.T_world_before()];
            let found = starts.into_iter().map(|T_world_start| best_near(&matcher, &T_world_start, &Pose3::identity()));
            let best = found.into_iter().max_by(|a, b| a.support.total_cmp(&b.support))?;
            let num_between = branch.len() as u32 + self.num_rejected;
            let gate = PredictionGate::between(&branch.T_world_before(), best.T_world_sensor(), num_between);
            let is_likelier = !with.is_plausible() || best.agreement > with.agreement + MAX_AMBIGUOUS_AGREEMENT_LOSS;
            let is_found = is_likelier
                && self.is_accepted(&best, gate)
                && matcher.second_basin(&best, &Reach::anywhere(&best)).is_none();
            is_found.then_some((level, best))
        };
        self.tentative_branches.iter().enumerate().rev().find_map(without)
    }

    /// Drops the tentative branches from `level` on and accepts a frame by its pose in the map from before them.
    pub(super) fn accept_without_branches(
        &mut self,
        level: usize,
        number: u32,
        frame: &PreparedSurfels,
        hypothesis: PoseHypothesis,
    ) -> Outcome {
        let branch = self.tentative_branches.drain(level..).next().unwrap_or_default();
        let (dropped, uncertain) = (self.drop_members(&branch.unknown_corrections()), branch.uncertain());
        for outer in &mut self.tentative_branches {
            outer.mark_resolved(&branch);
        }
        self.reference = branch.into_map_before();
        Outcome { estimate: self.append(number, frame, hypothesis, None), confirmed: Vec::new(), dropped, uncertain }
    }

    /// Corrects a branch at whose end a frame was registered to the map from before it (`anchored`) at another pose than to the
    /// whole map. Returns the members whose corrected poses are certain, and those that were dropped.
    pub(super) fn correct_branch(
        &mut self,
        branch: TentativeBranch,
        hypothesis: &PoseHypothesis,
        anchored: &PoseHypothesis,
    ) -> (Vec<Member>, Vec<Member>) {
        let (T_world_sensor, T_world_anchored) = (hypothesis.T_world_sensor(), anchored.T_world_sensor());
        let error = T_world_anchored.translation.vector - T_world_sensor.translation.vector;
        let corrections = branch.corrections(&(T_world_anchored * T_world_sensor.inverse()), &error);
        let (certain, dropped) = (self.move_members(&corrections), self.drop_members(&corrections));
        for outer in &mut self.tentative_branches {
            outer.mark_resolved(&branch);
        }
        let mut reference = branch.into_map_before();
        let certain_corrections = || corrections.iter().filter(|correction| correction.is_certain);
        reference.merge(&self.reference, &|number| {
            certain_corrections().find(|correction| correction.number == number).map(|correction| correction.motion)
        });
        self.reference = reference;
        (certain, dropped)
    }

    /// The members of a confirmed branch whose poses are certain now; none while an earlier branch is uncertain.
    pub(super) fn confirm(&mut self, branch: &TentativeBranch) -> Vec<Member> {
        for outer in &mut self.tentative_branches {
            outer.mark_resolved(branch);
        }
        if self.has_uncertain_member() {
            return Vec::new();
        }
        let mut confirmed = Vec::new();
        for member in self.members.iter_mut().filter(|member| branch.confirms(member.number)) {
            (member.assessment.status, member.assessment.reason) = (Status::Good, String::new());
            confirmed.push(member.clone());
        }
        confirmed
    }

    /// Moves the members whose corrections are certain. They are good unless an earlier branch is uncertain.
    fn move_members(&mut self, corrections: &[BranchCorrection]) -> Vec<Member> {
        let (mut certain, has_uncertain_member) = (Vec::new(), self.has_uncertain_member());
        for BranchCorrection { number, motion, .. } in corrections.iter().filter(|correction| correction.is_certain) {
            let Some(member) = self.members.iter_mut().find(|member| member.number == *number) else { continue };
            member.T_world_sensor = motion * member.T_world_sensor;
            if !has_uncertain_member {
                (member.assessment.status, member.assessment.reason) = (Status::Good, String::new());
            }
            certain.push(member.clone());
        }
        certain
    }

    /// Removes the members whose corrections are not certain.
    fn drop_members(&mut self, corrections: &[BranchCorrection]) -> Vec<Member> {
        let mut dropped = Vec::new();
        for BranchCorrection { number, motion, .. } in corrections.iter().filter(|correction| !correction.is_certain) {
            let Some(index) = self.members.iter().position(|member| member.number == *number) else { continue };
            let Member { number, T_world_sensor, assessment } = self.members.remove(index);
            let reason = "it was registered through a frame with an uncertain pose, and a later frame showed that this \
                          pose was wrong";
            let assessment = Assessment { status: Status::Doubtful, reason: reason.to_owned(), ..assessment };
            dropped.push(Member { number, T_world_sensor: motion * T_world_sensor, assessment });
        }
        dropped
    }
}
