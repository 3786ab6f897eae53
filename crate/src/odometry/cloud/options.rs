//! Options of the odometry of clouds.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::geometry::PointCloud;
use crate::preprocess::estimate_normals::NORMAL_NEIGHBORS;
use crate::registration::global::GlobalMethod;
use crate::registration::global::scale::feature_voxel_size;
use crate::registration::icp::{Criteria, IcpOptions, Rejection, Weighting};
use crate::registration::robust_kernel::RobustKernel;
use crate::registration::solver::Motion;
use crate::registration::spatial::SpatialMetric;
use crate::search::Neighborhood;

/// What a cloud is registered to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CloudMethod {
    /// The map of all clouds before it.
    #[default]
    CloudMap,
    /// The last cloud that was found.
    CloudToCloud,
}

/// When clouds are registered globally: by their features, without an initial guess.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum GlobalRegistrationUse {
    /// Where the registration from the last pose and the last motion is not good.
    #[default]
    WhenDoubtful,
    /// For every cloud; no other initial guess is tried.
    Always,
    /// Never.
    Never,
}

/// All options of [`CloudOdometry`](super::CloudOdometry).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudOptions {
    /// What a cloud is registered to.
    pub method: CloudMethod,
    /// Residual of a correspondence.
    pub metric: SpatialMetric,
    /// Degrees of freedom of the sensor. Where it moves in a plane, the y axis of the first cloud is normal to it.
    pub motion: Motion,
    /// When clouds are registered globally.
    pub global_registration: GlobalRegistrationUse,
    /// Method of the global registration.
    pub global_method: GlobalMethod,
    /// Side (m) of the voxels to which clouds are downsampled, one mean point each.
    pub voxel_size: f64,
    /// Largest distance of corresponding points (m) in the last stage.
    pub max_correspondence_distance: f64,
    /// Position of the sensor in its own frame (m): normals are oriented towards it.
    pub viewpoint: DVec3,
    /// Whether free space between the viewpoint and the points is tested: only where the sensor was at the viewpoint.
    pub tests_free_space: bool,
    /// Neighbours from which a normal is estimated.
    pub normals: Neighborhood,
    /// Whether a stage with a larger distance precedes the last one, a robust kernel weights the pairs, and pairs whose
    /// normals differ are rejected. Course pipelines have none of these.
    pub robust: bool,
    /// Most points of a cloud that are registered and become part of the map; the others are for normals, features and free space.
    pub max_points: usize,
    /// Whether points whose neighbours do not clearly lie in a plane have no normal: the rings of a spinning laser need it, a
    /// depth image does not.
    pub clear_normals: bool,
}

/// Radius of the neighbourhoods of normals in courses (voxels), as in Open3D's tutorial.
const COURSE_NORMAL_RADIUS: f64 = 2.0;
/// Largest distance of corresponding points in courses (voxels), as in Open3D's tutorial, ...
const COURSE_DISTANCE: f64 = 0.4;
/// ... and by default (voxels).
const DEFAULT_DISTANCE: f64 = 3.0;
/// Drift that the map must bear, as a share of the path: KISS-ICP's is 0.5 % on KITTI (Vizzo et al. 2023, table II), and that of `cargo measure
/// streets` at most 0.13 %.
const DRIFT: f64 = 0.003;
/// Constant seed of RANSAC: the same clouds give the same motions.
const COURSE_SEED: u64 = 1;

impl Default for CloudOptions {
    /// For rooms: voxels of 5 cm.
    fn default() -> Self {
        Self::new(0.05)
    }
}

impl CloudOptions {
    /// Defaults with voxels of this side (m): 0.05 for rooms, 0.25 for streets.
    pub fn new(voxel_size: f64) -> Self {
        Self {
            method: CloudMethod::CloudMap,
            metric: SpatialMetric::PointToPlane,
            motion: Motion::Free,
            global_registration: GlobalRegistrationUse::WhenDoubtful,
            global_method: GlobalMethod::Consistency,
            voxel_size,
            max_correspondence_distance: DEFAULT_DISTANCE * voxel_size,
            viewpoint: DVec3::ZERO,
            tests_free_space: true,
            normals: NORMAL_NEIGHBORS,
            robust: true,
            max_points: usize::MAX,
            clear_normals: true,
        }
    }

    /// The pipeline taught in courses with Open3D: normals from 30 neighbours within two voxels, FPFH from 100 within five,
    /// RANSAC with three matches, then point-to-plane ICP with correspondences within 0.4 voxels; each cloud to the
    /// previous one.
    pub fn course(voxel_size: f64) -> Self {
        Self {
            method: CloudMethod::CloudToCloud,
            global_registration: GlobalRegistrationUse::Always,
            global_method: GlobalMethod::Ransac { seed: COURSE_SEED },
            max_correspondence_distance: COURSE_DISTANCE * voxel_size,
            normals: Neighborhood { max_neighbors: 30, radius: COURSE_NORMAL_RADIUS * voxel_size },
            robust: false,
            clear_normals: false,
            ..Self::new(voxel_size)
        }
    }

    /// Path (m) after which what is not seen any more is forgotten: drift may then reach the distance of corresponding points, beyond which
    /// a place that is seen again would be mapped twice.
    pub(crate) fn max_age(&self) -> f64 {
        self.max_correspondence_distance / DRIFT
    }

    /// The voxels (m) in which clouds like this one are described for a global registration: courses describe every point.
    pub(super) fn global_voxel_size(&self, first: &PointCloud) -> f64 {
        let feature_size = if self.robust { feature_voxel_size(first).unwrap_or(0.0) } else { 0.0 };
        feature_size.max(self.voxel_size)
    }

    /// Stages that find a motion far from its prediction, before those of [`stages`](Self::stages).
    pub(super) fn wide_stages(&self) -> [IcpOptions; 3] {
        WIDE_DISTANCES.map(|voxels| rough_stage(voxels * self.voxel_size))
    }

    /// The stages of a registration, coarse to fine.
    pub(crate) fn stages(&self) -> (IcpOptions, Vec<IcpOptions>) {
        let distance = self.max_correspondence_distance;
        if !self.robust {
            let plain = IcpOptions {
                rejection: Rejection {
                    max_correspondence_distance: distance,
                    max_normal_angle: std::f64::consts::PI,
                    trim_fraction: 0.0,
                },
                weighting: Weighting { robust_kernel: RobustKernel::None, robust_kernel_width: distance },
                criteria: Criteria { max_iterations: 30, rotation_eps: 1e-6, translation_eps: 1e-6 },
            };
            return (plain, Vec::new());
        }
        let fine = Criteria { max_iterations: 40, rotation_eps: 1e-4, translation_eps: 1e-3 * distance };
        (rough_stage(2.0 * distance), vec![robust_stage(distance, distance / 3.0, fine)])
    }

    pub(super) fn check(&self) -> Result<()> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        if !positive(self.voxel_size) {
            let problem = format!("voxel_size is {} m", self.voxel_size);
            return Err(Error::whole(problem, "Give a positive voxel_size"));
        }
        if !positive(self.max_correspondence_distance) {
            let problem = format!("max_correspondence_distance is {} m", self.max_correspondence_distance);
            return Err(Error::whole(problem, "Give a positive max_correspondence_distance"));
        }
        if !self.viewpoint.is_finite() {
            return Err(Error::whole("The viewpoint is not finite", "Give x, y and z in metres"));
        }
        Ok(())
    }
}

/// A few iterations with pairs within this distance (m).
fn rough_stage(distance: f64) -> IcpOptions {
    let rough = Criteria { max_iterations: 15, rotation_eps: 2e-3, translation_eps: 0.01 * distance };
    robust_stage(distance, 0.35 * distance, rough)
}

fn robust_stage(distance: f64, width: f64, criteria: Criteria) -> IcpOptions {
    IcpOptions {
        rejection: Rejection {
            max_correspondence_distance: distance,
            max_normal_angle: MAX_NORMAL_ANGLE,
            trim_fraction: 0.0,
        },
        weighting: Weighting { robust_kernel: RobustKernel::GemanMcclure, robust_kernel_width: width },
        criteria,
    }
}

/// Distance limits of correspondences (voxels), one stage after the other, where a motion is far from its prediction. By
/// default a voxel is a fortieth of the median range: the widest is half of it.
const WIDE_DISTANCES: [f64; 3] = [20.0, 10.0, 6.0];
/// Largest angle (rad) between the normals of corresponding points.
const MAX_NORMAL_ANGLE: f64 = 0.8;
