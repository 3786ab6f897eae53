//! Runs the depth engine on the images of a real camera and prints one line per frame: status, processor time, evidence and pose.
//!
//! `cargo measure depth_camera d435_robot [--depth-only] [--every 2] [--reverse] [--agree] [--lines FILE]`.
//! `--focal 570` is taken for the focal length (pixels) in place of the recorded one. `--agree` compares the depth of successive frames at their poses. Other cameras' recordings are made from it: `--size 848x480`,
//! `--offset 0.05` (of the colours, m), `--rolling 0.5` and `--exposure 0.3` (of the time from frame to frame).

use nalgebra::Vector3;
use scanstitch::camera::Pinhole;
use scanstitch::evaluation::depth_consistency::{ConsistencyLimits, DepthView};
use scanstitch::evaluation::umeyama::umeyama;
use scanstitch::geometry::Pose3;
use scanstitch::io::depth_image;
use scanstitch::odometry::depth::ColorUse;
use scanstitch::pipeline::spatial_settings::SpatialSettings;
use scanstitch_scene::random::Random;

use crate::arguments::{argument, arguments, flag};
use crate::depth::recordings::{self, Recording, pgm};
use crate::depth::scores;
use crate::depth::stand_ins::{self, Changes};

pub fn main() {
    let Some(name) = arguments().into_iter().next().filter(|_| recordings::are_there()) else { return };
    let number = |name: &str, default: usize| argument(name).and_then(|text| text.parse().ok()).unwrap_or(default);
    let whole = recordings::camera(&name);
    let mut order: Vec<usize> = (number("--skip", 0)..whole.depth.len())
        .step_by(number("--every", 1))
        .take(number("--first", usize::MAX))
        .collect();
    if flag("--reverse") {
        order.reverse();
    }
    let scale = whole.depth_scale.unwrap_or(1000.0);
    let noise = argument("--noise").and_then(|text| text.parse().ok()).unwrap_or(0.0);
    let holes = argument("--holes").and_then(|text| text.parse().ok()).unwrap_or(0.0);
    let depth = order.iter().map(|&index| damaged(&whole.depth[index], index, scale, noise, holes)).collect();
    let color = order.iter().filter_map(|&index| whole.color.get(index).cloned()).collect();
    let truth = order.iter().filter_map(|&index| whole.truth.get(index).copied()).collect();
    let focal = argument("--focal").map(|text| text.parse().expect("pixels"));
    let intrinsics = whole.intrinsics.map(|[fx, fy, cx, cy]| [focal.unwrap_or(fx), focal.unwrap_or(fy), cx, cy]);
    let recording = Recording { depth, color, intrinsics, truth, ..whole };
    let is_depth_only = flag("--depth-only");
    let color = if is_depth_only { ColorUse::NotUsed } else { ColorUse::Used };
    let depth_scale = recording.depth_scale.unwrap_or_default();
    let settings = SpatialSettings { color, depth_scale, ..SpatialSettings::default() };
    let changes = changes();
    let recording = match changes {
        Some(changes) => {
            let (reconstruction, _) = scores::reconstruct(&recording, &settings);
            let poses = reconstruction.poses();
            Recording { truth: poses.clone(), ..stand_ins::changed(&recording, &poses, &changes) }
        }
        None => recording,
    };
    let (reconstruction, seconds) = scores::reconstruct(&recording, &settings);
    if let Some(file) = argument("--lines") {
        std::fs::write(file, scores::lines(&reconstruction)).expect("a file to write to");
    }
    let mut counts = [0; 3];
    for (index, (estimate, assessment)) in
        reconstruction.estimates().iter().zip(reconstruction.assessments()).enumerate()
    {
        let status = assessment.status;
        counts[status as usize] += 1;
        let rmse = estimate.registration.as_ref().map_or(0.0, |registration| registration.last.inlier_rmse);
        println!(
            "{} {status:?} {:.1} {:.3} {:.2} {rmse:.4} {} | {}",
            order[index],
            1000.0 * seconds[index],
            assessment.agreement,
            estimate.overlap,
            estimate
                .T_world_sensor
                .to_homogeneous()
                .transpose()
                .iter()
                .map(|x| format!("{x:.6}"))
                .collect::<Vec<_>>()
                .join(" "),
            assessment.reason
        );
    }
    let agreeing = if flag("--agree") { agreeing_steps(&recording, &reconstruction.poses()) } else { Vec::new() };
    if flag("--agree") {
        let apart: Vec<usize> = (0..agreeing.len()).filter(|step| !agreeing[*step]).map(|step| order[step]).collect();
        let count = agreeing.len() - apart.len();
        eprintln!("{count} of {} steps agree; those after {apart:?} do not", agreeing.len());
    }
    reconstruction.result().notes.iter().for_each(|note| eprintln!("{note}"));
    if recording.truth.len() == seconds.len() {
        let MeanErrors { aligned, with_scale, path_ratio, first_equal } =
            mean_errors(&recording.truth, &reconstruction.poses());
        eprintln!(
            "mean distance from the reference: {:.1} mm aligned, {:.1} mm with first poses equal; {:.1} mm with a scale, \
             the path is {:+.2} % longer",
            1000.0 * aligned,
            1000.0 * first_equal,
            1000.0 * with_scale,
            100.0 * (path_ratio - 1.0)
        );
    }
    let worst = seconds.iter().copied().fold(0.0, f64::max);
    eprintln!(
        "{name}: {} frames, good, doubtful, lost {counts:?}; register {:.0} ms a frame, at most {:.0}; loops {}",
        seconds.len(),
        1000.0 * seconds.iter().sum::<f64>() / seconds.len() as f64,
        1000.0 * worst,
        reconstruction.loop_report().num_closed
    );
}

/// Mean distances of an estimate from the truth (m).
struct MeanErrors {
    /// Aligned by rotation and translation, ...
    aligned: f64,
    /// ... and by a scale as well.
    with_scale: f64,
    /// The estimate's size over the truth's: the reciprocal of that scale.
    path_ratio: f64,
    /// With first poses made equal.
    first_equal: f64,
}

fn mean_errors(truth: &[Pose3], estimate: &[Pose3]) -> MeanErrors {
    let positions = |poses: &[Pose3]| -> Vec<Vector3<f64>> { poses.iter().map(|T| T.translation.vector).collect() };
    let (truth_positions, found) = (positions(truth), positions(estimate));
    let mean = |moved: &dyn Fn(&Vector3<f64>) -> Vector3<f64>| {
        let errors = found.iter().zip(&truth_positions).map(|(point, truth)| (moved(point) - truth).norm());
        errors.sum::<f64>() / found.len() as f64
    };
    let aligned = |has_scale: bool| {
        umeyama(&found, &truth_positions, has_scale).map_or((f64::NAN, f64::NAN), |fit| {
            let similarity = fit.similarity;
            let moved =
                |point: &Vector3<f64>| similarity.scale * (similarity.rotation * point) + similarity.translation;
            (mean(&moved), similarity.scale)
        })
    };
    let first = truth[0] * estimate[0].inverse();
    let first_equal = mean(&|point| first.transform_point(&(*point).into()).coords);
    let (with_scale, scale) = aligned(true);
    MeanErrors { aligned: aligned(false).0, with_scale, path_ratio: 1.0 / scale, first_equal }
}

/// The changes that the options name; `None` where they name none.
fn changes() -> Option<Changes> {
    let number = |name: &str| argument(name).map(|text| text.parse::<f64>().expect("a number"));
    let size = argument("--size").map(|text| {
        let (width, height) = text.split_once('x').expect("WIDTHxHEIGHT");
        (width.parse().expect("a width"), height.parse().expect("a height"))
    });
    let [offset, rolling, exposure] = ["--offset", "--rolling", "--exposure"].map(number);
    let is_changed = size.is_some() || [offset, rolling, exposure].iter().any(Option::is_some);
    is_changed.then(|| Changes {
        size,
        offset: offset.unwrap_or_default(),
        rolling: rolling.unwrap_or_default(),
        exposure: exposure.unwrap_or_default(),
    })
}

/// Depths beyond this (m) are not compared: a stereo camera's are noise.
const MAX_COMPARED_DEPTH: f64 = 5.0;

/// Whether the depth images agree at the poses, for each step from one frame to the next: the measure of `scanstitch consistency`.
fn agreeing_steps(recording: &Recording, poses: &[Pose3]) -> Vec<bool> {
    let limits = ConsistencyLimits::default();
    let scale = recording.depth_scale.unwrap_or(1000.0);
    let views: Vec<DepthView> = recording
        .depth
        .iter()
        .map(|bytes| {
            let image = depth_image::read(bytes).expect("a depth image");
            let intrinsics = recording.intrinsics.expect("a camera");
            let camera = Pinhole::new(image.width, image.height, intrinsics).expect("a camera");
            let depths = image.values.iter().map(|&value| f64::from(value) / scale);
            let depths = depths.map(|depth| if depth > MAX_COMPARED_DEPTH { 0.0 } else { depth as f32 }).collect();
            DepthView { camera, depths }
        })
        .collect();
    let agrees = |(views, poses): (&[DepthView], &[Pose3])| {
        let (visible, agreeing) = limits.compare(&views[0], &views[1], &(poses[1].inverse() * poses[0]));
        let is_enough = visible as f64 >= limits.min_visible * views[1].depths.len() as f64;
        is_enough && agreeing as f64 >= limits.min_share * visible as f64
    };
    views.windows(2).zip(poses.windows(2)).map(agrees).collect()
}

/// A depth image with more noise (standard deviation over the square of the depth, 1/m), and with this share of its patches
/// of 16 pixels missing.
fn damaged(bytes: &[u8], index: usize, scale: f64, noise: f64, holes: f64) -> Vec<u8> {
    if noise == 0.0 && holes == 0.0 {
        return bytes.to_vec();
    }
    let mut image = depth_image::read(bytes).expect("a depth image");
    let mut random = Random::new(index as u64);
    let across = image.width.div_ceil(16);
    let is_missing: Vec<bool> =
        (0..across * image.height.div_ceil(16)).map(|_| random.uniform(0.0, 1.0) < holes).collect();
    for (at, value) in image.values.iter_mut().enumerate() {
        let depth = f64::from(*value) / scale;
        let noisy = scale * (depth + noise * depth * depth * random.normal());
        let is_kept = *value > 0 && !is_missing[at / image.width / 16 * across + at % image.width / 16];
        *value = if is_kept { noisy.round().clamp(1.0, 65_534.0) as u16 } else { 0 };
    }
    pgm(&image)
}
