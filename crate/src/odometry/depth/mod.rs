//! The chain of depth frames: each is registered to the map of the frames before it.
//!
//! What starts a registration is chosen by evidence: many guesses are scored by what the map's view says of the frame,
//! the best few are refined, and the one that is contradicted least is kept. No motion model is trusted: robots stop
//! and turn. A result that is still contradicted starts a search all around before it is given up.

mod chain;
mod color;
mod evidence;
mod grid_search;
mod hypotheses;
mod matching;
mod motion_prior;
mod pair_registration;
mod pose_hypothesis;
mod reference_map;
mod tentative_branch;
mod unregistered_frames;

use serde::{Deserialize, Serialize};

use self::chain::{Chain, Member};
pub(crate) use self::evidence::{AGREEING_COSINE, FINE_TOLERANCE, score};
pub(crate) use self::hypotheses::{best_distinct, grid_around};
pub(crate) use self::matching::{fine_options, middle_options};
pub use self::pair_registration::{PairRegistration, Search};
use self::unregistered_frames::UnregisteredFrames;
use crate::camera::surfel_image::SurfelImage;
use crate::geometry::Pose3;
use crate::map::surfel::SurfelMap;
use crate::odometry::assessment::{Assessment, Status};
use crate::registration::prepared_surfels::PreparedSurfels;
use crate::registration::solver::Motion;
pub use crate::registration::spatial::SpatialRegistration;

/// Where a frame was found, and why that is believed or not.
pub struct SpatialEstimate {
    /// Pose of the sensor in the frame of the first one. Where the frame is lost, it is that of the last one found.
    pub T_world_sensor: Pose3,
    /// The registration; `None` for the first frame and for frames without surfaces.
    pub registration: Option<SpatialRegistration>,
    /// Share of the frame's surface that lies on what was seen before, 0..=1.
    pub overlap: f64,
    /// Whether it is believed.
    pub assessment: Assessment,
    /// Whether it has become part of the map that frames are registered to.
    pub is_in_map: bool,
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

/// Whether a frame is held against what is known before it is believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Verification {
    /// Always.
    #[default]
    On,
    /// Each is taken to be where it fits best near the last one: what comes of that shows what verification brings.
    Off,
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
    /// Whether what is found is verified.
    pub verification: Verification,
}

/// Points of the registration itself, ...
const FINE_POINTS: usize = 3000;
/// ... and where it is to be quick.
const QUICK_POINTS: usize = 1200;

impl DepthOptions {
    /// Makes a frame ready to be registered with these options: what can be done before it is its turn.
    pub fn prepared(&self, frame: SurfelImage) -> PreparedSurfels {
        let num_fine = if self.effort == Effort::Quick { QUICK_POINTS } else { FINE_POINTS };
        PreparedSurfels::new(frame, num_fine)
    }
}

/// Frame-to-map odometry in space. The world frame is the frame of the first camera.
#[derive(Clone)]
pub struct DepthOdometry {
    options: DepthOptions,
    /// Frames registered so far; also the number of the next one.
    num_frames: u32,
    empty_map: SurfelMap,
    chain: Option<Chain>,
    /// Frames that do not fit the chain but each other. Should they become more, it is the chain that does not belong.
    rival_chain: Option<Chain>,
    unregistered_frames: UnregisteredFrames,
    pose_updates: Vec<PoseUpdate>,
    rounds: Option<RelocalizationRounds>,
}

/// Going through the frames that were not found, once all others are.
#[derive(Clone)]
struct RelocalizationRounds {
    num_left: usize,
    /// Those that are left of this round.
    to_try: Vec<u32>,
    /// Whether one has been found in it, so that there may be more.
    is_news: bool,
}

/// What is found out later about a frame.
#[derive(Clone)]
pub struct PoseUpdate {
    /// Its number in the order they were registered, from 0.
    pub frame: u32,
    /// Where it is now taken to be.
    pub T_world_sensor: Pose3,
    /// Whether that is believed.
    pub assessment: Assessment,
    /// The registration that tells, and the overlap, where there is a new one.
    pub registration: Option<(SpatialRegistration, f64)>,
}

/// Poses nearer to each other than this are the same (m, turns included).
const SAME_PLACE: f64 = 0.05;
/// Fewer pieces of surface than this make no frame.
const MIN_SURFELS: usize = 200;
/// So many frames that fit each other are more than those that do not fit them.
const MIN_MAJORITY: usize = 3;
/// A chain of more frames than this is kept beside the one that outnumbers it.
const ESTABLISHED: usize = 5;
/// Frames that were not found are tried so often once all others are.
const ROUNDS: usize = 3;
/// So many frames before one that was found are tried again, ...
const MAX_LOOK_BACK_FRAMES: u32 = 12;
/// ... until so many of them do not fit.
const MAX_LOOK_BACK_FAILURES: usize = 2;

impl DepthOdometry {
    /// Odometry without frames.
    pub fn new(options: DepthOptions) -> Self {
        Self {
            options,
            num_frames: 0,
            empty_map: SurfelMap::new(),
            chain: None,
            rival_chain: None,
            unregistered_frames: UnregisteredFrames::default(),
            pose_updates: Vec::new(),
            rounds: None,
        }
    }

    /// Registers the next frame. One that is lost or contradicted is not added to the map, and the frames after it are looked
    /// for from where the last one was found.
    ///
    /// What it tells of the frames before is to be [taken](Self::take_revisions) after it.
    pub fn register_frame(&mut self, frame: &PreparedSurfels) -> SpatialEstimate {
        let number = self.num_frames;
        self.num_frames += 1;
        self.rounds = None;
        let num_surfels = frame.image.surfels().count();
        if num_surfels < MIN_SURFELS {
            return self.blank(num_surfels);
        }
        let Some(chain) = &mut self.chain else {
            let (chain, estimate) = Chain::new(self.options, number, frame);
            self.chain = Some(chain);
            return estimate;
        };
        let is_gap = chain.num_frames_since_accepted() > 0;
        let chain::Outcome { estimate, confirmed, dropped, uncertain } = chain.register(number, frame);
        self.pose_updates.extend(confirmed.iter().map(PoseUpdate::of));
        self.pose_updates.extend(dropped.iter().map(PoseUpdate::of));
        if !estimate.is_in_map {
            self.unregistered_frames.push(number, frame, estimate.T_world_sensor);
            return self.extend_rival_chain(number, frame).unwrap_or(estimate);
        }
        if !chain.has_tentative_branches() {
            for member in confirmed {
                self.unregistered_frames.remove(member.number);
            }
        }
        for number in uncertain {
            self.unregistered_frames.remove(number);
        }
        if estimate.assessment.status != Status::Good || chain.has_tentative_branches() {
            // It may be dropped again.
            self.unregistered_frames.push(number, frame, estimate.T_world_sensor);
        }
        self.rival_chain = self.rival_chain.take().filter(|rival_chain| rival_chain.members().len() > ESTABLISHED);
        if is_gap {
            self.relocalize_before(number);
        }
        for member in dropped.iter().rev().take(MAX_LOOK_BACK_FRAMES as usize) {
            self.relocalize(member.number, false);
        }
        estimate
    }

    /// What has been found out of frames before, in the order in which it was. It is told once.
    pub fn take_pose_updates(&mut self) -> Vec<PoseUpdate> {
        std::mem::take(&mut self.pose_updates)
    }

    /// Moves what each frame has shown by `motion` (of the world) of its number, frames being counted from 0, and the next
    /// frame is looked for from where that leaves the last one.
    pub fn apply_corrections(&mut self, motion: impl Fn(u32) -> Pose3) {
        if let Some(chain) = &mut self.chain {
            chain.apply_corrections(&motion);
        }
        self.unregistered_frames.apply_corrections(&motion);
    }

    /// Tries one of the frames that were not found again, once no frame will follow; whether there may be more to try.
    pub fn relocalize_next(&mut self) -> bool {
        let Some(chain) = &mut self.chain else { return false };
        let rounds = self.rounds.get_or_insert_with(|| RelocalizationRounds {
            num_left: ROUNDS,
            to_try: Vec::new(),
            is_news: true,
        });
        if rounds.to_try.is_empty() {
            if rounds.num_left == 0 || !rounds.is_news {
                return false;
            }
            let to_try =
                self.unregistered_frames.numbers().into_iter().filter(|number| !chain.is_member(*number)).collect();
            *rounds = RelocalizationRounds { num_left: rounds.num_left - 1, to_try, is_news: false };
        }
        let Some(number) = rounds.to_try.pop() else { return false };
        if self.relocalize(number, true)
            && let Some(rounds) = &mut self.rounds
        {
            // What it shows may tell where the others are.
            rounds.is_news = true;
        }
        true
    }

    /// The map so far.
    pub fn map(&self) -> &SurfelMap {
        self.chain.as_ref().map_or(&self.empty_map, |chain| &chain.seen().map)
    }

    fn blank(&self, num_surfels: usize) -> SpatialEstimate {
        let reason = format!("{num_surfels} pieces of surface could be told, too few to place it");
        match &self.chain {
            Some(chain) => chain.lost(reason, 0.0),
            None => SpatialEstimate {
                T_world_sensor: Pose3::identity(),
                registration: None,
                overlap: 0.0,
                assessment: Assessment { status: Status::Lost, reason, agreement: 0.0 },
                is_in_map: false,
            },
        }
    }

    /// Tries the frames before one that was found, backwards from there.
    fn relocalize_before(&mut self, number: u32) {
        let mut num_failures = 0;
        for earlier in (number.saturating_sub(MAX_LOOK_BACK_FRAMES)..number).rev() {
            if self.chain.as_ref().is_some_and(|chain| chain.is_member(earlier)) {
                break;
            }
            if self.unregistered_frames.get(earlier).is_some() && !self.relocalize(earlier, false) {
                num_failures += 1;
                if num_failures == MAX_LOOK_BACK_FAILURES {
                    break;
                }
            }
        }
    }

    /// Looks for a frame that was left out again; whether it was found.
    fn relocalize(&mut self, number: u32, everywhere: bool) -> bool {
        let (Some(chain), Some(left)) = (&mut self.chain, self.unregistered_frames.get(number)) else { return false };
        let Some(found) = chain.relocalize(left, everywhere) else { return false };
        let assessment = Assessment { status: Status::Good, reason: String::new(), agreement: found.agreement };
        let estimate = chain.insert(number, &left.frame, found, assessment);
        self.unregistered_frames.remove(number);
        self.pose_updates.push(PoseUpdate::found(number, estimate));
        true
    }

    /// Frames that the chain does not place are chained aside. Where those that fit each other have become more, they are the
    /// chain; then this is where the frame is.
    fn extend_rival_chain(&mut self, number: u32, frame: &PreparedSurfels) -> Option<SpatialEstimate> {
        let Some(rival_chain) = &mut self.rival_chain else {
            self.rival_chain = Some(Chain::new(self.options, number, frame).0);
            return None;
        };
        let chain::Outcome { estimate, .. } = rival_chain.register_inside_gate(number, frame);
        let num_rival = rival_chain.members().len();
        if !estimate.is_in_map {
            if rival_chain.num_frames_since_accepted() as usize >= num_rival {
                self.rival_chain = Some(Chain::new(self.options, number, frame).0);
            }
            return None;
        }
        let num_members = self.chain.as_ref().map_or(0, |chain| chain.members().len());
        if num_rival < MIN_MAJORITY || num_rival <= num_members {
            return None;
        }
        self.promote_rival_chain(number);
        Some(estimate)
    }

    fn promote_rival_chain(&mut self, number: u32) {
        std::mem::swap(&mut self.chain, &mut self.rival_chain);
        let (Some(chain), Some(outnumbered)) = (&self.chain, &self.rival_chain) else { return };
        for member in outnumbered.members() {
            let mut assessment = Assessment { status: Status::Lost, reason: String::new(), agreement: 0.0 };
            assessment.mark_outnumbered();
            let T_world_sensor = Pose3::identity();
            self.pose_updates.push(PoseUpdate { frame: member.number, T_world_sensor, assessment, registration: None });
        }
        for member in chain.members() {
            self.unregistered_frames.remove(member.number);
            if member.number != number {
                self.pose_updates.push(PoseUpdate::of(member));
            }
        }
        self.rival_chain = self.rival_chain.take().filter(|rival_chain| rival_chain.members().len() > ESTABLISHED);
    }
}

impl PoseUpdate {
    fn of(member: &Member) -> Self {
        let Member { number, T_world_sensor, assessment } = member.clone();
        Self { frame: number, T_world_sensor, assessment, registration: None }
    }

    fn found(frame: u32, estimate: SpatialEstimate) -> Self {
        let SpatialEstimate { T_world_sensor, registration, overlap, assessment, .. } = estimate;
        let registration = registration.map(|registration| (registration, overlap));
        Self { frame, T_world_sensor, assessment, registration }
    }
}
