//! Evaluation of results: the error of a trajectory against a reference, and the sharpness of a map where there is none.
//!
//! [`evaluate`](evaluate::evaluate) compares one estimate with the reference in four steps: [`associate`] finds corresponding
//! poses, [`alignment`] transforms the estimate into the reference's frame, [`metrics`] computes the errors, and `statistics`
//! summarises them. Definitions are those of evo (Grupp, "evo: Python package for the evaluation of odometry and SLAM",
//! 2017), each with its source in the literature.
//!
//! Figures agree with evo 1.38.1 to a relative 1e-9, except where they are rounding errors, in evo as well:
//!
//! - errors that are zero in exact arithmetic: the angle between equal rotations (below 1e-15 rad), the first pose once both
//!   are made equal, everything after a perfect alignment;
//! - errors near the rounding of the coordinates: 1e-9 m at 5,000 km from the origin (map projections), where even the order
//!   of the multiplications matters;
//! - rotations after the alignment of a straight path: the rotation about the line is arbitrary (a note says so);
//! - all pairs that are rotated by a delta of exactly zero: rounding decides which angles are zero.
//!
//! ```
//! use scanstitch::evaluation::{EvaluationOptions, evaluate};
//! use scanstitch::io::trajectory;
//!
//! // Time, position, quaternion (x, y, z, w): the estimate is 3 cm off at one of three poses.
//! let reference = trajectory::read(b"0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 1 1 0 0 0 0 1\n")?;
//! let estimate = trajectory::read(b"0 0 0 0 0 0 0 1\n1 1 0.03 0 0 0 0 1\n2 1 1 0 0 0 0 1\n")?;
//! let evaluation = evaluate(&reference, &estimate, &EvaluationOptions::default())?;
//! assert_eq!(evaluation.errors.len(), 3);
//! assert!((evaluation.summary.statistics.max - 0.03).abs() < 1e-12);
//! # Ok::<(), scanstitch::Error>(())
//! ```
//!
//! Without a reference, [`map_quality`](map_quality::map_quality) measures how sharp a map is, [`frame_clouds`] how well
//! the clouds of frames overlay at given poses, and [`depth_consistency`] how well consecutive depth images agree.

pub mod alignment;
pub mod associate;
mod clock_offset;
pub mod convention;
pub mod depth_consistency;
pub mod drift;
pub mod evaluate;
pub mod frame_clouds;
mod interpolate;
pub mod map_quality;
pub mod metrics;
mod motion_agreement;
pub(crate) mod motion_ratio;
mod pair_conventions;
mod pair_motions;
pub mod pairs;
pub mod path;
pub mod relation_times;
pub mod relations;
pub mod remarks;
pub(crate) mod sharpness;
pub(crate) mod statistics;
pub(crate) mod trajectory_error;
pub mod umeyama;

pub use evaluate::{Evaluation, EvaluationOptions, evaluate};
pub use sharpness::Sharpness;
pub use statistics::Statistics;
pub use trajectory_error::{AlignedError, PlanarPoint, TrajectoryError};
