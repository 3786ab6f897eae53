//! Odometry of point clouds in space: each cloud is registered to the previous one, or to the map of all earlier ones.
//!
//! Clouds lack the pixel grid of a camera: normals come from neighbours, and correspondences from blocks of voxels. No motion
//! model is trusted: the initial guess is chosen by how well it fits, and global registration is tried where the result is
//! doubtful. Read [`CloudOdometry::register_frame`] first. [`SweepOdometry`] straightens the sweeps of a lidar that moves while it turns.

mod azimuth;
mod candidates;
mod gyro;
pub mod options;
mod parts;
pub mod prepared;
mod skew_test;
mod start;
pub mod sweeps;
mod turns;
mod velocity;

use nalgebra::Matrix6;

pub(crate) use self::azimuth::{AzimuthGuess, Guess};
pub(crate) use self::candidates::FREE_SPACE_TOLERANCE;
use self::candidates::{Candidate, CloudTarget, Task};
pub use self::options::{CloudMethod, CloudOptions, GlobalRegistrationUse};
use self::parts::Parts;
pub use self::prepared::PreparedCloud;
pub use self::sweeps::{SweepEstimate, SweepOdometry};
use crate::error::Result;
use crate::geometry::{Pose3, RigidMotion};
use crate::map::cloud::CloudMap;
use crate::odometry::assessment::{Assessment, Limits, Status};
use crate::odometry::planar::information::seen_from;
use crate::registration::spatial::SpatialRegistration;

/// Smallest number of points with normals of a usable cloud.
const MIN_POINTS: usize = 100;
/// Points with which initial guesses are compared, and free space is tested.
pub(crate) const ROUGH_POINTS: usize = 1000;
/// Measured on pairs of frames, up to 30 apart, of two rendered floors: the agreement of correct registrations is at least
/// 0.99, and of those wrong by 15 cm or 5 degrees less than 0.89.
pub(crate) const LIMITS: Limits =
    Limits { lost_overlap: 0.2, doubtful_overlap: 0.4, lost_agreement: 0.85, doubtful_agreement: 0.95, ..Limits::NONE };
/// Least difference of the scores of a pose and of any other one: of right places along streets it is at least 0.4.
pub(crate) const MIN_LEAD: f64 = 0.2;
/// Largest translation of the last step of a converged registration, in voxels.
const MOVING_STEP: f64 = 0.1;
/// The map is cleared of what is old each time that the path has grown by this share of the age.
const FORGETTING_SHARE: f64 = 0.1;

/// The pose of a cloud, and its assessment.
pub struct CloudEstimate {
    /// Pose of the sensor in the frame of the first cloud. Where the cloud is lost, it is that of the last registered one.
    pub T_world_sensor: Pose3,
    /// The registration; `None` for the first cloud and for clouds with too few points. It maps into the frame of the last
    /// registered cloud with [`CloudMethod::CloudToCloud`], and into the world otherwise.
    pub registration: Option<SpatialRegistration>,
    /// Share of the cloud's points that lie on what it was registered to, 0..=1.
    pub overlap: f64,
    /// Whether the initial guess came from global registration.
    pub is_global: bool,
    /// Whether the pose is good, doubtful or lost.
    pub assessment: Assessment,
}

/// Odometry of clouds in space. The world frame is the frame of the first cloud.
pub struct CloudOdometry {
    options: CloudOptions,
    last: Option<PreparedCloud>,
    map: CloudMap,
    T_world_last: Pose3,
    last_motion: Pose3,
    /// Information of a perturbation on the left of the last motion, rotation first.
    step_information: Matrix6<f64>,
    /// Length of the path (m), ...
    path_length: f64,
    /// ... and up to where the map was cleared of what is old.
    forgotten_at: f64,
    parts: Parts,
    /// Clouds are described for global registrations in voxels of this side (m), told from the first one.
    global_voxel_size: f64,
}

/// The cloud that was registered last.
pub struct RegisteredCloud<'a> {
    /// The cloud.
    pub cloud: &'a PreparedCloud,
    /// Its pose, by the odometry alone.
    pub T_world_cloud: Pose3,
    /// Its number in the order of registration.
    pub number: usize,
    /// Information of a perturbation on the left of its motion from the one before, rotation first.
    pub step_information: Matrix6<f64>,
}

/// A registration that is not lost, before the cloud is added to the map.
struct Found {
    candidate: Candidate,
    T_world_sensor: Pose3,
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
            step_information: Matrix6::zeros(),
            path_length: 0.0,
            forgotten_at: 0.0,
            parts: Parts::default(),
            global_voxel_size: options.voxel_size,
        })
    }

    /// Registers the next cloud, which was prepared with the same options. A lost cloud does not enter
    /// the map, and the next cloud starts from the last registered pose.
    pub fn register_frame(&mut self, frame: PreparedCloud) -> CloudEstimate {
        if self.last.is_none() {
            return self.begin(frame);
        }
        match self.find(&frame, None) {
            Ok(found) => self.accept(frame, found),
            Err(lost) => *lost,
        }
    }

    /// For each cloud that is not lost, in the order of registration, whether it belongs to the largest set of clouds that are certain
    /// relative to each other: to be asked after the last one. Good clouds outside are good relative to one another, but a doubtful one lies
    /// between them and the others.
    pub fn are_in_largest_part(&self) -> Vec<bool> {
        self.parts.are_in_largest()
    }

    /// The cloud that was registered last.
    pub fn last_registered(&self) -> Option<RegisteredCloud<'_>> {
        let Self { T_world_last: T_world_cloud, step_information, .. } = *self;
        let number = self.parts.len().checked_sub(1)?;
        self.last.as_ref().map(|cloud| RegisteredCloud { cloud, T_world_cloud, number, step_information })
    }

    /// Takes over that two clouds, by their numbers in the order of registration, were found to be certain relative to each other.
    pub(crate) fn connect(&mut self, clouds: [usize; 2]) {
        self.parts.connect(clouds);
    }

    /// Where a cloud is that comes after the first one; it is not added to the map. Where the same cloud, straightened otherwise, was found
    /// after this motion from the last one, it is searched from there first.
    ///
    /// # Errors
    /// The estimate of a cloud that is lost.
    fn find(&self, frame: &PreparedCloud, found: Option<&Pose3>) -> std::result::Result<Found, Box<CloudEstimate>> {
        let num_points = frame.num_oriented();
        let Some(last) = self.last.as_ref().filter(|_| num_points >= MIN_POINTS) else {
            return Err(Box::new(self.lost(Assessment::too_few_points(num_points), None)));
        };

        let (task, T_world_target) = self.task(frame, last);

        let again = found.map(|motion| self.refine(&task, task.T_target_last * motion)).filter(Candidate::is_good);
        // From the last pose and the last motion; by features always, never, or where the result is doubtful.
        let candidate = again.map_or_else(
            || match self.options.global_registration {
                GlobalRegistrationUse::Never => Ok(self.register_nearby(&task)),
                GlobalRegistrationUse::Always => self.register_by_features(&task),
                GlobalRegistrationUse::WhenDoubtful => Ok(self.register_where_doubtful(&task)),
            },
            Ok,
        );

        match candidate {
            Err(reason) => Err(Box::new(self.lost(Assessment::lost(reason), None))),
            Ok(candidate) if candidate.assessment.status == Status::Lost => {
                let assessment = Assessment::lost(candidate.assessment.reason);
                Err(Box::new(self.lost(assessment, Some(candidate.registration))))
            }
            Ok(candidate) => {
                let T_world_sensor = (T_world_target * candidate.registration.T_target_source).renormalized();
                Ok(Found { candidate, T_world_sensor })
            }
        }
    }

    /// A cloud and its target, and the pose of that.
    fn task<'a>(&'a self, frame: &'a PreparedCloud, last: &'a PreparedCloud) -> (Task<'a>, Pose3) {
        let (target, T_world_target, T_target_last) = match self.options.method {
            CloudMethod::CloudToCloud => (CloudTarget::Tree(last.target()), self.T_world_last, Pose3::identity()),
            CloudMethod::CloudMap => (CloudTarget::Map(&self.map), Pose3::identity(), self.T_world_last),
        };
        (Task { frame, last, target, T_target_last }, T_world_target)
    }

    /// The first cloud defines the world frame.
    fn begin(&mut self, frame: PreparedCloud) -> CloudEstimate {
        let num_points = frame.num_oriented();
        if num_points < MIN_POINTS {
            return self.lost(Assessment::too_few_points(num_points), None);
        }
        self.map = CloudMap::new(self.options.voxel_size);
        if self.parts.len() == 0 {
            self.parts.add(true, []);
        }
        self.global_voxel_size = self.options.global_voxel_size(frame.cloud());
        self.keep(frame, true);
        CloudEstimate {
            T_world_sensor: self.T_world_last,
            registration: None,
            overlap: 1.0,
            is_global: false,
            assessment: Assessment::first(),
        }
    }

    /// Makes a cloud the last registered one, and adds it to the map unless free space contradicts it.
    fn accept(&mut self, frame: PreparedCloud, Found { candidate, T_world_sensor }: Found) -> CloudEstimate {
        let overlap = candidate.overlap();
        let Candidate { registration, is_global, assessment } = candidate;
        self.last_motion = self.T_world_last.inverse() * T_world_sensor;
        self.step_information = match self.options.method {
            CloudMethod::CloudToCloud => registration.information,
            CloudMethod::CloudMap => seen_from(&registration.information, &self.T_world_last),
        };
        self.path_length += self.last_motion.translation_norm();
        self.T_world_last = T_world_sensor;
        self.parts.add(assessment.status == Status::Good, self.parts_under(&frame, &T_world_sensor, overlap));
        self.keep(frame, assessment.agreement >= LIMITS.doubtful_agreement);
        CloudEstimate { T_world_sensor, registration: Some(registration), overlap, is_global, assessment }
    }

    /// A cloud of each part on which so much of a cloud lies that the part alone would register it.
    fn parts_under(&self, frame: &PreparedCloud, T_world_sensor: &Pose3, overlap: f64) -> Vec<usize> {
        if self.parts.are_one() || self.options.method == CloudMethod::CloudToCloud {
            return self.parts.len().checked_sub(1).into_iter().collect();
        }
        let firsts = self.parts.firsts();
        let mut counts = vec![0; firsts.len()];
        for point in frame.at_most(ROUGH_POINTS).points {
            let point = T_world_sensor.rotation * point + T_world_sensor.translation.vector;
            if let Some(cloud) = self.map.first_seen_by(&point) {
                counts[firsts[cloud as usize]] += 1;
            }
        }
        let all: usize = counts.iter().sum();
        let enough = LIMITS.doubtful_overlap * all as f64 / overlap;
        (0..counts.len()).filter(|&first| counts[first] > 0 && counts[first] as f64 >= enough).collect()
    }

    /// Keeps the cloud as the reference of the next one, and inserts it into the map where it is uncontradicted.
    fn keep(&mut self, frame: PreparedCloud, is_uncontradicted: bool) {
        if is_uncontradicted && self.options.method == CloudMethod::CloudMap {
            let number = self.parts.len() as u32 - 1;
            self.map.insert((number, self.path_length), &frame.source(), &self.T_world_last);
        }
        if self.path_length - self.forgotten_at > FORGETTING_SHARE * self.options.max_age() {
            self.map.forget(self.path_length - self.options.max_age());
            self.forgotten_at = self.path_length;
        }
        self.last = Some(frame);
    }

    fn lost(&self, assessment: Assessment, registration: Option<SpatialRegistration>) -> CloudEstimate {
        let overlap = registration.as_ref().map_or(0.0, |registration| registration.fitness);
        CloudEstimate { T_world_sensor: self.T_world_last, registration, overlap, is_global: false, assessment }
    }
}
