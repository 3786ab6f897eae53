//! Members of a chain that are not where they are for sure, and what becomes of them.

use super::super::matching::Matching;
use super::super::pose_hypothesis::{PoseHypothesis, PredictionGate};
use super::super::tentative_branch::{BranchCorrection, TentativeBranch};
use super::{AS_GOOD_AGREEMENT, Chain, Member, Outcome, near};
use crate::geometry::Pose3;
use crate::odometry::assessment::{Assessment, Status};
use crate::registration::prepared_surfels::PreparedSurfels;

impl Chain {
    /// Whether the last members may yet be dropped.
    pub(in super::super) fn has_tentative_branches(&self) -> bool {
        !self.tentative_branches.is_empty()
    }

    /// Where a frame is by what was seen before frames that are not where they are for sure: they may stand in its way. Where
    /// it fits about as well `with` them, they do not.
    pub(super) fn find_without_branch(
        &self,
        frame: &PreparedSurfels,
        with: &PoseHypothesis,
    ) -> Option<(usize, PoseHypothesis)> {
        let without = |(level, branch): (usize, &TentativeBranch)| {
            let matching = Matching::new(branch.before(), frame, self.options);
            let grid_around = [self.T_world_last, branch.T_world_before()];
            let found = grid_around.into_iter().map(|T_world_near| near(&matching, &T_world_near, &Pose3::identity()));
            let best = found.into_iter().max_by(|a, b| a.support.total_cmp(&b.support))?;
            let num_between = branch.len() as u32 + self.num_frames_since_accepted;
            let gate =
                PredictionGate::between(&branch.T_world_before(), &best.registration.T_target_source, num_between);
            let is_likelier = !with.is_plausible() || best.agreement > with.agreement + AS_GOOD_AGREEMENT;
            (is_likelier && self.is_accepted(&best, gate)).then_some((level, best))
        };
        self.tentative_branches.iter().enumerate().rev().find_map(without)
    }

    /// Members that a frame tells to be off as it was: those that are then where they are for sure, and those that are not.
    pub(super) fn move_by(
        &mut self,
        branch: TentativeBranch,
        found: &PoseHypothesis,
        anchored: &PoseHypothesis,
    ) -> (Vec<Member>, Vec<Member>) {
        let (T_world_found, T_world_anchored) =
            (&found.registration.T_target_source, &anchored.registration.T_target_source);
        let off = T_world_anchored.translation.vector - T_world_found.translation.vector;
        let moved = branch.moved_by(&(T_world_anchored * T_world_found.inverse()), &off);
        let (certain, dropped) = (self.move_members(&moved), self.drop_members(&moved));
        for outer in &mut self.tentative_branches {
            outer.settle(&branch);
        }
        let mut seen = branch.into_before();
        let is_kept = |moved: &&BranchCorrection| moved.is_certain;
        seen.merge(&self.seen, &|number| {
            moved.iter().filter(is_kept).find(|moved| moved.number == number).map(|moved| moved.motion)
        });
        self.seen = seen;
        (certain, dropped)
    }

    /// The same where it was found by what was known before them alone: they have led nowhere.
    pub(super) fn accept_without_branch(
        &mut self,
        level: usize,
        number: u32,
        frame: &PreparedSurfels,
        found: PoseHypothesis,
    ) -> Outcome {
        let branch = self.tentative_branches.drain(level..).next().unwrap_or_default();
        let (dropped, uncertain) = (self.drop_members(&branch.not_moved()), branch.uncertain());
        for outer in &mut self.tentative_branches {
            outer.settle(&branch);
        }
        self.seen = branch.into_before();
        Outcome { estimate: self.append(number, frame, found, None), confirmed: Vec::new(), dropped, uncertain }
    }

    /// Members that have led to where a frame is; those before them may still be off.
    pub(super) fn confirm(&mut self, branch: &TentativeBranch) -> Vec<Member> {
        for outer in &mut self.tentative_branches {
            outer.settle(branch);
        }
        if self.has_unbounded_error() {
            return Vec::new();
        }
        let mut confirmed = Vec::new();
        for member in self.members.iter_mut().filter(|member| branch.confirms(member.number)) {
            (member.assessment.status, member.assessment.reason) = (Status::Good, String::new());
            confirmed.push(member.clone());
        }
        confirmed
    }

    /// Whether members hang on one that may be anywhere.
    pub(super) fn has_unbounded_error(&self) -> bool {
        self.tentative_branches.iter().any(TentativeBranch::has_unbounded_error)
    }

    /// Those that a later frame tells for sure where they are, but for what those before them may be off.
    fn move_members(&mut self, moved: &[BranchCorrection]) -> Vec<Member> {
        let (mut certain, is_elsewhere) = (Vec::new(), self.has_unbounded_error());
        for BranchCorrection { number, motion, .. } in moved.iter().filter(|moved| moved.is_certain) {
            let Some(member) = self.members.iter_mut().find(|member| member.number == *number) else { continue };
            member.T_world_sensor = motion * member.T_world_sensor;
            if !is_elsewhere {
                (member.assessment.status, member.assessment.reason) = (Status::Good, String::new());
            }
            certain.push(member.clone());
        }
        certain
    }

    /// Those of which no later frame tells where they are for sure are members no longer.
    fn drop_members(&mut self, moved: &[BranchCorrection]) -> Vec<Member> {
        let mut dropped = Vec::new();
        for BranchCorrection { number, motion, .. } in moved.iter().filter(|moved| !moved.is_certain) {
            let Some(place) = self.members.iter().position(|member| member.number == *number) else { continue };
            let Member { number, T_world_sensor, assessment } = self.members.remove(place);
            let reason =
                "the way to it led over a frame whose place was not certain, and a later frame told that it was off";
            let assessment = Assessment { status: Status::Doubtful, reason: reason.to_owned(), ..assessment };
            dropped.push(Member { number, T_world_sensor: motion * T_world_sensor, assessment });
        }
        dropped
    }
}
