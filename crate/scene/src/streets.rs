//! Streets between blocks of houses, with parked cars, posts and hedges, and a drive of a kilometre that comes back to three of them.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};

use super::random::Random;
use super::space::{Shape, Solid, Space};
use scanstitch::geometry::Pose3;

/// Distance between the middles of parallel streets (m), ...
const PERIOD: [f64; 2] = [72.0, 52.0];
/// ... and their width between the fronts (m).
const WIDTH: f64 = 13.0;
/// Height of the sensor over the ground (m).
const SENSOR_HEIGHT: f64 = 1.7;
/// Length over which a corner is rounded (m).
const ROUNDED: f64 = 8.0;
/// Blocks along x and y, those around the outer streets included.
const NUM_BLOCKS: [i32; 2] = [4, 4];

/// Crossings on the way: round two blocks, then from the start on through streets that are known and others, some in the other
/// direction.
const WAY: [[f64; 2]; 16] = [
    [0.0, 0.0],
    [2.0, 0.0],
    [2.0, 1.0],
    [1.0, 1.0],
    [0.0, 1.0],
    [0.0, 0.0],
    [1.0, 0.0],
    [1.0, 1.0],
    [1.0, 2.0],
    [0.0, 2.0],
    [0.0, 1.0],
    [1.0, 1.0],
    [2.0, 1.0],
    [2.0, 2.0],
    [1.0, 2.0],
    [1.0, 1.0],
];

/// The streets; each seed makes others. Where they repeat, all blocks are alike.
pub fn streets(seed: u64, repeats: bool) -> Space {
    let solid = |shape, R_world_solid, center| Solid { shape, R_world_solid, center, material: 0 };
    let ground = Shape::Cuboid { half: Vector3::new(500.0, 500.0, 0.5) };
    let mut solids = vec![solid(ground, Matrix3::identity(), Vector3::new(0.0, 0.0, -0.5 - SENSOR_HEIGHT))];
    for (number, (x, y)) in (0..NUM_BLOCKS[0]).flat_map(|x| (0..NUM_BLOCKS[1]).map(move |y| (x, y))).enumerate() {
        let mut random = Random::new(if repeats { seed } else { 1000 * seed + number as u64 });
        let middle = Vector3::new((f64::from(x) - 0.5) * PERIOD[0], (f64::from(y) - 0.5) * PERIOD[1], 0.0);
        for side in 0..4 {
            let R = Rotation3::from_axis_angle(&Vector3::z_axis(), f64::from(side) * std::f64::consts::FRAC_PI_2);
            let [length, depth] = if side % 2 == 0 { PERIOD } else { [PERIOD[1], PERIOD[0]] };
            let [half_length, front] = [0.5 * (length - WIDTH), 0.5 * (depth - WIDTH)];
            let mut place = |shape, along: f64, out: f64, height: f64, turn: f64| {
                let turned = R * Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
                solids.push(solid(
                    shape,
                    *turned.matrix(),
                    middle + R * Vector3::new(along, out, height - SENSOR_HEIGHT),
                ));
            };
            let mut along = -half_length;
            while along < half_length {
                let half_width = random.uniform(2.0, 6.0).min(0.5 * (half_length - along));
                let half = Vector3::new(half_width, 3.0, random.uniform(2.0, 6.0));
                place(Shape::Cuboid { half }, along + half.x, front - half.y - random.uniform(0.0, 2.0), half.z, 0.0);
                along += 2.0 * half.x + if random.happens(0.3) { random.uniform(0.5, 3.0) } else { 0.0 };
            }
            for _ in 0..8 {
                let (along, out) = (random.uniform(-half_length, half_length), front + random.uniform(0.3, 1.5));
                if random.happens(0.5) {
                    place(Shape::Post { bottom: 0.15, top: 0.1, half_height: 2.5 }, along, out, 2.5, 0.0);
                } else {
                    let car = Shape::Rounded { half: Vector3::new(2.1, 0.85, 0.75), radius: 0.3 };
                    place(car, along, out + 0.8, 0.75, random.uniform(-0.1, 0.1));
                }
            }
        }
    }
    Space::new(solids, Vec::new(), Vec::new(), None)
}

/// Poses of a vehicle on its way through the streets, `step` (m) apart.
pub fn drive(step: f64) -> Vec<Pose3> {
    let corners = WAY.map(|[x, y]| Vector2::new(x * PERIOD[0], y * PERIOD[1]));
    let length: f64 = corners.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let at = |mut along: f64| {
        for pair in corners.windows(2) {
            let leg = (pair[1] - pair[0]).norm();
            if along <= leg {
                return pair[0] + (pair[1] - pair[0]) * (along / leg);
            }
            along -= leg;
        }
        corners[corners.len() - 1]
    };
    // The mean over a length rounds the corners.
    let rounded =
        |along: f64| (0..=16).map(|k| at(along + ROUNDED * (f64::from(k) / 16.0 - 0.5))).sum::<Vector2<f64>>() / 17.0;
    let pose = |along: f64| {
        let [behind, place, ahead] = [-0.5, 0.0, 0.5].map(|off| rounded(along + off));
        let heading = libm::atan2(ahead.y - behind.y, ahead.x - behind.x);
        let R = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
        Pose3::from_parts(Vector3::new(place.x, place.y, 0.0).into(), R)
    };
    let count = ((length - ROUNDED) / step) as usize;
    (0..=count).map(|number| pose(0.5 * ROUNDED + step * number as f64)).collect()
}
