//! The motion prior, applied to a pose that hardly any surface constrains along one direction.

use super::super::evidence::MIN_AGREEMENT_DIFFERENCE;
use super::super::frame_matcher::FrameMatcher;
use super::super::hypotheses::translated;
use super::super::motion_prior::PredictedMotion;
use super::super::pose_hypothesis::{ERROR_RATIO, PoseHypothesis};
use super::Chain;
use crate::geometry::quantile::THREE_SIGMA;
use crate::registration::degeneracy::DegenerateDirection;

impl Chain {
    /// Moves a pose towards the motion prior along the direction that is least constrained, by the two variances. The result
    /// must not contradict the map; a direction that was undetermined remains so.
    pub(in super::super) fn apply_motion_prior(
        &self,
        matcher: &FrameMatcher<'_>,
        hypothesis: PoseHypothesis,
    ) -> PoseHypothesis {
        if hypothesis.is_placed_by_brightness || self.num_rejected > 0 || !hypothesis.is_plausible() {
            return hypothesis;
        }
        if !hypothesis.is_degenerate() && hypothesis.is_well_constrained() {
            return hypothesis;
        }
        let weakest = hypothesis.weakest;
        let Some(Posterior { offset, sigma }) = self.posterior_along(&hypothesis, &weakest) else { return hypothesis };
        let guess = translated(hypothesis.T_world_sensor(), &weakest.direction, offset);
        let mut moved = matcher.register_across(&weakest, guess);
        let is_contradicted = moved.agreement < hypothesis.agreement - MIN_AGREEMENT_DIFFERENCE;
        if is_contradicted || !(moved.registration.converged || hypothesis.is_degenerate()) {
            return hypothesis;
        }
        // Fixing a direction in the registration adds no information about it.
        moved.registration.information = hypothesis.registration.information;
        PoseHypothesis { degenerate_sigma: hypothesis.degenerate_sigma.map(|_| sigma), ..moved }
    }

    /// What the motion prior makes of the position along a direction; `None` without a prior, and where the two are incompatible.
    fn posterior_along(&self, hypothesis: &PoseHypothesis, weakest: &DegenerateDirection) -> Option<Posterior> {
        let motion = self.last.T_world_sensor.inverse() * hypothesis.T_world_sensor();
        let direction = self.last.T_world_sensor.rotation.inverse() * weakest.direction;
        let predicted = self.motion_prior.predict(&motion, &direction)?;
        // A registration that has not converged knows nothing about the direction.
        let sigma = match hypothesis.degenerate_sigma {
            _ if !hypothesis.registration.converged => f64::INFINITY,
            Some(sigma) => sigma,
            None => ERROR_RATIO * hypothesis.weakest_sigma(),
        };
        Posterior::of(direction.dot(&motion.translation.vector), sigma, &predicted)
    }
}

/// The position along a direction with the motion prior.
#[derive(Debug)]
struct Posterior {
    /// How far it is from where it was without it (m).
    offset: f64,
    /// Its standard deviation (m). The motion may be unlike those before it, so the offset counts in full.
    sigma: f64,
}

impl Posterior {
    /// Of a motion along the direction (m) that is known with a standard deviation of `sigma` (m); `None` where the prior is incompatible.
    fn of(along: f64, sigma: f64, predicted: &PredictedMotion) -> Option<Self> {
        let (difference, variance) = (predicted.along - along, sigma * sigma);
        // As after a dropped frame.
        let is_unusual = difference.abs() > THREE_SIGMA * (predicted.variance + variance).sqrt();
        let weight = 1.0 / (1.0 + predicted.variance / variance);
        let offset = weight * difference;
        (!is_unusual).then(|| Self { offset, sigma: (weight * predicted.variance).sqrt().hypot(offset) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF_A_METRE: PredictedMotion = PredictedMotion { along: 0.5, variance: 0.03 * 0.03 };

    #[test]
    fn a_prior_that_agrees_makes_a_position_certain_and_one_that_does_not_leaves_what_it_moves_it_by() {
        let agreeing = Posterior::of(0.49, 0.6, &HALF_A_METRE).unwrap();
        assert!((agreeing.offset - 0.01).abs() < 1e-3 && agreeing.sigma < 0.04, "{agreeing:?}");
        let disagreeing = Posterior::of(0.9, 0.6, &HALF_A_METRE).unwrap();
        assert!((disagreeing.offset + 0.4).abs() < 0.01 && disagreeing.sigma > 0.39, "{disagreeing:?}");
        assert!(Posterior::of(0.9, 0.05, &HALF_A_METRE).is_none(), "a motion unlike all before it");
    }

    #[test]
    fn what_is_not_known_is_predicted_and_what_is_known_well_hardly_moves() {
        let unknown = Posterior::of(0.52, f64::INFINITY, &HALF_A_METRE).unwrap();
        assert!((unknown.offset + 0.02).abs() < 1e-12 && (unknown.sigma - 0.03f64.hypot(0.02)).abs() < 1e-12);
        let known = Posterior::of(0.52, 0.003, &HALF_A_METRE).unwrap();
        assert!(known.offset.abs() < 1e-3 && known.sigma < 0.0031, "{known:?}");
    }
}
