//! Batches of points that are added to a voxel map.
//!
//! Each step is done for all points of a batch before the next one, so that the arithmetic is vectorised and cache misses
//! overlap.

use glam::{Mat3A, Vec3, Vec3A};

use super::cell::{NORMAL_ZERO, packed, packed_color};
use super::grid::{Grid, MAX_COORDINATE};
use crate::geometry::scalar::ROUND_BY;

/// Points of a batch.
pub(super) const BATCH: usize = 64;

/// A batch of values for each axis.
type Axes<T> = [[T; BATCH]; 3];

/// Points of one frame: first in the sensor frame, after [`place`](Self::place) in the form that the map adds.
pub(super) struct Batch {
    len: usize,
    /// Positions in the sensor frame (m); once placed, relative to the voxel, in voxel sizes.
    positions: Axes<f32>,
    /// Normals in the sensor frame, of any length; once placed, in the world frame and as integers.
    normals: Axes<f32>,
    has_colors: bool,
    /// [`packed_color`]; 0 where the frame has no colours.
    colors: [u64; BATCH],
    /// The voxels of the points.
    corners: Axes<i32>,
    is_inside: [bool; BATCH],
}

/// A point in the form that its voxel adds.
pub(super) struct Point {
    /// Position relative to the voxel's corner, in voxel sizes.
    pub offset: Vec3,
    pub normal: u64,
    pub color: u64,
}

impl Batch {
    /// An empty batch of a frame with or without colours.
    pub(super) fn new(has_colors: bool) -> Self {
        Self {
            len: 0,
            positions: [[0.0; BATCH]; 3],
            normals: [[0.0; BATCH]; 3],
            has_colors,
            colors: [0; BATCH],
            corners: [[0; BATCH]; 3],
            is_inside: [false; BATCH],
        }
    }

    /// Adds a point; there is room for [`BATCH`]. The colour of a frame without colours is not used.
    #[inline]
    pub(super) fn push(&mut self, position: Vec3, normal: [f32; 3], color: [u8; 3]) {
        let at = self.len % BATCH;
        for axis in 0..3 {
            self.positions[axis][at] = position[axis];
            self.normals[axis][at] = normal[axis];
        }
        self.colors[at] = if self.has_colors { packed_color(color) } else { 0 };
        self.len = at + 1;
    }

    pub(super) fn is_full(&self) -> bool {
        self.len == BATCH
    }

    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// Transforms the points into the world; `R_world_normal` rotates normals and scales them to the integers of their sums.
    pub(super) fn place(&mut self, grid: &Grid, R_world_normal: &Mat3A) {
        let axes = |matrix: &Mat3A| [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        self.positions = transformed(&axes(&grid.R), grid.t, &self.positions);
        let zero = Vec3A::splat(ROUND_BY + NORMAL_ZERO as f32);
        self.normals = transformed(&axes(R_world_normal), zero, &self.normals);

        let [x, y, z] = &self.positions;
        for at in 0..BATCH {
            // NaN fails every comparison.
            let is_near =
                (x[at].abs() <= MAX_COORDINATE) & (y[at].abs() <= MAX_COORDINATE) & (z[at].abs() <= MAX_COORDINATE);
            let is_low = y[at] >= grid.least_y;
            self.is_inside[at] = is_near & is_low;
        }
        for (places, corners) in self.positions.iter_mut().zip(&mut self.corners) {
            for at in 0..BATCH {
                let rounded = places[at] + ROUND_BY;
                let whole = rounded - ROUND_BY;
                let excess = i32::from(whole > places[at]);
                corners[at] = rounded.to_bits().wrapping_sub(ROUND_BY.to_bits()).cast_signed() - excess;
                places[at] -= whole - excess as f32;
            }
        }
    }

    /// Indices in the batch of the points inside the map's bounds.
    #[inline]
    pub(super) fn inside(&self) -> impl Iterator<Item = usize> {
        (0..self.len).filter(|&at| self.is_inside[at])
    }

    /// The voxel of a placed point.
    #[inline]
    pub(super) fn corner(&self, at: usize) -> [i32; 3] {
        [self.corners[0][at], self.corners[1][at], self.corners[2][at]]
    }

    /// A placed point.
    #[inline]
    pub(super) fn point(&self, at: usize) -> Point {
        let at = at % BATCH;
        let [x, y, z] = [self.positions[0][at], self.positions[1][at], self.positions[2][at]];
        let normal = [0, 1, 2].map(|axis| self.normals[axis][at].to_bits().wrapping_sub(ROUND_BY.to_bits()));
        Point { offset: Vec3::new(x, y, z), normal: packed(normal), color: self.colors[at] }
    }
}

/// A matrix of these columns times vectors, plus `t`; in the order of terms of a single vector, so that results are equal.
fn transformed(columns: &[Vec3A; 3], t: Vec3A, [x, y, z]: &Axes<f32>) -> Axes<f32> {
    let mut turned = [[0.0; BATCH]; 3];
    for (axis, turned) in turned.iter_mut().enumerate() {
        let [a, b, c] = [columns[0][axis], columns[1][axis], columns[2][axis]];
        for at in 0..BATCH {
            turned[at] = a * x[at] + b * y[at] + c * z[at] + t[axis];
        }
    }
    turned
}
