//! The shades of a map's picture: PGM, PNG with or without transparency, PPM or JPEG.

use png::ColorType;

use crate::error::{Error, Result};
use crate::io::color_image;
use crate::io::depth_image;
use crate::io::netpbm;
use crate::io::png::{PNG_SIGNATURE, Png8, unknown_format};
use crate::io::text::refuse_pointer_and_utf16;

/// How bright a pixel is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shade {
    /// From 0, black, to 1, white.
    pub value: f32,
    /// Whether nothing shines through it.
    pub is_opaque: bool,
}

/// A picture, row by row from the top.
pub struct GreyPicture {
    pub width: usize,
    pub height: usize,
    pub shades: Vec<Shade>,
}

const REMEDY: &str = "The picture of a map is a PGM or PNG file, or PPM or JPEG";

/// Reads a picture. Colours are averaged.
///
/// # Errors
/// None of these formats; a file that is cut off; more pixels than the file can hold or a map may have.
pub fn read(bytes: &[u8]) -> Result<GreyPicture> {
    refuse_pointer_and_utf16(bytes)?;
    if bytes.starts_with(PNG_SIGNATURE) {
        read_png(bytes)
    } else if bytes.starts_with(b"P5") || bytes.starts_with(b"P2") {
        read_pgm(bytes)
    } else if bytes.starts_with(b"P6") || bytes.starts_with(b"\xFF\xD8") {
        let picture = color_image::read(bytes)?;
        let shades = picture.pixels.iter().map(|pixel| opaque(mean(pixel))).collect();
        Ok(GreyPicture { width: picture.width, height: picture.height, shades })
    } else {
        Err(unknown_format(bytes, "a PGM nor a PNG nor a PPM nor a JPEG", REMEDY))
    }
}

fn opaque(value: f32) -> Shade {
    Shade { value, is_opaque: true }
}

fn mean(channels: &[u8]) -> f32 {
    let sum: u32 = channels.iter().map(|&value| u32::from(value)).sum();
    sum as f32 / (255.0 * channels.len() as f32)
}

fn read_pgm(bytes: &[u8]) -> Result<GreyPicture> {
    let image = depth_image::read(bytes)?;
    let largest = netpbm::header(bytes, "PGM", &mut 0)?[2] as f32;
    let shades = image.values.iter().map(|&value| opaque(f32::from(value) / largest)).collect();
    Ok(GreyPicture { width: image.width, height: image.height, shades })
}

fn read_png(bytes: &[u8]) -> Result<GreyPicture> {
    let Png8 { width, height, color_type, data } = Png8::read(bytes, 1, REMEDY)?;
    let with_alpha = |pixel: &[u8]| {
        let (alpha, channels) = pixel.split_last().unwrap_or((&255, &[]));
        Shade { value: mean(channels), is_opaque: *alpha == 255 }
    };
    let shades: Vec<Shade> = match color_type {
        ColorType::Grayscale => data.iter().map(|&value| opaque(mean(&[value]))).collect(),
        ColorType::GrayscaleAlpha => data.chunks_exact(2).map(with_alpha).collect(),
        ColorType::Rgb | ColorType::Indexed => data.chunks_exact(3).map(|pixel| opaque(mean(pixel))).collect(),
        ColorType::Rgba => data.chunks_exact(4).map(with_alpha).collect(),
    };
    if shades.len() != width * height {
        return Err(Error::whole("The PNG is cut off", "Copy or export it again"));
    }
    Ok(GreyPicture { width, height, shades })
}
