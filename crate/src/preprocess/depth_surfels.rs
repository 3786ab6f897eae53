//! A depth image to pieces of surface, steps of coarse depth and silhouettes taken care of.
//!
//! A plane is linear in inverse depth: n . p = d with p = z (x, y, 1) gives 1 / z = (n . (x, y, 1)) / d. So a plane is
//! fitted to 1 / z over a window of pixels in closed form, from sums that summed-area tables (Crow 1984) give for any
//! window at the price of four look-ups. Around every cell the largest window counts that is a plane within the noise of
//! the depth. Small windows see the steps of coarse depth as planes that face the camera; large ones span many steps,
//! and the fit is on the surface to a fraction of a step. A window over a silhouette is no plane: mixed pixels drop out.

use nalgebra::Vector3;

use crate::camera::surfel_image::{Surfel, SurfelImage, cell_camera};
use crate::camera::{DepthImage, Pinhole};

/// How depth is measured: what the raw values mean and how far they are off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthModel {
    /// Metres a raw step.
    pub step: f64,
    /// What is added to a raw value to get the middle of the depths it stands for: 0.5 where depth was truncated to
    /// whole steps, 0 where it was rounded.
    pub offset: f64,
    /// Standard deviation of the depth over its square (1/m), beside that of the steps: the error of a camera that
    /// triangulates grows with the square of the depth.
    pub square_noise: f64,
    /// Nearer depths are dropped (m).
    pub min_range: f64,
    /// Farther depths are dropped (m).
    pub max_range: f64,
}

impl DepthModel {
    fn depth(&self, value: u16) -> Option<f64> {
        let depth = (f64::from(value) + self.offset) * self.step;
        (value > 0 && depth >= self.min_range && depth <= self.max_range).then_some(depth)
    }

    /// Variance of a depth: uniform within a step, and the camera's noise.
    fn variance(&self, depth: f64) -> f64 {
        self.step * self.step / 12.0 + (self.square_noise * depth * depth).powi(2) + MIN_NOISE * MIN_NOISE
    }
}

/// Surfaces are never flatter than this (m).
const MIN_NOISE: f64 = 1e-3;
/// Side of a cell (pixels).
pub const CELL_SIZE: usize = 4;
/// Windows reach this many cells beyond the middle one, the largest first.
const REACHES: [usize; 5] = [10, 6, 4, 2, 1];
/// A window is a plane when the mean square of its residuals is at most this many times the noise's.
const MAX_MISFIT: f64 = 1.5;
/// A cell belongs to its window's plane when its mean depth lies off by at most this many standard deviations.
const MAX_CELL_OFFSET: f64 = 1.5;
/// Normals less certain than this (rad) are none.
const MAX_NORMAL_DEVIATION: f64 = 0.2;
/// Surfaces seen at a cosine below this are too oblique.
const MIN_COSINE: f64 = 0.08;
/// Share of a window's pixels that have depth, at the least.
const MIN_FILLED: f64 = 0.6;
/// No surface is known better (m): walls bulge, lenses distort.
const MIN_DEVIATION: f64 = 2e-3;

/// Pieces of surface in cells of [`CELL_SIZE`] pixels. `usable` says of every pixel whether its depth is to be used.
pub fn depth_surfels(image: &DepthImage, usable: &[bool], camera: &Pinhole, model: &DepthModel) -> SurfelImage {
    let cells = cell_camera(camera, CELL_SIZE);
    let sums = SummedMoments::new(image, usable, camera, model);
    let mut surfels = vec![None; cells.width * cells.height];
    for (row, row_of_surfels) in surfels.chunks_exact_mut(cells.width.max(1)).enumerate() {
        for (column, surfel) in row_of_surfels.iter_mut().enumerate() {
            let ray = cells.ray(column as f64, row as f64);
            *surfel = sums.surfel(column, row, &ray, &cells, model);
        }
    }
    SurfelImage { camera: *camera, cell_size: CELL_SIZE, columns: cells.width, rows: cells.height, cells: surfels }
}

/// Weighted sums over pixels: of w, wx, wy, wxx, wxy, wyy, wr, wxr, wyr, wrr with r = 1 / z; the last is the number of
/// pixels.
type Moments = [f64; 11];

/// Sums of the moments over the cells above and to the left.
struct SummedMoments {
    columns: usize,
    rows: usize,
    /// `(columns + 1) * (rows + 1)`, the first row and column zero.
    sums: Vec<Moments>,
}

/// 1 / z = a x + b y + c over a window, with the mean square residual in units of the noise.
struct InversePlane {
    a: f64,
    b: f64,
    c: f64,
    misfit: f64,
    num_pixels: f64,
}

impl SummedMoments {
    fn new(image: &DepthImage, usable: &[bool], camera: &Pinhole, model: &DepthModel) -> Self {
        let (columns, rows) = (image.width / CELL_SIZE, image.height / CELL_SIZE);
        let table = camera.ray_table();
        let weights = WeightTable::new(image, model);
        let stride = columns + 1;
        let mut sums = vec![[0.0; 11]; stride * (rows + 1)];
        for row in 0..rows {
            let mut left: Moments = [0.0; 11];
            for column in 0..columns {
                let mut cell: Moments = [0.0; 11];
                for v in CELL_SIZE * row..CELL_SIZE * (row + 1) {
                    let y = table.y[v];
                    let start = v * image.width + CELL_SIZE * column;
                    let pixels = image.values[start..start + CELL_SIZE].iter().zip(&usable[start..start + CELL_SIZE]);
                    let (mut w, mut wx, mut wxx, mut wr, mut wxr, mut wrr, mut n) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
                    for ((&value, &usable), &x) in pixels.zip(&table.x[CELL_SIZE * column..]) {
                        let [weight, r] = weights.of(value);
                        if !usable || weight == 0.0 {
                            continue;
                        }
                        let (x_weight, r_weight) = (weight * x, weight * r);
                        w += weight;
                        wx += x_weight;
                        wxx += x_weight * x;
                        wr += r_weight;
                        wxr += x_weight * r;
                        wrr += r_weight * r;
                        n += 1.0;
                    }
                    let line = [w, wx, w * y, wxx, wx * y, w * y * y, wr, wxr, wr * y, wrr, n];
                    for (sum, value) in cell.iter_mut().zip(line) {
                        *sum += value;
                    }
                }
                let above = sums[row * stride + column + 1];
                let sum = &mut sums[(row + 1) * stride + column + 1];
                for index in 0..11 {
                    left[index] += cell[index];
                    sum[index] = above[index] + left[index];
                }
            }
        }
        Self { columns, rows, sums }
    }

    fn window(&self, columns: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> Moments {
        let at = |row: usize, column: usize| &self.sums[row * (self.columns + 1) + column];
        let (a, b) = (at(rows.end, columns.end), at(rows.start, columns.end));
        let (c, d) = (at(rows.end, columns.start), at(rows.start, columns.start));
        std::array::from_fn(|index| a[index] - b[index] - c[index] + d[index])
    }

    fn surfel(
        &self,
        column: usize,
        row: usize,
        ray: &Vector3<f64>,
        cells: &Pinhole,
        model: &DepthModel,
    ) -> Option<Surfel> {
        let cell = self.window(column..column + 1, row..row + 1);
        if cell[10] * 2.0 < (CELL_SIZE * CELL_SIZE) as f64 {
            return None;
        }
        for reach in REACHES {
            if column < reach || row < reach || column + reach >= self.columns || row + reach >= self.rows {
                continue;
            }
            let window = self.window(column - reach..column + reach + 1, row - reach..row + reach + 1);
            let side = (2 * reach + 1) * CELL_SIZE;
            let Some(plane) = fit(&window) else { continue };
            if plane.misfit > MAX_MISFIT || plane.num_pixels < MIN_FILLED * (side * side) as f64 {
                continue;
            }
            let r = plane.a * ray.x + plane.b * ray.y + plane.c;
            if r <= 0.0 {
                continue;
            }
            let depth = 1.0 / r;
            // Off in 1 / z by this much, in standard deviations of one pixel.
            let mean_offset = (cell[6] - plane.a * cell[1] - plane.b * cell[2] - plane.c * cell[0]) / cell[0];
            if mean_offset.abs() * depth * depth > MAX_CELL_OFFSET * model.variance(depth).sqrt() {
                return None;
            }
            return oriented(&plane, ray, depth, reach, cells, model);
        }
        None
    }
}

/// The piece of surface, if it is certain enough where it faces.
fn oriented(
    plane: &InversePlane,
    ray: &Vector3<f64>,
    depth: f64,
    reach: usize,
    cells: &Pinhole,
    model: &DepthModel,
) -> Option<Surfel> {
    // (a, b, c) = n / d: towards the camera it is the other way round.
    let gradient = Vector3::new(plane.a, plane.b, plane.c);
    let normal = -gradient / gradient.norm();
    let cosine = -normal.dot(ray) / ray.norm();
    if cosine < MIN_COSINE {
        return None;
    }
    let half_width = (reach as f64 + 0.5) / cells.fx; // as a tangent
    // Depths over the window differ by the slope of the plane: in steps.
    let slope = depth * depth * plane.a.abs().max(plane.b.abs());
    let steps = 2.0 * half_width * slope / model.step;
    // What the steps leave open shrinks with the number of them in the window; noise with the number of pixels.
    let step_deviation = model.step / 12f64.sqrt() / (1.0 + steps);
    let noise = model.square_noise * depth * depth / (plane.num_pixels / CORRELATED_PIXELS).max(1.0).sqrt();
    let deviation = step_deviation.hypot(noise);
    // Both ends of the window may be off by the deviation; its width lies across the line of sight.
    let normal_deviation = deviation / (half_width * depth) * cosine;
    if normal_deviation > MAX_NORMAL_DEVIATION {
        return None;
    }
    // An error in depth moves the point along the ray; the surface moves by its share along the normal.
    let along_normal = deviation * -normal.dot(ray);
    Some(Surfel { point: ray * depth, normal, deviation: along_normal.hypot(MIN_DEVIATION) })
}

/// Errors of triangulating cameras are the same over patches of about this many pixels.
const CORRELATED_PIXELS: f64 = 50.0;

/// The weighted least squares plane through a window, none where the pixels do not span one.
fn fit(window: &Moments) -> Option<InversePlane> {
    let [w, wx, wy, wxx, wxy, wyy, wr, wxr, wyr, wrr, num_pixels] = *window;
    if num_pixels < 12.0 {
        return None;
    }
    let (x, y, r) = (wx / w, wy / w, wr / w);
    let (xx, xy, yy) = (wxx / w - x * x, wxy / w - x * y, wyy / w - y * y);
    let (xr, yr, rr) = (wxr / w - x * r, wyr / w - y * r, wrr / w - r * r);
    let determinant = xx * yy - xy * xy;
    if determinant <= 1e-6 * xx * yy {
        return None;
    }
    let a = (xr * yy - yr * xy) / determinant;
    let b = (yr * xx - xr * xy) / determinant;
    let misfit = (rr - a * xr - b * yr).max(0.0) * w / num_pixels;
    Some(InversePlane { a, b, c: r - a * x - b * y, misfit, num_pixels })
}

/// For each raw value the weight of 1 / z, one over its variance, and 1 / z.
struct WeightTable {
    weights: Vec<[f64; 2]>,
}

impl WeightTable {
    fn new(image: &DepthImage, model: &DepthModel) -> Self {
        let largest = image.values.iter().copied().max().unwrap_or(0);
        let weight = |value| match model.depth(value) {
            // d(1/z) = dz / z^2
            Some(depth) => [depth.powi(4) / model.variance(depth), 1.0 / depth],
            None => [0.0, 0.0],
        };
        Self { weights: (0..=largest).map(weight).collect() }
    }

    fn of(&self, value: u16) -> [f64; 2] {
        self.weights[usize::from(value)]
    }
}
