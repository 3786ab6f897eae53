//! Depth images with the raw values of their files.

use serde::{Deserialize, Serialize};

use crate::geometry::quantile::{OUTLIER_SHARE, RANGE_END};

/// What the values of depth images are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum DepthValues {
    /// What the first image shows.
    ToldFromData,
    /// Depth along the optical axis.
    Depth,
    /// The same with the two bytes of a value in the other order.
    SwappedBytes,
    /// The largest value less the depth: near is bright.
    Inverted,
}

/// Raw depth values, row by row from the top; 0 means no measurement.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DepthImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` values.
    pub values: Vec<u16>,
    /// Bits of a value in the file: 8 (or fewer) or 16; or [`Self::METRES`].
    pub bits: u8,
}

impl DepthImage {
    /// `bits` of an image whose file holds metres as floating-point numbers; its values are millimetres.
    pub const METRES: u8 = 32;

    /// Whether the two bytes of each value are likely in the wrong order: adjacent pixels mostly see one surface, and their values
    /// differ far more in the wrong order.
    pub(crate) fn has_swapped_bytes(&self) -> bool {
        let swapped = |value: u16| value.swap_bytes();
        self.bits == 16 && self.roughness(|value| value) > MIN_SWAPPED_RATIO * self.roughness(swapped)
    }

    /// The image with its values made depth; nothing measured stays nothing.
    pub(crate) fn read_as(mut self, values: DepthValues) -> Self {
        let largest = self.largest_value();
        match values {
            DepthValues::ToldFromData | DepthValues::Depth => {}
            DepthValues::SwappedBytes => self.values.iter_mut().for_each(|value| *value = value.swap_bytes()),
            DepthValues::Inverted => {
                let measured = self.values.iter_mut().filter(|value| **value > 0);
                measured.for_each(|value| *value = largest - largest.min(*value));
            }
        }
        self
    }

    /// The largest value that the type can hold.
    pub(crate) fn largest_value(&self) -> u16 {
        if self.bits <= 8 { u16::from(u8::MAX) } else { u16::MAX }
    }

    /// Difference of neighbouring values in a row over their sum, 0..=1, over the whole image; without the largest value, which
    /// stands for no return in some images and is the same in either order of its bytes.
    #[inline(never)]
    fn roughness(&self, read: impl Fn(u16) -> u16) -> f64 {
        let rows = self.values.chunks_exact(self.width.max(1));
        let measured = 1..self.largest_value();
        let pairs =
            rows.flat_map(|row| row.windows(2)).filter(|pair| pair.iter().all(|value| measured.contains(value)));
        let (difference, sum) = pairs.fold((0, 0), |(difference, sum), pair| {
            let (a, b) = (u64::from(read(pair[0])), u64::from(read(pair[1])));
            (difference + a.abs_diff(b), sum + a + b)
        });
        difference as f64 / sum.max(1) as f64
    }

    /// Whether the farthest surface has the largest value that the type can hold, as in an image that was stretched to the full
    /// range. Where many more are cut off at that value, or it stands for no return, the values just below it are rarer.
    #[inline(never)]
    pub(crate) fn fills_range(&self) -> bool {
        let largest = match self.bits {
            16 => u16::MAX,
            8 => u16::from(u8::MAX),
            _ => return false,
        };
        let num_largest = self.values.iter().filter(|&&value| value == largest).count();
        let below = (RANGE_END * f64::from(largest)) as u16..largest;
        num_largest > 0 && num_largest < self.values.iter().filter(|value| below.contains(value)).count()
    }

    /// The value at which depth seems to be cut off: the largest one, which many pixels have and few have nearly. A flat wall that is
    /// rendered square on looks like that, too.
    pub(crate) fn cut_off(&self) -> Option<u16> {
        let largest = self.largest();
        let count = |value: u16| self.values.iter().filter(|&&other| other == value).count();
        let (num_largest, num_measured) = (count(largest), self.values.len() - count(0));
        if num_largest as f64 <= OUTLIER_SHARE * num_measured as f64 || largest >= self.largest_value() {
            return None;
        }
        let nearly = &self.histogram()[(CUT_OFF_FROM * f64::from(largest)) as usize..usize::from(largest)];
        (num_largest > MIN_CUT_OFF_RATIO * nearly.iter().max()?).then_some(largest)
    }

    /// The largest raw value.
    #[inline(never)]
    pub(crate) fn largest(&self) -> u16 {
        // Not by `Iterator::max`, which compares pixel by pixel.
        self.values.iter().fold(0, |largest, &value| largest.max(value))
    }

    /// Number of pixels of each raw value, up to the largest one.
    #[inline(never)]
    fn histogram(&self) -> Vec<usize> {
        let mut counts = vec![0; usize::from(self.largest()) + 1];
        for &value in &self.values {
            counts[usize::from(value)] += 1;
        }
        counts
    }

    /// The image in colours from near to far; `colors` may be of any encoding.
    pub fn picture(&self, colors: &[u32]) -> DepthPicture {
        let counts = self.histogram();
        let num_invalid = counts[0];
        let cut = (OUTLIER_SHARE * (self.values.len() - num_invalid) as f64) as usize;
        let mut measured = counts.iter().enumerate().skip(1);
        let past = |sum: &mut usize, count: usize| {
            *sum += count;
            *sum > cut
        };
        let (mut below, mut above) = (0, 0);
        let near = measured.clone().find(|&(_, &count)| past(&mut below, count)).map_or(0, |(value, _)| value);
        let far = measured.rfind(|&(_, &count)| past(&mut above, count)).map_or(0, |(value, _)| value);
        let last = colors.len().saturating_sub(1);
        let range = far.saturating_sub(near).max(1) as u64;
        let color_of = |value: usize| {
            let place = (value.saturating_sub(near) as u64 * last as u64 + range / 2) / range;
            if value == 0 { 0 } else { colors.get(last.min(place as usize)).copied().unwrap_or(0) }
        };
        let table: Vec<u32> = (0..counts.len()).map(color_of).collect();
        let pixels = self.values.iter().map(|&value| table[usize::from(value)]).collect();
        DepthPicture { pixels, near: near as u16, far: far as u16, num_invalid }
    }
}

/// Where depth is cut off, no value from this share of the limit on ...
const CUT_OFF_FROM: f64 = 0.9;
/// ... has so many pixels, by this factor. (Of 660 images as cameras and renderers gave them one in 25 at most, of walls that are
/// rendered square on.)
const MIN_CUT_OFF_RATIO: usize = 10;

/// Smallest ratio of the roughness of the values to that with swapped bytes for which their order is wrong. Measured on 227 images
/// of six recordings (D435, Kinects, renderings with 1,000 and 6,553.5 values per metre) and of generated flats: the right
/// order is smoother by a factor of 3.9 and more.
const MIN_SWAPPED_RATIO: f64 = 2.0;

/// A depth image in colours.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DepthPicture {
    /// Colours row by row, from the first for `near` to the last for `far`; 0 without a measurement.
    pub pixels: Vec<u32>,
    /// Raw value of the first colour, the first percentile; 0 where the image has no measurement.
    pub near: u16,
    /// Raw value of the last colour, the 99th percentile; 0 where the image has no measurement.
    pub far: u16,
    /// Number of pixels without a measurement.
    pub num_invalid: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(bits: u8, values: &[u16]) -> DepthImage {
        DepthImage { width: values.len(), height: 1, values: values.to_vec(), bits }
    }

    #[test]
    fn swapped_bytes_are_distinguished_from_a_surface() {
        let ramp: Vec<u16> = (0..640).map(|column| 1500 + 3 * column + column % 5).collect();
        let right = image(16, &ramp);
        let swapped = |image: DepthImage| image.read_as(DepthValues::SwappedBytes);
        assert!(!right.has_swapped_bytes() && swapped(right.clone()).has_swapped_bytes());
        // The largest value, which stands for no return, is the same in either order.
        let none = ramp.iter().enumerate().map(|(at, &value)| if at % 40 == 7 { u16::MAX } else { value });
        assert!(!image(16, &none.collect::<Vec<_>>()).has_swapped_bytes());
        // Where the order makes no difference it is left as it is.
        let (small, alike): (Vec<u16>, Vec<u16>) = (1..=250).map(|value| (value, 257 * value)).unzip();
        for values in [small, alike, vec![0; 9]] {
            let image = image(16, &values);
            assert!(!image.has_swapped_bytes() && !swapped(image).has_swapped_bytes());
        }
        assert!(!image(8, &ramp.iter().map(|value| value.swap_bytes()).collect::<Vec<_>>()).has_swapped_bytes());
    }

    #[test]
    fn inverted_values_keep_what_was_not_measured() {
        let inverted = |bits| image(bits, &[0, 1, 200, 255]).read_as(DepthValues::Inverted).values;
        assert_eq!(inverted(8), [0, 254, 55, 0]);
        assert_eq!(inverted(16), [0, 65_534, 65_335, 65_280]);
    }

    #[test]
    fn a_stretched_image_is_distinguished_from_a_clipped_one() {
        let ramp = |scale: u16| (0..=255).map(|value| value * scale).collect::<Vec<u16>>();
        assert!(image(8, &ramp(1)).fills_range() && image(16, &ramp(257)).fills_range());
        assert!(!image(16, &ramp(1)).fills_range() && !image(DepthImage::METRES, &ramp(257)).fills_range());
        // Beyond 10 m, or without a return.
        assert!(!image(8, &[ramp(1), vec![255; 20]].concat()).fills_range());
        assert!(!image(16, &[ramp(20), vec![u16::MAX]].concat()).fills_range());
    }

    #[test]
    fn a_picture_goes_from_near_to_far_and_leaves_holes_and_strays_out() {
        // 2 and 250 are one pixel in a hundred each; 0 is no depth.
        let mut values = vec![0; 50];
        values.extend([2, 250]);
        values.extend((0..198).map(|i| 100 + i % 11));
        let picture = image(8, &values).picture(&[10, 20, 30, 40, 50, 60]);
        assert_eq!((picture.near, picture.far, picture.num_invalid), (100, 110, 50));
        assert_eq!(picture.pixels[..52], [&[0; 50][..], &[10, 60]].concat());
        assert_eq!(picture.pixels[52..63], [10, 20, 20, 30, 30, 40, 40, 50, 50, 60, 60]);

        let nothing = image(16, &[0, 0]).picture(&[10, 20]);
        assert_eq!(nothing, DepthPicture { pixels: vec![0, 0], near: 0, far: 0, num_invalid: 2 });
        assert_eq!(image(16, &[7, 65_535]).picture(&[1, 2]).pixels, [1, 2]);
        assert_eq!(image(16, &[7]).picture(&[]).pixels, [0]);
        assert!(DepthImage::default().picture(&[1]).pixels.is_empty());
    }
}
