//! Planar odometry: each scan is registered to the map of the scans before it.
//!
//! Measured motion, where there is any, bounds the search and is fused with the registration; a registration that contradicts it
//! is rejected. A scan that fits the map nowhere is placed by the measured motion. Without any, it begins another piece of the
//! map if the next scan fits it.

use std::rc::Rc;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::geometry::{Pose2, RigidMotion};
use crate::map::local::{LocalMap, PlanarRegistration, QueryScan};
use crate::odometry::assessment::Assessment;
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::correlative::SearchWindow;
use crate::registration::icp::IcpOptions;
use crate::registration::planar::PlanarMetric;

pub(crate) mod assess;
pub mod belief;
pub mod hypothesis;
pub mod information;
mod measured;
pub mod motion_noise;
pub mod odometry_model;
mod unmeasured;

use assess::{GOOD_AGREEMENT, MIN_POINTS, assess};
use belief::{ByOdometry, Finding};
use hypothesis::Hypothesis;
use motion_noise::MotionChange;

/// What a registration starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum InitialGuess {
    /// Where the last scan was.
    Identity,
    /// The last motion once more.
    ConstantVelocity,
    /// The best pose in a window around constant velocity, by correlative search.
    Correlative,
}

/// Options of planar odometry.
#[derive(Debug, Clone)]
pub struct PlanarOptions {
    /// How many earlier scans form the local map.
    pub map_capacity: usize,
    /// What a registration starts from.
    pub initial_guess: InitialGuess,
    /// Half widths of the correlative search.
    pub search: SearchWindow,
    /// What a correspondence measures.
    pub metric: PlanarMetric,
    /// The registration loop.
    pub icp: IcpOptions,
}

/// A motion that was measured, with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredMotion {
    /// Pose of the sensor in the frame of the scan before.
    pub T_before_sensor: Pose2,
    /// By a perturbation on the left, rotation first.
    pub covariance: Matrix3<f64>,
}

/// How a frame is connected to those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Link {
    /// By nothing: a piece of the map begins.
    Start,
    /// By a registration that nothing speaks against.
    Registered,
    /// By a registration that something speaks against.
    Doubted,
    /// By a registration further off than the robot is known to move: nothing is known of the motion.
    Implausible,
    /// By measured motion alone.
    Carried,
    /// By nothing, or by measured motion without any returns: no frame is connected to it.
    Lost,
}

/// Where a scan was found, and how far that is to be trusted.
pub struct FrameEstimate {
    /// Pose of the sensor in the frame of the first scan. Where the frame is lost, it is the prediction.
    pub T_world_sensor: Pose2,
    /// The registration to the local map; `None` for the first scan and for scans with too few points.
    pub registration: Option<PlanarRegistration>,
    /// How far the registration alone is to be trusted, with the reason.
    pub registered: Assessment,
    /// How the odometry bears on it.
    pub by_odometry: ByOdometry,
    /// What else speaks against the pose, in the order in which it was found.
    pub findings: Vec<Finding>,
    /// How it is connected to the frames before.
    pub link: Link,
    /// The motion that was expected in place of the odometry's, which the scans refute.
    pub instead_of_odometry: Option<MeasuredMotion>,
    /// What the registration tells of the pose, by a perturbation on the left about the world's origin, rotation first.
    pub information: Matrix3<f64>,
    /// The scans that it was registered to, and where they were placed at that time.
    pub references: Vec<(Rc<PlanarScan>, Pose2)>,
}

/// Scan-to-map odometry in the plane. The world frame is the frame of the first scan.
pub struct Odometry {
    options: PlanarOptions,
    map: LocalMap,
    /// The last scan that fitted the map nowhere and had no measured motion, as a map of its own: the next one may fit it.
    stray: Option<LocalMap>,
    T_world_last: Pose2,
    /// The last motion, from one scan to the next, in the frame of the earlier.
    last_motion: Pose2,
    /// The last step of the odometry that no registration refuted.
    last_measured: Option<Pose2>,
    /// How many frames up to the last one were registered without a doubt, one after the other.
    num_registered: usize,
    /// How much the robot's motion changes from one frame to the next, where the odometry tells it.
    motion_change: Option<MotionChange>,
}

/// What a registration is known by at best (rad, m): its pairs of points are not independent.
pub const REGISTRATION_SIGMA: (f64, f64) = (0.003, 0.01);
/// Standard deviation (rad, m) of a motion in directions that nothing determines: the half widths of the usual search.
pub const UNKNOWN_SIGMA: (f64, f64) = (0.6, 1.5);
/// Two poses that differ by more are two places (m, rad).
pub const MIN_RIVAL_DISTANCE: SearchWindow = SearchWindow { translation: 0.6, rotation: 0.25 };
/// Number of consecutive registered frames from which the motion is known.
pub const MIN_FRAMES_KNOWN_MOTION: usize = 2;
/// Largest change of the position from what the motion before leads to: this share of that motion and of what makes another place. A
/// heading may change by as much as the usual search looks for: a robot that begins to turn.
const MAX_MOTION_CHANGE: f64 = 0.5;
/// A second place rivals the first when it scores this share of it and lies on the map with this share: what a good registration may
/// miss makes no difference. Where the motion is not known, a scan may look elsewhere and show less of the map: any share that is an
/// overlap counts.
pub const RIVAL_SHARE: f64 = GOOD_AGREEMENT;
/// Iterations of ICP from a guess that is near the solution, or that most likely is wrong.
pub const BRIEF_ITERATIONS: usize = 8;

impl Odometry {
    /// Odometry without any scan so far; the first one will be at `T_world_first`.
    pub fn new(options: PlanarOptions, T_world_first: Pose2) -> Self {
        let map = LocalMap::new(options.map_capacity, options.metric);
        Self {
            options,
            map,
            stray: None,
            T_world_last: T_world_first,
            last_motion: Pose2::identity(),
            last_measured: None,
            num_registered: 0,
            motion_change: None,
        }
    }

    /// With what is known of how much the motion changes from frame to frame.
    #[must_use]
    pub fn with_motion_change(self, motion_change: Option<MotionChange>) -> Self {
        Self { motion_change, ..self }
    }

    /// The next scan is the first of another recording, which begins anywhere.
    pub fn begin_recording(&mut self) {
        self.map = LocalMap::new(self.options.map_capacity, self.options.metric);
        (self.stray, self.last_measured, self.num_registered) = (None, None, 0);
        self.last_motion = Pose2::identity();
    }

    /// Registers the next scan, which is expected at this motion from the last one; without any, the last motion is
    /// expected once more. Where the measured motion is unlike the steps before and after it, `as_neighbors` is what these let expect.
    /// A scan that fits nothing stays at its prediction, and the scans after it start from there.
    pub fn register_frame(
        &mut self,
        scan: &Rc<PlanarScan>,
        motion: Option<&MeasuredMotion>,
        as_neighbors: Option<&Pose2>,
    ) -> FrameEstimate {
        let prediction = self.T_world_last * motion.map_or(self.last_motion, |motion| motion.T_before_sensor);
        let mut estimate = if scan.points.len() < MIN_POINTS {
            let too_few = unregistered(prediction, Assessment::too_few_points(scan.points.len()), Link::Lost);
            let is_placed = motion.is_some() && !self.map.is_empty();
            let by_odometry = if is_placed { ByOdometry::Placed(None) } else { ByOdometry::Nothing };
            FrameEstimate { by_odometry, ..too_few }
        } else if self.map.is_empty() {
            unregistered(prediction, Assessment::first(), Link::Start)
        } else if let Some(motion) = motion {
            self.register_measured(&QueryScan::new(scan), &prediction, motion, as_neighbors)
        } else {
            self.register_unmeasured(&QueryScan::new(scan), &prediction)
        };
        estimate.references = self.map.placed().collect();
        if let Some(motion) = motion.filter(|_| estimate.instead_of_odometry.is_none()) {
            self.last_measured = Some(motion.T_before_sensor);
        }
        self.take(scan, estimate, motion.is_some())
    }

    /// The scan enters the map, or waits for one that fits it.
    fn take(&mut self, scan: &Rc<PlanarScan>, mut estimate: FrameEstimate, is_measured: bool) -> FrameEstimate {
        match estimate.link {
            Link::Lost if is_measured || scan.points.len() < MIN_POINTS => {}
            Link::Lost => {
                if let Some(joined) = self.join_stray(scan, &estimate.T_world_sensor) {
                    estimate = joined;
                } else {
                    self.begin_stray(scan, &estimate.T_world_sensor);
                }
            }
            Link::Doubted if self.stray.is_some() => {
                if let Some(joined) = self.join_stray(scan, &estimate.T_world_sensor) {
                    estimate = joined;
                } else {
                    self.map.insert(Rc::clone(scan), estimate.T_world_sensor);
                }
            }
            Link::Start | Link::Registered | Link::Doubted | Link::Implausible | Link::Carried => {
                self.stray = None;
                self.map.insert(Rc::clone(scan), estimate.T_world_sensor);
            }
        }
        self.num_registered = if estimate.link == Link::Registered { self.num_registered + 1 } else { 0 };
        if estimate.link != Link::Lost {
            self.last_motion = self.T_world_last.inverse() * estimate.T_world_sensor;
        }
        self.T_world_last = estimate.T_world_sensor;
        estimate
    }

    /// Registers a scan that fits the map nowhere to the last such scan. If it fits, the two begin another piece of the map.
    fn join_stray(&mut self, scan: &Rc<PlanarScan>, prediction: &Pose2) -> Option<FrameEstimate> {
        if let Some(stray) = self.stray.take() {
            let main = std::mem::replace(&mut self.map, stray);
            let estimate = self.register_unmeasured(&QueryScan::new(scan), prediction);
            if estimate.link == Link::Registered {
                let references = self.map.placed().collect();
                self.map.insert(Rc::clone(scan), estimate.T_world_sensor);
                return Some(FrameEstimate { link: Link::Start, references, ..estimate });
            }
            self.map = main;
        }
        None
    }

    /// Keeps a scan that fits nothing for the next one.
    fn begin_stray(&mut self, scan: &Rc<PlanarScan>, prediction: &Pose2) {
        let mut stray = LocalMap::new(self.options.map_capacity, self.options.metric);
        stray.insert(Rc::clone(scan), *prediction);
        self.stray = Some(stray);
    }

    fn register_from(&self, scan: &QueryScan, guess: Pose2) -> Hypothesis {
        let registration = self.map.register(scan, guess, &self.options.icp);
        let assessment = assess(&registration, self.map.free_space(scan, &registration.T_target_source));
        Hypothesis { registration, assessment }
    }
}

/// Whether a motion leads to another place.
pub fn is_other_place(motion: &Pose2) -> bool {
    motion.translation_norm() > MIN_RIVAL_DISTANCE.translation || motion.rotation_angle() > MIN_RIVAL_DISTANCE.rotation
}

/// Whether a motion continues the one before.
pub fn continues(before: &Pose2, motion: &Pose2) -> bool {
    is_continuation(&(before.inverse() * motion), before.translation_norm())
}

/// Whether a step of this length (m) may follow one of `before` (m), whatever its direction.
pub fn may_follow(length: f64, before: f64) -> bool {
    length < before + largest_change(before)
}

fn is_continuation(off: &Pose2, before: f64) -> bool {
    off.rotation_angle() < UNKNOWN_SIGMA.0 && off.translation_norm() < largest_change(before)
}

/// How much (m) the next motion may differ from one of this length (m).
fn largest_change(before: f64) -> f64 {
    MAX_MOTION_CHANGE * (MIN_RIVAL_DISTANCE.translation + before)
}

fn unregistered(T_world_sensor: Pose2, assessment: Assessment, link: Link) -> FrameEstimate {
    let (information, references) = (Matrix3::zeros(), Vec::new());
    FrameEstimate {
        T_world_sensor,
        registration: None,
        registered: assessment,
        by_odometry: ByOdometry::Nothing,
        findings: Vec::new(),
        link,
        instead_of_odometry: None,
        information,
        references,
    }
}

fn registered(
    T_world_sensor: Pose2,
    registration: PlanarRegistration,
    information: Matrix3<f64>,
    assessment: Assessment,
    link: Link,
) -> FrameEstimate {
    let registration = Some(registration);
    FrameEstimate { registration, information, ..unregistered(T_world_sensor, assessment, link) }
}
