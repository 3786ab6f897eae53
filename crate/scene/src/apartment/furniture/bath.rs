//! Bathroom fittings.

use super::super::super::space::{Material, srgb};
use super::super::builder::Piece;
use super::{cloth, lacquer, metal};

/// A bathtub, its long side at the wall.
pub fn tub(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let (enamel, steel) = (china(piece), metal(piece));
    let rim = 0.07;
    piece.rounded([0.0, depth / 2.0, 0.14], [width, depth, 0.28], 0.03, enamel);
    for y in [rim / 2.0, depth - rim / 2.0] {
        piece.rounded([0.0, y, 0.39], [width, rim, 0.36], 0.03, enamel);
    }
    for side in [-1.0, 1.0] {
        piece.rounded([side * (width - rim) / 2.0, depth / 2.0, 0.39], [rim, depth, 0.36], 0.03, enamel);
    }
    let water = piece.paint(Material::plain(srgb(0x00B9_D6D8)).glossy(0.6));
    piece.standing([0.0, depth / 2.0, 0.28], [width - 2.0 * rim, depth - 2.0 * rim, 0.09], water);
    piece.rod([0.0, 0.02, 0.72], [0.0, 0.2, 0.7], 0.018, steel);
    piece.rod([0.28, 0.02, 0.72], [0.28, 0.03, 1.9], 0.011, steel);
    piece.rod([0.28, 0.03, 1.9], [0.28, 0.22, 1.92], 0.011, steel);
    piece.tapered([0.28, 0.24, 1.86], [0.06, 0.02], 0.06, steel);
    let towel = cloth(piece);
    piece.rounded([-width * 0.3, depth - rim / 2.0, 0.47], [0.4, rim + 0.04, 0.24], 0.02, towel);
}

/// A basin on a cupboard under a mirror.
pub fn basin(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let (enamel, steel, body) = (china(piece), metal(piece), lacquer(piece));
    piece.standing([0.0, depth / 2.0 - 0.02, 0.2], [width, depth - 0.04, 0.56], body);
    for x in [-1.0, 1.0] {
        piece.standing([x * width / 4.0, depth - 0.036, 0.22], [width / 2.0 - 0.012, 0.018, 0.52], body);
        piece.ball([x * 0.05, depth - 0.015, 0.5], [0.012; 3], steel);
    }
    piece.rounded([0.0, depth / 2.0, 0.81], [width + 0.02, depth, 0.1], 0.03, enamel);
    piece.ball([0.0, depth / 2.0 + 0.03, 0.86], [width * 0.36, depth * 0.33, 0.012], steel);
    piece.rod([0.0, 0.07, 0.85], [0.0, 0.07, 1.0], 0.014, steel);
    piece.rod([0.0, 0.07, 1.0], [0.0, 0.2, 0.97], 0.012, steel);
    let mirror = piece.paint(Material::plain(srgb(0x009A_A6AA)).glossy(0.95));
    piece.cuboid([0.0, 0.012, 1.5], [width + 0.04, 0.024, 0.74], body);
    piece.cuboid([0.0, 0.026, 1.5], [width - 0.02, 0.006, 0.68], mirror);
    for (x, height) in [(-0.2, 0.14), (-0.27, 0.1), (0.24, 0.17)] {
        let color = piece.choose(&[0x00D0_6A5A, 0x006A_98A8, 0x00E8_DFC0, 0x005E_7A52]);
        let bottle = piece.paint(Material::plain(srgb(color)).glossy(0.2));
        piece.post([x, 0.09, 0.86], 0.028, height, bottle);
    }
}

/// A toilet with its cistern at the wall.
pub fn toilet(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let enamel = china(piece);
    piece.rounded([0.0, 0.1, 0.6], [width, 0.18, 0.42], 0.03, enamel);
    piece.rounded([0.0, 0.3, 0.2], [0.24, 0.44, 0.4], 0.08, enamel);
    piece.ball([0.0, depth / 2.0 + 0.1, 0.4], [width / 2.0, depth / 2.0 - 0.08, 0.07], enamel);
    piece.rounded([0.0, depth / 2.0 + 0.06, 0.45], [width - 0.04, depth - 0.22, 0.04], 0.018, enamel);
}

fn china(piece: &mut Piece) -> super::Paint {
    piece.paint(Material::plain(srgb(0x00F0_EFEB)).glossy(0.3))
}
