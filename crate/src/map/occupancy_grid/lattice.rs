//! The cells that a line passes.

use nalgebra::Vector2;

/// Where the cells of a grid are.
pub(super) struct Lattice {
    /// Side of a cell (m).
    pub resolution: f64,
    /// Corner of the grid (m).
    pub origin: Vector2<f64>,
    /// Cells in a row.
    pub width: usize,
}

impl Lattice {
    /// Visits the cells from one point to the one before the cell of another (Amanatides and Woo, "A fast voxel traversal
    /// algorithm for ray tracing", Eurographics 1987).
    #[inline]
    pub fn cells_between(&self, from: &Vector2<f64>, to: &Vector2<f64>, mut visit: impl FnMut(usize)) {
        let scale = |point: &Vector2<f64>| (point - self.origin) / self.resolution;
        let (start, end) = (scale(from), scale(to));
        let along = end - start;
        let cell = start.map(|value| value.floor() as i64);
        let last = end.map(|value| value.floor() as i64);
        let step = along.map(|value| if value >= 0.0 { 1i64 } else { -1 });
        let per_cell = along.map(|value| if value == 0.0 { f64::INFINITY } else { 1.0 / value.abs() });
        let border = |axis: usize| {
            let next =
                if step[axis] > 0 { cell[axis] as f64 + 1.0 - start[axis] } else { start[axis] - cell[axis] as f64 };
            if along[axis] == 0.0 { f64::INFINITY } else { next * per_cell[axis] }
        };
        let (mut next_x, mut next_y) = (border(0), border(1));
        let num_steps = (last - cell).abs().sum();
        let mut index = cell.y as usize * self.width + cell.x as usize;
        // A table instead of a branch, which would be mispredicted.
        let steps = [(step.x as isize, per_cell.x, 0.0), (step.y as isize * self.width.cast_signed(), 0.0, per_cell.y)];
        for _ in 0..num_steps {
            visit(index);
            let (stride, along_x, along_y) = steps[usize::from(next_y < next_x)];
            index = index.wrapping_add_signed(stride);
            next_x += along_x;
            next_y += along_y;
        }
    }
}
