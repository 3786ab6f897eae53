//! Trajectories, their evaluation and the sharpness of maps for JavaScript.

use js_sys::{Array, Uint8Array};
use nalgebra::Vector3;
use serde::Serialize;
use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::spatial::PartialSpatialSettings;
use crate::{PointCloud, from_object, plain};
use scanstitch::error::Error;
use scanstitch::evaluation::depth_consistency::ConsistencyReport;
use scanstitch::evaluation::evaluate::{EvaluationOptions, EvaluationSummary, roll_pitch_yaw};
use scanstitch::evaluation::frame_clouds::{FrameResidual, FrameResidualOptions};
use scanstitch::evaluation::map_quality::{MapQuality, MapQualityOptions};
use scanstitch::evaluation::path::Path;
use scanstitch::evaluation::relation_times::time_tolerance;
use scanstitch::evaluation::relations::RelationErrors;
use scanstitch::evaluation::{evaluate as engine, frame_clouds, map_quality as quality, relations as known};
use scanstitch::io::intrinsics;
use scanstitch::io::relations::read as read_relations;
use scanstitch::io::trajectory::{self, Contents, TrajectoryFormat};
use scanstitch::pipeline::depth_consistency as consistency;

#[wasm_bindgen]
extern "C" {
    /// Any subset of the options; missing ones have their default values.
    #[wasm_bindgen(typescript_type = "Partial<EvaluationOptions>")]
    pub type PartialEvaluationOptions;
    /// Any subset of the options; missing ones have their default values.
    #[wasm_bindgen(typescript_type = "Partial<MapQualityOptions>")]
    pub type PartialMapQualityOptions;
    /// Any subset of the options; missing ones have their default values.
    #[wasm_bindgen(typescript_type = "Partial<FrameResidualOptions>")]
    pub type PartialFrameResidualOptions;
    /// File format of a trajectory.
    #[wasm_bindgen(typescript_type = "TrajectoryFormat")]
    pub type FormatName;
    /// Names of files.
    #[wasm_bindgen(typescript_type = "string[]")]
    pub type Names;
    /// Contents of files.
    #[wasm_bindgen(typescript_type = "Uint8Array[]")]
    pub type Files;
}

/// Positions over time, with orientations where the file has them. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct Trajectory {
    contents: Contents,
}

#[wasm_bindgen]
impl Trajectory {
    /// Reads a file; its format is detected unless it is given. `name` is for the messages. Quaternions that are not of unit
    /// length are normalised, which `notes` reports.
    ///
    /// # Errors
    /// When the file is not a trajectory.
    pub fn read(bytes: &[u8], name: &str, format: Option<FormatName>) -> Result<Trajectory, JsValue> {
        let format = format.map(JsValue::from).filter(|format| !format.is_undefined() && !format.is_null());
        let format = format.map(|format| format_named(&format)).transpose()?;
        let contents = trajectory::read_lenient(bytes, format).map_err(|error| error.in_file(name))?;
        Ok(Self { contents })
    }

    /// Reads one file for each frame, in this order, a 4 x 4 matrix in each.
    ///
    /// # Errors
    /// When a file is not a pose; the error names it.
    pub fn read_frames(names: &Names, files: &Files) -> Result<Trajectory, JsValue> {
        if !Array::is_array(names) || !Array::is_array(files) {
            return Err(Error::whole("The names or the files are not an array", "Give an array of each").into());
        }
        let texts: Vec<(String, Vec<u8>)> = Array::from(names)
            .iter()
            .zip(Array::from(files).iter())
            .map(|(name, bytes)| (name.as_string().unwrap_or_default(), Uint8Array::new(&bytes).to_vec()))
            .collect();
        let borrowed: Vec<(&str, &[u8])> =
            texts.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
        Ok(Self { contents: trajectory::read_frames(&borrowed)? })
    }

    /// Sets the times (s) from a file of one number per line, as in KITTI.
    ///
    /// # Errors
    /// When the file has another format or another number of times than there are poses.
    pub fn set_stamps(&mut self, bytes: &[u8], name: &str) -> Result<(), JsValue> {
        let stamps = trajectory::read_times(bytes).map_err(|error| error.in_file(name))?;
        let timed = self.contents.trajectory.clone().with_stamps(stamps);
        self.contents.trajectory = timed.map_err(|error| error.in_file(name))?;
        Ok(())
    }

    /// Number of poses.
    #[wasm_bindgen(getter)]
    pub fn length(&self) -> usize {
        self.contents.trajectory.len()
    }

    /// The format of the file.
    ///
    /// # Errors
    /// No input causes an error.
    #[wasm_bindgen(getter)]
    pub fn format(&self) -> Result<Ts<TrajectoryFormat>, JsValue> {
        Ok(plain(&self.contents.format))
    }

    /// Corrections made while reading, in whole sentences.
    #[wasm_bindgen(getter)]
    pub fn notes(&self) -> Vec<String> {
        self.contents.notes.clone()
    }

    /// Whether it has orientations.
    #[wasm_bindgen(getter)]
    pub fn has_orientations(&self) -> bool {
        self.contents.trajectory.orientations.is_some()
    }

    /// Times (s), where the file has them.
    pub fn stamps(&self) -> Option<Vec<f64>> {
        self.contents.trajectory.stamps.clone()
    }

    /// Positions x y z x y z ... (m).
    pub fn positions(&self) -> Vec<f64> {
        flat(&self.contents.trajectory.positions)
    }

    /// A file in this format.
    ///
    /// # Errors
    /// When the format is unknown, or needs orientations and there are none.
    pub fn write(&self, format: &FormatName) -> Result<Vec<u8>, JsValue> {
        let format = format_named(&JsValue::from(format))?;
        Ok(trajectory::write(&self.contents.trajectory, format)?)
    }
}

/// An estimate compared with the reference. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct Evaluation {
    evaluation: engine::Evaluation,
}

#[wasm_bindgen]
impl Evaluation {
    /// The statistics.
    ///
    /// # Errors
    /// No input causes an error.
    pub fn summary(&self) -> Result<Ts<EvaluationSummary>, JsValue> {
        Ok(plain(&self.evaluation.summary))
    }

    /// The errors, in `summary().unit`.
    pub fn errors(&self) -> Vec<f64> {
        self.evaluation.errors.clone()
    }

    /// For each error the index of its pose among the matched ones; for a pair of poses that of the second.
    pub fn error_poses(&self) -> Vec<u32> {
        self.evaluation.error_poses.iter().map(|&pose| pose as u32).collect()
    }

    /// For each matched pose its index in the reference.
    pub fn matched_reference(&self) -> Vec<u32> {
        self.evaluation.matched.iter().map(|pair| pair.reference as u32).collect()
    }

    /// For each matched pose its index in the estimate.
    pub fn matched_estimate(&self) -> Vec<u32> {
        self.evaluation.matched.iter().map(|pair| pair.estimate as u32).collect()
    }

    /// Times of the matched poses of the reference (s), where it has them.
    pub fn stamps(&self) -> Option<Vec<f64>> {
        self.evaluation.reference.stamps.clone()
    }

    /// Path length up to each matched pose of the reference (m).
    pub fn distances(&self) -> Vec<f64> {
        self.evaluation.reference.distances()
    }

    /// x y z x y z ... of the matched poses of the reference (m).
    pub fn reference_positions(&self) -> Vec<f64> {
        flat(&self.evaluation.reference.positions)
    }

    /// x y z x y z ... of the matched poses of the estimate, aligned (m).
    pub fn estimate_positions(&self) -> Vec<f64> {
        flat(&self.evaluation.estimate.positions)
    }

    /// Roll pitch yaw roll pitch yaw ... of the matched poses of the reference (rad), where orientations are known.
    pub fn reference_roll_pitch_yaw(&self) -> Option<Vec<f64>> {
        angles(&self.evaluation.reference)
    }

    /// Roll pitch yaw roll pitch yaw ... of the matched poses of the estimate, aligned (rad), where orientations are
    /// known.
    pub fn estimate_roll_pitch_yaw(&self) -> Option<Vec<f64>> {
        angles(&self.evaluation.estimate)
    }
}

/// Compares an estimate with the reference.
///
/// # Errors
/// When no poses correspond, fewer than three are to be aligned, the metric needs times or orientations that a
/// trajectory lacks, or an option is unknown.
#[wasm_bindgen]
pub fn evaluate(
    reference: &Trajectory,
    estimate: &Trajectory,
    options: Option<PartialEvaluationOptions>,
) -> Result<Evaluation, JsValue> {
    let options: EvaluationOptions = from_object(options.map(JsValue::from))?;
    let evaluation = engine::evaluate(&reference.contents.trajectory, &estimate.contents.trajectory, &options);
    Ok(Evaluation { evaluation: evaluation? })
}

/// The options' defaults, which are those of evo's `evo_ape`.
///
/// # Errors
/// No input causes an error.
#[wasm_bindgen]
pub fn evaluation_defaults() -> Result<Ts<EvaluationOptions>, JsValue> {
    Ok(plain(&EvaluationOptions::default()))
}

/// Errors of an estimate against given relations, a file of `EDGE2`, `EDGE_SE3:QUAT` or `time_i time_j dx dy dz roll pitch yaw`
/// lines. For the latter, `offset` (s) is added to the estimate's times, and the pose of a time is the nearest within `max_diff`
/// (s; by default half the interval of the estimate's times, but at most 0.1 s). With `loops_only`, relations between one pose
/// and the next are left out.
///
/// # Errors
/// When the file has another format, or no relation can be compared.
#[wasm_bindgen]
pub fn relation_errors(
    estimate: &Trajectory,
    relations: &[u8],
    name: &str,
    max_diff: Option<f64>,
    loops_only: bool,
    offset: Option<f64>,
) -> Result<Ts<RelationErrors>, JsValue> {
    let mut relations = read_relations(relations).map_err(|error| error.in_file(name))?;
    relations.retain(|relation| !(loops_only && relation.is_step()));
    let trajectory = &estimate.contents.trajectory;
    let mut path = Path::of(trajectory, 0..trajectory.len());
    for stamp in path.stamps.iter_mut().flatten() {
        *stamp += offset.unwrap_or(0.0);
    }
    let max_diff = max_diff.unwrap_or_else(|| time_tolerance(path.stamps.as_deref().unwrap_or_default()));
    Ok(plain(&known::relation_errors(&relations, &path, max_diff).map_err(|error| error.in_file(name))?))
}

/// Sharpness of a map without a reference: mean map entropy and mean plane variance.
///
/// # Errors
/// When no point has enough neighbours.
#[wasm_bindgen]
pub fn map_quality(map: &PointCloud, options: Option<PartialMapQualityOptions>) -> Result<Ts<MapQuality>, JsValue> {
    let options: MapQualityOptions = from_object(options.map(JsValue::from))?;
    let points: Vec<[f32; 3]> = map.cloud.positions.iter().map(glam::Vec3::to_array).collect();
    Ok(plain(&quality_of(&points, map.cloud.is_planar(), &options)?))
}

fn quality_of(points: &[[f32; 3]], is_planar: bool, options: &MapQualityOptions) -> Result<MapQuality, JsValue> {
    let found = if is_planar {
        let flat: Vec<[f32; 2]> = points.iter().map(|&[x, y, _]| [x, y]).collect();
        quality::map_quality(&flat, options)
    } else {
        quality::map_quality(points, options)
    };
    Ok(found?)
}

#[wasm_bindgen]
impl PointCloud {
    /// Reads a PLY or PCD file; `name` is for the messages.
    ///
    /// # Errors
    /// When the file has neither format, or is damaged.
    pub fn read(bytes: &[u8], name: &str) -> Result<PointCloud, JsValue> {
        Ok(Self { cloud: scanstitch::io::point_cloud::read(bytes).map_err(|error| error.in_file(name))? })
    }
}

/// How well the frames of a recording overlay at the poses of a trajectory.
#[derive(Serialize, tsify::Tsify)]
pub struct FrameQuality {
    /// Residual between overlapping frames.
    pub residual: FrameResidual,
    /// Sharpness of the map of all frames.
    pub map: MapQuality,
}

/// The clouds of the frames of a recording, each in its sensor frame, for the evaluation of trajectories without a reference.
/// Call `free()` when it is no longer used.
#[wasm_bindgen]
#[derive(Default)]
pub struct FrameClouds {
    clouds: frame_clouds::FrameClouds,
    is_planar: bool,
}

#[wasm_bindgen]
impl FrameClouds {
    /// Without frames.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Self {
        Self { clouds: frame_clouds::FrameClouds::new(), is_planar: true }
    }

    /// Adds the next frame: a planar scan or a cloud in space. `name` is for the messages.
    ///
    /// # Errors
    /// When the cloud has no finite point.
    pub fn add(&mut self, cloud: &PointCloud, name: &str) -> Result<(), JsValue> {
        self.clouds.push(&cloud.cloud).map_err(|error| error.in_file(name))?;
        self.is_planar &= cloud.cloud.is_planar();
        Ok(())
    }

    /// Number of frames.
    #[wasm_bindgen(getter)]
    pub fn length(&self) -> usize {
        self.clouds.len()
    }

    /// The metrics at the poses of a trajectory, one for each frame, in order.
    ///
    /// # Errors
    /// When the trajectory has no orientations or another number of poses, or no two frames overlap.
    pub fn quality(
        &self,
        trajectory: &Trajectory,
        residual_options: Option<PartialFrameResidualOptions>,
        map_options: Option<PartialMapQualityOptions>,
    ) -> Result<Ts<FrameQuality>, JsValue> {
        let residual_options: FrameResidualOptions = from_object(residual_options.map(JsValue::from))?;
        let map_options: MapQualityOptions = from_object(map_options.map(JsValue::from))?;
        let poses = trajectory.contents.trajectory.poses().ok_or_else(|| {
            let problem = "The trajectory has positions alone, and frames cannot be placed by them";
            JsValue::from(Error::whole(problem, "Give a trajectory with orientations"))
        })?;
        let residual = self.clouds.residual(&poses, &residual_options)?;
        let points = self.clouds.map(&poses)?;
        Ok(plain(&FrameQuality { residual, map: quality_of(&points, self.is_planar, &map_options)? }))
    }
}

/// How well consecutive depth images of a recording agree at the poses of a trajectory: add or skip every frame in order, then
/// ask for the report. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct DepthConsistency {
    comparison: consistency::DepthConsistency,
}

#[wasm_bindgen]
impl DepthConsistency {
    /// For a recording of `num_frames` frames, taken at `times` (s) where they are known. Of the `settings` of a reconstruction,
    /// those of camera, depth and reference poses are used.
    ///
    /// # Errors
    /// When a setting is unknown or out of its limits, the trajectory has no orientations, or the pose of each frame cannot be
    /// determined.
    #[wasm_bindgen(constructor)]
    #[allow(clippy::needless_pass_by_value, reason = "optional arrays cross by value")]
    pub fn new(
        trajectory: &Trajectory,
        num_frames: usize,
        times: Option<Vec<f64>>,
        settings: Option<PartialSpatialSettings>,
    ) -> Result<DepthConsistency, JsValue> {
        let settings = from_object(settings.map(JsValue::from))?;
        let comparison =
            consistency::DepthConsistency::new(settings, &trajectory.contents, num_frames, times.as_deref());
        Ok(Self { comparison: comparison? })
    }

    /// Reads the camera from a file beside the images, unless the settings have one. To be called before the first frame.
    ///
    /// # Errors
    /// When the file has no camera, or after the first frame.
    pub fn set_intrinsics(&mut self, name: &str, bytes: &[u8]) -> Result<(), JsValue> {
        let camera = intrinsics::read(bytes).map_err(|error| error.in_file(name))?;
        Ok(self.comparison.set_intrinsics(camera)?)
    }

    /// Adds the next depth image, PNG or PGM. A refused image counts as a skipped frame.
    ///
    /// # Errors
    /// When it is damaged, has no depth, or differs from the first one in size.
    pub fn add(&mut self, name: &str, bytes: &[u8]) -> Result<(), JsValue> {
        Ok(self.comparison.add(name, bytes)?)
    }

    /// Skips the next frame, for example because its file cannot be read.
    pub fn skip(&mut self) {
        self.comparison.skip();
    }

    /// What was assumed of the depth images, and what they say against the settings: a sentence each, after the first frame.
    #[wasm_bindgen(getter)]
    pub fn notes(&self) -> Vec<String> {
        self.comparison.notes().to_vec()
    }

    /// The agreement of all steps so far.
    ///
    /// # Errors
    /// No input causes an error.
    pub fn report(&self) -> Result<Ts<ConsistencyReport>, JsValue> {
        Ok(plain(&self.comparison.report()))
    }
}

fn flat(positions: &[Vector3<f64>]) -> Vec<f64> {
    positions.iter().flat_map(|p| [p.x, p.y, p.z]).collect()
}

fn angles(path: &Path) -> Option<Vec<f64>> {
    roll_pitch_yaw(path).map(|angles| flat(&angles))
}

fn format_named(format: &JsValue) -> Result<TrajectoryFormat, JsValue> {
    let name = format.as_string().unwrap_or_default();
    serde_json::from_value(name.clone().into()).map_err(|_| {
        let remedy = "Use tum, kitti, euroc, pose_table, matrices, npy, positions or planar";
        JsValue::from(Error::whole(format!("\"{name}\" is not a trajectory format"), remedy))
    })
}
