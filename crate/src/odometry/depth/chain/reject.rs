//! Reject: a frame is not added to the map. It is searched for again later.

use super::super::SpatialEstimate;
use super::super::pose_hypothesis::PoseHypothesis;
use super::Chain;
use super::track::PosedFrame;
use crate::geometry::Pose3;
use crate::odometry::assessment::{Assessment, Status};
use crate::registration::prepared_surfels::PreparedSurfels;

impl Chain {
    /// The estimate of a frame that is not added to the map. If it is doubtful, the next frame is searched near it, too.
    pub(in super::super) fn reject(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        hypothesis: PoseHypothesis,
        assessment: Assessment,
    ) -> SpatialEstimate {
        self.count_rejected();
        let overlap = hypothesis.overlap;
        if assessment.status == Status::Lost {
            return self.lost(assessment.reason, overlap);
        }
        let T_world_sensor = *hypothesis.T_world_sensor();
        // The frame before it is the one that was rejected before, or else the last of the map.
        let before = match self.num_rejected {
            1 => Some(&self.last),
            _ => self.rejected.as_ref(),
        };
        let motion = before.map_or_else(Pose3::identity, |before| before.T_world_sensor.inverse() * T_world_sensor);
        self.rejected = Some(PosedFrame::new(number, frame, T_world_sensor, motion));
        let registration = Some(hypothesis.registration);
        SpatialEstimate { T_world_sensor, registration, overlap, assessment, covariance: None, is_in_map: false }
    }

    /// Counts a frame that is not added to the map: the sensor may have moved further until the next one.
    pub(in super::super) fn count_rejected(&mut self) {
        self.num_rejected += 1;
    }

    /// The estimate of a lost frame: the last known pose.
    pub(in super::super) fn lost(&self, reason: String, overlap: f64) -> SpatialEstimate {
        let T_world_sensor = self.rejected.as_ref().unwrap_or(&self.last).T_world_sensor;
        let assessment = Assessment::lost(reason);
        SpatialEstimate { T_world_sensor, registration: None, overlap, assessment, covariance: None, is_in_map: false }
    }
}
