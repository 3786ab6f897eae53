//! The settings of a reconstruction in space, from depth images or clouds: names, defaults, limits and explanations, for the
//! page, the command line and the API.

mod choices;
mod list;

use std::f64::consts::FRAC_PI_2;

use serde::{Deserialize, Serialize};

pub use self::choices::{LoopClosing, Method, Quantisation, ReferenceAxes, ReferenceDirection, ReferenceQuaternions};
pub use self::list::{spatial_descriptions, spatial_presets};
use crate::camera::depth_scale::MAX_SENSOR_RANGE;
use crate::camera::{DepthSensor, DepthValues, Pinhole};
use crate::error::Result;
use crate::evaluation::convention::{KnownConvention, PoseDirection, QuaternionOrder, SensorAxes};
use crate::odometry::cloud::{CloudMethod, CloudOptions, GlobalRegistrationUse};
pub use crate::odometry::depth::ColorUse;
use crate::odometry::depth::{DepthOptions, Effort};
use crate::pipeline::settings::description::{check_limits, check_range};
use crate::preprocess::depth_cloud::DEPTH_VOXEL;
use crate::registration::free_space::DepthNoise;
use crate::registration::solver::Motion;
use crate::registration::spatial::SpatialMetric;

/// Settings of a reconstruction in space. The defaults are meant for depth cameras, rendered rooms and clouds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct SpatialSettings {
    /// What a frame is registered to.
    pub method: Method,
    /// Surfels: number of points of the final registration.
    pub effort: Effort,
    /// Surfels: use of the colours of depth images.
    pub color: ColorUse,
    /// Degrees of freedom of the sensor's motion.
    pub motion: Motion,
    /// Focal length along the rows (pixels); 0: from the field of view.
    pub fx: f64,
    /// Focal length along the columns (pixels), its sign, which left-handed renderers have, left out; 0: that along the rows.
    pub fy: f64,
    /// Column of the optical axis (pixels); 0: the middle of the image.
    pub cx: f64,
    /// Row of the optical axis (pixels); 0: the middle of the image.
    pub cy: f64,
    /// The angle that a row of pixels spans (rad); 0: a RealSense's where the depth shows its steps, the sensor's
    /// where only one has images of this size, a Kinect's for other 16-bit images of 4 : 3, a right angle otherwise.
    pub field_of_view: f64,
    /// Raw depth values per metre; 0: estimated from the first image.
    pub depth_scale: f64,
    /// What the values of depth images are.
    pub depth_values: DepthValues,
    /// How depth was quantised to whole numbers; relevant for 8 bits.
    pub quantisation: Quantisation,
    /// Nearer depths are dropped (m).
    pub min_range: f64,
    /// Farther depths are dropped (m); 0: beyond 10 m in depth images, nothing in clouds.
    pub max_range: f64,
    /// Height above the first sensor up to which points are added to the map (m).
    pub max_height: f64,
    /// Clouds: metres in a unit of their coordinates; 0: told from the first cloud.
    pub cloud_unit: f64,
    /// Clouds: voxel size of the downsampling (m); 0: estimated from the first cloud.
    pub voxel_size: f64,
    /// Clouds: the distance that a correspondence measures.
    pub metric: SpatialMetric,
    /// Clouds: largest distance of a pair (m); 0: three voxels.
    pub max_correspondence_distance: f64,
    /// Clouds: when a global registration is used.
    pub global_registration: GlobalRegistrationUse,
    /// Whether loops are closed.
    pub loop_closing: LoopClosing,
    /// Voxel size of the stitched map (m); 0: 2 cm, for clouds half of `voxel_size`.
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
            depth_values: DepthValues::ToldFromData,
            quantisation: Quantisation::ToldFromData,
            min_range: 0.1,
            max_range: 0.0,
            max_height: 100.0,
            cloud_unit: 0.0,
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

/// Depth images make a map of voxels of this side (m), unless set.
const DEPTH_MAP_VOXEL: f64 = 0.02;
/// Focal length over the width of the image of a Kinect, as the TUM RGB-D benchmark and Open3D assume it: 525 / 640.
pub(crate) const KINECT_FOCAL_LENGTH: f64 = 525.0 / 640.0;
/// Sizes of depth images that only one sensor has, and its focal length (pixels): Kinect v2, Azure Kinect (narrow field of
/// view).
const SIZES_OF_ONE_SENSOR: [(usize, usize, f64); 3] = [(512, 424, 365.0), (640, 576, 504.0), (320, 288, 252.0)];

/// Points of a cloud that are registered to a map. Of rendered sweeps of 97,000 points, 19,000 after downsampling, 5,000 give an error of
/// 4.8 mm in 58 ms a sweep and all of them 8.7 mm in 163 (`cargo measure lidar_sweeps --time`); KITTI's pair differs by 1 mm. 2,500 are as good
/// there and lose a pair of scans of a room (docs/measurements/clouds.md).
const MAX_MAPPED_POINTS: usize = 5000;

impl SpatialSettings {
    /// Checks every value against the limits of its description.
    ///
    /// # Errors
    /// Names the first setting out of its limits, with the value and the limits.
    pub(crate) fn validate(&self) -> Result<()> {
        check_limits(&list::table(), self)?;
        if self.max_range > 0.0 { check_range(self.min_range, self.max_range) } else { Ok(()) }
    }

    /// What is left open, for depth images.
    #[must_use]
    pub(crate) fn for_depth(&self) -> Self {
        Self {
            max_range: set_or(self.max_range, MAX_SENSOR_RANGE.0),
            voxel_size: set_or(self.voxel_size, DEPTH_VOXEL),
            map_voxel_size: set_or(self.map_voxel_size, DEPTH_MAP_VOXEL),
            ..self.clone()
        }
    }

    /// What is left open, for clouds of which half the points lie nearer than `size` (m) to the sensor or, where that is not
    /// known, to the middle of what they show.
    #[must_use]
    pub fn for_clouds(&self, size: f64) -> Self {
        let voxel_size = set_or(self.voxel_size, (size / 40.0).clamp(0.002, 1.0));
        let method = if self.method == Method::SurfelMap { Method::CloudMap } else { self.method };
        let max_range = set_or(self.max_range, f64::MAX);
        Self {
            method,
            max_range,
            voxel_size,
            map_voxel_size: set_or(self.map_voxel_size, voxel_size / 2.0),
            ..self.clone()
        }
    }

    /// What is set of the reading of a reference. The estimate does not depend on it.
    pub(crate) fn known_convention(&self) -> KnownConvention {
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
        let Self { motion, effort, color, .. } = *self;
        DepthOptions { motion, effort, color, noise: DepthNoise::default() }
    }

    /// The options of the odometry of clouds, once nothing is left open.
    pub fn cloud_options(&self) -> CloudOptions {
        let base = match self.method {
            Method::Course => CloudOptions::course(self.voxel_size),
            _ => CloudOptions::new(self.voxel_size),
        };
        let is_map = matches!(self.method, Method::SurfelMap | Method::CloudMap);
        CloudOptions {
            method: if is_map { CloudMethod::CloudMap } else { CloudMethod::CloudToCloud },
            metric: self.metric,
            motion: self.motion,
            max_points: if is_map { MAX_MAPPED_POINTS } else { usize::MAX },
            global_registration: self.global_registration,
            max_correspondence_distance: set_or(self.max_correspondence_distance, base.max_correspondence_distance),
            ..base
        }
    }

    /// The camera of images of this size: as set, or what such images mostly come from.
    ///
    /// # Errors
    /// When what is set makes no camera.
    pub fn camera(&self, width: usize, height: usize, bits: u8, sensor: DepthSensor) -> Result<Pinhole> {
        let Pinhole { fx, cx, cy, .. } = self.symmetric_camera(width, height, bits, sensor)?;
        Pinhole::new(width, height, [fx, set_or(self.fy.abs(), fx), set_or(self.cx, cx), set_or(self.cy, cy)])
    }

    /// With square pixels, and the optical axis in the middle of the image.
    fn symmetric_camera(&self, width: usize, height: usize, bits: u8, sensor: DepthSensor) -> Result<Pinhole> {
        let of_focal_length =
            |f| Pinhole::new(width, height, [f, f, (width as f64 - 1.0) / 2.0, (height as f64 - 1.0) / 2.0]);
        if self.fx > 0.0 {
            return of_focal_length(self.fx);
        }
        if self.field_of_view > 0.0 {
            return Pinhole::from_field_of_view(width, height, self.field_of_view);
        }
        if let DepthSensor::RealSense { focal_length } = sensor {
            return of_focal_length(focal_length);
        }
        // A camera may be held upright.
        let (long, short) = (width.max(height), width.min(height));
        let of_sensor = SIZES_OF_ONE_SENSOR.iter().find(|(w, h, _)| (*w, *h) == (long, short)).map(|(_, _, f)| *f);
        let usual = of_sensor.or((3 * long == 4 * short).then_some(KINECT_FOCAL_LENGTH * long as f64));
        match usual {
            Some(focal_length) if bits > 8 => of_focal_length(focal_length),
            _ => Pinhole::from_field_of_view(width, height, FRAC_PI_2),
        }
    }
}

/// The value as set; where it is left open, which is 0, the default.
pub(crate) fn set_or(value: f64, default: f64) -> f64 {
    if value > 0.0 { value } else { default }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::pipeline::settings::description::assert_describes_all;

    #[test]
    fn every_setting_is_described_once_and_every_preset_is_valid() {
        assert_describes_all(&list::table());
        for preset in spatial_presets() {
            preset.settings.validate().unwrap();
        }
        assert_eq!(spatial_presets()[0].settings, SpatialSettings::default());
    }

    #[test]
    fn values_out_of_their_limits_are_named() {
        let error = SpatialSettings { min_range: 5.0, max_range: 1.0, ..SpatialSettings::default() }.validate();
        assert!(error.unwrap_err().to_string().contains("min_range = 5"));
        let error = SpatialSettings { depth_scale: f64::NAN, ..SpatialSettings::default() }.validate();
        assert!(error.unwrap_err().to_string().contains("depth_scale"));
    }

    #[test]
    fn the_camera_is_the_set_one_or_the_likely_one() {
        let default = SpatialSettings::default();
        let of = |settings: &SpatialSettings, width, height, bits| {
            let camera = settings.camera(width, height, bits, DepthSensor::Unknown).unwrap();
            [camera.fx, camera.fy, camera.cx, camera.cy].map(|value| (value * 1e6).round() / 1e6)
        };
        assert_eq!(of(&default, 512, 512, 8), [256.0, 256.0, 256.0, 256.0]);
        assert_eq!(of(&default, 640, 480, 16), [525.0, 525.0, 319.5, 239.5]);
        assert_eq!(of(&SpatialSettings { field_of_view: PI / 2.0, ..default.clone() }, 640, 480, 16)[0], 320.0);
        let focal_length = SpatialSettings { fx: 585.0, ..default.clone() };
        assert_eq!(of(&focal_length, 640, 480, 16), [585.0, 585.0, 319.5, 239.5]);
        let principal_point = SpatialSettings { cx: 320.0, cy: 237.0, ..default };
        assert_eq!(of(&principal_point, 640, 480, 16), [525.0, 525.0, 320.0, 237.0]);
        assert_eq!(of(&principal_point, 512, 512, 8), [256.0, 256.0, 320.0, 237.0]);
        let all = SpatialSettings { fy: 580.0, cx: 320.0, cy: 240.0, ..focal_length };
        assert_eq!(of(&all, 640, 480, 16), [585.0, 580.0, 320.0, 240.0]);
    }
}
