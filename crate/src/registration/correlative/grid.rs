//! A target drawn into a pyramid of likelihoods.

use std::cell::OnceCell;

use nalgebra::Vector2;

use crate::geometry::{Pose2, RigidMotion};

/// Side of a cell (m).
pub const RESOLUTION: f64 = 0.1;
/// Standard deviation of the likelihood around a target point, at cells of [`RESOLUTION`] (m).
const SIGMA: f64 = 0.12;
/// Levels of the pyramid; an entry of the coarsest is the maximum of 2^5 x 2^5 cells.
pub(super) const NUM_LEVELS: usize = 6;
/// Most cells of a grid; a larger target gets larger cells.
const MAX_CELLS: f64 = 4e6;
/// Blocks of a row that are scored together: their sums, of 16 bits each, fill a vector of WebAssembly.
pub(super) const LANES: usize = 8;
/// Zeros on either side of a row of blocks, as many as are scored together.
#[allow(clippy::cast_possible_wrap, reason = "a handful")]
const PADDING: i32 = LANES as i32;
/// Blocks across the largest squares.
pub(super) const MAX_SQUARE: i32 = 8;

/// A target drawn into a pyramid of likelihoods. Levels are computed on first use.
pub struct LikelihoodGrid {
    pub(super) resolution: f64,
    /// Standard deviation of the likelihood around a target point (m).
    sigma: f64,
    /// Position of the corner of cell (0, 0) (m).
    corner: Vector2<f64>,
    pub(super) width: i32,
    pub(super) height: i32,
    /// `levels[h][y * width + x]` is the largest likelihood in the 2^h x 2^h cells from (x, y) on.
    levels: [OnceCell<Vec<u8>>; NUM_LEVELS],
    /// The same by rows of blocks.
    rows: [OnceCell<BlockRows>; NUM_LEVELS],
    /// `squares[h][n - 1]` holds for each block of 2^h x 2^h cells the largest likelihood in the square of n blocks from it on.
    squares: [[OnceCell<BlockRows>; MAX_SQUARE as usize]; NUM_LEVELS],
}

impl LikelihoodGrid {
    /// Draws target points (m, finite).
    pub fn new(points: &[Vector2<f64>]) -> Self {
        Self::with_resolution(points, RESOLUTION)
    }

    /// The same in cells of another side (m); the likelihood is as much wider as they are.
    pub fn with_resolution(points: &[Vector2<f64>], resolution: f64) -> Self {
        let (low, high) = points.iter().fold(
            (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY)),
            |(low, high): (Vector2<f64>, Vector2<f64>), p| (low.inf(p), high.sup(p)),
        );
        let mut grid = Self {
            resolution,
            sigma: SIGMA * (resolution / RESOLUTION),
            corner: Vector2::zeros(),
            width: 0,
            height: 0,
            levels: Default::default(),
            rows: Default::default(),
            squares: Default::default(),
        };
        let mut reach = 0;
        if !points.is_empty() {
            let extent = high - low;
            grid.resolution = resolution.max((extent.x * extent.y / MAX_CELLS).sqrt()).max(extent.amax() / MAX_CELLS);
            reach = (3.0 * grid.sigma / grid.resolution).ceil() as i32;
            // Sliding maxima reach up to 2^h - 1 cells to the lower left of the first drawn cell.
            let margin = reach + (1 << (NUM_LEVELS - 1));
            grid.corner = low - Vector2::repeat(grid.resolution * margin as f64);
            grid.width = (extent.x / grid.resolution) as i32 + 2 + margin + reach;
            grid.height = (extent.y / grid.resolution) as i32 + 2 + margin + reach;
        }
        let finest = grid.draw(points, reach);
        grid.levels[0] = OnceCell::from(finest);
        grid
    }

    /// The cell in which a point of the target's frame (m) lies.
    #[inline]
    pub(super) fn cell(&self, point: &Vector2<f64>) -> (i32, i32) {
        let cell = (point - self.corner) / self.resolution;
        (floor(cell.x), floor(cell.y))
    }

    /// Likelihood 255 * exp(-d^2 / 2 sigma^2), by the distance d of a cell to the nearest cell with a point.
    fn draw(&self, points: &[Vector2<f64>], reach: i32) -> Vec<u8> {
        let side = 2 * reach as usize + 1;
        let stamp: Vec<u8> = (0..side * side)
            .map(|cell| {
                let (dx, dy) = ((cell % side) as f64 - reach as f64, (cell / side) as f64 - reach as f64);
                let sq_distance = (dx * dx + dy * dy) * self.resolution * self.resolution;
                (255.0 * (-sq_distance / (2.0 * self.sigma * self.sigma)).exp()) as u8
            })
            .collect();
        let width = self.width as usize;
        let mut cells = vec![0u8; width * self.height as usize];
        for point in points {
            let (x, y) = self.cell(point); // at least `reach` cells away from every border
            let first = (y - reach) as usize * width + (x - reach) as usize;
            for (row, stamp_row) in stamp.chunks_exact(side).enumerate() {
                maximum(&mut cells[first + row * width..][..side], stamp_row);
            }
        }
        cells
    }

    /// A level of the pyramid.
    pub(super) fn level(&self, level: usize) -> &[u8] {
        self.levels[level].get_or_init(|| self.sliding_maximum(self.level(level - 1), 1 << (level - 1)))
    }

    /// A level by rows of blocks.
    pub(super) fn block_rows(&self, level: usize) -> &BlockRows {
        self.rows[level].get_or_init(|| BlockRows::new(self, level))
    }

    /// Columns and rows of blocks of a level, with [`MAX_SQUARE`] empty ones before them: squares reach from there onto the grid.
    pub(super) fn size_in_blocks(&self, level: usize) -> (i32, i32) {
        let blocks = |cells: i32| ((cells + (1 << level) - 1) >> level) + MAX_SQUARE;
        (blocks(self.width), blocks(self.height))
    }

    /// For each block of a level the largest likelihood in the square of so many blocks across from it on.
    pub(super) fn squares(&self, level: usize, width: usize) -> &BlockRows {
        self.squares[level][width - 1].get_or_init(|| match width {
            1 => BlockRows::of_blocks(self, level),
            _ => self.squares(level, width - 1).one_wider(),
        })
    }

    /// The largest of four squares of a finer level, `shift` cells apart; whole rows at once.
    fn sliding_maximum(&self, finer: &[u8], shift: usize) -> Vec<u8> {
        let width = self.width as usize;
        let mut coarser = finer.to_vec();
        if width == 0 {
            return coarser;
        }
        for (row, finer_row) in coarser.chunks_exact_mut(width).zip(finer.chunks_exact(width)) {
            let overlap = width.saturating_sub(shift);
            maximum(&mut row[..overlap], &finer_row[width - overlap..]);
        }
        for first in (0..coarser.len()).step_by(width) {
            let (rows, below) = coarser.split_at_mut((first + shift * width).min(finer.len()));
            if let Some(row_below) = below.get(..width) {
                maximum(&mut rows[first..first + width], row_below); // upwards: the rows below are not written yet
            }
        }
        coarser
    }

    /// The entry of a level at a cell, which may lie off the grid: nothing is there.
    pub(super) fn likelihood(&self, level: usize, x: i32, y: i32) -> u32 {
        if x < 0 || y < 0 || x >= self.width || y >= self.height {
            return 0;
        }
        u32::from(self.level(level)[y as usize * self.width as usize + x as usize])
    }

    /// Mean likelihood of a source's points at a pose, 0..=1.
    pub fn score(&self, source: &[Vector2<f64>], T_target_source: &Pose2) -> f64 {
        let likelihood = |point| {
            let (x, y) = self.cell(&T_target_source.act(point));
            self.likelihood(0, x, y)
        };
        source.iter().map(likelihood).sum::<u32>() as f64 / (255.0 * source.len().max(1) as f64)
    }
}

/// A level of the pyramid in another order: entries that are `stride` cells apart in a row are adjacent, so that [`LANES`]
/// blocks of a row are read in one step. Rows begin and end with zeros.
pub(super) struct BlockRows {
    level: usize,
    /// Entries of a row, the zeros on both sides included.
    length: i32,
    height: i32,
    /// `cells[(offset * height + y) * length + PADDING + i]` is the level's entry at (i * stride + offset, y).
    cells: Vec<u8>,
}

/// Memory of [`BlockRows::add_to`], used again in the next call.
#[derive(Default)]
pub(super) struct Buffers {
    /// Rows of the points, and where their entries are.
    placed: Vec<(i32, i32)>,
    rows: Vec<[u16; LANES]>,
}

impl BlockRows {
    fn new(grid: &LikelihoodGrid, level: usize) -> Self {
        let (stride, width) = (1 << level, grid.width as usize);
        let (length, height) = ((grid.width >> level) + 1 + 2 * PADDING, grid.height);
        let mut cells = vec![0; stride * height as usize * length as usize];
        let mut rows = cells.chunks_exact_mut(length as usize);
        for offset in 0..stride {
            for row in grid.level(level).chunks_exact(width.max(1)) {
                let blocks = rows.next().into_iter().flat_map(|row| &mut row[PADDING as usize..]);
                for (block, &entry) in blocks.zip(row.iter().skip(offset).step_by(stride)) {
                    *block = entry;
                }
            }
        }
        Self { level, length, height, cells }
    }

    /// The blocks of a level alone, as cells.
    fn of_blocks(grid: &LikelihoodGrid, level: usize) -> Self {
        let (width, height) = grid.size_in_blocks(level);
        let length = width + 2 * PADDING;
        let mut cells = vec![0; (height * length) as usize];
        let level_rows = grid.level(level).chunks_exact(grid.width.max(1) as usize).step_by(1 << level);
        for (blocks, row) in cells.chunks_exact_mut(length as usize).skip(MAX_SQUARE as usize).zip(level_rows) {
            for (block, &entry) in
                blocks[(PADDING + MAX_SQUARE) as usize..].iter_mut().zip(row.iter().step_by(1 << level))
            {
                *block = entry;
            }
        }
        Self { level: 0, length, height, cells }
    }

    /// The largest of each cell, of those to the right of and below it, and of the one diagonal from it.
    fn one_wider(&self) -> Self {
        let mut cells = self.cells.clone();
        for shift in [1, self.length as usize, self.length as usize + 1] {
            let shift = shift.min(cells.len());
            let end = cells.len() - shift;
            maximum(&mut cells[..end], &self.cells[shift..]);
        }
        Self { cells, ..*self }
    }

    /// Adds to `sums[j][i]` the entries at (x + i * stride, y + j * stride) of points that are shifted, `count` times; nothing
    /// is off the grid. There are at most 257 points.
    pub(super) fn add_to(
        &self,
        sums: &mut [[u32; LANES]],
        points: &[(i32, i32)],
        (count, are_inside): (u32, bool),
        shift: (i32, i32),
        Buffers { placed, rows }: &mut Buffers,
    ) {
        placed.clear();
        for point in points {
            let (x, y) = (point.0 + shift.0, point.1 + shift.1);
            let (offset, first) = (x & ((1 << self.level) - 1), (x >> self.level) + PADDING);
            if first >= 0 && first <= self.length - PADDING {
                placed.push((y, (offset * self.height + y) * self.length + first));
            }
        }
        let step = self.length << self.level;
        rows.resize(sums.len(), [0; LANES]);
        for (row, of_row) in (0_i32..).zip(rows.iter_mut()) {
            let mut added = [0_u16; LANES];
            for &(y, first) in placed.iter() {
                // Negative ones wrap round to beyond the size.
                if are_inside || ((y + (row << self.level)) as u32) < self.height as u32 {
                    let entries = &self.cells[(first + row * step) as usize..][..LANES];
                    for lane in 0..LANES {
                        added[lane] += u16::from(entries[lane]);
                    }
                }
            }
            *of_row = added;
        }
        // Apart from the loop above, whose sums would otherwise be vectors of half as many lanes.
        for (sum, added) in sums.iter_mut().zip(rows) {
            for lane in 0..LANES {
                sum[lane] += count * u32::from(added[lane]);
            }
        }
    }
}

/// The largest whole number that is not above this.
#[inline]
fn floor(value: f64) -> i32 {
    let whole = value as i32;
    whole.saturating_sub(i32::from(value < f64::from(whole)))
}

/// Raises each of `values` to its counterpart in `others`.
fn maximum(values: &mut [u8], others: &[u8]) {
    for (value, &other) in values.iter_mut().zip(others) {
        *value = (*value).max(other);
    }
}
