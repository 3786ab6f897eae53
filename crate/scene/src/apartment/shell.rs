//! Floors, ceilings, walls, windows and doors.

use nalgebra::{Vector2, Vector3};

use super::super::space::{Light, Material, Pattern, srgb};
use super::builder::{Builder, Paint, Place};
use super::plan::{FloorPlan, HALF_WALL, OUTER_WALL, Opening, OpeningKind, Rectangle, Room, RoomKind, Side};

/// Floors and ceilings are so thick (m).
const SLAB: f64 = 0.2;
/// Height and thickness of the skirting boards (m).
const SKIRTING: [f64; 2] = [0.09, 0.014];
/// Thickness of a door's leaf (m).
const LEAF: f64 = 0.042;
/// Width of the frames around doors (m).
const CASING: f64 = 0.07;

/// Paints that several parts share.
struct Paints {
    white: Paint,
    ceiling: Paint,
    door: Paint,
    steel: Paint,
    daylight: Paint,
}

/// A strip of wall: along which axis, where its inner face is on the other, which way is out of the room, how thick.
struct Wall {
    along: usize,
    face: f64,
    outwards: f64,
    thickness: f64,
}

impl Wall {
    fn corner(&self, along: f64, off: f64, z: f64) -> Vector3<f64> {
        let across = self.face + self.outwards * off;
        if self.along == 0 { Vector3::new(along, across, z) } else { Vector3::new(across, along, z) }
    }

    /// A box of the wall: from ... to along it, off its face, and in height.
    fn slab(&self, builder: &mut Builder, along: [f64; 2], off: [f64; 2], z: [f64; 2], paint: Paint) {
        builder.slab(self.corner(along[0], off[0], z[0]), self.corner(along[1], off[1], z[1]), paint);
    }
}

/// The empty flat. Gives the solids that are floors.
pub fn build(plan: &FloorPlan, builder: &mut Builder) -> Vec<usize> {
    let white = srgb(0x00EC_EAE4);
    let wood = |color: u32| Material::of(Pattern::Grain(2), srgb(color), srgb(color) * 0.8);
    let door = builder.choose(&[Material::plain(srgb(0x00EC_EAE3)), wood(0x00B9_8B5E), wood(0x008F_5F3A)]);
    let sky = Material::of(Pattern::Outdoors([-0.3, 2.3]), srgb(0x007F_B2E8), srgb(0x004C_6B35));
    let paints = Paints {
        white: builder.paint(Material::plain(white).glossy(0.12)),
        ceiling: builder.paint(Material::of(Pattern::Plaster, srgb(0x00F1_EFEA), white).continuing()),
        door: builder.paint(door.glossy(0.1)),
        steel: builder.paint(Material::plain(srgb(0x00A9_A9A6)).glossy(0.5)),
        daylight: builder.paint(sky.continuing().glowing(1.25)),
    };
    let boards = floor_boards(builder);
    let tiles = floor_tiles(builder);
    let mut floors = Vec::new();
    for room in &plan.rooms {
        let tiled = matches!(room.kind, RoomKind::Kitchen | RoomKind::Bath);
        let (low, high) = (room.cell.low, room.cell.high);
        let corner = |at: Vector2<f64>, z: f64| Vector3::new(at.x, at.y, z);
        floors.push(builder.solids.len());
        builder.slab(corner(low, -SLAB), corner(high, 0.0), if tiled { tiles } else { boards });
        builder.slab(corner(low, plan.height), corner(high, plan.height + SLAB), paints.ceiling);
        add_walls(plan, room, builder, &paints);
    }
    let curtains: Vec<Paint> = plan.rooms.iter().map(|_| curtain_cloth(builder)).collect();
    for opening in &plan.openings {
        match opening.kind {
            OpeningKind::Window | OpeningKind::FrenchWindow => add_window(plan, opening, builder, &paints, &curtains),
            OpeningKind::Open => {}
            _ => add_door(plan, opening, builder, &paints),
        }
    }
    floors
}

fn floor_boards(builder: &mut Builder) -> Paint {
    let (light, dark) = builder.choose(&[
        (0x00B8_8F63, 0x0082_5A38),
        (0x00A6_7C52, 0x006B_4629),
        (0x00C9_A77C, 0x0097_7148),
        (0x0080_5A3C, 0x0052_351F),
        (0x00B3_A08A, 0x0084_7159),
    ]);
    let size = builder.choose(&[[1.2, 0.14], [0.9, 0.09], [1.6, 0.19]]);
    builder.paint(Material::of(Pattern::Planks(size), srgb(light), srgb(dark)).continuing().glossy(0.22))
}

fn floor_tiles(builder: &mut Builder) -> Paint {
    let (first, second, checkered) = builder.choose(&[
        (0x00D8_D2C6, 0x0055_5A60, true),
        (0x00C9_BFAF, 0x00B5_A995, false),
        (0x00B7_6E4B, 0x00A3_5C3B, false),
        (0x00E3_E0D8, 0x008C_9AA0, true),
    ]);
    let side = builder.choose(&[0.3, 0.4, 0.5]);
    let pattern = Pattern::Tiles { side, checkered };
    builder.paint(Material::of(pattern, srgb(first), srgb(second)).continuing().glossy(0.3))
}

/// What the walls of a room are covered with, and one of them differently.
fn wall_paints(room: &Room, builder: &mut Builder) -> [Paint; 2] {
    let calm = |builder: &mut Builder| {
        let color = builder.choose(&[
            0x00E6_DFD0,
            0x00DD_D8CE,
            0x00D5_DBD3,
            0x00D3_DAE0,
            0x00E8_DCCB,
            0x00CF_C6B8,
            0x00DA_CFC8,
            0x00C8_D0C4,
        ]);
        Material::of(Pattern::Plaster, srgb(color), srgb(color))
    };
    let plain = calm(builder);
    let strong = builder.choose(&[
        0x005F_7A76,
        0x00A6_5E45,
        0x0062_7A94,
        0x00B9_8E4A,
        0x0074_8060,
        0x008A_5560,
        0x0041_5A6B,
        0x00C4_A382,
    ]);
    let strong = srgb(strong);
    let accent = match room.kind {
        RoomKind::Living | RoomKind::Study => {
            let brick = Material::of(Pattern::Bricks([0.23, 0.075]), srgb(0x00A8_5C43), srgb(0x00B8_B0A4));
            builder.choose(&[
                brick,
                Material::of(Pattern::Plaster, strong, strong),
                Material::of(Pattern::Motif(0.24), strong, plain.base * 0.8),
            ])
        }
        RoomKind::Bedroom | RoomKind::Child => builder.choose(&[
            Material::of(Pattern::Stripes(0.11), plain.base, strong * 0.4 + plain.base * 0.5),
            Material::of(Pattern::Motif(0.16), plain.base, strong),
        ]),
        RoomKind::Bath => {
            let tiles = Pattern::Tiles { side: 0.15, checkered: false };
            Material::of(tiles, srgb(0x00DD_E3E4), strong).glossy(0.25)
        }
        _ => plain,
    };
    let plain = if room.kind == RoomKind::Bath { accent } else { plain };
    [builder.paint(plain.continuing()), builder.paint(accent.continuing())]
}

fn add_walls(plan: &FloorPlan, room: &Room, builder: &mut Builder, paints: &Paints) {
    let [plain, accent] = wall_paints(room, builder);
    let special = builder.choose(&Side::ALL);
    for side in Side::ALL {
        let along = side.along();
        let thickness = if plan.is_outer(room, side) { OUTER_WALL } else { HALF_WALL };
        let wall = Wall { along, face: room.inner().side(side), outwards: side.sign(), thickness };
        let paint = if side == special { accent } else { plain };
        let mut openings: Vec<&Opening> = plan.openings.iter().filter(|opening| opening.is_in(room, side)).collect();
        openings.sort_by(|a, b| a.span[0].total_cmp(&b.span[0]));
        // Outer walls meet at the corners; inner ones end at the middle of the next.
        let inner = room.inner();
        let reach = |end: f64, edge: f64| if (end - edge).abs() < 1e-9 { OUTER_WALL } else { HALF_WALL };
        let mut from = inner.low[along] - reach(room.cell.low[along], 0.0);
        let end = inner.high[along] + reach(room.cell.high[along], plan.size[along]);
        let body = [0.0, wall.thickness];
        for opening in openings {
            let [bottom, top] = opening.heights(plan.height);
            let span = opening.span;
            add_strip(&wall, builder, paints, paint, [from, span[0]], plan.height);
            if bottom > 0.0 {
                wall.slab(builder, span, body, [0.0, bottom], paint);
                add_skirting(&wall, builder, paints, span);
            }
            if top < plan.height {
                wall.slab(builder, span, body, [top, plan.height], paint);
                add_cornice(&wall, builder, paints, span, plan.height);
            }
            from = span[1];
        }
        add_strip(&wall, builder, paints, paint, [from, end], plan.height);
    }
}

fn add_strip(wall: &Wall, builder: &mut Builder, paints: &Paints, paint: Paint, along: [f64; 2], height: f64) {
    wall.slab(builder, along, [0.0, wall.thickness], [0.0, height], paint);
    add_skirting(wall, builder, paints, along);
    add_cornice(wall, builder, paints, along, height);
}

fn add_cornice(wall: &Wall, builder: &mut Builder, paints: &Paints, along: [f64; 2], height: f64) {
    wall.slab(builder, along, [-0.05, 0.0], [height - 0.05, height], paints.white);
}

fn add_skirting(wall: &Wall, builder: &mut Builder, paints: &Paints, along: [f64; 2]) {
    wall.slab(builder, along, [-SKIRTING[1], 0.0], [0.0, SKIRTING[0]], paints.white);
}

/// Frame, bars, pane, sill, sometimes a radiator below or curtains at its sides; and the daylight.
fn add_window(plan: &FloorPlan, opening: &Opening, builder: &mut Builder, paints: &Paints, curtains: &[Paint]) {
    let Some((room, side)) = plan.rooms_at(opening).next() else { return };
    let face = plan.rooms[room].inner().side(side);
    let wall = Wall { along: side.along(), face, outwards: side.sign(), thickness: OUTER_WALL };
    let ([from, to], [bottom, top]) = (opening.span, opening.heights(plan.height));
    let (depth, bar) = (wall.thickness - 0.08, 0.055);
    let frame = [depth - 0.05, depth + 0.02];
    wall.slab(builder, [from, to], [depth, wall.thickness], [bottom, top], paints.daylight);
    for [a, b] in [[from, from + bar], [to - bar, to]] {
        wall.slab(builder, [a, b], frame, [bottom, top], paints.white);
    }
    for [a, b] in [[bottom, bottom + bar], [top - bar, top]] {
        wall.slab(builder, [from + bar, to - bar], frame, [a, b], paints.white);
    }
    let leaves = ((to - from) / 0.75).floor().max(1.0);
    for leaf in 1..leaves as usize {
        let at = from + (to - from) * leaf as f64 / leaves;
        wall.slab(builder, [at - bar / 2.0, at + bar / 2.0], frame, [bottom + bar, top - bar], paints.white);
    }
    if opening.kind == OpeningKind::Window {
        wall.slab(builder, [from - 0.06, to + 0.06], [-0.07, depth - 0.05], [bottom - 0.035, bottom], paints.white);
        if to - from > 1.0 {
            add_radiator(&wall, builder, paints, [from + 0.12, to - 0.12]);
        }
    }
    if to - from > 1.0 && builder.random.happens(0.75) {
        add_curtains(&wall, builder, opening, plan.height, curtains[room]);
    }
    let middle = wall.corner(f64::midpoint(from, to), depth - 0.06, f64::midpoint(bottom, top));
    let inwards = wall.corner(0.0, -1.0, 0.0) - wall.corner(0.0, 0.0, 0.0);
    let across = (wall.corner(to, 0.0, 0.0) - wall.corner(from, 0.0, 0.0)) / 2.0;
    let up = Vector3::z() * ((top - bottom) / 2.0);
    let radiance = Vector3::new(0.60, 0.66, 0.74) * 1.15;
    builder.lights.push(Light::Window { center: middle, across, up, inwards, radiance });
}

fn add_radiator(wall: &Wall, builder: &mut Builder, paints: &Paints, [from, to]: [f64; 2]) {
    let fins = ((to - from) / 0.06) as usize;
    for fin in 0..fins {
        let at = from + (to - from) * (fin as f64 + 0.5) / fins as f64;
        wall.slab(builder, [at - 0.021, at + 0.021], [-0.1, -0.03], [0.14, 0.7], paints.white);
    }
    wall.slab(builder, [from, to], [-0.08, -0.05], [0.2, 0.24], paints.white);
    wall.slab(builder, [from, to], [-0.08, -0.05], [0.6, 0.64], paints.white);
}

/// Curtains of one room are of one cloth.
fn curtain_cloth(builder: &mut Builder) -> Paint {
    let color = builder.choose(&[0x00C9_B79A, 0x0087_9AA6, 0x00B4_6A5A, 0x00E2_DCD0, 0x0072_8B74, 0x00A9_8FA8]);
    builder.paint(Material::of(Pattern::Cloth, srgb(color), srgb(color) * 0.75))
}

/// Folds on both sides of a window, on a rod.
fn add_curtains(wall: &Wall, builder: &mut Builder, opening: &Opening, height: f64, cloth: Paint) {
    let rod = builder.paint(Material::plain(srgb(0x0055_4A40)));
    let long = opening.kind == OpeningKind::FrenchWindow || builder.random.happens(0.4);
    let bottom = if long { 0.03 } else { 0.72 };
    let top = (opening.heights(height)[1] + 0.14).min(height - 0.08);
    let place = |at: f64| wall.corner(at, -0.13, 0.0);
    for (start, direction) in [(opening.span[0] - 0.12, 1.0), (opening.span[1] + 0.12, -1.0)] {
        for fold in 0..5 {
            let swing = builder.random.uniform(-0.012, 0.012);
            let at = place(start + direction * 0.058 * f64::from(fold));
            let mut piece = builder.piece(&Place { origin: at, turn: 0.0 });
            piece.tapered([swing, swing, bottom], [0.042, 0.03], top - bottom, cloth);
        }
    }
    let mut piece = builder.piece(&Place { origin: Vector3::zeros(), turn: 0.0 });
    let (a, b) = (place(opening.span[0] - 0.3), place(opening.span[1] + 0.3));
    piece.rod([a.x, a.y, top + 0.02], [b.x, b.y, top + 0.02], 0.013, rod);
}

/// Frame, threshold, and the leaf of a door: shut in the entrance, else open into the room with the smaller way past.
fn add_door(plan: &FloorPlan, opening: &Opening, builder: &mut Builder, paints: &Paints) {
    let Some((first, side)) = plan.rooms_at(opening).next() else { return };
    let outer = plan.is_outer(&plan.rooms[first], side);
    let faces = if outer { [-HALF_WALL, OUTER_WALL - HALF_WALL] } else { [-HALF_WALL, HALF_WALL] };
    // Off the middle of the wall, outwards from the first room.
    let wall = Wall { along: opening.along, face: opening.wall, outwards: side.sign(), thickness: 0.0 };
    let ([from, to], [_, top]) = (opening.span, opening.heights(plan.height));
    let reach = [faces[0] - 0.018, faces[1] + 0.018];
    for [a, b] in [[from - CASING + 0.02, from + 0.02], [to - 0.02, to + CASING - 0.02]] {
        wall.slab(builder, [a, b], reach, [0.0, top + CASING - 0.02], paints.door);
    }
    wall.slab(builder, [from + 0.02, to - 0.02], reach, [top - 0.02, top + CASING - 0.02], paints.door);
    if opening.kind == OpeningKind::Passage {
        return;
    }
    wall.slab(builder, [from, to], [faces[0], faces[1]], [0.0, 0.006], paints.door);
    let width = to - from - 0.05;
    if opening.kind == OpeningKind::Entrance {
        wall.slab(builder, [from + 0.02, to - 0.02], [0.0, LEAF], [0.006, top - 0.02], paints.door);
        let [a, b] = [to - 0.14, to - 0.02];
        wall.slab(builder, [a, a + 0.03], [-0.05, 0.0], [1.02, 1.04], paints.steel);
        wall.slab(builder, [a, b - 0.01], [-0.06, -0.045], [1.02, 1.04], paints.steel);
        return;
    }
    let (hinge, turn) = swing(plan, opening, builder);
    let mut piece = builder.piece(&Place { origin: Vector3::new(hinge.x, hinge.y, 0.0), turn });
    piece.standing([width / 2.0, 0.0, 0.01], [width, LEAF, top - 0.04], paints.door);
    for (low, high) in [(0.18, 0.9), (1.08, top - 0.2)] {
        for face in [-1.0, 1.0] {
            let middle = [width / 2.0, face * (LEAF / 2.0 + 0.003), f64::midpoint(low, high)];
            piece.cuboid(middle, [width - 0.26, 0.008, high - low], paints.door);
        }
    }
    for face in [-1.0, 1.0] {
        let y = face * (LEAF / 2.0 + 0.045);
        piece.rod([width - 0.06, 0.0, 1.02], [width - 0.06, y, 1.02], 0.009, paints.steel);
        piece.rod([width - 0.07, y, 1.02], [width - 0.18, y, 1.02], 0.009, paints.steel);
    }
}

/// Where the hinge of a door is, and how the leaf is turned (from x): into the room, almost against its wall.
fn swing(plan: &FloorPlan, opening: &Opening, builder: &mut Builder) -> (Vector2<f64>, f64) {
    let into = room_of_leaf(plan, opening);
    let (at_low, inwards) = hinge_side(plan, opening, into);
    let along = if at_low { opening.span[0] + 0.03 } else { opening.span[1] - 0.03 };
    let hinge = opening.at(along, inwards * (HALF_WALL + LEAF / 2.0));
    let open = builder.random.uniform(1.58, 1.78); // rad: a right angle or a little more
    let shut = if at_low { 0.0 } else { std::f64::consts::PI } + if opening.along == 1 { HALF_TURN } else { 0.0 };
    let turns_left = (inwards > 0.0) == at_low;
    let turns_left = if opening.along == 1 { !turns_left } else { turns_left };
    (hinge, shut + if turns_left { open } else { -open })
}

const HALF_TURN: f64 = std::f64::consts::FRAC_PI_2;

/// The room that a door opens into: not the corridor.
fn room_of_leaf(plan: &FloorPlan, opening: &Opening) -> Option<usize> {
    let outside = |room: RoomKind| !matches!(room, RoomKind::Corridor | RoomKind::Hall);
    plan.rooms_at(opening).map(|(room, _)| room).find(|&room| outside(plan.rooms[room].kind))
}

/// Whether the hinge is at the lower end of the opening, and which way the room lies: at the end nearer to a wall of it.
fn hinge_side(plan: &FloorPlan, opening: &Opening, room: Option<usize>) -> (bool, f64) {
    let Some(room) = room.map(|room| &plan.rooms[room]) else { return (true, 1.0) };
    let (low, high) = (room.cell.low[opening.along], room.cell.high[opening.along]);
    let inwards = if room.cell.center()[1 - opening.along] > opening.wall { 1.0 } else { -1.0 };
    (opening.span[0] - low < high - opening.span[1], inwards)
}

/// The floor that the leaf of an open door stands on and sweeps over.
pub fn swept_by_leaf(plan: &FloorPlan, opening: &Opening) -> Option<Rectangle> {
    if opening.kind != OpeningKind::Door {
        return None;
    }
    let (at_low, inwards) = hinge_side(plan, opening, room_of_leaf(plan, opening));
    let width = opening.span[1] - opening.span[0];
    let along =
        if at_low { [opening.span[0] - 0.25, opening.span[1]] } else { [opening.span[0], opening.span[1] + 0.25] };
    Some(Rectangle::new(opening.at(along[0], 0.0), opening.at(along[1], inwards * (HALF_WALL + width))))
}
