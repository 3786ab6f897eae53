//! Where the pieces of a view lie, cell by cell: the nearest of a cell and the eight around it, as vector units find it.

use glam::Vec4;

/// A point in every cell, infinitely far away where nothing is seen, with a border of such cells around the image.
#[derive(Clone)]
pub(super) struct CellPoints {
    /// From one row to the next.
    stride: usize,
    /// x, y and z (m), row by row.
    axes: [Vec<f32>; 3],
}

/// The cell, counted from the one before the point's own, and the squared distance (m^2).
pub(super) struct Nearest {
    pub(super) row: usize,
    pub(super) column: usize,
    pub(super) sq_distance: f32,
}

/// A row of three cells is loaded as four, so there is one cell before each row and two behind it.
const AROUND: usize = 3;
/// Takes the fourth cell out.
const THREE: Vec4 = Vec4::new(0.0, 0.0, 0.0, f32::INFINITY);

impl CellPoints {
    /// Nothing in any cell.
    pub(super) fn new(width: usize, height: usize) -> Self {
        let stride = width + AROUND;
        // The last of four lies behind the last row.
        let axis = || vec![f32::INFINITY; stride * (height + 2) + 1];
        Self { stride, axes: [axis(), axis(), axis()] }
    }

    /// The x, y and z of a row of cells.
    #[inline]
    pub(super) fn row(&mut self, row: usize) -> [&mut [f32]; 3] {
        let first = (row + 1) * self.stride + 1;
        let width = self.stride - AROUND;
        self.axes.each_mut().map(|axis| &mut axis[first..first + width])
    }

    /// What it takes on the heap.
    pub(super) fn num_bytes(&self) -> usize {
        self.axes.iter().map(|axis| size_of::<f32>() * axis.capacity()).sum()
    }

    /// The nearest to a point in and around a cell, if it is nearer than a limit (squared, m^2); of those as near the first.
    #[inline]
    pub(super) fn nearest(&self, query: &[f32; 3], column: usize, row: usize, sq_limit: f32) -> Option<Nearest> {
        let sq_distances = |rows_on: usize| {
            let first = (row + rows_on) * self.stride + column;
            let [x, y, z] =
                [0, 1, 2].map(|axis| Vec4::from_slice(&self.axes[axis][first..first + 4]) - Vec4::splat(query[axis]));
            x * x + y * y + z * z + THREE
        };
        let rows = [0, 1, 2].map(sq_distances);
        let sq_distance = rows[0].min(rows[1]).min(rows[2]).min_element();
        let found = |row: usize| {
            let is_there = rows[row].cmpeq(Vec4::splat(sq_distance)).bitmask();
            (is_there != 0).then(|| Nearest { row, column: is_there.trailing_zeros() as usize, sq_distance })
        };
        if sq_distance < sq_limit { (0..3).find_map(found) } else { None }
    }
}
