//! The pose and camera of a view, in single precision.

use glam::Vec4;
use nalgebra::Vector3;

use crate::camera::Pinhole;
use crate::geometry::Pose3;
use crate::geometry::algebra::single;

/// Smallest depth of a visible point (m): a nearer surfel would cover the whole view.
pub(super) const MIN_DEPTH: f32 = 0.05;
/// Points that are transformed and projected together.
pub(super) const LANES: usize = 4;

/// The pose of a view and its camera, whose pixels are the cells.
#[derive(Clone, Copy)]
pub(super) struct ViewTransform {
    pub(super) camera: Pinhole,
    pub(super) T_view_world: Transform,
    /// fx, fy, and the principal point relative to the outer corner of the first cell (cells).
    intrinsics: [f32; 4],
}

impl ViewTransform {
    pub(super) fn new(camera: &Pinhole, T_world_view: &Pose3) -> Self {
        let Pinhole { fx, fy, cx, cy, .. } = *camera;
        let intrinsics = [fx, fy, cx + 0.5, cy + 0.5].map(|x| x as f32);
        Self { camera: *camera, T_view_world: Transform::new(&T_world_view.inverse()), intrinsics }
    }

    /// Column and row of the cell that a point in the view's frame projects to.
    #[inline]
    pub(super) fn cell(&self, seen: &[f32; 3]) -> Option<(usize, usize)> {
        let [u, v] = self.project(seen);
        self.inside(u, v, seen[2])
    }

    /// Its projection (cells).
    #[inline]
    pub(super) fn project(&self, [x, y, z]: &[f32; 3]) -> [f32; 2] {
        let [fx, fy, cx, cy] = self.intrinsics;
        let away = 1.0 / z;
        [fx * x * away + cx, fy * y * away + cy]
    }

    /// The same for [`LANES`] points.
    #[inline]
    pub(super) fn project_all(&self, [x, y, z]: &[Vec4; 3]) -> [[f32; LANES]; 2] {
        let [fx, fy, cx, cy] = self.intrinsics.map(Vec4::splat);
        let away = Vec4::ONE / *z;
        [(fx * *x * away + cx).to_array(), (fy * *y * away + cy).to_array()]
    }

    /// Column and row as integers, if they are in the image and the point is in front of the camera.
    #[inline]
    pub(super) fn inside(&self, u: f32, v: f32, z: f32) -> Option<(usize, usize)> {
        // Not a number fails all of these.
        if !(z >= MIN_DEPTH && u >= 0.0 && v >= 0.0) {
            return None;
        }
        let (column, row) = (u as usize, v as usize);
        (column < self.camera.width && row < self.camera.height).then_some((column, row))
    }
}

/// A pose in single precision, by the rows of its matrix.
#[derive(Clone, Copy)]
pub(super) struct Transform {
    pub(super) rows: [[f32; 3]; 3],
    shift: [f32; 3],
}

impl Transform {
    pub(super) fn new(T: &Pose3) -> Self {
        let R = T.rotation.to_rotation_matrix().into_inner();
        Self { rows: std::array::from_fn(|row| single(&R.row(row).transpose())), shift: single(&T.translation.vector) }
    }

    #[inline]
    pub(super) fn act(&self, p: &[f32; 3]) -> [f32; 3] {
        std::array::from_fn(|axis| dot(&self.rows[axis], p) + self.shift[axis])
    }

    /// Rotates a direction.
    #[inline]
    pub(super) fn turn(&self, n: &[f32; 3]) -> [f32; 3] {
        std::array::from_fn(|axis| dot(&self.rows[axis], n))
    }

    /// Transforms [`LANES`] points.
    #[inline]
    pub(super) fn act_on_all(&self, [x, y, z]: &[Vec4; 3]) -> [Vec4; 3] {
        let along = |axis: usize| {
            let ([a, b, c], shift) = (self.rows[axis], self.shift[axis]);
            *x * a + *y * b + *z * c + Vec4::splat(shift)
        };
        [along(0), along(1), along(2)]
    }
}

#[inline]
pub(super) fn dot(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(super) fn between(a: &[f32; 3], b: &[f32; 3]) -> [f32; 3] {
    [b[0] - a[0], b[1] - a[1], b[2] - a[2]]
}

#[inline]
pub(super) fn double([x, y, z]: [f32; 3]) -> Vector3<f64> {
    Vector3::new(x.into(), y.into(), z.into())
}
