//! A lidar that moves while it turns, in a world of solids: each point is measured from where the sensor is at its time.

use std::f64::consts::TAU;

use glam::Vec3;
use nalgebra::Vector3;

use super::random::Random;
use super::space::Space;
use scanstitch::geometry::{PointCloud, PointTimes, Pose3};

/// Where the beams go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BeamPattern {
    /// Rings, one above the other, turning counterclockwise once a sweep.
    Rings {
        /// Rings.
        num_rings: usize,
        /// Firings a turn.
        num_azimuths: usize,
        /// Angle of the lowest and of the highest ring over the horizon (rad), one the negative of the other.
        half_field_of_view: f64,
    },
    /// The rosette of two prisms that turn against each other, as a Livox Mid-40's: no sweep repeats the one before.
    Rosette {
        /// Points a sweep.
        num_points: usize,
        /// Angle between the axis and the outermost beam (rad).
        half_field_of_view: f64,
    },
}

/// A lidar: its x axis points forward, z up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MovingLidar {
    /// Where the beams go.
    pub pattern: BeamPattern,
    /// Duration of a sweep (s).
    pub period: f64,
    /// Standard deviation of a range (m).
    pub noise: f64,
    /// Largest range of a return (m).
    pub max_range: f64,
}

/// Turns a second of the two prisms of a Mid-40 (Livox, "Mid-40 wiki", 7294 and -4664 a minute).
const PRISM_RATES: [f64; 2] = [7294.0 / 60.0, -4664.0 / 60.0];

impl MovingLidar {
    /// A lidar of `num_rings` rings with 2 cm of noise, ten turns a second.
    pub fn rings(num_rings: usize, num_azimuths: usize) -> Self {
        let half_field_of_view = if num_rings > 16 { 20f64 } else { 15f64 }.to_radians();
        let pattern = BeamPattern::Rings { num_rings, num_azimuths, half_field_of_view };
        Self { pattern, period: 0.1, noise: 0.02, max_range: 100.0 }
    }

    /// A rosette of 24,000 points within 35 degrees of the axis, ten times a second.
    pub fn rosette() -> Self {
        let pattern = BeamPattern::Rosette { num_points: 24_000, half_field_of_view: 35f64.to_radians() };
        Self { pattern, period: 0.1, noise: 0.02, max_range: 100.0 }
    }

    /// The sweep that begins at `start` (s): points in the frame of the sensor at their own time, which is given since `start`.
    pub fn sweep(&self, space: &Space, pose_at: impl Fn(f64) -> Pose3, start: f64, seed: u64) -> PointCloud {
        let mut random = Random::new(seed);
        let (mut positions, mut offsets) = (Vec::new(), Vec::new());
        let num_firings = match self.pattern {
            BeamPattern::Rings { num_azimuths, .. } => num_azimuths,
            BeamPattern::Rosette { num_points, .. } => num_points,
        };
        for firing in 0..num_firings {
            let offset = self.period * firing as f64 / num_firings as f64;
            let T_world_sensor = pose_at(start + offset);
            for beam in self.beams(firing as f64 / num_firings as f64, start + offset) {
                let hit = space.cast(&T_world_sensor.translation.vector, &(T_world_sensor.rotation * beam));
                let range = hit.map_or(f64::INFINITY, |hit| hit.distance) + self.noise * random.normal();
                if range <= self.max_range {
                    let point = beam * range;
                    positions.push(Vec3::new(point.x as f32, point.y as f32, point.z as f32));
                    offsets.push(offset as f32);
                }
            }
        }
        PointCloud { times: Some(PointTimes { origin: 0.0, offsets }), ..PointCloud::from_positions(positions) }
    }

    /// The beams of a firing, at this share of the sweep and at this time (s).
    fn beams(&self, share: f64, time: f64) -> Vec<Vector3<f64>> {
        match self.pattern {
            BeamPattern::Rings { num_rings, half_field_of_view, .. } => {
                let azimuth = TAU * share;
                let beam = |ring: usize| {
                    let height = 2.0 * ring as f64 / (num_rings - 1).max(1) as f64 - 1.0;
                    let elevation = half_field_of_view * height;
                    let level = libm::cos(elevation);
                    Vector3::new(level * libm::cos(azimuth), level * libm::sin(azimuth), libm::sin(elevation))
                };
                (0..num_rings).map(beam).collect()
            }
            BeamPattern::Rosette { half_field_of_view, .. } => {
                let [a, b] = PRISM_RATES.map(|rate| TAU * rate * time);
                let deflection = 0.5 * half_field_of_view;
                let [y, z] =
                    [libm::cos(a) + libm::cos(b), libm::sin(a) + libm::sin(b)].map(|sum| libm::tan(deflection * sum));
                vec![Vector3::new(1.0, y, z).normalize()]
            }
        }
    }
}
