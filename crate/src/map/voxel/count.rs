//! Number of voxels that a map would have.

use glam::Vec3;
use rustc_hash::FxHashMap;

use super::grid::{Grid, pack, unpack};
use super::{NUM_RECENT_BLOCKS, recent_slot};
use crate::geometry::{PointCloud, Pose3};
use crate::preprocess::map_image::MapImage;

/// Voxels along a side of a block: it has as many as a number has bits, so that the sparse points of a lidar take little more than their
/// keys.
const BLOCK: i32 = 4;

/// Counts the voxels that points fill, with one bit per voxel.
#[derive(Debug, Clone)]
pub struct VoxelCount {
    voxel_size: f64,
    /// For each block of [`BLOCK`]^3 voxels the bits of the filled ones.
    blocks: FxHashMap<u64, u64>,
}

impl VoxelCount {
    /// Without points; `voxel_size` (m) must be positive.
    pub fn new(voxel_size: f64) -> Self {
        Self { voxel_size, blocks: FxHashMap::default() }
    }

    /// Adds the points that [`VoxelMap::insert`](super::VoxelMap::insert) would.
    #[inline(never)]
    pub fn insert(&mut self, cloud: &PointCloud, T_world_sensor: &Pose3, max_height: f64) {
        let grid = Grid::new(self.voxel_size, T_world_sensor, max_height);
        let mut filling = Filling::new(self);
        cloud.positions.iter().for_each(|&position| filling.add_position(&grid, position));
        filling.finish();
    }

    /// The same for the points of an image, with `shift` (m) added to their depths.
    #[inline(never)]
    pub(crate) fn insert_image(&mut self, image: &MapImage, shift: f64, T_world_sensor: &Pose3, max_height: f64) {
        let grid = Grid::new(self.voxel_size, T_world_sensor, max_height);
        let mut filling = Filling::new(self);
        image.for_each_point(shift, |position, _, _| filling.add_position(&grid, position));
        filling.finish();
    }

    fn fill(&mut self, (key, filled): (u64, u64)) {
        if key != u64::MAX {
            *self.blocks.entry(key).or_default() |= filled;
        }
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.blocks.values().map(|filled| filled.count_ones() as usize).sum()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// The same points counted in voxels of another size (m), where that is a multiple of this one's.
    pub fn in_voxels_of(&self, voxel_size: f64) -> Option<Self> {
        let multiple = (voxel_size / self.voxel_size).round().max(1.0);
        if (multiple * self.voxel_size - voxel_size).abs() > 1e-9 * voxel_size {
            return None;
        }
        let mut coarser = Self::new(voxel_size);
        let mut filling = Filling::new(&mut coarser);
        for (&key, &filled) in &self.blocks {
            filling.add_block(key, filled, multiple as i32);
        }
        filling.finish();
        Some(coarser)
    }
}

/// Fills voxels. Neighbours mostly lie in blocks that were looked up shortly before: their bits are collected.
struct Filling<'a> {
    count: &'a mut VoxelCount,
    /// Keys of recent blocks, [`u64::MAX`] for none, and the bits that are still to be filled.
    recent: [(u64, u64); NUM_RECENT_BLOCKS],
}

impl<'a> Filling<'a> {
    fn new(count: &'a mut VoxelCount) -> Self {
        Self { count, recent: [(u64::MAX, 0); NUM_RECENT_BLOCKS] }
    }

    /// A position in the sensor's frame (m).
    #[inline]
    fn add_position(&mut self, grid: &Grid, position: Vec3) {
        if let Some(corner) = grid.corner(position) {
            self.add(corner);
        }
    }

    #[inline]
    fn add(&mut self, corner: [i32; 3]) {
        let key = pack(corner.map(|cell| cell.div_euclid(BLOCK)));
        let block = &mut self.recent[recent_slot(key)];
        if block.0 != key {
            let before = std::mem::replace(block, (key, 0));
            self.count.fill(before);
        }
        let [x, y, z] = corner.map(|cell| cell.rem_euclid(BLOCK));
        block.1 |= 1 << ((z * BLOCK + y) * BLOCK + x);
    }

    /// The voxels of a block of a finer count, of whose sides `multiple` are one here.
    #[inline(never)]
    fn add_block(&mut self, key: u64, mut filled: u64, multiple: i32) {
        let first = unpack(key).map(|block| block * BLOCK);
        while filled != 0 {
            let bit = filled.trailing_zeros().cast_signed();
            filled &= filled - 1;
            let corner = [first[0] + bit % BLOCK, first[1] + bit / BLOCK % BLOCK, first[2] + bit / (BLOCK * BLOCK)];
            self.add(corner.map(|cell| cell.div_euclid(multiple)));
        }
    }

    fn finish(self) {
        self.recent.into_iter().for_each(|block| self.count.fill(block));
    }
}
