//! Depth images into the field, and the field to a mesh.

use glam::{Mat3A, Vec3A};
use serde::{Deserialize, Serialize};

use super::blocks::{Blocks, SIDE, VOXELS, Voxel};
use super::extraction::extract;
use crate::error::{Error, Result};
use crate::geometry::{Pose3, TriangleMesh};
use crate::preprocess::depth_surfels::DepthModel;
use crate::preprocess::map_image::MapImage;

/// How a surface is made.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct SurfaceOptions {
    /// Side of a voxel (m). It doubles whenever the field exceeds `max_megabytes`.
    pub voxel_size: f64,
    /// Memory of the field (MB).
    pub max_megabytes: f64,
    /// Parts of the surface that are smaller than this are left out (m^2); 0: those under a square of ten voxels.
    pub min_island_area: f64,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self { voxel_size: 0.02, max_megabytes: 400.0, min_island_area: 0.0 }
    }
}

impl SurfaceOptions {
    /// # Errors
    /// When a value is out of its limits.
    pub fn check(&self) -> Result<()> {
        let limits = [
            ("voxel_size", self.voxel_size, 1e-3, 1.0, "m"),
            ("max_megabytes", self.max_megabytes, 10.0, 3000.0, "MB"),
            ("min_island_area", self.min_island_area, 0.0, 1e4, "m^2"),
        ];
        for (name, value, low, high, unit) in limits {
            if !(low..=high).contains(&value) {
                let problem = format!("{name} = {value} is not possible");
                return Err(Error::whole(problem, format!("Give a number from {low} to {high} {unit}")));
            }
        }
        Ok(())
    }
}

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
/// Bytes of a block: its voxels, and about as much for finding it as a corner and a number in a hash table take.
const BLOCK_BYTES: usize = VOXELS * size_of::<Voxel>() + 64;

/// A truncated signed distance field over depth images at their poses.
#[derive(Debug, Clone)]
pub struct SurfaceFusion {
    options: SurfaceOptions,
    voxel_size: f32,
    blocks: Blocks,
    num_frames: usize,
    /// Sum of the squared deviations of the measurements from the mean before, in units of the variance expected of them.
    deviation_sum: f64,
    num_deviations: u64,
}

/// What a pixel says of the points along its ray, in the camera's frame.
#[derive(Clone, Copy)]
struct Pixel {
    /// The surface's tangent plane, facing the camera: `normal . p + offset` is the distance of p, positive in front (m).
    normal: Vec3A,
    offset: f32,
    /// Depth (m); 0 where there is none.
    depth: f32,
    /// Where the field is truncated in front of the surface and behind it (m).
    truncation: f32,
    /// The same along the optical axis: longer, the more slanted the surface is seen (m).
    reach: f32,
    /// Inverse variance of the distance (1/m^2).
    information: f32,
}

const NO_DEPTH: Pixel =
    Pixel { normal: Vec3A::ZERO, offset: 0.0, depth: 0.0, truncation: 0.0, reach: 0.0, information: 0.0 };

/// A depth image at its pose, as the field reads it.
struct View<'a> {
    image: &'a MapImage,
    /// Camera to world.
    R: Mat3A,
    t: Vec3A,
    pixels: Vec<Pixel>,
    /// Of each tile the depth up to which all of its rays are free (m); 0 where a pixel has no depth.
    free_depths: Vec<f32>,
    model: &'a DepthModel,
    voxel_size: f32,
}

impl SurfaceFusion {
    /// An empty field.
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub fn new(options: SurfaceOptions) -> Result<Self> {
        options.check()?;
        Ok(Self {
            options,
            voxel_size: options.voxel_size as f32,
            blocks: Blocks::default(),
            num_frames: 0,
            deviation_sum: 0.0,
            num_deviations: 0,
        })
    }

    /// Side of a voxel (m): that of the options, or larger where the memory was not enough.
    pub fn voxel_size(&self) -> f64 {
        f64::from(self.voxel_size)
    }

    /// Number of images in the field.
    pub fn num_frames(&self) -> usize {
        self.num_frames
    }

    /// Memory of the field (bytes).
    pub fn num_bytes(&self) -> usize {
        self.blocks.len() * BLOCK_BYTES
    }

    /// Adds a depth image; `model` is how its depth was measured.
    pub fn integrate(&mut self, image: &MapImage, model: &DepthModel, T_world_camera: &Pose3) {
        if !T_world_camera.to_homogeneous().iter().all(|entry| entry.is_finite()) {
            return;
        }
        let mut view = View::new(image, model, T_world_camera, self.voxel_size);
        let mut touched = view.touched_blocks();
        while self.with_touched(&touched) > self.options.max_megabytes * 1e6 {
            self.coarsen();
            view.voxel_size = self.voxel_size;
            view.read_pixels();
            touched = view.touched_blocks();
        }
        let mut is_touched = vec![false; self.blocks.len()];
        for corner in touched {
            let number = self.blocks.insert(corner);
            if let Some(touched) = is_touched.get_mut(number) {
                *touched = true;
            }
            let (sum, count) = view.add_to_block(corner, &mut self.blocks.voxels[number]);
            self.deviation_sum += f64::from(sum);
            self.num_deviations += count;
        }
        for (number, is_touched) in is_touched.into_iter().enumerate() {
            if !is_touched {
                self.blocks.seen_through[number] += view.information_through(self.blocks.corners[number]);
            }
        }
        self.num_frames += 1;
    }

    /// Bytes that the field takes with these blocks.
    fn with_touched(&self, touched: &[[i32; 3]]) -> f64 {
        let new = touched.iter().filter(|&&corner| self.blocks.number(corner).is_none()).count();
        ((self.blocks.len() + new) * BLOCK_BYTES) as f64
    }

    fn coarsen(&mut self) {
        self.blocks = self.blocks.coarsened();
        self.voxel_size *= 2.0;
    }

    /// Ratio of the variance that the measurements have to the one that the sensor's noise explains, at least 1: errors of poses and
    /// of the camera's model add to it.
    pub fn variance_ratio(&self) -> f64 {
        if self.num_deviations == 0 {
            return 1.0;
        }
        (self.deviation_sum / self.num_deviations as f64).max(1.0)
    }

    /// The surface.
    pub fn mesh(&self) -> TriangleMesh {
        let mut mesh = extract(&self.blocks, self.voxel_size, self.variance_ratio() as f32);
        let side = 10.0 * self.voxel_size;
        let given = self.options.min_island_area as f32;
        mesh = mesh.without_islands(if given > 0.0 { given } else { side * side });
        mesh.set_normals();
        mesh
    }
}

impl<'a> View<'a> {
    fn new(image: &'a MapImage, model: &'a DepthModel, T_world_camera: &Pose3, voxel_size: f32) -> Self {
        let R = T_world_camera.rotation.to_rotation_matrix().into_inner().map(|entry| entry as f32);
        let R = Mat3A::from_cols_slice(R.as_slice());
        let t = T_world_camera.translation.vector.map(|entry| entry as f32);
        let mut view = Self {
            image,
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
    fn read_pixels(&mut self) {
        let rays = self.image.camera.ray_table();
        let width = self.image.camera.width;
        let pixel = |index: usize| {
            let ray = Vec3A::new(rays.x[index % width] as f32, rays.y[index / width] as f32, 1.0);
            self.read_pixel(index, ray).unwrap_or(NO_DEPTH)
        };
        self.pixels = (0..self.image.depths.len()).map(pixel).collect();
        let num_columns = width.div_ceil(TILE);
        let mut free = vec![f32::INFINITY; num_columns * self.image.camera.height.div_ceil(TILE)];
        for index in 0..self.image.depths.len() {
            let free = &mut free[index / width / TILE * num_columns + index % width / TILE];
            // A pixel without depth may be the edge of something thin.
            *free = free.min(self.depth(index).map_or(0.0, |depth| depth - self.truncation(depth)));
        }
        self.free_depths = free;
    }

    fn read_pixel(&self, index: usize, ray: Vec3A) -> Option<Pixel> {
        let depth = self.depth(index)?;
        let deviation = self.model.deviation(depth);
        let normal = self.normal(index, ray, depth)?;
        // The normal may point either way: that of a surface which is seen points to the camera.
        let facing = if normal.dot(ray) > 0.0 { -normal } else { normal };
        let cosine = -facing.dot(ray) / ray.length();
        (cosine >= MIN_COSINE).then(|| Pixel {
            normal: facing,
            offset: -facing.dot(ray * depth),
            depth,
            truncation: self.truncation(depth),
            reach: -self.truncation(depth) / facing.dot(ray),
            information: cosine / (deviation * deviation),
        })
    }

    /// Depth of a pixel (m).
    #[inline]
    fn depth(&self, pixel: usize) -> Option<f32> {
        let depth = self.image.depths[pixel];
        (depth > 0).then(|| f32::from(depth) * self.image.unit)
    }

    /// Where the field is truncated in front of a surface at this depth and behind it (m).
    fn truncation(&self, depth: f32) -> f32 {
        let (low, high) = (MIN_TRUNCATION_VOXELS * self.voxel_size, MAX_TRUNCATION_VOXELS * self.voxel_size);
        (TRUNCATION_DEVIATIONS * self.model.deviation(depth)).clamp(low, high)
    }

    /// The normal of the surface at a pixel: that of its cell, or, where that is no plane, of its neighbours.
    fn normal(&self, pixel: usize, ray: Vec3A, depth: f32) -> Option<Vec3A> {
        let of_cell = Vec3A::from(self.image.normals[pixel].map(f32::from));
        if of_cell != Vec3A::ZERO {
            return Some(of_cell.normalize());
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

    /// The blocks within the truncation of a surface, in the order in which they are met.
    fn touched_blocks(&self) -> Vec<[i32; 3]> {
        let block_size = self.voxel_size * SIDE as f32;
        let mut found = rustc_hash::FxHashSet::default();
        let mut touched = Vec::new();
        let mut last = [i32::MAX; 3];
        let camera = &self.image.camera;
        let rays = camera.ray_table();
        for (index, pixel) in self.pixels.iter().enumerate().filter(|(_, pixel)| pixel.depth > 0.0) {
            // Pixels that are further apart than this, in powers of two, jump over no block but at its corners.
            let (column, row) = (index % camera.width, index / camera.width);
            let apart = (0.25 * block_size * camera.fx as f32 / pixel.depth) as usize;
            if (column | row) & (apart.max(1).next_power_of_two() / 2).saturating_sub(1) != 0 {
                continue;
            }
            let ray = self.R * Vec3A::new(rays.x[column] as f32, rays.y[row] as f32, 1.0);
            // Along the ray in steps of half a block.
            let num_steps = (4.0 * pixel.reach / block_size).ceil().max(2.0);
            for step in 0..=num_steps as usize {
                let along = pixel.depth + pixel.reach * (2.0 * step as f32 / num_steps - 1.0);
                let point = (ray * along + self.t) / block_size;
                let corner = point.floor().to_array().map(|at| at as i32);
                if corner != last {
                    last = corner;
                    if found.insert(corner) {
                        touched.push(corner);
                    }
                }
            }
        }
        touched
    }

    /// Adds the image to the voxels of a block. Returns the sum and the number of the deviations from what was known.
    fn add_to_block(&self, corner: [i32; 3], voxels: &mut [Voxel; VOXELS]) -> (f32, u64) {
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
            for (x, voxel) in voxels.iter_mut().enumerate() {
                let point = start + along_x * x as f32;
                let Some(index) = self.pixel_at(point) else { continue };
                let pixel = &self.pixels[index];
                let distance = pixel.normal.dot(point) + pixel.offset;
                if !(distance > -pixel.truncation && pixel.depth > 0.0) {
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

    /// The pixel that a point in the camera's frame lies in.
    #[inline]
    fn pixel_at(&self, point: Vec3A) -> Option<usize> {
        let camera = &self.image.camera;
        if point.z <= 0.0 {
            return None;
        }
        let scale = 1.0 / point.z;
        let u = point.x * scale * camera.fx as f32 + camera.cx as f32 + 0.5;
        let v = point.y * scale * camera.fy as f32 + camera.cy as f32 + 0.5;
        let is_inside = u >= 0.0 && v >= 0.0 && u < camera.width as f32 && v < camera.height as f32;
        is_inside.then(|| v as usize * camera.width + u as usize)
    }

    /// Information (1/m^2) with which the image says that a block is empty: as much as of a surface there, where all that is seen in
    /// its direction lies behind it; otherwise 0.
    fn information_through(&self, corner: [i32; 3]) -> f32 {
        let block_size = self.voxel_size * SIDE as f32;
        let radius = 0.87 * block_size; // half of the diagonal
        let center = Vec3A::from(corner.map(|at| (at as f32 + 0.5) * block_size));
        let center = self.R.transpose() * (center - self.t);
        let nearest = center.z - radius;
        if nearest <= 0.0 || self.pixel_at(center).is_none() {
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
