//! The result of a reconstruction as plain data, the same for the page, the command line and `report.json`.

use nalgebra::Vector3;
use serde::Serialize;

use crate::evaluation::position_error::PositionError;
use crate::evaluation::sharpness::Sharpness;
use crate::geometry::{Pose2, RigidMotion};
use crate::map::local::PlanarRegistration;
use crate::odometry::assessment::Status;
use crate::odometry::planar::FrameEstimate;
use crate::pipeline::settings::Settings;
use crate::preprocess::clean::CleaningReport;
use crate::registration::icp::IterationRecord;

/// A pose in the plane, or three numbers that belong to one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct PlanarPose {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// Heading, counter-clockwise from x, in (-pi, pi] (rad).
    pub theta: f64,
}

impl From<Pose2> for PlanarPose {
    fn from(pose: Pose2) -> Self {
        Self { x: pose.translation.x, y: pose.translation.y, theta: pose.rotation.angle() }
    }
}

/// What is known of one frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct FrameResult {
    /// Name of the file.
    pub name: String,
    /// Time of the scan (s), from whatever zero the recorder had, or null.
    pub time: Option<f64>,
    /// Pose of the sensor; the world is the frame of the first scan.
    pub T_world_sensor: PlanarPose,
    /// One standard deviation of the registration to the scans before (m, m, rad); null where there is none.
    pub std: Option<PlanarPose>,
    /// How far the pose is to be trusted.
    pub status: Status,
    /// Why it is not good; empty when it is.
    pub reason: String,
    /// Share of the returns that agree with what the scans before saw, 0..=1.
    pub agreement: f64,
    /// The certain piece of the map that the frame belongs to; 0 is the main one. Frames of one piece hang together by
    /// registrations that nothing speaks against, by loops, or by measured motion that is tight enough.
    pub piece: usize,
    /// What was dropped before.
    pub cleaning: CleaningReport,
    /// Pairs within the distance limit.
    pub num_correspondences: usize,
    /// Pairs that counted.
    pub num_inliers: usize,
    /// Inliers over points.
    pub fitness: f64,
    /// Root mean square of the inliers' residuals (m).
    pub inlier_rmse: f64,
    /// Iterations of the registration.
    pub iterations: usize,
    /// Whether its last step was below both limits.
    pub converged: bool,
    /// Unit motion (x, y in the world frame, theta in metres at the points' rms distance) that the walls in view leave
    /// open, or null.
    pub undetermined: Option<PlanarPose>,
    /// Every iteration.
    pub history: Vec<IterationRecord>,
}

impl FrameResult {
    /// Puts together what is known of a frame; `pose` is its present `T_world_sensor`.
    pub fn new(name: &str, cleaning: CleaningReport, estimate: &FrameEstimate, pose: Pose2) -> Self {
        let registration = estimate.registration.as_ref();
        let last = registration.map_or_else(IterationRecord::default, |r| r.last);
        let open = registration.filter(|r| r.observability.is_undetermined());
        Self {
            name: name.to_owned(),
            time: None,
            T_world_sensor: pose.into(),
            std: registration.and_then(standard_deviation),
            status: estimate.verdict.status,
            reason: estimate.verdict.reason.clone(),
            agreement: estimate.verdict.agreement,
            piece: 0,
            cleaning,
            num_correspondences: last.num_correspondences,
            num_inliers: last.num_inliers,
            fitness: registration.map_or(0.0, |r| r.fitness),
            inlier_rmse: last.inlier_rmse,
            iterations: registration.map_or(0, |r| r.history.len()),
            converged: registration.is_none_or(|r| r.converged),
            undetermined: open.map(|r| planar(&r.observability.weakest_direction)),
            history: registration.map_or_else(Vec::new, |r| r.history.clone()),
        }
    }
}

/// Of the sensor's position and heading in the world frame. The information is of a perturbation about the world's
/// origin; the adjoint of a shift carries it to the sensor.
fn standard_deviation(registration: &PlanarRegistration) -> Option<PlanarPose> {
    let to_sensor =
        Pose2::translation(registration.T_target_source.translation.x, registration.T_target_source.translation.y);
    let adjoint = to_sensor.adjoint();
    let information = adjoint.tr_mul(&(registration.information * adjoint));
    let covariance = information.cholesky()?.inverse();
    Some(planar(&covariance.diagonal().map(f64::sqrt)))
}

/// From a tangent vector, rotation first.
fn planar(tangent: &Vector3<f64>) -> PlanarPose {
    PlanarPose { theta: tangent[0], x: tangent[1], y: tangent[2] }
}

/// Everything that is known of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct ReconstructionResult {
    /// Version of the engine.
    pub version: &'static str,
    /// The settings of the run.
    pub settings: Settings,
    /// One entry a scan, as far as the run has come.
    pub frames: Vec<FrameResult>,
    /// Iterations of the joint solution; empty without one.
    pub joint_history: Vec<IterationRecord>,
    /// Sharpness of the map, where scans overlap.
    pub sharpness: Option<Sharpness>,
    /// Distance to the reference, where one was given.
    pub comparison: Option<PositionError>,
    /// What else is worth knowing, in whole sentences.
    pub notes: Vec<String>,
}

/// What a laser log gave.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct AddedLog {
    /// Scans in it.
    pub num_scans: usize,
    /// Whether it holds poses that its scans are compared with.
    pub has_poses: bool,
    /// What is worth knowing, in whole sentences.
    pub notes: Vec<String>,
}

/// How far a run has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct Progress {
    /// What is being done.
    pub stage: Stage,
    /// Pieces of this stage that are done ...
    pub done: usize,
    /// ... of so many.
    pub total: usize,
    /// The frame that the last step registered, or null.
    pub frame: Option<usize>,
}

/// The stages of a run, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Stage {
    /// Scan by scan.
    Register,
    /// Frames that could not be placed when it was their turn, once more, now that all is known.
    Retry,
    /// Places that come into view again, in long sequences.
    Loops,
    /// All poses together.
    Joint,
    /// Sharpness and distances.
    Evaluate,
    /// Nothing is left to do.
    Done,
}
