//! CMU's Wean Hall: a map, and a log without an initial pose.

use nalgebra::{Matrix2, Vector2};
use scanstitch::geometry::Pose2;
use scanstitch::io::laser_log::{self, LaserLog};
use scanstitch::io::occupancy_map;
use scanstitch::map::occupancy_grid::OccupancyGrid;
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::localization::{Beam, BeamModel, Fit, MapField};
use scanstitch::pipeline::Settings;
use scanstitch::pipeline::planar::{Localization, Reconstruction};

use super::particles::{Drive, follow};
use super::{Table, number, run};
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
    println!("{}\n{}", Table::HEADER, table.row("branch and bound"));
    for count in super::particles::counts() {
        particles(&log, &whole, &certain, &grid, count);
    }
}

/// The scans of the log from which the robot is looked for.
fn starts(log: &LaserLog) -> impl Iterator<Item = usize> {
    let (starts, last) = (number("--starts", 20), log.scans.len() - 20);
    (0..starts).map(move |start| start * last / starts)
}

/// How far along the corridor a place is moved (m): its doors are 6.1 m apart.
const MOVED: [f64; 7] = [0.0, -12.2, -6.1, -3.6, 2.1, 6.1, 12.2];

/// What stretches of scans say at their certain places, and moved along the corridor, each as one rigid set of beams at the best pose
/// around: the mean score of a return, the share that ends on walls and the share that passed through one.
fn along(certain: &[Option<Pose2>], whole: &Localization, grid: &OccupancyGrid) {
    let field = MapField::new(grid);
    let model = BeamModel::of(&field);
    let direction = direction_of(certain);
    println!("| scans |{}\n|---|{}", MOVED.map(|by| format!(" {by} m |")).concat(), "---|".repeat(MOVED.len()));
    for scans in [150..230, 230..352, 352..430, 430..550, 550..690] {
        let (T_world_stretch, beams) =
            joined(whole, scans.clone().step_by(8).filter(|frame| certain[*frame].is_some()));
        let said = MOVED.map(|by| {
            let T_world_moved = Pose2::from_parts(
                (T_world_stretch.translation.vector + by * direction).into(),
                T_world_stretch.rotation,
            );
            let fit = best_around(&field, &model, &beams, &(grid.T_world_grid().inverse() * T_world_moved));
            let through = 100.0 * fit.num_through as f64 / fit.num_beams as f64;
            format!(" {:.2}, {:.0}, {through:.0} |", fit.mean(), 100.0 * fit.explained())
        });
        println!("| {} to {} |{}", scans.start, scans.end, said.concat());
    }
}

/// The direction in which places are spread furthest, eastward.
fn direction_of(certain: &[Option<Pose2>]) -> Vector2<f64> {
    let places: Vec<Vector2<f64>> = certain.iter().flatten().map(|pose| pose.translation.vector).collect();
    let mean = places.iter().sum::<Vector2<f64>>() / places.len().max(1) as f64;
    let spread: Matrix2<f64> = places.iter().map(|place| (place - mean) * (place - mean).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let direction = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    direction * direction.x.signum()
}

/// Every second beam of some scans at their places, in the frame of the middle one, and its pose in the world.
fn joined(whole: &Localization, frames: impl Iterator<Item = usize>) -> (Pose2, Vec<Beam>) {
    let place = |frame: usize| Some((whole.scans()[frame].clone(), whole.locations()[frame].place?.T_world_sensor));
    let placed: Vec<_> = frames.filter_map(place).collect();
    let T_world_stretch = placed[placed.len() / 2].1;
    let beams = placed.iter().flat_map(|(scan, T_world_sensor)| {
        let T_stretch_sensor = T_world_stretch.inverse() * T_world_sensor;
        let beam = move |&end| Beam { origin: Vector2::zeros(), end }.moved(&T_stretch_sensor);
        scan.points.iter().step_by(2).map(beam)
    });
    (T_world_stretch, beams.collect())
}

/// The best fit within 0.6 m and 3.4 degrees.
fn best_around(field: &MapField, model: &BeamModel, beams: &[Beam], T_grid_frame: &Pose2) -> Fit {
    let steps = |size: f64| (-4..=4).map(move |step| f64::from(step) * size);
    let around = steps(0.15).flat_map(|x| steps(0.15).flat_map(move |y| steps(0.015).map(move |turn| (x, y, turn))));
    let fits = around.map(|(x, y, turn)| {
        let pose = T_grid_frame * Pose2::new(Vector2::new(x, y), turn);
        field.fit(model, beams, &pose)
    });
    fits.max_by(|a, b| a.score.total_cmp(&b.score)).unwrap_or_default()
}

/// What a particle filter is sure of from each start, by the runs that are good there.
fn particles(log: &LaserLog, whole: &Localization, certain: &[Option<Pose2>], grid: &OccupancyGrid, count: usize) {
    let poses = log.scans.iter().map(|scan| scan.odometry.unwrap_or_default() * log.T_robot_laser);
    let odometry: Vec<Pose2> = poses.collect();
    let mut table = Table::default();
    for from in starts(log) {
        println!("from scan {from}");
        let drive = Drive { scans: &whole.scans()[from..], odometry: &odometry[from..], truth: &certain[from..] };
        follow(&drive, grid, count, &mut table);
    }
    println!("{}", table.row(&format!("{count} particles")));
}
