//! Rigid motions of the plane and of space, SE(2) and SE(3).
//!
//! A pose is a nalgebra isometry in double precision. The trait [`RigidMotion`] adds the exponential map, its inverse and the
//! adjoint, under the same names in both dimensions. Equation numbers refer to Sola, Deray and Atchuthan, "A micro Lie
//! theory for state estimation in robotics", arXiv 1812.01537v9.
//!
//! Tangent vectors hold the rotation first: (theta, x, y) in the plane and (wx, wy, wz, x, y, z) in space.

use std::fmt::Debug;
use std::ops::Mul;

use nalgebra::{
    Isometry2, Isometry3, Matrix2, Matrix2x3, Matrix3, Matrix3x6, Matrix6, Translation2, Translation3, UnitComplex,
    UnitQuaternion, Vector2, Vector3, Vector6,
};

use super::algebra::{Jacobian, SquareMatrix, Vector};
use super::jacobi::MAX_SWEEPS;

/// A pose in the plane: `T_world_sensor` maps sensor points into the world (m, rad).
pub type Pose2 = Isometry2<f64>;
/// A pose in space: `T_world_sensor` maps sensor points into the world (m, rad).
pub type Pose3 = Isometry3<f64>;

/// A group of rigid motions: [`Pose2`] in the plane, [`Pose3`] in space. Code for both is generic over this trait.
pub trait RigidMotion: Copy + Debug + PartialEq + Mul<Output = Self> + 'static {
    /// Points and directions (m).
    type Point: Vector;
    /// Rotation matrices and covariances of points.
    type PointMatrix: SquareMatrix<Vector = Self::Point>;
    /// Tangent vectors, rotation first (rad, m).
    type Tangent: Vector;
    /// Adjoints, covariances and information matrices of motions, with rows and columns as in the tangent vector.
    type Matrix: SquareMatrix<Vector = Self::Tangent>;
    /// Derivatives of points with respect to tangent vectors.
    type Jacobian: Jacobian<Point = Self::Point, Tangent = Self::Tangent, Matrix = Self::Matrix>;

    /// The motion without rotation and translation.
    fn identity() -> Self;
    /// The inverse motion.
    #[must_use]
    fn inverse(&self) -> Self;
    /// The exponential map, from a tangent vector (rotation first) to a motion.
    fn exp(tangent: &Self::Tangent) -> Self;
    /// The inverse of [`exp`](Self::exp), rotation angle in [-pi, pi].
    fn log(&self) -> Self::Tangent;
    /// `Ad_T`, with `T * exp(tau) == exp(Ad_T * tau) * T` (eq. 31).
    fn adjoint(&self) -> Self::Matrix;
    /// The motion applied to a point.
    fn act(&self, point: &Self::Point) -> Self::Point;
    /// The rotation applied to a direction.
    fn rotate(&self, direction: &Self::Point) -> Self::Point;
    /// The matrix of the rotation: for many points it takes half as long.
    fn rotation_matrix(&self) -> Self::PointMatrix;
    /// The translation (m).
    fn translation(&self) -> Self::Point;
    /// Derivative of `exp(tau) * point` with respect to `tau` at `tau = 0`.
    fn point_jacobian(point: &Self::Point) -> Self::Jacobian;
    /// Derivative of `direction . (exp(tau) * point)` with respect to `tau` at `tau = 0`.
    fn gradient_along(point: &Self::Point, direction: &Self::Point) -> Self::Tangent;
    /// The motion with this rotation matrix, which must be orthonormal with determinant 1, and this translation.
    fn from_parts(rotation: &Self::PointMatrix, translation: &Self::Point) -> Self;
    /// The rotation R with the largest trace(R^T * covariance): Umeyama, "Least-squares estimation of transformation
    /// parameters between two point patterns", PAMI 13 (1991), eqs. 39-40, where S turns a reflection into the nearest
    /// rotation. `None` when an entry is not finite.
    fn best_rotation(covariance: &Self::PointMatrix) -> Option<Self::PointMatrix>;
    /// Angle of the rotation, in [0, pi] (rad).
    fn rotation_angle(&self) -> f64;
    /// Length of the translation (m).
    fn translation_norm(&self) -> f64;
    /// The same motion with its complex number or quaternion scaled to unit length. In a chain of products of poses the
    /// rounding error of that length would otherwise double with each product.
    #[must_use]
    fn renormalized(&self) -> Self;
}

/// What reads the same in the plane and in space: nalgebra names no type for both.
macro_rules! same_in_both_dimensions {
    ($dimension:literal, $Point:ident) => {
        fn identity() -> Self {
            Self::identity()
        }

        fn inverse(&self) -> Self {
            self.inverse()
        }

        fn act(&self, point: &$Point<f64>) -> $Point<f64> {
            self.rotation * point + self.translation.vector
        }

        fn rotate(&self, direction: &$Point<f64>) -> $Point<f64> {
            self.rotation * direction
        }

        fn rotation_matrix(&self) -> Self::PointMatrix {
            self.rotation.to_rotation_matrix().into_inner()
        }

        fn translation(&self) -> $Point<f64> {
            self.translation.vector
        }

        fn best_rotation(covariance: &Self::PointMatrix) -> Option<Self::PointMatrix> {
            if !covariance.iter().all(|value| value.is_finite()) {
                return None;
            }
            let svd = covariance.try_svd(true, true, f64::EPSILON, MAX_SWEEPS)?;
            let (U, V_transposed) = (svd.u?, svd.v_t?);
            let mut S = Self::PointMatrix::identity();
            if U.determinant() * V_transposed.determinant() < 0.0 {
                // Singular values come sorted: the last is the smallest.
                S[($dimension - 1, $dimension - 1)] = -1.0;
            }
            Some(U * S * V_transposed)
        }

        fn translation_norm(&self) -> f64 {
            self.translation.vector.norm()
        }

        fn renormalized(&self) -> Self {
            let mut pose = *self;
            pose.rotation.renormalize();
            pose
        }
    };
}

impl RigidMotion for Pose2 {
    type Point = Vector2<f64>;
    type PointMatrix = Matrix2<f64>;
    type Tangent = Vector3<f64>;
    type Matrix = Matrix3<f64>;
    type Jacobian = Matrix2x3<f64>;

    same_in_both_dimensions!(2, Vector2);

    /// Eqs. 156 and 158.
    fn exp(tangent: &Vector3<f64>) -> Self {
        let theta = tangent.x;
        let sin_over = if theta.abs() < SMALL_ANGLE { 1.0 - theta * theta / 6.0 } else { theta.sin() / theta };
        let one_minus_cos_over = one_minus_cos_over_square(theta) * theta;
        let V = Matrix2::new(sin_over, -one_minus_cos_over, one_minus_cos_over, sin_over);
        let translation = V * Vector2::new(tangent.y, tangent.z);
        Isometry2::from_parts(Translation2::from(translation), UnitComplex::new(theta))
    }

    /// Eq. 157, with the inverse of V (eq. 158) in closed form: theta/2 * cot(theta/2) on its diagonal.
    fn log(&self) -> Vector3<f64> {
        let theta = self.rotation.angle();
        let half = theta / 2.0;
        let diagonal = if theta.abs() < SMALL_ANGLE { 1.0 - theta * theta / 12.0 } else { half / half.tan() };
        let V_inverse = Matrix2::new(diagonal, half, -half, diagonal);
        let rho = V_inverse * self.translation.vector;
        Vector3::new(theta, rho.x, rho.y)
    }

    /// Eq. 159, rotation first.
    fn adjoint(&self) -> Matrix3<f64> {
        let R = self.rotation.to_rotation_matrix();
        let t = self.translation.vector;
        Matrix3::new(1.0, 0.0, 0.0, t.y, R[(0, 0)], R[(0, 1)], -t.x, R[(1, 0)], R[(1, 1)])
    }

    fn point_jacobian(point: &Vector2<f64>) -> Matrix2x3<f64> {
        Matrix2x3::new(-point.y, 1.0, 0.0, point.x, 0.0, 1.0)
    }

    fn gradient_along(point: &Vector2<f64>, direction: &Vector2<f64>) -> Vector3<f64> {
        Vector3::new(point.perp(direction), direction.x, direction.y)
    }

    fn from_parts(rotation: &Matrix2<f64>, translation: &Vector2<f64>) -> Self {
        let angle = rotation[(1, 0)].atan2(rotation[(0, 0)]);
        Isometry2::from_parts(Translation2::from(*translation), UnitComplex::new(angle))
    }

    fn rotation_angle(&self) -> f64 {
        self.rotation.angle().abs()
    }
}

impl RigidMotion for Pose3 {
    type Point = Vector3<f64>;
    type PointMatrix = Matrix3<f64>;
    type Tangent = Vector6<f64>;
    type Matrix = Matrix6<f64>;
    type Jacobian = Matrix3x6<f64>;

    same_in_both_dimensions!(3, Vector3);

    /// Eqs. 172 and 174.
    fn exp(tangent: &Vector6<f64>) -> Self {
        let omega: Vector3<f64> = tangent.fixed_rows::<3>(0).into();
        let rho: Vector3<f64> = tangent.fixed_rows::<3>(3).into();
        let theta = omega.norm();
        let a = one_minus_cos_over_square(theta);
        let b =
            if theta < SMALL_ANGLE { 1.0 / 6.0 - theta * theta / 120.0 } else { (theta - theta.sin()) / theta.powi(3) };
        let W = omega.cross_matrix();
        let V = Matrix3::identity() + W * a + W * W * b;
        Isometry3::from_parts(Translation3::from(V * rho), UnitQuaternion::from_scaled_axis(omega))
    }

    /// Eq. 173; the inverse of V is the inverse left Jacobian of SO(3), eq. 146
    /// (here with the half angle, which stays finite up to pi).
    fn log(&self) -> Vector6<f64> {
        let omega = self.rotation.scaled_axis();
        let theta = omega.norm();
        let c = if theta < SMALL_ANGLE {
            1.0 / 12.0 + theta * theta / 720.0
        } else {
            1.0 / (theta * theta) - 1.0 / (2.0 * theta * (theta / 2.0).tan())
        };
        let W = omega.cross_matrix();
        let V_inverse = Matrix3::identity() - W * 0.5 + W * W * c;
        let rho = V_inverse * self.translation.vector;
        Vector6::new(omega.x, omega.y, omega.z, rho.x, rho.y, rho.z)
    }

    /// Eq. 175, rotation first.
    fn adjoint(&self) -> Matrix6<f64> {
        let R = self.rotation.to_rotation_matrix().into_inner();
        let mut adjoint = Matrix6::zeros();
        adjoint.fixed_view_mut::<3, 3>(0, 0).copy_from(&R);
        adjoint.fixed_view_mut::<3, 3>(3, 3).copy_from(&R);
        adjoint.fixed_view_mut::<3, 3>(3, 0).copy_from(&(self.translation.vector.cross_matrix() * R));
        adjoint
    }

    fn point_jacobian(point: &Vector3<f64>) -> Matrix3x6<f64> {
        let mut jacobian = Matrix3x6::zeros();
        jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&-point.cross_matrix());
        jacobian.fixed_view_mut::<3, 3>(0, 3).fill_with_identity();
        jacobian
    }

    fn gradient_along(point: &Vector3<f64>, direction: &Vector3<f64>) -> Vector6<f64> {
        let turned = point.cross(direction);
        Vector6::new(turned.x, turned.y, turned.z, direction.x, direction.y, direction.z)
    }

    fn from_parts(rotation: &Matrix3<f64>, translation: &Vector3<f64>) -> Self {
        let rotation = nalgebra::Rotation3::from_matrix_unchecked(*rotation);
        Isometry3::from_parts(Translation3::from(*translation), UnitQuaternion::from_rotation_matrix(&rotation))
    }

    fn rotation_angle(&self) -> f64 {
        self.rotation.angle()
    }
}

/// A motion as one of space, where the plane is z = 0.
pub trait Embedding: RigidMotion {
    /// The same motion in space.
    fn in_space(&self) -> Pose3;
    /// The part of a motion in space that this type can hold: in the plane x, y and the rotation about z.
    fn from_space(pose: &Pose3) -> Self;
}

impl Embedding for Pose2 {
    fn in_space(&self) -> Pose3 {
        let t = self.translation.vector;
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.rotation.angle());
        Pose3::from_parts(Translation3::new(t.x, t.y, 0.0), rotation)
    }

    fn from_space(pose: &Pose3) -> Self {
        let rotation = pose.rotation.to_rotation_matrix().matrix().fixed_view::<2, 2>(0, 0).into_owned();
        <Self as RigidMotion>::from_parts(&rotation, &pose.translation.vector.xy())
    }
}

impl Embedding for Pose3 {
    fn in_space(&self) -> Pose3 {
        *self
    }

    fn from_space(pose: &Pose3) -> Self {
        *pose
    }
}

/// Angle (rad) below which the Taylor series of sin(x) / x and its like are more accurate than the quotients.
const SMALL_ANGLE: f64 = 1e-4;

/// (1 - cos theta) / theta^2, computed from the half angle: 1 - cos theta cancels where theta is small.
fn one_minus_cos_over_square(theta: f64) -> f64 {
    if theta.abs() < SMALL_ANGLE {
        return 0.5 - theta * theta / 24.0;
    }
    let quotient = (theta / 2.0).sin() / theta;
    2.0 * quotient * quotient
}

#[cfg(test)]
mod tests {
    use nalgebra::{SMatrix, SVector};

    use super::*;

    /// Tangents over all quadrants, tiny angles and zero among them.
    fn tangents<const DOF: usize>() -> impl Iterator<Item = SVector<f64, DOF>> {
        [0.0, 1e-9, 9e-5, 1.1e-4, 0.3, 1.7].into_iter().flat_map(|scale| {
            (0..8).map(move |seed| SVector::from_fn(|row, _| scale * ((seed * 7 + row * 3 + 1) as f64).sin()))
        })
    }

    fn check<const D: usize, const DOF: usize, M>()
    where
        M: RigidMotion<Point = SVector<f64, D>, Tangent = SVector<f64, DOF>, Jacobian = SMatrix<f64, D, DOF>>,
    {
        let point = SVector::<f64, D>::from_fn(|row, _| 0.7 - 1.3 * row as f64);
        for tau in tangents::<DOF>() {
            let T = M::exp(&tau);
            assert!((T.log() - tau).norm() < 1e-12, "log of exp of {tau}");
            assert!(((T * T.inverse()).act(&point) - point).norm() < 1e-14);
            for delta in tangents::<DOF>() {
                let left = (T * M::exp(&delta)).act(&point);
                let right = (M::exp(&T.adjoint().apply(&delta)) * T).act(&point);
                assert!((left - right).norm() < 1e-11, "adjoint at {tau}");
            }
        }
        let h = 1e-6;
        let jacobian = M::point_jacobian(&point);
        for column in 0..DOF {
            let step = SVector::<f64, DOF>::from_fn(|row, _| if row == column { h } else { 0.0 });
            let numeric = (M::exp(&step).act(&point) - M::exp(&-step).act(&point)) / (2.0 * h);
            assert!((jacobian.column(column) - numeric).norm() < 1e-9, "column {column}");
        }
    }

    #[test]
    fn exp_log_adjoint_and_jacobian_in_the_plane() {
        check::<2, 3, Pose2>();
    }

    #[test]
    fn exp_log_adjoint_and_jacobian_in_space() {
        check::<3, 6, Pose3>();
    }

    #[test]
    fn small_rotations_keep_all_digits() {
        for theta in [1e-6f64, 0.9e-4, 1.1e-4, 1e-3, 1e-2] {
            // Both parts of a motion along an arc, as series.
            let aside = theta / 2.0 - theta.powi(3) / 24.0 + theta.powi(5) / 720.0;
            let ahead = 1.0 - theta.powi(2) / 6.0 + theta.powi(4) / 120.0;
            let flat = Pose2::exp(&Vector3::new(theta, 1.0, 0.0)).translation.vector;
            assert!((flat - Vector2::new(ahead, aside)).norm() < 1e-15, "{theta}: {flat}");
            let spatial = Pose3::exp(&Vector6::new(0.0, 0.0, theta, 1.0, 0.0, 0.0)).translation.vector;
            assert!((spatial - Vector3::new(ahead, aside, 0.0)).norm() < 1e-15, "{theta}: {spatial}");
        }
    }

    #[test]
    fn best_rotation_is_a_rotation_even_where_a_reflection_fits_better() {
        let R = Pose3::exp(&Vector6::new(0.4, -0.9, 0.3, 0.0, 0.0, 0.0)).rotation.to_rotation_matrix().into_inner();
        let spread = Matrix3::from_diagonal(&Vector3::new(3.0, 2.0, 0.5));
        assert!((Pose3::best_rotation(&(R * spread)).unwrap() - R).norm() < 1e-12);
        let mirrored = R * Matrix3::from_diagonal(&Vector3::new(3.0, 2.0, -0.5));
        assert!((Pose3::best_rotation(&mirrored).unwrap() - R).norm() < 1e-12);

        let R = Matrix2::new(0.8, -0.6, 0.6, 0.8);
        assert!((Pose2::best_rotation(&(R * Matrix2::new(2.0, 0.0, 0.0, -0.5))).unwrap() - R).norm() < 1e-12);
        assert!(Pose2::best_rotation(&Matrix2::repeat(f64::NAN)).is_none());
    }

    #[test]
    fn from_parts_keeps_rotation_and_translation() {
        let T = Pose2::exp(&Vector3::new(2.5, 1.0, -3.0));
        let again = <Pose2 as RigidMotion>::from_parts(T.rotation.to_rotation_matrix().matrix(), &T.translation.vector);
        assert!((T.inverse() * again).log().norm() < 1e-14);
        let T = Pose3::exp(&Vector6::new(1.0, -0.5, 0.2, 4.0, 5.0, 6.0));
        let again = <Pose3 as RigidMotion>::from_parts(T.rotation.to_rotation_matrix().matrix(), &T.translation.vector);
        assert!((T.inverse() * again).log().norm() < 1e-12);
    }
}
