//! The registration of two clouds in plain data, which crosses to JavaScript and into files.

use serde::Serialize;

use super::RegistrationOptions;
use super::clouds::{CloudProblem, PreparedClouds};
use crate::error::Result;
use crate::geometry::{PointCloud, SquareMatrix, Vector};
use crate::registration::icp::{EndReason, IterationRecord, Registration};
use crate::registration::lab::iteration::TracedIteration;
use crate::registration::lab::motion::LabMotion;
use crate::registration::problem::IcpProblem;

/// A registration with its evidence, as plain data.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct RegistrationResult {
    /// Maps source points into the target's frame: 4 x 4, row by row.
    pub T_target_source: [f64; 16],
    /// Whether the last step was below both limits. `false` is not an error: see the history.
    pub converged: bool,
    /// Why the loop ended.
    pub end_reason: EndReason,
    /// Number of iterations.
    pub iterations: usize,
    /// Pairs within the distance limit, in the last iteration.
    pub num_correspondences: usize,
    /// Pairs left after the rejection by normals and the trimming.
    pub num_inliers: usize,
    /// Number of inliers divided by the number of source points, 0..=1.
    pub fitness: f64,
    /// Root mean square of the inliers' residuals (m).
    pub inlier_rmse: f64,
    /// Information matrix of a perturbation on the left of `T_target_source` (1/rad^2, 1/m^2), row by row: 3 x 3 over
    /// (theta, x, y) for planar clouds, 6 x 6 over (wx, wy, wz, x, y, z) otherwise.
    pub information: Vec<f64>,
    /// The direction of motion that the points do not determine, in the order of `information`, or null.
    pub undetermined: Option<Vec<f64>>,
    /// A record of every iteration.
    pub history: Vec<IterationRecord>,
    /// Every iteration with its pairs and equations, where the option `trace` asks for it; null otherwise.
    pub trace: Option<Vec<TracedIteration>>,
}

/// Registers `source` to `target`. Two planar clouds (z = 0) are registered in the plane.
///
/// # Errors
/// When a cloud has no finite point, when only one of them is planar, when the metric does not fit the clouds, or when the
/// guess is not a rigid motion.
pub fn register_clouds(
    source: &PointCloud,
    target: &PointCloud,
    options: &RegistrationOptions,
) -> Result<RegistrationResult> {
    let clouds = PreparedClouds::new(source, target, options)?;
    match &clouds.problem {
        CloudProblem::Plane(problem, guess) => result(&clouds, problem.as_ref(), guess, options.trace),
        CloudProblem::Space(problem, guess) => result(&clouds, problem.as_ref(), guess, options.trace),
    }
}

fn result<M: LabMotion>(
    clouds: &PreparedClouds,
    problem: &dyn IcpProblem<M>,
    guess: &M,
    with_trace: bool,
) -> Result<RegistrationResult> {
    let registration = problem.register(*guess);
    let to_absolute = |pose: &M| clouds.to_absolute(&pose.in_space());
    let trace = with_trace.then(|| trace(&registration, problem, &to_absolute)).transpose()?;
    let Registration { last, observability, .. } = &registration;
    let weakest = observability.weakest_direction.as_slice().to_vec();
    Ok(RegistrationResult {
        T_target_source: to_absolute(&registration.T_target_source)?,
        converged: registration.converged,
        end_reason: registration.end_reason,
        iterations: registration.history.len(),
        num_correspondences: last.num_correspondences,
        num_inliers: last.num_inliers,
        fitness: registration.fitness,
        inlier_rmse: last.inlier_rmse,
        information: registration.information.as_slice().to_vec(), // symmetric: rows are columns
        undetermined: observability.is_undetermined().then_some(weakest),
        history: registration.history,
        trace,
    })
}

/// Every iteration, repeated from the poses of the loop.
fn trace<M: LabMotion>(
    registration: &Registration<M>,
    problem: &dyn IcpProblem<M>,
    to_absolute: &impl Fn(&M) -> Result<[f64; 16]>,
) -> Result<Vec<TracedIteration>> {
    let before = registration.trace.iter().take(registration.history.len());
    before.map(|pose| TracedIteration::of(&problem.iteration(pose, 1), problem, to_absolute)).collect()
}
