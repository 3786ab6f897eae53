//! Reconstruction of planar scans for JavaScript: settings, steps and results.

use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::thrown::Thrown;

use crate::memory::grow_ahead;
use crate::occupancy_grid::OccupancyGrid;
use crate::{from_object, plain, read_ply};
use scanstitch::io::{ply, trajectory};
use scanstitch::map::occupancy_grid::RESOLUTION;
use scanstitch::pipeline::planar::{Reconstruction as Engine, ScanToMap as Pair};
use scanstitch::pipeline::report::{FrameResult, PlanarPose, Progress, ReconstructionResult};
use scanstitch::pipeline::settings::{Preset, SettingDescription, Settings, descriptions};
use scanstitch::preprocess::clean::CleaningReport;
use scanstitch::registration::icp::IterationRecord;

type PlanarFrame = FrameResult<PlanarPose, CleaningReport>;

#[wasm_bindgen]
extern "C" {
    /// Any subset of the settings; missing ones have their default values.
    #[wasm_bindgen(typescript_type = "Partial<Settings>")]
    pub type PartialSettings;
}

/// Every setting of a reconstruction, with its limits and a line of explanation.
///
/// # Errors
/// No input causes an error.
#[wasm_bindgen]
pub fn describe_settings() -> Result<Vec<Ts<SettingDescription>>, Thrown> {
    Ok(descriptions().iter().map(plain).collect())
}

/// Presets of the settings; the first is the default.
///
/// # Errors
/// No input causes an error.
#[wasm_bindgen(unchecked_return_type = "Preset<Settings>[]")]
pub fn presets() -> Result<Vec<Ts<Preset<Settings>>>, Thrown> {
    Ok(scanstitch::pipeline::settings::presets().iter().map(plain).collect())
}

/// A registration of a run: a scan, and the local map to which it was registered. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct ScanToMap {
    pair: Pair,
}

#[wasm_bindgen]
impl ScanToMap {
    /// The scan after cleaning, in its sensor frame: x y z x y z ... (m).
    pub fn source(&self) -> Vec<f32> {
        bytemuck::cast_slice(&self.pair.source.positions).to_vec()
    }

    /// The points of the local map, in its frame: x y z x y z ... (m).
    pub fn target(&self) -> Vec<f32> {
        bytemuck::cast_slice(&self.pair.target.positions).to_vec()
    }

    /// Unit normals of the local map, NaN where a point has none; undefined where the metric needs none.
    pub fn target_normals(&self) -> Option<Vec<f32>> {
        self.pair.target.normals.as_deref().map(|normals| bytemuck::cast_slice(normals).to_vec())
    }

    /// The initial pose of the registration: 4 x 4, row by row.
    pub fn init_T_target_source(&self) -> Vec<f64> {
        self.pair.init_T_target_source.to_vec()
    }
}

/// A reconstruction of planar scans: add scans, call `step()` until its stage is `done`, call `result()` at any time.
/// Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct Reconstruction {
    pub(crate) engine: Engine,
}

#[wasm_bindgen]
impl Reconstruction {
    /// A reconstruction without scans.
    ///
    /// # Errors
    /// When a setting is unknown or out of its limits.
    #[wasm_bindgen(constructor)]
    pub fn new(settings: Option<PartialSettings>) -> Result<Reconstruction, Thrown> {
        let begin = if cfg!(feature = "full") { Engine::new } else { Engine::without_joining };
        Ok(Self { engine: begin(from_object(settings.map(JsValue::from))?)? })
    }

    /// Adds the next scan, a PLY file, and restarts the run.
    ///
    /// # Errors
    /// When the file is not a valid planar scan; scans added before are kept.
    pub fn add_scan(&mut self, name: &str, bytes: &[u8]) -> Result<Ts<CleaningReport>, Thrown> {
        let cloud = read_ply(name, bytes)?;
        Ok(plain(&self.engine.add_scan(name, cloud)?))
    }

    /// Keeps the scans and restarts the run with these settings; missing ones have their default values.
    ///
    /// # Errors
    /// When a setting is unknown or out of its limits; the old settings are then kept.
    pub fn set_settings(&mut self, settings: PartialSettings) -> Result<(), Thrown> {
        Ok(self.engine.set_settings(from_object(Some(settings.into()))?)?)
    }

    /// Sets the reference trajectory, in any readable format, which is used for the comparison only.
    ///
    /// # Errors
    /// When the file is not a trajectory.
    pub fn set_reference(&mut self, name: &str, bytes: &[u8]) -> Result<(), Thrown> {
        let contents = trajectory::read_lenient(bytes, None).map_err(|error| error.in_file(name))?;
        self.engine.set_reference(name, contents);
        Ok(())
    }

    /// Removes the reference.
    pub fn clear_reference(&mut self) {
        self.engine.clear_reference();
    }

    /// Does one bounded step of the run.
    ///
    /// # Errors
    /// No input causes an error.
    pub fn step(&mut self) -> Result<Ts<Progress>, Thrown> {
        grow_ahead();
        Ok(plain(&self.engine.step()))
    }

    /// The result so far.
    ///
    /// # Errors
    /// No input causes an error.
    pub fn result(&self) -> Result<Ts<ReconstructionResult>, Thrown> {
        Ok(plain(&self.engine.result()))
    }

    /// The result with an empty `history` of every frame, since the iterations are most of the data of long logs.
    ///
    /// # Errors
    /// No input causes an error.
    pub fn summary(&self) -> Result<Ts<ReconstructionResult>, Thrown> {
        let mut result = self.engine.result();
        result.frames.iter_mut().for_each(|frame| frame.history = Vec::new());
        Ok(plain(&result))
    }

    /// The results of the frames from this one on, with an empty `history` of each.
    ///
    /// # Errors
    /// No input causes an error.
    #[wasm_bindgen(unchecked_return_type = "FrameResult<PlanarPose, CleaningReport, PlanarPose>[]")]
    pub fn frames_from(&self, first: usize) -> Result<Vec<Ts<PlanarFrame>>, Thrown> {
        let frames = self.engine.frames_from(first).into_iter();
        Ok(frames.map(|frame| plain(&PlanarFrame { history: Vec::new(), ..frame })).collect())
    }

    /// Iterations of a frame's registration; none where there was no registration.
    ///
    /// # Errors
    /// No input causes an error.
    pub fn history(&self, frame: usize) -> Result<Vec<Ts<IterationRecord>>, Thrown> {
        Ok(self.engine.history(frame).iter().map(plain).collect())
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

    /// Number of points of the map from each of the frames from `first` on.
    pub fn map_sizes(&self, first: usize) -> Vec<u32> {
        self.engine.map_sizes_from(first)
    }

    /// The occupancy grid of a piece of the map, by default of the main one, with cells of this side (m; 0.05 by default).
    pub fn occupancy_grid(&self, resolution: Option<f64>, piece: Option<usize>) -> OccupancyGrid {
        OccupancyGrid { grid: self.engine.occupancy_grid_of(piece.unwrap_or(0), resolution.unwrap_or(RESOLUTION)) }
    }

    /// Numbers of the certain pieces of the map that are more than one scan, the main one first, whatever it is.
    pub fn pieces(&self) -> Vec<usize> {
        self.engine.pieces()
    }

    /// Points of a frame and their partners in the scans before it: x y of the point, x y of the partner, ... in the
    /// world frame (m).
    pub fn correspondences(&self, frame: usize) -> Vec<f32> {
        let pairs = self.engine.correspondences(frame);
        pairs.iter().flatten().flat_map(|p| [p.x as f32, p.y as f32]).collect()
    }

    /// A frame's registration before the joint optimisation, for `register` and `IcpLab` with the options of the settings.
    /// Undefined where there was none.
    pub fn scan_to_map(&self, frame: usize) -> Option<ScanToMap> {
        self.engine.scan_to_map(frame).map(|pair| ScanToMap { pair })
    }

    /// The trajectory in TUM's format: t x y z qx qy qz qw, one line per frame, t being the time of the log (s), or the number of
    /// the frame where there is none.
    pub fn trajectory_tum(&self) -> String {
        self.engine.trajectory_tum()
    }

    /// The trajectory as a text with a 4 x 4 matrix per frame.
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
