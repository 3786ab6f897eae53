//! Worlds with several similar places: their poses are ambiguous in scans alone, and measured motion resolves them.

use std::f64::consts::{PI, TAU};

use nalgebra::Vector2;

use super::corridor::{self, CorridorOptions};
use super::laser::Laser;
use super::passage::pose_at;
use super::random::Random;
use super::recording::PlanarRecording;
use super::world::{Obstacle, World};
use scanstitch::geometry::Pose2;

/// What repeats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ambiguity {
    /// A corridor with a door every 3 m; steps of half a period or more.
    RepeatedCorridor,
    /// A square room in which the robot turns by 60 degrees from scan to scan.
    SquareRoom,
    /// Pillars on a square lattice; steps of half a period or more.
    PillarLattice,
    /// Half of the scans come from one building, the others from another one.
    TwoBuildings,
    /// A corridor whose second half mirrors its first, the same on its left and on its right.
    MirroredHalf,
}

/// All kinds.
pub const ALL: [Ambiguity; 5] = [
    Ambiguity::RepeatedCorridor,
    Ambiguity::SquareRoom,
    Ambiguity::PillarLattice,
    Ambiguity::TwoBuildings,
    Ambiguity::MirroredHalf,
];

/// Distance from door to door (m).
const DOOR_PERIOD: f64 = 3.0;
/// Where the second building stands, in the frame of the first scan (m).
const SECOND_BUILDING: Vector2<f64> = Vector2::new(25.0, 10.0);

/// A drive of `num_scans` scans through a world of this kind, with its ground truth.
pub fn generate(kind: Ambiguity, seed: u64, num_scans: usize) -> PlanarRecording {
    let mut random = Random::new(seed);
    let field_of_view = [PI, 1.5 * PI, TAU * 359.0 / 360.0][(seed % 3) as usize];
    let num_beams = 1 + (field_of_view / PI * 180.0).round() as usize;
    let laser = Laser { num_beams, field_of_view, ..Laser::default() };
    let (world, path) = match kind {
        Ambiguity::RepeatedCorridor => repeated_corridor(num_scans, &mut random),
        Ambiguity::SquareRoom => square_room(num_scans, &mut random),
        Ambiguity::PillarLattice => pillar_lattice(num_scans, &mut random),
        Ambiguity::TwoBuildings => return two_buildings(seed, num_scans, laser, &mut random),
        Ambiguity::MirroredHalf => mirrored_half(num_scans, &mut random),
    };
    PlanarRecording::new(&world, &path, &laser, &mut random)
}

/// Steps along a line, with small deviations from it.
fn drive(num_scans: usize, step: (f64, f64), random: &mut Random) -> Vec<Pose2> {
    let mut along = 0.0;
    let pose = |_| {
        let pose = pose_at(Vector2::new(random.uniform(-0.2, 0.2), along), random.uniform(-0.06, 0.06));
        along += random.uniform(step.0, step.1);
        pose
    };
    (0..num_scans).map(pose).collect()
}

fn repeated_corridor(num_scans: usize, random: &mut Random) -> (World, Vec<Pose2>) {
    let (half_width, depth) = (random.uniform(0.9, 1.6), random.uniform(0.15, 0.4));
    let step = random.uniform(0.5, 1.3) * DOOR_PERIOD;
    let path = drive(num_scans, (0.95 * step, 1.05 * step), random);
    // The ends lie beyond the range of the laser.
    let num_doors = (path[num_scans - 1].translation.y / DOOR_PERIOD) as i32 + 40;
    let mut world = World::default();
    for side in [-1.0, 1.0] {
        let corner = |across: f64, along: f64| Vector2::new(side * across, along);
        let of_door = |door: i32| {
            let along = DOOR_PERIOD * f64::from(door);
            [(0.0, 0.0), (depth, 0.0), (depth, 1.0), (0.0, 1.0)].map(|(out, on)| corner(half_width + out, along + on))
        };
        world.add_walls(&(-20..num_doors).flat_map(of_door).collect::<Vec<_>>());
    }
    (world, path)
}

fn square_room(num_scans: usize, random: &mut Random) -> (World, Vec<Pose2>) {
    let side = random.uniform(5.0, 10.0);
    let mut world = World::default();
    world.add_box(Vector2::zeros(), Vector2::new(side, side), 0.0);
    let at = Vector2::new(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8));
    let start = random.uniform(-PI, PI);
    let near = |random: &mut Random| at + Vector2::new(random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1));
    let path = (0..num_scans).map(|scan| pose_at(near(random), start + scan as f64 * PI / 3.0)).collect();
    (world, path)
}

fn pillar_lattice(num_scans: usize, random: &mut Random) -> (World, Vec<Pose2>) {
    let (period, radius) = (random.uniform(2.5, 5.0), random.uniform(0.15, 0.3));
    let step = random.uniform(0.5, 1.0) * period;
    let path = drive(num_scans, (0.95 * step, 1.05 * step), random);
    let rows = -8..(path[num_scans - 1].translation.y / period) as i32 + 9;
    let center = |row: i32, column: i32| Vector2::new(f64::from(column) + 0.5, f64::from(row) + 0.5) * period;
    let pillars = rows.flat_map(|row| (-8..8).map(move |column| (row, column)));
    let obstacles = pillars.map(|(row, column)| Obstacle::Pillar { center: center(row, column), radius }).collect();
    (World { obstacles }, path)
}

fn two_buildings(seed: u64, num_scans: usize, laser: Laser, random: &mut Random) -> PlanarRecording {
    let half = num_scans / 2;
    let corridor = |seed: u64, num_scans| corridor::generate(&CorridorOptions { seed, num_scans, laser });
    let (mut first, second) = (corridor(2 * seed, half), corridor(2 * seed + 1, num_scans - half));
    let T_first_second = pose_at(SECOND_BUILDING, random.uniform(-PI, PI));
    first.scans.extend(second.scans);
    first.T_world_sensor.extend(second.T_world_sensor.iter().map(|pose| T_first_second * pose));
    first
}

fn mirrored_half(num_scans: usize, random: &mut Random) -> (World, Vec<Pose2>) {
    let half_width = random.uniform(1.0, 2.0);
    let path = drive(num_scans, (0.8, 1.2), random);
    let middle = path[num_scans / 2].translation.y;
    let (mut right, mut along) = (vec![Vector2::new(half_width, 0.0)], random.uniform(1.0, 3.0));
    while along < middle + 8.0 {
        let depth = if random.happens(0.5) { random.uniform(0.2, 0.6) } else { -random.uniform(0.1, 0.3) };
        let (end, out) = (along + random.uniform(0.6, 1.4), half_width + depth);
        right.extend([[half_width, along], [out, along], [out, end], [half_width, end]].map(Vector2::from));
        along = end + random.uniform(0.8, 3.5);
    }
    right.extend([Vector2::new(half_width, along), Vector2::new(0.0, along)]);
    let mut world = World::default();
    for (across, ahead) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
        let corner = |corner: &Vector2<f64>| Vector2::new(across * corner.x, middle + ahead * corner.y);
        world.add_walls(&right.iter().map(corner).collect::<Vec<_>>());
    }
    (world, path)
}
