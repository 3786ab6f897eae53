//! The choices among the settings in space.

use serde::{Deserialize, Serialize};

/// What a frame is registered to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Method {
    /// The surfels of a depth image to the map of the earlier ones, rendered from the camera. Clouds, which have no
    /// camera, are registered as by [`Method::CloudMap`].
    SurfelMap,
    /// A cloud to the voxel map of the earlier ones.
    CloudMap,
    /// A cloud to the previous one.
    CloudToCloud,
    /// A cloud to the previous one, by the pipeline taught in courses with Open3D.
    Course,
}

/// How depth was quantised to whole numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Quantisation {
    /// The one under which the first frames agree better.
    ToldFromData,
    /// Truncated to whole steps: the true depth is half a step larger on average.
    Truncated,
    /// Rounded to the nearest step.
    Rounded,
}

impl Quantisation {
    /// Offset from a raw value to the centre of its interval of depths (raw steps).
    pub fn offset(self) -> f64 {
        if self == Self::Truncated { 0.5 } else { 0.0 }
    }

    /// Correction to be added to depths that were prepared under another quantisation, in the unit of `depth_step` (the depth of
    /// one raw step).
    pub(crate) fn shift_from(self, prepared_as: Self, depth_step: f64) -> f64 {
        (self.offset() - prepared_as.offset()) * depth_step
    }
}

/// Whether loops are closed where the path returns to a known place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum LoopClosing {
    /// The accumulated drift is distributed over the loop: of depth images with surfels, and of clouds that are registered to their map.
    On,
    /// Loops are not closed.
    Off,
}

/// Order of the quaternions of a reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum ReferenceQuaternions {
    /// Chosen such that its motions best agree with the estimated ones.
    ToldFromData,
    /// qx qy qz qw.
    RealPartLast,
    /// qw qx qy qz.
    RealPartFirst,
}

/// Directions of the sensor's axes in a reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum ReferenceAxes {
    /// Chosen such that its motions best agree with the estimated ones.
    ToldFromData,
    /// [`Opencv`](crate::evaluation::convention::SensorAxes::Opencv).
    Opencv,
    /// [`Opengl`](crate::evaluation::convention::SensorAxes::Opengl).
    Opengl,
    /// [`Robotics`](crate::evaluation::convention::SensorAxes::Robotics).
    Robotics,
}

/// The frames that a pose of a reference maps between.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum ReferenceDirection {
    /// Chosen such that its motions best agree with the estimated ones.
    ToldFromData,
    /// [`SensorToWorld`](crate::evaluation::convention::PoseDirection::SensorToWorld).
    SensorToWorld,
    /// [`WorldToSensor`](crate::evaluation::convention::PoseDirection::WorldToSensor).
    WorldToSensor,
}
