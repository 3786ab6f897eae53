//! Clouds into a field: the plane of the points in and around each cell of space, and the distances of voxels from those planes.
//!
//! Hoppe, DeRose, Duchamp, McDonald and Stuetzle, "Surface reconstruction from unorganized points", SIGGRAPH 1992, with the planes
//! weighted as in Kolluri, "Provably good moving least squares", SODA 2005. It differs from those in two ways:
//!
//! - Planes face the sensors that saw their points, so nothing has to be propagated from one to the next.
//! - A sweep counts once in a cell, however many points it has there: they share the error of its pose.

use glam::{Mat4, Vec3};
use nalgebra::{Matrix3, Vector3};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;

use super::SurfaceOptions;
use super::blocks::{Blocks, MAX_WEIGHT, SIDE, index, positions};
use super::extraction::extract;
use super::fusion::{BLOCK_BYTES, COLOR_BYTES};
use super::pixels::{MIN_COSINE, MIN_TRUNCATION_VOXELS, WEIGHT_INFORMATION};
use crate::error::Result;
use crate::geometry::jacobi::eigenpairs;
use crate::geometry::quantile::quantile;
use crate::geometry::{PointCloud, Pose3, TriangleMesh};

/// Points that a plane is fitted to, at least: twice as many as it has degrees of freedom.
const MIN_POINTS: u32 = 6;
/// The largest standard deviation of points from their plane (sides of a cell). Points that fill their 27 cells evenly have 0.87, those
/// of two planes at a right angle 0.3.
const MAX_THICKNESS: f64 = 0.5;
/// The largest standard deviation of a plane's direction (rad), by which it is off by a sixth of a cell at `REACH`.
const MAX_TILT: f64 = 0.1;
/// A plane tells of voxels up to this distance along it from the mean of its points (sides of a cell): half of the 27 cells.
const REACH: f32 = 1.5;
/// Voxels from a cell to those that its plane tells of, along an axis: half a cell to its mean, `REACH` and the truncation are at most
/// a diagonal of 3 voxels away.
const WINDOW: i32 = 3;
/// Standard deviation that is below any measurement's (sides of a cell): single precision of coordinates up to a kilometre.
const ROUNDING: f64 = 1e-3;

/// Cells grow at least by this until they hold enough points.
const GROWTH: f32 = 1.25;
/// Cells are large enough where the 27 cells around most points hold so many: a plane's direction is then known to
/// `MAX_TILT` where points scatter from it by half as much as they do along it.
const ENOUGH_POINTS: f64 = 25.0;
/// Cells that are looked at for that: the share is known to 1 %.
const NUM_SAMPLED: usize = 2500;

/// A surface of clouds at their poses. It is made of all of them at once.
#[derive(Debug, Clone)]
pub struct CloudFusion {
    options: SurfaceOptions,
    /// Of the sensor, in the frame of its clouds (m).
    viewpoint: Vec3,
    /// Side of the smallest voxel that the points allow (m).
    min_voxel_size: f32,
    voxel_size: f32,
    clouds: BTreeMap<usize, (PointCloud, Pose3)>,
}

impl CloudFusion {
    /// Without clouds, whose sensor is at `viewpoint` (m, in their frame) and of whose points one is left in each cube of side
    /// `spacing` (m).
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub fn new(options: SurfaceOptions, viewpoint: Vec3, spacing: f64) -> Result<Self> {
        options.check()?;
        let min_voxel_size = options.voxel_size.max(spacing) as f32;
        Ok(Self { options, viewpoint, min_voxel_size, voxel_size: min_voxel_size, clouds: BTreeMap::new() })
    }

    /// Puts a cloud in at its pose, in place of the one with this number.
    pub fn put(&mut self, number: usize, cloud: PointCloud, T_world_cloud: Pose3) {
        if T_world_cloud.to_homogeneous().iter().all(|entry| entry.is_finite()) {
            self.clouds.insert(number, (cloud, T_world_cloud));
        }
    }

    /// Takes a cloud out.
    pub fn take_out(&mut self, number: usize) {
        self.clouds.remove(&number);
    }

    /// Number of clouds.
    pub fn num_frames(&self) -> usize {
        self.clouds.len()
    }

    /// Memory of their points (bytes).
    pub fn num_bytes(&self) -> usize {
        let bytes_a_point = |cloud: &PointCloud| size_of::<Vec3>() + if cloud.colors.is_some() { 3 } else { 0 };
        self.clouds.values().map(|(cloud, _)| cloud.len() * bytes_a_point(cloud)).sum()
    }

    /// Side of a voxel of the last [mesh](Self::mesh) (m): that of the options, or larger where the points are too few for it or the
    /// memory is not enough.
    pub fn voxel_size(&self) -> f64 {
        f64::from(self.voxel_size)
    }

    /// The surface.
    pub fn mesh(&mut self) -> TriangleMesh {
        let blocks = self.field();
        let mut mesh = extract(&blocks, self.voxel_size, 1.0 / WEIGHT_INFORMATION);
        mesh = mesh.without_islands(self.options.min_island_area(self.voxel_size));
        mesh.set_normals();
        mesh
    }

    /// The field in the smallest voxels that the points and the memory allow.
    fn field(&mut self) -> Blocks {
        self.voxel_size = self.min_voxel_size;
        let has_colors = self.clouds.values().any(|(cloud, _)| cloud.colors.is_some());
        let bytes_a_block = BLOCK_BYTES + if has_colors { COLOR_BYTES } else { 0 };
        loop {
            let mut cells = Cells::new(self.voxel_size);
            for (number, (cloud, pose)) in (1..).zip(self.clouds.values()) {
                cells.add(number, cloud, pose, self.viewpoint);
            }
            // A voxel that is larger than what is seen has nothing to tell.
            let density = if cells.len() < MIN_POINTS as usize { f64::INFINITY } else { cells.density() };
            if density >= ENOUGH_POINTS {
                let mut blocks = Blocks::default();
                cells.add_to(&mut blocks);
                if (blocks.len() * bytes_a_block) as f64 <= 1e6 * self.options.max_megabytes {
                    return blocks;
                }
            }
            // Of a surface, four times as many lie in cells twice as large.
            self.voxel_size *= GROWTH.max((ENOUGH_POINTS / density).sqrt() as f32 / GROWTH);
        }
    }
}

/// Sums over the points in a cell, in sides of a cell from its middle.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    count: u32,
    sum: Vec3,
    /// xx, yy, zz.
    squares: Vec3,
    /// xy, xz, yz.
    products: Vec3,
    /// Of unit vectors from the points to the sensors.
    towards: Vec3,
    color_sum: [u32; 3],
    /// The last cloud with a point in it, and the number of these.
    last_cloud: u32,
    num_clouds: u32,
}

/// A plane through the points in and around a cell, in sides of a cell from its middle.
struct Plane {
    mean: Vec3,
    /// Facing the sensors.
    normal: Vec3,
    /// Variance of the points along it.
    variance: f32,
}

impl Cell {
    fn add(&mut self, offset: Vec3, towards: Vec3) {
        self.count += 1;
        self.sum += offset;
        self.squares += offset * offset;
        self.products += Vec3::new(offset.x * offset.y, offset.x * offset.z, offset.y * offset.z);
        self.towards += towards;
    }

    /// Adds the sums of a cell so many sides away, as seen from this one.
    fn add_shifted(&mut self, other: &Self, shift: Vec3) {
        let count = other.count as f32;
        let pairs = |a: Vec3, b: Vec3| Vec3::new(a.x * b.y + a.y * b.x, a.x * b.z + a.z * b.x, a.y * b.z + a.z * b.y);
        self.count += other.count;
        self.sum += other.sum + count * shift;
        self.squares += other.squares + 2.0 * shift * other.sum + count * shift * shift;
        self.products += other.products + pairs(shift, other.sum) + 0.5 * count * pairs(shift, shift);
        self.towards += other.towards;
    }

    /// The plane of the points, where they have one.
    fn plane(&self) -> Option<Plane> {
        if self.count < MIN_POINTS {
            return None;
        }
        let count = self.count as f32;
        let (mean, freedom) = (self.sum / count, count - 3.0);
        let variances = self.squares - mean * self.sum;
        let [xx, yy, zz] = (variances / freedom).to_array().map(f64::from);
        let covariances = self.products - Vec3::new(mean.x * self.sum.y, mean.x * self.sum.z, mean.y * self.sum.z);
        let [xy, xz, yz] = (covariances / freedom).to_array().map(f64::from);
        let pairs = eigenpairs(Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
        let &[(variance, normal), (spread, _), _] = pairs.as_slice() else { return None };
        let normal: Vector3<f64> = normal;
        let variance = variance.max(ROUNDING * ROUNDING);
        let is_tilted = variance > MAX_TILT * MAX_TILT * f64::from(count) * spread;
        if is_tilted || variance > MAX_THICKNESS * MAX_THICKNESS {
            return None;
        }
        let normal = Vec3::new(normal.x as f32, normal.y as f32, normal.z as f32);
        let cosine = normal.dot(self.towards) / count;
        let is_seen = cosine.abs() > MIN_COSINE;
        is_seen.then(|| Plane { mean, normal: normal * cosine.signum(), variance: variance as f32 })
    }

    fn color(&self) -> Option<[u8; 3]> {
        let sum = self.color_sum;
        (sum != [0; 3]).then(|| sum.map(|sum| (sum / self.count) as u8))
    }
}

/// Cells of space with the points of clouds at their poses.
struct Cells {
    /// Side of a cell, and of a voxel of the field (m).
    side: f32,
    cells: FxHashMap<[i32; 3], Cell>,
}

impl Cells {
    fn new(side: f32) -> Self {
        Self { side, cells: FxHashMap::default() }
    }

    /// How many points there are in the 27 cells around a point, by some of the cells: three points in four have more.
    fn density(&self) -> f64 {
        let stride = self.cells.len().div_ceil(NUM_SAMPLED).max(1);
        let sampled = self.cells.iter().step_by(stride);
        let counts = sampled
            .flat_map(|(corner, cell)| std::iter::repeat_n(f64::from(self.around(*corner).count), cell.count as usize));
        quantile(&mut counts.collect::<Vec<f64>>(), 0.25).unwrap_or(0.0)
    }

    /// Number of cells with points.
    fn len(&self) -> usize {
        self.cells.len()
    }

    /// Adds a cloud of a sensor at `viewpoint` (m, in the frame of the cloud); `number`: another one for each cloud, from 1.
    fn add(&mut self, number: u32, cloud: &PointCloud, T_world_cloud: &Pose3, viewpoint: Vec3) {
        let matrix = T_world_cloud.to_homogeneous().cast::<f32>();
        let pose = Mat4::from_cols_slice(matrix.as_slice());
        let sensor = pose.transform_point3(viewpoint);
        for (point, position) in cloud.positions.iter().enumerate() {
            let place = pose.transform_point3(*position);
            let scaled = place / self.side;
            let corner = scaled.floor();
            let cell = self.cells.entry(corner.to_array().map(|at| at as i32)).or_default();
            cell.add(scaled - corner - 0.5, (sensor - place).normalize_or_zero());
            if let Some(colors) = &cloud.colors {
                cell.color_sum.iter_mut().zip(colors[point]).for_each(|(sum, value)| *sum += u32::from(value));
            }
            if cell.last_cloud != number {
                (cell.last_cloud, cell.num_clouds) = (number, cell.num_clouds + 1);
            }
        }
    }

    /// The sums of a cell and its 26 neighbours.
    fn around(&self, corner: [i32; 3]) -> Cell {
        let mut all = Cell::default();
        for (z, y, x) in positions(3) {
            let step = [x as i32 - 1, y as i32 - 1, z as i32 - 1];
            if let Some(cell) = self.cells.get(&[corner[0] + step[0], corner[1] + step[1], corner[2] + step[2]]) {
                all.add_shifted(cell, Vec3::new(step[0] as f32, step[1] as f32, step[2] as f32));
            }
        }
        all
    }

    /// Adds the planes of the cells to a field with voxels as large.
    fn add_to(&self, blocks: &mut Blocks) {
        for (corner, cell) in &self.cells {
            if let Some(plane) = self.around(*corner).plane() {
                let variance = plane.variance * self.side * self.side;
                let weight = (cell.num_clouds as f32 / (variance * WEIGHT_INFORMATION)).clamp(1.0, MAX_WEIGHT);
                plane.add_to(blocks, *corner, weight, cell.color());
            }
        }
    }
}

impl Plane {
    /// Adds the distances of voxels from it, and its colour, to those of a field; `corner` is that of its cell.
    fn add_to(&self, blocks: &mut Blocks, corner: [i32; 3], weight: f32, color: Option<[u8; 3]>) {
        // Neighbouring voxels are mostly in the same block.
        let mut last = None;
        for (z, y, x) in positions(2 * WINDOW as usize + 1) {
            let step = [x as i32 - WINDOW, y as i32 - WINDOW, z as i32 - WINDOW];
            let offset = Vec3::new(step[0] as f32, step[1] as f32, step[2] as f32) - self.mean;
            let distance = self.normal.dot(offset);
            let along = (offset.length_squared() - distance * distance) / (REACH * REACH);
            if distance.abs() > MIN_TRUNCATION_VOXELS || along > 1.0 {
                continue;
            }
            let [x, y, z] = [corner[0] + step[0], corner[1] + step[1], corner[2] + step[2]];
            let side = SIDE as i32;
            let of_block = [x.div_euclid(side), y.div_euclid(side), z.div_euclid(side)];
            let known = last.filter(|(of_last, _)| *of_last == of_block).map(|(_, number)| number);
            let number = known.unwrap_or_else(|| blocks.insert(of_block));
            last = Some((of_block, number));
            if color.is_some() {
                blocks.add_colors();
            }
            let at = index(x.rem_euclid(side) as usize, y.rem_euclid(side) as usize, z.rem_euclid(side) as usize);
            let Some((block, colors)) = blocks.get_mut(number) else { continue };
            // A plane counts the less, the farther away its points are.
            block.add(at, (weight * (1.0 - along)) as i32 + 1, distance);
            if let (Some(colors), Some(color)) = (colors, color) {
                colors[at].add(color, false);
            }
        }
    }
}
