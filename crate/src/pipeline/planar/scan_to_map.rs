//! One registration of a run, as two clouds: the same points, normals and first guess.

use glam::Vec3;
use nalgebra::Vector2;

use crate::geometry::{PointCloud, Pose2};
use crate::io::trajectory::in_space;
use crate::map::local::LocalMap;
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::align::row_major;

/// A scan and the map that it was registered to, as they were at that time.
#[derive(Debug, Clone)]
pub struct ScanToMap {
    /// The scan without what is no measurement (m), in its sensor's frame.
    pub source: PointCloud,
    /// The scans before it (m), with normals for point to line, in the frame of the map.
    pub target: PointCloud,
    /// The first guess of `T_target_source`, 4 x 4, row by row.
    pub init_T_target_source: [f64; 16],
}

impl ScanToMap {
    pub(super) fn new(scan: &PlanarScan, map: &LocalMap, guess: &Pose2) -> Self {
        let (points, normals): (Vec<_>, Vec<_>) = map.target_points().into_iter().unzip();
        let none = Vector2::from_element(f64::NAN);
        let normals = normals.iter().any(Option::is_some).then(|| normals.iter().map(|n| flat(&n.unwrap_or(none))));
        Self {
            source: PointCloud::from_positions(scan.points.iter().map(flat).collect()),
            target: PointCloud {
                normals: normals.map(Iterator::collect),
                ..PointCloud::from_positions(points.iter().map(flat).collect())
            },
            init_T_target_source: row_major(&in_space(guess)),
        }
    }
}

fn flat(point: &Vector2<f64>) -> Vec3 {
    Vec3::new(point.x as f32, point.y as f32, 0.0)
}
