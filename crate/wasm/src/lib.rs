//! Bindings for JavaScript: bytes and plain objects in, typed arrays and plain objects out.
//!
//! Functions take whole clouds, never single points. Returned arrays are copies, since a view into the engine's memory becomes
//! invalid when that memory grows. Every exception is an `Error` named `ScanstitchError` with the fields `file`, `place`,
//! `problem` and `remedy`.
//!
//! Without the feature `full` only planar scans have bindings, and the linker drops the rest of the engine. Read `planar` first.

#![cfg(target_arch = "wasm32")]
#![allow(non_snake_case)] // T_target_source: the field's notation.
#![allow(
    clippy::unnecessary_wraps,
    reason = "what returns an object is declared to return a `Result`: see `objects::plain`"
)]

use wasm_bindgen::prelude::*;

#[cfg(feature = "full")]
pub use self::lab::{IcpLab, local_minima};
use self::objects::{from_object, plain, read_ply};
pub use self::planar::{Reconstruction, describe_settings, presets};
#[cfg(feature = "full")]
pub use self::point_cloud::PointCloud;

#[cfg(feature = "full")]
mod bev;
#[cfg(feature = "full")]
mod evaluation;
#[cfg(feature = "full")]
mod lab;
#[cfg(feature = "full")]
mod localization;
#[cfg(feature = "full")]
mod map_files;
mod memory;
#[cfg(feature = "full")]
mod mending;
mod objects;
mod occupancy_grid;
#[cfg(feature = "full")]
mod particles;
#[cfg(feature = "full")]
mod picture;
mod planar;
#[cfg(feature = "full")]
mod planar_files;
#[cfg(feature = "full")]
mod point_cloud;
#[cfg(feature = "full")]
mod pose_graph;
#[cfg(feature = "full")]
mod spatial;
#[cfg(feature = "full")]
mod strategies;
#[cfg(feature = "full")]
mod surface;
mod thrown;

/// Makes a panic, which is always a defect of the engine, report its source location.
#[wasm_bindgen(start)]
pub fn start() {
    console_error_panic_hook::set_once();
}

/// Version of the engine.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}
