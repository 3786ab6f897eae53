//! Number of voxels that a map would have.

use rustc_hash::FxHashMap;

use super::grid::{Grid, pack, unpack};
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
    pub fn insert(&mut self, cloud: &PointCloud, T_world_sensor: &Pose3, max_height: f64) {
        let grid = Grid::new(self.voxel_size, T_world_sensor, max_height);
        let mut filling = Filling::of(self);
        cloud.positions.iter().filter_map(|&position| grid.corner(position)).for_each(|corner| filling.add(corner));
        filling.flush();
    }

    /// The same for the points of an image, with `shift` (m) added to their depths.
    pub(crate) fn insert_image(&mut self, image: &MapImage, shift: f64, T_world_sensor: &Pose3, max_height: f64) {
        let grid = Grid::new(self.voxel_size, T_world_sensor, max_height);
        let mut filling = Filling::of(self);
        image.for_each_point(shift, |position, _, _| {
            if let Some(corner) = grid.corner(position) {
                filling.add(corner);
            }
        });
        filling.flush();
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.blocks.values().map(|filled| filled.count_ones() as usize).sum()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// The same count of voxels with a side of `multiple` times this one's.
    #[must_use]
    pub fn coarser(&self, multiple: i32) -> Self {
        let multiple = multiple.max(1);
        let mut coarser = Self::new(f64::from(multiple) * self.voxel_size);
        let mut filling = Filling::of(&mut coarser);
        for (&key, &filled) in &self.blocks {
            // Along each axis, the coarser voxels of this block's.
            let cells = unpack(key).map(|block| [0, 1, 2, 3].map(|at| (block * BLOCK + at).div_euclid(multiple)));
            let mut rest = filled;
            while rest != 0 {
                let (bit, side) = (rest.trailing_zeros() as usize, BLOCK as usize);
                rest &= rest - 1;
                filling.add([cells[0][bit % side], cells[1][bit / side % side], cells[2][bit / (side * side)]]);
            }
        }
        filling.flush();
        coarser
    }
}

/// Voxels that are added to a count: those that follow each other mostly lie in one block.
struct Filling<'a> {
    count: &'a mut VoxelCount,
    /// Key of the last block, and its bits that are not in the count yet.
    last: (u64, u64),
}

impl<'a> Filling<'a> {
    fn of(count: &'a mut VoxelCount) -> Self {
        Self { count, last: (0, 0) }
    }

    #[inline]
    fn add(&mut self, corner: [i32; 3]) {
        let key = pack(corner.map(|cell| cell.div_euclid(BLOCK)));
        if key != self.last.0 {
            self.flush();
            self.last = (key, 0);
        }
        let [x, y, z] = corner.map(|cell| cell.rem_euclid(BLOCK));
        self.last.1 |= 1 << ((z * BLOCK + y) * BLOCK + x);
    }

    fn flush(&mut self) {
        let (key, filled) = self.last;
        if filled != 0 {
            *self.count.blocks.entry(key).or_default() |= filled;
        }
    }
}
