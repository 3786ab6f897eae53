//! The stitched map in space: one point a voxel, the mean of what all frames saw there.

use glam::{DVec3, Mat3A, Vec3, Vec3A};
use rustc_hash::FxHashMap;

use crate::geometry::{PointCloud, Pose3};
use crate::preprocess::map_image::MapImage;

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
    /// Sum of the positions relative to the voxel's corner, in sides of it.
    offset: Vec3,
    corner: [i32; 3],
    normal: Vec3,
    color: [u32; 3],
    count: u32,
    /// The first frame that saw it.
    frame: u32,
}

/// Neighbouring points of one voxel on their way into the map.
struct Placed {
    corner: [i32; 3],
    /// Its block, and its voxel's place in that.
    slot: (u32, u32),
    /// The number of its voxel.
    number: u32,
    /// Sums of their positions relative to the voxel's corner, in sides of it, of their normals and colours.
    offset: Vec3A,
    normal: Vec3A,
    color: [u32; 3],
    count: u32,
}

/// Points that are placed together: what is far away in memory is waited for once and not for each of them.
const BATCH: usize = 64;
/// Voxels along a side of a block, and that as a power of two.
const BLOCK: i32 = 1 << BLOCK_BITS;
const BLOCK_BITS: i32 = 3;
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
        self.has_colors |= cloud.colors.is_some();
        let R = rotation(T_world_sensor);
        let mut stitching = Stitching::new(self, T_world_sensor, frame, max_height);
        for (index, &position) in cloud.positions.iter().enumerate() {
            let normal = cloud.normals.as_ref().map_or(Vec3A::ZERO, |normals| R * Vec3A::from(normals[index]));
            let color = cloud.colors.as_ref().map_or([0; 3], |colors| colors[index]);
            stitching.add(position, normal, color);
        }
        stitching.flush();
    }

    /// The same for the points of an image, with `shift` (m) added to their depths.
    pub fn insert_image(
        &mut self,
        image: &MapImage,
        shift: f64,
        T_world_sensor: &Pose3,
        frame: usize,
        max_height: f64,
    ) {
        self.has_colors |= image.colors.is_some();
        let R = rotation(T_world_sensor);
        let mut stitching = Stitching::new(self, T_world_sensor, frame, max_height);
        // Neighbours are mostly of one surface.
        let mut last = ([0; 3], Vec3A::ZERO);
        image.for_each_point(shift, |position, normal, color| {
            if normal != last.0 {
                last = (normal, (R * Vec3A::from(normal.map(f32::from))).normalize_or_zero());
            }
            stitching.add(position, last.1, color);
        });
        stitching.flush();
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
            let offset = voxel.offset * (1.0 / voxel.count as f32);
            ((DVec3::from(voxel.corner.map(f64::from)) + offset.as_dvec3()) * self.voxel_size).as_vec3()
        })
    }

    /// Where their surfaces face: unit vectors, zero where that is unknown.
    pub fn normals(&self) -> impl ExactSizeIterator<Item = Vec3> {
        self.voxels.iter().map(|voxel| voxel.normal.normalize_or_zero())
    }

    /// Their colours (red, green, blue), where any frame had some.
    pub fn colors(&self) -> Option<impl ExactSizeIterator<Item = [u8; 3]>> {
        let color = |voxel: &Voxel| {
            let share = 1.0 / voxel.count as f32;
            voxel.color.map(|sum| (sum as f32 * share + 0.5) as u8)
        };
        self.has_colors.then(|| self.voxels.iter().map(color))
    }

    /// The first frame that saw each point.
    pub fn frames(&self) -> Vec<u32> {
        self.voxels.iter().map(|voxel| voxel.frame).collect()
    }
}

/// Points of one frame on their way into a map, a few at a time.
struct Stitching<'a> {
    map: &'a mut VoxelMap,
    grid: Grid,
    frame: usize,
    /// Key and number.
    last_block: (u64, u32),
    batch: Vec<Placed>,
}

impl<'a> Stitching<'a> {
    fn new(map: &'a mut VoxelMap, T_world_sensor: &Pose3, frame: usize, max_height: f64) -> Self {
        let grid = Grid::new(map.voxel_size, T_world_sensor, max_height);
        Self { map, grid, frame, last_block: (u64::MAX, 0), batch: Vec::with_capacity(BATCH) }
    }

    /// A position in the sensor's frame (m), with its normal in the world's.
    #[inline]
    fn add(&mut self, position: Vec3, normal: Vec3A, color: [u8; 3]) {
        let Some((corner, offset)) = self.grid.voxel_of(position) else { return };
        let color = color.map(u32::from);
        if let Some(last) = self.batch.last_mut().filter(|last| last.corner == corner) {
            last.offset += offset;
            last.normal += normal;
            last.color.iter_mut().zip(color).for_each(|(sum, channel)| *sum += channel);
            last.count += 1;
            return;
        }
        if self.batch.len() == BATCH {
            self.flush();
        }
        let key = block_key(corner);
        if key != self.last_block.0 {
            self.last_block = (key, self.map.block(key));
        }
        let [x, y, z] = corner.map(|cell| cell & (BLOCK - 1));
        let slot = (self.last_block.1, ((z * BLOCK + y) * BLOCK + x) as u32);
        self.batch.push(Placed { corner, slot, number: 0, offset, normal, color, count: 1 });
    }

    fn flush(&mut self) {
        let VoxelMap { blocks, voxels, .. } = &mut *self.map;
        for placed in &mut self.batch {
            let slot = &mut blocks[placed.slot.0 as usize][placed.slot.1 as usize];
            if *slot == 0 {
                voxels.push(Voxel::new(placed.corner, self.frame));
                *slot = voxels.len() as u32;
            }
            placed.number = *slot - 1;
        }
        for &Placed { number, offset, normal, color, count, .. } in &self.batch {
            let Some(voxel) = voxels.get_mut(number as usize) else { continue };
            voxel.offset += Vec3::from(offset);
            voxel.normal += Vec3::from(normal);
            voxel.count += count;
            for (sum, channel) in voxel.color.iter_mut().zip(color) {
                *sum += channel;
            }
        }
        self.batch.clear();
    }
}

/// From a sensor's frame to voxels of the world, in single precision: it tells micrometres apart in a house and millimetres
/// in a town.
struct Grid {
    /// To the world's frame in sides of a voxel.
    R: Mat3A,
    t: Vec3A,
    /// Below this y, which points down, it is too high.
    least_y: f32,
}

impl Grid {
    fn new(voxel_size: f64, T_world_sensor: &Pose3, max_height: f64) -> Self {
        let (inverse, t) = (1.0 / voxel_size, T_world_sensor.translation.vector);
        Self {
            R: rotation(T_world_sensor) * inverse as f32,
            t: (DVec3::new(t.x, t.y, t.z) * inverse).as_vec3a(),
            least_y: (-max_height * inverse) as f32,
        }
    }

    /// The voxel of a position (m, sensor's frame), and where in it that lies (in sides of it); `None` where it is too high,
    /// not finite or too far away.
    #[inline]
    fn voxel_of(&self, position: Vec3) -> Option<([i32; 3], Vec3A)> {
        const LIMIT: f32 = ((1 << (KEY_BITS - 1)) - 1) as f32;
        let scaled = self.R * Vec3A::from(position) + self.t;
        // Not a number fails the comparison.
        let is_inside = (scaled.cmpge(Vec3A::splat(-LIMIT)) & scaled.cmple(Vec3A::splat(LIMIT))).all();
        if !is_inside || scaled.y < self.least_y {
            return None;
        }
        let floor = scaled.floor();
        Some((floor.to_array().map(|cell| cell as i32), scaled - floor))
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
        let grid = Grid::new(self.voxel_size, T_world_sensor, max_height);
        let mut layers = (u64::MAX, [0; BLOCK as usize]);
        for &position in &cloud.positions {
            let Some((corner, _)) = grid.voxel_of(position) else { continue };
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

    /// How many there would be with a side that is a whole multiple of this one's.
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
                    // Neighbours are mostly of one coarser voxel.
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

impl Voxel {
    fn new(corner: [i32; 3], frame: usize) -> Self {
        Self { offset: Vec3::ZERO, corner, normal: Vec3::ZERO, color: [0; 3], count: 0, frame: frame as u32 }
    }
}

/// The key of the block that a voxel lies in.
#[inline]
fn block_key(corner: [i32; 3]) -> u64 {
    pack(corner.map(|cell| cell >> BLOCK_BITS))
}

#[inline]
fn pack(corner: [i32; 3]) -> u64 {
    let [x, y, z] = corner.map(|cell| u64::from((cell + (1 << (KEY_BITS - 1))) as u32));
    x | y << KEY_BITS | z << (2 * KEY_BITS)
}

fn unpack(key: u64) -> [i32; 3] {
    let mask = (1 << KEY_BITS) - 1;
    [key, key >> KEY_BITS, key >> (2 * KEY_BITS)].map(|part| (part & mask) as i32 - (1 << (KEY_BITS - 1)))
}

fn rotation(T: &Pose3) -> Mat3A {
    let R = T.rotation.to_rotation_matrix();
    Mat3A::from_cols_array(&R.into_inner().as_slice().try_into().map_or([0.0; 9], |R: [f64; 9]| R.map(|x| x as f32)))
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
