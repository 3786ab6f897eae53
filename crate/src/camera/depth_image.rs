//! Depth images as their files have them.

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

    /// How many pixels have each raw value, up to the largest there is.
    fn histogram(&self) -> Vec<usize> {
        let largest = self.values.iter().copied().max().unwrap_or(0);
        let mut counts = vec![0; usize::from(largest) + 1];
        for &value in &self.values {
            counts[usize::from(value)] += 1;
        }
        counts
    }

    /// The image as the eye can read it: in these colours, from near to far, whatever they are packed as.
    pub fn picture(&self, colors: &[u32]) -> DepthPicture {
        let counts = self.histogram();
        let num_invalid = counts[0];
        let cut = (self.values.len() - num_invalid) / STRAY_SHARE;
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

/// One in so many pixels, nearest and farthest, is left out of the range of a picture.
const STRAY_SHARE: usize = 100;

/// A depth image in colours.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DepthPicture {
    /// Row by row: a colour, from the first for `near` to the last for `far`; 0 where nothing was measured.
    pub pixels: Vec<u32>,
    /// The nearest raw value, the nearest hundredth of the pixels left out; 0 where nothing was measured.
    pub near: u16,
    /// The farthest, likewise.
    pub far: u16,
    /// Pixels where nothing was measured.
    pub num_invalid: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(bits: u8, values: &[u16]) -> DepthImage {
        DepthImage { width: values.len(), height: 1, values: values.to_vec(), bits }
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
