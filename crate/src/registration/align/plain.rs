//! The registration of two clouds in plain data, which crosses to JavaScript and into files.

use serde::Serialize;

use super::{RegistrationOptions, check_points, plane, pose_from, row_major, space};
use crate::error::{Error, Result};
use crate::geometry::{PointCloud, Pose3, RigidMotion, SquareMatrix, Vector};
use crate::io::trajectory::in_space;
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::icp::{IterationRecord, Registration};

/// A registration with its evidence, as plain data.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct RegistrationResult {
    /// Maps source points into the target's frame: 4 x 4, row by row.
    pub T_target_source: [f64; 16],
    /// Whether the last step was below both limits. `false` is no error: read the history.
    pub converged: bool,
    /// Iterations done.
    pub iterations: usize,
    /// Pairs within the distance limit, in the last iteration.
    pub num_correspondences: usize,
    /// Pairs that counted.
    pub num_inliers: usize,
    /// Inliers over source points.
    pub fitness: f64,
    /// Root mean square of the inliers' residuals (m).
    pub inlier_rmse: f64,
    /// Information matrix, row by row: 3 x 3 over (theta, x, y) for planar clouds, 6 x 6 over (wx, wy, wz, x, y, z)
    /// otherwise; a perturbation on the left of `T_target_source` (1/rad^2, 1/m^2).
    pub information: Vec<f64>,
    /// The direction of motion that the points leave open, in the order of `information`, or null.
    pub undetermined: Option<Vec<f64>>,
    /// Every iteration.
    pub history: Vec<IterationRecord>,
}

/// Registers `source` to `target`. Two planar clouds (z = 0) are registered in the plane.
///
/// # Errors
/// When a cloud has no finite point, when only one of them is planar, when the metric does not fit the clouds, or when the
/// guess is no rigid motion.
pub fn register_clouds(
    source: &PointCloud,
    target: &PointCloud,
    options: &RegistrationOptions,
) -> Result<RegistrationResult> {
    for (cloud, role) in [(source, "source"), (target, "target")] {
        check_points(role, cloud.positions.iter().any(|p| p.is_finite()))?;
    }
    let planar = match (source.is_planar(), target.is_planar()) {
        (true, true) => true,
        (false, false) => false,
        (source_is_planar, _) => {
            return Err(Error::whole(
                format!("The {} is planar, the other cloud is not", if source_is_planar { "source" } else { "target" }),
                "Give two planar scans (z = 0) or two clouds in space",
            ));
        }
    };
    // Both clouds relative to the target's origin, which may be far away: T = shift * T_near * shift^-1.
    let origin = space::origin_of(target);
    let guess = origin.inverse() * options.guess()? * origin;
    let mut result = if planar {
        let scan = |cloud| PlanarScan::new(space::Near::new(cloud, target.origin).points_in_plane());
        let registration = plane::register(&scan(source), &scan(target), plane::in_plane(&guess), options)?;
        result(&registration, &in_space(&registration.T_target_source))
    } else {
        let registration = space::register(source, target, guess, options)?;
        result(&registration, &registration.T_target_source)
    };
    result.T_target_source = row_major(&(origin * pose_from(&result.T_target_source)? * origin.inverse()));
    Ok(result)
}

fn result<M: RigidMotion>(registration: &Registration<M>, T_target_source: &Pose3) -> RegistrationResult {
    let Registration { last, observability, .. } = registration;
    let weakest = observability.weakest_direction.as_slice().to_vec();
    RegistrationResult {
        T_target_source: row_major(T_target_source),
        converged: registration.converged,
        iterations: registration.history.len(),
        num_correspondences: last.num_correspondences,
        num_inliers: last.num_inliers,
        fitness: registration.fitness,
        inlier_rmse: last.inlier_rmse,
        information: registration.information.as_slice().to_vec(), // symmetric: rows are columns
        undetermined: observability.is_undetermined().then_some(weakest),
        history: registration.history.clone(),
    }
}
