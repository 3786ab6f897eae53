//! A map from above as a picture: what the walls look like, and whether they stand twice.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use glam::Vec3;

/// Side of a pixel (m).
const PIXEL: f32 = 0.015;
/// Heights that are drawn, over the first camera, whose y axis points down (m).
const HEIGHTS: std::ops::Range<f32> = -1.0..0.9;
/// So many points in a pixel make it black.
const BLACK: f32 = 12.0;

/// Draws the points (world frame of the first camera) as seen from above, x to the right and z upwards.
pub fn draw(positions: &[Vec3], file: &Path) {
    let drawn: Vec<Vec3> = positions.iter().copied().filter(|point| HEIGHTS.contains(&-point.y)).collect();
    let low = drawn.iter().copied().fold(Vec3::splat(f32::MAX), Vec3::min);
    let high = drawn.iter().copied().fold(Vec3::splat(f32::MIN), Vec3::max);
    if drawn.is_empty() {
        return;
    }
    let size = |extent: f32| (extent / PIXEL) as usize + 1;
    let (width, height) = (size(high.x - low.x), size(high.z - low.z));
    let mut counts = vec![0.0f32; width * height];
    for point in drawn {
        let (column, row) = (size(point.x - low.x) - 1, size(high.z - point.z) - 1);
        counts[row.min(height - 1) * width + column.min(width - 1)] += 1.0;
    }
    let pixels: Vec<u8> = counts.iter().map(|count| (255.0 * (1.0 - count / BLACK).max(0.0)) as u8).collect();
    let writer = BufWriter::new(File::create(file).expect("a folder for the pictures"));
    let mut encoder = png::Encoder::new(writer, width as u32, height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(&pixels)).expect("a picture");
}
