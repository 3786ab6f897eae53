//! All settings of a reconstruction in space, from depth images or clouds: names, defaults, limits and explanations, for
//! the page, the command line and the API alike.

use std::f64::consts::{FRAC_PI_2, PI};

use serde::{Deserialize, Serialize};

use crate::camera::Pinhole;
use crate::cloud_odometry::{CloudMethod, CloudOptions, GlobalRegistrationUse};
pub use crate::depth_odometry::ColorUse;
use crate::depth_odometry::{DepthOptions, Effort};
use crate::error::{Error, Result};
use crate::evaluation::convention::{KnownConvention, PoseDirection, QuaternionOrder, SensorAxes};
use crate::registration::solver::Motion;
use crate::registration::spatial::SpatialMetric;
use crate::settings::{SettingDescription, check_limits, choice, number};

/// What a frame is matched with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Method {
    /// Pieces of surface of a depth image with the map of those before, as the camera sees it. Clouds, which have no
    /// camera, are matched as by [`Method::CloudMap`].
    SurfelMap,
    /// A cloud with a map of voxels of those before.
    CloudMap,
    /// A cloud with the one before it.
    CloudToCloud,
    /// A cloud with the one before it, step by step as courses teach it with Open3D.
    Course,
}

/// How depth was made a whole number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Quantisation {
    /// Whichever makes the first frames fit each other better.
    ToldFromData,
    /// Cut off to whole steps: the true depth lies half a step further in the mean.
    Truncated,
    /// Rounded to the nearest step.
    Rounded,
}

impl Quantisation {
    /// What is added to a raw value to get the middle of the depths it stands for.
    pub fn offset(self) -> f64 {
        if self == Self::Truncated { 0.5 } else { 0.0 }
    }
}

/// What is done where a path comes back to a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum LoopClosing {
    /// What the way round has added up is spread over it; of depth images with surfaces.
    On,
    /// Nothing.
    Off,
}

/// How the quaternions of a reference are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum ReferenceQuaternions {
    /// As its motions fit the estimated ones best.
    ToldFromData,
    /// qx qy qz qw.
    RealPartLast,
    /// qw qx qy qz.
    RealPartFirst,
}

/// Where the sensor's axes point in a reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum ReferenceAxes {
    /// As its motions fit the estimated ones best.
    ToldFromData,
    /// [`SensorAxes::Opencv`].
    Opencv,
    /// [`SensorAxes::Opengl`].
    Opengl,
    /// [`SensorAxes::Robotics`].
    Robotics,
}

/// What a pose of a reference maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum ReferenceDirection {
    /// As its motions fit the estimated ones best.
    ToldFromData,
    /// [`PoseDirection::SensorToWorld`].
    SensorToWorld,
    /// [`PoseDirection::WorldToSensor`].
    WorldToSensor,
}

/// Settings of a reconstruction in space. The default works with nothing set on rendered rooms and on depth cameras.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct SpatialSettings {
    /// What a frame is matched with.
    pub method: Method,
    /// How hard a first guess is looked for, with surfaces.
    pub effort: Effort,
    /// What the colours of depth images are used for, with surfaces.
    pub color: ColorUse,
    /// How the sensor may move.
    pub motion: Motion,
    /// Focal length along the rows (pixels); 0: from the field of view.
    pub fx: f64,
    /// Focal length along the columns (pixels); 0: that along the rows.
    pub fy: f64,
    /// Column of the optical axis (pixels), where fx is given.
    pub cx: f64,
    /// Row of the optical axis (pixels), where fx is given.
    pub cy: f64,
    /// The angle that a row of pixels spans (rad); 0: that of a Kinect for 16 bits of 4 : 3, a right angle otherwise.
    pub field_of_view: f64,
    /// Raw depth values a metre; 0: told from the first image.
    pub depth_scale: f64,
    /// How depth was made a whole number; matters for 8 bits.
    pub quantisation: Quantisation,
    /// Nearer depths are dropped (m).
    pub min_range: f64,
    /// Farther depths are dropped (m); 0: beyond 10 m in depth images, nothing in clouds.
    pub max_range: f64,
    /// The map ends so far above the first sensor (m).
    pub max_height: f64,
    /// Clouds: one point is kept in a cube of this side (m); 0: told from the first cloud.
    pub voxel_size: f64,
    /// Clouds: what a correspondence measures.
    pub metric: SpatialMetric,
    /// Clouds: pairs further apart are no correspondences (m); 0: three voxels.
    pub max_correspondence_distance: f64,
    /// Clouds: when features are searched for over the whole of two clouds.
    pub global_registration: GlobalRegistrationUse,
    /// What is done where the path comes back to a place.
    pub loop_closing: LoopClosing,
    /// The map holds one point in a cube of this side (m); 0: 2 cm, for clouds half their voxel.
    pub map_voxel_size: f64,
    /// The reference: order of its quaternions.
    pub reference_quaternions: ReferenceQuaternions,
    /// The reference: the axes of its sensor.
    pub reference_axes: ReferenceAxes,
    /// The reference: what its poses map.
    pub reference_direction: ReferenceDirection,
}

impl Default for SpatialSettings {
    fn default() -> Self {
        Self {
            method: Method::SurfelMap,
            effort: Effort::Thorough,
            color: ColorUse::default(),
            motion: Motion::Free,
            fx: 0.0,
            fy: 0.0,
            cx: 0.0,
            cy: 0.0,
            field_of_view: 0.0,
            depth_scale: 0.0,
            quantisation: Quantisation::ToldFromData,
            min_range: 0.1,
            max_range: 0.0,
            max_height: 100.0,
            voxel_size: 0.0,
            metric: SpatialMetric::PointToPlane,
            max_correspondence_distance: 0.0,
            global_registration: GlobalRegistrationUse::WhenDoubtful,
            loop_closing: LoopClosing::On,
            map_voxel_size: 0.0,
            reference_quaternions: ReferenceQuaternions::ToldFromData,
            reference_axes: ReferenceAxes::ToldFromData,
            reference_direction: ReferenceDirection::ToldFromData,
        }
    }
}

/// Depth images are used as far as this (m), unless set.
const DEPTH_REACH: f64 = 10.0;
/// Depth images make a map of voxels of this side (m), unless set.
const DEPTH_MAP_VOXEL: f64 = 0.02;
/// Voxels of depth images taken for clouds (m), unless set.
const DEPTH_VOXEL: f64 = 0.05;
/// Focal length over the width of the image of a Kinect, as the TUM RGB-D benchmark and Open3D assume it: 525 / 640.
const KINECT_FOCAL_LENGTH: f64 = 525.0 / 640.0;

impl SpatialSettings {
    /// Checks every value against the limits of its description.
    ///
    /// # Errors
    /// Names the first setting out of its limits, with the value and the limits.
    pub fn validate(&self) -> Result<()> {
        check_limits(&spatial_descriptions(), |name| self.number(name))?;
        if self.max_range > 0.0 && self.min_range >= self.max_range {
            return Err(Error::whole(
                format!("min_range = {} is not below max_range = {}", self.min_range, self.max_range),
                "Give a smaller min_range or a larger max_range",
            ));
        }
        Ok(())
    }

    /// The value of a numeric setting by its name; NaN for a choice.
    fn number(&self, name: &str) -> f64 {
        match name {
            "fx" => self.fx,
            "fy" => self.fy,
            "cx" => self.cx,
            "cy" => self.cy,
            "field_of_view" => self.field_of_view,
            "depth_scale" => self.depth_scale,
            "min_range" => self.min_range,
            "max_range" => self.max_range,
            "max_height" => self.max_height,
            "voxel_size" => self.voxel_size,
            "max_correspondence_distance" => self.max_correspondence_distance,
            "map_voxel_size" => self.map_voxel_size,
            _ => f64::NAN,
        }
    }

    /// What is left open, for depth images.
    #[must_use]
    pub fn for_depth(&self) -> Self {
        let or = |value: f64, default: f64| if value > 0.0 { value } else { default };
        Self {
            max_range: or(self.max_range, DEPTH_REACH),
            voxel_size: or(self.voxel_size, DEPTH_VOXEL),
            map_voxel_size: or(self.map_voxel_size, DEPTH_MAP_VOXEL),
            ..self.clone()
        }
    }

    /// What is left open, for clouds of which half the points lie nearer than `median_range` (m).
    #[must_use]
    pub fn for_clouds(&self, median_range: f64) -> Self {
        let or = |value: f64, default: f64| if value > 0.0 { value } else { default };
        let voxel_size = or(self.voxel_size, (median_range / 40.0).clamp(0.02, 1.0));
        let method = if self.method == Method::SurfelMap { Method::CloudMap } else { self.method };
        let max_range = or(self.max_range, f64::MAX);
        Self {
            method,
            max_range,
            voxel_size,
            map_voxel_size: or(self.map_voxel_size, voxel_size / 2.0),
            ..self.clone()
        }
    }

    /// What is set of the reading of a reference. The estimate does not depend on it.
    pub fn known_convention(&self) -> KnownConvention {
        KnownConvention {
            quaternion_order: match self.reference_quaternions {
                ReferenceQuaternions::ToldFromData => None,
                ReferenceQuaternions::RealPartLast => Some(QuaternionOrder::RealPartLast),
                ReferenceQuaternions::RealPartFirst => Some(QuaternionOrder::RealPartFirst),
            },
            sensor_axes: match self.reference_axes {
                ReferenceAxes::ToldFromData => None,
                ReferenceAxes::Opencv => Some(SensorAxes::Opencv),
                ReferenceAxes::Opengl => Some(SensorAxes::Opengl),
                ReferenceAxes::Robotics => Some(SensorAxes::Robotics),
            },
            direction: match self.reference_direction {
                ReferenceDirection::ToldFromData => None,
                ReferenceDirection::SensorToWorld => Some(PoseDirection::SensorToWorld),
                ReferenceDirection::WorldToSensor => Some(PoseDirection::WorldToSensor),
            },
        }
    }

    /// The options of the odometry of depth images.
    pub fn depth_options(&self) -> DepthOptions {
        DepthOptions { motion: self.motion, effort: self.effort, color: self.color }
    }

    /// The options of the odometry of clouds, once nothing is left open.
    pub fn cloud_options(&self) -> CloudOptions {
        let base = match self.method {
            Method::Course => CloudOptions::course(self.voxel_size),
            _ => CloudOptions::new(self.voxel_size),
        };
        let max_correspondence_distance = if self.max_correspondence_distance > 0.0 {
            self.max_correspondence_distance
        } else {
            base.max_correspondence_distance
        };
        let is_map = matches!(self.method, Method::SurfelMap | Method::CloudMap);
        CloudOptions {
            method: if is_map { CloudMethod::CloudMap } else { CloudMethod::CloudToCloud },
            metric: self.metric,
            motion: self.motion,
            global_registration: self.global_registration,
            max_correspondence_distance,
            ..base
        }
    }

    /// The camera of images of this size: as set, or what such images mostly come from.
    ///
    /// # Errors
    /// When what is set makes no camera.
    pub fn camera(&self, width: usize, height: usize, bits: u8) -> Result<Pinhole> {
        if self.fx > 0.0 {
            let fy = if self.fy > 0.0 { self.fy } else { self.fx };
            return Pinhole::new(width, height, [self.fx, fy, self.cx, self.cy]);
        }
        if self.field_of_view == 0.0 && bits > 8 && 3 * width == 4 * height {
            let f = KINECT_FOCAL_LENGTH * width as f64;
            return Pinhole::new(width, height, [f, f, (width as f64 - 1.0) / 2.0, (height as f64 - 1.0) / 2.0]);
        }
        let field_of_view = if self.field_of_view == 0.0 { FRAC_PI_2 } else { self.field_of_view };
        Pinhole::from_field_of_view(width, height, field_of_view)
    }
}

/// Settings in space for one purpose.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct SpatialPreset {
    /// Name on the command line.
    pub name: &'static str,
    /// What a person reads.
    pub label: &'static str,
    /// One line on what it is for.
    pub explanation: &'static str,
    /// Its settings.
    pub settings: SpatialSettings,
}

/// The presets; the first is the default.
pub fn spatial_presets() -> Vec<SpatialPreset> {
    vec![
        SpatialPreset {
            name: "best",
            label: "Best",
            explanation: "Each frame against the map of all before it; every result is checked before it is believed. The default.",
            settings: SpatialSettings::default(),
        },
        SpatialPreset {
            name: "course",
            label: "Course pipeline",
            explanation: "As courses teach it with Open3D: voxels of 5 cm, FPFH, RANSAC, point-to-plane ICP, each frame with the one before it.",
            settings: SpatialSettings {
                method: Method::Course,
                // Courses take the raw value for the depth, whatever it is.
                quantisation: Quantisation::Rounded,
                min_range: 0.0,
                voxel_size: 0.05,
                max_correspondence_distance: 0.02,
                global_registration: GlobalRegistrationUse::Always,
                ..SpatialSettings::default()
            },
        },
        SpatialPreset {
            name: "fast",
            label: "Fast",
            explanation: "Fewer points, and fewer places where a frame is looked for, unless that is doubtful; a map of 5 cm.",
            settings: SpatialSettings { effort: Effort::Quick, map_voxel_size: 0.05, ..SpatialSettings::default() },
        },
    ]
}

/// Every setting, in the order of the page.
#[allow(clippy::too_many_lines)] // a list: one entry a setting
pub fn spatial_descriptions() -> Vec<SettingDescription> {
    let pixels = |name, label, explanation| number(name, label, "Camera", "", explanation, (0.0, 1e5, 1.0));
    vec![
        choice(
            "method",
            "Method",
            "Registration",
            "What a frame is matched with. Surfaces in depth images are known best; clouds of other sensors use voxels in any case.",
            &[
                ("surfel_map", "Surfaces with the map"),
                ("cloud_map", "Cloud with the map"),
                ("cloud_to_cloud", "Cloud with the one before"),
                ("course", "Course pipeline"),
            ],
        ),
        choice(
            "effort",
            "Search",
            "Registration",
            "Surfaces: thorough looks for every frame in hundreds of places, quick in a few dozen unless that is doubtful.",
            &[("thorough", "Thorough"), ("quick", "Quick")],
        ),
        choice(
            "color",
            "Colours",
            "Registration",
            "Surfaces: what is painted on walls tells where along them the camera is. Colours count by how well they fit, so that changing light does no harm.",
            &[
                ("used", "Used where they fit"),
                ("where_open", "Where surfaces leave it open"),
                ("not_used", "For the map only"),
            ],
        ),
        choice(
            "loop_closing",
            "Loops",
            "Registration",
            "Surfaces: where the path comes back to a place and does not quite meet it, the error is spread over the way round.",
            &[("on", "Closed"), ("off", "Left as they are")],
        ),
        choice(
            "motion",
            "Motion",
            "Registration",
            "Free, or on a floor with a level sensor: then height and tilt stay as they were in the first frame.",
            &[("free", "Free"), ("planar", "On a floor")],
        ),
        choice(
            "global_registration",
            "Global search",
            "Registration",
            "Clouds: features are matched over both clouds, without a first guess. Slow and sure, so mostly for doubtful frames.",
            &[("when_doubtful", "When doubtful"), ("always", "Always"), ("never", "Never")],
        ),
        choice(
            "metric",
            "Metric",
            "Registration",
            "Clouds: point to plane lets walls slide along themselves; GICP knows surfaces on both sides.",
            &[("point_to_plane", "Point to plane"), ("gicp", "GICP")],
        ),
        number(
            "voxel_size",
            "Voxel",
            "Registration",
            "m",
            "Clouds: one point is kept in a cube of this side. Outdoors 0.25 to 1 m, in rooms 0.02 to 0.1 m. 0: told from the first cloud.",
            (0.0, 10.0, 0.01),
        ),
        number(
            "max_correspondence_distance",
            "Pair distance",
            "Registration",
            "m",
            "Clouds: points further apart than this are no pair. 0: three voxels.",
            (0.0, 100.0, 0.05),
        ),
        pixels("fx", "Focal length", "Along the rows, in pixels. 0: from the field of view."),
        pixels("fy", "Focal length, columns", "Along the columns, in pixels. 0: as along the rows."),
        pixels("cx", "Optical axis, column", "In pixels; counts where a focal length is given."),
        pixels("cy", "Optical axis, row", "In pixels; counts where a focal length is given."),
        number(
            "field_of_view",
            "Field of view",
            "Camera",
            "rad",
            "The angle that a row of pixels spans. 0: a Kinect's for 16-bit images of 4 : 3, 90 degrees otherwise.",
            (0.0, 0.99 * PI, 0.05),
        ),
        number(
            "depth_scale",
            "Depth scale",
            "Depth",
            "",
            "Raw values a metre: 1000 for millimetres, 5000 in TUM's, 25.5 for 8 bits over 10 m. 0: told from the first image.",
            (0.0, 1e6, 1.0),
        ),
        choice(
            "quantisation",
            "Rounding",
            "Depth",
            "8-bit depth has steps of centimetres. Cut off to whole steps, the true depth lies half a step further.",
            &[("told_from_data", "Told from the data"), ("truncated", "Cut off"), ("rounded", "Rounded")],
        ),
        number("min_range", "Nearest depth", "Depth", "m", "Nearer depths are dropped.", (0.0, 100.0, 0.05)),
        number(
            "max_range",
            "Farthest depth",
            "Depth",
            "m",
            "Farther points are dropped. 0: beyond 10 m in depth images, nothing in clouds.",
            (0.0, 1000.0, 0.5),
        ),
        number(
            "max_height",
            "Height of the map",
            "Map",
            "m",
            "What lies further above the first sensor is left out of the map: ceilings hide the floor plan.",
            (-100.0, 1000.0, 0.1),
        ),
        number(
            "map_voxel_size",
            "Map voxel",
            "Map",
            "m",
            "The map holds one point in a cube of this side. 0: 2 cm, for clouds half their voxel.",
            (0.0, 10.0, 0.01),
        ),
        choice(
            "reference_quaternions",
            "Quaternions",
            "True poses",
            "How the file of true poses orders its quaternions. It is used to compare only, never to estimate.",
            &[
                ("told_from_data", "Told from the data"),
                ("real_part_last", "qx qy qz qw"),
                ("real_part_first", "qw qx qy qz"),
            ],
        ),
        choice(
            "reference_axes",
            "Camera axes",
            "True poses",
            "Where the camera's axes point in the file of true poses.",
            &[
                ("told_from_data", "Told from the data"),
                ("opencv", "x right, y down, z forward"),
                ("opengl", "x right, y up, z backward"),
                ("robotics", "x forward, y left, z up"),
            ],
        ),
        choice(
            "reference_direction",
            "Direction",
            "True poses",
            "What a true pose turns into what: mostly camera coordinates into those of the world.",
            &[
                ("told_from_data", "Told from the data"),
                ("sensor_to_world", "Camera to world"),
                ("world_to_sensor", "World to camera"),
            ],
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::SettingKind;

    #[test]
    fn every_setting_is_described_once_and_every_preset_is_valid() {
        let fields = serde_json::to_value(SpatialSettings::default()).unwrap();
        let mut fields: Vec<String> = fields.as_object().unwrap().keys().cloned().collect();
        let mut described: Vec<String> = spatial_descriptions().iter().map(|d| d.name.to_owned()).collect();
        fields.sort();
        described.sort();
        assert_eq!(fields, described);
        for preset in spatial_presets() {
            preset.settings.validate().unwrap();
        }
        assert_eq!(spatial_presets()[0].settings, SpatialSettings::default());
    }

    #[test]
    fn every_choice_is_a_value_and_every_number_has_its_limits() {
        for description in spatial_descriptions() {
            match &description.kind {
                SettingKind::Choice { choices } => {
                    for choice in choices {
                        let json = serde_json::json!({ description.name: choice.value });
                        let settings: SpatialSettings = serde_json::from_value(json).unwrap();
                        assert_eq!(serde_json::to_value(&settings).unwrap()[description.name], choice.value);
                    }
                }
                _ => assert!(SpatialSettings::default().number(description.name).is_finite(), "{}", description.name),
            }
        }
        let error = SpatialSettings { min_range: 5.0, max_range: 1.0, ..SpatialSettings::default() }.validate();
        assert!(error.unwrap_err().to_string().contains("min_range = 5"));
        let error = SpatialSettings { depth_scale: f64::NAN, ..SpatialSettings::default() }.validate();
        assert!(error.unwrap_err().to_string().contains("depth_scale"));
    }

    #[test]
    fn the_camera_is_the_set_one_or_the_likely_one() {
        let default = SpatialSettings::default();
        let of = |settings: &SpatialSettings, width, height, bits| {
            let camera = settings.camera(width, height, bits).unwrap();
            [camera.fx, camera.fy, camera.cx, camera.cy].map(|value| (value * 1e6).round() / 1e6)
        };
        assert_eq!(of(&default, 512, 512, 8), [256.0, 256.0, 256.0, 256.0]);
        assert_eq!(of(&default, 640, 480, 16), [525.0, 525.0, 319.5, 239.5]);
        assert_eq!(of(&SpatialSettings { field_of_view: PI / 2.0, ..default.clone() }, 640, 480, 16)[0], 320.0);
        let set = SpatialSettings { fx: 585.0, cx: 320.0, cy: 240.0, ..default };
        assert_eq!(of(&set, 640, 480, 16), [585.0, 585.0, 320.0, 240.0]);
    }
}
