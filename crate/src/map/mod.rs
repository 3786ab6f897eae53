//! Maps: placed frames in, something to register the next frame to, or the result, out.
//!
//! - For registration: [`local`] (planar scans), [`cloud`], [`surfel`] (depth images), [`keyframes`].
//! - Results: [`local::StitchedMap`], [`voxel`] (a cloud), [`occupancy_grid`].
//!
//! Read [`local`] first: the others do in space what it does in the plane.

pub mod cloud;
pub mod keyframes;
pub mod local;
pub mod occupancy_grid;
pub mod surfel;
pub mod voxel;
