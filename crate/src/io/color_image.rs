//! Colour images: PNG, JPEG, and PPM or PGM of 8 bits.
//!
//! They are decoded here rather than by the browser, so that every platform sees the same colours.
//!
//! JPEG is decoded by jpeg-decoder. zune-jpeg 0.5.15 takes two thirds of its time, and its colours differ by 5 levels at
//! most on 406 pictures of five cameras (77 to 98 % of the values are the same). But even in its strict mode it takes
//! damaged files with restart markers, as cameras write them, for good ones: of 400 with three bytes changed it refused 62 to
//! 122, jpeg-decoder 315 to 351; it decodes 4:1:1 with restart markers to wrong colours (mean error 43 levels); and it takes
//! files that end up to 17 bytes early. Colours that are silently wrong would be measurements.

use jpeg_decoder::{CodingProcess, Decoder as JpegDecoder, PixelFormat};
use png::ColorType;

use super::limits::Packing;
use super::netpbm;
use super::png::{PNG_SIGNATURE, Png8, check_size, unknown_format};
use super::text::refuse_pointer_and_utf16;
use crate::camera::ColorImage;
use crate::{Error, Result};

const REMEDY: &str = "Colour images are PNG, JPEG or PPM files";

/// Reads a colour image, given as the bytes of its file. Grey images become grey colours, transparency is dropped.
///
/// # Errors
/// Neither PNG nor JPEG nor PPM; a file that is cut off or broken; a size the file cannot hold.
pub fn read(bytes: &[u8]) -> Result<ColorImage> {
    read_enough(bytes, [usize::MAX; 2])
}

/// The same, where an image of this width and height is enough: of a JPEG that is at least twice as wide and high no more is computed
/// than a half, a quarter or an eighth of its sides.
///
/// # Errors
/// As [`read`].
pub fn read_enough(bytes: &[u8], enough: [usize; 2]) -> Result<ColorImage> {
    refuse_pointer_and_utf16(bytes)?;
    if bytes.starts_with(PNG_SIGNATURE) {
        read_png(bytes)
    } else if bytes.starts_with(b"\xFF\xD8") {
        read_jpeg(bytes, enough)
    } else if bytes.starts_with(b"P6") || bytes.starts_with(b"P5") {
        read_pixmap(bytes)
    } else {
        Err(unknown_format(bytes, "a PNG nor a JPEG nor a PPM", REMEDY))
    }
}

fn read_png(bytes: &[u8]) -> Result<ColorImage> {
    let Png8 { width, height, color_type, data } = Png8::read(bytes, 8, REMEDY)?;
    let pixels = match color_type {
        ColorType::Grayscale => data.iter().map(|&grey| [grey; 3]).collect(),
        ColorType::GrayscaleAlpha => data.chunks_exact(2).map(|pixel| [pixel[0]; 3]).collect(),
        ColorType::Rgb | ColorType::Indexed => colors(data),
        ColorType::Rgba => data.chunks_exact(4).map(color).collect(),
    };
    Ok(ColorImage { width, height, pixels })
}

fn read_jpeg(bytes: &[u8], enough: [usize; 2]) -> Result<ColorImage> {
    let broken =
        |error: jpeg_decoder::Error| Error::whole(format!("The JPEG is broken: {error}"), "Copy or export it again");
    let nothing = || Error::whole("The JPEG holds no image", "Copy or export it again");
    let mut decoder = JpegDecoder::new(bytes);
    decoder.read_info().map_err(broken)?;
    let info = decoder.info().ok_or_else(nothing)?;
    let (width, height) = (usize::from(info.width), usize::from(info.height));
    let is_progressive = info.coding_process == CodingProcess::DctProgressive;
    let packing = if is_progressive { Packing::ProgressiveJpeg } else { Packing::Jpeg };
    check_size(width as u64, height as u64, packing.most_pixels(bytes.len()))?;
    let factor = (width / enough[0].max(1)).min(height / enough[1].max(1)).max(1);
    let least = [width, height].map(|side| side.div_ceil(factor) as u16);
    let (width, height) = decoder.scale(least[0], least[1]).map_err(broken)?;
    let (width, height) = (usize::from(width), usize::from(height));
    let data = decoder.decode().map_err(broken)?;
    let pixels: Vec<[u8; 3]> = match info.pixel_format {
        PixelFormat::L8 => data.iter().map(|&grey| [grey; 3]).collect(),
        PixelFormat::L16 => data.chunks_exact(2).map(|grey| [grey[0]; 3]).collect(),
        PixelFormat::RGB24 => colors(data),
        PixelFormat::CMYK32 => {
            return Err(Error::whole("The JPEG has the inks of a printer for colours", "Export it with RGB colours"));
        }
    };
    if pixels.len() != width * height {
        return Err(nothing());
    }
    Ok(ColorImage { width, height, pixels })
}

/// `P6 width height 255`, a blank, then three bytes a pixel; one in P5.
fn read_pixmap(bytes: &[u8]) -> Result<ColorImage> {
    let (format, channels) = if bytes[1] == b'6' { ("PPM", 3) } else { ("PGM", 1) };
    let mut position = 0;
    let [width, height, largest] = netpbm::header(bytes, format, &mut position)?;
    if largest != 255 {
        let problem = format!("The {format}'s largest value is {largest}");
        return Err(Error::byte(position, problem, "Colour images have 8 bits a channel, up to 255"));
    }
    let data = bytes.get(position + 1..).unwrap_or_default();
    let num_pixels = check_size(width, height, (data.len() / channels) as u64)?;
    let [width, height] = [width, height].map(|value| value as usize);
    let pixels = data[..num_pixels * channels].chunks_exact(channels);
    let pixels = if channels == 3 { pixels.map(color).collect() } else { pixels.map(|grey| [grey[0]; 3]).collect() };
    Ok(ColorImage { width, height, pixels })
}

/// The colours of three bytes each, without copying them.
fn colors(data: Vec<u8>) -> Vec<[u8; 3]> {
    bytemuck::allocation::try_cast_vec(data).unwrap_or_else(|(_, data)| data.chunks_exact(3).map(color).collect())
}

fn color(pixel: &[u8]) -> [u8; 3] {
    [pixel[0], pixel[1], pixel[2]]
}
