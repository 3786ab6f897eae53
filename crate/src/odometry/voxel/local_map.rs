//! The map that frames are registered to, kept as the settings say.

use nalgebra::Vector3;

use super::options::{KeptPoint, MapKind, VoxelOdometrySettings};
use super::voxel_grid::VoxelGrid;
use crate::geometry::Pose3;
use crate::registration::target::{LastSearch, SurfaceTarget, Target};
use crate::search::{KdTree, Neighbor};

/// [`LastSearch::again`]'s `clearance`: cells of a grid cost more the farther away they are.
const CLEARANCE: f64 = 1.25;

/// Points (m, world frame) with normals where they are known, and an index of them.
pub struct LocalMap {
    points: Vec<Vector3<f64>>,
    normals: Vec<Option<Vector3<f64>>>,
    /// Points that each point is the mean of; empty but where means are kept.
    counts: Vec<u32>,
    index: Index,
    settings: VoxelOdometrySettings,
    /// The points of the voxel that is being looked at.
    in_voxel: Vec<u32>,
}

enum Index {
    /// Of all points, as they were when it was built.
    Tree(KdTree<3>),
    Grid(VoxelGrid),
}

impl LocalMap {
    /// A map without points, of frames whose points lie so far apart (m), roughly.
    pub fn new(settings: &VoxelOdometrySettings, spacing: f64) -> Self {
        let index = match settings.map {
            MapKind::Whole => Index::Tree(KdTree::build(&[])),
            MapKind::Voxels => Index::Grid(VoxelGrid::new(settings.map_voxel_size, settings.points_per_voxel, spacing)),
        };
        Self {
            points: Vec::new(),
            normals: Vec::new(),
            counts: Vec::new(),
            index,
            settings: settings.clone(),
            in_voxel: Vec::new(),
        }
    }

    /// Points that the map holds.
    pub fn points(&self) -> &[Vector3<f64>] {
        &self.points
    }

    /// One entry a point: unit normals, where they are known.
    pub fn normals(&self) -> &[Option<Vector3<f64>>] {
        &self.normals
    }

    /// Makes the map ready for the next frame: a map kept whole builds its index anew, over all of its points. The grid of
    /// voxels has grown with them.
    pub fn make_ready(&mut self) {
        if let Index::Tree(tree) = &mut self.index {
            let single: Vec<[f32; 3]> = self.points.iter().map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect();
            *tree = KdTree::build(&single);
        }
    }

    /// Whether there is a point of the map within `distance` (m) of this one (world frame). A map kept whole answers from
    /// its index: points added since are not seen.
    pub fn has_partner(&self, point: &Vector3<f64>, distance: f64) -> bool {
        Target::nearest(self, point, distance).is_some()
    }

    /// Adds a point with its normal (world frame). Returns whether the map took it, be it as a part of a mean or in
    /// the place of another.
    pub fn insert(&mut self, point: Vector3<f64>, normal: Option<Vector3<f64>>) -> bool {
        let Index::Grid(grid) = &mut self.index else {
            self.points.push(point);
            self.normals.push(normal);
            return true;
        };
        if !grid.voxel_of(&point, &mut self.in_voxel) {
            return false;
        }
        let capacity = if self.settings.kept == KeptPoint::Mean { 1 } else { self.settings.points_per_voxel };
        if self.in_voxel.len() < capacity {
            let number = self.points.len() as u32;
            grid.insert(&point, number);
            self.points.push(point);
            self.normals.push(normal);
            if self.settings.kept == KeptPoint::Mean {
                self.counts.push(1);
            }
            return true;
        }
        self.insert_into_full(point, normal)
    }

    /// Adds a point to its voxel, whose points are `in_voxel`, where that holds as many points as it may. Returns whether the map
    /// took it.
    fn insert_into_full(&mut self, point: Vector3<f64>, normal: Option<Vector3<f64>>) -> bool {
        let Some(&oldest) = self.in_voxel.first() else { return false };
        let slot = oldest as usize;
        match self.settings.kept {
            KeptPoint::First => return false,
            KeptPoint::Newest => {
                (self.points[slot], self.normals[slot]) = (point, normal);
                if let Index::Grid(grid) = &mut self.index {
                    grid.make_last(&point, oldest);
                }
            }
            KeptPoint::Mean => {
                // A mean of points of one voxel stays in it: the grid need not know.
                self.counts[slot] += 1;
                let count = f64::from(self.counts[slot]);
                let mean = self.points[slot];
                self.points[slot] = mean + (point - mean) / count;
                self.normals[slot] = match (self.normals[slot], normal) {
                    // The two sides of a thin wall must not become one: the side seen first stays.
                    (Some(mean), Some(normal)) if mean.dot(&normal) > 0.0 => {
                        Some((mean * (count - 1.0) + normal).normalize())
                    }
                    (mean, normal) => mean.or(normal),
                };
            }
        }
        true
    }

    /// Forgets the points further than `distance` (m) from a place in the world.
    pub fn crop(&mut self, place: &Vector3<f64>, distance: f64) {
        let is_near = |point: &Vector3<f64>| (point - place).norm_squared() <= distance * distance;
        if self.points.iter().all(is_near) {
            return;
        }
        let near: Vec<usize> = (0..self.points.len()).filter(|&index| is_near(&self.points[index])).collect();
        self.points = near.iter().map(|&index| self.points[index]).collect();
        self.normals = near.iter().map(|&index| self.normals[index]).collect();
        if !self.counts.is_empty() {
            self.counts = near.iter().map(|&index| self.counts[index]).collect();
        }
        if let Index::Grid(grid) = &mut self.index {
            grid.clear();
            (0..).zip(&self.points).for_each(|(number, point)| grid.insert(point, number));
        }
    }
}

impl Target for LocalMap {
    type Point = Vector3<f64>;

    fn nearest(&self, query: &Vector3<f64>, max_distance: f64) -> Option<Neighbor> {
        match &self.index {
            Index::Tree(tree) => tree.nearest(&[query.x as f32, query.y as f32, query.z as f32], max_distance as f32),
            Index::Grid(grid) => grid.nearest(&self.points, query, max_distance),
        }
    }

    fn nearest_again(
        &self,
        query: &Vector3<f64>,
        max_distance: f64,
        last: &mut LastSearch<Vector3<f64>>,
    ) -> Option<Neighbor> {
        let nearest = |reach| self.nearest(query, reach);
        last.again(query, max_distance, CLEARANCE, nearest, |index| {
            // A little more than the way to the last partner, so that rounding does not shut it out.
            let reach = (self.points[index as usize] - query).norm() * (1.0 + 1e-6) + 1e-6;
            self.nearest(query, reach.min(max_distance))
        })
    }

    fn point(&self, index: u32) -> Vector3<f64> {
        self.points[index as usize]
    }

    fn normal(&self, index: u32) -> Option<Vector3<f64>> {
        self.normals[index as usize]
    }
}

impl SurfaceTarget for LocalMap {}

/// Moves points and normals of the sensor's frame into the world.
pub(super) fn placed(
    T_world_sensor: &Pose3,
    point: &Vector3<f64>,
    normal: Option<&Vector3<f64>>,
) -> (Vector3<f64>, Option<Vector3<f64>>) {
    let rotation = &T_world_sensor.rotation;
    (rotation * point + T_world_sensor.translation.vector, normal.map(|normal| rotation * normal))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(kept: KeptPoint, points_per_voxel: usize) -> VoxelOdometrySettings {
        VoxelOdometrySettings { map_voxel_size: 0.5, points_per_voxel, kept, ..VoxelOdometrySettings::default() }
    }

    /// Points along x in one voxel, then one in the next.
    fn filled(settings: &VoxelOdometrySettings) -> LocalMap {
        let mut map = LocalMap::new(settings, 0.05);
        for x in [0.1, 0.2, 0.3, 0.4, 0.6] {
            map.insert(Vector3::new(x, 0.1, 0.1), Some(Vector3::z()));
        }
        map.make_ready();
        map
    }

    fn abscissas(map: &LocalMap) -> Vec<f64> {
        let mut all: Vec<f64> = map.points().iter().map(|p| (p.x * 1e9).round() / 1e9).collect();
        all.sort_by(f64::total_cmp);
        all
    }

    #[test]
    fn a_voxel_keeps_what_it_is_told_to() {
        assert_eq!(abscissas(&filled(&settings(KeptPoint::First, 1))), [0.1, 0.6]);
        assert_eq!(abscissas(&filled(&settings(KeptPoint::First, 2))), [0.1, 0.2, 0.6]);
        assert_eq!(abscissas(&filled(&settings(KeptPoint::Newest, 1))), [0.4, 0.6]);
        assert_eq!(abscissas(&filled(&settings(KeptPoint::Newest, 2))), [0.3, 0.4, 0.6]);
        assert_eq!(abscissas(&filled(&settings(KeptPoint::Mean, 7))), [0.25, 0.6]);
        let whole = VoxelOdometrySettings { map: MapKind::Whole, ..VoxelOdometrySettings::default() };
        assert_eq!(abscissas(&filled(&whole)).len(), 5);
    }

    #[test]
    fn partners_are_found_before_and_after_a_crop() {
        let whole = VoxelOdometrySettings { map: MapKind::Whole, ..VoxelOdometrySettings::default() };
        for settings in [whole, settings(KeptPoint::First, 9), settings(KeptPoint::Mean, 1)] {
            let mut map = filled(&settings);
            let (near, far) = (Vector3::new(0.24, 0.1, 0.1), Vector3::new(0.62, 0.1, 0.1));
            assert!(map.has_partner(&near, 0.05) && map.has_partner(&far, 0.05) && !map.has_partner(&far, 0.01));
            map.crop(&Vector3::zeros(), 0.5);
            map.make_ready();
            assert!(map.has_partner(&near, 0.05) && !map.has_partner(&far, 0.05), "{settings:?}");
            let nearest = map.nearest(&far, 10.0).unwrap().index;
            let mut last = LastSearch::Nearest(0);
            assert_eq!(map.nearest_again(&far, 10.0, &mut last).unwrap().index, nearest);
            // A point too far away is not found, now or later, until it is near.
            let mut last = LastSearch::None;
            let at = |x: f64| Vector3::new(x, 0.1, 0.1);
            assert!([2.0, 1.99, 1.8].map(|x| map.nearest_again(&at(x), 1.0, &mut last)).iter().all(Option::is_none));
            assert!(map.nearest_again(&at(0.9), 1.0, &mut last).is_some());
        }
    }

    #[test]
    fn a_wall_keeps_the_side_that_was_seen_first() {
        let mut map = LocalMap::new(&settings(KeptPoint::Mean, 1), 0.05);
        map.insert(Vector3::new(0.1, 0.1, 0.1), Some(Vector3::z()));
        map.insert(Vector3::new(0.3, 0.1, 0.1), Some(-Vector3::z()));
        assert_eq!(map.normals()[0], Some(Vector3::z()));
        assert!(!map.insert(Vector3::new(f64::NAN, 0.0, 0.0), None));
    }
}
