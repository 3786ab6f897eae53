//! Values of cells, and their maxima over squares of several sizes: bounds of what blocks of poses score.
//!
//! Hess et al., "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016, section V.B, with sizes between the powers of two as well: a block
//! of poses that turns, too, moves far returns over more cells than near ones.

/// Sides of the squares, in cells. Each is at most twice the one before.
pub(super) const SIDES: [i32; 12] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64];

/// The maxima over squares of one size that begin at each cell, from `margin` cells before the first.
#[derive(Debug, Clone)]
struct Layer {
    width: i32,
    height: i32,
    margin: i32,
    values: Vec<u8>,
}

/// Values of cells with their maxima.
#[derive(Debug, Clone)]
pub(super) struct Pooled {
    layers: Vec<Layer>,
    /// The value of cells outside.
    outside: u8,
}

impl Pooled {
    /// Of the cells' values, row by row.
    pub(super) fn new(values: Vec<u8>, width: usize, outside: u8) -> Self {
        let height = values.len() / width.max(1);
        let cells = |count: usize| i32::try_from(count).unwrap_or(i32::MAX);
        let mut layers = vec![Layer { width: cells(width), height: cells(height), margin: 0, values }];
        for pair in SIDES.windows(2) {
            let below = &layers[layers.len() - 1];
            layers.push(below.widened(pair[1] - pair[0], outside));
        }
        Self { layers, outside }
    }

    /// Cells along x and y.
    pub(super) fn size(&self) -> (i32, i32) {
        (self.layers[0].width, self.layers[0].height)
    }

    /// The largest value of the square of `SIDES[layer]` cells that begins at this one.
    #[inline]
    pub(super) fn max(&self, layer: usize, x: i32, y: i32) -> u32 {
        u32::from(self.layers[layer].value(x, y).unwrap_or(self.outside))
    }
}

impl Layer {
    #[inline]
    fn value(&self, x: i32, y: i32) -> Option<u8> {
        let (x, y) = (x + self.margin, y + self.margin);
        // Negative ones wrap round to beyond the size.
        let is_inside = (x as u32) < self.width as u32 && (y as u32) < self.height as u32;
        is_inside.then(|| self.values[(y * self.width + x) as usize])
    }

    /// The maxima over squares whose sides are longer by `more`.
    fn widened(&self, more: i32, outside: u8) -> Self {
        let (width, height, margin) = (self.width + more, self.height + more, self.margin + more);
        let at = |x: i32, y: i32| self.value(x, y).unwrap_or(outside);
        let value = |(x, y): (i32, i32)| at(x, y).max(at(x + more, y)).max(at(x, y + more)).max(at(x + more, y + more));
        let cells = (0..height).flat_map(|y| (0..width).map(move |x| (x - margin, y - margin)));
        Self { width, height, margin, values: cells.map(value).collect() }
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
        let pooled = Pooled::new(values, width as usize, 90);
        for (layer, side) in SIDES.into_iter().enumerate() {
            for (x, y) in (-side - 1..=width).flat_map(|x| (-side - 1..=height).map(move |y| (x, y))) {
                let square = (0..side * side).map(|i| pooled.max(0, x + i % side, y + i / side));
                assert_eq!(pooled.max(layer, x, y), square.max().unwrap(), "side {side} at {x}, {y}");
            }
        }
    }
}
