//! A planar scan, ready for registration.

use nalgebra::Vector2;

use super::beam_normals::beam_normals;
use crate::geometry::PointCloud;

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
}

impl PlanarScan {
    /// The finite points of a cloud by their x and y, in the order of the beams; z is left out.
    pub fn from_cloud(cloud: &PointCloud) -> Self {
        let finite = cloud.positions.iter().filter(|p| p.is_finite());
        Self::new(
            finite.map(|p| <[f64; 3]>::from(p.as_dvec3() + cloud.origin)).map(|[x, y, _]| [x, y].into()).collect(),
        )
    }
}
