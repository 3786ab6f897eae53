//! A planar scan, ready for registration.

use nalgebra::Vector2;

use super::beam_normals::beam_normals;

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
