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
use crate::odometry::assessment::{Assessment, Status};
use crate::registration::free_space::sphere::SphericalSight;
use crate::registration::global::register_globally;
use crate::registration::icp::Source;
use crate::registration::spatial::{SpatialRegistration, register_in_space};
use crate::registration::target::OrientedTarget;

/// Fewer points make no cloud.
const MIN_POINTS: usize = 100;
/// Points that compare guesses.
const ROUGH_POINTS: usize = 1000;
/// A cloud of which less than this share lies on what it is registered to is not believed.
const LOST_OVERLAP: f64 = 0.2;
/// Below this share it is doubtful.
const DOUBTFUL_OVERLAP: f64 = 0.4;
/// Points of two clouds contradict each other beyond so many voxels.
const FREE_SPACE_TOLERANCE: f64 = 3.0;
/// Below this share of agreeing points a registration is not believed, ... On pairs of frames of two rendered floors, up to 30
/// frames apart, right registrations agree by 0.99 and more, and ones that are wrong by 15 cm or 5 degrees by less than 0.89.
const LOST_AGREEMENT: f64 = 0.85;
/// ... and below this it is doubtful, and no part of the map.
const DOUBTFUL_AGREEMENT: f64 = 0.95;
/// Residuals above this share of the distance limit (rms) are doubtful: pairs at random have 0.58 of it.
const DOUBTFUL_RESIDUAL: f64 = 0.45;
/// A last step larger than this share of a voxel tells of a registration that was cut off on its way.
const RESTLESS_STEP: f64 = 0.1;

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

/// A registration, with what speaks for it.
struct Found {
    registration: SpatialRegistration,
    overlap: f64,
    agreement: f64,
    is_global: bool,
}

impl Found {
    /// What speaks for a registration; points in free space count against it more than points on surfaces for it.
    fn support(&self) -> f64 {
        self.overlap - 2.0 * (1.0 - self.agreement)
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
            let reason = format!("it has {num_points} points on surfaces that could be told, too few to place it");
            return self.lost(reason, None, 0.0);
        }
        let Some(last) = &self.last else {
            self.keep(frame, true);
            let T_world_sensor = self.T_world_last;
            return CloudEstimate {
                T_world_sensor,
                registration: None,
                overlap: 1.0,
                is_global: false,
                assessment: Assessment::first(),
            };
        };
        match self.options.method {
            CloudMethod::CloudToCloud => {
                let found = self.find(&frame, last, last.target(), &Pose3::identity());
                self.believe(frame, found, self.T_world_last)
            }
            CloudMethod::CloudMap => {
                let reach = frame.target().points().iter().map(Vector3::norm_squared).fold(0.0, f64::max).sqrt();
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
            let max_distance = options::GLOBAL_DISTANCE * self.options.voxel_size;
            let (source, target) = (frame.described(&self.options), last.described(&self.options));
            let found =
                register_globally(source, target, last.target().tree(), self.options.global_method, max_distance);
            found.map(|found| T_target_last * self.options.motion.nearest(&found.consensus.T_target_source))
        };
        let refined = |guesses: &[Pose3]| {
            let found = self.refined(frame, target, guesses);
            let T_last_frame = T_target_last.inverse() * found.registration.T_target_source;
            Found { agreement: self.agreement(frame, last, &T_last_frame), ..found }
        };
        let near = || refined(&[*T_target_last, T_target_last * self.last_motion]);
        match self.options.global_registration {
            GlobalRegistrationUse::Never => Ok(near()),
            GlobalRegistrationUse::Always => {
                let guess = global().map_err(|error| error.problem)?;
                Ok(Found { is_global: true, ..refined(&[guess]) })
            }
            GlobalRegistrationUse::WhenDoubtful => {
                let found = near();
                if self.assess(&found).status == Status::Good {
                    return Ok(found);
                }
                let Ok(guess) = global() else { return Ok(found) };
                let again = refined(&[guess]);
                let is_better = again.support() > found.support();
                Ok(if is_better { Found { is_global: true, ..again } } else { found })
            }
        }
    }

    /// The registration that the best of some guesses leads to.
    fn refined(&self, frame: &PreparedCloud, target: &OrientedTarget<3>, guesses: &[Pose3]) -> Found {
        let ((first, finer), solver) = (self.options.stages(), self.options.motion.solver());
        let metric = self.options.metric;
        let guess = if let [only] = guesses {
            *only
        } else {
            let sample = frame.at_most(ROUGH_POINTS);
            let source = Source { points: &sample.points, normals: Some(&sample.normals), sigmas: None };
            let rough =
                guesses.iter().map(|guess| register_in_space(metric, source, target, *guess, (&first, &[]), &solver));
            let better = |best: SpatialRegistration, next: SpatialRegistration| {
                if next.fitness > best.fitness { next } else { best }
            };
            rough.reduce(better).map_or_else(Pose3::identity, |best| best.T_target_source)
        };
        let registration = register_in_space(metric, frame.source(), target, guess, (&first, &finer), &solver);
        Found { overlap: registration.fitness, registration, agreement: 1.0, is_global: false }
    }

    /// Share of what can be compared of two clouds that agrees: points of one on surfaces that the other saw, against points
    /// in its free space.
    fn agreement(&self, frame: &PreparedCloud, last: &PreparedCloud, T_last_frame: &Pose3) -> f64 {
        let viewpoint = Vector3::from(self.options.viewpoint.to_array());
        let tolerance = FREE_SPACE_TOLERANCE * self.options.voxel_size;
        let (mut agreeing, mut against) = (0.0, 0.0);
        for (seen, view, T) in [(frame, last, *T_last_frame), (last, frame, T_last_frame.inverse())] {
            let view = view.view(viewpoint);
            for point in seen.at_most(ROUGH_POINTS).points {
                match view.look(&(T.rotation * point + T.translation.vector), tolerance) {
                    SphericalSight::Agreeing => agreeing += 1.0,
                    SphericalSight::InFreeSpace => against += 1.0,
                    SphericalSight::Unknown => {}
                }
            }
        }
        agreeing / f64::max(agreeing + against, 1.0)
    }

    fn assess(&self, found: &Found) -> Assessment {
        let Found { registration, overlap, agreement, .. } = found;
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let with = |status, reason| Assessment { status, reason, agreement: *agreement };
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
        if *agreement < LOST_AGREEMENT {
            let reason = format!(
                "{} of its points in view stand where it or the cloud before saw free space: it shows another place, or the \
                 motion is larger than the search",
                percent(1.0 - agreement)
            );
            return with(Status::Lost, reason);
        }
        if *agreement < DOUBTFUL_AGREEMENT {
            let reason = format!("{} of its points in view stand in free space", percent(1.0 - agreement));
            return with(Status::Doubtful, reason);
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
        let assessment = self.assess(&found);
        let Found { registration, overlap, agreement, is_global } = found;
        if assessment.status == Status::Lost {
            return self.lost(assessment.reason, Some(registration), overlap);
        }
        let T_world_sensor = (T_world_target * registration.T_target_source).renormalized();
        self.last_motion = self.T_world_last.inverse() * T_world_sensor;
        self.T_world_last = T_world_sensor;
        self.keep(frame, agreement >= DOUBTFUL_AGREEMENT);
        CloudEstimate { T_world_sensor, registration: Some(registration), overlap, is_global, assessment }
    }

    /// The next cloud is compared with this one, and where it is uncontradicted registered to a map with it.
    fn keep(&mut self, frame: PreparedCloud, is_uncontradicted: bool) {
        if is_uncontradicted && self.options.method == CloudMethod::CloudMap {
            self.map.insert(frame.target().points(), frame.target().normals(), &self.T_world_last);
        }
        self.last = Some(frame);
    }

    fn lost(&self, reason: String, registration: Option<SpatialRegistration>, overlap: f64) -> CloudEstimate {
        let assessment = Assessment { status: Status::Lost, reason, agreement: 0.0 };
        CloudEstimate { T_world_sensor: self.T_world_last, registration, overlap, is_global: false, assessment }
    }
}

/// The map is looked at this much further (m) than the cloud reaches: the sensor has moved.
const MAP_MARGIN: f64 = 2.0;
