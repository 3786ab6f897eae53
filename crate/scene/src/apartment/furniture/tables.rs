//! Tables and what stands on them.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::super::super::space::{Material, Pattern, srgb};
use super::super::builder::Piece;
use super::decoration::{books_lying, bowl, lamp_on, monitor, vase};
use super::seats::{chair, chair_set, office_chair};
use super::{lacquer, metal, wood};

/// A dining table with chairs along its long sides and at its ends, laid or not; the size includes the chairs.
pub fn dining_table(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let (length, across) = (width - 0.9, depth - 1.0);
    let middle = depth / 2.0;
    let top = wood(piece, 0);
    piece.rounded([0.0, middle, 0.745], [length, across, 0.035], 0.012, top);
    piece.cuboid([0.0, middle, 0.69], [length - 0.22, across - 0.2, 0.07], top);
    for [x, y] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
        let foot = [x * (length / 2.0 - 0.09), middle + y * (across / 2.0 - 0.09), 0.0];
        piece.tapered(foot, [0.024, 0.04], 0.727, top);
    }
    let set = chair_set(piece);
    let seats = if length > 1.3 { 2 } else { 1 };
    for index in 0..seats {
        let x = length * ((f64::from(index) + 0.5) / f64::from(seats) - 0.5);
        for (y, turn) in [(middle - across / 2.0 - 0.15, 0.0), (middle + across / 2.0 + 0.15, PI)] {
            let (shift, twist) = (piece.uniform(-0.07, 0.07), piece.uniform(-0.25, 0.25));
            chair(piece, &set, [x + shift, y], turn + twist);
        }
    }
    for (x, turn) in [(-length / 2.0 - 0.12, -FRAC_PI_2), (length / 2.0 + 0.12, FRAC_PI_2)] {
        if piece.happens(0.6) {
            let twist = piece.uniform(-0.2, 0.2);
            chair(piece, &set, [x, middle], turn + twist);
        }
    }
    set_table(piece, [length, across], middle, 0.7625);
}

/// Bowl, vase, plates and glasses.
fn set_table(piece: &mut Piece, [length, across]: [f64; 2], middle: f64, z: f64) {
    if piece.happens(0.5) {
        bowl(piece, [0.12, middle, z]);
    } else {
        vase(piece, [0.05, middle, z]);
    }
    let china = piece.paint(Material::plain(srgb(0x00EF_EDE8)).glossy(0.3));
    let glass = piece.paint(Material::plain(srgb(0x00B9_CBD0)).glossy(0.5));
    for x in [-1.0, 1.0] {
        for y in [-1.0, 1.0] {
            if piece.happens(0.6) {
                let at = [x * length * 0.26, middle + y * (across / 2.0 - 0.17), z];
                piece.tapered(at, [0.07, 0.125], 0.016, china);
                piece.tapered([at[0] + 0.16, at[1] - y * 0.1, z], [0.028, 0.036], 0.11, glass);
            }
        }
    }
}

/// A low table for a sofa, round or square.
pub fn coffee_table(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let (top, middle) = (wood(piece, 0), depth / 2.0);
    let legs = if piece.happens(0.5) { metal(piece) } else { top };
    if width < 1.0 && piece.happens(0.5) {
        piece.post([0.0, middle, 0.39], depth / 2.0, 0.03, top);
        for leg in 0..4 {
            let angle = TAU * (f64::from(leg) + 0.5) / 4.0;
            let (x, y) = (libm::cos(angle), libm::sin(angle));
            let foot = [x * depth * 0.42, middle + y * depth * 0.42, 0.0];
            piece.rod(foot, [x * depth * 0.3, middle + y * depth * 0.3, 0.39], 0.016, legs);
        }
    } else {
        piece.rounded([0.0, middle, 0.4], [width, depth, 0.04], 0.012, top);
        piece.cuboid([0.0, middle, 0.16], [width - 0.1, depth - 0.1, 0.02], top);
        for [x, y] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
            piece.standing(
                [x * (width / 2.0 - 0.05), middle + y * (depth / 2.0 - 0.05), 0.0],
                [0.04, 0.04, 0.38],
                legs,
            );
        }
    }
    books_lying(piece, [-0.14, middle + 0.05, 0.42]);
    bowl(piece, [0.17, middle - 0.06, 0.42]);
}

/// A desk with drawers, a screen, a lamp and a chair; the size includes the chair.
pub fn desk(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let (top, body) = (wood(piece, 0), lacquer(piece));
    let deep = depth - 0.45;
    piece.rounded([0.0, deep / 2.0, 0.73], [width, deep, 0.03], 0.01, top);
    let side = piece.choose(&[-1.0, 1.0]);
    drawers(piece, [side * (width / 2.0 - 0.22), deep / 2.0], [0.4, deep - 0.08, 0.7], 3);
    for y in [0.06, deep - 0.06] {
        piece.standing([-side * (width / 2.0 - 0.05), y, 0.0], [0.05, 0.05, 0.715], body);
    }
    piece.standing([-side * (width / 2.0 - 0.05), deep / 2.0, 0.05], [0.02, deep - 0.17, 0.4], body);
    monitor(piece, [-side * 0.12, 0.2, 0.745]);
    let keys = piece.paint(Material::plain(srgb(0x0032_3335)).glossy(0.1));
    piece.standing([-side * 0.12, 0.43, 0.745], [0.42, 0.14, 0.02], keys);
    lamp_on(piece, [side * (width / 2.0 - 0.16), 0.16, 0.745]);
    books_lying(piece, [side * (width / 2.0 - 0.2), 0.42, 0.745]);
    let turn = PI + piece.uniform(-0.7, 0.7);
    office_chair(piece, [-side * 0.1, deep + 0.12], turn);
}

/// A body with drawers: its middle, its sides from the floor up.
pub fn drawers(piece: &mut Piece, [x, y]: [f64; 2], [width, depth, height]: [f64; 3], count: u32) {
    let body = lacquer(piece);
    let knob = metal(piece);
    piece.standing([x, y, 0.04], [width, depth, height - 0.04], body);
    let each = (height - 0.06) / f64::from(count);
    for index in 0..count {
        let z = 0.05 + each * (f64::from(index) + 0.5);
        let front = y + depth / 2.0;
        piece.cuboid([x, front + 0.008, z], [width - 0.02, 0.016, each - 0.014], body);
        piece.rod([x - 0.06, front + 0.03, z], [x + 0.06, front + 0.03, z], 0.006, knob);
    }
}

/// A small table beside a bed, with a lamp.
pub fn nightstand(piece: &mut Piece, [width, depth]: [f64; 2]) {
    drawers(piece, [0.0, depth / 2.0], [width, depth - 0.04, 0.5], 2);
    lamp_on(piece, [0.0, depth / 2.0 - 0.03, 0.5]);
    books_lying(piece, [0.06, depth / 2.0 + 0.09, 0.5]);
}

/// A small table for a hall, with a bowl and a vase.
pub fn console(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let wood = wood(piece, 0);
    piece.rounded([0.0, depth / 2.0, 0.8], [width, depth, 0.03], 0.008, wood);
    piece.cuboid([0.0, depth / 2.0, 0.2], [width - 0.06, depth - 0.06, 0.02], wood);
    for x in [-1.0, 1.0] {
        for y in [0.03, depth - 0.03] {
            piece.standing([x * (width / 2.0 - 0.03), y, 0.0], [0.035, 0.035, 0.785], wood);
        }
    }
    vase(piece, [width * 0.28, depth / 2.0, 0.815]);
    bowl(piece, [-width * 0.25, depth / 2.0, 0.815]);
    let basket = Material::of(Pattern::Cloth, srgb(0x00B0_8D5E), srgb(0x0076_5B36));
    let basket = piece.paint(basket);
    piece.tapered([0.0, depth / 2.0, 0.21], [0.11, 0.13], 0.2, basket);
}
