//! Degenerate geometry: where hardly any surface constrains the position along one direction, free space may.

use nalgebra::Vector3;

use super::evidence::FINE_TOLERANCE;
use super::frame_matcher::FrameMatcher;
use super::pose_hypothesis::PoseHypothesis;
use crate::geometry::Pose3;
use crate::map::keyframes::apart;
use crate::registration::degeneracy::DegenerateDirection;

/// Positions compared along an undetermined direction, to either side, ...
const NUM_OFFSETS: i32 = 10;
/// ... and their spacing (m).
const OFFSET_STEP: f64 = 0.1;
/// Share of the surfaces facing along the least constrained direction (0..=1) above which they constrain it. Of 1486 frames
/// of generated flats that agreed by 0.95 none with more was off by over 8 cm, but for one after a frame that was.
const WELL_CONSTRAINED_SHARE: f64 = 0.05;
/// Standard deviation along it, from the residuals (m), below which fewer surfaces constrain it, too: of 295 such frames of
/// generated flats one was off by 4 cm, the others by less than 3.
const WELL_CONSTRAINED_SIGMA: f64 = 1e-3;
/// Standard deviation (m) from which they do not: errors of decimetres are as common there as small ones.
const UNCONSTRAINED_SIGMA: f64 = 2e-3;
/// In between, the registration is repeated from this far along the direction to either side (m), ...
const PERTURBATION: f64 = 0.075;
/// ... and must return to within this distance (m, two metres per radian). Noise alone does not lead back.
const MAX_RETURN_DISTANCE: f64 = 0.02;
/// Difference in agreement (0..=1) by which one position is told from another.
pub(super) const MIN_AGREEMENT_DIFFERENCE: f64 = 0.01;

impl FrameMatcher<'_> {
    /// Compares positions along the direction that the surfaces do not constrain. The registration does not see the borders of
    /// objects, but free space does: positions are compared by their agreement, and not by their overlap, which is largest
    /// where nothing new is in view.
    pub(super) fn resolve_degeneracy(&self, mut hypothesis: PoseHypothesis) -> PoseHypothesis {
        let (weakest, share) = DegenerateDirection::weakest(&hypothesis.registration.correspondences, FINE_TOLERANCE);
        if self.is_constrained(&hypothesis, &weakest, share) {
            return hypothesis;
        }
        let agreement_here = self.agreement_at(&hypothesis, &weakest, 0).0;
        let (agreement_elsewhere, elsewhere) = self.best_at_offset(&hypothesis, &weakest);
        let mut is_resolved = agreement_elsewhere < agreement_here - MIN_AGREEMENT_DIFFERENCE;
        if agreement_elsewhere > agreement_here + MIN_AGREEMENT_DIFFERENCE {
            let other = self.register_finely(elsewhere);
            if other.agreement > hypothesis.agreement + MIN_AGREEMENT_DIFFERENCE {
                is_resolved = self.best_at_offset(&other, &weakest).0 < other.agreement - MIN_AGREEMENT_DIFFERENCE;
                hypothesis = other;
            }
        }
        // A registration that has not converged still moves along the direction.
        hypothesis.is_degenerate = !is_resolved || !hypothesis.registration.converged;
        hypothesis
    }

    /// Whether surfaces constrain the weakest direction: enough of them face along it (`share`), or their residuals are small,
    /// or the registration returns to this pose from both sides.
    fn is_constrained(&self, hypothesis: &PoseHypothesis, weakest: &DegenerateDirection, share: f64) -> bool {
        let sigma = weakest.sigma(&hypothesis.registration.information);
        let returns = || {
            [-PERTURBATION, PERTURBATION].iter().all(|distance| self.returns(hypothesis, weakest.direction * *distance))
        };
        share > WELL_CONSTRAINED_SHARE
            || hypothesis.registration.converged
                && (is_well_constrained(share, sigma) || (sigma < UNCONSTRAINED_SIGMA && returns()))
    }

    /// Whether the registration from a perturbed pose returns to this one, or ends where the evidence contradicts it.
    fn returns(&self, hypothesis: &PoseHypothesis, perturbation: Vector3<f64>) -> bool {
        let T_world_sensor = hypothesis.T_world_sensor();
        let T_perturbation = Pose3::translation(perturbation.x, perturbation.y, perturbation.z);
        let again = self.register_finely(T_perturbation * T_world_sensor);
        apart(T_world_sensor, again.T_world_sensor()) < MAX_RETURN_DISTANCE
            || again.agreement < hypothesis.agreement - MIN_AGREEMENT_DIFFERENCE
    }

    /// The agreement at a number of steps along a direction, and the pose there.
    fn agreement_at(&self, hypothesis: &PoseHypothesis, along: &DegenerateDirection, steps: i32) -> (f64, Pose3) {
        let offset = along.direction * (f64::from(steps) * OFFSET_STEP);
        let pose = Pose3::translation(offset.x, offset.y, offset.z) * hypothesis.T_world_sensor();
        (self.evidence(&hypothesis.view, &self.middle, &pose).agreement, pose)
    }

    /// The best agreement at other positions along a direction, and the pose there.
    fn best_at_offset(&self, hypothesis: &PoseHypothesis, along: &DegenerateDirection) -> (f64, Pose3) {
        let steps = (-NUM_OFFSETS..=NUM_OFFSETS).filter(|steps| *steps != 0);
        let agreements = steps.map(|steps| self.agreement_at(hypothesis, along, steps));
        agreements.fold((0.0, Pose3::identity()), |best, next| if next.0 > best.0 { next } else { best })
    }
}

/// Whether surfaces constrain a direction that this share of them face along, with this standard deviation (m).
pub(super) fn is_well_constrained(share: f64, sigma: f64) -> bool {
    share > WELL_CONSTRAINED_SHARE || sigma < WELL_CONSTRAINED_SIGMA
}
