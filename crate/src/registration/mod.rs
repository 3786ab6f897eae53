//! Aligning a source with a target.

pub mod correlative;
pub mod factors;
pub mod icp;
pub mod observability;
pub mod projective;
pub mod robust_kernel;
pub mod target;
pub mod visibility;
