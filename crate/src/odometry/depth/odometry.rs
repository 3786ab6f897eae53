//! The odometry itself: the chain of frames, its rival, and the frames that wait for relocalization.

use super::chain::{self, Chain, MAX_UNESTABLISHED_FRAMES, Member};
use super::estimate::{PoseUpdate, SpatialEstimate};
use super::unregistered_frames::UnregisteredFrames;
use super::{ColorUse, DepthOptions};
use crate::geometry::Pose3;
use crate::odometry::assessment::{Assessment, Status};
use crate::preprocess::color_registration::OutlineContrast;
use crate::registration::prepared_surfels::PreparedSurfels;

/// Smallest number of surfels in a frame that is registered.
const MIN_SURFELS: usize = 200;
/// Smallest number of frames in a rival chain that replaces a shorter chain.
const MIN_MAJORITY: usize = 3;
/// Rounds of relocalization after the last frame.
const MAX_ROUNDS: usize = 3;
/// Frames before a registered one that are relocalized, ...
const MAX_LOOK_BACK_FRAMES: u32 = 12;
/// ... until this many of them fail.
const MAX_LOOK_BACK_FAILURES: usize = 2;

/// Frame-to-map odometry in space. The world frame is the frame of the first camera.
#[derive(Clone)]
pub struct DepthOdometry {
    options: DepthOptions,
    /// Whether the colours belong to the depth's pixels, as all frames so far tell.
    outline_contrast: OutlineContrast,
    /// Frames registered so far; also the number of the next one.
    num_frames: u32,
    /// `None` before the first frame.
    chain: Option<Chain>,
    /// Frames that fit each other but not the chain. If they become the majority, the chain is replaced.
    rival_chain: Option<Chain>,
    /// Frames that are not in the map, or may be removed from it.
    unregistered_frames: UnregisteredFrames,
    /// Changes that have not been taken yet.
    pose_updates: Vec<PoseUpdate>,
    /// Frames before a registered one that are to be relocalized.
    look_back: Option<LookBack>,
    /// Relocalization after the last frame; `None` while frames follow.
    rounds: Option<RelocalizationRounds>,
}

/// Progress of relocalization backwards from a frame.
#[derive(Clone)]
struct LookBack {
    /// The frames from `start` until this one are left.
    end: u32,
    start: u32,
    num_failures: usize,
}

/// Progress of relocalization after the last frame.
#[derive(Clone)]
struct RelocalizationRounds {
    num_left: usize,
    /// Frames still to be tried in this round.
    to_try: Vec<u32>,
    /// Whether a frame has been relocalized in this round, which may help others.
    has_succeeded: bool,
}

impl DepthOdometry {
    /// Odometry without frames.
    pub fn new(options: DepthOptions) -> Self {
        Self {
            options,
            outline_contrast: OutlineContrast::default(),
            num_frames: 0,
            chain: None,
            rival_chain: None,
            unregistered_frames: UnregisteredFrames::default(),
            pose_updates: Vec::new(),
            look_back: None,
            rounds: None,
        }
    }

    /// Registers the next frame. A frame that is lost or contradicted is not added to the map; the next one is predicted from
    /// the last registered frame.
    ///
    /// [`take_pose_updates`](Self::take_pose_updates) then returns the consequences for earlier frames.
    pub fn register_frame(&mut self, frame: &PreparedSurfels) -> SpatialEstimate {
        let number = self.num_frames;
        self.num_frames += 1;
        self.rounds = None;
        let num_surfels = frame.image.surfels().count();
        if num_surfels < MIN_SURFELS {
            return self.too_few_surfels(num_surfels);
        }
        self.outline_contrast += frame.outline_contrast;
        if self.has_misaligned_colors() {
            self.options.color = ColorUse::NotUsed;
            for chain in self.chain.iter_mut().chain(&mut self.rival_chain) {
                chain.disregard_colors();
            }
        }
        let Some(chain) = &mut self.chain else {
            let (chain, estimate) = Chain::new(self.options, number, frame);
            self.chain = Some(chain);
            return estimate;
        };
        let is_after_gap = chain.num_rejected() > 0;
        let chain::Outcome { estimate, confirmed, dropped, uncertain } = chain.register(number, frame);
        self.pose_updates.extend(confirmed.iter().chain(&dropped).map(PoseUpdate::of));
        if !estimate.is_in_map {
            self.unregistered_frames.push(number, frame, estimate.T_world_sensor);
            return self.extend_rival_chain(number, frame).unwrap_or(estimate);
        }
        let has_tentative_branches = chain.has_tentative_branches();
        if !has_tentative_branches {
            for member in &confirmed {
                self.unregistered_frames.remove(member.number);
            }
        }
        for number in uncertain {
            self.unregistered_frames.remove(number);
        }
        if estimate.assessment.status != Status::Good || has_tentative_branches {
            // It may be dropped later.
            self.unregistered_frames.push(number, frame, estimate.T_world_sensor);
        }
        self.drop_small_rival_chain();
        if is_after_gap || !dropped.is_empty() {
            let end = dropped.last().map_or(number, |member| member.number + 1);
            self.look_back = Some(LookBack { end, start: end.saturating_sub(MAX_LOOK_BACK_FRAMES), num_failures: 0 });
        }
        self.look_back();
        estimate
    }

    /// Whether the colours are not those of the depth's pixels; they are not used then.
    pub fn has_misaligned_colors(&self) -> bool {
        self.outline_contrast.is_misaligned()
    }

    /// Whether a frame fitted about as well at another position within reach of the camera.
    pub fn surfaces_repeat(&self) -> bool {
        self.chain.as_ref().is_some_and(Chain::surfaces_repeat)
    }

    /// The changes of earlier frames since the last call, in the order in which they arose.
    pub fn take_pose_updates(&mut self) -> Vec<PoseUpdate> {
        std::mem::take(&mut self.pose_updates)
    }

    /// Moves each frame's content by `motion` (of the world) of its number, frames being counted from 0. The prediction for
    /// the next frame moves with the last one.
    pub fn apply_corrections(&mut self, motion: impl Fn(u32) -> Pose3) {
        if let Some(chain) = &mut self.chain {
            chain.apply_corrections(&motion);
        }
        self.unregistered_frames.apply_corrections(&motion);
    }

    /// Tries to relocalize one of the unregistered frames after the last frame; whether there may be more to try.
    pub fn relocalize_next(&mut self) -> bool {
        let Some(chain) = &mut self.chain else { return false };
        let rounds = self.rounds.get_or_insert_with(|| RelocalizationRounds {
            num_left: MAX_ROUNDS,
            to_try: Vec::new(),
            has_succeeded: true,
        });
        if rounds.to_try.is_empty() {
            if rounds.num_left == 0 || !rounds.has_succeeded {
                return false;
            }
            let numbers = self.unregistered_frames.numbers().into_iter();
            let to_try = numbers.filter(|number| !chain.is_member(*number)).collect();
            *rounds = RelocalizationRounds { num_left: rounds.num_left - 1, to_try, has_succeeded: false };
        }
        let Some(number) = rounds.to_try.pop() else { return false };
        if self.relocalize(number, true)
            && let Some(rounds) = &mut self.rounds
        {
            rounds.has_succeeded = true;
        }
        true
    }

    fn too_few_surfels(&self, num_surfels: usize) -> SpatialEstimate {
        let reason = format!("it has {num_surfels} surface elements (surfels), too few to register it");
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

    /// Tries to relocalize the frames before a registered one, backwards from it: one with each frame that follows, so that the
    /// time of a frame is bounded.
    fn look_back(&mut self) {
        let Some(LookBack { end, start, num_failures }) = self.look_back.take() else { return };
        let is_member = |number: u32| self.chain.as_ref().is_some_and(|chain| chain.is_member(number));
        let earlier = (start..end).rev().take_while(|number| !is_member(*number));
        let Some(number) = earlier.into_iter().find(|number| self.unregistered_frames.get(*number).is_some()) else {
            return;
        };
        let num_failures = num_failures + usize::from(!self.relocalize(number, false));
        if num_failures < MAX_LOOK_BACK_FAILURES {
            self.look_back = Some(LookBack { end: number, start, num_failures });
        }
    }

    /// Tries to register an unregistered frame again; whether it succeeded.
    fn relocalize(&mut self, number: u32, everywhere: bool) -> bool {
        let (Some(chain), Some(stored)) = (&mut self.chain, self.unregistered_frames.get(number)) else { return false };
        let Some(hypothesis) = chain.relocalize(stored, everywhere) else { return false };
        let mut assessment =
            Assessment { status: Status::Good, reason: String::new(), agreement: hypothesis.agreement };
        if chain.has_uncertain_member() {
            assessment.mark_dependent_on_uncertain_pose();
        }
        let estimate = chain.insert(number, &stored.frame, hypothesis, assessment);
        self.unregistered_frames.remove(number);
        self.pose_updates.push(PoseUpdate::relocalized(number, estimate));
        true
    }

    /// Registers a frame that the chain rejected to the rival chain. If that becomes the majority, it replaces the chain, and
    /// its estimate is the frame's.
    fn extend_rival_chain(&mut self, number: u32, frame: &PreparedSurfels) -> Option<SpatialEstimate> {
        let Some(rival_chain) = &mut self.rival_chain else {
            self.rival_chain = Some(Chain::new(self.options, number, frame).0);
            return None;
        };
        let chain::Outcome { estimate, .. } = rival_chain.register_near_prediction(number, frame);
        let num_rivals = rival_chain.members().len();
        if !estimate.is_in_map {
            if rival_chain.num_rejected() as usize >= num_rivals {
                self.rival_chain = Some(Chain::new(self.options, number, frame).0);
            }
            return None;
        }
        let num_members = self.chain.as_ref().map_or(0, |chain| chain.members().len());
        if num_rivals < MIN_MAJORITY || num_rivals <= num_members {
            return None;
        }
        self.promote_rival_chain(number);
        Some(estimate)
    }

    /// Replaces the chain by the rival chain. The frames of the replaced chain are lost.
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
        self.drop_small_rival_chain();
    }

    /// Drops the rival chain unless it is established.
    fn drop_small_rival_chain(&mut self) {
        self.rival_chain = self.rival_chain.take().filter(|rival| rival.members().len() > MAX_UNESTABLISHED_FRAMES);
    }
}

impl PoseUpdate {
    fn of(member: &Member) -> Self {
        let Member { number, T_world_sensor, assessment } = member.clone();
        Self { frame: number, T_world_sensor, assessment, registration: None }
    }

    fn relocalized(frame: u32, estimate: SpatialEstimate) -> Self {
        let SpatialEstimate { T_world_sensor, registration, overlap, assessment, .. } = estimate;
        let registration = registration.map(|registration| (registration, overlap));
        Self { frame, T_world_sensor, assessment, registration }
    }
}
