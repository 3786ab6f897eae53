//! A chain of frames: each is registered to the map of those before it.
//!
//! [`Chain::register`] is the way of a frame: predict, propose hypotheses and refine them ([`localize`]), [`track`] where the map contradicts, assess, and then
//! one of: accept into the map, keep as [tentative](super::tentative_branch), reject.

mod localize;
mod tentative;
mod track;

use self::track::PosedFrame;
use super::frame_matcher::{CLEAR_AGREEMENT, FrameMatcher};
use super::motion_prior::MotionPrior;
use super::pose_hypothesis::PoseHypothesis;
use super::prediction_gate::PredictionGate;
use super::reference_map::ReferenceMap;
use super::tentative_branch::{BranchOutcome, TentativeBranch};
use super::{ColorUse, DepthOptions, SpatialEstimate, Verification};
use crate::geometry::Pose3;
use crate::odometry::assessment::{Assessment, Status};
use crate::registration::prepared_surfels::PreparedSurfels;

/// Number of frames above which a chain is established: it is kept beside a longer one, and a plausible frame may begin a
/// tentative branch of it.
pub(super) const MAX_UNESTABLISHED_FRAMES: usize = 5;
/// Number of frames whose photometric correlation must be known before a frame's is compared with it: images may belong to
/// other frames, or the light may change with every frame.
const MIN_NCC_FRAMES: u32 = 3;
/// Smallest weight of the last frame in moving averages.
const MIN_AVERAGE_WEIGHT: f64 = 0.2;
/// A frame may leave this many times as much of the brightness unexplained (1 - correlation) as the average.
const MAX_UNEXPLAINED_RATIO: f64 = 3.0;
/// Photometric correlation (-1..=1) that suffices in any case. Below it, a pose may be off by one period of a repetitive
/// texture.
const SUFFICIENT_NCC: f64 = 0.9;
/// Largest number of tentative branches; each stores a copy of the map.
const MAX_TENTATIVE_BRANCHES: usize = 4;

/// Frames that are registered to each other, and their map.
#[derive(Clone)]
pub(super) struct Chain {
    options: DepthOptions,
    /// The content of all members, and of no other frames.
    reference: ReferenceMap,
    /// The frames of the map, in the order in which they were added.
    members: Vec<Member>,
    /// The last frame that was appended, ...
    last: PosedFrame,
    /// ... and its motion from the one before it.
    last_motion: Pose3,
    motion_prior: MotionPrior,
    /// The last frame, if it was doubtful and therefore rejected: the next one may be near it.
    rejected: Option<PosedFrame>,
    /// Frames since the last one that was appended.
    num_rejected: u32,
    /// Moving average of the contradicting surface (1 - agreement) of appended frames: noise and moving objects.
    mean_contradiction: f64,
    /// Moving average of the photometric correlation of appended frames, ...
    mean_ncc: f64,
    /// ... and the number of frames in it.
    num_ncc_frames: u32,
    /// Whether a frame fitted about as well at another position within reach.
    surfaces_repeat: bool,
    /// Branches of which the frames are members already, each beginning within the one before it.
    tentative_branches: Vec<TentativeBranch>,
}

/// A frame of a chain's map.
#[derive(Clone)]
pub(super) struct Member {
    /// Its number among all frames.
    pub(super) number: u32,
    pub(super) T_world_sensor: Pose3,
    pub(super) assessment: Assessment,
}

/// The estimate of a frame, and the consequences for frames before it.
pub(super) struct Outcome {
    pub(super) estimate: SpatialEstimate,
    /// Members whose poses have become certain.
    pub(super) confirmed: Vec<Member>,
    /// Frames that have been removed from the map, with their most likely poses.
    pub(super) dropped: Vec<Member>,
    /// Numbers of the dropped frames whose own registration is uncertain, so that relocalization cannot help.
    pub(super) uncertain: Vec<u32>,
}

impl From<SpatialEstimate> for Outcome {
    fn from(estimate: SpatialEstimate) -> Self {
        Self { estimate, confirmed: Vec::new(), dropped: Vec::new(), uncertain: Vec::new() }
    }
}

impl Chain {
    /// The chain that begins with this frame, at the world's origin.
    pub(super) fn new(options: DepthOptions, number: u32, frame: &PreparedSurfels) -> (Self, SpatialEstimate) {
        let (mut reference, T_world_sensor) = (ReferenceMap::default(), Pose3::identity());
        let view = reference.map.view(&frame.image, &T_world_sensor);
        reference.insert(frame, number, &T_world_sensor, &view);
        let assessment = Assessment::first();
        let estimate =
            SpatialEstimate { T_world_sensor, registration: None, overlap: 1.0, assessment, is_in_map: true };
        let chain = Self {
            options,
            reference,
            members: vec![Member { number, T_world_sensor, assessment: Assessment::first() }],
            last: PosedFrame::new(frame, T_world_sensor),
            last_motion: Pose3::identity(),
            motion_prior: MotionPrior::default(),
            rejected: None,
            num_rejected: 0,
            mean_contradiction: 0.0,
            mean_ncc: 0.0,
            num_ncc_frames: 0,
            surfaces_repeat: false,
            tentative_branches: Vec::new(),
        };
        (chain, estimate)
    }

    /// Frames from now on are registered by their depth alone.
    pub(super) fn disregard_colors(&mut self) {
        self.options.color = ColorUse::NotUsed;
    }

    pub(super) fn members(&self) -> &[Member] {
        &self.members
    }

    pub(super) fn is_member(&self, number: u32) -> bool {
        self.members.iter().rev().any(|member| member.number == number)
    }

    pub(super) fn surfaces_repeat(&self) -> bool {
        self.surfaces_repeat
    }

    /// Frames since the last one that was appended.
    pub(super) fn num_rejected(&self) -> u32 {
        self.num_rejected
    }

    /// Moves each frame's content by `motion` (of the world) of its number, frames being counted from 0. The prediction for
    /// the next frame moves with the last member.
    pub(super) fn apply_corrections(&mut self, motion: &impl Fn(u32) -> Pose3) {
        self.reference.apply_corrections(motion);
        for branch in &mut self.tentative_branches {
            branch.apply_corrections(motion);
        }
        let motion_of_last = self.members.last().map_or_else(Pose3::identity, |last| motion(last.number));
        for posed in [Some(&mut self.last), self.rejected.as_mut()].into_iter().flatten() {
            posed.T_world_sensor = motion_of_last * posed.T_world_sensor;
        }
        for member in &mut self.members {
            member.T_world_sensor = motion(member.number) * member.T_world_sensor;
        }
    }

    /// Registers the frame after the last one. It is accepted into the map, kept there as tentative, or rejected.
    pub(super) fn register(&mut self, number: u32, frame: &PreparedSurfels) -> Outcome {
        if self.options.verification == Verification::Off {
            let hypothesis = self.best_near_prediction(&self.matcher(frame));
            let assessment = Assessment { agreement: hypothesis.agreement, ..Assessment::first() };
            return self.append(number, frame, hypothesis, Some(assessment)).into();
        }
        let near = self.best_near_prediction(&self.matcher(frame));
        if !self.needs_no_wider_search(&near)
            && let Some(outcome) = self.follow(number, frame, &near)
        {
            return outcome;
        }
        let hypothesis = self.localize(frame, near);
        let gate = self.gate_of(&hypothesis);
        if self.is_accepted(&hypothesis, gate) {
            return self.accept(number, frame, hypothesis);
        }
        if let Some((level, hypothesis)) = self.localize_without_branches(frame, &hypothesis) {
            return self.accept_without_branches(level, number, frame, hypothesis);
        }
        // A chain of a few frames may itself be wrong: no plausible frame is added to it.
        let is_established = self.members.len() > MAX_UNESTABLISHED_FRAMES;
        if hypothesis.is_tentative(gate) && (hypothesis.is_degenerate || is_established) {
            return self.append_tentatively(number, frame, hypothesis, gate).into();
        }
        self.reject(frame, &hypothesis, gate).into()
    }

    /// Registers the frame after the last one if it lies near the prediction; for the rival chain.
    pub(super) fn register_near_prediction(&mut self, number: u32, frame: &PreparedSurfels) -> Outcome {
        let hypothesis = self.best_near_prediction(&self.matcher(frame));
        let gate = self.gate_of(&hypothesis);
        if self.is_accepted(&hypothesis, gate) {
            self.accept(number, frame, hypothesis)
        } else {
            self.reject(frame, &hypothesis, gate).into()
        }
    }

    /// A frame and the map. Results that are contradicted no more than usual are clear.
    fn matcher<'a>(&'a self, frame: &'a PreparedSurfels) -> FrameMatcher<'a> {
        let mut matcher = FrameMatcher::new(&self.reference, frame, self.options);
        matcher.clear_agreement = CLEAR_AGREEMENT.min(1.0 - self.mean_contradiction);
        matcher
    }

    fn gate_of(&self, hypothesis: &PoseHypothesis) -> PredictionGate {
        PredictionGate::between(&self.last.T_world_sensor, hypothesis.T_world_sensor(), self.num_rejected)
    }

    /// Whether surfaces and brightness suffice to accept a pose. Where surfaces repeat they do not without a prediction.
    fn is_accepted(&self, hypothesis: &PoseHypothesis, gate: PredictionGate) -> bool {
        let is_anywhere = gate == PredictionGate::NoPrediction
            && hypothesis.photometric_ncc.is_none()
            && self.is_in_repetitive_place();
        hypothesis.is_accepted(gate) && !is_anywhere && self.is_photometrically_consistent(hypothesis)
    }

    /// Whether the photometric correlation is about as high as that of other frames.
    fn is_photometrically_consistent(&self, hypothesis: &PoseHypothesis) -> bool {
        if self.num_ncc_frames < MIN_NCC_FRAMES {
            return true;
        }
        let expected = 1.0 - MAX_UNEXPLAINED_RATIO * (1.0 - self.mean_ncc);
        hypothesis.photometric_ncc.is_none_or(|ncc| ncc > expected.min(SUFFICIENT_NCC))
    }

    /// Adds a frame with a certain pose. Its registration to the map from before a tentative branch resolves the branch.
    fn accept(&mut self, number: u32, frame: &PreparedSurfels, mut hypothesis: PoseHypothesis) -> Outcome {
        self.look_for_second_basin(frame, &mut hypothesis);
        if hypothesis.second_basin.is_some() {
            self.surfaces_repeat = true;
            let gate = self.gate_of(&hypothesis);
            return self.append_tentatively(number, frame, hypothesis, gate).into();
        }
        let (mut confirmed, mut dropped, mut uncertain) = (Vec::new(), Vec::new(), Vec::new());
        let is_next = self.num_rejected == 0 && self.gate_of(&hypothesis) != PredictionGate::NoPrediction;
        while let Some(branch) = self.tentative_branches.pop() {
            match branch.resolved_by(frame, hypothesis.T_world_sensor(), self.options) {
                BranchOutcome::Unresolved => {
                    self.tentative_branches.push(branch);
                    break;
                }
                // Far from the end of the branch, the pose says nothing about the branch.
                BranchOutcome::Confirmed(anchored) if !is_next => {
                    self.tentative_branches.push(branch);
                    let level = self.tentative_branches.len() - 1;
                    return self.accept_without_branches(level, number, frame, *anchored);
                }
                BranchOutcome::Confirmed(_) => confirmed.extend(self.confirm(&branch)),
                BranchOutcome::Refuted(anchored) => {
                    uncertain.extend(branch.uncertain());
                    let (certain, others) = self.correct_branch(branch, &hypothesis, &anchored);
                    confirmed.extend(certain);
                    dropped.extend(others);
                    hypothesis = *anchored;
                    hypothesis.view = self.reference.map.view(&frame.image, hypothesis.T_world_sensor());
                }
            }
        }
        Outcome { estimate: self.append(number, frame, hypothesis, None), confirmed, dropped, uncertain }
    }

    /// Adds a frame with an uncertain pose, and begins a tentative branch unless the last frame is uncertain, too.
    fn append_tentatively(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        hypothesis: PoseHypothesis,
        gate: PredictionGate,
    ) -> SpatialEstimate {
        if self.tentative_branches.last().is_none_or(TentativeBranch::ends_with_certain_pose)
            && self.tentative_branches.len() < MAX_TENTATIVE_BRANCHES
        {
            self.tentative_branches.push(TentativeBranch::new(self.reference.clone(), self.last.T_world_sensor));
        }
        let assessment = hypothesis.assessment_at(gate, self.is_photometrically_consistent(&hypothesis));
        self.append(number, frame, hypothesis, Some(assessment))
    }

    /// Adds the frame after the last one; with an assessment if its own registration is uncertain.
    fn append(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        hypothesis: PoseHypothesis,
        uncertain: Option<Assessment>,
    ) -> SpatialEstimate {
        let T_world_sensor = *hypothesis.T_world_sensor();
        self.last_motion = self.last.T_world_sensor.inverse() * T_world_sensor;
        if uncertain.is_none() && self.num_rejected == 0 {
            self.motion_prior.push(&self.last_motion);
        }
        (self.last, self.rejected, self.num_rejected) = (PosedFrame::new(frame, T_world_sensor), None, 0);
        self.mean_contradiction += MIN_AVERAGE_WEIGHT * (1.0 - hypothesis.agreement - self.mean_contradiction);
        if let Some(ncc) = hypothesis.photometric_ncc {
            self.num_ncc_frames += 1;
            self.mean_ncc += MIN_AVERAGE_WEIGHT.max(1.0 / f64::from(self.num_ncc_frames)) * (ncc - self.mean_ncc);
        }
        for branch in &mut self.tentative_branches {
            branch.push(number, uncertain.is_some().then(|| hypothesis.uncertainty()));
        }
        let mut assessment = uncertain.unwrap_or_else(|| hypothesis.assessment());
        if self.has_uncertain_member() {
            assessment.mark_dependent_on_uncertain_pose();
        }
        self.insert(number, frame, hypothesis, assessment)
    }

    /// Adds a frame to the map.
    pub(super) fn insert(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        hypothesis: PoseHypothesis,
        assessment: Assessment,
    ) -> SpatialEstimate {
        let T_world_sensor = *hypothesis.T_world_sensor();
        self.reference.insert(frame, number, &T_world_sensor, &hypothesis.view);
        self.members.push(Member { number, T_world_sensor, assessment: assessment.clone() });
        let registration = Some(hypothesis.registration);
        SpatialEstimate { T_world_sensor, overlap: hypothesis.overlap, assessment, registration, is_in_map: true }
    }

    /// The estimate of a frame that is not added to the map. If it is doubtful, the next frame is searched near it, too.
    fn reject(
        &mut self,
        frame: &PreparedSurfels,
        hypothesis: &PoseHypothesis,
        gate: PredictionGate,
    ) -> SpatialEstimate {
        let assessment = hypothesis.assessment_at(gate, self.is_photometrically_consistent(hypothesis));
        self.num_rejected += 1;
        if assessment.status == Status::Lost {
            return self.lost(assessment.reason, hypothesis.overlap);
        }
        let T_world_sensor = *hypothesis.T_world_sensor();
        self.rejected = Some(PosedFrame::new(frame, T_world_sensor));
        let registration = Some(hypothesis.registration.clone());
        SpatialEstimate { T_world_sensor, overlap: hypothesis.overlap, assessment, registration, is_in_map: false }
    }

    /// The estimate of a lost frame: the last known pose.
    pub(super) fn lost(&self, reason: String, overlap: f64) -> SpatialEstimate {
        let assessment = Assessment { status: Status::Lost, reason, agreement: 0.0 };
        let T_world_sensor = self.rejected.as_ref().unwrap_or(&self.last).T_world_sensor;
        SpatialEstimate { T_world_sensor, registration: None, overlap, assessment, is_in_map: false }
    }
}
