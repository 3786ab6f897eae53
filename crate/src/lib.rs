//! Laser scans and depth images to a trajectory and a stitched map.
//!
//! One line from bytes to results, room by room in reading order: [`geometry`] and [`search`] lie under everything; [`io`]
//! reads a file into points or images; [`camera`] says what a pixel sees; [`preprocess`] cleans points and finds normals;
//! [`registration`] aligns one frame with another; [`map`] keeps what the next frame is registered to; [`odometry`] chains
//! frames; [`graph`] closes loops and optimises all poses together; [`pipeline`] runs all of it; [`evaluation`] says how
//! good the result is. Imports point one way only.
//!
//! Conventions everywhere: SI units and radians. `source` moves, `target` stays; `T_target_source` maps source points
//! into the target's frame; `T_world_sensor` is a pose.
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

#[cfg(target_arch = "wasm32")]
pub mod wasm;

pub use error::{Error, Place, Result};
