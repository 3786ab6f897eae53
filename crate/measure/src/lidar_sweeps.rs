//! Scores the odometry of lidars that move while they turn: rendered drives, with the errors of the same drive without skew, with skew and
//! straightened, with skew left in, straightened by the true motion, and without skew but with times, each the mean over worlds. Arguments: `--sweeps N` (20), `--worlds N` (1), `--only LIDAR`,
//! `--from-rest` for drives that begin at rest and reach their speed between 0.3 and 0.8 s, `--points N` to register at most as many points of a sweep, `--write DIR` to write the sweeps for other programs (x y z t as
//! 64-bit floats, `NAME/0000.bin`, and `NAME/truth.txt`), `--time` to take the processor time of sweeps of 120,000 beams instead.

use std::fmt::Write as _;
use std::path::Path;

use scanstitch::geometry::{PointCloud, Pose3, RigidMotion};
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::cloud::{CloudOdometry, CloudOptions, PreparedCloud, SweepOdometry};
use scanstitch::pipeline::SpatialSettings;
use scanstitch::preprocess::deskew::deskew;
use scanstitch_scene::moving_lidar::MovingLidar;
use scanstitch_scene::plaza::{around_the_plaza, plaza};
use scanstitch_scene::space::Space;

use crate::arguments::{argument, flag};
use crate::depth::processor_time::seconds_used;

/// A drive around the square.
struct Drive<'a> {
    space: &'a Space,
    lidar: MovingLidar,
    speed: f64,
    rate: f64,
    num_sweeps: usize,
    seed: u64,
}

impl Drive<'_> {
    fn pose(&self, time: f64) -> Pose3 {
        let since = (time - 0.3).max(0.0);
        let from_rest = if since < 0.5 { since * since } else { since - 0.25 };
        around_the_plaza(self.speed, self.rate, if flag("--from-rest") { from_rest } else { time })
    }

    fn start(&self, sweep: usize) -> f64 {
        self.lidar.period * sweep as f64
    }

    /// The sweeps; without skew each is measured from where it begins.
    fn sweeps(&self, has_skew: bool) -> Vec<PointCloud> {
        let sweep = |number: usize| {
            let start = self.start(number);
            let pose = |time| self.pose(if has_skew { time } else { start });
            self.lidar.sweep(self.space, pose, start, 1000 * self.seed + number as u64)
        };
        (0..self.num_sweeps).map(sweep).collect()
    }

    /// Root mean square and largest error of the positions (m), relative to the first pose, and how many sweeps are good.
    fn errors(&self, poses: &[(Pose3, Status)]) -> (f64, f64, usize) {
        let T_first_world = self.pose(0.0).inverse();
        let off = |(number, (pose, _)): (usize, &(Pose3, Status))| {
            ((T_first_world * self.pose(self.start(number))).inverse() * pose).translation_norm()
        };
        let all: Vec<f64> = poses.iter().enumerate().map(off).collect();
        let num_good = poses.iter().filter(|(_, status)| *status == Status::Good).count();
        let square: f64 = all.iter().map(|error| error * error).sum::<f64>() / all.len() as f64;
        (square.sqrt(), all.iter().copied().fold(0.0, f64::max), num_good)
    }
}

/// The options that the page has for clouds like this one.
pub fn options_for(cloud: &PointCloud) -> CloudOptions {
    let mut ranges: Vec<f32> = cloud.positions.iter().map(|point| point.length()).collect();
    ranges.sort_by(f32::total_cmp);
    let options = SpatialSettings::default().for_clouds(f64::from(ranges[ranges.len() / 2])).cloud_options();
    let max_points = argument("--points").and_then(|count| count.parse().ok()).unwrap_or(options.max_points);
    CloudOptions { max_points, ..options }
}

fn without_times(clouds: &[PointCloud]) -> Vec<(Pose3, Status)> {
    let options = options_for(&clouds[0]);
    let mut odometry = CloudOdometry::new(options).unwrap();
    let register = |cloud: &PointCloud| {
        let cloud = PointCloud::from_positions(cloud.positions.clone());
        let found = odometry.register_frame(PreparedCloud::new(&cloud, &options).unwrap());
        (found.T_world_sensor, found.assessment.status)
    };
    let found = clouds.iter().map(register).collect();
    within_largest_part(found, &odometry.are_in_largest_part())
}

/// Good sweeps are doubtful where a doubtful one lies between them and most.
fn within_largest_part(mut found: Vec<(Pose3, Status)>, are_inside: &[bool]) -> Vec<(Pose3, Status)> {
    let registered = found.iter_mut().filter(|(_, status)| *status != Status::Lost).zip(are_inside);
    for ((_, status), _) in registered.filter(|((_, status), is_inside)| *status == Status::Good && !**is_inside) {
        *status = Status::Doubtful;
    }
    found
}

fn straightened(clouds: &[PointCloud]) -> Vec<(Pose3, Status)> {
    let options = options_for(&clouds[0]);
    let mut odometry = SweepOdometry::new(options).unwrap();
    let mut all: Vec<(Pose3, Status)> = Vec::new();
    for (number, cloud) in clouds.iter().enumerate() {
        let found =
            odometry.register_sweep(PreparedCloud::downsampled(cloud, &options).unwrap(), Some(0.1 * number as f64));
        for (number, pose) in found.earlier {
            all[number].0 = pose;
        }
        all.push((found.estimate.T_world_sensor, found.estimate.assessment.status));
    }
    within_largest_part(all, &odometry.are_in_largest_part())
}

/// Straightened by the motion that the drive has in truth.
fn by_true_motion(drive: &Drive, clouds: &[PointCloud]) -> Vec<(Pose3, Status)> {
    let velocity = (drive.pose(0.0).inverse() * drive.pose(drive.lidar.period)).log() / drive.lidar.period;
    let straight = |cloud: &PointCloud| deskew(cloud.clone(), &velocity, 0.0);
    without_times(&clouds.iter().map(straight).collect::<Vec<_>>())
}

fn write(folder: &Path, drive: &Drive, clouds: &[PointCloud]) {
    std::fs::create_dir_all(folder).unwrap();
    let mut truth = String::new();
    for (number, cloud) in clouds.iter().enumerate() {
        let times = cloud.times.as_ref().unwrap();
        let rows = cloud.positions.iter().zip(&times.offsets);
        let values = rows.flat_map(|(p, t)| [p.x, p.y, p.z, *t].map(f64::from));
        let bytes: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
        std::fs::write(folder.join(format!("{number:04}.bin")), bytes).unwrap();
        let t = (drive.pose(0.0).inverse() * drive.pose(drive.start(number))).translation.vector;
        let _ = writeln!(truth, "{} {} {}", t.x, t.y, t.z);
    }
    std::fs::write(folder.join("truth.txt"), truth).unwrap();
}

fn time(space: &Space, num_sweeps: usize) {
    let lidar = MovingLidar::rings(64, 1875);
    let drive = Drive { space, lidar, speed: 5.0, rate: 0.5, num_sweeps, seed: 1 };
    let clouds = drive.sweeps(false);
    let points = clouds.iter().map(PointCloud::len).sum::<usize>() / clouds.len();
    let options = options_for(&clouds[0]);
    let mut odometry = CloudOdometry::new(options).unwrap();
    let (mut spent, mut num_kept, mut found) = ([0.0; 3], 0, Vec::new());
    for cloud in &clouds {
        let cloud = PointCloud::from_positions(cloud.positions.clone());
        let mut last = seconds_used();
        let mut lap = |stage: usize| {
            spent[stage] += (seconds_used() - last) * 1e3 / num_sweeps as f64;
            last = seconds_used();
        };
        num_kept += PreparedCloud::downsampled(&cloud, &options).unwrap().len() / num_sweeps;
        lap(0);
        let prepared = PreparedCloud::new(&cloud, &options).unwrap();
        lap(1);
        let estimate = odometry.register_frame(prepared);
        lap(2);
        found.push((estimate.T_world_sensor, estimate.assessment.status));
    }
    let [downsample, prepare, register] = spent;
    let each = prepare + register;
    let (rmse, worst, good) = drive.errors(&found);
    println!(
        "{points} points a sweep, {num_kept} kept: {each:.1} ms a sweep (downsample {downsample:.1}, normals {:.1}, register {register:.1}), {:.1} mm rmse, {:.1} mm at most, {good} good",
        prepare - downsample,
        1e3 * rmse,
        1e3 * worst
    );
    let skewed = drive.sweeps(true);
    let start = seconds_used();
    let found = straightened(&skewed);
    let each = (seconds_used() - start) * 1e3 / num_sweeps as f64;
    let (rmse, worst, good) = drive.errors(&found);
    println!(
        "with times, straightened: {each:.1} ms a sweep, {:.1} mm rmse, {:.1} mm at most, {good} good",
        1e3 * rmse,
        1e3 * worst
    );
    if let Some(folder) = argument("--write") {
        write(&Path::new(&folder).join("timing"), &drive, &clouds);
        write(&Path::new(&folder).join("timing_bent"), &drive, &skewed);
    }
}

/// Means over the worlds: root mean square and largest error (mm), and the number of good sweeps.
fn cell(errors: &[(f64, f64, usize)]) -> String {
    let count = errors.len() as f64;
    let mean = |of: fn(&(f64, f64, usize)) -> f64| errors.iter().map(of).sum::<f64>() / count;
    format!("{:.1} / {:.1}, {:.0}", 1e3 * mean(|e| e.0), 1e3 * mean(|e| e.1), mean(|e| e.2 as f64))
}

/// The lidars by their names, or the one of `--only`.
pub fn chosen_lidars() -> impl Iterator<Item = (&'static str, MovingLidar)> {
    let lidars = [
        ("16 rings", MovingLidar::rings(16, 1800)),
        ("32 rings", MovingLidar::rings(32, 1024)),
        ("64 rings", MovingLidar::rings(64, 1024)),
        ("rosette", MovingLidar::rosette()),
    ];
    lidars.into_iter().filter(|(name, _)| argument("--only").is_none_or(|only| only == *name))
}

pub fn main() {
    let number = |name, default| argument(name).and_then(|count| count.parse().ok()).unwrap_or(default);
    let num_sweeps = number("--sweeps", 20);
    let worlds: Vec<Space> = (1..=number("--worlds", 1) as u64).map(plaza).collect();
    if flag("--time") {
        return time(&worlds[0], num_sweeps);
    }
    println!(
        "{:26} {:>22} {:>22} {:>22} {:>22} {:>22}",
        "rmse / most (mm), good",
        "no skew",
        "straightened",
        "skew left in",
        "by the true motion",
        "no skew, with times"
    );
    for (name, lidar) in chosen_lidars() {
        for (speed, rate) in [(0.5, 1.0), (2.0, 1.0), (10.0, 1.0), (0.5, 2.0), (2.0, 2.0), (10.0, 2.0)] {
            let mut columns = [(); 5].map(|()| Vec::new());
            for (space, seed) in worlds.iter().zip(1..) {
                let drive = Drive { space, lidar, speed, rate, num_sweeps, seed };
                let (still, skewed) = (drive.sweeps(false), drive.sweeps(true));
                let left_in = without_times(&skewed);
                let by_truth = by_true_motion(&drive, &skewed);
                let all = [without_times(&still), straightened(&skewed), left_in, by_truth, straightened(&still)];
                for (column, poses) in columns.iter_mut().zip(&all) {
                    column.push(drive.errors(poses));
                }
                if let Some(folder) = argument("--write") {
                    let name = format!("{}_{speed}_{rate}_{seed}", name.replace(' ', "_"));
                    write(&Path::new(&folder).join(&name), &drive, &skewed);
                }
            }
            let [a, b, c, d, e] = columns.map(|column| cell(&column));
            println!("{:26} {a:>22} {b:>22} {c:>22} {d:>22} {e:>22}", format!("{name}, {speed} m/s, {rate} rad/s"));
        }
    }
}
