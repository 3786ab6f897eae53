//! A particle filter as it is taught, to compare with: Thrun, Burgard and Fox, "Probabilistic Robotics" (2005), tables 8.2 and 4.4.

use nalgebra::{Cholesky, Vector2, Vector3};
use scanstitch::geometry::{Pose2, RigidMotion};
use scanstitch::map::occupancy_grid::{Cell, OccupancyGrid};
use scanstitch::odometry::localization::{BeamModel, MapField};
use scanstitch::odometry::planar::motion_noise::MotionNoise;
use scanstitch::preprocess::planar_scan::PlanarScan;
use scanstitch_scene::random::Random;

/// Beams of a scan, and the share of what they say that is independent.
const BEAMS: usize = 30;
const INDEPENDENT: f64 = 0.3;
/// It is sure where so many of the particles are within this distance of the best one (m).
const SURE: (f64, f64) = (0.95, 1.0);

pub struct ParticleFilter<'a> {
    field: &'a MapField,
    model: BeamModel,
    noise: MotionNoise,
    random: Random,
    particles: Vec<Pose2>,
}

impl<'a> ParticleFilter<'a> {
    /// Spread evenly over the free cells.
    pub fn new(grid: &OccupancyGrid, field: &'a MapField, count: usize, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let cells = (0..grid.width * grid.height).map(|cell| (cell % grid.width, cell / grid.width));
        let free: Vec<(usize, usize)> = cells.filter(|&(x, y)| grid.cell(x, y) == Cell::Free).collect();
        let mut particle = || {
            let (x, y) = free[random.uniform(0.0, free.len() as f64) as usize];
            let at = Vector2::new(x as f64 + random.uniform(0.0, 1.0), y as f64 + random.uniform(0.0, 1.0))
                * grid.resolution;
            grid.T_world_grid() * Pose2::new(at, random.uniform(0.0, std::f64::consts::TAU))
        };
        let particles = (0..count).map(|_| particle()).collect();
        Self { field, model: BeamModel::of(field), noise: MotionNoise::default(), random, particles }
    }

    /// Moves, weighs and draws again.
    pub fn add_scan(&mut self, scan: &PlanarScan, motion: &Pose2) {
        let spread = Cholesky::new(self.noise.covariance(motion)).map(|factor| factor.l());
        let beams: Vec<Vector2<f64>> =
            scan.points.iter().step_by(scan.points.len().div_ceil(BEAMS).max(1)).copied().collect();
        let mut log_weights = Vec::with_capacity(self.particles.len());
        for particle in &mut self.particles {
            let normal = Vector3::from_fn(|_, _| self.random.normal());
            let noise = spread.map_or_else(Vector3::zeros, |spread| spread * normal);
            *particle = (*particle * Pose2::exp(&noise) * motion).renormalized();
            log_weights.push(INDEPENDENT * self.field.score(&self.model, &beams, particle));
        }
        self.draw(&log_weights);
    }

    /// Low-variance sampling.
    fn draw(&mut self, log_weights: &[f64]) {
        let largest = log_weights.iter().fold(f64::NEG_INFINITY, |largest, &weight| largest.max(weight));
        let weights: Vec<f64> = log_weights.iter().map(|weight| (weight - largest).exp()).collect();
        let step = weights.iter().sum::<f64>() / weights.len() as f64;
        let (mut at, mut sum, mut target) = (0, weights[0], step * self.random.uniform(0.0, 1.0));
        let mut drawn = Vec::with_capacity(weights.len());
        for _ in 0..weights.len() {
            while sum < target && at + 1 < weights.len() {
                at += 1;
                sum += weights[at];
            }
            drawn.push(self.particles[at]);
            target += step;
        }
        self.particles = drawn;
    }

    /// Where it is sure to be.
    pub fn sure_place(&self) -> Option<Pose2> {
        let one = self.particles[self.particles.len() / 2];
        let is_near = |particle: &&Pose2| (particle.translation.vector - one.translation.vector).norm() < SURE.1;
        let num_near = self.particles.iter().filter(is_near).count();
        (num_near as f64 >= SURE.0 * self.particles.len() as f64).then_some(one)
    }
}
