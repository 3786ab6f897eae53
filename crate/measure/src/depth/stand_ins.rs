//! Recordings of cameras that are not at hand, made from real ones: images of another size, colours seen from another place,
//! rows exposed one after another, blur along the motion.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion};
use scanstitch::camera::{ColorImage, DepthImage};
use scanstitch::geometry::Pose3;
use scanstitch::io::{color_image, depth_image};

use super::recordings::{Recording, jpeg_of, pgm};

/// What is changed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Changes {
    /// Width and height (pixels): scaled to the width, the rows in the middle.
    pub size: Option<(usize, usize)>,
    /// From the depth camera to that of the colours (m), to the right.
    pub offset: f64,
    /// Time from the exposure of the first row to that of the last, as a share of the time from frame to frame.
    pub rolling: f64,
    /// Exposure of the colours, as a share of the time from frame to frame.
    pub exposure: f64,
}

/// The motion from the camera's place before a frame and after it, over one frame.
fn motion(poses: &[Pose3], index: usize) -> Pose3 {
    let (before, after) = (index.saturating_sub(1), (index + 1).min(poses.len() - 1));
    let both = poses[before].inverse() * poses[after];
    share(&both, 1.0 / (after - before).max(1) as f64)
}

/// A part of a small motion.
fn share(motion: &Pose3, part: f64) -> Pose3 {
    Isometry3::from_parts(
        Translation3::from(motion.translation.vector * part),
        UnitQuaternion::from_scaled_axis(motion.rotation.scaled_axis() * part),
    )
}

/// The recording as such a camera would have taken it. `poses`: `T_world_camera` of its frames, from which rows and blur are
/// computed; estimates will do.
pub fn changed(recording: &Recording, poses: &[Pose3], changes: &Changes) -> Recording {
    let [fx, fy, cx, cy] = recording.intrinsics.expect("a camera");
    let scale = recording.depth_scale.unwrap_or(1000.0);
    let mut result = recording.clone();
    for (index, bytes) in recording.depth.iter().enumerate() {
        let mut depth = depth_image::read(bytes).expect("a depth image");
        let color = recording.color.get(index).map(|bytes| color_image::read(bytes).expect("a picture"));
        let moved = motion(poses, index);
        let camera = [fx, fy, cx, cy];
        let color = color.map(|color| {
            let color = shifted(&color, &depth, scale, fx * changes.offset);
            rolled_color(&color, &depth, scale, camera, &moved, changes)
        });
        depth = rolled_depth(&depth, scale, camera, &moved, changes.rolling);
        let (depth, color) = resized(depth, color, changes.size);
        result.depth[index] = pgm(&depth);
        if let Some(color) = color {
            result.color[index] = jpeg_of(&color.pixels.concat(), color.width, color.height);
        }
    }
    if let Some((width, height)) = changes.size {
        let image = depth_image::read(&recording.depth[0]).expect("a depth image");
        let factor = width as f64 / image.width as f64;
        let cut = (image.height as f64 * factor - height as f64) / 2.0;
        result.intrinsics = Some([fx * factor, fy * factor, cx * factor, cy * factor - cut]);
    }
    result
}

/// Where a pixel of a row exposed `part` of a frame's time later was seen in the image: the place, and the depth there in the
/// later camera's frame. The depth is that at the pixel itself, or at its neighbours.
fn source(
    depth: &DepthImage,
    scale: f64,
    [fx, fy, cx, cy]: [f64; 4],
    T_image_row: &Pose3,
    (u, v): (usize, usize),
) -> Option<(usize, usize, f64)> {
    let z_at = |x: f64, y: f64| {
        let is_inside = x >= 0.0 && y >= 0.0 && x < depth.width as f64 - 0.5 && y < depth.height as f64 - 0.5;
        is_inside.then(|| f64::from(depth.values[y.round() as usize * depth.width + x.round() as usize]) / scale)
    };
    let ray = Point3::new((u as f64 - cx) / fx, (v as f64 - cy) / fy, 1.0);
    let mut z = z_at(u as f64, v as f64)?.max(0.3);
    let mut place = (u as f64, v as f64);
    for _ in 0..3 {
        let point = T_image_row * Point3::from(ray.coords * z);
        place = (fx * point.x / point.z + cx, fy * point.y / point.z + cy);
        let seen = z_at(place.0, place.1)?;
        if seen == 0.0 {
            return Some((place.0.round() as usize, place.1.round() as usize, 0.0));
        }
        // The ray's depth whose point has the depth that is seen.
        z += seen - point.z;
    }
    Some((place.0.round() as usize, place.1.round() as usize, z))
}

/// Part of a frame's time by which a row is exposed after the middle one.
fn lateness(v: usize, height: usize, rolling: f64) -> f64 {
    rolling * (v as f64 / height as f64 - 0.5)
}

fn rolled_depth(depth: &DepthImage, scale: f64, camera: [f64; 4], motion: &Pose3, rolling: f64) -> DepthImage {
    if rolling == 0.0 {
        return depth.clone();
    }
    let value = |index: usize| {
        let (u, v) = (index % depth.width, index / depth.width);
        let T_image_row = share(motion, lateness(v, depth.height, rolling));
        let (_, _, z) = source(depth, scale, camera, &T_image_row, (u, v)).unwrap_or_default();
        (z.max(0.0) * scale).round() as u16
    };
    DepthImage { values: (0..depth.values.len()).map(value).collect(), ..depth.clone() }
}

/// Rows exposed one after another, and each the mean over its exposure.
fn rolled_color(
    color: &ColorImage,
    depth: &DepthImage,
    scale: f64,
    camera: [f64; 4],
    motion: &Pose3,
    changes: &Changes,
) -> ColorImage {
    const SAMPLES: usize = 7;
    if changes.rolling == 0.0 && changes.exposure == 0.0 {
        return color.clone();
    }
    let parts: Vec<f64> = match changes.exposure {
        0.0 => vec![0.0],
        exposure => (0..SAMPLES).map(|i| exposure * (i as f64 / (SAMPLES - 1) as f64 - 0.5)).collect(),
    };
    let pixel = |index: usize| {
        let (u, v) = (index % color.width, index / color.width);
        let mut sum = [0.0; 4];
        for part in &parts {
            let T_image_row = share(motion, part + lateness(v, color.height, changes.rolling));
            if let Some((x, y, _)) = source(depth, scale, camera, &T_image_row, (u, v)) {
                let seen = color.pixels[y * color.width + x];
                (0..3).for_each(|channel| sum[channel] += f64::from(seen[channel]));
                sum[3] += 1.0;
            }
        }
        let count = f64::max(sum[3], 1.0);
        [0, 1, 2].map(|channel| (sum[channel] / count).round() as u8)
    };
    ColorImage { pixels: (0..color.pixels.len()).map(pixel).collect(), ..color.clone() }
}

/// The colours from a place further to the right: `shift` is the focal length times the distance (pixels m).
fn shifted(color: &ColorImage, depth: &DepthImage, scale: f64, shift: f64) -> ColorImage {
    if shift == 0.0 {
        return color.clone();
    }
    let pixel = |index: usize| {
        let (u, row) = (index % color.width, index / color.width * color.width);
        let z = f64::from(depth.values[index]) / scale;
        let moved = if z > 0.0 { shift / z } else { 0.0 };
        color.pixels[row + ((u as f64 + moved).round() as usize).min(color.width - 1)]
    };
    ColorImage { pixels: (0..color.pixels.len()).map(pixel).collect(), ..color.clone() }
}

/// Scaled to the width by the nearest pixel, the rows in the middle.
fn resized(
    depth: DepthImage,
    color: Option<ColorImage>,
    size: Option<(usize, usize)>,
) -> (DepthImage, Option<ColorImage>) {
    let Some((width, height)) = size else { return (depth, color) };
    let factor = width as f64 / depth.width as f64;
    let cut = (depth.height as f64 * factor - height as f64) / 2.0;
    let from = |index: usize| {
        let (u, v) = ((index % width) as f64 + 0.5, (index / width) as f64 + cut + 0.5);
        let (x, y) = ((u / factor) as usize, (v / factor).max(0.0) as usize);
        y.min(depth.height - 1) * depth.width + x.min(depth.width - 1)
    };
    let color = color.map(|color| ColorImage {
        pixels: (0..width * height).map(|index| color.pixels[from(index)]).collect(),
        width,
        height,
    });
    let values = (0..width * height).map(|index| depth.values[from(index)]).collect();
    (DepthImage { values, width, height, ..depth }, color)
}
