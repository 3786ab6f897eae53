//! Reconstruction in space for JavaScript: frames are prepared in any worker and registered in one.

use std::cell::RefCell;

use js_sys::{Float32Array, Int16Array, Uint8Array, Uint32Array};
use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::thrown::Thrown;

use crate::memory::grow_ahead;
use crate::occupancy_grid::OccupancyGrid;
use crate::point_cloud::{MapFormat, map_format};
use crate::{from_object, plain};
use scanstitch::error::Error;
use scanstitch::geometry::{PointCloud, Pose3};
use scanstitch::io::{depth_image, intrinsics, pcd, ply, point_cloud, trajectory};
use scanstitch::map::occupancy_grid::RESOLUTION;
use scanstitch::map::voxel::VoxelMap;
use scanstitch::pipeline::prepared_frame::{ColorFile, DecodeConfig, FrameLabel, PreparedFrame};
use scanstitch::pipeline::report::Progress;
use scanstitch::pipeline::settings::{Preset, SettingDescription};
use scanstitch::pipeline::spatial::{Floor, SpatialReconstruction as Engine};
use scanstitch::pipeline::spatial_settings::{SpatialSettings, spatial_descriptions};
use scanstitch::pipeline::{MapSize, SpatialResult};

/// Points of the map that are copied to JavaScript in one call.
const SENT_TOGETHER: usize = 1024;

#[wasm_bindgen]
extern "C" {
    /// Any subset of the settings; missing ones have their default values.
    #[wasm_bindgen(typescript_type = "Partial<SpatialSettings>")]
    pub type PartialSpatialSettings;
}

/// Every setting of a reconstruction in space, with its limits and a line of explanation.
///
/// # Errors
/// No input causes an error.
#[wasm_bindgen]
pub fn describe_spatial_settings() -> Result<Vec<Ts<SettingDescription>>, Thrown> {
    Ok(spatial_descriptions().iter().map(plain).collect())
}

/// Presets of the settings in space; the first is the default.
///
/// # Errors
/// No input causes an error.
#[wasm_bindgen(unchecked_return_type = "Preset<SpatialSettings>[]")]
pub fn spatial_presets() -> Result<Vec<Ts<Preset<SpatialSettings>>>, Thrown> {
    Ok(scanstitch::pipeline::spatial_settings::spatial_presets().iter().map(plain).collect())
}

/// A depth image as it is in its file. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct DepthPixels {
    image: scanstitch::camera::DepthImage,
}

#[wasm_bindgen]
impl DepthPixels {
    /// Pixels in a row.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> usize {
        self.image.width
    }

    /// Rows.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> usize {
        self.image.height
    }

    /// Bits of a raw value: 8 or 16.
    #[wasm_bindgen(getter)]
    pub fn bits(&self) -> u8 {
        self.image.bits
    }

    /// Raw values, row by row; 0 without a measurement.
    pub fn values(&self) -> Vec<u16> {
        self.image.values.clone()
    }

    /// The image in these colours, from near to far.
    pub fn picture(&self, colors: &[u32]) -> DepthPicture {
        DepthPicture { picture: self.image.picture(colors) }
    }
}

/// A depth image in colours. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct DepthPicture {
    picture: scanstitch::camera::DepthPicture,
}

#[wasm_bindgen]
impl DepthPicture {
    /// A colour for each pixel, row by row; 0 without a measurement.
    pub fn pixels(&self) -> Vec<u32> {
        self.picture.pixels.clone()
    }

    /// Raw value of the first colour, the first percentile.
    #[wasm_bindgen(getter)]
    pub fn near(&self) -> u16 {
        self.picture.near
    }

    /// Raw value of the last colour, the 99th percentile.
    #[wasm_bindgen(getter)]
    pub fn far(&self) -> u16 {
        self.picture.far
    }

    /// Number of pixels without a measurement.
    #[wasm_bindgen(getter)]
    pub fn num_invalid(&self) -> usize {
        self.picture.num_invalid
    }
}

/// Decodes a depth image, PNG or PGM.
///
/// # Errors
/// When the file is not a valid depth image.
#[wasm_bindgen]
pub fn decode_depth(name: &str, bytes: &[u8]) -> Result<DepthPixels, Thrown> {
    let image = depth_image::read(bytes).map_err(|error| error.in_file(name))?;
    Ok(DepthPixels { image })
}

/// Prepares a depth image for registration, in any worker. `decode_config` is the result of `begin`; `index` is the frame's index
/// in the recording, `time` its time stamp (s), where known; `color` is the file of its colours, `color_name` its name in notes,
/// and `color_problem` the reason, with the name, if it could not be read. Returns bytes for `add_prepared`, at the beginning
/// of `into` where that is given and large enough: a buffer that was passed to `add_prepared` can be reused.
///
/// # Errors
/// When the depth image is damaged, has no depth, or differs from the first one in size.
#[wasm_bindgen]
#[allow(clippy::needless_pass_by_value, reason = "optional arrays cross by value")]
#[allow(clippy::too_many_arguments, reason = "an object of them would have to be taken apart here")]
pub fn prepare_frame(
    decode_config: &str,
    name: &str,
    index: usize,
    time: Option<f64>,
    depth: &[u8],
    color: Option<Vec<u8>>,
    color_name: Option<String>,
    color_problem: Option<String>,
    into: Option<Uint8Array>,
) -> Result<Uint8Array, Thrown> {
    let label = FrameLabel { name: name.to_owned(), index, time };
    with_decode_config(decode_config, into, |decode_config| {
        let name = color_name.as_deref().unwrap_or("its colour image");
        let bytes = color.as_deref().map(Ok).or(color_problem.as_deref().map(Err));
        let color = bytes.map(|bytes| ColorFile { name, bytes });
        PreparedFrame::from_depth(decode_config, label, depth, color)
    })
}

/// Prepares a cloud, PLY or PCD, for registration, in any worker; parameters as in [`prepare_frame`].
///
/// # Errors
/// When the file is damaged or has no points in range.
#[wasm_bindgen]
pub fn prepare_cloud(
    decode_config: &str,
    name: &str,
    index: usize,
    time: Option<f64>,
    cloud: &[u8],
    into: Option<Uint8Array>,
) -> Result<Uint8Array, Thrown> {
    let label = FrameLabel { name: name.to_owned(), index, time };
    with_decode_config(decode_config, into, |decode_config| PreparedFrame::from_cloud(decode_config, label, cloud))
}

/// A copy at the beginning of `into`, or, where that is too small, of a new buffer that is large enough for the next frames.
fn written(bytes: &[u8], into: Option<Uint8Array>) -> Uint8Array {
    let length = bytes.len() as u32;
    let Some(given) = into else { return Uint8Array::from(bytes) };
    let is_enough = given.length() >= length;
    let target = if is_enough { given } else { Uint8Array::new_with_length(length + length / 8) };
    let target = target.subarray(0, length);
    target.copy_from(bytes);
    target
}

thread_local! {
    /// The last configuration as JSON and parsed, since it is the same for most frames of a run.
    static LAST_DECODE_CONFIG: RefCell<Option<(String, DecodeConfig)>> = const { RefCell::new(None) };
}

/// Prepares a frame, and [writes](written) it.
fn with_decode_config(
    json: &str,
    into: Option<Uint8Array>,
    prepare: impl FnOnce(&DecodeConfig) -> Result<PreparedFrame, Error>,
) -> Result<Uint8Array, Thrown> {
    let frame = LAST_DECODE_CONFIG.with_borrow_mut(|last| {
        let known = last.take().filter(|(known, _)| known == json).map_or_else(|| parse_decode_config(json), Ok)?;
        prepare(&last.insert(known).1)
    });
    Ok(written(&frame?.to_bytes(), into))
}

fn parse_decode_config(json: &str) -> Result<(String, DecodeConfig), Error> {
    let decode_config = serde_json::from_str(json)
        .map_err(|_| Error::whole("This is not a decode configuration", "Pass on what begin() returned"))?;
    Ok((json.to_owned(), decode_config))
}

/// A reconstruction in space: `begin` with the first file, `add_prepared` frames in order, `step()` until its stage is
/// `done`; call `result()` at any time. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct SpatialReconstruction {
    pub(crate) engine: Engine,
}

#[wasm_bindgen]
impl SpatialReconstruction {
    /// A reconstruction without frames.
    ///
    /// # Errors
    /// When a setting is unknown or out of its limits.
    #[wasm_bindgen(constructor)]
    pub fn new(settings: Option<PartialSpatialSettings>) -> Result<SpatialReconstruction, Thrown> {
        let engine = Engine::new(from_object(settings.map(JsValue::from))?)?;
        Ok(Self { engine })
    }

    /// Reads the camera from a file beside the images, unless the settings have one. To be called before `begin`.
    ///
    /// # Errors
    /// When the file has no camera, or after `begin`.
    pub fn set_intrinsics(&mut self, name: &str, bytes: &[u8]) -> Result<(), Thrown> {
        let camera = intrinsics::read(bytes).map_err(|error| error.in_file(name))?;
        Ok(self.engine.set_intrinsics(camera)?)
    }

    /// Reads the first file and returns the configuration for `prepare_frame`. Later calls ignore the file.
    ///
    /// # Errors
    /// When it is neither a depth image nor a cloud, holds nothing, or the settings make no camera.
    pub fn begin(&mut self, name: &str, first_frame: &[u8]) -> Result<String, Thrown> {
        let decode_config = self.engine.begin(name, first_frame)?;
        Ok(serde_json::to_string(decode_config).unwrap_or_default())
    }

    /// The configuration for `prepare_frame`, after `begin`. It may change to reduce the work once some frames have been
    /// registered; frames prepared with an earlier one remain valid.
    pub fn decode_config(&self) -> Option<String> {
        serde_json::to_string(self.engine.decode_config()?).ok()
    }

    /// Adds the next frame to the queue. Frames must be in the order of the recording; gaps are allowed.
    ///
    /// # Errors
    /// When the bytes are not a prepared frame, or the frame comes before the last one.
    pub fn add_prepared(&mut self, prepared: &[u8]) -> Result<(), Thrown> {
        let frame = PreparedFrame::from_bytes(prepared);
        Ok(frame.and_then(|frame| self.engine.add(frame))?)
    }

    /// Ends the recording: `step()` then also tries frames again that were not found, and closes a loop that has been detected only
    /// once.
    pub fn finish(&mut self) {
        self.engine.finish();
    }

    /// Does one bounded step: registers a frame, relocalizes one that was not found, or closes a loop. The stage is `done` when
    /// nothing is left to do.
    ///
    /// # Errors
    /// No input causes an error.
    pub fn step(&mut self) -> Result<Ts<Progress>, Thrown> {
        grow_ahead();
        Ok(plain(&self.engine.step()))
    }

    /// Stitches one more of the registered frames in advance, which does not change the map. To be called after steps that
    /// registered a frame, if the map is requested in the end.
    pub fn stitch_ahead(&mut self) {
        self.engine.stitch_ahead();
    }

    /// Sets the reference trajectory, in any readable format, which is used for the comparison only. `num_recorded` is the number
    /// of all frames of the recording. The convention of its poses is detected from the data unless the settings give it.
    ///
    /// # Errors
    /// When the file is not a trajectory.
    pub fn set_reference(&mut self, name: &str, bytes: &[u8], num_recorded: usize) -> Result<(), Thrown> {
        let contents = trajectory::read_lenient(bytes, None).map_err(|error| error.in_file(name))?;
        self.engine.set_reference(name, contents, num_recorded);
        Ok(())
    }

    /// Removes the reference.
    pub fn clear_reference(&mut self) {
        self.engine.clear_reference();
    }

    /// The result so far. Of clouds whose coordinates do not begin at the sensor, poses are those behind the shift by its `origin`, as
    /// the map's are that is drawn; with `in_file_coordinates` those of the files, as in trajectory, report and map files.
    ///
    /// # Errors
    /// No input causes an error.
    pub fn result(&self, in_file_coordinates: Option<bool>) -> Result<Ts<SpatialResult>, Thrown> {
        let is_of_files = in_file_coordinates == Some(true);
        Ok(plain(&if is_of_files { self.engine.file_result() } else { self.engine.result() }))
    }

    /// The map: x y z ... (m) in the world frame: x right, y down, z forward of the first sensor.
    pub fn map_positions(&mut self) -> Float32Array {
        let positions = self.engine.map().positions().map(|position| position.to_array());
        sent(positions, Float32Array::new_with_length, Float32Array::subarray, Float32Array::copy_from)
    }

    /// Colours of the map's points: red, green, blue, ...; empty where the recording has none.
    pub fn map_colors(&mut self) -> Uint8Array {
        self.engine.map().colors().map_or_else(
            || Uint8Array::new_with_length(0),
            |colors| sent(colors, Uint8Array::new_with_length, Uint8Array::subarray, Uint8Array::copy_from),
        )
    }

    /// Normals of the map's points: x y z ...; zero where unknown.
    pub fn map_normals(&mut self) -> Float32Array {
        let normals = self.engine.map().normals().map(|normal| normal.to_array());
        sent(normals, Float32Array::new_with_length, Float32Array::subarray, Float32Array::copy_from)
    }

    /// Positions, colours, normals and frames of the map's points, for drawing, in one pass over the voxels.
    pub fn map_points(&mut self) -> SpatialMapPoints {
        drawn(self.engine.map())
    }

    /// For each of the map's points, the position in `result().frames` of the first frame that saw it.
    pub fn map_frames(&mut self) -> Vec<u32> {
        self.engine.map().frames()
    }

    /// Size of the map with other voxel sizes (m).
    ///
    /// # Errors
    /// When a size is less than a millimetre or not finite.
    pub fn map_sizes(&self, voxel_sizes: &[f64]) -> Result<Vec<Ts<MapSize>>, Thrown> {
        if let Some(size) = voxel_sizes.iter().find(|&&size| !(size >= 1e-3 && size.is_finite())) {
            let problem = format!("The voxel size {size} m is out of range");
            return Err(Error::whole(problem, "Give sizes of a millimetre or more").into());
        }
        Ok(self.engine.map_sizes(voxel_sizes).iter().map(plain).collect())
    }

    /// For each frame before this one, the motion x y z qx qy qz qw (m) that maps its points of the map from the world to where
    /// they were when this frame was registered, in the frame of the sensor before it.
    pub fn map_before(&self, frame: usize) -> Vec<f64> {
        let numbers = |pose: &Pose3| {
            let (t, q) = (pose.translation.vector, pose.rotation.coords);
            [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
        };
        self.engine.map_before(frame).iter().flat_map(numbers).collect()
    }

    /// What the map keeps of a frame, by its number in the recording, for `Surface.put`; undefined where there is none.
    pub fn kept_points(&self, index: usize) -> Option<Uint8Array> {
        self.engine.kept_points(index).as_deref().map(Uint8Array::from)
    }

    /// The trajectory in TUM's format: time or number of the frame, x y z qx qy qz qw, one line per frame.
    pub fn trajectory_tum(&self) -> String {
        trajectory::tum_text(self.engine.times().as_deref(), &self.engine.file_poses())
    }

    /// The trajectory as a text with a 4 x 4 matrix per frame.
    pub fn trajectory_matrices(&self) -> Vec<String> {
        let poses: Vec<Pose3> = self.engine.file_poses();
        poses.iter().map(trajectory::matrix_text).collect()
    }

    /// The map as a binary PLY file.
    pub fn map_ply(&mut self) -> Vec<u8> {
        ply::write(&self.map_cloud(), ply::Format::BinaryLittleEndian)
    }

    /// The map as a binary PCD file.
    pub fn map_pcd(&mut self) -> Vec<u8> {
        pcd::write(&self.map_cloud(), pcd::Format::Binary)
    }

    /// The map as a file of this format.
    ///
    /// # Errors
    /// When the format is unknown.
    pub fn map_file(&mut self, format: &MapFormat) -> Result<Vec<u8>, Thrown> {
        let format = map_format(format)?;
        Ok(point_cloud::write(&self.map_cloud(), format))
    }

    /// The map flattened to a grid: what stands between the two heights of `band` over the floor (m), in cells of this side (m; 0.05 by
    /// default). `up` points away from the floor, in the world of the map that is drawn, where the floor is `floor` m along it from the
    /// origin.
    ///
    /// # Errors
    /// When the band is empty or does not begin over the floor, or no frame has a good pose.
    pub fn flattened_grid(
        &self,
        up: &[f64],
        floor: f64,
        band: &[f64],
        resolution: Option<f64>,
    ) -> Result<OccupancyGrid, Thrown> {
        let triple = <[f64; 3]>::try_from(up).unwrap_or([f64::NAN; 3]);
        let band = <[f64; 2]>::try_from(band).unwrap_or([f64::NAN; 2]);
        let floor = Floor { up: triple.into(), height: floor };
        let grid = self.engine.flattened_grid(&floor, band, resolution.unwrap_or(RESOLUTION))?;
        Ok(OccupancyGrid { grid })
    }

    /// The result as the text of `report.json`.
    pub fn report_json(&self) -> String {
        serde_json::to_string_pretty(&self.engine.file_result()).unwrap_or_default()
    }

    fn map_cloud(&mut self) -> PointCloud {
        self.engine.file_map()
    }
}

/// The points of a map, array by array. Call `free()` when done; the arrays stay.
#[wasm_bindgen(getter_with_clone)]
pub struct SpatialMapPoints {
    /// x y z ... (m), world frame.
    pub positions: Float32Array,
    /// red green blue ...; empty where the recording has none.
    pub colors: Uint8Array,
    /// Unit normals in 32767ths: x y z ...; zero where unknown.
    pub normals: Int16Array,
    /// For each point, the position in `result().frames` of the first frame that saw it.
    pub frames: Uint32Array,
}

/// As [`sent`], in one pass over the voxels, a few points at a time.
fn drawn(map: &VoxelMap) -> SpatialMapPoints {
    let length = map.len() as u32;
    let positions = Float32Array::new_with_length(3 * length);
    let colors = Uint8Array::new_with_length(if map.has_colors() { 3 * length } else { 0 });
    let normals = Int16Array::new_with_length(3 * length);
    let frames = Uint32Array::new_with_length(length);
    let mut few_positions = [[0.0; 3]; SENT_TOGETHER];
    let mut few_colors = [[0; 3]; SENT_TOGETHER];
    let mut few_normals = [[0; 3]; SENT_TOGETHER];
    let mut few_frames = [0; SENT_TOGETHER];
    for start in (0..map.len()).step_by(SENT_TOGETHER) {
        let end = map.len().min(start + SENT_TOGETHER);
        let few = few_positions.iter_mut().zip(&mut few_colors).zip(&mut few_normals).zip(&mut few_frames);
        for ((((position, color), normal), frame), point) in few.zip(map.points(start..end)) {
            *position = point.position.to_array();
            *color = point.color;
            // Shifted, so that cutting off rounds: rounding is a call, or worse.
            *normal = (point.normal * f32::from(i16::MAX)).to_array().map(|x| ((x + 32_768.5) as i32 - 32_768) as i16);
            *frame = point.frame;
        }
        let (count, start, end) = (end - start, start as u32, end as u32);
        positions.subarray(3 * start, 3 * end).copy_from(few_positions[..count].as_flattened());
        if map.has_colors() {
            colors.subarray(3 * start, 3 * end).copy_from(few_colors[..count].as_flattened());
        }
        normals.subarray(3 * start, 3 * end).copy_from(few_normals[..count].as_flattened());
        frames.subarray(start, end).copy_from(&few_frames[..count]);
    }
    SpatialMapPoints { positions, colors, normals, frames }
}

/// Triples one after the other, as an array of JavaScript's own. A few at a time are copied there: a copy of all would take
/// the engine's memory, which is never given back, and more time.
fn sent<T: Copy + Default, A>(
    triples: impl ExactSizeIterator<Item = [T; 3]>,
    new: impl FnOnce(u32) -> A,
    part: impl Fn(&A, u32, u32) -> A,
    copy: impl Fn(&A, &[T]),
) -> A {
    let target = new(3 * triples.len() as u32);
    let (mut few, mut start) = ([[T::default(); 3]; SENT_TOGETHER], 0);
    let mut triples = triples.peekable();
    while triples.peek().is_some() {
        let mut count = 0;
        for (place, triple) in few.iter_mut().zip(&mut triples) {
            *place = triple;
            count += 1;
        }
        let values = few[..count].as_flattened();
        let end = start + values.len() as u32;
        copy(&part(&target, start, end), values);
        start = end;
    }
    target
}
