//! Keep tentative: a frame with a plausible, but uncertain pose is added to the map, which is kept as it was before.

use super::super::SpatialEstimate;
use super::super::pose_hypothesis::PoseHypothesis;
use super::super::tentative_branch::{TentativeBranch, UnresolvedFrames};
use super::Chain;
use crate::odometry::assessment::Assessment;
use crate::registration::prepared_surfels::PreparedSurfels;

/// Largest number of tentative branches; each stores a copy of the map.
const MAX_TENTATIVE_BRANCHES: usize = 4;

impl Chain {
    /// Adds a frame with an uncertain pose, and begins a tentative branch unless the last frame is uncertain, too.
    pub(in super::super) fn keep_tentative(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        hypothesis: PoseHypothesis,
        assessment: Assessment,
    ) -> SpatialEstimate {
        self.surfaces_repeat |= hypothesis.second_basin.is_some();
        if self.tentative_branches.last().is_none_or(TentativeBranch::ends_with_certain_pose)
            && self.tentative_branches.len() < MAX_TENTATIVE_BRANCHES
        {
            self.tentative_branches.push(TentativeBranch::new(self.reference.clone(), self.members.len()));
        }
        self.append(number, frame, hypothesis, Some(assessment))
    }

    /// The members with uncertain positions that no later frame has resolved; `None` where there are none.
    pub(in super::super) fn unresolved(&self) -> Option<UnresolvedFrames> {
        self.tentative_branches.first().map(TentativeBranch::unresolved).filter(|open| !open.frames.is_empty())
    }

    pub(in super::super) fn has_tentative_branches(&self) -> bool {
        !self.tentative_branches.is_empty()
    }

    /// Whether surfaces repeat where members are whose place is uncertain for that.
    pub(super) fn is_in_repetitive_place(&self) -> bool {
        self.tentative_branches.iter().any(TentativeBranch::is_in_repetitive_place)
    }
}
