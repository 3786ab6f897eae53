//! The whole run of depth images: files in, trajectory and map out, one frame after the other.

use serde::{Deserialize, Serialize};

use crate::camera::{DepthImage, DepthScale, Pinhole, SurfelImage};
use crate::depth_odometry::{DepthEstimate, DepthOdometry};
use crate::error::{Error, Result};
use crate::geometry::{PointCloud, Pose3};
use crate::io::depth_png;
use crate::preprocess::depth_surfels::{DepthModel, depth_surfels};
use crate::preprocess::wrap_around::usable_pixels;
use crate::report::{Progress, Stage};

/// How depth was made a whole number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantisation {
    /// Cut off to whole steps: the true depth lies half a step further in the mean.
    Truncated,
    /// Rounded to the nearest step.
    Rounded,
}

impl Quantisation {
    fn offset(self) -> f64 {
        match self {
            Self::Truncated => 0.5,
            Self::Rounded => 0.0,
        }
    }
}

/// Where the rays of the pixels go.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Intrinsics {
    /// The angle that a row of pixels spans (rad), the optical axis in the middle.
    FieldOfView(f64),
    /// fx, fy, cx, cy (pixels).
    Pixels([f64; 4]),
}

/// All settings; the default is that of the rendered rooms used in teaching, and what is `None` is told from the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DepthSettings {
    /// The camera.
    pub intrinsics: Intrinsics,
    /// Raw values a metre; none: guessed from the images.
    pub depth_scale: Option<f64>,
    /// Truncated or rounded; none: whichever makes the first frames fit each other better. Matters for 8 bits alone.
    pub quantisation: Option<Quantisation>,
    /// Nearer depths are dropped (m).
    pub min_range: f64,
    /// Farther depths are dropped (m).
    pub max_range: f64,
}

impl Default for DepthSettings {
    fn default() -> Self {
        Self {
            intrinsics: Intrinsics::FieldOfView(std::f64::consts::FRAC_PI_2),
            depth_scale: None,
            quantisation: None,
            min_range: 0.1,
            max_range: 10.0,
        }
    }
}

/// Standard deviation of a triangulating camera's depth over its square (1/m): 2 mm at a metre. Kinect's is 1.4 to 2 mm
/// (Khoshelham and Elberink, "Accuracy and resolution of Kinect depth data", Sensors 12 (2012)).
const TRIANGULATION_NOISE: f64 = 2e-3;
/// So many registered frames decide how depth was made whole.
const DECIDING_FRAMES: usize = 12;
/// Truncated depth, which is what a cast to a whole number gives, is taken for rounded where that fits better by this ratio
/// of the misfits. Half a step too near makes a room that turns about the camera bend; recordings that hardly turn leave
/// it open.
const DECIDING_RATIO: f64 = 1.05;

/// A reconstruction of depth images of one camera.
///
/// Add frames, call [`step`](Self::step) until it says [`Stage::Done`]; what is known so far may be asked for at any time,
/// and more frames may be added to a finished run.
pub struct DepthReconstruction {
    settings: DepthSettings,
    frames: Vec<Frame>,
    size: Option<(usize, usize)>,
    readings: Vec<Reading>,
    next: usize,
}

struct Frame {
    name: String,
    image: DepthImage,
}

/// A run with one way of reading the depth; while the data have not decided there are two.
struct Reading {
    quantisation: Quantisation,
    odometry: DepthOdometry,
    estimates: Vec<DepthEstimate>,
    /// Sum over the registered frames of the mean square residual over the mean square depth: a reading that makes
    /// everything smaller makes the residuals smaller, too.
    misfit: f64,
    num_registered: usize,
}

impl Reading {
    fn new(quantisation: Quantisation) -> Self {
        Self { quantisation, odometry: DepthOdometry::default(), estimates: Vec::new(), misfit: 0.0, num_registered: 0 }
    }

    fn add(&mut self, frame: &SurfelImage) {
        let estimate = self.odometry.register_frame(frame);
        if let Some(registration) = &estimate.registration {
            let sq_depths: f64 = frame.surfels().map(|surfel| surfel.point.z * surfel.point.z).sum();
            let sq_depth = sq_depths / frame.surfels().count().max(1) as f64;
            self.misfit += registration.last.inlier_rmse.powi(2) / sq_depth.max(f64::MIN_POSITIVE);
            self.num_registered += 1;
        }
        self.estimates.push(estimate);
    }
}

impl DepthReconstruction {
    /// A reconstruction without frames.
    ///
    /// # Errors
    /// When a setting is out of its limits.
    pub fn new(settings: DepthSettings) -> Result<Self> {
        let DepthSettings { min_range, max_range, depth_scale, .. } = settings;
        if !(min_range >= 0.0 && max_range > min_range && max_range.is_finite()) {
            let problem = format!("Depths from {min_range} to {max_range} m are none");
            return Err(Error::whole(problem, "min_range is 0 or more and max_range is larger"));
        }
        if depth_scale.is_some_and(|scale| !(scale > 0.0 && scale.is_finite())) {
            return Err(Error::whole("depth_scale is not positive", "Give raw values a metre: 1000 for millimetres"));
        }
        Ok(Self { settings, frames: Vec::new(), size: None, readings: Vec::new(), next: 0 })
    }

    /// Adds the next depth image, given as the bytes of its file.
    ///
    /// # Errors
    /// When the file is no depth image, holds no depth, or differs in size from those before; they stay.
    pub fn add_frame(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        let image = depth_png::read(bytes).map_err(|error| error.in_file(name))?;
        let size = (image.width, image.height);
        let expected = *self.size.get_or_insert(size);
        if size != expected {
            let problem = format!(
                "The image has {} x {} pixels, those before have {} x {}",
                size.0, size.1, expected.0, expected.1
            );
            return Err(Error::whole(problem, "Give images of one camera, all of one size").in_file(name));
        }
        self.camera()?;
        if image.values.iter().all(|&value| value == 0) {
            return Err(Error::whole("All depths are zero: nothing was measured", "Leave the frame out").in_file(name));
        }
        self.frames.push(Frame { name: name.to_owned(), image });
        Ok(())
    }

    /// Number of frames.
    pub fn num_frames(&self) -> usize {
        self.frames.len()
    }

    /// Name of a frame.
    pub fn name(&self, frame: usize) -> Option<&str> {
        self.frames.get(frame).map(|frame| frame.name.as_str())
    }

    /// Registers one more frame.
    ///
    /// # Errors
    /// When the intrinsics are those of no camera.
    pub fn step(&mut self) -> Result<Progress> {
        let total = self.frames.len();
        let Some(Frame { image, .. }) = self.frames.get(self.next) else {
            return Ok(Progress { stage: Stage::Done, done: total, total, frame: None });
        };
        let camera = self.camera()?;
        let usable = usable_pixels(image);
        if self.readings.is_empty() {
            self.readings = self
                .settings
                .quantisation
                .map_or_else(
                    || {
                        if image.bits > 8 {
                            vec![Quantisation::Rounded]
                        } else {
                            vec![Quantisation::Truncated, Quantisation::Rounded]
                        }
                    },
                    |quantisation| vec![quantisation],
                )
                .into_iter()
                .map(Reading::new)
                .collect();
        }
        for reading in &mut self.readings {
            let model = DepthModel {
                step: scale(&self.settings, &self.frames).step,
                offset: reading.quantisation.offset(),
                square_noise: if image.bits > 8 { TRIANGULATION_NOISE } else { 0.0 },
                min_range: self.settings.min_range,
                max_range: self.settings.max_range,
            };
            let frame = depth_surfels(image, &usable, &camera, &model);
            reading.add(&frame);
        }
        self.decide();
        let frame = self.next;
        self.next += 1;
        Ok(Progress { stage: Stage::Register, done: self.next, total, frame: Some(frame) })
    }

    /// Drops the reading that fits worse, once enough frames have been registered.
    fn decide(&mut self) {
        if self.readings.first().is_some_and(|reading| reading.num_registered >= DECIDING_FRAMES) {
            let best = self.best_index();
            self.readings.swap(0, best);
            self.readings.truncate(1);
        }
    }

    fn best_index(&self) -> usize {
        match &self.readings[..] {
            [truncated, rounded] if truncated.misfit > DECIDING_RATIO * rounded.misfit => 1,
            _ => 0,
        }
    }

    fn best(&self) -> Option<&Reading> {
        self.readings.get(self.best_index())
    }

    fn camera(&self) -> Result<Pinhole> {
        let (width, height) = self.size.unwrap_or_default();
        match self.settings.intrinsics {
            Intrinsics::FieldOfView(angle) => Pinhole::from_field_of_view(width, height, angle),
            Intrinsics::Pixels(pixels) => Pinhole::new(width, height, pixels),
        }
    }

    /// What has been found of each frame so far.
    pub fn estimates(&self) -> &[DepthEstimate] {
        self.best().map_or(&[], |reading| &reading.estimates)
    }

    /// Poses `T_world_camera` of the frames so far; the world is the frame of the first camera.
    pub fn poses(&self) -> Vec<Pose3> {
        self.estimates().iter().map(|estimate| estimate.T_world_camera).collect()
    }

    /// How depth was made whole, as set or as found so far.
    pub fn quantisation(&self) -> Option<Quantisation> {
        self.best().map(|reading| reading.quantisation)
    }

    /// Metres a raw step, as set or as guessed.
    pub fn depth_step(&self) -> f64 {
        scale(&self.settings, &self.frames).step
    }

    /// The map so far, with normals, in the world frame.
    pub fn map_cloud(&self) -> PointCloud {
        let Some(reading) = self.best() else { return PointCloud::default() };
        let single = |vector: &nalgebra::Vector3<f64>| glam::DVec3::new(vector.x, vector.y, vector.z).as_vec3();
        let surfels = || reading.odometry.map().surfels();
        PointCloud {
            positions: surfels().map(|surfel| single(&surfel.point)).collect(),
            normals: Some(surfels().map(|surfel| single(&surfel.normal)).collect()),
            ..PointCloud::default()
        }
    }
}

/// The scale of the settings, or the guess from the first image: later ones must not change what earlier ones meant.
fn scale(settings: &DepthSettings, frames: &[Frame]) -> DepthScale {
    let guessed = || DepthScale::guess(frames.first().map(|frame| &frame.image));
    settings.depth_scale.map_or_else(guessed, |scale| DepthScale { step: 1.0 / scale })
}
