//! The points of a view by cell, in the memory layout in which vector units find the nearest of nine neighbouring cells.

use glam::Vec4;

/// A point in every cell, infinitely far away in empty ones, with a border of empty cells around the image.
#[derive(Clone)]
pub(super) struct CellPoints {
    /// Distance from one row to the next (cells).
    stride: usize,
    /// x, y and z (m), row by row.
    axes: [Vec<f32>; 3],
}

/// The nearest point: its cell relative to the one before the query's own, and the squared distance (m^2).
pub(super) struct Nearest {
    pub(super) row: usize,
    pub(super) column: usize,
    pub(super) sq_distance: f32,
}

/// Cells beside each row: three are loaded as four, so there is one before the row and two behind it.
const PADDING: usize = 3;
/// Added to four squared distances to exclude the fourth.
const EXCLUDE_FOURTH: Vec4 = Vec4::new(0.0, 0.0, 0.0, f32::INFINITY);

impl CellPoints {
    /// Empty cells.
    pub(super) fn new(width: usize, height: usize) -> Self {
        let stride = width + PADDING;
        // The last of four lies behind the last row.
        let axis = || vec![f32::INFINITY; stride * (height + 2) + 1];
        Self { stride, axes: [axis(), axis(), axis()] }
    }

    /// The x, y and z of a row of cells.
    #[inline]
    pub(super) fn row(&mut self, row: usize) -> [&mut [f32]; 3] {
        let first = (row + 1) * self.stride + 1;
        let width = self.stride - PADDING;
        self.axes.each_mut().map(|axis| &mut axis[first..first + width])
    }

    /// Memory on the heap (bytes).
    pub(super) fn num_bytes(&self) -> usize {
        self.axes.iter().map(|axis| size_of::<f32>() * axis.capacity()).sum()
    }

    /// The nearest point to a query in and around its cell, within a limit (squared, m^2); the first of several.
    #[inline]
    pub(super) fn nearest(&self, query: &[f32; 3], column: usize, row: usize, sq_limit: f32) -> Option<Nearest> {
        let first = row * self.stride + column;
        let above = self.sq_distances(query, first);
        let beside = self.sq_distances(query, first + self.stride);
        let below = self.sq_distances(query, first + 2 * self.stride);
        let sq_distance = above.min(beside).min(below).min_element();
        if sq_distance >= sq_limit {
            return None;
        }
        let is_there = |row: Vec4| row.cmpeq(Vec4::splat(sq_distance)).bitmask();
        let place = (is_there(above) | is_there(beside) << 4 | is_there(below) << 8).trailing_zeros() as usize;
        Some(Nearest { row: place / 4, column: place % 4, sq_distance })
    }

    /// Squared distances (m^2) of a query from three neighbouring cells, and infinity.
    #[inline]
    fn sq_distances(&self, query: &[f32; 3], first: usize) -> Vec4 {
        let [xs, ys, zs] = &self.axes;
        let x = Vec4::from_slice(&xs[first..first + 4]) - Vec4::splat(query[0]);
        let y = Vec4::from_slice(&ys[first..first + 4]) - Vec4::splat(query[1]);
        let z = Vec4::from_slice(&zs[first..first + 4]) - Vec4::splat(query[2]);
        x * x + y * y + z * z + EXCLUDE_FOURTH
    }
}
