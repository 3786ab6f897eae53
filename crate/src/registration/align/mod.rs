//! Registration of two clouds, in the plane or in space: the entry point of the crate.
//!
//! [`align`] takes two [`PlanarScan`]s or two [`PointCloud`]s and gives a [`Registration`] with its evidence.
//! [`register_clouds`] does the same for clouds of either kind as files hold them, in plain data.

pub mod clouds;
mod plain;
mod plane;
mod space;
mod without_guess;

use nalgebra::{Matrix3, Matrix4};
use serde::{Deserialize, Serialize};

pub use self::plain::{RegistrationResult, register_clouds};
use crate::error::{Error, Result};
use crate::geometry::rotation::{ROTATION_TOLERANCE, nearest_rotation, rotation_defect};
use crate::geometry::{Embedding, PointCloud, Pose2, Pose3, RigidMotion};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::icp::{Criteria, IcpOptions, Registration, Rejection, Weighting};
use crate::registration::robust_kernel::RobustKernel;
use crate::registration::solver::{Motion, Solver};

/// Registers `source` to `target`: two [`PlanarScan`]s in the plane, two [`PointCloud`]s in space.
///
/// A registration that does not converge is not an error: see [`Registration::converged`] and its history.
///
/// In the plane, a room of four by three metres seen from two places:
///
/// ```
/// use nalgebra::{Vector2, Vector3};
/// use scanstitch::geometry::{Pose2, RigidMotion};
/// use scanstitch::preprocess::planar_scan::PlanarScan;
/// use scanstitch::registration::{RegistrationOptions, align};
///
/// // A laser's returns, one a degree: rays from `sensor` to the walls.
/// let scan = |sensor: &Pose2| {
///     let ray = |degree: i32| {
///         let angle = f64::from(degree).to_radians();
///         let (origin, way) = (sensor.translation.vector, sensor.rotate(&Vector2::new(angle.cos(), angle.sin())));
///         let to = |half: f64, at: f64, along: f64| (half.copysign(along) - at) / along;
///         let range = to(2.0, origin.x, way.x).min(to(1.5, origin.y, way.y));
///         Vector2::new(angle.cos(), angle.sin()) * range
///     };
///     PlanarScan::new((0..360).map(ray).collect())
/// };
/// let expected = Pose2::exp(&Vector3::new(0.05, 0.2, -0.1)); // rotation (rad), x and y (m)
/// let (target, source) = (scan(&Pose2::identity()), scan(&expected));
///
/// let registration = align(&source, &target, &RegistrationOptions::default())?;
/// assert!(registration.converged);
/// let error = expected.inverse() * registration.T_target_source;
/// assert!(error.translation_norm() < 1e-3 && error.rotation_angle() < 1e-3);
/// # Ok::<(), scanstitch::Error>(())
/// ```
///
/// In space, with the corner of a room:
///
/// ```
/// use glam::Vec3;
/// use nalgebra::{Vector3, Vector6};
/// use scanstitch::geometry::{PointCloud, Pose3, RigidMotion};
/// use scanstitch::registration::{CloudMetric, RegistrationOptions, align};
///
/// // A floor and two walls, a point every ten centimetres.
/// let cells = (0..20).flat_map(|i| (0..20).map(move |j| (0.1 * f64::from(i), 0.1 * f64::from(j))));
/// let corner: Vec<_> = cells
///     .flat_map(|(a, b)| [Vector3::new(a, b, 0.0), Vector3::new(a, 0.0, b), Vector3::new(0.0, a, b)])
///     .collect();
/// let cloud = |points: &mut dyn Iterator<Item = Vector3<f64>>| {
///     PointCloud::from_positions(points.map(|p| Vec3::new(p.x as f32, p.y as f32, p.z as f32)).collect())
/// };
/// let expected = Pose3::exp(&Vector6::new(0.02, -0.03, 0.05, 0.1, 0.05, -0.1));
/// let target = cloud(&mut corner.iter().copied());
/// let source = cloud(&mut corner.iter().map(|p| expected.inverse().act(p)));
///
/// let options = RegistrationOptions { metric: Some(CloudMetric::PointToPlane), ..RegistrationOptions::default() };
/// let registration = align(&source, &target, &options)?;
/// let error = expected.inverse() * registration.T_target_source;
/// assert!(registration.converged && error.translation_norm() < 1e-3);
/// # Ok::<(), scanstitch::Error>(())
/// ```
///
/// # Errors
/// When a cloud has no finite point, the metric does not fit the clouds, or the guess is not a rigid motion.
pub fn align<C: Alignable>(source: &C, target: &C, options: &RegistrationOptions) -> Result<Registration<C::Motion>> {
    source.align_to(target, options)
}

/// A cloud that [`align`] can register.
pub trait Alignable {
    /// Its rigid motions.
    type Motion: RigidMotion;

    /// Registers this cloud to another one; see [`align`].
    ///
    /// # Errors
    /// As [`align`].
    fn align_to(&self, target: &Self, options: &RegistrationOptions) -> Result<Registration<Self::Motion>>;
}

impl Alignable for PlanarScan {
    type Motion = Pose2;

    fn align_to(&self, target: &Self, options: &RegistrationOptions) -> Result<Registration<Pose2>> {
        for (scan, role) in [(self, "source"), (target, "target")] {
            check_points(role, scan.points.iter().any(|p| p.iter().all(|x| x.is_finite())))?;
        }
        let (problem, guess) = plane::prepare(self, target, Pose2::from_space(&options.guess()?), options, None)?;
        Ok(problem.register(guess))
    }
}

impl Alignable for PointCloud {
    type Motion = Pose3;

    fn align_to(&self, target: &Self, options: &RegistrationOptions) -> Result<Registration<Pose3>> {
        for (cloud, role) in [(self, "source"), (target, "target")] {
            check_points(role, cloud.positions.iter().any(|p| p.is_finite()))?;
        }
        if self.is_planar() || target.is_planar() {
            let problem = "A cloud is planar: all its points lie in z = 0, which fixes no motion in space";
            return Err(Error::whole(problem, "Give two PlanarScans, or use register_clouds"));
        }
        // Both clouds relative to the target's origin, which may be far away: T = shift * T_relative * shift^-1.
        let origin = space::origin_of(target);
        let guess = origin.inverse() * options.guess()? * origin;
        let (problem, guess) = space::prepare(self, target, guess, options)?;
        let mut registration = problem.register(guess);
        registration.T_target_source = origin * registration.T_target_source * origin.inverse();
        Ok(registration)
    }
}

fn check_points(role: &str, has_points: bool) -> Result<()> {
    if has_points {
        return Ok(());
    }
    Err(Error::whole(format!("The {role} has no finite point"), "Give a cloud with points"))
}

/// The distance that a correspondence measures.
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
    /// As `gicp`, but the partner of a point is the voxel that it lies in: voxelised GICP. It is faster and as coarse as
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
    /// Clouds in space: at the result of a global registration by features, which needs no guess. With `max_iterations` 0 it is
    /// the result.
    Global,
}

/// How the next step is computed from the pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum StepMethod {
    /// The best motion for the weighted pairs in closed form, by a singular value decomposition (Umeyama 1991); only for point to
    /// point.
    ClosedForm,
    /// One Gauss-Newton step: the solution of the normal equations.
    GaussNewton,
}

/// Options of [`align`] and [`register_clouds`]. They are flat, as in the JSON of the npm package and of the command line;
/// [`icp_options`](Self::icp_options) returns those of the loop in the nested form that
/// [`icp::register`](super::icp::register) takes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct RegistrationOptions {
    /// Null: point to line for planar clouds, point to plane where the target's file has normals, point to point otherwise.
    pub metric: Option<CloudMetric>,
    /// Initial guess, 4 x 4, row by row; null is the identity.
    pub init_T_target_source: Option<[f64; 16]>,
    /// Clouds in space: where the registration starts.
    pub init: RegistrationInit,
    /// Clouds in space: degrees of freedom of the motion from the guess, or in the target's frame where there is none.
    pub motion: Motion,
    /// How the next step is computed; null: in closed form for `point_to_point` with `motion` free, by Gauss-Newton otherwise.
    pub step: Option<StepMethod>,
    /// Clouds in space: voxel size to which both are downsampled (m); 0: all points are used, and a global registration
    /// chooses its own voxel size.
    pub voxel_size: f64,
    /// `vgicp`: side of the target's voxels (m); 0 is `max_correspondence_distance`.
    pub gaussian_voxel_size: f64,
    /// Planar clouds: half width of a search around the guess in x and y (m); there is no search where `search_rotation` is 0, too.
    pub search_translation: f64,
    /// Planar clouds: half width of the search in heading (rad).
    pub search_rotation: f64,
    /// Largest distance of a pair (m).
    pub max_correspondence_distance: f64,
    /// Largest angle between the normals of a pair (rad).
    pub max_normal_angle: f64,
    /// Share of the correspondences, those with the largest residuals, that is dropped, in [0, 1).
    pub trim_fraction: f64,
    /// Robust kernel that weights the residuals.
    pub robust_kernel: RobustKernel,
    /// Width of the robust kernel (m).
    pub robust_kernel_width: f64,
    /// Most iterations.
    pub max_iterations: usize,
    /// Rotation of a step below which the loop has converged (rad), if its translation is below `translation_eps`.
    pub rotation_eps: f64,
    /// Translation of a step below which the loop has converged (m), if its rotation is below `rotation_eps`.
    pub translation_eps: f64,
    /// [`register_clouds`]: whether the result holds every iteration with its pairs and equations.
    pub trace: bool,
}

impl Default for RegistrationOptions {
    fn default() -> Self {
        let IcpOptions { rejection, weighting, criteria } = IcpOptions::default();
        Self {
            metric: None,
            init_T_target_source: None,
            init: RegistrationInit::Guess,
            motion: Motion::Free,
            step: None,
            voxel_size: 0.0,
            gaussian_voxel_size: 0.0,
            search_translation: 0.0,
            search_rotation: 0.0,
            max_correspondence_distance: rejection.max_correspondence_distance,
            max_normal_angle: rejection.max_normal_angle,
            trim_fraction: rejection.trim_fraction,
            robust_kernel: weighting.robust_kernel,
            robust_kernel_width: weighting.robust_kernel_width,
            max_iterations: criteria.max_iterations,
            rotation_eps: criteria.rotation_eps,
            translation_eps: criteria.translation_eps,
            trace: false,
        }
    }
}

impl RegistrationOptions {
    /// The same options with this initial guess: a [`Pose3`], or a [`Pose2`] for scans in the plane.
    #[must_use]
    pub fn starting_at(self, init_T_target_source: &impl Embedding) -> Self {
        Self { init_T_target_source: Some(row_major(&init_T_target_source.in_space())), ..self }
    }

    /// The options of the registration loop.
    pub fn icp_options(&self) -> IcpOptions {
        IcpOptions {
            rejection: Rejection {
                max_correspondence_distance: self.max_correspondence_distance,
                max_normal_angle: self.max_normal_angle,
                trim_fraction: self.trim_fraction,
            },
            weighting: Weighting { robust_kernel: self.robust_kernel, robust_kernel_width: self.robust_kernel_width },
            criteria: Criteria {
                max_iterations: self.max_iterations,
                rotation_eps: self.rotation_eps,
                translation_eps: self.translation_eps,
            },
        }
    }

    /// The solver of a metric: its default one unless `step` selects another.
    fn solver<M: RigidMotion>(&self, own: Solver<M>, metric: CloudMetric) -> Result<Solver<M>> {
        let has_closed_form = metric == CloudMetric::PointToPoint && own.subspace.is_none();
        match self.step {
            Some(StepMethod::ClosedForm) if !has_closed_form => Err(Error::whole(
                "step closed_form is for point_to_point with motion free: nothing else has a solution in closed form",
                "Use gauss_newton",
            )),
            Some(StepMethod::GaussNewton) if has_closed_form => Ok(Solver::gauss_newton()),
            _ => Ok(own),
        }
    }

    fn guess(&self) -> Result<Pose3> {
        let parsed = |rows: &_| pose_from("init_T_target_source", rows);
        self.init_T_target_source.as_ref().map_or(Ok(Pose3::identity()), parsed)
    }

    /// Refuses a robust kernel without a width, which would divide by it.
    fn check_kernel(&self) -> Result<()> {
        let width = self.robust_kernel_width;
        if self.robust_kernel == RobustKernel::None || width > 0.0 {
            return Ok(());
        }
        Err(Error::whole(
            format!("robust_kernel_width = {width} m is not positive"),
            "Give a positive width (m), or robust_kernel none",
        ))
    }
}

pub(crate) fn row_major(pose: &Pose3) -> [f64; 16] {
    let mut rows = [0.0; 16];
    rows.copy_from_slice(pose.to_homogeneous().transpose().as_slice());
    rows
}

/// A pose from the matrix of a field or argument, by its `name` in errors.
fn pose_from(name: &str, rows: &[f64; 16]) -> Result<Pose3> {
    let matrix = Matrix4::from_row_slice(rows);
    let R: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    let rotation = nearest_rotation(&R).filter(|_| rotation_defect(&R) <= ROTATION_TOLERANCE);
    let bottom_is_right = matrix.row(3).iter().copied().eq([0.0, 0.0, 0.0, 1.0]);
    let is_finite = rows.iter().all(|value| value.is_finite());
    let rotation = rotation.filter(|_| bottom_is_right && is_finite).ok_or_else(|| {
        Error::whole(
            format!("{name} is not a rigid motion"),
            "Give 16 numbers row by row, a rotation matrix and a translation, the last row 0 0 0 1",
        )
    })?;
    Ok(Pose3::from_parts(matrix.fixed_view::<3, 1>(0, 3).into_owned().into(), rotation))
}
