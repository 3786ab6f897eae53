//! A cluttered corridor and a robot that drives along it.

use nalgebra::Vector2;

use super::laser::Laser;
use super::passage::{MAX_PILASTER, Passage, pose_at};
use super::random::Random;
use super::recording::PlanarRecording;
use super::world::World;
use scanstitch::geometry::Pose2;

pub use super::passage::MIN_CLEARANCE;

/// Options of the generator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorridorOptions {
    /// Each seed gives another corridor and another drive.
    pub seed: u64,
    /// Scans of the drive.
    pub num_scans: usize,
    /// The sensor.
    pub laser: Laser,
}

impl Default for CorridorOptions {
    fn default() -> Self {
        Self { seed: 1, num_scans: 10, laser: Laser::default() }
    }
}

/// Shortest and longest step (m).
pub const STEP: (f64, f64) = (0.9, 1.1);
/// Largest turn between two scans (rad).
pub const MAX_TURN: f64 = 7.0 * std::f64::consts::PI / 180.0;
/// Corridor behind the first scan and ahead of the last (m).
const MARGIN: (f64, f64) = (4.0, 28.0);

/// Generates a corridor along y, with doors, niches, cupboards, pillars and boxes, and a drive along it.
pub fn generate(options: &CorridorOptions) -> PlanarRecording {
    let mut random = Random::new(options.seed);
    let length = STEP.1 * options.num_scans as f64;
    let width = random.uniform(2.6, 4.2);
    let passage = Passage { origin: Vector2::zeros(), turn: 0.0, half_width: width / 2.0 };
    let mut world = World::default();
    for side in [-1.0, 1.0] {
        add_side(&mut world, &mut random, &passage, side, length);
    }
    add_ends(&mut world, &mut random, width / 2.0, length);

    let path = drive(options.num_scans, width / 2.0, &mut random);
    passage.add_clutter(&mut world, -MARGIN.0, length + MARGIN.1 - 6.0, &path, &mut random);
    PlanarRecording::new(&world, &path, &options.laser, &mut random)
}

/// One wall of the corridor with its doors and niches.
fn add_side(world: &mut World, random: &mut Random, passage: &Passage, side: f64, length: f64) {
    let mut y = -MARGIN.0;
    let mut corners = vec![passage.at(side * passage.half_width, y)];
    while y < length + MARGIN.1 {
        let start = y + random.uniform(1.2, 4.5);
        y = passage.add_opening(&mut corners, side, start, random);
    }
    world.add_walls(&corners);
}

/// The wall behind, and ahead a wall with an opening, through which beams reach the limit.
fn add_ends(world: &mut World, random: &mut Random, half_width: f64, length: f64) {
    let behind = half_width + 8.0;
    world.add_walls(&[Vector2::new(-behind, -MARGIN.0), Vector2::new(behind, -MARGIN.0)]);
    let (y, gap) = (length + MARGIN.1 - 6.0, random.uniform(-half_width, half_width - 0.5));
    world.add_walls(&[Vector2::new(-behind, y), Vector2::new(gap, y)]);
    world.add_walls(&[Vector2::new(gap + 0.5, y), Vector2::new(behind, y)]);
}

/// Steps of about a metre; the heading varies at random and is steered back to the middle of the corridor.
fn drive(num_scans: usize, half_width: f64, random: &mut Random) -> Vec<Pose2> {
    let room = half_width - MIN_CLEARANCE - MAX_PILASTER;
    let mut position = Vector2::new(random.uniform(-0.3, 0.3) * room, 0.0);
    let mut heading = random.uniform(-0.05, 0.05);
    let mut path = Vec::with_capacity(num_scans);
    for _ in 0..num_scans {
        path.push(pose_at(position, heading));
        let to_middle = 0.12 * position.x / room; // a turn to the left (positive) leads to smaller x
        let turn = random.uniform(-MAX_TURN, MAX_TURN) + to_middle - 0.4 * heading;
        heading += turn.clamp(-MAX_TURN, MAX_TURN);
        let step = random.uniform(STEP.0, STEP.1);
        position += Vector2::new(-libm::sin(heading), libm::cos(heading)) * step;
        position.x = position.x.clamp(-room, room);
    }
    path
}
