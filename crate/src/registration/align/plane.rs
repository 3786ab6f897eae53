//! Two scans in the plane.

use std::rc::Rc;

use nalgebra::Vector2;

use super::{CloudMetric, RegistrationOptions};
use crate::error::{Error, Result};
use crate::geometry::Pose2;
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::correlative::{LikelihoodGrid, SearchWindow};
use crate::registration::factors::{Factor, PointToPlane, PointToPoint};
use crate::registration::icp::IcpOptions;
use crate::registration::problem::{IcpProblem, Problem};
use crate::registration::solver::Solver;
use crate::registration::target::{OrientedTarget, PointTarget, TabledTarget, Target};
use crate::search::NearestTable;

/// Prepares two scans, with the guess, or the best pose around it where the options request a search.
pub(super) fn prepare(
    source: &PlanarScan,
    target: &PlanarScan,
    mut guess: Pose2,
    options: &RegistrationOptions,
    table: Option<&Rc<NearestTable>>,
) -> Result<(Box<dyn IcpProblem<Pose2>>, Pose2)> {
    options.check_kernel()?;
    let window =
        SearchWindow { translation: options.search_translation, rotation: options.search_rotation }.checked()?;
    if window.translation > 0.0 || window.rotation > 0.0 {
        let found = LikelihoodGrid::new(&target.points).search(&source.points, &guess, window);
        guess = found.map_or(guess, |found| found.T_target_source);
    }
    let metric = options.metric.unwrap_or(CloudMetric::PointToLine);
    let solver = options.solver(Solver::default(), metric)?;
    let (points, normals) = (target.points.clone(), target.normals.clone());
    let (icp, num_target) = (options.icp_options(), points.len());
    let problem: Box<dyn IcpProblem<Pose2>> = match (metric, table) {
        (CloudMetric::PointToPoint, None) => {
            problem(source, (PointTarget::new(points), num_target), PointToPoint, icp, solver)
        }
        (CloudMetric::PointToPoint, Some(table)) => {
            let target = TabledTarget::new(PointTarget::new(points), table.clone());
            problem(source, (target, num_target), PointToPoint, icp, solver)
        }
        (CloudMetric::PointToLine, None) => {
            problem(source, (OrientedTarget::new(points, normals), num_target), PointToPlane, icp, solver)
        }
        (CloudMetric::PointToLine, Some(table)) => {
            let target = TabledTarget::new(OrientedTarget::new(points, normals), table.clone());
            problem(source, (target, num_target), PointToPlane, icp, solver)
        }
        (CloudMetric::PointToPlane | CloudMetric::Gicp | CloudMetric::Vgicp, _) => {
            let problem = "point_to_plane, gicp and vgicp do not fit planar clouds: all their points lie in one plane";
            return Err(Error::whole(problem, "Use point_to_line"));
        }
    };
    Ok((problem, guess))
}

fn problem<T, F>(
    source: &PlanarScan,
    (target, num_target): (T, usize),
    factor: F,
    options: IcpOptions,
    solver: Solver<Pose2>,
) -> Box<dyn IcpProblem<Pose2>>
where
    T: Target<Point = Vector2<f64>> + Clone + 'static,
    F: Factor<Pose2, T> + Clone + 'static,
{
    let (points, normals) = (source.points.clone(), Some(source.normals.clone()));
    Box::new(Problem { points, normals, target, num_target, factor, options, solver })
}
