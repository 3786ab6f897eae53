//! What a gyroscope beside a lidar changes, right ones and wrong ones: rendered sweeps in a bare corridor, in which the lidar spins, and around a
//! square. Arguments: `--sweeps N` (20), `--rate RAD_PER_S` (5, negative: clockwise).

use scanstitch::geometry::{Pose3, RigidMotion};
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::cloud::{CloudOptions, PreparedCloud, SweepOdometry};
use scanstitch_scene::gyroscope::{Fault, corridor, readings, spinning};
use scanstitch_scene::moving_lidar::MovingLidar;
use scanstitch_scene::plaza::{around_the_plaza, plaza};
use scanstitch_scene::space::Space;

use crate::arguments::argument;

/// A drive: the world, where the lidar is, and the side of voxels (m).
struct Drive<'a> {
    space: Space,
    pose: Box<dyn Fn(f64) -> Pose3 + 'a>,
    voxel_size: f64,
    num_sweeps: usize,
}

impl Drive<'_> {
    /// A row of the table.
    fn row(&self, name: &str, fault: Option<Fault>) {
        let options = CloudOptions::new(self.voxel_size);
        let (lidar, mut odometry) = (MovingLidar::rings(16, 720), SweepOdometry::new(options).unwrap());
        let end = lidar.period * self.num_sweeps as f64 + 0.2;
        let said = fault.map(|fault| readings(&self.pose, [-0.2, end], fault, 7)).unwrap_or_default();
        odometry.add_gyro(&said);
        let (mut num_good, mut wrong, mut worst) = (0, 0, [0.0f64; 2]);
        for number in 0..self.num_sweeps {
            let start = lidar.period * number as f64;
            let sweep = lidar.sweep(&self.space, &self.pose, start, number as u64);
            let cloud = PreparedCloud::downsampled(&sweep, &options).unwrap();
            let found = odometry.register_sweep(cloud, Some(start)).estimate;
            let error = ((self.pose)(0.0).inverse() * (self.pose)(start)).inverse() * found.T_world_sensor;
            let [metres, degrees] = [error.translation_norm(), error.rotation_angle().to_degrees()];
            let is_good = found.assessment.status == Status::Good;
            num_good += usize::from(is_good);
            wrong += usize::from(is_good && (metres > 0.3 || degrees > 3.0));
            worst = [worst[0].max(metres), worst[1].max(degrees)];
        }
        println!("| {name} | {num_good} | {wrong} | {:.3} | {:.2} |", worst[0], worst[1]);
        odometry.notes().iter().for_each(|note| eprintln!("  {note}"));
    }
}

pub fn main() {
    let number = |name, default: f64| argument(name).and_then(|count| count.parse().ok()).unwrap_or(default);
    let (num_sweeps, rate) = (number("--sweeps", 20.0) as usize, number("--rate", 5.0));
    let drives = [
        (
            "corridor",
            Drive { space: corridor(), pose: Box::new(move |time| spinning(rate, time)), voxel_size: 0.1, num_sweeps },
        ),
        (
            "square",
            Drive {
                space: plaza(1),
                pose: Box::new(|time| around_the_plaza(5.0, 1.0, time)),
                voxel_size: 0.4,
                num_sweeps,
            },
        ),
    ];
    println!("| drive, gyroscope | good | of these wrong | largest error (m) | (degrees) |\n|---|---|---|---|---|");
    for (name, drive) in &drives {
        drive.row(&format!("{name}, none"), None);
        for (fault_name, fault) in Fault::ALL {
            drive.row(&format!("{name}, {fault_name}"), Some(fault));
        }
    }
}
