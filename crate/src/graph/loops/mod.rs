//! Loops: places that come into view again, found, verified and added to the pose graph.

pub(crate) mod planar;
pub mod spatial;
