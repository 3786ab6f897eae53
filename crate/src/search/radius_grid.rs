//! Whether there is a point within one fixed distance, for many queries: mostly a look at one cell of a grid.
//!
//! Each cell knows whether it lies wholly within the distance of some point, wholly outside that of all points, or
//! neither; only in the last case the points themselves are looked at. The answers are those of the tree, to the last bit.

use glam::Vec3;

use super::KdTree;

/// Cells a distance is long, but for a little: so no cell more than two off a point's own matters.
const CELLS: f32 = 1.998;
/// Rounding moves a point by less than this share of a squared distance.
const MARGIN: f32 = 1e-3;
/// Cells on either side of a point's own that the distance may reach.
const CELL_REACH: usize = 2;
const WIDTH: usize = 2 * CELL_REACH + 1;
/// Larger grids are not worth their memory (of 16 bytes a word), or too long for single precision.
const MAX_WORDS: usize = 1 << 20;
const MAX_CELLS_OF_AXIS: f32 = 2048.0;
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

/// A row of cells, one bit a cell.
#[derive(Clone, Copy, Default)]
struct Cells {
    /// A point may be within reach of some place in the cell.
    maybe: u64,
    /// A point is within reach of every place in the cell.
    surely: u64,
}

impl<'a> RadiusGrid<'a> {
    /// A grid around `points` (m), from which `tree` was built. Where it would be too large the tree alone answers.
    pub fn new(points: &[Vec3], tree: &'a KdTree<3>, distance: f32) -> Self {
        let cells_per_metre = CELLS / distance;
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

    /// Whether there is a grid: without one it is the tree that answers.
    pub fn has_cells(&self) -> bool {
        !self.words.is_empty()
    }

    /// Whether there is a point within the distance of `query` (m).
    #[inline]
    pub fn has_within(&self, query: Vec3) -> bool {
        if !self.has_cells() {
            return self.tree.has_within(&query.to_array(), self.distance);
        }
        let place = (query - self.origin) * self.cells_per_metre;
        let [width, height, depth] = self.size;
        // Not so for what is not a number.
        let is_inside =
            place.min_element() >= 0.0 && place.x < width as f32 && place.y < height as f32 && place.z < depth as f32;
        if !is_inside {
            return false;
        }
        let (x, y, z) = (place.x as usize, place.y as usize, place.z as usize);
        let cells = self.words[(z * height + y) * (width / WORD) + x / WORD];
        let bit = 1 << (x % WORD);
        cells.surely & bit != 0 || (cells.maybe & bit != 0 && self.tree.has_within(&query.to_array(), self.distance))
    }

    /// Marks the cells around a point.
    fn mark(&mut self, point: Vec3) {
        let place = (point - self.origin) * self.cells_per_metre;
        let cell = place.floor();
        let within = (place - cell).to_array();
        // Along each axis, from the point to the nearest and to the farthest place in the cells around.
        let mut nearest = [[0.0; WIDTH]; 3];
        let mut farthest = [[0.0; WIDTH]; 3];
        for axis in 0..3 {
            for step in 0..WIDTH {
                let low = step as f32 - CELL_REACH as f32 - within[axis];
                let high = low + 1.0;
                let near = if low > 0.0 {
                    low
                } else if high < 0.0 {
                    high
                } else {
                    0.0
                };
                let far = if -low > high { low } else { high };
                (nearest[axis][step], farthest[axis][step]) = (near * near, far * far);
            }
        }
        let (may, must) = (CELLS * CELLS * (1.0 + MARGIN), CELLS * CELLS * (1.0 - MARGIN));
        let (x, y, z) = (cell.x as usize - CELL_REACH, cell.y as usize - CELL_REACH, cell.z as usize - CELL_REACH);
        let words = self.size[0] / WORD;
        for dz in 0..WIDTH {
            for dy in 0..WIDTH {
                let near = nearest[2][dz] + nearest[1][dy];
                if near > may {
                    continue;
                }
                let far = farthest[2][dz] + farthest[1][dy];
                let row = |limit: f32, rest: f32, along: &[f32; WIDTH]| {
                    (0..WIDTH).map(|dx| u64::from(rest + along[dx] <= limit) << dx).sum::<u64>()
                };
                let (maybe, surely) = (row(may, near, &nearest[0]), row(must, far, &farthest[0]));
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
