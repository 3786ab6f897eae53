//! Long laser sequences: real and generated, with odometry and from scans alone, and the grid that comes of them.

use std::fs;

use crate::common::shared_data;
use nalgebra::Vector2;
use scanstitch::evaluation::path::Path;
use scanstitch::evaluation::relations::relation_errors;
use scanstitch::geometry::{Pose2, Pose3};
use scanstitch::io::laser_log::{self, LaserLog};
use scanstitch::io::relations::{self, Relation};
use scanstitch::io::trajectory::{self, Contents, Trajectory, TrajectoryFormat, in_space};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::report::{FrameResult, PlanarPose, Stage};
use scanstitch::pipeline::settings::{OdometrySource, Settings};
use scanstitch::preprocess::clean::CleaningReport;
use scanstitch_scene::drive::{Drive, DriveOptions};
use scanstitch_scene::laser::Laser;
use scanstitch_scene::office::{OfficeOptions, generate};
use scanstitch_scene::recording::PlanarRecording;

fn run(log: &LaserLog, odometry: Option<Trajectory>, settings: Settings) -> Reconstruction {
    let mut reconstruction = Reconstruction::new(settings).unwrap();
    reconstruction.add_log("drive.log", log);
    if let Some(odometry) = odometry {
        reconstruction.set_odometry("odometry.txt", odometry).unwrap();
    }
    while reconstruction.step().stage != Stage::Done {}
    reconstruction
}

fn trajectory_of(poses: &[Pose2]) -> Trajectory {
    Trajectory::from_poses(&poses.iter().map(in_space).collect::<Vec<Pose3>>())
}

/// Distances of positions, first poses made equal.
fn errors(estimate: &[Pose2], truth: &[Pose2]) -> Vec<f64> {
    assert_eq!(estimate.len(), truth.len());
    estimate.iter().zip(truth).map(|(e, t)| (e.translation.vector - t.translation.vector).norm()).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn office(seed: u64, num_scans: usize, options: DriveOptions) -> (PlanarRecording, Drive, LaserLog) {
    let recording = generate(&OfficeOptions { seed, num_scans, ..OfficeOptions::default() });
    let drive = Drive::new(&recording, &DriveOptions { seed, ..options });
    let log = laser_log::read(drive.carmen().as_bytes()).unwrap();
    (recording, drive, log)
}

#[test]
fn the_freiburg_log_closes_its_loops_with_odometry_and_without() {
    let Some(folder) = shared_data("laser/fr079") else { return };
    let bytes = fs::read(folder.join("fr079.log")).unwrap();
    let log = laser_log::read(&bytes).unwrap();
    let odometry = trajectory::read(&fs::read(folder.join("fr079.odometry.txt")).unwrap()).unwrap();
    let loops: Vec<Relation> = relations::read(&bytes).unwrap().into_iter().filter(|r| !r.is_step()).collect();
    for odometry in [Some(odometry), None] {
        let reconstruction = run(&log, odometry, Settings::default());
        let path = Trajectory::from_poses(&reconstruction.poses_in_space());
        let errors = relation_errors(&loops, &Path::of(&path, 0..path.len()), 0.01).unwrap();
        assert!(errors.translation.mean < 0.04, "{:?}", errors.translation);
        assert!(errors.rotation.mean < 0.5f64.to_radians(), "{:?}", errors.rotation);
        let result = reconstruction.result();
        let comparison = result.comparison.unwrap();
        assert!(comparison.name.contains("log") && comparison.mean < 0.08, "{} {}", comparison.name, comparison.mean);
        let wrong = |(frame, error): (&FrameResult<PlanarPose, CleaningReport>, &Option<f64>)| {
            error.is_some_and(|error| error > 0.5) && frame.status == Status::Good
        };
        assert!(!result.frames.iter().zip(&comparison.errors).any(wrong), "a wrong scan is called good");
    }
}

#[test]
fn rings_of_corridors_close_for_other_scanners_ways_and_seeds() {
    let hokuyo = Laser { num_beams: 541, max_range: 12.0, ..Laser::default() };
    for (seed, num_scans, options) in [
        (21, 150, DriveOptions::default()),
        (22, 100, DriveOptions { is_returning: true, ..DriveOptions::default() }),
        (23, 130, DriveOptions { laser: hokuyo, step: 0.5, ..DriveOptions::default() }),
    ] {
        let (_, drive, log) = office(seed, num_scans, options);
        for odometry in [Some(trajectory_of(&drive.odometry)), None] {
            let has_odometry = odometry.is_some();
            let reconstruction = run(&log, odometry, Settings::default());
            let errors = errors(&reconstruction.poses(), &drive.T_world_robot);
            let largest = errors.iter().copied().fold(0.0, f64::max);
            assert!(mean(&errors) < 0.06 && largest < 0.25, "seed {seed} {has_odometry}: {} {largest}", mean(&errors));
        }
    }
}

#[test]
fn the_reference_changes_no_byte_and_odometry_from_a_file_or_from_the_log_is_the_same() {
    let (_, drive, log) = office(31, 110, DriveOptions { step: 1.0, ..DriveOptions::default() });
    let bare = LaserLog {
        scans: log
            .scans
            .iter()
            .cloned()
            .map(|scan| laser_log::LaserScan { reference: None, odometry: None, ..scan })
            .collect(),
        ..log.clone()
    };
    let text = |reconstruction: &Reconstruction| trajectory::tum_text(None, &reconstruction.poses_in_space());
    let from_file = Settings { odometry: OdometrySource::File, ..Settings::default() };
    let alone = run(&bare, None, Settings::default());
    let with_poses = run(&log, None, from_file.clone());
    assert_eq!(text(&alone), text(&with_poses));
    assert!(alone.result().comparison.is_none() && with_poses.result().comparison.is_some());

    let mut compared = Reconstruction::new(from_file).unwrap();
    compared.add_log("drive.log", &log);
    let truth = trajectory_of(&drive.T_world_robot);
    let contents = Contents { trajectory: truth, format: TrajectoryFormat::Tum, notes: Vec::new() };
    compared.set_reference("truth.txt", contents);
    while compared.step().stage != Stage::Done {}
    assert_eq!(text(&alone), text(&compared));

    let asked = Settings { odometry: OdometrySource::Log, ..Settings::default() };
    let from_log = run(&log, None, asked.clone());
    // The log rounds its poses: the file holds the same numbers.
    let in_log: Vec<Pose2> = log.scans.iter().map(|scan| scan.odometry.unwrap()).collect();
    let from_file = run(&bare, Some(trajectory_of(&in_log)), Settings::default());
    let distance = errors(&from_log.poses(), &from_file.poses());
    assert!(mean(&distance) < 1e-4, "the log's poses are the wheels': {}", mean(&distance));
    assert_ne!(text(&from_log), text(&alone));
}

/// ROS's map_server, after its documentation: occ = (255 - v) / 255 unless `negate`; above `occupied_thresh` occupied,
/// below `free_thresh` free, unknown between. The first row of the picture is the one with the largest y.
struct ServedMap {
    resolution: f64,
    origin: [f64; 2],
    width: usize,
    height: usize,
    /// 100, 0 or -1, row by row from the least y.
    data: Vec<i8>,
}

fn map_server(yaml: &str, pgm: &[u8]) -> ServedMap {
    let field = |name: &str| {
        let line = yaml.lines().find_map(|line| line.strip_prefix(&format!("{name}: ")));
        line.unwrap_or_else(|| panic!("{name} is missing")).to_owned()
    };
    let number = |name: &str| field(name).parse::<f64>().unwrap();
    assert_eq!((field("image").as_str(), field("mode").as_str(), number("negate")), ("map.pgm", "trinary", 0.0));
    let origin = field("origin");
    let origin: Vec<f64> = origin.trim_matches(['[', ']']).split(", ").map(|text| text.parse().unwrap()).collect();
    assert_eq!((origin.len(), origin[2]), (3, 0.0));
    let header: Vec<&[u8]> = pgm.splitn(4, |&byte| byte == b'\n').collect();
    assert_eq!((header[0], header[2]), (&b"P5"[..], &b"255"[..]));
    let size = String::from_utf8(header[1].to_vec()).unwrap();
    let (width, height) = size.split_once(' ').unwrap();
    let (width, height): (usize, usize) = (width.parse().unwrap(), height.parse().unwrap());
    assert_eq!(header[3].len(), width * height);
    let served = |value: u8| {
        let occ = (255.0 - f64::from(value)) / 255.0;
        if occ > number("occupied_thresh") {
            100
        } else if occ < number("free_thresh") {
            0
        } else {
            -1
        }
    };
    let data = header[3].chunks_exact(width).rev().flatten().map(|&value| served(value)).collect();
    ServedMap { resolution: number("resolution"), origin: [origin[0], origin[1]], width, height, data }
}

#[test]
fn the_grid_reads_back_as_map_server_reads_it_and_shows_the_known_world() {
    let (recording, drive, log) = office(41, 110, DriveOptions { step: 0.5, ..DriveOptions::default() });
    let reconstruction = run(&log, Some(trajectory_of(&drive.odometry)), Settings::default());
    let grid = reconstruction.occupancy_grid(0.05);
    let map = map_server(&grid.yaml("map.pgm"), &grid.pgm());
    assert_eq!(map.resolution, 0.05);
    // The recording's world is in the frame of its first scan, whose y is ahead; the map's is the robot's, x ahead.
    let to_world = |x: usize, y: usize| {
        let at = |index: usize, origin: f64| origin + (index as f64 + 0.5) * map.resolution;
        let in_map = Vector2::new(at(x, map.origin[0]), at(y, map.origin[1]));
        Pose2::rotation(std::f64::consts::FRAC_PI_2) * nalgebra::Point2::from(in_map)
    };
    let (mut occupied, mut misplaced, mut free, mut walls) = (0, 0, 0, 0);
    for (index, &value) in map.data.iter().enumerate() {
        let clearance = recording.world.clearance(&to_world(index % map.width, index / map.width).coords);
        match value {
            100 => {
                occupied += 1;
                misplaced += i32::from(clearance > 0.15);
            }
            0 => {
                free += 1;
                walls += i32::from(clearance < 0.01);
            }
            _ => {}
        }
    }
    assert_eq!(map.data.len(), map.width * map.height);
    assert!(occupied > 2000 && free > 20_000, "{occupied} {free}");
    assert!(f64::from(misplaced) < 0.02 * f64::from(occupied), "{misplaced} of {occupied} stand in free space");
    assert!(f64::from(walls) < 0.01 * f64::from(free), "{walls} of {free} free cells are walls");
    // Where the robot was in the main piece by its own pose, it is free; by its true one nothing stands, and the next cell at the
    // most is free. Far outside nobody knows.
    let column_and_row = |p: &Pose2| {
        let x = ((p.translation.x - map.origin[0]) / map.resolution) as usize;
        let y = ((p.translation.y - map.origin[1]) / map.resolution) as usize;
        (x, y)
    };
    let (frames, poses) = (reconstruction.result().frames, reconstruction.poses());
    let main: Vec<usize> = (0..frames.len()).filter(|&frame| frames[frame].piece == 0).collect();
    assert!(2 * main.len() > frames.len(), "{} of {}", main.len(), frames.len());
    for frame in main {
        let (x, y) = column_and_row(&poses[frame]);
        assert_eq!(map.data[y * map.width + x], 0, "{frame}");
        let (x, y) = column_and_row(&drive.T_world_robot[frame]);
        assert_ne!(map.data[y * map.width + x], 100, "{frame}");
        let is_free = |(x, y): (usize, usize)| map.data[y * map.width + x] == 0;
        assert!((x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y))).any(is_free), "{frame}");
    }
    assert_eq!((map.data[0], map.data[map.data.len() - 1]), (-1, -1));
}
