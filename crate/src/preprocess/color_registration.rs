//! Whether the colours of a frame are registered to its depth image: depth discontinuities are then edges of the brightness.
//!
//! Many cameras take colours through a second lens. Unless its images are registered to the depth, colours are shifted by up to
//! dozens of pixels, the more the nearer the surface. Photometric registration then biases the estimate.

use serde::{Deserialize, Serialize};

use crate::camera::brightness::GREY_UNIT;
use crate::camera::{Brightness, DepthImage};
use crate::preprocess::depth_surfels::DepthModel;

/// Smallest step of depth at the outline of an object, as a share of the larger depth.
const MIN_OUTLINE_STEP: f64 = 0.1;
/// Most pixels without depth between the two sides of an outline: the part that is occluded for one lens.
const MAX_OUTLINE_GAP: usize = 24;
/// Largest distance from an outline at which an edge belongs to it (pixels of the finest brightness, which are two of the image).
const SAME_EDGE: usize = 1;
/// Smallest distance from an outline at which an edge lies beside it (pixels of the finest brightness).
const NEAREST_OTHER: usize = 5;
/// Largest distance from an outline at which edges beside it are compared with it (pixels of the finest brightness).
const FARTHEST_OTHER: usize = 24;
/// A slope (grey levels a pixel) is half of the difference of the two pixels beside one.
const SLOPE_UNIT: f64 = 0.5 * GREY_UNIT;
/// Bound of the slope of the brightness, 15 grey levels a pixel, so that single edges do not outweigh the others.
const MAX_SLOPE: u32 = (15.0 / SLOPE_UNIT) as u32;
/// Fewest outline pixels for a decision.
const MIN_OUTLINES: u64 = 300;
/// Smallest ratio of the slope on outlines to that beside them. Along the axis where it is smaller, it is 2.2 to 7 where colours are
/// registered (a Kinect, an Asus Xtion, rendered rooms), and 0.8 to 1.15 where they are not (a RealSense, two Kinects).
const MIN_CONTRAST: f64 = 1.6;

/// Slopes of the brightness on the outlines of objects and beside them, along the rows and along the columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct OutlineContrast {
    /// Number of outline pixels.
    num_outlines: [u64; 2],
    /// Sum of the mean slopes on each (grey levels a pixel).
    on_outlines: [u64; 2],
    /// Sum of the mean slopes beside each (grey levels a pixel).
    beside: [u64; 2],
}

impl OutlineContrast {
    /// Of one frame.
    #[inline(never)]
    pub fn new(image: &DepthImage, usable: &[bool], model: &DepthModel, brightness: &Brightness) -> Self {
        let (mut along_rows, mut along_columns) = (Vec::new(), Vec::new());
        let (in_rows, in_columns) = (SlopeSums::along_rows(brightness), SlopeSums::along_columns(brightness));
        // All lines at once, for memory lies row by row.
        let mut columns = vec![Outlines::default(); image.width.div_ceil(2)];
        let lines = image.values.chunks_exact(image.width.max(1)).zip(usable.chunks_exact(image.width.max(1)));
        for (row, (values, usable)) in lines.enumerate() {
            let measured = |column: usize| if usable[column] { values[column] } else { 0 };
            for column in (1..image.width).step_by(2) {
                if let Some(row) = columns[column / 2].at(row, measured(column), model) {
                    along_columns.extend(in_columns.at_outline(column / 2, row / 2));
                }
            }
            if row % 2 == 1 {
                let mut line = Outlines::default();
                let found = (0..image.width).filter_map(|column| line.at(column, measured(column), model));
                along_rows.extend(found.filter_map(|column| in_rows.at_outline(row / 2, column / 2)));
            }
        }
        let axes = [along_rows, along_columns];
        let sum = |of: fn(&[f64; 2]) -> f64| axes.each_ref().map(|slopes| slopes.iter().map(of).sum::<f64>() as u64);
        Self {
            num_outlines: axes.each_ref().map(|slopes| slopes.len() as u64),
            on_outlines: sum(|slopes| slopes[0]),
            beside: sum(|slopes| slopes[1]),
        }
    }

    /// Whether the outlines show, along either axis, that the colours are not registered to the depth.
    pub fn is_misaligned(&self) -> bool {
        (0..2).any(|axis| {
            self.num_outlines[axis] > MIN_OUTLINES
                && (self.on_outlines[axis] as f64) < MIN_CONTRAST * self.beside[axis] as f64
        })
    }
}

impl std::ops::AddAssign for OutlineContrast {
    fn add_assign(&mut self, other: Self) {
        for axis in 0..2 {
            self.num_outlines[axis] += other.num_outlines[axis];
            self.on_outlines[axis] += other.on_outlines[axis];
            self.beside[axis] += other.beside[axis];
        }
    }
}

/// Slopes of the finest brightness along its rows or columns, added up from the border on: the sum over any stretch of a line is a
/// difference of two.
struct SlopeSums {
    /// For each pixel the sum over those before it in its line, in [`SLOPE_UNIT`]s.
    sums: Vec<u32>,
    /// Lines, and pixels in each.
    size: [usize; 2],
    /// From a line to the next, and from a pixel to the next.
    strides: [usize; 2],
}

impl SlopeSums {
    fn along_rows(brightness: &Brightness) -> Self {
        let [(width, height, values), ..] = brightness.levels();
        let mut sums = vec![0; width * height];
        for (sums, values) in sums.chunks_exact_mut(width.max(1)).zip(values.chunks_exact(width.max(1))) {
            let mut sum = 0;
            for (next, pair) in sums.iter_mut().skip(2).zip(values.windows(3)) {
                sum += bounded_slope(pair[0], pair[2]);
                *next = sum;
            }
        }
        Self { sums, size: [height, width], strides: [width, 1] }
    }

    fn along_columns(brightness: &Brightness) -> Self {
        let [(width, height, values), ..] = brightness.levels();
        let mut sums = vec![0; width * height];
        for row in 2..height {
            let (before, sums) = sums[(row - 1) * width..(row + 1) * width].split_at_mut(width);
            let (above, below) = (&values[(row - 2) * width..][..width], &values[row * width..][..width]);
            for ((next, sum), (&above, &below)) in sums.iter_mut().zip(before).zip(above.iter().zip(below)) {
                *next = *sum + bounded_slope(above, below);
            }
        }
        Self { sums, size: [width, height], strides: [1, width] }
    }

    /// Mean slopes (grey levels a pixel) on and beside an outline at a pixel of a line; `None` where the image ends.
    fn at_outline(&self, line: usize, pixel: usize) -> Option<[f64; 2]> {
        let [num_lines, num_pixels] = self.size;
        let is_inside = (1..num_lines.saturating_sub(1)).contains(&line)
            && (FARTHEST_OTHER + 1..num_pixels.saturating_sub(FARTHEST_OTHER + 1)).contains(&pixel);
        if !is_inside {
            return None;
        }
        let before = |pixel: usize| self.sums[line * self.strides[0] + pixel * self.strides[1]];
        let mean = |first: usize, last: usize| {
            f64::from(before(last + 1) - before(first)) * SLOPE_UNIT / (last + 1 - first) as f64
        };
        let beside =
            mean(pixel - FARTHEST_OTHER, pixel - NEAREST_OTHER) + mean(pixel + NEAREST_OTHER, pixel + FARTHEST_OTHER);
        Some([mean(pixel - SAME_EDGE, pixel + SAME_EDGE), 0.5 * beside])
    }
}

/// The slope of the brightness at a pixel between these two (in [`SLOPE_UNIT`]s), bounded.
#[inline]
fn bounded_slope(before: u16, after: u16) -> u32 {
    u32::from(before.abs_diff(after)).min(MAX_SLOPE)
}

/// The search for the pixels of a row or column at which the depth steps.
#[derive(Clone, Copy, Default)]
struct Outlines {
    /// Index and raw value of the last pixel with depth, 0 before there is one, ...
    last: (usize, u16),
    /// ... and its depth (m).
    depth: f64,
}

impl Outlines {
    /// Takes the next pixel: whether there is a step between the last one with depth and this one. Returns the nearer of the two.
    #[inline]
    fn at(&mut self, place: usize, value: u16, model: &DepthModel) -> Option<usize> {
        let ((before, known), known_depth) = (self.last, self.depth);
        if value == 0 {
            return None;
        } else if value == known {
            self.last.0 = place;
            return None;
        }
        let depth = model.depth(value)?;
        *self = Self { last: (place, value), depth };
        let is_outline = known > 0
            && place - before <= MAX_OUTLINE_GAP
            && (depth - known_depth).abs() > MIN_OUTLINE_STEP * depth.max(known_depth);
        is_outline.then_some(if depth < known_depth { place } else { before })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::ColorImage;

    /// Contrast of dark boxes in front of a bright wall, whose colours lie `shift` pixels to the right of their depth.
    fn boxes(shift: usize) -> OutlineContrast {
        let (width, height) = (640, 480);
        let is_box = |column: usize, row: usize| column / 40 % 2 == 1 && row / 40 % 2 == 1;
        let of_pixel = |index: usize| (index % width, index / width);
        let depth = |index| if is_box(of_pixel(index).0, of_pixel(index).1) { 1500 } else { 2500 };
        let color = |index| {
            let (column, row) = of_pixel(index);
            // Both have a pattern of their own.
            let grey = 110 + 12 * ((column / 3 + row / 5) % 2) as u8;
            [if is_box(column.saturating_sub(shift), row) { grey - 60 } else { grey }; 3]
        };
        let image = DepthImage { width, height, bits: 16, values: (0..width * height).map(depth).collect() };
        let colors = ColorImage { width, height, pixels: (0..width * height).map(color).collect() };
        let model = DepthModel { step: 1e-3, offset: 0.0, square_noise: 0.0, min_range: 0.1, max_range: 10.0 };
        OutlineContrast::new(&image, &vec![true; width * height], &model, &Brightness::new(&colors))
    }

    #[test]
    fn shifted_colours_are_distinguished_from_registered_ones() {
        assert!(!boxes(0).is_misaligned(), "{:?}", boxes(0));
        assert!(boxes(14).is_misaligned(), "{:?}", boxes(14));
    }

    #[test]
    fn sums_give_the_means_of_the_slopes() {
        let (width, height) = (130, 124);
        let noise = |index: usize| [(index as u32).wrapping_mul(2_654_435_761).to_be_bytes()[0]; 3];
        let brightness =
            Brightness::new(&ColorImage { width, height, pixels: (0..width * height).map(noise).collect() });
        let sums = [SlopeSums::along_rows(&brightness), SlopeSums::along_columns(&brightness)];
        let mut num_places = 0;
        for (column, row) in (0..height).flat_map(|row| (0..width).map(move |column| (column, row))) {
            let places = [(row, column), (column, row)];
            for (axis, (sums, (line, pixel))) in sums.iter().zip(places).enumerate() {
                let slope = |off: isize| {
                    let moved = pixel.checked_add_signed(off)?;
                    let [column, row] = if axis == 0 { [moved, line] } else { [line, moved] };
                    let bound = f64::from(MAX_SLOPE) * SLOPE_UNIT;
                    Some(brightness.gradient(0, column, row)?[axis].abs().min(bound))
                };
                let mean = |offs: &[isize]| {
                    let slopes = offs.iter().map(|&off| slope(off)).collect::<Option<Vec<f64>>>()?;
                    Some(slopes.iter().sum::<f64>() / slopes.len() as f64)
                };
                let beside: Vec<isize> = (-24..=24_isize).filter(|off| off.abs() >= 5).collect();
                let expected = mean(&[-1, 0, 1]).zip(mean(&beside));
                let found = sums.at_outline(line, pixel);
                assert_eq!(found.is_some(), expected.is_some(), "axis {axis}, {line}, {pixel}");
                if let Some(([on, off], (expected_on, expected_off))) = found.zip(expected) {
                    assert!(
                        (on - expected_on).abs() < 1e-9 && (off - expected_off).abs() < 1e-9,
                        "axis {axis}, {line}, {pixel}"
                    );
                    num_places += 1;
                }
            }
        }
        assert!(num_places > 1000, "{num_places} places");
    }

    #[test]
    fn few_outlines_decide_nothing_and_those_of_all_frames_add_up() {
        let mut sum = OutlineContrast::default();
        assert!(!sum.is_misaligned());
        sum += boxes(14);
        let doubled = sum.num_outlines.map(|count| 2 * count);
        sum += boxes(14);
        assert!(sum.is_misaligned() && sum.num_outlines == doubled);
    }
}
