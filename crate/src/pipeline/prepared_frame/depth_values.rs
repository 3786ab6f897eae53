//! What the values of a recording's depth images are: as set, or told from the first one.

use crate::camera::{DepthImage, DepthValues, NoDepth, Votes};
use crate::error::{Error, Result};
use crate::pipeline::spatial_settings::SpatialSettings;

/// What is said of images whose values were written with the low byte first.
const SWAPPED_BYTES: &str = "The two bytes of each depth value are in the wrong order (low byte first): neighbouring pixels differ \
                             far less the other way round. They are read that way; write 16-bit PNGs and PGMs with the high byte \
                             first";
/// ... and of those where near is bright.
const INVERTED: &str = "The depth images are taken for inverted, near being bright: their planes are plane that way alone. If that is \
                        wrong, set depth_values=depth";

/// What the values are, and what is to be said of that.
///
/// # Errors
/// When they are something of which depth cannot be made here.
pub(super) fn values_of(settings: &SpatialSettings, first: &DepthImage) -> Result<(DepthValues, Option<String>)> {
    if settings.depth_values != DepthValues::ToldFromData {
        return Ok((settings.depth_values, None));
    }
    if first.has_swapped_bytes() {
        return Ok((DepthValues::SwappedBytes, Some(SWAPPED_BYTES.to_owned())));
    }
    let focal_length = if settings.fx > 0.0 { settings.fx } else { USUAL_FOCAL_LENGTH * first.width as f64 };
    let votes = Votes::of(first, focal_length);
    if votes.is_inverted() {
        return Ok((DepthValues::Inverted, Some(INVERTED.to_owned())));
    }
    let Some(kind) = votes.no_depth() else { return Ok((DepthValues::Depth, None)) };
    let (problem, formula) = match kind {
        NoDepth::Inverse => (
            "The values of the depth images are inverse depth, as disparities: planes are plane that way alone",
            "Save depth, focal length times baseline over disparity",
        ),
        NoDepth::RayLength => (
            "The values of the depth images are the lengths of rays, not depth along the optical axis: planes are plane that way alone",
            "Save depth, the length over sqrt(1 + ((u - cx) / fx)^2 + ((v - cy) / fy)^2) at the pixel (u, v)",
        ),
    };
    Err(Error::whole(problem, format!("{formula}; or set depth_values=depth if they are depth")))
}

/// Of most cameras, over the width of their images.
const USUAL_FOCAL_LENGTH: f64 = 0.7;
