//! A particle filter as it is taught, to compare with.

use std::rc::Rc;
use std::time::Instant;

use scanstitch::geometry::Pose2;
use scanstitch::map::occupancy_grid::OccupancyGrid;
use scanstitch::odometry::localization::{MapField, Particle, ParticleFilter, ParticleOptions};
use scanstitch::odometry::planar::MeasuredMotion;
use scanstitch::odometry::planar::motion_noise::MotionNoise;
use scanstitch::preprocess::planar_scan::PlanarScan;

use super::{Table, number};
use crate::arguments::argument;

/// It is sure where particles of so much of the weight are within this distance of the heaviest one (m).
const SURE: (f64, f64) = (0.95, 1.0);

/// Where it is sure to be.
fn sure_place(particles: &[Particle]) -> Option<Pose2> {
    let heaviest = particles.iter().max_by(|a, b| a.weight.total_cmp(&b.weight))?.T_world_sensor;
    let off = |particle: &Particle| particle.T_world_sensor.translation.vector - heaviest.translation.vector;
    let near = particles.iter().filter(|particle| off(particle).norm() < SURE.1);
    (near.map(|particle| particle.weight).sum::<f64>() >= SURE.0).then_some(heaviest)
}

/// The numbers of particles that are asked for.
pub fn counts() -> Vec<usize> {
    let number = |count: &str| count.parse().expect("a number");
    argument("--particles").map_or_else(Vec::new, |counts| counts.split(',').map(number).collect())
}

/// Scans in the order in which they were taken, the laser's pose at each by the wheels, and where that is known its true pose.
pub struct Drive<'a> {
    pub scans: &'a [Rc<PlanarScan>],
    pub odometry: &'a [Pose2],
    pub truth: &'a [Option<Pose2>],
}

/// Follows a drive with so many particles from each of some seeds, and adds what they were sure of to a table.
pub fn follow(drive: &Drive<'_>, grid: &OccupancyGrid, count: usize, table: &mut Table) {
    let field = Rc::new(MapField::new(grid));
    let noise = MotionNoise::default();
    for seed in 1..=number("--seeds", 3) {
        let started = Instant::now();
        let options = ParticleOptions { num_particles: count, seed: seed as u32, ..ParticleOptions::default() };
        let mut filter = ParticleFilter::new(&field, options).expect("the map is usable");
        let (mut num_sure, mut num_wrong, mut first) = (0, 0, None);
        for (frame, scan) in drive.scans.iter().enumerate() {
            let motion = frame.checked_sub(1).map(|before| {
                let T_before_sensor = drive.odometry[before].inverse() * drive.odometry[frame];
                MeasuredMotion { T_before_sensor, covariance: noise.covariance(&T_before_sensor) }
            });
            filter.add_scan(scan, motion.as_ref());
            let Some((place, truth)) = sure_place(filter.particles()).zip(drive.truth[frame]) else { continue };
            let off = (place.translation.vector - truth.translation.vector).norm();
            num_sure += 1;
            num_wrong += usize::from(off > SURE.1);
            first.get_or_insert((frame + 1, off));
        }
        table.add(first.filter(|(_, off)| *off <= SURE.1).map(|(after, _)| after), num_wrong);
        let time = 1e3 * started.elapsed().as_secs_f64() / drive.scans.len() as f64;
        println!(
            "  {count} particles, seed {seed}: sure at {num_sure} scans, wrong at {num_wrong}; first {first:.2?}; {time:.1} ms a scan"
        );
    }
}
