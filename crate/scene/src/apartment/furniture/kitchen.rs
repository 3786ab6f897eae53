//! Kitchen fittings.

use super::super::super::space::{Color, Material, Pattern, srgb};
use super::super::builder::{Paint, Piece};
use super::decoration::{bowl, vase};
use super::metal;

/// Height of a worktop (m).
const TOP: f64 = 0.91;

struct Fittings {
    front: Paint,
    stone: Paint,
    steel: Paint,
    black: Paint,
    handle: Paint,
}

/// A row of cupboards under a worktop with sink, hob and oven, cupboards on the wall, and a fridge at one end.
pub fn counter(piece: &mut Piece, [width, depth]: [f64; 2]) {
    let front = piece.choose(&[0x00E4_E2DB, 0x005E_6F6A, 0x0038_4A5C, 0x00B3_9068, 0x00C3_B9A8]);
    let stone = piece.choose(&[
        Material::of(Pattern::Speckled, srgb(0x0048_4646), srgb(0x00A5_A19C)),
        Material::of(Pattern::Veined, srgb(0x00E4_E2DE), srgb(0x008C_8A8A)),
        Material::of(Pattern::Grain(0), srgb(0x00B8_8752), srgb(0x0088_5A30)),
    ]);
    let fittings = Fittings {
        front: piece.paint(Material::plain(srgb(front)).glossy(0.12)),
        stone: piece.paint(stone.glossy(0.25)),
        steel: piece.paint(Material::plain(srgb(0x00B5_B6B5)).glossy(0.45)),
        black: piece.paint(Material::plain(srgb(0x0014_1416)).glossy(0.5)),
        handle: metal(piece),
    };
    let fridge = 0.62;
    let flip = piece.choose(&[-1.0, 1.0]);
    tall_fridge(piece, &fittings, [flip * (width - fridge) / 2.0, depth / 2.0], fridge);
    let long = width - fridge - 0.01;
    let middle = -flip * (width - long) / 2.0;
    base_units(piece, &fittings, [middle, long], depth);
    wall_units(piece, &fittings, [middle, long]);
    on_top(piece, &fittings, [middle, long]);
}

fn tall_fridge(piece: &mut Piece, fittings: &Fittings, [x, y]: [f64; 2], side: f64) {
    piece.standing([x, y, 0.04], [side - 0.02, side - 0.06, 1.86], fittings.steel);
    for (low, high) in [(0.06, 0.68), (0.7, 1.88)] {
        let front = y + side / 2.0 - 0.02;
        piece.rounded([x, front, f64::midpoint(low, high)], [side - 0.03, 0.05, high - low], 0.012, fittings.steel);
        piece.rod(
            [x - 0.24, front + 0.05, low + 0.1],
            [x - 0.24, front + 0.05, high.min(1.2) - 0.1],
            0.011,
            fittings.handle,
        );
    }
}

fn base_units(piece: &mut Piece, fittings: &Fittings, [middle, long]: [f64; 2], depth: f64) {
    piece.standing([middle, depth / 2.0 - 0.06, 0.0], [long, depth - 0.14, 0.1], fittings.black);
    piece.standing([middle, depth / 2.0 - 0.02, 0.1], [long, depth - 0.05, TOP - 0.14], fittings.front);
    piece.rounded([middle, depth / 2.0, TOP - 0.02], [long, depth, 0.04], 0.006, fittings.stone);
    let units = (long / 0.55).floor().max(2.0);
    let each = long / units;
    let oven = units as usize / 2;
    let front = depth - 0.035;
    for unit in 0..units as usize {
        let x = middle - long / 2.0 + each * (unit as f64 + 0.5);
        if unit == oven {
            piece.standing([x, front, 0.14], [each - 0.01, 0.02, TOP - 0.2], fittings.steel);
            piece.standing([x, front + 0.012, 0.22], [each - 0.09, 0.008, 0.4], fittings.black);
            piece.rod([x - 0.2, front + 0.05, 0.68], [x + 0.2, front + 0.05, 0.68], 0.01, fittings.steel);
            for knob in 0..4 {
                let at = x - 0.15 + 0.1 * f64::from(knob);
                piece.rod([at, front, 0.77], [at, front + 0.035, 0.77], 0.017, fittings.black);
            }
            continue;
        }
        let splits: &[[f64; 2]] = if unit % 2 == 0 {
            &[[0.115, 0.64], [0.655, 0.86]]
        } else {
            &[[0.115, 0.36], [0.375, 0.61], [0.625, 0.86]]
        };
        for [low, high] in splits {
            piece.standing([x, front, *low], [each - 0.012, 0.02, high - low], fittings.front);
            let z = high - 0.05;
            piece.rod([x - 0.08, front + 0.035, z], [x + 0.08, front + 0.035, z], 0.007, fittings.handle);
        }
    }
}

fn wall_units(piece: &mut Piece, fittings: &Fittings, [middle, long]: [f64; 2]) {
    let tiles = Pattern::Tiles { side: 0.1, checkered: false };
    let color = piece.choose(&[0x00E6_E8E6, 0x0085_A5A8, 0x00C4_9A6C]);
    let tiles = piece.paint(Material::of(tiles, srgb(color), Color::zeros()).glossy(0.2));
    piece.standing([middle, 0.004, TOP], [long, 0.008, 0.54], tiles);
    let units = (long / 0.6).floor().max(2.0);
    let each = long / units;
    let hood = units as usize / 2;
    for unit in 0..units as usize {
        let x = middle - long / 2.0 + each * (unit as f64 + 0.5);
        if unit == hood {
            piece.standing([x, 0.2, 1.62], [each - 0.02, 0.4, 0.06], fittings.steel);
            piece.standing([x, 0.13, 1.68], [0.26, 0.24, 0.5], fittings.steel);
            continue;
        }
        piece.standing([x, 0.17, 1.46], [each - 0.004, 0.33, 0.7], fittings.front);
        piece.standing([x, 0.34, 1.466], [each - 0.014, 0.018, 0.688], fittings.front);
        piece.rod([x + each / 2.0 - 0.05, 0.365, 1.5], [x + each / 2.0 - 0.05, 0.365, 1.64], 0.007, fittings.handle);
    }
}

fn on_top(piece: &mut Piece, fittings: &Fittings, [middle, long]: [f64; 2]) {
    let units = (long / 0.55).floor().max(2.0);
    let each = long / units;
    let x = middle - long / 2.0 + each * ((units as usize / 2) as f64 + 0.5);
    piece.standing([x, 0.31, TOP], [each - 0.04, 0.5, 0.008], fittings.black);
    for [a, b] in [[-0.13, 0.2], [0.13, 0.2], [-0.13, 0.43], [0.13, 0.43]] {
        piece.post([x + a, b, TOP + 0.008], 0.08, 0.003, fittings.steel);
    }
    let pot = piece.choose(&[0x0092_2B26, 0x002C_3338, 0x00B7_B8B6]);
    let pot = piece.paint(Material::plain(srgb(pot)).glossy(0.3));
    piece.post([x - 0.13, 0.2, TOP + 0.011], 0.1, 0.14, pot);
    piece.post([x - 0.13, 0.2, TOP + 0.151], 0.012, 0.03, fittings.black);
    // Sink and tap.
    let sink = middle - long / 2.0 + each * 0.5;
    piece.standing([sink, 0.31, TOP], [0.42, 0.42, 0.006], fittings.steel);
    piece.standing([sink, 0.31, TOP + 0.006], [0.36, 0.34, 0.002], fittings.black);
    piece.rod([sink, 0.08, TOP], [sink, 0.08, TOP + 0.3], 0.013, fittings.steel);
    piece.rod([sink, 0.08, TOP + 0.3], [sink, 0.24, TOP + 0.26], 0.011, fittings.steel);
    let end = middle + long / 2.0 - 0.22;
    bowl(piece, [end, 0.3, TOP]);
    vase(piece, [end - 0.3, 0.16, TOP]);
    let board = super::wood(piece, 2);
    piece.turned([end - 0.1, 0.06, TOP + 0.17], [0.24, 0.018, 0.34], [-0.12, 0.0], board);
    let bottles = piece.choose(&[0x0034_5A33, 0x0093_5A1E]);
    let bottle = piece.paint(Material::plain(srgb(bottles)).glossy(0.5));
    for index in 0..3 {
        let at = [end - 0.48 + 0.085 * f64::from(index), 0.12, TOP];
        piece.post(at, 0.033, 0.19, bottle);
        piece.tapered([at[0], at[1], TOP + 0.19], [0.033, 0.013], 0.05, bottle);
        piece.post([at[0], at[1], TOP + 0.24], 0.013, 0.05, bottle);
    }
}
