//! Depth images: PNG and PGM of grey values with up to 16 bits, and PFM in metres.
//!
//! Read are grey PNGs (an alpha channel is dropped), colour PNGs of 8 bits whose three channels are equal, PGM, binary
//! (P5) and plain (P2), and grey PFM (Pf). Everything else is no depth image and refused with the reason.

use super::length_unit::{METRE, MILLIMETRE};
use super::limits::Packing;
use super::netpbm::{self, next_whole, pfm_values};
use super::png::{PNG_SIGNATURE, broken_png, check_size, first_picture, unknown_format};
use super::text::refuse_pointer_and_utf16;
use crate::camera::DepthImage;
use crate::{Error, Result};

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
    } else {
        Err(unknown_format(bytes, "a PNG nor a PGM nor a PFM", REMEDY))
    }
}

const REMEDY: &str = "Depth images are grey PNG or PGM files of 8 or 16 bits, or PFM files in metres";

fn read_png(bytes: &[u8]) -> Result<DepthImage> {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.ignore_checksums(false);
    let header = decoder.read_header_info().map_err(broken_png)?;
    let (width, height) = (header.width, header.height);
    let (color, depth) = (header.color_type, header.bit_depth);
    check_size(u64::from(width), u64::from(height), Packing::Deflate(1).most_pixels(bytes.len()))?;
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
    let values = grey_values(&data, width as usize, channels, depth)?;
    let bits = if depth == png::BitDepth::Sixteen { 16 } else { 8 };
    image(width as usize, height as usize, values, bits)
}

/// The grey values of a picture, row by row.
#[inline(never)]
fn grey_values(data: &[u8], width: usize, channels: usize, depth: png::BitDepth) -> Result<Vec<u16>> {
    Ok(match depth {
        png::BitDepth::Sixteen => {
            data.chunks_exact(2 * channels).map(|pixel| u16::from_be_bytes([pixel[0], pixel[1]])).collect()
        }
        png::BitDepth::Eight if channels == 1 => data.iter().map(|&value| u16::from(value)).collect(),
        png::BitDepth::Eight => {
            let mut pixels = data.chunks_exact(channels);
            if channels > 2 && pixels.any(|pixel| pixel[0] != pixel[1] || pixel[0] != pixel[2]) {
                return Err(Error::whole("This is a colour image, not depth", REMEDY));
            }
            data.chunks_exact(channels).map(|pixel| u16::from(pixel[0])).collect()
        }
        few => {
            let bits = few as usize; // 1, 2 or 4; rows begin at a byte
            let a_byte = 8 / bits;
            let stride = width.div_ceil(a_byte);
            let mut values = Vec::with_capacity(data.len() / stride * width);
            for row in data.chunks_exact(stride) {
                let value = |u: usize| row[u / a_byte] >> (8 - bits * (u % a_byte + 1)) & ((1 << bits) - 1);
                values.extend((0..width).map(|u| u16::from(value(u))));
            }
            values
        }
    })
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

/// The median depth of an image is below this (m): beyond it, it is in millimetres.
const MAX_MEDIAN_METRES: f32 = 60.0;
/// The largest number of half precision, which renderers write for the sky.
const SKY: f32 = 65_504.0;

/// Metres per unit of fractions.
fn unit_of(values: &[f32]) -> f64 {
    let mut known: Vec<f32> = values.iter().copied().filter(|value| *value > 0.0 && *value < SKY).collect();
    let middle = known.len() / 2;
    let is_beyond = middle > 0 && *known.select_nth_unstable_by(middle, f32::total_cmp).1 > MAX_MEDIAN_METRES;
    if is_beyond { MILLIMETRE.metres } else { METRE.metres }
}

/// Metres as fractions, or millimetres where they cannot be metres: what is not a number, infinite, negative or zero was not
/// measured. They are kept in whole millimetres, as depth cameras tell them; what lies beyond 65.535 m was not measured either.
fn read_pfm(bytes: &[u8]) -> Result<DepthImage> {
    let (width, height, values) = pfm_values(bytes, |pixels| {
        check_size(pixels[0], pixels[1], bytes.len() as u64 / 4)?;
        Ok(())
    })?;
    let per_unit = unit_of(&values) / MILLIMETRE.metres;
    let millimetres = |value: f32| {
        let value = (f64::from(value) * per_unit).round();
        if value >= 1.0 && value <= f64::from(u16::MAX) { value as u16 } else { 0 }
    };
    image(width, height, values.into_iter().map(millimetres).collect(), DepthImage::METRES)
}

fn image(width: usize, height: usize, values: Vec<u16>, bits: u8) -> Result<DepthImage> {
    if values.len() != width * height {
        return Err(Error::whole("The PNG is cut off", "Copy or export it again"));
    }
    Ok(DepthImage { width, height, values, bits })
}
