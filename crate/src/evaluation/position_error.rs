//! Distance of estimated positions to a reference.

use nalgebra::{UnitQuaternion, Vector2};
use serde::Serialize;

use crate::error::{Error, Result};
use crate::geometry::Pose2;
use crate::io::trajectory::Trajectory;

/// A position in the plane (m).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct PlanarPoint {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
}

/// Distances of the positions of a trajectory to a reference, first poses made equal, no other alignment.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct PositionError {
    /// Name of the reference.
    pub name: String,
    /// Frames with a partner in the reference.
    pub num_matched: usize,
    /// Mean distance (m).
    pub mean: f64,
    /// Root mean square distance (m).
    pub rmse: f64,
    /// Largest distance (m).
    pub max: f64,
    /// Distance of each frame (m), null where there is none.
    pub errors: Vec<Option<f64>>,
    /// The reference's positions in the world frame, the frame of the first scan.
    pub reference: Vec<PlanarPoint>,
}

/// Compares estimated poses, `None` for lost frames, with a reference of one pose a frame.
///
/// The reference is moved so that its first pose is the identity, which is what the first estimate is; where it has no
/// orientations, only its first position is moved to the origin.
///
/// # Errors
/// When the reference has another number of poses than there are frames.
pub fn position_error(estimate: &[Option<Pose2>], name: &str, reference: &Trajectory) -> Result<PositionError> {
    let positions = in_first_frame(reference);
    if positions.len() != estimate.len() {
        return Err(Error::whole(
            format!("The reference has {} poses, but there are {} scans", positions.len(), estimate.len()),
            "Give a reference with one line for each scan, in the order of the scans",
        )
        .in_file(name));
    }
    let errors: Vec<Option<f64>> = estimate
        .iter()
        .zip(&positions)
        .map(|(pose, position)| pose.map(|pose| (pose.translation.vector - position).norm()))
        .collect();
    let known: Vec<f64> = errors.iter().copied().flatten().collect();
    let count = known.len().max(1) as f64;
    Ok(PositionError {
        name: name.to_owned(),
        num_matched: known.len(),
        mean: known.iter().sum::<f64>() / count,
        rmse: (known.iter().map(|e| e * e).sum::<f64>() / count).sqrt(),
        max: known.iter().copied().fold(0.0, f64::max),
        errors,
        reference: positions.iter().map(|p| PlanarPoint { x: p.x, y: p.y }).collect(),
    })
}

/// Positions in the plane, in the frame of the first pose.
fn in_first_frame(reference: &Trajectory) -> Vec<Vector2<f64>> {
    let Some(first) = reference.positions.first() else { return Vec::new() };
    let to_first =
        reference.orientations.as_ref().and_then(|orientations| orientations.first()).map(UnitQuaternion::inverse);
    let moved = reference.positions.iter().map(|position| position - first);
    moved.map(|position| to_first.map_or(position, |q| q * position).xy()).collect()
}
