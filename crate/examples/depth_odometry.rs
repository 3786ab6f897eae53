//! Runs the depth engine on the recordings of ../shared/data/rgbd and prints how far it is from their ground truth, with
//! the first poses made equal and no other alignment. The truth is read after the estimate.

use std::path::{Path, PathBuf};
use std::time::Instant;

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use scanstitch::camera::{DepthImage, DepthScale, Pinhole};
use scanstitch::depth_odometry::DepthOdometry;
use scanstitch::geometry::Pose3;
use scanstitch::io::{depth_png, npy};
use scanstitch::preprocess::depth_surfels::{DepthModel, depth_surfels};
use scanstitch::preprocess::wrap_around::usable_pixels;

struct Recording {
    name: &'static str,
    depth: Vec<PathBuf>,
    intrinsics: Option<[f64; 4]>,
    truth: Vec<Pose3>,
}

fn numbered(folder: &Path, suffix: &str) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .map(|entries| entries.filter_map(|entry| Some(entry.ok()?.path())).collect())
        .unwrap_or_default();
    files.retain(|path| path.to_string_lossy().ends_with(suffix));
    let number = |path: &PathBuf| -> u64 {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.chars().filter(char::is_ascii_digit).collect::<String>().parse().unwrap_or(0)
    };
    files.sort_by_key(number);
    files
}

fn matrix_pose(rows: &[f64]) -> Pose3 {
    let R = Matrix3::from_fn(|row, column| rows[4 * row + column]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&R));
    Isometry3::from_parts(Translation3::new(rows[3], rows[7], rows[11]), rotation)
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().filter_map(|token| token.parse().ok()).collect()
}

fn apartment(root: &Path, name: &'static str) -> Recording {
    let folder = root.join(name);
    let array = npy::read(&std::fs::read(folder.join("GT_pose.npy")).unwrap()).unwrap();
    let npy::PoseRows::Quaternions(rows) = npy::pose_rows(&array).unwrap() else { panic!("(N, 7) expected") };
    let flip = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let truth = rows
        .iter()
        .map(|&[x, y, z, qw, qx, qy, qz]| {
            let rotation = UnitQuaternion::new_normalize(Quaternion::new(qw, qx, qy, qz)) * flip;
            Isometry3::from_parts(Translation3::new(x, y, z), rotation)
        })
        .collect();
    Recording { name, depth: numbered(&folder.join("depth"), ".png"), intrinsics: None, truth }
}

fn fusion_demo(root: &Path) -> Recording {
    let folder = root.join("fusion_demo50/rgbd-frames");
    let depth = numbered(&folder, ".depth.png");
    let truth = numbered(&folder, ".pose.txt")
        .iter()
        .map(|path| matrix_pose(&numbers(&std::fs::read_to_string(path).unwrap())))
        .collect();
    Recording { name: "fusion_demo50", depth, intrinsics: Some([585.0, 585.0, 320.0, 240.0]), truth }
}

fn redwood(root: &Path) -> Recording {
    let folder = root.join("redwood5");
    let log = numbers(&std::fs::read_to_string(folder.join("odometry.log")).unwrap());
    let truth = log.chunks_exact(19).map(|pose| matrix_pose(&pose[3..])).collect();
    let depth = numbered(&folder.join("depth"), ".png");
    Recording { name: "redwood5", depth, intrinsics: Some([525.0, 525.0, 319.5, 239.5]), truth }
}

fn main() {
    let root = PathBuf::from("../shared/data/rgbd");
    if !root.is_dir() {
        eprintln!("skipped: ../shared/data is absent");
        return;
    }
    let verbose = std::env::args().any(|argument| argument == "--frames");
    let offset: f64 = std::env::var("OFFSET").ok().and_then(|v| v.parse().ok()).unwrap_or(0.5);
    let recordings = [
        apartment(&root, "apartment_first_floor"),
        apartment(&root, "apartment_second_floor"),
        fusion_demo(&root),
        redwood(&root),
    ];
    for recording in recordings {
        let bytes: Vec<Vec<u8>> = recording.depth.iter().map(|path| std::fs::read(path).unwrap()).collect();
        let mut odometry = DepthOdometry::default();
        let mut poses = Vec::new();
        let mut seconds = [0.0f64; 3];
        let mut lines = Vec::new();
        for bytes in &bytes {
            let start = Instant::now();
            let image: DepthImage = depth_png::read(bytes).unwrap();
            seconds[0] += start.elapsed().as_secs_f64();
            let start = Instant::now();
            let scale = DepthScale::guess([&image]);
            let camera = match recording.intrinsics {
                Some(intrinsics) => Pinhole::new(image.width, image.height, intrinsics).unwrap(),
                None => Pinhole::from_field_of_view(image.width, image.height, std::f64::consts::FRAC_PI_2).unwrap(),
            };
            let model = DepthModel {
                step: scale.step,
                offset: if image.bits == 8 { offset } else { 0.0 },
                square_noise: if image.bits == 8 { 0.0 } else { 0.002 },
                min_range: 0.1,
                max_range: 10.0,
            };
            let usable = usable_pixels(&image);
            let frame = depth_surfels(&image, &usable, &camera, &model);
            seconds[1] += start.elapsed().as_secs_f64();
            let start = Instant::now();
            let estimate = odometry.register_frame(&frame);
            seconds[2] += start.elapsed().as_secs_f64();
            let last = estimate.registration.as_ref().map(|r| (r.last.inlier_rmse, r.history.len(), r.fitness));
            lines.push(format!("{} surfels, agreement {:.3}, {last:.4?}", frame.surfels().count(), estimate.agreement));
            poses.push(estimate.T_world_camera);
        }
        let first = recording.truth[0];
        let truth: Vec<Pose3> = recording.truth.iter().map(|pose| first.inverse() * pose).collect();
        let error = |index: usize| (poses[index].translation.vector - truth[index].translation.vector).norm();
        let (mut worst_step, mut worst_turn) = ((0.0f64, 0), (0.0f64, 0));
        for index in 0..poses.len() {
            let previous = index.saturating_sub(1);
            let step = poses[previous].inverse() * poses[index];
            let true_step = truth[previous].inverse() * truth[index];
            let off = true_step.inverse() * step;
            if off.translation.vector.norm() > worst_step.0 {
                worst_step = (off.translation.vector.norm(), index);
            }
            if off.rotation.angle() > worst_turn.0 {
                worst_turn = (off.rotation.angle(), index);
            }
            if verbose {
                let e = poses[index].translation.vector - truth[index].translation.vector;
                println!(
                    "{index:3} error {:.3} ({:.3} {:.3} {:.3}), step off {:.4} m {:.3} deg, turn off {:.3} deg; {}",
                    error(index),
                    e.x,
                    e.y,
                    e.z,
                    off.translation.vector.norm(),
                    off.rotation.angle().to_degrees(),
                    (truth[index].inverse() * poses[index]).rotation.angle().to_degrees(),
                    lines[index]
                );
            }
        }
        let mean = (0..poses.len()).map(error).sum::<f64>() / poses.len() as f64;
        let ms = seconds.map(|s| 1000.0 * s / poses.len() as f64);
        println!(
            "{}: mean L2 {mean:.4} m, last {:.4}, worst step {:.3} m (frame {}), {:.2} deg (frame {}); ms a frame: decode {:.1}, surfels {:.1}, register {:.1}; map {}",
            recording.name,
            error(poses.len() - 1),
            worst_step.0,
            worst_step.1,
            worst_turn.0.to_degrees(),
            worst_turn.1,
            ms[0],
            ms[1],
            ms[2],
            odometry.map().surfels().len()
        );
    }
}
