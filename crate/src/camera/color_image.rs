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
