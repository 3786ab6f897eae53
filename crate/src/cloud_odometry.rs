//! The chain of clouds in space: each is registered to the one before it, or to the map of all before it.
//!
//! Clouds have no grid of a camera: normals come from neighbours, and partners from an index. As with depth images no
//! motion model is trusted: what starts a registration is chosen by evidence, and global registration helps where that
//! is doubtful.

use std::cell::OnceCell;

use glam::DVec3;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::cloud_map::CloudMap;
use crate::error::{Error, Result};
use crate::geometry::{PointCloud, Pose3};
use crate::preprocess::estimate_normals::estimate_normals;
use crate::preprocess::voxel_downsample::voxel_downsample_from;
use crate::registration::global::{DescribedCloud, GlobalMethod, register_globally};
use crate::registration::icp::{Criteria, IcpOptions, Rejection, Source, Weighting};
use crate::registration::robust_kernel::RobustKernel;
use crate::registration::solver::Motion;
use crate::registration::spatial::{SpatialMetric, SpatialRegistration, register_in_space};
use crate::registration::target::OrientedTarget;
use crate::search::{KdTree, Neighbourhood};
use crate::verdict::{Status, Verdict};

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

/// All options of [`CloudOdometry`].
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
const GLOBAL_DISTANCE: f64 = 1.5;
const COURSE_DISTANCE: f64 = 0.4;
const DEFAULT_DISTANCE: f64 = 3.0;
/// Neighbours of a feature.
const FEATURE_NEIGHBORS: usize = 100;

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
            global_method: GlobalMethod::Ransac,
            max_correspondence_distance: COURSE_DISTANCE * voxel_size,
            normals: Neighbourhood { max_neighbors: 30, radius: COURSE_NORMAL_RADIUS * voxel_size },
            robust: false,
            ..Self::new(voxel_size)
        }
    }

    fn feature_neighbourhood(&self) -> Neighbourhood {
        Neighbourhood { max_neighbors: FEATURE_NEIGHBORS, radius: FEATURE_RADIUS * self.voxel_size }
    }

    /// The stages of a registration, coarse to fine.
    fn stages(&self) -> (IcpOptions, Vec<IcpOptions>) {
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

    fn check(&self) -> Result<()> {
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
/// Fewer points make no cloud.
const MIN_POINTS: usize = 100;
/// Points that compare guesses.
const ROUGH_POINTS: usize = 1000;
/// A cloud of which less than this share lies on what it is registered to is not believed.
const LOST_OVERLAP: f64 = 0.2;
/// Below this share it is doubtful.
const DOUBTFUL_OVERLAP: f64 = 0.4;
/// Residuals above this share of the distance limit (rms) are doubtful: pairs at random have 0.58 of it.
const DOUBTFUL_RESIDUAL: f64 = 0.45;
/// A last step larger than this share of a voxel tells of a registration that was cut off on its way.
const RESTLESS_STEP: f64 = 0.1;

/// A cloud made ready: thinned, with normals and an index. Making it is most of the work and needs no other cloud.
pub struct PreparedCloud {
    cloud: PointCloud,
    target: OrientedTarget<3>,
    described: OnceCell<DescribedCloud>,
}

impl PreparedCloud {
    /// Thins a cloud (sensor frame) and finds its normals. Normals that it has are not used: they may point anywhere.
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub fn new(cloud: &PointCloud, options: &CloudOptions) -> Result<Self> {
        options.check()?;
        if cloud.origin != DVec3::ZERO {
            let problem =
                "The coordinates are those of a map, not of a sensor: they are too large for single precision";
            return Err(Error::whole(problem, "Give clouds in the frame of the sensor that took them"));
        }
        let finite = cloud.positions.iter().filter(|p| p.is_finite());
        let lowest = finite.copied().reduce(glam::Vec3::min).unwrap_or_default();
        let corner = lowest.as_dvec3() - 0.5 * options.voxel_size;
        let mut cloud = if cloud.normals.is_some() {
            voxel_downsample_from(&PointCloud { normals: None, ..cloud.clone() }, options.voxel_size, corner)?
        } else {
            voxel_downsample_from(cloud, options.voxel_size, corner)?
        };
        let tree = KdTree::build(bytemuck::cast_slice(&cloud.positions));
        let normals = estimate_normals(&cloud.positions, &tree, options.normals, options.viewpoint);
        let single = |normal: &Option<Vector3<f64>>| {
            normal.map_or(glam::Vec3::NAN, |n| DVec3::from(<[f64; 3]>::from(n)).as_vec3())
        };
        cloud.normals = Some(normals.iter().map(single).collect());
        Ok(Self::with_tree(cloud, normals, tree))
    }

    /// A cloud made ready before: what [`cloud`](Self::cloud) gave, in another worker perhaps.
    pub fn from_cloud(cloud: PointCloud) -> Self {
        let known =
            |normal: &glam::Vec3| normal.is_finite().then(|| Vector3::from(normal.as_dvec3().to_array()).normalize());
        let none = vec![None; cloud.len()];
        let normals = cloud.normals.as_ref().map_or(none, |normals| normals.iter().map(known).collect());
        let tree = KdTree::build(bytemuck::cast_slice(&cloud.positions));
        Self::with_tree(cloud, normals, tree)
    }

    fn with_tree(cloud: PointCloud, normals: Vec<Option<Vector3<f64>>>, tree: KdTree<3>) -> Self {
        let points = cloud.positions.iter().map(|p| Vector3::from(p.as_dvec3().to_array())).collect();
        Self { target: OrientedTarget::with_tree(points, normals, tree), cloud, described: OnceCell::new() }
    }

    /// The thinned points with normals (not a number where there is none) and colours, if the cloud had them.
    pub fn cloud(&self) -> &PointCloud {
        &self.cloud
    }

    /// The points as something to register.
    pub fn source(&self) -> Source<'_, 3> {
        Source { points: self.target.points(), normals: Some(self.target.normals()), deviations: None }
    }

    /// The points as something to register to.
    pub fn target(&self) -> &OrientedTarget<3> {
        &self.target
    }

    fn described(&self, options: &CloudOptions) -> &DescribedCloud {
        self.described.get_or_init(|| {
            let (normals, tree) = (self.target.normals(), self.target.tree());
            DescribedCloud::new(&self.cloud.positions, normals, tree, options.feature_neighbourhood())
        })
    }

    /// Every so many of its points with a normal, so that there are about `most`.
    fn at_most(&self, most: usize) -> Sample {
        let stride = self.target.points().len().div_ceil(most).max(1);
        let every = self.target.points().iter().zip(self.target.normals()).step_by(stride);
        let (points, normals) = every.filter(|(_, normal)| normal.is_some()).map(|(p, n)| (*p, *n)).unzip();
        Sample { points, normals }
    }
}

struct Sample {
    points: Vec<Vector3<f64>>,
    normals: Vec<Option<Vector3<f64>>>,
}

/// Where a cloud was found, and why that is believed or not.
pub struct CloudEstimate {
    /// Pose of the sensor in the frame of the first cloud. Where the cloud is lost, it is that of the last one found.
    pub T_world_sensor: Pose3,
    /// The registration; `None` for the first cloud and for clouds with too few points. It maps into the frame of the last cloud
    /// found with [`CloudMethod::CloudToCloud`], and into the world otherwise.
    pub registration: Option<SpatialRegistration>,
    /// Share of the cloud's points that lie on what it was registered to, 0..=1.
    pub overlap: f64,
    /// Whether global registration started it.
    pub is_global: bool,
    /// Whether it is believed.
    pub verdict: Verdict,
}

/// Odometry of clouds in space. The world frame is the frame of the first cloud.
pub struct CloudOdometry {
    options: CloudOptions,
    last: Option<PreparedCloud>,
    map: CloudMap,
    T_world_last: Pose3,
    last_motion: Pose3,
}

/// A registration, with what speaks for it.
struct Found {
    registration: SpatialRegistration,
    overlap: f64,
    is_global: bool,
}

impl CloudOdometry {
    /// Odometry without clouds.
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub fn new(options: CloudOptions) -> Result<Self> {
        options.check()?;
        Ok(Self {
            options,
            last: None,
            map: CloudMap::new(options.voxel_size),
            T_world_last: Pose3::identity(),
            last_motion: Pose3::identity(),
        })
    }

    /// The map so far; empty with [`CloudMethod::CloudToCloud`].
    pub fn map(&self) -> &CloudMap {
        &self.map
    }

    /// Registers the next cloud, which was prepared with the same options. A cloud that is lost is no part of the map, and the
    /// clouds after it are looked for from where the last one was found.
    pub fn register_frame(&mut self, frame: PreparedCloud) -> CloudEstimate {
        let num_points = frame.target.normals().iter().flatten().count();
        if num_points < MIN_POINTS {
            let reason = format!("it has {num_points} points on surfaces that could be told, too few to place it");
            return self.lost(reason, None, 0.0);
        }
        let Some(last) = &self.last else {
            self.keep(frame);
            let T_world_sensor = self.T_world_last;
            return CloudEstimate {
                T_world_sensor,
                registration: None,
                overlap: 1.0,
                is_global: false,
                verdict: Verdict::first(),
            };
        };
        match self.options.method {
            CloudMethod::CloudToCloud => {
                let found = self.find(&frame, last, &last.target, &Pose3::identity());
                self.believe(frame, found, self.T_world_last)
            }
            CloudMethod::CloudMap => {
                let reach = frame.target.points().iter().map(Vector3::norm_squared).fold(0.0, f64::max).sqrt();
                let margin = MAP_MARGIN + self.options.max_correspondence_distance;
                let target = self.map.around(&self.T_world_last.translation.vector, reach + margin);
                let found = self.find(&frame, last, &target, &self.T_world_last);
                self.believe(frame, found, Pose3::identity())
            }
        }
    }

    /// Registers a cloud to a target in which the last cloud is at `T_target_last`.
    fn find(
        &self,
        frame: &PreparedCloud,
        last: &PreparedCloud,
        target: &OrientedTarget<3>,
        T_target_last: &Pose3,
    ) -> std::result::Result<Found, String> {
        let global = || {
            let max_distance = GLOBAL_DISTANCE * self.options.voxel_size;
            let (source, target) = (frame.described(&self.options), last.described(&self.options));
            let found = register_globally(source, target, last.target.tree(), self.options.global_method, max_distance);
            found.map(|found| T_target_last * self.options.motion.nearest(&found.consensus.T_target_source))
        };
        let near = || self.refined(frame, target, &[*T_target_last, T_target_last * self.last_motion]);
        match self.options.global_registration {
            GlobalRegistrationUse::Never => Ok(near()),
            GlobalRegistrationUse::Always => {
                let guess = global().map_err(|error| error.problem)?;
                Ok(Found { is_global: true, ..self.refined(frame, target, &[guess]) })
            }
            GlobalRegistrationUse::WhenDoubtful => {
                let found = near();
                if self.judge(&found).status == Status::Good {
                    return Ok(found);
                }
                let Ok(guess) = global() else { return Ok(found) };
                let again = self.refined(frame, target, &[guess]);
                let is_better = support(&again) > support(&found);
                Ok(if is_better { Found { is_global: true, ..again } } else { found })
            }
        }
    }

    /// The registration that the best of some guesses leads to.
    fn refined(&self, frame: &PreparedCloud, target: &OrientedTarget<3>, guesses: &[Pose3]) -> Found {
        let ((first, finer), solver) = (self.options.stages(), self.options.motion.solver());
        let metric = self.options.metric;
        let guess = match guesses {
            [only] => *only,
            _ => {
                let sample = frame.at_most(ROUGH_POINTS);
                let source = Source { points: &sample.points, normals: Some(&sample.normals), deviations: None };
                let rough = guesses.iter().map(|guess| {
                    let registration = register_in_space(metric, source, target, *guess, (&first, &[]), &solver);
                    (registration.fitness, registration.T_target_source)
                });
                let best = rough.fold(None, |best: Option<(f64, Pose3)>, next| match best {
                    Some(best) if best.0 >= next.0 => Some(best),
                    _ => Some(next),
                });
                best.map_or_else(Pose3::identity, |best| best.1)
            }
        };
        let registration = register_in_space(metric, frame.source(), target, guess, (&first, &finer), &solver);
        Found { overlap: registration.fitness, registration, is_global: false }
    }

    fn judge(&self, found: &Found) -> Verdict {
        let Found { registration, overlap, .. } = found;
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let with = |status, reason| Verdict { status, reason, agreement: *overlap };
        if !self.options.robust {
            // A course's pairs lie within a fraction of a voxel: few have a partner, and none is weighed.
            return if registration.last.num_inliers < MIN_POINTS {
                with(Status::Lost, format!("only {} pairs were found", registration.last.num_inliers))
            } else {
                with(Status::Good, String::new())
            };
        }
        if *overlap < LOST_OVERLAP {
            let reason =
                format!("only {} of its points lie on what was seen before: too little overlap", percent(*overlap));
            return with(Status::Lost, reason);
        }
        if *overlap < DOUBTFUL_OVERLAP {
            let reason = format!("only {} of its points lie on what was seen before", percent(*overlap));
            return with(Status::Doubtful, reason);
        }
        if registration.observability.is_undetermined() {
            return with(Status::Doubtful, "the surfaces in view leave the position along one direction open".into());
        }
        let residual = registration.last.inlier_rmse / self.options.max_correspondence_distance;
        if residual > DOUBTFUL_RESIDUAL {
            let reason = format!("its points lie {:.3} m off the surfaces in the mean", registration.last.inlier_rmse);
            return with(Status::Doubtful, reason);
        }
        if registration.last.translation_step > RESTLESS_STEP * self.options.voxel_size {
            let iterations = registration.history.len();
            return with(Status::Doubtful, format!("it was still moving after {iterations} iterations"));
        }
        with(Status::Good, String::new())
    }

    /// Takes a registration into a target that stands at `T_world_target`, unless it is not believed.
    fn believe(
        &mut self,
        frame: PreparedCloud,
        found: std::result::Result<Found, String>,
        T_world_target: Pose3,
    ) -> CloudEstimate {
        let found = match found {
            Ok(found) => found,
            Err(reason) => return self.lost(reason, None, 0.0),
        };
        let verdict = self.judge(&found);
        let Found { registration, overlap, is_global } = found;
        if verdict.status == Status::Lost {
            return self.lost(verdict.reason, Some(registration), overlap);
        }
        let T_world_sensor = T_world_target * registration.T_target_source;
        self.last_motion = self.T_world_last.inverse() * T_world_sensor;
        self.T_world_last = T_world_sensor;
        self.keep(frame);
        CloudEstimate { T_world_sensor, registration: Some(registration), overlap, is_global, verdict }
    }

    fn keep(&mut self, frame: PreparedCloud) {
        if self.options.method == CloudMethod::CloudMap {
            self.map.insert(frame.target.points(), frame.target.normals(), &self.T_world_last);
        }
        self.last = Some(frame);
    }

    fn lost(&self, reason: String, registration: Option<SpatialRegistration>, overlap: f64) -> CloudEstimate {
        let verdict = Verdict { status: Status::Lost, reason, agreement: 0.0 };
        CloudEstimate { T_world_sensor: self.T_world_last, registration, overlap, is_global: false, verdict }
    }
}

/// The map is looked at this much further (m) than the cloud reaches: the sensor has moved.
const MAP_MARGIN: f64 = 2.0;

/// What speaks for a registration: many points on the surfaces, and close to them.
fn support(found: &Found) -> f64 {
    found.overlap
}
