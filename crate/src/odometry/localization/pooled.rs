//! Values of cells, and their maxima over squares of several sizes: bounds of what blocks of poses score.
//!
//! Hess et al., "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016, section V.B, with sizes between the powers of two as well: a block
//! of poses that turns, too, moves far returns over more cells than near ones.

/// Sides of the squares, in cells. Each is at most twice the one before.
pub(super) const SIDES: [i32; 12] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64];

/// Cells before the first one from which the largest squares still reach into the map. All layers begin there, so that one offset leads
/// from a pose to a return in any of them.
const MARGIN: i32 = SIDES[SIDES.len() - 1] - 1;

/// Values of cells with their maxima.
#[derive(Debug, Clone)]
pub(super) struct Pooled {
    /// Cells along x and y.
    size: (i32, i32),
    /// The layers one after the other, each row by row with its margin.
    values: Vec<u8>,
    /// The value of cells outside.
    outside: u8,
}

/// Cells from the least to the largest along x and y: `[x, to_x, y, to_y]`.
pub(super) type Reach = [i32; 4];

impl Pooled {
    /// Of the cells' values, row by row.
    pub(super) fn new(cells: &[u8], width: usize, outside: u8) -> Self {
        let count = |count: usize| i32::try_from(count).unwrap_or(i32::MAX - MARGIN);
        let size = (count(width), count(cells.len() / width.max(1)));
        let mut pooled = Self { size, values: Vec::new(), outside };
        pooled.values.reserve_exact(pooled.area() * SIDES.len());
        pooled.values.resize(pooled.area(), outside);
        for (y, row) in cells.chunks(width.max(1)).enumerate() {
            let first = pooled.offset(0, 0, count(y)) as usize;
            pooled.values[first..][..width].copy_from_slice(row);
        }
        for layer in 1..SIDES.len() {
            pooled.add_layer(layer);
        }
        pooled
    }

    /// Cells along x and y.
    pub(super) fn size(&self) -> (i32, i32) {
        self.size
    }

    /// Cells from one row of a layer to the next.
    fn stride(&self) -> i32 {
        self.size.0 + MARGIN
    }

    /// Cells of a layer.
    fn area(&self) -> usize {
        self.stride() as usize * (self.size.1 + MARGIN) as usize
    }

    /// The largest value of the square of `SIDES[layer]` cells that begins at this one.
    pub(super) fn max(&self, layer: usize, x: i32, y: i32) -> u32 {
        if self.holds(&[x, x, y, y]) { self.at(self.offset(layer, x, y)) } else { u32::from(self.outside) }
    }

    /// Whether the layers have values for all of these cells.
    pub(super) fn holds(&self, &[x, to_x, y, to_y]: &Reach) -> bool {
        x.min(y) >= -MARGIN && to_x < self.size.0 && to_y < self.size.1
    }

    /// Where the value of a cell in a layer is, if [`holds`](Self::holds) is true of it. Wraps around, so that offsets of cells outside add up, too.
    pub(super) fn offset(&self, layer: usize, x: i32, y: i32) -> u32 {
        ((layer * self.area()) as u32 + (MARGIN * self.stride() + MARGIN) as u32).wrapping_add(self.shift(x, y))
    }

    /// What a shift by so many cells adds to an offset.
    pub(super) fn shift(&self, x: i32, y: i32) -> u32 {
        y.wrapping_mul(self.stride()).wrapping_add(x) as u32
    }

    /// The value at an offset.
    #[inline]
    pub(super) fn at(&self, offset: u32) -> u32 {
        u32::from(self.values[offset as usize])
    }

    /// The maxima over the squares of a layer, by those of the layer below.
    fn add_layer(&mut self, layer: usize) {
        let more = SIDES[layer] - SIDES[layer - 1];
        let at = |x: i32, y: i32| self.max(layer - 1, x, y) as u8;
        let value = |(x, y): (i32, i32)| at(x, y).max(at(x + more, y)).max(at(x, y + more)).max(at(x + more, y + more));
        let cells = (-MARGIN..self.size.1).flat_map(|y| (-MARGIN..self.size.0).map(move |x| (x, y)));
        let values: Vec<u8> = cells.map(value).collect();
        self.values.extend(values);
    }
}

/// The layer of the smallest squares with at least this side; `None` where none is as large.
pub(super) fn layer_of(side: i32) -> Option<usize> {
    SIDES.iter().position(|&of_layer| of_layer >= side)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_layer_holds_the_maxima_of_its_squares() {
        let (width, height) = (13, 9);
        let values: Vec<u8> = (0..width * height).map(|i| ((i * 37 + i * i * 11) % 251) as u8).collect();
        let pooled = Pooled::new(&values, width as usize, 90);
        for (layer, side) in SIDES.into_iter().enumerate() {
            for (x, y) in (-side - 1..=width).flat_map(|x| (-side - 1..=height).map(move |y| (x, y))) {
                let square = (0..side * side).map(|i| pooled.max(0, x + i % side, y + i / side));
                assert_eq!(pooled.max(layer, x, y), square.max().unwrap(), "side {side} at {x}, {y}");
            }
        }
    }
}
