//! The result of a reconstruction in space as plain data, the same for the page, the command line and `report.json`.

use glam::DVec3;
use nalgebra::Translation3;
use serde::Serialize;

use crate::camera::Pinhole;
use crate::evaluation::trajectory_error::TrajectoryError;
use crate::geometry::Pose3;
use crate::graph::loops::spatial::LoopReport;
use crate::pipeline::assumptions::Assumption;
use crate::pipeline::report::{FrameResult, SpatialDeviation, SpatialPose};
use crate::pipeline::spatial_settings::{Quantisation, SpatialSettings};
use crate::pipeline::suggestion::Suggestion;

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
    /// Metres in a unit of the clouds' coordinates, as set or told; null for depth images.
    pub cloud_unit: Option<f64>,
    /// What is taken off the clouds' coordinates (x, y, z in m; whole numbers) where these do not begin at the sensor.
    pub origin: [f64; 3],
    /// How depth was quantised, as set or as found so far; null for clouds.
    pub quantisation: Option<Quantisation>,
    /// What was assumed of the depth images or clouds, as neither a setting nor a file says it.
    pub assumptions: Vec<Assumption>,
    /// Whether the first depth image contradicts the depth scale that is set, and no reference bears it out; a note says how.
    pub is_scale_contradicted: bool,
    /// One entry a registered frame.
    pub frames: Vec<FrameResult<SpatialPose, (), SpatialDeviation>>,
    /// Places that came into view again, and what came of it.
    pub loops: LoopReport,
    /// Points of clouds that are left out of the map, as later sweeps see through the places where they were.
    pub num_moved_points: usize,
    /// Errors against the reference, where one was given and fits.
    pub comparison: Option<TrajectoryError<SpatialPose>>,
    /// What would make the estimate as large as the reference, where they differ by a factor. An offer: the estimate does not
    /// depend on it.
    pub suggestion: Option<Suggestion>,
    /// What else is worth knowing, in whole sentences.
    pub notes: Vec<String>,
}

impl SpatialResult {
    /// The same, in coordinates to which this was added (m).
    #[must_use]
    pub(crate) fn moved(mut self, origin: DVec3) -> Self {
        let moved = |pose: SpatialPose| SpatialPose::from(with_origin(&pose.into(), origin));
        for frame in &mut self.frames {
            frame.T_world_sensor = moved(frame.T_world_sensor);
        }
        for pose in self.comparison.iter_mut().flat_map(|comparison| comparison.reference.iter_mut().flatten()) {
            *pose = moved(*pose);
        }
        self
    }
}

/// A pose where this was added to the coordinates of its world and of its sensor (m).
pub(crate) fn with_origin(pose: &Pose3, origin: DVec3) -> Pose3 {
    let shift = Translation3::new(origin.x, origin.y, origin.z);
    shift * pose * shift.inverse()
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
