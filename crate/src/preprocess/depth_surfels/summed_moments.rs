//! Sums over the pixels of any window of a depth image, from four look-ups, and the plane that fits them.

use super::{CELL_SIZE, DepthModel};
use crate::camera::pinhole::RayTable;
use crate::camera::{DepthImage, Pinhole};
use crate::geometry::scalar::larger;

/// Weighted sums over pixels: of w, wx, wy, wxx, wxy, wyy, wr, wxr, wyr, wrr with r = 1 / z.
pub(super) type Moments = [f64; 10];

/// Sums over the cells above and to the left: `(columns + 1) * (rows + 1)` of each, the first row and column zero.
pub(super) struct SummedMoments {
    pub columns: usize,
    pub rows: usize,
    sums: Vec<Moments>,
    /// Numbers of pixels with depth. They exclude many windows, and a table of their own stays in the processor's fastest memory.
    counts: Vec<u32>,
}

/// A window of cells.
#[derive(Clone, Copy)]
pub(super) struct Window {
    left: usize,
    right: usize,
    top: usize,
    bottom: usize,
}

impl Window {
    /// The cells up to `reach` from a cell.
    #[inline]
    pub fn around(column: usize, row: usize, reach: usize) -> Self {
        Self { left: column - reach, right: column + reach + 1, top: row - reach, bottom: row + reach + 1 }
    }
}

/// 1 / z = a x + b y + c over a window, with the mean square residual in units of the noise.
pub(super) struct InversePlane {
    pub a: f64,
    pub b: f64,
    pub c: f64,
    pub misfit: f64,
    pub num_pixels: f64,
}

impl SummedMoments {
    pub fn new(image: &DepthImage, usable: &[bool], camera: &Pinhole, model: &DepthModel) -> Self {
        let (columns, rows) = (image.width / CELL_SIZE, image.height / CELL_SIZE);
        let table = camera.ray_table();
        let weights = WeightTable::new(image, model);
        let stride = columns + 1;
        let mut sums = Vec::with_capacity(stride * (rows + 1));
        let mut counts = Vec::with_capacity(stride * (rows + 1));
        sums.resize(stride, [0.0; 10]);
        counts.resize(stride, 0);
        for row in 0..rows {
            let (mut left, mut count_left): (Moments, u32) = ([0.0; 10], 0);
            sums.push(left);
            counts.push(0);
            for column in 0..columns {
                let above = row * stride + column + 1;
                let (cell, count) = weights.moments_of_cell(image, usable, &table, column, row);
                let mut sum: Moments = sums[above];
                for index in 0..10 {
                    left[index] += cell[index];
                    sum[index] += left[index];
                }
                sums.push(sum);
                count_left += count;
                counts.push(counts[above] + count_left);
            }
        }
        Self { columns, rows, sums, counts }
    }

    /// Indices of the sums at the corners of a window.
    #[inline]
    fn corners(&self, Window { left, right, top, bottom }: Window) -> [usize; 4] {
        let (above, below) = (top * (self.columns + 1), bottom * (self.columns + 1));
        [below + right, above + right, below + left, above + left]
    }

    /// The number of pixels with depth in a window.
    #[inline]
    pub fn count(&self, window: Window) -> u32 {
        let [a, b, c, d] = self.corners(window);
        self.counts[a] - self.counts[b] - (self.counts[c] - self.counts[d])
    }

    /// The moments of a window.
    #[inline]
    pub fn moments(&self, window: Window) -> Moments {
        let [a, b, c, d] = self.corners(window).map(|corner| &self.sums[corner]);
        let mut between = [0.0; 10];
        for index in 0..10 {
            between[index] = a[index] - b[index] - c[index] + d[index];
        }
        between
    }
}

/// The weighted least squares plane through a window, none where the pixels do not span one.
pub(super) fn fit(window: &Moments, num_pixels: f64) -> Option<InversePlane> {
    let [w, wx, wy, wxx, wxy, wyy, wr, wxr, wyr, wrr] = *window;
    if num_pixels < 12.0 {
        return None;
    }
    // Tens of thousands of windows an image: one division for all.
    let inverse = 1.0 / w;
    let (x, y, r) = (wx * inverse, wy * inverse, wr * inverse);
    let (xx, xy, yy) = (wxx * inverse - x * x, wxy * inverse - x * y, wyy * inverse - y * y);
    let (xr, yr, rr) = (wxr * inverse - x * r, wyr * inverse - y * r, wrr * inverse - r * r);
    let determinant = xx * yy - xy * xy;
    if determinant <= 1e-6 * xx * yy {
        return None;
    }
    let inverse = 1.0 / determinant;
    let a = (xr * yy - yr * xy) * inverse;
    let b = (yr * xx - xr * xy) * inverse;
    let misfit = larger(0.0, rr - a * xr - b * yr) * w / num_pixels;
    Some(InversePlane { a, b, c: r - a * x - b * y, misfit, num_pixels })
}

/// For each raw value the weight w of r = 1 / z (the inverse of its variance), w r, w r r, and the number of pixels: 1, or 0 where
/// it means no depth. The last is for all values beyond the range.
struct WeightTable {
    weights: Vec<[f64; 4]>,
}

impl WeightTable {
    fn new(image: &DepthImage, model: &DepthModel) -> Self {
        let largest = image.largest();
        let weight = |value| match model.depth(value) {
            // d(1/z) = dz / z^2
            Some(depth) => {
                let (weight, r) = (depth.powi(4) / model.variance(depth), 1.0 / depth);
                [weight, weight * r, weight * r * r, 1.0]
            }
            None => [0.0; 4],
        };
        // Some cameras mark what they do not measure by the largest value.
        let last_in_range = (model.max_range / model.step).min(f64::from(largest)) as u16;
        Self { weights: (0..=last_in_range.saturating_add(1)).map(weight).chain([[0.0; 4]]).collect() }
    }

    /// The moments of one cell's pixels.
    #[inline]
    fn moments_of_cell(
        &self,
        image: &DepthImage,
        usable: &[bool],
        rays: &RayTable,
        column: usize,
        row: usize,
    ) -> (Moments, u32) {
        // All rays of a column share x, all of a row y: their factors are summed first.
        let mut by_column = [[0.0; 4]; CELL_SIZE];
        let (mut wy, mut wxy, mut wyy, mut wyr) = (0.0, 0.0, 0.0, 0.0);
        let xs = &rays.x[CELL_SIZE * column..][..CELL_SIZE];
        let beyond = self.weights.len() - 1;
        for v in CELL_SIZE * row..CELL_SIZE * (row + 1) {
            let start = v * image.width + CELL_SIZE * column;
            let (values, usable) = (&image.values[start..][..CELL_SIZE], &usable[start..][..CELL_SIZE]);
            let (mut w, mut wx, mut wr) = (0.0, 0.0, 0.0);
            for lane in 0..CELL_SIZE {
                // 0 stands for no depth.
                let value = if usable[lane] { values[lane] } else { 0 };
                let weights = &self.weights[usize::from(value).min(beyond)];
                for (sum, weight) in by_column[lane].iter_mut().zip(weights) {
                    *sum += weight;
                }
                w += weights[0];
                wx += weights[0] * xs[lane];
                wr += weights[1];
            }
            let y = rays.y[v];
            wy += w * y;
            wxy += wx * y;
            wyy += w * y * y;
            wyr += wr * y;
        }
        let (mut w, mut wx, mut wxx, mut wr, mut wxr, mut wrr, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (sums, x) in by_column.iter().zip(xs) {
            w += sums[0];
            wx += sums[0] * x;
            wxx += sums[0] * x * x;
            wr += sums[1];
            wxr += sums[1] * x;
            wrr += sums[2];
            count += sums[3];
        }
        ([w, wx, wy, wxx, wxy, wyy, wr, wxr, wyr, wrr], count as u32)
    }
}
