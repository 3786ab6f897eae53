//! The error after a least-squares alignment of all poses, and whether the first pose of the reference is an outlier.

use nalgebra::{UnitQuaternion, Vector3};
use serde::Serialize;

use crate::evaluation::motion_ratio::MAX_SAMPLES;
use crate::evaluation::umeyama::best_fit;
use crate::geometry::Pose3;
use crate::geometry::pose_distance::pose_distance;
use crate::geometry::quantile::MIN_SAMPLE;

/// Distances after the rotation and translation that align all compared positions in the least-squares sense.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct AlignedError {
    /// Mean distance (m).
    pub mean: f64,
    /// Root mean square distance (m).
    pub rmse: f64,
    /// Largest distance (m).
    pub max: f64,
}

/// The first pose is an outlier where the error with it made equal exceeds the largest with another one made equal by this factor. It is
/// that of one trajectory, and not of the other, where it is farther by this factor from where the motion after it leads back to.
const MIN_OUTLIER_RATIO: f64 = 2.0;

impl AlignedError {
    /// In space, by Umeyama's fit; `None` of fewer than three positions.
    pub(super) fn in_space(pairs: &[(Pose3, Pose3)]) -> Option<Self> {
        let (estimate, reference): (Vec<_>, Vec<_>) = pairs.iter().map(positions).unzip();
        Self::of_positions(&estimate, &reference)
    }

    /// In space, for corresponding positions (m).
    pub(in crate::evaluation) fn of_positions(estimate: &[Vector3<f64>], reference: &[Vector3<f64>]) -> Option<Self> {
        let fit = best_fit(reference, estimate, false).ok()?.similarity;
        Some(Self::of(estimate.iter().zip(reference).map(|(e, r)| (fit.rotation * r + fit.translation - e).norm())))
    }

    /// In the plane, by a fit that rotates about z only.
    pub(super) fn in_plane(pairs: &[(Pose3, Pose3)]) -> Option<Self> {
        let (estimate, reference): (Vec<_>, Vec<_>) = pairs.iter().map(positions).unzip();
        let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let (mean_estimate, mean_reference) = (mean(&estimate), mean(&reference));
        let (mut sin, mut cos) = (0.0, 0.0);
        for (e, r) in estimate.iter().zip(&reference) {
            let (e, r) = (e - mean_estimate, r - mean_reference);
            cos += r.x * e.x + r.y * e.y;
            sin += r.x * e.y - r.y * e.x;
        }
        if pairs.len() < 2 || f64::hypot(sin, cos) <= f64::EPSILON {
            return None;
        }
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), sin.atan2(cos));
        let distance =
            |(e, r): (&Vector3<f64>, &Vector3<f64>)| (turn * (r - mean_reference) + mean_estimate - e).norm();
        Some(Self::of(estimate.iter().zip(&reference).map(distance)))
    }

    fn of(distances: impl Iterator<Item = f64>) -> Self {
        let (mut sum, mut squares, mut max, mut count) = (0.0, 0.0, 0.0, 0.0);
        for distance in distances {
            sum += distance;
            squares += distance * distance;
            max = f64::max(max, distance);
            count += 1.0;
        }
        Self { mean: sum / count, rmse: f64::sqrt(squares / count), max }
    }
}

/// A note where the first row of the reference, or the first pose of the estimate, alone causes an error of this `rmse` (m).
/// `pairs`: estimate and reference of each frame, with orientations.
pub(in crate::evaluation) fn first_row_hint(
    name: &str,
    rmse: f64,
    aligned: &AlignedError,
    pairs: &[(Pose3, Pose3)],
) -> Option<String> {
    let (first, all) = (1e3 * rmse, 1e3 * aligned.rmse);
    is_first_row_off(pairs).then(|| {
        let (of_estimate, of_reference) = (first_jump(pairs, |pair| pair.0), first_jump(pairs, |pair| pair.1));
        let whose = if of_reference > MIN_OUTLIER_RATIO * of_estimate {
            "its first row explains most of the error"
        } else if of_estimate > MIN_OUTLIER_RATIO * of_reference {
            "the estimate's first pose explains most of the error"
        } else {
            "its first row or the estimate's first pose explains most of the error"
        };
        format!(
            "{name}: {whose}: the rmse is {first:.1} mm with the first poses made equal, and {all:.1} mm with all of them \
             aligned"
        )
    })
}

/// How far the first pose of a trajectory is from where the motion after it leads back to (m): a pose that is off leaves the
/// motion of its own trajectory, not that of the other one.
fn first_jump(pairs: &[(Pose3, Pose3)], of: impl Fn(&(Pose3, Pose3)) -> Pose3) -> f64 {
    let [first, second, third, ..] = pairs else { return 0.0 };
    let (first, second, third) = (of(first), of(second), of(third));
    pose_distance(&first, &(second * (third.inverse() * second)))
}

/// Whether the trajectories are far closer when the poses of any other frame are made equal.
fn is_first_row_off(pairs: &[(Pose3, Pose3)]) -> bool {
    let anchored = |(estimate, reference): &(Pose3, Pose3)| {
        let moved = estimate * reference.inverse();
        AlignedError::of(pairs.iter().map(|(e, r)| ((moved * r).translation.vector - e.translation.vector).norm())).rmse
    };
    let Some((first, others)) = pairs.split_first() else { return false };
    let stride = others.len().div_ceil(MAX_SAMPLES).max(1);
    let anchors = others.iter().step_by(stride);
    anchors.len() >= MIN_SAMPLE && anchored(first) > MIN_OUTLIER_RATIO * anchors.map(anchored).fold(0.0, f64::max)
}

fn positions((estimate, reference): &(Pose3, Pose3)) -> (Vector3<f64>, Vector3<f64>) {
    (estimate.translation.vector, reference.translation.vector)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;

    /// A curved path (m).
    fn path(turned_first: f64) -> Vec<(Pose3, Pose3)> {
        let pose = |i: u32| {
            let s = 0.3 * f64::from(i);
            Isometry3::new(Vector3::new(s, (0.4 * s).sin(), 0.0), Vector3::z() * 0.1 * s)
        };
        let noise = |i: u32| 1e-3 * f64::from(i * 7 % 5);
        let mut pairs: Vec<_> =
            (0..20).map(|i| (Isometry3::translation(0.0, noise(i), 0.0) * pose(i), pose(i))).collect();
        pairs[0].1 *= Isometry3::rotation(Vector3::z() * turned_first);
        pairs
    }

    #[test]
    fn the_fit_removes_a_rigid_motion_and_leaves_the_noise() {
        let moved = Isometry3::new(Vector3::new(3.0, -1.0, 0.0), Vector3::z() * 0.7);
        let pairs: Vec<_> = path(0.0).into_iter().map(|(e, r)| (e, moved * r)).collect();
        for error in [AlignedError::in_plane(&pairs).unwrap(), AlignedError::in_space(&pairs).unwrap()] {
            assert!(error.rmse > 5e-4 && error.rmse < 2e-3 && error.max < 5e-3 && error.mean < error.rmse, "{error:?}");
        }
        assert_eq!(AlignedError::in_plane(&pairs[..1]), None);
        assert_eq!(AlignedError::in_space(&pairs[..2]), None);
    }

    #[test]
    fn a_rotated_first_row_is_reported_and_noise_is_not() {
        let told = |pairs: &[(Pose3, Pose3)]| {
            let aligned = AlignedError::in_space(pairs).unwrap();
            first_row_hint("gt", 0.1, &aligned, pairs).unwrap_or_default()
        };
        assert!(told(&path(0.05)).starts_with("gt: its first row explains"), "{}", told(&path(0.05)));
        let exchanged: Vec<_> = path(0.05).into_iter().map(|(estimate, reference)| (reference, estimate)).collect();
        assert!(told(&exchanged).starts_with("gt: the estimate's first pose explains"), "{}", told(&exchanged));
        assert!(is_first_row_off(&path(0.05)));
        assert!(!is_first_row_off(&path(0.0)));
        assert!(!is_first_row_off(&path(0.05)[..4]) && !is_first_row_off(&[]));
        // A path with steady drift has no outlier.
        let drifting: Vec<_> = (0..20u32)
            .map(|i| {
                let s = 0.3 * f64::from(i);
                let pose =
                    |scale: f64| Isometry3::new(Vector3::new(s, scale * s * s, 0.0), Vector3::z() * 2.0 * scale * s);
                (pose(0.02), pose(0.0))
            })
            .collect();
        assert!(!is_first_row_off(&drifting));
    }
}
