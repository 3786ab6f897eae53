//! Options of the depth odometry.

use serde::{Deserialize, Serialize};

use crate::camera::surfel_image::SurfelImage;
use crate::registration::free_space::DepthNoise;
use crate::registration::prepared_surfels::PreparedSurfels;
use crate::registration::solver::Motion;

/// Number of points of the final registration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Effort {
    /// Thousands of points are registered.
    #[default]
    Thorough,
    /// Fewer points are registered.
    Quick,
}

/// How colours contribute to the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum ColorUse {
    /// In every frame that has them, weighted by their residuals.
    #[default]
    Used,
    /// In frames whose surfaces do not constrain one direction.
    #[serde(rename = "where_open")] // as settings that users have saved name it
    WhereDegenerate,
    /// Not at all.
    NotUsed,
}

/// All options of [`DepthOdometry`](super::DepthOdometry).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DepthOptions {
    /// How the camera moves. Where it is planar, the y axis of the first camera is vertical.
    pub motion: Motion,
    /// Number of points of the final registration.
    pub effort: Effort,
    /// How colours contribute, where frames have them.
    pub color: ColorUse,
    /// Noise of the sensor.
    pub noise: DepthNoise,
}

/// Points of the final registration with [`Effort::Thorough`]; four in ten of them with [`Effort::Quick`].
const FINE_POINTS: usize = 3000;

impl DepthOptions {
    /// Prepares a frame for registration with these options. This depends on the frame alone, so it can be done ahead.
    pub fn prepared(&self, frame: SurfelImage) -> PreparedSurfels {
        let num_fine = if self.effort == Effort::Quick { FINE_POINTS * 2 / 5 } else { FINE_POINTS };
        PreparedSurfels::new(frame, num_fine)
    }
}
