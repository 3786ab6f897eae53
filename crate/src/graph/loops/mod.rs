//! Loop closure: revisited places are detected, verified and added to the pose graph.

pub mod clouds;
pub(crate) mod planar;
pub mod spatial;
