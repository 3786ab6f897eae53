//! What moves in the [streets](super::streets): a car ahead that drives away, cars that come towards the vehicle, and people who cross.

use nalgebra::{Matrix3, Vector3};

use super::space::{Shape, Solid, Space};

/// Height of the sensor over the ground (m).
const SENSOR_HEIGHT: f64 = 1.7;
/// Half the sides of a car and of a person (m).
const CAR: [f64; 3] = [2.1, 0.85, 0.75];
const PERSON: [f64; 3] = [0.25, 0.2, 0.85];

/// What moves, at a time (s) since the vehicle set out along the first street.
pub fn traffic(time: f64) -> Vec<Solid> {
    let solid = |half: [f64; 3], x: f64, y: f64, radius: f64| Solid {
        shape: Shape::Rounded { half: half.into(), radius },
        R_world_solid: Matrix3::identity(),
        center: Vector3::new(x, y, half[2] - SENSOR_HEIGHT),
        material: 0,
    };
    let ahead = solid(CAR, 16.0 + 10.0 * time + 4.0 * (time - 2.0).max(0.0), 0.0, 0.3);
    let coming = (0..6).map(|number| solid(CAR, 30.0 + 35.0 * f64::from(number) - 9.0 * time, 2.4, 0.3));
    let crossing = (0..3).map(|number| {
        let [x, begins] = [20.0 + 20.0 * f64::from(number), f64::from(number)];
        solid(PERSON, x, -5.0 + 1.4 * (time - begins).max(0.0), 0.15)
    });
    std::iter::once(ahead).chain(coming).chain(crossing).collect()
}

/// A world with what moves in it, at this time (s).
pub fn with_traffic(space: &Space, time: f64) -> Space {
    Space::new(space.solids().iter().copied().chain(traffic(time)).collect(), Vec::new(), Vec::new(), None)
}

/// Whether a point was measured on something that moves, at this time (s), give or take `tolerance` (m).
pub fn is_of_traffic(point: &Vector3<f64>, time: f64, tolerance: f64) -> bool {
    let is_on = |solid: &Solid| {
        let Shape::Rounded { half, .. } = solid.shape else { return false };
        let off = (point - solid.center).abs() - half;
        off.max() < tolerance
    };
    point.z > tolerance - SENSOR_HEIGHT && traffic(time).iter().any(is_on)
}
