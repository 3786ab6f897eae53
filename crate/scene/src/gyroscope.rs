//! A gyroscope on a lidar, what may be wrong with one, and a bare corridor in which a lidar spins.

use std::f64::consts::PI;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::random::Random;
use super::space::{Shape, Solid, Space};
use scanstitch::geometry::Pose3;

/// Half the sides of the corridor (m).
pub const HALF: [f64; 3] = [20.0, 1.2, 1.3];
/// Time between two readings (s).
const PERIOD: f64 = 0.005;

/// What may be wrong with a gyroscope.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Nothing but its noise and a bias of 2 degrees a second about each axis.
    None,
    /// Its axes are others than said.
    Axes,
    /// It counts degrees.
    Degrees,
    /// Its clock is half a second ahead.
    Clock,
    /// It measures no more than 60 degrees a second.
    Saturated,
    /// Noise of 3 rad/s.
    Noise,
}

impl Fault {
    /// All of them, with their names.
    pub const ALL: [(&str, Self); 6] = [
        ("right", Self::None),
        ("wrong axes", Self::Axes),
        ("degrees a second", Self::Degrees),
        ("wrong clock", Self::Clock),
        ("saturated", Self::Saturated),
        ("noise", Self::Noise),
    ];
}

/// A corridor without doors.
pub fn corridor() -> Space {
    let wall = |number: usize| {
        let (axis, side) = (number / 2, if number.is_multiple_of(2) { 1.0 } else { -1.0 });
        let mut half = Vector3::from(HALF).add_scalar(1.0);
        half[axis] = 0.5;
        let center = Vector3::ith(axis, side * (HALF[axis] + 0.5));
        Solid { shape: Shape::Cuboid { half }, R_world_solid: Matrix3::identity(), center, material: 0 }
    };
    Space::new((0..6).map(wall).collect(), Vec::new(), Vec::new(), None)
}

/// Where a lidar is that moves along the corridor with 0.5 m/s and spins with this mean rate (rad/s), which it changes by a third.
pub fn spinning(rate: f64, time: f64) -> Pose3 {
    let heading = rate * (time + 0.2 * libm::sin(0.5 * PI * time));
    let R = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    Pose3::from_parts(Vector3::new(0.5 * time, 0.1, 0.0).into(), R)
}

/// What a gyroscope on a sensor says from one time (s) to another: times and angular velocities in the sensor's frame (rad/s).
pub fn readings(
    pose: impl Fn(f64) -> Pose3,
    [from, to]: [f64; 2],
    fault: Fault,
    seed: u64,
) -> Vec<(f64, Vector3<f64>)> {
    let mut random = Random::new(seed);
    let rate = |time: f64| {
        let [before, after] = [-0.5, 0.5].map(|share| pose(time + share * PERIOD).rotation);
        (before.inverse() * after).scaled_axis() / PERIOD
    };
    let count = ((to - from) / PERIOD).round() as usize;
    let mut reading = |number: usize| {
        let time = from + PERIOD * number as f64;
        let noise = if fault == Fault::Noise { 3.0 } else { 0.005 };
        let mut noisy = |rate: Vector3<f64>| rate.map(|x| x + noise * random.normal() + 2f64.to_radians());
        let said = match fault {
            Fault::None | Fault::Noise => noisy(rate(time)),
            Fault::Axes => noisy(rate(time)).zyx(),
            Fault::Degrees => noisy(rate(time)).map(f64::to_degrees),
            Fault::Clock => noisy(rate(time + 0.5)),
            Fault::Saturated => noisy(rate(time)).map(|x| x.clamp(-PI / 3.0, PI / 3.0)),
        };
        (time, said)
    };
    (0..=count).map(&mut reading).collect()
}
