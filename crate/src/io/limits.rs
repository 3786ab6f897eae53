//! What one file may make the readers allocate: what its header claims is not believed.

/// Largest number of pixels of an image, and of cells of a map: those of a square of 8,192. No camera has more.
pub(crate) const MAX_PIXELS: u64 = 1 << 26;
/// Largest number of readings of a planar scan: the finest lasers have some ten thousand.
pub(super) const MAX_BEAMS: usize = 100_000;
/// Number of bytes that a packed file may unpack to however small it is: a depth image of 3840 x 2160, or 1.4 million points.
const FREE_BYTES: u64 = 1 << 24;
/// Number of bytes that each byte of a larger file may unpack to: of depth images of ten recordings up to 24, of renderings in 8 bits.
const UNPACKED_RATIO: u64 = 40;

/// Number of bytes that so many packed ones may unpack to.
pub(super) fn most_unpacked(num_packed: usize) -> u64 {
    FREE_BYTES.max(UNPACKED_RATIO.saturating_mul(num_packed as u64))
}

/// How the pixels of an image are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Packing {
    /// PNG, whose pixels take this number of bits at least.
    Deflate(u64),
    /// JPEG.
    Jpeg,
    /// JPEG that is decoded as a whole, which takes twice as much memory.
    ProgressiveJpeg,
}

impl Packing {
    /// Number of pixels that an image of so many bytes may have. Most have two bytes.
    pub(super) fn most_pixels(self, num_packed: usize) -> u64 {
        let by_memory = match self {
            Self::Deflate(_) | Self::Jpeg => most_unpacked(num_packed) / 2,
            Self::ProgressiveJpeg => most_unpacked(num_packed) / 4,
        };
        let most_a_byte = match self {
            // A run of 258 bytes takes two bits (RFC 1951).
            Self::Deflate(bits) => 258 * 4 * 8 / bits,
            // A bit stands for at least half a block of 64 pixels in four by four of its kind (ITU T.81).
            Self::Jpeg | Self::ProgressiveJpeg => 8 * 64 * 16 * 2,
        };
        by_memory.min((num_packed as u64).saturating_mul(most_a_byte))
    }
}
