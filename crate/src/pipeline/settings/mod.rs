//! The settings of a planar reconstruction: names, defaults, limits and explanations, for the page, the command line and the
//! API.

pub(crate) mod description;
mod list;

use serde::{Deserialize, Serialize};

pub use self::description::{Choice, Preset, SettingDescription, SettingKind};
use self::description::{check_limits, check_range};
pub use self::list::{descriptions, presets};
use crate::error::Result;
use crate::odometry::planar::{InitialGuess, PlanarOptions};
use crate::preprocess::clean::RangeLimits;
use crate::registration::correlative::SearchWindow;
use crate::registration::icp::{Criteria, IcpOptions, Rejection, Weighting};
use crate::registration::planar::PlanarMetric;
use crate::registration::robust_kernel::RobustKernel;

/// What scans are registered to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Strategy {
    /// Each scan to the one before it.
    ScanToScan,
    /// Each scan to a local map of the scans before it.
    ScanToMap,
    /// As scan to map, followed by a joint registration of each scan with the n before it.
    Joint,
}

/// The source of measured motion between scans, which serves as the initial guess.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum OdometrySource {
    /// The odometry file, or else the poses of the log, if they are found to be raw wheel odometry.
    Auto,
    /// The odometry file, where one is given.
    File,
    /// The odometry file, or else the poses of the laser log.
    Log,
    /// No odometry.
    None,
}

/// Which way the readings of a laser follow one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum LaserDirection {
    /// As the recording has them.
    AsRecorded,
    /// The other way round: the laser turns clockwise or hangs upside down, and the recording does not say so.
    Mirrored,
}

/// Settings of a planar reconstruction. The defaults are meant for all recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Settings {
    /// Returns nearer than this are dropped (m).
    pub min_range: f64,
    /// Returns at or beyond this are dropped (m).
    pub max_range: f64,
    /// Which way the readings follow one another.
    pub laser_direction: LaserDirection,
    /// Metres in a unit of scans that are a file each; 0: told from the first one.
    pub scan_unit: f64,
    /// Distance between the wheels (m), for odometry that has the paths of the two wheels; 0: not known.
    pub wheel_track: f64,
    /// What scans are registered to.
    pub strategy: Strategy,
    /// Number of earlier scans in the local map.
    pub local_map_scans: usize,
    /// Joint, fewer than 100 scans: number n of preceding scans, and of nearest scans before those, that each scan is matched with;
    /// 0 means all. Longer sequences choose their pairs themselves.
    pub matched_scans: usize,
    /// The pose from which a registration starts.
    pub initial_guess: InitialGuess,
    /// The source of measured motion, which takes precedence over `initial_guess`.
    pub odometry: OdometrySource,
    /// Half width of the correlative search in x and y (m).
    pub search_translation: f64,
    /// Half width of the correlative search in heading (rad).
    pub search_rotation: f64,
    /// The distance that a correspondence measures.
    pub metric: PlanarMetric,
    /// Largest distance of a pair (m).
    pub max_correspondence_distance: f64,
    /// Largest angle between the normals of a pair (rad).
    pub max_normal_angle: f64,
    /// Share of the correspondences, those with the largest residuals, that is dropped, in [0, 1).
    pub trim_fraction: f64,
    /// Robust kernel that weights the residuals.
    pub robust_kernel: RobustKernel,
    /// Width of the robust kernel (m).
    pub robust_kernel_width: f64,
    /// Most iterations of a registration, and of the joint registration.
    pub max_iterations: usize,
    /// Rotation of a step below which a registration has converged (rad), if its translation is below `translation_eps`.
    pub rotation_eps: f64,
    /// Translation of a step below which a registration has converged (m), if its rotation is below `rotation_eps`.
    pub translation_eps: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            min_range: 0.05,
            max_range: 50.0,
            laser_direction: LaserDirection::AsRecorded,
            scan_unit: 0.0,
            wheel_track: 0.0,
            strategy: Strategy::Joint,
            local_map_scans: 5,
            matched_scans: 10,
            initial_guess: InitialGuess::Correlative,
            odometry: OdometrySource::Auto,
            search_translation: 1.5,
            search_rotation: 35f64.to_radians(),
            metric: PlanarMetric::PointToLine,
            max_correspondence_distance: 0.5,
            max_normal_angle: 45f64.to_radians(),
            trim_fraction: 0.0,
            robust_kernel: RobustKernel::Cauchy,
            robust_kernel_width: 0.05,
            max_iterations: 50,
            rotation_eps: 1e-4,
            translation_eps: 1e-4,
        }
    }
}

impl Settings {
    /// Checks every value against the limits of its description.
    ///
    /// # Errors
    /// Names the first setting out of its limits, with the value and the limits.
    pub(crate) fn validate(&self) -> Result<()> {
        check_limits(&list::table(), self)?;
        check_range(self.min_range, self.max_range)
    }

    /// The range limits of the cleaning.
    pub(crate) fn range_limits(&self) -> RangeLimits {
        RangeLimits { min_range: self.min_range, max_range: self.max_range }
    }

    /// Number of scans in the local map.
    pub(crate) fn map_capacity(&self) -> usize {
        if self.strategy == Strategy::ScanToScan { 1 } else { self.local_map_scans }
    }

    /// The options of the odometry.
    pub(crate) fn odometry_options(&self) -> PlanarOptions {
        PlanarOptions {
            map_capacity: self.map_capacity(),
            initial_guess: self.initial_guess,
            search: SearchWindow { translation: self.search_translation, rotation: self.search_rotation },
            metric: self.metric,
            icp: self.icp_options(),
        }
    }

    /// The options of the registration loop.
    pub fn icp_options(&self) -> IcpOptions {
        IcpOptions {
            rejection: Rejection {
                max_correspondence_distance: self.max_correspondence_distance,
                max_normal_angle: self.max_normal_angle,
                trim_fraction: self.trim_fraction,
            },
            weighting: Weighting { robust_kernel: self.robust_kernel, robust_kernel_width: self.robust_kernel_width },
            criteria: Criteria {
                max_iterations: self.max_iterations,
                rotation_eps: self.rotation_eps,
                translation_eps: self.translation_eps,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::description::assert_describes_all;
    use super::*;

    #[test]
    fn every_setting_is_described_once_and_every_preset_is_valid() {
        assert_describes_all(&list::table());
        for preset in presets() {
            preset.settings.validate().unwrap();
        }
        assert_eq!(presets()[0].settings, Settings::default());
    }

    #[test]
    fn values_out_of_their_limits_are_named() {
        let error = Settings { trim_fraction: 1.5, ..Settings::default() }.validate().unwrap_err();
        assert!(error.to_string().contains("trim_fraction = 1.5"), "{error}");
        assert!(Settings { max_range: f64::NAN, ..Settings::default() }.validate().is_err());
        assert!(Settings { min_range: 60.0, ..Settings::default() }.validate().is_err());
        assert!(serde_json::from_str::<Settings>("{\"max_rnage\": 3}").is_err());
    }
}
