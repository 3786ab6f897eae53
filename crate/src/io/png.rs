//! PNG files, and what the readers of depth and colour images share.

use png::{ColorType, Transformations};

use super::limits::{MAX_PIXELS, Packing};
use super::text::quote;
use crate::{Error, Result};

/// The first bytes of every PNG.
pub(super) const PNG_SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// The number of pixels that a header announces: a header must not make us allocate more than the file can hold.
///
/// # Errors
/// No pixel, more than `most`, which the file's bytes can hold, or more than any camera has.
pub(super) fn check_size(width: u64, height: u64, most: u64) -> Result<usize> {
    let pixels = width.saturating_mul(height);
    let announced = format!("The header announces {width} x {height} pixels");
    if pixels == 0 {
        let problem = format!("An image of {width} x {height} pixels is empty");
        return Err(Error::whole(problem, "Export it again, or leave it out"));
    }
    if pixels > most {
        return Err(Error::whole(format!("{announced}, more than the file can hold"), "Copy or export it again"));
    }
    if pixels > MAX_PIXELS {
        return Err(Error::whole(
            format!("{announced}, more than the limit of {MAX_PIXELS}"),
            "Export a smaller image",
        ));
    }
    Ok(pixels as usize)
}

/// A PNG with 8 bits a channel, palettes looked up.
pub(super) struct Png8 {
    pub width: usize,
    pub height: usize,
    pub color_type: ColorType,
    /// Row by row.
    pub data: Vec<u8>,
}

impl Png8 {
    /// Reads one whose pixels take at least this many bits in the file before it is packed.
    ///
    /// # Errors
    /// A file that is broken or cut off; a size the file cannot hold.
    pub fn read(bytes: &[u8], min_bits: u64, remedy: &str) -> Result<Self> {
        let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        decoder.set_transformations(Transformations::normalize_to_color8());
        let header = decoder.read_header_info().map_err(broken_png)?;
        let (width, height) = (header.width as usize, header.height as usize);
        check_size(width as u64, height as u64, Packing::Deflate(min_bits).most_pixels(bytes.len()))?;
        let mut reader = decoder.read_info().map_err(broken_png)?;
        check_palette(reader.info())?;
        let (color_type, data) = first_picture(&mut reader, remedy)?;
        Ok(Self { width, height, color_type, data })
    }
}

/// A palette has three bytes a colour, at most 256 of them, and no more opacities than colours (PNG specification, 11.2.2 and
/// 11.3.1.1). The decoder takes that for granted and panics where it is not so.
fn check_palette(info: &png::Info<'_>) -> Result<()> {
    let num_bytes = info.palette.as_ref().map_or(0, |palette| palette.len());
    let num_opacities = info.trns.as_ref().map_or(0, |opacities| opacities.len());
    let is_indexed = info.color_type == ColorType::Indexed;
    if is_indexed && (!num_bytes.is_multiple_of(3) || num_bytes > 3 * 256 || num_opacities > num_bytes / 3) {
        let problem =
            format!("The PNG's palette has {num_bytes} bytes and {num_opacities} opacities, which is not possible");
        return Err(Error::whole(problem, "Copy or export it again"));
    }
    Ok(())
}

/// Colour type and bytes of a PNG's picture, row by row.
pub(super) fn first_picture<R: std::io::BufRead + std::io::Seek>(
    reader: &mut png::Reader<R>,
    remedy: &str,
) -> Result<(png::ColorType, Vec<u8>)> {
    let size = reader.output_buffer_size().ok_or_else(|| Error::whole("The PNG is too large", remedy))?;
    let mut data = vec![0; size];
    let info = reader.next_frame(&mut data).map_err(broken_png)?;
    data.truncate(info.buffer_size());
    Ok((info.color_type, data))
}

#[allow(clippy::needless_pass_by_value, reason = "as map_err gives it")]
pub(super) fn broken_png(error: png::DecodingError) -> Error {
    let problem = match error {
        png::DecodingError::IoError(_) => "The PNG is cut off".to_owned(),
        error => format!("The PNG is broken: {error}"),
    };
    Error::whole(problem, "Copy or export it again")
}

/// The error of a file that is empty or begins as none of these formats: "a PNG nor a JPEG".
pub(super) fn unknown_format(bytes: &[u8], formats: &str, remedy: &str) -> Error {
    if bytes.is_empty() {
        return Error::whole("The file is empty", "Export it again, or leave it out");
    }
    let start = quote(&bytes[..bytes.len().min(8)]);
    Error::byte(0, format!("This is neither {formats}: it begins with {start}"), remedy)
}
