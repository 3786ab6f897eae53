//! How good a result is: a trajectory against the truth, and the crispness of a map where there is none.
//!
//! [`evaluate`](evaluate::evaluate) compares one estimate with the reference, step by step: [`associate`] finds the poses
//! that belong together, [`alignment`] brings the estimate into the reference's frame, [`metrics`] measures, and
//! [`statistics`] sums up. Definitions are those of evo (Grupp, "evo: Python package for the evaluation of odometry and
//! SLAM", 2017), each with its source in the literature.

pub mod alignment;
pub mod associate;
pub mod convention;
pub mod drift;
pub mod evaluate;
pub mod frame_clouds;
pub mod map_quality;
pub mod metrics;
pub mod pairs;
pub mod path;
pub mod position_error;
pub mod relations;
pub mod sharpness;
pub mod spatial_error;
pub mod statistics;
pub mod umeyama;
