//! The initial motion between two clouds in space without a guess, by global registration.

use glam::DVec3;
use nalgebra::Translation3;

use super::RegistrationOptions;
use crate::error::Result;
use crate::geometry::{PointCloud, Pose3};
use crate::preprocess::estimate_normals::{NORMAL_NEIGHBORS, estimate_normals};
use crate::preprocess::voxel_downsample::voxel_downsample;
use crate::registration::global::scale::{MATCH_DISTANCE, feature_neighborhood, feature_voxel_size};
use crate::registration::global::{DescribedCloud, GlobalMethod, register_globally};
use crate::search::KdTree;

/// The motion from `source` to `target`, relative to the target's origin.
pub(super) fn without_a_guess(
    source: &PointCloud,
    target: &PointCloud,
    options: &RegistrationOptions,
) -> Result<Pose3> {
    let voxel_size = if options.voxel_size > 0.0 { options.voxel_size } else { feature_voxel_size(target)? };
    let describe = |cloud: &PointCloud| -> Result<(DescribedCloud, KdTree<3>)> {
        let cloud = voxel_downsample(cloud, voxel_size)?;
        let tree = KdTree::build(bytemuck::cast_slice(&cloud.positions));
        // Features need normals of one orientation, which those of files may not have.
        let normals = estimate_normals(&cloud.positions, &tree, NORMAL_NEIGHBORS, DVec3::ZERO);
        Ok((DescribedCloud::new(&cloud.positions, &normals, &tree, feature_neighborhood(voxel_size)), tree))
    };
    let ((described_source, _), (described_target, tree)) = (describe(source)?, describe(target)?);
    let max_distance = MATCH_DISTANCE * voxel_size;
    let method = GlobalMethod::Consistency;
    let found = register_globally(&described_source, &described_target, &tree, method, max_distance)?;
    let shift = source.origin - target.origin;
    Ok(found.consensus.T_target_source * Translation3::new(shift.x, shift.y, shift.z).inverse())
}
