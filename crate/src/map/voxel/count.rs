//! Number of voxels that a map would have.

use rustc_hash::FxHashMap;

use super::grid::{BLOCK, Grid, block_key, pack, unpack};
use crate::geometry::{PointCloud, Pose3};

/// Counts the voxels that points fill, with one bit per voxel.
#[derive(Debug, Clone)]
pub struct VoxelCount {
    voxel_size: f64,
    /// For each block of [`BLOCK`]^3 voxels, layer by layer, the bits of the filled voxels.
    blocks: FxHashMap<u64, [u64; BLOCK as usize]>,
}

impl VoxelCount {
    /// Without points; `voxel_size` (m) must be positive.
    pub fn new(voxel_size: f64) -> Self {
        Self { voxel_size, blocks: FxHashMap::default() }
    }

    /// Adds the points that [`VoxelMap::insert`](super::VoxelMap::insert) would.
    pub fn insert(&mut self, cloud: &PointCloud, T_world_sensor: &Pose3, max_height: f64) {
        let grid = Grid::new(self.voxel_size, T_world_sensor, max_height);
        let mut layers = (u64::MAX, [0; BLOCK as usize]);
        for &position in &cloud.positions {
            let Some(corner) = grid.corner(position) else { continue };
            let key = block_key(corner);
            if key != layers.0 {
                self.fill(layers);
                layers = (key, [0; BLOCK as usize]);
            }
            let [x, y, z] = corner.map(|cell| cell & (BLOCK - 1));
            layers.1[z as usize] |= 1 << (y * BLOCK + x);
        }
        self.fill(layers);
    }

    fn fill(&mut self, (key, layers): (u64, [u64; BLOCK as usize])) {
        if key != u64::MAX {
            let filled = self.blocks.entry(key).or_default();
            filled.iter_mut().zip(layers).for_each(|(filled, layer)| *filled |= layer);
        }
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.blocks.values().flatten().map(|layer| layer.count_ones() as usize).sum()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// Number of voxels with a side of `multiple` times this one's.
    pub fn len_of_multiple(&self, multiple: i32) -> usize {
        let (multiple, mut coarser) = (multiple.max(1), Vec::new());
        for (&key, layers) in &self.blocks {
            let first = unpack(key).map(|block| block * BLOCK);
            for (z, &layer) in (0..).zip(layers) {
                let mut rest = layer;
                while rest != 0 {
                    let bit = rest.trailing_zeros().cast_signed();
                    rest &= rest - 1;
                    let corner = [first[0] + bit % BLOCK, first[1] + bit / BLOCK, first[2] + z];
                    let key = pack(corner.map(|cell| cell.div_euclid(multiple)));
                    // Neighbours mostly lie in the same coarse voxel.
                    if coarser.last() != Some(&key) {
                        coarser.push(key);
                    }
                }
            }
        }
        coarser.sort_unstable();
        coarser.dedup();
        coarser.len()
    }
}
