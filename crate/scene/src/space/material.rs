//! Materials of surfaces.

use nalgebra::Vector3;

/// Red, green and blue, linear in light.
pub type Color = Vector3<f64>;

/// A colour from the way it is written for screens, `0xRRGGBB`.
pub fn srgb(hex: u32) -> Color {
    let channel = |shift: u32| {
        let value = f64::from((hex >> shift) & 0xFF) / 255.0;
        libm::pow(value, 2.2)
    };
    Vector3::new(channel(16), channel(8), channel(0))
}

/// How colour varies over a surface. Lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pattern {
    /// Not at all.
    Plain,
    /// Hand-laid plaster: faint clouds.
    Plaster,
    /// Wallpaper with stripes so wide.
    Stripes(f64),
    /// Wallpaper with a small motif at such distances.
    Motif(f64),
    /// Floor boards of this length and width.
    Planks([f64; 2]),
    /// Square tiles of this side, every other one in the second colour if so.
    Tiles {
        /// Side of a tile.
        side: f64,
        /// Whether they alternate.
        checkered: bool,
    },
    /// Bricks of this length and height.
    Bricks([f64; 2]),
    /// Wood with its grain along this axis of the solid.
    Grain(usize),
    /// Woven cloth.
    Cloth,
    /// Long pile.
    Carpet,
    /// A rug of these half sides, with a border and a field of diamonds.
    Rug([f64; 2]),
    /// Stone with specks.
    Speckled,
    /// Stone with veins.
    Veined,
    /// A picture of these half sides, across and upwards.
    Picture([f64; 2]),
    /// The back of a book of this half height.
    Spine(f64),
    /// What is to be seen through a window up to these heights: the lower and the upper edge.
    Outdoors([f64; 2]),
    /// Leaves with veins.
    Leaf,
}

/// Colour, and how a surface answers to light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// How the colours are laid out.
    pub pattern: Pattern,
    /// The ground.
    pub base: Color,
    /// The figure.
    pub second: Color,
    /// What is random in the pattern.
    pub seed: u64,
    /// Whether the pattern goes on from solid to solid, as on walls, floors and ceilings.
    pub continues: bool,
    /// Share of the light mirrored, 0 matt to 1 a mirror.
    pub gloss: f64,
    /// Light given off, as a multiple of the colour.
    pub glow: f64,
    /// Panes and lampshades let light through.
    pub casts_shadow: bool,
}

impl Material {
    /// A matt material of one colour.
    pub fn plain(base: Color) -> Self {
        Self::of(Pattern::Plain, base, base)
    }

    /// A matt material.
    pub fn of(pattern: Pattern, base: Color, second: Color) -> Self {
        Self { pattern, base, second, seed: 0, continues: false, gloss: 0.0, glow: 0.0, casts_shadow: true }
    }

    /// The same, mirroring this share of the light.
    #[must_use]
    pub fn glossy(self, gloss: f64) -> Self {
        Self { gloss, ..self }
    }

    /// The same with other randomness.
    #[must_use]
    pub fn seeded(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// The same, going on from solid to solid.
    #[must_use]
    pub fn continuing(self) -> Self {
        Self { continues: true, ..self }
    }

    /// The same, giving off so many times its colour, and casting no shadow.
    #[must_use]
    pub fn glowing(self, glow: f64) -> Self {
        Self { glow, casts_shadow: false, ..self }
    }
}
