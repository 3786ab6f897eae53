//! Several recordings in one map: joined where they show the same building, and pieces of their own where not.

use std::fs;

use crate::common::shared_data;
use scanstitch::geometry::{Pose2, RigidMotion};
use scanstitch::io::laser_log::{self, LaserLog};
use scanstitch::io::trajectory;
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::report::{FrameResult, Stage};
use scanstitch::pipeline::settings::{Settings, Strategy};
use scanstitch_scene::drive::{Drive, DriveOptions};
use scanstitch_scene::office::{OfficeOptions, generate};

/// A part of a log that keeps no times: nothing says that it goes on with another.
fn part(log: &LaserLog, numbers: std::ops::Range<usize>) -> LaserLog {
    let mut log = LaserLog { scans: log.scans[numbers].to_vec(), ..log.clone() };
    log.scans.iter_mut().for_each(|scan| scan.time = None);
    log
}

fn every_third(log: &LaserLog, numbers: std::ops::Range<usize>) -> LaserLog {
    let part = part(log, numbers);
    LaserLog { scans: part.scans.into_iter().step_by(3).collect(), ..log.clone() }
}

#[test]
fn a_second_recording_of_a_building_joins_the_first_and_one_of_another_building_does_not() {
    let Some(folder) = shared_data("laser/radish") else { return };
    let log = |name: &str| laser_log::read(&fs::read(folder.join(name)).unwrap()).unwrap();
    let (building, other) = (log("freiburg-101.log"), log("belgioioso.log"));
    let size = building.scans.len();
    let logs = [part(&building, 0..size / 2), part(&building, size / 2..size), part(&other, 0..60)];
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    for (number, log) in logs.iter().enumerate() {
        reconstruction.add_log(&format!("{number}.log"), log);
    }
    while reconstruction.step().stage != Stage::Done {}
    let frames = reconstruction.frames_from(0);
    let num_in_main = |range: std::ops::Range<usize>| frames[range].iter().filter(|frame| frame.piece == 0).count();
    let (first, second) = (num_in_main(0..size / 2), num_in_main(size / 2..size));
    assert!(first.min(second) > 9 * (size / 2) / 10, "{first} and {second} scans are in the main piece");
    assert_eq!(num_in_main(size..size + 60), 0);
    let notes = reconstruction.result().notes;
    let is_said = |what: &str| notes.iter().any(|note| note.starts_with(what));
    assert!(
        is_said("1.log joins the map of the recordings before it: 14") && is_said("2.log is not joined"),
        "{notes:?}"
    );
    // Poses of the second recording as seen from those of the first near them, by those that the log's authors computed.
    let (poses, truth) = (reconstruction.poses(), |frame: usize| building.scans[frame].reference.unwrap());
    let is_good = |frame: &usize| frames[*frame].status == Status::Good && frames[*frame].piece == 0;
    let mut errors = Vec::new();
    for first in (0..size / 2).filter(is_good) {
        for second in (size / 2..size).filter(is_good) {
            let T: Pose2 = truth(first).inverse() * truth(second);
            if T.translation_norm() < 3.0 {
                errors.push((T.inverse() * (poses[first].inverse() * poses[second])).translation_norm());
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    let (count, median, most) = (errors.len(), errors[errors.len() / 2], errors[errors.len() - 1]);
    assert!(count > 100 && median < 0.1 && most < 0.5, "{count} pairs, median {median} m, at most {most} m");
}

#[test]
fn a_recording_that_shares_one_stretch_with_another_joins_it() {
    let Some(folder) = shared_data("laser/radish") else { return };
    let log = laser_log::read(&fs::read(folder.join("belgioioso.log")).unwrap()).unwrap();
    // Of the first half scans 0 to 54 alone show what the second half shows.
    let size = log.scans.len();
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    reconstruction.add_log("first.log", &part(&log, 0..size / 2));
    reconstruction.add_log("second.log", &part(&log, size / 2..size));
    let odometry = trajectory::read(&fs::read(folder.join("belgioioso.odometry.txt")).unwrap()).unwrap();
    reconstruction.set_odometry("odometry", odometry).unwrap();
    while reconstruction.step().stage != Stage::Done {}
    let notes = reconstruction.result().notes;
    assert!(notes.iter().any(|note| note.starts_with("second.log joins the map")), "{notes:?}");
    let (frames, poses) = (reconstruction.frames_from(0), reconstruction.poses());
    let truth: Vec<Pose2> = log.scans.iter().map(|scan| scan.reference.unwrap()).collect();
    let is_told = |first: usize, second: usize| {
        [first, second].iter().all(|&frame| frames[frame].status == Status::Good)
            && frames[first].piece == frames[second].piece
            && (truth[first].inverse() * truth[second]).translation_norm() < 20.0
    };
    let pairs = (0..size / 2).flat_map(|first| (size / 2..size).map(move |second| (first, second)));
    let off = |(first, second): (usize, usize)| {
        let off = (truth[first].inverse() * truth[second]).inverse() * (poses[first].inverse() * poses[second]);
        off.translation_norm() > 0.5 || off.rotation_angle() > 5f64.to_radians()
    };
    let are_wrong: Vec<bool> = pairs.filter(|&(first, second)| is_told(first, second)).map(off).collect();
    let num_wrong = are_wrong.iter().filter(|is_wrong| **is_wrong).count();
    assert!(are_wrong.len() > 1000 && 100 * num_wrong < are_wrong.len(), "{num_wrong} of {}", are_wrong.len());
}

#[test]
fn recordings_of_a_few_scans_are_searched_for_in_each_other() {
    let Some(folder) = shared_data("laser/radish") else { return };
    let log = laser_log::read(&fs::read(folder.join("aces.clf")).unwrap()).unwrap();
    let (first, again) = (every_third(&log, 0..147), every_third(&log, 1..147));
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    reconstruction.add_log("first.log", &first);
    reconstruction.add_log("again.log", &again);
    while reconstruction.step().stage != Stage::Done {}
    let notes = reconstruction.result().notes;
    assert!(
        notes.iter().any(|note| note.starts_with("again.log joins the map of the recordings before it")),
        "{notes:?}"
    );
}

#[test]
fn files_of_one_scan_each_are_one_recording() {
    let Some(folder) = shared_data("laser/radish") else { return };
    let log = laser_log::read(&fs::read(folder.join("aces.clf")).unwrap()).unwrap();
    let run = |logs: &[LaserLog]| {
        let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
        for (number, log) in logs.iter().enumerate() {
            reconstruction.add_log(&format!("{number}.log"), log);
        }
        while reconstruction.step().stage != Stage::Done {}
        reconstruction.poses()
    };
    let scans: Vec<LaserLog> = (0..12).map(|at| part(&log, at..at + 1)).collect();
    assert_eq!(run(&scans), run(&[part(&log, 0..12)]));
}

#[test]
fn a_strategy_that_joins_no_recordings_says_so() {
    let recording = generate(&OfficeOptions { seed: 3, num_scans: 8, ..OfficeOptions::default() });
    let drive = Drive::new(&recording, &DriveOptions::default());
    let log = laser_log::read(drive.carmen().as_bytes()).unwrap();
    let settings = Settings { strategy: Strategy::ScanToMap, ..Settings::default() };
    let mut reconstruction = Reconstruction::new(settings).unwrap();
    for name in ["first.log", "second.log"] {
        reconstruction.add_log(name, &part(&log, 0..6));
    }
    while reconstruction.step().stage != Stage::Done {}
    let frames = reconstruction.frames_from(0);
    assert!(frames[..6].iter().all(|frame| frame.status == Status::Good), "{frames:?}");
    let is_told =
        |frame: &FrameResult<_, _>| frame.status != Status::Good && frame.reason.contains("another recording");
    assert!(frames[6..].iter().all(is_told), "{frames:?}");
}
