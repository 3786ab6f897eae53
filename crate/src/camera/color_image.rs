//! Colours of the pixels of an image.

/// Red, green and blue of every pixel, row by row from the top.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ColorImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` colours.
    pub pixels: Vec<[u8; 3]>,
}

impl ColorImage {
    /// The same view in fewer pixels, each the mean of those that it covers. Sides that are longer than these stay as they are.
    #[must_use]
    pub fn reduced(&self, width: usize, height: usize) -> Self {
        let (width, height) = (width.min(self.width), height.min(self.height));
        let edge = |index: usize, from: usize, to: usize| (index as u64 * from as u64 / to as u64) as usize;
        let covered = |index: usize, from: usize, to: usize| edge(index, from, to)..edge(index + 1, from, to);
        let mut pixels = Vec::with_capacity(width * height);
        for rows in (0..height).map(|row| covered(row, self.height, height)) {
            for columns in (0..width).map(|column| covered(column, self.width, width)) {
                let mut sums = [0; 3];
                for row in rows.clone() {
                    for pixel in &self.pixels[row * self.width..][columns.clone()] {
                        sums = [0, 1, 2].map(|channel| sums[channel] + u64::from(pixel[channel]));
                    }
                }
                let count = (rows.len() * columns.len()) as u64;
                pixels.push(sums.map(|sum| ((sum + count / 2) / count) as u8));
            }
        }
        Self { width, height, pixels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reduced_image_has_the_mean_of_the_pixels_that_each_one_covers() {
        let pixels = (0..5 * 4).map(|index: u8| [index, 2 * index, 200]).collect();
        let image = ColorImage { width: 5, height: 4, pixels };
        let reduced = image.reduced(2, 2);
        // Two and three columns of five, and two rows each: 0 1 5 6, 2 3 4 7 8 9, 10 11 15 16, 12 13 14 17 18 19.
        assert_eq!(reduced.pixels, [[3, 6, 200], [6, 11, 200], [13, 26, 200], [16, 31, 200]]);
        assert_eq!((reduced.width, reduced.height), (2, 2));
        assert_eq!(image.reduced(5, 4), image);
        assert_eq!(image.reduced(9, 9), image);
    }
}
