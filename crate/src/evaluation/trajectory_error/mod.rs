//! Errors of the poses of a run against a reference, in the plane and in space.
//!
//! [`planar`] and [`spatial`] find each frame's partner in the reference and transform the reference into the estimate's world;
//! [`TrajectoryError`] holds the remaining distances and angles.

mod aligned;
mod planar;
mod spatial;

use serde::Serialize;

pub use self::aligned::AlignedError;
pub(super) use self::aligned::first_row_hint;
pub use self::planar::PlanarPoint;
pub(crate) use self::planar::planar_error;
pub(crate) use self::spatial::{EstimatedFrame, number_in_name, spatial_error};
use crate::evaluation::motion_agreement::agreement;
use crate::geometry::Pose3;

/// Errors of a run's poses against a reference, with the poses of the first good frame made equal that is compared; in `aligned` those
/// after an alignment of all poses. Lists have one entry per frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct TrajectoryError<P> {
    /// Name of the reference.
    pub name: String,
    /// Number of frames with an estimate and a partner in the reference.
    pub num_matched: usize,
    /// Mean distance (m), the mean L2 norm.
    pub mean: f64,
    /// Root mean square distance (m).
    pub rmse: f64,
    /// Largest distance (m).
    pub max: f64,
    /// The same after an alignment of all positions by a rotation and a translation; null of fewer than three
    /// positions.
    pub aligned: Option<AlignedError>,
    /// A note for the result: the reference does not fit at all, or its first row alone causes the error.
    #[serde(skip)]
    pub hint: Option<String>,
    /// Distances (m); null for lost frames and those without a partner.
    pub errors: Vec<Option<f64>>,
    /// Angles between the orientations (rad); null where the distance is, and where the reference has no orientations.
    pub rotation_errors: Vec<Option<f64>>,
    /// The reference pose or position of each frame, in the estimate's world.
    pub reference: Vec<Option<P>>,
    /// The pose convention of the reference, in words.
    pub convention: String,
}

/// The convention of a reference without orientations, in words.
pub(crate) const POSITIONS_ALONE: &str = "positions alone";

/// Error of a frame: the distance (m) and, where the reference has orientations, the angle (rad).
type FrameError = (f64, Option<f64>);

impl<P> TrajectoryError<P> {
    /// From the errors of all frames, `None` for those that are not compared.
    fn new(name: &str, frames: &[Option<FrameError>], reference: Vec<Option<P>>, convention: String) -> Self {
        let errors: Vec<Option<f64>> = frames.iter().map(|frame| frame.map(|(distance, _)| distance)).collect();
        let distances: Vec<f64> = errors.iter().copied().flatten().collect();
        let count = distances.len().max(1) as f64;
        Self {
            name: name.to_owned(),
            num_matched: distances.len(),
            mean: distances.iter().sum::<f64>() / count,
            rmse: (distances.iter().map(|distance| distance * distance).sum::<f64>() / count).sqrt(),
            max: distances.iter().copied().fold(0.0, f64::max),
            aligned: None,
            hint: None,
            errors,
            rotation_errors: frames.iter().map(|frame| frame.and_then(|(_, angle)| angle)).collect(),
            reference,
            convention,
        }
    }

    /// Adds the aligned error and its note. `pairs`: estimate and reference of each compared frame, with orientations if the
    /// reference has them.
    fn with_alignment(self, aligned: Option<AlignedError>, pairs: &[(Pose3, Pose3)]) -> Self {
        let has_orientations = self.convention != POSITIONS_ALONE;
        let first_row = |aligned: AlignedError| first_row_hint(&self.name, self.rmse, &aligned, pairs);
        let hint = agreement(&self.name, pairs, has_orientations)
            .1
            .or_else(|| aligned.filter(|_| has_orientations).and_then(first_row));
        Self { aligned, hint, ..self }
    }

    /// The same with the reference's poses in another form.
    pub fn map_reference<Q>(self, to: impl Fn(P) -> Q) -> TrajectoryError<Q> {
        let Self { name, num_matched, mean, rmse, max, aligned, hint, errors, rotation_errors, reference, convention } =
            self;
        let reference = reference.into_iter().map(|pose| pose.map(&to)).collect();
        TrajectoryError {
            name,
            num_matched,
            mean,
            rmse,
            max,
            aligned,
            hint,
            errors,
            rotation_errors,
            reference,
            convention,
        }
    }
}
