//! A depth image to surfels, robust to coarsely quantised depth and to silhouettes.
//!
//! A plane is linear in inverse depth: n . p = d with p = z (x, y, 1) gives 1 / z = (n . (x, y, 1)) / d. So a plane is
//! fitted to 1 / z over a window of pixels in closed form, from sums that summed-area tables (Crow 1984) give for any
//! window from four look-ups. For every cell the largest window around it is used that is a plane to within the noise of the
//! depth. In small windows the steps of coarse depth look like planes that face the camera; large windows span many steps, and
//! the fit is accurate to a fraction of a step. A window over a silhouette is not a plane, so mixed pixels are left out.

mod summed_moments;

use std::sync::Arc;

use nalgebra::Vector3;

use self::summed_moments::{InversePlane, Moments, SummedMoments, Window, fit};
use crate::camera::surfel_image::{Surfel, SurfelImage, cell_camera};
use crate::camera::{DepthImage, Pinhole};
use crate::geometry::scalar::larger;

/// How depth is measured: scale, range and noise of the raw values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthModel {
    /// Depth of a raw step (m).
    pub step: f64,
    /// Offset from a raw value to the centre of its interval of depths (raw steps): 0.5 where depth was truncated to whole
    /// steps, 0 where it was rounded.
    pub offset: f64,
    /// Standard deviation of the depth divided by its square (1/m), in addition to the quantisation: the error of a camera
    /// that triangulates grows with the square of the depth.
    pub square_noise: f64,
    /// Nearer depths are dropped (m).
    pub min_range: f64,
    /// Farther depths are dropped (m).
    pub max_range: f64,
}

impl DepthModel {
    /// The depth of a raw value (m); `None` for 0 and out of range.
    pub fn depth(&self, value: u16) -> Option<f64> {
        let depth = (f64::from(value) + self.offset) * self.step;
        (value > 0 && depth >= self.min_range && depth <= self.max_range).then_some(depth)
    }

    /// Standard deviation of a depth (m).
    #[inline]
    pub(crate) fn deviation(&self, depth: f32) -> f32 {
        (self.variance(f64::from(depth)) as f32).sqrt()
    }

    /// Variance of a depth: uniform within a step, and the camera's noise.
    fn variance(&self, depth: f64) -> f64 {
        self.step * self.step / 12.0 + (self.square_noise * depth * depth).powi(2) + MIN_NOISE * MIN_NOISE
    }
}

/// Lower bound of the noise of a surface's points (m), for surfaces are never perfectly flat.
pub(crate) const MIN_NOISE: f64 = 1e-3;
/// Side of a cell (pixels).
pub(crate) const CELL_SIZE: usize = 4;
/// Half widths of the windows (cells beyond the centre), the largest first.
const WINDOW_RADII: [usize; 5] = [10, 6, 4, 2, 1];
/// Largest ratio of the mean square residual to the noise's variance for which a window is a plane.
const MAX_MISFIT: f64 = 1.5;
/// Largest deviation of a cell's mean depth from its window's plane (standard deviations).
const MAX_CELL_OFFSET: f64 = 1.5;
/// Largest standard deviation of a normal (rad).
const MAX_NORMAL_DEVIATION: f64 = 0.2;
/// Surfaces seen at a cosine below this are too oblique.
const MIN_COSINE: f64 = 0.08;
/// Share of a window's pixels that have depth, at the least.
const MIN_FILLED: f64 = 0.6;
/// No surface is known better (m): walls bulge, lenses distort.
const MIN_DEVIATION: f64 = 2e-3;

/// Pieces of surface in cells of `CELL_SIZE` pixels. `usable` says of every pixel whether its depth is to be used.
pub fn depth_surfels(image: &DepthImage, usable: &[bool], camera: &Pinhole, model: &DepthModel) -> SurfelImage {
    let cells = cell_camera(camera, CELL_SIZE);
    let sums = SummedMoments::new(image, usable, camera, model);
    let mut surfels = vec![None; cells.width * cells.height];
    // Misfits of the last visited cell of each column; one column more, which has none.
    let mut known = vec![Misfits::default(); cells.width + 1];
    let rays = cells.ray_table();
    for (row, row_of_surfels) in surfels.chunks_exact_mut(cells.width.max(1)).enumerate() {
        let mut misfits = Misfits::default();
        for (column, surfel) in row_of_surfels.iter_mut().enumerate() {
            let ray = Vector3::new(rays.x[column], rays.y[row], 1.0);
            misfits = Misfits::beside([&misfits, &known[column], &known[column + 1]]);
            *surfel = sums.surfel(column, row, &ray, &cells, model, &mut misfits);
            known[column] = misfits;
        }
    }
    SurfelImage {
        camera: *camera,
        cell_size: CELL_SIZE,
        columns: cells.width,
        rows: cells.height,
        cells: Arc::new(surfels),
        brightness: None,
    }
}

/// Lower bounds of the sums of squared residuals in the windows around a cell, in units of the noise, in the order of
/// [`WINDOW_RADII`].
///
/// The sum of squared residuals of a window is at least that of any window within it. So a misfit excludes all larger windows,
/// and near silhouettes, where most windows fail, few are evaluated.
#[derive(Clone, Copy, Default)]
struct Misfits([f64; WINDOW_RADII.len()]);

impl Misfits {
    /// Bounds from the cells next to this one: each window contains their next smaller ones.
    #[inline]
    fn beside(neighbours: [&Self; 3]) -> Self {
        let mut known = [0.0; WINDOW_RADII.len()];
        for index in (0..WINDOW_RADII.len() - 1).rev() {
            let smaller = neighbours.map(|neighbour| neighbour.0[index + 1]);
            known[index] = smaller.into_iter().fold(known[index + 1], larger);
        }
        Self(known)
    }

    /// Updates the bounds by the sum of one window.
    #[inline]
    fn learn(&mut self, index: usize, squares: f64) {
        for known in &mut self.0[..=index] {
            *known = larger(*known, squares);
        }
    }
}

impl SummedMoments {
    /// The surfel of a cell from the largest window around it that is a plane.
    fn surfel(
        &self,
        column: usize,
        row: usize,
        ray: &Vector3<f64>,
        cells: &Pinhole,
        model: &DepthModel,
        misfits: &mut Misfits,
    ) -> Option<Surfel> {
        let cell = Window::around(column, row, 0);
        if 2 * self.count(cell) < (CELL_SIZE * CELL_SIZE) as u32 {
            return None;
        }
        let most = column.min(row).min(self.columns - 1 - column).min(self.rows - 1 - row);
        for (index, reach) in WINDOW_RADII.into_iter().enumerate() {
            let side = (2 * reach + 1) * CELL_SIZE;
            let area = (side * side) as f64;
            if reach > most || misfits.0[index] > MAX_MISFIT * area {
                continue;
            }
            let window = Window::around(column, row, reach);
            let num_pixels = f64::from(self.count(window));
            if num_pixels < MIN_FILLED * area {
                continue;
            }
            let Some(plane) = fit(&self.moments(window), num_pixels) else { continue };
            misfits.learn(index, plane.misfit * plane.num_pixels);
            if plane.misfit > MAX_MISFIT {
                continue;
            }
            let r = plane.a * ray.x + plane.b * ray.y + plane.c;
            if r <= 0.0 {
                continue;
            }
            let depth = 1.0 / r;
            if lies_off(&plane, &self.moments(cell), depth, model) {
                return None;
            }
            return oriented(&plane, ray, depth, reach, cells, model);
        }
        None
    }
}

/// Whether the mean depth of a cell deviates from the depth of the plane by more than the noise.
#[inline]
fn lies_off(plane: &InversePlane, cell: &Moments, depth: f64, model: &DepthModel) -> bool {
    // The deviation of the cell's mean 1 / z from the plane, and the same in z (m).
    let mean_offset = (cell[6] - plane.a * cell[1] - plane.b * cell[2] - plane.c * cell[0]) / cell[0];
    let cell_offset = mean_offset * depth * depth;
    cell_offset * cell_offset > MAX_CELL_OFFSET * MAX_CELL_OFFSET * model.variance(depth)
}

/// The surfel, if its normal is certain enough.
fn oriented(
    plane: &InversePlane,
    ray: &Vector3<f64>,
    depth: f64,
    reach: usize,
    cells: &Pinhole,
    model: &DepthModel,
) -> Option<Surfel> {
    // (a, b, c) = n / d; the normal towards the camera is its negative.
    let gradient = Vector3::new(plane.a, plane.b, plane.c);
    let normal = gradient * -gradient.norm().recip();
    let towards = -normal.dot(ray);
    let cosine = towards / ray.norm();
    if cosine < MIN_COSINE {
        return None;
    }
    let half_width = (reach as f64 + 0.5) / cells.fx; // as a tangent
    // Depths over the window differ by the slope of the plane: in steps.
    let slope = depth * depth * larger(plane.a.abs(), plane.b.abs());
    let steps = 2.0 * half_width * slope / model.step;
    // The error by quantisation decreases with the number of steps in the window, that by noise with the number of pixels.
    let step_deviation = model.step / 12f64.sqrt() / (1.0 + steps);
    let noise_of_pixel = model.square_noise * depth * depth;
    let noise = noise_of_pixel / larger(1.0, plane.num_pixels / CORRELATED_PIXELS).sqrt();
    let sigma = (step_deviation * step_deviation + noise * noise).sqrt();
    // Both ends of the window may be off by the deviation; its width lies across the line of sight.
    if sigma * cosine > MAX_NORMAL_DEVIATION * half_width * depth {
        return None;
    }
    let shared = SHARED_ERROR * noise_of_pixel;
    // An error in depth moves the point along the ray; the surface moves by its share along the normal.
    let variance_along_normal = (sigma * sigma + shared * shared) * towards * towards;
    let sigma = (variance_along_normal + MIN_DEVIATION * MIN_DEVIATION).sqrt();
    Some(Surfel { point: ray * depth, normal, sigma })
}

/// Pixels over which errors of triangulating cameras are correlated.
const CORRELATED_PIXELS: f64 = 50.0;
/// Error that all pixels of a window share, and all images of a surface, in units of the noise of one pixel; the normal does not turn
/// by it. Along the line of sight, the surfaces of registered frames and of the map differ by 0.7 to 1.0 (kinect_office), 0.7 to 1.3
/// (d435_robot) and 0.3 to 1.7 (kinect_pioneer) times that noise, at depths of 1 to 7 m. Without the 2 mm that every surface may be off
/// it is 0.7 in the median, half of the variance being each one's.
pub(crate) const SHARED_ERROR: f64 = 0.5;

#[cfg(test)]
mod tests {
    use super::*;

    const EIGHT_BITS: DepthModel =
        DepthModel { step: 10.0 / 255.0, offset: 0.5, square_noise: 0.0, min_range: 0.1, max_range: 10.0 };

    fn camera() -> Pinhole {
        Pinhole::from_field_of_view(256, 192, 1.4).unwrap()
    }

    /// The nearest of some planes n . p = d along every ray, in 8 bits over 10 m, truncated.
    fn image(planes: &[(Vector3<f64>, f64)]) -> DepthImage {
        let camera = camera();
        let depth = |index: usize| {
            let ray = camera.ray((index % 256) as f64, (index / 256) as f64);
            let depths = planes.iter().map(|(normal, d)| d / normal.dot(&ray)).filter(|&depth| depth > 0.0);
            depths.fold(f64::INFINITY, f64::min)
        };
        let values = (0..256 * 192).map(|index| (depth(index) / 10.0 * 255.0).floor().min(255.0) as u16).collect();
        DepthImage { width: 256, height: 192, values, bits: 8 }
    }

    fn surfels(image: &DepthImage) -> SurfelImage {
        depth_surfels(image, &vec![true; image.values.len()], &camera(), &EIGHT_BITS)
    }

    #[test]
    fn steps_of_coarse_depth_are_no_false_planes() {
        let wall = (Vector3::new(0.6, 0.0, 0.8), 2.0); // oblique, 39 mm steps everywhere
        let found = surfels(&image(&[wall]));
        let inner: Vec<&Surfel> = found.surfels().collect();
        let (mut sum, count) = (0.0, inner.len());
        assert!(inner.len() * 10 > 8 * found.cells.len(), "{}", inner.len());
        for surfel in inner {
            let (off, turned) = (wall.0.dot(&surfel.point) - wall.1, surfel.normal.angle(&-wall.0));
            assert!(off.abs() < 0.010 && off.abs() < 4.0 * surfel.sigma, "{off} {}", surfel.sigma);
            assert!(turned < MAX_NORMAL_DEVIATION, "{turned} at {}", surfel.point);
            sum += turned;
            assert!((surfel.normal.norm() - 1.0).abs() < 1e-6);
        }
        assert!(sum / (count as f64) < 0.02, "{}", sum / count as f64);
    }

    #[test]
    fn a_wall_that_faces_the_camera_is_known_to_a_step_only() {
        let found = surfels(&image(&[(Vector3::z(), 3.01)]));
        for surfel in found.surfels() {
            assert!((surfel.normal + Vector3::z()).norm() < 1e-6);
            assert!((surfel.point.z - 3.01).abs() < EIGHT_BITS.step / 2.0);
            assert!((surfel.sigma - EIGHT_BITS.step / 12f64.sqrt()).abs() < 1e-3);
        }
        assert!(found.surfels().count() > 2000);
    }

    #[test]
    fn the_error_that_pixels_share_does_not_decrease_with_their_number() {
        let millimetres = DepthModel { step: 1e-3, offset: 0.0, square_noise: 2e-3, ..EIGHT_BITS };
        let wall = DepthImage { width: 256, height: 192, values: vec![3000; 256 * 192], bits: 16 };
        let found = depth_surfels(&wall, &vec![true; wall.values.len()], &camera(), &millimetres);
        let shared = SHARED_ERROR * millimetres.square_noise * 9.0;
        assert!(found.surfels().all(|surfel| surfel.sigma > shared), "none is known better");
        let in_large_windows = found.surfels().filter(|surfel| surfel.sigma < 1.1 * shared).count();
        assert!(in_large_windows > 1000, "{in_large_windows}");
    }

    #[test]
    fn nothing_stands_between_an_object_and_what_is_behind() {
        let (box_front, wall) = ((Vector3::new(-0.3, 0.0, 0.954), 1.5), (Vector3::z(), 4.0));
        let mut scene = image(&[wall]);
        let near = image(&[box_front]);
        for (index, value) in scene.values.iter_mut().enumerate() {
            if (60..130).contains(&(index % 256)) && index / 256 > 70 {
                *value = near.values[index];
            }
        }
        // Mixed pixels, as sensors that average have them.
        for v in 71..192 {
            for u in [59, 130] {
                let index = v * 256 + u;
                scene.values[index] = u16::midpoint(scene.values[index - 2], scene.values[index + 2]);
            }
        }
        for surfel in surfels(&scene).surfels() {
            let to_box = (box_front.0.dot(&surfel.point) - box_front.1).abs();
            let to_wall = (surfel.point.z - wall.1).abs();
            assert!(to_box.min(to_wall) < 0.025, "{} is on neither", surfel.point);
        }
    }

    #[test]
    fn holes_and_unusable_pixels_give_no_surface() {
        let mut scene = image(&[(Vector3::new(0.6, 0.0, 0.8), 2.0)]);
        let usable: Vec<bool> = (0..scene.values.len()).map(|index| index % 256 < 128).collect();
        scene.values[..256 * 40].fill(0);
        let found = depth_surfels(&scene, &usable, &camera(), &EIGHT_BITS);
        for (index, cell) in found.cells.iter().enumerate() {
            let (column, row) = (index % found.columns, index / found.columns);
            assert!(cell.is_none() || (column < 32 && row >= 10), "{column} {row}");
        }
        assert!(found.surfels().count() > 500);
        let up_to_3_m = DepthModel { step: 1e-3, offset: 0.0, max_range: 3.0, ..EIGHT_BITS };
        for (value, is_in_range) in [(3000, true), (3001, false), (u16::MAX, false)] {
            let wall = DepthImage { values: vec![value; 256 * 192], bits: 16, ..scene.clone() };
            let found = depth_surfels(&wall, &vec![true; wall.values.len()], &camera(), &up_to_3_m);
            assert_eq!(found.surfels().count() > 1000, is_in_range, "{value}");
        }
        let tiny = DepthImage { width: 3, height: 3, values: vec![9; 9], bits: 8 };
        let camera = Pinhole::new(3, 3, [3.0, 3.0, 1.0, 1.0]).unwrap();
        assert!(depth_surfels(&tiny, &[true; 9], &camera, &EIGHT_BITS).cells.is_empty());
    }
}
