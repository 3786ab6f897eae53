//! Registration of two clouds alone, planar or in space: for those who need nothing else.

use std::borrow::Cow;

use glam::{DVec3, Vec3};
use nalgebra::{Matrix3, Matrix4, Translation3, Vector3};
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::geometry::{PointCloud, Pose2, Pose3, RigidMotion, SquareMatrix, Vector};
use crate::io::trajectory::in_space;
use crate::preprocess::estimate_normals::estimate_normals;
use crate::preprocess::planar_scan::PlanarScan;
use crate::preprocess::voxel_downsample::voxel_downsample;
use crate::registration::correlative::{LikelihoodGrid, SearchWindow};
use crate::registration::factors::{PointToPlane, PointToPoint};
use crate::registration::global::{DescribedCloud, GlobalMethod, register_globally};
use crate::registration::icp::{
    Criteria, IcpOptions, IterationRecord, Registration, Rejection, Source, Weighting, register, register_with,
};
use crate::registration::robust_kernel::RobustKernel;
use crate::registration::solver::Motion;
use crate::registration::spatial::{SpatialMetric, register_in_space};
use crate::registration::target::{OrientedTarget, PointTarget};
use crate::registration::voxelized::{GaussianVoxels, PlaneToVoxel};
use crate::search::{KdTree, Neighbourhood};

/// What a correspondence measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum CloudMetric {
    /// Distance to the nearest point.
    PointToPoint,
    /// Distance to the line through the nearest point, for planar clouds; normals come from neighbouring beams.
    PointToLine,
    /// Distance to the plane through the nearest point, for clouds in space. A target without normals gets them from its points.
    PointToPlane,
    /// Distance of the planes through both points, for clouds in space: generalised ICP. Clouds without normals get them
    /// from their points.
    Gicp,
    /// As `gicp`, with the voxel that a point lies in for its partner: voxelised GICP. Quicker, and as coarse as
    /// `gaussian_voxel_size`.
    Vgicp,
}

/// Where a registration starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum RegistrationInit {
    /// At `init_T_target_source`.
    #[default]
    Guess,
    /// Clouds in space: where points that look alike lie on each other, wherever the clouds are. With `max_iterations` 0 this
    /// is all that is done.
    Global,
}

/// Options of [`register_clouds`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct RegistrationOptions {
    /// Null: point to line for planar clouds, point to plane where the target's file has normals, point to point otherwise.
    pub metric: Option<CloudMetric>,
    /// First guess, 4 x 4, row by row; null is the identity.
    pub init_T_target_source: Option<[f64; 16]>,
    /// Clouds in space: where to start.
    pub init: RegistrationInit,
    /// Clouds in space: how the source may move from the guess, or in the target's frame where there is none.
    pub motion: Motion,
    /// Clouds in space: side of the cubes that each are thinned to one point (m); 0: all points are used, and a global
    /// registration chooses a size by itself.
    pub voxel_size: f64,
    /// `vgicp`: side of the target's voxels (m); 0 is `max_correspondence_distance`.
    pub gaussian_voxel_size: f64,
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
            init: RegistrationInit::Guess,
            motion: Motion::Free,
            voxel_size: 0.0,
            gaussian_voxel_size: 0.0,
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
    let mut result = if planar {
        let (source, target) = (Near::new(source, target.origin), Near::new(target, target.origin));
        register_planar(&source, &target, &guess, options)?
    } else {
        register_spatial(source, target, guess, options)?
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

    /// Its normals, or those that its points tell of.
    fn known_or_estimated_normals(&self) -> Vec<Option<Vector3<f64>>> {
        self.normals.clone().unwrap_or_else(|| {
            let points: Vec<Vec3> = self.points.iter().map(|p| DVec3::from(<[f64; 3]>::from(*p)).as_vec3()).collect();
            let tree = KdTree::build(bytemuck::cast_slice(&points));
            estimate_normals(&points, &tree, NORMAL_NEIGHBORS, DVec3::ZERO)
        })
    }

    fn as_source(&self) -> Source<'_, Vector3<f64>> {
        Source { points: &self.points, normals: self.normals.as_deref(), sigmas: None }
    }
}

/// Points that make a normal.
const NORMAL_NEIGHBORS: Neighbourhood = Neighbourhood { max_neighbors: 20, radius: f64::INFINITY };

fn register_planar(
    source: &Near,
    target: &Near,
    guess: &Pose3,
    options: &RegistrationOptions,
) -> Result<RegistrationResult> {
    let [source, target] = [source, target].map(|near| PlanarScan::new(near.points.iter().map(Vector3::xy).collect()));
    let rotation = guess.rotation.to_rotation_matrix().matrix().fixed_view::<2, 2>(0, 0).into_owned();
    let mut guess = <Pose2 as RigidMotion>::from_parts(&rotation, &guess.translation.vector.xy());
    if options.search_translation > 0.0 || options.search_rotation > 0.0 {
        let window = SearchWindow { translation: options.search_translation, rotation: options.search_rotation };
        let found = LikelihoodGrid::new(&target.points).search(&source.points, &guess, window);
        guess = found.map_or(guess, |found| found.T_target_source);
    }
    let icp = icp_options(options);
    let points = Source { points: &source.points, normals: Some(&source.normals), sigmas: None };
    let registration = match options.metric.unwrap_or(CloudMetric::PointToLine) {
        CloudMetric::PointToPoint => register(points, &PointTarget::new(target.points), guess, &PointToPoint, &icp),
        CloudMetric::PointToLine => {
            let target = OrientedTarget::new(target.points, target.normals);
            register(points, &target, guess, &PointToPlane, &icp)
        }
        CloudMetric::PointToPlane | CloudMetric::Gicp | CloudMetric::Vgicp => {
            let problem = "point_to_plane, gicp and vgicp do not fit planar clouds: all their points lie in one plane";
            return Err(Error::whole(problem, "Use point_to_line"));
        }
    };
    Ok(result(&registration, &in_space(&registration.T_target_source)))
}

fn register_spatial(
    source: &PointCloud,
    target: &PointCloud,
    mut guess: Pose3,
    options: &RegistrationOptions,
) -> Result<RegistrationResult> {
    let [source, target] = [thinned(source, options)?, thinned(target, options)?];
    if options.init == RegistrationInit::Global {
        guess = options.motion.nearest(&without_a_guess(&source, &target, options)?);
    }
    let metric = options.metric.unwrap_or(match target.normals {
        Some(_) => CloudMetric::PointToPlane,
        None => CloudMetric::PointToPoint,
    });
    let (icp, solver) = (icp_options(options), options.motion.solver());
    let (mut source, target) = (Near::new(&source, target.origin), Near::new(&target, target.origin));
    if metric == CloudMetric::PointToLine {
        let problem = "point_to_line is for planar clouds, and these are clouds in space";
        return Err(Error::whole(problem, "Use point_to_plane or point_to_point"));
    }
    if metric == CloudMetric::PointToPoint {
        let target = PointTarget::new(target.points);
        let registration = register_with(source.as_source(), &target, guess, &PointToPoint, &icp, &solver);
        return Ok(result(&registration, &registration.T_target_source));
    }
    let normals = target.known_or_estimated_normals();
    if normals.iter().all(Option::is_none) {
        let problem = "The metric needs normals, and the target has none, nor do its points span a surface";
        return Err(Error::whole(problem, "Give a target with normals (nx, ny, nz) or use point_to_point"));
    }
    if metric != CloudMetric::PointToPlane {
        source.normals = Some(source.known_or_estimated_normals());
    }
    let source = source.as_source();
    let registration = if metric == CloudMetric::Vgicp {
        let target = GaussianVoxels::new(&target.points, &normals, gaussian_voxel_size(options)?);
        register_with(source, &target, guess, &PlaneToVoxel, &icp, &solver)
    } else {
        let metric = if metric == CloudMetric::Gicp { SpatialMetric::Gicp } else { SpatialMetric::PointToPlane };
        let target = OrientedTarget::new(target.points, normals);
        register_in_space(metric, source, &target, guess, (&icp, &[]), &solver)
    };
    Ok(result(&registration, &registration.T_target_source))
}

/// The side of the voxels that `vgicp` registers to (m).
fn gaussian_voxel_size(options: &RegistrationOptions) -> Result<f64> {
    let size = options.gaussian_voxel_size;
    let size = if size == 0.0 { options.max_correspondence_distance } else { size };
    if size > 0.0 && size.is_finite() {
        return Ok(size);
    }
    Err(Error::whole(format!("Voxels of {size} m hold no points"), "Give a positive gaussian_voxel_size"))
}

/// The cloud with one point a voxel, or all of it.
fn thinned<'a>(cloud: &'a PointCloud, options: &RegistrationOptions) -> Result<Cow<'a, PointCloud>> {
    if options.voxel_size == 0.0 {
        return Ok(Cow::Borrowed(cloud));
    }
    Ok(Cow::Owned(voxel_downsample(cloud, options.voxel_size)?))
}

/// Points of a cloud that are enough for a global registration.
const GLOBAL_POINTS: f64 = 6000.0;
/// The size of voxels that leave about so many points is looked for so often.
const SIZE_TRIES: usize = 4;

/// The motion from `source` to `target` relative to the target's origin, whatever it is.
fn without_a_guess(source: &PointCloud, target: &PointCloud, options: &RegistrationOptions) -> Result<Pose3> {
    let voxel_size = if options.voxel_size > 0.0 { options.voxel_size } else { telling_voxel_size(target)? };
    let describe = |cloud: &PointCloud| -> Result<(DescribedCloud, KdTree<3>)> {
        let cloud = voxel_downsample(cloud, voxel_size)?;
        let tree = KdTree::build(bytemuck::cast_slice(&cloud.positions));
        // Features need normals that all face the same way: those of files may not.
        let normals = estimate_normals(&cloud.positions, &tree, NORMAL_NEIGHBORS, DVec3::ZERO);
        let around = Neighbourhood { max_neighbors: 100, radius: FEATURE_RADIUS * voxel_size };
        Ok((DescribedCloud::new(&cloud.positions, &normals, &tree, around), tree))
    };
    let ((described_source, _), (described_target, tree)) = (describe(source)?, describe(target)?);
    let max_distance = GLOBAL_DISTANCE * voxel_size;
    let method = GlobalMethod::Consistency;
    let found = register_globally(&described_source, &described_target, &tree, method, max_distance)?;
    let shift = source.origin - target.origin;
    Ok(found.consensus.T_target_source * Translation3::new(shift.x, shift.y, shift.z).inverse())
}

/// Voxels within which a feature is made and ...
const FEATURE_RADIUS: f64 = 5.0;
/// ... to within which matches speak for a motion.
const GLOBAL_DISTANCE: f64 = 1.5;

/// A side of voxels (m) that leaves about [`GLOBAL_POINTS`] points.
fn telling_voxel_size(cloud: &PointCloud) -> Result<f64> {
    let finite = || cloud.positions.iter().copied().filter(|p| p.is_finite());
    let (low, high) = (finite().reduce(Vec3::min).unwrap_or_default(), finite().reduce(Vec3::max).unwrap_or_default());
    let mut size = f64::from((high - low).max_element()) / 100.0;
    if size <= 0.0 {
        let problem = "All points of the target are one: nothing looks like anything";
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
    Ok(<Pose3 as RigidMotion>::from_parts(&R, &matrix.fixed_view::<3, 1>(0, 3).into_owned()))
}
