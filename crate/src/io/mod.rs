//! Files to points and trajectories, and back.
//!
//! Readers take the bytes of a whole file and give plain data or an [`Error`](crate::Error) that names the line or the
//! byte. They never allocate more than a small multiple of the bytes they are given, whatever a header claims.

pub mod color_image;
pub mod depth_png;
pub mod intrinsics;
pub mod laser_log;
mod netpbm;
pub mod pcd;
pub mod ply;
pub mod point_cloud;
pub mod relations;
mod text;
pub mod trajectory;
