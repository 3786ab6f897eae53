//! CMU's Wean Hall: a map, and a log without an initial pose.

use nalgebra::{Matrix2, Vector2};
use scanstitch::geometry::Pose2;
use scanstitch::io::laser_log::{self, LaserLog};
use scanstitch::io::occupancy_map;
use scanstitch::map::occupancy_grid::OccupancyGrid;
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::localization::{BeamModel, MapField};
use scanstitch::pipeline::Settings;
use scanstitch::pipeline::planar::{Localization, Reconstruction};

use super::particles::ParticleFilter;
use super::{number, run};
use crate::arguments::{argument, flag};

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
    if flag("--along") {
        return along(&certain, &whole, &grid);
    }
    let mut table = Table::default();
    for from in starts(&log) {
        let score = run(&mut localization(&log, &grid, from), |frame| certain[from + frame]);
        score.print(&format!("from scan {from}"));
        table.add(score.found, score.wrong);
    }
    println!("{HEADER}\n{}", table.row("branch and bound"));
    if let Some(count) = argument("--particles").map(|count| count.parse().expect("a number")) {
        particles(&log, &whole, &grid, count);
    }
}

/// The scans of the log from which the robot is looked for.
fn starts(log: &LaserLog) -> impl Iterator<Item = usize> {
    let (starts, last) = (number("--starts", 20), log.scans.len() - 20);
    (0..starts).map(move |start| start * last / starts)
}

const HEADER: &str = "| | found | after scans (median) | runs with a certain wrong place |\n|---|---|---|---|";

/// How many runs found the robot, after how many scans, and how many were certain of a wrong place.
#[derive(Default)]
struct Table {
    num_runs: usize,
    after: Vec<usize>,
    num_wrong: usize,
}

impl Table {
    fn add(&mut self, after: Option<usize>, num_wrong: usize) {
        self.num_runs += 1;
        self.after.extend(after);
        self.num_wrong += usize::from(num_wrong > 0);
    }

    fn row(mut self, name: &str) -> String {
        self.after.sort_unstable();
        let median = self.after.get(self.after.len() / 2).map_or("-".to_owned(), usize::to_string);
        let Self { num_runs, after, num_wrong } = self;
        format!("| {name} | {} of {num_runs} | {median} | {num_wrong} |", after.len())
    }
}

/// How far along the corridor a place is moved (m): its doors are 6.1 m apart.
const MOVED: [f64; 7] = [0.0, -12.2, -6.1, -3.6, 2.1, 6.1, 12.2];

/// What the scans score a return at their certain places, and at such that are moved along the corridor, each at the best pose around.
fn along(certain: &[Option<Pose2>], whole: &Localization, grid: &OccupancyGrid) {
    let field = MapField::new(grid);
    let model = BeamModel::of(&field);
    let places: Vec<Vector2<f64>> = certain.iter().flatten().map(|pose| pose.translation.vector).collect();
    let mean = places.iter().sum::<Vector2<f64>>() / places.len().max(1) as f64;
    let spread: Matrix2<f64> = places.iter().map(|place| (place - mean) * (place - mean).transpose()).sum();
    let direction =
        spread.symmetric_eigen().eigenvectors.column(spread.symmetric_eigen().eigenvalues.imax()).into_owned();
    let direction = direction * direction.x.signum();
    let best = |ends: &[Vector2<f64>], pose: &Pose2| {
        let steps = |size: f64| (-4..=4).map(move |step| f64::from(step) * size);
        let around =
            steps(0.15).flat_map(|x| steps(0.15).flat_map(move |y| steps(0.015).map(move |turn| (x, y, turn))));
        let off = around.map(|(x, y, turn)| pose * Pose2::new(Vector2::new(x, y), turn));
        off.map(|pose| field.score(&model, ends, &pose)).fold(f64::NEG_INFINITY, f64::max) / ends.len() as f64
    };
    println!("| scans |{}\n|---|{}", MOVED.map(|by| format!(" {by} m |")).concat(), "---|".repeat(MOVED.len()));
    for scans in [150..230, 230..352, 352..430, 430..550, 550..690] {
        let mean = MOVED.map(|by| {
            let scores = scans.clone().step_by(8).filter_map(|frame| {
                let place = whole.locations()[frame].place.filter(|_| certain[frame].is_some())?.T_world_sensor;
                let moved = Pose2::from_parts((place.translation.vector + by * direction).into(), place.rotation);
                let ends = &whole.scans()[frame].points;
                Some(best(&ends.iter().step_by(2).copied().collect::<Vec<_>>(), &moved))
            });
            let scores: Vec<f64> = scores.collect();
            scores.iter().sum::<f64>() / scores.len().max(1) as f64
        });
        println!("| {} to {} |{}", scans.start, scans.end, mean.map(|mean| format!(" {mean:.2} |")).concat());
    }
}

/// How often a particle filter is sure of a place, and of a right one, by the runs that are good there.
fn particles(log: &LaserLog, whole: &Localization, grid: &OccupancyGrid, count: usize) {
    let field = MapField::new(grid);
    let pose = |frame: usize| log.scans[frame].odometry.unwrap_or_default() * log.T_robot_laser;
    let mut table = Table::default();
    for from in starts(log) {
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
            table.add(first.filter(|(_, off)| *off <= 1.0).map(|(after, _)| after), wrong);
            let scans = (log.scans.len() - from) as f64;
            let time = 1e3 * started.elapsed().as_secs_f64() / scans;
            println!(
                "{count} particles from scan {from}, seed {seed}: sure at {sure} scans, wrong at {wrong}; first {first:.2?}; {time:.1} ms a scan"
            );
        }
    }
    println!("{HEADER}\n{}", table.row(&format!("{count} particles")));
}
