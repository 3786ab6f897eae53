//! The points of a frame that are compared by brightness, and the pictures that they are looked up in.

use std::sync::Arc;

use nalgebra::Vector3;

use super::MIN_SIGMA;
use crate::camera::brightness::{Brightness, NUM_LEVELS, Sample};
use crate::camera::{Pinhole, SurfelImage};

/// The brightness pyramid of a frame, with the camera of every level.
#[derive(Debug, Clone)]
pub struct Picture {
    brightness: Arc<Brightness>,
    cameras: [Pinhole; NUM_LEVELS],
}

/// A point of a frame at a large gradient of the brightness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TexturedPoint {
    /// Position (m, camera frame).
    pub point: Vector3<f64>,
    /// The patch of the image that it lies in; errors within a patch are correlated.
    pub patch: u32,
    /// Its brightness in every level (grey levels).
    pub values: [f64; NUM_LEVELS],
}

/// Side of the squares from which one point is selected (cells).
const SPACING: usize = 5;
/// Side of a patch (such squares).
const PATCH: usize = 3;
/// The level whose pixels are the cells.
const CELL_LEVEL: usize = 1;

impl Picture {
    /// A frame's brightness and the camera of its images.
    pub fn new(brightness: Arc<Brightness>, camera: &Pinhole) -> Self {
        let cameras = std::array::from_fn(|level| brightness.camera(camera, level));
        Self { brightness, cameras }
    }

    /// Memory of the brightness on the heap (bytes).
    pub fn num_bytes(&self) -> usize {
        self.brightness.num_bytes()
    }

    /// Brightness at a point (m, the picture's camera frame), and its derivative with respect to the point.
    #[inline]
    pub(super) fn look(&self, level: usize, point: &Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
        let camera = &self.cameras[level];
        let place = camera.project(point)?;
        let Sample { value, gradient } = self.brightness.sample(level, place.x, place.y)?;
        let gradient = camera.projection_jacobian(point).tr_mul(&nalgebra::Vector2::from(gradient));
        Some((value, gradient))
    }
}

/// Points of a frame at large gradients, evenly spread over the image; empty where it has no colours.
pub fn textured_points(frame: &SurfelImage) -> Vec<TexturedPoint> {
    let Some(brightness) = &frame.brightness else { return Vec::new() };
    let picture = Picture::new(brightness.clone(), &frame.camera);
    let camera = picture.cameras[CELL_LEVEL];
    let squares_across = frame.columns.div_ceil(SPACING);
    let patches_across = squares_across.div_ceil(PATCH);
    let mut points = Vec::new();
    for square in 0..squares_across * frame.rows.div_ceil(SPACING) {
        let (left, top) = (square % squares_across * SPACING, square / squares_across * SPACING);
        // Smaller differences between pixels are noise.
        let mut best = (MIN_SIGMA * MIN_SIGMA, None);
        for row in top..(top + SPACING).min(frame.rows) {
            for column in left..(left + SPACING).min(frame.columns) {
                let [across, along] = brightness.gradient(CELL_LEVEL, column, row).unwrap_or_default();
                let sq_steepness = across * across + along * along;
                if sq_steepness > best.0
                    && let Some(surfel) = &frame.cells[row * frame.columns + column]
                {
                    best = (sq_steepness, Some((column, row, surfel)));
                }
            }
        }
        let Some((column, row, surfel)) = best.1 else { continue };
        let ray = camera.ray(column as f64, row as f64);
        let point = ray * (surfel.normal.dot(&surfel.point) / surfel.normal.dot(&ray));
        let value = |level: usize| Some(picture.look(level, &point)?.0);
        let [Some(fine), Some(middle), Some(coarse)] = [value(0), value(1), value(2)] else { continue };
        let patch = (top / SPACING / PATCH * patches_across + left / SPACING / PATCH) as u32;
        points.push(TexturedPoint { point, patch, values: [fine, middle, coarse] });
    }
    points
}
