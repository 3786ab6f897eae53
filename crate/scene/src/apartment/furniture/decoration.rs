//! Plants, lamps, pictures, books, rugs, and other things that make a room a home.

use std::f64::consts::TAU;

use super::super::super::space::{Material, Pattern, srgb};
use super::super::builder::Piece;
use super::{cloth, cloth_color, metal, wood};

/// Warm light of a bulb.
const BULB: [f64; 3] = [1.0, 0.83, 0.62];

/// A plant in a pot, so high from the pot's foot.
pub fn plant(piece: &mut Piece, [x, y, z]: [f64; 3], height: f64) {
    let pot = piece.choose(&[0x00B0_6A48, 0x00E6_E3DC, 0x0045_4B50, 0x007C_8F86]);
    let pot = piece.paint(Material::plain(srgb(pot)).glossy(0.12));
    let earth = piece.paint(Material::of(Pattern::Carpet, srgb(0x0040_2E20), srgb(0x002A_1D14)));
    let leaf = piece.choose(&[0x0044_7A3A, 0x005C_8A48, 0x0035_6B4A]);
    let leaf = piece.paint(Material::of(Pattern::Leaf, srgb(leaf), srgb(leaf) * 0.55).glossy(0.1));
    let deep = height * 0.3;
    let radius = deep * 0.55;
    piece.tapered([x, y, z], [radius * 0.75, radius], deep, pot);
    piece.post([x, y, z + deep], radius * 0.9, 0.004, earth);
    let stems = 9 + (height * 16.0) as usize;
    for stem in 0..stems {
        let angle = TAU * stem as f64 * 0.381_966; // the golden angle: no leaf covers another
        let share = (stem as f64 + 0.5) / stems as f64;
        let (lean, tall) = (height * (0.1 + 0.16 * share), height * (0.66 - 0.45 * share));
        let (lean, tall) = (lean * piece.uniform(0.7, 1.2), tall * piece.uniform(0.85, 1.1));
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let tip = [x + cos * lean, y + sin * lean, z + deep + tall];
        piece.rod([x + cos * 0.02, y + sin * 0.02, z + deep - 0.01], tip, 0.0045, leaf);
        // The leaf begins at the tip and hangs outwards.
        let half = piece.uniform(0.10, 0.15) * height.sqrt();
        let droop = piece.uniform(0.1, 0.75);
        let (out, down) = (half * 0.85 * libm::cos(droop), half * 0.85 * libm::sin(droop));
        let middle = [tip[0] + cos * out, tip[1] + sin * out, tip[2] - down];
        piece.ball_turned(middle, [half * 0.34, half, 0.006], [-droop, angle - TAU / 4.0], leaf);
    }
}

/// A lamp that stands on the floor.
pub fn floor_lamp(piece: &mut Piece, [_, depth]: [f64; 2]) {
    let (stand, y) = (metal(piece), depth / 2.0);
    piece.post([0.0, y, 0.0], 0.14, 0.025, stand);
    piece.post([0.0, y, 0.025], 0.013, 1.33, stand);
    shade(piece, [0.0, y, 1.32], [0.21, 0.14], 0.28);
    piece.lamp([0.0, y, 1.66], 0.1, srgb(0x00FF_D9A8) * 0.4);
    piece.lamp([0.0, y, 1.24], 0.1, srgb(0x00FF_D9A8) * 0.35);
}

/// A lamp that stands on a table.
pub fn lamp_on(piece: &mut Piece, [x, y, z]: [f64; 3]) {
    let foot = metal(piece);
    piece.post([x, y, z], 0.06, 0.015, foot);
    piece.post([x, y, z + 0.015], 0.01, 0.2, foot);
    shade(piece, [x, y, z + 0.2], [0.12, 0.07], 0.17);
    piece.lamp([x, y, z + 0.42], 0.06, srgb(0x00FF_D9A8) * 0.14);
}

fn shade(piece: &mut Piece, bottom: [f64; 3], radii: [f64; 2], height: f64) {
    let color = srgb(piece.choose(&[0x00F6_E7C8, 0x00F2_EEE2, 0x00E9_CFA6]));
    let paper = piece.paint(Material::of(Pattern::Plaster, color, color).glowing(0.75));
    piece.tapered(bottom, radii, height, paper);
}

/// A lamp under the ceiling at this height: a dish, or a pendant where a table stands below.
pub fn ceiling_lamp(piece: &mut Piece, ceiling: f64, pendant: bool, power: f64) {
    let power = nalgebra::Vector3::from(BULB) * power;
    let stem = metal(piece);
    if pendant {
        piece.post([0.0, 0.0, ceiling - 0.03], 0.05, 0.03, stem);
        piece.post([0.0, 0.0, 1.86], 0.005, ceiling - 1.86, stem);
        shade(piece, [0.0, 0.0, 1.62], [0.23, 0.1], 0.24);
        piece.lamp([0.0, 0.0, 1.56], 0.12, power * 0.9);
        piece.lamp([0.0, 0.0, 1.95], 0.12, power * 0.5);
    } else {
        let glass = piece.paint(Material::plain(srgb(0x00FF_F1DA)).glowing(1.1));
        piece.post([0.0, 0.0, ceiling - 0.02], 0.2, 0.02, stem);
        piece.ball([0.0, 0.0, ceiling - 0.03], [0.18, 0.18, 0.07], glass);
        piece.lamp([0.0, 0.0, ceiling - 0.16], 0.16, power);
    }
}

/// A picture on the wall, its middle at this height.
pub fn picture(piece: &mut Piece, [width, height]: [f64; 2], z: f64) {
    let frame =
        if piece.happens(0.5) { wood(piece, 0) } else { piece.paint(Material::plain(srgb(0x0022_2224)).glossy(0.15)) };
    let (base, second) = (cloth_color(piece), cloth_color(piece));
    let half = [width / 2.0 - 0.025, height / 2.0 - 0.025];
    let canvas = piece.paint(Material::of(Pattern::Picture(half), base * 1.3, second));
    piece.cuboid([0.0, 0.012, z], [width, 0.024, height], frame);
    piece.cuboid([0.0, 0.016, z], [2.0 * half[0], 0.02, 2.0 * half[1]], canvas);
}

/// A mirror on the wall.
pub fn mirror(piece: &mut Piece, [width, height]: [f64; 2], z: f64) {
    let frame = wood(piece, 2);
    let glass = piece.paint(Material::plain(srgb(0x009A_A6AA)).glossy(0.95));
    piece.cuboid([0.0, 0.014, z], [width, 0.028, height], frame);
    piece.cuboid([0.0, 0.018, z], [width - 0.08, 0.024, height - 0.08], glass);
}

/// A rug.
pub fn rug(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let (base, second) = (cloth_color(piece), cloth_color(piece));
    let pattern = Pattern::Rug([width / 2.0, depth / 2.0]);
    let light = srgb(0x00DB_CFB8);
    let second = if (base - second).norm() < 0.15 { light } else { second };
    let pile = piece.paint(Material::of(pattern, base, second));
    piece.rounded([0.0, depth / 2.0, 0.008], [width, depth, 0.016], 0.006, pile);
}

/// A bowl with fruit.
pub fn bowl(piece: &mut Piece, [x, y, z]: [f64; 3]) {
    let china = srgb(piece.choose(&[0x00E8_E4DC, 0x003F_6A78, 0x00C0_7A48]));
    let china = piece.paint(Material::plain(china).glossy(0.3));
    piece.tapered([x, y, z], [0.06, 0.13], 0.07, china);
    for fruit in 0..5 {
        let color = piece.choose(&[0x00C8_3A2A, 0x00E0_9A2C, 0x009A_B63C]);
        let peel = piece.paint(Material::plain(srgb(color)).glossy(0.12));
        let angle = TAU * f64::from(fruit) / 4.0;
        let out = if fruit == 4 { 0.0 } else { 0.055 };
        let up = if fruit == 4 { 0.12 } else { 0.08 };
        piece.ball([x + out * libm::cos(angle), y + out * libm::sin(angle), z + up], [0.037; 3], peel);
    }
}

/// A vase, on most with flowers.
pub fn vase(piece: &mut Piece, [x, y, z]: [f64; 3]) {
    let glaze = srgb(piece.choose(&[0x0045_6F86, 0x00D9_D2C4, 0x00A6_4B3C, 0x0030_3C3A]));
    let glaze = piece.paint(Material::plain(glaze).glossy(0.35));
    piece.tapered([x, y, z], [0.035, 0.055], 0.09, glaze);
    piece.tapered([x, y, z + 0.09], [0.055, 0.026], 0.07, glaze);
    if piece.happens(0.7) {
        let green = piece.paint(Material::plain(srgb(0x004E_7A3E)));
        let bloom = piece.choose(&[0x00D8_5A6A, 0x00F0_C84A, 0x00E9_E4F0, 0x008E_6AB8]);
        let bloom = piece.paint(Material::plain(srgb(bloom)));
        for flower in 0..5 {
            let angle = TAU * f64::from(flower) / 5.0;
            let lean = piece.uniform(0.02, 0.08);
            let tip = [x + lean * libm::cos(angle), y + lean * libm::sin(angle), z + piece.uniform(0.24, 0.32)];
            piece.rod([x, y, z + 0.15], tip, 0.003, green);
            piece.ball(tip, [0.026, 0.026, 0.02], bloom);
        }
    }
}

/// A few books lying on each other.
pub fn books_lying(piece: &mut Piece, [x, y, z]: [f64; 3]) {
    let mut top = z;
    for _ in 0..3 {
        let [base, _] = book_colors(piece);
        let cover = piece.paint(Material::plain(base));
        let (thick, turn) = (piece.uniform(0.012, 0.03), piece.uniform(-0.5, 0.5));
        piece.turned([x, y, top + thick / 2.0], [0.2, 0.14, thick], [0.0, turn], cover);
        top += thick;
    }
}

/// A computer's screen.
pub fn monitor(piece: &mut Piece, [x, y, z]: [f64; 3]) {
    let frame = piece.paint(Material::plain(srgb(0x0024_2426)).glossy(0.15));
    let picture = Material::of(Pattern::Picture([0.27, 0.155]), srgb(0x0038_6A98), srgb(0x00D8_DDE2));
    let glass = piece.paint(picture.glowing(0.7));
    piece.post([x, y, z], 0.1, 0.012, frame);
    piece.post([x, y - 0.02, z], 0.018, 0.2, frame);
    piece.cuboid([x, y, z + 0.33], [0.58, 0.03, 0.35], frame);
    piece.cuboid([x, y + 0.015, z + 0.33], [0.54, 0.004, 0.31], glass);
}

/// A basket for washing or toys.
pub fn basket(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let weave = Material::of(Pattern::Cloth, srgb(0x00B8_9766), srgb(0x0078_5C38));
    let weave = piece.paint(weave);
    piece.tapered([0.0, depth / 2.0, 0.0], [width * 0.4, width * 0.5], 0.42, weave);
    let cloth = cloth(piece);
    piece.ball([0.02, depth / 2.0, 0.42], [width * 0.4, width * 0.38, 0.07], cloth);
}

/// Blocks and balls on the floor.
pub fn toys(piece: &mut Piece, [width, depth]: [f64; 2]) {
    for _ in 0..9 {
        let color = piece.choose(&[0x00D0_4A3A, 0x003A_7AC0, 0x00E8_C23A, 0x0048_A060]);
        let paint = piece.paint(Material::plain(srgb(color)).glossy(0.1));
        let (x, y) = (piece.uniform(-0.45, 0.45) * width, piece.uniform(0.05, 0.95) * depth);
        let (side, turn) = (piece.uniform(0.05, 0.09), piece.uniform(0.0, 1.5));
        if piece.happens(0.3) {
            piece.ball([x, y, side], [side; 3], paint);
        } else {
            piece.turned([x, y, side / 2.0], [side; 3], [0.0, turn], paint);
        }
    }
}

/// A plant that stands on the floor.
pub fn potted_plant(piece: &mut Piece, [_, depth]: [f64; 2]) {
    let height = piece.uniform(0.8, 1.3);
    plant(piece, [0.0, depth / 2.0, 0.0], height);
}

/// Ground and print of a book.
pub fn book_colors(piece: &mut Piece) -> [super::Color; 2] {
    let base = piece.choose(&[
        0x0083_2B2B,
        0x001F_3D5C,
        0x0036_5B3C,
        0x00D8_CDB4,
        0x0025_2528,
        0x00C0_8A2E,
        0x006A_4A6E,
        0x00A9_B7BF,
        0x00B5_5A2C,
        0x0047_7F86,
        0x00EA_E6DA,
        0x0059_402C,
    ]);
    let second = piece.choose(&[0x00E8_D9A6, 0x00F2_EFE6, 0x001C_1C1E]);
    let second = if base == 0x00D8_CDB4 || base == 0x00EA_E6DA { 0x0060_2A22 } else { second };
    [srgb(base), srgb(second)]
}
