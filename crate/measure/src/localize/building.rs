//! A log with its odometry and its reference poses, cut into parts, and the grid of a part.

use std::fs;

use scanstitch::geometry::{Pose2, Pose3};
use scanstitch::io::laser_log::{self, LaserLog, LaserScan};
use scanstitch::io::trajectory::{self, Trajectory, in_space};
use scanstitch::map::occupancy_grid::{OccupancyGrid, RESOLUTION};
use scanstitch::pipeline::Settings;
use scanstitch::pipeline::planar::{Localization, Reconstruction};
use scanstitch::preprocess::planar_scan::PlanarScan;

/// A recording of a building.
pub struct Building {
    pub name: &'static str,
    pub log: LaserLog,
    /// The robot's poses by its wheels.
    pub odometry: Vec<Pose2>,
    /// Where it was.
    pub reference: Vec<Pose2>,
}

/// Name, log and odometry; the poses in the logs are corrected, but for aces, which is solved.
pub const BUILDINGS: &[(&str, &str, &str)] = &[
    ("fr079", "fr079/fr079.log", "fr079/fr079.odometry.txt"),
    ("freiburg-101", "radish/freiburg-101.log", "radish/freiburg-101.odometry.txt"),
    ("belgioioso", "radish/belgioioso.log", "radish/belgioioso.odometry.txt"),
    ("edmonton", "radish/edmonton.log", "radish/edmonton.odometry.txt"),
    ("infinite-corridor", "radish/infinite-corridor.log", "radish/infinite-corridor.odometry.txt"),
    ("aces", "radish/aces.clf", ""),
];

impl Building {
    pub fn read(data: &str, (name, log, odometry): (&'static str, &str, &str)) -> Self {
        let log =
            laser_log::read(&fs::read(format!("{data}/{log}")).expect("the log can be read")).expect("it is sound");
        let planar = |pose: &Pose3| Pose2::new(pose.translation.vector.xy(), pose.rotation.euler_angles().2);
        let (odometry, reference) = if odometry.is_empty() {
            (log.scans.iter().filter_map(|scan| scan.odometry).collect(), solved(&log))
        } else {
            let odometry = fs::read(format!("{data}/{odometry}")).expect("odometry can be read");
            let poses = trajectory::read(&odometry).expect("it is sound").poses().expect("it has headings");
            let reference = log.scans.iter().map(|scan| scan.reference.or(scan.odometry).expect("a pose a scan"));
            (poses.iter().map(planar).collect(), reference.collect())
        };
        Self { name, log, odometry, reference }
    }

    /// The scans of some numbers.
    pub fn part(&self, numbers: impl Iterator<Item = usize> + Clone) -> Self {
        let scans = numbers.clone().map(|index| self.log.scans[index].clone()).collect();
        let mut log = LaserLog { scans, ..self.log.clone() };
        log.scans.iter_mut().enumerate().for_each(|(number, scan)| scan.number = number);
        Self {
            name: self.name,
            log,
            odometry: numbers.clone().map(|index| self.odometry[index]).collect(),
            reference: numbers.map(|index| self.reference[index]).collect(),
        }
    }

    /// The grid of its scans where they were taken.
    pub fn grid(&self) -> OccupancyGrid {
        let point = |[x, y]: [f32; 2]| nalgebra::Vector2::new(f64::from(x), f64::from(y));
        let usable = |limit: f64| move |p: &nalgebra::Vector2<f64>| p.norm() < limit.min(50.0) - 1e-3;
        let scan = |scan: &LaserScan| {
            PlanarScan::new(scan.points().into_iter().map(point).filter(usable(scan.max_range)).collect())
        };
        let scans: Vec<PlanarScan> = self.log.scans.iter().map(scan).collect();
        let poses: Vec<Pose2> = self.reference.iter().map(|pose| pose * self.log.T_robot_laser).collect();
        OccupancyGrid::new(
            &scans.iter().zip(poses.iter().copied()).collect::<Vec<_>>(),
            std::slice::from_ref(&poses),
            RESOLUTION,
        )
    }

    /// Prepares to locate its scans.
    pub fn localization(&self, grid: &OccupancyGrid, with_odometry: bool) -> Localization {
        let source = if with_odometry { "auto" } else { "none" };
        let settings: Settings =
            serde_json::from_value(serde_json::json!({ "odometry": source })).expect("the settings are right");
        let mut reconstruction = Reconstruction::new(settings).expect("the settings are right");
        reconstruction.add_log(self.name, &self.log);
        if with_odometry {
            let poses: Vec<Pose3> = self.odometry.iter().map(in_space).collect();
            reconstruction.set_odometry("odometry", Trajectory::from_poses(&poses)).expect("it has headings");
        }
        reconstruction.localization(grid).expect("the map is usable")
    }
}

/// The poses that the whole reconstruction finds.
fn solved(log: &LaserLog) -> Vec<Pose2> {
    let mut reconstruction = Reconstruction::new(Settings::default()).expect("the settings are right");
    reconstruction.add_log("log", log);
    while reconstruction.step().stage != scanstitch::pipeline::Stage::Done {}
    reconstruction.poses()
}
