//! What can be chosen of the odometry of clouds.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::registration::global::GlobalMethod;
use crate::registration::icp::{Criteria, IcpOptions, Rejection, Weighting};
use crate::registration::robust_kernel::RobustKernel;
use crate::registration::solver::Motion;
use crate::registration::spatial::SpatialMetric;
use crate::search::Neighbourhood;

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

/// When clouds are registered without a guess, by their features.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum GlobalRegistrationUse {
    /// Where the registration from the last pose and the last motion is doubtful.
    #[default]
    WhenDoubtful,
    /// Every cloud, and nothing else starts a registration.
    Always,
    /// Never.
    Never,
}

/// All options of [`CloudOdometry`](super::CloudOdometry).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudOptions {
    /// What a cloud is registered to.
    pub method: CloudMethod,
    /// What a correspondence measures.
    pub metric: SpatialMetric,
    /// How the sensor moves. Where it is planar, the first cloud's y axis stands upright on the floor.
    pub motion: Motion,
    /// When clouds are registered without a guess.
    pub global_registration: GlobalRegistrationUse,
    /// How they then are.
    pub global_method: GlobalMethod,
    /// Clouds are thinned to one point, the mean, in a cube of this side (m).
    pub voxel_size: f64,
    /// Pairs further apart are no correspondences (m), in the last stage.
    pub max_correspondence_distance: f64,
    /// Where the sensor stands in its own frame (m): normals are turned towards it.
    pub viewpoint: DVec3,
    /// Neighbours that make a normal.
    pub normals: Neighbourhood,
    /// Whether a wide search precedes the last stage, pairs lose weight by their residual, and pairs whose normals differ
    /// are rejected; the plain loop of a course has none of these.
    pub robust: bool,
}

/// Voxels within which a normal and a feature are looked for, and pairs for, where courses set no other.
const COURSE_NORMAL_RADIUS: f64 = 2.0;
const FEATURE_RADIUS: f64 = 5.0;
pub(super) const GLOBAL_DISTANCE: f64 = 1.5;
const COURSE_DISTANCE: f64 = 0.4;
const DEFAULT_DISTANCE: f64 = 3.0;
/// Of the random samples: any is as good as another, but the same clouds must give the same motions.
const COURSE_SEED: u64 = 1;
/// Neighbours of a feature.
const FEATURE_NEIGHBORS: usize = 100;

impl Default for CloudOptions {
    /// For rooms: voxels of 5 cm.
    fn default() -> Self {
        Self::new(0.05)
    }
}

impl CloudOptions {
    /// What works for most clouds, with voxels of this side (m): 0.05 for rooms, 0.25 for streets.
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
            normals: Neighbourhood { max_neighbors: 20, radius: f64::INFINITY },
            robust: true,
        }
    }

    /// The pipeline that courses teach with Open3D: normals from 30 neighbours within two voxels, features from 100 within five,
    /// random samples of three matches, then point-to-plane from there, with pairs within 0.4 voxels; each cloud to the
    /// one before it.
    pub fn course(voxel_size: f64) -> Self {
        Self {
            method: CloudMethod::CloudToCloud,
            global_registration: GlobalRegistrationUse::Always,
            global_method: GlobalMethod::Ransac { seed: COURSE_SEED },
            max_correspondence_distance: COURSE_DISTANCE * voxel_size,
            normals: Neighbourhood { max_neighbors: 30, radius: COURSE_NORMAL_RADIUS * voxel_size },
            robust: false,
            ..Self::new(voxel_size)
        }
    }

    pub(super) fn feature_neighbourhood(&self) -> Neighbourhood {
        Neighbourhood { max_neighbors: FEATURE_NEIGHBORS, radius: FEATURE_RADIUS * self.voxel_size }
    }

    /// The stages of a registration, coarse to fine.
    pub(super) fn stages(&self) -> (IcpOptions, Vec<IcpOptions>) {
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
        let stage = |distance: f64, width: f64, criteria: Criteria| IcpOptions {
            rejection: Rejection {
                max_correspondence_distance: distance,
                max_normal_angle: MAX_NORMAL_ANGLE,
                trim_fraction: 0.0,
            },
            weighting: Weighting { robust_kernel: RobustKernel::GemanMcclure, robust_kernel_width: width },
            criteria,
        };
        let rough = Criteria { max_iterations: 15, rotation_eps: 2e-3, translation_eps: 0.02 * distance };
        let fine = Criteria { max_iterations: 40, rotation_eps: 1e-4, translation_eps: 1e-3 * distance };
        (stage(2.0 * distance, 0.7 * distance, rough), vec![stage(distance, distance / 3.0, fine)])
    }

    pub(super) fn check(&self) -> Result<()> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        if !positive(self.voxel_size) {
            let problem = format!("A voxel of {} m is none", self.voxel_size);
            return Err(Error::whole(problem, "Give a positive voxel_size"));
        }
        if !positive(self.max_correspondence_distance) {
            let problem = format!("Pairs within {} m are none", self.max_correspondence_distance);
            return Err(Error::whole(problem, "Give a positive max_correspondence_distance"));
        }
        if !self.viewpoint.is_finite() {
            return Err(Error::whole("The viewpoint is not finite", "Give x, y and z in metres"));
        }
        Ok(())
    }
}

/// Pairs whose normals differ by more (rad) lie on different surfaces.
const MAX_NORMAL_ANGLE: f64 = 0.8;
