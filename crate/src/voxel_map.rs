//! The stitched map in space: one point a voxel, the mean of what all frames saw there.

use glam::{DVec3, Vec3};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::geometry::{PointCloud, Pose3};

/// Points of many frames in the world frame, without doubles.
///
/// Memory grows with the surface seen, not with the number of frames.
#[derive(Debug, Clone)]
pub struct VoxelMap {
    voxel_size: f64,
    /// Number of each block of [`BLOCK`] voxels a side that holds a point: neighbours are found without hashing.
    index: FxHashMap<u64, u32>,
    /// For each block, the numbers of its voxels plus 1; 0 where there is none.
    blocks: Vec<[u32; BLOCK_VOXELS]>,
    voxels: Vec<Voxel>,
    has_colors: bool,
}

#[derive(Debug, Clone)]
struct Voxel {
    /// Sum of the positions relative to the voxel's corner (m).
    offset: Vec3,
    corner: [i32; 3],
    normal: Vec3,
    color: [u32; 3],
    count: u32,
    /// The first frame that saw it.
    frame: u32,
}

/// A point on its way into the map.
struct Placed {
    /// Its index in the cloud.
    point: usize,
    corner: [i32; 3],
    /// Its block, and its voxel's place in that.
    slot: (u32, u32),
    /// The number of its voxel.
    number: u32,
    /// Its position relative to the voxel's corner (m).
    offset: Vec3,
}

/// Points that are placed together: what is far away in memory is waited for once and not for each of them.
const BATCH: usize = 64;
/// Voxels along a side of a block.
const BLOCK: i32 = 8;
const BLOCK_VOXELS: usize = (BLOCK * BLOCK * BLOCK) as usize;
/// Bits of a key for each axis: voxels of a millimetre reach a kilometre.
const KEY_BITS: u32 = 21;

impl VoxelMap {
    /// A map without points; `voxel_size` (m) is positive.
    pub fn new(voxel_size: f64) -> Self {
        Self { voxel_size, index: FxHashMap::default(), blocks: Vec::new(), voxels: Vec::new(), has_colors: false }
    }

    /// Adds the points of a frame at its pose. Points higher than `max_height` (m) above the world's origin are left out;
    /// the world's y axis points down.
    pub fn insert(&mut self, cloud: &PointCloud, T_world_sensor: &Pose3, frame: usize, max_height: f64) {
        let (R, t) = single(T_world_sensor);
        let inverse = 1.0 / self.voxel_size;
        self.has_colors |= cloud.colors.is_some();
        let mut last_block = (u64::MAX, 0);
        let mut batch: Vec<Placed> = Vec::with_capacity(BATCH);
        for start in (0..cloud.positions.len()).step_by(BATCH) {
            batch.clear();
            for point in start..(start + BATCH).min(cloud.positions.len()) {
                let position = R * cloud.positions[point].as_dvec3() + t;
                if -position.y > max_height {
                    continue;
                }
                let scaled = position * inverse;
                let Some(corner) = corner_of(scaled) else { continue };
                let key = pack(corner.map(|cell| cell.div_euclid(BLOCK)));
                if key != last_block.0 {
                    last_block = (key, self.block(key));
                }
                let [x, y, z] = corner.map(|cell| cell.rem_euclid(BLOCK));
                let slot = (last_block.1, ((z * BLOCK + y) * BLOCK + x) as u32);
                let offset = ((scaled - DVec3::from(corner.map(f64::from))) * self.voxel_size).as_vec3();
                batch.push(Placed { point, corner, slot, number: 0, offset });
            }
            for placed in &mut batch {
                let slot = &mut self.blocks[placed.slot.0 as usize][placed.slot.1 as usize];
                if *slot == 0 {
                    self.voxels.push(Voxel::new(placed.corner, frame));
                    *slot = self.voxels.len() as u32;
                }
                placed.number = *slot - 1;
            }
            for &Placed { point, number, offset, .. } in &batch {
                let Some(voxel) = self.voxels.get_mut(number as usize) else { continue };
                voxel.offset += offset;
                voxel.count += 1;
                if let Some(normals) = &cloud.normals {
                    voxel.normal += (R * normals[point].as_dvec3()).as_vec3();
                }
                if let Some(colors) = &cloud.colors {
                    for (sum, &channel) in voxel.color.iter_mut().zip(&colors[point]) {
                        *sum += u32::from(channel);
                    }
                }
            }
        }
    }

    /// The number of the block of this key, which is made where there is none.
    fn block(&mut self, key: u64) -> u32 {
        let next = self.blocks.len() as u32;
        let number = *self.index.entry(key).or_insert(next);
        if number == next {
            self.blocks.push([0; BLOCK_VOXELS]);
        }
        number
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.voxels.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.voxels.is_empty()
    }

    /// The points, world frame, in the order in which they were first seen.
    pub fn cloud(&self) -> PointCloud {
        PointCloud {
            positions: self.positions().collect(),
            normals: Some(self.normals().collect()),
            colors: self.colors().map(Iterator::collect),
            origin: DVec3::ZERO,
        }
    }

    /// Where the points are (m), in the order of [`cloud`](Self::cloud).
    pub fn positions(&self) -> impl ExactSizeIterator<Item = Vec3> {
        self.voxels.iter().map(|voxel| {
            let corner = DVec3::from(voxel.corner.map(f64::from)) * self.voxel_size;
            (corner + voxel.offset.as_dvec3() / f64::from(voxel.count)).as_vec3()
        })
    }

    /// Where their surfaces face: unit vectors, zero where that is unknown.
    pub fn normals(&self) -> impl ExactSizeIterator<Item = Vec3> {
        self.voxels.iter().map(|voxel| voxel.normal.normalize_or_zero())
    }

    /// Their colours (red, green, blue), where any frame had some.
    pub fn colors(&self) -> Option<impl ExactSizeIterator<Item = [u8; 3]>> {
        let color = |voxel: &Voxel| voxel.color.map(|sum| ((sum + voxel.count / 2) / voxel.count) as u8);
        self.has_colors.then(|| self.voxels.iter().map(color))
    }

    /// The first frame that saw each point.
    pub fn frames(&self) -> Vec<u32> {
        self.voxels.iter().map(|voxel| voxel.frame).collect()
    }
}

/// How many voxels some points fill, without keeping the points: a bit a voxel.
#[derive(Debug, Clone)]
pub struct VoxelCount {
    voxel_size: f64,
    /// For each block of [`BLOCK`] voxels a side, layer by layer, a bit for each that is filled.
    blocks: FxHashMap<u64, [u64; BLOCK as usize]>,
}

impl VoxelCount {
    /// Of nothing; `voxel_size` (m) is positive.
    pub fn new(voxel_size: f64) -> Self {
        Self { voxel_size, blocks: FxHashMap::default() }
    }

    /// Adds the points that [`VoxelMap::insert`] would.
    pub fn insert(&mut self, cloud: &PointCloud, T_world_sensor: &Pose3, max_height: f64) {
        let (R, t) = single(T_world_sensor);
        let inverse = 1.0 / self.voxel_size;
        let mut layers = (u64::MAX, [0; BLOCK as usize]);
        for &position in &cloud.positions {
            let position = R * position.as_dvec3() + t;
            let Some(corner) = corner_of(position * inverse).filter(|_| -position.y <= max_height) else { continue };
            let key = pack(corner.map(|cell| cell.div_euclid(BLOCK)));
            if key != layers.0 {
                self.fill(layers);
                layers = (key, [0; BLOCK as usize]);
            }
            let [x, y, z] = corner.map(|cell| cell.rem_euclid(BLOCK));
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

    /// How many there would be with a side that is a whole multiple of this one's.
    pub fn len_of_multiple(&self, multiple: i32) -> usize {
        let mut coarser = FxHashSet::default();
        for (&key, layers) in &self.blocks {
            let first = unpack(key).map(|block| block * BLOCK);
            for (z, &layer) in (0..).zip(layers) {
                let mut rest = layer;
                while rest != 0 {
                    let bit = rest.trailing_zeros().cast_signed();
                    rest &= rest - 1;
                    let corner = [first[0] + bit % BLOCK, first[1] + bit / BLOCK, first[2] + z];
                    coarser.insert(pack(corner.map(|cell| cell.div_euclid(multiple.max(1)))));
                }
            }
        }
        coarser.len()
    }
}

impl Voxel {
    fn new(corner: [i32; 3], frame: usize) -> Self {
        Self { offset: Vec3::ZERO, corner, normal: Vec3::ZERO, color: [0; 3], count: 0, frame: frame as u32 }
    }
}

/// The voxel of a position in units of its side; `None` where it is not finite or too far away.
fn corner_of(scaled: DVec3) -> Option<[i32; 3]> {
    let limit = f64::from(1 << (KEY_BITS - 1));
    // Not a number fails the comparison.
    let is_inside = scaled.abs().max_element() < limit - 1.0 && scaled.is_finite();
    is_inside.then(|| scaled.floor().to_array().map(|cell| cell as i32))
}

fn pack(corner: [i32; 3]) -> u64 {
    let [x, y, z] = corner.map(|cell| u64::from((cell + (1 << (KEY_BITS - 1))) as u32));
    x | y << KEY_BITS | z << (2 * KEY_BITS)
}

fn unpack(key: u64) -> [i32; 3] {
    let mask = (1 << KEY_BITS) - 1;
    [key, key >> KEY_BITS, key >> (2 * KEY_BITS)].map(|part| (part & mask) as i32 - (1 << (KEY_BITS - 1)))
}

fn single(T: &Pose3) -> (glam::DMat3, DVec3) {
    let R = T.rotation.to_rotation_matrix();
    let t = T.translation.vector;
    (glam::DMat3::from_cols_slice(R.matrix().as_slice()), DVec3::new(t.x, t.y, t.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::RigidMotion;

    fn cloud(positions: &[[f32; 3]]) -> PointCloud {
        PointCloud {
            positions: positions.iter().map(|&p| Vec3::from(p)).collect(),
            normals: Some(vec![Vec3::Z; positions.len()]),
            colors: Some((0..positions.len()).map(|i| [i as u8 * 10, 0, 255]).collect()),
            ..PointCloud::default()
        }
    }

    #[test]
    fn a_voxel_holds_the_mean_of_what_was_seen_in_it() {
        let mut map = VoxelMap::new(0.1);
        map.insert(&cloud(&[[0.02, 0.0, 1.0], [0.04, 0.0, 1.02], [-0.01, 0.0, 1.0]]), &Pose3::identity(), 3, 100.0);
        map.insert(&cloud(&[[0.06, 0.0, 1.01], [5.0, 0.0, 0.0]]), &Pose3::identity(), 7, 100.0);
        assert_eq!((map.len(), map.frames()), (3, vec![3, 3, 7]));
        let points = map.cloud();
        assert!((points.positions[0] - Vec3::new(0.04, 0.0, 1.01)).length() < 1e-6, "{}", points.positions[0]);
        assert!((points.positions[1] - Vec3::new(-0.01, 0.0, 1.0)).length() < 1e-6);
        assert_eq!(points.colors.unwrap()[0], [3, 0, 255]); // (0 + 10 + 0) / 3
        assert_eq!(points.normals.unwrap()[0], Vec3::Z);
    }

    #[test]
    fn poses_move_points_and_heights_and_strays_are_cut() {
        let T = <Pose3 as RigidMotion<3, 6>>::exp(&nalgebra::Vector6::new(
            0.0,
            0.0,
            std::f64::consts::FRAC_PI_2,
            1.0,
            2.0,
            0.0,
        ));
        let expected = T * nalgebra::Point3::new(0.5, 0.25, 2.0);
        let mut map = VoxelMap::new(0.05);
        map.insert(&cloud(&[[0.5, 0.25, 2.0]]), &T, 0, 100.0);
        let found = map.cloud().positions[0];
        assert!((f64::from(found.x) - expected.x).hypot(f64::from(found.y) - expected.y) < 1e-6);

        let mut map = VoxelMap::new(0.05);
        let strays = [[0.0, -1.5, 0.0], [f32::NAN, 0.0, 0.0], [1e30, 0.0, 0.0], [0.0, 1.5, 0.0]];
        map.insert(&cloud(&strays), &Pose3::identity(), 0, 1.0);
        assert_eq!(map.len(), 1);
    }

    #[test]
    fn coarser_maps_are_counted_as_if_they_had_been_filled() {
        let mut random = 1u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / 1e7 - 0.8
        };
        let points: Vec<[f32; 3]> = (0..3000).map(|_| [next(), next(), next()]).collect();
        let cloud = PointCloud::from_positions(points.iter().map(|&p| Vec3::from(p)).collect());
        let filled = |voxel_size| {
            let mut map = VoxelMap::new(voxel_size);
            map.insert(&cloud, &Pose3::identity(), 0, 0.5);
            map.len()
        };
        let mut fine = VoxelCount::new(0.0625);
        assert!(fine.is_empty());
        fine.insert(&cloud, &Pose3::identity(), 0.5);
        assert_eq!(fine.len(), filled(0.0625));
        for multiple in [1, 2, 5] {
            assert_eq!(fine.len_of_multiple(multiple), filled(0.0625 * f64::from(multiple)));
        }
    }
}
