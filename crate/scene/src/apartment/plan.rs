//! The floor plan: rooms on both sides of an L-shaped corridor, and the openings in their walls.

use nalgebra::Vector2;

use super::super::random::Random;

/// What a room is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RoomKind {
    /// Sofa, shelves, dining table.
    Living,
    /// Counter, table.
    Kitchen,
    /// Double bed, wardrobe.
    Bedroom,
    /// Tub, basin.
    Bath,
    /// Desk, shelves.
    Study,
    /// Bed, desk, toys.
    Child,
    /// The arm of the corridor that all rooms open to.
    Corridor,
    /// The arm with the entrance.
    Hall,
}

/// A rectangle of the plan (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// Least x and y.
    pub low: Vector2<f64>,
    /// Largest x and y.
    pub high: Vector2<f64>,
}

/// A room: the rectangle up to the middle of its walls, or up to their inner face where they are outer walls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Room {
    /// What it is for.
    pub kind: RoomKind,
    /// Where it is.
    pub cell: Rectangle,
}

/// What an opening is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OpeningKind {
    /// With a leaf.
    Door,
    /// The door to the staircase; it is shut.
    Entrance,
    /// Without a leaf.
    Passage,
    /// No wall at all.
    Open,
    /// With a sill.
    Window,
    /// A window down to the floor.
    FrenchWindow,
}

/// A side of a rectangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Least x.
    Left,
    /// Largest x.
    Right,
    /// Least y.
    Bottom,
    /// Largest y.
    Top,
}

/// An opening in a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opening {
    /// What it is.
    pub kind: OpeningKind,
    /// The axis along which the wall runs: 0 for x, 1 for y.
    pub along: usize,
    /// Where the middle of the wall lies on the other axis (m).
    pub wall: f64,
    /// Where it begins and ends along the wall (m).
    pub span: [f64; 2],
}

/// Rooms and openings. Lengths in metres.
#[derive(Debug, Clone, PartialEq)]
pub struct FloorPlan {
    /// All rooms; the corridor's two arms come last.
    pub rooms: Vec<Room>,
    /// All openings.
    pub openings: Vec<Opening>,
    /// The flat reaches from (0, 0) to here.
    pub size: Vector2<f64>,
    /// Height of the rooms.
    pub height: f64,
}

/// From a wall's middle to its face (m).
pub const HALF_WALL: f64 = 0.06;
/// Thickness of outer walls (m).
pub const OUTER_WALL: f64 = 0.24;
/// Doors are so high (m).
pub const DOOR_HEIGHT: f64 = 2.05;
/// Windows begin and end so high (m).
pub const WINDOW: [f64; 2] = [0.88, 2.2];

impl Side {
    /// All four.
    pub const ALL: [Self; 4] = [Self::Left, Self::Right, Self::Bottom, Self::Top];

    /// The axis along which a wall on this side runs.
    pub fn along(self) -> usize {
        usize::from(matches!(self, Self::Left | Self::Right))
    }

    /// -1 where it is the lower end of its axis, otherwise 1.
    pub fn sign(self) -> f64 {
        if matches!(self, Self::Left | Self::Bottom) { -1.0 } else { 1.0 }
    }
}

impl Rectangle {
    /// From corner to corner, in any order.
    pub fn new(a: Vector2<f64>, b: Vector2<f64>) -> Self {
        Self { low: a.inf(&b), high: a.sup(&b) }
    }

    /// Its middle.
    pub fn center(&self) -> Vector2<f64> {
        (self.low + self.high) / 2.0
    }

    /// Its sides.
    pub fn size(&self) -> Vector2<f64> {
        self.high - self.low
    }

    /// With so much more on all sides.
    #[must_use]
    pub fn grown(&self, margin: f64) -> Self {
        Self { low: self.low.add_scalar(-margin), high: self.high.add_scalar(margin) }
    }

    /// Whether both have an inner point in common.
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..2).all(|axis| self.low[axis] < other.high[axis] && other.low[axis] < self.high[axis])
    }

    /// Whether the other lies within.
    pub fn contains(&self, other: &Self) -> bool {
        (0..2).all(|axis| self.low[axis] <= other.low[axis] && other.high[axis] <= self.high[axis])
    }

    /// Distance from a point, 0 within.
    pub fn distance(&self, point: &Vector2<f64>) -> f64 {
        self.way_from(point).norm()
    }

    /// From a point outside to the nearest point.
    pub fn way_from(&self, point: &Vector2<f64>) -> Vector2<f64> {
        point.sup(&self.low).inf(&self.high) - point
    }

    /// Where a side lies on the axis across it.
    pub fn side(&self, side: Side) -> f64 {
        let axis = 1 - side.along();
        if side.sign() < 0.0 { self.low[axis] } else { self.high[axis] }
    }
}

impl Room {
    /// What is free of walls.
    pub fn inner(&self) -> Rectangle {
        self.cell.grown(-HALF_WALL)
    }
}

impl Opening {
    /// The lower and the upper edge (m) in rooms of this height.
    pub fn heights(&self, room: f64) -> [f64; 2] {
        match self.kind {
            OpeningKind::Door | OpeningKind::Entrance => [0.0, DOOR_HEIGHT],
            OpeningKind::Passage => [0.0, DOOR_HEIGHT + 0.15],
            OpeningKind::Open => [0.0, room],
            OpeningKind::Window => WINDOW,
            OpeningKind::FrenchWindow => [0.06, WINDOW[1]],
        }
    }

    /// Whether one can walk through.
    pub fn is_way(&self) -> bool {
        matches!(self.kind, OpeningKind::Door | OpeningKind::Passage | OpeningKind::Open)
    }

    /// Its middle, in the middle of the wall.
    pub fn center(&self) -> Vector2<f64> {
        self.at(f64::midpoint(self.span[0], self.span[1]), 0.0)
    }

    /// A place of the plan: so far along the wall, and so far from its middle.
    pub fn at(&self, along: f64, off: f64) -> Vector2<f64> {
        let across = self.wall + off;
        if self.along == 0 { Vector2::new(along, across) } else { Vector2::new(across, along) }
    }

    /// The strip of floor in front of it on both sides, so deep.
    pub fn approach(&self, depth: f64) -> Rectangle {
        Rectangle::new(self.at(self.span[0], -depth), self.at(self.span[1], depth))
    }

    /// Whether it is in this side of the room.
    pub fn is_in(&self, room: &Room, side: Side) -> bool {
        let across = side.along();
        self.along == across
            && (self.wall - room.cell.side(side)).abs() < 1e-9
            && self.span[1] > room.cell.low[across]
            && self.span[0] < room.cell.high[across]
    }
}

/// Where the parts of the plan end (m); before it is mirrored, the corridor runs along x over the lower rooms, and the
/// hall down from its right end.
struct Measures {
    width: f64,
    lower: f64,
    corridor: f64,
    upper: f64,
    hall: f64,
}

impl FloorPlan {
    /// A plan of four to six rooms and an L-shaped corridor.
    pub fn generate(random: &mut Random) -> Self {
        let third_upper = random.happens(0.5);
        let third_lower = random.happens(0.5);
        let living = random.uniform(4.3, 5.2);
        let kitchen = random.uniform(3.3, 3.8);
        let extra = if third_upper { random.uniform(2.6, 3.2) } else { 0.0 };
        let measures = Measures {
            width: living + kitchen + extra,
            lower: random.uniform(2.9, 3.5),
            corridor: random.uniform(1.45, 1.7),
            upper: random.uniform(4.0, 4.7),
            hall: random.uniform(1.5, 1.8),
        };
        let mut plan = Self {
            rooms: Vec::new(),
            openings: Vec::new(),
            size: Vector2::new(measures.width, measures.lower + measures.corridor + measures.upper),
            height: random.uniform(2.55, 2.75),
        };
        plan.add_upper(&measures, [living, kitchen], third_upper, random);
        plan.add_lower(&measures, third_lower, random);
        plan.add_corridor(&measures);
        let mirrored = [random.happens(0.5), random.happens(0.5)];
        plan.mirror(mirrored);
        plan
    }

    fn add_room(&mut self, kind: RoomKind, low: [f64; 2], high: [f64; 2]) {
        self.rooms.push(Room { kind, cell: Rectangle { low: low.into(), high: high.into() } });
    }

    fn add_opening(&mut self, kind: OpeningKind, along: usize, wall: f64, from: f64, width: f64) {
        self.openings.push(Opening { kind, along, wall, span: [from, from + width] });
    }

    /// Living room, kitchen, and on some plans one more, all with windows on top.
    fn add_upper(&mut self, m: &Measures, [living, kitchen]: [f64; 2], third: bool, random: &mut Random) {
        let (low, top) = (m.lower + m.corridor, self.size.y);
        let wall = living + kitchen;
        self.add_room(RoomKind::Living, [0.0, low], [living, top]);
        self.add_room(RoomKind::Kitchen, [living, low], [wall, top]);
        // Two ways between living room and kitchen, with a pier between them.
        let pier = random.uniform(0.65, 0.9);
        let middle = low + random.uniform(1.75, 2.0);
        self.add_opening(OpeningKind::Passage, 1, living, middle - pier / 2.0 - 1.1, 1.1);
        self.add_opening(OpeningKind::Passage, 1, living, middle + pier / 2.0, 1.1);
        let passage = random.uniform(1.2, 1.5);
        self.add_opening(OpeningKind::Passage, 0, low, random.uniform(0.9, living - passage - 0.9), passage);
        self.add_opening(OpeningKind::Door, 0, low, living + random.uniform(1.4, kitchen - 1.1), 0.85);
        let french = random.uniform(1.5, 1.9);
        self.add_opening(OpeningKind::FrenchWindow, 0, top, random.uniform(0.5, 0.8), french);
        self.add_opening(OpeningKind::Window, 0, top, living - 1.9, 1.3);
        self.add_opening(OpeningKind::Window, 0, top, living + random.uniform(1.0, kitchen - 1.7), 1.2);
        self.add_opening(OpeningKind::Window, 1, 0.0, low + random.uniform(1.4, 2.0), 1.4);
        if third {
            let kind = if random.happens(0.5) { RoomKind::Child } else { RoomKind::Study };
            self.add_room(kind, [wall, low], [m.width, top]);
            self.add_opening(OpeningKind::Door, 0, low, wall + random.uniform(0.5, 0.9), 0.85);
            self.add_opening(OpeningKind::Window, 0, top, wall + 0.7, 1.3);
        }
    }

    /// Bedroom, bath, and on some plans one more, all with windows at the bottom.
    fn add_lower(&mut self, m: &Measures, third: bool, random: &mut Random) {
        let end = m.width - m.hall;
        let bedroom = (end - 1.9 - if third { 2.5 } else { 0.0 }).min(random.uniform(3.3, 4.0));
        let third = third && end - bedroom > 4.4;
        let bath = if third { random.uniform(1.9, 2.2) } else { end - bedroom };
        self.add_room(RoomKind::Bedroom, [0.0, 0.0], [bedroom, m.lower]);
        self.add_opening(OpeningKind::Door, 0, m.lower, bedroom - random.uniform(1.0, 1.4), 0.85);
        self.add_opening(OpeningKind::Window, 0, 0.0, random.uniform(0.8, bedroom - 2.1), 1.4);
        self.add_room(RoomKind::Bath, [bedroom, 0.0], [bedroom + bath, m.lower]);
        self.add_opening(OpeningKind::Door, 0, m.lower, bedroom + 0.27, 0.85);
        self.add_opening(OpeningKind::Window, 0, 0.0, bedroom + bath - 1.1, 0.7);
        if third {
            let kind = if random.happens(0.5) { RoomKind::Study } else { RoomKind::Child };
            self.add_room(kind, [bedroom + bath, 0.0], [end, m.lower]);
            self.add_opening(OpeningKind::Door, 0, m.lower, bedroom + bath + random.uniform(0.3, 0.6), 0.85);
            self.add_opening(OpeningKind::Window, 0, 0.0, end - 1.9, 1.3);
        }
    }

    fn add_corridor(&mut self, m: &Measures) {
        let start = m.width - m.hall;
        self.add_room(RoomKind::Corridor, [0.0, m.lower], [m.width, m.lower + m.corridor]);
        self.add_room(RoomKind::Hall, [start, 0.0], [m.width, m.lower]);
        let width = m.hall - 2.0 * HALF_WALL;
        self.add_opening(OpeningKind::Open, 0, m.lower, start + HALF_WALL, width);
        self.add_opening(OpeningKind::Entrance, 0, 0.0, start + (m.hall - 0.95) / 2.0, 0.95);
        self.add_opening(OpeningKind::Window, 1, 0.0, m.lower + m.corridor / 2.0 - 0.4, 0.8);
    }

    fn mirror(&mut self, axes: [bool; 2]) {
        for axis in (0..2).filter(|&axis| axes[axis]) {
            let size = self.size[axis];
            for room in &mut self.rooms {
                let (low, high) = (room.cell.low[axis], room.cell.high[axis]);
                (room.cell.low[axis], room.cell.high[axis]) = (size - high, size - low);
            }
            for opening in &mut self.openings {
                if opening.along == axis {
                    opening.span = [size - opening.span[1], size - opening.span[0]];
                } else {
                    opening.wall = size - opening.wall;
                }
            }
        }
    }

    /// Area of all rooms (m^2).
    pub fn area(&self) -> f64 {
        self.rooms.iter().map(|room| room.inner().size().product()).sum()
    }

    /// The room of this kind.
    pub fn room(&self, kind: RoomKind) -> Option<&Room> {
        self.rooms.iter().find(|room| room.kind == kind)
    }

    /// The rooms that an opening is in: one or two.
    pub fn rooms_at<'a>(&'a self, opening: &'a Opening) -> impl Iterator<Item = (usize, Side)> + 'a {
        let sides = self.rooms.iter().enumerate().flat_map(|(room, _)| Side::ALL.map(|side| (room, side)));
        sides.filter(|&(room, side)| opening.is_in(&self.rooms[room], side))
    }

    /// Whether a wall of the room is an outer wall.
    pub fn is_outer(&self, room: &Room, side: Side) -> bool {
        let at = room.cell.side(side);
        let axis = 1 - side.along();
        at.abs() < 1e-9 || (at - self.size[axis]).abs() < 1e-9
    }
}
