//! Shading of a surface: lamps, windows and the sun with their shadows, ambient light, and reflections.
//!
//! Areas are lit by few rays: one of eight by eight patterns at each pixel, so that the mean over eight by eight neighbours
//! is the mean over all of them.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use nalgebra::Vector3;

use super::light::across;
use super::material::Color;
use super::{Hit, Space};

/// A place that a ray has met.
#[derive(Debug, Clone, Copy)]
pub struct Surface {
    /// Index of the solid.
    pub solid: usize,
    /// Where (m).
    pub point: Vector3<f64>,
    /// Unit normal.
    pub normal: Vector3<f64>,
    /// Unit vector that the ray came along.
    pub sight: Vector3<f64>,
}

/// Light at a place, before the surface gives it a colour.
#[derive(Debug, Clone, Copy, Default)]
pub struct Illumination {
    /// What falls on the surface.
    pub irradiance: Color,
    /// What a mirror there would show, as far as the surface is one.
    pub mirrored: Color,
}

/// What shaded the places before: the next place is likely to lie in the same shadows.
#[derive(Debug, Clone, Default)]
pub struct Shades {
    around: Option<usize>,
    of_lights: Vec<Option<usize>>,
    of_sun: Option<usize>,
}

/// Patterns along a row of pixels, and along a column.
pub const SIDE: usize = 8;
/// Patterns of rays.
pub const NUM_PATTERNS: usize = SIDE * SIDE;
/// Rays that look, at each pixel, how open the place is.
const OPENNESS_RAYS: usize = 2;
/// The longest of them (m).
const OPENNESS_REACH: f64 = 1.3;
/// Light that comes from everywhere: from above and from below.
const FROM_ABOVE: [f64; 3] = [0.50, 0.49, 0.47];
const FROM_BELOW: [f64; 3] = [0.40, 0.36, 0.31];
/// Less light than this is left out; it fades in up to three times as much.
const FAINT: f64 = 0.01;
/// A sunbeam is followed so far (m).
const SUNBEAM: f64 = 40.0;
/// Surfaces are left by this before light is looked for (m).
const LIFT: f64 = 1e-5;

/// Directions over the half space about z, more of them towards z, each as long as it looks (m), pattern by pattern.
static OPENNESS: LazyLock<Vec<[Vector3<f64>; OPENNESS_RAYS]>> = LazyLock::new(|| {
    let ray = |pattern: usize, ray: usize| {
        // Strata of direction, of height over the surface, and of length: near things darken more than far ones.
        let [a, b] = strata(pattern);
        let c = ((pattern * 11 + ray * 5) % 16) as f64 / 16.0 + 1.0 / 32.0;
        let angle = TAU * (a + 0.5 * ray as f64 + b / 8.0);
        let sq_radius = (b + if ray == 0 { 0.0 } else { 1.0 - 2.0 * b }).clamp(0.0, 0.99);
        let radius = sq_radius.sqrt();
        let direction = Vector3::new(radius * libm::cos(angle), radius * libm::sin(angle), (1.0 - sq_radius).sqrt());
        direction * (OPENNESS_REACH * c)
    };
    (0..NUM_PATTERNS).map(|pattern| std::array::from_fn(|index| ray(pattern, index))).collect()
});

/// The middle of the pattern's square in the unit square.
fn strata(pattern: usize) -> [f64; 2] {
    let share = |index: usize| (index as f64 + 0.5) / SIDE as f64;
    [share(pattern % SIDE), share(pattern / SIDE % SIDE)]
}

impl Space {
    /// The place that a ray has met.
    pub(super) fn surface(&self, origin: &Vector3<f64>, direction: &Vector3<f64>, hit: &Hit) -> Surface {
        let point = origin + direction * hit.distance;
        let normal = self.solids[hit.solid].normal(&point);
        Surface { solid: hit.solid, point, normal, sight: direction.normalize() }
    }

    /// Share of light that the surface gives back.
    pub(super) fn albedo(&self, surface: &Surface) -> Color {
        let solid = &self.solids[surface.solid];
        let material = &self.materials[solid.material];
        if material.continues {
            material.albedo(&surface.point, &surface.normal)
        } else {
            let normal = solid.R_world_solid.tr_mul(&surface.normal);
            material.albedo(&solid.to_own_frame(&surface.point), &normal)
        }
    }

    /// Light at a place, by one pattern of rays.
    pub(super) fn illumination(&self, surface: &Surface, pattern: usize, shades: &mut Shades) -> Illumination {
        let material = &self.materials[self.solids[surface.solid].material];
        let from = surface.point + surface.normal * LIFT;
        let mut irradiance = self.all_round(surface, &from, pattern, &mut shades.around);
        shades.of_lights.resize(self.lights.len(), None);
        for (index, light) in self.lights.iter().enumerate() {
            let arriving = light.towards(&from, &surface.normal, strata(pattern + 5 * index));
            let strength = arriving.irradiance.max();
            if strength > FAINT && !self.is_shaded(&from, &(arriving.path * 0.999), &mut shades.of_lights[index]) {
                irradiance += arriving.irradiance * ((strength - FAINT) / (2.0 * FAINT)).min(1.0);
            }
        }
        let mirrored = if material.gloss > 0.0 { self.mirrored(surface, &from, pattern) } else { Color::zeros() };
        Illumination { irradiance, mirrored }
    }

    /// The sun's light, whose shadows are sharp.
    pub(super) fn sunlight(&self, surface: &Surface, shades: &mut Shades) -> Color {
        let Some(sun) = &self.sun else { return Color::zeros() };
        let cosine = surface.normal.dot(&sun.direction);
        let from = surface.point + surface.normal * LIFT;
        if cosine <= 0.0 || self.is_shaded(&from, &(sun.direction * SUNBEAM), &mut shades.of_sun) {
            return Color::zeros();
        }
        sun.irradiance * cosine
    }

    fn all_round(&self, surface: &Surface, from: &Vector3<f64>, pattern: usize, last: &mut Option<usize>) -> Color {
        let (u, v) = across(&surface.normal);
        let open = OPENNESS[pattern]
            .iter()
            .filter(|ray| !self.is_shaded(from, &(u * ray.x + v * ray.y + surface.normal * ray.z), last))
            .count();
        ambient(&surface.normal) * (open as f64 / OPENNESS_RAYS as f64)
    }

    /// What a surface that is not quite smooth mirrors.
    fn mirrored(&self, surface: &Surface, from: &Vector3<f64>, pattern: usize) -> Color {
        let gloss = self.materials[self.solids[surface.solid].material].gloss;
        let towards = surface.normal.dot(&surface.sight);
        let mirror = surface.sight - surface.normal * (2.0 * towards);
        let (u, v) = across(&mirror);
        let spread = 0.16 * (1.0 - gloss);
        let [a, b] = strata(pattern).map(|share| 2.0 * share - 1.0);
        let direction = mirror + (u * a + v * b) * spread;
        // Schlick, "An inexpensive BRDF model for physically-based rendering", CGF 13 (1994): more at grazing sight.
        let grazing = 1.0 - towards.abs();
        let sq = grazing * grazing;
        let share = gloss * gloss * 0.85 + 0.6 * gloss.min(0.7) * sq * sq * grazing;
        let Some(hit) = self.cast(from, &direction) else { return Color::zeros() };
        let seen = self.surface(from, &direction, &hit);
        let glow = self.materials[self.solids[seen.solid].material].glow;
        self.albedo(&seen).component_mul(&(ambient(&seen.normal) * 1.7 + Color::repeat(glow))) * share
    }
}

/// Light from all round on an open surface.
fn ambient(normal: &Vector3<f64>) -> Color {
    let up = f64::midpoint(normal.z, 1.0);
    Color::from(FROM_BELOW) * (1.0 - up) + Color::from(FROM_ABOVE) * up
}
