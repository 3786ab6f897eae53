//! Joint optimisation: the poses of odometry in, jointly optimised poses out.
//!
//! [`loops`] detects loops; `pose_graph` optimises poses over relative measurements; [`joint_scan_registration`] optimises them
//! over the points themselves; [`optimize`] the pose graph of a file; [`sparse`] solves the linear systems of both.
//!
//! Read `pose_graph` first, then `loops::planar`.

pub mod joint_scan_registration;
pub mod loops;
pub mod optimize;
pub(crate) mod pose_graph;
pub mod sparse;
