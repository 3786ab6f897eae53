//! Odometry of depth images: each frame is registered to the map of the frames before it.
//!
//! In: [prepared frames](PreparedSurfels). Out: a [`SpatialEstimate`] for each, and [`PoseUpdate`]s of earlier ones.
//!
//! The evidence decides where a registration starts: many pose hypotheses are scored in the view of the map, the best few are
//! refined, and the one that is contradicted least is kept. No motion model is trusted, for robots stop and turn on the spot.
//! A result that is still contradicted starts a wider search before the frame is lost.
//!
//! Read [`DepthOdometry::register_frame`] first: it is the way of one frame, and every step is in the file of its name in
//! `chain`. `docs/depth.md` has the whole with a figure.

mod chain;
mod color;
mod error_propagation;
mod estimate;
mod evidence;
mod frame_matcher;
mod hypotheses;
mod motion_prior;
mod moving_average;
mod odometry;
mod options;
mod pair_registration;
mod pose_hypothesis;
mod prediction_gate;
mod propose;
mod reference_map;
mod register;
mod resolve_degeneracy;
mod second_basin;
mod textured_frame;
mod unregistered_frames;

pub use self::chain::{UnresolvedFrame, UnresolvedFrames};
pub(crate) use self::error_propagation::{covariance_of_error, of_pose_distance};
pub use self::estimate::{PoseUpdate, SpatialEstimate};
pub(crate) use self::evidence::{ComparedSurfaces, FINE_TOLERANCE, LIMITS, MIN_AGREEMENT_DIFFERENCE};
pub(crate) use self::frame_matcher::{fine_options, middle_options};
pub(crate) use self::hypotheses::MIN_DISTANCE;
pub use self::odometry::DepthOdometry;
pub use self::options::{ColorUse, DepthOptions, Effort};
pub use self::pair_registration::{PairRegistration, Search};
pub(crate) use self::pose_hypothesis::MOSTLY_MAPPED_OVERLAP;
#[cfg(doc)]
use crate::registration::prepared_surfels::PreparedSurfels;
pub use crate::registration::spatial::SpatialRegistration;
