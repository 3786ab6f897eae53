//! A planar scan with normals: the source and target of registration in the plane.

use glam::DVec3;
use nalgebra::Vector2;

use super::beam_normals::{beam_normals, bearing, is_one_surface};
use crate::geometry::PointCloud;
use crate::search::order::ascending;

/// Sine of the largest angle between the surfaces at two returns and the line between them for which points are interpolated.
const MAX_BEND: f64 = 0.26;

/// Returns of one planar laser scan in the sensor frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlanarScan {
    /// Returns (m).
    pub points: Vec<Vector2<f64>>,
    /// Unit normal of each return, facing the sensor, where its neighbours form a line.
    pub normals: Vec<Option<Vector2<f64>>>,
}

impl PlanarScan {
    /// Finds the normals of finite returns (m, sensor frame).
    pub fn new(points: Vec<Vector2<f64>>) -> Self {
        Self { normals: beam_normals(&points), points }
    }

    /// The returns with their normals, and points interpolated between adjacent beams on one surface such that they are at most
    /// `spacing` (m) apart (Censi, "An ICP variant using a point-to-line metric", ICRA 2008, matches with such segments).
    pub fn surface(&self, spacing: f64) -> Vec<(Vector2<f64>, Option<Vector2<f64>>)> {
        let by_bearing = ascending(self.points.iter().map(bearing));
        let mut surface: Vec<_> = self.points.iter().copied().zip(self.normals.iter().copied()).collect();
        for pair in by_bearing.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let (Some(n), Some(m)) = (self.normals[a], self.normals[b]) else { continue };
            let between = self.points[b] - self.points[a];
            let length = between.norm();
            let off = n.dot(&between).abs().max(m.dot(&between).abs());
            if length <= spacing || !is_one_surface(&self.points[a], &self.points[b]) || off > MAX_BEND * length {
                continue;
            }
            let count = (length / spacing).ceil() as usize;
            let normal = (n + m).try_normalize(0.5);
            surface.extend((1..count).map(|i| (self.points[a] + between * (i as f64 / count as f64), normal)));
        }
        surface
    }

    /// The finite points of a cloud by their x and y, in the order of the beams; z is left out.
    pub fn from_cloud(cloud: &PointCloud) -> Self {
        let point = |(_, point): (usize, DVec3)| Vector2::from((point + cloud.origin).truncate().to_array());
        Self::new(cloud.finite_points().map(point).collect())
    }
}
