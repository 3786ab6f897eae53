//! Degenerate geometry: where hardly any surface constrains the position along one direction, free space may.

use super::frame_matcher::FrameMatcher;
use super::pose_hypothesis::PoseHypothesis;
use crate::geometry::Pose3;
use crate::registration::degeneracy::DegenerateDirection;

/// Positions compared along an undetermined direction, to either side, ...
const NUM_OFFSETS: i32 = 10;
/// ... and their spacing (m).
const OFFSET_STEP: f64 = 0.1;
/// A position with less than this share of another one's overlap tells little by its agreement: less of the map is in view.
const MIN_OVERLAP_RATIO: f64 = 0.6;
/// Difference in agreement (0..=1) by which one position is told from another.
pub(super) const MIN_AGREEMENT_DIFFERENCE: f64 = 0.01;

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
        let agreement_here = self.agreement_at(&hypothesis, &weakest, 0).0;
        let (agreement_elsewhere, elsewhere) = self.best_at_offset(&hypothesis, &weakest);
        let mut is_resolved = agreement_elsewhere < agreement_here - MIN_AGREEMENT_DIFFERENCE;
        if agreement_elsewhere > agreement_here + MIN_AGREEMENT_DIFFERENCE {
            let other = self.register_finely(elsewhere);
            let tells_as_much = other.overlap > MIN_OVERLAP_RATIO * hypothesis.overlap;
            if tells_as_much && other.agreement > hypothesis.agreement + MIN_AGREEMENT_DIFFERENCE {
                is_resolved = self.best_at_offset(&other, &weakest).0 < other.agreement - MIN_AGREEMENT_DIFFERENCE;
                hypothesis = other;
            }
        }
        // A registration that has not converged still moves along the direction.
        hypothesis.is_degenerate = !is_resolved || !hypothesis.registration.converged;
        hypothesis
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
