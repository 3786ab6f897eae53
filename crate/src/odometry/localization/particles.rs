//! Monte Carlo localisation as it is taught, for comparison with the exact search: Thrun, Burgard and Fox, "Probabilistic Robotics" (2005),
//! tables 8.2 (the filter), 6.3 (the likelihood field), 4.4 (low-variance sampling) and 5.4 (a normal sample as a sum of twelve).

use std::rc::Rc;

use nalgebra::{Cholesky, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::field::MapField;
use super::likelihood::BeamModel;
use crate::geometry::random::Random;
use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::MeasuredMotion;
use crate::preprocess::planar_scan::PlanarScan;
use crate::{Error, Result};

/// What is chosen by hand in a particle filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(default, deny_unknown_fields)]
pub struct ParticleOptions {
    /// Number of particles, 1..=1,000,000.
    pub num_particles: usize,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Most beams of a scan that are used, evenly chosen; at least 1.
    pub num_beams: usize,
    /// Standard deviation of a return from a wall (m), beside that of the map and the sensor: a wider field has fewer, broader maxima.
    pub return_sigma: f64,
    /// Share of what the beams say that is independent, above 0 and up to 1: the exponent of their likelihood.
    pub independent: f64,
    /// Factor on the standard deviation of the motions, 0 or more.
    pub motion_noise: f64,
    /// Particles are drawn anew where the effective number is below this share of them: 1 after every scan, 0 never.
    pub resample_below: f64,
    /// Share of the particles that are put anywhere in the free cells when they are drawn, 0..=1: recovers a kidnapped robot.
    pub random_share: f64,
}

impl Default for ParticleOptions {
    /// 2,000 particles, 30 beams, drawn after every scan; 0.2 m as nav2's AMCL has it.
    fn default() -> Self {
        Self {
            num_particles: 2000,
            seed: 1,
            num_beams: 30,
            return_sigma: 0.2,
            independent: 0.3,
            motion_noise: 1.0,
            resample_below: 1.0,
            random_share: 0.0,
        }
    }
}

/// Most particles: 32 MB.
pub const MAX_PARTICLES: usize = 1_000_000;

impl ParticleOptions {
    fn check(&self) -> Result<()> {
        let is_share = |share: f64| (0.0..=1.0).contains(&share);
        let is_sigma = |sigma: f64| (0.0..f64::INFINITY).contains(&sigma);
        let faults = [
            (
                !(1..=MAX_PARTICLES).contains(&self.num_particles),
                "num_particles",
                format!("a number from 1 to {MAX_PARTICLES}"),
            ),
            (self.num_beams == 0, "num_beams", "1 or more".to_owned()),
            (!is_share(self.independent) || self.independent == 0.0, "independent", "above 0 and up to 1".to_owned()),
            (!is_sigma(self.return_sigma), "return_sigma", "0 or more".to_owned()),
            (!is_sigma(self.motion_noise), "motion_noise", "0 or more".to_owned()),
            (!is_share(self.resample_below), "resample_below", "from 0 to 1".to_owned()),
            (!is_share(self.random_share), "random_share", "from 0 to 1".to_owned()),
        ];
        match faults.into_iter().find(|(is_wrong, ..)| *is_wrong) {
            Some((_, name, limits)) => {
                Err(Error::whole(format!("{name} is out of its limits"), format!("Give {limits}")))
            }
            None => Ok(()),
        }
    }
}

/// A pose in the world with its weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Particle {
    /// The sensor's pose.
    pub T_world_sensor: Pose2,
    /// Its share of all weights.
    pub weight: f64,
}

/// Poses that stand for the probability of where the robot is.
#[derive(Debug, Clone)]
pub struct ParticleFilter {
    options: ParticleOptions,
    field: Rc<MapField>,
    model: BeamModel,
    random: Random,
    particles: Vec<Particle>,
}

impl ParticleFilter {
    /// Spread evenly over the free cells of a map, with any heading.
    ///
    /// # Errors
    /// Options out of their limits; a map without walls or without free space.
    pub fn new(field: &Rc<MapField>, options: ParticleOptions) -> Result<Self> {
        options.check()?;
        field.check()?;
        let mut filter = Self {
            options,
            field: Rc::clone(field),
            model: BeamModel::of(field).widened(options.return_sigma),
            random: Random::new(options.seed.into()),
            particles: Vec::new(),
        };
        filter.spread();
        Ok(filter)
    }

    /// What was chosen.
    pub fn options(&self) -> &ParticleOptions {
        &self.options
    }

    /// The particles, moved and weighed by the last scan.
    pub fn particles(&self) -> &[Particle] {
        &self.particles
    }

    /// So many particles of equal weight would say as much: the inverse of the sum of the squared weights.
    pub fn effective_number(&self) -> f64 {
        1.0 / self.particles.iter().map(|particle| particle.weight * particle.weight).sum::<f64>()
    }

    /// Draws the particles by their weights, moves them and weighs them by a scan. Where no motion is known they are spread anew.
    pub fn add_scan(&mut self, scan: &PlanarScan, motion: Option<&MeasuredMotion>) {
        match motion {
            Some(motion) => {
                if self.effective_number() <= self.options.resample_below * self.particles.len() as f64 {
                    self.draw();
                }
                self.move_on(motion);
            }
            None => self.spread(),
        }
        self.weigh(scan);
    }

    /// Anywhere in the free cells.
    fn spread(&mut self) {
        let free = self.field.free_cells();
        let weight = 1.0 / self.options.num_particles as f64;
        self.particles = (0..self.options.num_particles)
            .map(|_| Particle { T_world_sensor: anywhere(&self.field, &free, &mut self.random), weight })
            .collect();
    }

    fn move_on(&mut self, motion: &MeasuredMotion) {
        let spread = Cholesky::new(motion.covariance).map(|root| self.options.motion_noise * root.l());
        for particle in &mut self.particles {
            let noise = Vector3::from_fn(|_, _| normal(&mut self.random));
            let noise = spread.map_or_else(Vector3::zeros, |spread| spread * noise);
            particle.T_world_sensor =
                (particle.T_world_sensor * Pose2::exp(&noise) * motion.T_before_sensor).renormalized();
        }
    }

    /// By the likelihood field, in logarithms: of many beams the likelihood is below the least number.
    fn weigh(&mut self, scan: &PlanarScan) {
        let step = scan.points.len().div_ceil(self.options.num_beams).max(1);
        let ends: Vec<Vector2<f64>> = scan.points.iter().step_by(step).copied().collect();
        let log_weight = |particle: &Particle| {
            let score = self.field.score(&self.model, &ends, &particle.T_world_sensor);
            particle.weight.ln() + self.options.independent * score
        };
        let log_weights: Vec<f64> = self.particles.iter().map(log_weight).collect();
        let largest = log_weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = log_weights.iter().map(|weight| (weight - largest).exp()).sum();
        for (particle, log_weight) in self.particles.iter_mut().zip(log_weights) {
            particle.weight = (log_weight - largest).exp() / sum;
        }
    }

    /// Low-variance sampling: one random number chooses them all. Some are put anywhere.
    fn draw(&mut self) {
        let count = self.particles.len();
        let weight = 1.0 / count as f64;
        let (mut at, mut sum) = (0, self.particles[0].weight);
        let mut target = self.random.uniform(0.0, weight);
        let mut drawn = Vec::with_capacity(count);
        for _ in 0..count {
            while sum < target && at + 1 < count {
                at += 1;
                sum += self.particles[at].weight;
            }
            drawn.push(Particle { weight, ..self.particles[at] });
            target += weight;
        }
        let num_random = (self.options.random_share * count as f64) as usize;
        if num_random > 0 {
            let free = self.field.free_cells();
            for index in 0..num_random {
                drawn[index * count / num_random].T_world_sensor = anywhere(&self.field, &free, &mut self.random);
            }
        }
        self.particles = drawn;
    }
}

/// A pose in one of these cells.
fn anywhere(field: &MapField, cells: &[usize], random: &mut Random) -> Pose2 {
    let cell = cells[random.below(cells.len())];
    let corner = Vector2::new((cell % field.width) as f64, (cell / field.width) as f64);
    let inside = Vector2::new(random.uniform(0.0, 1.0), random.uniform(0.0, 1.0));
    field.in_world(&Pose2::new((corner + inside) * field.resolution, random.uniform(0.0, std::f64::consts::TAU)))
}

/// Of mean 0 and standard deviation 1, nearly normal.
fn normal(random: &mut Random) -> f64 {
    (0..12).map(|_| random.uniform(-0.5, 0.5)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::occupancy_grid::OccupancyGrid;

    /// In a square room of 4 m.
    fn filter(options: ParticleOptions) -> ParticleFilter {
        let side = |turn: f64| {
            let wall = (-40..=40).map(|i| Vector2::new(2.0, f64::from(i) * 0.05));
            wall.map(move |point| Pose2::new(Vector2::zeros(), turn).act(&point))
        };
        let points = (0..4).flat_map(|quarter| side(f64::from(quarter) * std::f64::consts::FRAC_PI_2)).collect();
        let (scan, pose) = (PlanarScan::new(points), Pose2::identity());
        // As often as makes a cell free that beams cross.
        let grid = OccupancyGrid::new(&[(&scan, pose); 5], &[], 0.05);
        ParticleFilter::new(&Rc::new(MapField::new(&grid)), options).expect("the room has walls and free space")
    }

    #[test]
    fn each_particle_is_drawn_as_often_as_its_weight_says_but_for_less_than_one() {
        let mut filter = filter(ParticleOptions { num_particles: 50, ..ParticleOptions::default() });
        let sum: f64 = (0..50).map(f64::from).sum();
        let mut before = filter.particles.clone();
        for (index, particle) in before.iter_mut().enumerate() {
            particle.weight = index as f64 / sum;
        }
        filter.particles.clone_from(&before);
        filter.draw();
        assert_eq!(filter.particles.len(), 50);
        for particle in &before {
            let drawn = filter.particles.iter().filter(|drawn| drawn.T_world_sensor == particle.T_world_sensor).count();
            assert!((drawn as f64 - 50.0 * particle.weight).abs() < 1.0, "{drawn} of {}", particle.weight);
        }
        assert!((filter.effective_number() - 50.0).abs() < 1e-9);
    }

    #[test]
    fn particles_spread_evenly_over_the_free_cells_and_some_again_where_they_are_asked_for() {
        let options = ParticleOptions { num_particles: 4000, random_share: 0.25, ..ParticleOptions::default() };
        let mut filter = filter(options);
        let quarter = |filter: &ParticleFilter| {
            let is_inside =
                |p: &&Particle| p.T_world_sensor.translation.x > 0.0 && p.T_world_sensor.translation.y > 0.0;
            filter.particles.iter().filter(is_inside).count() as f64 / 4000.0
        };
        assert!((quarter(&filter) - 0.25).abs() < 0.03, "{}", quarter(&filter));
        let corner = Pose2::new(Vector2::new(1.0, 1.0), 0.0);
        filter.particles.iter_mut().for_each(|particle| particle.T_world_sensor = corner);
        filter.draw();
        let elsewhere = filter.particles.iter().filter(|particle| particle.T_world_sensor != corner).count();
        assert_eq!(elsewhere, 1000);
    }

    #[test]
    fn numbers_out_of_their_limits_are_refused_by_name() {
        let field = Rc::clone(&filter(ParticleOptions::default()).field);
        for (options, name) in [
            (ParticleOptions { num_particles: 0, ..ParticleOptions::default() }, "num_particles"),
            (ParticleOptions { num_particles: usize::MAX, ..ParticleOptions::default() }, "num_particles"),
            (ParticleOptions { num_beams: 0, ..ParticleOptions::default() }, "num_beams"),
            (ParticleOptions { independent: 0.0, ..ParticleOptions::default() }, "independent"),
            (ParticleOptions { return_sigma: -1.0, ..ParticleOptions::default() }, "return_sigma"),
            (ParticleOptions { motion_noise: f64::NAN, ..ParticleOptions::default() }, "motion_noise"),
            (ParticleOptions { resample_below: 1.1, ..ParticleOptions::default() }, "resample_below"),
            (ParticleOptions { random_share: -0.1, ..ParticleOptions::default() }, "random_share"),
        ] {
            let error = ParticleFilter::new(&field, options).err().map(|error| error.problem);
            assert_eq!(error, Some(format!("{name} is out of its limits")));
        }
    }
}
