//! Rotation matrices that files hold in few digits, made orthonormal; swing-twist decomposition.

use nalgebra::{Matrix3, Quaternion, Unit, UnitQuaternion, Vector3};

use super::Pose3;
use super::jacobi::MAX_SWEEPS;

/// Largest magnitude of an off-diagonal entry of R R^T for which the rows of R count as perpendicular.
const MAX_OFF_DIAGONAL: f64 = 1e-12;

/// How far R^T R of a rotation may be off the identity: files round to three decimals.
pub(crate) const ROTATION_TOLERANCE: f64 = 1e-2;

/// Largest entry by which R^T R of a matrix is off the identity.
pub(crate) fn rotation_defect(matrix: &Matrix3<f64>) -> f64 {
    (matrix.transpose() * matrix - Matrix3::identity()).amax()
}

/// The matrix of a pose's rotation, and its translation (m).
pub(crate) fn rotation_and_translation(T: &Pose3) -> (Matrix3<f64>, Vector3<f64>) {
    (T.rotation.to_rotation_matrix().into_inner(), T.translation.vector)
}

/// The rotation nearest to a matrix of positive determinant in the Frobenius norm, U V^T of its singular value
/// decomposition U S V^T, by the quadratically convergent iteration X <- (X + X^-T) / 2 (Higham, "Computing the polar
/// decomposition - with applications", SIAM J. Sci. Stat. Comput. 7, 1986).
///
/// A matrix whose rows are perpendicular to 1e-12 and whose squared lengths differ from 1 by at most 1e-5 is not projected: its
/// quaternion is only normalised, as SciPy's `Rotation.from_matrix` does, so that the angles of rounded matrices agree with
/// SciPy's to the last digits. `None` when the determinant is not positive or an
/// entry is not finite.
pub(crate) fn nearest_rotation(matrix: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let determinant = matrix.determinant();
    if !(determinant > 0.0 && determinant.is_finite()) {
        return None;
    }
    let gramian = matrix * matrix.transpose();
    let perpendicular = gramian.m12.abs() <= MAX_OFF_DIAGONAL
        && gramian.m13.abs() <= MAX_OFF_DIAGONAL
        && gramian.m23.abs() <= MAX_OFF_DIAGONAL;
    let unit = gramian.diagonal().iter().all(|sq_length| (sq_length - 1.0).abs() <= 1e-5 + MAX_OFF_DIAGONAL);
    let rotation = if perpendicular && unit { *matrix } else { polar_factor(matrix)? };
    Some(quaternion_of(&rotation))
}

fn polar_factor(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let mut X = *matrix;
    for _ in 0..MAX_SWEEPS {
        let next = (X + X.try_inverse()?.transpose()) * 0.5;
        let step = (next - X).abs().max();
        X = next;
        if step <= 1e-15 {
            break;
        }
    }
    Some(X)
}

/// The quaternion of a rotation matrix, computed from the largest of its four components, which avoids cancellation
/// (Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1, 1978).
fn quaternion_of(R: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let trace = R.trace();
    let (w, x, y, z) = if trace >= R.m11.max(R.m22).max(R.m33) {
        (1.0 + trace, R.m32 - R.m23, R.m13 - R.m31, R.m21 - R.m12)
    } else if R.m11 >= R.m22.max(R.m33) {
        (R.m32 - R.m23, 1.0 - trace + 2.0 * R.m11, R.m21 + R.m12, R.m31 + R.m13)
    } else if R.m22 >= R.m33 {
        (R.m13 - R.m31, R.m21 + R.m12, 1.0 - trace + 2.0 * R.m22, R.m32 + R.m23)
    } else {
        (R.m21 - R.m12, R.m31 + R.m13, R.m32 + R.m23, 1.0 - trace + 2.0 * R.m33)
    };
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

/// Angle of [`twist_about`] (rad), in [-2 pi, 2 pi].
pub(crate) fn twist_angle(rotation: &UnitQuaternion<f64>, axis: &Unit<Vector3<f64>>) -> f64 {
    2.0 * rotation.imag().dot(axis).atan2(rotation.w)
}

/// The twist of a rotation's swing-twist decomposition: the rotation about `axis` that is nearest to it.
pub(crate) fn twist_about(rotation: &UnitQuaternion<f64>, axis: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(axis, twist_angle(rotation, axis))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_are_kept_and_rounded_ones_are_made_orthonormal() {
        for angle in [0.0, 1e-9, 0.3, 1.5, 3.0, std::f64::consts::PI] {
            for axis in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(1.0, -2.0, 0.5)] {
                let expected = UnitQuaternion::from_scaled_axis(axis.normalize() * angle);
                let matrix = expected.to_rotation_matrix().into_inner();
                let exact = nearest_rotation(&matrix).unwrap();
                assert!((exact.inverse() * expected).angle() < 1e-15, "{angle} about {axis}");
                assert!((exact.angle() - angle).abs() < 1e-15);

                let rounded = matrix.map(|value| (value * 1e4).round() / 1e4);
                let near = nearest_rotation(&rounded).unwrap();
                assert!((near.inverse() * expected).angle() < 2e-4);
                // It is the nearest: every rotation close to it is further from the matrix.
                let distance = |q: &UnitQuaternion<f64>| (q.to_rotation_matrix().into_inner() - rounded).norm();
                for turn in [Vector3::x(), Vector3::y(), Vector3::z()] {
                    for sign in [-1e-3, 1e-3] {
                        assert!(distance(&(near * UnitQuaternion::from_scaled_axis(turn * sign))) > distance(&near));
                    }
                }
            }
        }
    }

    #[test]
    fn the_twist_is_the_nearest_rotation_about_its_axis() {
        let axis = Unit::new_normalize(Vector3::new(0.2, 1.0, -0.4));
        let swing = UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis.cross(&Vector3::x())), 0.4);
        for angle in [-3.0, -0.7, 0.0, 1e-9, 2.5] {
            let rotation = swing * UnitQuaternion::from_axis_angle(&axis, angle);
            assert!((twist_angle(&rotation, &axis) - angle).abs() < 1e-12);
            let distance = |turn: f64| (UnitQuaternion::from_axis_angle(&axis, turn).inverse() * rotation).angle();
            assert!((distance(angle) - (twist_about(&rotation, &axis).inverse() * rotation).angle()).abs() < 1e-12);
            assert!(distance(angle) < distance(angle - 0.01) && distance(angle) < distance(angle + 0.01));
        }
    }

    #[test]
    fn matrices_without_a_nearest_rotation_are_refused() {
        assert_eq!(nearest_rotation(&Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0))), None);
        assert_eq!(nearest_rotation(&Matrix3::zeros()), None);
        assert_eq!(nearest_rotation(&Matrix3::repeat(f64::NAN)), None);
    }
}
