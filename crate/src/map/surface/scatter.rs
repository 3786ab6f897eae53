//! The noise of a depth camera from images of the same surfaces.
//!
//! Errors of stereo matching are alike over patches, and calibration leaves others that are smooth over the image: within a window of one image
//! both look like the surface. From another place they lie elsewhere, so two images differ by them.

use nalgebra::{Point3, Vector3};

use crate::camera::Pinhole;
use crate::geometry::quantile::{MEDIAN_TO_SIGMA, quantile};
use crate::geometry::{Pose3, RigidMotion};
use crate::preprocess::depth_surfels::DepthModel;
use crate::preprocess::map_image::MapImage;

/// Of this many pixels along a row and a column one is compared: neighbours share most of their errors.
const STRIDE: usize = 4;
/// Fewest pixels that are compared: their median is known to 7 %.
const MIN_COMPARED: usize = 300;
/// Surfaces are compared where their normals differ by less than this (cosine): an edge between two planes is no noise.
const MIN_COSINE: f64 = 0.8;

/// An image that was added.
#[derive(Debug, Clone)]
pub(super) struct PlacedImage {
    pub image: MapImage,
    pub model: DepthModel,
    pub T_world_camera: Pose3,
}

/// A point of a surface in a camera's frame, and its normal.
struct Place {
    point: Vector3<f64>,
    normal: Vector3<f64>,
}

impl PlacedImage {
    /// The standard deviation of a depth over its square (1/m) by which this image and another differ, as [`DepthModel::square_noise`]; none
    /// where they see too few of the same surfaces. Surfaces that one of them does not see, fewer than half, move the median little.
    pub(super) fn noise_between(&self, other: &Self) -> Option<f64> {
        let T_self_other = self.T_world_camera.inverse() * other.T_world_camera;
        let Pinhole { width, height, .. } = other.image.camera;
        let pixels = (0..height).step_by(STRIDE).flat_map(|v| (0..width).step_by(STRIDE).map(move |u| [u, v]));
        let mut ratios: Vec<f64> = pixels.filter_map(|pixel| self.ratio(&other.place(pixel)?, &T_self_other)).collect();
        let is_enough = ratios.len() >= MIN_COMPARED;
        quantile(&mut ratios, 0.5).filter(|_| is_enough).map(|median| MEDIAN_TO_SIGMA * median)
    }

    /// Distance of another image's point from the plane seen here, over its standard deviation for a square noise of 1.
    fn ratio(&self, other: &Place, T_self_other: &Pose3) -> Option<f64> {
        let point = (T_self_other * Point3::from(other.point)).coords;
        let at = self.image.camera.project(&point)?;
        let is_inside = at.x >= 0.0 && at.y >= 0.0;
        let seen = self.place([at.x.round() as usize, at.y.round() as usize]).filter(|_| is_inside)?;
        if seen.normal.dot(&T_self_other.rotate(&other.normal)) < MIN_COSINE {
            return None;
        }
        // An error of the depth moves a point along its ray, which is that of a depth of 1 times the depth.
        let deviation = |place: &Place| place.normal.dot(&place.point) * place.point.z;
        Some((seen.normal.dot(&(point - seen.point)) / deviation(&seen).hypot(deviation(other))).abs())
    }

    /// The surface at a pixel, where its normal is known.
    fn place(&self, [column, row]: [usize; 2]) -> Option<Place> {
        let camera = &self.image.camera;
        if column >= camera.width || row >= camera.height {
            return None;
        }
        let at = row * camera.width + column;
        let (depth, normal) = (self.image.depths[at], self.image.normals[at].map(f64::from));
        let normal = Vector3::from(normal).try_normalize(0.5).filter(|_| depth > 0)?;
        let ray = camera.ray(column as f64, row as f64);
        Some(Place { point: ray * (f64::from(depth) * f64::from(self.image.unit)), normal })
    }
}
