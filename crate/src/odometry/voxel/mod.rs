//! ICP odometry in space against a growing map, with every choice an option: whether the map keeps all points or a few in each
//! voxel, whether every point is added or only new ones, whether the sensor may tilt, and how far apart correspondences may be.
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
