//! A depth image reduced for the stitched map: every second pixel, coarse depth smoothed, silhouettes left out.

use glam::Vec3;
use nalgebra::Vector3;

use super::depth_surfels::DepthModel;
use crate::camera::pinhole::RayTable;
use crate::camera::{ColorImage, DepthImage, Pinhole, Surfel, SurfelImage};
use crate::geometry::PointCloud;

/// Pixels with their depth, colour and normal: for the map every second one of every second row, small enough to be kept for every
/// frame of a long recording.
#[derive(Debug, Clone, PartialEq)]
pub struct MapImage {
    /// The camera that sees these pixels.
    pub camera: Pinhole,
    /// Unit of `depths` (m).
    pub unit: f32,
    /// Depths, row by row, in `unit`; 0 where there is none.
    pub depths: Vec<u16>,
    /// Unit normals in 127ths, camera frame; zero where unknown.
    pub normals: Vec<[i8; 3]>,
    /// Colours, where the recording has them.
    pub colors: Option<Vec<[u8; 3]>>,
}

/// Stride of the pixels that are kept for the map.
const STRIDE: usize = 2;
/// The finest unit of kept depths (m), far below the resolution of depth cameras.
const FINEST_UNIT: f64 = 2.5e-4;
/// A pixel whose depth is between those of its neighbours and differs from both by more than this share of its depth is a
/// mixed pixel at a silhouette.
const MIN_MIXED_STEP: f64 = 0.03;

impl MapImage {
    /// For the map, from a depth image, its surfaces and its colours (of the same size). Where the pixel's cell is a surface that
    /// passes through it within the noise, the depth is the surface's.
    pub fn new(
        image: &DepthImage,
        usable: &[bool],
        surfels: &SurfelImage,
        model: &DepthModel,
        colors: Option<&ColorImage>,
    ) -> Self {
        Self::with_stride(STRIDE, true, image, usable, surfels, model, colors)
    }

    /// The same of every pixel whose row and column are multiples of `stride`; where `is_smoothed` is false, the depth is the pixel's
    /// own.
    pub(crate) fn with_stride(
        stride: usize,
        is_smoothed: bool,
        image: &DepthImage,
        usable: &[bool],
        surfels: &SurfelImage,
        model: &DepthModel,
        colors: Option<&ColorImage>,
    ) -> Self {
        let full = Pinhole { width: image.width, height: image.height, ..surfels.camera };
        let camera = thinned_camera(&full, stride, 0, 0);
        let Pinhole { width, height, .. } = camera;
        let unit = FINEST_UNIT.max(model.max_range * 1.01 / f64::from(u16::MAX));
        let (a_metre, table) = (1.0 / unit, DepthTable::new(image, model));
        let planes: Vec<Option<Plane>> = surfels.cells.iter().map(|surfel| surfel.as_ref().map(Plane::of)).collect();
        let rays = full.ray_table();
        let (mut depths, mut normals) = (vec![0; width * height], vec![[0; 3]; width * height]);
        for (row, v) in (0..image.height).step_by(stride).enumerate() {
            let start = v * image.width;
            let (values, usable_here) = (&image.values[start..][..image.width], &usable[start..][..image.width]);
            let cell_row = v / surfels.cell_size;
            let planes =
                if cell_row < surfels.rows { &planes[cell_row * surfels.columns..][..surfels.columns] } else { &[] };
            let kept = depths[row * width..][..width].iter_mut().zip(&mut normals[row * width..][..width]);
            for (column, (kept_depth, kept_normal)) in kept.enumerate() {
                let u = column * stride;
                let z = if usable_here[u] { table.of(values[u]) } else { 0.0 };
                if z == 0.0 || table.is_mixed(image, usable, u, v) {
                    continue;
                }
                let on_surface = planes.get(u / surfels.cell_size).and_then(Option::as_ref).and_then(|plane| {
                    let on_plane = plane.depth(rays.x[u], rays.y[v]);
                    let noise = 0.6 * model.step + 2.0 * model.square_noise * z * z;
                    let depth = if is_smoothed { on_plane } else { z };
                    ((on_plane - z).abs() < noise).then_some((depth, plane.rounded_normal))
                });
                let (z, normal) = on_surface.unwrap_or((z, [0; 3]));
                // Rounded half up, for depths are positive. Converted as signed integers, which takes fewer instructions.
                *kept_depth = ((z * a_metre + 0.5) as i32).clamp(1, i32::from(u16::MAX)) as u16;
                *kept_normal = normal;
            }
        }
        let colors = colors.map(|colors| {
            let mut kept = Vec::with_capacity(width * height);
            for row in colors.pixels.chunks_exact(colors.width.max(1)).step_by(stride) {
                kept.extend(row.iter().step_by(stride));
            }
            kept
        });
        Self { camera, unit: unit as f32, depths, normals, colors }
    }

    /// Every second pixel of every second row, from pixel (`left`, `top`) on, each 0 or 1.
    #[must_use]
    pub fn thinned(&self, left: usize, top: usize) -> Self {
        let Pinhole { width, height, .. } = self.camera;
        let every_second = |first: usize, count: usize| (first..count).step_by(STRIDE);
        let kept = || every_second(top, height).flat_map(|v| every_second(left, width).map(move |u| v * width + u));
        Self {
            camera: thinned_camera(&self.camera, STRIDE, left, top),
            unit: self.unit,
            depths: kept().map(|index| self.depths[index]).collect(),
            normals: kept().map(|index| self.normals[index]).collect(),
            colors: self.colors.as_ref().map(|colors| kept().map(|index| colors[index]).collect()),
        }
    }

    /// With `shift` (m) added to its depths.
    #[must_use]
    pub(crate) fn shifted(&self, shift: f64) -> Self {
        let units = (shift / f64::from(self.unit)).round() as i32;
        let moved = |&depth: &u16| (i32::from(depth) + units).clamp(1, i32::from(u16::MAX)) as u16;
        let depths = self.depths.iter().map(|depth| if *depth == 0 { 0 } else { moved(depth) }).collect();
        Self { depths, ..self.clone() }
    }

    /// Mean depth (m); 0 without any.
    pub(crate) fn mean_depth(&self) -> f64 {
        let (sum, count) = self
            .depths
            .iter()
            .filter(|depth| **depth > 0)
            .fold((0.0, 0), |(sum, count), depth| (sum + f64::from(*depth), count + 1));
        f64::from(self.unit) * sum / f64::from(count.max(1))
    }

    /// Its points in the camera's frame, with `shift` (m) added to their depths: position (m), normal in 127ths and colour,
    /// black where there are no colours.
    #[inline]
    pub fn for_each_point(&self, shift: f64, mut work: impl FnMut(Vec3, [i8; 3], [u8; 3])) {
        let (width, unit, shift) = (self.camera.width.max(1), self.unit, shift as f32);
        let RayTable { x, y } = self.camera.ray_table();
        let [x, y] = [x, y].map(|rays| rays.into_iter().map(|ray| ray as f32).collect::<Vec<f32>>());
        let rows = self.depths.chunks_exact(width).zip(self.normals.chunks_exact(width)).zip(&y);
        for (row, ((depths, normals), &y)) in rows.enumerate() {
            let colors = self.colors.as_ref().map(|colors| &colors[row * width..][..width]);
            for (column, ((&depth, &normal), &x)) in depths.iter().zip(normals).zip(&x).enumerate() {
                if depth != 0 {
                    let z = f32::from(depth) * unit + shift;
                    work(Vec3::new(x * z, y * z, z), normal, colors.map_or([0; 3], |colors| colors[column]));
                }
            }
        }
    }

    /// Its points as a cloud with unit normals.
    pub fn cloud(&self, shift: f64) -> PointCloud {
        let most = self.depths.len();
        let (mut positions, mut normals, mut colors) =
            (Vec::with_capacity(most), Vec::with_capacity(most), Vec::with_capacity(most));
        self.for_each_point(shift, |position, normal, color| {
            positions.push(position);
            normals.push(Vec3::from(normal.map(f32::from)).normalize_or_zero());
            colors.push(color);
        });
        let colors = self.colors.is_some().then_some(colors);
        PointCloud { positions, normals: Some(normals), colors, ..PointCloud::default() }
    }
}

/// The camera whose image has the pixels of `camera`'s from (`left`, `top`) on in steps of `stride`.
fn thinned_camera(camera: &Pinhole, stride: usize, left: usize, top: usize) -> Pinhole {
    let step = stride as f64;
    Pinhole {
        width: camera.width.saturating_sub(left).div_ceil(stride),
        height: camera.height.saturating_sub(top).div_ceil(stride),
        fx: camera.fx / step,
        fy: camera.fy / step,
        cx: (camera.cx - left as f64) / step,
        cy: (camera.cy - top as f64) / step,
    }
}

/// The depth (m) of each raw value; 0 where it has none.
struct DepthTable {
    depths: Vec<f64>,
    /// Of the model, in raw values.
    offset: f64,
}

impl DepthTable {
    fn new(image: &DepthImage, model: &DepthModel) -> Self {
        // Some cameras mark what they do not measure by the largest value.
        let last_in_range = (model.max_range / model.step).min(f64::from(image.largest())) as u16;
        let depths = (0..=last_in_range.saturating_add(1)).map(|value| model.depth(value).unwrap_or(0.0)).collect();
        Self { depths, offset: model.offset }
    }

    #[inline]
    fn of(&self, value: u16) -> f64 {
        self.depths.get(usize::from(value)).copied().unwrap_or(0.0)
    }

    /// Whether a pixel is the mean of what lies left and right of it, or above and below, and near to neither.
    #[inline]
    fn is_mixed(&self, image: &DepthImage, usable: &[bool], u: usize, v: usize) -> bool {
        let index = v * image.width + u;
        // Depths are as far apart as their raw values, which are at hand.
        let gap = (MIN_MIXED_STEP * (f64::from(image.values[index]) + self.offset)) as i32 + 2;
        let value = i32::from(image.values[index]);
        let between = |before: usize, after: usize| {
            let (a, b) = (i32::from(image.values[before]) - value, value - i32::from(image.values[after]));
            let is_between = (a > gap && b > gap) || (-a > gap && -b > gap);
            is_between && [before, after].iter().all(|&other| usable[other] && self.of(image.values[other]) > 0.0)
        };
        (u > 0 && u + 1 < image.width && between(index - 1, index + 1))
            || (v > 0 && v + 1 < image.height && between(index - image.width, index + image.width))
    }
}

/// The plane of a surfel.
struct Plane {
    normal: Vector3<f64>,
    /// The normal times any of its points (m).
    offset: f64,
    rounded_normal: [i8; 3],
}

impl Plane {
    fn of(surfel: &Surfel) -> Self {
        let normal = surfel.normal;
        // Shifted, so that cutting off rounds: a call to round costs more than all else here.
        let rounded_normal = [normal.x, normal.y, normal.z].map(|x| ((127.0 * x + 128.5) as i16 - 128) as i8);
        Self { normal, offset: normal.dot(&surfel.point), rounded_normal }
    }

    /// Where the ray (x, y, 1) meets it (m).
    fn depth(&self, x: f64, y: f64) -> f64 {
        self.offset / (self.normal.x * x + self.normal.y * y + self.normal.z)
    }
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
