//! Aligning a source with a target.

pub mod clustered;
pub mod correlative;
pub mod factors;
pub mod global;
pub mod icp;
pub mod observability;
pub mod photometric;
pub mod projective;
pub mod robust_kernel;
pub mod solver;
pub mod spatial;
pub mod spherical_view;
pub mod target;
pub mod visibility;
pub mod voxelized;
