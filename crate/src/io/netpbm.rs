//! The parts that the netpbm formats share: numbers of a header, and the values of a PFM.
//!
//! Source: the netpbm manual (pgm, ppm); P. Debevec, "The PFM format" (Pf).

use super::text::leading_number;
use crate::{Error, Result};

const EXPORT_AGAIN: &str = "Export the image again";

/// The next whole number after blanks and comments.
pub(super) fn next_whole(bytes: &[u8], position: &mut usize) -> Option<u64> {
    skip_blanks(bytes, position)?;
    let digits = bytes[*position..].iter().take_while(|byte| byte.is_ascii_digit()).take(19).count();
    let (value, length) = leading_number(&bytes[*position..*position + digits])?;
    *position += length;
    Some(value as u64)
}

/// Width, height and the largest value of a header that begins with two letters; `position` then stands at the blank
/// that ends it.
///
/// # Errors
/// A number that is missing.
pub(super) fn header(bytes: &[u8], format: &str, position: &mut usize) -> Result<[u64; 3]> {
    *position = 2;
    let mut header = [0; 3];
    for (slot, name) in header.iter_mut().zip(["width", "height", "largest value"]) {
        *slot = next_whole(bytes, position)
            .ok_or_else(|| Error::byte(*position, format!("The {format}'s header has no {name} here"), EXPORT_AGAIN))?;
    }
    Ok(header)
}

/// Width, height and the values of a grey PFM, row by row from the top. `check` may refuse the size before memory is
/// taken for it.
///
/// The header is `Pf width height scale`, a blank, then the rows from the bottom up; a negative scale means that the low
/// byte of a value comes first. Its magnitude has no agreed meaning and is not applied.
///
/// # Errors
/// A number of the header that is missing; fewer values than announced; what `check` refuses.
pub(super) fn pfm_values(bytes: &[u8], check: impl Fn([u64; 2]) -> Result<()>) -> Result<(usize, usize, Vec<f32>)> {
    let mut position = 2;
    let mut size = [0; 2];
    for (slot, name) in size.iter_mut().zip(["width", "height"]) {
        *slot = next_whole(bytes, &mut position)
            .ok_or_else(|| Error::byte(position, format!("The PFM's header has no {name} here"), EXPORT_AGAIN))?;
    }
    let no_scale = |at: usize| Error::byte(at, "The PFM's header has no scale here", EXPORT_AGAIN);
    skip_blanks(bytes, &mut position).ok_or_else(|| no_scale(bytes.len()))?;
    let (scale, length) = leading_number(&bytes[position..]).ok_or_else(|| no_scale(position))?;
    position += length;
    check(size)?;
    let [width, height] = size.map(|value| value as usize);
    let data = bytes.get(position + 1..).unwrap_or_default();
    if data.len() / 4 < width * height {
        let problem = format!("The PFM is cut off: it ends in value {} of {}", data.len() / 4 + 1, width * height);
        return Err(Error::byte(bytes.len(), problem, "Copy or export it again"));
    }
    let value = |four: &[u8]| {
        let four = [four[0], four[1], four[2], four[3]];
        if scale < 0.0 { f32::from_le_bytes(four) } else { f32::from_be_bytes(four) }
    };
    let rows = data[..4 * width * height].chunks_exact(4 * width).rev();
    Ok((width, height, rows.flat_map(|row| row.chunks_exact(4).map(value)).collect()))
}

fn skip_blanks(bytes: &[u8], position: &mut usize) -> Option<()> {
    loop {
        match bytes.get(*position)? {
            b'#' => *position += bytes[*position..].iter().position(|&byte| byte == b'\n')?,
            byte if byte.is_ascii_whitespace() => *position += 1,
            _ => return Some(()),
        }
    }
}
