//! Reassess: members are good where they are certain relative to most of the others.

use super::{Chain, Member};
use crate::odometry::assessment::Status;

impl Chain {
    /// Takes what tentative branches leave uncertain into the members' assessments. Returns those whose assessment has changed.
    pub(in super::super) fn reassess(&mut self) -> Vec<Member> {
        // The first branch has the frames of all others.
        let majority = self.tentative_branches.first().and_then(|branch| {
            let num_before = branch.num_members_before();
            let is_good = |member: &&Member| member.registered.status == Status::Good;
            let num_good_before = self.members.iter().take(num_before).filter(is_good).count();
            Some((num_before, branch.majority(num_good_before)?))
        });
        let mut changed = Vec::new();
        for (index, member) in self.members.iter_mut().enumerate() {
            let mut assessment = member.registered.clone();
            if let Some((num_before, majority)) = &majority {
                let is_known = if index < *num_before {
                    majority.includes_map_before
                } else {
                    majority.numbers.binary_search(&member.number).is_ok()
                };
                match (is_known, majority.includes_map_before) {
                    (true, _) => {}
                    (false, true) => assessment.mark_dependent_on_uncertain_pose(),
                    (false, false) => assessment.mark_outside_majority(),
                }
            }
            if assessment != member.assessment {
                member.assessment = assessment;
                changed.push(member.clone());
            }
        }
        changed
    }
}
