//! What a map costs and gains: [`StrategyComparison`] runs several settings of [voxel odometry](crate::odometry::voxel)
//! over the same frames, side by side, and reports what each stored, how long it took (the caller holds the clock) and how
//! far its trajectory is from the reference.

mod comparison;
mod presets;
mod report;
mod settings;

pub use self::comparison::StrategyComparison;
pub use self::presets::strategy_presets;
pub use self::report::{StrategyErrors, StrategyFrame, StrategyResult, StrategyTiming, Trend};
pub use self::settings::strategy_descriptions;
