//! Points and rigid motions: what everything else is written in.

pub mod point_cloud;
pub mod pose;
pub mod rotation;

pub use point_cloud::PointCloud;
pub use pose::{Pose2, Pose3, RigidMotion};
