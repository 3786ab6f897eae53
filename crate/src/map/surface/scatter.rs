//! The noise of a depth camera from images of the same surfaces.
//!
//! Errors of stereo matching are alike over patches, and calibration leaves others that are smooth over the image: within a window of one image
//! both look like the surface. From another place they lie elsewhere, so two images differ by them.

use nalgebra::{Point3, Vector3};

use crate::camera::Pinhole;
use crate::geometry::quantile::{MEDIAN_TO_SIGMA, quantile};
use crate::geometry::{Pose3, RigidMotion};
use crate::preprocess::depth_surfels::{CELL_SIZE, DepthModel};
use crate::preprocess::map_image::MapImage;

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
        // One of each cell: neighbours share most of their errors.
        let pixels = (0..height).step_by(CELL_SIZE).flat_map(|v| (0..width).step_by(CELL_SIZE).map(move |u| [u, v]));
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

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};

    use super::*;
    use crate::geometry::random::Random;
    use crate::map::surface::{SurfaceFusion, SurfaceOptions};

    const SIDE: usize = 128;
    /// Pixels along a side of a patch whose errors are the same.
    const PATCH: usize = 8;
    const MODEL: DepthModel =
        DepthModel { step: 1e-3, offset: 0.0, square_noise: 2e-3, min_range: 0.1, max_range: 10.0 };

    /// A normally distributed number.
    fn normal(random: &mut Random) -> f64 {
        (0..12).map(|_| random.uniform(-0.5, 0.5)).sum()
    }

    /// A view of the wall z = 3 m, turned and moved aside. Its depths are off by `noise` (1/m) times their square, in patches; the
    /// normals are those of the wall. Before the columns from `hidden` on stands a second wall, at half of the depth.
    fn view(number: u64, noise: f64, hidden: usize) -> PlacedImage {
        let camera = Pinhole::from_field_of_view(SIDE, SIDE, 1.2).unwrap();
        let (mut random, unit) = (Random::new(number), 1e-4);
        let aside = 0.15 * number as f64;
        let turn = UnitQuaternion::from_euler_angles(0.1, 0.3 - 0.1 * number as f64, 0.05);
        let T_world_camera = Isometry3::from_parts(Vector3::new(aside, -0.1, 0.2).into(), turn);
        let wall = turn.inverse() * Vector3::new(0.0, 0.0, -1.0);
        let errors: Vec<f64> = (0..(SIDE / PATCH).pow(2)).map(|_| noise * normal(&mut random)).collect();
        let depth = |at: usize| {
            let (column, row) = (at % SIDE, at / SIDE);
            let z = (0.2 - 3.0) / wall.dot(&camera.ray(column as f64, row as f64));
            let z = if column < hidden { z } else { z / 2.0 };
            ((z + z * z * errors[row / PATCH * (SIDE / PATCH) + column / PATCH]) / unit).round() as u16
        };
        let image = MapImage {
            camera,
            unit: unit as f32,
            depths: (0..SIDE * SIDE).map(depth).collect(),
            normals: vec![[wall.x, wall.y, wall.z].map(|entry| (127.0 * entry).round() as i8); SIDE * SIDE],
            colors: None,
        };
        PlacedImage { image, model: MODEL, T_world_camera }
    }

    #[test]
    fn errors_in_patches_of_images_are_told_by_what_these_differ() {
        let between = |noise: f64| view(1, noise, SIDE).noise_between(&view(3, noise, SIDE)).unwrap();
        // Compared points lie up to half a pixel apart, and normals are known to half of a 127th.
        assert!(between(0.0) < 2e-4, "{}", between(0.0));
        for noise in [3e-3, 6e-3] {
            assert!((between(noise) / noise - 1.0).abs() < 0.2, "{} of {noise}", between(noise));
        }
    }

    #[test]
    fn what_one_image_alone_sees_moves_it_little_and_too_little_in_common_tells_nothing() {
        let noise = 6e-3;
        let whole = view(1, noise, SIDE);
        let partly_hidden = whole.noise_between(&view(3, noise, SIDE * 4 / 5)).unwrap();
        assert!((0.8..1.7).contains(&(partly_hidden / noise)), "{partly_hidden}");
        let mut without_normals = view(3, noise, SIDE);
        without_normals.image.normals.fill([0; 3]);
        let mut turned = view(3, noise, SIDE);
        turned.image.normals.fill([-127, 0, 0]);
        let mut elsewhere = view(3, noise, SIDE);
        elsewhere.T_world_camera.translation.vector.x += 10.0;
        let mut small = view(3, noise, SIDE);
        small.image.depths[SIDE * SIDE / 5..].fill(0);
        for other in [without_normals, turned, elsewhere, small] {
            assert_eq!(whole.noise_between(&other), None);
        }
    }

    #[test]
    fn a_field_is_made_anew_with_the_noise_by_which_its_first_images_differ() {
        let options = SurfaceOptions { voxel_size: 0.04, ..SurfaceOptions::default() };
        let noise = 8e-3;
        let views: Vec<PlacedImage> = (1..=6).map(|number| view(number, noise, SIDE)).collect();
        let fused = |square_noise: f64| {
            let mut field = SurfaceFusion::new(options).unwrap();
            let model = DepthModel { square_noise, ..MODEL };
            for view in &views {
                field.integrate(&view.image, &model, &view.T_world_camera);
            }
            let mesh = field.mesh();
            let off = |(point, deviation): (&glam::Vec3, &f32)| f64::from((point.z - 3.0) / deviation).powi(2);
            let squares = mesh.positions.iter().zip(&mesh.deviations).map(off).sum::<f64>();
            (mesh.deviations[0], (squares / mesh.positions.len() as f64).sqrt())
        };
        let (told, known) = (fused(MODEL.square_noise), fused(noise));
        assert!((told.0 / known.0 - 1.0).abs() < 0.2, "{told:?} {known:?}");
        assert!(told.1 < 1.2, "vertices are off by {} deviations", told.1);
    }
}
