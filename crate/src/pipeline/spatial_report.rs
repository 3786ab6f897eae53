//! The result of a reconstruction in space as plain data, the same for the page, the command line and `report.json`.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::Serialize;

use crate::camera::Pinhole;
use crate::evaluation::spatial_error::SpatialError;
use crate::geometry::Pose3;
use crate::graph::loops::spatial::LoopReport;
use crate::odometry::assessment::Status;
use crate::odometry::depth::SpatialEstimate;
use crate::pipeline::spatial_settings::{Quantisation, SpatialSettings};
use crate::registration::icp::IterationRecord;

/// A pose in space: a position (m) and a unit quaternion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct SpatialPose {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// m.
    pub z: f64,
    /// Imaginary part.
    pub qx: f64,
    /// Imaginary part.
    pub qy: f64,
    /// Imaginary part.
    pub qz: f64,
    /// Real part.
    pub qw: f64,
}

impl From<Pose3> for SpatialPose {
    fn from(pose: Pose3) -> Self {
        let (t, q) = (pose.translation.vector, pose.rotation);
        Self { x: t.x, y: t.y, z: t.z, qx: q.i, qy: q.j, qz: q.k, qw: q.w }
    }
}

impl From<SpatialPose> for Pose3 {
    fn from(pose: SpatialPose) -> Self {
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(pose.qw, pose.qx, pose.qy, pose.qz));
        Isometry3::from_parts(Translation3::new(pose.x, pose.y, pose.z), rotation)
    }
}

/// What is known of one frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct SpatialFrameResult {
    /// Name of the file.
    pub name: String,
    /// Its place in the recording, counted from 0.
    pub index: usize,
    /// When it was taken (s), or null.
    pub time: Option<f64>,
    /// Pose of the sensor; the world is the frame of the first one, x right, y down, z forward.
    pub T_world_sensor: SpatialPose,
    /// How far the pose is to be trusted.
    pub status: Status,
    /// Why it is not good; empty when it is.
    pub reason: String,
    /// Share of the surface in view of both that agrees, 0..=1.
    pub agreement: f64,
    /// Share of the frame's surface that lies on the map, 0..=1.
    pub overlap: f64,
    /// Pairs within the distance limit.
    pub num_correspondences: usize,
    /// Pairs that counted.
    pub num_inliers: usize,
    /// Inliers over points.
    pub fitness: f64,
    /// Root mean square of the inliers' residuals (m).
    pub inlier_rmse: f64,
    /// Iterations of the last registration.
    pub iterations: usize,
    /// Whether its last step was below both limits.
    pub converged: bool,
    /// Every iteration of it.
    pub history: Vec<IterationRecord>,
}

impl SpatialFrameResult {
    /// Puts together what is known of a frame; `pose` is its present `T_world_sensor`.
    pub fn new(name: &str, index: usize, time: Option<f64>, estimate: &SpatialEstimate, pose: Pose3) -> Self {
        let registration = estimate.registration.as_ref();
        let last = registration.map_or_else(IterationRecord::default, |r| r.last);
        Self {
            name: name.to_owned(),
            index,
            time,
            T_world_sensor: pose.into(),
            status: estimate.assessment.status,
            reason: estimate.assessment.reason.clone(),
            agreement: estimate.assessment.agreement,
            overlap: estimate.overlap,
            num_correspondences: last.num_correspondences,
            num_inliers: last.num_inliers,
            fitness: registration.map_or(0.0, |r| r.fitness),
            inlier_rmse: last.inlier_rmse,
            iterations: registration.map_or(0, |r| r.history.len()),
            converged: registration.is_none_or(|r| r.converged),
            history: registration.map_or_else(Vec::new, |r| r.history.clone()),
        }
    }
}

/// Errors against the reference, first poses made equal, no other alignment. Lists have one entry a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct SpatialComparison {
    /// Name of the reference.
    pub name: String,
    /// Frames with an estimate and a partner in the reference.
    pub num_matched: usize,
    /// Mean distance (m), the mean L2 of homework.
    pub mean: f64,
    /// Root mean square distance (m).
    pub rmse: f64,
    /// Largest distance (m).
    pub max: f64,
    /// Distances (m); null for lost frames and such without a partner.
    pub errors: Vec<Option<f64>>,
    /// Angles between the orientations (rad).
    pub rotation_errors: Vec<Option<f64>>,
    /// The reference's poses in the estimate's world.
    pub reference: Vec<Option<SpatialPose>>,
    /// How the reference's poses were read, in words.
    pub convention: String,
}

impl SpatialComparison {
    /// As plain data.
    pub fn new(name: &str, error: SpatialError) -> Self {
        Self {
            name: name.to_owned(),
            num_matched: error.num_matched,
            mean: error.mean,
            rmse: error.rmse,
            max: error.max,
            errors: error.errors,
            rotation_errors: error.rotation_errors,
            reference: error.reference.into_iter().map(|pose| pose.map(SpatialPose::from)).collect(),
            convention: error.convention.map_or_else(|| "positions alone".to_owned(), |found| found.words()),
        }
    }
}

/// Everything that is known of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct SpatialResult {
    /// Version of the engine.
    pub version: &'static str,
    /// The settings of the run.
    pub settings: SpatialSettings,
    /// The camera of the depth images, as set, read or guessed; null for clouds.
    pub camera: Option<Pinhole>,
    /// Raw depth values a metre, as set or guessed; null for clouds.
    pub depth_scale: Option<f64>,
    /// How depth was made whole, as set or as found so far; null for clouds.
    pub quantisation: Option<Quantisation>,
    /// One entry a registered frame.
    pub frames: Vec<SpatialFrameResult>,
    /// Places that came into view again, and what came of it.
    pub loops: LoopReport,
    /// Errors against the reference, where one was given and fits.
    pub comparison: Option<SpatialComparison>,
    /// What else is worth knowing, in whole sentences.
    pub notes: Vec<String>,
}

/// What the map takes at a size of its voxels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct MapSize {
    /// m.
    pub voxel_size: f64,
    /// Points.
    pub num_points: usize,
    /// Bytes of a binary PLY file of them, with normals and colours where there are any.
    pub num_bytes: usize,
}
