//! The map that clouds are registered to: one point with a normal per voxel, with an index that grows with it.
//!
//! A k-d tree would have to be built anew for every cloud. Points are found by blocks of voxels in a hash table instead, as in Bai et al.,
//! "Faster-LIO: lightweight tightly coupled lidar-inertial odometry using parallel sparse incremental voxels", RA-L 7 (2022).

use nalgebra::Vector3;

use crate::geometry::{Pose3, RigidMotion};
use crate::preprocess::voxel_hash::{Voxel as Cell, VoxelHash};
use crate::registration::icp::Source;
use crate::registration::target::{CLEARANCE_FACTOR, LastSearch, OrientedTarget, SurfaceTarget, Target};
use crate::search::Neighbor;
use crate::search::kd_tree::{LANES, smaller};

/// Voxels along the side of a block: a surface then has about 16 points in one, as a leaf of a tree.
const BLOCK_SIDE: i32 = 4;
/// Relative error of squared distances in single precision, at most.
const ROUNDING_SHARE: f64 = 1e-5;

/// The points in a voxel.
#[derive(Debug, Clone, Copy)]
struct Voxel {
    mean: Vector3<f64>,
    normal_sum: Vector3<f64>,
    /// The sum to unit length.
    normal: Vector3<f64>,
    count: f64,
    /// Number of the cloud that it was first seen by.
    cloud: u32,
    /// Length of the path (m) up to the cloud that it was last seen by.
    last_seen: f64,
    /// Its place among the points of its block.
    place: u32,
}

/// The points of a block of voxels.
struct Block {
    cell: Cell,
    points: Vec<Lanes>,
    num_points: u32,
}

/// Points of a block: means from its lowest corner, where single precision is enough however far the world's origin is, axis by axis,
/// and the numbers of their voxels. Unused entries hold infinity.
struct Lanes {
    coordinates: [[f32; LANES]; 3],
    numbers: [u32; LANES],
}

/// Points with normals in the world frame, at most one a cube of side `voxel_size`.
pub struct CloudMap {
    hash: VoxelHash,
    voxels: Vec<Voxel>,
    block_hash: VoxelHash,
    blocks: Vec<Block>,
}

impl CloudMap {
    /// A map without points; `voxel_size` in m.
    pub(crate) fn new(voxel_size: f64) -> Self {
        let block_hash = VoxelHash::new(f64::from(BLOCK_SIDE) * voxel_size);
        Self { hash: VoxelHash::new(voxel_size), voxels: Vec::new(), block_hash, blocks: Vec::new() }
    }

    /// Adds the points with normals (sensor frame) of the cloud of this number, after a path of this length (m), from `T_world_sensor`;
    /// points without a normal are left out.
    pub(crate) fn insert(&mut self, (cloud, path_length): (u32, f64), source: &Source<'_, Vector3<f64>>, T: &Pose3) {
        for (point, normal) in source.points.iter().zip(source.normals.unwrap_or_default()) {
            let Some(normal) = normal else { continue };
            let (point, normal) = (T.act(point), T.rotate(normal));
            let Some(cell) = self.hash.voxel(&point) else { continue };
            let Some(number) = self.hash.number(&cell) else {
                let voxel = Voxel {
                    mean: point,
                    normal_sum: normal,
                    normal,
                    count: 1.0,
                    cloud,
                    last_seen: path_length,
                    place: 0,
                };
                self.push(cell, voxel);
                continue;
            };
            let voxel = &mut self.voxels[number as usize];
            voxel.last_seen = path_length;
            // The two sides of a thin wall must not be averaged: the side seen first is kept.
            if voxel.normal.dot(&normal) > 0.0 {
                voxel.add(&point, &normal);
                let (mean, place) = (voxel.mean, voxel.place);
                let block = self.block(&cell);
                let corner = self.corner(&self.blocks[block].cell);
                self.blocks[block].set(place, &(mean - corner), number);
            }
        }
    }

    /// Adds a voxel that is not there yet.
    fn push(&mut self, cell: Cell, voxel: Voxel) {
        let (number, block) = (self.hash.insert(cell), self.block(&cell));
        let corner = self.corner(&self.blocks[block].cell);
        let block = &mut self.blocks[block];
        let place = block.num_points;
        self.voxels.push(Voxel { place, ..voxel });
        block.num_points += 1;
        block.set(place, &(voxel.mean - corner), number);
    }

    /// Forgets what was last seen before the path had this length (m).
    pub(crate) fn forget(&mut self, path_length: f64) {
        let old = std::mem::replace(self, Self::new(self.hash.voxel_size()));
        for voxel in old.voxels.into_iter().filter(|voxel| voxel.last_seen >= path_length) {
            // A mean at the border of its voxel may be rounded into the next one.
            let cell = self.hash.voxel(&voxel.mean).filter(|cell| self.hash.number(cell).is_none());
            if let Some(cell) = cell {
                self.push(cell, voxel);
            }
        }
    }

    /// All points with their unit normals (world frame).
    pub(crate) fn points(&self) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + '_ {
        self.voxels.iter().map(|voxel| (voxel.mean, voxel.normal))
    }

    /// The points within `radius` (m) of a position in the world, in a tree.
    pub(crate) fn around(&self, place: &Vector3<f64>, radius: f64) -> OrientedTarget<3> {
        let near = self.points().filter(|(point, _)| (point - place).norm_squared() <= radius * radius);
        let (points, normals) = near.map(|(point, normal)| (point, Some(normal))).unzip();
        OrientedTarget::new(points, normals)
    }

    /// The index of the block of a voxel, which is made where there is none.
    fn block(&mut self, cell: &Cell) -> usize {
        let cell = cell.map(|x| x.div_euclid(BLOCK_SIDE));
        let index = self.block_hash.insert(cell) as usize;
        if index == self.blocks.len() {
            self.blocks.push(Block { cell, points: Vec::new(), num_points: 0 });
        }
        index
    }

    /// The lowest corner of a block (m).
    fn corner(&self, cell: &Cell) -> Vector3<f64> {
        Vector3::from(cell.map(f64::from)) * self.block_hash.voxel_size()
    }

    /// The number of the cloud that first saw the voxel of a point (world frame), if any did.
    pub(crate) fn first_seen_by(&self, point: &Vector3<f64>) -> Option<u32> {
        let number = self.hash.number(&self.hash.voxel(point)?)?;
        Some(self.voxels[number as usize].cloud)
    }

    /// Compares the points of a block with the nearest one so far.
    fn search_block(&self, block: &Block, query: &Vector3<f64>, best: &mut Neighbor) {
        let query = (query - self.corner(&block.cell)).map(|x| x as f32);
        for lanes in &block.points {
            let mut sq_distances = [0.0; LANES];
            for (coordinates, x) in lanes.coordinates.iter().zip(&query) {
                for (sum, coordinate) in sq_distances.iter_mut().zip(coordinates) {
                    *sum += (coordinate - x) * (coordinate - x);
                }
            }
            // Few are near enough: they are looked at one by one only where one is.
            if sq_distances.iter().copied().fold(f32::INFINITY, smaller) <= best.sq_distance {
                for (&sq_distance, &index) in sq_distances.iter().zip(&lanes.numbers) {
                    if sq_distance < best.sq_distance || (sq_distance == best.sq_distance && index < best.index) {
                        *best = Neighbor { index, sq_distance };
                    }
                }
            }
        }
    }

    /// Compares the points of all blocks that are `ring` blocks away along one axis, and at most so far along the others.
    fn search_ring(&self, ring: i32, center: &Cell, query: &Vector3<f64>, best: &mut Neighbor) {
        let side = self.block_hash.voxel_size();
        // Squared distance along an axis to the blocks with this coordinate.
        let sq_offset = |axis: usize, coordinate: i32| {
            let low = f64::from(coordinate) * side - query[axis];
            // Comparisons, for `f64::max` is a function call on targets without such an instruction.
            let outside = if low > 0.0 { low } else { -low - side };
            if outside > 0.0 { outside * outside * (1.0 - ROUNDING_SHARE) } else { 0.0 }
        };
        let is_near = |sq_offset: f64, best: &Neighbor| sq_offset <= f64::from(best.sq_distance);
        for z in -ring..=ring {
            let sq_z = sq_offset(2, center[2] + z);
            for y in -ring..=ring {
                let sq_yz = sq_z + sq_offset(1, center[1] + y);
                if !is_near(sq_yz, best) {
                    continue;
                }
                let is_whole_row = z.abs() == ring || y.abs() == ring;
                for x in (-ring..=ring).step_by(if is_whole_row { 1 } else { 2 * ring.max(1) as usize }) {
                    let cell = [center[0] + x, center[1] + y, center[2] + z];
                    if is_near(sq_yz + sq_offset(0, cell[0]), best)
                        && let Some(index) = self.block_hash.number(&cell)
                    {
                        self.search_block(&self.blocks[index as usize], query, best);
                    }
                }
            }
        }
    }
}

impl Block {
    /// Sets a point from the block's lowest corner (m), at the place after the last one at most, and the number of its voxel.
    fn set(&mut self, place: u32, point: &Vector3<f64>, number: u32) {
        let (at, lane) = (place as usize / LANES, place as usize % LANES);
        if at == self.points.len() {
            self.points.push(Lanes { coordinates: [[f32::INFINITY; LANES]; 3], numbers: [u32::MAX; LANES] });
        }
        let lanes = &mut self.points[at];
        lanes.numbers[lane] = number;
        for (coordinates, &x) in lanes.coordinates.iter_mut().zip(point) {
            coordinates[lane] = x as f32;
        }
    }
}

impl Voxel {
    fn add(&mut self, point: &Vector3<f64>, normal: &Vector3<f64>) {
        self.count += 1.0;
        self.mean += (point - self.mean) / self.count;
        self.normal_sum += normal;
        self.normal = self.normal_sum.normalize();
    }
}

impl Target for CloudMap {
    type Point = Vector3<f64>;

    fn nearest(&self, query: &Vector3<f64>, max_distance: f64) -> Option<Neighbor> {
        let center = self.block_hash.voxel(query)?;
        let side = self.block_hash.voxel_size();
        let mut best = Neighbor::limit(max_distance as f32);
        for ring in 0.. {
            // The query is at least one block less away from these blocks.
            if side * f64::from(ring - 1) > f64::from(best.sq_distance).sqrt() {
                break;
            }
            if 24 * (ring * ring) as usize > self.blocks.len() {
                self.blocks.iter().for_each(|block| self.search_block(block, query, &mut best));
                break;
            }
            self.search_ring(ring, &center, query, &mut best);
        }
        (best.index != u32::MAX).then_some(best)
    }

    fn nearest_again(
        &self,
        query: &Vector3<f64>,
        max_distance: f64,
        last: &mut LastSearch<Vector3<f64>>,
    ) -> Option<Neighbor> {
        let nearest = |reach| self.nearest(query, reach);
        last.again(query, max_distance, CLEARANCE_FACTOR, nearest, |index| {
            let distance = (query - self.voxels[index as usize].mean).norm() * (1.0 + ROUNDING_SHARE);
            self.nearest(query, distance.min(max_distance))
        })
    }

    fn point(&self, index: u32) -> Vector3<f64> {
        self.voxels[index as usize].mean
    }

    fn normal(&self, index: u32) -> Option<Vector3<f64>> {
        Some(self.voxels[index as usize].normal)
    }
}

impl SurfaceTarget for CloudMap {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::scalar::wave;

    #[test]
    fn a_voxel_holds_the_mean_of_its_points_and_one_side_of_a_wall() {
        let mut map = CloudMap::new(0.5);
        let points = [Vector3::new(0.1, 0.1, 0.1), Vector3::new(0.3, 0.1, 0.1), Vector3::new(-0.1, 0.1, 0.1)];
        let mut insert = |sighting, num_points: usize, normals: &[Option<Vector3<f64>>], x| {
            let source = Source { points: &points[..num_points], normals: Some(normals), sigmas: None };
            map.insert(sighting, &source, &Pose3::translation(x, 0.0, 0.0));
            map.voxels.len()
        };
        insert((7, 1.0), 3, &[Some(Vector3::z()), Some(Vector3::z()), None], 0.0);
        assert_eq!(insert((8, 2.0), 1, &[Some(-Vector3::z())], 0.0), 1);
        assert_eq!(insert((9, 3.0), 1, &[Some(Vector3::x())], 5.0), 2);
        assert!((map.point(0) - Vector3::new(0.2, 0.1, 0.1)).norm() < 1e-12 && map.normal(0) == Some(Vector3::z()));
        let seen_by = |map: &CloudMap| [0.2, 5.2, -0.1].map(|x| map.first_seen_by(&Vector3::new(x, 0.1, 0.1)));
        assert_eq!(seen_by(&map), [Some(7), Some(9), None]);
        map.forget(2.0);
        assert_eq!(seen_by(&map), [Some(7), Some(9), None], "it was seen again");
        map.forget(2.5);
        assert_eq!(seen_by(&map), [None, Some(9), None]);
        assert_eq!(map.nearest(&Vector3::new(5.0, 0.0, 0.0), 1.0).map(|found| found.index), Some(0));
        assert_eq!(map.nearest(&Vector3::zeros(), f64::NAN), None);
        assert_eq!(CloudMap::new(0.5).nearest(&Vector3::zeros(), 1e9), None);
    }

    #[test]
    fn the_nearest_point_is_that_of_a_search_of_all() {
        for far in [0.0, 5e4] {
            let place = |i: usize, scale: f64| {
                Vector3::new(wave(i, 1.3) + far, wave(i, 2.1), 0.3 * wave(i, 3.7))
                    .component_mul(&Vector3::new(1.0, scale, scale))
            };
            let mut map = CloudMap::new(0.05);
            let points: Vec<Vector3<f64>> = (0..4000).map(|i| place(i, 3.0)).collect();
            // Twice, moved: means change.
            for shift in [0.0, 0.01] {
                let source =
                    Source { points: &points, normals: Some(&vec![Some(Vector3::z()); points.len()]), sigmas: None };
                map.insert((0, 0.0), &source, &Pose3::translation(shift, 0.0, 0.0));
            }
            for i in 0..500 {
                let (query, max_distance) = (place(i + 10_000, 4.0), [0.02, 0.15, 0.9, 100.0][i % 4]);
                let distance = |voxel: &Voxel| (voxel.mean - query).norm();
                let expected = map.voxels.iter().map(distance).fold(f64::INFINITY, f64::min);
                let found = map.nearest(&query, max_distance).map(|found| distance(&map.voxels[found.index as usize]));
                let mut last = LastSearch::None;
                map.nearest_again(&(query + Vector3::x() * 0.03), max_distance, &mut last);
                let again = map
                    .nearest_again(&query, max_distance, &mut last)
                    .map(|found| distance(&map.voxels[found.index as usize]));
                assert_eq!(found, again, "{query}, {max_distance}");
                assert_eq!(found.is_some(), expected <= max_distance, "{query}, {max_distance}: {expected}");
                assert!(found.is_none_or(|found| found - expected < 1e-6), "{query}, {max_distance}: {expected}");
            }
        }
    }
}
