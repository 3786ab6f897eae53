//! A spinning laser in a world of solids: few rings, each with dense points, as on indoor robots.

use std::f64::consts::TAU;

use glam::Vec3;
use nalgebra::{UnitQuaternion, Vector3};

use super::random::Random;
use super::space::Space;
use scanstitch::geometry::{PointCloud, Pose3};

/// A spinning laser: its x axis points forward, z up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpinningLidar {
    /// Beams, one above the other.
    pub num_rings: usize,
    /// Angle of the lowest and of the highest beam over the horizon (rad), one the negative of the other.
    pub half_field_of_view: f64,
    /// Angle from one firing to the next (rad).
    pub azimuth_step: f64,
    /// Standard deviation of a range (m).
    pub noise: f64,
    /// Largest range of a return (m).
    pub max_range: f64,
}

impl Default for SpinningLidar {
    /// A VLP-16: 16 beams over 30 degrees, 0.2 degrees apart along a ring, 2 cm of noise.
    fn default() -> Self {
        Self {
            num_rings: 16,
            half_field_of_view: 15f64.to_radians(),
            azimuth_step: 0.2f64.to_radians(),
            noise: 0.02,
            max_range: 100.0,
        }
    }
}

impl SpinningLidar {
    /// One turn of the laser from a pose of a level sensor, in the sensor's frame.
    pub fn scan(&self, space: &Space, T_world_sensor: &Pose3, seed: u64) -> PointCloud {
        let mut random = Random::new(seed);
        let num_azimuths = (TAU / self.azimuth_step).round() as usize;
        let origin = T_world_sensor.translation.vector;
        let mut positions = Vec::new();
        for azimuth in (0..num_azimuths).map(|index| index as f64 * self.azimuth_step) {
            for ring in 0..self.num_rings {
                let share = ring as f64 / (self.num_rings - 1).max(1) as f64;
                let elevation = self.half_field_of_view * (2.0 * share - 1.0);
                let level = libm::cos(elevation);
                let beam = Vector3::new(level * libm::cos(azimuth), level * libm::sin(azimuth), libm::sin(elevation));
                let Some(hit) = space.cast(&origin, &(T_world_sensor.rotation * beam)) else { continue };
                let range = hit.distance + self.noise * random.normal();
                if range <= self.max_range {
                    let point = beam * range;
                    positions.push(Vec3::new(point.x as f32, point.y as f32, point.z as f32));
                }
            }
        }
        PointCloud::from_positions(positions)
    }
}

/// A level sensor's pose where a camera stands: x where the camera looks, z up.
pub fn level_sensor(T_world_camera: &Pose3) -> Pose3 {
    let forward = T_world_camera.rotation * Vector3::z();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), libm::atan2(forward.y, forward.x));
    Pose3::from_parts(T_world_camera.translation, turn)
}
