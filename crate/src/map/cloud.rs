//! The map that clouds are registered to: one point with a normal per voxel.

use nalgebra::Vector3;

use crate::geometry::Pose3;
use crate::preprocess::voxel_hash::VoxelHash;
use crate::registration::target::OrientedTarget;

/// Sums over the points of a voxel.
#[derive(Debug, Clone, Copy)]
struct Voxel {
    point: Vector3<f64>,
    normal: Vector3<f64>,
    count: f64,
    /// Number of the cloud that it was first seen by.
    cloud: u32,
}

/// Points with normals in the world frame, at most one a cube of side `voxel_size`.
pub struct CloudMap {
    hash: VoxelHash,
    voxels: Vec<Voxel>,
}

impl CloudMap {
    /// A map without points; `voxel_size` in m.
    pub(crate) fn new(voxel_size: f64) -> Self {
        Self { hash: VoxelHash::new(voxel_size), voxels: Vec::new() }
    }

    /// Adds the points with normals (sensor frame) of the cloud of this number from `T_world_sensor`; points without a normal are left
    /// out.
    pub(crate) fn insert(
        &mut self,
        cloud: u32,
        points: &[Vector3<f64>],
        normals: &[Option<Vector3<f64>>],
        T_world_sensor: &Pose3,
    ) {
        for (point, normal) in points.iter().zip(normals) {
            let Some(normal) = normal else { continue };
            let point = T_world_sensor.rotation * point + T_world_sensor.translation.vector;
            let normal = T_world_sensor.rotation * normal;
            let Some(voxel) = self.hash.voxel(&point) else { continue };
            match self.voxels.get_mut(self.hash.insert(voxel) as usize) {
                None => self.voxels.push(Voxel { point, normal, count: 1.0, cloud }),
                // The two sides of a thin wall must not be averaged: the side seen first is kept.
                Some(voxel) if voxel.normal.dot(&normal) > 0.0 => {
                    voxel.point += point;
                    voxel.normal += normal;
                    voxel.count += 1.0;
                }
                Some(_) => {}
            }
        }
    }

    /// The number of the cloud that first saw the voxel of a point (world frame), if any did.
    pub(crate) fn first_seen_by(&self, point: &Vector3<f64>) -> Option<u32> {
        let number = self.hash.number(&self.hash.voxel(point)?)?;
        Some(self.voxels[number as usize].cloud)
    }

    /// All points with their unit normals (world frame), in the order in which their voxels were first met.
    pub(crate) fn points(&self) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + '_ {
        self.voxels.iter().map(|voxel| (voxel.point / voxel.count, voxel.normal.normalize()))
    }

    /// The registration target for a cloud: the points within `radius` (m) of a position in the world.
    pub(crate) fn around(&self, place: &Vector3<f64>, radius: f64) -> OrientedTarget<3> {
        let near = self.points().filter(|(point, _)| (point - place).norm_squared() <= radius * radius);
        let (points, normals) = near.map(|(point, normal)| (point, Some(normal))).unzip();
        OrientedTarget::new(points, normals)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_voxel_holds_the_mean_of_its_points_and_one_side_of_a_wall() {
        let mut map = CloudMap::new(0.5);
        let points = [Vector3::new(0.1, 0.1, 0.1), Vector3::new(0.3, 0.1, 0.1), Vector3::new(-0.1, 0.1, 0.1)];
        map.insert(7, &points, &[Some(Vector3::z()), Some(Vector3::z()), None], &Pose3::identity());
        map.insert(8, &points[..1], &[Some(-Vector3::z())], &Pose3::identity());
        assert_eq!(map.voxels.len(), 1);
        let (point, normal) = map.points().next().unwrap();
        assert!((point - Vector3::new(0.2, 0.1, 0.1)).norm() < 1e-12 && normal == Vector3::z());
        map.insert(9, &points[..1], &[Some(Vector3::x())], &Pose3::translation(5.0, 0.0, 0.0));
        assert_eq!(map.voxels.len(), 2);
        let seen_by = |x| map.first_seen_by(&Vector3::new(x, 0.1, 0.1));
        assert_eq!([0.2, 5.2, -0.1].map(seen_by), [Some(7), Some(9), None]);
        assert_eq!(map.around(&Vector3::zeros(), 1.0).points().len(), 1);
    }
}
