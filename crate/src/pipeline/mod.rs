//! Whole runs: recorded frames and settings in; trajectory, map, assessments and errors out, one bounded step at a time.
//!
//! [`planar`] reconstructs from laser scans, [`spatial`] from depth images or clouds, [`strategies`] compares settings of
//! voxel odometry on one recording.
//!
//! Read [`planar`] first.

pub mod odometry_check;
pub mod planar;
pub mod prepared_frame;
pub mod recorded_scan;
pub mod report;
pub mod settings;
pub mod spatial;
pub mod spatial_report;
pub mod spatial_settings;
pub mod strategies;
