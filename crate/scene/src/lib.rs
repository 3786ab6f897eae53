//! Synthetic worlds for samples, tests and benchmarks: exact reference poses, seeded, the same bytes on every machine.
//!
//! Sines and cosines come from the `libm` crate, since the standard library's differ from platform to platform in the
//! last digit.
#![allow(non_snake_case)] // T_world_camera: the field's notation

pub mod ambiguous;
pub mod apartment;
pub mod campus;
pub mod corridor;
pub mod drive;
pub mod gyroscope;
pub mod hand_held;
pub mod laser;
pub mod moving_lidar;
pub mod office;
mod passage;
pub mod plaza;
pub mod random;
pub mod recording;
pub mod repetitive;
pub mod ring;
pub mod samples;
pub mod space;
pub mod spinning_lidar;
pub mod straight_corridor;
pub mod streets;
pub mod traffic;
pub mod world;
