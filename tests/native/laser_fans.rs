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

/// Logs, and whether their scans tell other fans apart as well: in the corridor, and of a robot that mostly turns, some do not.
const LOGS: [(&str, bool); 6] = [
    ("fr079/fr079.log", true),
    ("radish/freiburg-101.log", true),
    ("radish/belgioioso.log", true),
    ("radish/edmonton.log", true),
    ("radish/infinite-corridor.log", false),
    ("radish/aces.clf", false),
];

#[test]
fn fans_in_another_unit_or_of_another_laser_are_read_as_the_scans_tell() {
    let Some(folder) = shared_data("laser") else { return };
    let unit = 180.0 / std::f64::consts::PI;
    let mut missed = Vec::new();
    for (name, tells_other_fans) in LOGS {
        let log = laser_log::read(&fs::read(folder.join(name)).unwrap()).unwrap();
        let found = notes(&log);
        assert!(!found.contains("fan"), "{name}: {found}");
        let others = [2.0, 0.5, 4.0 / 3.0, 1.5].into_iter().filter(|_| tells_other_fans);
        for factor in [1.0 / unit, unit].into_iter().chain(others) {
            let found = notes(&widened(&log, factor));
            if !found.contains("It was read as 180.0 degrees") {
                missed.push((name, factor, found));
            }
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}
