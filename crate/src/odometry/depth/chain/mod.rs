//! A chain of frames: each is looked for in the map of those before it.

mod tentative;

use super::color::SAME_PLACE_CORRELATION;
use super::evidence::FINE_TOLERANCE;
use super::hypotheses;
use super::matching::{Matching, TELLING_AGREEMENT, is_well_constrained};
use super::motion_prior::MotionPrior;
use super::pose_hypothesis::{PoseHypothesis, PredictionGate};
use super::reference_map::ReferenceMap;
use super::tentative_branch::{BranchOutcome, TentativeBranch};
use super::unregistered_frames::UnregisteredFrame;
use super::{DepthOptions, ESTABLISHED, Effort, SpatialEstimate, Verification};
use crate::geometry::Pose3;
use crate::map::keyframes::apart;
use crate::odometry::assessment::{Assessment, Status};
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::prepared_surfels::PreparedSurfels;

/// Another place than where the last frame was is believed when it agrees better by this share ...
const BETTER_AGREEMENT: f64 = 0.02;
/// ... and has so much more support.
const BETTER_SUPPORT: f64 = 0.05;

/// Poses further apart than this are other places (m, turns included).
const ANOTHER_PLACE: f64 = 0.2;
/// Two places fit about as well where so much less agrees, ...
const AS_GOOD_AGREEMENT: f64 = 0.005;
/// ... of so much of the overlap.
const AS_GOOD_OVERLAP: f64 = 0.6;
/// So many frames tell how well brightness agrees in a recording: images may be of other frames, or of other light each time.
const TELLING_FRAMES: u32 = 3;
/// The last frame has this share in the mean, at the least.
const MIN_MEAN_NCC_WEIGHT: f64 = 0.2;
/// Where brightness leaves so many times as much unexplained as usual, it is another place, or another light.
const MAX_UNEXPLAINED_RATIO: f64 = 3.0;

/// Frames are off along the direction that is held least by so many times what their residuals tell (root mean square, in
/// generated flats): surfaces err together. That is so where they hold them, however well, ...
const HELD_ERRING_TOGETHER: f64 = 10.0;
/// ... and this where they do not.
const OPEN_ERRING_TOGETHER: f64 = 40.0;
/// What is further from what is usual, in standard deviations, is something else: a frame may have been dropped.
const MAX_PRIOR_SIGMAS: f64 = 3.0;

/// So many places that are not certain are remembered with what was known before them: it is a copy of the map.
const MAX_TENTATIVE_BRANCHES: usize = 4;

/// Frames that hang together, and their map.
#[derive(Clone)]
pub(super) struct Chain {
    options: DepthOptions,
    seen: ReferenceMap,
    members: Vec<Member>,
    /// Where the last member was, and how it came there.
    T_world_last: Pose3,
    last_motion: Pose3,
    motion_prior: MotionPrior,
    /// Where the last frame seemed to be, if it was contradicted: the next one may be near.
    T_world_rejected: Option<Pose3>,
    /// Frames since the last member.
    num_frames_since_accepted: u32,
    /// How well the brightness of frames agrees with the pictures of those before, in the mean of the last ones.
    photometric_ncc: f64,
    /// Frames that have told that.
    num_photometric_ncc: u32,
    /// Frames since ones whose place is not certain, each of them after the ones of the last.
    tentative_branches: Vec<TentativeBranch>,
}

/// A frame that is part of a chain's map.
#[derive(Clone)]
pub(super) struct Member {
    /// Its number among all frames.
    pub(super) number: u32,
    pub(super) T_world_sensor: Pose3,
    pub(super) assessment: Assessment,
}

/// What becomes of a frame, and what it tells of those before.
pub(super) struct Outcome {
    pub(super) estimate: SpatialEstimate,
    /// Members that are now where they are for sure.
    pub(super) confirmed: Vec<Member>,
    /// Frames that are members no longer, and where they seem to be.
    pub(super) dropped: Vec<Member>,
    /// The numbers of those of them whose own place nothing tells, so that trying them again tells no more.
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
        let (mut seen, T_world_sensor) = (ReferenceMap::default(), Pose3::identity());
        let view = seen.map.view(&frame.image, &T_world_sensor);
        seen.insert(frame, number, &T_world_sensor, &view);
        let assessment = Assessment::first();
        let estimate =
            SpatialEstimate { T_world_sensor, registration: None, overlap: 1.0, assessment, is_in_map: true };
        let chain = Self {
            options,
            seen,
            members: vec![Member { number, T_world_sensor, assessment: Assessment::first() }],
            T_world_last: T_world_sensor,
            last_motion: Pose3::identity(),
            motion_prior: MotionPrior::default(),
            T_world_rejected: None,
            num_frames_since_accepted: 0,
            photometric_ncc: 0.0,
            num_photometric_ncc: 0,
            tentative_branches: Vec::new(),
        };
        (chain, estimate)
    }

    pub(super) fn seen(&self) -> &ReferenceMap {
        &self.seen
    }

    /// The frames of the map, in the order in which they were added.
    pub(super) fn members(&self) -> &[Member] {
        &self.members
    }

    pub(super) fn is_member(&self, number: u32) -> bool {
        self.members.iter().rev().any(|member| member.number == number)
    }

    /// Frames since the last member.
    pub(super) fn num_frames_since_accepted(&self) -> u32 {
        self.num_frames_since_accepted
    }

    /// Moves what each frame has shown by `motion` (of the world) of its number, frames being counted from 0. The next frame
    /// is looked for from where that leaves the last one.
    pub(super) fn apply_corrections(&mut self, motion: &impl Fn(u32) -> Pose3) {
        self.seen.apply_corrections(motion);
        for branch in &mut self.tentative_branches {
            branch.apply_corrections(motion);
        }
        let moved = self.members.last().map_or_else(Pose3::identity, |last| motion(last.number));
        self.T_world_last = moved * self.T_world_last;
        self.T_world_rejected = self.T_world_rejected.map(|doubtful| moved * doubtful);
        for member in &mut self.members {
            member.T_world_sensor = motion(member.number) * member.T_world_sensor;
        }
    }

    /// Registers the frame after the last one. One that is contradicted, or where too little says that it is there, is no part of
    /// the map.
    pub(super) fn register(&mut self, number: u32, frame: &PreparedSurfels) -> Outcome {
        if self.options.verification == Verification::Off {
            let found = self.find_near(&Matching::new(&self.seen, frame, self.options));
            let assessment = Assessment { agreement: found.agreement, ..Assessment::first() };
            return self.append(number, frame, found, Some(assessment)).into();
        }
        let found = self.find(frame);
        let gate = self.gate_of(&found);
        if self.is_accepted(&found, gate) {
            return self.accept(number, frame, found);
        }
        if let Some((level, found)) = self.find_without_branch(frame, &found) {
            return self.accept_without_branch(level, number, frame, found);
        }
        // Of a few frames it is not known yet whether they belong.
        let is_tentative = found.is_tentative(gate) && (found.is_degenerate || self.members.len() > ESTABLISHED);
        if is_tentative {
            if self.tentative_branches.last().is_none_or(TentativeBranch::ends_with_certain_pose)
                && self.tentative_branches.len() < MAX_TENTATIVE_BRANCHES
            {
                self.tentative_branches.push(TentativeBranch::new(self.seen.clone(), self.T_world_last));
            }
            let assessment = found.assessment_at(gate, self.is_photometrically_consistent(&found));
            return self.append(number, frame, found, Some(assessment)).into();
        }
        self.doubt(&found, gate).into()
    }

    /// Registers a frame after the last one if it is where such a frame is to be expected; for chains that are not it yet.
    pub(super) fn register_inside_gate(&mut self, number: u32, frame: &PreparedSurfels) -> Outcome {
        let found = self.find_near(&Matching::new(&self.seen, frame, self.options));
        let gate = self.gate_of(&found);
        if self.is_accepted(&found, gate) { self.accept(number, frame, found) } else { self.doubt(&found, gate).into() }
    }

    fn gate_of(&self, found: &PoseHypothesis) -> PredictionGate {
        PredictionGate::between(&self.T_world_last, &found.registration.T_target_source, self.num_frames_since_accepted)
    }

    /// Whether a frame is placed beyond doubt: by its surfaces, and it looks about as much like the pictures as frames do.
    fn is_accepted(&self, found: &PoseHypothesis, gate: PredictionGate) -> bool {
        found.is_accepted(gate) && self.is_photometrically_consistent(found)
    }

    fn is_photometrically_consistent(&self, found: &PoseHypothesis) -> bool {
        if self.num_photometric_ncc < TELLING_FRAMES {
            return true;
        }
        let usual = 1.0 - MAX_UNEXPLAINED_RATIO * (1.0 - self.photometric_ncc);
        found.photometric_ncc.is_none_or(|photometric_ncc| photometric_ncc > usual.min(SAME_PLACE_CORRELATION))
    }

    fn is_settled(&self, found: &PoseHypothesis) -> bool {
        let gate = self.gate_of(found);
        self.is_accepted(found, gate) || found.is_degenerate_inside_gate(gate)
    }

    /// Near where the last frame was, or seemed to be, then all around, then in all places seen before: as far as the
    /// evidence sends it.
    fn find(&self, frame: &PreparedSurfels) -> PoseHypothesis {
        let matching = Matching::new(&self.seen, frame, self.options);
        let mut found = self.find_near(&matching);
        if !self.is_settled(&found) {
            found = better_of(found, matching.best_of_all_around(&self.T_world_last));
        }
        if found.is_contradicted() {
            let further = matching.best_of_anywhere(&self.T_world_last);
            if self.is_accepted(&further, self.gate_of(&further)) {
                return further;
            }
            if let Some(elsewhere) =
                matching.best_of_everywhere().filter(|found| self.is_accepted(found, PredictionGate::NoPrediction))
            {
                return elsewhere;
            }
        }
        self.apply_motion_prior(&matching, found)
    }

    /// Where little or nothing holds a frame along a direction, it has moved there as it usually does, as far as that is known
    /// better, and unless it contradicts what is known. What was open is open all the same.
    fn apply_motion_prior(&self, matching: &Matching<'_>, found: PoseHypothesis) -> PoseHypothesis {
        if found.photometric_ncc.is_some() || self.num_frames_since_accepted > 0 || !found.is_plausible() {
            return found;
        }
        let (weakest, share) = DegenerateDirection::weakest(&found.registration.correspondences, FINE_TOLERANCE);
        let deviation = weakest.sigma(&found.registration.information);
        if !found.is_degenerate && is_well_constrained(share, deviation) {
            return found;
        }
        let T_world_found = found.registration.T_target_source;
        let motion = self.T_world_last.inverse() * T_world_found;
        let direction = self.T_world_last.rotation.inverse() * weakest.direction;
        let Some(expected) = self.motion_prior.expected(&motion, &direction) else { return found };
        let deviation = match (found.registration.converged, found.is_degenerate) {
            // What is still moving tells nothing.
            (false, _) => f64::INFINITY,
            (true, true) => OPEN_ERRING_TOGETHER * deviation,
            (true, false) => HELD_ERRING_TOGETHER * deviation,
        };
        let off = expected.along - direction.dot(&motion.translation.vector);
        let sq_deviation = deviation * deviation;
        if off * off > MAX_PRIOR_SIGMAS * MAX_PRIOR_SIGMAS * (expected.variance + sq_deviation) {
            return found;
        }
        let moved = weakest.direction * (off / (1.0 + expected.variance / sq_deviation));
        let guess = Pose3::translation(moved.x, moved.y, moved.z) * T_world_found;
        let mut usual = matching.register_across(&weakest, guess);
        let is_contradicted = usual.agreement < found.agreement - TELLING_AGREEMENT;
        if is_contradicted || !(usual.registration.converged || found.is_degenerate) {
            return found;
        }
        // What the registration holds fast is known no better for it.
        usual.registration.information = found.registration.information;
        PoseHypothesis { is_degenerate: found.is_degenerate, ..usual }
    }

    fn find_near(&self, matching: &Matching<'_>) -> PoseHypothesis {
        let mut found = match self.options.effort {
            Effort::Thorough => near(matching, &self.T_world_last, &self.last_motion),
            Effort::Quick => {
                matching.best_of(&hypotheses::few(&self.T_world_last, &self.last_motion), &self.T_world_last)
            }
        };
        if self.options.effort == Effort::Quick && !self.is_accepted(&found, self.gate_of(&found)) {
            found = near(matching, &self.T_world_last, &self.last_motion);
        }
        if let Some(T_world_rejected) = self.T_world_rejected.filter(|_| !self.is_settled(&found)) {
            let other = near(matching, &T_world_rejected, &Pose3::identity());
            if other.support > found.support {
                found = other;
            }
        }
        found
    }

    /// Looks for a frame around where members near it in the recording are, and where it seemed to be, and in all places
    /// seen before if `everywhere`.
    pub(super) fn relocalize(&self, left: &UnregisteredFrame, everywhere: bool) -> Option<PoseHypothesis> {
        let matching = Matching::new(&self.seen, &left.frame, self.options);
        let between = |member: &&Member| member.number.abs_diff(left.number);
        let before = self.members.iter().filter(|member| member.number < left.number).min_by_key(between);
        let after = self.members.iter().filter(|member| member.number > left.number).min_by_key(between);
        let neighbors: Vec<&Member> = before.into_iter().chain(after).collect();
        let is_accepted = |found: &PoseHypothesis| {
            let T_world_found = &found.registration.T_target_source;
            let from = |member: &&Member| {
                PredictionGate::between(&member.T_world_sensor, T_world_found, between(member).max(1) - 1)
            };
            neighbors.iter().map(from).any(|gate| self.is_accepted(found, gate))
                || self.is_accepted(found, PredictionGate::NoPrediction)
        };
        let grid_around = neighbors.iter().map(|member| member.T_world_sensor).chain([left.T_world_sensor]);
        let mut found: Vec<PoseHypothesis> =
            grid_around.map(|T_world_near| near(&matching, &T_world_near, &Pose3::identity())).collect();
        if everywhere && !found.iter().any(is_accepted) {
            found.extend(neighbors.first().map(|member| matching.best_of_all_around(&member.T_world_sensor)));
        }
        let best = found.into_iter().max_by(|a, b| a.support.total_cmp(&b.support)).filter(is_accepted);
        let elsewhere =
            || matching.best_of_everywhere().filter(|found| self.is_accepted(found, PredictionGate::NoPrediction));
        let found = best.or_else(|| everywhere.then(elsewhere).flatten())?;
        // Of two places that fit about as well neither is believed.
        let seemed = matching.settled(left.T_world_sensor);
        let is_another =
            apart(&seemed.registration.T_target_source, &found.registration.T_target_source) > ANOTHER_PLACE;
        let fits_as_well =
            seemed.agreement > found.agreement - AS_GOOD_AGREEMENT && seemed.overlap > AS_GOOD_OVERLAP * found.overlap;
        (!is_another || !fits_as_well).then_some(found)
    }

    /// A frame that is where it is for sure. What was known before frames that are not tells where those are, once it is seen
    /// again.
    fn accept(&mut self, number: u32, frame: &PreparedSurfels, mut found: PoseHypothesis) -> Outcome {
        let (mut confirmed, mut dropped, mut uncertain) = (Vec::new(), Vec::new(), Vec::new());
        let is_next = self.num_frames_since_accepted == 0 && self.gate_of(&found) != PredictionGate::NoPrediction;
        while let Some(branch) = self.tentative_branches.pop() {
            match branch.resolved_by(frame, &found.registration.T_target_source, self.options) {
                BranchOutcome::Nothing => {
                    self.tentative_branches.push(branch);
                    break;
                }
                // Found far from them, it says nothing of where they are.
                BranchOutcome::Confirmed(found) if !is_next => {
                    self.tentative_branches.push(branch);
                    return self.accept_without_branch(self.tentative_branches.len() - 1, number, frame, *found);
                }
                BranchOutcome::Confirmed(_) => confirmed.extend(self.confirm(&branch)),
                BranchOutcome::BranchCorrection(anchored) => {
                    uncertain.extend(branch.uncertain());
                    let (certain, others) = self.move_by(branch, &found, &anchored);
                    confirmed.extend(certain);
                    dropped.extend(others);
                    found = *anchored;
                    found.view = self.seen.map.view(&frame.image, &found.registration.T_target_source);
                }
            }
        }
        Outcome { estimate: self.append(number, frame, found, None), confirmed, dropped, uncertain }
    }

    /// Takes in the frame after the last one; with an assessment, if its own place is not certain.
    fn append(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        found: PoseHypothesis,
        doubt: Option<Assessment>,
    ) -> SpatialEstimate {
        let T_world_sensor = found.registration.T_target_source;
        self.last_motion = self.T_world_last.inverse() * T_world_sensor;
        if doubt.is_none() && self.num_frames_since_accepted == 0 {
            self.motion_prior.push(&self.last_motion);
        }
        (self.T_world_last, self.T_world_rejected, self.num_frames_since_accepted) = (T_world_sensor, None, 0);
        if let Some(photometric_ncc) = found.photometric_ncc {
            self.num_photometric_ncc += 1;
            self.photometric_ncc += MIN_MEAN_NCC_WEIGHT.max(1.0 / f64::from(self.num_photometric_ncc))
                * (photometric_ncc - self.photometric_ncc);
        }
        for branch in &mut self.tentative_branches {
            branch.push(number, doubt.is_some().then(|| found.doubt()));
        }
        let mut assessment = doubt.unwrap_or_else(|| found.assessment());
        if self.has_unbounded_error() {
            assessment.mark_hanging_on_an_open_place();
        }
        self.insert(number, frame, found, assessment)
    }

    /// Takes in a frame.
    pub(super) fn insert(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        found: PoseHypothesis,
        assessment: Assessment,
    ) -> SpatialEstimate {
        let T_world_sensor = found.registration.T_target_source;
        self.seen.insert(frame, number, &T_world_sensor, &found.view);
        self.members.push(Member { number, T_world_sensor, assessment: assessment.clone() });
        let registration = Some(found.registration);
        SpatialEstimate { T_world_sensor, overlap: found.overlap, assessment, registration, is_in_map: true }
    }

    /// A frame that is not believed is no part of the map, but where it seems to be the next one may be.
    fn doubt(&mut self, found: &PoseHypothesis, gate: PredictionGate) -> SpatialEstimate {
        let assessment = found.assessment_at(gate, self.is_photometrically_consistent(found));
        self.num_frames_since_accepted += 1;
        if assessment.status == Status::Lost {
            return self.lost(assessment.reason, found.overlap);
        }
        let T_world_sensor = found.registration.T_target_source;
        self.T_world_rejected = Some(T_world_sensor);
        let registration = Some(found.registration.clone());
        SpatialEstimate { T_world_sensor, overlap: found.overlap, assessment, registration, is_in_map: false }
    }

    /// A frame of which nothing is known.
    pub(super) fn lost(&self, reason: String, overlap: f64) -> SpatialEstimate {
        let assessment = Assessment { status: Status::Lost, reason, agreement: 0.0 };
        let T_world_sensor = self.T_world_rejected.unwrap_or(self.T_world_last);
        SpatialEstimate { T_world_sensor, registration: None, overlap, assessment, is_in_map: false }
    }
}

fn near(matching: &Matching<'_>, T_world_near: &Pose3, motion: &Pose3) -> PoseHypothesis {
    matching.best_of(&hypotheses::near(T_world_near, motion), T_world_near)
}

/// What is found all around must be held by what is known, and agree the better by something.
fn better_of(found: PoseHypothesis, again: PoseHypothesis) -> PoseHypothesis {
    let is_better =
        again.agreement > found.agreement + BETTER_AGREEMENT && again.support > found.support + BETTER_SUPPORT;
    if is_better && again.is_constrained_by_map() { again } else { found }
}
