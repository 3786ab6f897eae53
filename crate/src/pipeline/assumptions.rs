//! What is assumed of depth images because neither a setting nor a file says it, and what their data say against what is set.

use serde::{Deserialize, Serialize};

use crate::camera::depth_scale::{is_step_of_sensor, kinect_focal_length};
use crate::camera::{DepthImage, DepthScale, DepthSensor, Pinhole, ScaleBasis};
use crate::pipeline::spatial_settings::SpatialSettings;

/// A setting of how depth images or clouds are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(rename_all = "snake_case")]
pub enum ReadingSetting {
    /// Raw values per metre.
    DepthScale,
    /// Focal length (pixels).
    Fx,
    /// Metres in a unit of the coordinates of clouds.
    CloudUnit,
}

/// A setting that was left open, and the value that it was given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct Assumption {
    /// Which one.
    pub setting: ReadingSetting,
    /// Its value.
    pub value: f64,
    /// Where the value is from, in words.
    pub why: String,
    /// Values that the data allow, the likeliest first, which is the one that was taken. With more than one it is open.
    pub likely: Vec<f64>,
    /// Values that such images have, and whose they are.
    pub usual: Vec<UsualValue>,
    /// What in the recording confirms the value, in words; null where nothing does: then frames that fit each other make a map
    /// that may still have another size (depth scale) or be bent (focal length).
    pub confirmed_by: Option<String>,
}

/// A value that is in use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct UsualValue {
    /// The value.
    pub value: f64,
    /// Who uses it.
    pub about: String,
}

/// Common scales of images of 16 bits (raw values per metre).
pub(super) const SCALES_16: [(f64, &str); 7] = [
    (1000.0, "millimetres"),
    (5000.0, "TUM RGB-D"),
    (6553.5, "16 bits over 10 m"),
    (4000.0, "Matterport3D"),
    (10_000.0, "tenths of a millimetre"),
    (8000.0, "SUN RGB-D"),
    (256.0, "KITTI"),
];
/// Common scales of images of 8 bits (raw values per metre).
pub(super) const SCALES_8: [(f64, &str); 4] = [
    (25.5, "10 m over the range"),
    (51.0, "5 m over the range"),
    (12.75, "20 m over the range"),
    (100.0, "centimetres"),
];
/// Focal length of a Kinect's own depth camera over the width of the image, as its driver has it. Depth that was registered to the
/// colours has that of the colour camera.
const OWN_KINECT_FOCAL_LENGTH: f64 = 0.9;
/// Why a Kinect's focal length was assumed.
const KINECT_STEPS: &str = "told from the spacing of the raw values: a Kinect or its like";
/// Focal lengths over the longer side of the image, from the sensors' datasheets.
const FOCAL_LENGTHS: [(f64, &str); 7] = [
    (0.5, "renderers"),
    (0.6, "RealSense D435, D455"),
    (0.713, "Kinect v2"),
    (0.788, "Azure Kinect"),
    (0.82, "Kinect, Xtion, phones"),
    (OWN_KINECT_FOCAL_LENGTH, "Kinect, Xtion: depth not registered to the colours"),
    (0.955, "RealSense D415"),
];
/// Range of plausible median depths (m): rooms have 2.2 m, and a tenth or ten times that is neither a room nor a hall.
const PLAUSIBLE_MEDIAN: (f64, f64) = (0.2, 25.0);

/// What is assumed of the images of which this is the first.
pub(crate) fn assumptions(
    settings: &SpatialSettings,
    image: &DepthImage,
    scale: &DepthScale,
    camera: &Pinhole,
) -> Vec<Assumption> {
    let depth_scale = (settings.depth_scale == 0.0 && scale.basis != ScaleBasis::Metres).then(|| {
        let usual = if image.bits > 8 { &SCALES_16[..] } else { &SCALES_8[..] };
        let likely: Vec<f64> = std::iter::once(scale.per_metre()).chain(scale.alternatives.iter().copied()).collect();
        let why = match scale.basis {
            ScaleBasis::DisparitySteps(_) => "told from the spacing of the raw values".to_owned(),
            ScaleBasis::RoomSize(median) => format!("told from the size of rooms (median depth {median:.1} m)"),
            _ => "as 8 bits of rendered rooms mostly have it".to_owned(),
        };
        Assumption {
            confirmed_by: scale.confirmed_by(image.width),
            ..assumption(ReadingSetting::DepthScale, likely, usual, why)
        }
    });
    let focal_length = (settings.fx == 0.0 && settings.field_of_view == 0.0).then(|| {
        let usual = FOCAL_LENGTHS.map(|(share, about)| ((share * image.width.max(image.height) as f64).round(), about));
        let why = match scale.sensor {
            DepthSensor::RealSense { .. } => "told from the spacing of the raw values: a RealSense",
            DepthSensor::Kinect => KINECT_STEPS,
            DepthSensor::Unknown if (2.0 * camera.fx / image.width as f64 - 1.0).abs() < 1e-9 => {
                "as rendered images mostly have it"
            }
            DepthSensor::Unknown => "as the usual depth camera with images of this size has it",
        };
        assumption(ReadingSetting::Fx, vec![camera.fx], &usual, why.to_owned())
    });
    depth_scale.into_iter().chain(focal_length).collect()
}

/// What is said of a Kinect's focal length that was assumed, once its colours turn out not to be registered to the depth.
pub(crate) fn own_focal_length_of_kinect(assumptions: &[Assumption], width: usize) -> Option<String> {
    let is_kinect =
        |assumption: &&Assumption| assumption.setting == ReadingSetting::Fx && assumption.why == KINECT_STEPS;
    assumptions.iter().find(is_kinect).map(|Assumption { value, .. }| {
        format!(
            "fx = {value} is assumed, which a Kinect's depth images have once they are registered to the colours. These are not: \
             its own depth camera has about fx = {:.0}",
            OWN_KINECT_FOCAL_LENGTH * width as f64
        )
    })
}

fn assumption(setting: ReadingSetting, likely: Vec<f64>, usual: &[(f64, &str)], why: String) -> Assumption {
    let usual = usual.iter().map(|&(value, about)| UsualValue { value, about: about.to_owned() }).collect();
    Assumption { setting, value: likely[0], why, likely, usual, confirmed_by: None }
}

/// What the first image says against the depth scale that is set, or else against the focal length.
pub(crate) fn contradiction(settings: &SpatialSettings, scale: &DepthScale) -> Option<String> {
    wrong_scale(settings, scale).or_else(|| wrong_focal_length(settings, scale))
}

/// A triangulating camera's steps of depth tell the focal length that it measured with.
fn wrong_focal_length(settings: &SpatialSettings, scale: &DepthScale) -> Option<String> {
    let (sensor, told) = match (scale.sensor, scale.basis) {
        (DepthSensor::RealSense { focal_length }, _) => ("RealSense", focal_length),
        (DepthSensor::Kinect, ScaleBasis::DisparitySteps(c)) => ("Kinect", kinect_focal_length(c)),
        _ => return None,
    };
    let set = settings.fx;
    (set > 0.0 && !is_step_of_sensor(set / told)).then(|| {
        format!(
            "fx = {set} is given, but the spacing of the raw depth values is that of a {sensor} with a focal length of about \
             {told:.0} pixels: it is right only if the depth images were scaled, or mapped into another camera's images"
        )
    })
}

/// What the first image says against the depth scale that is set.
pub(crate) fn wrong_scale(settings: &SpatialSettings, scale: &DepthScale) -> Option<String> {
    let set = settings.depth_scale;
    if set == 0.0 {
        return None;
    }
    let fits = |value: &f64| is_step_of_sensor(value / set);
    let told = scale.per_metre();
    match scale.basis {
        ScaleBasis::DisparitySteps(_) if !fits(&told) && !scale.alternatives.iter().any(fits) => Some(format!(
            "depth_scale = {set} is set, but the spacing of the raw values is that of a depth camera with {told} values a \
             metre: is the map {:.1} times too {}?",
            (told / set).max(set / told),
            if told > set { "large" } else { "small" },
        )),
        ScaleBasis::RoomSize(median) => {
            let median = median * told / set;
            let is_plausible = median > PLAUSIBLE_MEDIAN.0 && median < PLAUSIBLE_MEDIAN.1;
            (!is_plausible).then(|| {
                format!(
                    "depth_scale = {set} puts the median depth of the first image at {median:.2} m: is it in raw values per metre?"
                )
            })
        }
        _ => None,
    }
}

impl Assumption {
    /// The same where something else confirms it, too.
    pub(crate) fn or_confirmed(self, by: impl Fn(ReadingSetting) -> Option<String>) -> Self {
        Self { confirmed_by: self.confirmed_by.or_else(|| by(self.setting)), ..self }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub fn ramp(step: Option<f64>) -> DepthImage {
        let value = |i: usize| {
            let z = 1.0 + 3.0 * i as f64 / 307_199.0;
            step.map_or(z, |c| 1.0 / (c * (1.0 / z / c).round())) * 1000.0
        };
        DepthImage {
            width: 640,
            height: 480,
            values: (0..307_200).map(|i| value(i).round() as u16).collect(),
            bits: 16,
        }
    }

    /// Steps of a Kinect's depth (1/m).
    pub const KINECT: Option<f64> = Some(1.0 / 348.0);

    pub fn of(settings: &SpatialSettings, image: &DepthImage) -> Vec<Assumption> {
        let scale = DepthScale::estimate(image);
        let camera = settings.camera(image.width, image.height, image.bits, scale.sensor).unwrap();
        assumptions(settings, image, &scale, &camera)
    }

    #[test]
    fn what_is_set_is_not_assumed() {
        let all = of(&SpatialSettings::default(), &ramp(KINECT));
        assert_eq!(
            all.iter().map(|one| (one.setting, one.value)).collect::<Vec<_>>(),
            [(ReadingSetting::DepthScale, 1000.0), (ReadingSetting::Fx, 525.0)]
        );
        assert!(all[0].usual.iter().any(|usual| usual.value == 5000.0), "{:?}", all[0]);
        let set = SpatialSettings { depth_scale: 1000.0, fx: 585.0, ..SpatialSettings::default() };
        assert_eq!(of(&set, &ramp(KINECT)), []);
        let metres = DepthImage { bits: DepthImage::METRES, ..ramp(None) };
        assert_eq!(of(&SpatialSettings::default(), &metres).len(), 1, "the focal length alone");
    }

    #[test]
    fn the_focal_length_of_depth_that_is_not_registered_to_the_colours_is_told_of_a_kinect_that_was_assumed() {
        let told = |settings: &SpatialSettings, image: &DepthImage| {
            own_focal_length_of_kinect(&of(settings, image), image.width)
        };
        let default = SpatialSettings::default();
        let note = told(&default, &ramp(KINECT)).unwrap();
        assert!(note.contains("fx = 525 is assumed") && note.contains("about fx = 576"), "{note}");
        assert_eq!(told(&SpatialSettings { fx: 525.0, ..default.clone() }, &ramp(KINECT)), None, "it is set");
        assert_eq!(told(&default, &ramp(None)), None, "another camera");
    }

    #[test]
    fn a_scale_that_the_data_contradict_is_told() {
        let told = |depth_scale, image: &DepthImage| {
            let settings = SpatialSettings { depth_scale, ..SpatialSettings::default() };
            contradiction(&settings, &DepthScale::estimate(image))
        };
        let of_kinect = ramp(KINECT);
        assert_eq!((told(1000.0, &of_kinect), told(0.0, &of_kinect)), (None, None));
        assert!(told(200.0, &of_kinect).unwrap().contains("5.0 times too large"));
        assert!(told(5000.0, &of_kinect).unwrap().contains("5.0 times too small"));
        let smooth = ramp(None);
        assert_eq!((told(1000.0, &smooth), told(4000.0, &smooth)), (None, None), "a room may be small");
        assert!(told(1.0, &smooth).unwrap().contains("at 2500"), "{:?}", told(1.0, &smooth));
        let focal = |fx| {
            let settings = SpatialSettings { fx, depth_scale: 1000.0, ..SpatialSettings::default() };
            contradiction(&settings, &DepthScale::estimate(&of_kinect))
        };
        assert_eq!((focal(525.0), focal(0.0)), (None, None));
        assert!(focal(384.0).unwrap().contains("of a Kinect with a focal length of about 580"), "{:?}", focal(384.0));
    }
}
