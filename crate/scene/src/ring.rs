//! A corridor around a block that returns to its start. The camera never sees across the block, so the drift of its path
//! appears where the loop closes.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Vector2, Vector3};

use super::apartment::walk::level_pose;
use super::random::Random;
use super::space::{Color, Light, Material, Shape, Solid, Space, srgb};
use scanstitch::geometry::Pose3;

/// Sides of the rectangle along the middle of the corridor (m).
const SIDES: [f64; 2] = [12.0, 8.0];
/// Width of the corridor (m).
const WIDTH: f64 = 2.0;
/// Height of its ceiling (m).
const HEIGHT: f64 = 2.5;
/// What stands along the walls leaves this much (m) free on either side of the middle.
const FREE: f64 = 0.5;
/// Height of the camera over the floor (m).
const CAMERA_HEIGHT: f64 = 1.25;

/// The corridor and everything in it. The floor is the plane z = 0, z points up; the middle of the block is the origin.
#[derive(Debug, Clone)]
pub struct Ring {
    /// What can be seen.
    pub space: Space,
}

impl Ring {
    /// A corridor with furniture along its walls; each seed gives other furniture.
    pub fn generate(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let paints: &[u32] =
            &[0x00d8_d2c4, 0x008a_6f52, 0x00a8_5a48, 0x0050_7a8c, 0x0069_8455, 0x00c9_a24a, 0x0074_5f86];
        let materials = paints.iter().map(|&paint| Material::plain(srgb(paint))).collect();
        let mut solids = Vec::new();
        let [outer, inner] = [1.0, -1.0].map(|side| SIDES.map(|length| f64::midpoint(length, side * WIDTH)));
        shell(outer, inner, &mut solids);
        for quarter in 0..4u8 {
            let length = SIDES[usize::from(quarter % 2)];
            for side in [1.0, -1.0] {
                place_furniture(quarter, side, length, paints.len(), &mut random, &mut solids);
            }
        }
        let light = |quarter: u8| Light::Lamp {
            center: in_side(quarter, 0.0, 0.0).push(HEIGHT - 0.3),
            radius: 0.1,
            power: Color::new(2.0, 2.0, 1.9),
        };
        Self { space: Space::new(solids, materials, (0..4).map(light).collect(), None) }
    }

    /// The poses `T_world_camera` of a walk once round and `beyond` metres further, by steps of this length (m) and turns on
    /// the spot by this angle (rad). Both are made a little smaller where they do not fit a side and a corner.
    pub fn walk(&self, step: f64, turn: f64, beyond: f64) -> Vec<Pose3> {
        if !(step > 0.01 && turn > 0.01) {
            return Vec::new();
        }
        let pose = |position: Vector2<f64>, heading: f64| level_pose(position.push(CAMERA_HEIGHT), heading);
        let mut poses = Vec::new();
        // Two half sides a corner: from the middle of one to the middle of the next.
        for leg in 0..5u8 {
            let quarter = leg % 4;
            let (here, next) = (SIDES[usize::from(quarter % 2)] / 2.0, SIDES[usize::from((quarter + 1) % 2)] / 2.0);
            let heading = direction(quarter);
            let steps = |length: f64| (length / step).ceil().max(1.0);
            let along = |quarter: u8, from: f64, to: f64| {
                let count = steps(to - from);
                (0..count as usize).map(move |i| (quarter, from + (to - from) * i as f64 / count))
            };
            if leg == 4 {
                poses.extend(
                    along(0, 0.0, beyond.min(here)).map(|(quarter, at)| pose(in_side(quarter, at, 0.0), heading)),
                );
                break;
            }
            poses.extend(along(quarter, 0.0, here).map(|(quarter, at)| pose(in_side(quarter, at, 0.0), heading)));
            let turns = (FRAC_PI_2 / turn).ceil();
            let corner = in_side(quarter, here, 0.0);
            poses.extend((0..turns as usize).map(|i| pose(corner, heading + FRAC_PI_2 * i as f64 / turns)));
            let second = (quarter + 1) % 4;
            let rest = along(second, -next, 0.0);
            poses.extend(rest.map(|(quarter, at)| pose(in_side(quarter, at, 0.0), direction(second))));
        }
        poses
    }
}

/// Where one looks when one walks along a side, from x towards y (rad).
fn direction(quarter: u8) -> f64 {
    f64::from(quarter) * FRAC_PI_2 - if quarter > 2 { 2.0 * PI } else { 0.0 }
}

/// A place of a side: `along` from its middle in the direction of the walk, `aside` to the right, outwards.
fn in_side(quarter: u8, along: f64, aside: f64) -> Vector2<f64> {
    let off = SIDES[usize::from((quarter + 1) % 2)] / 2.0 + aside;
    match quarter % 4 {
        0 => Vector2::new(along, -off),
        1 => Vector2::new(off, along),
        2 => Vector2::new(-along, off),
        _ => Vector2::new(-off, -along),
    }
}

fn slab(low: Vector3<f64>, high: Vector3<f64>, material: usize) -> Solid {
    let (low, high) = (low.inf(&high), low.sup(&high));
    let shape = Shape::Cuboid { half: (high - low) / 2.0 };
    Solid { shape, R_world_solid: Matrix3::identity(), center: (low + high) / 2.0, material }
}

/// Floor, ceiling, the block in the middle and the outer walls.
fn shell(outer: [f64; 2], inner: [f64; 2], solids: &mut Vec<Solid>) {
    const THICK: f64 = 0.2;
    let [x, y] = outer.map(|half| half + THICK);
    let mut add = |low: [f64; 3], high: [f64; 3], material| {
        solids.push(slab(Vector3::from(low), Vector3::from(high), material));
    };
    add([-x, -y, -THICK], [x, y, 0.0], 1);
    add([-x, -y, HEIGHT], [x, y, HEIGHT + THICK], 0);
    add([-inner[0], -inner[1], 0.0], [inner[0], inner[1], HEIGHT], 0);
    for side in [-1.0, 1.0] {
        add([side * outer[0], -y, 0.0], [side * x, y, HEIGHT], 0);
        add([-x, side * outer[1], 0.0], [x, side * y, HEIGHT], 0);
    }
}

/// Cupboards, benches and pillars along one wall of a side.
fn place_furniture(
    quarter: u8,
    side: f64,
    length: f64,
    num_paints: usize,
    random: &mut Random,
    solids: &mut Vec<Solid>,
) {
    let wall = WIDTH / 2.0;
    let mut along = -length / 2.0 + wall + random.uniform(0.0, 1.0);
    while along < length / 2.0 - wall - 1.2 {
        let (width, depth) = (random.uniform(0.3, 1.2), random.uniform(0.15, wall - FREE));
        let (bottom, top) = if random.happens(0.25) {
            (random.uniform(0.8, 1.4), random.uniform(1.5, 2.0))
        } else {
            (0.0, random.uniform(0.4, 2.2))
        };
        let paint = 1 + random.uniform(0.0, num_paints as f64 - 1.0) as usize;
        let low = in_side(quarter, along, side * wall).push(bottom);
        let high = in_side(quarter, along + width, side * (wall - depth)).push(top);
        solids.push(slab(low, high, paint.min(num_paints - 1)));
        along += width + random.uniform(0.4, 1.8);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scanstitch::geometry::RigidMotion;

    #[test]
    fn the_walk_keeps_clear_of_everything_and_comes_back_to_its_start() {
        let ring = Ring::generate(1);
        let walk = ring.walk(0.25, 10f64.to_radians(), 4.0);
        let once_round = walk.iter().skip(100).position(|pose| (walk[0].inverse() * pose).translation_norm() < 1e-9);
        assert_eq!(once_round, Some(2 * (48 + 32) + 4 * 9 - 100));
        for (before, after) in walk.iter().zip(&walk[1..]) {
            let step = before.inverse() * after;
            assert!(step.translation_norm() < 0.2501 && step.rotation_angle() < 0.1746);
        }
        for pose in &walk {
            for turn in 0..24 {
                let angle = f64::from(turn) * PI / 12.0;
                let ray = Vector3::new(libm::cos(angle), libm::sin(angle), 0.0);
                let hit = ring.space.cast(&pose.translation.vector, &ray).expect("a wall");
                assert!(hit.distance > FREE - 1e-9, "{}", hit.distance);
            }
        }
    }
}
