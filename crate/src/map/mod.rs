//! Maps: frames with poses in; a registration target for the next frame, or the resulting map, out.
//!
//! - For registration: `local` (planar scans), `cloud`, `surfel` (depth images), `keyframes`.
//! - Results: [`local::StitchedMap`], [`voxel`] (a cloud), [`occupancy_grid`], [`picture`], [`surface`] (triangles).
//! - What is left out of a result: `seen_through`; how it is best laid: [`wall_direction`].
//!
//! Read `local` first: the others do in space what it does in the plane.

pub(crate) mod cloud;
pub(crate) mod keyframes;
pub(crate) mod local;
pub mod occupancy_grid;
pub mod picture;
pub(crate) mod seen_through;
pub mod surface;
pub(crate) mod surfel;
pub mod voxel;
pub mod wall_direction;

pub use local::StitchedMap;
