//! Two clouds in space.

use std::borrow::Cow;

use glam::{DVec3, Vec3};
use nalgebra::{Translation3, Vector2, Vector3};

use super::without_guess::without_a_guess;
use super::{CloudMetric, RegistrationInit, RegistrationOptions};
use crate::error::{Error, Result};
use crate::geometry::{PointCloud, Pose3};
use crate::preprocess::estimate_normals::{NORMAL_NEIGHBORS, estimate_normals};
use crate::preprocess::planar_scan::PlanarScan;
use crate::preprocess::voxel_downsample::voxel_downsample;
use crate::registration::factors::{Factor, PlaneToPlane, PointToPlane, PointToPoint};
use crate::registration::problem::{IcpProblem, Problem};
use crate::registration::solver::Solver;
use crate::registration::target::{OrientedTarget, PointTarget, Target};
use crate::registration::voxelized::{GaussianVoxels, PlaneToVoxel};
use crate::search::KdTree;

/// Prepares two clouds and the guess, relative to the target's origin.
pub(super) fn prepare(
    source: &PointCloud,
    target: &PointCloud,
    mut guess: Pose3,
    options: &RegistrationOptions,
) -> Result<(Box<dyn IcpProblem<Pose3>>, Pose3)> {
    options.check_kernel()?;
    let metric = options.metric.unwrap_or(match target.normals {
        Some(_) => CloudMetric::PointToPlane,
        None => CloudMetric::PointToPoint,
    });
    let solver = options.solver(options.motion.solver(), metric)?;
    if metric == CloudMetric::PointToLine {
        let problem = "point_to_line is for planar clouds, and these are clouds in space";
        return Err(Error::whole(problem, "Use point_to_plane or point_to_point"));
    }
    let gaussian_voxel_size = if metric == CloudMetric::Vgicp { Some(gaussian_voxel_size(options)?) } else { None };
    let [source, target] = [thinned(source, options)?, thinned(target, options)?];
    if options.init == RegistrationInit::Global {
        guess = options.motion.nearest(&without_a_guess(&source, &target, options)?);
    }
    let (mut source, target) = (RelativeCloud::new(&source, target.origin), RelativeCloud::new(&target, target.origin));
    if metric == CloudMetric::PointToPoint {
        let (num_target, target) = (target.points.len(), PointTarget::new(target.points));
        return Ok((problem(source, (target, num_target), PointToPoint, options, &solver), guess));
    }
    let (normals, num_target) = (target.known_or_estimated_normals(), target.points.len());
    if normals.iter().all(Option::is_none) {
        let problem = "The metric needs normals, and the target has none, nor do its points span a surface";
        return Err(Error::whole(problem, "Give a target with normals (nx, ny, nz) or use point_to_point"));
    }
    if metric != CloudMetric::PointToPlane {
        source.normals = Some(source.known_or_estimated_normals());
    }
    if let Some(size) = gaussian_voxel_size {
        let target = GaussianVoxels::new(&target.points, &normals, size);
        let num_target = target.len();
        return Ok((problem(source, (target, num_target), PlaneToVoxel, options, &solver), guess));
    }
    let target = (OrientedTarget::new(target.points, normals), num_target);
    let problem = match metric {
        CloudMetric::Gicp => problem(source, target, PlaneToPlane, options, &solver),
        _ => problem(source, target, PointToPlane, options, &solver),
    };
    Ok((problem, guess))
}

fn problem<T, F>(
    source: RelativeCloud,
    (target, num_target): (T, usize),
    factor: F,
    options: &RegistrationOptions,
    solver: &Solver<Pose3>,
) -> Box<dyn IcpProblem<Pose3>>
where
    T: Target<Point = Vector3<f64>> + Clone + 'static,
    F: Factor<Pose3, T> + Clone + 'static,
{
    let (points, normals) = (source.points, source.normals);
    Box::new(Problem { points, normals, target, num_target, factor, options: options.icp_options(), solver: *solver })
}

/// Smallest length of the x and y part of a planar cloud's normal that lies in the plane. Other normals were estimated as if the
/// points were a floor.
const MIN_IN_PLANE: f64 = 0.5;

/// The side of the voxels that `vgicp` registers to (m).
fn gaussian_voxel_size(options: &RegistrationOptions) -> Result<f64> {
    let size = options.gaussian_voxel_size;
    let size = if size == 0.0 { options.max_correspondence_distance } else { size };
    if size > 0.0 && size.is_finite() {
        return Ok(size);
    }
    let problem = format!("gaussian_voxel_size = {size} m is not positive and finite");
    Err(Error::whole(problem, "Give a positive gaussian_voxel_size"))
}

/// The downsampled cloud, or the whole cloud where `voxel_size` is 0.
fn thinned<'a>(cloud: &'a PointCloud, options: &RegistrationOptions) -> Result<Cow<'a, PointCloud>> {
    if options.voxel_size == 0.0 {
        return Ok(Cow::Borrowed(cloud));
    }
    Ok(Cow::Owned(voxel_downsample(cloud, options.voxel_size)?))
}

/// The translation from coordinates relative to the cloud's origin to the cloud's frame.
pub(super) fn origin_of(cloud: &PointCloud) -> Translation3<f64> {
    Translation3::new(cloud.origin.x, cloud.origin.y, cloud.origin.z)
}

/// The finite points of a cloud relative to an origin (m), in double precision, with their normals.
pub(super) struct RelativeCloud {
    points: Vec<Vector3<f64>>,
    normals: Option<Vec<Option<Vector3<f64>>>>,
}

impl RelativeCloud {
    pub(super) fn new(cloud: &PointCloud, origin: DVec3) -> Self {
        let shift = cloud.origin - origin;
        let points = cloud.finite_points().map(|(_, p)| Vector3::from((p + shift).to_array())).collect();
        let normal = |n: Vec3| n.is_finite().then(|| Vector3::from(n.as_dvec3().to_array()));
        let of_finite = |normals: &Vec<Vec3>| cloud.finite_points().map(|(index, _)| normal(normals[index])).collect();
        let normals = cloud.normals.as_ref().map(of_finite);
        Self { points, normals }
    }

    /// A planar cloud as a scan: with its own normals where they lie in the plane, otherwise with normals from adjacent beams.
    pub(super) fn scan(&self) -> PlanarScan {
        let points: Vec<Vector2<f64>> = self.points.iter().map(Vector3::xy).collect();
        let in_plane = |n: &Vector3<f64>| n.xy().try_normalize(MIN_IN_PLANE);
        let normals = self.normals.iter().flatten().map(|normal| normal.as_ref().and_then(in_plane));
        let normals: Vec<_> = normals.collect();
        if normals.iter().any(Option::is_some) { PlanarScan { points, normals } } else { PlanarScan::new(points) }
    }

    /// Its normals, or normals estimated from its points.
    fn known_or_estimated_normals(&self) -> Vec<Option<Vector3<f64>>> {
        self.normals.clone().unwrap_or_else(|| {
            let points: Vec<Vec3> = self.points.iter().map(|p| DVec3::from(<[f64; 3]>::from(*p)).as_vec3()).collect();
            let tree = KdTree::build(bytemuck::cast_slice(&points));
            estimate_normals(&points, &tree, NORMAL_NEIGHBORS, DVec3::ZERO)
        })
    }
}
