//! Reconstructs a laser log natively and prints its assessment: the program to profile.
//!
//! `cargo measure laser_log LOG [--odometry FILE] [--relations FILE] [--reference FILE] [NAME=VALUE]...`

use std::time::Instant;

use scanstitch::evaluation::path::Path;
use scanstitch::evaluation::relations::relation_errors;
use scanstitch::geometry::{Pose2, Pose3, RigidMotion};
use scanstitch::io::{laser_log, relations, trajectory};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::settings::Settings;

use crate::arguments::arguments;

pub fn main() {
    let arguments = arguments();
    let option = |name: &str| arguments.iter().position(|a| a == name).and_then(|at| arguments.get(at + 1));
    let mut settings = serde_json::to_value(Settings::default()).expect("settings are plain data");
    for pair in &arguments {
        if let Some((name, value)) = pair.split_once('=') {
            settings[name] = serde_json::from_str(value).unwrap_or_else(|_| value.into());
        }
    }
    let settings: Settings = serde_json::from_value(settings).expect("the settings are right");
    let log = laser_log::read(&std::fs::read(&arguments[0]).expect("the log can be read")).expect("the log is sound");
    println!("{} scans, the laser at {:?}", log.scans.len(), log.T_robot_laser);
    let mut reconstruction = Reconstruction::new(settings).expect("the settings are right");
    reconstruction.add_log("log", &log);
    if let Some(file) = option("--odometry") {
        let odometry =
            trajectory::read(&std::fs::read(file).expect("odometry can be read")).expect("odometry is sound");
        reconstruction.set_odometry(file, odometry).expect("odometry has headings");
    }
    let (mut stage, mut started) = (Stage::Register, Instant::now());
    while stage != Stage::Done {
        let next = reconstruction.step().stage;
        if next != stage {
            println!("{stage:?}: {:.2} s", started.elapsed().as_secs_f64());
            (stage, started) = (next, Instant::now());
        }
    }
    let result = reconstruction.result();
    for status in [Status::Good, Status::Doubtful, Status::Lost] {
        let frames: Vec<usize> =
            (0..result.frames.len()).filter(|&frame| result.frames[frame].status == status).collect();
        println!(
            "{status:?}: {} {:?}",
            frames.len(),
            &frames[..frames.len().min(if status == Status::Good { 0 } else { 30 })]
        );
    }
    result.notes.iter().for_each(|note| println!("{note}"));
    if let Some(sharpness) = result.sharpness {
        println!("sharpness {:.1} mm over {}", 1e3 * sharpness.mean_residual, sharpness.num_pairs);
    }
    let poses = reconstruction.poses_in_space();
    if let Some(file) = option("--out") {
        std::fs::write(file, reconstruction.trajectory_tum()).expect("the trajectory can be written");
    }
    if let Some(file) = option("--grid") {
        let started = Instant::now();
        let grid = reconstruction.occupancy_grid(0.05);
        std::fs::write(file, grid.pgm()).expect("the grid can be written");
        println!("grid {} x {}: {:.2} s", grid.width, grid.height, started.elapsed().as_secs_f64());
    }
    if let Some(file) = option("--relations") {
        let list = relations::read(&std::fs::read(file).expect("relations can be read")).expect("relations are sound");
        let (steps, loops): (Vec<_>, Vec<_>) = list.into_iter().partition(relations::Relation::is_step);
        for (name, list) in [("steps", steps), ("loops", loops)] {
            let errors =
                relation_errors(&list, &Path::of(&trajectory::Trajectory::from_poses(&poses), 0..poses.len()), 0.01);
            if let Ok(errors) = errors {
                let (t, r) = (errors.translation, errors.rotation);
                println!(
                    "{name}: mean {:.4} m {:.3} deg, median {:.4} m {:.3} deg, max {:.3} m {:.2} deg",
                    t.mean,
                    r.mean.to_degrees(),
                    t.median,
                    r.median.to_degrees(),
                    t.max,
                    r.max.to_degrees()
                );
            }
        }
    }
    if let Some(file) = option("--reference") {
        let reference = trajectory::read(&std::fs::read(file).expect("it can be read")).expect("it is sound");
        compare(&reconstruction, &reference.poses().expect("it has headings"), &result);
    }
}

/// After the alignment that minimises the sum of squared distances.
fn compare(
    reconstruction: &Reconstruction,
    reference: &[Pose3],
    result: &scanstitch::pipeline::report::ReconstructionResult,
) {
    let estimate: Vec<_> = reconstruction.poses_in_space().iter().map(|pose| pose.translation.vector.xy()).collect();
    let truth: Vec<_> = reference.iter().map(|pose| pose.translation.vector.xy()).collect();
    let n = estimate.len().min(truth.len()) as f64;
    let mean = |points: &[nalgebra::Vector2<f64>]| points.iter().sum::<nalgebra::Vector2<f64>>() / n;
    let (a, b) = (mean(&estimate), mean(&truth));
    let covariance = estimate.iter().zip(&truth).map(|(e, t)| (t - b) * (e - a).transpose()).sum();
    let R = Pose2::best_rotation(&covariance).expect("finite");
    let errors: Vec<f64> = estimate.iter().zip(&truth).map(|(e, t)| (R * (e - a) + b - t).norm()).collect();
    let largest = errors.iter().copied().fold(0.0, f64::max);
    let wrong = (0..errors.len()).filter(|&i| errors[i] > 0.5).collect::<Vec<_>>();
    let unsaid = wrong.iter().filter(|&&i| result.frames[i].status == Status::Good).count();
    println!(
        "reference: mean {:.4} m, max {largest:.3} m; {} off by more than 0.5 m, {unsaid} of them called good",
        errors.iter().sum::<f64>() / n,
        wrong.len()
    );
}
