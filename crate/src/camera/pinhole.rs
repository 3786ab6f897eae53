//! The pinhole camera without distortion.

use nalgebra::{Matrix2x3, Vector2, Vector3};

use crate::{Error, Result};

/// Intrinsics (pixels): `u = fx x / z + cx`, `v = fy y / z + cy` for a point (x right, y down, z forward).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Pinhole {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Focal length along the rows (pixels).
    pub fx: f64,
    /// Focal length along the columns (pixels).
    pub fy: f64,
    /// Column of the optical axis (pixels).
    pub cx: f64,
    /// Row of the optical axis (pixels).
    pub cy: f64,
}

impl Pinhole {
    /// A camera from its intrinsics.
    ///
    /// # Errors
    /// When an image side is zero, a focal length is not positive, or a value is not finite.
    pub fn new(width: usize, height: usize, [fx, fy, cx, cy]: [f64; 4]) -> Result<Self> {
        if width == 0 || height == 0 {
            return Err(Error::whole(format!("An image of {width} x {height} pixels is empty"), ""));
        }
        if !(fx > 0.0 && fy > 0.0 && [fx, fy, cx, cy].iter().all(|value| value.is_finite())) {
            let problem = format!("fx = {fx}, fy = {fy}, cx = {cx}, cy = {cy} is not a valid camera");
            return Err(Error::whole(problem, "Focal lengths are positive, and all four are finite numbers of pixels"));
        }
        Ok(Self { width, height, fx, fy, cx, cy })
    }

    /// A camera with square pixels whose rows span the angle `field_of_view` (rad), the optical axis at (width / 2,
    /// height / 2).
    ///
    /// # Errors
    /// When an image side is zero or the angle is not between 0 and pi.
    pub fn from_field_of_view(width: usize, height: usize, field_of_view: f64) -> Result<Self> {
        if !(field_of_view > 0.0 && field_of_view < std::f64::consts::PI) {
            let problem = format!("A field of view of {} degrees is not possible", field_of_view.to_degrees());
            return Err(Error::whole(problem, "Give an angle between 0 and 180 degrees"));
        }
        let f = width as f64 / 2.0 / (field_of_view / 2.0).tan();
        Self::new(width, height, [f, f, width as f64 / 2.0, height as f64 / 2.0])
    }

    /// The pixel (u, v) that a point (m, camera frame) projects to, inside the image or not; `None` behind the camera.
    pub fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        (point.z > 0.0)
            .then(|| Vector2::new(self.fx * point.x / point.z + self.cx, self.fy * point.y / point.z + self.cy))
    }

    /// Derivative of [`project`](Self::project) with respect to the point, which must be in front of the camera.
    pub fn projection_jacobian(&self, point: &Vector3<f64>) -> Matrix2x3<f64> {
        let (x, y, z) = (point.x / point.z, point.y / point.z, 1.0 / point.z);
        Matrix2x3::new(self.fx * z, 0.0, -self.fx * x * z, 0.0, self.fy * z, -self.fy * y * z)
    }

    /// The point at z = 1 on the ray of pixel (u, v).
    pub fn ray(&self, u: f64, v: f64) -> Vector3<f64> {
        Vector3::new((u - self.cx) / self.fx, (v - self.cy) / self.fy, 1.0)
    }

    /// The point at depth `z` (m, along the optical axis) on the ray of pixel (u, v).
    pub fn unproject(&self, u: f64, v: f64, z: f64) -> Vector3<f64> {
        self.ray(u, v) * z
    }

    /// x / z of every column and y / z of every row, which give the rays of all pixels.
    pub(crate) fn ray_table(&self) -> RayTable {
        RayTable {
            x: (0..self.width).map(|u| self.ray(u as f64, 0.0).x).collect(),
            y: (0..self.height).map(|v| self.ray(0.0, v as f64).y).collect(),
        }
    }
}

/// The rays of all pixels: that of pixel (u, v) is `(x[u], y[v], 1)`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RayTable {
    /// x / z of each column.
    pub x: Vec<f64>,
    /// y / z of each row.
    pub y: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_of_view_over_512_pixels_has_a_focal_length_of_256() {
        let camera = Pinhole::from_field_of_view(512, 512, std::f64::consts::FRAC_PI_2).unwrap();
        for (value, expected) in [(camera.fx, 256.0), (camera.fy, 256.0), (camera.cx, 256.0), (camera.cy, 256.0)] {
            assert!((value - expected).abs() < 1e-10);
        }
    }

    #[test]
    fn points_come_back_from_their_pixels() {
        let camera = Pinhole::new(640, 480, [585.0, 580.0, 320.5, 240.0]).unwrap();
        let table = camera.ray_table();
        for (u, v, z) in [(0.0, 0.0, 1.0), (639.0, 479.0, 0.3), (17.0, 400.0, 9.0)] {
            let point = camera.unproject(u, v, z);
            assert!((camera.project(&point).unwrap() - Vector2::new(u, v)).norm() < 1e-10);
            assert_eq!(point, Vector3::new(table.x[u as usize], table.y[v as usize], 1.0) * z);
        }
        assert_eq!(camera.project(&Vector3::new(1.0, 1.0, 0.0)), None);
        assert_eq!(camera.project(&Vector3::new(1.0, 1.0, -1.0)), None);
    }

    #[test]
    fn jacobian_is_the_numeric_one() {
        let camera = Pinhole::new(640, 480, [585.0, 580.0, 320.5, 240.0]).unwrap();
        let (point, h) = (Vector3::new(0.4, -0.7, 2.1), 1e-6);
        for axis in 0..3 {
            let step = Vector3::from_fn(|row, _| if row == axis { h } else { 0.0 });
            let numeric =
                (camera.project(&(point + step)).unwrap() - camera.project(&(point - step)).unwrap()) / (2.0 * h);
            assert!((camera.projection_jacobian(&point).column(axis) - numeric).norm() < 1e-5);
        }
    }

    #[test]
    fn what_is_no_camera_is_refused() {
        assert!(Pinhole::new(0, 480, [500.0, 500.0, 0.0, 0.0]).is_err());
        assert!(Pinhole::new(640, 480, [0.0, 500.0, 0.0, 0.0]).is_err());
        assert!(Pinhole::new(640, 480, [500.0, 500.0, f64::NAN, 0.0]).is_err());
        for angle in [0.0, -1.0, std::f64::consts::PI, f64::NAN] {
            assert!(Pinhole::from_field_of_view(640, 480, angle).is_err());
        }
    }
}
