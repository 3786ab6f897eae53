//! The engine as JavaScript sees it: bytes and plain objects in, typed arrays and plain objects out.
//!
//! One call a cloud, never one a point. Returned arrays are copies: a view into the engine's memory is lost when that
//! memory grows. Whatever is thrown is an `Error` named `ScanstitchError` with the fields `file`, `place`, `problem` and
//! `remedy`.

use js_sys::{JSON, Object, Reflect};
use serde::Serialize;
use serde::de::DeserializeOwned;
use tsify::{Ts, Tsify};
use wasm_bindgen::prelude::*;

use crate::cloud_registration::{RegistrationOptions, RegistrationResult, register_clouds};
use crate::error::{Error, Place};
use crate::geometry::PointCloud as Cloud;
use crate::io::laser_log;
use crate::io::ply;
use crate::io::point_cloud::{self, CloudFormat};
use crate::io::trajectory;
use crate::occupancy_grid::RESOLUTION;
use crate::preprocess::clean::CleaningReport;
use crate::reconstruction::Reconstruction as Engine;
use crate::report::{AddedLog, Progress, ReconstructionResult};
use crate::settings::{Preset, SettingDescription, descriptions};

mod bev;
mod evaluation;
mod spatial;
mod strategies;

#[wasm_bindgen(typescript_custom_section)]
const TYPES: &str = "
/** Every error that the engine throws. */
export interface ScanstitchError extends Error {
  name: 'ScanstitchError';
  file: string | null;
  place: { line: number } | { byte: number } | null;
  problem: string;
  remedy: string;
}
";

#[wasm_bindgen]
extern "C" {
    /// Some of the settings; the others have their defaults.
    #[wasm_bindgen(typescript_type = "Partial<Settings>")]
    pub type PartialSettings;
    /// Some of the options; the others have their defaults.
    #[wasm_bindgen(typescript_type = "Partial<RegistrationOptions>")]
    pub type PartialRegistrationOptions;
    /// How a PLY file holds its numbers.
    #[wasm_bindgen(typescript_type = "'ascii' | 'binary_little_endian'")]
    pub type PlyFormat;
    /// A format of clouds: PLY or PCD, as text or binary; `ply` and `pcd` are the binary ones.
    #[wasm_bindgen(
        typescript_type = "'ply' | 'ply_ascii' | 'ply_binary' | 'pcd' | 'pcd_ascii' | 'pcd_binary' | 'pcd_binary_compressed'"
    )]
    pub type MapFormat;
}

/// Makes a panic, which would be a defect of the engine, say where it happened.
#[wasm_bindgen(start)]
pub fn start() {
    console_error_panic_hook::set_once();
}

/// Version of the engine.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
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
#[wasm_bindgen]
pub fn presets() -> Result<Vec<Ts<Preset>>, JsValue> {
    crate::settings::presets().iter().map(plain).collect()
}

/// Points in metres, with normals and colours where the file had them. Call `free()` when done.
#[wasm_bindgen]
pub struct PointCloud {
    cloud: Cloud,
}

#[wasm_bindgen]
impl PointCloud {
    /// Reads a PLY file; `name` is for the messages.
    ///
    /// # Errors
    /// When the file is no sound PLY file.
    pub fn from_ply(bytes: &[u8], name: &str) -> Result<PointCloud, JsValue> {
        Ok(Self { cloud: read_ply(name, bytes)? })
    }

    /// From x y z x y z ... (m); what is left of an incomplete point is an error.
    ///
    /// # Errors
    /// When the length is no multiple of three.
    pub fn from_positions(xyz: &[f32]) -> Result<PointCloud, JsValue> {
        if !xyz.len().is_multiple_of(3) {
            let problem = format!("{} numbers are no whole points", xyz.len());
            return Err(thrown(&Error::whole(problem, "Give x, y and z of every point")));
        }
        Ok(Self { cloud: Cloud::from_positions(xyz.chunks_exact(3).map(glam::Vec3::from_slice).collect()) })
    }

    /// Number of points.
    #[wasm_bindgen(getter)]
    pub fn length(&self) -> usize {
        self.cloud.len()
    }

    /// Whether all points lie in the plane z = 0, as a planar laser's do.
    #[wasm_bindgen(getter)]
    pub fn is_planar(&self) -> bool {
        self.cloud.is_planar()
    }

    /// x y z x y z ... (m), relative to `origin()`.
    pub fn positions(&self) -> Vec<f32> {
        bytemuck::cast_slice(&self.cloud.positions).to_vec()
    }

    /// What to add to every position (m): zero but for clouds in map coordinates.
    pub fn origin(&self) -> Vec<f64> {
        self.cloud.origin.to_array().to_vec()
    }

    /// Unit normals, x y z x y z ..., where the file had them.
    pub fn normals(&self) -> Option<Vec<f32>> {
        self.cloud.normals.as_deref().map(|normals| bytemuck::cast_slice(normals).to_vec())
    }

    /// Red, green, blue, red, ... where the file had them.
    pub fn colors(&self) -> Option<Vec<u8>> {
        self.cloud.colors.as_deref().map(|colors| bytemuck::cast_slice(colors).to_vec())
    }

    /// A PLY file of the cloud.
    ///
    /// # Errors
    /// When the format is unknown.
    pub fn to_ply(&self, format: &PlyFormat) -> Result<Vec<u8>, JsValue> {
        let format = match JsValue::from(format).as_string().as_deref() {
            Some("ascii") => ply::Format::Ascii,
            Some("binary_little_endian") => ply::Format::BinaryLittleEndian,
            other => {
                let problem = format!("{other:?} is no format of a PLY file");
                return Err(thrown(&Error::whole(problem, "Use \"ascii\" or \"binary_little_endian\"")));
            }
        };
        Ok(ply::write(&self.cloud, format))
    }
}

/// Registers `source` to `target`: in the plane when both are planar, in space otherwise.
///
/// # Errors
/// When a cloud has no points, when only one is planar, or when the options do not fit.
#[wasm_bindgen]
pub fn register(
    source: &PointCloud,
    target: &PointCloud,
    options: Option<PartialRegistrationOptions>,
) -> Result<Ts<RegistrationResult>, JsValue> {
    let options: RegistrationOptions = from_object(options.map(JsValue::from))?;
    plain(&register_clouds(&source.cloud, &target.cloud, &options).map_err(|error| thrown(&error))?)
}

/// A reconstruction of planar scans: add scans, call `step()` until its stage is `done`, ask for `result()` at any time.
/// Call `free()` when done.
#[wasm_bindgen]
pub struct Reconstruction {
    engine: Engine,
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

    /// Adds all scans of a laser log, CARMEN's text or CSM's JSON, and starts over. Their poses are not used for the
    /// estimate, unless the setting `odometry` asks for it.
    ///
    /// # Errors
    /// When the file is no sound log; what was added before stays.
    pub fn add_log(&mut self, name: &str, bytes: &[u8]) -> Result<Ts<AddedLog>, JsValue> {
        let log = laser_log::read(bytes).map_err(|error| thrown(&error.in_file(name)))?;
        plain(&self.engine.add_log(name, &log))
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
        plain(&self.engine.step())
    }

    /// What is known so far.
    ///
    /// # Errors
    /// Never for the input's sake.
    pub fn result(&self) -> Result<Ts<ReconstructionResult>, JsValue> {
        plain(&self.engine.result())
    }

    /// The map: x y x y ... in the world frame (m).
    pub fn map_points(&self) -> Vec<f32> {
        bytemuck::cast_slice(&self.engine.map().points).to_vec()
    }

    /// Index of the frame that each point of the map comes from.
    pub fn map_frames(&self) -> Vec<u32> {
        self.engine.map().frames
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

    /// The trajectory as TUM writes it: frame x y z qx qy qz qw, a line a frame.
    pub fn trajectory_tum(&self) -> String {
        trajectory::tum_text(None, &self.engine.poses_in_space())
    }

    /// The trajectory as one text of a 4 x 4 matrix a frame.
    pub fn trajectory_matrices(&self) -> Vec<String> {
        self.engine.poses_in_space().iter().map(trajectory::matrix_text).collect()
    }

    /// The map as a binary PLY file.
    pub fn map_ply(&self) -> Vec<u8> {
        ply::write(&self.engine.map().to_cloud(), ply::Format::BinaryLittleEndian)
    }

    /// The map as a file of this format.
    ///
    /// # Errors
    /// When there is no such format.
    pub fn map_file(&self, format: &MapFormat) -> Result<Vec<u8>, JsValue> {
        Ok(point_cloud::write(&self.engine.map().to_cloud(), map_format(format)?))
    }

    /// The result as the text of `report.json`.
    pub fn report_json(&self) -> String {
        serde_json::to_string_pretty(&self.engine.result()).unwrap_or_default()
    }
}

/// Whether a file that begins with these bytes is a laser log.
#[wasm_bindgen]
pub fn is_laser_log(head: &[u8]) -> bool {
    laser_log::is_laser_log(head)
}

/// What is free, occupied and unknown. Call `free()` when done.
#[wasm_bindgen]
pub struct OccupancyGrid {
    grid: crate::occupancy_grid::OccupancyGrid,
}

#[wasm_bindgen]
impl OccupancyGrid {
    /// Cells along x.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> usize {
        self.grid.width
    }

    /// Cells along y.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> usize {
        self.grid.height
    }

    /// Side of a cell (m).
    #[wasm_bindgen(getter)]
    pub fn resolution(&self) -> f64 {
        self.grid.resolution
    }

    /// x and y of the corner of the cell with the least of both, in the world frame (m).
    #[wasm_bindgen(getter)]
    pub fn origin(&self) -> Vec<f64> {
        vec![self.grid.origin.x, self.grid.origin.y]
    }

    /// A grey value a cell, row by row from the largest y down: 0 occupied, 254 free, 205 unknown.
    pub fn grey_values(&self) -> Vec<u8> {
        self.grid.grey_values()
    }

    /// The picture as a PGM file.
    pub fn pgm(&self) -> Vec<u8> {
        self.grid.pgm()
    }

    /// The YAML file that ROS's map_server reads beside the picture, whose name it holds.
    pub fn yaml(&self, image: &str) -> String {
        self.grid.yaml(image)
    }
}

fn map_format(format: &MapFormat) -> Result<CloudFormat, JsValue> {
    let name = JsValue::from(format).as_string().unwrap_or_default();
    CloudFormat::named(&name).map_err(|error| thrown(&error))
}

fn read_ply(name: &str, bytes: &[u8]) -> Result<Cloud, JsValue> {
    ply::read(bytes).map_err(|error| thrown(&error.in_file(name)))
}

/// Options from a plain object, by way of its JSON: serde then names unknown fields and wrong types.
fn from_object<T: DeserializeOwned + Default>(object: Option<JsValue>) -> Result<T, JsValue> {
    let Some(object) = object.filter(|value| !value.is_undefined() && !value.is_null()) else {
        return Ok(T::default());
    };
    let json = JSON::stringify(&object).map(String::from)?;
    serde_json::from_str(&json).map_err(|error| {
        let problem = format!("The options are not right: {error}");
        thrown(&Error::whole(problem, "Give only the options that the documentation names"))
    })
}

/// Plain data as a plain object.
fn plain<T: Tsify + Serialize>(data: &T) -> Result<Ts<T>, JsValue> {
    data.into_ts().map_err(|error| JsValue::from(js_sys::Error::new(&error.to_string())))
}

/// The error as JavaScript throws it.
fn thrown(error: &Error) -> JsValue {
    let place = match error.place {
        Place::Whole => JsValue::NULL,
        Place::Line(line) => number_field("line", line),
        Place::Byte(offset) => number_field("byte", offset),
    };
    let thrown = js_sys::Error::new(&error.to_string());
    thrown.set_name("ScanstitchError");
    let file = error.file.as_deref().map_or(JsValue::NULL, JsValue::from_str);
    let fields = [
        ("file", file),
        ("place", place),
        ("problem", error.problem.as_str().into()),
        ("remedy", error.remedy.as_str().into()),
    ];
    for (name, value) in fields {
        set(&thrown, name, &value);
    }
    thrown.into()
}

fn number_field(name: &str, value: usize) -> JsValue {
    let object = Object::new();
    set(&object, name, &JsValue::from_f64(value as f64));
    object.into()
}

/// Setting a field of a fresh object cannot fail.
fn set(object: &Object, name: &str, value: &JsValue) {
    let _ = Reflect::set(object, &JsValue::from_str(name), value);
}
