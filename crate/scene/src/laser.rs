//! A planar laser.

use nalgebra::Vector2;

use super::random::Random;
use super::world::World;
use scanstitch::geometry::{Pose2, RigidMotion};

/// A laser that sweeps the plane from right to left; x is right, y is ahead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Laser {
    /// Beams of a scan, evenly spread over the field of view, its ends included.
    pub num_beams: usize,
    /// Angle between the first and the last beam (rad); the first points along x.
    pub field_of_view: f64,
    /// Standard deviation of a range (m).
    pub noise_sigma: f64,
    /// Range that is reported without a return (m).
    pub max_range: f64,
}

impl Default for Laser {
    /// The laser of the homework's recordings.
    fn default() -> Self {
        Self { num_beams: 180, field_of_view: std::f64::consts::PI, noise_sigma: 0.01, max_range: 50.0 }
    }
}

impl Laser {
    /// Unit vector of a beam in the sensor's frame.
    pub fn direction(&self, beam: usize) -> Vector2<f64> {
        let bearing = self.field_of_view * beam as f64 / (self.num_beams.max(2) - 1) as f64;
        Vector2::new(libm::cos(bearing), libm::sin(bearing))
    }

    /// Returns of one scan in the sensor's frame (m), one a beam, at the limit where there is nothing nearer.
    pub fn scan(&self, world: &World, T_world_sensor: &Pose2, random: &mut Random) -> Vec<Vector2<f64>> {
        let origin = T_world_sensor.translation.vector;
        let near = world.within(&origin, self.max_range);
        let beam = |beam| {
            let direction = self.direction(beam);
            let range = near.cast(&origin, &T_world_sensor.rotate(&direction)).unwrap_or(self.max_range);
            let measured = range + self.noise_sigma * random.normal();
            direction * if range < self.max_range { measured.clamp(0.0, self.max_range) } else { self.max_range }
        };
        (0..self.num_beams).map(beam).collect()
    }
}
