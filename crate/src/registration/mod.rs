//! Registration: a source and a target in, `T_target_source` with its evidence out.
//!
//! [`align()`] registers two clouds. Its loop is [`icp`]: [`target`] and [`correspondences`] find pairs, [`factors`] compute
//! their residuals, [`robust_kernel`] their weights and [`solver`] the step. Initial guesses come from [`correlative`] (plane)
//! and [`global`] (space); [`projective`] and [`photometric`] register depth and colour images. [`free_space`] and
//! [`degeneracy`] give the evidence for accepting a result.
//!
//! Read [`icp`] first.

pub mod align;
pub mod correlative;
pub mod correspondences;
mod cost;
pub mod degeneracy;
pub mod factors;
pub(crate) mod focal_length;
pub mod free_space;
pub mod global;
pub mod icp;
pub mod lab;
pub mod photometric;
pub mod planar;
pub mod prepared_surfels;
pub mod problem;
pub mod projective;
pub mod robust_kernel;
pub mod sandwich_variance;
pub mod solver;
pub mod spatial;
pub mod target;
pub mod voxelized;

pub use align::{Alignable, CloudMetric, RegistrationInit, RegistrationOptions, align};
pub use icp::{IcpOptions, Registration};
