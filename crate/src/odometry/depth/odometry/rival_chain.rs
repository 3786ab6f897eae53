//! The rival chain: frames that fit each other but not the map. A recording may begin with a frame of another place.

use super::super::chain::{Chain, MAX_UNESTABLISHED_FRAMES};
use super::super::estimate::{PoseUpdate, SpatialEstimate};
use super::DepthOdometry;
use crate::geometry::Pose3;
use crate::odometry::assessment::{Assessment, Status};
use crate::registration::prepared_surfels::PreparedSurfels;

/// Smallest number of frames in a rival chain that replaces a shorter chain.
const MIN_MAJORITY: usize = 3;

impl DepthOdometry {
    /// Registers a frame that the chain rejected to the rival chain. If that becomes the majority, it replaces the chain, and
    /// its estimate is the frame's.
    pub(super) fn extend_rival_chain(&mut self, number: u32, frame: &PreparedSurfels) -> Option<SpatialEstimate> {
        let Some(rival_chain) = &mut self.rival_chain else {
            self.rival_chain = Some(Chain::new(self.options, number, frame).0);
            return None;
        };
        let estimate = rival_chain.extend_near_prediction(number, frame);
        let num_rivals = rival_chain.members().len();
        if !estimate.is_in_map {
            if rival_chain.num_rejected() as usize >= num_rivals {
                self.rival_chain = Some(Chain::new(self.options, number, frame).0);
            }
            return None;
        }
        let num_members = self.chain.as_ref().map_or(0, |chain| chain.members().len());
        if num_rivals < MIN_MAJORITY || num_rivals <= num_members {
            return None;
        }
        self.promote_rival_chain(number);
        Some(estimate)
    }

    /// Replaces the chain by the rival chain. The frames of the replaced chain are lost.
    fn promote_rival_chain(&mut self, number: u32) {
        std::mem::swap(&mut self.chain, &mut self.rival_chain);
        let (Some(chain), Some(outnumbered)) = (&self.chain, &self.rival_chain) else { return };
        for member in outnumbered.members() {
            let mut assessment = Assessment { status: Status::Lost, reason: String::new(), agreement: 0.0 };
            assessment.mark_outnumbered();
            let T_world_sensor = Pose3::identity();
            self.pose_updates.push(PoseUpdate { frame: member.number, T_world_sensor, assessment, registration: None });
        }
        for member in chain.members() {
            self.unregistered_frames.remove(member.number);
            if member.number != number {
                self.pose_updates.push(member.pose_update());
            }
        }
        self.drop_small_rival_chain();
    }

    /// Drops the rival chain unless it is established.
    pub(super) fn drop_small_rival_chain(&mut self) {
        self.rival_chain = self.rival_chain.take().filter(|rival| rival.members().len() > MAX_UNESTABLISHED_FRAMES);
    }
}

impl Chain {
    /// Registers the frame after the last one if it lies near the prediction.
    fn extend_near_prediction(&mut self, number: u32, frame: &PreparedSurfels) -> SpatialEstimate {
        let matcher = self.matcher(frame);
        let hypothesis = self.search_near_prediction(&matcher);
        if !self.is_accepted(&hypothesis) {
            let assessment = self.assessment_of(&hypothesis);
            return self.reject(frame, hypothesis, assessment);
        }
        let hypothesis = self.with_second_basin(&matcher, hypothesis);
        if hypothesis.second_basin.is_none() {
            return self.accept(number, frame, hypothesis).estimate;
        }
        let assessment = self.assessment_of(&hypothesis);
        self.keep_tentative(number, frame, hypothesis, assessment)
    }
}
