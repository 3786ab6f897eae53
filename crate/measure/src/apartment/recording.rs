//! Writes recordings of the synthetic flat the way the homework's folders are laid out.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use scanstitch::camera::{DepthImage, Pinhole};
use scanstitch::geometry::Pose3;
use scanstitch::io::trajectory::{Trajectory, TrajectoryFormat, write};
use scanstitch_scene::apartment::Apartment;
use scanstitch_scene::apartment::walk::in_homework_axes;
use scanstitch_scene::random::Random;
use scanstitch_scene::space::{DepthSensor, RenderedFrame};

/// Quality of the JPEG files.
const QUALITY: u8 = 85;

/// A picture as a JPEG file.
pub fn jpeg(frame: &RenderedFrame) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, QUALITY);
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    encoder.set_optimized_huffman_tables(true);
    encoder.encode(&frame.rgb, frame.width as u16, frame.height as u16, ColorType::Rgb)?;
    Ok(bytes)
}

/// Depth as a grey PNG file of 8 or 16 bits.
pub fn depth_png(image: &DepthImage) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width as u32, image.height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_compression(png::Compression::High);
    let data: Vec<u8> = if image.bits == 8 {
        encoder.set_depth(png::BitDepth::Eight);
        image.values.iter().map(|&value| value as u8).collect()
    } else {
        encoder.set_depth(png::BitDepth::Sixteen);
        image.values.iter().flat_map(|value| value.to_be_bytes()).collect()
    };
    encoder.write_header()?.write_image_data(&data)?;
    Ok(bytes)
}

/// Writes `rgb/N.jpg` and `depth/N.png`, N from 1, and `GT_pose.npy`. The noise of a frame follows from the seed and its
/// number, so every frame can be rendered alone.
pub fn write_recording(
    out: &Path,
    apartment: &Apartment,
    camera: &Pinhole,
    walk: &[Pose3],
    sensor: DepthSensor,
    seed: u64,
) -> Result<(), Box<dyn Error>> {
    for folder in ["rgb", "depth"] {
        fs::create_dir_all(out.join(folder))?;
    }
    let next = AtomicUsize::new(0);
    let failure = Mutex::new(None);
    let render = || -> Result<(), Box<dyn Error>> {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(pose) = walk.get(index) else { return Ok(()) };
            let frame = apartment.space.render(pose, camera);
            let mut random = Random::new(seed.wrapping_mul(1000) + index as u64);
            let depth = sensor.measure(&frame.depth, frame.width, &mut random);
            fs::write(out.join(format!("rgb/{}.jpg", index + 1)), jpeg(&frame)?)?;
            fs::write(out.join(format!("depth/{}.png", index + 1)), depth_png(&depth)?)?;
        }
    };
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                if let Err(error) = render() {
                    *failure.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = Some(error.to_string());
                }
            });
        }
    });
    if let Some(error) = failure.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
        return Err(error.into());
    }
    fs::write(out.join("GT_pose.npy"), poses_npy(walk)?)?;
    Ok(())
}

/// The poses of a walk as the homework's `GT_pose.npy`.
pub fn poses_npy(walk: &[Pose3]) -> Result<Vec<u8>, Box<dyn Error>> {
    let poses: Vec<Pose3> = walk.iter().map(in_homework_axes).collect();
    Ok(write(&Trajectory::from_poses(&poses), TrajectoryFormat::Npy)?)
}

/// `scene.json` of the top and the front view: robotics axes for the world (z up), x right, y down, z forward for the
/// cameras, the floor at height 0.
pub fn bev_scene(camera: &Pinhole, [top, front]: [&Pose3; 2]) -> String {
    let side = |name: &str, pose: &Pose3| {
        let matrix = pose.to_homogeneous();
        // Quarter turns leave rounding errors of sines and cosines: no position is meant to a picometre.
        let tidy = |value: f64| (value * 1e12).round() / 1e12 + 0.0;
        let row = |row: usize| {
            let values: Vec<String> = (0..4).map(|column| tidy(matrix[(row, column)]).to_string()).collect();
            format!("[{}]", values.join(", "))
        };
        let rows: Vec<String> = (0..4).map(row).collect();
        format!(
            "  \"{name}\": {{\n    \"image\": \"{name}.jpg\",\n    \"width\": {},\n    \"height\": {},\n    \
             \"intrinsics\": {{ \"kind\": \"focal\", \"fx\": {}, \"fy\": {}, \"cx\": {}, \"cy\": {} }},\n    \
             \"pose\": {{\n      \"kind\": \"matrix\",\n      \"T_world_camera\": [\n        {}\n      ]\n    }}\n  }}",
            camera.width,
            camera.height,
            camera.fx,
            camera.fy,
            camera.cx,
            camera.cy,
            rows.join(",\n        ")
        )
    };
    let plane = "{ \"kind\": \"level\", \"height\": 0 }";
    format!(
        "{{\n  \"axes\": \"ros_optical\",\n  \"plane\": {plane},\n{},\n{}\n}}\n",
        side("top", top),
        side("front", front)
    )
}
