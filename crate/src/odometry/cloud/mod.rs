//! Odometry of point clouds in space: each cloud is registered to the previous one, or to the map of all earlier ones.
//!
//! Clouds lack the pixel grid of a camera: normals come from neighbours, and correspondences from a k-d tree. No motion
//! model is trusted: the initial guess is chosen by how well it fits, and global registration is tried where the result is
//! doubtful. Read [`CloudOdometry::register_frame`] first. [`SweepOdometry`] straightens the sweeps of a lidar that moves while it turns.

pub mod options;
mod parts;
pub mod prepared;
mod skew_test;
pub mod sweeps;

use std::slice;

use nalgebra::{Translation3, UnitQuaternion, Vector3};

pub use self::options::{CloudMethod, CloudOptions, GlobalRegistrationUse};
use self::parts::Parts;
pub use self::prepared::PreparedCloud;
pub use self::sweeps::{SweepEstimate, SweepOdometry};
use crate::error::Result;
use crate::geometry::quantile::quantile;
use crate::geometry::{Pose3, RigidMotion};
use crate::map::cloud::CloudMap;
use crate::odometry::assessment::{Assessment, Evidence, Limits, Status, Unconstrained};
use crate::registration::degeneracy::{DegenerateDirection, is_rotation_constrained};
use crate::registration::free_space::FreeSpaceTally;
use crate::registration::global::register_globally;
use crate::registration::global::scale::MATCH_DISTANCE;
use crate::registration::icp::{IcpOptions, Source};
use crate::registration::spatial::{SpatialRegistration, register_in_space};
use crate::registration::target::OrientedTarget;

/// Smallest number of points with normals of a usable cloud.
const MIN_POINTS: usize = 100;
/// Points with which initial guesses are compared, and free space is tested.
const ROUGH_POINTS: usize = 1000;
/// Tolerance of the free-space test, in voxels.
const FREE_SPACE_TOLERANCE: f64 = 3.0;
/// Measured on pairs of frames, up to 30 apart, of two rendered floors: the agreement of correct registrations is at least
/// 0.99, and of those wrong by 15 cm or 5 degrees less than 0.89.
const LIMITS: Limits =
    Limits { lost_overlap: 0.2, doubtful_overlap: 0.4, lost_agreement: 0.85, doubtful_agreement: 0.95, ..Limits::NONE };
/// Root mean square residual, as a share of the distance limit, above which a registration is doubtful: random pairs have
/// 1 / sqrt(3) = 0.58.
const DOUBTFUL_RESIDUAL: f64 = 0.45;
/// Largest translation of the last step of a converged registration, in voxels.
const MOVING_STEP: f64 = 0.1;
/// A shift that this share of the pairs measure is constrained, whatever the noise of the normals: in a bare corridor seen by
/// 16 rings with 2 cm of noise up to 0.01 seem to measure the one along it.
const WELL_MEASURED_SHARE: f64 = 0.02;
/// A motion whose turn moves the points this many times as far as its shift is a turn.
const PURE_TURN: f64 = 3.0;
/// Turns that are tried about each axis, either way: with steps of 0.15 rad (stages of 6 voxels, of which a median range has 40), 26 degrees
/// with what the last one reaches, after which a sensor of 70 degrees sees too little of the map.
const NUM_TURNS: i32 = 2;
/// Margin (m) of the part of the map that is registered to, beyond the cloud's range: the sensor has moved.
const MAP_MARGIN: f64 = 2.0;

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
    parts: Parts,
    /// Clouds are described for global registrations in voxels of this side (m), told from the first one.
    global_voxel_size: f64,
}

/// A cloud to register, and its target.
struct Task<'a> {
    frame: &'a PreparedCloud,
    /// The last registered cloud.
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

/// A registration that is not lost, before the cloud is added to the map.
struct Found {
    candidate: Candidate,
    T_world_sensor: Pose3,
}

impl Candidate {
    fn overlap(&self) -> f64 {
        self.registration.fitness
    }

    /// Whether it is accepted without a prediction near it: a wrong pose overlaps the map somewhere by chance.
    fn is_sound(&self) -> bool {
        self.overlap() >= LIMITS.doubtful_overlap && self.assessment.agreement >= LIMITS.doubtful_agreement
    }

    /// Score by which candidates are compared: overlap, less twice the share of points that contradict free space.
    fn score(&self) -> f64 {
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
        match self.find(&frame) {
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

    /// Where a cloud is that comes after the first one; it is not added to the map.
    ///
    /// # Errors
    /// The estimate of a cloud that is lost.
    fn find(&self, frame: &PreparedCloud) -> std::result::Result<Found, Box<CloudEstimate>> {
        let num_points = num_oriented(frame);
        let Some(last) = self.last.as_ref().filter(|_| num_points >= MIN_POINTS) else {
            return Err(Box::new(self.lost(Assessment::too_few_points(num_points), None)));
        };

        // The target, and its pose.
        let map;
        let (target, T_world_target, T_target_last) = match self.options.method {
            CloudMethod::CloudToCloud => (last.target(), self.T_world_last, Pose3::identity()),
            CloudMethod::CloudMap => {
                map = self.map_around(frame);
                (&map, Pose3::identity(), self.T_world_last)
            }
        };
        let task = Task { frame, last, target, T_target_last };

        // From the last pose and the last motion; by features always, never, or where the result is doubtful.
        let candidate = match self.options.global_registration {
            GlobalRegistrationUse::Never => Ok(self.register_nearby(&task)),
            GlobalRegistrationUse::Always => self.register_by_features(&task),
            GlobalRegistrationUse::WhenDoubtful => Ok(self.register_where_doubtful(&task)),
        };

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

    /// The first cloud defines the world frame.
    fn begin(&mut self, frame: PreparedCloud) -> CloudEstimate {
        let num_points = num_oriented(&frame);
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

    /// The part of the map within the cloud's range.
    fn map_around(&self, frame: &PreparedCloud) -> OrientedTarget<3> {
        let range = frame.target().points().iter().map(Vector3::norm_squared).fold(0.0, f64::max).sqrt();
        let margin = MAP_MARGIN + self.options.max_correspondence_distance;
        self.map.around(&self.T_world_last.translation.vector, range + margin)
    }

    /// Starts from the last pose or from constant velocity, whichever fits a sample of the points better.
    fn register_nearby(&self, task: &Task<'_>) -> Candidate {
        self.register(task, self.start_nearby(task))
    }

    /// Starts from the motion that global registration to the last cloud finds.
    fn register_by_features(&self, task: &Task<'_>) -> std::result::Result<Candidate, String> {
        let guess = self.features_guess(task).map_err(|error| error.problem)?;
        Ok(Candidate { is_global: true, ..self.register(task, guess) })
    }

    /// Starts nearby; where the result is not good, also farther away and by features. A sample of the points decides: the
    /// first start that is good with it, or else the one with the highest score. The start nearby is left to the last where the
    /// sample is lost from it.
    fn register_where_doubtful(&self, task: &Task<'_>) -> Candidate {
        let guess = self.start_nearby(task);
        let sample = self.register_sample(task, guess);
        let is_lost = sample.assessment.status == Status::Lost;
        let nearby = if is_lost { sample } else { self.register(task, guess) };
        if nearby.assessment.status == Status::Good {
            return nearby;
        }
        let wide = || Some(self.nearby_guess(task, &self.options.wide_stages()));
        let turned = || Some(self.turned_guess(task));
        let by_features = || self.features_guess(task).ok();
        let further: [(&dyn Fn() -> Option<Pose3>, bool); 3] = [(&wide, false), (&turned, false), (&by_features, true)];
        let mut best: Option<Candidate> = None;
        for (guess, is_global) in further {
            let Some(guess) = guess() else { continue };
            let rough = Candidate { is_global, ..self.register_sample(task, guess) };
            let is_good = rough.assessment.status == Status::Good;
            if best.as_ref().is_none_or(|best| rough.score() > best.score()) {
                best = Some(rough);
            }
            if is_good {
                break;
            }
        }
        let whole = |rough: Candidate| {
            let guess = rough.registration.T_target_source;
            Candidate { is_global: rough.is_global, ..self.register(task, guess) }
        };
        let is_better = |other: &Candidate| other.is_sound() && other.score() > nearby.score();
        let found = best.map(whole).filter(is_better);
        found.unwrap_or_else(|| if is_lost { self.register(task, guess) } else { nearby })
    }

    /// Registers the whole cloud from a guess, and assesses the result.
    fn register(&self, task: &Task<'_>, guess: Pose3) -> Candidate {
        self.register_from(task, task.frame.source(), guess)
    }

    /// Registers a few of the points.
    fn register_sample(&self, task: &Task<'_>, guess: Pose3) -> Candidate {
        self.register_from(task, task.frame.at_most(ROUGH_POINTS).source(), guess)
    }

    fn register_from(&self, task: &Task<'_>, source: Source<'_, Vector3<f64>>, guess: Pose3) -> Candidate {
        let ((first, finer), solver) = (self.options.stages(), self.options.motion.solver());
        let registration =
            register_in_space(self.options.metric, source, task.target, guess, (&first, &finer), &solver);
        let T_last_frame = task.T_target_last.inverse() * registration.T_target_source;
        let is_tested = self.options.tests_free_space;
        let agreement = is_tested.then(|| self.free_space(task.frame, task.last, &T_last_frame).agreement());
        let assessment = self.assess(&registration, agreement);
        Candidate { registration, is_global: false, assessment }
    }

    /// By the options of the registration itself.
    fn start_nearby(&self, task: &Task<'_>) -> Pose3 {
        self.nearby_guess(task, slice::from_ref(&self.options.stages().0))
    }

    /// The last pose or the last motion once more, whichever a few of the points fit better from, moved to where they do.
    fn nearby_guess(&self, task: &Task<'_>, stages: &[IcpOptions]) -> Pose3 {
        let Some((first, finer)) = stages.split_first() else { return task.T_target_last };
        let (metric, solver) = (self.options.metric, self.options.motion.solver());
        let sample = task.frame.at_most(ROUGH_POINTS);
        let from = |guess| register_in_space(metric, sample.source(), task.target, guess, (first, finer), &solver);
        let (resting, moving) = (from(task.T_target_last), from(task.T_target_last * self.last_motion));
        if moving.fitness > resting.fitness { moving.T_target_source } else { resting.T_target_source }
    }

    /// The last pose turned about an axis of the sensor as far as most of its points fit best, moved to where they do: the sensor may have
    /// begun to turn.
    fn turned_guess(&self, task: &Task<'_>) -> Pose3 {
        let (first, solver) = (self.options.stages().0, self.options.motion.solver());
        let sample = task.frame.at_most(ROUGH_POINTS);
        let mut ranges: Vec<f64> = sample.points.iter().map(Vector3::norm).collect();
        // Registrations of neighbouring turns reach each other at the median range.
        let step = first.rejection.max_correspondence_distance / quantile(&mut ranges, 0.5).unwrap_or(1.0);
        let turns = (1..=NUM_TURNS).flat_map(|turn| [turn, -turn]).map(|turn| f64::from(turn) * step);
        let axes = [Vector3::z_axis(), Vector3::y_axis(), Vector3::x_axis()];
        let guesses =
            axes.iter().flat_map(|axis| turns.clone().map(move |turn| UnitQuaternion::from_axis_angle(axis, turn)));
        let from = |turn| {
            let guess = self.options.motion.nearest(&Pose3::from_parts(Translation3::identity(), turn));
            register_in_space(
                self.options.metric,
                sample.source(),
                task.target,
                task.T_target_last * guess,
                (&first, &[]),
                &solver,
            )
        };
        let best = guesses.map(from).max_by(|a, b| a.fitness.total_cmp(&b.fitness));
        best.map_or(task.T_target_last, |best| best.T_target_source)
    }

    /// The motion that features of this cloud and the last one tell.
    fn features_guess(&self, task: &Task<'_>) -> Result<Pose3> {
        let voxel_size = self.global_voxel_size;
        let [source, target] = [task.frame, task.last].map(|cloud| cloud.described(&self.options, voxel_size));
        let max_distance = MATCH_DISTANCE * voxel_size;
        let (tree, method) = (target.tree(task.last), self.options.global_method);
        let found = register_globally(&source.cloud, &target.cloud, tree, method, max_distance)?;
        Ok(task.T_target_last * self.options.motion.nearest(&found.consensus.T_target_source))
    }

    /// Free-space test of a sample of the points of each cloud against the other.
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

    fn assess(&self, registration: &SpatialRegistration, agreement: Option<f64>) -> Assessment {
        let last = &registration.last;
        let evidence = Evidence {
            num_pairs: last.num_inliers,
            overlap: registration.fitness,
            agreement,
            degenerate: None,
            residual: last.inlier_rmse,
            moving_after: None,
        };
        if !self.options.robust {
            // Course pipelines take pairs within a fraction of a voxel: few points have a correspondence.
            return Assessment::of(&evidence, &Limits { min_pairs: MIN_POINTS, ..Limits::NONE });
        }
        let is_moving = last.translation_step > MOVING_STEP * self.options.voxel_size;
        let evidence = Evidence {
            degenerate: self.degenerate(registration),
            moving_after: is_moving.then_some(registration.history.len()),
            ..evidence
        };
        let doubtful_residual = DOUBTFUL_RESIDUAL * self.options.max_correspondence_distance;
        Assessment::of(&evidence, &Limits { doubtful_residual, ..LIMITS })
    }

    /// The weakest direction of motion, if no surfaces constrain it. The share of pairs that measure it does not tell alone: noisy
    /// normals of a bare corridor or of a round room seem to, and the little floor that a spinning laser sees in a small room seems
    /// not to, though it does.
    fn degenerate(&self, registration: &SpatialRegistration) -> Option<Unconstrained> {
        let (weakest, pairs) = (&registration.observability, &registration.correspondences);
        let tolerance = self.options.max_correspondence_distance;
        let [turn, shift] = [0, 3].map(|first| weakest.weakest_direction.fixed_rows::<3>(first).into_owned());
        if turn.norm() > PURE_TURN * shift.norm() {
            let is_free = weakest.is_undetermined() && !is_rotation_constrained(&turn.normalize(), pairs, tolerance);
            return is_free.then_some(Unconstrained::Turn);
        }
        let is_free =
            weakest.weakest_share < WELL_MEASURED_SHARE && DegenerateDirection::of(pairs, tolerance).is_some();
        is_free.then_some(Unconstrained::Position)
    }

    /// Makes a cloud the last registered one, and adds it to the map unless free space contradicts it.
    fn accept(&mut self, frame: PreparedCloud, Found { candidate, T_world_sensor }: Found) -> CloudEstimate {
        let overlap = candidate.overlap();
        let Candidate { registration, is_global, assessment } = candidate;
        self.last_motion = self.T_world_last.inverse() * T_world_sensor;
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
            self.map.insert(number, frame.target().points(), frame.target().normals(), &self.T_world_last);
        }
        self.last = Some(frame);
    }

    fn lost(&self, assessment: Assessment, registration: Option<SpatialRegistration>) -> CloudEstimate {
        let overlap = registration.as_ref().map_or(0.0, |registration| registration.fitness);
        CloudEstimate { T_world_sensor: self.T_world_last, registration, overlap, is_global: false, assessment }
    }
}

/// Number of points that have a normal.
fn num_oriented(frame: &PreparedCloud) -> usize {
    frame.target().normals().iter().flatten().count()
}
