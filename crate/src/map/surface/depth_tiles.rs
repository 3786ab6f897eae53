//! Between which depths an image measures the field, by tiles of its pixels, by tiles of four of those, and so on.

use super::pixels::NUM_LEVELS;

/// Up to where all rays are free, and up to where the field of each level is measured (m).
pub(super) type Depths = [f32; 1 + NUM_LEVELS];

/// Side of the smallest tiles (pixels): those of two leave no more parts of blocks out.
const TILE: usize = 4;

/// Up to where rays along which nothing is measured are free (m).
pub(super) const fn free_up_to(depth: f32) -> Depths {
    let mut depths = [f32::NEG_INFINITY; 1 + NUM_LEVELS];
    depths[0] = depth;
    depths
}

/// The tiles of an image, with what holds for all of their pixels.
#[derive(Debug, Clone)]
pub(super) struct DepthTiles {
    width: usize,
    height: usize,
    /// Side of the smallest tiles (pixels).
    tile: usize,
    /// From the smallest tiles on, each with tiles twice as large.
    levels: Vec<Level>,
}

#[derive(Debug, Clone)]
struct Level {
    columns: usize,
    rows: usize,
    depths: Vec<Depths>,
}

/// A rectangle of an image (pixels), ends included.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rectangle {
    pub low: [f32; 2],
    pub high: [f32; 2],
}

impl DepthTiles {
    /// Of an image that is read row by row: `read(column, row)` tells the depths of a pixel.
    pub(super) fn new(width: usize, height: usize, mut read: impl FnMut(usize, usize) -> Depths) -> Self {
        let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
        let mut depths = vec![free_up_to(f32::INFINITY); columns * rows];
        for row in 0..height {
            let tiles = &mut depths[row / TILE * columns..][..columns];
            for column in 0..width {
                let tile = &mut tiles[column / TILE];
                *tile = joined(*tile, read(column, row));
            }
        }
        let mut levels = vec![Level { columns, rows, depths }];
        while let Some(last) = levels.last().filter(|last| last.columns * last.rows > 1) {
            levels.push(last.halved());
        }
        Self { width, height, tile: TILE, levels }
    }

    /// The same without the smallest tiles: a quarter of the memory.
    pub(super) fn without_smallest(&self) -> Self {
        let (skipped, tile) = if self.levels.len() > 1 { (1, 2 * self.tile) } else { (0, self.tile) };
        Self { tile, levels: self.levels[skipped..].to_vec(), ..*self }
    }

    /// The depths between which the field is measured in a rectangle, and whether that lies wholly in the image.
    #[inline]
    pub(super) fn depths(&self, rectangle: &Rectangle) -> (Depths, bool) {
        let Rectangle { low: [left, top], high: [right, bottom] } = *rectangle;
        let (width, height) = (self.width as f32, self.height as f32);
        if !(right >= 0.0 && left < width && bottom >= 0.0 && top < height) {
            return (free_up_to(0.0), false);
        }
        let is_inside = left >= 0.0 && right < width && top >= 0.0 && bottom < height;
        let [left, top] = [left as usize / self.tile, top as usize / self.tile];
        let [right, bottom] =
            [(right as usize).min(self.width - 1) / self.tile, (bottom as usize).min(self.height - 1) / self.tile];
        // At the level where it has at most two tiles along each side.
        let extent = (right - left).max(bottom - top);
        let level = ((usize::BITS - extent.saturating_sub(1).leading_zeros()) as usize).min(self.levels.len() - 1);
        let Level { columns, depths, .. } = &self.levels[level];
        let mut all = free_up_to(f32::INFINITY);
        for row in top >> level..=bottom >> level {
            for tile in &depths[row * columns..][left >> level..=right >> level] {
                all = joined(all, *tile);
            }
        }
        (all, is_inside)
    }
}

impl Level {
    fn halved(&self) -> Self {
        let (columns, rows) = (self.columns.div_ceil(2), self.rows.div_ceil(2));
        let mut depths = vec![free_up_to(f32::INFINITY); columns * rows];
        for (row, tiles) in self.depths.chunks_exact(self.columns).enumerate() {
            for (column, tile) in tiles.iter().enumerate() {
                let larger = &mut depths[row / 2 * columns + column / 2];
                *larger = joined(*larger, *tile);
            }
        }
        Self { columns, rows, depths }
    }
}

#[inline]
fn joined(a: Depths, b: Depths) -> Depths {
    // Comparisons, as `f32::min` is a call without an instruction for it.
    std::array::from_fn(|at| if (a[at] < b[at]) == (at == 0) { a[at] } else { b[at] })
}
