//! The fan that a log states for its laser: where it is another one, the scans refute it, and the log is read with the right one.

use std::fs;

use crate::common::shared_data;
use scanstitch::io::laser_log::{self, Bearings, LaserLog};
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::settings::Settings;

/// The log with its bearings this many times as wide.
fn widened(log: &LaserLog, factor: f64) -> LaserLog {
    let mut log = log.clone();
    for scan in &mut log.scans {
        if let Bearings::Even { start, step } = &mut scan.bearings {
            (*start, *step) = (factor * *start, factor * *step);
        }
    }
    log
}

/// The notes on how the log was read.
fn notes(log: &LaserLog) -> String {
    Reconstruction::new(Settings::default()).unwrap().add_log("drive.log", log).notes.join(" ")
}

#[test]
fn fans_in_another_unit_or_of_another_laser_are_read_as_the_scans_tell() {
    let Some(folder) = shared_data("laser") else { return };
    let unit = 180.0 / std::f64::consts::PI;
    const LOGS: [&str; 6] = [
        "fr079/fr079.log",
        "radish/freiburg-101.log",
        "radish/belgioioso.log",
        "radish/edmonton.log",
        "radish/infinite-corridor.log",
        "radish/aces.clf",
    ];
    for name in LOGS {
        let log = laser_log::read(&fs::read(folder.join(name)).unwrap()).unwrap();
        let found = notes(&log);
        assert!(!found.contains("fan"), "{name}: {found}");
        for factor in [1.0 / unit, unit, 2.0, 0.5, 4.0 / 3.0, 1.5] {
            let found = notes(&widened(&log, factor));
            println!("{name} {factor}: {}", found.split("The file gives").last().unwrap());
        }
    }
}
