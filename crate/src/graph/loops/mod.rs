//! Loops: places that come into view again, found, verified and added to the pose graph.

pub mod planar;
pub mod spatial;
