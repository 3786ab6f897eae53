//! What a depth image gives to the stitched map: fewer pixels, the steps of coarse depth smoothed, silhouettes left out.

use glam::Vec3;
use nalgebra::Vector3;

use super::depth_surfels::DepthModel;
use crate::camera::{ColorImage, DepthImage, Pinhole, Surfel, SurfelImage};
use crate::geometry::PointCloud;

/// Every second pixel of every second row with its depth, colour and normal, small enough to be kept for every frame of a
/// long recording.
#[derive(Debug, Clone, PartialEq)]
pub struct MapImage {
    /// The camera that sees these pixels.
    pub camera: Pinhole,
    /// Metres a unit of `depths`.
    pub unit: f32,
    /// Row by row; 0 where there is no depth.
    pub depths: Vec<u16>,
    /// Unit normals in 127ths, camera frame; zero where none could be told.
    pub normals: Vec<[i8; 3]>,
    /// Colours, where the recording has them.
    pub colors: Option<Vec<[u8; 3]>>,
}

/// Pixels between those that are kept.
const STRIDE: usize = 2;
/// The finest unit of kept depths (m): far below what depth cameras tell apart.
const FINEST_UNIT: f64 = 2.5e-4;
/// A pixel whose depth lies between those of its neighbours, further from both than this share of it, is a mixture of
/// the surfaces at a silhouette.
const MIXED: f64 = 0.03;

impl MapImage {
    /// From a depth image, its surfaces and its colours (of the same size). Where the pixel's cell is a surface that
    /// passes through it within the noise, the depth is the surface's.
    pub fn new(
        image: &DepthImage,
        usable: &[bool],
        surfels: &SurfelImage,
        model: &DepthModel,
        colors: Option<&ColorImage>,
    ) -> Self {
        let (width, height) = (image.width.div_ceil(STRIDE), image.height.div_ceil(STRIDE));
        let full = surfels.camera;
        let stride = STRIDE as f64;
        let camera = Pinhole {
            width,
            height,
            fx: full.fx / stride,
            fy: full.fy / stride,
            cx: full.cx / stride,
            cy: full.cy / stride,
        };
        let unit = FINEST_UNIT.max(model.max_range * 1.01 / f64::from(u16::MAX));
        let table = DepthTable::new(image, model);
        let depth = |index: usize| if usable[index] { table.of(image.values[index]) } else { 0.0 };
        let planes: Vec<Option<Plane>> = surfels.cells.iter().map(|surfel| surfel.as_ref().map(Plane::of)).collect();
        let rays = full.ray_table();
        let (mut depths, mut normals) = (vec![0; width * height], vec![[0; 3]; width * height]);
        for (row, v) in (0..image.height).step_by(STRIDE).enumerate() {
            for (column, u) in (0..image.width).step_by(STRIDE).enumerate() {
                let z = depth(v * image.width + u);
                if z == 0.0 || is_mixed(image, u, v, z, model, &depth) {
                    continue;
                }
                let (cell_column, cell_row) = (u / surfels.cell_size, v / surfels.cell_size);
                let is_inside = cell_column < surfels.columns && cell_row < surfels.rows;
                let plane = if is_inside { &planes[cell_row * surfels.columns + cell_column] } else { &None };
                let on_surface = plane.as_ref().and_then(|plane| {
                    let on_plane = plane.depth(rays.x[u], rays.y[v]);
                    let noise = 0.6 * model.step + 2.0 * model.square_noise * z * z;
                    ((on_plane - z).abs() < noise).then_some((on_plane, plane.rounded_normal))
                });
                let (z, normal) = on_surface.unwrap_or((z, [0; 3]));
                let index = row * width + column;
                // Halves go up: depths are positive.
                depths[index] = (z / unit + 0.5).clamp(1.0, f64::from(u16::MAX)) as u16;
                normals[index] = normal;
            }
        }
        let colors = colors.map(|colors| {
            let rows = colors.pixels.chunks_exact(colors.width.max(1)).step_by(STRIDE);
            rows.flat_map(|row| row.iter().step_by(STRIDE).copied()).collect()
        });
        Self { camera, unit: unit as f32, depths, normals, colors }
    }

    /// Every second pixel of every second row, from pixel (`left`, `top`) on, each 0 or 1.
    #[must_use]
    pub fn thinned(&self, left: usize, top: usize) -> Self {
        let Pinhole { width, height, fx, fy, cx, cy } = self.camera;
        let every_second = |first: usize, count: usize| (first..count).step_by(2);
        let kept = || every_second(top, height).flat_map(|v| every_second(left, width).map(move |u| v * width + u));
        let camera = Pinhole {
            width: every_second(left, width).len(),
            height: every_second(top, height).len(),
            fx: fx / 2.0,
            fy: fy / 2.0,
            cx: (cx - left as f64) / 2.0,
            cy: (cy - top as f64) / 2.0,
        };
        Self {
            camera,
            unit: self.unit,
            depths: kept().map(|index| self.depths[index]).collect(),
            normals: kept().map(|index| self.normals[index]).collect(),
            colors: self.colors.as_ref().map(|colors| kept().map(|index| colors[index]).collect()),
        }
    }

    /// Its points in the camera's frame, with `shift` (m) added to their depths.
    pub fn cloud(&self, shift: f64) -> PointCloud {
        let table = self.camera.ray_table();
        let (mut positions, mut normals, mut colors) = (Vec::new(), Vec::new(), Vec::new());
        for (index, (&depth, normal)) in self.depths.iter().zip(&self.normals).enumerate() {
            if depth == 0 {
                continue;
            }
            let (u, v) = (index % self.camera.width, index / self.camera.width);
            let z = f64::from(depth) * f64::from(self.unit) + shift;
            positions.push(Vec3::new((table.x[u] * z) as f32, (table.y[v] * z) as f32, z as f32));
            normals.push(Vec3::from(normal.map(f32::from)).normalize_or_zero());
            colors.extend(self.colors.as_ref().map(|colors| colors[index]));
        }
        let colors = self.colors.is_some().then_some(colors);
        PointCloud { positions, normals: Some(normals), colors, ..PointCloud::default() }
    }
}

/// The depth (m) of each raw value; 0 where it stands for none.
struct DepthTable {
    depths: Vec<f64>,
}

impl DepthTable {
    fn new(image: &DepthImage, model: &DepthModel) -> Self {
        let largest = image.values.iter().copied().max().unwrap_or(0);
        Self { depths: (0..=largest).map(|value| model.depth(value).unwrap_or(0.0)).collect() }
    }

    fn of(&self, value: u16) -> f64 {
        self.depths[usize::from(value)]
    }
}

/// The plane of a piece of surface.
struct Plane {
    normal: Vector3<f64>,
    /// The normal times any of its points (m).
    offset: f64,
    rounded_normal: [i8; 3],
}

impl Plane {
    fn of(surfel: &Surfel) -> Self {
        let normal = surfel.normal;
        let rounded_normal = [normal.x, normal.y, normal.z].map(|x| (127.0 * x).round() as i8);
        Self { normal, offset: normal.dot(&surfel.point), rounded_normal }
    }

    /// Where the ray (x, y, 1) meets it (m).
    fn depth(&self, x: f64, y: f64) -> f64 {
        self.offset / (self.normal.x * x + self.normal.y * y + self.normal.z)
    }
}

/// Whether a pixel is the mean of what lies left and right of it, or above and below, and near to neither.
fn is_mixed(image: &DepthImage, u: usize, v: usize, z: f64, model: &DepthModel, depth: &impl Fn(usize) -> f64) -> bool {
    let (index, gap) = (v * image.width + u, MIXED * z + 2.0 * model.step);
    let between = |a: f64, b: f64| a > 0.0 && b > 0.0 && ((a - z > gap && z - b > gap) || (z - a > gap && b - z > gap));
    let across = u > 0 && u + 1 < image.width && between(depth(index - 1), depth(index + 1));
    let along = v > 0 && v + 1 < image.height && between(depth(index - image.width), depth(index + image.width));
    across || along
}

#[cfg(test)]
mod tests {
    use super::super::depth_surfels::depth_surfels;
    use super::*;

    const EIGHT_BITS: DepthModel =
        DepthModel { step: 10.0 / 255.0, offset: 0.5, square_noise: 0.0, min_range: 0.1, max_range: 10.0 };

    fn map_image(values: Vec<u16>, colors: Option<&ColorImage>) -> MapImage {
        let camera = Pinhole::from_field_of_view(64, 64, 1.4).unwrap();
        let image = DepthImage { width: 64, height: 64, values, bits: 8 };
        let usable = vec![true; 64 * 64];
        let surfels = depth_surfels(&image, &usable, &camera, &EIGHT_BITS);
        MapImage::new(&image, &usable, &surfels, &EIGHT_BITS, colors)
    }

    #[test]
    fn a_wall_of_steps_becomes_smooth_and_keeps_its_colours() {
        // An oblique wall: 0.28 x + 0.96 z = 2.
        let camera = Pinhole::from_field_of_view(64, 64, 1.4).unwrap();
        let depth = |u: usize| 2.0 / (0.28 * camera.ray(u as f64, 0.0).x + 0.96);
        let values = (0..64 * 64).map(|index| (depth(index % 64) * 25.5) as u16).collect();
        let pixels = (0..64 * 64).map(|index: u32| [(index % 64) as u8, (index / 64) as u8, 7]).collect();
        let map = map_image(values, Some(&ColorImage { width: 64, height: 64, pixels }));
        let cloud = map.cloud(0.0);
        assert_eq!(cloud.len(), 32 * 32);
        let off = |p: &Vec3| (0.28 * p.x + 0.96 * p.z - 2.0).abs();
        let mean = cloud.positions.iter().map(off).sum::<f32>() / cloud.len() as f32;
        assert!(mean < 0.004, "{mean}"); // steps of 39 mm are off by 10 in the mean
        let colors = cloud.colors.unwrap();
        assert_eq!((colors[0], colors[33]), ([0, 0, 7], [2, 2, 7]));
        let normal = cloud.normals.unwrap()[500];
        assert!(normal.dot(Vec3::new(-0.28, 0.0, -0.96)) > 0.99, "{normal}");
        let shifted = map.cloud(-0.5 * EIGHT_BITS.step);
        assert!((cloud.positions[9].z - shifted.positions[9].z - 0.0196).abs() < 1e-4);
    }

    #[test]
    fn mixed_pixels_and_holes_are_left_out() {
        let mut values: Vec<u16> = (0..64 * 64).map(|index| if index % 64 < 32 { 40 } else { 100 }).collect();
        for row in values.chunks_exact_mut(64) {
            row[32] = 70;
        }
        values[10 * 64 + 10] = 0;
        let map = map_image(values, None);
        assert_eq!(map.depths[5 * 32 + 5], 0);
        for row in 0..32 {
            assert_eq!(map.depths[row * 32 + 16], 0);
            assert!(map.depths[row * 32 + 15] > 0 && map.depths[row * 32 + 17] > 0);
        }
        assert_eq!(map.cloud(0.0).colors, None);
    }
}
