//! Registers rendered depth images the way the page does.

use std::error::Error;

use scanstitch::camera::DepthImage;
use scanstitch::pipeline::prepared_frame::{FrameLabel, PreparedFrame};
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::spatial::SpatialReconstruction;
use scanstitch::pipeline::spatial_settings::SpatialSettings;

use super::recording::depth_png;

/// The reconstruction of depth images of one camera.
pub fn reconstruct(settings: SpatialSettings, images: &[DepthImage]) -> Result<SpatialReconstruction, Box<dyn Error>> {
    let mut reconstruction = SpatialReconstruction::new(settings)?;
    for (index, image) in images.iter().enumerate() {
        let (name, bytes) = (format!("{}.png", index + 1), depth_png(image)?);
        let decode_config = reconstruction.begin(&name, &bytes)?;
        let frame = PreparedFrame::from_depth(decode_config, FrameLabel { name, index, time: None }, &bytes, None)?;
        reconstruction.add(frame)?;
    }
    reconstruction.finish();
    while reconstruction.step().stage != Stage::Done {}
    Ok(reconstruction)
}
