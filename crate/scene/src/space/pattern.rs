//! Patterns: colour as a function of the position on a surface.

use nalgebra::{Vector2, Vector3};

use super::material::{Color, Material, Pattern};
use super::noise::{hashed, rough, smooth};

impl Material {
    /// Share of the light that comes back, at a point of the surface with this normal, both in the frame that the
    /// pattern is laid out in.
    pub fn albedo(&self, p: &Vector3<f64>, normal: &Vector3<f64>) -> Color {
        color(self, p, normal)
    }
}

/// Colour at a point of a surface.
fn color(material: &Material, p: &Vector3<f64>, normal: &Vector3<f64>) -> Color {
    let Material { base, second, seed, .. } = *material;
    let uv = planar(p, normal);
    match material.pattern {
        Pattern::Plain => base,
        Pattern::Plaster => base * (0.96 + 0.08 * rough(&(p * 3.0), seed)),
        Pattern::Stripes(width) => {
            let stripe = ((uv.x / width).floor() as i64).rem_euclid(2) == 0;
            let paper = 0.97 + 0.06 * smooth(&(p * 160.0), seed);
            if stripe { base * paper } else { second * paper }
        }
        Pattern::Motif(distance) => motif(material, &uv, distance),
        Pattern::Planks(size) => planks(material, &uv, size),
        Pattern::Tiles { side, checkered } => tiles(material, &uv, side, checkered),
        Pattern::Bricks([length, height]) => {
            let row = (uv.y / height).floor();
            let along = uv.x / length + 0.5 * row;
            let (joint_x, joint_y) = (edge(along) * length, edge(uv.y / height) * height);
            if joint_x.min(joint_y) < 0.005 {
                return second * (0.9 + 0.2 * smooth(&(p * 90.0), seed));
            }
            let brick = hashed(along.floor() as i64, row as i64, 0, seed);
            base * (0.7 + 0.45 * brick) * (0.88 + 0.24 * rough(&(p * 40.0), seed))
        }
        Pattern::Grain(axis) => {
            let stretch = Vector3::from_fn(|row, _| if row == axis { 1.5 } else { 22.0 });
            let rings = rough(&p.component_mul(&stretch), seed);
            let lines = smooth(&(p.component_mul(&stretch) * 7.0), seed ^ 1);
            mix(&base, &second, ripple(rings * 5.0) * 0.75 + lines * 0.25)
        }
        Pattern::Cloth => {
            let weave = 0.5 * (ripple(uv.x * 140.0) + ripple(uv.y * 140.0));
            mix(&base, &second, 0.25 * weave + 0.5 * rough(&(p * 14.0), seed)) * (0.92 + 0.08 * weave)
        }
        Pattern::Carpet => mix(&base, &second, 0.6 * rough(&(p * 110.0), seed) + 0.4 * rough(&(p * 7.0), seed)),
        Pattern::Rug(half) => rug(material, p, half),
        Pattern::Speckled => {
            let speck = smooth(&(p * 170.0), seed);
            let ground = base * (0.9 + 0.2 * rough(&(p * 12.0), seed));
            if speck > 0.74 { mix(&ground, &second, 0.8) } else { ground }
        }
        Pattern::Veined => {
            let bent = p * 2.4 + Vector3::repeat(1.6) * rough(&(p * 3.0), seed);
            let vein = 1.0 - 2.0 * (rough(&bent, seed ^ 7) - 0.5).abs() * 7.0;
            mix(&base, &second, vein.max(0.0) * 0.6)
        }
        Pattern::Picture(half) => picture(material, p.x / half[0], p.z / half[1]),
        Pattern::Spine(half) => {
            let at = p.z / half;
            let band = |middle: f64, reach: f64| (at - middle).abs() < reach;
            let title = band(0.3, 0.28) && (at * half * 220.0).sin_like() > 0.1;
            let printed = band(-0.78, 0.04) || band(0.82, 0.03) || title;
            if printed { second } else { base * (0.92 + 0.16 * smooth(&(p * 60.0), seed)) }
        }
        Pattern::Outdoors([low, high]) => outdoors(material, p, (p.z - low) / (high - low)),
        Pattern::Leaf => {
            let vein = edge(p.x * 9.0 + p.y.abs() * 6.0);
            mix(&base, &second, 0.7 * rough(&(p * 16.0), seed) + 0.3 * vein)
        }
    }
}

/// The two coordinates along the surface; the second one upwards where it stands.
fn planar(p: &Vector3<f64>, normal: &Vector3<f64>) -> Vector2<f64> {
    match normal.iamax() {
        0 => Vector2::new(p.y, p.z),
        1 => Vector2::new(p.x, p.z),
        _ => Vector2::new(p.x, p.y),
    }
}

fn mix(a: &Color, b: &Color, share: f64) -> Color {
    a + (b - a) * share
}

/// Distance from the nearest whole number, 0 to 1/2.
fn edge(x: f64) -> f64 {
    (x - x.round()).abs()
}

/// A wave of period 1 between 0 and 1, made of parabolas.
fn ripple(x: f64) -> f64 {
    let t = 2.0 * edge(x);
    t * t * (3.0 - 2.0 * t)
}

/// Something like a sine, of period 2 pi.
trait SinLike {
    fn sin_like(self) -> f64;
}

impl SinLike for f64 {
    fn sin_like(self) -> f64 {
        2.0 * ripple(self / std::f64::consts::TAU) - 1.0
    }
}

fn planks(material: &Material, uv: &Vector2<f64>, [length, width]: [f64; 2]) -> Color {
    let Material { base, second, seed, .. } = *material;
    let row = (uv.y / width).floor();
    let shift = hashed(row as i64, 3, 0, seed);
    let along = uv.x / length + shift;
    let board = hashed(row as i64, along.floor() as i64, 1, seed);
    let gap = (edge(along) * length).min(edge(uv.y / width) * width);
    let grain = Vector3::new(uv.x * 1.3 + board * 40.0, uv.y * 26.0, board * 90.0);
    let rings = rough(&grain, seed);
    let lines = smooth(&Vector3::new(grain.x * 3.0, grain.y * 7.0, grain.z), seed ^ 1);
    let wood = mix(&base, &second, 0.55 * ripple(rings * 3.0) + 0.25 * lines + 0.2 * board) * (0.72 + 0.5 * board);
    if gap < 0.0025 { wood * 0.45 } else { wood }
}

fn tiles(material: &Material, uv: &Vector2<f64>, side: f64, checkered: bool) -> Color {
    let Material { base, second, seed, .. } = *material;
    let (column, row) = ((uv.x / side).floor() as i64, (uv.y / side).floor() as i64);
    let joint = edge(uv.x / side).min(edge(uv.y / side)) * side;
    if joint < 0.003 {
        return Color::repeat(0.30);
    }
    let odd = checkered && (column + row).rem_euclid(2) == 1;
    let p = Vector3::new(uv.x, uv.y, hashed(column, row, 0, seed) * 50.0);
    let shade = 0.86 + 0.16 * hashed(column, row, 5, seed) + 0.12 * (rough(&(p * 9.0), seed) - 0.5);
    (if odd { second } else { base }) * shade
}

/// Small lozenges in staggered rows, with a dot in the middle.
fn motif(material: &Material, uv: &Vector2<f64>, distance: f64) -> Color {
    let row = (uv.y / distance).floor();
    let x = uv.x / distance + 0.5 * row;
    let (dx, dy) = (x - x.floor() - 0.5, uv.y / distance - row - 0.5);
    let lozenge = dx.abs() + 0.6 * dy.abs();
    let inside = lozenge < 0.26 && lozenge > 0.17 || lozenge < 0.07;
    let paper = 0.97 + 0.06 * smooth(&Vector3::new(uv.x * 150.0, uv.y * 150.0, 0.0), material.seed);
    (if inside { material.second } else { material.base }) * paper
}

fn rug(material: &Material, p: &Vector3<f64>, half: [f64; 2]) -> Color {
    let Material { base, second, seed, .. } = *material;
    let inset = (half[0] - p.x.abs()).min(half[1] - p.y.abs());
    let pile = 0.82 + 0.3 * rough(&(p * 120.0), seed);
    let field = match seed % 3 {
        0 => {
            let (a, b) = (edge(p.x * 2.6 + p.y * 2.6), edge(p.x * 2.6 - p.y * 2.6));
            if a.min(b) < 0.1 || a.max(b) > 0.42 { second } else { base }
        }
        1 => {
            let stripe = hashed((p.x * 11.0).floor() as i64, 0, 0, seed);
            mix(&base, &second, stripe)
        }
        _ => mix(&base, &second, ripple(rough(&(p * 2.2), seed) * 6.0)),
    };
    let border = inset < 0.05 || (0.09..0.11).contains(&inset);
    (if border { second } else { field }) * pile
}

/// A framed picture, one of four kinds; `x` and `y` reach from -1 to 1.
fn picture(material: &Material, x: f64, y: f64) -> Color {
    let Material { base, second, seed, .. } = *material;
    let random = |index: i64| hashed(index, 11, 0, seed);
    let tone = |index: i64| Vector3::new(random(index), random(index + 1), random(index + 2)).map(|c| 0.05 + 0.6 * c);
    if x.abs() > 0.84 || y.abs() > 0.84 {
        return Color::repeat(0.78); // the mount
    }
    match seed % 4 {
        0 => {
            // Hills behind hills under a sky.
            for ridge in 0..4 {
                let height = -0.7 + 0.32 * f64::from(3 - ridge);
                let line = smooth(&Vector3::new(x * 1.7 + f64::from(ridge) * 9.0, f64::from(ridge), 0.0), seed);
                if ridge < 4 && y < height + 0.5 * (line - 0.3) - 0.25 * f64::from(ridge) + 0.4 {
                    return mix(&base, &second, f64::from(ridge) / 3.0);
                }
            }
            mix(&Vector3::new(0.75, 0.6, 0.45), &Vector3::new(0.25, 0.45, 0.7), f64::midpoint(y, 1.0))
        }
        1 => {
            // Fields of colour with black bars.
            let (a, b) = (random(1) - 0.5, random(2) - 0.5);
            if (x - a).abs() < 0.035 || (y - b).abs() < 0.035 || (y + 0.6 * a).abs() < 0.03 && x > a {
                return Color::repeat(0.03);
            }
            match (x > a, y > b) {
                (true, true) => base,
                (false, false) => second,
                (true, false) if y < -0.6 * a => tone(20),
                _ => Color::repeat(0.8),
            }
        }
        2 => {
            // Discs.
            let mut ground = Color::repeat(0.7);
            for disc in 0..7 {
                let at = |index: i64| 1.3 * (random(10 * disc + index) - 0.5);
                let (dx, dy) = (x - at(1), y - at(2));
                let radius = 0.12 + 0.35 * random(10 * disc + 3);
                if dx * dx + dy * dy < radius * radius {
                    ground = mix(&tone(10 * disc + 4), if disc % 2 == 0 { &base } else { &second }, 0.5);
                }
            }
            ground
        }
        _ => {
            // Strokes that flow.
            let p = Vector3::new(x * 1.6, y * 1.6, 0.0);
            let bend = smooth(&p, seed) * 2.5;
            let stroke = rough(&Vector3::new(p.x * 2.0 + bend, p.y * 6.0 + bend * 4.0, 0.0), seed);
            mix(&mix(&base, &second, ripple(stroke * 2.0)), &tone(31), smooth(&(p * 1.3), seed ^ 5) * 0.6)
        }
    }
}

/// Sky over trees; `height` is 0 at the lower edge of the window and 1 at the upper.
fn outdoors(material: &Material, p: &Vector3<f64>, height: f64) -> Color {
    let Material { base, second, seed, .. } = *material;
    let across = p.x + p.y; // one of them is constant along a window
    let crowns = 0.28 + 0.35 * rough(&Vector3::new(across * 1.7, 0.0, 0.0), seed);
    let leaves = rough(&Vector3::new(across * 9.0, p.z * 9.0, 0.0), seed);
    let blend = ((height - crowns) * 9.0 + 2.4 * (leaves - 0.5)).clamp(0.0, 1.0);
    let trees = second * (0.5 + 0.8 * leaves);
    let clouds = rough(&Vector3::new(across * 1.1, p.z * 2.6, 4.0), seed);
    let sky = mix(&base, &Color::repeat(1.0), ((clouds - 0.35) * 2.0).clamp(0.0, 1.0) * 0.7 + 0.25 * (1.0 - height));
    mix(&trees, &sky, blend)
}
