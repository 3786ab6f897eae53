//! Number of voxels that a map would have.

use rustc_hash::FxHashMap;

use super::grid::{Grid, pack, unpack};
use crate::geometry::{PointCloud, Pose3};

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
    pub fn insert(&mut self, cloud: &PointCloud, T_world_sensor: &Pose3, max_height: f64) {
        let grid = Grid::new(self.voxel_size, T_world_sensor, max_height);
        let mut last = (u64::MAX, 0);
        for &position in &cloud.positions {
            let Some(corner) = grid.corner(position) else { continue };
            let key = pack(corner.map(|cell| cell.div_euclid(BLOCK)));
            if key != last.0 {
                self.fill(last);
                last = (key, 0);
            }
            let [x, y, z] = corner.map(|cell| cell.rem_euclid(BLOCK));
            last.1 |= 1 << ((z * BLOCK + y) * BLOCK + x);
        }
        self.fill(last);
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

    /// Number of voxels with a side of `multiple` times this one's.
    pub fn len_of_multiple(&self, multiple: i32) -> usize {
        let (multiple, mut coarser) = (multiple.max(1), Vec::new());
        for (&key, &filled) in &self.blocks {
            let first = unpack(key).map(|block| block * BLOCK);
            let mut rest = filled;
            while rest != 0 {
                let bit = rest.trailing_zeros().cast_signed();
                rest &= rest - 1;
                let corner = [first[0] + bit % BLOCK, first[1] + bit / BLOCK % BLOCK, first[2] + bit / (BLOCK * BLOCK)];
                let key = pack(corner.map(|cell| cell.div_euclid(multiple)));
                // Neighbours mostly lie in the same coarse voxel.
                if coarser.last() != Some(&key) {
                    coarser.push(key);
                }
            }
        }
        coarser.sort_unstable();
        coarser.dedup();
        coarser.len()
    }
}
