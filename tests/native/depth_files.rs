//! Depth images and NumPy arrays: what is read, and what is refused with which reason.

use crate::common::shared_data;
use scanstitch::camera::{DepthScale, DepthSensor};
use scanstitch::io::depth_image;

fn png(width: u32, height: u32, color: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![0, 0, 0, 255, 255, 255]);
    }
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

/// Rows from the bottom up.
fn pfm(header: &str, values: &[f32], low_first: bool) -> Vec<u8> {
    let bytes = values.iter().flat_map(|value| if low_first { value.to_le_bytes() } else { value.to_be_bytes() });
    header.bytes().chain(bytes).collect()
}

#[test]
fn metres_become_millimetres() {
    let values = [1.2345, f32::NAN, 0.0, f32::INFINITY, 65.535, 65.54, -1.0, 0.0004, 2.0];
    for (scale, low_first) in [("-1.0", true), ("1", false)] {
        let image = depth_image::read(&pfm(&format!("Pf\n3 3\n{scale}\n"), &values, low_first)).unwrap();
        assert_eq!((image.width, image.height, image.bits), (3, 3, 32));
        assert_eq!(image.values, [0, 0, 2000, 0, 65535, 0, 1235, 0, 0], "rows from the top");
    }
    // What cannot be metres, the sky aside, is in millimetres.
    let far = pfm("Pf 5 1 -1\n", &[f32::NAN, 1500.4, 700.0, 65_504.0, 65_504.0], true);
    assert_eq!(depth_image::read(&far).unwrap().values, [0, 1500, 700, 65_504, 65_504]);
    let sky = pfm("Pf 4 1 -1\n", &[1.5, 65_504.0, 65_504.0, 65_504.0], true);
    assert_eq!(depth_image::read(&sky).unwrap().values, [1500, 0, 0, 0]);
    let whole = pfm("Pf 2 1 -1\n", &[1.0, 2.0], true);
    assert!(refused(&whole[..whole.len() - 1]).contains("cut off: it ends in value 2 of 2"));
    assert!(refused(&pfm("Pf 0 1 -1\n", &[], true)).contains("pixels is empty"));
    assert!(refused(b"Pf 4294967296 4294967296 -1\n").contains("more than the file can hold"));
    assert!(refused(b"Pf 2").contains("no height"));
    assert!(refused(b"Pf 2 2").contains("no scale"));
    assert!(refused(&pfm("PF 1 1 -1\n", &[1.0, 2.0, 3.0], true)).contains("colour image"));
}

fn refused(bytes: &[u8]) -> String {
    depth_image::read(bytes).unwrap_err().to_string()
}

#[test]
fn grey_png_of_every_depth_keeps_its_values() {
    use png::{BitDepth, ColorType};
    let image = depth_image::read(&png(
        3,
        2,
        ColorType::Grayscale,
        BitDepth::Sixteen,
        &[0, 1, 2, 3, 255, 255, 0, 0, 1, 0, 0, 9],
    ))
    .unwrap();
    assert_eq!((image.width, image.height, image.bits), (3, 2, 16));
    assert_eq!(image.values, [1, 0x203, 65535, 0, 256, 9]);
    let image = depth_image::read(&png(3, 1, ColorType::Grayscale, BitDepth::Eight, &[0, 7, 255])).unwrap();
    assert_eq!((image.values, image.bits), (vec![0, 7, 255], 8));
    // Four bits a pixel: rows begin at a byte.
    let image = depth_image::read(&png(3, 2, ColorType::Grayscale, BitDepth::Four, &[0x12, 0x30, 0xFE, 0xD0])).unwrap();
    assert_eq!(image.values, [1, 2, 3, 15, 14, 13]);
    let image = depth_image::read(&png(9, 1, ColorType::Grayscale, BitDepth::One, &[0b1010_0001, 0x80])).unwrap();
    assert_eq!(image.values, [1, 0, 1, 0, 0, 0, 0, 1, 1]);
    let image =
        depth_image::read(&png(2, 1, ColorType::GrayscaleAlpha, BitDepth::Sixteen, &[1, 0, 255, 255, 2, 0, 0, 0]))
            .unwrap();
    assert_eq!(image.values, [256, 512]);
    let image = depth_image::read(&png(2, 1, ColorType::Rgba, BitDepth::Eight, &[5, 5, 5, 255, 6, 6, 6, 0])).unwrap();
    assert_eq!(image.values, [5, 6]);
}

#[test]
fn colour_is_no_depth() {
    use png::{BitDepth, ColorType};
    for bytes in [
        png(2, 1, ColorType::Rgb, BitDepth::Eight, &[5, 5, 5, 6, 7, 6]),
        png(2, 1, ColorType::Rgb, BitDepth::Sixteen, &[0; 12]),
        png(2, 1, ColorType::Indexed, BitDepth::Eight, &[0, 1]),
        b"P6 1 1 255\n\x01\x02\x03".to_vec(),
        b"\xFF\xD8\xFF\xE0".to_vec(),
    ] {
        assert!(refused(&bytes).contains("colour image"), "{}", refused(&bytes));
    }
    assert!(refused(b"GIF89a").contains("neither a PNG nor a PGM"));
    assert!(refused(b"").contains("The file is empty"));
}

#[test]
fn cut_off_and_lying_pngs_are_refused_without_a_large_allocation() {
    let data: Vec<u8> = (0..64 * 64 * 2).map(|i: u32| (i * i % 251) as u8).collect();
    let whole = png(64, 64, png::ColorType::Grayscale, png::BitDepth::Sixteen, &data);
    for length in (9..whole.len() - 12).step_by(41) {
        let message = refused(&whole[..length]);
        assert!(message.contains("cut off") || message.contains("broken"), "{length}: {message}");
    }
    for offset in (8..whole.len()).step_by(13) {
        let mut broken = whole.clone();
        broken[offset] ^= 0x55;
        let _ = depth_image::read(&broken); // an error or not, but no panic
    }
    // A header of 2^31 - 1 by 2^31 - 1 pixels, with the right checksum.
    let mut lying = whole.clone();
    lying[16..24].copy_from_slice(&[0x7F, 0xFF, 0xFF, 0xFF, 0x7F, 0xFF, 0xFF, 0xFF]);
    let crc = crc32(&lying[12..29]);
    lying[29..33].copy_from_slice(&crc.to_be_bytes());
    assert!(refused(&lying).contains("more than the file can hold"), "{}", refused(&lying));
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 })
    })
}

#[test]
fn pgm_in_both_forms() {
    let image = depth_image::read(b"P5\n# a comment\n2 2\n65535\n\x01\x00\x00\x02\xFF\xFF\x00\x00").unwrap();
    assert_eq!((image.values, image.bits), (vec![256, 2, 65535, 0], 16));
    let image = depth_image::read(b"P5 2 1 255 \x0A\x20").unwrap();
    assert_eq!((image.values, image.bits), (vec![10, 32], 8));
    let image = depth_image::read(b"P2\n3 1 # wide\n1000\n0 17\n1000\n").unwrap();
    assert_eq!((image.values, image.bits), (vec![0, 17, 1000], 16));
    for (bytes, reason) in [
        (&b"P5 2 2 65535\n\x01\x00\x00"[..], "ends in value 2 of 4"),
        (b"P2 2 1 255 7", "ends in value 2 of 2"),
        (b"P2 2 1 255 7 256", "over its largest"),
        (b"P5 2", "no height"),
        (b"P5 2 2 70000 ", "largest value is 70000"),
        (b"P5 0 2 255 ", "pixels is empty"),
        (b"P5 99999999999 99999999999 255 ", "more than the file can hold"),
    ] {
        assert!(refused(bytes).contains(reason), "{}", refused(bytes));
    }
}

#[test]
fn real_depth_images() {
    let Some(folder) = shared_data("rgbd") else { return };
    for (path, width, height, bits) in [
        ("apartment_first_floor/depth/1.png", 512, 512, 8),
        ("fusion_demo50/rgbd-frames/frame-000008.depth.png", 640, 480, 16),
        ("redwood5/other_formats/TUM_depth.png", 640, 480, 16),
        ("redwood5/other_formats/NYU_depth.pgm", 640, 480, 16),
    ] {
        let image = depth_image::read(&std::fs::read(folder.join(path)).unwrap()).unwrap();
        assert_eq!((image.width, image.height, image.bits), (width, height, bits), "{path}");
        assert!(image.values.iter().filter(|&&value| value > 0).count() * 2 > image.values.len(), "{path}");
    }
    let color = std::fs::read(folder.join("apartment_first_floor/rgb/1.png")).unwrap();
    assert!(refused(&color).contains("colour image"));
}

#[test]
fn the_depth_scale_of_four_kinds_of_cameras_is_estimated() {
    let d435 = DepthSensor::RealSense { focal_length: 384.0 };
    for (name, per_metre, sensor) in [
        ("kinect_office/frame-000500.depth.png", 1000.0, DepthSensor::Kinect),
        ("kinect_office/frame-000625.depth.png", 1000.0, DepthSensor::Kinect),
        ("redwood5/depth/00000.png", 1000.0, DepthSensor::Kinect),
        ("kinect_pioneer/depth/1.png", 5000.0, DepthSensor::Kinect),
        ("kinect_pioneer/depth/46.png", 5000.0, DepthSensor::Kinect),
        ("redwood5/other_formats/TUM_depth.png", 5000.0, DepthSensor::Kinect),
        ("redwood5/other_formats/SUN_depth.png", 8000.0, DepthSensor::Kinect),
        ("d435_robot/depth/0.png", 1000.0, d435),
        ("d435_robot/depth/81.png", 1000.0, d435),
        ("habitat_16bit/depth/1.png", 6553.5, DepthSensor::Unknown),
    ] {
        let Some(path) = shared_data(&format!("rgbd/{name}")) else { return };
        let scale = DepthScale::estimate(&depth_image::read(&std::fs::read(path).unwrap()).unwrap());
        assert_eq!(scale.per_metre(), per_metre, "{name}: {scale:?}");
        let is_alike = match (scale.sensor, sensor) {
            (DepthSensor::RealSense { focal_length: a }, DepthSensor::RealSense { focal_length: b }) => {
                (a / b - 1.0).abs() < 0.02
            }
            (one, other) => one == other,
        };
        assert!(is_alike, "{name}: {scale:?}");
    }
}
