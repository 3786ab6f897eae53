//! Beds.

use super::super::super::space::{Material, Pattern, srgb};
use super::super::builder::Piece;
use super::{cloth, cloth_color, wood};

/// A bed with its head at the wall.
pub fn bed(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let frame = wood(piece, 0);
    let head = piece.uniform(0.9, 1.15);
    piece.rounded([0.0, 0.03, head / 2.0], [width, 0.06, head], 0.02, frame);
    piece.cuboid([0.0, depth / 2.0, 0.25], [width, depth - 0.02, 0.14], frame);
    for x in [-1.0, 1.0] {
        piece.standing([x * (width / 2.0 - 0.05), depth - 0.06, 0.0], [0.07, 0.07, 0.2], frame);
    }
    let linen = srgb(piece.choose(&[0x00EF_ECE6, 0x00DC_E0E4, 0x00E6_DCCC]));
    let sheet = piece.paint(Material::of(Pattern::Cloth, linen, linen * 0.9));
    piece.rounded([0.0, depth / 2.0 + 0.02, 0.41], [width - 0.04, depth - 0.08, 0.2], 0.06, sheet);
    let color = cloth_color(piece);
    let stripes = piece.happens(0.5);
    let duvet = if stripes {
        Material::of(Pattern::Stripes(0.09), linen, color)
    } else {
        Material::of(Pattern::Cloth, color, color * 0.7)
    };
    let duvet = piece.paint(duvet);
    let (from, to) = (0.62, depth - 0.02);
    piece.rounded([0.0, f64::midpoint(from, to), 0.52], [width + 0.05, to - from, 0.1], 0.05, duvet);
    for x in [-1.0, 1.0] {
        piece.rounded([x * (width / 2.0 + 0.015), f64::midpoint(from, to), 0.4], [0.06, to - from, 0.28], 0.028, duvet);
    }
    for fold in 0..5 {
        let (x, y) = (piece.uniform(-0.4, 0.4) * width, piece.uniform(from + 0.25, to - 0.2));
        let (long, turn) = (piece.uniform(0.2, 0.4), piece.uniform(-1.5, 1.5));
        let thick = 0.014 + 0.003 * f64::from(fold);
        piece.ball_turned([x, y, 0.565], [long, 0.07, thick], [0.0, turn], duvet);
    }
    let pillows = if width > 1.2 { 2 } else { 1 };
    for index in 0..pillows {
        let x = width * ((f64::from(index) + 0.5) / f64::from(pillows) - 0.5);
        let turn = piece.uniform(-0.1, 0.1);
        piece.rounded_turned([x, 0.32, 0.6], [0.62, 0.4, 0.16], 0.078, [0.25, turn], sheet);
        let cover = cloth(piece);
        piece.rounded_turned([x, 0.52, 0.63], [0.4, 0.14, 0.36], 0.068, [-0.75, turn * 3.0], cover);
    }
}
