//! Real logs of large buildings, with the wheels' odometry: loops close, and what is called good is right.

use std::fs;
use std::path::Path;

use crate::common::shared_data;
use crate::driven_grid;
use scanstitch::evaluation::path;
use scanstitch::evaluation::relations::{RelationErrors, relation_errors};
use scanstitch::io::laser_log::{self, LaserLog};
use scanstitch::io::trajectory::Trajectory;
use scanstitch::io::{relations, trajectory};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::settings::Settings;

const LOGS: &str = "laser/radish";

fn read_log(folder: &Path, name: &str) -> LaserLog {
    laser_log::read(&fs::read(folder.join(name)).unwrap()).unwrap()
}

/// A log run with its odometry.
fn run(folder: &Path, log: &str, odometry: Option<&str>) -> Reconstruction {
    run_log(folder, log, &read_log(folder, log), odometry)
}

fn run_log(folder: &Path, name: &str, log: &LaserLog, odometry: Option<&str>) -> Reconstruction {
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    reconstruction.add_log(name, log);
    if let Some(file) = odometry {
        let odometry = trajectory::read(&fs::read(folder.join(file)).unwrap()).unwrap();
        reconstruction.set_odometry(file, odometry).unwrap();
    }
    while reconstruction.step().stage != Stage::Done {}
    reconstruction
}

fn errors(reconstruction: &Reconstruction, relations: &Path, stamps: Option<Vec<f64>>) -> RelationErrors {
    let list = relations::read(&fs::read(relations).unwrap()).unwrap();
    let path = Trajectory { stamps, ..Trajectory::from_poses(&reconstruction.poses_in_space()) };
    let num_poses = reconstruction.num_scans();
    relation_errors(&list, &path::Path::of(&path, 0..num_poses), 0.05).unwrap()
}

/// Share of relations that are off by more than half a metre or five degrees.
fn share_wrong(errors: &RelationErrors) -> f64 {
    let is_wrong = |(t, r): (&f64, &f64)| *t > 0.5 || *r > 5f64.to_radians();
    let pairs = errors.translation_errors.iter().zip(&errors.rotation_errors);
    pairs.filter(|&pair| is_wrong(pair)).count() as f64 / errors.num_compared as f64
}

fn share_good(reconstruction: &Reconstruction) -> f64 {
    let frames = reconstruction.result().frames;
    frames.iter().filter(|frame| frame.status == Status::Good).count() as f64 / frames.len() as f64
}

#[test]
fn the_wheels_poses_in_the_raw_aces_log_are_used_its_loops_close_and_its_driven_cells_are_free() {
    let Some(folder) = shared_data(LOGS) else { return };
    let log = read_log(&folder, "aces.clf");
    let reconstruction = run_log(&folder, "aces.clf", &log, None);
    let stamps = log.scans.iter().map(|scan| scan.time.unwrap()).collect();
    let errors = errors(&reconstruction, &folder.join("aces.relations"), Some(stamps));
    assert_eq!(errors.num_compared, 1279);
    assert!(errors.translation.mean < 0.0375 && errors.rotation.mean < 0.373f64.to_radians(), "{errors:?}");
    assert!(share_wrong(&errors) == 0.0 && share_good(&reconstruction) > 0.8);
    let notes = reconstruction.result().notes;
    assert!(notes.iter().any(|note| note.contains("wheels' own")), "{notes:?}");
    driven_grid::check("aces", reconstruction);
}

#[test]
fn sparse_logs_of_buildings_close_their_loops_and_their_driven_cells_are_free() {
    let Some(folder) = shared_data(LOGS) else { return };
    for (name, most_wrong_stretches) in [("belgioioso", 0.01), ("freiburg-101", 0.01), ("infinite-corridor", 0.01)] {
        let (log, odometry) = (format!("{name}.log"), format!("{name}.odometry.txt"));
        let reconstruction = run(&folder, &log, Some(&odometry));
        let places = errors(&reconstruction, &folder.join(format!("{name}.places.txt")), None);
        let stretches = errors(&reconstruction, &folder.join(format!("{name}.stretches.txt")), None);
        assert!(share_wrong(&places) < 0.01 && places.translation.median < 0.1, "{name}: {}", share_wrong(&places));
        assert!(share_wrong(&stretches) < most_wrong_stretches, "{name}: {}", share_wrong(&stretches));
        assert!(share_good(&reconstruction) > 0.8, "{name}: {}", share_good(&reconstruction));
        driven_grid::check(name, reconstruction);
    }
}

/// In one scan the walls all but leave a turn open; the odometry, which is 0.26 m off, must not turn it by 7 degrees.
#[test]
fn a_third_of_the_beams_missing_turns_no_scan_away_from_what_it_sees() {
    let Some(folder) = shared_data(LOGS) else { return };
    let mut log = read_log(&folder, "belgioioso.log");
    for (number, scan) in log.scans.iter_mut().enumerate() {
        for (beam, range) in scan.ranges.iter_mut().enumerate() {
            if is_missing(number as u64, beam as u64 / 8) {
                *range = f32::NAN;
            }
        }
    }
    let reconstruction = run_log(&folder, "belgioioso.log", &log, Some("belgioioso.odometry.txt"));
    let stretches = errors(&reconstruction, &folder.join("belgioioso.stretches.txt"), None);
    assert!(share_wrong(&stretches) == 0.0 && share_good(&reconstruction) > 0.8, "{}", share_wrong(&stretches));
}

/// Three blocks of beams in ten, picked at random and alike in every run.
fn is_missing(scan: u64, block: u64) -> bool {
    let mut state = scan << 32 ^ block << 8 ^ 1;
    for _ in 0..3 {
        state = (state ^ state >> 31).wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(0x632B_E59B);
    }
    ((state >> 40) as f32) < 0.3 * (1 << 24) as f32
}

#[test]
fn odometry_of_another_log_is_left_out_and_said_so() {
    let Some(folder) = shared_data(LOGS) else { return };
    let reconstruction = run(&folder, "freiburg-101.log", Some("belgioioso.odometry.txt"));
    let notes = reconstruction.result().notes;
    let is_refusal = |note: &String| note.contains("belgioioso") && note.contains("odometry of this log");
    assert!(notes.iter().any(is_refusal), "{notes:?}");
    let places = errors(&reconstruction, &folder.join("freiburg-101.places.txt"), None);
    assert!(share_wrong(&places) < 0.01, "the scans alone place it: {}", share_wrong(&places));
}
