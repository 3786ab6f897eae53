//! A drive outdoors around the buildings of a campus: most beams have no return, the others hit trees, cars, hedges and the
//! ground ahead of slopes.

use nalgebra::Vector2;

use super::drive::{Drive, Wheels, odometry};
use super::laser::Laser;
use super::random::Random;
use super::world::{Obstacle, World};
use scanstitch::geometry::{Pose2, RigidMotion};

/// Options of the generator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CampusOptions {
    /// Each seed gives other buildings, trees and noise.
    pub seed: u64,
    /// Distance between scans (m); in a turn they are at most 0.35 rad apart.
    pub step: f64,
    /// Length of the drive (m), at most 630 m; it returns to its start after 400 m.
    pub length: f64,
    /// The wheels.
    pub wheels: Wheels,
}

impl Default for CampusOptions {
    /// A skid-steered robot, whose wheels overestimate turns.
    fn default() -> Self {
        let wheels = Wheels { scale: -0.02, drift: 0.004, turn: 0.05, noise: 0.05, slip: 0.01 };
        Self { seed: 1, step: 1.0, length: 630.0, wheels }
    }
}

/// Corners of the way (m): round both blocks, then between them and round the first one.
const WAY: [[f64; 2]; 9] = [
    [0.0, 0.0],
    [120.0, 0.0],
    [120.0, 80.0],
    [0.0, 80.0],
    [0.0, 0.0],
    [60.0, 0.0],
    [60.0, 80.0],
    [0.0, 80.0],
    [0.0, 50.0],
];
/// Length over which a corner is rounded (m).
const ROUNDED: f64 = 8.0;
/// Height of the laser (m).
const SENSOR_HEIGHT: f64 = 0.4;
/// Hills: place (m), height (m) and width (m).
const HILLS: [(f64, f64, f64, f64); 3] = [(35.0, 0.0, 1.0, 6.0), (120.0, 45.0, 0.8, 5.0), (62.0, 38.0, 0.7, 4.0)];
/// Standard deviation of a range (m), ...
const NOISE: f64 = 0.02;
/// ... and how deep beams reach into leaves (m).
const LEAVES: f64 = 0.2;
/// Share of the beams that pass a hedge, and of the scans with a person in view.
const SHARES: (f64, f64) = (0.1, 0.3);
const MAX_TURN: f64 = 0.35;

/// Drives over a campus; readings of 81.91 m mean that nothing came back.
pub fn generate(options: &CampusOptions) -> Drive {
    let mut random = Random::new(options.seed);
    let campus = Campus::new(&mut random);
    let path = drive(options);
    let ranges = path.iter().map(|T| campus.scan(T, &mut random)).collect();
    let T_first_world = path.first().map_or_else(Pose2::identity, Pose2::inverse);
    let T_world_robot: Vec<Pose2> = path.iter().map(|T| T_first_world * T).collect();
    let odometry = odometry(&T_world_robot, &options.wheels, &mut random);
    Drive { ranges, T_world_robot, odometry }
}

/// Where the robot is from scan to scan; it looks along x.
fn drive(options: &CampusOptions) -> Vec<Pose2> {
    let pose = |along: f64| {
        let [behind, ahead] = [-0.5, 0.5].map(|off| way(along + off));
        let heading = libm::atan2(ahead.y - behind.y, ahead.x - behind.x);
        Pose2::new(way(along), heading)
    };
    let (mut path, mut along) = (vec![pose(0.0)], 0.0);
    while along < options.length {
        let mut step = options.step;
        while (path[path.len() - 1].inverse() * pose(along + step)).rotation_angle() > MAX_TURN {
            step *= 0.7;
        }
        along += step;
        path.push(pose(along));
    }
    path
}

/// The place after a way along the corners, which are rounded and wandered about (m).
fn way(along: f64) -> Vector2<f64> {
    const SAMPLES: i32 = 16;
    let sharp = |along: f64| {
        let mut left = along;
        for pair in WAY.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(Vector2::from);
            let length = (to - from).norm();
            if left < length || pair[1] == WAY[WAY.len() - 1] {
                return from + (to - from) * (left / length);
            }
            left -= length;
        }
        Vector2::zeros()
    };
    let offset = |sample: i32| ROUNDED * (f64::from(sample) / f64::from(SAMPLES - 1) - 0.5);
    let sum: Vector2<f64> = (0..SAMPLES).map(|sample| sharp(along + offset(sample))).sum();
    let wander = Vector2::new(libm::sin(along / 7.0), libm::sin(along / 9.0 + 1.0)) * 0.5;
    sum / f64::from(SAMPLES) + wander
}

struct Campus {
    solid: World,
    leaves: World,
}

impl Campus {
    fn new(random: &mut Random) -> Self {
        let mut campus = Self { solid: World::default(), leaves: World::default() };
        // From corner to corner (m). South of the way there is a lawn with a few trees; the east block is set back from it.
        let buildings = [
            [10.0, 9.0, 48.0, 30.0],
            [12.0, 40.0, 50.0, 71.0],
            [70.0, 38.0, 110.0, 70.0],
            [-5.0, 92.0, 40.0, 110.0],
            [55.0, 95.0, 118.0, 112.0],
            [135.0, 10.0, 150.0, 70.0],
        ];
        for [left, bottom, right, top] in buildings {
            let corners = [[left, bottom], [right, bottom], [right, top], [left, top], [left, bottom]];
            for pair in corners.windows(2) {
                campus.add_facade(pair[0].into(), pair[1].into(), random);
            }
        }
        campus.add_cars([125.5, 8.0], [0.0, 1.0], 22, random);
        campus.add_cars([14.0, 86.0], [1.0, 0.0], 30, random);
        campus.add_hedge([-5.0, 8.0], [-5.0, 72.0]);
        campus.add_hedge([5.0, 35.0], [5.0, 70.0]);
        campus.add_hedge([66.0, 10.0], [66.0, 34.0]);
        campus.add_trees([112.0, 8.0], [0.0, 7.5], 9, random);
        campus.add_trees([54.5, 10.0], [0.0, 9.0], 8, random);
        campus.add_trees([4.0, 74.5], [10.0, 0.0], 11, random);
        campus.add_trees([10.0, -12.0], [24.0, -3.0], 5, random);
        campus
    }

    /// A wall with bays, doors and pillars.
    fn add_facade(&mut self, from: Vector2<f64>, to: Vector2<f64>, random: &mut Random) {
        let along = (to - from).normalize();
        let inwards = Vector2::new(-along.y, along.x);
        let (mut corners, mut at) = (vec![from], random.uniform(1.0, 5.0));
        while at + 6.0 < (to - from).norm() {
            let end = at + random.uniform(0.8, 5.0);
            let depth = inwards * random.uniform(-0.4, 1.2);
            corners.extend([from + along * at, from + along * at + depth, from + along * end + depth]);
            corners.push(from + along * end);
            at = end + random.uniform(0.8, 6.0);
        }
        corners.push(to);
        self.solid.add_walls(&corners);
    }

    /// Cars side by side, with gaps.
    fn add_cars(&mut self, from: [f64; 2], along: [f64; 2], count: usize, random: &mut Random) {
        let (from, along) = (Vector2::from(from), Vector2::from(along));
        for place in 0..count {
            if random.happens(0.7) {
                let off =
                    along * (2.7 * place as f64) + Vector2::new(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3));
                let sides = Vector2::new(random.uniform(1.6, 1.9), random.uniform(3.8, 4.8));
                let turn = libm::atan2(along.y, along.x) + random.uniform(-0.06, 0.06);
                self.solid.add_box(from + off, sides, turn);
            }
        }
    }

    fn add_hedge(&mut self, from: [f64; 2], to: [f64; 2]) {
        self.leaves.add_walls(&[from.into(), to.into()]);
    }

    /// Trunks in a row.
    fn add_trees(&mut self, from: [f64; 2], step: [f64; 2], count: usize, random: &mut Random) {
        for tree in 0..count {
            let off = Vector2::new(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8));
            let center = Vector2::from(from) + Vector2::from(step) * tree as f64 + off;
            self.solid.obstacles.push(Obstacle::Pillar { center, radius: random.uniform(0.12, 0.35) });
        }
    }

    fn scan(&self, T_world_robot: &Pose2, random: &mut Random) -> Vec<f64> {
        let laser = Laser { max_range: 81.91, field_of_view: 179f64.to_radians(), ..Laser::default() };
        let origin = T_world_robot.translation.vector;
        let [solid, leaves] = [&self.solid, &self.leaves].map(|world| world.within(&origin, laser.max_range));
        let person = random.happens(SHARES.1).then(|| {
            let (bearing, range) = (random.uniform(0.2, 2.9), random.uniform(1.5, 9.0));
            let center = T_world_robot.act(&(Vector2::new(libm::sin(bearing), -libm::cos(bearing)) * range));
            Obstacle::Pillar { center, radius: 0.25 }
        });
        let people = World { obstacles: person.into_iter().collect() };
        let beam = |beam: usize| {
            // The scene's lasers look along y, a robot along x.
            let direction = laser.direction(beam);
            let direction = T_world_robot.rotate(&Vector2::new(direction.y, -direction.x));
            let hedge = leaves.cast(&origin, &direction).filter(|_| !random.happens(SHARES.0));
            let hedge = hedge.map(|range| range + LEAVES * random.normal().abs());
            let wall = solid.cast(&origin, &direction).into_iter().chain(people.cast(&origin, &direction)).chain(hedge);
            let ground = ground(&origin, &direction).map(|range| range + 0.1 * random.normal());
            let range = wall.chain(ground).fold(f64::INFINITY, f64::min) + NOISE * random.normal();
            libm::round(100.0 * range.clamp(0.02, laser.max_range)) / 100.0
        };
        (0..laser.num_beams).map(beam).collect()
    }
}

/// Range at which a beam meets the ground; the laser has the ground's tilt.
fn ground(origin: &Vector2<f64>, direction: &Vector2<f64>) -> Option<f64> {
    const STEP: f64 = 0.5;
    let rise = (height(&(origin + direction * 0.25)) - height(&(origin - direction * 0.25))) / 0.5;
    let start = height(origin) + SENSOR_HEIGHT;
    let above = |range: f64| start + rise * range - height(&(origin + direction * range));
    let first = (1..80).map(|step| STEP * f64::from(step)).find(|&range| above(range) <= 0.0)?;
    let (before, after) = (above(first - STEP), above(first));
    Some(first - STEP * after / (after - before))
}

/// Height of the ground (m).
fn height(place: &Vector2<f64>) -> f64 {
    let of = |&(x, y, height, width): &(f64, f64, f64, f64)| {
        let sq_distance = (place - Vector2::new(x, y)).norm_squared() / (width * width);
        if sq_distance < 20.0 { height * libm::exp(-0.5 * sq_distance) } else { 0.0 }
    };
    HILLS.iter().map(of).sum()
}
