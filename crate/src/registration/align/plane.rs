//! Two scans in the plane.

use super::{CloudMetric, RegistrationOptions};
use crate::error::{Error, Result};
use crate::geometry::{Pose2, Pose3, RigidMotion};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::correlative::{LikelihoodGrid, SearchWindow};
use crate::registration::factors::{PointToPlane, PointToPoint};
use crate::registration::icp::{self, Registration, Source};
use crate::registration::target::{OrientedTarget, PointTarget};

/// Registers `source` to `target` from a guess, or from the best pose around it where the options ask for a search.
pub(super) fn register(
    source: &PlanarScan,
    target: &PlanarScan,
    mut guess: Pose2,
    options: &RegistrationOptions,
) -> Result<Registration<Pose2>> {
    if options.search_translation > 0.0 || options.search_rotation > 0.0 {
        let window = SearchWindow { translation: options.search_translation, rotation: options.search_rotation };
        let found = LikelihoodGrid::new(&target.points).search(&source.points, &guess, window);
        guess = found.map_or(guess, |found| found.T_target_source);
    }
    let icp = options.icp_options();
    let source = Source { points: &source.points, normals: Some(&source.normals), sigmas: None };
    match options.metric.unwrap_or(CloudMetric::PointToLine) {
        CloudMetric::PointToPoint => {
            let target = PointTarget::new(target.points.clone());
            Ok(icp::register(source, &target, guess, &PointToPoint, &icp))
        }
        CloudMetric::PointToLine => {
            let target = OrientedTarget::new(target.points.clone(), target.normals.clone());
            Ok(icp::register(source, &target, guess, &PointToPlane, &icp))
        }
        CloudMetric::PointToPlane | CloudMetric::Gicp | CloudMetric::Vgicp => {
            let problem = "point_to_plane, gicp and vgicp do not fit planar clouds: all their points lie in one plane";
            Err(Error::whole(problem, "Use point_to_line"))
        }
    }
}

/// What of a motion in space is left in the plane z = 0.
pub(super) fn in_plane(pose: &Pose3) -> Pose2 {
    let rotation = pose.rotation.to_rotation_matrix().matrix().fixed_view::<2, 2>(0, 0).into_owned();
    <Pose2 as RigidMotion>::from_parts(&rotation, &pose.translation.vector.xy())
}
