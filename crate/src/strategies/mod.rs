//! What a map costs and gains: odometry by ICP against a growing map, with every choice a setting.
//!
//! A student who registers frame after frame to the map of all before it has to choose: is the map kept whole or by
//! voxels, is every point added or only what is new, may the sensor tilt, how far apart may partners be? Here each
//! choice is a [setting](StrategySettings), and [`StrategyComparison`] runs several strategies over the same frames, side
//! by side, and tells what each one stored, how long it took (the caller holds the clock) and how far it is from the truth.
//!
//! The registration is the one loop of [`crate::registration::icp`], against a [`LocalMap`].
//! The pipeline and the adaptive threshold are those of Vizzo et al., "KISS-ICP: In defense of point-to-point ICP -- simple,
//! accurate, and robust registration if done the right way", RA-L 8 (2023), each equation cited where it is computed.

mod adaptive_threshold;
mod comparison;
mod local_map;
mod odometry;
mod presets;
mod report;
mod settings;
mod voxel_grid;

pub use self::adaptive_threshold::AdaptiveThreshold;
pub use self::comparison::StrategyComparison;
pub use self::local_map::LocalMap;
pub use self::odometry::{StrategyEstimate, StrategyOdometry};
pub use self::presets::{StrategyPreset, strategy_presets};
pub use self::report::{BYTES_A_POINT, StrategyErrors, StrategyFrame, StrategyResult, StrategyTiming, Trend};
pub use self::settings::{
    AddedPoints, KeptPoint, MapKind, Stages, StrategyMetric, StrategyMotion, StrategySettings, ThresholdKind,
    strategy_descriptions,
};
