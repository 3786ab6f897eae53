//! Furniture, each piece in a frame of its own: x to the right along its back, y to the front, z up, the origin on the
//! floor in the middle of its back edge. Lengths in metres; `size` is width and depth.

pub mod bath;
pub mod beds;
pub mod decoration;
pub mod kitchen;
pub mod seats;
pub mod storage;
pub mod tables;

use super::super::space::{Color, Material, Pattern, srgb};
use super::builder::{Paint, Piece};

/// Furniture wood in one of several colours.
pub fn wood(piece: &mut Piece, axis: usize) -> Paint {
    let (light, dark) = piece.choose(&[
        (0x00C8_9D6C, 0x009A_7044),
        (0x008A_5A36, 0x0059_3519),
        (0x00DC_C39B, 0x00BB_9A6C),
        (0x005C_3B28, 0x0037_2116),
        (0x00B5_7F4C, 0x0085_5528),
    ]);
    piece.paint(Material::of(Pattern::Grain(axis), srgb(light), srgb(dark)).glossy(0.12))
}

/// White or coloured lacquer.
pub fn lacquer(piece: &mut Piece) -> Paint {
    let color = piece.choose(&[0x00EC_EAE6, 0x00E6_E3DA, 0x003B_4148, 0x0089_9A97, 0x00C9_C2B4]);
    piece.paint(Material::plain(srgb(color)).glossy(0.15))
}

/// Cloth for seats, beds and the like.
pub fn cloth(piece: &mut Piece) -> Paint {
    let color = cloth_color(piece);
    piece.paint(Material::of(Pattern::Cloth, color, color * 0.7))
}

/// Colour of a cloth.
pub fn cloth_color(piece: &mut Piece) -> Color {
    srgb(piece.choose(&[
        0x0052_6A7A,
        0x008C_8277,
        0x00A4_5A48,
        0x006B_7A58,
        0x00BB_9A54,
        0x0047_4B52,
        0x009A_A3A8,
        0x0075_4C5C,
        0x00C7_B8A0,
        0x003F_5C5A,
    ]))
}

/// Dull or polished metal.
pub fn metal(piece: &mut Piece) -> Paint {
    let color = piece.choose(&[0x00A6_A6A4, 0x0035_3536, 0x00B4_9658]);
    piece.paint(Material::plain(srgb(color)).glossy(0.4))
}
