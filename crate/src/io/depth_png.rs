//! Depth images: PNG and PGM of grey values with up to 16 bits, and PFM in metres.
//!
//! Read are grey PNGs (an alpha channel is dropped), colour PNGs of 8 bits whose three channels are equal, PGM, binary
//! (P5) and plain (P2), and grey PFM (Pf). Everything else is no depth image and refused with the reason.

use super::netpbm::{self, next_whole, pfm_values};
use super::text::{quote, refuse_pointer_and_utf16};
use crate::camera::DepthImage;
use crate::{Error, Result};

/// No depth camera has more pixels.
pub(super) const MAX_PIXELS: u64 = 1 << 26;
/// Pixels of a packed image of any size in bytes: those of a screen of 3840 x 2160; ...
pub(super) const FREE_PIXELS: u64 = 1 << 23;
/// ... beyond that, the most a byte.
const PIXELS_A_BYTE: u64 = 20;
/// A byte of deflate can unfold to this many at the most.
pub(super) const MAX_INFLATION: u64 = 1032;
/// The first bytes of every PNG.
pub(super) const PNG_SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Reads a depth image, given as the bytes of its file.
///
/// # Errors
/// Neither PNG nor PGM nor PFM; a colour image; a file that is cut off or broken; a size the file cannot hold.
pub fn read(bytes: &[u8]) -> Result<DepthImage> {
    refuse_pointer_and_utf16(bytes)?;
    if bytes.starts_with(PNG_SIGNATURE) {
        read_png(bytes)
    } else if bytes.starts_with(b"P5") || bytes.starts_with(b"P2") {
        read_pgm(bytes)
    } else if bytes.starts_with(b"Pf") {
        read_pfm(bytes)
    } else if bytes.starts_with(b"P6")
        || bytes.starts_with(b"P3")
        || bytes.starts_with(b"PF")
        || bytes.starts_with(b"\xFF\xD8")
    {
        Err(Error::whole("This is a colour image, not depth", REMEDY))
    } else if bytes.is_empty() {
        Err(Error::whole("The file is empty", "Export it again, or leave it out"))
    } else {
        let start = quote(&bytes[..bytes.len().min(8)]);
        Err(Error::byte(0, format!("This is neither a PNG nor a PGM nor a PFM: it begins with {start}"), REMEDY))
    }
}

const REMEDY: &str = "Depth images are grey PNG or PGM files of 8 or 16 bits, or PFM files in metres";

fn read_png(bytes: &[u8]) -> Result<DepthImage> {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.ignore_checksums(false);
    let header = decoder.read_header_info().map_err(broken_png)?;
    let (width, height) = (header.width, header.height);
    let (color, depth) = (header.color_type, header.bit_depth);
    let pixels = check_size(u64::from(width), u64::from(height), most_pixels(bytes, FREE_PIXELS, 8 * MAX_INFLATION))?;
    // Fewer bits than 8 stay the numbers they are: expanding would scale them.
    decoder.set_transformations(png::Transformations::IDENTITY);
    let channels = match color {
        png::ColorType::Grayscale => 1,
        png::ColorType::GrayscaleAlpha => 2,
        png::ColorType::Rgb if depth == png::BitDepth::Eight => 3,
        png::ColorType::Rgba if depth == png::BitDepth::Eight => 4,
        png::ColorType::Rgb | png::ColorType::Rgba | png::ColorType::Indexed => {
            return Err(Error::whole("This is a colour image, not depth", REMEDY));
        }
    };
    let (_, data) = first_picture(&mut decoder.read_info().map_err(broken_png)?, REMEDY)?;

    let mut values = Vec::with_capacity(pixels);
    match depth {
        png::BitDepth::Sixteen => {
            let pixels = data.chunks_exact(2 * channels);
            values.extend(pixels.map(|pixel| u16::from_be_bytes([pixel[0], pixel[1]])));
        }
        png::BitDepth::Eight if channels == 1 => values.extend(data.iter().map(|&value| u16::from(value))),
        png::BitDepth::Eight => {
            let mut pixels = data.chunks_exact(channels);
            if channels > 2 && pixels.any(|pixel| pixel[0] != pixel[1] || pixel[0] != pixel[2]) {
                return Err(Error::whole("This is a colour image, not depth", REMEDY));
            }
            values.extend(data.chunks_exact(channels).map(|pixel| u16::from(pixel[0])));
        }
        few => {
            let bits = few as usize; // 1, 2 or 4; rows begin at a byte
            let a_byte = 8 / bits;
            for row in data.chunks_exact((width as usize).div_ceil(a_byte)) {
                let value = |u: usize| row[u / a_byte] >> (8 - bits * (u % a_byte + 1)) & ((1 << bits) - 1);
                values.extend((0..width as usize).map(|u| u16::from(value(u))));
            }
        }
    }
    let bits = if depth == png::BitDepth::Sixteen { 16 } else { 8 };
    image(width as usize, height as usize, values, bits)
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

/// Jef Poskanzer's format: `P5 width height maxval`, a single blank, then the values, two bytes each with the high one
/// first where maxval is over 255. `#` begins a comment.
fn read_pgm(bytes: &[u8]) -> Result<DepthImage> {
    let mut position = 0;
    let header = netpbm::header(bytes, "PGM", &mut position)?;
    let [width, height, largest] = header;
    if largest == 0 || largest > u64::from(u16::MAX) {
        let problem = format!("The PGM's largest value is {largest}");
        return Err(Error::byte(position, problem, "It must lie between 1 and 65535"));
    }
    let wide = largest > 255;
    let plain = bytes.starts_with(b"P2");
    let pixels = check_size(width, height, bytes.len() as u64)?;
    let cut_off = |index: usize| {
        let problem = format!("The PGM is cut off: it ends in value {} of {pixels}", index + 1);
        Error::byte(bytes.len(), problem, "Copy or export it again")
    };
    let mut values = Vec::with_capacity(pixels);
    if plain {
        for index in 0..pixels {
            let value = next_whole(bytes, &mut position).ok_or_else(|| cut_off(index))?;
            if value > largest {
                let problem = format!("Value {} of the PGM is {value}, over its largest, {largest}", index + 1);
                return Err(Error::byte(position, problem, "Export the image again"));
            }
            values.push(value as u16);
        }
    } else {
        let data = bytes.get(position + 1..).unwrap_or_default();
        let size = if wide { 2 } else { 1 };
        if data.len() / size < pixels {
            return Err(cut_off(data.len() / size));
        }
        let data = &data[..pixels * size];
        if wide {
            values.extend(data.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])));
        } else {
            values.extend(data.iter().map(|&value| u16::from(value)));
        }
    }
    image(width as usize, height as usize, values, if wide { 16 } else { 8 })
}

/// Metres as fractions: what is not a number, infinite, negative or zero was not measured. They are kept in whole
/// millimetres, as depth cameras tell them; what lies beyond 65.535 m was not measured either.
fn read_pfm(bytes: &[u8]) -> Result<DepthImage> {
    let (width, height, values) = pfm_values(bytes, |pixels| {
        check_size(pixels[0], pixels[1], bytes.len() as u64 / 4)?;
        Ok(())
    })?;
    let millimetres = |metres: f32| {
        let value = (f64::from(metres) * 1000.0).round();
        if value >= 1.0 && value <= f64::from(u16::MAX) { value as u16 } else { 0 }
    };
    image(width, height, values.into_iter().map(millimetres).collect(), DepthImage::METRES)
}

/// How many pixels a packed image of these bytes may have: `free` however few they are, and at most so many `a_byte`.
pub(super) fn most_pixels(bytes: &[u8], free: u64, a_byte: u64) -> u64 {
    let size = bytes.len() as u64;
    free.max(PIXELS_A_BYTE * size).min(size * a_byte)
}

/// The number of pixels, if the file can hold them: `most` is how many its bytes can.
fn check_size(width: u64, height: u64, most: u64) -> Result<usize> {
    let pixels = width.saturating_mul(height);
    if pixels == 0 {
        return Err(Error::whole(format!("An image of {width} x {height} pixels is empty"), REMEDY));
    }
    if pixels > most.min(MAX_PIXELS) {
        let problem = format!("The header announces {width} x {height} pixels, more than the file can hold");
        return Err(Error::whole(problem, "Copy or export it again"));
    }
    Ok(pixels as usize)
}

fn image(width: usize, height: usize, values: Vec<u16>, bits: u8) -> Result<DepthImage> {
    if values.len() != width * height {
        return Err(Error::whole("The PNG is cut off", "Copy or export it again"));
    }
    Ok(DepthImage { width, height, values, bits })
}
