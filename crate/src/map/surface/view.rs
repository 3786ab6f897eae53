//! A depth image at its pose: what it says of the points in space.

#![allow(
    clippy::inline_always,
    reason = "the innermost loop of the fusion, which a build for tests else leaves as calls"
)]
#![allow(clippy::cast_possible_wrap, reason = "images have less than 2^31 pixels")]

use glam::{Mat3A, Mat4, Vec3A, Vec4};
use wide::{f32x4, i32x4};

use super::blocks::{Block, BlockColors, PART_SIDE, PART_VOXELS, SIDE, STEPS, VOXELS, positions};
use super::depth_tiles::{DepthTiles, Depths, Rectangle, free_up_to};
use super::pixels::{MIN_TRUNCATION_VOXELS, NUM_LEVELS, Optics, Pixel, Pixels, Seen, side_at};
use crate::geometry::Pose3;
use crate::preprocess::map_image::MapImage;

/// A camera in the field: the world is in voxels, its own frame in metres.
#[derive(Debug, Clone)]
pub(super) struct PosedCamera {
    /// World to camera, with the voxel's side in it.
    to_camera: Mat3A,
    /// The origin of the world, in the camera's frame (m).
    origin: Vec3A,
    /// Focal lengths and centre, where a pixel begins at a whole number.
    projection: [f32; 4],
    /// Of the cube with a side of two voxels about a point, half of its extent along the camera's axes (m).
    extent: Vec3A,
}

/// Where a cube of voxels lies in an image.
struct Bounds {
    rectangle: Rectangle,
    /// Least and largest depth (m).
    depths: [f32; 2],
}

impl PosedCamera {
    fn new(T_world_camera: &Pose3, projection: [f32; 4], voxel_size: f32) -> Self {
        let T_camera_world = T_world_camera.inverse();
        let R = T_camera_world.rotation.to_rotation_matrix().into_inner().map(|entry| entry as f32);
        let to_camera = Mat3A::from_cols_slice(R.as_slice()) * voxel_size;
        let t = T_camera_world.translation.vector.map(|entry| entry as f32);
        let extent = to_camera.x_axis.abs() + to_camera.y_axis.abs() + to_camera.z_axis.abs();
        Self { to_camera, origin: Vec3A::new(t.x, t.y, t.z), projection, extent }
    }

    /// Of the voxels of a level from one on, `side` along each axis: their centres. None where the plane of the camera is not before all
    /// of them.
    #[inline]
    fn bounds(&self, first: Vec3A, side: usize, level: usize) -> Option<Bounds> {
        let (half, scale) = (0.5 * (side - 1) as f32, side_at(level));
        let center = self.to_camera * ((first + half + 0.5) * scale) + self.origin;
        let half = half * scale;
        let (low, high) = (center - half * self.extent, center + half * self.extent);
        if low.z <= 0.0 {
            return None;
        }
        let [fx, fy, cx, cy] = self.projection;
        let (nearest, farthest) = (1.0 / low.z, 1.0 / high.z);
        let least = |at: f32| at * if at > 0.0 { farthest } else { nearest };
        let most = |at: f32| at * if at > 0.0 { nearest } else { farthest };
        let rectangle = Rectangle {
            low: [least(low.x) * fx + cx, least(low.y) * fy + cy],
            high: [most(high.x) * fx + cx, most(high.y) * fy + cy],
        };
        Some(Bounds { rectangle, depths: [low.z, high.z] })
    }
}

/// What an image says of the space that it sees through: small enough to be kept for all images.
#[derive(Debug, Clone)]
pub(super) struct FreeSpace {
    camera: PosedCamera,
    tiles: DepthTiles,
}

impl FreeSpace {
    /// For voxels twice as large.
    pub(super) fn double_voxels(&mut self) {
        self.camera.to_camera *= 2.0;
        self.camera.extent *= 2.0;
    }

    /// Weight with which the image says that a block is empty: that of a surface there, where all that is seen in its direction lies
    /// behind it; otherwise 0.
    pub(super) fn weight_through(&self, corner: [i32; 3], level: usize, optics: &Optics) -> i32 {
        let Some(bounds) = self.camera.bounds(first_voxel(corner), SIDE, level) else { return 0 };
        weight_through(&bounds, &self.tiles, optics).0
    }
}

/// Whether all rays through a cube are free: the weight of that, otherwise 0; and the depths in which the field is measured there.
#[inline]
fn weight_through(Bounds { rectangle, depths }: &Bounds, tiles: &DepthTiles, optics: &Optics) -> (i32, Depths) {
    let (measured, is_inside) = tiles.depths(rectangle);
    let is_free = is_inside && depths[1] < measured[0];
    (if is_free { optics.weight(depths[1]) as i32 } else { 0 }, measured)
}

#[inline]
fn first_voxel([x, y, z]: [i32; 3]) -> Vec3A {
    Vec3A::new(x as f32, y as f32, z as f32) * SIDE as f32
}

/// A depth image at its pose, as the field reads it.
pub(super) struct View<'a> {
    image: &'a MapImage,
    pub(super) optics: &'a Optics,
    pixels: Pixels<'a>,
    camera: PosedCamera,
    tiles: DepthTiles,
    /// Of each level, blocks within the truncation of a surface, some more than once.
    pub(super) touched: [Vec<[i32; 3]>; NUM_LEVELS],
}

/// What an image adds to the sum of the squares of the distances (weighted, steps^2), and the number of those.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Squares {
    pub sum: f64,
    pub count: i64,
}

impl<'a> View<'a> {
    pub(super) fn new(image: &'a MapImage, optics: &'a Optics, T_world_camera: &Pose3, voxel_size: f32) -> Self {
        let mut pixels = Pixels::new(image, optics);
        let fx = image.camera.fx as f32;
        let mut touched: [Touched; NUM_LEVELS] =
            std::array::from_fn(|level| Touched::new(T_world_camera, voxel_size * side_at(level), fx));
        let [fx, fy, cx, cy] = pixels.projection();
        let tiles = DepthTiles::new(image.camera.width, image.camera.height, |column, row| {
            if let Some(seen) = pixels.seen(column, row) {
                touched[seen.level].see(&seen, [column, row], optics);
                let [nearest, farthest] = pixels.set(column, row, &seen);
                let mut depths = free_up_to(nearest);
                depths[1 + seen.level] = farthest;
                return depths;
            }
            // Without depth it may be the edge of something thin.
            let free = pixels.truncation(column, row).map_or(0.0, |(depth, truncation)| depth - truncation);
            free_up_to(free)
        });
        let camera = PosedCamera::new(T_world_camera, [fx, fy, cx - 1.0, cy - 1.0], voxel_size);
        Self { image, optics, pixels, camera, tiles, touched: touched.map(|touched| touched.blocks) }
    }

    pub(super) fn has_colors(&self) -> bool {
        self.image.colors.is_some()
    }

    pub(super) fn free_space(&self) -> FreeSpace {
        FreeSpace { camera: self.camera.clone(), tiles: self.tiles.without_smallest() }
    }

    /// Adds the image to the voxels of a block, or takes it out.
    pub(super) fn change_block<const IS_TAKEN_OUT: bool>(
        &self,
        corner: [i32; 3],
        level: usize,
        block: &mut Block,
        mut colors: Option<&mut BlockColors>,
        squares: &mut Squares,
    ) {
        let corner = first_voxel(corner);
        for (part, (z, y, x)) in positions(SIDE / PART_SIDE).enumerate() {
            let first = corner + Vec3A::new(x as f32, y as f32, z as f32) * PART_SIDE as f32;
            let Some(bounds) = self.camera.bounds(first, PART_SIDE, level) else { continue };
            let (through, depths) = weight_through(&bounds, &self.tiles, self.optics);
            if through > 0 {
                block.seen_through[part] += if IS_TAKEN_OUT { -through } else { through };
            } else if bounds.depths[0] < depths[1 + level]
                && self.change_part::<IS_TAKEN_OUT>(first, part, level, block, colors.as_deref_mut(), squares)
            {
                let share = self.optics.noise_share(0.5 * (bounds.depths[0] + bounds.depths[1]));
                block.noise_shares[part] += if IS_TAKEN_OUT { -share } else { share };
            }
        }
    }

    /// The same for a part of it, whose first voxel is `first` in the world. Returns whether it measured anything there.
    fn change_part<const IS_TAKEN_OUT: bool>(
        &self,
        first: Vec3A,
        part: usize,
        level: usize,
        block: &mut Block,
        mut colors: Option<&mut BlockColors>,
        squares: &mut Squares,
    ) -> bool {
        let mut rows = Rows::new(&self.camera, &self.pixels, first, level);
        let (mut sum, mut count) = (f32x4::ZERO, i32x4::ZERO);
        for row in 0..PART_SIDE * PART_SIDE {
            let measured = rows.measure();
            rows.step(row % PART_SIDE == PART_SIDE - 1);
            let is_measured = measured.weights.simd_gt(f32x4::ZERO);
            if !is_measured.any() {
                continue;
            }
            let products = measured.weights * measured.distances;
            sum += products * measured.distances;
            count -= bytemuck::cast::<f32x4, i32x4>(is_measured);
            let from = part * PART_VOXELS + row * PART_SIDE;
            change::<IS_TAKEN_OUT>(&mut block.distances, from, products);
            change::<IS_TAKEN_OUT>(&mut block.weights, from, measured.weights);
            if let (Some(sums), Some(colors)) = (&mut colors, &self.image.colors) {
                // Those at the corners of cells that the surface crosses.
                let near = measured.distances.abs().simd_lt(f32x4::splat(MIN_TRUNCATION_VOXELS * STEPS));
                let mut lanes = (near & is_measured).to_bitmask();
                while lanes != 0 {
                    let lane = lanes.trailing_zeros() as usize;
                    lanes &= lanes - 1;
                    sums[from + lane].add(colors[self.pixels.number(measured.pixels[lane])], IS_TAKEN_OUT);
                }
            }
        }
        squares.sum += f64::from(sum.reduce_add());
        let count = count.reduce_add();
        squares.count += i64::from(count);
        count > 0
    }
}

/// Adds rounded numbers to four sums, or takes them off.
#[inline(always)]
fn change<const IS_TAKEN_OUT: bool>(sums: &mut [i32; VOXELS], from: usize, values: f32x4) {
    let sums: &mut [i32] = &mut sums[from..from + PART_SIDE];
    let before = i32x4::from([sums[0], sums[1], sums[2], sums[3]]);
    let after = if IS_TAKEN_OUT { before - rounded(values) } else { before + rounded(values) };
    sums.copy_from_slice(&after.to_array());
}

/// Single precision has whole numbers alone from here on, up to twice this.
const WHOLE: f32 = f32::EPSILON.recip();

/// The nearest whole numbers of those below 2^22: a sum and a difference, where the conversion takes ten instructions in WebAssembly.
#[inline(always)]
fn rounded(values: f32x4) -> i32x4 {
    let middle = f32x4::splat(1.5 * WHOLE);
    bytemuck::cast::<f32x4, i32x4>(values + middle) - bytemuck::cast::<f32x4, i32x4>(middle)
}

/// The rows of four voxels of a part of a block, in the camera's frame: a point is u z, v z and z of its pixel (u, v) and its depth z.
struct Rows<'a> {
    pixels: &'a [Pixel],
    /// Pixels in a row, and the last column and row.
    stride: f32x4,
    last: [f32x4; 2],
    level: f32x4,
    /// Of the four voxels of a row.
    at: [f32x4; 3],
    /// To the next row along y, and from the last row of a layer to the first of the next.
    steps: [[f32x4; 3]; 2],
}

/// What an image says of the four voxels of a row.
struct Measured {
    pixels: [i32; 4],
    /// Steps, up to the truncation in front.
    distances: f32x4,
    /// 0 where nothing was measured.
    weights: f32x4,
}

impl<'a> Rows<'a> {
    #[inline(always)]
    fn new(camera: &PosedCamera, pixels: &'a Pixels, first: Vec3A, level: usize) -> Self {
        let [fx, fy, cx, cy] = pixels.projection();
        let projected = |p: Vec3A| Vec3A::new(fx * p.x + cx * p.z, fy * p.y + cy * p.z, p.z);
        let to_camera = camera.to_camera * side_at(level);
        let along_x = projected(to_camera.x_axis);
        let (along_y, along_z) = (projected(to_camera.y_axis), projected(to_camera.z_axis));
        let start = projected(to_camera * (first + 0.5) + camera.origin);
        let lanes = f32x4::from([0.0, 1.0, 2.0, 3.0]);
        let row = |start: f32, step: f32| f32x4::splat(start) + f32x4::splat(step) * lanes;
        let at = [row(start.x, along_x.x), row(start.y, along_x.y), row(start.z, along_x.z)];
        let to_next_layer = along_z - along_y * (PART_SIDE - 1) as f32;
        let steps = [along_y, to_next_layer].map(|step| step.to_array().map(f32x4::splat));
        let [column, row] = pixels.last();
        let (stride, last) = (f32x4::splat(pixels.stride() as f32), [f32x4::splat(column), f32x4::splat(row)]);
        let level = f32x4::splat(level as f32);
        Self { pixels: &pixels.all, stride, last, level, at, steps }
    }

    #[inline(always)]
    fn step(&mut self, is_last_of_layer: bool) {
        let step = self.steps[usize::from(is_last_of_layer)];
        self.at = std::array::from_fn(|axis| self.at[axis] + step[axis]);
    }

    #[inline(always)]
    fn measure(&self) -> Measured {
        let [x, y, z] = self.at;
        // Rounded, the depth of a voxel just before the camera may be 0; 0 / 0 would be no pixel.
        let away = f32x4::ONE / z.fast_max(f32x4::splat(f32::MIN_POSITIVE));
        let at = self.pixels_at(x * away, y * away);
        let [p, q, r, s] = at.map(|at| self.pixels[at as usize]);
        let planes = Mat4::from_cols(p.plane, q.plane, r.plane, s.plane).transpose();
        let limits = Mat4::from_cols(p.limits, q.limits, r.limits, s.limits).transpose();
        let [a, b, c, d] = [planes.x_axis, planes.y_axis, planes.z_axis, planes.w_axis].map(lanes);
        let [truncations, weights, levels] = [limits.x_axis, limits.y_axis, limits.z_axis].map(lanes);
        let distances = a * x + b * y + c * z + d;
        let is_near = distances.simd_gt(-truncations) & levels.simd_eq(self.level);
        Measured { pixels: at, distances: distances.fast_min(truncations), weights: weights & is_near }
    }

    /// The pixels at these columns and rows; whatever is outside of the image is on its border. Numbers are rounded down, and
    /// multiplied, where floats have whole numbers alone: conversions take ten instructions in WebAssembly.
    #[inline(always)]
    fn pixels_at(&self, columns: f32x4, rows: f32x4) -> [i32; 4] {
        let (half, whole) = (f32x4::splat(0.5), f32x4::splat(WHOLE));
        let floor = f32x4::splat(WHOLE - 0.5);
        let columns = columns.fast_max(half).fast_min(self.last[0]) + floor;
        let rows = rows.fast_max(half).fast_min(self.last[1]) + floor - whole;
        let numbers = bytemuck::cast::<f32x4, i32x4>(rows * self.stride + columns);
        (numbers - bytemuck::cast::<f32x4, i32x4>(whole)).to_array()
    }
}

/// The same register by its other name: matrices are transposed by glam, whose code for that is quick in WebAssembly as well.
#[inline(always)]
fn lanes(vector: Vec4) -> f32x4 {
    bytemuck::cast(vector)
}

/// Places of [`Touched::recent`].
const NUM_RECENT: usize = 16 * 16 * 16;

/// The blocks that surfaces touch, some more than once.
struct Touched {
    /// PosedCamera to world, in blocks.
    R: Mat3A,
    t: Vec3A,
    block_size: f32,
    /// From this depth on, pixels that are 1, 2, 4, ... apart jump over no block but at its corners: half a block (m).
    depths: [f32; 16],
    /// By a hash, the last block that had it: neighbouring rays meet the same blocks.
    recent: Vec<[i32; 3]>,
    blocks: Vec<[i32; 3]>,
}

impl Touched {
    fn new(T_world_camera: &Pose3, voxel_size: f32, fx: f32) -> Self {
        let R = T_world_camera.rotation.to_rotation_matrix().into_inner().map(|entry| entry as f32);
        let t = T_world_camera.translation.vector.map(|entry| entry as f32);
        let block_size = voxel_size * SIDE as f32;
        Self {
            R: Mat3A::from_cols_slice(R.as_slice()) * block_size.recip(),
            t: Vec3A::new(t.x, t.y, t.z) / block_size,
            block_size,
            depths: std::array::from_fn(|power| 0.5 * block_size * fx / (2 << power) as f32),
            recent: vec![[i32::MAX; 3]; NUM_RECENT],
            blocks: Vec::new(),
        }
    }

    /// Takes in the blocks along the ray of a pixel that lie within the truncation.
    #[inline]
    fn see(&mut self, seen: &Seen, [column, row]: [usize; 2], optics: &Optics) {
        // The more often both are even, the wider apart are the pixels that are alike. The last column and row are among all of these.
        let of_side = |at: usize, rays: &[f32]| if at + 1 == rays.len() { 0 } else { at };
        let either = of_side(column, &optics.rays[0]) | of_side(row, &optics.rays[1]);
        let power = (either.trailing_zeros() as usize).min(self.depths.len() - 1);
        if seen.depth < self.depths[power] {
            return;
        }
        let ray = self.R * Vec3A::new(optics.rays[0][column], optics.rays[1][row], 1.0);
        // In steps of half a block.
        let num_steps = (4.0 * seen.reach / self.block_size).ceil().max(2.0);
        for step in 0..=num_steps as usize {
            let along = seen.depth + seen.reach * (2.0 * step as f32 / num_steps - 1.0);
            let at = ray * along + self.t;
            let corner = [floor(at.x), floor(at.y), floor(at.z)];
            let recent = &mut self.recent[slot(corner)];
            if *recent != corner {
                *recent = corner;
                self.blocks.push(corner);
            }
        }
    }
}

/// Where [`Touched::recent`] has a block: those of a cube of 16 blocks each have their own place.
#[inline]
fn slot([x, y, z]: [i32; 3]) -> usize {
    (x & 15 | (y & 15) << 4 | (z & 15) << 8) as usize
}

/// Without an instruction of the processor for it, `f32::floor` is a call of a function.
#[inline]
fn floor(value: f32) -> i32 {
    let whole = value as i32;
    whole - i32::from(value < whole as f32)
}
