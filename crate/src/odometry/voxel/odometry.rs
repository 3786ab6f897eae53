//! The odometry itself: each frame is registered to the map, then added to it.

use nalgebra::{UnitQuaternion, Vector3};

use super::adaptive_threshold::AdaptiveThreshold;
use super::local_map::{LocalMap, placed};
use super::options::{
    AddedPoints, MapKind, Stages, ThresholdKind, VoxelOdometryMetric, VoxelOdometryMotion, VoxelOdometrySettings,
};
use crate::geometry::rotation::twist_about;
use crate::geometry::{PointCloud, Pose3};
use crate::odometry::assessment::{Assessment, Evidence, Limits, Status};
use crate::preprocess::voxel_hash::VoxelHash;
use crate::registration::factors::{PointToPlane, PointToPoint};
use crate::registration::icp::{Criteria, IcpOptions, Rejection, Source, Weighting, register_with};
use crate::registration::robust_kernel::RobustKernel;
use crate::registration::solver::{Solver, Subspace};
use crate::registration::spatial::SpatialRegistration;
use crate::registration::target::Target;

/// What a voxel odometry asks for. It tests no free space: the map holds points alone.
const LIMITS: Limits = Limits { min_pairs: 30, lost_overlap: 0.2, doubtful_overlap: 0.5, ..Limits::NONE };
/// A registration that has not converged and whose last step is longer than this (m) was cut off on its way.
const MOVING_STEP: f64 = 0.01;
/// Near means within this times the spacing of the frame's points, ...
const CLOSE_SPACINGS: f64 = 3.0;
/// ... and within this number of the map's voxels.
const CLOSE_VOXELS: f64 = 1.5;
/// Points that compare the two predictions.
const COMPARED_POINTS: usize = 1000;
/// The width of the robust kernel is this share of the threshold: kappa = sigma / 3, with tau = 3 sigma, is a variance in
/// Vizzo et al. 2023; as a distance, sigma itself serves every size of scene alike.
const KERNEL_SHARE: f64 = 1.0 / 3.0;
/// Pairs whose normals differ by more are none: the two sides of a wall (rad).
const MAX_NORMAL_ANGLE: f64 = std::f64::consts::FRAC_PI_4;
/// A registration has converged when its step turns less (rad) ...
const ROTATION_EPS: f64 = 1e-4;
/// ... and moves less (m).
const TRANSLATION_EPS: f64 = 1e-4;
/// A first cloud of which this share lies ahead, ...
const VIEW_SHARE: f64 = 0.99;
/// ... within 75 degrees of the z axis, is a camera's view. The floor around a robot lies across its z axis.
const VIEW_COSINE: f64 = 0.25;

/// Where a frame was found, and what that took.
#[derive(Debug, Clone)]
pub struct VoxelEstimate {
    /// Pose of the sensor in the frame of the first one. Of a lost frame, what was predicted.
    pub T_world_sensor: Pose3,
    /// How far it is to be trusted.
    pub status: Status,
    /// Why it is not good; empty when it is.
    pub reason: String,
    /// The registration; none for the first frame.
    pub registration: Option<SpatialRegistration>,
    /// Points that were registered.
    pub num_source: usize,
    /// Largest distance of correspondences (m).
    pub threshold: f64,
    /// Points that the map took, be it in the place of others.
    pub num_added: usize,
}

/// Scan-to-map odometry in space. The world frame is the frame of the first cloud.
pub struct VoxelOdometry {
    settings: VoxelOdometrySettings,
    /// How far apart the points of a frame lie (m), roughly.
    spacing: f64,
    /// Whether a camera is known to have taken the frames.
    is_camera: bool,
    map: LocalMap,
    threshold: AdaptiveThreshold,
    solver: Solver<Pose3>,
    /// The axis that stands upright, where the motion is planar.
    upright: Option<Upright>,
    T_world_last: Option<Pose3>,
    last_motion: Pose3,
}

/// The axis about which a planar motion turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Upright {
    Y,
    Z,
}

/// A frame's points in the sensor's frame.
struct Points {
    positions: Vec<Vector3<f64>>,
    normals: Vec<Option<Vector3<f64>>>,
}

impl VoxelOdometry {
    /// Odometry without frames.
    pub fn new(settings: VoxelOdometrySettings) -> Self {
        Self {
            spacing: 0.0,
            is_camera: false,
            map: LocalMap::new(&settings, 0.0),
            threshold: AdaptiveThreshold::new(settings.max_correspondence_distance),
            solver: Solver::default(),
            upright: None,
            T_world_last: None,
            last_motion: Pose3::identity(),
            settings,
        }
    }

    /// Sets the approximate spacing of a frame's points (m), the side of the voxels that it was thinned with, and whether a camera
    /// took the frames. After the first frame this has no effect.
    pub fn expect_frames(&mut self, spacing: f64, is_camera: bool) {
        if self.T_world_last.is_none() {
            (self.spacing, self.is_camera) = (spacing, is_camera);
            self.map = LocalMap::new(&self.settings, spacing);
        }
    }

    /// The settings.
    pub fn settings(&self) -> &VoxelOdometrySettings {
        &self.settings
    }

    /// The map so far.
    pub fn map(&self) -> &LocalMap {
        &self.map
    }

    /// Registers the next frame, whose normals are not finite where they are unknown. A frame that is lost is no part of the
    /// map.
    pub fn register_frame(&mut self, cloud: &PointCloud) -> VoxelEstimate {
        let frame = Points::of(cloud);
        let Some(T_world_last) = self.T_world_last else {
            self.hold(&frame);
            self.T_world_last = Some(Pose3::identity());
            let num_added = self.add(&frame, &Pose3::identity());
            return VoxelEstimate {
                T_world_sensor: Pose3::identity(),
                status: Status::Good,
                reason: String::new(),
                registration: None,
                num_source: 0,
                threshold: self.limit(),
                num_added,
            };
        };
        let source = frame.thinned(self.settings.source_voxel_size);
        self.map.make_ready();
        let threshold = self.limit();
        let guess = self.predict(&source, &T_world_last, threshold);
        let registration = self.register(&source, guess, threshold);
        let Assessment { status, reason, .. } = assess(&registration);
        let is_lost = status == Status::Lost;
        let T_world_sensor = if is_lost { guess } else { registration.T_target_source };
        let mut num_added = 0;
        if !is_lost {
            self.threshold.update(&(guess.inverse() * T_world_sensor), frame.reach());
            num_added = self.add(&frame, &T_world_sensor);
        }
        self.last_motion = T_world_last.inverse() * T_world_sensor;
        self.T_world_last = Some(T_world_sensor);
        let registration = Some(SpatialRegistration { correspondences: Vec::new(), ..registration });
        let num_source = source.positions.len();
        VoxelEstimate { T_world_sensor, status, reason, registration, num_source, threshold, num_added }
    }

    /// Holds the motion to the plane, if it is planar, from the first frame on.
    fn hold(&mut self, first: &Points) {
        self.upright = match self.settings.motion {
            VoxelOdometryMotion::Free => None,
            VoxelOdometryMotion::PlanarXz => Some(Upright::Y),
            VoxelOdometryMotion::Planar if self.is_camera || first.is_view() => Some(Upright::Y),
            VoxelOdometryMotion::Planar | VoxelOdometryMotion::PlanarXy => Some(Upright::Z),
        };
        let axes: Option<&[usize]> = self.upright.map(|upright| match upright {
            Upright::Y => &[1, 3, 5][..], // wy, x and z
            Upright::Z => &[2, 3, 4][..], // wz, x and y
        });
        self.solver.subspace = axes.map(Subspace::spanned_by);
    }

    fn limit(&self) -> f64 {
        match self.settings.threshold {
            ThresholdKind::Fixed => self.settings.max_correspondence_distance,
            ThresholdKind::Adaptive => self.threshold.threshold(),
        }
    }

    /// The better of two predictions: the sensor moved on as it did last (Vizzo et al. 2023, section III-A), or it stood still.
    /// Recordings that go step by step, a step ahead and then a turn, follow no constant velocity.
    fn predict(&self, source: &Points, T_world_last: &Pose3, threshold: f64) -> Pose3 {
        let moved_on = T_world_last * self.last_motion;
        let (kernel, width) = (RobustKernel::GemanMcclure, KERNEL_SHARE * threshold);
        let stride = source.positions.len().div_ceil(COMPARED_POINTS).max(1);
        let support = |T: &Pose3| -> f64 {
            let sample = source.positions.iter().step_by(stride);
            let weight = |point: &Vector3<f64>| {
                let (point, _) = placed(T, point, None);
                let partner = self.map.nearest(&point, threshold);
                partner.map_or(0.0, |found| kernel.weight(f64::from(found.sq_distance).sqrt(), width))
            };
            sample.map(weight).sum()
        };
        if support(&moved_on) >= support(T_world_last) { moved_on } else { *T_world_last }
    }

    fn register(&self, source: &Points, guess: Pose3, threshold: f64) -> SpatialRegistration {
        let stage = |distance: f64| IcpOptions {
            rejection: Rejection {
                max_correspondence_distance: distance,
                max_normal_angle: MAX_NORMAL_ANGLE,
                trim_fraction: 0.0,
            },
            weighting: Weighting {
                robust_kernel: RobustKernel::GemanMcclure,
                robust_kernel_width: KERNEL_SHARE * distance,
            },
            criteria: Criteria {
                max_iterations: self.settings.max_iterations,
                rotation_eps: ROTATION_EPS,
                translation_eps: TRANSLATION_EPS,
            },
        };
        let source = Source { points: &source.positions, normals: Some(&source.normals), sigmas: None };
        let register = |guess, options: &IcpOptions| match self.settings.metric {
            VoxelOdometryMetric::PointToPoint => {
                register_with(source, &self.map, guess, &PointToPoint, options, &self.solver)
            }
            VoxelOdometryMetric::PointToPlane => {
                register_with(source, &self.map, guess, &PointToPlane, options, &self.solver)
            }
        };
        let mut registration = register(guess, &stage(threshold));
        let close_by = self.close_by();
        if self.settings.stages == Stages::Two && (f64::MIN_POSITIVE..threshold).contains(&close_by) {
            let mut history = std::mem::take(&mut registration.history);
            registration = register(registration.T_target_source, &stage(close_by));
            history.append(&mut registration.history);
            registration.history = history;
        }
        let T_target_source = self.made_exact(&registration.T_target_source);
        SpatialRegistration { T_target_source, ..registration }
    }

    /// What counts as close by in the second stage (m); 0 where nothing determines it.
    fn close_by(&self) -> f64 {
        let of_map =
            if self.settings.map == MapKind::Voxels { CLOSE_VOXELS * self.settings.map_voxel_size } else { 0.0 };
        f64::max(CLOSE_SPACINGS * self.spacing, of_map)
    }

    /// A pose without what rounding has added to it: across the plane, and to the length of its quaternion. The inverse of a
    /// quaternion that is a little too long is too long as well, and a prediction multiplies three of them: left alone, the
    /// error more than doubles with every frame.
    fn made_exact(&self, T: &Pose3) -> Pose3 {
        let (q, t) = (T.rotation.quaternion(), T.translation.vector);
        let Some(upright) = self.upright else {
            return Pose3::from_parts(t.into(), UnitQuaternion::new_normalize(*q));
        };
        let (axis, t) = match upright {
            Upright::Y => (Vector3::y_axis(), Vector3::new(t.x, 0.0, t.z)),
            Upright::Z => (Vector3::z_axis(), Vector3::new(t.x, t.y, 0.0)),
        };
        Pose3::from_parts(t.into(), twist_about(&T.rotation, &axis))
    }

    /// Adds a frame to the map as the settings say; returns how many points the map took.
    fn add(&mut self, frame: &Points, T_world_sensor: &Pose3) -> usize {
        let world: Vec<_> = frame
            .positions
            .iter()
            .zip(&frame.normals)
            .map(|(point, normal)| placed(T_world_sensor, point, normal.as_ref()))
            .filter(|(point, _)| {
                // Against the map as it was before the frame: points of one frame do not shut each other out.
                self.settings.added == AddedPoints::All || !self.map.has_partner(point, self.settings.partner_distance)
            })
            .collect();
        let num_added = world.into_iter().filter(|(point, normal)| self.map.insert(*point, *normal)).count();
        if self.settings.crop_distance > 0.0 {
            self.map.crop(&T_world_sensor.translation.vector, self.settings.crop_distance);
        }
        num_added
    }
}

impl Points {
    fn of(cloud: &PointCloud) -> Self {
        let vector = |p: &glam::Vec3| Vector3::from(p.as_dvec3().to_array());
        let normal = |n: &glam::Vec3| (n.is_finite() && *n != glam::Vec3::ZERO).then(|| vector(n).normalize());
        Self {
            positions: cloud.positions.iter().map(vector).collect(),
            normals: match &cloud.normals {
                Some(normals) => normals.iter().map(normal).collect(),
                None => vec![None; cloud.len()],
            },
        }
    }

    /// The point of every cube of side `voxel_size` (m) that came first: a measured one, not the middle of several (Vizzo et
    /// al. 2023, section III-B). 0: all.
    fn thinned(&self, voxel_size: f64) -> Self {
        let mut hash = VoxelHash::new(voxel_size);
        let mut is_first = |point: &Vector3<f64>| {
            let num_before = hash.len();
            hash.voxel(point).is_some_and(|voxel| hash.insert(voxel) as usize == num_before)
        };
        let is_first = |point: &Vector3<f64>| voxel_size == 0.0 || is_first(point);
        let kept = self.positions.iter().map(is_first).collect::<Vec<bool>>();
        let (positions, normals) = self
            .positions
            .iter()
            .zip(&self.normals)
            .zip(kept)
            .filter_map(|((point, normal), is_kept)| is_kept.then_some((*point, *normal)))
            .unzip();
        Self { positions, normals }
    }

    /// How far the points reach (m).
    fn reach(&self) -> f64 {
        self.positions.iter().map(Vector3::norm_squared).filter(|r| r.is_finite()).fold(0.0, f64::max).sqrt()
    }

    /// Whether it looks like what a camera sees along z, and not like what a laser sees all around.
    fn is_view(&self) -> bool {
        let ahead = self.positions.iter().filter(|point| point.z > VIEW_COSINE * point.norm()).count();
        ahead as f64 >= VIEW_SHARE * self.positions.len() as f64
    }
}

fn assess(registration: &SpatialRegistration) -> Assessment {
    let last = &registration.last;
    let is_moving = !registration.converged && last.translation_step > MOVING_STEP;
    let evidence = Evidence {
        num_pairs: last.num_inliers,
        overlap: registration.fitness,
        agreement: None,
        degenerate: None,
        residual: last.inlier_rmse,
        moving_after: is_moving.then_some(registration.history.len()),
    };
    Assessment::of(&evidence, &LIMITS)
}
