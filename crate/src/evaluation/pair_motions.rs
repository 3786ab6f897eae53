//! The motions between corresponding poses of two trajectories, compared.

use nalgebra::{Matrix3, Vector3};

use super::motion_ratio::{MAX_SAMPLES, widest_gap};
use super::path::{Path, relative};
use crate::geometry::pose_distance::METRES_PER_RADIAN;
use crate::geometry::quantile::quantile;
use crate::geometry::rotation::nearest_rotation;

/// A motion between two poses, in the sensor's axes at the first.
pub(super) type Motion = (Matrix3<f64>, Vector3<f64>);

/// Mean distance of motions from none (m).
pub(super) fn mean_size(motions: &[Motion]) -> f64 {
    let still = (Matrix3::identity(), Vector3::zeros());
    motions.iter().map(|motion| distance(motion, &still)).sum::<f64>() / motions.len() as f64
}

/// Which motions are compared.
pub(super) struct Motions {
    /// The indices of the first and of the second pose of each.
    pairs: Vec<(usize, usize)>,
    /// Motions that share no frame, and whose errors are thus independent.
    pub num_independent: usize,
}

impl Motions {
    pub fn of(num_poses: usize) -> Option<Self> {
        let gap = widest_gap(num_poses);
        let count = num_poses.checked_sub(gap).filter(|count| *count > 0)?;
        let stride = count.div_ceil(MAX_SAMPLES);
        let pairs: Vec<_> = (0..count).step_by(stride).map(|index| (index, index + gap)).collect();
        Some(Self { num_independent: pairs.len().min(count.div_ceil(gap)), pairs })
    }

    /// The poses that the motions need: first, second, first, second ...
    pub fn sampled(&self, path: &Path) -> Path {
        let indices = || self.pairs.iter().flat_map(|&(a, b)| [a, b]);
        Path {
            positions: indices().map(|index| path.positions[index]).collect(),
            rotations: path.rotations.as_ref().map(|all| indices().map(|index| all[index]).collect()),
            stamps: None,
        }
    }

    /// The motions between sampled poses.
    pub fn between(sampled: &Path) -> Vec<Motion> {
        let rotations = sampled.rotations.as_deref().unwrap_or_default();
        let poses: Vec<_> = rotations.iter().zip(&sampled.positions).collect();
        poses.chunks_exact(2).map(|pair| relative(pair[0], pair[1])).collect()
    }
}

/// The unit of the reference's lengths in that of the estimate.
pub(super) fn scale_between(reference: &[Motion], estimate: &[Motion]) -> f64 {
    let length = |motions: &[Motion]| {
        let mut lengths: Vec<f64> = motions.iter().map(|(_, t)| t.norm()).collect();
        quantile(&mut lengths, 0.5).unwrap_or(0.0)
    };
    let ratio = length(reference) / length(estimate);
    if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 }
}

/// Mean difference of the motions (m), those of the estimate turned by `axes` and in another unit of length.
pub(super) fn misfit(reference: &[Motion], estimate: &[Motion], axes: &Matrix3<f64>, scale: f64) -> f64 {
    let turned = |(R, t): &Motion| (axes * R * axes.transpose(), scale * (axes * t));
    let differences = reference.iter().zip(estimate).map(|(a, b)| distance(a, &turned(b)));
    differences.sum::<f64>() / reference.len() as f64
}

/// Distance of two motions (m), as `pose_distance`.
pub(super) fn distance((R_a, t_a): &Motion, (R_b, t_b): &Motion) -> f64 {
    let cosine = (((R_a.transpose() * R_b).trace() - 1.0) / 2.0).clamp(-1.0, 1.0);
    (t_a - t_b).norm() + METRES_PER_RADIAN * cosine.acos()
}

/// Of the 24 rotations that exchange or reverse axes the one that turns the estimate's motions nearest to the reference's.
pub(super) fn best_axes(reference: &[Motion], estimate: &[Motion], scale: f64) -> Matrix3<f64> {
    let vector =
        |R: &Matrix3<f64>| METRES_PER_RADIAN * nearest_rotation(R).map_or_else(Vector3::zeros, |q| q.scaled_axis());
    let mut covariance = Matrix3::zeros();
    for ((R_a, t_a), (R_b, t_b)) in reference.iter().zip(estimate) {
        covariance += vector(R_a) * vector(R_b).transpose() + scale * (t_a * t_b.transpose());
    }
    let fit = |axes: &Matrix3<f64>| axes.component_mul(&covariance).sum();
    rotations_of_axes().into_iter().max_by(|a, b| fit(a).total_cmp(&fit(b))).unwrap_or_else(Matrix3::identity)
}

/// The 24 rotations that map axes to axes.
fn rotations_of_axes() -> Vec<Matrix3<f64>> {
    let axes = || [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().flat_map(|axis| [axis, -axis]);
    let with = |x: Vector3<f64>| {
        axes().filter(move |y| x.dot(y) == 0.0).map(move |y| Matrix3::from_columns(&[x, y, x.cross(&y)]))
    };
    axes().flat_map(with).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_24_rotations_of_axes() {
        assert_eq!(rotations_of_axes().len(), 24);
        assert!(rotations_of_axes().iter().all(|axes| (axes.determinant() - 1.0).abs() < 1e-12));
    }
}
