//! The rival chain: frames that fit each other but not the map. A recording may begin with a frame of another place.

use super::super::chain::{Chain, Proposal};
use super::super::estimate::{PoseUpdate, SpatialEstimate};
use super::super::unregistered_frames::UnregisteredFrame;
use super::{DepthOdometry, DepthOptions};
use crate::geometry::Pose3;
use crate::odometry::assessment::Status;
use crate::registration::prepared_surfels::PreparedSurfels;

/// A chain beside the first one.
#[derive(Clone)]
pub(super) struct RivalChain {
    pub(super) chain: Chain,
    /// Number of its first frame.
    first: u32,
    /// Pose of its world in that of the other chain, where it is roughly known: its first frame lay near the last one of that.
    T_world_rival: Option<Pose3>,
}

impl RivalChain {
    /// The chain that begins with a frame that `other` rejected, with this `estimate`.
    fn beside(
        other: &Chain,
        options: DepthOptions,
        number: u32,
        frame: &PreparedSurfels,
        estimate: &SpatialEstimate,
    ) -> Self {
        let is_plausible =
            estimate.assessment.status == Status::Doubtful && other.is_near_last(&estimate.T_world_sensor);
        let T_world_rival = is_plausible.then_some(estimate.T_world_sensor);
        Self { chain: Chain::new(options, number, frame).0, first: number, T_world_rival }
    }

    /// Moves it by the `motion` of its first frame in the world of the other chain.
    pub(super) fn apply_corrections(&mut self, motion: &impl Fn(u32) -> Pose3) {
        self.T_world_rival = self.T_world_rival.map(|T| motion(self.first) * T);
    }
}

impl DepthOdometry {
    /// Registers a frame that the chain rejected, with this `estimate`, to the rival chain. If that becomes the majority, it
    /// replaces the chain, and its estimate is the frame's.
    pub(super) fn extend_rival_chain(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        rejected: &SpatialEstimate,
    ) -> Option<SpatialEstimate> {
        let chain = self.chain.as_ref()?;
        let Some(RivalChain { chain: rival, .. }) = &mut self.rival_chain else {
            self.rival_chain = Some(RivalChain::beside(chain, self.options, number, frame, rejected));
            return None;
        };
        let matcher = rival.matcher(frame);
        let near = rival.search_near_prediction(&matcher);
        let decision = rival.assess(&matcher, Proposal::InMap(near));
        let mut estimate = rival.conclude(number, frame, decision, &mut Vec::new());
        if let Some(member) = rival.reassess().into_iter().find(|member| member.number == number) {
            estimate.assessment = member.assessment;
        }
        let num_rivals = rival.members().len();
        if !estimate.is_in_map {
            if rival.num_rejected() as usize >= num_rivals {
                self.rival_chain = Some(RivalChain::beside(chain, self.options, number, frame, rejected));
            }
            return None;
        }
        if num_rivals <= chain.members().len() {
            return None;
        }
        self.promote_rival_chain(number);
        Some(estimate)
    }

    /// Replaces the chain by the rival chain, of which this is the last frame.
    fn promote_rival_chain(&mut self, number: u32) {
        let (Some(replaced), Some(RivalChain { chain, T_world_rival, .. })) =
            (self.chain.take(), self.rival_chain.take())
        else {
            return;
        };
        let T_world_replaced = T_world_rival.and_then(|T| chain.join_last_of(&replaced, &T.inverse()));
        self.replace_estimates(&replaced, &chain, T_world_replaced);
        for member in chain.members() {
            self.unregistered_frames.remove(member.number);
            if member.number != number {
                self.pose_updates.push(member.pose_update());
            }
        }
        self.chain = Some(chain);
    }

    /// The frames of a replaced chain, and the doubtful ones that it rejected, are doubtful where it is roughly known how it lies to the
    /// `chain` that replaces it, and lost otherwise.
    fn replace_estimates(&mut self, replaced: &Chain, chain: &Chain, T_world_replaced: Option<Pose3>) {
        let members =
            replaced.members().iter().map(|member| (member.number, member.T_world_sensor, &member.assessment));
        let is_rejected = |stored: &&UnregisteredFrame| {
            stored.assessment.status == Status::Doubtful && !replaced.is_member(stored.number)
        };
        let rejected = self.unregistered_frames.iter().filter(is_rejected);
        let rejected = rejected.map(|stored| (stored.number, stored.T_world_sensor, &stored.assessment));
        for (frame, T_replaced_sensor, assessment) in
            members.chain(rejected).filter(|(number, ..)| !chain.is_member(*number))
        {
            let mut assessment = assessment.clone();
            match T_world_replaced {
                Some(_) => assessment.mark_replaced(),
                None => assessment.mark_outnumbered(),
            }
            let T_world_sensor = T_world_replaced.map_or_else(Pose3::identity, |T| T * T_replaced_sensor);
            let update = PoseUpdate { frame, T_world_sensor, assessment, is_replaced: true, registered: None };
            self.pose_updates.push(update);
        }
        if let Some(motion) = T_world_replaced {
            self.unregistered_frames.apply_corrections(&|_| motion);
        }
    }
}
