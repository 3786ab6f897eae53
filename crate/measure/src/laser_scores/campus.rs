//! Drives over a campus outdoors, with wheel odometry and from scans alone, compared with the ground truth.

use std::fmt::Write as _;
use std::fs;

use scanstitch::geometry::{Pose2, RigidMotion};
use scanstitch::io::laser_log;
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::report::Stage;
use scanstitch_scene::campus::{CampusOptions, generate};

use super::{PlanarFrame, WRONG, calibration, num_pieces, pieces, small_pieces};
use crate::arguments::arguments;

/// Scans are compared with those after this way (m) and those at one place after this way, which are so near (m).
const STRETCH: f64 = 20.0;
const REVISIT: (f64, f64) = (30.0, 2.0);

/// Options besides the engine's settings.
pub const OPTIONS: [&str; 4] = ["seed", "seeds", "campus_step", "campus_length"];

pub fn print_table(settings: &serde_json::Value, out: Option<&str>) {
    let arguments = arguments();
    let option =
        |name: &str| arguments.iter().find_map(|a| a.strip_prefix(name)?.strip_prefix('=')?.parse::<f64>().ok());
    let defaults = CampusOptions::default();
    let first = option("seed").unwrap_or(1.0) as u64;
    for seed in first..first + option("seeds").unwrap_or(1.0) as u64 {
        let step = option("campus_step").unwrap_or(defaults.step);
        let length = option("campus_length").unwrap_or(defaults.length);
        let drive = generate(&CampusOptions { seed, step, length, ..defaults });
        let all: Vec<f64> = drive.ranges.iter().flatten().copied().collect();
        let none = all.iter().filter(|&&range| range > 81.0).count() as f64 / all.len() as f64;
        println!(
            "campus seed {seed}: {} scans, {:.0} % of the beams without a return",
            drive.ranges.len(),
            100.0 * none
        );
        let log = laser_log::read(drive.carmen().as_bytes()).expect("the log is sound");
        let named = arguments.iter().position(|a| a == "--mode").and_then(|at| arguments.get(at + 1));
        let is_run = |(_, name): &(&str, &str)| named.is_none_or(|named| named == name);
        for (mode, _) in [("log", "odometry"), ("none", "alone")].into_iter().filter(is_run) {
            let mut settings = settings.clone();
            settings["odometry"] = mode.into();
            let mut reconstruction =
                Reconstruction::new(serde_json::from_value(settings).expect("the settings are right"))
                    .expect("and in their limits");
            reconstruction.add_log("campus", &log);
            let started = super::processor_seconds();
            while reconstruction.step().stage != Stage::Done {}
            let seconds = super::processor_seconds() - started;
            let (result, poses) = (reconstruction.result(), reconstruction.poses());
            let count = |status| result.frames.iter().filter(|frame| frame.status == status).count();
            println!(
                "  odometry {mode}: {:.2} ms a scan, good {} doubtful {} lost {}, {} pieces {:?}",
                1e3 * seconds / poses.len() as f64,
                count(Status::Good),
                count(Status::Doubtful),
                count(Status::Lost),
                num_pieces(&result.frames),
                pieces(&result.frames)
            );
            print_pairs(&drive.T_world_robot, &poses, &result.frames);
            println!("    {}", small_pieces(|scan| drive.T_world_robot.get(scan).copied(), &poses, &result.frames));
            if let Some(calibration) = calibration(|scan| drive.T_world_robot.get(scan).copied(), &reconstruction) {
                println!("    {calibration}");
            }
            result.notes.iter().for_each(|note| println!("    note: {note}"));
            if let Some(out) = out {
                fs::create_dir_all(out).expect("the folder can be made");
                let name = format!("{out}/campus{seed}.{step}.{mode}");
                fs::write(format!("{name}.pgm"), reconstruction.occupancy_grid(0.2).pgm())
                    .expect("the map can be written");
                fs::write(format!("{name}.txt"), rows(&drive.T_world_robot, &poses, &result.frames))
                    .expect("the poses can be written");
            }
        }
    }
}

/// Pairs of scans 20 m after each other, and of scans at one place: how many are wrong, and of good ones of a piece.
fn print_pairs(truth: &[Pose2], poses: &[Pose2], frames: &[PlanarFrame]) {
    let mut along = vec![0.0; truth.len()];
    for frame in 1..truth.len() {
        along[frame] = along[frame - 1] + (truth[frame - 1].inverse() * truth[frame]).translation_norm();
    }
    let pairs = |is_pair: &dyn Fn(usize, usize) -> bool| -> Vec<(usize, usize)> {
        (0..truth.len()).flat_map(|b| (0..b).map(move |a| (a, b))).filter(|&(a, b)| is_pair(a, b)).collect()
    };
    let stretches = pairs(&|a, b| along[b] - along[a] >= STRETCH && along[b - 1] - along[a] < STRETCH);
    let places = pairs(&|a, b| {
        along[b] - along[a] > REVISIT.0
            && (truth[a].translation.vector - truth[b].translation.vector).norm() < REVISIT.1
    });
    for (name, pairs) in [("stretches", stretches), ("places", places)] {
        let off = |&(a, b): &(usize, usize)| {
            let off = (truth[a].inverse() * truth[b]).inverse() * (poses[a].inverse() * poses[b]);
            (off.translation_norm(), off.rotation_angle().to_degrees())
        };
        let is_wrong = |pair: &&(usize, usize)| off(pair).0 > WRONG.0 || off(pair).1 > WRONG.1;
        let is_good = |&&(a, b): &&(usize, usize)| {
            [a, b].iter().all(|&frame| frames[frame].status == Status::Good) && frames[a].piece == frames[b].piece
        };
        let good: Vec<&(usize, usize)> = pairs.iter().filter(is_good).collect();
        let falsely: Vec<&&(usize, usize)> = good.iter().filter(|pair| is_wrong(pair)).collect();
        let mut errors: Vec<f64> = pairs.iter().map(|pair| off(pair).0).collect();
        errors.sort_by(f64::total_cmp);
        println!(
            "    {name:9} {} pairs, wrong {}, median {:.3} m; good {}, falsely {} {:?}",
            pairs.len(),
            pairs.iter().filter(is_wrong).count(),
            errors.get(errors.len() / 2).copied().unwrap_or(f64::NAN),
            good.len(),
            falsely.len(),
            falsely
                .iter()
                .take(6)
                .map(|pair| (pair.0, pair.1, (100.0 * off(pair).0).round() / 100.0))
                .collect::<Vec<_>>()
        );
    }
}

fn rows(truth: &[Pose2], poses: &[Pose2], frames: &[PlanarFrame]) -> String {
    let mut text = String::new();
    for (index, ((truth, pose), frame)) in truth.iter().zip(poses).zip(frames).enumerate() {
        let of =
            |pose: &Pose2| format!("{:.3} {:.3} {:.4}", pose.translation.x, pose.translation.y, pose.rotation.angle());
        let _ = writeln!(
            text,
            "{index} {} truth {} {:?} piece {} agreement {:.3} overlap {:.3} {}",
            of(pose),
            of(truth),
            frame.status,
            frame.piece,
            frame.agreement,
            frame.overlap,
            frame.reason
        );
    }
    text
}
