//! Files to points and trajectories, and back.
//!
//! Readers take the bytes of a whole file and give plain data or an [`Error`](crate::Error) that names the line or the
//! byte. They never allocate more than a small multiple of the bytes they are given, whatever a header claims.
//!
//! ```
//! use scanstitch::io::point_cloud;
//!
//! // PLY or PCD, ASCII or binary: the bytes tell.
//! let cloud = point_cloud::read(&std::fs::read("www/samples/corridor/0.ply")?)?;
//! assert!(cloud.is_planar() && cloud.len() > 100);
//!
//! let cut = b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n";
//! let error = point_cloud::read(cut).unwrap_err();
//! assert!(error.place != scanstitch::Place::Whole && error.problem.contains('2'));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod cloud_parts;
pub mod color_image;
pub mod depth_image;
pub mod intrinsics;
pub mod laser_log;
pub mod length_unit;
pub(crate) mod limits;
pub mod mesh;
mod message_table;
mod netpbm;
pub mod occupancy_map;
pub mod pcd;
pub mod ply;
mod png;
pub mod point_cloud;
pub mod pose_graph;
pub mod relations;
mod text;
mod time_unit;
pub mod trajectory;
