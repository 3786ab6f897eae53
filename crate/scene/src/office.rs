//! A ring of corridors around a block of rooms, and a drive around it that closes a loop.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::Vector2;

use super::corridor::STEP;
use super::laser::Laser;
use super::passage::{MAX_OPENING, MAX_PILASTER, MAX_ROOM_MARGIN, MIN_CLEARANCE, Passage, pose_at};
use super::random::Random;
use super::recording::PlanarRecording;
use super::world::World;
use scanstitch::geometry::Pose2;

/// Options of the generator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OfficeOptions {
    /// Each seed gives another building and another drive.
    pub seed: u64,
    /// Scans of the drive. One round takes 90 to 135.
    pub num_scans: usize,
    /// The sensor.
    pub laser: Laser,
}

impl Default for OfficeOptions {
    /// A round and the beginning of the next.
    fn default() -> Self {
        Self { seed: 1, num_scans: 150, laser: Laser::default() }
    }
}

/// Largest turn between two scans (rad): the robot takes shorter steps where it goes round a corner.
pub const MAX_TURN: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// The robot goes round a corner on an arc of this radius (m).
const ARC_RADIUS: f64 = 1.2;
/// The heading differs from the way driven by this much at most (rad).
const WOBBLE: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Generates the building and a drive round it, counter-clockwise, as many rounds as the scans last.
pub fn generate(options: &OfficeOptions) -> PlanarRecording {
    let mut random = Random::new(options.seed);
    let ring = Ring::new(&mut random);
    let mut world = World::default();
    for passage in &ring.passages {
        ring.add_walls(&mut world, passage, &mut random);
    }
    let path = ring.drive(options.num_scans, &mut random);
    for (passage, length) in &ring.passages {
        passage.add_clutter(&mut world, 0.0, *length, &path, &mut random);
    }
    PlanarRecording::new(&world, &path, &options.laser, &mut random)
}

/// Four passages round a block: the middles of the passages form a rectangle, driven along with rounded corners.
struct Ring {
    /// In the order they are driven, each from corner to corner of the rectangle, with its length (m).
    passages: [(Passage, f64); 4],
    half_width: f64,
}

/// Lateral offset of the robot from the middle of its path: two waves, which no round repeats.
struct Wander {
    /// Largest distance from the middle (m).
    amplitude: f64,
    /// Length (m) and phase (rad) of each wave.
    waves: [(f64, f64); 2],
}

impl Ring {
    fn new(random: &mut Random) -> Self {
        let half_width = random.uniform(1.2, 1.8);
        let (a, b) = (random.uniform(16.0, 24.0), random.uniform(22.0, 36.0));
        let passage = |index: usize, x: f64, y: f64, length: f64| {
            (Passage { origin: Vector2::new(x, y), turn: index as f64 * FRAC_PI_2, half_width }, length)
        };
        let passages = [passage(0, a, 0.0, b), passage(1, a, b, a), passage(2, 0.0, b, b), passage(3, 0.0, 0.0, a)];
        Self { passages, half_width }
    }

    /// The walls of one passage: the block's on the left, the outer one, which reaches round the corners, on the right.
    fn add_walls(&self, world: &mut World, (passage, length): &(Passage, f64), random: &mut Random) {
        for (side, reach) in [(-1.0, -self.half_width), (1.0, self.half_width)] {
            let (from, to) = (-reach, length + reach);
            let mut corners = vec![passage.at(side * self.half_width, from)];
            // No room may reach past the end of its wall, into the next passage.
            let mut y = from + MAX_ROOM_MARGIN;
            loop {
                let start = y + random.uniform(0.5, 3.5);
                if start + MAX_OPENING + MAX_ROOM_MARGIN > to {
                    break;
                }
                y = passage.add_opening(&mut corners, side, start, random);
            }
            corners.push(passage.at(side * self.half_width, to));
            world.add_walls(&corners);
        }
    }

    /// Steps of about a metre, shorter ones round the corners.
    fn drive(&self, num_scans: usize, random: &mut Random) -> Vec<Pose2> {
        let wave = |random: &mut Random, low, high| (random.uniform(low, high), random.uniform(0.0, TAU));
        let wander = Wander {
            // Half the radius of the corners, or the way round them would bend back on itself.
            amplitude: (self.half_width - MIN_CLEARANCE - MAX_PILASTER).min(ARC_RADIUS / 2.0),
            waves: [wave(random, 17.0, 29.0), wave(random, 31.0, 47.0)],
        };
        let least_cosine = libm::cos(MAX_TURN - 2.0 * WOBBLE);
        let mut driven = 0.0;
        let mut path = Vec::with_capacity(num_scans);
        for _ in 0..num_scans {
            let (position, heading) = self.way(driven, &wander);
            path.push(pose_at(position, heading + random.uniform(-WOBBLE, WOBBLE)));
            let mut step = random.uniform(STEP.0, STEP.1);
            while libm::cos(self.way(driven + step, &wander).1 - heading) < least_cosine {
                step *= 0.7;
            }
            driven += step;
        }
        path
    }

    /// Position (m) and heading (rad, from y) after this way along the middle (m).
    fn way(&self, driven: f64, wander: &Wander) -> (Vector2<f64>, f64) {
        let (middle, heading, curvature) = self.middle(driven);
        let (off, slope) = wander.at(driven);
        let left = Vector2::new(-libm::cos(heading), -libm::sin(heading));
        (middle + left * off, heading + libm::atan2(slope, 1.0 - curvature * off))
    }

    /// Position (m), heading (rad, from y) and curvature (1/m) of the middle of the way.
    fn middle(&self, driven: f64) -> (Vector2<f64>, f64, f64) {
        let arc = ARC_RADIUS * FRAC_PI_2;
        let straight = |length: f64| length - 2.0 * ARC_RADIUS;
        let round: f64 = self.passages.iter().map(|(_, length)| straight(*length) + arc).sum();
        let mut left = driven % round;
        for (passage, length) in &self.passages {
            if left < straight(*length) {
                return (passage.at(0.0, ARC_RADIUS + left), passage.turn, 0.0);
            }
            left -= straight(*length);
            if left < arc {
                let angle = left / ARC_RADIUS;
                let across = ARC_RADIUS * (libm::cos(angle) - 1.0);
                let along = length - ARC_RADIUS + ARC_RADIUS * libm::sin(angle);
                return (passage.at(across, along), passage.turn + angle, 1.0 / ARC_RADIUS);
            }
            left -= arc;
        }
        // A rounding error short of the full round: where it begins.
        let (first, _) = &self.passages[0];
        (first.at(0.0, ARC_RADIUS), first.turn, 0.0)
    }
}

impl Wander {
    /// Distance to the left of the middle (m), and its change per metre driven.
    fn at(&self, driven: f64) -> (f64, f64) {
        let half = self.amplitude / 2.0;
        self.waves.iter().fold((0.0, 0.0), |(off, slope), (length, phase)| {
            let angle = TAU * driven / length + phase;
            (off + half * libm::sin(angle), slope + half * libm::cos(angle) * TAU / length)
        })
    }
}
