//! Conventions of camera and world axes, and the angles about them.
//!
//! All computations use camera axes x right, y down, z forward. A named convention differs from that by two rotations, one of
//! the camera's axes and one of the world's.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::ROUNDING;

/// Directions of the axes of the cameras and of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum BevAxes {
    /// Three.js and OpenGL: x right, y up, z back, for cameras and world; angles in the order XYZ.
    #[default]
    ThreeJs,
    /// OpenCV: x right, y down, z forward, for cameras and world.
    Opencv,
    /// Habitat: the axes of OpenGL; a sensor's `orientation` turns about the fixed axes x, y, z in turn, order ZYX here.
    Habitat,
    /// Robotics (ROS REP 103): x forward, y left, z up, for cameras and world; roll, pitch and yaw, order ZYX.
    Robotics,
    /// A robot's world (x forward, y left, z up) with OpenCV's camera axes, which ROS calls an optical frame.
    RosOptical,
}

/// Every convention.
pub const AXES: [BevAxes; 5] =
    [BevAxes::ThreeJs, BevAxes::Opencv, BevAxes::Habitat, BevAxes::Robotics, BevAxes::RosOptical];

impl BevAxes {
    /// Maps directions in camera axes x right, y down, z forward into this convention's camera axes.
    pub fn R_named_camera(self) -> Matrix3<f64> {
        match self {
            Self::ThreeJs | Self::Habitat => RIGHT_UP_BACK,
            Self::Opencv | Self::RosOptical => Matrix3::identity(),
            Self::Robotics => FORWARD_LEFT_UP,
        }
    }

    /// Maps directions in world axes x right, y down, z forward into this convention's world axes.
    pub fn R_named_world(self) -> Matrix3<f64> {
        match self {
            Self::ThreeJs | Self::Habitat => RIGHT_UP_BACK,
            Self::Opencv => Matrix3::identity(),
            Self::Robotics | Self::RosOptical => FORWARD_LEFT_UP,
        }
    }

    /// Up, in this convention's world.
    pub fn up(self) -> Vector3<f64> {
        self.R_named_world() * -Vector3::y()
    }

    /// The order of angles that this convention is used with.
    pub fn euler_order(self) -> EulerOrder {
        match self {
            Self::ThreeJs | Self::Opencv => EulerOrder::XYZ,
            Self::Habitat | Self::Robotics | Self::RosOptical => EulerOrder::ZYX,
        }
    }
}

// Columns: right, down, forward in the axes of the convention.
const RIGHT_UP_BACK: Matrix3<f64> = Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0);
const FORWARD_LEFT_UP: Matrix3<f64> = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);

/// The order of three rotations, named as in Three.js: `XYZ` is `R = Rx Ry Rz`, rotations about the moved axes (intrinsic). For
/// rotations about fixed axes (extrinsic) it is read from the right: `ZYX` is x, then y, then z, which is roll, pitch, yaw.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum EulerOrder {
    /// `R = Rx Ry Rz`
    #[default]
    XYZ,
    /// `R = Ry Rz Rx`
    YZX,
    /// `R = Rz Rx Ry`
    ZXY,
    /// `R = Rx Rz Ry`
    XZY,
    /// `R = Ry Rx Rz`
    YXZ,
    /// `R = Rz Ry Rx`
    ZYX,
}

/// Every order.
pub const EULER_ORDERS: [EulerOrder; 6] =
    [EulerOrder::XYZ, EulerOrder::YZX, EulerOrder::ZXY, EulerOrder::XZY, EulerOrder::YXZ, EulerOrder::ZYX];

impl EulerOrder {
    /// Indices of the axes of the first, the second and the third turn.
    fn axes(self) -> [usize; 3] {
        match self {
            Self::XYZ => [0, 1, 2],
            Self::YZX => [1, 2, 0],
            Self::ZXY => [2, 0, 1],
            Self::XZY => [0, 2, 1],
            Self::YXZ => [1, 0, 2],
            Self::ZYX => [2, 1, 0],
        }
    }

    /// The rotation by these angles about x, y and z (rad).
    pub fn rotation(self, angles: [f64; 3]) -> Matrix3<f64> {
        self.axes().into_iter().fold(Matrix3::identity(), |R, axis| R * about(axis, angles[axis]))
    }

    /// The angles about x, y and z (rad) of a rotation, the middle one in [-pi/2, pi/2]. Where that is a quarter turn,
    /// the last one is zero.
    ///
    /// With the axes i, j, k of the turns by a, b, c, and e = 1 where they follow each other as x, y, z do, -1 otherwise,
    /// multiplying the three matrices gives `R_ik = e sin b`, `R_ii = cos b cos c`, `R_ij = -e cos b sin c`,
    /// `R_jk = -e sin a cos b` and `R_kk = cos a cos b`.
    pub fn angles(self, R: &Matrix3<f64>) -> [f64; 3] {
        let [i, j, k] = self.axes();
        let e = if (i + 1) % 3 == j { 1.0 } else { -1.0 };
        let cos_b = R[(i, i)].hypot(R[(i, j)]);
        let mut angles = [0.0; 3];
        angles[j] = (e * R[(i, k)]).atan2(cos_b);
        // Otherwise the first and the last rotation are about one axis, and only their sum is known.
        if cos_b > ROUNDING {
            angles[i] = (-e * R[(j, k)]).atan2(R[(k, k)]);
            angles[k] = (-e * R[(i, j)]).atan2(R[(i, i)]);
        } else {
            angles[i] = (e * R[(k, j)]).atan2(R[(j, j)]);
        }
        angles
    }
}

/// The rotation about an axis: a turn by a positive angle carries the axis after it towards the one after that.
fn about(axis: usize, angle: f64) -> Matrix3<f64> {
    let (sin, cos) = angle.sin_cos();
    let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut R = Matrix3::identity();
    R[(j, j)] = cos;
    R[(k, k)] = cos;
    R[(j, k)] = -sin;
    R[(k, j)] = sin;
    R
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn conventions_are_rotations_whose_names_are_true() {
        let (right, down, forward) = (Vector3::x(), Vector3::y(), Vector3::z());
        for axes in AXES {
            for R in [axes.R_named_camera(), axes.R_named_world()] {
                assert_eq!(R.determinant(), 1.0, "{axes:?}");
                assert_eq!(R * R.transpose(), Matrix3::identity());
            }
        }
        let three = BevAxes::ThreeJs.R_named_camera();
        assert_eq!([three * right, three * -down, three * -forward], [Vector3::x(), Vector3::y(), Vector3::z()]);
        assert_eq!(BevAxes::Habitat.R_named_camera(), three);
        let robot = BevAxes::Robotics.R_named_world();
        assert_eq!([robot * forward, robot * -right, robot * -down], [Vector3::x(), Vector3::y(), Vector3::z()]);
        assert_eq!(BevAxes::RosOptical.R_named_camera(), Matrix3::identity());
        assert_eq!(AXES.map(BevAxes::up), [Vector3::y(), -Vector3::y(), Vector3::y(), Vector3::z(), Vector3::z()]);
    }

    #[test]
    fn rotations_by_90_degrees_are_right_handed() {
        let turn = |axis| about(axis, FRAC_PI_2);
        assert!((turn(0) * Vector3::y() - Vector3::z()).norm() < 1e-15);
        assert!((turn(1) * Vector3::z() - Vector3::x()).norm() < 1e-15);
        assert!((turn(2) * Vector3::x() - Vector3::y()).norm() < 1e-15);
    }

    #[test]
    fn angles_come_back_in_every_order() {
        for order in EULER_ORDERS {
            for [x, y, z] in [[0.3, -0.7, 1.1], [-1.2, 0.4, -0.1], [0.0, 0.0, 0.0], [1.5, -1.5, 1.4]] {
                let back = order.angles(&order.rotation([x, y, z]));
                for (found, given) in back.into_iter().zip([x, y, z]) {
                    assert!((found - given).abs() < 1e-13, "{order:?}: {back:?} in place of {:?}", [x, y, z]);
                }
            }
            // At gimbal lock other angles come back, of the same rotation.
            let [i, j, k] = order.axes();
            for sign in [-1.0, 1.0] {
                let mut angles = [0.0; 3];
                (angles[i], angles[j], angles[k]) = (0.4, sign * FRAC_PI_2, -0.3);
                let R = order.rotation(angles);
                let back = order.angles(&R);
                assert_eq!(back[k], 0.0);
                assert!((order.rotation(back) - R).norm() < 1e-14, "{order:?}");
            }
        }
    }

    #[test]
    fn orders_are_named_from_the_left() {
        let [a, b, c] = [0.3, -0.7, 1.1];
        assert_eq!(EulerOrder::XYZ.rotation([a, b, c]), about(0, a) * about(1, b) * about(2, c));
        assert_eq!(EulerOrder::ZYX.rotation([a, b, c]), about(2, c) * about(1, b) * about(0, a));
        assert_eq!(EulerOrder::YXZ.rotation([a, b, c]), about(1, b) * about(0, a) * about(2, c));
    }
}
