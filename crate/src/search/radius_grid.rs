//! Answers whether there is a point within one fixed distance, mostly by one lookup in a grid.
//!
//! Each cell lies wholly within the distance of some point, wholly beyond the distance of all points, or neither. Only in the
//! last case is the k-d tree searched. The answers are exactly those of the tree.

use glam::Vec3;

use super::KdTree;

/// The distance in cells: slightly less than two, so that it reaches no cell more than two from the point's own, even with
/// rounding errors.
const CELLS_PER_DISTANCE: f32 = 1.998;
/// Bound of the relative rounding error of a squared distance in cells.
const MARGIN: f32 = 1e-3;
/// Cells that the distance may reach on either side of a point's own.
const CELL_REACH: usize = 2;
/// Cells along each axis of the cube that the distance may reach.
const WIDTH: usize = 2 * CELL_REACH + 1;
/// Largest grid (words of 16 bytes), which bounds its memory to 16 MB.
const MAX_WORDS: usize = 1 << 20;
/// Most cells along an axis: beyond, positions in cells are too inaccurate in single precision.
const MAX_CELLS_OF_AXIS: f32 = 2048.0;
/// Cells of a word.
const WORD: usize = u64::BITS as usize;

/// Answers whether a point of a tree lies within a distance (m).
pub struct RadiusGrid<'a> {
    tree: &'a KdTree<3>,
    distance: f32,
    cells_per_metre: f32,
    origin: Vec3,
    /// Cells along each axis; those along x fill whole words. All zero where there is no grid.
    size: [usize; 3],
    words: Vec<Cells>,
}

/// A row of cells along x, one bit a cell.
#[derive(Clone, Copy, Default)]
struct Cells {
    /// Some position in the cell may be within the distance of a point.
    maybe: u64,
    /// Every position in the cell is within the distance of a point.
    surely: u64,
}

impl<'a> RadiusGrid<'a> {
    /// A grid around `points` (m), from which `tree` was built. Where the grid would be too large, queries go to the tree.
    pub fn new(points: &[Vec3], tree: &'a KdTree<3>, distance: f32) -> Self {
        let cells_per_metre = CELLS_PER_DISTANCE / distance;
        let finite = || points.iter().copied().filter(|p| p.is_finite());
        let mut grid = Self { tree, distance, cells_per_metre, origin: Vec3::ZERO, size: [0; 3], words: Vec::new() };
        let (Some(low), Some(high)) = (finite().reduce(Vec3::min), finite().reduce(Vec3::max)) else { return grid };
        let cells = (high - low) * cells_per_metre + (WIDTH + 1) as f32;
        if !(distance > 0.0 && cells.max_element() < MAX_CELLS_OF_AXIS) {
            return grid;
        }
        let size = [(cells.x as usize + 1).next_multiple_of(WORD), cells.y as usize + 1, cells.z as usize + 1];
        let num_words = size[0] / WORD * size[1] * size[2];
        if num_words > MAX_WORDS {
            return grid;
        }
        grid.origin = low - (CELL_REACH as f32 + 0.5) / cells_per_metre;
        grid.size = size;
        grid.words = vec![Cells::default(); num_words];
        finite().for_each(|point| grid.mark(point));
        grid
    }

    /// Whether there is a grid; without one, queries go to the tree.
    pub fn has_cells(&self) -> bool {
        !self.words.is_empty()
    }

    /// Whether there is a point within the distance of `query` (m).
    #[inline]
    pub fn has_within(&self, query: Vec3) -> bool {
        if !self.has_cells() {
            return self.tree.has_within(&query.to_array(), self.distance);
        }
        let position = (query - self.origin) * self.cells_per_metre;
        let [width, height, depth] = self.size;
        // False where the query is NaN.
        let is_inside = position.min_element() >= 0.0
            && position.x < width as f32
            && position.y < height as f32
            && position.z < depth as f32;
        if !is_inside {
            return false;
        }
        let (x, y, z) = (position.x as usize, position.y as usize, position.z as usize);
        let cells = self.words[(z * height + y) * (width / WORD) + x / WORD];
        let bit = 1 << (x % WORD);
        cells.surely & bit != 0 || (cells.maybe & bit != 0 && self.tree.has_within(&query.to_array(), self.distance))
    }

    /// Marks the cells around a point.
    fn mark(&mut self, point: Vec3) {
        let position = (point - self.origin) * self.cells_per_metre;
        let cell = position.floor();
        let [(near_x, far_x), (near_y, far_y), (near_z, far_z)] =
            (position - cell).to_array().map(sq_distances_to_cells);
        let sq_distance = CELLS_PER_DISTANCE * CELLS_PER_DISTANCE;
        let (may, must) = (sq_distance * (1.0 + MARGIN), sq_distance * (1.0 - MARGIN));
        let (x, y, z) = (cell.x as usize - CELL_REACH, cell.y as usize - CELL_REACH, cell.z as usize - CELL_REACH);
        let words = self.size[0] / WORD;
        for dz in 0..WIDTH {
            for dy in 0..WIDTH {
                let near = near_z[dz] + near_y[dy];
                if near > may {
                    continue;
                }
                let far = far_z[dz] + far_y[dy];
                let row = |limit: f32, rest: f32, along: &[f32; WIDTH]| {
                    (0..WIDTH).map(|dx| u64::from(rest + along[dx] <= limit) << dx).sum::<u64>()
                };
                let (maybe, surely) = (row(may, near, &near_x), row(must, far, &far_x));
                let (word, shift) = (((z + dz) * self.size[1] + y + dy) * words + x / WORD, x % WORD);
                self.words[word].maybe |= maybe << shift;
                self.words[word].surely |= surely << shift;
                if shift > WORD - WIDTH {
                    self.words[word + 1].maybe |= maybe >> (WORD - shift);
                    self.words[word + 1].surely |= surely >> (WORD - shift);
                }
            }
        }
    }
}

/// Squared distances along one axis from a point, at `within` of its cell, to the nearest and to the farthest position of each
/// cell around it. All lengths are in cells.
fn sq_distances_to_cells(within: f32) -> ([f32; WIDTH], [f32; WIDTH]) {
    let mut nearest = [0.0; WIDTH];
    let mut farthest = [0.0; WIDTH];
    for step in 0..WIDTH {
        let low = step as f32 - CELL_REACH as f32 - within;
        let high = low + 1.0;
        let near = if low > 0.0 {
            low
        } else if high < 0.0 {
            high
        } else {
            0.0
        };
        let far = if -low > high { low } else { high };
        (nearest[step], farthest[step]) = (near * near, far * far);
    }
    (nearest, farthest)
}
