//! Drives of a kilometre through rendered streets that come back to three of them: drift with and without loops, from the first pose on and after
//! all of them are aligned, and loops that are wrong. Arguments: `--drives N` (20), a quarter of them through streets that repeat; `--first SEED` (1); `--step M` (1).

use scanstitch::evaluation::umeyama::umeyama;
use scanstitch::geometry::RigidMotion;
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::spatial_settings::{LoopClosing, SpatialSettings};
use scanstitch::pipeline::{FrameLabel, PreparedFrame, SpatialReconstruction, Stage};
use scanstitch_scene::spinning_lidar::SpinningLidar;
use scanstitch_scene::streets::{drive, streets};

use crate::arguments::argument;

/// What came of a drive.
struct Outcome {
    rmse: f64,
    /// The same after the rotation and translation that align all positions best.
    aligned: f64,
    end: f64,
    num_loops: usize,
    num_good: usize,
    num_frames: usize,
    /// Largest error of a pose relative to the nearest one of at least a hundred frames before (m).
    of_revisits: f64,
}

fn run(seed: u64, repeats: bool, step: f64, loop_closing: LoopClosing) -> Outcome {
    let (space, truth) = (streets(seed, repeats), drive(step));
    let lidar = SpinningLidar { azimuth_step: 1f64.to_radians(), max_range: 60.0, ..SpinningLidar::default() };
    let mut reconstruction =
        SpatialReconstruction::new(SpatialSettings { loop_closing, ..SpatialSettings::default() }).unwrap();
    for (index, pose) in truth.iter().enumerate() {
        let cloud = lidar.scan(&space, pose, 10_000 * seed + index as u64);
        let points: Vec<u8> =
            cloud.positions.iter().flat_map(glam::Vec3::to_array).flat_map(f32::to_le_bytes).collect();
        let header = format!(
            "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT 1\nPOINTS {0}\nDATA binary\n",
            cloud.len()
        );
        let (name, bytes) = (format!("{index}.pcd"), [header.into_bytes(), points].concat());
        let config = reconstruction.begin(&name, &bytes).unwrap().clone();
        let frame = PreparedFrame::from_cloud(&config, FrameLabel { name, index, time: None }, &bytes).unwrap();
        reconstruction.add(frame).unwrap();
        while reconstruction.step().stage != Stage::Done {}
    }
    reconstruction.finish();
    while reconstruction.step().stage != Stage::Done {}
    let poses = reconstruction.poses();
    let error = |a: usize, b: usize| {
        ((truth[a].inverse() * truth[b]).inverse() * (poses[a].inverse() * poses[b])).translation_norm()
    };
    let all: Vec<f64> = (0..poses.len()).map(|index| error(0, index)).collect();
    let nearest = |index: usize| {
        let apart = |other: &usize| (truth[*other].inverse() * truth[index]).translation_norm();
        let before = (0..index.saturating_sub(100)).min_by(|a, b| apart(a).total_cmp(&apart(b)));
        before.filter(|before| apart(before) < 3.0)
    };
    let of_revisits = (0..poses.len()).filter_map(|index| Some(error(nearest(index)?, index))).fold(0.0, f64::max);
    let T_first_world = truth[0].inverse();
    let found: Vec<_> = poses.iter().map(|pose| pose.translation.vector).collect();
    let expected: Vec<_> = truth.iter().map(|pose| (T_first_world * pose).translation.vector).collect();
    let fit = umeyama(&found, &expected, false).unwrap().similarity;
    let off = found.iter().zip(&expected).map(|(a, b)| (fit.rotation * a + fit.translation - b).norm_squared());
    Outcome {
        aligned: (off.sum::<f64>() / all.len() as f64).sqrt(),
        rmse: (all.iter().map(|error| error * error).sum::<f64>() / all.len() as f64).sqrt(),
        end: all[all.len() - 1],
        num_loops: reconstruction.loop_report().num_closed,
        num_good: reconstruction.assessments().iter().filter(|one| one.status == Status::Good).count(),
        num_frames: poses.len(),
        of_revisits,
    }
}

pub fn main() {
    let number = |name, default: f64| argument(name).and_then(|count| count.parse().ok()).unwrap_or(default);
    let (num_drives, step) = (number("--drives", 20.0) as u64, number("--step", 1.0));
    let first = number("--first", 1.0) as u64;
    println!(
        "| drive | without loops: rmse, aligned, end, at revisits (m) | with loops: the same | loops | good |\n|---|---|---|---|---|"
    );
    for seed in first..first + num_drives {
        let repeats = seed % 4 == 0;
        let [without, with] = [LoopClosing::Off, LoopClosing::On].map(|closing| run(seed, repeats, step, closing));
        println!(
            "| {seed}{} | {:.2}, {:.3}, {:.2}, {:.2} | {:.2}, {:.3}, {:.2}, {:.2} | {} | {} of {} |",
            if repeats { ", repeating" } else { "" },
            without.rmse,
            without.aligned,
            without.end,
            without.of_revisits,
            with.rmse,
            with.aligned,
            with.end,
            with.of_revisits,
            with.num_loops,
            with.num_good,
            with.num_frames
        );
    }
}
