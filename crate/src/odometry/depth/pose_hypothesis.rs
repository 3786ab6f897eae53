//! A registration with what speaks for and against it, and whether it is believed.

use super::evidence::FINE_TOLERANCE;
use super::tentative_branch::PoseUncertainty;
use crate::geometry::Pose3;
use crate::geometry::rotation::angle_of;
use crate::odometry::assessment::{Assessment, Evidence, Limits, Status, Unconstrained};
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::projective::ProjectiveTarget;
use crate::registration::spatial::SpatialRegistration;

/// A frame is placed beyond doubt when so much of what can be told agrees: right after a believed frame, where at least half
/// of it lies on the map, ...
const MIN_AGREEMENT_MOSTLY_MAPPED: f64 = 0.95;
/// ... after a few others, where at least half of it lies on the map, ...
const MIN_AGREEMENT_MOSTLY_MAPPED_AFTER_GAP: f64 = 0.98;
/// ... where it is less than half, ...
const MIN_AGREEMENT: f64 = 0.99;
/// ... and where nothing tells that it should be there.
const MIN_AGREEMENT_OUTSIDE_GATE: f64 = 0.995;
const MOSTLY_MAPPED_OVERLAP: f64 = 0.5;
/// So much of it must lie on the map: right after a frame that is believed, ...
const MIN_OVERLAP: f64 = 0.15;
/// ... after a few others, ...
const MIN_OVERLAP_AFTER_GAP: f64 = 0.2;
/// ... and so much where nothing tells that it should be there.
const MIN_OVERLAP_WITHOUT_PREDICTION: f64 = 0.5;
/// Frames are expected so far from the one before (m), ...
const GATE_TRANSLATION: f64 = 1.5;
/// ... and turned so far (rad).
const GATE_ROTATION: f64 = 1.15;
/// Places that look so much like the pictures have been seen before.
const MIN_REVISIT_NCC: f64 = 0.95;
/// Frames are not out of the question so far from the one before (m), turned in any way. What is seen of them then must agree
/// as if it were afar, ...
const MAX_STEP_TRANSLATION: f64 = 2.5;
/// ... and be at least so much of them.
const MIN_OVERLAP_OUTSIDE_GATE: f64 = 0.25;
/// After more frames than this without a place nothing is expected.
const GATE_MAX_GAP: u32 = 2;
/// What was seen before frames in doubt holds a frame after them when it shows so much of it.
const MIN_CONSTRAINING_OVERLAP: f64 = 0.25;
/// A frame that hardly overlaps the map is not believed: nothing ties it down. On the recordings at hand, with up to three frames
/// of four left out, right registrations agree by 0.95 to 1, and ones that are wrong by half a metre mostly by less than 0.9; a
/// doubtful frame is no part of the map.
const LIMITS: Limits = Limits { lost_overlap: 0.1, lost_agreement: 0.85, doubtful_agreement: 0.95, ..Limits::NONE };

/// How much a place is what was to be expected. No more is asked of motion: robots stop and turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PredictionGate {
    /// Within reach of the frame before.
    Inside,
    /// Within reach of one a few frames before or after.
    InsideAfterGap,
    /// Further than is to be expected, but not out of the question.
    Outside,
    NoPrediction,
}

impl PredictionGate {
    /// From a frame that is placed, with so many between.
    pub(super) fn between(T_world_placed: &Pose3, T_world_sensor: &Pose3, num_between: u32) -> Self {
        let moved = T_world_placed.inverse() * T_world_sensor;
        let (far, turned) = (moved.translation.vector.norm(), angle_of(&moved.rotation));
        let is_far = far > GATE_TRANSLATION || turned > GATE_ROTATION;
        match num_between {
            0..=GATE_MAX_GAP if is_far && far < MAX_STEP_TRANSLATION => Self::Outside,
            _ if is_far => Self::NoPrediction,
            0 => Self::Inside,
            1..=GATE_MAX_GAP => Self::InsideAfterGap,
            _ => Self::NoPrediction,
        }
    }
}

/// A registration with what speaks for and against it.
pub(super) struct PoseHypothesis {
    pub(super) registration: SpatialRegistration,
    /// The map as seen from about there.
    pub(super) view: ProjectiveTarget,
    pub(super) support: f64,
    pub(super) overlap: f64,
    pub(super) agreement: f64,
    /// Whether it might as well stand somewhere else along a direction.
    pub(super) is_degenerate: bool,
    /// How well its brightness agrees with the pictures of key frames (-1..=1), where they show enough of it.
    pub(super) photometric_ncc: Option<f64>,
}

impl PoseHypothesis {
    /// Whether it stands in free space, or on nothing that is known.
    pub(super) fn is_contradicted(&self) -> bool {
        self.overlap < LIMITS.lost_overlap || self.agreement < LIMITS.doubtful_agreement
    }

    /// Whether surfaces place it beyond doubt. Where brightness agrees as well, it need not show that much of what is known.
    pub(super) fn is_accepted(&self, gate: PredictionGate) -> bool {
        let is_seen_again = self.photometric_ncc.is_some_and(|photometric_ncc| photometric_ncc > MIN_REVISIT_NCC);
        let gate = if gate == PredictionGate::NoPrediction && is_seen_again { PredictionGate::Outside } else { gate };
        let (overlap, agreement, agreement_of_half) = match gate {
            PredictionGate::Inside => (MIN_OVERLAP, MIN_AGREEMENT, MIN_AGREEMENT_MOSTLY_MAPPED),
            PredictionGate::InsideAfterGap => {
                (MIN_OVERLAP_AFTER_GAP, MIN_AGREEMENT, MIN_AGREEMENT_MOSTLY_MAPPED_AFTER_GAP)
            }
            PredictionGate::Outside => {
                (MIN_OVERLAP_OUTSIDE_GATE, MIN_AGREEMENT_OUTSIDE_GATE, MIN_AGREEMENT_OUTSIDE_GATE)
            }
            PredictionGate::NoPrediction => {
                (MIN_OVERLAP_WITHOUT_PREDICTION, MIN_AGREEMENT_OUTSIDE_GATE, MIN_AGREEMENT_OUTSIDE_GATE)
            }
        };
        let least = if self.overlap > MOSTLY_MAPPED_OVERLAP { agreement_of_half } else { agreement };
        self.overlap > overlap && self.agreement > least && !self.is_degenerate && self.registration.converged
    }

    /// Whether it may well be there, for all that can be told.
    pub(super) fn is_plausible(&self) -> bool {
        !self.is_contradicted() && (self.is_degenerate || self.registration.converged)
    }

    /// Whether it is where it may be, though little says so, or nothing along a direction.
    pub(super) fn is_tentative(&self, gate: PredictionGate) -> bool {
        self.is_degenerate_inside_gate(gate)
            || (self.is_plausible()
                && !self.is_degenerate
                && gate != PredictionGate::NoPrediction
                && (self.agreement > MIN_AGREEMENT || self.is_accepted(gate)))
    }

    /// Whether it is about where it is to be expected, and only its place along a direction is not told. Further away it may
    /// be anywhere: bare walls fit everywhere.
    pub(super) fn is_degenerate_inside_gate(&self, gate: PredictionGate) -> bool {
        self.is_degenerate
            && self.is_plausible()
            && matches!(gate, PredictionGate::Inside | PredictionGate::InsideAfterGap)
    }

    /// How it may be off where its place is not certain.
    pub(super) fn doubt(&self) -> PoseUncertainty {
        if self.is_degenerate {
            PoseUncertainty::Along(
                DegenerateDirection::weakest(&self.registration.correspondences, FINE_TOLERANCE).0.direction,
            )
        } else {
            PoseUncertainty::Anywhere
        }
    }

    /// Whether what has been seen holds it in all directions.
    pub(super) fn is_constrained_by_map(&self) -> bool {
        self.overlap > MIN_CONSTRAINING_OVERLAP
            && !self.is_contradicted()
            && !self.is_degenerate
            && self.registration.converged
    }

    /// The same with what must be asked of a place that is so much, or so little, what was to be expected.
    pub(super) fn assessment_at(&self, gate: PredictionGate, is_photometrically_consistent: bool) -> Assessment {
        let assessment = self.assessment();
        if assessment.status != Status::Good || (self.is_accepted(gate) && is_photometrically_consistent) {
            return assessment;
        }
        let reason = if is_photometrically_consistent {
            "it fits what was seen before, but so little of it that it may be elsewhere"
        } else {
            "its surfaces fit what was seen before, but its colours do not: it may be one repetition away"
        };
        Assessment { status: Status::Doubtful, reason: reason.to_owned(), ..assessment }
    }

    /// What the surfaces alone tell.
    pub(super) fn assessment(&self) -> Assessment {
        let registration = &self.registration;
        let evidence = Evidence {
            num_pairs: registration.last.num_inliers,
            overlap: self.overlap,
            agreement: Some(self.agreement),
            degenerate: self.is_degenerate.then_some(Unconstrained::Position),
            residual: registration.last.inlier_rmse,
            moving_after: (!registration.converged).then_some(registration.history.len()),
        };
        Assessment::of(&evidence, &LIMITS)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    fn at(metres: f64, degrees: f64) -> Pose3 {
        Isometry3::new(Vector3::z() * metres, Vector3::y() * degrees.to_radians())
    }

    #[test]
    fn less_is_expected_the_further_a_place_is_and_the_longer_nothing_was_known() {
        let gate = |metres, degrees, between| {
            PredictionGate::between(&at(1.0, 10.0), &(at(1.0, 10.0) * at(metres, degrees)), between)
        };
        assert_eq!(gate(1.0, 50.0, 0), PredictionGate::Inside);
        assert_eq!(gate(1.0, 50.0, 2), PredictionGate::InsideAfterGap);
        assert_eq!(gate(1.0, 50.0, 3), PredictionGate::NoPrediction);
        assert_eq!(gate(2.0, 0.0, 0), PredictionGate::Outside);
        assert_eq!(gate(0.0, 170.0, 1), PredictionGate::Outside);
        assert_eq!(gate(3.0, 0.0, 0), PredictionGate::NoPrediction);
    }
}
