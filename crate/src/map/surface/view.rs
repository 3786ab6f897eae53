//! A depth image at its pose: what it says of the points in space.

use glam::{Mat3A, Vec3A};

use super::blocks::{SIDE, VOXELS, Voxel};
use crate::camera::Pinhole;
use crate::geometry::Pose3;
use crate::preprocess::depth_surfels::DepthModel;
use crate::preprocess::map_image::MapImage;

/// The field is truncated at so many standard deviations of the depth: one in 370 measurements lies beyond.
const TRUNCATION_DEVIATIONS: f32 = 3.0;
/// And at least at so many voxels: cells that the surface crosses have corners up to a diagonal, 1.73 voxels, away.
const MIN_TRUNCATION_VOXELS: f32 = 2.0;
/// And at most at so many voxels, where the depth is that uncertain that more would fill the room.
const MAX_TRUNCATION_VOXELS: f32 = 16.0;
/// Surfaces seen at a smaller cosine than this tell too little of where they are.
const MIN_COSINE: f32 = 0.1;
/// Neighbouring pixels of one surface differ by less than so many times their distance across: a surface seen at 6 degrees.
const MAX_SLOPE: f32 = 10.0;
/// Side of the tiles of an image that tell whether all rays pass a block (pixels).
const TILE: usize = 8;

/// What a pixel says of the points along its ray, in the camera's frame.
#[derive(Clone, Copy)]
struct Pixel {
    /// The surface's tangent plane, facing the camera: `normal . p + offset` is the distance of p, positive in front (m); everything is
    /// far behind where there is none.
    normal: [f32; 3],
    offset: f32,
    /// Where the field is truncated in front of the surface and behind it (m).
    truncation: f32,
    /// Inverse variance of the distance (1/m^2).
    information: f32,
}

const NO_SURFACE: Pixel = Pixel { normal: [0.0; 3], offset: f32::NEG_INFINITY, truncation: 0.0, information: 0.0 };

/// A camera in single precision: u = fx x / z + cx, where a pixel begins at a whole number.
#[derive(Clone, Copy)]
struct Projection {
    f: [f32; 2],
    c: [f32; 2],
    size: [f32; 2],
}

/// A depth image at its pose, as the field reads it.
pub(super) struct View<'a> {
    image: &'a MapImage,
    projection: Projection,
    /// Camera to world.
    R: Mat3A,
    t: Vec3A,
    pixels: Vec<Pixel>,
    /// Of each tile the depth up to which all of its rays are free (m); 0 where a pixel has no depth.
    free_depths: Vec<f32>,
    model: &'a DepthModel,
    pub(super) voxel_size: f32,
}

impl Pixel {
    /// Of a surface that the ray meets at this depth; none where it is seen at too flat an angle.
    fn of(normal: Vec3A, ray: Vec3A, depth: f32, deviation: f32, truncation: f32) -> Self {
        let along = normal.dot(ray);
        // The normal may point either way: that of a surface which is seen points to the camera.
        let facing = if along > 0.0 { -normal } else { normal };
        let cosine = along.abs() * ray.length_recip();
        if cosine < MIN_COSINE {
            return NO_SURFACE;
        }
        let information = cosine / (deviation * deviation);
        Self { normal: facing.to_array(), offset: along.abs() * depth, truncation, information }
    }
}

impl Projection {
    fn of(camera: &Pinhole) -> Self {
        Self {
            f: [camera.fx as f32, camera.fy as f32],
            c: [camera.cx as f32 + 0.5, camera.cy as f32 + 0.5],
            size: [camera.width as f32, camera.height as f32],
        }
    }

    /// The pixels that points in the camera's frame lie in, x, y and z apart; -1 outside of the image.
    #[inline]
    fn pixels_at(&self, [x, y, z]: &[[f32; SIDE]; 3]) -> [i32; SIDE] {
        let Self { f, c, size } = *self;
        let width = size[0] as i32;
        let mut indices = [-1; SIDE];
        for lane in 0..SIDE {
            let scale = 1.0 / z[lane];
            let u = x[lane] * scale * f[0] + c[0];
            let v = y[lane] * scale * f[1] + c[1];
            let is_inside = z[lane] > 0.0 && u >= 0.0 && v >= 0.0 && u < size[0] && v < size[1];
            let index = v as i32 * width + u as i32;
            indices[lane] = if is_inside { index } else { -1 };
        }
        indices
    }
}

impl<'a> View<'a> {
    pub(super) fn new(image: &'a MapImage, model: &'a DepthModel, T_world_camera: &Pose3, voxel_size: f32) -> Self {
        let R = T_world_camera.rotation.to_rotation_matrix().into_inner().map(|entry| entry as f32);
        let R = Mat3A::from_cols_slice(R.as_slice());
        let t = T_world_camera.translation.vector.map(|entry| entry as f32);
        let mut view = Self {
            image,
            projection: Projection::of(&image.camera),
            R,
            t: Vec3A::new(t.x, t.y, t.z),
            pixels: Vec::new(),
            free_depths: Vec::new(),
            model,
            voxel_size,
        };
        view.read_pixels();
        view
    }

    /// The pixels; anew where the size of the voxels has changed.
    pub(super) fn read_pixels(&mut self) {
        let rays = self.image.camera.ray_table();
        let Pinhole { width, height, .. } = self.image.camera;
        let num_columns = width.div_ceil(TILE);
        let mut pixels = Vec::with_capacity(width * height);
        let mut free = vec![f32::INFINITY; num_columns * height.div_ceil(TILE)];
        for row in 0..height {
            let free = &mut free[row / TILE * num_columns..][..num_columns];
            for column in 0..width {
                let free = &mut free[column / TILE];
                let Some(depth) = self.depth(row * width + column) else {
                    // It may be the edge of something thin.
                    *free = 0.0;
                    pixels.push(NO_SURFACE);
                    continue;
                };
                let deviation = self.model.deviation(depth);
                let truncation = self.truncation(deviation);
                *free = free.min(depth - truncation);
                let ray = Vec3A::new(rays.x[column] as f32, rays.y[row] as f32, 1.0);
                let surface = self.normal(row * width + column, ray, depth);
                pixels.push(surface.map_or(NO_SURFACE, |normal| Pixel::of(normal, ray, depth, deviation, truncation)));
            }
        }
        (self.pixels, self.free_depths) = (pixels, free);
    }

    /// Depth of a pixel (m).
    #[inline]
    fn depth(&self, pixel: usize) -> Option<f32> {
        let depth = self.image.depths[pixel];
        (depth > 0).then(|| f32::from(depth) * self.image.unit)
    }

    /// Where the field is truncated in front of a surface with this standard deviation and behind it (m).
    fn truncation(&self, deviation: f32) -> f32 {
        let (low, high) = (MIN_TRUNCATION_VOXELS * self.voxel_size, MAX_TRUNCATION_VOXELS * self.voxel_size);
        (TRUNCATION_DEVIATIONS * deviation).clamp(low, high)
    }

    /// The normal of the surface at a pixel: that of its cell, or, where that is no plane, of its neighbours.
    fn normal(&self, pixel: usize, ray: Vec3A, depth: f32) -> Option<Vec3A> {
        let of_cell = Vec3A::from(self.image.normals[pixel].map(f32::from));
        if of_cell != Vec3A::ZERO {
            return Some(of_cell * of_cell.length_recip());
        }
        let camera = &self.image.camera;
        let (column, row) = (pixel % camera.width, pixel / camera.width);
        let step = [1.0 / camera.fx as f32, 1.0 / camera.fy as f32];
        // The slope of the depth along a row or a column: the mean of both sides, or the one that is there.
        let slope = |before: Option<usize>, after: Option<usize>| {
            let change = |other: Option<usize>| other.and_then(|other| self.depth(other)).map(|other| other - depth);
            let is_joined =
                |change: &f32| change.abs() < MAX_SLOPE * depth * step[0] + 3.0 * self.model.deviation(depth);
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

    /// Visits the blocks within the truncation of a surface, some more than once, until one is refused. Returns whether none was.
    pub(super) fn visit_touched_blocks(&self, mut visit: impl FnMut([i32; 3]) -> bool) -> bool {
        let block_size = self.voxel_size * SIDE as f32;
        // Of the same step along the ray before: neighbouring rays meet the same blocks.
        let mut last = [[i32::MAX; 3]; 16];
        let camera = &self.image.camera;
        let rays = camera.ray_table();
        for row in 0..camera.height {
            for column in 0..camera.width {
                let index = row * camera.width + column;
                let pixel = &self.pixels[index];
                let Some(depth) = self.depth(index).filter(|_| pixel.information > 0.0) else { continue };
                // Pixels that are further apart than this, in powers of two, jump over no block but at its corners.
                let apart = (0.25 * block_size * camera.fx as f32 / depth) as usize;
                if (column | row) & (apart.max(1).next_power_of_two() / 2).saturating_sub(1) != 0 {
                    continue;
                }
                let ray = Vec3A::new(rays.x[column] as f32, rays.y[row] as f32, 1.0);
                // The truncation along the optical axis: longer, the more slanted the surface is seen.
                let reach = -pixel.truncation / Vec3A::from(pixel.normal).dot(ray);
                let ray = self.R * ray;
                // Along the ray in steps of half a block.
                let num_steps = (4.0 * reach / block_size).ceil().max(2.0);
                for step in 0..=num_steps as usize {
                    let along = depth + reach * (2.0 * step as f32 / num_steps - 1.0);
                    let point = (ray * along + self.t) / block_size;
                    let corner = point.floor().to_array().map(|at| at as i32);
                    if last[step % last.len()] != corner {
                        last[step % last.len()] = corner;
                        if !visit(corner) {
                            return false;
                        }
                    }
                }
            }
        }
        true
    }

    /// Adds the image to the voxels of a block. Returns the sum and the number of the deviations from what was known.
    pub(super) fn add_to_block(&self, corner: [i32; 3], voxels: &mut [Voxel; VOXELS]) -> (f32, u64) {
        let (mut sum, mut count) = (0.0, 0);
        // The centre of the first voxel, and the way from one to the next, in the camera's frame.
        let first = Vec3A::from(corner.map(|at| (at as f32 * SIDE as f32 + 0.5) * self.voxel_size));
        let to_camera = self.R.transpose();
        let first = to_camera * (first - self.t);
        let [along_x, along_y, along_z] =
            [to_camera.x_axis, to_camera.y_axis, to_camera.z_axis].map(|axis| axis * self.voxel_size);
        let a_metre = 1.0 / self.voxel_size;
        for (row, voxels) in voxels.chunks_exact_mut(SIDE).enumerate() {
            let start = first + along_y * (row % SIDE) as f32 + along_z * (row / SIDE) as f32;
            let points = [0, 1, 2].map(|axis| std::array::from_fn(|x| start[axis] + along_x[axis] * x as f32));
            let indices = self.projection.pixels_at(&points);
            for (x, voxel) in voxels.iter_mut().enumerate() {
                let Ok(index) = usize::try_from(indices[x]) else { continue };
                let pixel = &self.pixels[index];
                let [nx, ny, nz] = pixel.normal;
                let distance = nx * points[0][x] + ny * points[1][x] + nz * points[2][x] + pixel.offset;
                if distance <= -pixel.truncation {
                    continue;
                }
                let clamped = distance.min(pixel.truncation) * a_metre;
                if let Some(deviation) = voxel.add(clamped, pixel.information) {
                    sum += deviation * self.voxel_size * self.voxel_size;
                    count += 1;
                }
                if let Some(colors) = self.image.colors.as_ref().filter(|_| distance.abs() < 2.0 * self.voxel_size) {
                    voxel.add_color(colors[index]);
                }
            }
        }
        (sum, count)
    }

    /// Information (1/m^2) with which the image says that a block is empty: as much as of a surface there, where all that is seen in
    /// its direction lies behind it; otherwise 0.
    pub(super) fn information_through(&self, corner: [i32; 3]) -> f32 {
        let block_size = self.voxel_size * SIDE as f32;
        let radius = 0.87 * block_size; // half of the diagonal
        let center = Vec3A::from(corner.map(|at| (at as f32 + 0.5) * block_size));
        let center = self.R.transpose() * (center - self.t);
        let nearest = center.z - radius;
        if nearest <= 0.0 {
            return 0.0;
        }
        let camera = &self.image.camera;
        let tiles = |at: f32, f: f64, c: f64, count: usize| {
            let (at, reach) = (at / center.z * f as f32 + c as f32, radius / nearest * f as f32);
            let (low, high) = (at - reach, at + reach);
            let is_inside = low >= 0.0 && high < count as f32;
            is_inside.then_some(low as usize / TILE..=high as usize / TILE)
        };
        let columns = tiles(center.x, camera.fx, camera.cx, camera.width);
        let (Some(columns), Some(rows)) = (columns, tiles(center.y, camera.fy, camera.cy, camera.height)) else {
            return 0.0;
        };
        let num_columns = camera.width.div_ceil(TILE);
        let mut seen = rows.flat_map(|row| columns.clone().map(move |column| row * num_columns + column));
        let is_empty = seen.all(|tile| self.free_depths[tile] > center.z + radius);
        if is_empty { self.model.deviation(center.z).powi(-2) } else { 0.0 }
    }
}
