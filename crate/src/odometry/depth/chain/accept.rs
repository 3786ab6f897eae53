//! Accept: a frame with a certain pose is added to the map, and resolves the tentative branches whose map it sees.

use nalgebra::Matrix3;

use super::super::pose_hypothesis::PoseHypothesis;
use super::super::prediction_gate::PredictionGate;
use super::super::tentative_branch::{BranchCorrection, BranchOutcome, TentativeBranch};
use super::{Chain, Member, Outcome};
use crate::odometry::assessment::{Assessment, Status};
use crate::registration::prepared_surfels::PreparedSurfels;

impl Chain {
    /// Adds a frame with a certain pose. Its registration to the map from before a tentative branch resolves the branch.
    pub(in super::super) fn accept(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        mut hypothesis: PoseHypothesis,
    ) -> Outcome {
        let (mut confirmed, mut dropped, mut uncertain) = (Vec::new(), Vec::new(), Vec::new());
        let is_next = self.num_rejected == 0 && self.gate_of(&hypothesis) != PredictionGate::NoPrediction;
        while let Some(branch) = self.tentative_branches.pop() {
            match branch.resolved_by(frame, hypothesis.T_world_sensor(), self.options) {
                BranchOutcome::Bounded(covariance) if is_next => {
                    confirmed.extend(self.bound_error(branch, covariance));
                    break;
                }
                BranchOutcome::Unresolved | BranchOutcome::Bounded(_) => {
                    self.tentative_branches.push(branch);
                    break;
                }
                // Far from the end of the branch, the pose says nothing about the branch.
                BranchOutcome::Confirmed(anchored) if !is_next => {
                    self.tentative_branches.push(branch);
                    let level = self.tentative_branches.len() - 1;
                    let mut outcome = self.accept_before(level, number, frame, *anchored);
                    // What inner branches have told is not lost.
                    dropped.append(&mut outcome.dropped);
                    uncertain.append(&mut outcome.uncertain);
                    return Outcome { confirmed, dropped, uncertain, ..outcome };
                }
                BranchOutcome::Confirmed(_) => confirmed.extend(self.confirm_branch(&branch)),
                BranchOutcome::Refuted(anchored) => {
                    uncertain.extend(branch.uncertain());
                    let (certain, others) = self.correct_branch(branch, &hypothesis, &anchored);
                    confirmed.extend(certain);
                    dropped.extend(others);
                    hypothesis = *anchored;
                    hypothesis.view = self.reference.map.view(&frame.image, hypothesis.T_world_sensor());
                }
            }
        }
        Outcome { estimate: self.append(number, frame, hypothesis, None), confirmed, dropped, uncertain }
    }

    /// Keeps a branch with a bound of its error. Returns the members whose poses are certain by it.
    fn bound_error(&mut self, mut branch: TentativeBranch, covariance: Matrix3<f64>) -> Vec<Member> {
        branch.bound_error(covariance);
        let bounded = branch.bounded();
        self.tentative_branches.push(branch);
        self.confirm(|number| bounded.contains(&number))
    }

    /// Drops the tentative branches from `level` on and accepts a frame by its pose in the map from before them.
    fn accept_before(
        &mut self,
        level: usize,
        number: u32,
        frame: &PreparedSurfels,
        hypothesis: PoseHypothesis,
    ) -> Outcome {
        let branch = self.tentative_branches.drain(level..).next().unwrap_or_default();
        let (dropped, uncertain) = (self.drop_members(&branch.unknown_corrections()), branch.uncertain());
        self.mark_resolved(&branch);
        self.reference = branch.into_map_before();
        Outcome { estimate: self.append(number, frame, hypothesis, None), confirmed: Vec::new(), dropped, uncertain }
    }

    /// Corrects a branch at whose end a frame was registered to the map from before it (`anchored`) at another pose than to the
    /// whole map. Returns the members whose corrected poses are certain, and those that were dropped.
    fn correct_branch(
        &mut self,
        branch: TentativeBranch,
        hypothesis: &PoseHypothesis,
        anchored: &PoseHypothesis,
    ) -> (Vec<Member>, Vec<Member>) {
        let (T_world_sensor, T_world_anchored) = (hypothesis.T_world_sensor(), anchored.T_world_sensor());
        let error = T_world_anchored.translation.vector - T_world_sensor.translation.vector;
        let corrections = branch.corrections(&(T_world_anchored * T_world_sensor.inverse()), &error);
        let (certain, dropped) = (self.move_members(&corrections), self.drop_members(&corrections));
        self.mark_resolved(&branch);
        let mut reference = branch.into_map_before();
        let certain_corrections = || corrections.iter().filter(|correction| correction.is_certain);
        reference.merge(&self.reference, &|number| {
            certain_corrections().find(|correction| correction.number == number).map(|correction| correction.motion)
        });
        self.reference = reference;
        (certain, dropped)
    }

    /// Marks the frames of a resolved branch in those that it began within.
    fn mark_resolved(&mut self, branch: &TentativeBranch) {
        for outer in &mut self.tentative_branches {
            outer.mark_resolved(branch);
        }
    }

    /// The members of a confirmed branch whose poses are certain now.
    fn confirm_branch(&mut self, branch: &TentativeBranch) -> Vec<Member> {
        self.mark_resolved(branch);
        self.confirm(|number| branch.confirms(number))
    }

    /// The members whose poses are certain now, as a branch tells; none while a branch that is left is uncertain.
    fn confirm(&mut self, is_certain: impl Fn(u32) -> bool) -> Vec<Member> {
        if self.has_uncertain_member() {
            return Vec::new();
        }
        let mut confirmed = Vec::new();
        for member in self.members.iter_mut().filter(|member| is_certain(member.number)) {
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
