//! Laser scans and depth images to a trajectory and a stitched map.
//!
//! One straight line from bytes to pixels: [`io`] reads a file into points, [`preprocess`] cleans them and finds
//! normals, [`registration`] aligns one scan with another, [`odometry`] chains scans, [`pose_graph`] solves all poses
//! jointly, [`evaluation`] says how good the result is. Imports point one way only, in that order.
//!
//! Conventions everywhere: SI units and radians. `source` moves, `target` stays; `T_target_source` maps source points
//! into the target's frame; `T_world_sensor` is a pose.
#![allow(non_snake_case)] // T_target_source, H: the field's notation, frame names readable next to each other.

pub mod camera;
pub mod cloud_map;
pub mod cloud_odometry;
pub mod cloud_registration;
pub mod depth_odometry;
pub mod error;
pub mod evaluation;
pub mod geometry;
pub mod io;
pub mod key_views;
pub mod loop_closure;
pub mod map;
pub mod occupancy_grid;
pub mod odometry;
pub mod pose_graph;
pub mod prepared_frame;
pub mod prepared_surfels;
pub mod preprocess;
pub mod reconstruction;
pub mod recorded_scan;
pub mod registration;
pub mod relation_graph;
pub mod report;
pub mod scene;
pub mod search;
pub mod settings;
pub mod sparse;
pub mod spatial_loops;
pub mod spatial_reconstruction;
pub mod spatial_report;
pub mod spatial_settings;
pub mod strategies;
pub mod surfel_map;
pub mod verdict;
pub mod voxel_map;

#[cfg(target_arch = "wasm32")]
pub mod wasm;

pub use error::{Error, Place, Result};
