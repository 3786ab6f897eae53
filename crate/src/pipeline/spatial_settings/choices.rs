//! The choices among the settings in space.

use serde::{Deserialize, Serialize};

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
