//! Degenerate geometry: where hardly any surface constrains the position along one direction, free space may.

use super::evidence::{MIN_AGREEMENT_DIFFERENCE, ROUGH_TOLERANCE};
use super::frame_matcher::FrameMatcher;
use super::hypotheses::{REACH_ALL_AROUND, steps_within, translated};
use super::pose_hypothesis::{MOSTLY_MAPPED_OVERLAP, PoseHypothesis};
use crate::geometry::Pose3;
use crate::registration::degeneracy::DegenerateDirection;

impl FrameMatcher<'_> {
    /// Compares positions along the direction that the surfaces do not constrain. The registration does not see the borders of
    /// objects, but free space does: positions are compared by their agreement, and not by their overlap, which is largest
    /// where nothing new is in view.
    pub(super) fn resolve_degeneracy(&self, mut hypothesis: PoseHypothesis) -> PoseHypothesis {
        let weakest = hypothesis.weakest;
        let is_clear = hypothesis.registration.converged && hypothesis.is_well_constrained();
        if is_clear || hypothesis.has_constraining_surfaces() {
            return hypothesis;
        }
        let mut along = self.positions_along(&hypothesis, &weakest);
        if along.best_agreement > hypothesis.agreement + MIN_AGREEMENT_DIFFERENCE {
            let other = self.register_finely(along.best);
            // With much less of the map in view, its agreement tells little.
            let tells_as_much = other.overlap > MOSTLY_MAPPED_OVERLAP * hypothesis.overlap;
            if tells_as_much && other.agreement > hypothesis.agreement + MIN_AGREEMENT_DIFFERENCE {
                along = self.positions_along(&other, &weakest);
                hypothesis = other;
            }
        }
        let is_resolved = along.best_agreement < hypothesis.agreement - MIN_AGREEMENT_DIFFERENCE;
        // A registration that has not converged still moves along the direction.
        if !is_resolved || !hypothesis.registration.converged {
            hypothesis.degenerate_sigma = Some(along.sigma);
        }
        hypothesis
    }

    /// A hypothesis of which brightness contradicts the position along the weakest direction.
    pub(super) fn mark_degenerate(&self, hypothesis: PoseHypothesis) -> PoseHypothesis {
        let sigma = self.positions_along(&hypothesis, &hypothesis.weakest).sigma;
        PoseHypothesis { degenerate_sigma: Some(sigma), ..hypothesis }
    }

    /// Other positions of a hypothesis along a direction: as far as the search all around reaches, apart by the tolerance of initial poses.
    fn positions_along(&self, hypothesis: &PoseHypothesis, along: &DegenerateDirection) -> PositionsAlong {
        let others = steps_within(REACH_ALL_AROUND, ROUGH_TOLERANCE).filter(|steps| *steps != 0).map(|steps| {
            let distance = f64::from(steps) * ROUGH_TOLERANCE;
            let pose = translated(hypothesis.T_world_sensor(), &along.direction, distance);
            OtherPosition { distance, pose, agreement: self.evidence(&hypothesis.view, &self.middle, &pose).agreement }
        });
        PositionsAlong::of(hypothesis.agreement, others)
    }
}

/// A position beside that of a hypothesis.
struct OtherPosition {
    /// From there along the direction (m).
    distance: f64,
    pose: Pose3,
    agreement: f64,
}

/// Other positions along a direction.
struct PositionsAlong {
    /// The best agreement at any of them, ...
    best_agreement: f64,
    /// ... and the pose there.
    best: Pose3,
    /// Standard deviation (m) of those that agree no less than the hypothesis, which may be at any of them.
    sigma: f64,
}

impl PositionsAlong {
    /// Beside a hypothesis with this `agreement`.
    fn of(agreement: f64, others: impl Iterator<Item = OtherPosition>) -> Self {
        let (mut best_agreement, mut best) = (0.0, Pose3::identity());
        let (mut num_alike, mut sum_of_squares) = (1.0, 0.0);
        for other in others {
            if other.agreement > best_agreement {
                (best_agreement, best) = (other.agreement, other.pose);
            }
            if other.agreement >= agreement - MIN_AGREEMENT_DIFFERENCE {
                num_alike += 1.0;
                sum_of_squares += other.distance * other.distance;
            }
        }
        let variance_within_step = ROUGH_TOLERANCE * ROUGH_TOLERANCE / 12.0;
        Self { best_agreement, best, sigma: (sum_of_squares / num_alike + variance_within_step).sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Beside a hypothesis that agrees by 0.99, where those agree that `fits` names by their steps.
    fn positions(fits: impl Fn(i32) -> f64) -> PositionsAlong {
        let other = |steps: i32| OtherPosition {
            distance: f64::from(steps) * ROUGH_TOLERANCE,
            pose: Pose3::translation(f64::from(steps), 0.0, 0.0),
            agreement: fits(steps),
        };
        PositionsAlong::of(0.99, steps_within(REACH_ALL_AROUND, ROUGH_TOLERANCE).filter(|steps| *steps != 0).map(other))
    }

    #[test]
    fn a_position_is_as_uncertain_as_those_that_agree_about_as_well_are_far_apart() {
        let anywhere = positions(|_| 0.985);
        assert!((anywhere.sigma - 0.606).abs() < 1e-3, "uniform over two metres: {}", anywhere.sigma);
        let alone = positions(|_| 0.97);
        assert!((alone.sigma - ROUGH_TOLERANCE / 12f64.sqrt()).abs() < 1e-12, "within a step: {}", alone.sigma);
        let ahead = positions(|steps| if steps == 4 { 0.999 } else { 0.9 });
        assert_eq!((ahead.best_agreement, ahead.best.translation.x), (0.999, 4.0));
        assert!((ahead.sigma - (0.08f64 + 0.01 / 12.0).sqrt()).abs() < 1e-12, "here or there: {}", ahead.sigma);
    }
}
