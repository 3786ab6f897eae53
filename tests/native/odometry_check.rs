//! Odometry that is not that of the scans, or in other units, or by another clock: told, with the remedy; and good odometry
//! is taken as it is.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::common::shared_data;
use scanstitch::geometry::Pose2;
use scanstitch::io::{laser_log, trajectory};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::odometry_check::{CheckedOdometry, check_odometry, mirror_of_log};
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::recorded_scan::RecordedScan;
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::settings::Settings;
use scanstitch::preprocess::clean::range_limit;

/// Logs with their own odometry: rows of number, x, y (m), heading (rad).
struct Drive {
    scans: Vec<RecordedScan>,
    rows: Vec<[f64; 4]>,
}

fn check(drive: &Drive, odometry: &str) -> CheckedOdometry {
    let limit = range_limit(drive.scans.iter().map(|scan| scan.cloud.positions.as_slice()));
    let given = trajectory::read(odometry.as_bytes()).unwrap();
    check_odometry("wheels.txt", &drive.scans, &given, limit.unwrap_or(f64::INFINITY))
}

fn real(log: &Path, odometry: Option<&Path>) -> Drive {
    let log = laser_log::read(&fs::read(log).unwrap()).unwrap();
    let scans: Vec<RecordedScan> = RecordedScan::of_log(&log).collect();
    let of_log = |scan: &RecordedScan| scan.odometry.unwrap();
    let poses: Vec<Pose2> = match odometry {
        Some(file) => {
            let given = trajectory::read(&fs::read(file).unwrap()).unwrap();
            let headings = given.headings.unwrap();
            given.positions.iter().zip(&headings).map(|(p, &heading)| Pose2::new(p.xy(), heading)).collect()
        }
        None => scans.iter().map(of_log).collect(),
    };
    let row =
        |(index, pose): (usize, &Pose2)| [index as f64, pose.translation.x, pose.translation.y, pose.rotation.angle()];
    let rows = poses.iter().enumerate().map(row).collect();
    Drive { scans, rows }
}

/// All that are recorded.
fn all(folder: &Path) -> [(&'static str, Drive); 6] {
    let with_odometry = |recordings: &str, name: &'static str| {
        let file = |ending: &str| folder.join(recordings).join(format!("{name}.{ending}"));
        (name, real(&file("log"), Some(&file("odometry.txt"))))
    };
    [
        with_odometry("radish", "belgioioso"),
        with_odometry("radish", "edmonton"),
        with_odometry("radish", "freiburg-101"),
        with_odometry("radish", "infinite-corridor"),
        ("aces", real(&folder.join("radish/aces.clf"), None)),
        with_odometry("fr079", "fr079"),
    ]
}

/// Rows of number, x, y, heading.
fn rows(drive: &Drive, scale: f64, angle: f64) -> String {
    drive.rows.iter().fold(String::new(), |mut text, [number, x, y, heading]| {
        let _ = writeln!(text, "{number} {} {} {}", x * scale, y * scale, heading * angle);
        text
    })
}

/// TUM's rows, with the times of the scans and this added (s).
fn timed(drive: &Drive, shift: f64) -> String {
    drive.rows.iter().zip(&drive.scans).fold(String::new(), |mut text, ([_, x, y, heading], scan)| {
        let (sin, cos) = (heading / 2.0).sin_cos();
        let _ = writeln!(text, "{} {x} {y} 0 0 0 {sin} {cos}", scan.time.unwrap() + shift);
        text
    })
}

/// What is told; empty of odometry that is used.
fn refusal(drive: &Drive, odometry: &str) -> String {
    let checked = check(drive, odometry);
    let is_used = checked.poses.iter().any(Option::is_some);
    assert_eq!(is_used, checked.refusal.is_none());
    checked.refusal.unwrap_or_default()
}

const DEGREES: f64 = 180.0 / std::f64::consts::PI;

fn units_are_told(name: &str, drive: &Drive) {
    assert_eq!(check(drive, &rows(drive, 1.0, 1.0)).refusal, None, "{name}");
    for (scale, angle, told) in [
        (1.0, DEGREES, "Its headings are degrees: "),
        (100.0, 1.0, "Its positions are centimetres: "),
        (1000.0, 1.0, "Its positions are millimetres: "),
        (0.001, 1.0, "Its positions are kilometres: "),
        (0.01, 1.0, "Its positions are about a hundred times too small: "),
        (0.1, 1.0, "Its positions are about ten times too small: "),
        (10.0, 1.0, "Its positions are about ten times too large: "),
        (100.0, DEGREES, "Its headings are degrees and its positions centimetres: "),
    ] {
        let found = refusal(drive, &rows(drive, scale, angle));
        assert!(
            found.starts_with(&format!("wheels.txt: {told}")) && found.contains(" Give "),
            "{name}: {told} {found}"
        );
    }
}

/// The laser turns the other way than its readings were taken, or y was counted to the right.
fn mirrors_are_told(name: &str, drive: &Drive) {
    let drive_mirrored = Drive {
        scans: drive.scans.clone(),
        rows: drive.rows.iter().map(|&[number, x, y, heading]| [number, x, -y, -heading]).collect(),
    };
    let checked = check(&drive_mirrored, &rows(&drive_mirrored, 1.0, 1.0));
    assert!(checked.mirrored.is_some(), "{name}: {:?}", checked.refusal);
    assert!(checked.refusal.unwrap().contains("It is the mirror image of what the scans saw"), "{name}");

    // The poses that stand in the log.
    let mut scans = drive.scans.clone();
    let limit = range_limit(scans.iter().map(|scan| scan.cloud.positions.as_slice())).unwrap_or(f64::INFINITY);
    for (scan, &[_, x, y, heading]) in scans.iter_mut().zip(&drive.rows) {
        scan.odometry = Some(Pose2::new([x, y].into(), heading));
    }
    assert_eq!(mirror_of_log(&scans, limit), None, "{name}");
    scans.iter_mut().flat_map(|scan| &mut scan.cloud.positions).for_each(|p| p.y = -p.y);
    let told = mirror_of_log(&scans, limit).unwrap_or_default();
    assert!(told.contains("mirror image") && told.contains("turns clockwise"), "{name}: {told}");
}

/// The laser looks sideways or backwards, or the odometry's headings count from another axis.
fn turns_are_told(name: &str, drive: &Drive) {
    for (quarter, told) in [(1.0, -90), (2.0, 180), (-1.0, 90)] {
        let turned = Drive {
            scans: drive.scans.clone(),
            rows: drive.rows.iter().map(|&[number, x, y, h]| [number, x, y, h + quarter * FRAC_PI_2]).collect(),
        };
        let checked = check(&turned, &rows(&turned, 1.0, 1.0));
        assert_eq!(checked.refusal, None, "{name}");
        assert!(checked.notes[0].contains(&format!("turned by {told} degrees")), "{name}: {:?}", checked.notes);
        for (pose, [_, x, y, heading]) in checked.poses.iter().flatten().zip(&drive.rows) {
            let off = pose.inverse() * Pose2::new([*x, *y].into(), *heading);
            assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle().abs() < 1e-9, "{name}");
        }
    }
}

fn clocks_are_told(name: &str, drive: &Drive) {
    let good = check(drive, &timed(drive, 0.0));
    assert_eq!((good.refusal, good.notes), (None, vec![]), "{name}");
    for (shift, told) in [(3.0, "Its clock is 3 s ahead"), (-12.25, "Its clock is 12.25 s behind")] {
        // As many poses as scans: they are taken in their order, and the clock is told.
        let checked = check(drive, &timed(drive, shift));
        assert_eq!(checked.refusal, None, "{name}");
        assert!(checked.notes[0].contains(told), "{name}: {:?}", checked.notes);
        assert_eq!(checked.poses.iter().flatten().count(), drive.scans.len());
        // Some are missing: there is no order to take.
        let some: String = timed(drive, shift).lines().skip(2).fold(String::new(), |text, line| text + line + "\n");
        let found = refusal(drive, &some);
        assert!(found.contains(told) && found.contains(&format!("Add {} s to its times", -shift)), "{name}: {found}");
    }
    // Times that meet none of the scans'.
    let late: String = timed(drive, 1e6).lines().skip(2).fold(String::new(), |text, line| text + line + "\n");
    let found = refusal(drive, &late);
    assert!(found.contains("are not those of the scans") && found.contains("its clock is off: add -100000"), "{found}");
}

#[test]
fn odometry_of_real_logs_is_taken_and_what_is_wrong_with_it_told() {
    let Some(folder) = shared_data("laser") else { return };
    let drives = all(&folder);
    for (name, drive) in &drives {
        units_are_told(name, drive);
        mirrors_are_told(name, drive);
        turns_are_told(name, drive);
        if *name == "aces" || *name == "fr079" {
            clocks_are_told(name, drive);
        }
        for (other, another) in &drives {
            if other != name {
                let found = refusal(drive, &rows(another, 1.0, 1.0));
                assert!(found.contains("Give the odometry of this log"), "{name} with {other}'s: {found}");
            }
        }
    }
}

fn made_up() -> Drive {
    let (text, rows) = made_up_log(false);
    let log = laser_log::read(text.as_bytes()).unwrap();
    Drive { scans: RecordedScan::of_log(&log).collect(), rows }
}

/// A robot that drives an oval in a hall with pillars, a scan each half second; 180 beams, the last one first where it turns
/// clockwise.
fn made_up_log(is_clockwise: bool) -> (String, Vec<[f64; 4]>) {
    let walls = [[-6.0, -4.0, 9.0, -4.0], [9.0, -4.0, 9.0, 5.0], [9.0, 5.0, -6.0, 7.0], [-6.0, 7.0, -6.0, -4.0]];
    let pillars = [[0.0, 1.0, 1.0, 1.6], [1.0, 1.6, 0.4, 2.4], [3.0, -0.2, 3.8, 0.5], [-3.4, 2.0, -2.8, 1.2]];
    let range = |x: f64, y: f64, angle: f64| {
        let (dy, dx) = angle.sin_cos();
        let hit = |&[x0, y0, x1, y1]: &[f64; 4]| {
            let (ex, ey) = (x1 - x0, y1 - y0);
            let cross = dx * ey - dy * ex;
            let (range, along) = (((x0 - x) * ey - (y0 - y) * ex) / cross, ((x0 - x) * dy - (y0 - y) * dx) / cross);
            if range > 0.0 && (0.0..=1.0).contains(&along) { range } else { f64::INFINITY }
        };
        walls.iter().chain(&pillars).map(hit).fold(f64::INFINITY, f64::min)
    };
    let mut text = String::new();
    let mut rows = Vec::new();
    for scan in 0..160 {
        // Stands still for a while now and then, which gives the clock away.
        let t = f64::from(scan / 20 * 14 + (scan % 20).min(14)) * 0.09;
        let (x, y, heading) = (1.5 + 4.5 * t.cos(), 0.8 + 2.6 * t.sin(), t + 1.6 + 0.4 * (5.0 * t).sin());
        let mut beams: Vec<String> =
            (0..180).map(|beam| format!("{:.3}", range(x, y, heading + f64::from(beam - 90).to_radians()))).collect();
        if is_clockwise {
            beams.reverse();
        }
        let (time, beams) = (100.0 + 0.5 * f64::from(scan), beams.join(" "));
        let _ = writeln!(text, "FLASER 180 {beams} {x} {y} {heading} {x} {y} {heading} {time} h {time}");
        rows.push([f64::from(scan), x, y, heading]);
    }
    (text, rows)
}

#[test]
fn a_mirrored_map_is_doubtful_where_the_log_has_poses() {
    for is_clockwise in [false, true] {
        let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
        reconstruction.add_log("drive.log", &laser_log::read(made_up_log(is_clockwise).0.as_bytes()).unwrap());
        while reconstruction.step().stage != Stage::Done {}
        let result = reconstruction.result();
        let num_good = result.frames.iter().filter(|frame| frame.status == Status::Good).count();
        let is_told = result.notes.iter().any(|note| note.contains("mirror image"));
        assert_eq!(is_told, is_clockwise, "{:?}", result.notes);
        assert_eq!(result.odometry_refusal.is_some(), is_clockwise);
        assert_eq!(num_good, if is_clockwise { 0 } else { result.frames.len() });
    }
}

#[test]
fn units_clocks_gaps_and_counts_of_a_made_up_drive() {
    let drive = made_up();
    units_are_told("made up", &drive);
    mirrors_are_told("made up", &drive);
    clocks_are_told("made up", &drive);

    // Gaps: what is there is used at its scan.
    let all = rows(&drive, 1.0, 1.0);
    let gaps: String = all
        .lines()
        .enumerate()
        .filter(|(row, _)| !(40..55).contains(row))
        .fold(String::new(), |text, (_, line)| text + line + "\n");
    let checked = check(&drive, &gaps);
    assert_eq!((checked.refusal, checked.poses.iter().flatten().count()), (None, 145));
    assert!(checked.poses[39].is_some() && checked.poses[40].is_none() && checked.poses[55].is_some());
    assert!((checked.poses[60].unwrap().translation.x - drive.rows[60][1]).abs() < 1e-12);
    assert!(checked.notes[0].starts_with("wheels.txt has gaps: 15 of 160 scans have no pose in it, scan 40 first"));

    // Of a log that was cut: the odometry goes on, and is that of the scans.
    let cut = Drive { scans: drive.scans[..100].to_vec(), rows: Vec::new() };
    let checked = check(&cut, &all);
    assert_eq!((checked.refusal, checked.poses.len()), (None, 100));
    assert!(checked.notes[0].contains("has 160 poses, and there are 100 scans"), "{:?}", checked.notes);
    // Of another log: more poses, or fewer, or as many.
    let turned = |count: i32| {
        (0..count)
            .fold(String::new(), |text, i| text + &format!("{i} {} 0 {}\n", 0.4 * f64::from(i), 0.02 * f64::from(i)))
    };
    for count in [100, 160, 1000] {
        let told = refusal(&drive, &turned(count));
        assert!(told.contains("Give the odometry of this log"), "{count}: {told}");
    }
    let numbers = "900 0 0 0\n901 1 0 0\n902 2 0 0\n";
    assert!(
        refusal(&drive, numbers).contains("It has 3 poses, and there are 160 scans"),
        "{}",
        refusal(&drive, numbers)
    );
}

#[test]
fn scans_that_look_alike_say_nothing_of_good_odometry() {
    // A robot that stands still, with wheels that do as well.
    let mut drive = made_up();
    let first = drive.scans[0].clone();
    drive
        .scans
        .iter_mut()
        .for_each(|scan| *scan = RecordedScan { index: scan.index, time: scan.time, ..first.clone() });
    drive.rows.iter_mut().for_each(|row| *row = [row[0], 0.0, 0.0, 0.0]);
    let checked = check(&drive, &rows(&drive, 1.0, 1.0));
    assert_eq!((checked.refusal, checked.notes), (None, vec![]));
}
