//! Sofas, armchairs, chairs.

use super::super::builder::{Paint, Piece};
use super::{cloth, lacquer, metal, wood};

/// A sofa with cushions.
pub fn sofa(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let (cover, legs) = (cloth(piece), wood(piece, 2));
    let arm = 0.16;
    piece.rounded([0.0, depth / 2.0, 0.24], [width, depth - 0.04, 0.26], 0.05, cover);
    piece.rounded_turned([0.0, 0.13, 0.55], [width - 0.1, 0.22, 0.56], 0.09, [-0.12, 0.0], cover);
    for side in [-1.0, 1.0] {
        let x = side * (width - arm) / 2.0;
        piece.rounded([x, depth / 2.0, 0.36], [arm, depth, 0.5], 0.07, cover);
        for y in [0.07, depth - 0.07] {
            piece.tapered([side * (width / 2.0 - 0.09), y, 0.0], [0.018, 0.026], 0.13, legs);
        }
    }
    let seats = if width > 1.7 { 3 } else { 2 };
    let seat = (width - 2.0 * arm) / f64::from(seats);
    for index in 0..seats {
        let x = -width / 2.0 + arm + seat * (f64::from(index) + 0.5);
        piece.rounded([x, 0.2 + (depth - 0.2) / 2.0, 0.42], [seat - 0.015, depth - 0.2, 0.16], 0.06, cover);
        piece.rounded_turned([x, 0.31, 0.66], [seat - 0.03, 0.16, 0.4], 0.075, [-0.2, 0.0], cover);
    }
    for _ in 0..3 {
        let pillow = cloth(piece);
        let (x, turn) = (piece.uniform(-0.36, 0.36) * width, piece.uniform(-0.4, 0.4));
        let size = piece.uniform(0.36, 0.46);
        piece.rounded_turned([x, 0.46, 0.66], [size, 0.13, size], 0.065, [-0.4, turn], pillow);
    }
    if piece.happens(0.6) {
        let blanket = cloth(piece);
        let x = piece.choose(&[-1.0, 1.0]) * (width / 2.0 - arm - 0.2);
        piece.rounded([x, depth / 2.0 + 0.12, 0.507], [0.38, depth - 0.2, 0.03], 0.012, blanket);
        piece.rounded([x, depth + 0.01, 0.36], [0.38, 0.03, 0.3], 0.012, blanket);
    }
}

/// An armchair.
pub fn armchair(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let (cover, legs) = (cloth(piece), wood(piece, 2));
    piece.rounded([0.0, depth / 2.0 + 0.03, 0.33], [width - 0.14, depth - 0.1, 0.22], 0.07, cover);
    piece.rounded_turned([0.0, 0.15, 0.62], [width - 0.1, 0.2, 0.68], 0.09, [-0.2, 0.0], cover);
    for side in [-1.0, 1.0] {
        piece.rounded([side * (width / 2.0 - 0.06), depth / 2.0, 0.42], [0.12, depth - 0.08, 0.36], 0.055, cover);
        for y in [0.1, depth - 0.1] {
            piece.tapered([side * (width / 2.0 - 0.1), y, 0.0], [0.016, 0.026], 0.26, legs);
        }
    }
    let pillow = cloth(piece);
    piece.rounded_turned([0.0, 0.35, 0.6], [0.4, 0.12, 0.36], 0.06, [-0.3, 0.1], pillow);
}

/// What the chairs of one set have in common.
#[derive(Debug, Clone, Copy)]
pub struct ChairSet {
    frame: Paint,
    seat: Paint,
    slats: bool,
}

/// Paints for a set of chairs.
pub fn chair_set(piece: &mut Piece) -> ChairSet {
    let frame = if piece.happens(0.7) { wood(piece, 2) } else { lacquer(piece) };
    let seat = if piece.happens(0.5) { cloth(piece) } else { frame };
    ChairSet { frame, seat, slats: piece.happens(0.5) }
}

/// A chair whose seat is in the middle of `at`, turned so that it looks along (-sin, cos) of the angle.
pub fn chair(piece: &mut Piece, set: &ChairSet, [x, y]: [f64; 2], turn: f64) {
    let (sin, cos) = (libm::sin(turn), libm::cos(turn));
    let at = |across: f64, ahead: f64, z: f64| [x + cos * across - sin * ahead, y + sin * across + cos * ahead, z];
    let (half, back) = (0.19, -0.19);
    for side in [-half, half] {
        piece.rod(at(side, 0.18, 0.0), at(side * 0.95, 0.17, 0.44), 0.017, set.frame);
        piece.rod(at(side, back - 0.03, 0.0), at(side, back, 0.46), 0.017, set.frame);
        piece.rod(at(side, back, 0.46), at(side * 0.95, back - 0.08, 0.9), 0.016, set.frame);
        piece.rod(at(side, back - 0.01, 0.2), at(side, 0.175, 0.2), 0.01, set.frame);
    }
    piece.rounded_turned(at(0.0, 0.0, 0.455), [0.44, 0.42, 0.04], 0.018, [0.0, turn], set.seat);
    if set.slats {
        for slat in 0..4 {
            let across = -0.12 + 0.08 * f64::from(slat);
            piece.rod(at(across, back - 0.005, 0.47), at(across, back - 0.075, 0.86), 0.009, set.frame);
        }
        piece.rod(at(-half, back - 0.08, 0.88), at(half, back - 0.08, 0.88), 0.022, set.frame);
    } else {
        piece.rounded_turned(at(0.0, back - 0.06, 0.74), [0.4, 0.03, 0.3], 0.014, [0.17, turn], set.seat);
    }
}

/// A stool.
pub fn stool(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let wood = wood(piece, 2);
    for [x, y] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
        let foot = [x * width * 0.42, depth / 2.0 + y * depth * 0.42, 0.0];
        piece.rod(foot, [x * width * 0.28, depth / 2.0 + y * depth * 0.28, 0.44], 0.016, wood);
    }
    piece.post([0.0, depth / 2.0, 0.43], width / 2.0, 0.035, wood);
}

/// A chair on castors.
pub fn office_chair(piece: &mut Piece, [x, y]: [f64; 2], turn: f64) {
    let (cover, frame) = (cloth(piece), metal(piece));
    for arm in 0..5 {
        let angle = turn + std::f64::consts::TAU * f64::from(arm) / 5.0;
        let foot = [x + 0.28 * libm::cos(angle), y + 0.28 * libm::sin(angle), 0.06];
        piece.rod([x, y, 0.1], foot, 0.017, frame);
        piece.ball([foot[0], foot[1], 0.03], [0.03; 3], frame);
    }
    piece.post([x, y, 0.1], 0.025, 0.34, frame);
    let (sin, cos) = (libm::sin(turn), libm::cos(turn));
    piece.rounded_turned([x, y, 0.48], [0.5, 0.48, 0.09], 0.04, [0.0, turn], cover);
    piece.rounded_turned([x + sin * 0.25, y - cos * 0.25, 0.83], [0.44, 0.07, 0.5], 0.034, [0.15, turn], cover);
    piece.rod([x + sin * 0.2, y - cos * 0.2, 0.46], [x + sin * 0.27, y - cos * 0.27, 0.7], 0.02, frame);
    for side in [-1.0, 1.0] {
        let (ax, ay) = (x + cos * 0.27 * side, y + sin * 0.27 * side);
        piece.rod([ax, ay, 0.48], [ax, ay, 0.66], 0.014, frame);
        piece.rounded_turned([ax, ay, 0.67], [0.06, 0.26, 0.03], 0.014, [0.0, turn], frame);
    }
}
