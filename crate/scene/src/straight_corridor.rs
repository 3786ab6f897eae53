//! Drives straight along a corridor whose end walls are out of range: bare, where nothing tells how far the sensor moves, and with pillars.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::gyroscope::{HALF, corridor};
use super::moving_lidar::MovingLidar;
use super::random::Random;
use super::space::{Shape, Solid, Space};
use scanstitch::geometry::Pose3;

/// Range (m) of the lidar: less than the way to the end walls, which are 40 m apart, over drives of 6 m about the middle.
const MAX_RANGE: f64 = 15.0;
/// Where drives begin (m along the corridor).
const START: f64 = -3.0;

/// The same lidar with a range short enough.
pub fn short_sighted(lidar: MovingLidar) -> MovingLidar {
    MovingLidar { max_range: MAX_RANGE, ..lidar }
}

/// A corridor with pillars of 0.3 m at irregular distances along both walls.
pub fn pillared(seed: u64) -> Space {
    let (mut random, bare) = (Random::new(seed), corridor());
    let mut solids = bare.solids().to_vec();
    for side in [-1.0, 1.0] {
        let mut x = -HALF[0];
        while x < HALF[0] {
            x += random.uniform(1.5, 4.0);
            let (half, center) = (Vector3::new(0.15, 0.15, HALF[2]), Vector3::new(x, side * (HALF[1] - 0.15), 0.0));
            let shape = Shape::Cuboid { half };
            solids.push(Solid { shape, R_world_solid: Matrix3::identity(), center, material: 0 });
        }
    }
    Space::new(solids, Vec::new(), Vec::new(), None)
}

/// Where a lidar is that moves straight along the corridor at this speed (m/s): each seed has another place across it and another heading.
pub fn along(speed: f64, seed: u64) -> impl Fn(f64) -> Pose3 + Copy {
    let mut random = Random::new(seed);
    let (y, z, heading) = (random.uniform(-0.4, 0.4), random.uniform(-0.5, 0.2), random.uniform(-0.3, 0.3));
    move |time| {
        let R = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
        Pose3::from_parts(Vector3::new(START + speed * time, y, z).into(), R)
    }
}
