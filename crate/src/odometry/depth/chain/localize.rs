//! The search for a frame's pose relative to a chain.

use super::super::Effort;
use super::super::evidence::FINE_TOLERANCE;
use super::super::frame_matcher::FrameMatcher;
use super::super::hypotheses;
use super::super::pose_hypothesis::{OPEN_ERROR_RATIO, PoseHypothesis};
use super::super::prediction_gate::PredictionGate;
use super::super::resolve_degeneracy::{MIN_AGREEMENT_DIFFERENCE, is_well_constrained};
use super::super::second_basin::{MAX_STEP, Reach};
use super::super::unregistered_frames::UnregisteredFrame;
use super::{Chain, Member};
use crate::geometry::Pose3;
use crate::map::keyframes::apart;
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::prepared_surfels::PreparedSurfels;

/// Gain in agreement (0..=1) needed to accept a pose away from the prediction, ...
const MIN_AGREEMENT_GAIN: f64 = 0.02;
/// ... and gain in support.
const MIN_SUPPORT_GAIN: f64 = 0.05;
/// Distance above which two poses are different places (m, two metres per radian).
const MIN_PLACE_DISTANCE: f64 = 0.2;
/// Two places are ambiguous if their agreements differ by less than this ...
pub(super) const MAX_AMBIGUOUS_AGREEMENT_LOSS: f64 = 0.005;
/// ... and the overlap of one is more than this share of the other's.
const MIN_AMBIGUOUS_OVERLAP_RATIO: f64 = 0.6;
/// Ratio of a pose's actual error along its least constrained direction to the standard deviation from its residuals (root
/// mean square in generated flats): the errors of surfaces are correlated. Where surfaces constrain the direction, ...
const CONSTRAINED_ERROR_RATIO: f64 = 10.0;
/// Largest difference from the motion prior (standard deviations) for which it is applied: a larger one means an unusual
/// motion, as after a dropped frame.
const MAX_PRIOR_SIGMAS: f64 = 3.0;
/// The camera may move so many times as far as it has before.
const FASTER: f64 = 2.0;
/// A camera that hardly moved may begin to move by so much a frame (m).
const MIN_LONGEST_STEP: f64 = 0.25;

impl Chain {
    /// The best pose `near` the prediction; where the evidence does not suffice, all around it, then near all keyframes.
    pub(super) fn localize(&self, frame: &PreparedSurfels, near: PoseHypothesis) -> PoseHypothesis {
        let matcher = self.matcher(frame);
        let mut best = near;
        if !self.needs_no_wider_search(&best) {
            best = better_of(best, matcher.best_of_all_around(&self.last.T_world_sensor));
        }
        if best.is_contradicted() {
            let farther = matcher.best_of_anywhere(&self.last.T_world_sensor);
            if self.is_accepted(&farther, self.gate_of(&farther)) {
                return farther;
            }
            if let Some(revisited) = self.best_near_keyframes(&matcher) {
                return revisited;
            }
        }
        self.apply_motion_prior(&matcher, best)
    }

    /// The best pose near the last one, and near that of a rejected frame since.
    pub(super) fn best_near_prediction(&self, matcher: &FrameMatcher<'_>) -> PoseHypothesis {
        let mut best = match self.options.effort {
            Effort::Thorough => best_near(matcher, &self.last.T_world_sensor, &self.last_motion),
            Effort::Quick => {
                let few = hypotheses::few_near_prediction(&self.last.T_world_sensor, &self.last_motion);
                matcher.best_of(&few, &self.last.T_world_sensor)
            }
        };
        if self.options.effort == Effort::Quick && !self.is_accepted(&best, self.gate_of(&best)) {
            best = best_near(matcher, &self.last.T_world_sensor, &self.last_motion);
        }
        if let Some(rejected) = self.rejected.as_ref().filter(|_| !self.needs_no_wider_search(&best)) {
            let other = best_near(matcher, &rejected.T_world_sensor, &Pose3::identity());
            if other.support > best.support {
                best = other;
            }
        }
        best
    }

    /// Notes another position of an accepted pose where the frame fits about as well, if the camera may be there. How far it may
    /// have come is known from earlier steps between frames with certain poses.
    pub(super) fn look_for_second_basin(&self, frame: &PreparedSurfels, hypothesis: &mut PoseHypothesis) {
        let num_steps = f64::from(1 + self.num_rejected);
        let longest =
            self.motion_prior.longest_step().map(|longest| num_steps * FASTER * longest.max(MIN_LONGEST_STEP));
        let position = |T: &Pose3| T.translation.vector;
        let step = (position(hypothesis.T_world_sensor()) - position(&self.last.T_world_sensor)).norm();
        let radius = longest.filter(|longest| step < *longest).unwrap_or(MAX_STEP).min(MAX_STEP);
        let reach = if step < radius {
            Reach::from_last(&self.last.T_world_sensor, radius)
        } else {
            Reach::anywhere(hypothesis)
        };
        hypothesis.second_basin = self.matcher(frame).second_basin(hypothesis, &reach);
    }

    pub(super) fn needs_no_wider_search(&self, hypothesis: &PoseHypothesis) -> bool {
        let gate = self.gate_of(hypothesis);
        self.is_accepted(hypothesis, gate) || hypothesis.is_degenerate_inside_gate(gate)
    }

    /// The best pose near all keyframes, if it is accepted without a prediction.
    fn best_near_keyframes(&self, matcher: &FrameMatcher<'_>) -> Option<PoseHypothesis> {
        matcher.best_of_everywhere().filter(|best| self.is_accepted(best, PredictionGate::NoPrediction))
    }

    /// Moves a pose towards the motion prior along the direction that is least constrained, by the two variances. The result
    /// must not contradict the map; a direction that was undetermined remains so.
    fn apply_motion_prior(&self, matcher: &FrameMatcher<'_>, hypothesis: PoseHypothesis) -> PoseHypothesis {
        if hypothesis.photometric_ncc.is_some() || self.num_rejected > 0 || !hypothesis.is_plausible() {
            return hypothesis;
        }
        let (weakest, share) = DegenerateDirection::weakest(&hypothesis.registration.correspondences, FINE_TOLERANCE);
        let sigma = weakest.sigma(&hypothesis.registration.information);
        if !hypothesis.is_degenerate && is_well_constrained(share, sigma) {
            return hypothesis;
        }
        let Some(offset) = self.offset_by_prior(&hypothesis, &weakest, sigma) else { return hypothesis };
        let translation = weakest.direction * offset;
        let guess = Pose3::translation(translation.x, translation.y, translation.z) * hypothesis.T_world_sensor();
        let mut moved = matcher.register_across(&weakest, guess);
        let is_contradicted = moved.agreement < hypothesis.agreement - MIN_AGREEMENT_DIFFERENCE;
        if is_contradicted || !(moved.registration.converged || hypothesis.is_degenerate) {
            return hypothesis;
        }
        // Fixing a direction in the registration adds no information about it.
        moved.registration.information = hypothesis.registration.information;
        PoseHypothesis { is_degenerate: hypothesis.is_degenerate, ..moved }
    }

    /// How far (m) the motion prior moves a pose along a direction that is known with a standard deviation of `sigma` (m);
    /// `None` without a prior, and where the two are incompatible.
    fn offset_by_prior(&self, hypothesis: &PoseHypothesis, weakest: &DegenerateDirection, sigma: f64) -> Option<f64> {
        let motion = self.last.T_world_sensor.inverse() * hypothesis.T_world_sensor();
        let direction = self.last.T_world_sensor.rotation.inverse() * weakest.direction;
        let predicted = self.motion_prior.predict(&motion, &direction)?;
        let sigma = match (hypothesis.registration.converged, hypothesis.is_degenerate) {
            // A registration that has not converged knows nothing about the direction.
            (false, _) => f64::INFINITY,
            (true, true) => OPEN_ERROR_RATIO * sigma,
            (true, false) => CONSTRAINED_ERROR_RATIO * sigma,
        };
        let difference = predicted.along - direction.dot(&motion.translation.vector);
        let variance = sigma * sigma;
        let is_unusual =
            difference * difference > MAX_PRIOR_SIGMAS * MAX_PRIOR_SIGMAS * (predicted.variance + variance);
        (!is_unusual).then_some(difference / (1.0 + predicted.variance / variance))
    }

    /// Searches for an unregistered frame near the members before and after it in the recording, and near its last pose; all
    /// around them and near all keyframes if `everywhere`.
    pub(in super::super) fn relocalize(&self, frame: &UnregisteredFrame, everywhere: bool) -> Option<PoseHypothesis> {
        let matcher = self.matcher(&frame.frame);
        let neighbors = self.neighbors(frame.number);
        let is_accepted = |hypothesis: &PoseHypothesis| {
            let gate_from = |member: &&Member| {
                let num_between = member.number.abs_diff(frame.number).max(1) - 1;
                PredictionGate::between(&member.T_world_sensor, hypothesis.T_world_sensor(), num_between)
            };
            neighbors.iter().map(gate_from).any(|gate| self.is_accepted(hypothesis, gate))
                || self.is_accepted(hypothesis, PredictionGate::NoPrediction)
        };
        let starts = neighbors.iter().map(|member| member.T_world_sensor).chain([frame.T_world_sensor]);
        let mut found: Vec<PoseHypothesis> =
            starts.map(|T_world_start| best_near(&matcher, &T_world_start, &Pose3::identity())).collect();
        if everywhere && !found.iter().any(is_accepted) {
            found.extend(neighbors.first().map(|member| matcher.best_of_all_around(&member.T_world_sensor)));
        }
        let best = found.into_iter().max_by(|a, b| a.support.total_cmp(&b.support)).filter(is_accepted);
        let best = best.or_else(|| everywhere.then(|| self.best_near_keyframes(&matcher)).flatten())?;
        let last = matcher.register_at(frame.T_world_sensor);
        let is_elsewhere = || matcher.second_basin(&best, &Reach::anywhere(&best)).is_some();
        (!is_ambiguous(&last, &best) && !is_elsewhere()).then_some(best)
    }

    /// The members directly before and after a frame in the recording.
    fn neighbors(&self, number: u32) -> Vec<&Member> {
        let gap = |member: &&Member| member.number.abs_diff(number);
        let before = self.members.iter().filter(|member| member.number < number).min_by_key(gap);
        let after = self.members.iter().filter(|member| member.number > number).min_by_key(gap);
        before.into_iter().chain(after).collect()
    }
}

/// Whether another pose fits about as well at a different place: neither is accepted then.
fn is_ambiguous(other: &PoseHypothesis, best: &PoseHypothesis) -> bool {
    let is_another_place = apart(other.T_world_sensor(), best.T_world_sensor()) > MIN_PLACE_DISTANCE;
    let fits_as_well = other.agreement > best.agreement - MAX_AMBIGUOUS_AGREEMENT_LOSS
        && other.overlap > MIN_AMBIGUOUS_OVERLAP_RATIO * best.overlap;
    is_another_place && fits_as_well
}

/// The best pose near another one, after which the camera has moved as it did last.
pub(super) fn best_near(matcher: &FrameMatcher<'_>, T_world_near: &Pose3, last_motion: &Pose3) -> PoseHypothesis {
    matcher.best_of(&hypotheses::near_prediction(T_world_near, last_motion), T_world_near)
}

/// A pose away from the prediction must agree distinctly better and be constrained by the map.
fn better_of(near: PoseHypothesis, away: PoseHypothesis) -> PoseHypothesis {
    let is_better =
        away.agreement > near.agreement + MIN_AGREEMENT_GAIN && away.support > near.support + MIN_SUPPORT_GAIN;
    if is_better && away.is_constrained_by_map() { away } else { near }
}
