//! Poses between the poses of a file, at the times of another: for trajectories of different rates.

use nalgebra::{Matrix3, Vector3};

use super::associate::Pair;
use super::path::Path;
use crate::geometry::quantile::quantile;
use crate::geometry::rotation::nearest_rotation;
use crate::search::order::ascending;
use crate::{Error, Result};

/// Most intervals, in medians, over which a pose is interpolated: one pose may be missing. The error of a straight line between
/// two poses grows with the square of their interval.
pub(super) const MAX_INTERVALS: f64 = 2.5;

/// The reference and the estimate at common times, and for each the nearest pose of both files.
pub(super) struct Interpolated {
    pub pairs: Vec<Pair>,
    pub reference: Path,
    pub estimate: Path,
    pub note: String,
}

/// Interval between consecutive times (s), the median of the positive ones; `None` of fewer than two times.
pub(super) fn interval(stamps: &[f64]) -> Option<f64> {
    let mut intervals: Vec<f64> =
        stamps.windows(2).map(|pair| pair[1] - pair[0]).filter(|interval| *interval > 0.0).collect();
    quantile(&mut intervals, 0.5)
}

/// Keeps the poses of the trajectory with the longer interval, and interpolates the other at their times: positions linearly,
/// orientations along the shortest rotation. `offset` (s) is added to the estimate's times.
///
/// # Errors
/// When one has no times, or none of the times lies between two poses of the other.
pub(super) fn interpolated(reference: &Path, estimate: &Path, offset: f64) -> Result<Interpolated> {
    let (Some(of_reference), Some(of_estimate)) = (&reference.stamps, &estimate.stamps) else {
        let whose = if reference.stamps.is_none() { "reference" } else { "estimate" };
        let problem = format!("The {whose} has no times to interpolate by");
        return Err(Error::whole(problem, "Compare without interpolation, or give the times in a file of their own"));
    };
    let of_estimate: Vec<f64> = of_estimate.iter().map(|stamp| stamp + offset).collect();
    let keeps_estimate = interval(&of_estimate) >= interval(of_reference);
    let (kept, kept_stamps, whose, dense, dense_stamps) = if keeps_estimate {
        (estimate, &of_estimate, "reference", reference, of_reference)
    } else {
        (reference, of_reference, "estimate", estimate, &of_estimate)
    };
    let order = ascending(dense_stamps.iter().copied());
    let longest = MAX_INTERVALS * interval(dense_stamps).unwrap_or(0.0);
    let (mut indices, mut at) = (Vec::new(), Vec::new());
    for (index, &stamp) in kept_stamps.iter().enumerate() {
        if let Some(place) = between(dense_stamps, &order, stamp, longest) {
            indices.push(index);
            at.push(place);
        }
    }
    if at.is_empty() {
        let problem = format!("No time lies between two neighbouring poses of the {whose}");
        return Err(Error::whole(problem, "Correct the offset of the times, or compare without interpolation"));
    }
    let note = format!("The {whose} was interpolated at {} of the {} times of the other.", at.len(), kept.len());
    let stamps = indices.iter().map(|&index| kept_stamps[index]).collect();
    let kept_path = Path { stamps: Some(stamps), ..selected(kept, &indices) };
    let dense_path = Path { stamps: kept_path.stamps.clone(), ..at_places(dense, &at) };
    let nearest = |place: &Place| if place.share < 0.5 { place.before } else { place.after };
    let pairs = indices.iter().zip(&at).map(|(&index, place)| {
        let dense = nearest(place);
        if keeps_estimate {
            Pair { reference: dense, estimate: index }
        } else {
            Pair { reference: index, estimate: dense }
        }
    });
    let pairs = pairs.collect();
    let (reference, estimate) = if keeps_estimate { (dense_path, kept_path) } else { (kept_path, dense_path) };
    Ok(Interpolated { pairs, reference, estimate, note })
}

/// Between two poses: the share of the way from the one before to the one after.
pub(super) struct Place {
    before: usize,
    after: usize,
    share: f64,
}

impl Place {
    /// A pose of the file.
    pub(super) fn of(index: usize) -> Self {
        Self { before: index, after: index, share: 0.0 }
    }
}

/// The rotation and the position of a path at a place; none without rotations.
pub(super) fn pose_at(path: &Path, place: Place) -> Option<(Matrix3<f64>, Vector3<f64>)> {
    let Path { positions, rotations, .. } = at_places(path, &[place]);
    Some((rotations?[0], positions[0]))
}

/// Where a time lies between two poses that are not further apart than `longest` (s); `order` sorts the times.
pub(super) fn between(stamps: &[f64], order: &[usize], stamp: f64, longest: f64) -> Option<Place> {
    let next = order.partition_point(|&index| stamps[index] < stamp);
    let after = *order.get(next)?;
    if stamps[after] == stamp {
        return Some(Place::of(after));
    }
    let before = order[next.checked_sub(1)?];
    let interval = stamps[after] - stamps[before];
    (interval <= longest).then(|| Place { before, after, share: (stamp - stamps[before]) / interval })
}

fn selected(path: &Path, indices: &[usize]) -> Path {
    Path {
        positions: indices.iter().map(|&index| path.positions[index]).collect(),
        rotations: path.rotations.as_ref().map(|all| indices.iter().map(|&index| all[index]).collect()),
        stamps: None,
    }
}

fn at_places(path: &Path, places: &[Place]) -> Path {
    let position = |place: &Place| path.positions[place.before].lerp(&path.positions[place.after], place.share);
    let rotation = |all: &[Matrix3<f64>], place: &Place| {
        let (before, after) = (all[place.before], all[place.after]);
        let turned = || {
            let (from, to) = (nearest_rotation(&before)?, nearest_rotation(&after)?);
            let by = (from.inverse() * to).powf(place.share);
            Some((from * by).to_rotation_matrix().into_inner())
        };
        if place.share == 0.0 { before } else { turned().unwrap_or(before) }
    };
    Path {
        positions: places.iter().map(position).collect(),
        rotations: path.rotations.as_ref().map(|all| places.iter().map(|place| rotation(all, place)).collect()),
        stamps: None,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;

    /// A drive along a line at 2 m/s and 0.5 rad/s.
    fn drive(stamps: &[f64]) -> Path {
        let rotation =
            |t: &f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.5 * t).to_rotation_matrix().into_inner();
        Path {
            positions: stamps.iter().map(|t| Vector3::new(2.0 * t, 0.0, 1.0)).collect(),
            rotations: Some(stamps.iter().map(rotation).collect()),
            stamps: Some(stamps.to_vec()),
        }
    }

    #[test]
    fn the_denser_trajectory_is_interpolated_at_the_times_of_the_other_but_not_over_holes() {
        let dense: Vec<f64> = (0..100).filter(|i| !(40..50).contains(i)).map(|i| 0.1 * f64::from(i)).collect();
        let sparse: Vec<f64> = (0..24).map(|i| 0.03 + 0.5 * f64::from(i)).collect();
        for (reference, estimate) in [(&dense, &sparse), (&sparse, &dense)] {
            let found = interpolated(&drive(reference), &drive(estimate), 0.0).unwrap();
            // Two of the times lie in the hole, and four after the end.
            assert_eq!(
                (found.pairs.len(), found.reference.len(), found.estimate.len()),
                (18, 18, 18),
                "{}",
                found.note
            );
            for (a, b) in found.reference.positions.iter().zip(&found.estimate.positions) {
                assert!((a - b).norm() < 1e-12);
            }
            let rotations = found.reference.rotations.unwrap().into_iter().zip(found.estimate.rotations.unwrap());
            assert!(rotations.into_iter().all(|(a, b)| (a - b).amax() < 1e-12));
        }
        let late: Vec<f64> = sparse.iter().map(|stamp| stamp - 700.0).collect();
        assert!(interpolated(&drive(&dense), &drive(&late), 0.0).is_err());
        assert_eq!(interpolated(&drive(&dense), &drive(&late), 700.0).unwrap().pairs.len(), 18);
        let told = interpolated(&Path { stamps: None, ..drive(&dense) }, &drive(&sparse), 0.0).err().unwrap();
        assert!(told.to_string().contains("The reference has no times"));
    }
}
