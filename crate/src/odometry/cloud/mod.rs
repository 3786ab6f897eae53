//! The chain of clouds in space: each is registered to the one before it, or to the map of all before it.
//!
//! Clouds have no grid of a camera: normals come from neighbours, and partners from an index. As with depth images no
//! motion model is trusted: what starts a registration is chosen by evidence, and global registration helps where that
//! is doubtful.

pub mod options;
pub mod prepared;

use nalgebra::Vector3;

pub use self::options::{CloudMethod, CloudOptions, GlobalRegistrationUse};
pub use self::prepared::PreparedCloud;
use crate::error::Result;
use crate::geometry::{Pose3, RigidMotion};
use crate::map::cloud::CloudMap;
use crate::odometry::assessment::{Assessment, Evidence, Limits, Status, Unconstrained};
use crate::registration::free_space::FreeSpaceTally;
use crate::registration::global::register_globally;
use crate::registration::icp::Source;
use crate::registration::spatial::{SpatialRegistration, register_in_space};
use crate::registration::target::OrientedTarget;

/// Fewer points make no cloud.
const MIN_POINTS: usize = 100;
/// Points that compare guesses.
const ROUGH_POINTS: usize = 1000;
/// Points of two clouds contradict each other beyond so many voxels.
const FREE_SPACE_TOLERANCE: f64 = 3.0;
/// On pairs of frames of two rendered floors, up to 30 frames apart, right registrations agree by 0.99 and more, and ones that
/// are wrong by 15 cm or 5 degrees by less than 0.89.
const LIMITS: Limits =
    Limits { lost_overlap: 0.2, doubtful_overlap: 0.4, lost_agreement: 0.85, doubtful_agreement: 0.95, ..Limits::NONE };
/// Residuals above this share of the distance limit (rms) are doubtful: pairs at random have 0.58 of it.
const DOUBTFUL_RESIDUAL: f64 = 0.45;
/// A registration whose last step is longer than this share of a voxel was cut off on its way.
const MOVING_STEP: f64 = 0.1;
/// The map is looked at this much further (m) than the cloud reaches: the sensor has moved.
const MAP_MARGIN: f64 = 2.0;

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
    pub assessment: Assessment,
}

/// Odometry of clouds in space. The world frame is the frame of the first cloud.
pub struct CloudOdometry {
    options: CloudOptions,
    last: Option<PreparedCloud>,
    map: CloudMap,
    T_world_last: Pose3,
    last_motion: Pose3,
}

/// A cloud on its way, and what it is registered to.
struct Task<'a> {
    frame: &'a PreparedCloud,
    /// The last cloud that was found.
    last: &'a PreparedCloud,
    target: &'a OrientedTarget<3>,
    T_target_last: Pose3,
}

/// A registration with its assessment.
struct Candidate {
    registration: SpatialRegistration,
    is_global: bool,
    assessment: Assessment,
}

impl Candidate {
    fn overlap(&self) -> f64 {
        self.registration.fitness
    }

    /// What speaks for a registration; points in free space count against it more than points on surfaces for it.
    fn support(&self) -> f64 {
        self.overlap() - 2.0 * (1.0 - self.assessment.agreement)
    }
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
        let num_points = frame.target().normals().iter().flatten().count();
        if num_points < MIN_POINTS {
            return self.lost(Assessment::too_few_points(num_points), None);
        }
        let Some(last) = &self.last else { return self.begin(frame) };

        // What the cloud is registered to, and where that lies in the world.
        let map;
        let (target, T_world_target, T_target_last) = match self.options.method {
            CloudMethod::CloudToCloud => (last.target(), self.T_world_last, Pose3::identity()),
            CloudMethod::CloudMap => {
                map = self.map_around(&frame);
                (&map, Pose3::identity(), self.T_world_last)
            }
        };
        let task = Task { frame: &frame, last, target, T_target_last };

        // From the last pose and the last motion; by features always, never, or where that is doubtful.
        let candidate = match self.options.global_registration {
            GlobalRegistrationUse::Never => Ok(self.register_nearby(&task)),
            GlobalRegistrationUse::Always => self.register_by_features(&task),
            GlobalRegistrationUse::WhenDoubtful => Ok(self.register_where_doubtful(&task)),
        };

        match candidate {
            Err(reason) => self.lost(Assessment::lost(reason), None),
            Ok(candidate) if candidate.assessment.status == Status::Lost => {
                self.lost(Assessment::lost(candidate.assessment.reason), Some(candidate.registration))
            }
            Ok(candidate) => self.accept(frame, candidate, &T_world_target),
        }
    }

    /// The first cloud: the world is its frame.
    fn begin(&mut self, frame: PreparedCloud) -> CloudEstimate {
        self.keep(frame, true);
        CloudEstimate {
            T_world_sensor: self.T_world_last,
            registration: None,
            overlap: 1.0,
            is_global: false,
            assessment: Assessment::first(),
        }
    }

    /// As much of the map as the cloud may show.
    fn map_around(&self, frame: &PreparedCloud) -> OrientedTarget<3> {
        let range = frame.target().points().iter().map(Vector3::norm_squared).fold(0.0, f64::max).sqrt();
        let margin = MAP_MARGIN + self.options.max_correspondence_distance;
        self.map.around(&self.T_world_last.translation.vector, range + margin)
    }

    /// From the last pose, or the last motion once more.
    fn register_nearby(&self, task: &Task<'_>) -> Candidate {
        self.register(task, &[task.T_target_last, task.T_target_last * self.last_motion])
    }

    /// From the motion that features of this cloud and the last one tell, without a guess.
    fn register_by_features(&self, task: &Task<'_>) -> std::result::Result<Candidate, String> {
        let max_distance = options::GLOBAL_DISTANCE * self.options.voxel_size;
        let (source, target) = (task.frame.described(&self.options), task.last.described(&self.options));
        let found =
            register_globally(source, target, task.last.target().tree(), self.options.global_method, max_distance)
                .map_err(|error| error.problem)?;
        let guess = task.T_target_last * self.options.motion.nearest(&found.consensus.T_target_source);
        Ok(Candidate { is_global: true, ..self.register(task, &[guess]) })
    }

    /// From nearby, and by features where that is not good: the one with more support.
    fn register_where_doubtful(&self, task: &Task<'_>) -> Candidate {
        let nearby = self.register_nearby(task);
        if nearby.assessment.status == Status::Good {
            return nearby;
        }
        match self.register_by_features(task) {
            Ok(by_features) if by_features.support() > nearby.support() => by_features,
            _ => nearby,
        }
    }

    /// Registers from the best of some guesses, and assesses the result.
    fn register(&self, task: &Task<'_>, guesses: &[Pose3]) -> Candidate {
        let ((first, finer), solver) = (self.options.stages(), self.options.motion.solver());
        let (metric, guess) = (self.options.metric, self.best_guess(task, guesses));
        let registration =
            register_in_space(metric, task.frame.source(), task.target, guess, (&first, &finer), &solver);
        let T_last_frame = task.T_target_last.inverse() * registration.T_target_source;
        let agreement = self.free_space(task.frame, task.last, &T_last_frame).agreement();
        let assessment = self.assess(&registration, agreement);
        Candidate { registration, is_global: false, assessment }
    }

    /// The guess from which a few of the points fit best, moved to where they do.
    fn best_guess(&self, task: &Task<'_>, guesses: &[Pose3]) -> Pose3 {
        if let [only] = guesses {
            return *only;
        }
        let ((first, _), solver) = (self.options.stages(), self.options.motion.solver());
        let sample = task.frame.at_most(ROUGH_POINTS);
        let source = Source { points: &sample.points, normals: Some(&sample.normals), sigmas: None };
        let registered = guesses
            .iter()
            .map(|guess| register_in_space(self.options.metric, source, task.target, *guess, (&first, &[]), &solver));
        let better = |best: SpatialRegistration, next: SpatialRegistration| {
            if next.fitness > best.fitness { next } else { best }
        };
        registered.reduce(better).map_or_else(Pose3::identity, |best| best.T_target_source)
    }

    /// The free-space test of some points of each cloud against the other.
    fn free_space(&self, frame: &PreparedCloud, last: &PreparedCloud, T_last_frame: &Pose3) -> FreeSpaceTally {
        let viewpoint = Vector3::from(self.options.viewpoint.to_array());
        let tolerance = FREE_SPACE_TOLERANCE * self.options.voxel_size;
        let mut tally = FreeSpaceTally::default();
        for (seen, view, T) in [(frame, last, *T_last_frame), (last, frame, T_last_frame.inverse())] {
            let view = view.view(viewpoint);
            for point in seen.at_most(ROUGH_POINTS).points {
                tally.add(&view.classify(&(T.rotation * point + T.translation.vector), tolerance));
            }
        }
        tally
    }

    fn assess(&self, registration: &SpatialRegistration, agreement: f64) -> Assessment {
        let last = &registration.last;
        let evidence = Evidence {
            num_pairs: last.num_inliers,
            overlap: registration.fitness,
            agreement: Some(agreement),
            degenerate: None,
            residual: last.inlier_rmse,
            moving_after: None,
        };
        if !self.options.robust {
            // A course's pairs lie within a fraction of a voxel: few have a partner, and none is weighed.
            return Assessment::of(&evidence, &Limits { min_pairs: MIN_POINTS, ..Limits::NONE });
        }
        let is_moving = last.translation_step > MOVING_STEP * self.options.voxel_size;
        let evidence = Evidence {
            degenerate: registration.observability.is_undetermined().then_some(Unconstrained::Position),
            moving_after: is_moving.then_some(registration.history.len()),
            ..evidence
        };
        let doubtful_residual = DOUBTFUL_RESIDUAL * self.options.max_correspondence_distance;
        Assessment::of(&evidence, &Limits { doubtful_residual, ..LIMITS })
    }

    /// Makes a cloud the last one that was found, and part of the map where nothing contradicts it.
    fn accept(&mut self, frame: PreparedCloud, candidate: Candidate, T_world_target: &Pose3) -> CloudEstimate {
        let overlap = candidate.overlap();
        let Candidate { registration, is_global, assessment } = candidate;
        let T_world_sensor = (T_world_target * registration.T_target_source).renormalized();
        self.last_motion = self.T_world_last.inverse() * T_world_sensor;
        self.T_world_last = T_world_sensor;
        self.keep(frame, assessment.agreement >= LIMITS.doubtful_agreement);
        CloudEstimate { T_world_sensor, registration: Some(registration), overlap, is_global, assessment }
    }

    /// The next cloud is compared with this one, and where it is uncontradicted registered to a map with it.
    fn keep(&mut self, frame: PreparedCloud, is_uncontradicted: bool) {
        if is_uncontradicted && self.options.method == CloudMethod::CloudMap {
            self.map.insert(frame.target().points(), frame.target().normals(), &self.T_world_last);
        }
        self.last = Some(frame);
    }

    fn lost(&self, assessment: Assessment, registration: Option<SpatialRegistration>) -> CloudEstimate {
        let overlap = registration.as_ref().map_or(0.0, |registration| registration.fitness);
        CloudEstimate { T_world_sensor: self.T_world_last, registration, overlap, is_global: false, assessment }
    }
}
