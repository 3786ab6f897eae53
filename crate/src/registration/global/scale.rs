//! The scale of a global registration: the voxels at which features are computed, and distances in them.

use glam::Vec3;

use crate::error::{Error, Result};
use crate::geometry::PointCloud;
use crate::preprocess::voxel_downsample::voxel_downsample;
use crate::search::Neighborhood;

/// Number of points of a cloud to which it is downsampled for a global registration.
const GLOBAL_POINTS: f64 = 6000.0;
/// Iterations of the search for the voxel size that leaves about this number of points.
const SIZE_TRIES: usize = 4;

/// Radius of a feature's neighbourhood (voxels), and most neighbours in it, as in Open3D's tutorial.
const FEATURE_RADIUS: f64 = 5.0;
const FEATURE_NEIGHBORS: usize = 100;
/// Largest distance of a match that agrees with a motion (voxels), as in Open3D's tutorial.
pub(crate) const MATCH_DISTANCE: f64 = 1.5;

/// The neighbourhood that a feature describes, in a cloud of one point per voxel of this side (m).
pub(crate) fn feature_neighborhood(voxel_size: f64) -> Neighborhood {
    Neighborhood { max_neighbors: FEATURE_NEIGHBORS, radius: FEATURE_RADIUS * voxel_size }
}

/// A voxel size (m) that leaves about 6,000 points, so that features describe rooms, not the roughness of a wall.
///
/// # Errors
/// When all points coincide.
pub fn feature_voxel_size(cloud: &PointCloud) -> Result<f64> {
    let finite = || cloud.positions.iter().copied().filter(|p| p.is_finite());
    let (low, high) = (finite().reduce(Vec3::min).unwrap_or_default(), finite().reduce(Vec3::max).unwrap_or_default());
    let mut size = f64::from((high - low).max_element()) / 100.0;
    if size <= 0.0 {
        let problem = "All points of the target coincide, so that their features are undefined";
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
