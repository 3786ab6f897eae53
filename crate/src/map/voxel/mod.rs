//! The stitched map in space: one point per voxel, the mean of the points of all frames in it.

mod batch;
mod cell;
mod count;
mod grid;

use std::hint::black_box;
use std::ops::Range;

use glam::{Mat3A, Vec3};
use rustc_hash::FxHashMap;

use self::batch::{BATCH, Batch};
use self::cell::{NORMAL_SCALE, Voxel};
pub use self::count::VoxelCount;
use self::grid::{BLOCK_VOXELS, Grid, THIRD_BITS, block_key, rotation, slot};
use crate::geometry::{PointCloud, Pose3};
use crate::preprocess::map_image::MapImage;

/// Points of many frames in the world frame, averaged per voxel.
///
/// Memory grows with the area of the surfaces, not with the number of frames.
#[derive(Debug, Clone)]
pub struct VoxelMap {
    voxel_size: f64,
    /// For each block of voxels that holds a point, the index of its first slot. Within a block voxels need no hashing.
    blocks: FxHashMap<u64, u32>,
    /// For each voxel of each block its index plus 1; 0 where it is empty.
    slots: Vec<u32>,
    voxels: Vec<Voxel>,
    /// Corner and first frame of each voxel.
    origins: Vec<Origin>,
    has_colors: bool,
}

/// The data of a voxel that do not change.
#[derive(Debug, Clone, Copy)]
struct Origin {
    corner: [i32; 3],
    /// Index of the first frame with a point in it.
    frame: u32,
}

/// A point of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapPoint {
    /// World frame (m).
    pub position: Vec3,
    /// Unit normal (world frame); zero where it is unknown.
    pub normal: Vec3,
    /// Red, green, blue; black where no frame had colours.
    pub color: [u8; 3],
    /// Index of the first frame with a point in the voxel.
    pub frame: u32,
}

/// Entries of the cache of recently found blocks.
const NUM_RECENT_BLOCKS: usize = 256;
/// Length of the normals of an image, whose coordinates are signed bytes.
const IMAGE_UNIT: f32 = 127.0;

impl VoxelMap {
    /// A map without points; `voxel_size` (m) is positive.
    pub fn new(voxel_size: f64) -> Self {
        Self {
            voxel_size,
            blocks: FxHashMap::default(),
            slots: Vec::new(),
            voxels: Vec::new(),
            origins: Vec::new(),
            has_colors: false,
        }
    }

    /// Adds the points of a frame at its pose. Points higher than `max_height` (m) above the world's origin are left out;
    /// the world's y axis points down.
    pub fn insert(&mut self, cloud: &PointCloud, T_world_sensor: &Pose3, frame: usize, max_height: f64) {
        let has_colors = cloud.colors.is_some();
        let mut stitching = Stitching::new(self, T_world_sensor, 1.0, has_colors, frame, max_height);
        for (index, &position) in cloud.positions.iter().enumerate() {
            let normal = cloud.normals.as_ref().map_or(Vec3::ZERO, |normals| normals[index].normalize_or_zero());
            let color = cloud.colors.as_ref().map_or([0; 3], |colors| colors[index]);
            stitching.add(position, normal.to_array(), color);
        }
        stitching.flush();
    }

    /// The same for the points of an image, with `shift` (m) added to their depths.
    pub(crate) fn insert_image(
        &mut self,
        image: &MapImage,
        shift: f64,
        T_world_sensor: &Pose3,
        frame: usize,
        max_height: f64,
    ) {
        let has_colors = image.colors.is_some();
        let mut stitching = Stitching::new(self, T_world_sensor, IMAGE_UNIT, has_colors, frame, max_height);
        image.for_each_point(shift, |position, normal, color| {
            stitching.add(position, normal.map(f32::from), color);
        });
        stitching.flush();
    }

    /// Index of the first slot of the block of this key, which is created where it is missing.
    fn block(&mut self, key: u64) -> u32 {
        let next = self.slots.len() as u32;
        let first = *self.blocks.entry(key).or_insert(next);
        if first == next {
            self.slots.resize(self.slots.len() + BLOCK_VOXELS, 0);
        }
        first
    }

    /// Index plus 1 of the voxel of a slot, which is created where it is missing.
    fn voxel(&mut self, slot: u32, corner: [i32; 3], frame: u32) -> u32 {
        let number = &mut self.slots[slot as usize];
        if *number == 0 {
            self.voxels.push(Voxel::default());
            self.origins.push(Origin { corner, frame });
            *number = self.voxels.len() as u32;
        }
        *number
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.voxels.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.voxels.is_empty()
    }

    /// The points (world frame), in the order of their creation.
    pub fn cloud(&self) -> PointCloud {
        PointCloud {
            positions: self.positions().collect(),
            normals: Some(self.normals().collect()),
            colors: self.colors().map(Iterator::collect),
            ..PointCloud::default()
        }
    }

    /// Positions of the points (m), in the order of [`cloud`](Self::cloud).
    pub fn positions(&self) -> impl ExactSizeIterator<Item = Vec3> {
        self.voxels.iter().zip(&self.origins).map(|(voxel, origin)| voxel.position(origin.corner, self.voxel_size))
    }

    /// Their unit normals; zero where unknown.
    pub fn normals(&self) -> impl ExactSizeIterator<Item = Vec3> {
        self.voxels.iter().map(Voxel::normal)
    }

    /// Their colours (red, green, blue), where any frame had some.
    pub fn colors(&self) -> Option<impl ExactSizeIterator<Item = [u8; 3]>> {
        self.has_colors.then(|| self.voxels.iter().map(Voxel::color))
    }

    /// Whether any frame had colours.
    pub fn has_colors(&self) -> bool {
        self.has_colors
    }

    /// A range of the points, by their indices in [`cloud`](Self::cloud).
    pub fn points(&self, places: Range<usize>) -> impl ExactSizeIterator<Item = MapPoint> {
        self.voxels[places.clone()].iter().zip(&self.origins[places]).map(|(voxel, origin)| MapPoint {
            position: voxel.position(origin.corner, self.voxel_size),
            normal: voxel.normal(),
            color: voxel.color(),
            frame: origin.frame,
        })
    }

    /// Index of the first frame of each point.
    pub fn frames(&self) -> Vec<u32> {
        self.origins.iter().map(|origin| origin.frame).collect()
    }
}

/// Adds the points of one frame to a map.
struct Stitching<'a> {
    map: &'a mut VoxelMap,
    grid: Grid,
    R_world_normal: Mat3A,
    frame: u32,
    /// Keys of recently found blocks, and the indices of their first slots.
    recent: [(u64, u32); NUM_RECENT_BLOCKS],
    batch: Batch,
}

impl<'a> Stitching<'a> {
    /// `unit` is the length of a normal; `has_colors` says whether the frame has colours.
    fn new(
        map: &'a mut VoxelMap,
        T_world_sensor: &Pose3,
        unit: f32,
        has_colors: bool,
        frame: usize,
        max_height: f64,
    ) -> Self {
        map.has_colors |= has_colors;
        let grid = Grid::new(map.voxel_size, T_world_sensor, max_height);
        let R_world_normal = rotation(T_world_sensor) * (NORMAL_SCALE / unit);
        let recent = [(u64::MAX, 0); NUM_RECENT_BLOCKS];
        Self { map, grid, R_world_normal, frame: frame as u32, recent, batch: Batch::new(has_colors) }
    }

    /// A position and a normal in the sensor's frame (m).
    #[inline]
    fn add(&mut self, position: Vec3, normal: [f32; 3], color: [u8; 3]) {
        self.batch.push(position, normal, color);
        if self.batch.is_full() {
            self.flush();
        }
    }

    fn flush(&mut self) {
        let Self { map, batch, recent, .. } = self;
        batch.place(&self.grid, &self.R_world_normal);
        let (mut points, mut slots, mut count) = ([0; BATCH], [0; BATCH], 0);
        for at in batch.inside() {
            let corner = batch.corner(at);
            let key = block_key(corner);
            let block = &mut recent[recent_slot(key)];
            if block.0 != key {
                *block = (key, map.block(key));
            }
            (points[count], slots[count]) = (at, block.1 + slot(corner));
            count += 1;
        }
        let (points, slots) = (&points[..count], &slots[..count]);

        let mut numbers = [0; BATCH];
        for (number, &slot) in numbers.iter_mut().zip(slots) {
            *number = map.slots[slot as usize];
        }
        for ((number, &slot), &at) in numbers.iter_mut().zip(slots).zip(points) {
            if *number == 0 {
                *number = map.voxel(slot, batch.corner(at), self.frame);
            }
        }
        // All voxels are read before any is changed, so that their cache misses overlap.
        let counts = numbers[..count].iter().map(|&number| map.voxels[number as usize - 1].count);
        black_box(counts.fold(0, u32::max));
        for (&number, &at) in numbers.iter().zip(points) {
            let point = batch.point(at);
            map.voxels[number as usize - 1].add(point.offset, point.normal, point.color);
        }
        batch.clear();
    }
}

/// Entry of a block in the cache; neighbouring blocks have different entries.
#[inline]
fn recent_slot(key: u64) -> usize {
    let [x, y, z] = [key, key >> THIRD_BITS, key >> (2 * THIRD_BITS)];
    x.wrapping_add(7 * y).wrapping_add(31 * z) as usize % NUM_RECENT_BLOCKS
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::RigidMotion;

    fn cloud(positions: &[[f32; 3]]) -> PointCloud {
        PointCloud {
            positions: positions.iter().map(|&p| Vec3::from(p)).collect(),
            normals: Some(vec![Vec3::Z; positions.len()]),
            colors: Some((0..positions.len()).map(|i| [(i as u8).wrapping_mul(10), 0, 255]).collect()),
            ..PointCloud::default()
        }
    }

    #[test]
    fn a_voxel_holds_the_mean_of_its_points() {
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
    fn points_are_transformed_and_high_and_non_finite_ones_are_left_out() {
        let T =
            <Pose3 as RigidMotion>::exp(&nalgebra::Vector6::new(0.0, 0.0, std::f64::consts::FRAC_PI_2, 1.0, 2.0, 0.0));
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
    fn the_count_of_a_coarser_map_equals_that_of_a_filled_one() {
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
            assert_eq!(fine.coarser(multiple).len(), filled(0.0625 * f64::from(multiple)));
        }
    }

    #[test]
    fn a_batch_finds_the_voxels_that_single_points_lie_in() {
        let T = <Pose3 as RigidMotion>::exp(&nalgebra::Vector6::new(0.3, -1.2, 0.4, -3.0, 2.0, 0.7));
        let grid = Grid::new(0.05, &T, 2.0);
        let positions: Vec<[f32; 3]> = (0..1000)
            .map(|i| [(i % 10) as f32 * 0.3 - 1.5, (i / 100) as f32 * 0.4 - 2.0, (i / 10 % 10) as f32])
            .collect();
        let mut map = VoxelMap::new(0.05);
        map.insert(&cloud(&positions), &T, 0, 2.0);
        let mut seen = rustc_hash::FxHashSet::default();
        let corners = positions.iter().filter_map(|&position| grid.corner(Vec3::from(position)));
        let corners: Vec<_> = corners.filter(|&corner| seen.insert(corner)).collect();
        assert!(corners.len() > 300 && corners.len() < 1000, "{}", corners.len());
        assert_eq!(map.origins.iter().map(|origin| origin.corner).collect::<Vec<_>>(), corners);
    }

    #[test]
    fn normals_and_colours_of_any_number_of_points_are_means() {
        let normal = Vec3::new(-0.36, 0.48, -0.8);
        let many = 5000;
        let positions = (0..many).map(|i| Vec3::new(0.05 + 1e-6 * i as f32, 0.05, 0.05)).collect();
        let colors = (0..many).map(|i| [255, (i % 2) as u8 * 255, 7]).collect();
        let cloud = PointCloud {
            positions,
            // Not of unit length, as in some files.
            normals: Some(vec![3.0 * normal; many]),
            colors: Some(colors),
            ..PointCloud::default()
        };
        let mut map = VoxelMap::new(0.1);
        map.insert(&cloud, &Pose3::identity(), 0, 100.0);
        let found = map.cloud();
        assert!(found.normals.unwrap()[0].distance(normal) < 2e-3);
        assert_eq!(found.colors.unwrap(), [[255, 128, 7]]);
        assert!((found.positions[0].x - 0.0525).abs() < 1e-5, "{}", found.positions[0]);
    }

    #[test]
    fn points_of_frames_without_colours_do_not_darken_the_mean_colour() {
        let coloured = cloud(&[[0.02, 0.0, 1.0]; 40]);
        let plain = PointCloud { colors: None, ..coloured.clone() };
        let color_of = |clouds: &[&PointCloud]| {
            let mut map = VoxelMap::new(0.1);
            for cloud in clouds {
                map.insert(cloud, &Pose3::identity(), 0, 100.0);
            }
            map.cloud().colors.map(|colors| colors[0])
        };
        let expected = color_of(&[&coloured]);
        assert!(expected.is_some_and(|color| color[2] == 255));
        assert_eq!(color_of(&[&coloured, &plain]), expected);
        assert_eq!(color_of(&[&plain, &plain, &coloured]), expected);
        assert_eq!(color_of(&[&plain]), None);
    }

    #[test]
    fn points_are_those_of_the_cloud() {
        let positions: Vec<[f32; 3]> = (0..100).map(|i| [i as f32 * 0.03, (i % 7) as f32 * 0.2, 1.0]).collect();
        let mut map = VoxelMap::new(0.1);
        map.insert(&cloud(&positions[..50]), &Pose3::identity(), 4, 100.0);
        map.insert(&cloud(&positions[50..]), &Pose3::identity(), 9, 100.0);
        let whole = map.cloud();
        let (normals, colors) = (whole.normals.unwrap(), whole.colors.unwrap());
        let points: Vec<MapPoint> = map.points(10..map.len()).collect();
        assert_eq!(points.len(), map.len() - 10);
        for (at, point) in (10..).zip(points) {
            let MapPoint { position, normal, color, frame } = point;
            assert_eq!((position, normal, color), (whole.positions[at], normals[at], colors[at]));
            assert_eq!(frame, map.frames()[at]);
        }
    }

    #[test]
    fn voxels_of_a_block_have_different_slots() {
        let mut slots: Vec<u32> = (0..512).map(|i| slot([i % 8 - 8, i / 8 % 8, i / 64 + 16])).collect();
        slots.sort_unstable();
        assert_eq!(slots, (0..512).collect::<Vec<_>>());
    }
}
