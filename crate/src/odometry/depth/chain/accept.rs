//! Accept: a frame with a certain pose is added to the map, and resolves the tentative branches whose map it sees.

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
        let (mut moved, mut dropped, mut uncertain) = (Vec::new(), Vec::new(), Vec::new());
        let is_next = self.num_rejected == 0 && self.gate_of(&hypothesis) != PredictionGate::NoPrediction;
        while let Some(branch) = self.tentative_branches.pop() {
            match branch.resolved_by(frame, hypothesis.T_world_sensor(), self.options) {
                BranchOutcome::Unresolved => {
                    self.tentative_branches.push(branch);
                    break;
                }
                // The frame does not follow the end of the branch, so its pose does not tell whether the branch is right: the
                // branch is dropped, and the frame accepted by its pose in the map from before it.
                BranchOutcome::Confirmed(anchored) if !is_next => {
                    uncertain.extend(branch.uncertain());
                    dropped.extend(self.drop_members(&branch.unknown_corrections()));
                    self.mark_resolved(&branch);
                    self.reference = branch.into_map_before();
                    hypothesis = *anchored;
                    break;
                }
                BranchOutcome::Confirmed(_) => self.mark_resolved(&branch),
                BranchOutcome::Refuted(anchored) => {
                    uncertain.extend(branch.uncertain());
                    let (certain, others) = self.correct_branch(branch, &hypothesis, &anchored);
                    moved.extend(certain);
                    dropped.extend(others);
                    hypothesis = *anchored;
                    hypothesis.view = self.reference.map.view(&frame.image, hypothesis.T_world_sensor());
                }
            }
        }
        Outcome { estimate: self.append(number, frame, hypothesis, None), moved, dropped, uncertain }
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

    /// Moves the members whose corrections are certain.
    fn move_members(&mut self, corrections: &[BranchCorrection]) -> Vec<Member> {
        let mut moved = Vec::new();
        for BranchCorrection { number, motion, .. } in corrections.iter().filter(|correction| correction.is_certain) {
            let Some(member) = self.members.iter_mut().find(|member| member.number == *number) else { continue };
            member.T_world_sensor = motion * member.T_world_sensor;
            moved.push(member.clone());
        }
        moved
    }

    /// Removes the members whose corrections are not certain.
    fn drop_members(&mut self, corrections: &[BranchCorrection]) -> Vec<Member> {
        let mut dropped = Vec::new();
        for BranchCorrection { number, motion, .. } in corrections.iter().filter(|correction| !correction.is_certain) {
            let Some(index) = self.members.iter().position(|member| member.number == *number) else { continue };
            let Member { number, T_world_sensor, registered, .. } = self.members.remove(index);
            let reason = "it was registered through a frame with an uncertain pose, and a later frame showed that this \
                          pose was wrong";
            let assessment = Assessment { status: Status::Doubtful, reason: reason.to_owned(), ..registered };
            dropped.push(Member::new(number, motion * T_world_sensor, assessment));
        }
        dropped
    }
}
