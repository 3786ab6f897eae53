//! Rotation matrices that are not quite rotations, as files with few digits hold them.

use nalgebra::{Matrix3, Quaternion, Unit, UnitQuaternion, Vector3};

/// Largest deviation of R^T R from the identity, beyond the diagonal, of a matrix that is taken as orthogonal.
const ORTHOGONAL: f64 = 1e-12;
/// Newton's iteration squares the error with every step, so a matrix that is nearly a rotation needs three or four.
const MAX_ITERATIONS: usize = 50;

/// The rotation nearest to a matrix of positive determinant in the sense of Frobenius, U V^T of its singular value
/// decomposition U S V^T (Higham, "Computing the polar decomposition - with applications", SIAM J. Sci. Stat. Comput. 7,
/// 1986: X <- (X + X^-T) / 2 converges to it quadratically).
///
/// A matrix whose columns are perpendicular to 1e-12 is only scaled, which is what SciPy's `Rotation.from_matrix` does:
/// angles agree with it to the last digits also where the matrix was rounded. `None` when the determinant is not
/// positive or an entry not finite.
pub(crate) fn nearest_rotation(matrix: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let determinant = matrix.determinant();
    if !(determinant > 0.0 && determinant.is_finite()) {
        return None;
    }
    let gramian = matrix * matrix.transpose();
    let perpendicular =
        gramian.m12.abs() <= ORTHOGONAL && gramian.m13.abs() <= ORTHOGONAL && gramian.m23.abs() <= ORTHOGONAL;
    let unit = gramian.diagonal().iter().all(|length| (length - 1.0).abs() <= 1e-5 + ORTHOGONAL);
    let rotation = if perpendicular && unit { *matrix } else { polar_factor(matrix)? };
    Some(quaternion_of(&rotation))
}

fn polar_factor(matrix: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let mut X = *matrix;
    for _ in 0..MAX_ITERATIONS {
        let next = (X + X.try_inverse()?.transpose()) * 0.5;
        let step = (next - X).abs().max();
        X = next;
        if step <= 1e-15 {
            break;
        }
    }
    Some(X)
}

/// The quaternion of a rotation matrix, from the largest of its four components, which never cancels: Shepperd,
/// "Quaternion from rotation matrix", J. Guidance and Control 1 (1978).
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

/// Angle of a rotation in [0, pi] (rad), exact also where it is tiny or near pi: the cosine alone is neither.
pub fn angle_of(rotation: &UnitQuaternion<f64>) -> f64 {
    2.0 * rotation.imag().norm().atan2(rotation.w.abs())
}

/// Angle (rad) of a rotation's part about an axis, in [-2 pi, 2 pi]: the twist of its swing-twist decomposition.
pub(crate) fn turn_about(rotation: &UnitQuaternion<f64>, axis: &Unit<Vector3<f64>>) -> f64 {
    2.0 * rotation.imag().dot(axis).atan2(rotation.w)
}

/// The rotation's part about an axis: of all turns about it the nearest to the rotation.
pub(crate) fn twist_about(rotation: &UnitQuaternion<f64>, axis: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(axis, turn_about(rotation, axis))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_come_back_and_rounded_ones_are_made_whole() {
        for angle in [0.0, 1e-9, 0.3, 1.5, 3.0, std::f64::consts::PI] {
            for axis in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(1.0, -2.0, 0.5)] {
                let expected = UnitQuaternion::from_scaled_axis(axis.normalize() * angle);
                let matrix = expected.to_rotation_matrix().into_inner();
                let exact = nearest_rotation(&matrix).unwrap();
                assert!(angle_of(&(exact.inverse() * expected)) < 1e-15, "{angle} about {axis}");
                assert!((angle_of(&exact) - angle).abs() < 1e-15);

                let rounded = matrix.map(|value| (value * 1e4).round() / 1e4);
                let near = nearest_rotation(&rounded).unwrap();
                assert!(angle_of(&(near.inverse() * expected)) < 2e-4);
                // The nearest: any rotation a little off lies further from the matrix.
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
    fn the_twist_is_the_nearest_turn_about_its_axis() {
        let axis = Unit::new_normalize(Vector3::new(0.2, 1.0, -0.4));
        let swing = UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis.cross(&Vector3::x())), 0.4);
        for angle in [-3.0, -0.7, 0.0, 1e-9, 2.5] {
            let rotation = swing * UnitQuaternion::from_axis_angle(&axis, angle);
            assert!((turn_about(&rotation, &axis) - angle).abs() < 1e-12);
            let distance = |turn: f64| angle_of(&(UnitQuaternion::from_axis_angle(&axis, turn).inverse() * rotation));
            assert!((distance(angle) - angle_of(&(twist_about(&rotation, &axis).inverse() * rotation))).abs() < 1e-12);
            assert!(distance(angle) < distance(angle - 0.01) && distance(angle) < distance(angle + 0.01));
        }
    }

    #[test]
    fn what_is_no_rotation_is_told() {
        assert_eq!(nearest_rotation(&Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0))), None);
        assert_eq!(nearest_rotation(&Matrix3::zeros()), None);
        assert_eq!(nearest_rotation(&Matrix3::repeat(f64::NAN)), None);
    }
}
