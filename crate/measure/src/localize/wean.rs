//! CMU's Wean Hall: a map, and a log without an initial pose.

use scanstitch::geometry::Pose2;
use scanstitch::io::laser_log::{self, LaserLog};
use scanstitch::io::occupancy_map;
use scanstitch::map::occupancy_grid::OccupancyGrid;
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::localization::MapField;
use scanstitch::pipeline::Settings;
use scanstitch::pipeline::planar::{Localization, Reconstruction};

use super::particles::ParticleFilter;
use super::{number, run};
use crate::arguments::argument;

fn localization(log: &LaserLog, grid: &OccupancyGrid, from: usize) -> Localization {
    let mut reconstruction = Reconstruction::new(Settings::default()).expect("the settings are right");
    reconstruction.add_log("log", &LaserLog { scans: log.scans[from..].to_vec(), ..log.clone() });
    reconstruction.localization(grid).expect("the map is usable")
}

/// The map of a file.
pub fn grid(file: &str) -> OccupancyGrid {
    let bytes = std::fs::read(file).expect("the file can be read");
    OccupancyGrid::of_map(&occupancy_map::read_probabilities(&bytes).expect("the map is sound"))
}

pub fn main() {
    let grid = grid(&argument("--map").expect("--map: wean.dat, unpacked"));
    let log = argument("--log").unwrap_or_else(|| "../shared/data/laser/text/cmu_wean_robotdata1.log".to_owned());
    let log = laser_log::read(&std::fs::read(log).expect("the file can be read")).expect("the log is sound");
    let mut whole = localization(&log, &grid, 0);
    run(&mut whole, |_| None).print("the whole log");
    println!("{}\n{:?}", whole.result().summary, whole.result().notes);
    if let Some(file) = argument("--out") {
        std::fs::write(file, whole.trajectory_tum()).expect("it can be written");
    }
    let is_certain = whole.locations().iter().map(|location| location.status == Status::Good);
    let certain = whole.poses().into_iter().zip(is_certain).map(|(pose, is_certain)| pose.filter(|_| is_certain));
    let certain: Vec<Option<Pose2>> = certain.collect();
    let starts = number("--starts", 20);
    for from in (0..starts).map(|start| start * (log.scans.len() - 20) / starts) {
        run(&mut localization(&log, &grid, from), |frame| certain[from + frame]).print(&format!("from scan {from}"));
    }
    if let Some(count) = argument("--particles").map(|count| count.parse().expect("a number")) {
        particles(&log, &whole, &grid, count);
    }
}

/// How often a particle filter is sure of a place, and of a right one, by the runs that are good there.
fn particles(log: &LaserLog, whole: &Localization, grid: &OccupancyGrid, count: usize) {
    let field = MapField::new(grid);
    let pose = |frame: usize| log.scans[frame].odometry.unwrap_or_default() * log.T_robot_laser;
    let starts = number("--starts", 20);
    for from in (0..starts).map(|start| start * (log.scans.len() - 20) / starts) {
        for seed in 1..=number("--seeds", 3) {
            let started = std::time::Instant::now();
            let mut filter = ParticleFilter::new(grid, &field, count, seed as u64);
            let (mut sure, mut wrong, mut first) = (0, 0, None);
            for frame in from..log.scans.len() {
                let motion = if frame == from { Pose2::identity() } else { pose(frame - 1).inverse() * pose(frame) };
                filter.add_scan(&whole.scans()[frame], &motion);
                let location = &whole.locations()[frame];
                let truth = location.place.filter(|_| location.status == Status::Good);
                let Some((place, truth)) = filter.sure_place().zip(truth) else { continue };
                let off = (place.translation.vector - truth.T_world_sensor.translation.vector).norm();
                sure += 1;
                wrong += usize::from(off > 1.0);
                first.get_or_insert((frame - from + 1, off));
            }
            let scans = (log.scans.len() - from) as f64;
            let time = 1e3 * started.elapsed().as_secs_f64() / scans;
            println!(
                "{count} particles from scan {from}, seed {seed}: sure at {sure} scans, wrong at {wrong}; first {first:.2?}; {time:.1} ms a scan"
            );
        }
    }
}
