//! ICP odometry in space against a growing map, with every choice an option: is the map kept whole or by voxels, is every
//! point added or only what is new, may the sensor tilt, how far apart may partners be?
//!
//! The registration is the one loop of [`crate::registration::icp`], against a [`LocalMap`].
//! The pipeline and the adaptive threshold are those of Vizzo et al., "KISS-ICP: In defense of point-to-point ICP -- simple,
//! accurate, and robust registration if done the right way", RA-L 8 (2023), each equation cited where it is computed.

mod adaptive_threshold;
mod local_map;
mod odometry;
mod options;
mod voxel_grid;

pub use self::adaptive_threshold::AdaptiveThreshold;
pub use self::local_map::LocalMap;
pub use self::odometry::{VoxelEstimate, VoxelOdometry};
pub use self::options::{
    AddedPoints, KeptPoint, MapKind, Stages, ThresholdKind, VoxelOdometryMetric, VoxelOdometryMotion,
    VoxelOdometrySettings,
};
