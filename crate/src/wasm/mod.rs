//! The engine as JavaScript sees it: bytes and plain objects in, typed arrays and plain objects out.
//!
//! One call a cloud, never one a point. Returned arrays are copies: a view into the engine's memory is lost when that
//! memory grows. Whatever is thrown is an `Error` named `ScanstitchError` with the fields `file`, `place`, `problem` and
//! `remedy`.
//!
//! Without the feature `full` only planar scans have bindings: whatever no binding reaches is left out of the module.

use wasm_bindgen::prelude::*;

#[cfg(feature = "full")]
pub use self::lab::{IcpLab, local_minima};
use self::objects::{from_object, plain, read_ply, thrown};
pub use self::planar::{Reconstruction, describe_settings, presets};
#[cfg(feature = "full")]
pub use self::point_cloud::PointCloud;

#[cfg(feature = "full")]
mod bev;
#[cfg(feature = "full")]
mod evaluation;
#[cfg(feature = "full")]
mod lab;
mod memory;
mod objects;
mod occupancy_grid;
mod planar;
#[cfg(feature = "full")]
mod planar_files;
#[cfg(feature = "full")]
mod point_cloud;
#[cfg(feature = "full")]
mod spatial;
#[cfg(feature = "full")]
mod strategies;

/// Makes a panic, which would be a defect of the engine, say where it happened.
#[wasm_bindgen(start)]
pub fn start() {
    console_error_panic_hook::set_once();
}

/// Version of the engine.
#[wasm_bindgen]
pub fn version() -> String {
    env!("CARGO_PKG_VERSION").to_owned()
}
