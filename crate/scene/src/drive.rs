//! A long drive as a robot with a laser logs it: dense scans, wheel odometry with slip, and the reference poses.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt::Write as _;

use nalgebra::Vector3;

use super::laser::Laser;
use super::random::Random;
use super::recording::PlanarRecording;
use scanstitch::geometry::{Pose2, RigidMotion};

/// How a drive is logged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveOptions {
    /// Of the noise of laser and wheels.
    pub seed: u64,
    /// The sensor; its readings are logged in whole centimetres.
    pub laser: Laser,
    /// A scan is logged after this way (m) ...
    pub step: f64,
    /// ... or after this turn (rad).
    pub turn: f64,
    /// Whether the robot turns round at the end and drives back.
    pub is_returning: bool,
    /// Scale error of the wheels, noise of each step and steady turn (rad a metre).
    pub wheels: Wheels,
}

/// Errors of the wheel odometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wheels {
    /// Relative error of measured distances.
    pub scale: f64,
    /// Drift of the heading (rad/m).
    pub drift: f64,
    /// Relative error of measured turns.
    pub turn: f64,
    /// Standard deviation of each distance and turn, as a share of it.
    pub noise: f64,
    /// Share of the steps in which the wheels slip: they overestimate the distance by up to 30 % and turn by up to 0.05 rad.
    pub slip: f64,
}

impl Default for DriveOptions {
    /// A robot that logs often, and wheels as they are.
    fn default() -> Self {
        Self {
            seed: 1,
            // 180 beams a degree apart, as a FLASER line of 180 readings is understood: the last one at 179 degrees.
            laser: Laser { max_range: 80.0, field_of_view: 179f64.to_radians(), ..Laser::default() },
            step: 0.3,
            turn: 0.2,
            is_returning: false,
            wheels: Wheels { scale: 0.02, drift: 0.004, turn: 0.0, noise: 0.05, slip: 0.0 },
        }
    }
}

/// A drive: x is ahead in the robot's frame, and in that of the laser, which sits in its middle.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// Readings of each scan, from right to left (m).
    pub ranges: Vec<Vec<f64>>,
    /// Ground-truth poses of the robot, in the frame of the first one.
    pub T_world_robot: Vec<Pose2>,
    /// Poses by its wheel odometry.
    pub odometry: Vec<Pose2>,
}

impl Drive {
    /// Drives the way of a recording again.
    pub fn new(recording: &PlanarRecording, options: &DriveOptions) -> Self {
        let mut random = Random::new(options.seed);
        let path = path_of(recording, options);
        let scan = |T: &Pose2, random: &mut Random| {
            let points = options.laser.scan(&recording.world, T, random);
            points.iter().map(|p| libm::round(100.0 * p.norm()) / 100.0).collect()
        };
        let ranges = path.iter().map(|T| scan(T, &mut random)).collect();
        // The scene's lasers look along y; a robot along x.
        let T_laser_robot = Pose2::rotation(FRAC_PI_2);
        let T_robot_first = path.first().map_or_else(Pose2::identity, |first| (first * T_laser_robot).inverse());
        let T_world_robot: Vec<Pose2> = path.iter().map(|T| T_robot_first * T * T_laser_robot).collect();
        let odometry = odometry(&T_world_robot, &options.wheels, &mut random);
        Self { ranges, T_world_robot, odometry }
    }

    /// The drive as CARMEN logs it: FLASER lines, whose poses are the wheels'.
    pub fn carmen(&self) -> String {
        self.logged(false)
    }

    /// The drive as CARMEN logs it while it is driven: before each FLASER line the wheels' own, ODOM, which it repeats.
    pub fn raw_carmen(&self) -> String {
        self.logged(true)
    }

    fn logged(&self, with_wheels: bool) -> String {
        let mut text = String::from("# a drive through a generated building\n");
        for (index, (ranges, pose)) in self.ranges.iter().zip(&self.odometry).enumerate() {
            let pose = format!("{:.6} {:.6} {:.6}", pose.translation.x, pose.translation.y, pose.rotation.angle());
            let time = 0.2 * index as f64;
            if with_wheels {
                let _ = writeln!(text, "ODOM {pose} 0 0 0 {time:.3} robot {time:.3}");
            }
            let _ = write!(text, "FLASER {}", ranges.len());
            for range in ranges {
                let _ = write!(text, " {range:.2}");
            }
            let _ = writeln!(text, " {pose} {pose} {time:.3} robot {time:.3}");
        }
        text
    }
}

/// Wheel odometry of a path.
pub(super) fn odometry(T_world_robot: &[Pose2], wheels: &Wheels, random: &mut Random) -> Vec<Pose2> {
    let mut odometry = vec![Pose2::identity(); T_world_robot.len().min(1)];
    for pair in T_world_robot.windows(2) {
        let moved = (pair[0].inverse() * pair[1]).log();
        let way = moved.y.hypot(moved.z);
        let mut along = 1.0 + wheels.scale + wheels.noise * random.normal();
        let mut theta = moved.x * (1.0 + wheels.turn + wheels.noise * random.normal()) + wheels.drift * way;
        if wheels.slip > 0.0 && random.happens(wheels.slip) {
            along += random.uniform(0.0, 0.3);
            theta += random.uniform(-0.05, 0.05);
        }
        odometry
            .push(odometry[odometry.len() - 1] * Pose2::exp(&Vector3::new(theta, moved.y * along, moved.z * along)));
    }
    odometry
}

/// The poses of the recording with others between, and the way back.
fn path_of(recording: &PlanarRecording, options: &DriveOptions) -> Vec<Pose2> {
    let mut corners = recording.T_world_sensor.clone();
    if options.is_returning {
        let back: Vec<Pose2> = corners.iter().rev().map(|T| T * Pose2::rotation(PI - 1e-3)).collect();
        corners.extend(back);
    }
    let mut path = Vec::new();
    for pair in corners.windows(2) {
        let moved = (pair[0].inverse() * pair[1]).log();
        let pieces = (moved.y.hypot(moved.z) / options.step).max(moved.x.abs() / options.turn).ceil().max(1.0);
        // A turn on the spot goes the short way round.
        debug_assert!(moved.x.abs() < TAU);
        path.extend((0..pieces as usize).map(|piece| pair[0] * Pose2::exp(&(moved * (piece as f64 / pieces)))));
    }
    path
}
