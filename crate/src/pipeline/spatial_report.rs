//! The result of a reconstruction in space as plain data, the same for the page, the command line and `report.json`.

use serde::Serialize;

use crate::camera::Pinhole;
use crate::evaluation::trajectory_error::TrajectoryError;
use crate::graph::loops::spatial::LoopReport;
use crate::pipeline::assumptions::{Assumption, Suggestion};
use crate::pipeline::report::{FrameResult, SpatialPose};
use crate::pipeline::spatial_settings::{Quantisation, SpatialSettings};

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
    /// Raw depth values per metre, as set or guessed; null for clouds.
    pub depth_scale: Option<f64>,
    /// How depth was quantised, as set or as found so far; null for clouds.
    pub quantisation: Option<Quantisation>,
    /// What was assumed of the depth images, as neither a setting nor a file says it.
    pub assumptions: Vec<Assumption>,
    /// Whether the first depth image contradicts the depth scale that is set, and no reference bears it out; a note says how.
    pub is_scale_contradicted: bool,
    /// One entry a registered frame.
    pub frames: Vec<FrameResult<SpatialPose, ()>>,
    /// Places that came into view again, and what came of it.
    pub loops: LoopReport,
    /// Errors against the reference, where one was given and fits.
    pub comparison: Option<TrajectoryError<SpatialPose>>,
    /// What would make the estimate as large as the reference, where they differ by a factor. An offer: the estimate does not
    /// depend on it.
    pub suggestion: Option<Suggestion>,
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
