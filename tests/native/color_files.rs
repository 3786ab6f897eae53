//! Colour images: what is read, and what is refused with which reason.

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use scanstitch::camera::ColorImage;
use scanstitch::io::color_image;

/// Red from left to right, green from top to bottom, blue in a disc: no two channels are alike.
fn picture(width: usize, height: usize) -> ColorImage {
    let pixel = |index: usize| {
        let (u, v) = (index % width, index / width);
        let in_disc = (2 * u).abs_diff(width).pow(2) + (2 * v).abs_diff(height).pow(2) < width * height / 4;
        [(255 * u / width) as u8, (255 * v / height) as u8, if in_disc { 200 } else { 60 }]
    };
    ColorImage { width, height, pixels: (0..width * height).map(pixel).collect() }
}

fn jpeg(image: &ColorImage, sampling: SamplingFactor, progressive: bool, own_tables: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, 92);
    encoder.set_sampling_factor(sampling);
    encoder.set_progressive(progressive);
    encoder.set_optimized_huffman_tables(own_tables);
    let (width, height) = (image.width as u16, image.height as u16);
    encoder.encode(image.pixels.as_flattened(), width, height, ColorType::Rgb).unwrap();
    bytes
}

fn png(image: &ColorImage) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(image.pixels.as_flattened()).unwrap();
    bytes
}

/// Mean difference of the channels.
fn difference(a: &ColorImage, b: &ColorImage) -> f64 {
    assert_eq!((a.width, a.height, a.pixels.len()), (b.width, b.height, b.pixels.len()));
    let channels = a.pixels.as_flattened().iter().zip(b.pixels.as_flattened());
    channels.map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / (3 * a.pixels.len()) as f64
}

#[test]
fn colours_come_as_they_are() {
    for (width, height) in [(512, 512), (640, 480), (33, 17), (8, 8), (1, 1)] {
        let image = picture(width, height);
        assert_eq!(color_image::read(&png(&image)).unwrap(), image);
        for sampling in [SamplingFactor::R_4_4_4, SamplingFactor::R_4_2_2, SamplingFactor::R_4_2_0] {
            for (progressive, own_tables) in [(false, false), (true, false), (false, true), (true, true)] {
                let read = color_image::read(&jpeg(&image, sampling, progressive, own_tables)).unwrap();
                let off = difference(&read, &image);
                let what =
                    format!("{width} x {height}, {sampling:?}, progressive {progressive}, own tables {own_tables}");
                // Of a few pixels, the colours are those of a block.
                let bar = if width < 64 { 20.0 } else { 6.0 };
                assert!(off < bar, "{what}: {off}");
            }
        }
    }
}

#[test]
fn of_a_large_jpeg_no_more_is_computed_than_is_enough() {
    let image = picture(640, 482);
    for sampling in [SamplingFactor::R_4_4_4, SamplingFactor::R_4_2_2, SamplingFactor::R_4_2_0] {
        for progressive in [false, true] {
            let bytes = jpeg(&image, sampling, progressive, false);
            for (enough, size) in
                [([640, 400], [640, 482]), ([320, 240], [320, 241]), ([200, 150], [320, 241]), ([60, 9], [80, 61])]
            {
                let read = color_image::read_enough(&bytes, enough).unwrap();
                assert_eq!([read.width, read.height], size, "{enough:?}");
                let off = difference(&read, &image.reduced(size[0], size[1]));
                assert!(off < 4.0, "{sampling:?}, progressive {progressive}, {enough:?}: {off}");
            }
        }
    }
    assert_eq!(color_image::read_enough(&png(&image), [320, 240]).unwrap(), image);
}

#[test]
fn what_is_broken_is_refused() {
    let image = picture(64, 48);
    for bytes in [png(&image), jpeg(&image, SamplingFactor::R_4_2_0, false, true)] {
        for length in [0, 1, 3, 20, 100, bytes.len() / 2] {
            let error = color_image::read(&bytes[..length]).unwrap_err();
            assert!(!error.problem.is_empty() && !error.remedy.is_empty());
        }
    }
    assert!(color_image::read(b"GIF89a").unwrap_err().to_string().contains("neither a PNG nor a JPEG"));
    assert!(color_image::read(b"").unwrap_err().to_string().contains("The file is empty"));
}

/// The decoder panicked on each of them; found by the fuzzer.
#[test]
fn palettes_that_cannot_be_are_refused() {
    let indexed = |palette: usize, opacities: usize| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 8, 4);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_palette((0..palette).map(|byte| byte as u8).collect::<Vec<u8>>());
        if opacities > 0 {
            encoder.set_trns(vec![9; opacities]);
        }
        encoder.write_header().unwrap().write_image_data(&[1; 32]).unwrap();
        color_image::read(&bytes)
    };
    for (palette, opacities) in [(53, 0), (3 * 256 + 3, 0), (6, 3), (769, 0), (1, 0)] {
        let told = indexed(palette, opacities).unwrap_err().to_string();
        assert!(
            told.contains("palette") || told.contains("PLTE") || told.contains("broken"),
            "{palette}, {opacities}: {told}"
        );
    }
    let image = indexed(6, 1).unwrap();
    assert_eq!(image.pixels, [[3, 4, 5]; 32]);
}

/// Cameras write them: with 4:1:1, another decoder lost its place at each.
#[test]
fn restart_markers_change_no_colour() {
    let image = picture(97, 65);
    for sampling in [SamplingFactor::R_4_4_4, SamplingFactor::R_4_2_0, SamplingFactor::R_4_1_1] {
        let read = |interval: u16| {
            let mut bytes = Vec::new();
            let mut encoder = Encoder::new(&mut bytes, 90);
            encoder.set_sampling_factor(sampling);
            encoder.set_restart_interval(interval);
            encoder.encode(image.pixels.as_flattened(), 97, 65, ColorType::Rgb).unwrap();
            color_image::read(&bytes).unwrap()
        };
        assert_eq!(read(4), read(0), "{sampling:?}");
    }
}

#[test]
fn a_few_bytes_of_jpeg_take_no_memory_for_many_pixels() {
    let claiming = |width: u16, height: u16, progressive: bool| {
        let mut bytes = jpeg(&picture(16, 16), SamplingFactor::R_4_4_4, progressive, true);
        let marker = [0xFF, if progressive { 0xC2 } else { 0xC0 }];
        let frame = bytes.windows(2).position(|pair| pair == marker).unwrap();
        bytes[frame + 5..frame + 7].copy_from_slice(&height.to_be_bytes());
        bytes[frame + 7..frame + 9].copy_from_slice(&width.to_be_bytes());
        let answer = color_image::read(&bytes);
        answer.err().is_some_and(|error| error.to_string().contains("can hold"))
    };
    assert!(claiming(8192, 8000, false));
    assert!(claiming(3000, 2000, true));
    assert!(!claiming(3840, 2160, false) && !claiming(2560, 1440, true));
}

#[test]
fn pixmaps_keep_their_colours() {
    let image = picture(7, 5);
    let ppm = [b"P6\n# by hand\n7 5\n255\n", image.pixels.as_flattened()].concat();
    assert_eq!(color_image::read(&ppm), Ok(image));
    let grey = color_image::read(b"P5 3 1 255\n\x00\x07\xff").unwrap();
    assert_eq!((grey.width, grey.height, grey.pixels), (3, 1, vec![[0; 3], [7; 3], [255; 3]]));
    let refused = |bytes: &[u8]| color_image::read(bytes).unwrap_err().to_string();
    assert!(refused(&ppm[..ppm.len() - 1]).contains("can hold"));
    assert!(refused(b"P6 4294967297 4294967297 255\n\x01\x02\x03").contains("can hold"));
    assert!(refused(b"P6 0 1 255\n").contains("0 x 1 pixels is empty"));
    assert!(refused(b"P5 1 1 65535\n\x00\x00").contains("65535"));
    assert!(refused(b"P6 3").contains("no height"));
}
