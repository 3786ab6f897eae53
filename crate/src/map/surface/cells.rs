//! Cells of space with the points of clouds, and the planes through them.

#![allow(clippy::cast_possible_wrap, reason = "positions within a block are below ten")]

use glam::{Mat4, Vec3};
use nalgebra::{Matrix3, Vector3};
use rustc_hash::FxHashMap;

use super::blocks::{Blocks, MAX_WEIGHT, SIDE, index, positions};
use super::pixels::{MIN_COSINE, MIN_TRUNCATION_VOXELS, WEIGHT_INFORMATION};
use crate::geometry::jacobi::eigenpairs;
use crate::geometry::quantile::quantile;
use crate::geometry::{PointCloud, Pose3};

/// Points that a plane is fitted to, at least: twice as many as it has degrees of freedom.
const MIN_POINTS: u32 = 6;
/// The largest standard deviation of points from their plane (voxels). Points that fill 27 voxels evenly have 0.87, those of two planes
/// at a right angle 0.3.
const MAX_THICKNESS: f64 = 0.5;
/// The largest standard deviation of a plane's direction (rad), by which it is off by a sixth of a cell at `REACH`.
pub(super) const MAX_TILT: f64 = 0.1;
/// A plane tells of voxels up to this distance along it from the mean of its points (sides of a cell): half of the 27 cells.
const REACH: f32 = 1.5;
/// And up to so many standard deviations of the points: evenly spread ones end at 1.73.
const EXTENT: f32 = 2.0;
/// Standard deviation that is below any measurement's (sides of a cell): single precision of coordinates up to a kilometre.
const ROUNDING: f64 = 1e-3;
/// Cells that are looked at for the density of points: shares are known to 1 %.
const NUM_SAMPLED: usize = 2500;

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
    /// Points that no plane has been found for.
    num_open: u32,
}

/// A plane through the points in and around a cell, in sides of a cell from its middle.
struct Plane {
    mean: Vec3,
    /// Facing the sensors.
    normal: Vec3,
    /// Directions within it, divided by how far it reaches along them.
    extents: [Vec3; 2],
    /// Variance of the points along the normal.
    variance: f32,
    /// Of its direction (rad^2).
    tilt_variance: f32,
}

impl Cell {
    fn add(&mut self, offset: Vec3, towards: Vec3) {
        self.count += 1;
        self.num_open += 1;
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

    /// In sides of a cell that are twice as long.
    fn halved(&self) -> Self {
        Self { sum: self.sum / 2.0, squares: self.squares / 4.0, products: self.products / 4.0, ..*self }
    }

    /// Adds the sums of one of its eighths, so many sides away.
    fn add_eighth(&mut self, other: &Self, shift: Vec3) {
        self.add_shifted(&other.halved(), shift);
        self.num_open += other.num_open;
        self.num_clouds = self.num_clouds.max(other.num_clouds);
        self.color_sum.iter_mut().zip(other.color_sum).for_each(|(sum, value)| *sum += value);
    }

    /// The plane of the points, where they have one; `max_thickness`: their largest standard deviation from it (sides of a cell).
    fn plane(&self, max_thickness: f64) -> Option<Plane> {
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
        let &[(variance, normal), (spread, along), (length, further)] = pairs.as_slice() else { return None };
        let single = |v: Vector3<f64>| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
        let variance = variance.max(ROUNDING * ROUNDING);
        let tilt_variance = variance / (f64::from(count) * spread);
        if !(tilt_variance <= MAX_TILT * MAX_TILT && variance <= max_thickness * max_thickness) {
            return None;
        }
        let extents = [(along, spread), (further, length)]
            .map(|(direction, variance)| single(direction) / (EXTENT * (variance as f32).sqrt()).min(REACH));
        let normal = single(normal);
        let cosine = normal.dot(self.towards) / count;
        let is_seen = cosine.abs() > MIN_COSINE;
        let [variance, tilt_variance] = [variance, tilt_variance].map(|variance| variance as f32);
        is_seen.then(|| Plane { mean, normal: normal * cosine.signum(), extents, variance, tilt_variance })
    }

    fn color(&self) -> Option<[u8; 3]> {
        let sum = self.color_sum;
        (sum != [0; 3]).then(|| sum.map(|sum| (sum / self.count) as u8))
    }
}

/// Cells of space with the points of clouds at their poses.
pub(super) struct Cells {
    /// Side of a voxel of the field (m), and that of a cell (voxels).
    voxel_size: f32,
    scale: i32,
    by_corner: FxHashMap<[i32; 3], Cell>,
}

impl Cells {
    /// As large as the voxels (m).
    pub(super) fn new(voxel_size: f32) -> Self {
        Self { voxel_size, scale: 1, by_corner: FxHashMap::default() }
    }

    /// Twice as large, with the same points.
    pub(super) fn coarser(&self) -> Self {
        let mut by_corner: FxHashMap<[i32; 3], Cell> = FxHashMap::default();
        for (corner, cell) in &self.by_corner {
            let shift = corner.map(|at| if at.rem_euclid(2) == 0 { -0.25 } else { 0.25 });
            let parent = by_corner.entry(corner.map(|at| at.div_euclid(2))).or_default();
            parent.add_eighth(cell, Vec3::from_array(shift));
        }
        Self { voxel_size: self.voxel_size, scale: 2 * self.scale, by_corner }
    }

    /// How many points there are in the 27 cells around a point, by some of the cells: three points in four have more.
    pub(super) fn density(&self) -> f64 {
        let stride = self.by_corner.len().div_ceil(NUM_SAMPLED).max(1);
        let sampled = self.by_corner.iter().step_by(stride);
        let counts = sampled
            .flat_map(|(corner, cell)| std::iter::repeat_n(f64::from(self.around(*corner).count), cell.count as usize));
        quantile(&mut counts.collect::<Vec<f64>>(), 0.25).unwrap_or(0.0)
    }

    /// Number of points in them.
    pub(super) fn num_points(&self) -> usize {
        self.by_corner.values().map(|cell| cell.count as usize).sum()
    }

    /// Their memory.
    pub(super) fn num_bytes(&self) -> usize {
        self.by_corner.capacity() * size_of::<([i32; 3], Cell)>()
    }

    /// Adds a cloud of a sensor at `viewpoint` (m, in the frame of the cloud); `number`: another one for each cloud, from 1.
    pub(super) fn add(&mut self, number: u32, cloud: &PointCloud, T_world_cloud: &Pose3, viewpoint: Vec3) {
        let matrix = T_world_cloud.to_homogeneous().cast::<f32>();
        let pose = Mat4::from_cols_slice(matrix.as_slice());
        let sensor = pose.transform_point3(viewpoint);
        for (point, position) in cloud.positions.iter().enumerate().filter(|(_, position)| position.is_finite()) {
            let place = pose.transform_point3(*position);
            let scaled = place / self.voxel_size;
            let corner = scaled.floor();
            let cell = self.by_corner.entry(corner.to_array().map(|at| at as i32)).or_default();
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
            if let Some(cell) = self.by_corner.get(&[corner[0] + step[0], corner[1] + step[1], corner[2] + step[2]]) {
                all.add_shifted(cell, Vec3::new(step[0] as f32, step[1] as f32, step[2] as f32));
            }
        }
        all
    }

    /// Adds the planes of cells to a field: of those in which most points have none yet.
    pub(super) fn add_to(&mut self, blocks: &mut Blocks) {
        let max_thickness = MAX_THICKNESS / f64::from(self.scale);
        let is_open = |(_, cell): &(&[i32; 3], &Cell)| 2 * cell.num_open > cell.count;
        let plane_of = |(corner, _): (&[i32; 3], &Cell)| Some((*corner, self.around(*corner).plane(max_thickness)?));
        let planes: Vec<([i32; 3], Plane)> = self.by_corner.iter().filter(is_open).filter_map(plane_of).collect();
        let unit = (self.voxel_size * self.scale as f32).powi(2) * WEIGHT_INFORMATION;
        for (corner, plane) in planes {
            let Some(cell) = self.by_corner.get_mut(&corner) else { continue };
            cell.num_open = 0;
            // Planes of cells of a surface that share a point: their directions err together, so they count as one.
            let num_sharing = (2.0 * REACH).powi(2);
            let tilt_variance = num_sharing * plane.tilt_variance;
            let variances = [plane.variance / cell.num_clouds as f32, tilt_variance * REACH * REACH];
            let variances = variances.map(|variance| variance * unit);
            plane.add_to(blocks, corner, self.scale, variances, cell.color());
        }
    }
}

impl Plane {
    /// Adds the distances of voxels from it, and its colour, to those of a field; `corner` is that of its cell, of side `scale` (voxels);
    /// `variances` are those of its place at its middle and by its tilt at `REACH` from there, each times the information of a weight of 1.
    fn add_to(&self, blocks: &mut Blocks, corner: [i32; 3], scale: i32, variances: [f32; 2], color: Option<[u8; 3]>) {
        let mean = (Vec3::from_array(corner.map(|at| at as f32 + 0.5)) + self.mean) * scale as f32;
        let reach = REACH * scale as f32;
        let [u, v, w] = self.axes();
        // Along the axis that is nearest to the normal, the voxels in reach of the truncation are few.
        let tall = MIN_TRUNCATION_VOXELS / self.normal[w].abs();
        let range = |middle: f32, half: f32| (middle - half).floor() as i32..=(middle + half).floor() as i32;
        // Neighbouring voxels are mostly in the same block.
        let mut last = None;
        let mut voxel = [0; 3];
        for at_u in range(mean[u], reach) {
            for at_v in range(mean[v], reach) {
                let off = [at_u as f32 + 0.5 - mean[u], at_v as f32 + 0.5 - mean[v]];
                let middle = mean[w] - (self.normal[u] * off[0] + self.normal[v] * off[1]) / self.normal[w];
                for at_w in range(middle, tall) {
                    (voxel[u], voxel[v], voxel[w]) = (at_u, at_v, at_w);
                    let offset = Vec3::from_array(voxel.map(|at| at as f32 + 0.5)) - mean;
                    let distance = self.normal.dot(offset);
                    let along = self.extents.map(|extent| extent.dot(offset) / scale as f32);
                    let along = along[0] * along[0] + along[1] * along[1];
                    if distance.abs() <= MIN_TRUNCATION_VOXELS && along <= 1.0 {
                        let weight = (variances[0] + variances[1] * along).recip().min(MAX_WEIGHT);
                        // It ends gently.
                        let weight = (weight * (1.0 - along)) as i32 + 1;
                        add_voxel(blocks, &mut last, voxel, weight, distance, color);
                    }
                }
            }
        }
    }

    /// The axes, that nearest to the normal last.
    fn axes(&self) -> [usize; 3] {
        let [x, y, z] = self.normal.abs().to_array();
        if x > y && x > z {
            [1, 2, 0]
        } else if y > z {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        }
    }
}

/// Adds a distance (voxels) and a colour to those of a voxel; `last` is the block that was used last, with its number.
fn add_voxel(
    blocks: &mut Blocks,
    last: &mut Option<([i32; 3], usize)>,
    voxel: [i32; 3],
    weight: i32,
    distance: f32,
    color: Option<[u8; 3]>,
) {
    let side = SIDE as i32;
    let corner = voxel.map(|at| at.div_euclid(side));
    let number = match *last {
        Some((of_last, number)) if of_last == corner => number,
        _ => blocks.insert(corner),
    };
    *last = Some((corner, number));
    if color.is_some() {
        blocks.add_colors();
    }
    let [x, y, z] = voxel.map(|at| at.rem_euclid(side) as usize);
    let Some((block, colors)) = blocks.get_mut(number) else { return };
    block.add(index(x, y, z), weight, distance);
    if let (Some(colors), Some(color)) = (colors, color) {
        colors[index(x, y, z)].add(color, false);
    }
}
