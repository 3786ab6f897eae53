//! What the pixels of a depth image say of the points along their rays.

use glam::{Vec3A, Vec4};

use super::blocks::{MAX_WEIGHT, STEPS, WHOLE_SHARE};
use crate::camera::Pinhole;
use crate::geometry::quantile::THREE_SIGMA;
use crate::preprocess::depth_surfels::DepthModel;
use crate::preprocess::map_image::MapImage;

/// The field is truncated at [`THREE_SIGMA`] of the depth, and at least at so many voxels: cells that the surface crosses have corners up
/// to a diagonal, 1.73 voxels, away.
pub(super) const MIN_TRUNCATION_VOXELS: f32 = 2.0;
/// And at most at so many voxels, where the depth is that uncertain that more would fill the room.
const MAX_TRUNCATION_VOXELS: f32 = 16.0;
/// Sizes of voxels, each twice as large as the one before. A depth is measured in the largest that are no larger than what its pixel sees.
pub(super) const NUM_LEVELS: usize = 3;
/// Surfaces seen at a smaller cosine than this, at less than 6 degrees, tell too little of where they are.
pub(super) const MIN_COSINE: f32 = 0.1;

/// The information (1/m^2) of a weight of 1.
pub(super) const WEIGHT_INFORMATION: f32 = 1e6 / MAX_WEIGHT;

/// Side of the voxels of a level, in those of the first.
#[inline]
pub(super) fn side_at(level: usize) -> f32 {
    (1 << level) as f32
}

/// What follows from a depth alone.
#[derive(Debug, Clone, Copy, Default)]
struct DepthLimits {
    /// Where the field is truncated in front of the surface and behind it (m).
    truncation: f32,
    /// Of the depth, by a right angle of view.
    weight: f32,
    noise_share: i16,
    level: u16,
}

/// What all images of a recording have in common. It is made once.
#[derive(Debug, Clone)]
pub(super) struct Optics {
    camera: Pinhole,
    model: DepthModel,
    unit: f32,
    voxel_size: f32,
    pub(super) rays: [Vec<f32>; 2],
    /// From a pixel to the next, at a depth of 1.
    pixel_steps: [f32; 2],
    /// Length of each pixel's ray (x, y, 1), inverted.
    cosines: Vec<f32>,
    /// By raw depth.
    limits: Vec<DepthLimits>,
    /// Of each level, steps in a metre.
    steps: [f32; NUM_LEVELS],
}

impl Optics {
    pub(super) fn new(image: &MapImage, model: &DepthModel, voxel_size: f32) -> Self {
        let table = image.camera.ray_table();
        let rays = [table.x, table.y].map(|rays| rays.into_iter().map(|ray| ray as f32).collect::<Vec<f32>>());
        let cosine = |y: f32| rays[0].iter().map(move |x| (x * x + y * y + 1.0).sqrt().recip());
        let cosines = rays[1].iter().flat_map(|&y| cosine(y)).collect();
        let sides: [f32; NUM_LEVELS] = std::array::from_fn(|level| voxel_size * side_at(level));
        let focal_length = image.camera.fx.max(image.camera.fy) as f32;
        let limits = (0..=u16::MAX).map(|depth| {
            let depth = f32::from(depth) * image.unit;
            let deviation = model.deviation(depth);
            let weight = deviation.powi(-2) / WEIGHT_INFORMATION;
            let noise = model.square_noise as f32 * depth * depth / deviation;
            let noise_share = (WHOLE_SHARE * noise * noise).min(WHOLE_SHARE).round() as i16;
            let is_within_pixel = |level: &usize| sides[*level] * focal_length <= depth;
            let level = (1..NUM_LEVELS).take_while(is_within_pixel).count();
            let [low, high] = [MIN_TRUNCATION_VOXELS, MAX_TRUNCATION_VOXELS].map(|voxels| voxels * sides[level]);
            let truncation = (THREE_SIGMA as f32 * deviation).clamp(low, high);
            DepthLimits { truncation, weight, noise_share, level: level as u16 }
        });
        let limits = limits.collect();
        let pixel_steps = [image.camera.fx, image.camera.fy].map(|focal_length| focal_length.recip() as f32);
        Self {
            camera: image.camera,
            model: *model,
            unit: image.unit,
            voxel_size,
            rays,
            pixel_steps,
            cosines,
            limits,
            steps: sides.map(|side| STEPS / side),
        }
    }

    pub(super) fn is_of(&self, image: &MapImage, model: &DepthModel, voxel_size: f32) -> bool {
        (self.camera, self.model, self.unit, self.voxel_size) == (image.camera, *model, image.unit, voxel_size)
    }

    /// Weight of a depth (m), seen at a right angle.
    pub(super) fn weight(&self, depth: f32) -> f32 {
        self.limits_at(depth).weight
    }

    /// The share that noise has in the variance of a depth (m), of [`WHOLE_SHARE`]; the rest is that of the steps of the depth values,
    /// which differs from place to place.
    pub(super) fn noise_share(&self, depth: f32) -> i32 {
        i32::from(self.limits_at(depth).noise_share)
    }

    #[inline]
    fn limits_at(&self, depth: f32) -> DepthLimits {
        self.limits[(depth / self.unit).clamp(0.0, f32::from(u16::MAX)) as usize]
    }
}

/// A surface at a pixel, in the camera's frame.
pub(super) struct Seen {
    /// Facing the camera.
    pub normal: Vec3A,
    pub depth: f32,
    /// Cosine of the angle of view, times the length of the ray (x, y, 1): depth along the axis to distance.
    along: f32,
    /// Truncation along the optical axis (m): the longer, the more slanted the surface is seen.
    pub reach: f32,
    /// Of the voxels in which it is measured.
    pub level: usize,
    truncation: f32,
    weight: f32,
}

/// What a pixel says of the space along its ray: 32 bytes, so that it is one read of memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pixel {
    /// The tangent plane of its surface: of a point with the depth z at the pixel (u, v) (a, b, c, d) . (u z, v z, z, 1) is its distance
    /// from the surface (steps), positive in front.
    pub plane: Vec4,
    /// Truncation (steps) and weight, both whole numbers, 0 where there is no surface, and the level; the last is not used.
    pub limits: Vec4,
}

/// The pixels of an image, with a border of one pixel without surface.
pub(super) struct Pixels<'a> {
    image: &'a MapImage,
    optics: &'a Optics,
    /// The last normal of a cell: neighbouring pixels are mostly of the same.
    last: ([i8; 3], Vec3A),
    /// Row by row, with the border.
    pub all: Vec<Pixel>,
}

impl<'a> Pixels<'a> {
    /// Without any.
    pub(super) fn new(image: &'a MapImage, optics: &'a Optics) -> Self {
        let count = (image.camera.width + 2) * (image.camera.height + 2);
        let none = Pixel { plane: Vec4::ZERO, limits: Vec4::ZERO };
        Self { image, optics, last: ([0; 3], Vec3A::ZERO), all: vec![none; count] }
    }

    /// Pixels in a row, with the border.
    pub(super) fn stride(&self) -> usize {
        self.image.camera.width + 2
    }

    /// Focal lengths and centre, where the first pixel after the border begins at 1.
    pub(super) fn projection(&self) -> [f32; 4] {
        let Pinhole { fx, fy, cx, cy, .. } = self.image.camera;
        [fx as f32, fy as f32, cx as f32 + 1.5, cy as f32 + 1.5]
    }

    /// The middles of the last column and row, with the border.
    pub(super) fn last(&self) -> [f32; 2] {
        let Pinhole { width, height, .. } = self.image.camera;
        [width, height].map(|size| size as f32 + 1.5)
    }

    /// The number of a pixel in the image, from that with the border.
    #[inline]
    pub(super) fn number(&self, at: i32) -> usize {
        let (row, column) = (at as usize / self.stride(), at as usize % self.stride());
        (row - 1) * self.image.camera.width + column - 1
    }

    /// The surface that a pixel sees; none where it has no depth or is seen at too flat an angle.
    #[inline]
    pub(super) fn seen(&mut self, column: usize, row: usize) -> Option<Seen> {
        let index = row * self.image.camera.width + column;
        let raw = self.image.depths[index];
        if raw == 0 {
            return None;
        }
        let depth = f32::from(raw) * self.optics.unit;
        let ray = Vec3A::new(self.optics.rays[0][column], self.optics.rays[1][row], 1.0);
        let normal = self.normal(index, ray, depth)?;
        let along = normal.dot(ray);
        // The normal may point either way: that of a surface which is seen points to the camera.
        let normal = if along > 0.0 { -normal } else { normal };
        let along = along.abs();
        let cosine = along * self.optics.cosines[index];
        let DepthLimits { truncation, weight, level, .. } = self.optics.limits[usize::from(raw)];
        let weight = cosine * weight + 0.5;
        // What is known to more than 90 mm has no weight: with it, more of the truth would be covered, and less precisely.
        if cosine < MIN_COSINE || weight < 1.0 {
            return None;
        }
        let weight = (weight as i32).min(MAX_WEIGHT as i32) as f32;
        Some(Seen { normal, depth, along, reach: truncation / along, level: usize::from(level), truncation, weight })
    }

    /// Takes in what a pixel sees. Returns the depths between which the field is measured at it (m).
    #[inline]
    pub(super) fn set(&mut self, column: usize, row: usize, seen: &Seen) -> [f32; 2] {
        let [step_x, step_y] = self.optics.pixel_steps;
        let steps = self.optics.steps[seen.level];
        let [.., cx, cy] = self.projection();
        let (a, b) = (seen.normal.x * step_x, seen.normal.y * step_y);
        let c = seen.normal.z - a * cx - b * cy;
        let at = (row + 1) * self.stride() + column + 1;
        self.all[at] = Pixel {
            plane: Vec4::new(a, b, c, seen.along * seen.depth) * steps,
            limits: Vec4::new((seen.truncation * steps) as i32 as f32, seen.weight, seen.level as f32, 0.0),
        };
        // Within the pixel the plane comes nearer and goes farther.
        let reach = seen.reach + 0.5 * seen.depth * (a.abs() + b.abs()) * seen.reach / seen.truncation;
        [seen.depth - reach, seen.depth + reach]
    }

    /// Depth of a pixel (m).
    #[inline]
    fn depth(&self, pixel: usize) -> Option<f32> {
        let depth = self.image.depths[pixel];
        (depth > 0).then(|| f32::from(depth) * self.optics.unit)
    }

    /// The normal of the surface at a pixel: that of its cell, or, where that is no plane, of its neighbours.
    #[inline]
    fn normal(&mut self, pixel: usize, ray: Vec3A, depth: f32) -> Option<Vec3A> {
        let of_cell @ [x, y, z] = self.image.normals[pixel];
        if of_cell == [0; 3] {
            return self.normal_of_neighbors(pixel, ray, depth);
        }
        if of_cell != self.last.0 {
            self.last = (of_cell, Vec3A::new(f32::from(x), f32::from(y), f32::from(z)).normalize());
        }
        Some(self.last.1)
    }

    fn normal_of_neighbors(&self, pixel: usize, ray: Vec3A, depth: f32) -> Option<Vec3A> {
        let camera = &self.image.camera;
        let (column, row) = (pixel % camera.width, pixel / camera.width);
        let step = self.optics.pixel_steps;
        // What is seen at the smallest angle, and noise.
        let max_change = depth * step[0] / MIN_COSINE + THREE_SIGMA as f32 * self.optics.model.deviation(depth);
        // The slope of the depth along a row or a column: the mean of both sides, or the one that is there.
        let slope = |before: Option<usize>, after: Option<usize>| {
            let change = |other: Option<usize>| other.and_then(|other| self.depth(other)).map(|other| other - depth);
            let is_joined = |change: &f32| change.abs() < max_change;
            match (change(before).filter(is_joined), change(after).filter(is_joined)) {
                (Some(before), Some(after)) => Some((after - before) / 2.0),
                (Some(before), None) => Some(-before),
                (None, after) => after,
            }
        };
        let along_row = slope((column > 0).then(|| pixel - 1), (column + 1 < camera.width).then_some(pixel + 1))?;
        let below = Some(pixel + camera.width).filter(|&below| below < self.image.depths.len());
        let along_column = slope((row > 0).then(|| pixel - camera.width), below)?;
        let right = ray * along_row + Vec3A::X * (depth * step[0]);
        let down = ray * along_column + Vec3A::Y * (depth * step[1]);
        down.cross(right).try_normalize()
    }

    /// The truncation of the field, of a pixel without a known normal (m).
    pub(super) fn truncation(&self, column: usize, row: usize) -> Option<(f32, f32)> {
        let raw = self.image.depths[row * self.image.camera.width + column];
        (raw > 0).then(|| (f32::from(raw) * self.optics.unit, self.optics.limits[usize::from(raw)].truncation))
    }
}
