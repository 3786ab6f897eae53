//! The chain of depth frames: each is registered to the map of the frames before it.
//!
//! What starts a registration is chosen by evidence: many guesses are scored by what the map's view says of the frame,
//! the best few are refined, and the one that is contradicted least is kept. No motion model is trusted: robots stop
//! and turn. A result that is still contradicted starts a search all around before it is given up.

mod color;
mod evidence;
mod found;
mod guesses;
mod lattice;
mod lone_frame;
mod matching;
mod open_direction;
mod seen;
mod surfel_cloud;

use serde::{Deserialize, Serialize};

pub(crate) use self::evidence::{AGREEING_COSINE, FINE_TOLERANCE, score};
use self::found::Found;
pub(crate) use self::guesses::{around, best_apart};
pub use self::lone_frame::{LoneFrame, Search};
use self::matching::Matching;
pub(crate) use self::matching::{fine_options, middle_options};
pub(crate) use self::open_direction::OpenDirection;
use self::seen::Seen;
pub(crate) use self::surfel_cloud::{AllSurfels, SurfelCloud};
use crate::camera::surfel_image::SurfelImage;
use crate::geometry::Pose3;
use crate::key_views::apart;
use crate::registration::solver::Motion;
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

/// What colours are used for in the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum ColorUse {
    /// Every frame that has them, as far as they fit.
    #[default]
    Used,
    /// Frames whose surfaces leave a direction open.
    WhereOpen,
    /// Nothing.
    NotUsed,
}

/// All options of [`DepthOdometry`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DepthOptions {
    /// How the camera moves. Where it is planar, the first camera's y axis stands upright on the floor.
    pub motion: Motion,
    /// How hard a first guess is looked for.
    pub effort: Effort,
    /// What colours are used for, where frames have them.
    pub color: ColorUse,
}

/// Frame-to-map odometry in space. The world frame is the frame of the first camera.
#[derive(Clone)]
pub struct DepthOdometry {
    options: DepthOptions,
    seen: Seen,
    unconfirmed: Option<Unconfirmed>,
    correction: Option<Correction>,
    /// Frames registered so far; also the number of the next one.
    num_frames: u32,
    T_world_last: Pose3,
    last_motion: Pose3,
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

/// Another place than where the last frame was is believed when it agrees better by this share ...
const BETTER_AGREEMENT: f64 = 0.02;
/// ... and has so much more support.
const BETTER_SUPPORT: f64 = 0.05;
/// Poses nearer to each other than this are the same (m, turns included).
const SAME_PLACE: f64 = 0.05;
/// Fewer pieces of surface than this make no frame.
const MIN_SURFELS: usize = 200;

impl DepthOdometry {
    /// Odometry without frames.
    pub fn new(options: DepthOptions) -> Self {
        Self {
            options,
            seen: Seen::default(),
            unconfirmed: None,
            correction: None,
            num_frames: 0,
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
        self.num_frames += 1;
        estimate
    }

    /// How the frames before the last one are to be moved, where that one has told. It is told once.
    pub fn take_correction(&mut self) -> Option<Correction> {
        self.correction.take()
    }

    /// Moves what each frame has shown by `motion` (of the world) of its number, frames being counted from 0, and the next
    /// frame is looked for from where that leaves the last one.
    pub fn move_frames(&mut self, motion: impl Fn(u32) -> Pose3) {
        self.seen.move_frames(&motion);
        if let Some(unconfirmed) = &mut self.unconfirmed {
            unconfirmed.before.move_frames(&motion);
        }
        self.T_world_last = motion(self.num_frames.saturating_sub(1)) * self.T_world_last;
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
            self.seen.insert(frame, self.num_frames, &T_world_sensor, &view);
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
            Effort::Thorough => {
                matching.best_of(&guesses::near(&self.T_world_last, &self.last_motion), &self.T_world_last)
            }
            Effort::Quick => matching.best_of(&guesses::few(&self.T_world_last, &self.last_motion), &self.T_world_last),
        };
        if self.options.effort == Effort::Quick && found.verdict().status != Status::Good {
            found = matching.best_of(&guesses::near(&self.T_world_last, &self.last_motion), &self.T_world_last);
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
        self.seen.insert(frame, self.num_frames, &T_world_sensor, &found.view);
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
}
