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

/// Compares estimated poses, `None` for lost frames, with a reference.
///
/// A reference with as many poses as there are frames is taken in their order. Otherwise frames are matched by the number
/// in their name: with the stamp of that number, or, without stamps, with the line of that number, counted from 0.
/// The reference is moved so that the pose of the first frame is the identity, which is what the first estimate is; where
/// it has no orientations, only that frame's position is moved to the origin.
///
/// # Errors
/// When the reference has another number of poses than there are frames, and the names do not tell which is which.
pub fn position_error(
    estimate: &[Option<Pose2>],
    names: &[&str],
    name: &str,
    reference: &Trajectory,
) -> Result<PositionError> {
    let partners = partners(names, reference).ok_or_else(|| {
        Error::whole(
            format!("The reference has {} poses, but there are {} scans", reference.len(), names.len()),
            "Give a reference with one line for each scan, or with the numbers of the scans as its times",
        )
        .in_file(name)
    })?;
    let reference = seen_from(reference, partners.first().copied().unwrap_or(0));
    let positions: Vec<Vector2<f64>> = partners.iter().map(|&partner| reference[partner]).collect();
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
        reference: reference.iter().map(|p| PlanarPoint { x: p.x, y: p.y }).collect(),
    })
}

/// Index in the reference of each frame's partner.
fn partners(names: &[&str], reference: &Trajectory) -> Option<Vec<usize>> {
    if reference.len() == names.len() {
        return Some((0..names.len()).collect());
    }
    let with_number = |number: usize| match &reference.stamps {
        Some(stamps) => stamps.iter().position(|&stamp| (stamp - number as f64).abs() < 1e-6),
        None => (number < reference.len()).then_some(number),
    };
    names.iter().map(|name| last_number(name).and_then(with_number)).collect()
}

/// The last number in a file's name: 7 in `scans/scan_07.ply`.
fn last_number(name: &str) -> Option<usize> {
    name.rsplit(|c: char| !c.is_ascii_digit()).find(|digits| !digits.is_empty())?.parse().ok()
}

/// All positions in the plane, in the frame of the pose `origin`.
fn seen_from(reference: &Trajectory, origin: usize) -> Vec<Vector2<f64>> {
    let Some(first) = reference.positions.get(origin) else { return Vec::new() };
    let orientations = reference.orientations.as_ref();
    let to_first = orientations.and_then(|orientations| orientations.get(origin)).map(UnitQuaternion::inverse);
    let moved = reference.positions.iter().map(|position| position - first);
    moved.map(|position| to_first.map_or(position, |q| q * position).xy()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_a_frame_is_the_last_in_its_name() {
        let numbers = ["7.ply", "scan_07.ply", "run2/10.ply", "a.ply", "", "é12é.ply", "99999999999999999999.ply"]
            .map(last_number);
        assert_eq!(numbers, [Some(7), Some(7), Some(10), None, None, Some(12), None]);
    }

    #[test]
    fn missing_frames_are_matched_by_their_number() {
        let along_x = |count: u32| (0..count).map(|i| nalgebra::Vector3::new(f64::from(i), 0.0, 0.0)).collect();
        let lines = Trajectory { positions: along_x(5), ..Trajectory::default() };
        let estimate: Vec<_> = [0.0, 2.1, 3.0].map(|x| Some(Pose2::translation(x, 0.0))).to_vec();
        let error = position_error(&estimate, &["1.ply", "3.ply", "4.ply"], "ref.txt", &lines).unwrap();
        assert_eq!((error.num_matched, error.reference.len(), error.reference[0].x), (3, 5, -1.0));
        assert!((error.max - 0.1).abs() < 1e-12 && error.errors[2] == Some(0.0));

        let stamped =
            Trajectory { stamps: Some(vec![1.0, 2.0, 3.0, 4.0]), positions: along_x(4), ..Trajectory::default() };
        let error = position_error(&estimate, &["1.ply", "3.ply", "4.ply"], "ref.txt", &stamped).unwrap();
        assert!((error.max - 0.1).abs() < 1e-12);

        let refused = position_error(&estimate, &["a.ply", "b.ply", "c.ply"], "ref.txt", &lines).unwrap_err();
        assert!(refused.to_string().starts_with("ref.txt: The reference has 5 poses, but there are 3 scans."));
        assert!(position_error(&estimate, &["1.ply", "3.ply", "8.ply"], "ref.txt", &lines).is_err());
    }
}
