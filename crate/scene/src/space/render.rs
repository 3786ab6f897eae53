//! Pictures and depth images of the world.

use nalgebra::Vector3;

use super::material::Color;
use super::shading::{Illumination, NUM_PATTERNS, SIDE, Shades, Surface};
use super::{Hit, Space};
use scanstitch::camera::Pinhole;
use scanstitch::geometry::{Pose3, RigidMotion};

/// A picture and its depth.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderedFrame {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green and blue of each pixel, row by row from the top.
    pub rgb: Vec<u8>,
    /// Exact depth along the optical axis at the middle of each pixel (m); infinite where there is nothing.
    pub depth: Vec<f64>,
}

/// Places within a pixel that its colour is the mean of (pixels).
const SUBPIXELS: [[f64; 2]; 4] = [[-0.125, -0.375], [0.375, -0.125], [-0.375, 0.125], [0.125, 0.375]];
/// Neighbours of a pixel share its light up to this distance from its plane, at a metre (m).
const SAME_PLANE: f64 = 0.01;
/// and up to this cosine between the normals.
const SAME_FACING: f64 = 0.95;

/// Where fewer of the neighbours share the plane, more are asked.
const FEW: f64 = 44.0;

/// What the middles of the pixels see.
struct View<'a> {
    space: &'a Space,
    camera: &'a Pinhole,
    T_world_camera: &'a Pose3,
    hits: Vec<Option<Hit>>,
}

impl Space {
    /// Exact depth along the optical axis at the middle of each pixel (m), row by row; infinite where there is nothing.
    /// `T_world_camera` has x right, y down, z forward.
    pub fn depth(&self, T_world_camera: &Pose3, camera: &Pinhole) -> Vec<f64> {
        View::new(self, T_world_camera, camera).depth()
    }

    /// The solid, and the point of its surface, that the pixel (u, v) sees.
    pub fn seen_at(&self, T_world_camera: &Pose3, camera: &Pinhole, u: f64, v: f64) -> Option<(usize, Vector3<f64>)> {
        let (origin, direction) = (T_world_camera.translation.vector, T_world_camera.rotate(&camera.ray(u, v)));
        let hit = self.cast(&origin, &direction)?;
        Some((hit.solid, origin + direction * hit.distance))
    }

    /// The picture and the depth.
    pub fn render(&self, T_world_camera: &Pose3, camera: &Pinhole) -> RenderedFrame {
        let view = View::new(self, T_world_camera, camera);
        let mut shades = Shades::default();
        let light = view.light(&mut shades);
        let pixels = (0..camera.height).flat_map(|v| (0..camera.width).map(move |u| (u, v)));
        let rgb = pixels.flat_map(|(u, v)| view.color(&light, u, v, &mut shades)).collect();
        RenderedFrame { width: camera.width, height: camera.height, rgb, depth: view.depth() }
    }
}

impl<'a> View<'a> {
    fn new(space: &'a Space, T_world_camera: &'a Pose3, camera: &'a Pinhole) -> Self {
        let mut view = Self { space, camera, T_world_camera, hits: Vec::new() };
        let origin = T_world_camera.translation.vector;
        let pixels = (0..camera.height).flat_map(|v| (0..camera.width).map(move |u| (u, v)));
        let mut last: Option<usize> = None;
        let mut hit = |(u, v): (usize, usize)| {
            let direction = view.direction(u as f64, v as f64);
            let hit = space.hierarchy.cast(&space.solids, &origin, &direction, last);
            last = hit.map(|hit| hit.solid);
            hit
        };
        view.hits = pixels.map(&mut hit).collect();
        view
    }

    fn direction(&self, u: f64, v: f64) -> Vector3<f64> {
        self.T_world_camera.rotate(&self.camera.ray(u, v))
    }

    /// Rays have z = 1 in the camera's frame: their parameter is the depth.
    fn depth(&self) -> Vec<f64> {
        self.hits.iter().map(|hit| hit.map_or(f64::INFINITY, |hit| hit.distance)).collect()
    }

    fn surface(&self, u: usize, v: usize) -> Option<Surface> {
        let hit = self.hits[v * self.camera.width + u].as_ref()?;
        let direction = self.direction(u as f64, v as f64);
        Some(self.space.surface(&self.T_world_camera.translation.vector, &direction, hit))
    }

    /// Light at every pixel: one pattern of rays each, then the mean over the neighbours on the same surface.
    fn light(&self, shades: &mut Shades) -> Vec<Option<(Surface, Illumination)>> {
        let (width, height) = (self.camera.width, self.camera.height);
        let single: Vec<Option<(Surface, Illumination)>> = (0..width * height)
            .map(|index| {
                let (u, v) = (index % width, index / width);
                let surface = self.surface(u, v)?;
                Some((surface, self.space.illumination(&surface, u % SIDE + SIDE * (v % SIDE), shades)))
            })
            .collect();
        let mut mean = |index: usize| {
            let (surface, _) = single[index]?;
            let within = SAME_PLANE * self.hits[index]?.distance.max(0.3);
            let gathered = self.gather(&single, index, &surface, within, SIDE / 2);
            let (sum, count) =
                if gathered.1 < FEW { self.gather(&single, index, &surface, within, SIDE) } else { gathered };
            let irradiance = sum.irradiance / count + self.space.sunlight(&surface, shades);
            Some((surface, Illumination { irradiance, mirrored: sum.mirrored / count }))
        };
        (0..width * height).map(&mut mean).collect()
    }

    /// Sum of the light of the neighbours on the same plane, and their number; a window of twice `half` pixels a side.
    fn gather(
        &self,
        single: &[Option<(Surface, Illumination)>],
        index: usize,
        surface: &Surface,
        within: f64,
        half: usize,
    ) -> (Illumination, f64) {
        let (width, height) = (self.camera.width, self.camera.height);
        let (u, v) = (index % width, index / width);
        let (mut sum, mut count) = (Illumination::default(), 0.0);
        for row in v.saturating_sub(half)..(v + half).min(height) {
            let columns = u.saturating_sub(half)..(u + half).min(width);
            for (other, light) in single[row * width..][columns].iter().flatten() {
                let same = other.normal.dot(&surface.normal) > SAME_FACING
                    && surface.normal.dot(&(other.point - surface.point)).abs() < within;
                if same {
                    sum.irradiance += light.irradiance;
                    sum.mirrored += light.mirrored;
                    count += 1.0;
                }
            }
        }
        (sum, count)
    }

    /// Colour of a pixel on the screen.
    fn color(&self, light: &[Option<(Surface, Illumination)>], u: usize, v: usize, shades: &mut Shades) -> [u8; 3] {
        let inside = self.is_inside_one_solid(u, v);
        let origin = self.T_world_camera.translation.vector;
        let mut sum = Color::zeros();
        for [du, dv] in SUBPIXELS {
            let direction = self.direction(u as f64 + du, v as f64 + dv);
            let alone = inside.and_then(|solid| {
                let distance = self.space.solids[solid].enter(&origin, &direction)?;
                Some(Hit { solid, distance })
            });
            let Some(hit) = alone.or_else(|| self.space.cast(&origin, &direction)) else { continue };
            let surface = self.space.surface(&origin, &direction, &hit);
            let illumination = self.light_on(light, &surface, [u, v], shades);
            let glow = self.space.materials[self.space.solids[hit.solid].material].glow;
            let albedo = self.space.albedo(&surface);
            let radiance = albedo.component_mul(&illumination.irradiance) + albedo * glow + illumination.mirrored;
            sum += radiance.map(on_screen);
        }
        let byte = |channel: f64| (channel * (255.0 / SUBPIXELS.len() as f64) + 0.5) as u8;
        [byte(sum.x), byte(sum.y), byte(sum.z)]
    }

    /// The solid that the pixel and all its neighbours see.
    fn is_inside_one_solid(&self, u: usize, v: usize) -> Option<usize> {
        let (width, height) = (self.camera.width, self.camera.height);
        let solid = self.hits[v * width + u]?.solid;
        let same = |hit: &Option<Hit>| hit.is_some_and(|hit| hit.solid == solid);
        let mut rows = v.saturating_sub(1)..(v + 2).min(height);
        rows.all(|row| self.hits[row * width..][u.saturating_sub(1)..(u + 2).min(width)].iter().all(same))
            .then_some(solid)
    }

    /// Light on a place within a pixel: that of the nearest neighbour on the same surface; where there is none, its own.
    fn light_on(
        &self,
        light: &[Option<(Surface, Illumination)>],
        surface: &Surface,
        [u, v]: [usize; 2],
        shades: &mut Shades,
    ) -> Illumination {
        let width = self.camera.width;
        let near = |u: usize, v: usize| {
            let (other, illumination) = light[v * width + u].as_ref()?;
            let same = other.solid == surface.solid && other.normal.dot(&surface.normal) > SAME_FACING;
            same.then_some(*illumination)
        };
        if let Some(own) = near(u, v) {
            return own;
        }
        for row in v.saturating_sub(1)..(v + 2).min(self.camera.height) {
            for column in u.saturating_sub(1)..(u + 2).min(width) {
                if let Some(other) = near(column, row) {
                    return other;
                }
            }
        }
        let mut sum = Illumination { irradiance: self.space.sunlight(surface, shades), mirrored: Color::zeros() };
        // One in each row and in each column of the patterns.
        for pattern in (0..NUM_PATTERNS).step_by(NUM_PATTERNS / SIDE + 1) {
            let one = self.space.illumination(surface, pattern, shades);
            sum.irradiance += one.irradiance / SIDE as f64;
            sum.mirrored += one.mirrored / SIDE as f64;
        }
        sum
    }
}

/// Light as a screen shows it, 0 to 1: bright places are compressed (Reinhard et al., "Photographic tone reproduction for
/// digital images", SIGGRAPH 2002, eq. 4); the square root stands for the screen's gamma and is exact everywhere.
fn on_screen(light: f64) -> f64 {
    const EXPOSURE: f64 = 2.0;
    const WHITE: f64 = 2.2;
    let light = light * EXPOSURE;
    (light * (1.0 + light / (WHITE * WHITE)) / (1.0 + light)).clamp(0.0, 1.0).sqrt()
}
