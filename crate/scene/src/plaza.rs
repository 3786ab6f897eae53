//! A square between houses, with lamp posts, trees and parked cars around a circle that is free to drive on.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::random::Random;
use super::space::{Shape, Solid, Space};
use scanstitch::geometry::Pose3;

/// Half the side of the square (m).
const HALF_SIDE: f64 = 35.0;
/// Radius of the free circle (m).
const FREE_RADIUS: f64 = 14.0;
/// Height of the sensor over the ground (m).
const SENSOR_HEIGHT: f64 = 1.7;

/// The square; each seed makes another one.
pub fn plaza(seed: u64) -> Space {
    let mut random = Random::new(seed);
    let ground = Shape::Cuboid { half: Vector3::new(200.0, 200.0, 0.5) };
    let solid = |shape, R_world_solid, center| Solid { shape, R_world_solid, center, material: 0 };
    let mut solids = vec![solid(ground, Matrix3::identity(), Vector3::new(0.0, 0.0, -0.5 - SENSOR_HEIGHT))];
    for side in 0..4 {
        let R = Rotation3::from_axis_angle(&Vector3::z_axis(), f64::from(side) * std::f64::consts::FRAC_PI_2);
        // Houses of different width, depth and height, with alleys between them.
        let mut along = -HALF_SIDE;
        while along < HALF_SIDE {
            let half = Vector3::new(random.uniform(2.0, 5.0), random.uniform(3.0, 6.0), random.uniform(3.0, 8.0));
            let front = HALF_SIDE + random.uniform(-3.0, 3.0);
            let center = Vector3::new(along + half.x, front + half.y, half.z - SENSOR_HEIGHT);
            solids.push(solid(Shape::Cuboid { half }, *R.matrix(), R * center));
            along += 2.0 * half.x + random.uniform(0.0, 3.0);
        }
    }
    for number in 0..40 {
        let (radius, angle) =
            (random.uniform(FREE_RADIUS, HALF_SIDE - 4.0), random.uniform(0.0, std::f64::consts::TAU));
        let R = Rotation3::from_axis_angle(&Vector3::z_axis(), random.uniform(0.0, 3.0));
        let (shape, height) = if number % 2 == 0 {
            (Shape::Post { bottom: 0.2, top: 0.1, half_height: 2.5 }, 2.5)
        } else {
            (Shape::Rounded { half: Vector3::new(2.2, 0.9, 0.75), radius: 0.3 }, 0.75)
        };
        let place = Vector3::new(radius * libm::cos(angle), radius * libm::sin(angle), height - SENSOR_HEIGHT);
        solids.push(solid(shape, *R.matrix(), place));
    }
    Space::new(solids, Vec::new(), Vec::new(), None)
}

/// Where a vehicle is at a time (s) that drives around the square with this speed (m/s) and rate of turn (rad/s, not zero).
pub fn around_the_plaza(speed: f64, rate: f64, time: f64) -> Pose3 {
    let (radius, angle) = (speed / rate, rate * time);
    let R = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    let place = Vector3::new(radius * libm::sin(angle), -radius * libm::cos(angle), 0.0);
    Pose3::from_parts(place.into(), R)
}
