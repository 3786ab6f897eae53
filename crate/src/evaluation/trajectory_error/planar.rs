//! Errors of estimated poses in the plane against a reference.

use nalgebra::{UnitComplex, UnitQuaternion, Vector2, Vector3};
use serde::Serialize;

use super::{AlignedError, POSITIONS_ALONE, TrajectoryError};
use crate::error::{Error, Result};
use crate::evaluation::associate::by_time;
use crate::evaluation::relation_times::time_tolerance;
use crate::geometry::rotation::twist_angle;
use crate::geometry::{Pose2, Pose3};
use crate::io::trajectory::{Trajectory, in_space};

/// A position in the plane (m).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct PlanarPoint {
    /// x (m).
    pub x: f64,
    /// y (m).
    pub y: f64,
    /// Heading, counter-clockwise from x (rad); null where the reference has no orientations.
    pub heading: Option<f64>,
}

/// Compares estimated poses, `None` for lost frames, with a reference; `good` tells which of them are.
///
/// A reference with as many poses as there are frames is matched in order. Otherwise frames are matched by time, where both
/// have times and those of most frames are in the reference; or by the number in their name: with the stamp of that number, or,
/// without stamps, with the line of that number, counted from 0.
/// The reference is transformed such that it equals the estimate at the first good frame that both have, which is usually the first
/// one with the identity as pose; without one, at the first that both have. A reference without orientations is only translated.
///
/// # Errors
/// When the numbers of poses and frames differ, and neither times nor names match them.
#[inline(never)]
pub(crate) fn planar_error(
    estimate: &[Option<Pose2>],
    good: &[bool],
    names: &[&str],
    times: Option<&[f64]>,
    name: &str,
    reference: &Trajectory,
) -> Result<TrajectoryError<PlanarPoint>> {
    let partners = partners(names, times, reference).ok_or_else(|| {
        Error::whole(
            format!("The reference has {} poses, but there are {} scans", reference.num_rows(), names.len()),
            "Give a reference with one line for each scan, or with the scans' times or numbers as its times",
        )
        .in_file(name)
    })?;
    let is_good = |frame: &usize| partners[*frame].is_some() && good.get(*frame) == Some(&true);
    let first = (0..partners.len()).find(is_good).or_else(|| partners.iter().position(Option::is_some)).unwrap_or(0);
    // The first frame defines the world frame even where it is lost.
    let T_world_first = estimate.get(first).copied().flatten().filter(|_| first > 0).unwrap_or_else(Pose2::identity);
    let placed = seen_from(reference, &partners, first, &T_world_first);
    let compare = |(pose, placed): (&Option<Pose2>, &Option<Placed>)| {
        let (pose, placed) = (pose.as_ref()?, placed.as_ref()?);
        let distance = (pose.translation.vector - placed.position).norm();
        Some((distance, placed.heading.map(|heading| (pose.rotation.inverse() * heading).angle().abs())))
    };
    let errors: Vec<_> = estimate.iter().zip(&placed).map(compare).collect();
    let point = |placed: &Option<Placed>| {
        let heading = |placed: &Placed| placed.heading.map(|heading| heading.angle());
        placed.as_ref().map(|p| PlanarPoint { x: p.position.x, y: p.position.y, heading: heading(p) })
    };
    let reading = if reference.orientations.is_some() { "poses from sensor to world" } else { POSITIONS_ALONE };
    let pairs: Vec<(Pose3, Pose3)> = estimate
        .iter()
        .zip(&placed)
        .filter_map(|(pose, placed)| {
            let placed = placed.as_ref()?;
            let heading = placed.heading.unwrap_or_else(UnitComplex::identity);
            Some((in_space(pose.as_ref()?), in_space(&Pose2::from_parts(placed.position.into(), heading))))
        })
        .collect();
    Ok(TrajectoryError::new(name, &errors, placed.iter().map(point).collect(), reading.to_owned())
        .with_alignment(AlignedError::in_plane(&pairs), &pairs))
}

/// Index in the reference of each frame's partner.
fn partners(names: &[&str], times: Option<&[f64]>, reference: &Trajectory) -> Option<Vec<Option<usize>>> {
    if reference.num_rows() == names.len() {
        return Some((0..names.len()).map(|row| reference.index_of_row(row)).collect());
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
        None => reference.index_of_row(number),
    };
    names.iter().map(|name| last_number(name).and_then(with_number).map(Some)).collect()
}

/// The last number in a file's name: 7 in `scans/scan_07.ply`.
fn last_number(name: &str) -> Option<usize> {
    name.rsplit(|c: char| !c.is_ascii_digit()).find(|digits| !digits.is_empty())?.parse().ok()
}

/// A pose of the reference in the plane.
struct Placed {
    position: Vector2<f64>,
    /// `None` where the reference has no orientations.
    heading: Option<UnitComplex<f64>>,
}

/// Each frame's partner in the plane, transformed such that that of the frame `first` is at `T_world_first`.
fn seen_from(
    reference: &Trajectory,
    partners: &[Option<usize>],
    first: usize,
    T_world_first: &Pose2,
) -> Vec<Option<Placed>> {
    let orientation = |index: usize| reference.orientations.as_ref().and_then(|all| all.get(index));
    let Some(origin) = partners.get(first).copied().flatten() else {
        return partners.iter().map(|_| None).collect();
    };
    let (first, to_first) = (reference.positions[origin], orientation(origin).map(UnitQuaternion::inverse));
    // Without orientations the reference is not rotated.
    let turn = to_first.map_or_else(UnitQuaternion::identity, |q| in_space(T_world_first).rotation * q);
    let placed = |partner: usize| Placed {
        position: (turn * (reference.positions[partner] - first)).xy() + T_world_first.translation.vector,
        heading: orientation(partner).map(|q| UnitComplex::new(twist_angle(&(turn * q), &Vector3::z_axis()))),
    };
    partners.iter().map(|partner| partner.map(placed)).collect()
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
        let error = planar_error(&estimate, &[true; 3], &["1.ply", "3.ply", "4.ply"], None, "ref.txt", &lines).unwrap();
        assert_eq!((error.num_matched, error.reference.len(), error.reference[0].unwrap().x), (3, 3, 0.0));
        assert!((error.max - 0.1).abs() < 1e-12 && error.errors[2] == Some(0.0));

        let stamped =
            Trajectory { stamps: Some(vec![1.0, 2.0, 3.0, 4.0]), positions: along_x(4), ..Trajectory::default() };
        let error =
            planar_error(&estimate, &[true; 3], &["1.ply", "3.ply", "4.ply"], None, "ref.txt", &stamped).unwrap();
        assert!((error.max - 0.1).abs() < 1e-12);

        // By time, where most frames have a partner in the reference; the poses of the first of these are made equal.
        let times = [10.1, 12.0, 12.9];
        let timed = Trajectory { stamps: Some(vec![11.0, 12.0, 13.0, 14.0]), ..stamped };
        let error = planar_error(&estimate, &[true; 3], &["a", "b", "c"], Some(&times), "ref.txt", &timed).unwrap();
        assert_eq!(error.errors[0], None);
        assert!((error.num_matched, error.errors[1]) == (2, Some(0.0)), "{error:?}");
        assert!((error.errors[2].unwrap() - 0.1).abs() < 1e-12 && (error.reference[1].unwrap().x - 2.1).abs() < 1e-12);

        // A doubtful frame is no anchor: the next good one is.
        let doubtful = [false, true, true];
        let error = planar_error(&estimate, &doubtful, &["1.ply", "3.ply", "4.ply"], None, "ref.txt", &lines).unwrap();
        assert!(
            (error.errors[1], error.num_matched) == (Some(0.0), 3) && (error.errors[0].unwrap() - 0.1).abs() < 1e-12
        );

        let refused =
            planar_error(&estimate, &[true; 3], &["a.ply", "b.ply", "c.ply"], None, "ref.txt", &lines).unwrap_err();
        assert!(refused.to_string().starts_with("ref.txt: The reference has 5 poses, but there are 3 scans."));
        assert!(planar_error(&estimate, &[true; 3], &["1.ply", "3.ply", "8.ply"], None, "ref.txt", &lines).is_err());
    }
}
