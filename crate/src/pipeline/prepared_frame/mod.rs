//! A frame made ready for registration: what can be done to each frame on its own, in any worker.
//!
//! Prepared frames travel as bytes, so that workers that share no memory can prepare frames ahead while registration
//! goes on in order.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::camera::{Brightness, SurfelImage};
use crate::error::{Error, Result};
use crate::geometry::PointCloud;
use crate::odometry::cloud::{CloudOptions, PreparedCloud};
use crate::pipeline::spatial_settings::{Method, Quantisation};
use crate::preprocess::color_registration::OutlineContrast;
use crate::preprocess::depth_cloud::depth_cloud;
use crate::preprocess::depth_surfels::{DepthModel, depth_surfels};
use crate::preprocess::map_image::MapImage;
use crate::preprocess::wrap_around::usable_pixels;
use crate::registration::prepared_surfels::PreparedSurfels;

mod bytes;
mod cloud_reading;
mod decode_config;
mod depth_values;
mod files;
mod frame_note;
mod gyro_comments;
mod sensor_place;
mod single_precision;

pub use cloud_reading::CloudReading;
pub(crate) use decode_config::set_intrinsics;
pub use decode_config::{DecodeConfig, DepthDecodeConfig};
pub use depth_values::ValuesSeen;
use files::{colors_of, read_cloud};
pub use frame_note::FrameNote;
pub(crate) use frame_note::merged;

/// Where a frame stands in its recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameLabel {
    /// Name of the file.
    pub name: String,
    /// Its index in the recording, from 0; frames that were left out count.
    pub index: usize,
    /// When it was taken (s), where known.
    pub time: Option<f64>,
}

impl FrameLabel {
    /// Whether the frame comes after the last one that was added, whose index this is.
    ///
    /// # Errors
    /// When it does not.
    pub(crate) fn check_order(&self, last: Option<usize>) -> Result<()> {
        if last.is_none_or(|last| self.index > last) {
            return Ok(());
        }
        let problem = format!("Frame {} comes before a frame that was added earlier", self.index);
        Err(Error::whole(problem, "Add frames in the order of the recording").in_file(&self.name))
    }
}

/// A colour image as it lies in its file.
#[derive(Debug, Clone, Copy)]
pub struct ColorFile<'a> {
    /// Name of the file.
    pub name: &'a str,
    /// All of it, or why it could not be read, which names it.
    pub bytes: std::result::Result<&'a [u8], &'a str>,
}

/// A frame made ready.
#[derive(Debug, Clone, PartialEq)]
pub struct PreparedFrame {
    /// Which one it is.
    pub label: FrameLabel,
    /// What is registered.
    pub surfaces: Surfaces,
    /// What it gives to the map.
    pub map_points: MapPoints,
    /// What a gyroscope measured around it: times from its stamp (s), angular velocities in the sensor's frame (rad/s).
    pub gyro: Vec<[f64; 4]>,
    /// What could not be used of it.
    pub notes: Vec<FrameNote>,
    /// What the values of its depth image tell of what they are.
    pub values: ValuesSeen,
}

/// What is registered of a frame, in the sensor's frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Surfaces {
    /// The surfaces of a depth image, for each way of reading the depth that was open.
    Surfels(Vec<(Quantisation, PreparedSurfels)>),
    /// What [`PreparedCloud::cloud`] gave.
    Cloud(PointCloud),
}

/// What a frame gives to the map, in the sensor's frame.
#[derive(Debug, Clone, PartialEq)]
pub enum MapPoints {
    /// Of a depth image, by one way of reading the depth.
    Image(MapImage, Quantisation),
    /// Of a cloud.
    Cloud(PointCloud),
}

impl MapPoints {
    /// About what it takes in memory.
    pub(crate) fn num_bytes(&self) -> usize {
        match self {
            Self::Image(image, _) => image.depths.len() * if image.colors.is_some() { 8 } else { 5 },
            Self::Cloud(cloud) => num_bytes(cloud),
        }
    }

    /// Leaves one point in four: of frames that follow one another others, so that they fill each other's gaps. `index`
    /// counts the frames, `round` how often this one has been thinned out before.
    pub(crate) fn thin(&mut self, index: usize, round: usize) {
        let phase = (index >> (2 * round).min(30)) % 4;
        match self {
            Self::Image(image, _) => *image = image.thinned(phase % 2, phase / 2),
            Self::Cloud(cloud) => {
                let kept: Vec<usize> = (phase..cloud.len()).step_by(4).collect();
                *cloud = cloud.selected(&kept);
            }
        }
    }
}

/// What a cloud's points take in memory.
fn num_bytes(cloud: &PointCloud) -> usize {
    let PointCloud { positions, normals, colors, times, .. } = cloud;
    size_of_val(positions.as_slice())
        + normals.as_ref().map_or(0, |normals| size_of_val(normals.as_slice()))
        + colors.as_ref().map_or(0, |colors| size_of_val(colors.as_slice()))
        + times.as_ref().map_or(0, |times| size_of_val(times.offsets.as_slice()))
}

impl PreparedFrame {
    /// Decodes and prepares a depth image, with the colours of its pixels where there is a colour image. A colour image
    /// that cannot be used is left out, with a note.
    ///
    /// # Errors
    /// When the depth image is broken, holds no depth, or differs from the first one in size.
    pub fn from_depth(
        decode_config: &DecodeConfig,
        label: FrameLabel,
        bytes: &[u8],
        color: Option<ColorFile<'_>>,
    ) -> Result<Self> {
        let Some(depth) = &decode_config.depth else {
            let problem = "This is a depth image, and the first frame is a cloud";
            return Err(Error::whole(problem, "Give frames of one kind").in_file(&label.name));
        };
        let (image, camera) = (depth.read(&label.name, bytes)?, &depth.camera);
        let of_frame = |reason| FrameNote { subject: label.name.clone(), reason };
        let values = ValuesSeen::of(&image, camera.fx, label.index);
        let mut notes: Vec<FrameNote> = depth.other_camera(&image).map(of_frame).into_iter().collect();
        let colors = color.and_then(|color| colors_of(color, &label.name, &image, &mut notes));
        let usable = usable_pixels(&image);
        let registered_colors = colors.as_ref().filter(|_| decode_config.registers_colors);
        let brightness = registered_colors.map(|colors| Arc::new(Brightness::new(colors)));
        let surfels = |&quantisation: &Quantisation| {
            let surfels = depth_surfels(&image, &usable, camera, &decode_config.depth_model(depth, quantisation));
            (quantisation, SurfelImage { brightness: brightness.clone(), ..surfels })
        };
        let surfels: Vec<(Quantisation, SurfelImage)> = depth.open_quantisations().iter().map(surfels).collect();
        let Some((quantisation, likeliest)) = surfels.first() else {
            return Err(Error::whole("There is no way to read the depth", "Give a quantisation"));
        };
        let model = decode_config.depth_model(depth, *quantisation);
        let map_image = MapImage::new(&image, &usable, likeliest, &model, colors.as_ref());
        let map_points = MapPoints::Image(map_image, *quantisation);
        let settings = &decode_config.settings;
        let surfaces = if settings.method == Method::SurfelMap {
            let options = settings.depth_options();
            let contrast_with =
                |brightness: &Arc<Brightness>| OutlineContrast::new(&image, &usable, &model, brightness);
            let outline_contrast = brightness.as_ref().map(contrast_with).unwrap_or_default();
            let prepared = |(quantisation, surfels)| {
                (quantisation, PreparedSurfels { outline_contrast, ..options.prepared(surfels) })
            };
            Surfaces::Surfels(surfels.into_iter().map(prepared).collect())
        } else {
            // Courses take every value for what it says.
            let taken = if settings.method == Method::Course { vec![true; image.values.len()] } else { usable };
            let cloud = depth_cloud(&image, &taken, camera, &model, None);
            let options = CloudOptions { clear_normals: false, max_points: usize::MAX, ..settings.cloud_options() };
            Surfaces::Cloud(PreparedCloud::new(&cloud, &options)?.into_cloud())
        };
        Ok(Self { label, surfaces, map_points, gyro: Vec::new(), notes, values })
    }

    /// Reads and prepares a cloud, in the frame of the sensor that took it.
    ///
    /// # Errors
    /// When the file is broken or holds no points in range, or the first frame is a depth image.
    pub fn from_cloud(decode_config: &DecodeConfig, label: FrameLabel, bytes: &[u8]) -> Result<Self> {
        let settings = &decode_config.settings;
        let Some(reading) = &decode_config.cloud else {
            let problem = "This is a cloud, and the first frame is a depth image";
            return Err(Error::whole(problem, "Give frames of one kind").in_file(&label.name));
        };
        let whole = reading.read(read_cloud(&label.name, bytes)?, label.time);
        let ranges = whole.positions.iter().map(|point| point.length()).filter(|range| range.is_finite());
        let (count, farthest) = (whole.len(), ranges.fold(0.0, f32::max));
        let limits = if reading.is_sensor_at_origin { settings.min_range..=settings.max_range } else { 0.0..=f64::MAX };
        let cloud = in_range(whole, *limits.start() as f32, *limits.end() as f32);
        let in_file = |error: Error| error.in_file(&label.name);
        if cloud.is_empty() {
            let problem = format!(
                "None of its {count} points is within the range limits (min_range = {} m); the farthest is {farthest:.3} m away",
                settings.min_range
            );
            let remedy = "Set cloud_unit to the unit of the coordinates (m), for example cloud_unit=1000 for kilometres; or set min_range";
            return Err(in_file(Error::whole(problem, remedy)));
        }
        let options = decode_config.cloud_options();
        let (voxels, parts) = if settings.map_voxel_size < settings.voxel_size {
            let (voxels, parts) =
                PreparedCloud::downsampled_twice(&cloud, &options, settings.map_voxel_size).map_err(in_file)?;
            (voxels, Some(parts))
        } else {
            (PreparedCloud::downsampled(&cloud, &options).map_err(in_file)?, None)
        };
        // The normals of a cloud with times are those of the straightened sweep, which registration makes of it.
        let has_times = cloud.times.is_some();
        let prepared = if has_times { voxels } else { PreparedCloud::with_normals(voxels, &options).into_cloud() };
        let map_points = parts.unwrap_or_else(|| prepared.clone());
        let (surfaces, map_points) = (Surfaces::Cloud(prepared), MapPoints::Cloud(map_points));
        let gyro = gyro_comments::gyro_readings(bytes).unwrap_or_default();
        Ok(Self { label, surfaces, map_points, gyro, notes: Vec::new(), values: ValuesSeen::default() })
    }
}

/// All pixels of a depth image with their colours, and how its depth was measured.
///
/// # Errors
/// As [`PreparedFrame::from_depth`]. Colours that cannot be used are left out: preparing the frame has told of it.
pub(crate) fn map_image(
    decode_config: &DecodeConfig,
    name: &str,
    bytes: &[u8],
    color: Option<ColorFile<'_>>,
) -> Result<(MapImage, DepthModel)> {
    let (Some(depth), true) = (&decode_config.depth, !bytes.is_empty()) else {
        return Err(Error::whole("This is no depth image", "Give depth images").in_file(name));
    };
    let image = depth.read(name, bytes)?;
    let colors = color.and_then(|color| colors_of(color, name, &image, &mut Vec::new()));
    let quantisation = depth.open_quantisations().first().copied().unwrap_or(Quantisation::Rounded);
    let (usable, model) = (usable_pixels(&image), decode_config.depth_model(depth, quantisation));
    let surfels = depth_surfels(&image, &usable, &depth.camera, &model);
    Ok((MapImage::with_stride(1, depth.bits == 8, &image, &usable, &surfels, &model, colors.as_ref()), model))
}

/// The points that are finite and from `min_range` to `max_range` (m) away from the sensor.
fn in_range(cloud: PointCloud, min_range: f32, max_range: f32) -> PointCloud {
    let keep = |position: &glam::Vec3| position.is_finite() && (min_range..=max_range).contains(&position.length());
    if cloud.positions.iter().all(keep) {
        return cloud;
    }
    let kept: Vec<usize> = (0..cloud.len()).filter(|&point| keep(&cloud.positions[point])).collect();
    cloud.selected(&kept)
}
