//! A cluttered corridor and a robot that drives along it.

use nalgebra::{UnitComplex, Vector2};

use super::laser::Laser;
use super::random::Random;
use super::world::{Obstacle, World};
use crate::geometry::Pose2;

/// What is generated.
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

/// A drive with its exact truth.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanarRecording {
    /// What was there, in the frame of the first pose.
    pub world: World,
    /// Returns of each scan in the sensor's frame (m).
    pub scans: Vec<Vec<Vector2<f64>>>,
    /// Pose of the sensor at each scan, in the frame of the first.
    pub T_world_sensor: Vec<Pose2>,
}

/// The robot keeps this far from everything (m).
pub const MIN_CLEARANCE: f64 = 0.35;
/// Length of a step (m), from ... to.
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
    let mut world = World::default();
    for side in [-1.0, 1.0] {
        add_side(&mut world, &mut random, side, width / 2.0, length);
    }
    add_ends(&mut world, &mut random, width / 2.0, length);

    let path = drive(options.num_scans, width / 2.0, &mut random);
    add_clutter(&mut world, &mut random, width / 2.0, length, &path);
    let path = in_first_frame(&mut world, &path);
    let scans = path.iter().map(|pose| options.laser.scan(&world, pose, &mut random)).collect();
    PlanarRecording { world, scans, T_world_sensor: path }
}

/// One wall of the corridor with its doors and niches.
fn add_side(world: &mut World, random: &mut Random, side: f64, half_width: f64, length: f64) {
    let at = |depth: f64, y: f64| Vector2::new(side * (half_width + depth), y);
    let end = length + MARGIN.1;
    let mut y = -MARGIN.0;
    let mut corners = vec![at(0.0, y)];
    while y < end {
        let next = y + random.uniform(1.2, 4.5);
        let opening = random.uniform(0.7, 1.3);
        let kind = random.uniform(0.0, 1.0);
        corners.push(at(0.0, next));
        if kind < 0.2 {
            // An open door into a room: the far wall of the room is seen through it.
            let (depth, before, after) = (random.uniform(2.0, 5.0), random.uniform(0.3, 2.0), random.uniform(0.3, 2.0));
            let jamb = 0.12;
            corners.extend([at(jamb, next), at(jamb, next - before), at(depth, next - before)]);
            corners.extend([
                at(depth, next + opening + after),
                at(jamb, next + opening + after),
                at(jamb, next + opening),
            ]);
        } else {
            // A closed door set back in its frame, a niche, or a pilaster that stands out.
            let depth = if kind < 0.6 {
                0.12
            } else if kind < 0.8 {
                random.uniform(0.25, 0.6)
            } else {
                -random.uniform(0.1, 0.25)
            };
            corners.extend([at(depth, next), at(depth, next + opening)]);
        }
        corners.push(at(0.0, next + opening));
        y = next + opening;
    }
    world.add_walls(&corners);
}

/// The wall behind, and ahead a wall with a way out, through which nothing is seen up to the limit.
fn add_ends(world: &mut World, random: &mut Random, half_width: f64, length: f64) {
    let behind = half_width + 8.0;
    world.add_walls(&[Vector2::new(-behind, -MARGIN.0), Vector2::new(behind, -MARGIN.0)]);
    let (y, gap) = (length + MARGIN.1 - 6.0, random.uniform(-half_width, half_width - 0.5));
    world.add_walls(&[Vector2::new(-behind, y), Vector2::new(gap, y)]);
    world.add_walls(&[Vector2::new(gap + 0.5, y), Vector2::new(behind, y)]);
}

/// Steps of about a metre; the heading wanders and is drawn back to the middle and to straight ahead.
fn drive(num_scans: usize, half_width: f64, random: &mut Random) -> Vec<Pose2> {
    let room = half_width - MIN_CLEARANCE - 0.25; // a pilaster may stand out by 0.25
    let mut position = Vector2::new(random.uniform(-0.3, 0.3) * room, 0.0);
    let mut heading = random.uniform(-0.05, 0.05);
    let mut path = Vec::with_capacity(num_scans);
    for _ in 0..num_scans {
        path.push(Pose2::from_parts(
            position.into(),
            UnitComplex::from_cos_sin_unchecked(libm::cos(heading), libm::sin(heading)),
        ));
        let to_middle = 0.12 * position.x / room; // a turn to the left (positive) leads to smaller x
        let turn = random.uniform(-MAX_TURN, MAX_TURN) + to_middle - 0.4 * heading;
        heading += turn.clamp(-MAX_TURN, MAX_TURN);
        let step = random.uniform(STEP.0, STEP.1);
        position += Vector2::new(-libm::sin(heading), libm::cos(heading)) * step;
        position.x = position.x.clamp(-room, room);
    }
    path
}

/// Cupboards along the walls, boxes and pillars, wherever they leave the robot its way.
fn add_clutter(world: &mut World, random: &mut Random, half_width: f64, length: f64, path: &[Pose2]) {
    let end = length + MARGIN.1 - 6.0;
    let attempts = (end + MARGIN.0) as usize * 2;
    for _ in 0..attempts {
        let mut piece = World::default();
        let side = if random.happens(0.5) { 1.0 } else { -1.0 };
        let y = random.uniform(0.5 - MARGIN.0, end - 0.5);
        let kind = random.uniform(0.0, 1.0);
        if kind < 0.5 {
            let sides = Vector2::new(random.uniform(0.25, 0.6), random.uniform(0.5, 1.6));
            piece.add_box(Vector2::new(side * (half_width - sides.x / 2.0), y), sides, 0.0);
        } else if kind < 0.8 {
            let sides = Vector2::new(random.uniform(0.2, 0.7), random.uniform(0.2, 0.7));
            let center = Vector2::new(side * random.uniform(0.3, 0.95) * half_width, y);
            piece.add_box(center, sides, random.uniform(0.0, std::f64::consts::PI));
        } else {
            let center = Vector2::new(side * random.uniform(0.3, 0.95) * half_width, y);
            piece.obstacles.push(Obstacle::Pillar { center, radius: random.uniform(0.06, 0.25) });
        }
        if random.happens(0.45) && leaves_the_way(&piece, path) {
            world.obstacles.append(&mut piece.obstacles);
        }
    }
}

/// Whether the robot keeps its clearance all along its path.
fn leaves_the_way(piece: &World, path: &[Pose2]) -> bool {
    path.windows(2).all(|pair| {
        let (from, to) = (pair[0].translation.vector, pair[1].translation.vector);
        (0..=10).all(|i| piece.clearance(&from.lerp(&to, f64::from(i) / 10.0)) > MIN_CLEARANCE + 0.05)
    })
}

/// Moves the world and the path so that the first pose is the identity.
fn in_first_frame(world: &mut World, path: &[Pose2]) -> Vec<Pose2> {
    let Some(first) = path.first() else { return Vec::new() };
    let T_first_world = first.inverse();
    let moved = |point: &Vector2<f64>| T_first_world.rotation * point + T_first_world.translation.vector;
    for obstacle in &mut world.obstacles {
        match obstacle {
            Obstacle::Wall { from, to } => (*from, *to) = (moved(from), moved(to)),
            Obstacle::Pillar { center, .. } => *center = moved(center),
        }
    }
    path.iter().map(|pose| T_first_world * pose).collect()
}
