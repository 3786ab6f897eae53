//! Scenes by chance, the same ones every time.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use scanstitch::camera::bev::axes::{AXES, EULER_ORDERS};
use scanstitch::camera::bev::{BevAxes, BevCamera, BevIntrinsics, BevPlane, BevPose, BevScene, BevSide};

/// Uniform numbers: a multiply-with-carry generator, enough for choosing cases.
pub struct Chance(pub u64);

impl Chance {
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[(self.unit() * all.len() as f64) as usize]
    }

    /// A camera about 1 to 3 m above the ground that may look anywhere, in our own world: x right, y down, z forward.
    pub fn camera(&mut self, axes: BevAxes) -> BevCamera {
        let (width, height) = (self.within(100.0, 2000.0) as usize, self.within(100.0, 2000.0) as usize);
        let intrinsics = if self.unit() < 0.5 {
            let side = self.one_of(&[BevSide::Horizontal, BevSide::Vertical]);
            BevIntrinsics::FieldOfView { field_of_view: self.within(0.4, 2.4), side }
        } else {
            let [fx, fy] = [(); 2].map(|()| self.within(150.0, 1500.0));
            let [cx, cy] = [width, height].map(|size| size as f64 * self.within(0.3, 0.7));
            BevIntrinsics::Focal { fx, fy, cx, cy }
        };
        let W = axes.R_named_world();
        let place = Vector3::new(self.within(-2.0, 2.0), -self.within(0.7, 3.0), self.within(-2.0, 2.0));
        let position: [f64; 3] = (W * place).into();
        // Mostly looking somewhere down, at times upwards or on its side.
        let order = self.one_of(&EULER_ORDERS);
        let ours = yaw_pitch_roll([self.within(-PI, PI), -self.within(-0.2, 1.6), self.within(-0.6, 0.6)]);
        let named = W * ours * axes.R_named_camera().transpose();
        let pose = match (self.unit() * 3.0) as usize {
            0 => BevPose::Euler { position, order, angles: order.angles(&named) },
            1 => {
                let q = nalgebra::UnitQuaternion::from_matrix(&named);
                let scale = self.within(0.5, 2.0); // of no consequence
                BevPose::Quaternion { position, qx: q.i * scale, qy: q.j * scale, qz: q.k * scale, qw: q.w * scale }
            }
            _ => {
                let row = |i: usize| [named[(i, 0)], named[(i, 1)], named[(i, 2)], position[i]];
                BevPose::Matrix { T_world_camera: [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]] }
            }
        };
        BevCamera { image: None, width, height, intrinsics, pose }
    }

    pub fn scene(&mut self) -> BevScene {
        let axes = self.one_of(&AXES);
        let plane = if self.unit() < 0.5 {
            BevPlane::Level { height: self.within(-0.3, 0.3) }
        } else {
            let tilt = Vector3::from_fn(|_, _| self.within(-0.2, 0.2));
            let normal = (axes.up() + tilt) * self.one_of(&[1.0, 2.5, -1.0]);
            BevPlane::Tilted { normal: normal.into(), offset: self.within(-0.1, 0.1) }
        };
        BevScene { axes, plane, top: self.camera(axes), front: self.camera(axes) }
    }

    pub fn pixel(&mut self, camera: &BevCamera) -> [f64; 2] {
        [camera.width, camera.height].map(|size| self.within(-0.5, size as f64 - 0.5))
    }
}

/// Yaw about down, pitch about right, roll about forward.
pub fn yaw_pitch_roll([yaw, pitch, roll]: [f64; 3]) -> Matrix3<f64> {
    turn(1, yaw) * turn(0, pitch) * turn(2, roll)
}

/// A rotation about an axis, written out.
pub fn turn(axis: usize, angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    match axis {
        0 => Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c),
        1 => Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c),
        _ => Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
    }
}
