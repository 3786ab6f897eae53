//! Odometry: frames in, one after the other; for each, a pose in the frame of the first and an assessment out.
//!
//! `planar` registers laser scans, [`cloud`] clouds in space, [`depth`] depth images; [`voxel`] is the textbook pipeline
//! with every choice an option. [`localization`] finds planar scans in a map that exists. [`assessment`] says good, doubtful or lost, and why.
//!
//! Read `planar` first: one page that shows the way of a frame.

pub mod assessment;
pub mod cloud;
pub mod depth;
pub mod localization;
pub mod planar;
pub mod voxel;

pub use planar::InitialGuess;
