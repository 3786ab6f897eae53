//! Places the furniture: at a wall or in the middle of a room, clear of other pieces, doors and windows, and
//! such that every door can be reached from every other.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Vector2, Vector3};

use super::builder::{Builder, Piece, Place};
use super::furniture::{bath, beds, decoration, kitchen, seats, storage, tables};
use super::plan::{FloorPlan, Opening, OpeningKind, Rectangle, Room, RoomKind, Side};
use super::shell::swept_by_leaf;
use super::ways::{Ways, obstacles};

/// A kind of furniture.
#[derive(Clone, Copy)]
struct Item {
    /// Width and depth (m).
    size: [f64; 2],
    /// Whether it hides pictures on the wall behind it.
    tall: bool,
    build: fn(&mut Piece, [f64; 2]),
}

/// Radius of the disc that must fit wherever the camera walks (m).
const WALKER: f64 = 0.3;
/// Squares of the floor (m).
const SQUARE: f64 = 0.08;
/// Gap between a piece and its wall (m).
const GAP: f64 = 0.03;
/// Depth of the floor that is kept free in front of a door (m) ...
const APPROACH: f64 = 0.75;
/// ... and in front of a window, for radiators and curtains.
const WINDOW_APPROACH: f64 = 0.24;
/// Gap between a low piece under a window and the wall, for the radiator (m).
const WINDOW_GAP: f64 = WINDOW_APPROACH + 0.1;
/// Places that are tried for a piece.
const TRIES: usize = 60;

struct FurniturePlacer<'a> {
    plan: &'a FloorPlan,
    builder: &'a mut Builder,
    /// What stands on the floor.
    taken: Vec<Rectangle>,
    /// Doors, and windows.
    kept_free: Vec<Rectangle>,
    windows: Vec<Rectangle>,
    /// What stands or hangs high at a wall.
    hidden: Vec<Rectangle>,
    ways: Ways,
}

/// Furnishes all rooms.
pub fn place_furniture(plan: &FloorPlan, builder: &mut Builder) {
    let mut ways = Ways::new(plan.size, SQUARE);
    for wall in obstacles(&builder.solids) {
        ways.block(&wall, WALKER);
    }
    let is_window = |kind: OpeningKind| matches!(kind, OpeningKind::Window | OpeningKind::FrenchWindow);
    let doors = plan.openings.iter().filter(|opening| !is_window(opening.kind) && opening.kind != OpeningKind::Open);
    let windows = plan.openings.iter().filter(|opening| is_window(opening.kind));
    let leaves = plan.openings.iter().filter_map(|opening| swept_by_leaf(plan, opening));
    let approach = |opening: &Opening| opening.approach(APPROACH).grown(0.05);
    let mut placer = FurniturePlacer {
        plan,
        builder,
        taken: Vec::new(),
        kept_free: doors.map(approach).chain(leaves).collect(),
        windows: windows.map(|opening| opening.approach(WINDOW_APPROACH + 0.06)).collect(),
        hidden: Vec::new(),
        ways,
    };
    for room in &plan.rooms {
        placer.place_furniture(room);
    }
}

impl FurniturePlacer<'_> {
    fn place_furniture(&mut self, room: &Room) {
        let mut pendant = None;
        match room.kind {
            RoomKind::Living => pendant = self.living(room),
            RoomKind::Kitchen => pendant = self.kitchen(room),
            RoomKind::Bedroom => self.bedroom(room),
            RoomKind::Bath => self.bath(room),
            RoomKind::Study => self.study(room),
            RoomKind::Child => self.child(room),
            RoomKind::Corridor => self.corridor(room),
            RoomKind::Hall => self.hall(room),
        }
        let pictures = match room.kind {
            RoomKind::Living | RoomKind::Corridor => 5,
            RoomKind::Bath => 0,
            RoomKind::Hall => 2,
            _ => 3,
        };
        for _ in 0..pictures {
            let size = [self.builder.random.uniform(0.35, 0.95), self.builder.random.uniform(0.35, 0.75)];
            self.hang(room, size, decoration::picture);
        }
        self.light(room, pendant);
    }

    fn living(&mut self, room: &Room) -> Option<Vector2<f64>> {
        let sofa = self.builder.random.uniform(1.7, 2.1);
        let group: fn(&mut Piece, [f64; 2]) = sofa_with_table;
        if self.at_wall(room, Item { size: [sofa, 1.95], tall: false, build: group }).is_none() {
            self.at_wall(room, Item { size: [sofa, 0.92], tall: false, build: seats::sofa });
        }
        self.at_wall(room, Item { size: [1.5, 0.42], tall: true, build: storage::sideboard });
        self.at_wall(room, Item { size: [1.0, 0.32], tall: true, build: storage::bookshelf });
        let length = self.builder.random.uniform(1.3, 1.7);
        let dining = Item { size: [length + 0.9, 1.9], tall: false, build: tables::dining_table };
        let table = self.in_the_middle(room, dining);
        self.in_a_corner(room, Item { size: [0.45, 0.45], tall: true, build: decoration::floor_lamp });
        self.in_a_corner(room, Item { size: [0.82, 0.85], tall: false, build: seats::armchair });
        self.in_a_corner(room, Item { size: [0.55, 0.55], tall: false, build: decoration::potted_plant });
        self.at_wall(room, Item { size: [0.8, 0.3], tall: true, build: storage::bookshelf });
        table.map(|footprint| footprint.center())
    }

    fn kitchen(&mut self, room: &Room) -> Option<Vector2<f64>> {
        let longest = room.inner().size().max();
        for width in [3.3, 2.9, 2.5, 2.1, 1.75] {
            let item = Item { size: [width, 0.64], tall: true, build: kitchen::counter };
            if width < longest && self.at_wall(room, item).is_some() {
                break;
            }
        }
        let small = Item { size: [1.75, 1.75], tall: false, build: tables::dining_table };
        let table = self.in_the_middle(room, small);
        self.in_a_corner(room, Item { size: [0.5, 0.5], tall: false, build: decoration::potted_plant });
        self.in_a_corner(room, Item { size: [0.36, 0.36], tall: false, build: seats::stool });
        table.map(|footprint| footprint.center())
    }

    fn bedroom(&mut self, room: &Room) {
        let group: fn(&mut Piece, [f64; 2]) = bed_with_nightstands;
        let wide = Item { size: [2.6, 2.1], tall: false, build: group };
        let placed = self.at_wall(room, wide);
        if placed.is_none() {
            self.at_wall(room, Item { size: [1.4, 2.05], tall: false, build: beds::bed });
        }
        for width in [1.9, 1.5, 1.1] {
            let item = Item { size: [width, 0.62], tall: true, build: storage::wardrobe };
            if self.at_wall(room, item).is_some() {
                break;
            }
        }
        self.at_wall(room, Item { size: [1.1, 0.42], tall: false, build: tables::console });
        self.in_a_corner(room, Item { size: [0.5, 0.5], tall: false, build: decoration::potted_plant });
        self.hang(room, [0.5, 1.2], decoration::mirror);
    }

    fn bath(&mut self, room: &Room) {
        self.at_wall(room, Item { size: [1.65, 0.74], tall: false, build: bath::tub });
        self.at_wall(room, Item { size: [0.72, 0.46], tall: true, build: bath::basin });
        self.at_wall(room, Item { size: [0.4, 0.7], tall: true, build: bath::toilet });
        self.in_a_corner(room, Item { size: [0.42, 0.42], tall: false, build: decoration::basket });
        self.lay_rug(room, [0.9, 0.6]);
    }

    fn study(&mut self, room: &Room) {
        self.at_wall(room, Item { size: [1.5, 1.2], tall: true, build: tables::desk });
        self.at_wall(room, Item { size: [1.1, 0.32], tall: true, build: storage::bookshelf });
        self.at_wall(room, Item { size: [0.9, 0.32], tall: true, build: storage::bookshelf });
        self.in_a_corner(room, Item { size: [0.8, 0.85], tall: false, build: seats::armchair });
        self.in_a_corner(room, Item { size: [0.45, 0.45], tall: true, build: decoration::floor_lamp });
        self.in_a_corner(room, Item { size: [0.5, 0.5], tall: false, build: decoration::potted_plant });
        self.lay_rug(room, [1.7, 1.2]);
    }

    fn child(&mut self, room: &Room) {
        self.at_wall(room, Item { size: [0.98, 2.0], tall: false, build: beds::bed });
        self.at_wall(room, Item { size: [1.2, 1.15], tall: true, build: tables::desk });
        self.at_wall(room, Item { size: [1.0, 0.58], tall: true, build: storage::wardrobe });
        self.at_wall(room, Item { size: [0.8, 0.3], tall: true, build: storage::bookshelf });
        self.in_a_corner(room, Item { size: [0.45, 0.45], tall: false, build: decoration::basket });
        self.at_wall(room, Item { size: [0.7, 0.45], tall: false, build: decoration::toys });
        self.lay_rug(room, [1.5, 1.2]);
    }

    fn corridor(&mut self, room: &Room) {
        self.at_wall(room, Item { size: [0.9, 0.3], tall: true, build: tables::console });
        self.at_wall(room, Item { size: [0.8, 0.28], tall: true, build: storage::bookshelf });
        self.in_a_corner(room, Item { size: [0.42, 0.42], tall: false, build: decoration::potted_plant });
        self.lay_rug(room, [2.6, 0.75]);
        self.hang(room, [0.5, 0.9], decoration::mirror);
    }

    fn hall(&mut self, room: &Room) {
        self.at_wall(room, Item { size: [1.2, 0.3], tall: true, build: storage::coat_rack });
        self.in_a_corner(room, Item { size: [0.4, 0.4], tall: false, build: decoration::potted_plant });
        self.hang(room, [0.45, 1.1], decoration::mirror);
    }

    /// Puts a piece with its back to a wall, at the first free place of some random ones.
    fn at_wall(&mut self, room: &Room, item: Item) -> Option<Rectangle> {
        for _ in 0..TRIES {
            let side = self.builder.choose(&Side::ALL);
            let (width, inner) = (item.size[0], room.inner());
            let (low, high) = (inner.low[side.along()] + 0.04, inner.high[side.along()] - 0.04 - width);
            if high < low {
                continue;
            }
            // Furniture mostly stands in corners and in the middle of a wall.
            let share = self.builder.random.uniform(-0.3, 1.3).clamp(0.0, 1.0);
            let placed = self.at(&inner, side, low + (high - low) * share, item);
            if placed.is_some() {
                return placed;
            }
        }
        None
    }

    fn in_a_corner(&mut self, room: &Room, item: Item) -> Option<Rectangle> {
        for _ in 0..TRIES / 3 {
            let side = self.builder.choose(&Side::ALL);
            let (width, inner) = (item.size[0], room.inner());
            let (low, high) = (inner.low[side.along()] + 0.04, inner.high[side.along()] - 0.04 - width);
            let along = if self.builder.random.happens(0.5) { low } else { high };
            let placed = self.at(&inner, side, along, item);
            if placed.is_some() {
                return placed;
            }
        }
        None
    }

    /// Puts a piece at a wall if it fits there; `along` is where its lower end comes to lie.
    fn at(&mut self, inner: &Rectangle, side: Side, along: f64, item: Item) -> Option<Rectangle> {
        let [width, depth] = item.size;
        let gap = if self.stands_before_window(inner, side, along, item) { WINDOW_GAP } else { GAP };
        let (back, inwards) = (inner.side(side) - side.sign() * gap, -side.sign());
        let corner = |along: f64, deep: f64| {
            let across = back + inwards * deep;
            if side.along() == 0 { Vector2::new(along, across) } else { Vector2::new(across, along) }
        };
        let footprint = Rectangle::new(corner(along, 0.0), corner(along + width, depth));
        let turn = match side {
            Side::Bottom => 0.0,
            Side::Top => PI,
            Side::Left => -FRAC_PI_2,
            Side::Right => FRAC_PI_2,
        };
        let place = Place::on_floor(corner(along + width / 2.0, 0.0), turn);
        self.put(inner, place, footprint, item)
    }

    /// Whether a low piece would come to stand under a window.
    fn stands_before_window(&self, inner: &Rectangle, side: Side, along: f64, item: Item) -> bool {
        let at = |along: f64| {
            let across = inner.side(side);
            if side.along() == 0 { Vector2::new(along, across) } else { Vector2::new(across, along) }
        };
        let back = Rectangle::new(at(along), at(along + item.size[0])).grown(0.05);
        let low = |opening: &&Opening| opening.kind == OpeningKind::Window;
        !item.tall && self.plan.openings.iter().filter(low).any(|window| window.approach(0.2).overlaps(&back))
    }

    fn in_the_middle(&mut self, room: &Room, item: Item) -> Option<Rectangle> {
        let inner = room.inner();
        for _ in 0..TRIES {
            let crosswise = self.builder.random.happens(0.5);
            let [width, depth] = item.size;
            let size = if crosswise { Vector2::new(depth, width) } else { Vector2::new(width, depth) };
            let room_left = inner.size() - size;
            if room_left.min() < 0.0 {
                continue;
            }
            let share = Vector2::from_fn(|_, _| self.builder.random.uniform(0.0, 1.0));
            let low = inner.low + room_left.component_mul(&share);
            let footprint = Rectangle { low, high: low + size };
            let middle = footprint.center();
            let place = if crosswise {
                Place::on_floor(middle + Vector2::new(depth / 2.0, 0.0), FRAC_PI_2)
            } else {
                Place::on_floor(middle - Vector2::new(0.0, depth / 2.0), 0.0)
            };
            let placed = self.put(&inner, place, footprint, item);
            if placed.is_some() {
                return placed;
            }
        }
        None
    }

    /// Builds a piece if its place is free and one can still walk everywhere.
    fn put(&mut self, inner: &Rectangle, place: Place, footprint: Rectangle, item: Item) -> Option<Rectangle> {
        let others = self.taken.iter().chain(&self.kept_free).chain(&self.windows);
        if !inner.contains(&footprint) || others.into_iter().any(|other| other.overlaps(&footprint)) {
            return None;
        }
        let mut ways = self.ways.clone();
        ways.block(&footprint, WALKER);
        if !all_doors_meet(self.plan, &ways) {
            return None;
        }
        self.ways = ways;
        self.taken.push(footprint.grown(0.03));
        if item.tall {
            self.hidden.push(footprint);
        }
        (item.build)(&mut self.builder.piece(&place), item.size);
        Some(footprint)
    }

    /// Hangs something on a wall where nothing is in front of it.
    fn hang(&mut self, room: &Room, size: [f64; 2], build: fn(&mut Piece, [f64; 2], f64)) {
        let inner = room.inner();
        for _ in 0..TRIES / 2 {
            let side = self.builder.choose(&Side::ALL);
            let (low, high) = (inner.low[side.along()] + 0.2, inner.high[side.along()] - 0.2 - size[0]);
            if high < low {
                continue;
            }
            let along = self.builder.random.uniform(low, high);
            let at = |along: f64, off: f64| {
                let across = inner.side(side) - side.sign() * off;
                if side.along() == 0 { Vector2::new(along, across) } else { Vector2::new(across, along) }
            };
            let front = Rectangle::new(at(along, -0.2), at(along + size[0], 0.25)).grown(0.06);
            let openings = self.plan.openings.iter().map(|opening| opening.approach(0.3));
            let others = self.hidden.iter().copied().chain(openings);
            if others.into_iter().any(|other| other.overlaps(&front)) {
                continue;
            }
            self.hidden.push(front);
            let turn = match side {
                Side::Bottom => 0.0,
                Side::Top => PI,
                Side::Left => -FRAC_PI_2,
                Side::Right => FRAC_PI_2,
            };
            let place = Place::on_floor(at(along + size[0] / 2.0, 0.0), turn);
            let z = self.builder.random.uniform(1.45, 1.6);
            build(&mut self.builder.piece(&place), size, z);
            return;
        }
    }

    /// Lays a rug where no furniture stands on its middle.
    fn lay_rug(&mut self, room: &Room, [width, depth]: [f64; 2]) {
        let inner = room.inner().grown(-0.12);
        let lengthwise = inner.size().x > inner.size().y;
        let size = if lengthwise { Vector2::new(width, depth) } else { Vector2::new(depth, width) };
        let room_left = inner.size() - size;
        if room_left.min() < 0.0 {
            return;
        }
        for _ in 0..TRIES {
            let share = Vector2::from_fn(|_, _| self.builder.random.uniform(0.2, 0.8));
            let low = inner.low + room_left.component_mul(&share);
            let footprint = Rectangle { low, high: low + size };
            let feet = footprint.grown(-0.12);
            if self.taken.iter().any(|other| other.overlaps(&feet)) {
                continue;
            }
            let place = if lengthwise {
                Place::on_floor(Vector2::new(footprint.center().x, low.y), 0.0)
            } else {
                Place::on_floor(Vector2::new(footprint.high.x, footprint.center().y), FRAC_PI_2)
            };
            decoration::rug(&mut self.builder.piece(&place), [width, depth]);
            return;
        }
    }

    /// A lamp under the ceiling, over the table if there is one.
    fn light(&mut self, room: &Room, table: Option<Vector2<f64>>) {
        let area = room.inner().size().product();
        let power = 0.55 + 0.035 * area;
        let height = self.plan.height;
        let center = room.inner().center();
        let mut lamp = |at: Vector2<f64>, pendant: bool, power: f64| {
            let place = Place { origin: Vector3::new(at.x, at.y, 0.0), turn: 0.0 };
            decoration::ceiling_lamp(&mut self.builder.piece(&place), height, pendant, power);
        };
        match table {
            Some(table) => lamp(table, true, 0.7 * power),
            None if room.kind == RoomKind::Corridor => {
                for share in [0.25, 0.75] {
                    lamp(room.inner().low.lerp(&room.inner().high, share).inf(&room.inner().high), false, 0.5);
                }
                return;
            }
            None => {}
        }
        if table.is_none_or(|table| (table - center).norm() > 1.2) {
            lamp(center, false, power);
        }
    }
}

/// Whether one can walk from every door to every other.
fn all_doors_meet(plan: &FloorPlan, ways: &Ways) -> bool {
    let mut doors = plan.openings.iter().filter(|opening| opening.is_way());
    let Some(first) = doors.next() else { return true };
    let distances = ways.distances(&first.center());
    doors.all(|door| ways.cell(&door.center()).is_some_and(|cell| distances[cell] < u32::MAX))
}

/// A sofa, a rug and a low table before it.
fn sofa_with_table(piece: &mut Piece, [width, _]: [f64; 2]) {
    seats::sofa(piece, [width, 0.92]);
    let mut before = piece.shifted([0.0, 0.62]);
    decoration::rug(&mut before, [width + 0.3, 1.36]);
    let mut table = piece.shifted([0.0, 1.3]);
    tables::coffee_table(&mut table, [0.95, 0.62]);
}

/// A double bed between two nightstands.
fn bed_with_nightstands(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let bed = width - 1.0;
    beds::bed(piece, [bed, depth - 0.05]);
    for side in [-1.0, 1.0] {
        let mut stand = piece.shifted([side * (bed / 2.0 + 0.27), 0.0]);
        tables::nightstand(&mut stand, [0.42, 0.4]);
    }
}
