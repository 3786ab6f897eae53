//! How one cloud is registered: from several initial guesses, each result assessed.

use std::slice;

use nalgebra::{Translation3, UnitQuaternion, Vector3};

use super::prepared::PreparedCloud;
use super::{CloudOdometry, LIMITS, MIN_POINTS, MOVING_STEP, ROUGH_POINTS};
use crate::error::Result;
use crate::geometry::Pose3;
use crate::geometry::quantile::quantile;
use crate::map::cloud::CloudMap;
use crate::odometry::assessment::{Assessment, Evidence, Limits, Status, Unconstrained};
use crate::registration::degeneracy::{DegenerateDirection, is_rotation_constrained};
use crate::registration::free_space::FreeSpaceTally;
use crate::registration::global::register_globally;
use crate::registration::global::scale::MATCH_DISTANCE;
use crate::registration::icp::{IcpOptions, Source};
use crate::registration::spatial::{SpatialRegistration, register_in_space};
use crate::registration::target::{LastSearch, OrientedTarget, SurfaceTarget, Target};
use crate::search::Neighbor;

/// Tolerance of the free-space test, in voxels.
pub(crate) const FREE_SPACE_TOLERANCE: f64 = 3.0;
/// Root mean square residual, as a share of the distance limit, above which a registration is doubtful: random pairs have
/// 1 / sqrt(3) = 0.58.
const DOUBTFUL_RESIDUAL: f64 = 0.45;
/// A shift that this share of the pairs measure is constrained, whatever the noise of the normals: in a bare corridor seen by
/// 16 rings with 2 cm of noise up to 0.01 seem to measure the one along it.
const WELL_MEASURED_SHARE: f64 = 0.02;
/// A motion whose turn moves the points this many times as far as its shift is a turn.
const PURE_TURN: f64 = 3.0;
/// Turns that are tried about each axis, either way: with steps of 0.15 rad (stages of 6 voxels, of which a median range has 40), 26 degrees
/// with what the last one reaches, after which a sensor of 70 degrees sees too little of the map.
const NUM_TURNS: i32 = 2;

/// A cloud to register, and its target.
pub(super) struct Task<'a> {
    pub(super) frame: &'a PreparedCloud,
    /// The last registered cloud.
    pub(super) last: &'a PreparedCloud,
    pub(super) target: CloudTarget<'a>,
    pub(super) T_target_last: Pose3,
}

/// What a cloud is registered to: the last one, or the map. Its own index is there at once and finds what is near; a tree takes a while to
/// build, and less to find that nothing is.
#[derive(Clone, Copy)]
pub(super) enum CloudTarget<'a> {
    Tree(&'a OrientedTarget<3>),
    Map(&'a CloudMap),
}

/// A registration with its assessment.
pub(super) struct Candidate {
    pub(super) registration: SpatialRegistration,
    pub(super) is_global: bool,
    pub(super) assessment: Assessment,
}

impl Candidate {
    pub(super) fn overlap(&self) -> f64 {
        self.registration.fitness
    }

    /// Whether it is accepted without a prediction near it: a wrong pose overlaps the map somewhere by chance.
    pub(super) fn is_sound(&self) -> bool {
        self.overlap() >= LIMITS.doubtful_overlap && self.assessment.agreement >= LIMITS.doubtful_agreement
    }

    pub(super) fn is_good(&self) -> bool {
        self.assessment.status == Status::Good
    }

    /// Whether its status is as good as that of another one and its score no lower, or its status better.
    pub(super) fn is_no_worse_than(&self, other: &Self) -> bool {
        (other.assessment.status as u8, self.score()) >= (self.assessment.status as u8, other.score())
    }

    /// Score by which candidates are compared: overlap, less twice the share of points that contradict free space.
    pub(super) fn score(&self) -> f64 {
        self.overlap() - 2.0 * (1.0 - self.assessment.agreement)
    }
}

impl CloudOdometry {
    /// Starts from the last pose or from constant velocity, whichever fits a sample of the points better.
    pub(super) fn register_nearby(&self, task: &Task<'_>) -> Candidate {
        self.register(task, self.start_nearby(task))
    }

    /// Starts from the motion that global registration to the last cloud finds.
    pub(super) fn register_by_features(&self, task: &Task<'_>) -> std::result::Result<Candidate, String> {
        let guess = self.features_guess(task).map_err(|error| error.problem)?;
        Ok(Candidate { is_global: true, ..self.register(task, guess) })
    }

    /// Starts from the last motion; where the result is not good, nearby, then also farther away and by features. A sample of the points
    /// decides: the first start that is good with it, or else the one with the highest score. The start nearby is left to the last where
    /// the sample is lost from it.
    pub(super) fn register_where_doubtful(&self, task: &Task<'_>) -> Candidate {
        let mut guess = task.T_target_last * self.last_motion;
        let mut sample = self.register_sample(task, guess);
        if !sample.is_good() {
            guess = self.start_nearby(task);
            sample = self.register_sample(task, guess);
        }
        let is_lost = sample.assessment.status == Status::Lost;
        let nearby = if is_lost { sample } else { self.refine(task, sample.registration.T_target_source) };
        if nearby.assessment.status == Status::Good {
            return nearby;
        }
        let tree = self.tree_around(task);
        let target = tree.as_ref().map_or(task.target, CloudTarget::Tree);
        let task = &Task { target, ..*task };
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

    /// The map within twice the cloud's range, for searches of a wide area; `None` where the target is a tree.
    fn tree_around(&self, task: &Task<'_>) -> Option<OrientedTarget<3>> {
        let CloudTarget::Map(map) = task.target else { return None };
        let range = task.frame.source().points.iter().map(Vector3::norm_squared).fold(0.0, f64::max).sqrt();
        Some(map.around(&self.T_world_last.translation.vector, 2.0 * range))
    }

    /// Registers the whole cloud from where a few of its points were registered, or all of them straightened otherwise: in the last stage alone
    /// where that makes it good.
    pub(super) fn refine(&self, task: &Task<'_>, guess: Pose3) -> Candidate {
        let (_, finer) = self.options.stages();
        let refined = finer.last().map(|last| self.register_in(task, task.frame.source(), guess, (last, &[])));
        refined.filter(Candidate::is_good).unwrap_or_else(|| self.register(task, guess))
    }

    /// Registers the whole cloud from a guess, and assesses the result.
    pub(super) fn register(&self, task: &Task<'_>, guess: Pose3) -> Candidate {
        self.register_from(task, task.frame.source(), guess)
    }

    /// Registers a few of the points.
    pub(super) fn register_sample(&self, task: &Task<'_>, guess: Pose3) -> Candidate {
        self.register_from(task, task.frame.at_most(ROUGH_POINTS).source(), guess)
    }

    fn register_from(&self, task: &Task<'_>, source: Source<'_, Vector3<f64>>, guess: Pose3) -> Candidate {
        let (first, finer) = self.options.stages();
        self.register_in(task, source, guess, (&first, &finer))
    }

    fn register_in(
        &self,
        task: &Task<'_>,
        source: Source<'_, Vector3<f64>>,
        guess: Pose3,
        stages: (&IcpOptions, &[IcpOptions]),
    ) -> Candidate {
        let solver = self.options.motion.solver();
        let registration = register_in_space(self.options.metric, source, &task.target, guess, stages, &solver);
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
        let from = |guess| register_in_space(metric, sample.source(), &task.target, guess, (first, finer), &solver);
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
                &task.target,
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
}

impl Target for CloudTarget<'_> {
    type Point = Vector3<f64>;

    fn nearest(&self, query: &Vector3<f64>, max_distance: f64) -> Option<Neighbor> {
        match self {
            Self::Tree(cloud) => cloud.nearest(query, max_distance),
            Self::Map(map) => map.nearest(query, max_distance),
        }
    }

    fn nearest_again(
        &self,
        query: &Vector3<f64>,
        max_distance: f64,
        last: &mut LastSearch<Vector3<f64>>,
    ) -> Option<Neighbor> {
        match self {
            Self::Tree(cloud) => cloud.nearest_again(query, max_distance, last),
            Self::Map(map) => map.nearest_again(query, max_distance, last),
        }
    }

    fn point(&self, index: u32) -> Vector3<f64> {
        match self {
            Self::Tree(cloud) => cloud.point(index),
            Self::Map(map) => map.point(index),
        }
    }

    fn normal(&self, index: u32) -> Option<Vector3<f64>> {
        match self {
            Self::Tree(cloud) => cloud.normal(index),
            Self::Map(map) => map.normal(index),
        }
    }
}

impl SurfaceTarget for CloudTarget<'_> {}
