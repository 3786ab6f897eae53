//! The native tests, a module for each subject, in one binary: what they share is compiled and linked once, and the threads of one
//! run keep all processors busy.
#![cfg(not(target_arch = "wasm32"))] // a browser runs tests/browser
#![allow(non_snake_case)]

mod apartment;
mod architecture;
mod bev;
mod campus;
mod clean;
mod cloud_loops;
mod cloud_surface;
mod clouds;
mod color_files;
mod common;
mod depth_colors;
mod depth_files;
mod depth_worlds;
mod driven_grid;
mod evaluation;
mod evaluation_parts;
mod flattened_grid;
mod global_registration;
mod gyroscope;
mod icp_lab;
mod joint_scan_registration;
mod laser_fans;
mod laser_logs;
mod laser_tables;
mod laser_worlds;
mod localization;
mod long_sequences;
mod map_edits;
mod map_quality;
mod mending;
mod moving;
mod named_numbers;
mod odometry_check;
mod pair_registration;
mod pcd;
mod ply;
mod pose_graphs;
mod radish_logs;
mod reconstruction;
mod recordings;
mod registration;
mod scene;
mod search;
mod spatial_loops;
mod spatial_reconstruction;
mod strategies;
mod surface;
mod sweeps;
mod trajectory;
