//! Registration of two clouds alone, planar or in space: for those who need nothing else.

use glam::{DVec3, Vec3};
use nalgebra::{Matrix3, Matrix4, Translation3, Vector3};
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::geometry::{PointCloud, Pose2, Pose3, RigidMotion};
use crate::io::trajectory::in_space;
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::correlative::{LikelihoodGrid, SearchWindow};
use crate::registration::factors::{PointToPlane, PointToPoint};
use crate::registration::icp::{
    Criteria, IcpOptions, IterationRecord, Registration, Rejection, Source, Weighting, register,
};
use crate::registration::robust_kernel::RobustKernel;
use crate::registration::target::{OrientedTarget, PointTarget};

/// What a correspondence measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum CloudMetric {
    /// Distance to the nearest point.
    PointToPoint,
    /// Distance to the line through the nearest point, for planar clouds; normals come from neighbouring beams.
    PointToLine,
    /// Distance to the plane through the nearest point, for clouds in space whose target has normals.
    PointToPlane,
}

/// Options of [`register_clouds`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct RegistrationOptions {
    /// Null: point to line for planar clouds, point to plane where the target has normals, point to point otherwise.
    pub metric: Option<CloudMetric>,
    /// First guess, 4 x 4, row by row; null is the identity.
    pub init_T_target_source: Option<[f64; 16]>,
    /// Planar clouds: half width of a search around the guess in x and y (m); 0 is no search.
    pub search_translation: f64,
    /// Planar clouds: half width of the search in heading (rad).
    pub search_rotation: f64,
    /// Pairs further apart are no correspondences (m).
    pub max_correspondence_distance: f64,
    /// Pairs whose normals differ by more are rejected (rad).
    pub max_normal_angle: f64,
    /// Share of the worst correspondences that is dropped.
    pub trim_fraction: f64,
    /// How pairs that fit badly lose weight.
    pub robust_kernel: RobustKernel,
    /// Residual at which they do (m).
    pub robust_kernel_width: f64,
    /// Most iterations.
    pub max_iterations: usize,
    /// Converged when a step turns less (rad) and moves less than `translation_eps`.
    pub rotation_eps: f64,
    /// Converged when a step moves less (m) and turns less than `rotation_eps`.
    pub translation_eps: f64,
}

impl Default for RegistrationOptions {
    fn default() -> Self {
        Self {
            metric: None,
            init_T_target_source: None,
            search_translation: 0.0,
            search_rotation: 0.0,
            max_correspondence_distance: 0.5,
            max_normal_angle: 45f64.to_radians(),
            trim_fraction: 0.0,
            robust_kernel: RobustKernel::Cauchy,
            robust_kernel_width: 0.05,
            max_iterations: 50,
            rotation_eps: 1e-4,
            translation_eps: 1e-4,
        }
    }
}

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
        if !cloud.positions.iter().any(|p| p.is_finite()) {
            return Err(Error::whole(format!("The {role} has no finite point"), "Give a cloud with points"));
        }
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
    let origin = Translation3::new(target.origin.x, target.origin.y, target.origin.z);
    let guess = origin.inverse() * first_guess(options)? * origin;
    let (source, target) = (Near::new(source, target.origin), Near::new(target, target.origin));
    let mut result = if planar {
        register_planar(&source, &target, &guess, options)?
    } else {
        register_spatial(&source, target, guess, options)?
    };
    result.T_target_source = row_major(&(origin * pose_from(&result.T_target_source)? * origin.inverse()));
    Ok(result)
}

/// Finite points in double precision, with their normals.
struct Near {
    points: Vec<Vector3<f64>>,
    normals: Option<Vec<Option<Vector3<f64>>>>,
}

impl Near {
    fn new(cloud: &PointCloud, origin: DVec3) -> Self {
        let finite = || cloud.positions.iter().enumerate().filter(|(_, p)| p.is_finite());
        let shift = cloud.origin - origin;
        let points = finite().map(|(_, p)| Vector3::from((p.as_dvec3() + shift).to_array())).collect();
        let normal = |n: Vec3| n.is_finite().then(|| Vector3::from(n.as_dvec3().to_array()));
        let normals = cloud.normals.as_ref().map(|normals| finite().map(|(index, _)| normal(normals[index])).collect());
        Self { points, normals }
    }
}

fn register_planar(
    source: &Near,
    target: &Near,
    guess: &Pose3,
    options: &RegistrationOptions,
) -> Result<RegistrationResult> {
    let [source, target] = [source, target].map(|near| PlanarScan::new(near.points.iter().map(Vector3::xy).collect()));
    let rotation = guess.rotation.to_rotation_matrix().matrix().fixed_view::<2, 2>(0, 0).into_owned();
    let mut guess = <Pose2 as RigidMotion<2, 3>>::from_parts(&rotation, &guess.translation.vector.xy());
    if options.search_translation > 0.0 || options.search_rotation > 0.0 {
        let window = SearchWindow { translation: options.search_translation, rotation: options.search_rotation };
        let found = LikelihoodGrid::new(&target.points).search(&source.points, &guess, window);
        guess = found.map_or(guess, |found| found.T_target_source);
    }
    let icp = icp_options(options);
    let points = Source { points: &source.points, normals: Some(&source.normals), deviations: None };
    let registration = match options.metric.unwrap_or(CloudMetric::PointToLine) {
        CloudMetric::PointToPoint => {
            register::<2, 3, Pose2, PointToPoint>(points, &PointTarget::new(target.points), guess, &icp)
        }
        CloudMetric::PointToLine => {
            let target = OrientedTarget::new(target.points, target.normals);
            register::<2, 3, Pose2, PointToPlane>(points, &target, guess, &icp)
        }
        CloudMetric::PointToPlane => {
            let problem = "point_to_plane does not fit planar clouds: all their points lie in one plane";
            return Err(Error::whole(problem, "Use point_to_line"));
        }
    };
    Ok(result(&registration, &in_space(&registration.T_target_source)))
}

fn register_spatial(
    source: &Near,
    target: Near,
    guess: Pose3,
    options: &RegistrationOptions,
) -> Result<RegistrationResult> {
    let icp = icp_options(options);
    let points = Source { points: &source.points, normals: source.normals.as_deref(), deviations: None };
    let registration = match (options.metric, target.normals) {
        (Some(CloudMetric::PointToLine), _) => {
            let problem = "point_to_line is for planar clouds, and these are clouds in space";
            return Err(Error::whole(problem, "Use point_to_plane or point_to_point"));
        }
        (Some(CloudMetric::PointToPlane), None) => {
            let problem = "point_to_plane needs normals, and the target has none";
            return Err(Error::whole(problem, "Give a target with normals (nx, ny, nz) or use point_to_point"));
        }
        (None | Some(CloudMetric::PointToPlane), Some(normals)) => {
            let target = OrientedTarget::new(target.points, normals);
            register::<3, 6, Pose3, PointToPlane>(points, &target, guess, &icp)
        }
        (None | Some(CloudMetric::PointToPoint), _) => {
            register::<3, 6, Pose3, PointToPoint>(points, &PointTarget::new(target.points), guess, &icp)
        }
    };
    Ok(result(&registration, &registration.T_target_source))
}

fn result<const D: usize, const DOF: usize, M>(
    registration: &Registration<D, DOF, M>,
    T_target_source: &Pose3,
) -> RegistrationResult {
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

fn icp_options(options: &RegistrationOptions) -> IcpOptions {
    IcpOptions {
        rejection: Rejection {
            max_correspondence_distance: options.max_correspondence_distance,
            max_normal_angle: options.max_normal_angle,
            trim_fraction: options.trim_fraction,
        },
        weighting: Weighting { robust_kernel: options.robust_kernel, robust_kernel_width: options.robust_kernel_width },
        criteria: Criteria {
            max_iterations: options.max_iterations,
            rotation_eps: options.rotation_eps,
            translation_eps: options.translation_eps,
        },
    }
}

fn first_guess(options: &RegistrationOptions) -> Result<Pose3> {
    options.init_T_target_source.as_ref().map_or(Ok(Pose3::identity()), pose_from)
}

fn row_major(pose: &Pose3) -> [f64; 16] {
    let mut rows = [0.0; 16];
    rows.copy_from_slice(pose.to_homogeneous().transpose().as_slice());
    rows
}

/// How far a rotation matrix may be from orthonormal: the rounding of a file with six digits.
const MAX_ROTATION_DEFECT: f64 = 1e-4;

fn pose_from(rows: &[f64; 16]) -> Result<Pose3> {
    let matrix = Matrix4::from_row_slice(rows);
    let R: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    let defect = (R * R.transpose() - Matrix3::identity()).norm();
    let bottom_is_right = matrix.row(3).iter().copied().eq([0.0, 0.0, 0.0, 1.0]);
    let sound = defect < MAX_ROTATION_DEFECT && R.determinant() > 0.0 && bottom_is_right;
    if !(sound && rows.iter().all(|value| value.is_finite())) {
        return Err(Error::whole(
            "init_T_target_source is no rigid motion",
            "Give 16 numbers row by row, a rotation matrix and a translation, the last row 0 0 0 1",
        ));
    }
    Ok(<Pose3 as RigidMotion<3, 6>>::from_parts(&R, &matrix.fixed_view::<3, 1>(0, 3).into_owned()))
}
