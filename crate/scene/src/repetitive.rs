//! Rooms in which a depth camera sees similar images from several places.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};

use super::apartment::walk::level_pose;
use super::random::Random;
use super::space::{Color, Light, Material, Pattern, Shape, Solid, Space, srgb};
use scanstitch::geometry::Pose3;

/// The repeated structure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Repetition {
    /// Pillars along both walls of a corridor, at this distance from each other (m).
    Pillars(f64),
    /// The walls of a cubic room of 8 m, in which the camera turns on the spot by 20 degrees from frame to frame.
    Cube,
    /// The tiles of the floor and the walls of a corridor, of 0.5 m.
    Tiles,
}

/// Height of the camera over the floor (m).
const CAMERA_HEIGHT: f64 = 1.25;
/// Half the length of a corridor (m): its ends are out of range.
const HALF_LENGTH: f64 = 40.0;
/// Half the width of a corridor (m).
const HALF_WIDTH: f64 = 1.5;
/// Height of a corridor (m).
const HEIGHT: f64 = 2.6;
/// Side of the cubic room (m).
const CUBE_SIDE: f64 = 8.0;
/// Side of a tile (m).
const TILE_SIDE: f64 = 0.5;
/// Thickness of walls (m).
const THICKNESS: f64 = 0.2;
/// Largest random deviation from the path (m, and rad).
const DEVIATION: f64 = 0.02;

/// The room, and the poses of a walk of `num_frames` frames through it; in a corridor by steps of this length (m).
pub fn generate(repetition: Repetition, step: f64, num_frames: usize, seed: u64) -> (Space, Vec<Pose3>) {
    let mut random = Random::new(seed);
    let pattern = if repetition == Repetition::Tiles {
        Pattern::Tiles { side: TILE_SIDE, checkered: true }
    } else {
        Pattern::Plain
    };
    let material = Material::of(pattern, srgb(0x00d8_d2c4), srgb(0x0050_7a8c)).continuing();
    let solids = match repetition {
        Repetition::Cube => room([CUBE_SIDE / 2.0; 2], CUBE_SIDE),
        Repetition::Tiles => room([HALF_LENGTH, HALF_WIDTH], HEIGHT),
        Repetition::Pillars(period) => {
            let mut solids = room([HALF_LENGTH, HALF_WIDTH], HEIGHT);
            solids.extend(pillars(period));
            solids
        }
    };
    let mut pose = |index: usize| {
        let [x, y, turn] = [(); 3].map(|()| random.uniform(-DEVIATION, DEVIATION));
        let (along, heading) = match repetition {
            Repetition::Cube => (0.0, index as f64 * TAU / 18.0),
            _ => (index as f64 * step - HALF_LENGTH / 2.0, 0.0),
        };
        level_pose(Vector3::new(along + x, y, CAMERA_HEIGHT), heading + turn)
    };
    let poses = (0..num_frames).map(&mut pose).collect();
    let light = Light::Lamp { center: Vector3::new(0.0, 0.0, HEIGHT - 0.3), radius: 0.1, power: Color::repeat(2.0) };
    (Space::new(solids, vec![material], vec![light], None), poses)
}

fn slab(low: [f64; 3], high: [f64; 3]) -> Solid {
    let (low, high) = (Vector3::from(low), Vector3::from(high));
    let shape = Shape::Cuboid { half: (high - low) / 2.0 };
    Solid { shape, R_world_solid: Matrix3::identity(), center: (low + high) / 2.0, material: 0 }
}

/// Floor, ceiling and four walls around the origin.
fn room([x, y]: [f64; 2], height: f64) -> Vec<Solid> {
    let mut solids = vec![slab([-x, -y, -THICKNESS], [x, y, 0.0]), slab([-x, -y, height], [x, y, height + THICKNESS])];
    for side in [-1.0, 1.0] {
        let (near, far) = (side * x, side * (x + THICKNESS));
        solids.push(slab([near.min(far), -y, 0.0], [near.max(far), y, height]));
        let (near, far) = (side * y, side * (y + THICKNESS));
        solids.push(slab([-x, near.min(far), 0.0], [x, near.max(far), height]));
    }
    solids
}

/// Square pillars of 0.3 m against both walls of the corridor.
fn pillars(period: f64) -> Vec<Solid> {
    const SIDE: f64 = 0.3;
    let num_pillars = (HALF_LENGTH / period) as i32;
    let pair = |index: i32| {
        let along = f64::from(index) * period;
        [-HALF_WIDTH, HALF_WIDTH - SIDE].map(|y| slab([along, y, 0.0], [along + SIDE, y + SIDE, HEIGHT]))
    };
    (-num_pillars..num_pillars).flat_map(pair).collect()
}
