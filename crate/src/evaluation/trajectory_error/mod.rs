//! Distance of the poses of a run to a reference, in the plane and in space.
//!
//! [`planar`] and [`spatial`] find each frame's partner in the reference and bring the reference into the estimate's world;
//! [`TrajectoryError`] sums up what is left between them.

mod aligned;
mod planar;
mod spatial;

use serde::Serialize;

pub use self::aligned::AlignedError;
pub(super) use self::aligned::first_row_hint;
pub use self::planar::PlanarPoint;
pub(crate) use self::planar::planar_error;
pub(crate) use self::spatial::{EstimatedFrame, spatial_error};
use crate::evaluation::motion_agreement::misfit_hint;
use crate::geometry::Pose3;

/// Errors of a run's poses against a reference, the poses of the first compared frame made equal; beside them, what is left
/// when all of them are aligned. Lists have one entry a frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct TrajectoryError<P> {
    /// Name of the reference.
    pub name: String,
    /// Frames with an estimate and a partner in the reference.
    pub num_matched: usize,
    /// Mean distance (m), the mean L2 of homework.
    pub mean: f64,
    /// Root mean square distance (m).
    pub rmse: f64,
    /// Largest distance (m).
    pub max: f64,
    /// The same with all positions aligned by a rotation and a translation; null where the positions do not fix them.
    pub aligned: Option<AlignedError>,
    /// In a sentence: the reference does not fit at all, or its first row alone makes the error as large as it is. Told among a
    /// result's notes.
    #[serde(skip)]
    pub hint: Option<String>,
    /// Distances (m); null for lost frames and those without a partner.
    pub errors: Vec<Option<f64>>,
    /// Angles between the orientations (rad); null as well where the reference has positions alone.
    pub rotation_errors: Vec<Option<f64>>,
    /// What the reference holds for each frame, in the estimate's world.
    pub reference: Vec<Option<P>>,
    /// How the reference was read, in words.
    pub convention: String,
}

/// How a reference without orientations is read.
pub(crate) const POSITIONS_ALONE: &str = "positions alone";

/// How far a frame's estimate is off: the distance (m) and, where the reference has orientations, the angle (rad).
type FrameError = (f64, Option<f64>);

impl<P> TrajectoryError<P> {
    /// Sums up the errors of all frames; `None` for those that are not compared.
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

    /// With what all poses together say. `pairs`: estimate and reference of each compared frame, with orientations if the
    /// reference has them.
    fn with_alignment(self, aligned: Option<AlignedError>, pairs: &[(Pose3, Pose3)]) -> Self {
        let has_orientations = self.convention != POSITIONS_ALONE;
        let first_row = |aligned: AlignedError| first_row_hint(&self.name, self.rmse, &aligned, pairs);
        let hint = misfit_hint(&self.name, pairs, has_orientations)
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
