//! The motion prior, applied to a pose that hardly any surface constrains along one direction.

use super::super::Verification;
use super::super::frame_matcher::FrameMatcher;
use super::super::pose_hypothesis::PoseHypothesis;
use super::super::resolve_degeneracy::MIN_AGREEMENT_DIFFERENCE;
use super::Chain;
use crate::geometry::Pose3;
use crate::registration::degeneracy::DegenerateDirection;

/// Ratio of a pose's actual error along its least constrained direction to the standard deviation from its residuals (root
/// mean square in generated flats): the errors of surfaces are correlated. Where surfaces constrain the direction, ...
const CONSTRAINED_ERROR_RATIO: f64 = 10.0;
/// Largest difference from the motion prior (standard deviations) for which it is applied: a larger one means an unusual
/// motion, as after a dropped frame.
const MAX_PRIOR_SIGMAS: f64 = 3.0;

impl Chain {
    /// Moves a pose towards the motion prior along the direction that is least constrained, by the two variances. The result
    /// must not contradict the map; a direction that was undetermined remains so.
    pub(in super::super) fn apply_motion_prior(
        &self,
        matcher: &FrameMatcher<'_>,
        hypothesis: PoseHypothesis,
    ) -> PoseHypothesis {
        let is_off = self.options.verification == Verification::Off;
        if is_off || hypothesis.is_placed_by_brightness || self.num_rejected > 0 || !hypothesis.is_plausible() {
            return hypothesis;
        }
        let (weakest, sigma) = (hypothesis.weakest, hypothesis.weakest_sigma());
        if !hypothesis.is_degenerate && hypothesis.is_well_constrained() {
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
            (true, true) => hypothesis.open_error_ratio() * sigma,
            (true, false) => CONSTRAINED_ERROR_RATIO * sigma,
        };
        let difference = predicted.along - direction.dot(&motion.translation.vector);
        let variance = sigma * sigma;
        let is_unusual =
            difference * difference > MAX_PRIOR_SIGMAS * MAX_PRIOR_SIGMAS * (predicted.variance + variance);
        (!is_unusual).then_some(difference / (1.0 + predicted.variance / variance))
    }
}
