//! The chain of depth frames: each is registered to the map of the frames before it.
//!
//! What starts a registration is chosen by evidence: many guesses are scored by what the map's view says of the frame,
//! the best few are refined, and the one that is contradicted least is kept. No motion model is trusted: robots stop
//! and turn. A result that is still contradicted starts a search all around before it is given up.

use nalgebra::{Isometry3, Matrix3, Vector3};

use serde::{Deserialize, Serialize};

use crate::camera::surfel_image::SurfelImage;
use crate::geometry::Pose3;
use crate::geometry::rotation::angle_of;
use crate::key_views::{KeyViews, apart};
use crate::registration::factors::PointToSurfel;
use crate::registration::icp::{Criteria, IcpOptions, Rejection, Source, Weighting, register_with};
use crate::registration::projective::{ProjectiveTarget, Sight};
use crate::registration::robust_kernel::RobustKernel;
use crate::registration::solver::{Motion, Solver};
pub use crate::registration::spatial::SpatialRegistration;
use crate::surfel_map::SurfelMap;
use crate::verdict::{Status, Verdict};

/// Where a frame was found, and why that is believed or not.
pub struct SpatialEstimate {
    /// Pose of the sensor in the frame of the first one. Where the frame is lost, it is that of the last one found.
    pub T_world_sensor: Pose3,
    /// The registration; `None` for the first frame and for frames without surfaces.
    pub registration: Option<SpatialRegistration>,
    /// Share of the frame's surface that lies on what was seen before, 0..=1.
    pub overlap: f64,
    /// Whether it is believed.
    pub verdict: Verdict,
}

/// How hard a first guess is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Effort {
    /// Every frame is looked for in hundreds of places.
    #[default]
    Thorough,
    /// A frame is looked for in a few dozen places, and in hundreds only when that is doubtful; with fewer points.
    Quick,
}

/// All options of [`DepthOdometry`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DepthOptions {
    /// How the camera moves. Where it is planar, the first camera's y axis stands upright on the floor.
    pub motion: Motion,
    /// How hard a first guess is looked for.
    pub effort: Effort,
}

/// Frame-to-map odometry in space. The world frame is the frame of the first camera.
#[derive(Clone)]
pub struct DepthOdometry {
    options: DepthOptions,
    seen: Seen,
    unconfirmed: Option<Unconfirmed>,
    correction: Option<Correction>,
    T_world_last: Pose3,
    last_motion: Pose3,
}

/// What frames that are part of the map have shown.
#[derive(Clone, Default)]
struct Seen {
    map: SurfelMap,
    key_views: KeyViews,
}

impl Seen {
    /// `view` is the map as seen from about there.
    fn insert(&mut self, frame: &SurfelImage, T_world_camera: &Pose3, view: &ProjectiveTarget) {
        self.map.insert(frame, T_world_camera, view);
        self.key_views.add(frame, T_world_camera);
    }
}

/// Frames since one whose place was left open along a direction: where that one is off, so are those after it.
#[derive(Clone)]
struct Unconfirmed {
    /// What was seen before them.
    before: Seen,
    /// Whether their own place is open, one a frame.
    are_open: Vec<bool>,
}

/// What is found out later about the frames before one: it knew where it was from what was seen before all of them.
#[derive(Debug, Clone)]
pub struct Correction {
    /// One motion (of the world's frame) for each of the frames before, the latest last.
    pub motions: Vec<Pose3>,
}

impl Unconfirmed {
    /// The frames whose own place is open share what was found in the end, all others are off by all that came before.
    fn corrected_by(&self, motion: &Pose3) -> Correction {
        let num_open = self.are_open.iter().filter(|is_open| **is_open).count().max(1) as f64;
        let mut passed = 0.0;
        let share = |&is_open: &bool| {
            passed += f64::from(u8::from(is_open));
            Pose3::identity().try_lerp_slerp(motion, passed / num_open, 1e-9).unwrap_or(*motion)
        };
        Correction { motions: self.are_open.iter().map(share).collect() }
    }
}

/// Points that score a guess: hundreds of guesses are looked at.
const SPARSE_POINTS: usize = 250;
/// Points that refine the best guesses.
const MIDDLE_POINTS: usize = 800;
/// Points of the registration itself, ...
const FINE_POINTS: usize = 3000;
/// ... and where it is to be quick.
const QUICK_POINTS: usize = 1200;
/// Guesses that are refined with few points, ...
const ROUGH_GUESSES: usize = 8;
/// ... and of these with more.
const REFINED_GUESSES: usize = 3;
/// Guesses nearer to each other than this (m) ...
const SAME_GUESS_TRANSLATION: f64 = 0.3;
/// ... and this (rad) end in the same place.
const SAME_GUESS_ROTATION: f64 = 0.1;
/// Surfaces agree with a rough guess when they are this near (m), ...
const ROUGH_TOLERANCE: f64 = 0.1;
/// ... and with a refined one when they are this near.
const FINE_TOLERANCE: f64 = 0.03;
/// Taken off the support for every metre, and for every radian, from where the last frame was.
const FAR_AWAY: f64 = 0.01;
/// As far (m, and rad added) as guesses near the last frame go ...
const SEARCH_REACH: f64 = 1.3;
/// ... and what is taken off for what is beyond.
const BEYOND_SEARCH: f64 = 0.2;
/// Another place than where the last frame was is believed when it agrees better by this share ...
const BETTER_AGREEMENT: f64 = 0.02;
/// ... and has so much more support.
const BETTER_SUPPORT: f64 = 0.05;
/// Places that look most like a frame that is nowhere near: so many are looked at.
const PLACES_ANYWHERE: usize = 6;
/// A place far from where the last frame was is believed when so much of the frame lies on it ...
const UNMISTAKABLE_OVERLAP: f64 = 0.5;
/// ... and so much of it agrees.
const UNMISTAKABLE_AGREEMENT: f64 = 0.98;
/// What was seen before frames in doubt holds a frame after them when it shows so much of it.
const ANCHORING_OVERLAP: f64 = 0.25;
/// Poses nearer to each other than this are the same (m, turns included).
const SAME_PLACE: f64 = 0.05;
/// Surfaces that agree face the same way (cosine).
const AGREEING_COSINE: f64 = 0.8;

/// Fewer pieces of surface than this make no frame.
const MIN_SURFELS: usize = 200;
/// A frame of which less than this share lies on the map is not believed: nothing ties it down.
const LOST_OVERLAP: f64 = 0.1;
/// Below this share of agreeing surface a registration is not believed ... On the recordings at hand, with up to three
/// frames of four left out, right registrations agree by 0.95 to 1, and ones that are wrong by half a metre mostly by less
/// than 0.9.
const LOST_AGREEMENT: f64 = 0.85;
/// ... and below this it is doubtful, and no part of the map.
const DOUBTFUL_AGREEMENT: f64 = 0.95;

impl DepthOdometry {
    /// Odometry without frames.
    pub fn new(options: DepthOptions) -> Self {
        Self {
            options,
            seen: Seen::default(),
            unconfirmed: None,
            correction: None,
            T_world_last: Pose3::identity(),
            last_motion: Pose3::identity(),
        }
    }

    /// Registers the next frame. A frame that is lost or contradicted is not added to the map, and the frames after it are looked for
    /// from where the last one was found.
    ///
    /// What it tells of the frames before is to be [taken](Self::take_correction) after it.
    pub fn register_frame(&mut self, frame: &SurfelImage) -> SpatialEstimate {
        let estimate = self.register(frame);
        if let Some(unconfirmed) = &mut self.unconfirmed {
            let is_open = estimate.verdict.status == Status::Doubtful;
            unconfirmed.are_open.push(is_open);
        }
        estimate
    }

    /// How the frames before the last one are to be moved, where that one has told. It is told once.
    pub fn take_correction(&mut self) -> Option<Correction> {
        self.correction.take()
    }

    fn register(&mut self, frame: &SurfelImage) -> SpatialEstimate {
        let num_surfels = frame.surfels().count();
        if num_surfels < MIN_SURFELS {
            let reason = format!("{num_surfels} pieces of surface could be told, too few to place it");
            return self.lost(reason, 0.0);
        }
        if self.seen.map.is_empty() {
            let T_world_sensor = self.T_world_last;
            let view = self.seen.map.view(frame, &T_world_sensor);
            self.seen.insert(frame, &T_world_sensor, &view);
            return SpatialEstimate { T_world_sensor, registration: None, overlap: 1.0, verdict: Verdict::first() };
        }
        let found = self.search(frame);
        if found.is_contradicted() || !found.registration.converged {
            return self.doubt(found);
        }
        self.believe(frame, found)
    }

    /// The map so far.
    pub fn map(&self) -> &SurfelMap {
        &self.seen.map
    }

    /// Near where the last frame was, then all around, then in all places seen before: as far as the evidence sends it.
    fn search(&self, frame: &SurfelImage) -> Found {
        let matching = Matching::new(&self.seen, frame, self.options);
        let mut found = match self.options.effort {
            Effort::Thorough => matching.best_of(&self.near_guesses(), &self.T_world_last),
            Effort::Quick => matching.best_of(&self.few_guesses(), &self.T_world_last),
        };
        if self.options.effort == Effort::Quick && found.verdict().status != Status::Good {
            found = matching.best_of(&self.near_guesses(), &self.T_world_last);
        }
        if found.is_contradicted() {
            let again = matching.best_of_all_around(&self.T_world_last);
            let is_better =
                again.agreement > found.agreement + BETTER_AGREEMENT && again.support > found.support + BETTER_SUPPORT;
            if is_better && again.is_anchored() {
                found = again;
            }
        }
        if found.is_contradicted()
            && let Some(elsewhere) = matching.best_of_everywhere().filter(Found::is_unmistakable)
        {
            found = elsewhere;
        }
        found
    }

    /// A frame that nothing contradicts becomes part of the map. Where its place is open along a direction, it does so until
    /// a frame after it tells, from what was seen before it, where it really is.
    fn believe(&mut self, frame: &SurfelImage, mut found: Found) -> SpatialEstimate {
        if found.is_open {
            let before = || Unconfirmed { before: self.seen.clone(), are_open: Vec::new() };
            self.unconfirmed.get_or_insert_with(before);
        } else if let Some(unconfirmed) = self.unconfirmed.take() {
            let T_world_found = found.registration.T_target_source;
            let anchored = Matching::new(&unconfirmed.before, frame, self.options).settled(T_world_found);
            let T_world_anchored = anchored.registration.T_target_source;
            if !anchored.is_anchored() {
                self.unconfirmed = Some(unconfirmed);
            } else if apart(&T_world_anchored, &T_world_found) > SAME_PLACE {
                self.correction = Some(unconfirmed.corrected_by(&(T_world_anchored * T_world_found.inverse())));
                self.seen = unconfirmed.before;
                found = anchored;
            }
        }
        let (verdict, overlap) = (found.verdict(), found.overlap);
        let T_world_sensor = found.registration.T_target_source;
        self.seen.insert(frame, &T_world_sensor, &found.view);
        self.move_to(T_world_sensor);
        SpatialEstimate { T_world_sensor, registration: Some(found.registration), overlap, verdict }
    }

    /// A frame that is contradicted is no part of the map.
    fn doubt(&mut self, found: Found) -> SpatialEstimate {
        let (verdict, overlap) = (found.verdict(), found.overlap);
        if verdict.status == Status::Lost {
            return SpatialEstimate { registration: Some(found.registration), ..self.lost(verdict.reason, overlap) };
        }
        let T_world_sensor = found.registration.T_target_source;
        self.move_to(T_world_sensor);
        SpatialEstimate { T_world_sensor, registration: Some(found.registration), overlap, verdict }
    }

    fn move_to(&mut self, T_world_sensor: Pose3) {
        self.last_motion = self.T_world_last.inverse() * T_world_sensor;
        self.T_world_last = T_world_sensor;
    }

    fn lost(&self, reason: String, overlap: f64) -> SpatialEstimate {
        let verdict = Verdict { status: Status::Lost, reason, agreement: 0.0 };
        SpatialEstimate { T_world_sensor: self.T_world_last, registration: None, overlap, verdict }
    }

    /// The last pose, the last motion once more, turns about the camera's vertical by up to 30 degrees and moves of up to
    /// three quarters of a metre ahead and a quarter aside.
    fn near_guesses(&self) -> Vec<Pose3> {
        let mut guesses = vec![self.T_world_last, self.T_world_last * self.last_motion];
        guesses.extend(around(&self.T_world_last, -6..=6, 5f64.to_radians(), 3, 1));
        guesses
    }

    /// The same by coarser turns and without moves aside.
    fn few_guesses(&self) -> Vec<Pose3> {
        let mut guesses = vec![self.T_world_last, self.T_world_last * self.last_motion];
        guesses.extend(around(&self.T_world_last, -4..=4, 7.5f64.to_radians(), 2, 0));
        guesses
    }
}

/// Poses around a pose: turns about the camera's vertical by multiples of `turn` (rad), moves by multiples of a quarter of
/// a metre, up to `ahead` of them ahead and back and up to `aside` of them to either side.
fn around(
    T_world_camera: &Pose3,
    turns: std::ops::RangeInclusive<i32>,
    turn: f64,
    ahead: i32,
    aside: i32,
) -> impl Iterator<Item = Pose3> {
    const STEP: f64 = 0.25;
    let T = *T_world_camera;
    turns.flat_map(move |turns| {
        (-ahead..=ahead).flat_map(move |ahead| {
            (-aside..=aside).map(move |aside| {
                let translation = Vector3::new(f64::from(aside) * STEP, 0.0, f64::from(ahead) * STEP);
                T * Isometry3::new(translation, Vector3::y() * (f64::from(turns) * turn))
            })
        })
    })
}

/// A frame that is being looked for in a map.
struct Matching<'a> {
    seen: &'a Seen,
    frame: &'a SurfelImage,
    /// The frame as its own camera sees it: what the map's surfaces are held against.
    own_view: ProjectiveTarget,
    sparse: SurfelCloud,
    middle: SurfelCloud,
    fine: SurfelCloud,
    solver: Solver<6>,
}

/// A registration with what speaks for and against it.
struct Found {
    registration: SpatialRegistration,
    /// The map as seen from about there.
    view: ProjectiveTarget,
    support: f64,
    overlap: f64,
    agreement: f64,
    /// Whether it might as well stand somewhere else along a direction.
    is_open: bool,
}

impl Found {
    /// Whether it stands in free space, or on nothing that is known.
    fn is_contradicted(&self) -> bool {
        self.overlap < LOST_OVERLAP || self.agreement < DOUBTFUL_AGREEMENT
    }

    /// Whether it is beyond doubt though it is far from where the last frame was.
    fn is_unmistakable(&self) -> bool {
        self.overlap > UNMISTAKABLE_OVERLAP
            && self.agreement > UNMISTAKABLE_AGREEMENT
            && !self.is_open
            && self.registration.converged
    }

    /// Whether what has been seen holds it in all directions.
    fn is_anchored(&self) -> bool {
        self.overlap > ANCHORING_OVERLAP && !self.is_contradicted() && !self.is_open && self.registration.converged
    }

    fn verdict(&self) -> Verdict {
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let with = |status, reason| Verdict { status, reason, agreement: self.agreement };
        if self.overlap < LOST_OVERLAP {
            let reason = format!("only {} of its surface lies on the map: too little overlap", percent(self.overlap));
            return with(Status::Lost, reason);
        }
        if self.agreement < LOST_AGREEMENT {
            let reason = format!(
                "{} of the surface in view stands where it or the map saw free space: it shows another place, or the \
                 motion is larger than the search",
                percent(1.0 - self.agreement)
            );
            return with(Status::Lost, reason);
        }
        if self.agreement < DOUBTFUL_AGREEMENT {
            let reason = format!("{} of the surface in view stands in free space", percent(1.0 - self.agreement));
            return with(Status::Doubtful, reason);
        }
        if self.is_open {
            return with(Status::Doubtful, "the surfaces in view leave the position along one direction open".into());
        }
        if !self.registration.converged {
            let iterations = self.registration.history.len();
            return with(Status::Doubtful, format!("it was still moving after {iterations} iterations"));
        }
        with(Status::Good, String::new())
    }
}

impl<'a> Matching<'a> {
    fn new(seen: &'a Seen, frame: &'a SurfelImage, options: DepthOptions) -> Self {
        let cloud = SurfelCloud::new(frame);
        Self {
            seen,
            frame,
            own_view: ProjectiveTarget::draw((0..).zip(frame.surfels()), &frame.cell_camera(), &Pose3::identity()),
            sparse: cloud.at_most(SPARSE_POINTS),
            middle: cloud.at_most(MIDDLE_POINTS),
            fine: cloud.at_most(if options.effort == Effort::Quick { QUICK_POINTS } else { FINE_POINTS }),
            solver: options.motion.solver(),
        }
    }

    /// The registration that the best of these guesses leads to; the map is seen from `T_world_view` at first.
    fn best_of(&self, guesses: &[Pose3], T_world_view: &Pose3) -> Found {
        let view = self.seen.map.view(self.frame, T_world_view);
        let scored = guesses.iter().map(|guess| (score(&view, &self.sparse, guess), *guess));
        self.refine(&view, scored.collect(), T_world_view)
    }

    /// The same for turns by any angle and moves of up to a metre around a pose.
    fn best_of_all_around(&self, T_world_last: &Pose3) -> Found {
        let quarters = [0, 1, 2, 3].map(|quarter| {
            let turned = T_world_last * Isometry3::rotation(Vector3::y() * f64::from(quarter) * 90f64.to_radians());
            let view = self.seen.map.view(self.frame, &turned);
            let guesses = around(&turned, -6..=6, 7.5f64.to_radians(), 4, 4);
            let scored: Vec<_> = guesses.map(|guess| (score(&view, &self.sparse, &guess), guess)).collect();
            self.refine(&view, scored, T_world_last)
        });
        let [first, others @ ..] = quarters;
        others.into_iter().fold(first, |best, next| if next.support > best.support { next } else { best })
    }

    /// From scored guesses to one registration: few points for many guesses, more points for few.
    fn refine(&self, view: &ProjectiveTarget, scored: Vec<(f64, Pose3)>, T_world_last: &Pose3) -> Found {
        let rough = best_apart(scored, ROUGH_GUESSES).into_iter().map(|guess| {
            let refined = self.register_to(view, &self.sparse, guess, &rough_options()).T_target_source;
            (self.evidence(view, &self.sparse, &refined).support - unlikelihood(T_world_last, &refined), refined)
        });
        let refined = best_apart(rough.collect(), REFINED_GUESSES).into_iter().map(|guess| {
            let refined = self.register_to(view, &self.middle, guess, &middle_options()).T_target_source;
            (self.evidence(view, &self.middle, &refined).support - unlikelihood(T_world_last, &refined), refined)
        });
        let best = best_apart(refined.collect(), 1).first().copied().unwrap_or_else(Pose3::identity);

        self.settled(best)
    }

    /// In the places of all key frames: where this frame looks like one of them, if anywhere.
    fn best_of_everywhere(&self) -> Option<Found> {
        let mut scored = Vec::new();
        for key_view in self.seen.key_views.all() {
            for T_key_camera in around(&Pose3::identity(), -2..=2, 15f64.to_radians(), 1, 1) {
                scored.push((
                    score(key_view.view(), &self.sparse, &T_key_camera),
                    key_view.T_world_camera * T_key_camera,
                ));
            }
        }
        let found = best_apart(scored, PLACES_ANYWHERE).into_iter().map(|guess| {
            let view = self.seen.map.view(self.frame, &guess);
            self.refine(&view, vec![(0.0, guess)], &guess)
        });
        found.max_by(|a, b| a.support.total_cmp(&b.support))
    }

    /// The registration near a guess, with places along a direction that it leaves open compared.
    fn settled(&self, guess: Pose3) -> Found {
        self.settle(self.register_finely(guess))
    }

    fn register_finely(&self, guess: Pose3) -> Found {
        let view = self.seen.map.view(self.frame, &guess);
        let registration = self.register_to(&view, &self.fine, guess, &fine_options());
        let Evidence { support, overlap, agreement } =
            self.evidence(&view, &self.middle, &registration.T_target_source);
        Found { registration, view, support, overlap, agreement, is_open: false }
    }

    /// Where hardly any surface holds a direction, the borders of things may: the registration does not see them, but what
    /// stands in free space tells. Places along that direction are compared by it, and not by how much of the map they
    /// see: that is most where nothing new is in view.
    fn settle(&self, found: Found) -> Found {
        let Some(open) = OpenDirection::of(&found.registration) else { return found };
        let here = self.agreement_at(&found, &open, 0).0;
        let elsewhere = self.best_elsewhere(&found, &open);
        let (mut found, mut is_told) = (found, elsewhere.0 < here - TELLING_AGREEMENT);
        if elsewhere.0 > here + TELLING_AGREEMENT {
            let other = self.register_finely(elsewhere.1);
            if other.agreement > found.agreement + TELLING_AGREEMENT {
                is_told = self.best_elsewhere(&other, &open).0 < other.agreement - TELLING_AGREEMENT;
                found = other;
            }
        }
        found.is_open = !is_told;
        found
    }

    /// The agreement so many places along an open direction, and where that is.
    fn agreement_at(&self, found: &Found, open: &OpenDirection, place: i32) -> (f64, Pose3) {
        let moved = open.direction * (f64::from(place) * BETWEEN_PLACES);
        let pose = Pose3::translation(moved.x, moved.y, moved.z) * found.registration.T_target_source;
        (self.evidence(&found.view, &self.middle, &pose).agreement, pose)
    }

    fn best_elsewhere(&self, found: &Found, open: &OpenDirection) -> (f64, Pose3) {
        let places = (-PLACES..=PLACES).filter(|place| *place != 0);
        let agreements = places.map(|place| self.agreement_at(found, open, place));
        agreements.fold((0.0, Pose3::identity()), |best, next| if next.0 > best.0 { next } else { best })
    }

    fn register_to(
        &self,
        view: &ProjectiveTarget,
        cloud: &SurfelCloud,
        guess: Pose3,
        options: &IcpOptions,
    ) -> SpatialRegistration {
        register_with::<3, 6, Pose3, PointToSurfel>(cloud.source(), view, guess, options, &self.solver)
    }

    /// The frame's surface held against the map's view, and the map's against the frame's own.
    fn evidence(&self, view: &ProjectiveTarget, cloud: &SurfelCloud, T_world_camera: &Pose3) -> Evidence {
        let (R, t) = parts(T_world_camera);
        let mut frame_in_map = Tally::default();
        let witnesses = self.seen.key_views.near(T_world_camera);
        for (point, normal) in cloud.points.iter().zip(&cloud.normals) {
            let (point, normal) = (R * point + t, R * normal);
            match view.look_around(&point, FINE_TOLERANCE) {
                Sight::Agreeing(seen) if seen.normal.dot(&normal) > AGREEING_COSINE => frame_in_map.agreeing += 1.0,
                _ if witnesses.iter().any(|witness| witness.saw_through(&point)) => frame_in_map.against += 1.0,
                _ => {}
            }
        }
        let (R, t) = parts(&T_world_camera.inverse());
        let mut map_in_frame = Tally::default();
        for surfel in view.surfels().iter().step_by(view.len().div_ceil(cloud.points.len()).max(1)) {
            map_in_frame.add(self.own_view.look_around(&(R * surfel.point + t), FINE_TOLERANCE), &(R * surfel.normal));
        }
        let agreeing = frame_in_map.agreeing + map_in_frame.agreeing;
        let against = frame_in_map.against + map_in_frame.against;
        let overlap = frame_in_map.agreeing / cloud.points.len().max(1) as f64;
        let agreement = agreeing / (agreeing + against).max(1.0);
        // What is contradicted counts against a pose more than what fits counts for it: walls fit in many ways.
        let support = (agreeing - 2.0 * against) / (2 * cloud.points.len().max(1)) as f64;
        Evidence { support, overlap, agreement }
    }
}

/// A direction is held by the surfaces that face along it at least so much (cosine), ...
const HOLDING_COSINE: f64 = 0.3;
/// ... if they are at least this share of all.
const HOLDING_SHARE: f64 = 0.01;
/// Places along an open direction that are compared, so many either way ...
const PLACES: i32 = 10;
/// ... and so far apart (m).
const BETWEEN_PLACES: f64 = 0.1;
/// A place is told from another when it agrees so much better.
const TELLING_AGREEMENT: f64 = 0.01;

/// The direction of motion that is known least, where hardly any surface faces along it. Long walls do not add up to one
/// that faces the other way, however many there are and however noisy their normals.
struct OpenDirection {
    direction: Vector3<f64>,
}

impl OpenDirection {
    fn of(registration: &SpatialRegistration) -> Option<Self> {
        let fitting = registration.correspondences.iter().filter(|pair| pair.residual.abs() < FINE_TOLERANCE);
        let normals: Vec<Vector3<f64>> = fitting.filter_map(|pair| pair.normal).collect();
        let spread: Matrix3<f64> = normals.iter().map(|normal| normal * normal.transpose()).sum();
        let eigen = spread.symmetric_eigen();
        let direction = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let num_holding = normals.iter().filter(|normal| normal.dot(&direction).abs() > HOLDING_COSINE).count();
        ((num_holding as f64) < HOLDING_SHARE * normals.len() as f64).then_some(Self { direction })
    }
}

struct Evidence {
    support: f64,
    overlap: f64,
    agreement: f64,
}

#[derive(Default)]
struct Tally {
    agreeing: f64,
    against: f64,
}

impl Tally {
    fn add(&mut self, sight: Sight<'_>, normal: &Vector3<f64>) {
        match sight {
            Sight::Agreeing(seen) if seen.normal.dot(normal) > AGREEING_COSINE => self.agreeing += 1.0,
            Sight::InFreeSpace => self.against += 1.0,
            Sight::Agreeing(_) | Sight::Hidden | Sight::Unknown => {}
        }
    }
}

/// What speaks for a guess, cheaply: the share of the points that agree with the view, less those in its free space.
fn score(view: &ProjectiveTarget, cloud: &SurfelCloud, T_world_camera: &Pose3) -> f64 {
    let (R, t) = parts(T_world_camera);
    let mut tally = Tally::default();
    for (point, normal) in cloud.points.iter().zip(&cloud.normals) {
        tally.add(view.look_at(&(R * point + t), ROUGH_TOLERANCE), &(R * normal));
    }
    (tally.agreeing - tally.against) / cloud.points.len().max(1) as f64
}

/// What a long way takes off the support: of two places that look the same, the nearer one is the likelier.
fn unlikelihood(T_world_last: &Pose3, T_world_camera: &Pose3) -> f64 {
    let moved = T_world_last.inverse() * T_world_camera;
    let far = moved.translation.vector.norm() + angle_of(&moved.rotation);
    FAR_AWAY * far + BEYOND_SEARCH * (far - SEARCH_REACH).max(0.0)
}

/// The best poses by their score, each apart from the ones before it.
fn best_apart(mut scored: Vec<(f64, Pose3)>, most: usize) -> Vec<Pose3> {
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut best: Vec<Pose3> = Vec::with_capacity(most);
    for (_, pose) in scored {
        let is_new = best.iter().all(|other| {
            let apart = other.inverse() * pose;
            apart.translation.vector.norm() > SAME_GUESS_TRANSLATION || apart.rotation.angle() > SAME_GUESS_ROTATION
        });
        if is_new {
            best.push(pose);
            if best.len() == most {
                break;
            }
        }
    }
    best
}

fn parts(T: &Pose3) -> (Matrix3<f64>, Vector3<f64>) {
    (T.rotation.to_rotation_matrix().into_inner(), T.translation.vector)
}

fn rough_options() -> IcpOptions {
    options((0.4, 0.7), 0.15, Criteria { max_iterations: 8, rotation_eps: 3e-3, translation_eps: 5e-3 })
}

fn middle_options() -> IcpOptions {
    options((0.3, 0.6), 0.08, Criteria { max_iterations: 15, rotation_eps: 1e-3, translation_eps: 2e-3 })
}

fn fine_options() -> IcpOptions {
    options((0.15, 0.5), 0.03, Criteria { max_iterations: 30, rotation_eps: 1e-4, translation_eps: 1e-4 })
}

/// Pairs within a distance (m) and an angle (rad), the kernel's width (m), and when to end.
fn options(
    (max_correspondence_distance, max_normal_angle): (f64, f64),
    robust_kernel_width: f64,
    criteria: Criteria,
) -> IcpOptions {
    IcpOptions {
        rejection: Rejection { max_correspondence_distance, max_normal_angle, trim_fraction: 0.0 },
        weighting: Weighting { robust_kernel: RobustKernel::GemanMcclure, robust_kernel_width },
        criteria,
    }
}

/// A frame's pieces of surface, column by column.
#[derive(Clone)]
pub(crate) struct SurfelCloud {
    points: Vec<Vector3<f64>>,
    normals: Vec<Vector3<f64>>,
    known_normals: Vec<Option<Vector3<f64>>>,
    deviations: Vec<f64>,
}

impl SurfelCloud {
    pub(crate) fn new(frame: &SurfelImage) -> Self {
        Self {
            points: frame.surfels().map(|surfel| surfel.point).collect(),
            normals: frame.surfels().map(|surfel| surfel.normal).collect(),
            known_normals: frame.surfels().map(|surfel| Some(surfel.normal)).collect(),
            deviations: frame.surfels().map(|surfel| surfel.deviation).collect(),
        }
    }

    /// About `most` of them, as many of every direction as there are, so that the few that hold a corridor's length count
    /// beside its long walls (Rusinkiewicz and Levoy, "Efficient variants of the ICP algorithm", 3DIM 2001).
    pub(crate) fn at_most(&self, most: usize) -> Self {
        let kept = even_over_directions(&self.normals, most);
        Self {
            points: kept.iter().map(|&index| self.points[index]).collect(),
            normals: kept.iter().map(|&index| self.normals[index]).collect(),
            known_normals: kept.iter().map(|&index| self.known_normals[index]).collect(),
            deviations: kept.iter().map(|&index| self.deviations[index]).collect(),
        }
    }

    pub(crate) fn source(&self) -> Source<'_, 3> {
        Source { points: &self.points, normals: Some(&self.known_normals), deviations: Some(&self.deviations) }
    }
}

/// Directions are told apart by which of their components are beyond this, and on which side.
const DIRECTION_COMPONENT: f64 = 0.4;
const NUM_DIRECTIONS: usize = 27;

/// Indices of about `most` of the normals in their order, evenly over their directions as far as there are enough.
fn even_over_directions(normals: &[Vector3<f64>], most: usize) -> Vec<usize> {
    let third =
        |component: f64| usize::from(component > -DIRECTION_COMPONENT) + usize::from(component > DIRECTION_COMPONENT);
    let direction = |normal: &Vector3<f64>| 9 * third(normal.x) + 3 * third(normal.y) + third(normal.z);
    let mut counts = [0usize; NUM_DIRECTIONS];
    for normal in normals {
        counts[direction(normal)] += 1;
    }
    // What small directions do not use up is shared among the larger ones.
    let mut by_size: [usize; NUM_DIRECTIONS] = std::array::from_fn(|index| index);
    by_size.sort_by_key(|&index| (counts[index], index));
    let (mut quotas, mut left) = ([0usize; NUM_DIRECTIONS], most);
    for (place, &index) in by_size.iter().enumerate() {
        quotas[index] = counts[index].min(left / (NUM_DIRECTIONS - place));
        left -= quotas[index];
    }
    let mut seen = [0usize; NUM_DIRECTIONS];
    let is_kept = |normal: &Vector3<f64>| {
        let index = direction(normal);
        let before = seen[index] * quotas[index] / counts[index];
        seen[index] += 1;
        seen[index] * quotas[index] / counts[index] > before
    };
    let kept: Vec<bool> = normals.iter().map(is_kept).collect();
    (0..normals.len()).filter(|&index| kept[index]).collect()
}
