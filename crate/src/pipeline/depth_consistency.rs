//! The consistency of a recording's depth images from their files: read as a reconstruction reads them, and compared by
//! [`evaluation::depth_consistency`](crate::evaluation::depth_consistency).

use crate::error::{Error, Result};
use crate::evaluation::depth_consistency::{
    ConsistencyLimits, ConsistencyReport, DepthConsistency as Comparison, DepthView,
};
use crate::io::intrinsics::Intrinsics;
use crate::io::trajectory::Contents;
use crate::pipeline::prepared_frame::{DecodeConfig, set_intrinsics};
use crate::pipeline::spatial_settings::SpatialSettings;
use crate::preprocess::wrap_around::usable_pixels;

/// Compares the depth images of a recording, one [added](Self::add) after the other, at the poses of a trajectory.
pub struct DepthConsistency {
    settings: SpatialSettings,
    decode_config: Option<DecodeConfig>,
    comparison: Comparison,
}

impl DepthConsistency {
    /// For a recording of `num_frames` frames, taken at `times` (s) where they are known. Of the settings, those of camera,
    /// depth and reference poses count.
    ///
    /// # Errors
    /// When a setting is out of its limits, the trajectory has positions alone, or it cannot be told which pose belongs to
    /// which frame.
    pub fn new(
        settings: SpatialSettings,
        trajectory: &Contents,
        num_frames: usize,
        times: Option<&[f64]>,
    ) -> Result<Self> {
        settings.validate()?;
        let known = settings.known_convention();
        let comparison = Comparison::new(trajectory, num_frames, times, known, ConsistencyLimits::default())?;
        Ok(Self { settings, decode_config: None, comparison })
    }

    /// Sets the camera and the depth scale of a file beside the images, as far as the settings have none.
    ///
    /// # Errors
    /// After the first frame.
    pub fn set_intrinsics(&mut self, intrinsics: Intrinsics) -> Result<()> {
        set_intrinsics(&mut self.settings, self.decode_config.as_ref(), intrinsics)
    }

    /// Adds the next depth image of the recording, PNG or PGM. One that cannot be used takes its place without depth.
    ///
    /// # Errors
    /// When the file is broken, holds no depth, is of another size than the first one, or is a cloud.
    pub fn add(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        let view = self.view(name, bytes);
        let (view, result) = view.map_or_else(|error| (None, Err(error)), |view| (Some(view), Ok(())));
        self.comparison.add(view);
        result
    }

    /// Leaves the next frame of the recording out: its file cannot be read.
    pub fn skip(&mut self) {
        self.comparison.add(None);
    }

    fn view(&mut self, name: &str, bytes: &[u8]) -> Result<DepthView> {
        let decode_config = match &mut self.decode_config {
            Some(decode_config) => decode_config,
            none => none.insert(DecodeConfig::new(&self.settings, name, bytes)?),
        };
        let Some(depth) = &decode_config.depth else {
            let problem = "This is a cloud: what its sensor saw of another frame is not known pixel by pixel";
            return Err(Error::whole(problem, "Give depth images").in_file(name));
        };
        let image = depth.read(name, bytes)?;
        let model = decode_config.depth_model(depth, depth.quantisations[0]);
        let depth_of = |(&value, is_usable): (&u16, bool)| {
            model.depth(value).filter(|_| is_usable).map_or(0.0, |depth| depth as f32)
        };
        let depths = image.values.iter().zip(usable_pixels(&image)).map(depth_of).collect();
        Ok(DepthView { camera: depth.camera, depths })
    }

    /// What was assumed of the depth images, and what they say against the settings: a sentence each, after the first frame.
    pub fn notes(&self) -> &[String] {
        self.decode_config.as_ref().and_then(|config| config.depth.as_ref()).map_or(&[], |depth| &depth.notes)
    }

    /// The agreement of all steps so far.
    pub fn report(&self) -> ConsistencyReport {
        self.comparison.report()
    }
}
