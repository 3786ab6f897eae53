//! Mapping of a pixel by way of the plane to the other camera's pixel; equations of [`super`].

use nalgebra::{Matrix3, RowVector3, Vector2, Vector3};
use serde::Serialize;

use super::ROUNDING;
use super::clip::{HalfPlane, clip};
use super::points::{BevPoint, BevStatus};
use crate::camera::Pinhole;
use crate::geometry::Pose3;

/// A camera with a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PosedCamera {
    /// Its intrinsics.
    pub pinhole: Pinhole,
    /// Its pose; camera axes x right, y down, z forward.
    pub T_world_camera: Pose3,
}

impl PosedCamera {
    /// K: intrinsics as a matrix.
    pub fn K(&self) -> Matrix3<f64> {
        let Pinhole { fx, fy, cx, cy, .. } = self.pinhole;
        Matrix3::new(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0)
    }

    /// K^-1 in closed form.
    fn K_inverse(&self) -> Matrix3<f64> {
        let Pinhole { fx, fy, cx, cy, .. } = self.pinhole;
        Matrix3::new(1.0 / fx, 0.0, -cx / fx, 0.0, 1.0 / fy, -cy / fy, 0.0, 0.0, 1.0)
    }

    fn R(&self) -> Matrix3<f64> {
        self.T_world_camera.rotation.to_rotation_matrix().into_inner()
    }

    /// Direction that a pixel looks in, in the world, its length such that the depth grows by 1 m; eq. (3).
    pub fn ray(&self, [u, v]: [f64; 2]) -> Vector3<f64> {
        self.T_world_camera.rotation * self.pinhole.ray(u, v)
    }

    /// The pixel that a point of the world projects to, in the image or not; `None` behind the camera. Eqs. (5) and (6).
    pub fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        self.pinhole.project(&self.T_world_camera.inverse_transform_point(&(*point).into()).coords)
    }

    /// Left, top, right and bottom edge of the image (pixels): the middle of its first pixel is (0, 0).
    pub fn frame(&self) -> [f64; 4] {
        [-0.5, -0.5, self.pinhole.width as f64 - 0.5, self.pinhole.height as f64 - 0.5]
    }

    /// Whether the image has this pixel.
    pub fn sees(&self, u: f64, v: f64) -> bool {
        let [left, top, right, bottom] = self.frame();
        (left..=right).contains(&u) && (top..=bottom).contains(&v)
    }

    /// Angles between the rays through (0, cy) and (width, cy), and through (cx, 0) and (cx, height) (rad): eq. (1) where the
    /// optical axis is at (width / 2, height / 2).
    pub fn fields_of_view(&self) -> [f64; 2] {
        let Pinhole { width, height, fx, fy, cx, cy } = self.pinhole;
        let angle = |size: f64, f: f64, c: f64| ((size - c) / f).atan() + (c / f).atan();
        [angle(width as f64, fx, cx), angle(height as f64, fy, cy)]
    }
}

/// The points X with `normal . X = offset`, the normal of length 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vector3<f64>,
    /// m.
    pub offset: f64,
}

impl Plane {
    /// Signed distance of a camera from the plane, along its normal (m).
    pub fn height_of(&self, camera: &PosedCamera) -> f64 {
        self.normal.dot(&camera.T_world_camera.translation.vector) - self.offset
    }
}

/// Maps pixels of one camera to another by way of a plane. Made by [`super::BevScene`], which validates its parts.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneTransfer {
    /// The camera whose pixels are given.
    pub marked: PosedCamera,
    /// The camera that they are looked for in.
    pub projected: PosedCamera,
    /// The plane they lie on.
    pub plane: Plane,
    /// Inverse depth of a pixel (u, v, 1) of the first camera, eq. (7).
    a: RowVector3<f64>,
    /// Eq. (8).
    H: Matrix3<f64>,
}

impl PlaneTransfer {
    pub(super) fn new(marked: PosedCamera, projected: PosedCamera, plane: Plane) -> Self {
        let R_K_inverse = marked.R() * marked.K_inverse();
        let a = plane.normal.transpose() * R_K_inverse / -plane.height_of(&marked);
        let between = marked.T_world_camera.translation.vector - projected.T_world_camera.translation.vector;
        let H = projected.K() * projected.R().transpose() * (R_K_inverse + between * a);
        Self { marked, projected, plane, a, H }
    }

    /// The point of the plane that a pixel of the first camera sees (m, world); `None` where it sees none. Eqs. (3), (4).
    pub fn ground(&self, pixel: [f64; 2]) -> Option<Vector3<f64>> {
        let ray = self.marked.ray(pixel);
        let t = -self.plane.height_of(&self.marked) / self.plane.normal.dot(&ray);
        let point = self.marked.T_world_camera.translation.vector + ray * t;
        (t > 0.0 && point.iter().all(|value| value.is_finite())).then_some(point)
    }

    /// A pixel of the first camera, followed to the second. Eqs. (3) to (6).
    pub fn point(&self, marked: [f64; 2]) -> BevPoint {
        let Some(ground) = self.ground(marked) else {
            return BevPoint { marked, ground: None, projected: None, status: BevStatus::NoGround };
        };
        let Some(pixel) = self.projected.project(&ground) else {
            return BevPoint { marked, ground: Some(ground.into()), projected: None, status: BevStatus::BehindCamera };
        };
        let is_visible = self.projected.sees(pixel.x, pixel.y);
        let status = if is_visible { BevStatus::Visible } else { BevStatus::OutsideImage };
        BevPoint { marked, ground: Some(ground.into()), projected: Some(pixel.into()), status }
    }

    /// The plane's homography (8), which maps (u, v, 1) of the first camera to the second's pixel, up to scale. The scale
    /// is such that the lower right entry is 1 or, where that is all but zero, that the largest entry is.
    pub fn homography(&self) -> Matrix3<f64> {
        let corner = self.H[(2, 2)];
        let largest = self.H.iter().fold(0.0, |best: f64, &value| if value.abs() > best.abs() { value } else { best });
        self.H / if corner.abs() > 1e-9 * largest.abs() { corner } else { largest }
    }

    /// `H p`, whose scale is z' / t, eq. (8).
    pub(super) fn scaled_pixel(&self, p: &Vector3<f64>) -> Vector3<f64> {
        self.H * p
    }

    /// The row and matrix of eqs. (7) and (8).
    pub(super) fn rows(&self) -> (RowVector3<f64>, Matrix3<f64>) {
        (self.a, self.H)
    }

    /// What a pixel of the first camera has to fulfil for the second to see its ground.
    pub(super) fn half_planes(&self) -> [HalfPlane; 6] {
        let [left, top, right, bottom] = self.projected.frame();
        let [h1, h2, h3] = [0, 1, 2].map(|row| self.H.row(row).into_owned());
        // Where the depth in the other camera vanishes, the ground would project to infinity.
        [self.a, h3 - self.a * ROUNDING, h1 - h3 * left, h3 * right - h1, h2 - h3 * top, h3 * bottom - h2]
    }

    /// The part of the plane that the first camera sees, no deeper than `max_depth` (m, along its optical axis): corners
    /// in the world, none where it sees no ground.
    fn footprint(&self, max_depth: f64) -> Vec<[f64; 3]> {
        let [left, top, right, bottom] = self.marked.frame();
        let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
        // 1 / t >= 1 / max_depth, eq. (7).
        let near_enough = self.a - RowVector3::new(0.0, 0.0, 1.0 / max_depth);
        let kept = clip(&corners, &[near_enough]);
        kept.iter().filter_map(|vertex| self.ground([vertex.p.x, vertex.p.y])).map(Into::into).collect()
    }
}

/// What a drawing of the scene needs: everything in the world, whatever kind of pose or plane was given.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct BevLayout {
    /// Unit normal of the ground, on the side of the top camera.
    pub up: [f64; 3],
    /// The point of the ground nearest to the world's origin.
    pub ground: [f64; 3],
    /// The camera that points are marked in.
    pub top: BevLayoutCamera,
    /// The camera that they are looked for in.
    pub front: BevLayoutCamera,
}

/// A camera as it is drawn.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct BevLayoutCamera {
    /// Position (m).
    pub position: [f64; 3],
    /// Unit vectors in the world: right, down and forward.
    pub right: [f64; 3],
    /// See `right`.
    pub down: [f64; 3],
    /// See `right`.
    pub forward: [f64; 3],
    /// Directions of the image's corners, clockwise from the upper left, with depth 1.
    pub corners: Vec<[f64; 3]>,
    /// Corners of the ground that it sees, cut at `max_depth`.
    pub footprint: Vec<[f64; 3]>,
    /// Height above the ground (m).
    pub height: f64,
    /// fx fy cx cy (pixels).
    pub intrinsics: [f64; 4],
    /// Angle that a row of the image spans (rad).
    pub horizontal_field_of_view: f64,
    /// Angle that a column of the image spans (rad).
    pub vertical_field_of_view: f64,
}

impl BevLayout {
    /// The layout of the cameras of `front_from_top`; footprints end at `max_depth` (m).
    pub fn new(front_from_top: &PlaneTransfer, max_depth: f64) -> Self {
        let PlaneTransfer { marked: top, projected: front, plane, .. } = *front_from_top;
        let side = plane.height_of(&top).signum();
        let up = plane.normal * side;
        let backwards = PlaneTransfer::new(front, top, plane);
        Self {
            up: up.into(),
            ground: (plane.normal * plane.offset).into(),
            top: BevLayoutCamera::new(&top, plane.height_of(&top) * side, front_from_top.footprint(max_depth)),
            front: BevLayoutCamera::new(&front, plane.height_of(&front) * side, backwards.footprint(max_depth)),
        }
    }
}

impl BevLayoutCamera {
    fn new(camera: &PosedCamera, height: f64, footprint: Vec<[f64; 3]>) -> Self {
        let [left, top, right, bottom] = camera.frame();
        let R = camera.R();
        let Pinhole { fx, fy, cx, cy, .. } = camera.pinhole;
        let [horizontal_field_of_view, vertical_field_of_view] = camera.fields_of_view();
        Self {
            position: camera.T_world_camera.translation.vector.into(),
            right: R.column(0).into_owned().into(),
            down: R.column(1).into_owned().into(),
            forward: R.column(2).into_owned().into(),
            corners: [[left, top], [right, top], [right, bottom], [left, bottom]]
                .map(|pixel| camera.ray(pixel).into())
                .to_vec(),
            footprint,
            height,
            intrinsics: [fx, fy, cx, cy],
            horizontal_field_of_view,
            vertical_field_of_view,
        }
    }
}
