//! The result of a reconstruction as plain data, the same for the page, the command line and `report.json`.

use nalgebra::{Isometry3, Matrix6, Quaternion, Translation3, UnitQuaternion, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::evaluation::sharpness::Sharpness;
use crate::evaluation::trajectory_error::{PlanarPoint, TrajectoryError};
use crate::geometry::{Pose2, Pose3, RigidMotion};
use crate::odometry::assessment::{Assessment, Status};
use crate::odometry::depth::SpatialEstimate;
use crate::odometry::planar::FrameEstimate;
use crate::pipeline::prepared_frame::FrameLabel;
use crate::pipeline::settings::Settings;
use crate::preprocess::clean::CleaningReport;
use crate::registration::icp::{IterationRecord, Registration};

/// A pose in the plane, or its standard deviations or a motion in its coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct PlanarPose {
    /// x (m).
    pub x: f64,
    /// y (m).
    pub y: f64,
    /// Heading, counter-clockwise from x, in (-pi, pi] (rad).
    pub theta: f64,
}

impl From<Pose2> for PlanarPose {
    fn from(pose: Pose2) -> Self {
        Self { x: pose.translation.x, y: pose.translation.y, theta: pose.rotation.angle() }
    }
}

impl From<PlanarPose> for Pose2 {
    fn from(pose: PlanarPose) -> Self {
        Self::new(Vector2::new(pose.x, pose.y), pose.theta)
    }
}

/// A pose in space: a position (m) and a unit quaternion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct SpatialPose {
    /// x (m).
    pub x: f64,
    /// y (m).
    pub y: f64,
    /// z (m).
    pub z: f64,
    /// Imaginary part i of the quaternion.
    pub qx: f64,
    /// Imaginary part j.
    pub qy: f64,
    /// Imaginary part k.
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

/// Standard deviations of a pose in space.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct SpatialDeviation {
    /// Of the position along the world's axis x (m).
    pub x: f64,
    /// Along y (m).
    pub y: f64,
    /// Along z (m).
    pub z: f64,
    /// Root mean square of the angle by which the rotation may be off (rad).
    pub rotation: f64,
}

/// The result of one frame, in the plane or in space: `P` is its pose, `C` the report of the cleaning, `S` the standard deviations.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct FrameResult<P, C, S = PlanarPose> {
    /// Name of the file.
    pub name: String,
    /// Index in the recording, from 0.
    pub index: usize,
    /// Time stamp (s), or null.
    pub time: Option<f64>,
    /// Pose of the sensor, or of the robot where a log says where on it the laser sits; the world is the frame of the first one.
    pub T_world_sensor: P,
    /// Standard deviations: of a scan, against the one before, by its registration, the odometry and, where both leave a direction open, by
    /// the motion before; of a depth image, against the first one. Null where nothing tells.
    pub std: Option<S>,
    /// Assessment of the pose.
    pub status: Status,
    /// Reason for a status other than good; empty otherwise.
    pub reason: String,
    /// Share of the surfaces in view of both the frame and the map that agrees, 0..=1.
    pub agreement: f64,
    /// Share of the frame that lies on the map, 0..=1.
    pub overlap: f64,
    /// The connected piece of the map that the frame belongs to; 0 is the main one. Frames of one piece are connected by
    /// registrations that nothing contradicts, by loops, or by measured motion that is certain enough.
    pub piece: usize,
    /// In the plane: counts of dropped points; null in space.
    pub cleaning: C,
    /// Pairs within the distance limit.
    pub num_correspondences: usize,
    /// Pairs left after the rejection by normals and the trimming.
    pub num_inliers: usize,
    /// Number of inliers divided by the number of points, 0..=1.
    pub fitness: f64,
    /// Root mean square of the inliers' residuals (m).
    pub inlier_rmse: f64,
    /// Iterations of the last registration.
    pub iterations: usize,
    /// Whether its last step was below both limits.
    pub converged: bool,
    /// In the plane: unit motion (x, y in the world frame, theta in metres at the points' rms distance) that the walls in view
    /// do not constrain; null otherwise.
    pub undetermined: Option<PlanarPose>,
    /// The iterations of the last registration.
    pub history: Vec<IterationRecord>,
}

impl<P, C, S> FrameResult<P, C, S> {
    fn new<M: RigidMotion>(
        label: FrameLabel,
        T_world_sensor: P,
        assessment: &Assessment,
        overlap: f64,
        registration: Option<&Registration<M>>,
        cleaning: C,
    ) -> Self {
        let last = registration.map_or_else(IterationRecord::default, |r| r.last);
        Self {
            name: label.name,
            index: label.index,
            time: label.time,
            T_world_sensor,
            std: None,
            status: assessment.status,
            reason: assessment.reason.clone(),
            agreement: assessment.agreement,
            overlap,
            piece: 0,
            cleaning,
            num_correspondences: last.num_correspondences,
            num_inliers: last.num_inliers,
            fitness: registration.map_or(0.0, |r| r.fitness),
            inlier_rmse: last.inlier_rmse,
            iterations: registration.map_or(0, |r| r.history.len()),
            converged: registration.is_none_or(|r| r.converged),
            undetermined: None,
            history: registration.map_or_else(Vec::new, |r| r.history.clone()),
        }
    }
}

impl FrameResult<PlanarPose, CleaningReport> {
    /// The result of a scan; `pose` is the current pose that it reports, of the sensor or of the robot. `R_map_run`: a turn alone, for a
    /// shift of the map changes no uncertainty.
    #[inline(never)]
    pub(crate) fn of_scan(
        label: FrameLabel,
        cleaning: CleaningReport,
        estimate: &FrameEstimate,
        pose: Pose2,
        R_map_run: &Pose2,
    ) -> Self {
        let registration = estimate.registration.as_ref();
        let overlap = registration.map_or(estimate.registered.agreement, |r| r.fitness);
        let degenerate = registration.filter(|r| r.observability.is_undetermined());
        Self {
            undetermined: degenerate.map(|r| planar(&(R_map_run.adjoint() * r.observability.weakest_direction))),
            ..Self::new(label, pose.into(), &estimate.assessment(), overlap, registration, cleaning)
        }
    }
}

impl FrameResult<SpatialPose, (), SpatialDeviation> {
    /// The result of a depth image or a cloud, with its current pose.
    pub(crate) fn of_frame(label: FrameLabel, estimate: &SpatialEstimate, assessment: &Assessment) -> Self {
        let SpatialEstimate { T_world_sensor, registration, overlap, covariance, .. } = estimate;
        let covariance = covariance.filter(|_| assessment.status != Status::Lost);
        Self {
            std: covariance.map(|covariance| SpatialDeviation::of(&covariance, T_world_sensor)),
            ..Self::new(label, (*T_world_sensor).into(), assessment, *overlap, registration.as_ref(), ())
        }
    }
}

impl SpatialDeviation {
    /// From the covariance of a small motion of the world (rotation first) that is the error of a pose.
    pub fn of(covariance: &Matrix6<f64>, T_world_sensor: &Pose3) -> Self {
        // The same motion about the sensor, along the axes of the world.
        let adjoint = Pose3::from(T_world_sensor.translation).inverse().adjoint();
        let covariance = adjoint * covariance * adjoint.transpose();
        let [x, y, z] = [3, 4, 5].map(|axis| covariance[(axis, axis)].max(0.0).sqrt());
        Self { x, y, z, rotation: covariance.fixed_view::<3, 3>(0, 0).trace().max(0.0).sqrt() }
    }
}

/// From a tangent vector, rotation first.
fn planar(tangent: &Vector3<f64>) -> PlanarPose {
    PlanarPose { theta: tangent[0], x: tangent[1], y: tangent[2] }
}

/// The result of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct ReconstructionResult {
    /// Version of the engine.
    pub version: &'static str,
    /// The settings of the run.
    pub settings: Settings,
    /// One entry per scan that has been registered so far.
    pub frames: Vec<FrameResult<PlanarPose, CleaningReport, PlanarPose>>,
    /// Iterations of the joint solution; empty without one.
    pub joint_history: Vec<IterationRecord>,
    /// Sharpness of the map, where scans overlap.
    pub sharpness: Option<Sharpness>,
    /// Errors against the reference, where one was given.
    pub comparison: Option<TrajectoryError<PlanarPoint>>,
    /// Why the given odometry is not used, or why the poses in the log are a mirror image of the scans, in whole sentences; null
    /// otherwise. Contained in the notes as well.
    pub odometry_refusal: Option<String>,
    /// The certain pieces of the map, in whole sentences, where there are several; null where it is one. Contained in the notes as
    /// well.
    pub unconnected: Option<String>,
    /// Remarks, in whole sentences.
    pub notes: Vec<String>,
}

/// Contents of a laser log that was added.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct AddedLog {
    /// Scans in it.
    pub num_scans: usize,
    /// Whether it holds poses that its scans are compared with.
    pub has_poses: bool,
    /// Parts of the log that could not be used, in whole sentences.
    pub losses: Vec<String>,
    /// Other remarks, in whole sentences.
    pub notes: Vec<String>,
}

/// Progress of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct Progress {
    /// The current stage.
    pub stage: Stage,
    /// Number of finished pieces of this stage.
    pub done: usize,
    /// Number of all pieces of this stage.
    pub total: usize,
    /// Index of the frame that the last step registered, or null.
    pub frame: Option<usize>,
}

/// The stages of a run, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Stage {
    /// Registration of frame after frame.
    Register,
    /// Second attempt to register frames that failed before, with the whole map.
    Retry,
    /// Detection of loops, in long sequences.
    Loops,
    /// Joint optimisation of all poses.
    Joint,
    /// Sharpness of the map and errors against the reference.
    Evaluate,
    /// The run is complete.
    Done,
}
