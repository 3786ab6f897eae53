//! Distance of estimated positions to a reference.

use nalgebra::{UnitQuaternion, Vector2};
use serde::Serialize;

use super::associate::by_time;
use super::relation_times::time_tolerance;
use crate::error::{Error, Result};
use crate::geometry::Pose2;
use crate::io::trajectory::{Trajectory, in_space};

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
/// A reference with as many poses as there are frames is taken in their order. Otherwise frames are matched by their time,
/// where both have times and those of most frames are in the reference; or by the number in their name: with the stamp of
/// that number, or, without stamps, with the line of that number, counted from 0.
/// The reference is moved so that it agrees with the estimate at the first frame that both have, which mostly is the first
/// one and the identity; where it has no orientations, only that frame's position is made equal.
///
/// # Errors
/// When the reference has another number of poses than there are frames, and neither times nor names tell which is which.
pub fn position_error(
    estimate: &[Option<Pose2>],
    names: &[&str],
    times: Option<&[f64]>,
    name: &str,
    reference: &Trajectory,
) -> Result<PositionError> {
    let partners = partners(names, times, reference).ok_or_else(|| {
        Error::whole(
            format!("The reference has {} poses, but there are {} scans", reference.len(), names.len()),
            "Give a reference with one line for each scan, or with the scans' times or numbers as its times",
        )
        .in_file(name)
    })?;
    let first = partners.iter().position(Option::is_some).unwrap_or(0);
    // A first frame that is lost is where the world begins all the same.
    let T_world_first = estimate.get(first).copied().flatten().filter(|_| first > 0).unwrap_or_else(Pose2::identity);
    let reference = seen_from(reference, partners.get(first).copied().flatten().unwrap_or(0), &T_world_first);
    let distance = |(pose, partner): (&Option<Pose2>, &Option<usize>)| {
        Some(((*pose)?.translation.vector - reference[(*partner)?]).norm())
    };
    let errors: Vec<Option<f64>> = estimate.iter().zip(&partners).map(distance).collect();
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
fn partners(names: &[&str], times: Option<&[f64]>, reference: &Trajectory) -> Option<Vec<Option<usize>>> {
    if reference.len() == names.len() {
        return Some((0..names.len()).map(Some).collect());
    }
    if let (Some(times), Some(stamps)) = (times, &reference.stamps)
        && let Ok(pairs) = by_time(stamps, times, time_tolerance(stamps).max(time_tolerance(times)), 0.0)
        && 2 * pairs.len() > names.len().min(reference.len())
    {
        let mut partners = vec![None; names.len()];
        for pair in pairs {
            partners[pair.estimate] = Some(pair.reference);
        }
        return Some(partners);
    }
    let with_number = |number: usize| match &reference.stamps {
        Some(stamps) => stamps.iter().position(|&stamp| (stamp - number as f64).abs() < 1e-6),
        None => (number < reference.len()).then_some(number),
    };
    names.iter().map(|name| last_number(name).and_then(with_number).map(Some)).collect()
}

/// The last number in a file's name: 7 in `scans/scan_07.ply`.
fn last_number(name: &str) -> Option<usize> {
    name.rsplit(|c: char| !c.is_ascii_digit()).find(|digits| !digits.is_empty())?.parse().ok()
}

/// All positions in the plane, moved so that the pose `origin` is this one.
fn seen_from(reference: &Trajectory, origin: usize, T_world_origin: &Pose2) -> Vec<Vector2<f64>> {
    let Some(first) = reference.positions.get(origin) else { return Vec::new() };
    let orientations = reference.orientations.as_ref();
    let to_first = orientations.and_then(|orientations| orientations.get(origin)).map(UnitQuaternion::inverse);
    // Without orientations the reference keeps its own.
    let turn = to_first.map_or_else(UnitQuaternion::identity, |q| in_space(T_world_origin).rotation * q);
    let moved = reference.positions.iter().map(|position| (turn * (position - first)).xy());
    moved.map(|position| position + T_world_origin.translation.vector).collect()
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
        let error = position_error(&estimate, &["1.ply", "3.ply", "4.ply"], None, "ref.txt", &lines).unwrap();
        assert_eq!((error.num_matched, error.reference.len(), error.reference[0].x), (3, 5, -1.0));
        assert!((error.max - 0.1).abs() < 1e-12 && error.errors[2] == Some(0.0));

        let stamped =
            Trajectory { stamps: Some(vec![1.0, 2.0, 3.0, 4.0]), positions: along_x(4), ..Trajectory::default() };
        let error = position_error(&estimate, &["1.ply", "3.ply", "4.ply"], None, "ref.txt", &stamped).unwrap();
        assert!((error.max - 0.1).abs() < 1e-12);

        // By time, where most frames have one in the reference; the first one that has is where both begin.
        let times = [10.1, 12.0, 12.9];
        let timed = Trajectory { stamps: Some(vec![11.0, 12.0, 13.0, 14.0]), ..stamped };
        let error = position_error(&estimate, &["a", "b", "c"], Some(&times), "ref.txt", &timed).unwrap();
        assert_eq!(error.errors[0], None);
        assert!((error.num_matched, error.errors[1]) == (2, Some(0.0)), "{error:?}");
        assert!((error.errors[2].unwrap() - 0.1).abs() < 1e-12 && (error.reference[1].x - 2.1).abs() < 1e-12);

        let refused = position_error(&estimate, &["a.ply", "b.ply", "c.ply"], None, "ref.txt", &lines).unwrap_err();
        assert!(refused.to_string().starts_with("ref.txt: The reference has 5 poses, but there are 3 scans."));
        assert!(position_error(&estimate, &["1.ply", "3.ply", "8.ply"], None, "ref.txt", &lines).is_err());
    }
}
