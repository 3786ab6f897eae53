//! Depth images as their files have them, and how many metres a step of theirs is.

/// Raw depth values, row by row from the top; 0 means that nothing was measured.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DepthImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` values.
    pub values: Vec<u16>,
    /// Bits a value had in the file: 8 (or fewer) or 16; or [`Self::METRES`].
    pub bits: u8,
}

impl DepthImage {
    /// `bits` of an image whose file holds metres as fractions: its values are millimetres.
    pub const METRES: u8 = 32;
}

/// Depth along the optical axis in metres = raw value * `step`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthScale {
    /// Metres a raw step.
    pub step: f64,
}

/// Beyond this a depth camera for rooms sees nothing (m): a median depth above it means that the scale is another.
const ROOM: f64 = 12.0;

impl DepthScale {
    /// 8 bits over 10 m: v / 255 * 10, as the renderings of rooms used in teaching have it.
    pub const TEN_METRES_IN_8_BITS: Self = Self { step: 10.0 / 255.0 };
    /// Millimetres in 16 bits: Kinect, RealSense, ScanNet, Redwood.
    pub const MILLIMETRES: Self = Self { step: 1e-3 };
    /// 5000 a metre in 16 bits: the TUM RGB-D benchmark.
    pub const TUM: Self = Self { step: 1.0 / 5000.0 };

    /// The preset that fits: 8 bits reach 10 m; of 16 bits, millimetres unless the median pixel of all `images` would
    /// lie beyond any room, then 5000 a metre. Files that hold metres need no guess.
    pub fn guess<'a>(images: impl IntoIterator<Item = &'a DepthImage>) -> Self {
        let (mut histogram, mut bits) = (vec![0u64; usize::from(u16::MAX) + 1], 0);
        for image in images {
            bits = bits.max(image.bits);
            for &value in image.values.iter().filter(|&&value| value > 0) {
                histogram[usize::from(value)] += 1;
            }
        }
        if bits == DepthImage::METRES {
            return Self::MILLIMETRES;
        }
        if bits <= 8 {
            return Self::TEN_METRES_IN_8_BITS;
        }
        let half = histogram.iter().sum::<u64>() / 2;
        let mut below = 0;
        let is_median = |count: &u64| {
            below += count;
            below > half
        };
        let median = histogram.iter().position(is_median).unwrap_or(0);
        if median as f64 * Self::MILLIMETRES.step > ROOM { Self::TUM } else { Self::MILLIMETRES }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(bits: u8, values: &[u16]) -> DepthImage {
        DepthImage { width: values.len(), height: 1, values: values.to_vec(), bits }
    }

    #[test]
    fn the_scale_follows_from_bits_and_median() {
        assert_eq!(DepthScale::guess(&[image(8, &[10, 200])]), DepthScale::TEN_METRES_IN_8_BITS);
        assert_eq!(DepthScale::guess(&[image(16, &[0, 0, 0, 900, 2500, 60_000])]), DepthScale::MILLIMETRES);
        assert_eq!(DepthScale::guess(&[image(16, &[0, 0, 0, 4900, 14_000, 15_000])]), DepthScale::TUM);
        let far_in_metres = image(DepthImage::METRES, &[0, 14_000, 15_000]);
        assert_eq!(DepthScale::guess(&[far_in_metres]), DepthScale::MILLIMETRES);
        assert_eq!(DepthScale::guess(&[image(16, &[0, 0])]), DepthScale::MILLIMETRES);
        assert_eq!(DepthScale::guess(&[]), DepthScale::TEN_METRES_IN_8_BITS);
    }
}
