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
    /// Whichever makes the first frames fit each other better.
    ToldFromData,
    /// Truncated to whole steps: the true depth lies half a step further on average.
    Truncated,
    /// Rounded to the nearest step.
    Rounded,
}

impl Quantisation {
    /// What is added to a raw value to get the middle of the depths it stands for.
    pub fn offset(self) -> f64 {
        if self == Self::Truncated { 0.5 } else { 0.0 }
    }

    /// What is to be added to depths that were prepared by another reading, in the unit of `depth_step` (one raw value).
    pub(crate) fn shift_from(self, prepared_as: Self, depth_step: f64) -> f64 {
        (self.offset() - prepared_as.offset()) * depth_step
    }
}

/// Whether loops are closed where the path returns to a known place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum LoopClosing {
    /// The accumulated drift is distributed over the loop; depth images with surfels only.
    On,
    /// Loops are not closed.
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
    /// [`Opencv`](crate::evaluation::convention::SensorAxes::Opencv).
    Opencv,
    /// [`Opengl`](crate::evaluation::convention::SensorAxes::Opengl).
    Opengl,
    /// [`Robotics`](crate::evaluation::convention::SensorAxes::Robotics).
    Robotics,
}

/// What a pose of a reference maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum ReferenceDirection {
    /// As its motions fit the estimated ones best.
    ToldFromData,
    /// [`SensorToWorld`](crate::evaluation::convention::PoseDirection::SensorToWorld).
    SensorToWorld,
    /// [`WorldToSensor`](crate::evaluation::convention::PoseDirection::WorldToSensor).
    WorldToSensor,
}
