//! Runs the pipeline that courses teach (voxels, FPFH, RANSAC, point-to-plane ICP, frame to frame) on the rendered rooms of
//! ../shared/data/rgbd, and the engine's own odometry of clouds beside it. Prints the error of both against the ground truth, with
//! the first poses made equal, and the time of each stage. The ground truth is read after the estimate. `--course` runs that
//! pipeline alone, `--seed N` sets the seed of its random samples, `--frames` prints every frame.

use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::Vec3;
use nalgebra::{UnitQuaternion, Vector3};
use scanstitch::geometry::{PointCloud, Pose3};
use scanstitch::io::{depth_image, trajectory};
use scanstitch::odometry::cloud::{CloudMethod, CloudOdometry, CloudOptions, PreparedCloud};
use scanstitch::registration::global::GlobalMethod;
use scanstitch::registration::spatial::SpatialMetric;

use crate::arguments::{argument, flag};

/// Focal length and principal point of the rendered images (pixels), and depth of one raw step (m).
const FOCAL: f32 = 256.0;
const DEPTH_STEP: f32 = 10.0 / 255.0;

fn numbered(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .map(|entries| entries.filter_map(|entry| Some(entry.ok()?.path())).collect())
        .unwrap_or_default();
    let number = |path: &PathBuf| path.file_stem().and_then(|stem| stem.to_string_lossy().parse::<u64>().ok());
    files.retain(|path| number(path).is_some());
    files.sort_by_key(number);
    files
}

/// Every pixel with a depth, as a point in front of the camera.
fn back_projected(path: &Path) -> PointCloud {
    let image = depth_image::read(&std::fs::read(path).expect("readable")).expect("a depth image");
    let point = |(index, &value): (usize, &u16)| {
        let z = f32::from(value) * DEPTH_STEP;
        let (u, v) = ((index % image.width) as f32, (index / image.width) as f32);
        (value > 0).then(|| Vec3::new((u - FOCAL) / FOCAL * z, (v - FOCAL) / FOCAL * z, z))
    };
    PointCloud::from_positions(image.values.iter().enumerate().filter_map(point).collect())
}

#[allow(clippy::too_many_lines)]
fn run(folder: &Path, label: &str, options: CloudOptions, verbose: bool) {
    let frames = numbered(&folder.join("depth"));
    let mut odometry = CloudOdometry::new(options).expect("sound options");
    let (mut poses, mut seconds, mut counts, mut num_points) = (Vec::new(), [0.0; 3], [0; 3], 0);
    let mut assessments = Vec::new();
    for path in &frames {
        let started = Instant::now();
        let cloud = back_projected(path);
        let read = Instant::now();
        let prepared = PreparedCloud::new(&cloud, &options).expect("sound options");
        let ready = Instant::now();
        num_points += prepared.cloud().len();
        let estimate = odometry.register_frame(prepared);
        seconds[0] += (read - started).as_secs_f64();
        seconds[1] += (ready - read).as_secs_f64();
        seconds[2] += ready.elapsed().as_secs_f64();
        counts[estimate.assessment.status as usize] += 1;
        poses.push(estimate.T_world_sensor);
        assessments.push(estimate.assessment);
    }
    let truth = trajectory::read(&std::fs::read(folder.join("GT_pose.npy")).expect("readable")).expect("poses");
    // The file's camera looks along -z with y up.
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let truth: Vec<Pose3> = truth.poses().expect("poses").iter().map(|pose| pose * turn).collect();
    let error = |index: usize| {
        let expected = truth[0].inverse() * truth[index];
        (poses[index].translation.vector - expected.translation.vector).norm()
    };
    let (mut worst, mut worst_turn, mut steps_off) = ((0.0, 0), (0.0, 0), 0.0);
    for index in 1..poses.len() {
        let step = poses[index - 1].inverse() * poses[index];
        let off = (truth[index - 1].inverse() * truth[index]).inverse() * step;
        let (metres, degrees) = (off.translation.vector.norm(), off.rotation.angle().to_degrees());
        steps_off += metres;
        if metres > worst.0 {
            worst = (metres, index);
        }
        if degrees > worst_turn.0 {
            worst_turn = (degrees, index);
        }
        if verbose {
            println!("{index:3}: {:.3} m, step {metres:.3} m {degrees:.2} deg, {:?}", error(index), assessments[index]);
        }
    }
    let count = poses.len() as f64;
    println!(
        "{} {label}: {} frames of {:.0} points: mean L2 {:.4} m, steps off by {:.4} m, at worst {worst:.3?} m {worst_turn:.2?} deg; good, \
         doubtful, lost {counts:?}; ms a frame: read {:.1}, prepare {:.1}, register {:.1}",
        folder.file_name().unwrap_or_default().to_string_lossy(),
        poses.len(),
        num_points as f64 / count,
        (0..poses.len()).map(error).sum::<f64>() / count,
        steps_off / (count - 1.0),
        1e3 * seconds[0] / count,
        1e3 * seconds[1] / count,
        1e3 * seconds[2] / count
    );
}

pub fn main() {
    let root = Path::new("../shared/data/rgbd");
    if !root.is_dir() {
        eprintln!("skipped: ../shared/data is absent");
        return;
    }
    let verbose = flag("--frames");
    let only_course = flag("--course");
    let seed = argument("--seed").and_then(|seed| seed.parse().ok());
    let global_method = GlobalMethod::Ransac { seed: seed.unwrap_or(1) };
    for name in ["apartment_first_floor", "apartment_second_floor"] {
        let folder = root.join(name);
        run(&folder, "course", CloudOptions { global_method, ..CloudOptions::course(0.05) }, verbose);
        if only_course {
            continue;
        }
        for (method, method_name) in
            [(CloudMethod::CloudToCloud, "cloud_to_cloud"), (CloudMethod::CloudMap, "cloud_map")]
        {
            for (metric, metric_name) in [(SpatialMetric::PointToPlane, "plane"), (SpatialMetric::Gicp, "gicp")] {
                let options = CloudOptions { method, metric, ..CloudOptions::new(0.05) };
                run(&folder, &format!("{method_name} {metric_name}"), options, verbose);
            }
        }
    }
}
