//! What the values of a recording's depth images are: as set, or told from the first one.

use serde::{Deserialize, Serialize};

use crate::camera::{Curvatures, DepthImage, DepthValues, NoDepth, holds_kinect_raw};
use crate::error::{Error, Result};
use crate::pipeline::spatial_settings::{KINECT_FOCAL_LENGTH, SpatialSettings};

/// What is said of images whose values were written with the low byte first.
const SWAPPED_BYTES: &str = "The two bytes of each depth value are in the wrong order (low byte first): neighbouring pixels differ \
                             far less the other way round. They are read that way; write 16-bit PNGs and PGMs with the high byte \
                             first";
/// ... and of those where near is bright.
const INVERTED: &str = "The depth images are taken for inverted, near being bright: their planes are plane that way alone. If that is \
                        wrong, set depth_values=depth";

/// ... and where most planes, but not enough of them, say so.
const MAY_BE_INVERTED: &str = "The depth images are read with far being bright, but may be inverted, near being bright: the few planes \
                               in them look so. If the map is bent, set depth_values=inverted";
/// ... and of both at once.
const SWAPPED_AND_INVERTED: &str = "The depth images are inverted, near being bright, and the two bytes of each value are in the wrong \
                                    order (low byte first)";

/// What is said of images that a Kinect's driver wrote as they came ...
const KINECT_RAW: &str =
    "The values of the depth images are a Kinect's raw ones, of 11 bits with 2047 for none, not distances";
/// ... and of those whose name alone tells.
const SAID_DISPARITY: &str =
    "The name of the depth images says that they hold disparities, and no planes in them say otherwise";

/// What the values of one depth image tell of what they are.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ValuesSeen {
    /// Whether they reach just to the largest value that the file can hold.
    pub fills_range: bool,
    /// The value at which they seem to be cut off.
    pub cut_off: Option<u16>,
    /// How smooth pieces are curved, of the images that are looked at.
    pub curvatures: Option<Curvatures>,
}

impl ValuesSeen {
    /// Of an image whose camera has about this focal length (pixels), at this place in its recording. Curvatures are those of images
    /// 0, 1, 2, 4, 8, 16 and so on: few, of many views.
    pub fn of(image: &DepthImage, focal_length: f64, index: usize) -> Self {
        let is_looked_at = index == 0 || index.is_power_of_two();
        Self {
            fills_range: image.fills_range(),
            cut_off: image.cut_off(),
            curvatures: is_looked_at.then(|| Curvatures::of(image, focal_length)),
        }
    }
}

/// Whether a path says that its images hold disparities: a folder or a file called `disparity`, `disp_0`, `left_disp`.
fn says_disparity(path: &str) -> bool {
    let path = path.to_ascii_lowercase();
    let mut words = path.split(|letter: char| !letter.is_ascii_alphabetic());
    words.any(|word| ["disp", "disparity", "disparities"].contains(&word))
}

/// What the values of the first image, of this name, are, and what is to be said of that.
///
/// # Errors
/// When they are something of which depth cannot be made here.
pub(super) fn values_of(
    settings: &SpatialSettings,
    name: &str,
    first: &DepthImage,
) -> Result<(DepthValues, Option<String>)> {
    if settings.depth_values != DepthValues::ToldFromData {
        return Ok((settings.depth_values, None));
    }
    let read = if first.has_swapped_bytes() { DepthValues::SwappedBytes } else { DepthValues::Depth };
    let focal_length =
        if settings.fx > 0.0 { settings.fx } else { KINECT_FOCAL_LENGTH * first.width.max(first.height) as f64 };
    let told = Curvatures::of(&first.clone().read_as(read), focal_length).told();
    let (problem, remedy) = match (read, told.no_depth()) {
        (DepthValues::SwappedBytes, Some(NoDepth::Inverted)) => {
            (SWAPPED_AND_INVERTED.to_owned(), "Write 16-bit PNGs and PGMs with the high byte first")
        }
        (_, Some(NoDepth::Inverted)) => return Ok((DepthValues::Inverted, Some(INVERTED.to_owned()))),
        (_, Some(kind)) => {
            let (are, remedy) = kind.in_words();
            (format!("The values of the depth images are {are}: planes are plane that way alone"), remedy)
        }
        (DepthValues::Depth, _) if told.may_be_inverted() => return Ok((read, Some(MAY_BE_INVERTED.to_owned()))),
        (DepthValues::Depth, _) if holds_kinect_raw(first) => {
            (KINECT_RAW.to_owned(), "Save depth, 1 / (3.3309 - 0.0030711 * value) m")
        }
        _ if says_disparity(name) && !told.is_depth() => (SAID_DISPARITY.to_owned(), NoDepth::Inverse.in_words().1),
        _ => return Ok((read, (read == DepthValues::SwappedBytes).then(|| SWAPPED_BYTES.to_owned()))),
    };
    Err(Error::whole(problem, format!("{remedy}; or set depth_values, if that is wrong")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::raw_depth::tests::corner;

    #[test]
    fn swapped_bytes_hide_neither_inverted_nor_inverse_depth() {
        let told = |make: fn(f64, f64) -> f64, is_swapped: bool| {
            let image = corner(make, 16);
            let image = if is_swapped { image.read_as(DepthValues::SwappedBytes) } else { image };
            values_of(&SpatialSettings::default(), "0.png", &image)
                .map(|(values, _)| values)
                .map_err(|error| error.problem)
        };
        let depth: fn(f64, f64) -> f64 = |z, _| 1000.0 * z;
        let inverted: fn(f64, f64) -> f64 = |z, _| 65_535.0 - 6553.5 * z;
        assert_eq!(
            [false, true].map(|swapped| told(depth, swapped)),
            [Ok(DepthValues::Depth), Ok(DepthValues::SwappedBytes)]
        );
        assert_eq!(told(inverted, false), Ok(DepthValues::Inverted));
        assert!(told(inverted, true).unwrap_err().contains("inverted"));
        for is_swapped in [false, true] {
            assert!(told(|z, _| 60_000.0 / z, is_swapped).unwrap_err().contains("inverse depth"));
        }
        let set = SpatialSettings { depth_values: DepthValues::Depth, ..SpatialSettings::default() };
        assert_eq!(values_of(&set, "0.png", &corner(inverted, 16)), Ok((DepthValues::Depth, None)));
    }

    #[test]
    fn raw_values_of_a_kinect_are_not_distances() {
        let image = |none: u16| {
            let values = (0..640 * 480).map(|pixel| if pixel % 640 < 30 { none } else { 600 + (pixel % 251) as u16 });
            DepthImage { width: 640, height: 480, values: values.collect(), bits: 16 }
        };
        let told = |image: &DepthImage| values_of(&SpatialSettings::default(), "0.png", image);
        assert!(told(&image(2047)).unwrap_err().problem.contains("Kinect's raw"));
        for none in [0, 2046, 2048, 65_535] {
            assert!(told(&image(none)).is_ok(), "{none}");
        }
    }

    #[test]
    fn a_name_that_says_disparity_is_believed_where_no_planes_contradict() {
        let told = |name: &str, image: &DepthImage| values_of(&SpatialSettings::default(), name, image).is_ok();
        let flat = DepthImage { width: 64, height: 48, values: vec![5000; 64 * 48], bits: 16 };
        let room = corner(|z, _| 1000.0 * z, 16);
        for name in ["disparity/0001.png", "left/0001_disp.png", "Disp-0/1.png"] {
            assert!(!told(name, &flat) && told(name, &room), "{name}");
        }
        assert!(told("displays/depth/0001.png", &flat));
        let set = SpatialSettings { depth_values: DepthValues::Depth, ..SpatialSettings::default() };
        assert!(values_of(&set, "disparity/1.png", &flat).is_ok());
    }
}
