//! PNG files, and what the readers of depth and colour images share.

use super::limits::MAX_PIXELS;
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
