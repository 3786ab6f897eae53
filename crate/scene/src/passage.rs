//! A straight passage between two walls, with landmarks: doors, rooms, niches, furniture.

use nalgebra::{UnitComplex, Vector2};

use super::random::Random;
use super::world::{Obstacle, World};
use scanstitch::geometry::Pose2;

/// The robot keeps this far from everything (m).
pub const MIN_CLEARANCE: f64 = 0.35;
/// A pilaster stands out from its wall by this much at most (m).
pub const MAX_PILASTER: f64 = 0.25;
/// A door or niche is this wide at most (m).
pub const MAX_OPENING: f64 = 1.3;
/// What lies behind a wall reaches past its opening by this much at most (m).
pub const MAX_ROOM_MARGIN: f64 = 2.0;

/// A strip of floor. In its own frame x runs across it and y along it.
#[derive(Debug, Clone, Copy)]
pub struct Passage {
    /// Where the middle of the strip begins (m).
    pub origin: Vector2<f64>,
    /// Turn of its x axis from that of the building (rad).
    pub turn: f64,
    /// Half its width (m).
    pub half_width: f64,
}

impl Passage {
    /// A place of the passage, in the building's frame.
    pub fn at(&self, across: f64, along: f64) -> Vector2<f64> {
        let (sin, cos) = (libm::sin(self.turn), libm::cos(self.turn));
        self.origin + Vector2::new(cos * across - sin * along, sin * across + cos * along)
    }

    /// Adds the corners of one opening of the wall on this side (-1 left, 1 right), and gives where it ends.
    pub fn add_opening(&self, corners: &mut Vec<Vector2<f64>>, side: f64, start: f64, random: &mut Random) -> f64 {
        let at = |depth: f64, y: f64| self.at(side * (self.half_width + depth), y);
        let end = start + random.uniform(0.7, MAX_OPENING);
        let kind = random.uniform(0.0, 1.0);
        corners.push(at(0.0, start));
        if kind < 0.2 {
            // An open door into a room: the far wall of the room is seen through it.
            let margin = |random: &mut Random| random.uniform(0.3, MAX_ROOM_MARGIN);
            let (depth, before, after) = (random.uniform(2.0, 5.0), margin(random), margin(random));
            let jamb = 0.12;
            corners.extend([at(jamb, start), at(jamb, start - before), at(depth, start - before)]);
            corners.extend([at(depth, end + after), at(jamb, end + after), at(jamb, end)]);
        } else {
            // A closed door set back in its frame, a niche, or a pilaster that stands out.
            let depth = if kind < 0.6 {
                0.12
            } else if kind < 0.8 {
                random.uniform(0.25, 0.6)
            } else {
                -random.uniform(0.1, MAX_PILASTER)
            };
            corners.extend([at(depth, start), at(depth, end)]);
        }
        corners.push(at(0.0, end));
        end
    }

    /// Adds cupboards along the walls, boxes and pillars from one place along the passage to another, wherever they
    /// leave the robot its way.
    pub fn add_clutter(&self, world: &mut World, from: f64, to: f64, path: &[Pose2], random: &mut Random) {
        let attempts = (to - from).max(0.0) as usize * 2;
        for _ in 0..attempts {
            let mut piece = World::default();
            let side = if random.happens(0.5) { 1.0 } else { -1.0 };
            let y = random.uniform(from + 0.5, to - 0.5);
            let kind = random.uniform(0.0, 1.0);
            if kind < 0.5 {
                let sides = Vector2::new(random.uniform(0.25, 0.6), random.uniform(0.5, 1.6));
                piece.add_box(self.at(side * (self.half_width - sides.x / 2.0), y), sides, self.turn);
            } else if kind < 0.8 {
                let sides = Vector2::new(random.uniform(0.2, 0.7), random.uniform(0.2, 0.7));
                let center = self.at(side * random.uniform(0.3, 0.95) * self.half_width, y);
                piece.add_box(center, sides, random.uniform(0.0, std::f64::consts::PI));
            } else {
                let center = self.at(side * random.uniform(0.3, 0.95) * self.half_width, y);
                piece.obstacles.push(Obstacle::Pillar { center, radius: random.uniform(0.06, 0.25) });
            }
            if random.happens(0.45) && leaves_the_way(&piece, path) {
                world.obstacles.append(&mut piece.obstacles);
            }
        }
    }
}

/// Pose of a robot that heads this far to the left of y (rad).
pub fn pose_at(position: Vector2<f64>, heading: f64) -> Pose2 {
    Pose2::from_parts(position.into(), UnitComplex::from_cos_sin_unchecked(libm::cos(heading), libm::sin(heading)))
}

/// Whether the robot keeps its clearance all along its path.
fn leaves_the_way(piece: &World, path: &[Pose2]) -> bool {
    let required = MIN_CLEARANCE + 0.05;
    path.windows(2).all(|pair| {
        let (from, to) = (pair[0].translation.vector, pair[1].translation.vector);
        // Nothing on the step is nearer than its start by more than its length: most steps are done with that.
        piece.clearance(&from) > required + (to - from).norm()
            || (0..=10).all(|i| piece.clearance(&from.lerp(&to, f64::from(i) / 10.0)) > required)
    })
}
