//! The focal length with which two depth images of one camera fit each other best.
//!
//! A wrong focal length bends what each image shows: surfaces that were seen at the image's border in one view and in its middle
//! in the other do not fit then. The ratio of the focal lengths is the seventh unknown of a point-to-plane registration (self-calibration by
//! bundle adjustment, as in Basso, Menegatti and Pretto, "Robust intrinsic and extrinsic calibration of RGB-D cameras", IEEE
//! Transactions on Robotics 34 (2018), with one parameter).

use std::sync::Arc;

use nalgebra::{Matrix6, Point3, Vector3, Vector6};

use super::factors::{Correspondence, PointToPlane};
use super::icp::{IcpOptions, register_with};
use super::prepared_surfels::{PreparedSurfels, SurfelCloud};
use super::projective::ProjectiveTarget;
use super::solver::Solver;
use super::target::Target;
use crate::camera::{Pinhole, Surfel, SurfelImage};
use crate::geometry::Pose3;

/// What two images say of their camera's focal length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FocalLengthFit {
    /// Logarithm of the focal length that fits best over that of the camera.
    pub log_ratio: f64,
    /// Its variance.
    pub variance: f64,
}

/// Steps of Gauss-Newton; two to four suffice for focal lengths that are off by a fifth.
const MAX_STEPS: usize = 8;
/// The search has ended once the focal length changes by less than this share, and no error is smaller.
const MIN_STEP: f64 = 1e-3;
/// Beyond this factor no images that were registered with one focal length are of the other.
const MAX_FACTOR: f64 = 2.0;
/// Points that must have a partner, as a share of all: fewer are another view's.
const MIN_FITNESS: f64 = 0.3;
/// Squares in a row of the image whose residuals share an error, as those of one wall do.
const CLUSTERS_IN_ROW: usize = 8;

/// Fits the focal length to two images from their relative pose under that of their camera, by registrations that are `rough` at
/// first and `fine` afterwards. `None` where the images do not overlap, or do not tell.
pub(crate) fn fit_focal_length(
    source: &PreparedSurfels,
    target: &PreparedSurfels,
    init_T_target_source: Pose3,
    [rough, fine]: [&IcpOptions; 2],
) -> Option<FocalLengthFit> {
    let mut T_target_source = init_T_target_source;
    let mut log_ratio: f64 = 0.0;
    for number in 0..MAX_STEPS {
        let options = if number == 0 { rough } else { fine };
        let cloud = SurfelCloud::of(source.fine().surfels().map(|surfel| scaled(&surfel, log_ratio.exp())));
        let target = ProjectiveTarget::of_frame(&scaled_image(&target.image, log_ratio.exp()), 1).with_cell_points();
        let fit = register_with(cloud.source(), &target, T_target_source, &PointToPlane, options, &Solver::default());
        if fit.fitness < MIN_FITNESS {
            return None;
        }
        T_target_source = fit.T_target_source;
        let camera = &source.image.camera;
        let step = step(&cloud, &target, &fit.correspondences, &T_target_source, camera)?;
        log_ratio += step.log_ratio;
        if log_ratio.abs() > MAX_FACTOR.ln() {
            return None;
        }
        if step.log_ratio.abs() < MIN_STEP {
            return Some(FocalLengthFit { log_ratio, variance: step.variance.max(MIN_STEP * MIN_STEP) });
        }
    }
    None
}

/// The step of the focal length that Gauss-Newton takes together with the pose: the Schur complement of the pose.
fn step(
    cloud: &SurfelCloud,
    target: &ProjectiveTarget,
    correspondences: &[Correspondence<Vector3<f64>>],
    T_target_source: &Pose3,
    camera: &Pinhole,
) -> Option<FocalLengthFit> {
    let rows: Vec<Row> = correspondences
        .iter()
        .filter_map(|pair| Row::new(pair, &cloud.points[pair.source as usize], target, T_target_source, camera))
        .collect();
    let H: Matrix6<f64> = rows.iter().map(|row| row.weight * row.by_pose * row.by_pose.transpose()).sum();
    let shared: Vector6<f64> = rows.iter().map(|row| row.weight * row.by_focal_length * row.by_pose).sum();
    let along = H.cholesky()?.solve(&shared);
    // What of the focal length's effect no motion imitates.
    let own = |row: &Row| row.by_focal_length - row.by_pose.dot(&along);
    let information: f64 = rows.iter().map(|row| row.weight * own(row).powi(2)).sum();
    let mut clusters = vec![0.0; CLUSTERS_IN_ROW * CLUSTERS_IN_ROW];
    for row in &rows {
        clusters[row.cluster] += row.weight * own(row) * row.residual;
    }
    let gradient: f64 = clusters.iter().sum();
    // The sandwich estimator, see `sandwich_variance`.
    let variance = clusters.iter().map(|cluster| cluster * cluster).sum::<f64>() / (information * information);
    (information > 0.0).then(|| FocalLengthFit { log_ratio: -gradient / information, variance })
}

/// A row of the normal equations.
struct Row {
    residual: f64,
    weight: f64,
    by_pose: Vector6<f64>,
    by_focal_length: f64,
    cluster: usize,
}

impl Row {
    fn new(
        pair: &Correspondence<Vector3<f64>>,
        source: &Vector3<f64>,
        target: &ProjectiveTarget,
        T_target_source: &Pose3,
        camera: &Pinhole,
    ) -> Option<Self> {
        let (point, normal) = (target.point(pair.target), target.normal(pair.target)?);
        let moved = (T_target_source * Point3::from(*source)).coords;
        let (by_pose, by_focal_length) = derivatives(source, T_target_source, &point, &normal);
        Some(Self {
            residual: normal.dot(&(moved - point)),
            weight: pair.weight,
            by_pose,
            by_focal_length,
            cluster: cluster(source, camera),
        })
    }
}

/// Derivatives of the distance of a source point from the plane of its partner: by a small turn and shift in the target's frame, and by
/// the logarithm of the focal length, which moves both points.
fn derivatives(
    source: &Vector3<f64>,
    T_target_source: &Pose3,
    point: &Vector3<f64>,
    normal: &Vector3<f64>,
) -> (Vector6<f64>, f64) {
    let turn = (T_target_source * Point3::from(*source)).coords.cross(normal);
    let widened = T_target_source.rotation * by_log_ratio(source) - by_log_ratio(point);
    (Vector6::new(turn.x, turn.y, turn.z, normal.x, normal.y, normal.z), normal.dot(&widened))
}

/// The square of the image that a point lies in.
fn cluster(point: &Vector3<f64>, camera: &Pinhole) -> usize {
    let share = |place: f64, size: usize| {
        ((place / size as f64 * CLUSTERS_IN_ROW as f64).max(0.0) as usize).min(CLUSTERS_IN_ROW - 1)
    };
    let (u, v) = (camera.fx * point.x / point.z + camera.cx, camera.fy * point.y / point.z + camera.cy);
    share(v, camera.height) * CLUSTERS_IN_ROW + share(u, camera.width)
}

/// Derivative of a point by the logarithm of the focal length: x = (u - cx) z / fx.
fn by_log_ratio(point: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(-point.x, -point.y, 0.0)
}

/// A surfel as it is with a focal length that is `ratio` times as large.
fn scaled(surfel: &Surfel, ratio: f64) -> Surfel {
    let Surfel { point, normal, sigma } = surfel;
    Surfel {
        point: Vector3::new(point.x / ratio, point.y / ratio, point.z),
        normal: Vector3::new(normal.x * ratio, normal.y * ratio, normal.z).normalize(),
        sigma: *sigma,
    }
}

fn scaled_image(image: &SurfelImage, ratio: f64) -> SurfelImage {
    let camera = Pinhole { fx: image.camera.fx * ratio, fy: image.camera.fy * ratio, ..image.camera };
    let cells = image.cells.iter().map(|cell| cell.as_ref().map(|surfel| scaled(surfel, ratio))).collect();
    SurfelImage { camera, cells: Arc::new(cells), ..image.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 1e-6;

    fn surfel(point: Vector3<f64>) -> Surfel {
        Surfel { point, normal: Vector3::new(0.3, -0.5, -0.8).normalize(), sigma: 0.01 }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let (source, target) = (surfel(Vector3::new(0.7, -0.4, 2.1)), surfel(Vector3::new(0.5, -0.2, 2.0)));
        let T_target_source = Pose3::new(Vector3::new(-0.2, 0.1, 0.05), Vector3::new(0.1, -0.3, 0.2));
        let distance = |change: Vector6<f64>, log_ratio: f64| {
            let [source, partner] = [&source, &target].map(|surfel| scaled(surfel, log_ratio.exp()).point);
            let moved =
                Pose3::new(change.fixed_rows::<3>(3).into(), change.fixed_rows::<3>(0).into()) * T_target_source;
            target.normal.dot(&((moved * Point3::from(source)).coords - partner))
        };
        let (by_pose, by_focal_length) = derivatives(&source.point, &T_target_source, &target.point, &target.normal);
        for axis in 0..6 {
            let step = Vector6::from_fn(|row, _| if row == axis { STEP } else { 0.0 });
            let difference = (distance(step, 0.0) - distance(-step, 0.0)) / (2.0 * STEP);
            assert!((difference - by_pose[axis]).abs() < 1e-8, "axis {axis}: {difference} and {}", by_pose[axis]);
        }
        let difference = (distance(Vector6::zeros(), STEP) - distance(Vector6::zeros(), -STEP)) / (2.0 * STEP);
        assert!((difference - by_focal_length).abs() < 1e-8, "{difference} and {by_focal_length}");
    }

    #[test]
    fn a_scaled_surfel_lies_in_the_scaled_plane() {
        let here = surfel(Vector3::new(0.7, -0.4, 2.1));
        let along = here.normal.cross(&Vector3::new(0.2, 0.9, 0.1));
        let there = surfel(here.point + along);
        let [scaled_here, scaled_there] = [&here, &there].map(|surfel| scaled(surfel, 1.2));
        assert!(scaled_here.normal.dot(&(scaled_there.point - scaled_here.point)).abs() < 1e-12);
        assert!(here.normal.dot(&(scaled_there.point - scaled_here.point)).abs() > 1e-3);
    }
}
