//! What the odometry reports of a frame, at once and later.

use nalgebra::Matrix6;

use super::pose_hypothesis::PoseHypothesis;
use crate::geometry::Pose3;
use crate::odometry::assessment::Assessment;
use crate::registration::spatial::SpatialRegistration;

/// The pose of a frame with its assessment.
#[derive(Clone)]
pub struct SpatialEstimate {
    /// Pose of the sensor in the frame of the first one. For a lost frame: the last known pose.
    pub T_world_sensor: Pose3,
    /// The registration; `None` for the first frame of an odometry and for frames that it has lost.
    pub registration: Option<SpatialRegistration>,
    /// Share of the frame's surface that lies on the map, 0..=1.
    pub overlap: f64,
    /// Good, doubtful or lost, with the reason.
    pub assessment: Assessment,
    /// Covariance of the pose's error against the first frame's, a small motion of the world (rotation first); `None` outside the map.
    pub covariance: Option<Matrix6<f64>>,
    /// Whether the frame has been added to the map.
    pub is_in_map: bool,
}

impl SpatialEstimate {
    /// Of a frame that is not added to the map.
    pub(super) fn outside_map(hypothesis: PoseHypothesis, assessment: Assessment) -> Self {
        let (T_world_sensor, overlap) = (*hypothesis.T_world_sensor(), hypothesis.overlap);
        let registration = Some(hypothesis.registration);
        Self { T_world_sensor, registration, overlap, assessment, covariance: None, is_in_map: false }
    }

    /// Of a lost frame.
    pub(super) fn lost(T_world_sensor: Pose3, reason: String, overlap: f64) -> Self {
        let assessment = Assessment::lost(reason);
        Self { T_world_sensor, registration: None, overlap, assessment, covariance: None, is_in_map: false }
    }
}

/// A later change of an earlier frame's estimate.
#[derive(Clone)]
pub struct PoseUpdate {
    /// Number of the frame in the order of registration, from 0.
    pub frame: u32,
    /// Its new pose.
    pub T_world_sensor: Pose3,
    /// Its new assessment.
    pub assessment: Assessment,
    /// Whether its chain has been replaced by another one.
    pub is_replaced: bool,
    /// The new estimate, where the frame has been registered again.
    pub registered: Option<Box<SpatialEstimate>>,
}

impl PoseUpdate {
    /// Of a frame that was registered again.
    pub(super) fn relocalized(frame: u32, estimate: SpatialEstimate) -> Self {
        let (T_world_sensor, assessment) = (estimate.T_world_sensor, estimate.assessment.clone());
        Self { frame, T_world_sensor, assessment, is_replaced: false, registered: Some(Box::new(estimate)) }
    }
}
