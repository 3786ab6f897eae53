//! Good sweeps in a corridor whose end walls are out of range: bare, where none but the first may be good, and with pillars, where all may.
//! Arguments: `--sweeps N` (20), `--seeds N` (3), `--only LIDAR`.

use scanstitch::geometry::{Pose3, RigidMotion};
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::cloud::{PreparedCloud, SweepOdometry};
use scanstitch_scene::gyroscope::corridor;
use scanstitch_scene::moving_lidar::MovingLidar;
use scanstitch_scene::space::Space;
use scanstitch_scene::straight_corridor::{along, pillared, short_sighted};

use crate::arguments::argument;
use crate::lidar_sweeps::{chosen_lidars, options_for};

/// Error of the position (m) above which a good sweep is wrong.
const WRONG: f64 = 0.3;
/// Error of the motion since the last sweep, as a share of it, above which it is wrong.
const WRONG_STEP: f64 = 0.5;

/// Good sweeps of drives.
#[derive(Default)]
struct Counts {
    good: usize,
    /// Of these within the largest part, ...
    within: usize,
    /// ... and of those at a wrong place.
    misplaced: usize,
    /// Good ones with a wrong motion since the last sweep.
    wrong_step: usize,
    /// Largest error of the position of a good one (m).
    largest: f64,
}

impl Counts {
    fn add(&mut self, space: &Space, lidar: &MovingLidar, pose: impl Fn(f64) -> Pose3, num_sweeps: usize) {
        let sweep = |number: usize| lidar.sweep(space, &pose, lidar.period * number as f64, number as u64);
        let options = options_for(&sweep(0));
        let mut odometry = SweepOdometry::new(options).unwrap();
        let register = |number: usize| {
            let cloud = PreparedCloud::downsampled(&sweep(number), &options).unwrap();
            let found = odometry.register_sweep(cloud, Some(lidar.period * number as f64)).estimate;
            (found.T_world_sensor, found.assessment.status)
        };
        let found: Vec<(Pose3, Status)> = (0..num_sweeps).map(register).collect();
        let truth = |number: usize| pose(0.0).inverse() * pose(lidar.period * number as f64);
        let mut inside = odometry.are_in_largest_part().into_iter();
        for (number, (T, status)) in found.iter().enumerate() {
            let is_inside = *status != Status::Lost && inside.next() == Some(true);
            if *status != Status::Good || number == 0 {
                continue;
            }
            let step = |from: &Pose3, to: &Pose3| (from.inverse() * to).translation.vector;
            let true_step = step(&truth(number - 1), &truth(number));
            let step_error = (step(&found[number - 1].0, T) - true_step).norm();
            let error = (truth(number).inverse() * T).translation_norm();
            self.good += 1;
            self.within += usize::from(is_inside);
            self.misplaced += usize::from(is_inside && error > WRONG);
            self.wrong_step += usize::from(step_error > WRONG_STEP * true_step.norm());
            self.largest = self.largest.max(error);
        }
    }
}

pub fn main() {
    let number = |name, default| argument(name).and_then(|count| count.parse().ok()).unwrap_or(default);
    let (num_sweeps, num_seeds) = (number("--sweeps", 20), number("--seeds", 3) as u64);
    println!("Of {} sweeps each, without the first of every drive", (num_sweeps - 1) * num_seeds as usize);
    println!(
        "| corridor, lidar, speed | good | within the largest part | misplaced | wrong step | largest error (m) |"
    );
    println!("|---|---|---|---|---|---|");
    for (name, lidar) in chosen_lidars() {
        let lidar = short_sighted(lidar);
        for (place, speed) in [("bare", 0.5), ("bare", 1.0), ("bare", 2.0), ("pillars", 1.0)] {
            let mut counts = Counts::default();
            for seed in 1..=num_seeds {
                let space = if place == "bare" { corridor() } else { pillared(seed) };
                counts.add(&space, &lidar, along(speed, seed), num_sweeps);
            }
            let Counts { good, within, misplaced, wrong_step, largest } = counts;
            println!(
                "| {place}, {name}, {speed} m/s | {good} | {within} | {misplaced} | {wrong_step} | {largest:.3} |"
            );
        }
    }
}
