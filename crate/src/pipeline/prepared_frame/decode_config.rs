//! How the frames of a recording are read and prepared, told from the first one.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::cloud_reading::CloudReading;
use super::depth_values::values_of;
use super::files::{read_cloud, read_depth};
use super::single_precision::refuse_rounded;
use crate::camera::depth_levels::disparity_step;
use crate::camera::{DepthImage, DepthScale, DepthValues, Pinhole};
use crate::error::{Error, Result};
use crate::io::intrinsics::Intrinsics;
use crate::io::point_cloud;
use crate::odometry::cloud::CloudOptions;
use crate::pipeline::assumptions::{Assumption, assumptions, contradiction, wrong_scale};
use crate::pipeline::spatial_settings::{ColorUse, Method, Quantisation, SpatialSettings, set_or};
use crate::preprocess::depth_noise::estimate_depth_noise;
use crate::preprocess::depth_surfels::DepthModel;
use crate::preprocess::wrap_around::usable_pixels;

/// What preparing a frame has to know.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DecodeConfig {
    /// The settings, with nothing left open that preparing needs.
    pub settings: SpatialSettings,
    /// Whether colours take part in the registration: as set, until they turn out not to belong to the depth's pixels.
    pub registers_colors: bool,
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
            let in_file = |error: Error| error.in_file(name);
            let (cloud, size) = CloudReading::new(settings, &points, first).map_err(in_file)?;
            refuse_rounded(&points, size / cloud.unit).map_err(in_file)?;
            let settings = settings.for_clouds(size);
            return Ok(Self { settings, registers_colors: false, depth: None, cloud: Some(cloud) });
        }
        let first = read_depth(name, first)?;
        let settings = settings.for_depth();
        let (values, of_values) = values_of(&settings, name, &first).map_err(|error| error.in_file(name))?;
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
        let registers_colors = settings.color != ColorUse::NotUsed;
        let config = Self { settings, registers_colors, depth: None, cloud: None };
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
    pub(super) fn other_camera(&self, image: &DepthImage) -> Option<String> {
        let of_first = self.disparity_step?;
        let factor = disparity_step(image)? / of_first;
        (factor.ln().abs() > OTHER_CAMERA_FACTOR.ln()).then(|| {
            format!(
                "the spacing of its raw values is {factor:.2} times that of the first frame: it seems to be of another \
                 camera or of another depth scale"
            )
        })
    }

    /// The ways of reading a frame's depth. The decision falls while frames are being prepared ahead, and a run must not
    /// depend on how far: the map's points are always of the likeliest way, so that one is never left out.
    pub(super) fn open_quantisations(&self) -> &[Quantisation] {
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
