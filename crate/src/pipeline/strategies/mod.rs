//! Comparison of mapping strategies: [`StrategyComparison`] runs several settings of [voxel odometry](crate::odometry::voxel) on
//! the same frames, and reports for each the size of the map, the time (measured by the caller) and the error against the
//! reference.

mod comparison;
mod presets;
mod report;
mod settings;

pub use self::comparison::StrategyComparison;
pub use self::presets::strategy_presets;
pub use self::report::{StrategyErrors, StrategyFrame, StrategyResult, StrategyTiming, Trend};
pub use self::settings::strategy_descriptions;
