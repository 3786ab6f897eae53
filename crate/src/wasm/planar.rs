//! A reconstruction of planar scans for JavaScript: its settings, its steps, what comes out.

use tsify::Ts;
use wasm_bindgen::prelude::*;

use super::memory::grow_ahead;
use super::occupancy_grid::OccupancyGrid;
use super::{from_object, plain, read_ply, thrown};
use crate::io::{ply, trajectory};
use crate::map::occupancy_grid::RESOLUTION;
use crate::pipeline::planar::{Reconstruction as Engine, ScanToMap as Pair};
use crate::pipeline::report::{FrameResult, PlanarPose, Progress, ReconstructionResult};
use crate::pipeline::settings::{Preset, SettingDescription, Settings, descriptions};
use crate::preprocess::clean::CleaningReport;
use crate::registration::icp::IterationRecord;

type PlanarFrame = FrameResult<PlanarPose, CleaningReport>;

#[wasm_bindgen]
extern "C" {
    /// Some of the settings; the others have their defaults.
    #[wasm_bindgen(typescript_type = "Partial<Settings>")]
    pub type PartialSettings;
}

/// Every setting of a reconstruction, with its limits and a line of explanation.
///
/// # Errors
/// Never for the input's sake.
#[wasm_bindgen]
pub fn describe_settings() -> Result<Vec<Ts<SettingDescription>>, JsValue> {
    descriptions().iter().map(plain).collect()
}

/// Settings for one purpose each; the first is the default.
///
/// # Errors
/// Never for the input's sake.
#[wasm_bindgen(unchecked_return_type = "Preset<Settings>[]")]
pub fn presets() -> Result<Vec<Ts<Preset<Settings>>>, JsValue> {
    crate::pipeline::settings::presets().iter().map(plain).collect()
}

/// A registration of a run as it was done: a scan, and the map of the scans before it as it was at that time. Call `free()`
/// when done.
#[wasm_bindgen]
pub struct ScanToMap {
    pair: Pair,
}

#[wasm_bindgen]
impl ScanToMap {
    /// The scan without what is no measurement, in its sensor's frame: x y z x y z ... (m).
    pub fn source(&self) -> Vec<f32> {
        bytemuck::cast_slice(&self.pair.source.positions).to_vec()
    }

    /// What it was registered to, in the frame of the map: x y z x y z ... (m).
    pub fn target(&self) -> Vec<f32> {
        bytemuck::cast_slice(&self.pair.target.positions).to_vec()
    }

    /// Unit normals of that, NaN where a point has none; undefined where the metric needs none.
    pub fn target_normals(&self) -> Option<Vec<f32>> {
        self.pair.target.normals.as_deref().map(|normals| bytemuck::cast_slice(normals).to_vec())
    }

    /// Where the registration began: 4 x 4, row by row.
    pub fn init_T_target_source(&self) -> Vec<f64> {
        self.pair.init_T_target_source.to_vec()
    }
}

/// A reconstruction of planar scans: add scans, call `step()` until its stage is `done`, ask for `result()` at any time.
/// Call `free()` when done.
#[wasm_bindgen]
pub struct Reconstruction {
    pub(super) engine: Engine,
}

#[wasm_bindgen]
impl Reconstruction {
    /// A reconstruction without scans.
    ///
    /// # Errors
    /// When a setting is unknown or out of its limits.
    #[wasm_bindgen(constructor)]
    pub fn new(settings: Option<PartialSettings>) -> Result<Reconstruction, JsValue> {
        let engine = Engine::new(from_object(settings.map(JsValue::from))?).map_err(|error| thrown(&error))?;
        Ok(Self { engine })
    }

    /// Adds the next scan, a PLY file, and starts over.
    ///
    /// # Errors
    /// When the file is no sound planar scan; what was added before stays.
    pub fn add_scan(&mut self, name: &str, bytes: &[u8]) -> Result<Ts<CleaningReport>, JsValue> {
        let cloud = read_ply(name, bytes)?;
        plain(&self.engine.add_scan(name, cloud).map_err(|error| thrown(&error))?)
    }

    /// Sets the odometry that first guesses come from, and starts over: rows of `id x y theta`, or TUM.
    ///
    /// # Errors
    /// When the file is no trajectory with headings.
    pub fn set_odometry(&mut self, name: &str, bytes: &[u8]) -> Result<(), JsValue> {
        let odometry = trajectory::read(bytes).map_err(|error| thrown(&error.in_file(name)))?;
        self.engine.set_odometry(name, odometry).map_err(|error| thrown(&error))
    }

    /// Forgets the odometry and starts over.
    pub fn clear_odometry(&mut self) {
        self.engine.clear_odometry();
    }

    /// Keeps the scans and starts over with these settings; those not given have their defaults.
    ///
    /// # Errors
    /// When a setting is unknown or out of its limits; the old ones stay.
    pub fn set_settings(&mut self, settings: PartialSettings) -> Result<(), JsValue> {
        self.engine.set_settings(from_object(Some(settings.into()))?).map_err(|error| thrown(&error))
    }

    /// Sets the trajectory to compare with: TUM, or lines of x y z. It is used for nothing else.
    ///
    /// # Errors
    /// When the file is no trajectory.
    pub fn set_reference(&mut self, name: &str, bytes: &[u8]) -> Result<(), JsValue> {
        let reference = trajectory::read(bytes).map_err(|error| thrown(&error.in_file(name)))?;
        self.engine.set_reference(name, reference);
        Ok(())
    }

    /// Forgets the reference.
    pub fn clear_reference(&mut self) {
        self.engine.clear_reference();
    }

    /// One bounded piece of work.
    ///
    /// # Errors
    /// Never for the input's sake.
    pub fn step(&mut self) -> Result<Ts<Progress>, JsValue> {
        grow_ahead();
        plain(&self.engine.step())
    }

    /// What is known so far.
    ///
    /// # Errors
    /// Never for the input's sake.
    pub fn result(&self) -> Result<Ts<ReconstructionResult>, JsValue> {
        plain(&self.engine.result())
    }

    /// The same with an empty `history` of every frame: of long logs the iterations are most of the result.
    ///
    /// # Errors
    /// Never for the input's sake.
    pub fn summary(&self) -> Result<Ts<ReconstructionResult>, JsValue> {
        let mut result = self.engine.result();
        result.frames.iter_mut().for_each(|frame| frame.history = Vec::new());
        plain(&result)
    }

    /// What is known of the frames from this one on, with an empty `history` of each.
    ///
    /// # Errors
    /// Never for the input's sake.
    #[wasm_bindgen(unchecked_return_type = "FrameResult<PlanarPose, CleaningReport>[]")]
    pub fn frames_from(&self, first: usize) -> Result<Vec<Ts<PlanarFrame>>, JsValue> {
        let frames = self.engine.frames_from(first).into_iter();
        frames.map(|frame| plain(&PlanarFrame { history: Vec::new(), ..frame })).collect()
    }

    /// Iterations of a frame's registration; none where there was no registration.
    ///
    /// # Errors
    /// Never for the input's sake.
    pub fn history(&self, frame: usize) -> Result<Vec<Ts<IterationRecord>>, JsValue> {
        self.engine.history(frame).iter().map(plain).collect()
    }

    /// The pose of every frame so far: x y theta x y theta ... (m, m, rad).
    pub fn poses(&self) -> Vec<f64> {
        let poses = self.engine.poses();
        poses.iter().flat_map(|pose| [pose.translation.x, pose.translation.y, pose.rotation.angle()]).collect()
    }

    /// The map: x y x y ... in the world frame (m); of the frames from `first` on, where it is given.
    pub fn map_points(&self, first: Option<usize>) -> Vec<f32> {
        self.engine.map_points_from(first.unwrap_or(0)).into_flattened()
    }

    /// Index of the frame that each point of the map comes from.
    pub fn map_frames(&self) -> Vec<u32> {
        self.engine.map().frames
    }

    /// How many points of the map come from each of the frames from `first` on.
    pub fn map_sizes(&self, first: usize) -> Vec<u32> {
        self.engine.map_sizes_from(first)
    }

    /// What is free, occupied and unknown, in cells of this side (m; 0.05 where none is given).
    pub fn occupancy_grid(&self, resolution: Option<f64>) -> OccupancyGrid {
        OccupancyGrid { grid: self.engine.occupancy_grid(resolution.unwrap_or(RESOLUTION)) }
    }

    /// Points of a frame and their partners in the scans before it: x y of the point, x y of the partner, ... in the
    /// world frame (m).
    pub fn correspondences(&self, frame: usize) -> Vec<f32> {
        let pairs = self.engine.correspondences(frame);
        pairs.iter().flatten().flat_map(|p| [p.x as f32, p.y as f32]).collect()
    }

    /// A frame's registration as the run did it, before all poses were optimised together: for `register` and `IcpLab` with
    /// the settings' options. Undefined where there was none.
    pub fn scan_to_map(&self, frame: usize) -> Option<ScanToMap> {
        self.engine.scan_to_map(frame).map(|pair| ScanToMap { pair })
    }

    /// The trajectory as TUM writes it: t x y z qx qy qz qw, a line a frame; the time is the log's (s), and the number of the
    /// frame where there is none.
    pub fn trajectory_tum(&self) -> String {
        self.engine.trajectory_tum()
    }

    /// The trajectory as one text of a 4 x 4 matrix a frame.
    pub fn trajectory_matrices(&self) -> Vec<String> {
        self.engine.poses_in_space().iter().map(trajectory::matrix_text).collect()
    }

    /// The map as a binary PLY file.
    pub fn map_ply(&self) -> Vec<u8> {
        ply::write(&self.engine.map().to_cloud(), ply::Format::BinaryLittleEndian)
    }

    /// The result as the text of `report.json`.
    pub fn report_json(&self) -> String {
        serde_json::to_string_pretty(&self.engine.result()).unwrap_or_default()
    }
}
