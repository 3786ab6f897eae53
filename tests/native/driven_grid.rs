//! A planner on the exported grid: every cell in which the robot was is free, and a way leads from its first pose to its last.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::Path;

use crate::common::shared_data;
use scanstitch::geometry::Pose2;
use scanstitch::io::laser_log;
use scanstitch::io::ply;
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::settings::Settings;
use scanstitch_scene::drive::{Drive, DriveOptions};
use scanstitch_scene::office::{OfficeOptions, generate};

/// The cells that a planner may use, as ROS's map_server gives them in its trinary mode: those whose share of black is below
/// `free_thresh`. The first row of the picture is the one with the largest y.
struct Served {
    resolution: f64,
    origin: [f64; 2],
    free: BTreeSet<(i64, i64)>,
}

impl Served {
    fn of(yaml: &str, pgm: &[u8]) -> Self {
        let field = |name: &str| yaml.lines().find_map(|line| line.strip_prefix(&format!("{name}: "))).unwrap();
        let number = |name: &str| field(name).parse::<f64>().unwrap();
        let origin: Vec<f64> =
            field("origin").trim_matches(['[', ']']).split(", ").map(|x| x.parse().unwrap()).collect();
        let header: Vec<&[u8]> = pgm.splitn(4, |&byte| byte == b'\n').collect();
        let width: usize = std::str::from_utf8(header[1]).unwrap().split(' ').next().unwrap().parse().unwrap();
        let is_free = |value: u8| (255.0 - f64::from(value)) / 255.0 < number("free_thresh");
        let rows = header[3].chunks_exact(width).rev().enumerate();
        let cells = rows.flat_map(|(y, row)| {
            row.iter().enumerate().map(move |(x, &value)| ((x.cast_signed() as i64, y.cast_signed() as i64), value))
        });
        let free = cells.filter(|(_, value)| is_free(*value)).map(|(cell, _)| cell).collect();
        Self { resolution: number("resolution"), origin: [origin[0], origin[1]], free }
    }

    fn cell_of(&self, pose: &Pose2) -> (i64, i64) {
        let along = |value: f64, origin: f64| ((value - origin) / self.resolution).floor() as i64;
        (along(pose.translation.x, self.origin[0]), along(pose.translation.y, self.origin[1]))
    }

    /// Whether free cells that share a side lead from one cell to the other.
    fn has_way(&self, from: (i64, i64), to: (i64, i64)) -> bool {
        let (mut reached, mut open) = (BTreeSet::from([from]), VecDeque::from([from]));
        while let Some((x, y)) = open.pop_front() {
            let near = [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)];
            open.extend(near.into_iter().filter(|cell| self.free.contains(cell) && reached.insert(*cell)));
        }
        reached.contains(&to)
    }
}

/// Checks the grid of each piece of the map, in which a way leads from its first pose to its last; how many pieces there are. Those
/// of logs of buildings: `radish_logs`.
pub fn check(what: &str, mut reconstruction: Reconstruction) -> usize {
    while reconstruction.step().stage != Stage::Done {}
    let (frames, poses) = (reconstruction.result().frames, reconstruction.poses());
    let pieces = reconstruction.pieces();
    for &piece in &pieces {
        let grid = reconstruction.occupancy_grid_of(piece, 0.05);
        let served = Served::of(&grid.yaml("map.pgm"), &grid.pgm());
        let of_piece =
            frames.iter().zip(&poses).filter(|(frame, _)| frame.piece == piece && frame.status != Status::Lost);
        let driven: Vec<(i64, i64)> = of_piece.map(|(_, pose)| served.cell_of(pose)).collect();
        let taken = driven.iter().filter(|cell| !served.free.contains(cell)).count();
        assert_eq!(taken, 0, "{what}, piece {piece}: of {} driven cells these are not free", driven.len());
        assert!(served.has_way(driven[0], driven[driven.len() - 1]), "{what}, piece {piece}: no way to its last pose");
    }
    pieces.len()
}

fn of_folder(folder: &Path) -> Reconstruction {
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    for index in 0..10 {
        let name = format!("{index}.ply");
        reconstruction.add_scan(&name, ply::read(&fs::read(folder.join(&name)).unwrap()).unwrap()).unwrap();
    }
    reconstruction
}

#[test]
fn driven_cells_of_the_sample_are_free() {
    assert_eq!(check("sample", of_folder(&Path::new(env!("CARGO_MANIFEST_DIR")).join("www/samples/corridor"))), 1);
}

#[test]
fn driven_cells_of_the_ten_real_scans_are_free() {
    let Some(folder) = shared_data("laser/zju10") else { return };
    check("zju10", of_folder(&folder));
}

#[test]
fn driven_cells_of_a_log_with_a_mounted_laser_are_free() {
    let recording = generate(&OfficeOptions { seed: 41, num_scans: 60, ..OfficeOptions::default() });
    let drive = Drive::new(&recording, &DriveOptions { seed: 41, step: 0.5, ..DriveOptions::default() });
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    reconstruction.add_log("drive.log", &laser_log::read(drive.carmen().as_bytes()).unwrap());
    check("office", reconstruction);
}

/// The scans of two buildings in one log without odometry: nothing connects them.
#[test]
fn a_map_in_pieces_is_reported_and_has_a_grid_for_each() {
    let logs = [41, 57].map(|seed| {
        let recording = generate(&OfficeOptions { seed, num_scans: 40, ..OfficeOptions::default() });
        let drive = Drive::new(&recording, &DriveOptions { seed, step: 0.3, ..DriveOptions::default() });
        laser_log::read(drive.carmen().as_bytes()).unwrap()
    });
    let [mut both, other] = logs;
    both.scans.extend(other.scans);
    for (index, scan) in both.scans.iter_mut().enumerate() {
        (scan.odometry, scan.reference, scan.time, scan.number) = (None, None, Some(0.5 * index as f64), index);
    }
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    reconstruction.add_log("both.log", &both);
    while reconstruction.step().stage != Stage::Done {}
    let result = reconstruction.result();
    let pieces = reconstruction.pieces();
    assert!(pieces.len() > 1 && pieces[0] == 0, "{pieces:?}");
    let mut sizes = BTreeMap::<usize, usize>::new();
    let placed = result.frames.iter().filter(|frame| frame.status != Status::Lost);
    placed.for_each(|frame| *sizes.entry(frame.piece).or_default() += 1);
    // Those of one scan have no grid.
    let is_map = |(&piece, &size): (&usize, &usize)| (piece == 0 || size > 1).then_some(piece);
    assert_eq!(pieces, sizes.iter().filter_map(is_map).collect::<Vec<_>>());
    let told = result.unconnected.clone().unwrap();
    assert!(told.starts_with(&format!("The map is in {} pieces that are not connected", sizes.len())), "{told}");
    assert!(result.notes.contains(&told));
    for &piece in &pieces {
        let yaml = reconstruction.occupancy_grid_of(piece, 0.05).yaml("map.pgm");
        let which = if piece == 0 { "the main piece".to_owned() } else { format!("piece {piece}") };
        assert!(yaml.contains(&format!("\n# This is {which} of a map in {} pieces", sizes.len())), "{yaml}");
    }
    check("both", reconstruction);
}
