//! Generated buildings, whose poses are known exactly.

use scanstitch::geometry::{Pose2, Pose3};
use scanstitch::io::laser_log;
use scanstitch::io::trajectory::{Trajectory, in_space};
use scanstitch::map::occupancy_grid::{OccupancyGrid, RESOLUTION};
use scanstitch::pipeline::Settings;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::preprocess::planar_scan::PlanarScan;
use scanstitch_scene::drive::{Drive, DriveOptions};
use scanstitch_scene::office::{OfficeOptions, generate};

use super::{Score, run};

pub fn main() {
    let mut sum = Score::default();
    for seed in 1..=10 {
        let recording = generate(&OfficeOptions { seed, ..OfficeOptions::default() });
        let scans: Vec<PlanarScan> = recording
            .scans
            .iter()
            .map(|scan| PlanarScan::new(scan.iter().copied().filter(|p| p.norm() < 49.9).collect()))
            .collect();
        let placed: Vec<_> = scans.iter().zip(recording.T_world_sensor.iter().copied()).collect();
        let grid = OccupancyGrid::new(&placed, std::slice::from_ref(&recording.T_world_sensor), RESOLUTION);
        let drive = Drive::new(&recording, &DriveOptions { seed: 100 + seed, ..DriveOptions::default() });
        let log = laser_log::read(drive.carmen().as_bytes()).expect("the log is sound");
        let mut reconstruction = Reconstruction::new(Settings::default()).expect("the settings are right");
        reconstruction.add_log("drive", &log);
        let odometry: Vec<Pose3> = drive.odometry.iter().map(in_space).collect();
        reconstruction.set_odometry("odometry", Trajectory::from_poses(&odometry)).expect("it has headings");
        let mut localization = reconstruction.localization(&grid).expect("the map is usable");
        // The drive's world is the frame of its first robot; the recording's that of its first laser, which looks along y.
        let T_world_first = recording.T_world_sensor[0] * Pose2::rotation(std::f64::consts::FRAC_PI_2);
        let truth: Vec<Pose2> = drive.T_world_robot.iter().map(|T| T_world_first * T).collect();
        let score = run(&mut localization, |frame| Some(truth[frame]));
        score.print(&format!("office {seed}"));
        sum.add(&score);
    }
    sum.print("all");
}
