//! A frame made ready for registration: what can be done to each frame on its own, in any worker.
//!
//! Prepared frames travel as bytes, so that workers that share no memory can prepare frames ahead while registration
//! goes on in order.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::camera::depth_scale::disparity_step;
use crate::camera::{Brightness, ColorImage, DepthImage, DepthScale, DepthValues, Pinhole, SurfelImage};
use crate::error::{Error, Result};
use crate::geometry::PointCloud;
use crate::io::intrinsics::Intrinsics;
use crate::io::{color_image, depth_image, point_cloud};
use crate::odometry::cloud::{CloudOptions, PreparedCloud};
use crate::pipeline::assumptions::{Assumption, assumptions, contradiction, wrong_scale};
use crate::pipeline::spatial_settings::{ColorUse, Method, Quantisation, SpatialSettings, set_or};
use crate::preprocess::color_registration::OutlineContrast;
use crate::preprocess::depth_cloud::depth_cloud;
use crate::preprocess::depth_noise::estimate_depth_noise;
use crate::preprocess::depth_surfels::{DepthModel, depth_surfels};
use crate::preprocess::map_image::MapImage;
use crate::preprocess::voxel_downsample::voxel_downsample;
use crate::preprocess::wrap_around::usable_pixels;
use crate::registration::prepared_surfels::PreparedSurfels;

mod bytes;
mod cloud_reading;
mod depth_values;
mod frame_note;
mod sensor_place;
mod single_precision;

pub use cloud_reading::CloudReading;
use depth_values::values_of;
pub use frame_note::FrameNote;
pub(crate) use frame_note::merged;
use single_precision::refuse_rounded;

/// What preparing a frame has to know.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DecodeConfig {
    /// The settings, with nothing left open that preparing needs.
    pub settings: SpatialSettings,
    /// How depth images are to be read; none where the frames are clouds.
    pub depth: Option<DepthDecodeConfig>,
    /// How clouds are to be read; none where the frames are depth images.
    pub cloud: Option<CloudReading>,
}

/// How depth images are to be read, told from the first one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DepthDecodeConfig {
    /// The camera of all images.
    pub camera: Pinhole,
    /// Metres a raw step of depth.
    pub depth_step: f64,
    /// What was assumed.
    pub assumptions: Vec<Assumption>,
    /// Whether the first image contradicts the depth scale that is set.
    pub is_scale_contradicted: bool,
    /// What is worth knowing of that, and what the first image says against the settings, in whole sentences.
    pub notes: Vec<String>,
    /// Bits of a raw value.
    pub bits: u8,
    /// What the raw values are.
    pub values: DepthValues,
    /// Standard deviation of the depth over its square (1/m), as measured in the first image.
    pub square_noise: f64,
    /// The even spacing of the first image's inverse raw values, where they have one (1 / raw).
    pub disparity_step: Option<f64>,
    /// The ways of reading the depth that are open at the beginning, the likeliest first.
    pub quantisations: Vec<Quantisation>,
    /// The one that the data have decided for.
    pub decided: Option<Quantisation>,
}

/// Standard deviation of a triangulating camera's depth over its square (1/m): 2 mm at a metre. Kinect's is 1.4 to 2 mm
/// (Khoshelham and Elberink, "Accuracy and resolution of Kinect depth data", Sensors 12 (2012)).
const TRIANGULATION_NOISE: f64 = 2e-3;
/// Disparity steps that differ by this factor are two cameras'.
const OTHER_CAMERA_FACTOR: f64 = 1.1;

impl DecodeConfig {
    /// From the settings and the first file, a depth image or a cloud: later ones must not change what earlier ones
    /// meant.
    ///
    /// # Errors
    /// When the file is neither or holds nothing, or the settings make no camera. The error names the file.
    pub fn new(settings: &SpatialSettings, name: &str, first: &[u8]) -> Result<Self> {
        if point_cloud::is_cloud(first) {
            let points = read_cloud(name, first)?;
            let (cloud, size) = CloudReading::new(settings, &points, first);
            refuse_rounded(&points, size / cloud.unit).map_err(|error| error.in_file(name))?;
            return Ok(Self { settings: settings.for_clouds(size), depth: None, cloud: Some(cloud) });
        }
        let first = read_depth(name, first)?;
        let settings = settings.for_depth();
        let (values, of_values) = values_of(&settings, &first).map_err(|error| error.in_file(name))?;
        let first = first.read_as(values);
        let scale = DepthScale::estimate(&first);
        let quantisations = match settings.quantisation {
            Quantisation::ToldFromData if first.bits > 8 => vec![Quantisation::Rounded],
            // With clouds, the two cannot be distinguished.
            Quantisation::ToldFromData if settings.method != Method::SurfelMap => vec![Quantisation::Truncated],
            Quantisation::ToldFromData => vec![Quantisation::Truncated, Quantisation::Rounded],
            known => vec![known],
        };
        let camera = settings.camera(first.width, first.height, first.bits, scale.sensor)?;
        let assumed = scale.note().filter(|_| settings.depth_scale == 0.0);
        let notes = of_values.into_iter().chain(assumed).chain(contradiction(&settings, &scale)).collect();
        let mut depth = DepthDecodeConfig {
            camera,
            depth_step: if settings.depth_scale > 0.0 { 1.0 / settings.depth_scale } else { scale.step },
            assumptions: assumptions(&settings, &first, &scale, &camera),
            is_scale_contradicted: wrong_scale(&settings, &scale).is_some(),
            notes,
            bits: first.bits,
            values,
            square_noise: 0.0,
            disparity_step: disparity_step(&first),
            quantisations,
            decided: None,
        };
        let config = Self { settings, depth: None, cloud: None };
        if depth.bits > 8 {
            let model = config.depth_model(&depth, Quantisation::Rounded);
            depth.square_noise = estimate_depth_noise(&first, &usable_pixels(&first), &depth.camera, &model);
        }
        Ok(Self { depth: Some(depth), ..config })
    }

    /// For methods that take clouds as they are: the times of points are not read, and all points are registered.
    #[must_use]
    pub(crate) fn with_whole_clouds(mut self) -> Self {
        if let Some(cloud) = &mut self.cloud {
            (cloud.clock, cloud.is_whole) = (None, true);
        }
        self
    }

    /// What was assumed of the frames.
    pub(crate) fn assumptions(&self) -> &[Assumption] {
        let of_depth = self.depth.as_ref().map(|depth| &depth.assumptions);
        of_depth.or(self.cloud.as_ref().map(|cloud| &cloud.assumptions)).map_or(&[], Vec::as_slice)
    }

    /// What is worth knowing of how the frames are read, in whole sentences.
    pub(crate) fn notes(&self) -> &[String] {
        let of_depth = self.depth.as_ref().map(|depth| &depth.notes);
        of_depth.or(self.cloud.as_ref().map(|cloud| &cloud.notes)).map_or(&[], Vec::as_slice)
    }

    /// What is taken off the coordinates of clouds (m).
    pub fn origin(&self) -> DVec3 {
        self.cloud.as_ref().map_or(DVec3::ZERO, |cloud| cloud.origin.into())
    }

    /// The options of the odometry of clouds.
    pub(crate) fn cloud_options(&self) -> CloudOptions {
        let options = self.settings.cloud_options();
        self.cloud.as_ref().map_or(options, |cloud| CloudOptions {
            viewpoint: cloud.viewpoint.into(),
            tests_free_space: cloud.is_sensor_at_origin,
            max_points: if cloud.is_whole { usize::MAX } else { options.max_points },
            ..options
        })
    }

    pub(crate) fn depth_model(&self, depth: &DepthDecodeConfig, quantisation: Quantisation) -> DepthModel {
        DepthModel {
            step: depth.depth_step,
            offset: quantisation.offset(),
            square_noise: if depth.bits > 8 { depth.square_noise.max(TRIANGULATION_NOISE) } else { 0.0 },
            min_range: self.settings.min_range,
            max_range: self.settings.max_range,
        }
    }
}

impl DepthDecodeConfig {
    /// Reads a depth image of the same size as the first one.
    ///
    /// # Errors
    /// When it is broken, all zero, or of another size or kind of values; the error names the file.
    pub(crate) fn read(&self, name: &str, bytes: &[u8]) -> Result<DepthImage> {
        let (image, camera) = (read_depth(name, bytes)?, &self.camera);
        let is_of_size = (image.width, image.height) == (camera.width, camera.height);
        if is_of_size && image.bits == self.bits {
            return Ok(image.read_as(self.values));
        }
        if is_of_size {
            let bits = |bits: u8| if bits == DepthImage::METRES { "metres".to_owned() } else { format!("{bits} bits") };
            let problem =
                format!("The depth image has {} a value, the first one {}", bits(image.bits), bits(self.bits));
            return Err(Error::whole(problem, "Give images of one camera, all of one kind").in_file(name));
        }
        let problem = format!(
            "The depth image has {} x {} pixels, the first one has {} x {}",
            image.width, image.height, camera.width, camera.height
        );
        Err(Error::whole(problem, "Give images of one camera, all of one size").in_file(name))
    }

    /// What tells a frame of another camera: one camera's disparity steps agree from image to image within 0.3 % (five
    /// recordings of Kinects and a RealSense).
    fn other_camera(&self, image: &DepthImage) -> Option<String> {
        let factor = disparity_step(image)? / self.disparity_step?;
        (factor.ln().abs() > OTHER_CAMERA_FACTOR.ln()).then(|| {
            format!(
                "the spacing of its raw values is {factor:.2} times that of the first frame: it seems to be of another \
                 camera or of another depth scale"
            )
        })
    }

    /// The ways of reading a frame's depth. The decision falls while frames are being prepared ahead, and a run must not
    /// depend on how far: the map's points are always of the likeliest way, so that one is never left out.
    fn open_quantisations(&self) -> &[Quantisation] {
        let is_likeliest = self.decided.is_some() && self.decided.as_ref() == self.quantisations.first();
        if is_likeliest { &self.quantisations[..1] } else { &self.quantisations }
    }
}

/// Gives the settings the camera and the depth scale that a file beside the images gives, as far as they have none.
///
/// # Errors
/// When there is a decode configuration: frames have been prepared with another camera.
pub(crate) fn set_intrinsics(
    settings: &mut SpatialSettings,
    decode_config: Option<&DecodeConfig>,
    Intrinsics { fx, fy, cx, cy, depth_scale }: Intrinsics,
) -> Result<()> {
    if decode_config.is_some() {
        return Err(Error::whole("The camera is set after the first frame", "Set it before all frames"));
    }
    if settings.fx == 0.0 && settings.field_of_view == 0.0 {
        settings.fx = fx;
        settings.fy = set_or(settings.fy, fy);
    }
    settings.cx = set_or(settings.cx, cx);
    settings.cy = set_or(settings.cy, cy);
    if settings.depth_scale == 0.0 {
        settings.depth_scale = depth_scale.unwrap_or_default();
    }
    Ok(())
}

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
    /// What could not be used of it.
    pub notes: Vec<FrameNote>,
    /// Whether its depth reaches just to the largest value that the file can hold.
    pub fills_range: bool,
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
            Self::Cloud(cloud) => {
                let a_point = 12
                    + [(cloud.normals.is_some(), 12), (cloud.colors.is_some(), 3), (cloud.times.is_some(), 4)]
                        .map(|(is_there, bytes)| usize::from(is_there) * bytes)
                        .iter()
                        .sum::<usize>();
                cloud.len() * a_point
            }
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
        let mut notes: Vec<FrameNote> = depth.other_camera(&image).map(of_frame).into_iter().collect();
        let colors = color.and_then(|color| {
            let note_left_out = |note| notes.push(note);
            colors_of(color, &label.name, &image).map_err(note_left_out).ok()
        });
        let usable = usable_pixels(&image);
        let is_used = decode_config.settings.color != ColorUse::NotUsed;
        let brightness = colors.as_ref().filter(|_| is_used).map(|colors| Arc::new(Brightness::new(colors)));
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
        Ok(Self { label, surfaces, map_points, notes, fills_range: image.fills_range() })
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
        let limits = if reading.is_sensor_at_origin { settings.min_range..=settings.max_range } else { 0.0..=f64::MAX };
        let cloud = in_range(whole, *limits.start() as f32, *limits.end() as f32);
        let in_file = |error: Error| error.in_file(&label.name);
        if cloud.is_empty() {
            let problem = format!("No point is within the range limits (min_range = {} m)", settings.min_range);
            return Err(in_file(Error::whole(problem, "Give other limits of the range")));
        }
        let options = decode_config.cloud_options();
        // What is registered is made of what the map is made of, where that is finer.
        let is_finer = settings.map_voxel_size < settings.voxel_size;
        let fine = is_finer.then(|| voxel_downsample(&cloud, settings.map_voxel_size)).transpose().map_err(in_file)?;
        let whole = fine.as_ref().unwrap_or(&cloud);
        let prepared = if cloud.times.is_some() {
            // Its normals are those of the straightened sweep, which registration makes of it.
            PreparedCloud::downsampled(whole, &options).map_err(in_file)?
        } else {
            PreparedCloud::new(whole, &options).map_err(in_file)?.into_cloud()
        };
        let map_points = fine.unwrap_or_else(|| prepared.clone());
        let (surfaces, map_points) = (Surfaces::Cloud(prepared), MapPoints::Cloud(map_points));
        Ok(Self { label, surfaces, map_points, notes: Vec::new(), fills_range: false })
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
    let colors = color.and_then(|color| colors_of(color, name, &image).ok());
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

fn read_cloud(name: &str, bytes: &[u8]) -> Result<PointCloud> {
    let cloud = point_cloud::read(bytes).map_err(|error| error.in_file(name))?;
    if cloud.is_empty() {
        return Err(Error::whole("The cloud has no points", "Leave the file out or export it again").in_file(name));
    }
    if cloud.is_planar() {
        let problem = "All points have z = 0: this is a scan of a planar laser, not a cloud in space";
        return Err(Error::whole(problem, "Give planar scans apart from clouds").in_file(name));
    }
    refuse_upright_plane(&cloud).map_err(|error| error.in_file(name))?;
    Ok(cloud)
}

/// Refuses a planar scan whose plane is not that of x and y.
fn refuse_upright_plane(cloud: &PointCloud) -> Result<()> {
    let finite = || cloud.positions.iter().filter(|p| p.is_finite());
    let Some(first) = finite().next() else { return Ok(()) };
    let Some(axis) = (0..2).find(|&axis| finite().all(|p| p[axis] == first[axis])) else { return Ok(()) };
    let [flat, other] = if axis == 0 { ["x", "y"] } else { ["y", "x"] };
    let problem = format!(
        "All points have {flat} = {}: this is a scan of a planar laser, in the plane of {other} and z",
        first[axis]
    );
    Err(Error::whole(problem, "Give it in the plane of x and y, with z = 0: x ahead, y to the left"))
}

/// Reads a depth image that holds some depth.
///
/// # Errors
/// When it is broken or all zero; the error names the file.
fn read_depth(name: &str, bytes: &[u8]) -> Result<DepthImage> {
    let image = depth_image::read(bytes).map_err(|error| error.in_file(name))?;
    if image.values.iter().all(|&value| value == 0) {
        return Err(Error::whole("All depths are zero: nothing was measured", "Leave the frame out").in_file(name));
    }
    Ok(image)
}

/// The colours of a frame's pixels.
///
/// # Errors
/// A note, where the colour image cannot be used.
fn colors_of(color: ColorFile<'_>, frame: &str, depth: &DepthImage) -> std::result::Result<ColorImage, FrameNote> {
    let ColorFile { name, bytes } = color;
    let read = |bytes| read_colors(bytes, depth).map_err(|error| error.in_file(name).to_string());
    bytes.map_err(str::to_owned).and_then(read).map_err(|problem| {
        let left_out = format!("{frame}: its colours are left out");
        match problem.strip_prefix(&format!("{name}: ")) {
            Some(reason) => FrameNote { subject: format!("{left_out}: {name}"), reason: reason.to_owned() },
            None => FrameNote { subject: left_out, reason: problem },
        }
    })
}

fn read_colors(bytes: &[u8], depth: &DepthImage) -> Result<ColorImage> {
    let colors = color_image::read(bytes)?;
    if (colors.width, colors.height) == (depth.width, depth.height) {
        return Ok(colors);
    }
    let problem = format!(
        "The colour image has {} x {} pixels, the depth image {} x {}",
        colors.width, colors.height, depth.width, depth.height
    );
    Err(Error::whole(problem, "Give colour images that are registered to the depth images, pixel by pixel"))
}
