//! Shelves, cupboards, wardrobes.

use super::super::super::space::{Material, Pattern, srgb};
use super::super::builder::Piece;
use super::decoration::{book_colors, plant, vase};
use super::{lacquer, metal, wood};

/// Boards are so thick (m).
const BOARD: f64 = 0.024;

/// Shelves with books and a few other things.
pub fn bookshelf(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let body = if piece.happens(0.6) { wood(piece, 2) } else { lacquer(piece) };
    let height = piece.uniform(1.7, 2.1);
    let boards = 5;
    let each = (height - 0.08) / f64::from(boards);
    for x in [-1.0, 1.0] {
        piece.standing([x * (width - BOARD) / 2.0, depth / 2.0, 0.0], [BOARD, depth, height], body);
    }
    piece.standing([0.0, 0.006, 0.0], [width - 2.0 * BOARD, 0.012, height], body);
    for index in 0..=boards {
        let z = 0.06 + each * f64::from(index);
        piece.standing([0.0, depth / 2.0, z], [width - 2.0 * BOARD, depth - 0.004, BOARD], body);
        if index < boards {
            let inner = [-width / 2.0 + BOARD, width / 2.0 - BOARD];
            books_standing(piece, inner, depth, z + BOARD, each - BOARD);
        }
    }
}

/// Books side by side from left to right, with gaps that hold something else.
fn books_standing(piece: &mut Piece, [left, right]: [f64; 2], depth: f64, z: f64, height: f64) {
    let mut x = left + 0.006;
    while x < right - 0.07 {
        if piece.happens(0.06) {
            if right - x > 0.2 && piece.happens(0.5) {
                vase(piece, [x + 0.1, depth / 2.0, z]);
            }
            x += piece.uniform(0.12, 0.25);
            continue;
        }
        let thick = piece.uniform(0.018, 0.055);
        let (tall, deep) = (piece.uniform(0.62, 0.9) * height, piece.uniform(0.65, 0.85) * depth);
        let [base, second] = book_colors(piece);
        let spine = piece.paint(Material::of(Pattern::Spine(tall / 2.0), base, second));
        piece.standing([x + thick / 2.0, 0.02 + deep / 2.0, z], [thick - 0.0015, deep, tall], spine);
        x += thick;
    }
}

/// A wardrobe.
pub fn wardrobe(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let body = if piece.happens(0.5) { wood(piece, 2) } else { lacquer(piece) };
    let knob = metal(piece);
    let height = piece.uniform(2.0, 2.25);
    piece.standing([0.0, depth / 2.0 - 0.01, 0.0], [width, depth - 0.02, 0.07], body);
    piece.standing([0.0, depth / 2.0, 0.07], [width, depth - 0.024, height - 0.07], body);
    piece.standing([0.0, depth / 2.0, height], [width + 0.04, depth, 0.03], body);
    let doors = (width / 0.5).floor().max(2.0);
    let each = width / doors;
    for door in 0..doors as usize {
        let x = -width / 2.0 + each * (door as f64 + 0.5);
        piece.standing([x, depth - 0.002, 0.09], [each - 0.008, 0.02, height - 0.11], body);
        for (low, high) in [(0.2, 0.95), (1.08, height - 0.14)] {
            let middle = [x, depth + 0.01, f64::midpoint(low, high)];
            piece.cuboid(middle, [each - 0.15, 0.008, high - low], body);
        }
        let side = if door % 2 == 0 { 1.0 } else { -1.0 };
        piece.rod(
            [x + side * (each / 2.0 - 0.04), depth + 0.03, 0.95],
            [x + side * (each / 2.0 - 0.04), depth + 0.03, 1.12],
            0.008,
            knob,
        );
    }
    if piece.happens(0.6) {
        let box_ = Material::of(Pattern::Cloth, srgb(0x00B9_A58A), srgb(0x008C_7A60));
        let box_ = piece.paint(box_);
        piece.standing([-width * 0.2, depth / 2.0, height + 0.03], [0.45, 0.35, 0.2], box_);
    }
}

/// A low cupboard with a television or with pictures and plants on top.
pub fn sideboard(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let (body, knob) = (wood(piece, 0), metal(piece));
    let height = 0.55;
    piece.standing([0.0, depth / 2.0, 0.14], [width, depth - 0.02, height - 0.14], body);
    for x in [-1.0, 1.0] {
        for y in [0.05, depth - 0.06] {
            piece.tapered([x * (width / 2.0 - 0.1), y, 0.0], [0.014, 0.022], 0.14, body);
        }
    }
    let doors = (width / 0.45).floor().max(2.0);
    let each = width / doors;
    for door in 0..doors as usize {
        let x = -width / 2.0 + each * (door as f64 + 0.5);
        piece.standing([x, depth - 0.006, 0.155], [each - 0.012, 0.016, height - 0.17], body);
        piece.ball([x + each / 2.0 - 0.05, depth + 0.012, 0.38], [0.012; 3], knob);
    }
    let screen = piece.paint(Material::plain(srgb(0x0012_1316)).glossy(0.6));
    let frame = piece.paint(Material::plain(srgb(0x0020_2022)).glossy(0.2));
    let wide = (width - 0.3).min(1.25);
    let tall = wide * 0.57;
    piece.cuboid([0.0, 0.13, height + 0.06 + tall / 2.0], [wide, 0.035, tall], frame);
    piece.cuboid([0.0, 0.149, height + 0.065 + tall / 2.0], [wide - 0.03, 0.006, tall - 0.03], screen);
    for x in [-0.25, 0.25] {
        piece.standing([x * wide, 0.13, height], [0.03, 0.2, 0.07], frame);
    }
    plant(piece, [width / 2.0 - 0.11, depth / 2.0, height], 0.3);
}

/// Coats on a rail, shoes below.
pub fn coat_rack(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let (board, hook) = (wood(piece, 0), metal(piece));
    piece.cuboid([0.0, 0.015, 1.68], [width, 0.03, 0.14], board);
    piece.standing([0.0, depth / 2.0, 0.0], [width, depth, 0.03], board);
    piece.standing([0.0, depth / 2.0, 0.2], [width, depth, 0.025], board);
    for side in [-1.0, 1.0] {
        piece.standing([side * (width / 2.0 - 0.012), depth / 2.0, 0.0], [0.024, depth, 0.45], board);
    }
    piece.standing([0.0, depth / 2.0, 0.45], [width, depth, 0.03], board);
    let hooks = (width / 0.38) as usize;
    for index in 0..hooks {
        let x = -width / 2.0 + width * (index as f64 + 0.5) / hooks as f64;
        piece.rod([x, 0.03, 1.66], [x, 0.1, 1.69], 0.008, hook);
        if piece.happens(0.8) {
            let coat = super::cloth(piece);
            let long = piece.uniform(0.6, 0.95);
            piece.rounded([x, 0.12, 1.64 - long / 2.0], [0.3, 0.11, long], 0.05, coat);
            piece.rounded([x, 0.12, 1.6], [0.36, 0.1, 0.14], 0.05, coat);
            for side in [-1.0, 1.0] {
                piece.rounded([x + side * 0.165, 0.13, 1.35], [0.09, 0.09, 0.56], 0.04, coat);
            }
        }
    }
    for index in 0..4 {
        if piece.happens(0.8) {
            let color = piece.choose(&[0x0038_2A20, 0x0020_2022, 0x008A_3B32, 0x00C8_C2B6, 0x0041_5878]);
            let shoe = piece.paint(Material::plain(srgb(color)));
            for side in [-0.045, 0.045] {
                let x = -width / 2.0 + width * (f64::from(index) + 0.5) / 4.0 + side;
                let z = if index % 2 == 0 { 0.225 } else { 0.03 };
                piece.rounded([x, depth / 2.0, z + 0.045], [0.075, 0.24, 0.09], 0.035, shoe);
            }
        }
    }
}
