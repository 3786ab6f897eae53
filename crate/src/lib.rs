//! Laser scans and depth images to a trajectory and a stitched map.
//!
//! Two scans, each read from a PLY or PCD file, and the motion between them:
//!
//! ```
//! use scanstitch::io::point_cloud;
//! use scanstitch::{PlanarScan, RegistrationOptions, align};
//!
//! let read = |name: &str| -> Result<PlanarScan, Box<dyn std::error::Error>> {
//!     Ok(PlanarScan::from_cloud(&point_cloud::read(&std::fs::read(name)?)?))
//! };
//! let target = read("www/samples/corridor/0.ply")?;
//! let source = read("www/samples/corridor/1.ply")?;
//!
//! // They were taken a metre apart in an unknown direction: search for a start within 1.5 m and 0.3 rad.
//! let options = RegistrationOptions { search_translation: 1.5, search_rotation: 0.3, ..Default::default() };
//! let registration = align(&source, &target, &options)?;
//!
//! let T_target_source = registration.T_target_source; // a Pose2: translation (m) and angle (rad)
//! assert!((T_target_source.translation.vector - nalgebra::Vector2::new(0.106, 0.956)).norm() < 0.05);
//! assert!((T_target_source.rotation.angle() + 0.110).abs() < 0.02);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! In space, give [`align()`] two [`PointCloud`]s: the motion is a [`Pose3`]. What to do next:
//!
//! | you have | you want | start at |
//! |---|---|---|
//! | two clouds or scans | the motion between them | [`align()`] |
//! | clouds with targets and normals of your own | the loop alone | [`registration::icp::register`] |
//! | laser scans | trajectory and map | [`pipeline::Reconstruction`] |
//! | depth images or clouds in space | trajectory and map | [`pipeline::SpatialReconstruction`] |
//! | two trajectories | how far they are apart | [`evaluation::evaluate`](fn@evaluation::evaluate) |
//!
//! One line from bytes to results, room by room in reading order: [`geometry`] and [`search`] lie under everything; [`io`]
//! reads a file into points or images; [`camera`] says what a pixel sees; [`preprocess`] cleans points and finds normals;
//! [`registration`] aligns one frame with another; [`map`] keeps what the next frame is registered to; [`odometry`] chains
//! frames; [`graph`] closes loops and optimises all poses together; [`pipeline`] runs all of it; [`evaluation`] says how
//! good the result is. Imports point one way only.
//!
//! Conventions everywhere: SI units and radians. `source` moves, `target` stays; `T_target_source` maps source points
//! into the target's frame; `T_world_sensor` is a pose.
// In WebAssembly the tests of tests/browser run, and no unit tests are compiled.
#![cfg(not(all(target_arch = "wasm32", any(test, doctest))))]
#![allow(non_snake_case)] // T_target_source, H: the field's notation, frame names readable next to each other.

pub mod error;

pub mod geometry;
pub mod search;

pub mod io;

pub mod camera;
pub mod preprocess;

pub mod registration;

pub mod map;

pub mod odometry;

pub mod graph;

pub mod pipeline;

pub mod evaluation;

#[cfg(doctest)]
#[doc = include_str!("../../docs/api.md")]
mod guide {}

pub use error::{Error, Place, Result};
pub use geometry::{PointCloud, Pose2, Pose3};
pub use preprocess::planar_scan::PlanarScan;
pub use registration::{Registration, RegistrationOptions, align};
