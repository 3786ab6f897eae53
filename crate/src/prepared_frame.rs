//! A frame of a depth camera made ready for registration: what can be done to each frame on its own, in any worker.
//!
//! Prepared frames travel as bytes, so that workers that share no memory can prepare frames ahead while registration
//! goes on in order.

use serde::{Deserialize, Serialize};

use crate::camera::{ColorImage, DepthImage, DepthScale, Pinhole, SurfelImage};
use crate::error::{Error, Result};
use crate::io::{color_image, depth_png};
use crate::preprocess::depth_surfels::{DepthModel, depth_surfels};
use crate::preprocess::map_image::MapImage;
use crate::preprocess::wrap_around::usable_pixels;
use crate::spatial_settings::{Quantisation, SpatialSettings};

mod bytes;

/// What preparing a frame has to know: the settings with everything that was open told from the first image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Preparation {
    /// The camera of all images.
    pub camera: Pinhole,
    /// Metres a raw step of depth.
    pub depth_step: f64,
    /// Bits of a raw value.
    pub bits: u8,
    /// The ways of reading the depth that are open at the beginning, the likeliest first.
    pub quantisations: Vec<Quantisation>,
    /// The one that the data have decided for.
    pub decided: Option<Quantisation>,
    /// Nearer depths are dropped (m).
    pub min_range: f64,
    /// Farther depths are dropped (m).
    pub max_range: f64,
}

/// Standard deviation of a triangulating camera's depth over its square (1/m): 2 mm at a metre. Kinect's is 1.4 to 2 mm
/// (Khoshelham and Elberink, "Accuracy and resolution of Kinect depth data", Sensors 12 (2012)).
const TRIANGULATION_NOISE: f64 = 2e-3;

/// The first frames are prepared in every way, whatever has been decided meanwhile.
const UNDECIDED_FRAMES: usize = 32;

impl Preparation {
    /// From the settings and the first image: later ones must not change what earlier ones meant.
    ///
    /// # Errors
    /// When the settings make no camera.
    pub fn new(settings: &SpatialSettings, first: &DepthImage) -> Result<Self> {
        let guessed = DepthScale::guess([first]).step;
        let quantisations = match settings.quantisation {
            Quantisation::ToldFromData if first.bits > 8 => vec![Quantisation::Rounded],
            Quantisation::ToldFromData => vec![Quantisation::Truncated, Quantisation::Rounded],
            known => vec![known],
        };
        Ok(Self {
            camera: settings.camera(first.width, first.height, first.bits)?,
            depth_step: if settings.depth_scale > 0.0 { 1.0 / settings.depth_scale } else { guessed },
            bits: first.bits,
            quantisations,
            decided: None,
            min_range: settings.min_range,
            max_range: settings.max_range,
        })
    }

    /// The ways of reading a frame's depth. The decision falls while frames are being prepared ahead, so it counts from
    /// a fixed frame on: a run must not depend on how far ahead the workers are.
    fn quantisations_of(&self, label: &FrameLabel) -> Vec<Quantisation> {
        match self.decided {
            Some(decided) if label.index >= UNDECIDED_FRAMES => vec![decided],
            _ => self.quantisations.clone(),
        }
    }

    fn depth_model(&self, quantisation: Quantisation) -> DepthModel {
        DepthModel {
            step: self.depth_step,
            offset: quantisation.offset(),
            square_noise: if self.bits > 8 { TRIANGULATION_NOISE } else { 0.0 },
            min_range: self.min_range,
            max_range: self.max_range,
        }
    }
}

/// Where a frame stands in its recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameLabel {
    /// Name of the file.
    pub name: String,
    /// Its place in the recording, counted from 0, whatever was left out before it.
    pub index: usize,
    /// When it was taken (s), where known.
    pub time: Option<f64>,
}

/// A frame made ready.
#[derive(Debug, Clone, PartialEq)]
pub struct PreparedFrame {
    /// Which one it is.
    pub label: FrameLabel,
    /// Its surfaces, for each way of reading the depth that was open.
    pub surfels: Vec<(Quantisation, SurfelImage)>,
    /// What it gives to the map, by the first of these.
    pub map_image: MapImage,
    /// What could not be used of it, in whole sentences.
    pub notes: Vec<String>,
}

impl PreparedFrame {
    /// Decodes and prepares a depth image, with the colours of its pixels where there is a colour image. A colour image
    /// that cannot be used is left out, with a note.
    ///
    /// # Errors
    /// When the depth image is broken, holds no depth, or differs from the first one in size.
    pub fn from_depth(
        preparation: &Preparation,
        label: FrameLabel,
        depth: &[u8],
        color: Option<&[u8]>,
    ) -> Result<Self> {
        let image = read_depth(&label.name, depth)?;
        let camera = &preparation.camera;
        if (image.width, image.height) != (camera.width, camera.height) {
            let problem = format!(
                "The depth image has {} x {} pixels, the first one has {} x {}",
                image.width, image.height, camera.width, camera.height
            );
            return Err(Error::whole(problem, "Give images of one camera, all of one size").in_file(&label.name));
        }
        let mut notes = Vec::new();
        let colors = color.and_then(|bytes| match read_colors(bytes, &image) {
            Ok(colors) => Some(colors),
            Err(error) => {
                notes.push(format!("{}: its colours are left out: {error}", label.name));
                None
            }
        });
        let usable = usable_pixels(&image);
        let surfels = |&quantisation: &Quantisation| {
            (quantisation, depth_surfels(&image, &usable, camera, &preparation.depth_model(quantisation)))
        };
        let surfels: Vec<(Quantisation, SurfelImage)> =
            preparation.quantisations_of(&label).iter().map(surfels).collect();
        let Some((quantisation, likeliest)) = surfels.first() else {
            return Err(Error::whole("There is no way to read the depth", "Give a quantisation"));
        };
        let model = preparation.depth_model(*quantisation);
        let map_image = MapImage::new(&image, &usable, likeliest, &model, colors.as_ref());
        Ok(Self { label, surfels, map_image, notes })
    }
}

/// Reads a depth image that holds some depth.
///
/// # Errors
/// When it is broken or all zero; the error names the file.
pub fn read_depth(name: &str, bytes: &[u8]) -> Result<DepthImage> {
    let image = depth_png::read(bytes).map_err(|error| error.in_file(name))?;
    if image.values.iter().all(|&value| value == 0) {
        return Err(Error::whole("All depths are zero: nothing was measured", "Leave the frame out").in_file(name));
    }
    Ok(image)
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
