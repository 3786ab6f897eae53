//! Sharpness of a map without any truth: how far overlapping scans lie from each other's surfaces.

use nalgebra::Vector2;
use serde::Serialize;

use crate::geometry::Pose2;
use crate::preprocess::planar_scan::PlanarScan;
use crate::search::KdTree;

/// Returns further out than this do not count (m).
pub const MAX_RANGE: f64 = 29.0;
/// A point and its nearest neighbour further apart than this do not overlap (m).
pub const MAX_PAIR_DISTANCE: f64 = 0.5;

/// Mean point-to-line residual between overlapping scans.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Sharpness {
    /// Mean absolute distance along the partner's normal (m): the smaller, the crisper the map.
    pub mean_residual: f64,
    /// Pairs that the mean is taken over.
    pub num_pairs: usize,
}

/// Every point of a scan against its nearest neighbour in the union of all other scans, in the world frame; pairs within
/// [`MAX_PAIR_DISTANCE`] whose target point has a normal count with their distance along that normal. Only returns within
/// [`MAX_RANGE`]. `None` where no two scans overlap.
pub fn sharpness(scans: &[(&PlanarScan, Pose2)]) -> Option<Sharpness> {
    let mut positions: Vec<Vector2<f64>> = Vec::new();
    let mut normals: Vec<Option<Vector2<f64>>> = Vec::new();
    let mut scan_of: Vec<u32> = Vec::new();
    for (index, (scan, T_world_sensor)) in scans.iter().enumerate() {
        for (point, normal) in scan.points.iter().zip(&scan.normals) {
            if point.norm() <= MAX_RANGE {
                positions.push(T_world_sensor * nalgebra::Point2::from(*point) - nalgebra::Point2::origin());
                normals.push(normal.map(|normal| T_world_sensor.rotation * normal));
                scan_of.push(index as u32);
            }
        }
    }
    let single: Vec<[f32; 2]> = positions.iter().map(|p| [p.x as f32, p.y as f32]).collect();
    let tree = KdTree::build(&single);

    let (mut sum, mut num_pairs) = (0.0, 0);
    for (point, query) in single.iter().enumerate() {
        let of_others = |other: u32| scan_of[other as usize] != scan_of[point];
        let Some(neighbor) = tree.nearest_where(query, MAX_PAIR_DISTANCE as f32, of_others) else { continue };
        let partner = neighbor.index as usize;
        if let Some(normal) = normals[partner] {
            sum += normal.dot(&(positions[point] - positions[partner])).abs();
            num_pairs += 1;
        }
    }
    (num_pairs > 0).then(|| Sharpness { mean_residual: sum / num_pairs as f64, num_pairs })
}
