//! Whether the colours of a frame are registered to its depth image: depth discontinuities are then edges of the brightness.
//!
//! Many cameras take colours through a second lens. Unless its images are registered to the depth, colours are shifted by up to
//! dozens of pixels, the more the nearer the surface. Photometric registration then biases the estimate.

use serde::{Deserialize, Serialize};

use crate::camera::{Brightness, DepthImage};
use crate::preprocess::depth_surfels::DepthModel;

/// Smallest step of depth at the outline of an object, as a share of the larger depth.
const MIN_OUTLINE_STEP: f64 = 0.1;
/// Most pixels without depth between the two sides of an outline: the part that is occluded for one lens.
const MAX_OUTLINE_GAP: usize = 24;
/// Largest distance from an outline at which an edge belongs to it (pixels of the finest brightness, which are two of the image).
const SAME_EDGE: isize = 1;
/// Smallest distance from an outline at which an edge lies beside it (pixels of the finest brightness).
const NEAREST_OTHER: isize = 5;
/// Largest distance from an outline at which edges beside it are compared with it (pixels of the finest brightness).
const FARTHEST_OTHER: isize = 24;
/// Bound of the slope of the brightness (grey levels per pixel), so that single edges do not outweigh the others.
const MAX_BRIGHTNESS_SLOPE: f64 = 15.0;
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
    pub fn new(image: &DepthImage, usable: &[bool], model: &DepthModel, brightness: &Brightness) -> Self {
        let (mut along_rows, mut along_columns) = (Vec::new(), Vec::new());
        // All lines at once, for memory lies row by row.
        let mut columns = vec![Outlines::default(); image.width.div_ceil(2)];
        let lines = image.values.chunks_exact(image.width.max(1)).zip(usable.chunks_exact(image.width.max(1)));
        for (row, (values, usable)) in lines.enumerate() {
            let measured = |column: usize| if usable[column] { values[column] } else { 0 };
            for column in (1..image.width).step_by(2) {
                if let Some(row) = columns[column / 2].at(row, measured(column), model) {
                    let slope = |row: usize| Some(brightness.gradient(0, column / 2, row)?[1]);
                    along_columns.extend(slopes(row, slope));
                }
            }
            if row % 2 == 1 {
                let mut line = Outlines::default();
                let slope = |column: usize| Some(brightness.gradient(0, column, row / 2)?[0]);
                let found = (0..image.width).filter_map(|column| line.at(column, measured(column), model));
                along_rows.extend(found.filter_map(|column| slopes(column, slope)));
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

/// Mean slopes on and beside an outline at index `place` of a row or column; `None` where the image ends. `slope` is that of the
/// brightness, in its own pixels.
fn slopes(place: usize, slope: impl Fn(usize) -> Option<f64>) -> Option<[f64; 2]> {
    let mean = |off: std::ops::RangeInclusive<isize>| {
        let slopes =
            off.clone().map(|off| Some(slope((place / 2).checked_add_signed(off)?)?.abs().min(MAX_BRIGHTNESS_SLOPE)));
        Some(slopes.sum::<Option<f64>>()? / off.count() as f64)
    };
    let beside = mean(-FARTHEST_OTHER..=-NEAREST_OTHER)? + mean(NEAREST_OTHER..=FARTHEST_OTHER)?;
    Some([mean(-SAME_EDGE..=SAME_EDGE)?, 0.5 * beside])
}

/// The search for the pixels of a row or column at which the depth steps.
#[derive(Clone, Copy, Default)]
struct Outlines {
    /// Index and raw value of the last pixel with depth; 0 before there is one.
    last: (usize, u16),
}

impl Outlines {
    /// Takes the next pixel: whether there is a step between the last one with depth and this one. Returns the nearer of the two.
    #[inline]
    fn at(&mut self, place: usize, value: u16, model: &DepthModel) -> Option<usize> {
        let (before, known) = self.last;
        if value == 0 {
            return None;
        } else if value == known {
            self.last.0 = place;
            return None;
        }
        let depth = model.depth(value)?;
        self.last = (place, value);
        let known = model.depth(known)?;
        let is_outline =
            place - before <= MAX_OUTLINE_GAP && (depth - known).abs() > MIN_OUTLINE_STEP * depth.max(known);
        is_outline.then_some(if depth < known { place } else { before })
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
    fn few_outlines_decide_nothing_and_those_of_all_frames_add_up() {
        let mut sum = OutlineContrast::default();
        assert!(!sum.is_misaligned());
        sum += boxes(14);
        let doubled = sum.num_outlines.map(|count| 2 * count);
        sum += boxes(14);
        assert!(sum.is_misaligned() && sum.num_outlines == doubled);
    }
}
