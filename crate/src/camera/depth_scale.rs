//! How many metres a raw step of depth is, and what kind of camera measured it, told from one image.
//!
//! Nothing in a PNG file says so, and registration cannot tell either: a world twice as large fits as well. What does tell:
//!
//! - A triangulating camera measures disparity in fixed steps, so its depth comes in steps of c z^2 (Khoshelham and
//!   Elberink, "Accuracy and resolution of Kinect depth data", Sensors 12 (2012), eq. 3 to 5): 1/z is evenly spaced.
//!   c is known for each kind of camera (1/m), and measured in raw values it gives the scale. A plane in a rendered image has
//!   evenly spaced 1/z as well, each plane its own: a camera's are multiples of one step in the whole image.
//! - Where there are no such steps (rendered, time of flight, filtered), the size of rooms: half of all pixels lie about
//!   two metres away. Renderers leave no holes, real cameras do.

use super::depth_image::DepthImage;
use super::depth_levels::Levels;
use crate::geometry::hypotheses::{alternatives, gaussian, log_normal, ranked};
use crate::geometry::quantile::THREE_SIGMA;

/// Depth along the optical axis in metres = raw value * `step`.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthScale {
    /// Metres a raw step.
    pub step: f64,
    /// What it was told from.
    pub basis: ScaleBasis,
    /// Kind of camera, as far as its disparity steps tell.
    pub sensor: DepthSensor,
    /// Raw values per metre that are possible as well, the likeliest first.
    pub alternatives: Vec<f64>,
}

/// What a depth scale was told from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ScaleBasis {
    /// The file holds metres.
    Metres,
    /// 8 bits over 10 m: v / 255 * 10, as the renderings of rooms used in teaching have it.
    EightBits,
    /// Steps of c z^2 with this c (1/m).
    DisparitySteps(f64),
    /// The median depth, in metres at this scale.
    RoomSize(f64),
}

/// Kind of depth camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DepthSensor {
    /// Structured light with disparities of 1/8 pixel: Kinect, Xtion, PrimeSense.
    Kinect,
    /// Stereo with disparities of 1/32 pixel: RealSense D400. Its step is 1 / (32 f b) with a known baseline b, so it
    /// determines the focal length, too.
    RealSense {
        /// Of the depth image (pixels).
        focal_length: f64,
    },
    /// Rendered, time of flight, filtered, or not known.
    Unknown,
}

/// A way to store depth: raw values per metre, how common it is, and who uses it.
struct Candidate {
    per_metre: f64,
    prior: f64,
    /// Which cameras' raw data it is used with: Kinect, RealSense.
    sensors: [bool; 2],
    /// Whether renderers use it.
    is_rendered: bool,
}

/// Millimetres: most cameras and data sets. 5,000: TUM RGB-D. 8,000: SUN RGB-D, which rotates the bits by three. 4,000:
/// Matterport3D. 10,000: cameras at 0.1 mm. 65,535 over 10 m: renderings of Replica.
/// 256: KITTI, and networks that estimate depth.
const CANDIDATES: [Candidate; 7] = [
    Candidate { per_metre: 1000.0, prior: 0.6, sensors: [true, true], is_rendered: true },
    Candidate { per_metre: 6553.5, prior: 0.15, sensors: [false, false], is_rendered: true },
    Candidate { per_metre: 5000.0, prior: 0.1, sensors: [true, false], is_rendered: true },
    Candidate { per_metre: 8000.0, prior: 0.05, sensors: [true, false], is_rendered: false },
    Candidate { per_metre: 4000.0, prior: 0.05, sensors: [true, false], is_rendered: true },
    Candidate { per_metre: 10_000.0, prior: 0.05, sensors: [true, true], is_rendered: false },
    Candidate { per_metre: 256.0, prior: 0.02, sensors: [false, false], is_rendered: true },
];

/// Kinect: 1 / (8 f b) with f = 580 pixels and b = 0.075 m (1/m).
const KINECT_STEP: f64 = 1.0 / (8.0 * 580.0 * KINECT_BASELINE);
/// From the projector to the camera (m).
const KINECT_BASELINE: f64 = 0.075;
/// Deviation of a camera's step from its nominal one, as a logarithm: calibration, resampling, 16 : 9 at the same width. On seven
/// recordings of Kinects it is 0.10.
const STEP_DEVIATION: f64 = 0.12;
/// RealSense D400: baseline (m) and focal length at 4 : 3 (shares of the width), by the datasheet: D435, D415, D455.
const REALSENSES: [(f64, f64); 3] = [(0.05, 0.6), (0.055, 0.955), (0.095, 0.61)];
/// Median depth of an indoor image (m), and its deviation as a logarithm. On eight recordings it is 1.0 to 3.3 m.
const ROOM_MEDIAN: (f64, f64) = (2.2, 0.6);
/// Largest depth that cameras measure (m), and its deviation as a logarithm.
pub(crate) const MAX_SENSOR_RANGE: (f64, f64) = (10.0, 0.2);
/// More pixels without depth than this and the image was not rendered.
const MAX_RENDERED_HOLES: f64 = 0.01;
/// A candidate this much less probable than the best is not named.
const MIN_ALTERNATIVE: f64 = 0.05;
/// Share of the recordings whose values all are multiples of something else than 1 mm or a power of ten of it: no camera above writes them.
const UNUSUAL_MULTIPLES: f64 = 0.02;
/// Share of 6,553.5 values a metre among images of TUM's size, and of 5,000 among others: renderers with the second make images as
/// TUM's are, those with the first make square or wide ones.
const SCALE_OF_OTHER_IMAGES: f64 = 0.2;

impl DepthScale {
    /// The likeliest scale and its alternatives.
    pub fn estimate(image: &DepthImage) -> Self {
        let known = |step, basis| Self { step, basis, sensor: DepthSensor::Unknown, alternatives: Vec::new() };
        if image.bits == DepthImage::METRES {
            return known(1e-3, ScaleBasis::Metres);
        }
        if image.bits <= 8 {
            return known(10.0 / 255.0, ScaleBasis::EightBits);
        }
        let levels = Levels::new(image);
        let step = levels.disparity_step();
        let ranked = ranked(
            CANDIDATES
                .iter()
                .map(|candidate| (candidate.prior * candidate.likelihood(image, &levels, step), candidate.per_metre)),
        );
        let (_, per_metre) = ranked[0];
        let (basis, sensor) = match step.map(|step| step * per_metre) {
            Some(c) if kinect_likelihood(c) >= realsense_likelihood(c, image.width) => {
                (ScaleBasis::DisparitySteps(c), DepthSensor::Kinect)
            }
            Some(c) => {
                let (focal_length, _) = realsense(c, image.width);
                (ScaleBasis::DisparitySteps(c), DepthSensor::RealSense { focal_length })
            }
            None => (ScaleBasis::RoomSize(levels.median / per_metre), DepthSensor::Unknown),
        };
        Self { step: 1.0 / per_metre, basis, sensor, alternatives: alternatives(&ranked, MIN_ALTERNATIVE) }
    }

    /// Raw values per metre.
    pub fn per_metre(&self) -> f64 {
        1.0 / self.step
    }

    /// What in the image confirms the scale: the disparity steps of a known sensor, at no other scale in use. The size of
    /// rooms confirms none, as a small room and a large one look alike.
    /// `width` is that of the image (pixels).
    pub fn confirmed_by(&self, width: usize) -> Option<String> {
        let ScaleBasis::DisparitySteps(c) = self.basis else { return None };
        let (sensor, ratio) = match self.sensor {
            DepthSensor::Kinect => ("Kinect", c / KINECT_STEP),
            DepthSensor::RealSense { .. } => ("RealSense", realsense(c, width).1.exp()),
            DepthSensor::Unknown => return None,
        };
        (self.alternatives.is_empty() && is_step_of_sensor(ratio))
            .then(|| format!("the disparity steps of a {sensor}, which fit no other scale in use"))
    }

    /// What is assumed and why, for the user; none where there is nothing to doubt or nothing unusual.
    pub fn note(&self) -> Option<String> {
        let numbers = |values: &[f64]| values.iter().map(|value| trimmed(&format!("{value:.6}"))).collect::<Vec<_>>();
        let is_usual = self.step == 1e-3 && self.alternatives.is_empty();
        let why = match self.basis {
            ScaleBasis::DisparitySteps(_) if !is_usual => "the spacing of its values".to_owned(),
            ScaleBasis::RoomSize(median) if !is_usual => format!("the size of rooms (median depth {median:.1} m)"),
            _ => return None,
        };
        let others = match numbers(&self.alternatives).as_slice() {
            [] => String::new(),
            others => format!("; possible as well: {}", others.join(", ")),
        };
        let assumed = numbers(&[self.per_metre()]).join("");
        Some(format!(
            "The depth images do not state their depth scale: {assumed} raw values per metre are assumed from {why}{others}. \
             Set depth_scale to the right number if the map has the wrong size."
        ))
    }
}

/// Whether a sensor's steps may be off from its nominal ones by this factor.
pub(crate) fn is_step_of_sensor(ratio: f64) -> bool {
    ratio.ln().abs() < THREE_SIGMA * STEP_DEVIATION
}

/// Focal length (pixels) of a Kinect whose depth has steps of c z^2 (1/m).
pub(crate) fn kinect_focal_length(c: f64) -> f64 {
    1.0 / (8.0 * KINECT_BASELINE * c)
}

fn trimmed(number: &str) -> String {
    number.trim_end_matches('0').trim_end_matches('.').to_owned()
}

impl Candidate {
    /// How well an image fits this way to store depth; `step` is that of its inverse raw values, if they are evenly spaced.
    fn likelihood(&self, image: &DepthImage, levels: &Levels, step: Option<f64>) -> f64 {
        let of_multiples = if self.are_usual_multiples(levels.common_divisor()) { 1.0 } else { UNUSUAL_MULTIPLES };
        of_multiples * self.likelihood_of_spacing(image, levels, step)
    }

    /// Whether values that all are multiples of this one are so of 1 mm or a power of ten of it: 5,000 values a metre are made of whole
    /// millimetres as a rule, by a factor of 5.
    fn are_usual_multiples(&self, divisor: u16) -> bool {
        let millimetres = 1e3 * f64::from(divisor) / self.per_metre;
        divisor == 1 || (millimetres >= 1.0 && millimetres.log10().fract() == 0.0)
    }

    fn likelihood_of_spacing(&self, image: &DepthImage, levels: &Levels, step: Option<f64>) -> f64 {
        if let Some(step) = step {
            let c = step * self.per_metre;
            let of_sensor = [kinect_likelihood(c), realsense_likelihood(c, image.width)];
            return of_sensor.iter().zip(self.sensors).map(|(p, used)| if used { *p } else { 0.0 }).fold(0.0, f64::max);
        }
        if !self.stores_smooth_depth(image, levels.holes) {
            return 0.0;
        }
        let room = log_normal(levels.median / self.per_metre, ROOM_MEDIAN);
        let is_tum = self.per_metre == 5000.0;
        let is_unusual = if has_size_of_tum(image) { self.is_only_rendered() } else { is_tum };
        let room = if is_unusual { SCALE_OF_OTHER_IMAGES * room } else { room };
        let is_camera = levels.holes >= MAX_RENDERED_HOLES;
        let beyond = (levels.far / self.per_metre / MAX_SENSOR_RANGE.0).ln().max(0.0) / MAX_SENSOR_RANGE.1;
        room * if is_camera { gaussian(beyond) } else { 1.0 }
    }

    /// Whether depth without disparity steps is stored like this: what only cameras use, not without holes; what only
    /// renderers use, only without; TUM's way with holes in images of its size alone.
    fn stores_smooth_depth(&self, image: &DepthImage, holes: f64) -> bool {
        let is_rendered = holes < MAX_RENDERED_HOLES;
        let is_tum = self.per_metre == 5000.0;
        let is_of_kind = if is_rendered { self.is_rendered } else { !self.is_only_rendered() };
        is_of_kind && (!is_tum || is_rendered || has_size_of_tum(image))
    }

    fn is_only_rendered(&self) -> bool {
        self.is_rendered && self.sensors == [false, false]
    }
}

/// The size of TUM RGB-D's and ICL-NUIM's images, or half of it.
fn has_size_of_tum(image: &DepthImage) -> bool {
    [(640, 480), (320, 240)].contains(&(image.width, image.height))
}

fn kinect_likelihood(c: f64) -> f64 {
    log_normal(c, (KINECT_STEP, STEP_DEVIATION))
}

fn realsense_likelihood(c: f64, width: usize) -> f64 {
    gaussian(realsense(c, width).1 / STEP_DEVIATION)
}

/// Focal length (pixels) of the RealSense that has the step c (1/m), and how far it is from the nominal one (logarithm).
fn realsense(c: f64, width: usize) -> (f64, f64) {
    let of_model = REALSENSES.map(|(baseline, nominal)| {
        let focal_length = 1.0 / (32.0 * baseline * c);
        (focal_length, (focal_length / (nominal * width as f64)).ln().abs())
    });
    of_model.into_iter().fold((0.0, f64::INFINITY), |best, other| if other.1 < best.1 { other } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp from `near` to `far` (m), stored with so many raw values per metre, by a camera with this step c (1/m), if any.
    fn ramp((near, far): (f64, f64), per_metre: f64, step: Option<f64>, holes: f64) -> DepthImage {
        let value = |i: usize| {
            let z = near + (far - near) * i as f64 / 307_199.0;
            let z = step.map_or(z, |c| 1.0 / (c * (1.0 / z / c).round()));
            if (i as f64 * 0.618).fract() < holes { 0 } else { (z * per_metre).round() as u16 }
        };
        DepthImage { width: 640, height: 480, values: (0..307_200).map(value).collect(), bits: 16 }
    }

    /// The same kind of camera, with a focal length within 2 %.
    fn is_alike(one: DepthSensor, other: DepthSensor) -> bool {
        match (one, other) {
            (DepthSensor::RealSense { focal_length: a }, DepthSensor::RealSense { focal_length: b }) => {
                (a / b).ln().abs() < 0.02
            }
            _ => one == other,
        }
    }

    #[test]
    fn the_spacing_of_a_triangulating_camera_tells_the_scale_and_the_camera() {
        for (per_metre, c, sensor) in [
            (1000.0, KINECT_STEP, DepthSensor::Kinect),
            (1000.0, 1.2 * KINECT_STEP, DepthSensor::Kinect),
            (5000.0, KINECT_STEP, DepthSensor::Kinect),
            (5000.0, 0.88 * KINECT_STEP, DepthSensor::Kinect),
            (8000.0, KINECT_STEP, DepthSensor::Kinect),
            (1000.0, 1.0 / (32.0 * 384.0 * 0.05), DepthSensor::RealSense { focal_length: 384.0 }),
            (1000.0, 1.0 / (32.0 * 611.0 * 0.055), DepthSensor::RealSense { focal_length: 611.0 }),
            (1000.0, 1.0 / (32.0 * 390.0 * 0.095), DepthSensor::RealSense { focal_length: 390.0 }),
        ] {
            for far in [4.0, 6.0] {
                let scale = DepthScale::estimate(&ramp((1.0, far), per_metre, Some(c), 0.1));
                assert_eq!(scale.per_metre(), per_metre, "{c} {far}: {scale:?}");
                assert!(is_alike(scale.sensor, sensor), "{c} {far}: {scale:?}");
            }
        }
    }

    #[test]
    fn what_all_values_are_multiples_of_tells_the_scale_as_well() {
        for (per_metre, factor) in [(5000.0, 5), (8000.0, 8), (10_000.0, 10)] {
            let millimetres = ramp((1.0, 6.0), 1000.0, Some(KINECT_STEP), 0.1);
            let values = millimetres.values.iter().map(|value| factor * value).collect();
            let scale = DepthScale::estimate(&DepthImage { values, ..millimetres });
            assert_eq!((scale.per_metre(), scale.alternatives.len()), (per_metre, 0), "{scale:?}");
        }
        // In whole centimetres.
        let millimetres = ramp((0.5, 3.5), 1000.0, None, 0.0);
        let values = millimetres.values.iter().map(|value| value / 10 * 10).collect();
        assert_eq!(DepthScale::estimate(&DepthImage { values, ..millimetres }).per_metre(), 1000.0);
    }

    #[test]
    fn only_the_steps_of_a_known_sensor_confirm_a_scale() {
        let confirmed = |per_metre, c| {
            let image = ramp((1.0, 4.0), per_metre, c, 0.1);
            DepthScale::estimate(&image).confirmed_by(image.width)
        };
        let by = confirmed(1000.0, Some(KINECT_STEP)).unwrap();
        assert!(by.contains("steps of a Kinect"), "{by}");
        assert_eq!(confirmed(5000.0, Some(KINECT_STEP)), None, "4000 is possible as well");
        assert!(confirmed(1000.0, Some(1.0 / (32.0 * 384.0 * 0.05))).unwrap().contains("steps of a RealSense"));
        assert_eq!(confirmed(1000.0, Some(2.5 * KINECT_STEP)), None, "steps of no known sensor");
        assert_eq!(confirmed(1000.0, None), None, "the size of rooms");
        let eight_bits = DepthImage { bits: 8, values: vec![77; 100], width: 10, height: 10 };
        assert_eq!(DepthScale::estimate(&eight_bits).confirmed_by(10), None);
    }

    #[test]
    fn without_steps_the_size_of_rooms_decides() {
        let rendered = |per_metre| {
            DepthScale::estimate(&DepthImage { width: 512, height: 600, ..ramp((0.5, 3.5), per_metre, None, 0.0) })
        };
        assert_eq!(rendered(1000.0).per_metre(), 1000.0);
        assert!(rendered(1000.0).alternatives.is_empty() && rendered(1000.0).note().is_none());
        assert_eq!(rendered(6553.5).per_metre(), 6553.5);
        assert!(rendered(6553.5).alternatives.contains(&4000.0), "two close scales cannot be told apart by size");
        assert!(rendered(6553.5).note().unwrap().contains("6553.5 raw values per metre are assumed"));
        // Matterport3D: at a millimetre the camera would see 14 m.
        let matterport = DepthImage { width: 512, height: 600, ..ramp((0.5, 3.8), 4000.0, None, 0.2) };
        assert_eq!(DepthScale::estimate(&matterport).per_metre(), 4000.0);
        // Holes: not rendered, so not a renderer's scale.
        assert_ne!(DepthScale::estimate(&ramp((0.5, 3.5), 6553.5, None, 0.2)).per_metre(), 6553.5);
    }

    /// Floor and ceiling of a rendered hall, whose inverse depth is even from row to row, each in its own steps.
    #[test]
    fn the_planes_of_a_rendered_image_are_no_disparity_steps() {
        let inverse =
            |row: usize| if row < 240 { 0.2 + 0.0011 * (240 - row) as f64 } else { 0.2 + 0.0017 * (row - 239) as f64 };
        let values = (0..480usize).flat_map(|row| std::iter::repeat_n((5000.0 / inverse(row)).round() as u16, 640));
        let image = DepthImage { width: 640, height: 480, values: values.collect(), bits: 16 };
        let scale = DepthScale::estimate(&image);
        assert_eq!((scale.per_metre(), scale.sensor), (5000.0, DepthSensor::Unknown), "{scale:?}");
        assert!(super::super::depth_levels::disparity_step(&image).is_none() && !scale.alternatives.is_empty());
    }

    #[test]
    fn what_is_known_is_not_guessed() {
        let image = |bits, values: &[u16]| DepthImage { width: values.len(), height: 1, values: values.to_vec(), bits };
        assert_eq!(DepthScale::estimate(&image(8, &[10, 200])).step, 10.0 / 255.0);
        let metres = DepthScale::estimate(&image(DepthImage::METRES, &[0, 14_000, 15_000]));
        assert_eq!((metres.step, metres.note()), (1e-3, None));
        assert_eq!(DepthScale::estimate(&image(16, &[0, 0])).step, 1e-3);
    }
}
