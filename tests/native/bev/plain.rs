//! The plain evaluation that the engine is compared with.

use nalgebra::{Matrix3, Matrix3x4, Matrix4, Vector3, Vector4};
use scanstitch::camera::bev::{BevAxes, BevCamera, BevIntrinsics, BevPlane, BevPose, BevScene, BevSide};

use super::chance::turn;

/// The plain evaluation: 4 x 4 matrices put together and inverted in full, sharing no line with the engine.
pub struct Plain {
    /// 3 x 4: world to pixels, up to scale; the scale is the depth.
    pub P_top: Matrix3x4<f64>,
    pub P_front: Matrix3x4<f64>,
    pub plane: Vector4<f64>,
}

impl Plain {
    pub fn of(scene: &BevScene) -> Self {
        let plane = match scene.plane {
            BevPlane::Level { height } => match scene.axes {
                BevAxes::ThreeJs | BevAxes::Habitat => Vector4::new(0.0, 1.0, 0.0, -height),
                BevAxes::Opencv => Vector4::new(0.0, -1.0, 0.0, -height),
                BevAxes::Robotics | BevAxes::RosOptical => Vector4::new(0.0, 0.0, 1.0, -height),
            },
            BevPlane::Tilted { normal: [a, b, c], offset } => Vector4::new(a, b, c, -offset),
        };
        Self {
            P_top: Self::projection(scene.axes, &scene.top),
            P_front: Self::projection(scene.axes, &scene.front),
            plane,
        }
    }

    pub fn projection(axes: BevAxes, camera: &BevCamera) -> Matrix3x4<f64> {
        let (width, height) = (camera.width as f64, camera.height as f64);
        let [fx, fy, cx, cy] = match camera.intrinsics {
            BevIntrinsics::Focal { fx, fy, cx, cy } => [fx, fy, cx, cy],
            BevIntrinsics::FieldOfView { field_of_view, side } => {
                let size = if side == BevSide::Horizontal { width } else { height };
                let f = size / (2.0 * (field_of_view / 2.0).tan());
                [f, f, width / 2.0, height / 2.0]
            }
        };
        let T = match camera.pose {
            BevPose::Matrix { T_world_camera: rows } => Matrix4::from_fn(|i, j| rows[i][j]),
            BevPose::Quaternion { position: p, qx, qy, qz, qw } => {
                let n = (qx * qx + qy * qy + qz * qz + qw * qw).sqrt();
                let (x, y, z, w) = (qx / n, qy / n, qz / n, qw / n);
                #[rustfmt::skip]
                let T = Matrix4::new(
                    1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w), p[0],
                    2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w), p[1],
                    2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y), p[2],
                    0.0, 0.0, 0.0, 1.0,
                );
                T
            }
            BevPose::Euler { position, order, angles: [x, y, z] } => {
                let [x, y, z] = [turn(0, x), turn(1, y), turn(2, z)];
                let R = match format!("{order:?}").as_str() {
                    "XYZ" => x * y * z,
                    "YZX" => y * z * x,
                    "ZXY" => z * x * y,
                    "XZY" => x * z * y,
                    "YXZ" => y * x * z,
                    _ => z * y * x,
                };
                Matrix4::new_translation(&position.into()) * R.to_homogeneous()
            }
        };
        // Rows: right, down and forward in the camera's named axes.
        #[rustfmt::skip]
        let axes = match axes {
            BevAxes::ThreeJs | BevAxes::Habitat => Matrix4::new(1.,0.,0.,0., 0.,-1.,0.,0., 0.,0.,-1.,0., 0.,0.,0.,1.),
            BevAxes::Opencv | BevAxes::RosOptical => Matrix4::identity(),
            BevAxes::Robotics => Matrix4::new(0.,-1.,0.,0., 0.,0.,-1.,0., 1.,0.,0.,0., 0.,0.,0.,1.),
        };
        let K = Matrix3x4::new(fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0);
        K * axes * T.try_inverse().unwrap()
    }

    /// The point of the plane that a pixel sees: three linear equations, solved in full. Pixel, depth and point.
    pub fn follow(from: &Matrix3x4<f64>, to: &Matrix3x4<f64>, plane: &Vector4<f64>, [u, v]: [f64; 2]) -> Seen {
        let rows = [from.row(0) - from.row(2) * u, from.row(1) - from.row(2) * v, plane.transpose()];
        let A = Matrix3::from_fn(|i, j| rows[i][j]);
        let b = Vector3::from_fn(|i, _| -rows[i][3]);
        let X = A.try_inverse().expect("a plane that is not seen edge on") * b;
        let X = X + A.try_inverse().unwrap() * (b - A * X); // one step of iterative refinement
        let (near, far) = (from * X.push(1.0), to * X.push(1.0));
        Seen { depth: near.z, ground: X, depth_there: far.z, pixel: [far.x / far.z, far.y / far.z] }
    }

    pub fn front(&self, pixel: [f64; 2]) -> Seen {
        Self::follow(&self.P_top, &self.P_front, &self.plane, pixel)
    }

    pub fn top(&self, pixel: [f64; 2]) -> Seen {
        Self::follow(&self.P_front, &self.P_top, &self.plane, pixel)
    }
}

pub struct Seen {
    pub depth: f64,
    pub ground: Vector3<f64>,
    pub depth_there: f64,
    pub pixel: [f64; 2],
}

pub fn distance([a, b]: [f64; 2], [c, d]: [f64; 2]) -> f64 {
    (a - c).hypot(b - d)
}

pub const NUM_CASES: usize = 1000;
