//! The scale at which the surfaces of a cloud are described for a global registration.

use glam::Vec3;

use crate::error::{Error, Result};
use crate::geometry::PointCloud;
use crate::preprocess::voxel_downsample::voxel_downsample;

/// Points of a cloud that are enough for a global registration.
const GLOBAL_POINTS: f64 = 6000.0;
/// Tries to find the voxel size that leaves about this number of points.
const SIZE_TRIES: usize = 4;

/// A side of voxels (m) that leaves about 6,000 points: features then describe rooms, not the texture of a wall.
///
/// # Errors
/// When all points are one.
pub fn telling_voxel_size(cloud: &PointCloud) -> Result<f64> {
    let finite = || cloud.positions.iter().copied().filter(|p| p.is_finite());
    let (low, high) = (finite().reduce(Vec3::min).unwrap_or_default(), finite().reduce(Vec3::max).unwrap_or_default());
    let mut size = f64::from((high - low).max_element()) / 100.0;
    if size <= 0.0 {
        let problem = "All points of the target coincide: no feature tells one from another";
        return Err(Error::whole(problem, "Give a cloud of surfaces"));
    }
    for _ in 0..SIZE_TRIES {
        let count = voxel_downsample(cloud, size)?.len() as f64;
        // Surfaces: the number of voxels goes with the square of their size.
        let ratio = (count / GLOBAL_POINTS).sqrt().clamp(0.1, 10.0);
        if (0.8..=1.25).contains(&ratio) || (ratio < 1.0 && count > 0.9 * cloud.len() as f64) {
            break;
        }
        size *= ratio;
    }
    Ok(size)
}
