//! Information and covariances of registered and measured motions (perturbations on the left, rotation first).

use nalgebra::{Matrix3, SMatrix, Vector2, Vector3};

use crate::evaluation::relations::{WRONG_ROTATION_DEG, WRONG_TRANSLATION};
use crate::geometry::mahalanobis;
use crate::geometry::{Pose2, RigidMotion, SquareMatrix};
use crate::map::local::PlanarRegistration;
use crate::preprocess::beam_normals::NUM_BEAMS;

/// Mean square sine of the angle by which normals are off, far walls and doors in recesses included: what they tell of a
/// direction that the walls leave open. With 0.7 and 1.4 times as much: `docs/measurements/laser.md`, leave one out and thresholds.
const NORMALS_NOISE: f64 = 0.02;

/// The information of the motion from a pose to the registered scan. What noise in the normals alone would tell of a
/// direction that the walls leave open is taken off first.
pub fn motion_information(registration: &PlanarRegistration, T_world_before: &Pose2) -> Matrix3<f64> {
    seen_from(&information_less_normal_noise(registration), T_world_before)
}

/// The information of the motion from a pose, of information about the world's origin.
pub fn seen_from<M: RigidMotion>(information: &M::Matrix, T_world_before: &M) -> M::Matrix {
    let adjoint = T_world_before.adjoint();
    adjoint.tr_mul(&(*information * adjoint))
}

/// The information of a registration, less what normals that are off by a few degrees would tell of every direction.
pub fn information_less_normal_noise(registration: &PlanarRegistration) -> Matrix3<f64> {
    independent_information(registration, NORMALS_NOISE)
}

/// The information of a registration, with what the normals tell of every direction: where that is known to be more than noise.
pub fn information(registration: &PlanarRegistration) -> Matrix3<f64> {
    independent_information(registration, 0.0)
}

/// The information by residuals that are independent, less what noise of this mean square sine in the normals tells.
fn independent_information(registration: &PlanarRegistration, normals_noise: f64) -> Matrix3<f64> {
    let weights: f64 = registration.correspondences.iter().map(|c| c.weight).sum();
    if weights <= 0.0 {
        return Matrix3::zeros();
    }
    let moved = || registration.correspondences.iter().map(|c| (c.moved, c.weight));
    let center = moved().map(|(p, w)| p * w).sum::<Vector2<f64>>() / weights;
    let sq_radius = moved().map(|(p, w)| (p - center).norm_squared() * w).sum::<f64>() / weights;
    if sq_radius <= 0.0 {
        return Matrix3::zeros();
    }
    // As in `observability`: about the centre, with the rotation in metres, all directions measured fully give the
    // identity times the number of correspondences over their variance.
    let to_center = Pose2::translation(center.x, center.y).adjoint();
    let basis = to_center * Matrix3::from_diagonal(&Vector3::new(1.0 / sq_radius.sqrt(), 1.0, 1.0));
    let Some(inverse) = basis.try_inverse() else { return Matrix3::zeros() };
    let normalised = basis.tr_mul(&(registration.information * basis));
    let full = normalised.trace().max(0.0);
    let noise = normals_noise * full;
    let eigen = ((normalised + normalised.transpose()) * 0.5).symmetric_eigen();
    // Three unknowns are fitted to what is independent of the residuals: a handful of beams says nothing.
    // Residuals of beams that share a normal are not.
    let num_independent = registration.correspondences.len() as f64 / NUM_BEAMS as f64;
    let freedom = (1.0 - 3.0 / num_independent).max(0.0);
    let kept = eigen.eigenvalues.map(|value| (value - noise).max(0.0) * freedom / NUM_BEAMS as f64);
    let cleaned = eigen.eigenvectors * Matrix3::from_diagonal(&kept) * eigen.eigenvectors.transpose();
    inverse.tr_mul(&(cleaned * inverse))
}

/// The inverse of an information matrix, which may leave directions open: what is known at best, and at worst (rad, m).
pub fn softened_covariance(information: &Matrix3<f64>, best: (f64, f64), worst: (f64, f64)) -> Matrix3<f64> {
    let diagonal = |(rotation, translation): (f64, f64), power: i32| {
        Matrix3::from_diagonal(&Vector3::new(rotation, translation, translation).map(|sigma: f64| sigma.powi(power)))
    };
    let prior = diagonal(worst, -2);
    (information + prior).try_inverse().unwrap_or_else(|| diagonal(worst, 2)) + diagonal(best, 2)
}

/// Largest standard deviation (rad, m) of the motion between two places for which it is certain: half of what makes a pair of frames
/// wrong, so that two standard deviations reach it.
pub const CERTAIN_SIGMA: (f64, f64) = (WRONG_ROTATION_DEG.to_radians() / 2.0, WRONG_TRANSLATION / 2.0);

/// Standard deviations of a motion's heading (rad) and of the position that it leads to (m), by its covariance.
pub fn sigmas(motion: &Pose2, covariance: &Matrix3<f64>) -> (f64, f64) {
    (covariance[(0, 0)].max(0.0).sqrt(), position_covariance(motion, covariance).trace().max(0.0).sqrt())
}

/// The variance of a motion as a share of the largest one that is certain, of its heading or its position, whichever is larger.
pub fn openness(motion: &Pose2, covariance: &Matrix3<f64>) -> f64 {
    let (heading, position) = sigmas(motion, covariance);
    (heading / CERTAIN_SIGMA.0).max(position / CERTAIN_SIGMA.1).powi(2)
}

/// The most likely motion by two measurements of it, each with its covariance. The second one may be an outlier: its weight
/// falls as it contradicts the first, beyond what one in twenty right ones does (dynamic covariance scaling, as in the pose graph).
pub fn fuse(first: (&Pose2, &Matrix3<f64>), second: (&Pose2, &Matrix3<f64>)) -> Pose2 {
    let off = (second.0 * first.0.inverse()).log();
    let sq_distance = (first.1 + second.1).try_inverse().map_or(0.0, |information| off.dot(&(information * off)));
    let weight = mahalanobis::dynamic_covariance_scaling(sq_distance, mahalanobis::ONE_IN_TWENTY);
    let sum = first.1 + second.1 / weight;
    let gain = sum.try_inverse().map_or_else(Matrix3::zeros, |inverse| first.1 * inverse);
    (Pose2::exp(&(gain * off)) * first.0).renormalized()
}

/// Covariance of a motion and then another.
pub fn chained(first: (&Pose2, &Matrix3<f64>), second: &Matrix3<f64>) -> Matrix3<f64> {
    let adjoint = first.0.adjoint();
    first.1 + adjoint * second * adjoint.transpose()
}

/// Covariance of a motion taken backwards.
pub fn inverted(motion: &Pose2, covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let adjoint = motion.inverse().adjoint();
    adjoint * covariance * adjoint.transpose()
}

/// Covariance of where a motion takes the origin (m^2).
pub fn position_covariance(motion: &Pose2, covariance: &Matrix3<f64>) -> SMatrix<f64, 2, 2> {
    let jacobian = Pose2::point_jacobian(&motion.translation.vector);
    jacobian * covariance * jacobian.transpose()
}
