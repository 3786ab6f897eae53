//! A pose hypothesis: a registration with its evidence, and the conditions under which it is accepted.

use nalgebra::Vector3;

use super::evidence::{FINE_TOLERANCE, LIMITS, MIN_AGREEMENT_DIFFERENCE, PoseEvidence, is_same_place};
use super::prediction_gate::PredictionGate;
use crate::geometry::Pose3;
use crate::geometry::quantile::THREE_SIGMA;
use crate::odometry::assessment::{Assessment, Evidence, Limits, Status, Unconstrained};
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::projective::ProjectiveTarget;
use crate::registration::spatial::SpatialRegistration;

/// Overlap (0..=1, of what this camera's frames can have) above which a frame lies mostly on the map: without a prediction it
/// has to. Half as much suffices outside the gate or after a gap, and constrains a pose, and half of that inside.
pub(crate) const MOSTLY_MAPPED_OVERLAP: f64 = 0.5;

/// A registration with the evidence for and against it.
pub(super) struct PoseHypothesis {
    pub(super) registration: SpatialRegistration,
    /// The direction that the surfaces of the registration constrain least.
    pub(super) weakest: DegenerateDirection,
    /// The map as seen from about this pose.
    pub(super) view: ProjectiveTarget,
    /// Agreeing less contradicting surface, as a share of all; the score by which hypotheses are ranked.
    pub(super) support: f64,
    /// Share of the frame's surface that lies on the map, 0..=1.
    pub(super) overlap: f64,
    /// Agreeing surface as a share of the agreeing and contradicting, 0..=1.
    pub(super) agreement: f64,
    /// [`PoseEvidence::normal_repeatability`], ...
    pub(super) normal_repeatability: f64,
    /// ... and its average over frames with certain poses: no larger share of a frame than that can agree.
    pub(super) expected_normal_repeatability: f64,
    /// Standard deviation (m) of the position along the weakest direction, where neither surfaces nor colours constrain it.
    pub(super) degenerate_sigma: Option<f64>,
    /// Whether the frame before it alone gives the same pose as the map.
    pub(super) is_tracked_on_map: bool,
    /// Offset (m, in the world) to another position where the frame fits about as well, if the camera may have come there.
    pub(super) second_basin: Option<Vector3<f64>>,
    /// Correlation of its brightness with the images of keyframes (-1..=1), where they show enough of it.
    pub(super) photometric_ncc: Option<f64>,
    /// Whether brightness tells its position along the weakest direction from all others.
    pub(super) is_placed_by_brightness: bool,
}

/// Share of the surfaces (0..=1) that face along the least constrained direction, above which they constrain it. Of 1486 frames of
/// generated flats with an agreement of at least 0.95, one with a larger share was off by more than 8 cm: it followed a frame that
/// was.
const WELL_CONSTRAINED_SHARE: f64 = 0.05;
/// Ratio of a pose's actual error to the standard deviation from its residuals, as if these were independent: those of one patch of
/// a surface are alike, and in frames that follow each other. Root mean square along the least constrained direction in generated flats, where
/// surfaces constrain it; of rendered cameras of four kinds, see docs/measurements/depth_ablations.md.
pub(super) const ERROR_RATIO: f64 = 10.0;

impl PoseHypothesis {
    /// A registration with its evidence; it is not known to be degenerate.
    pub(super) fn new(
        registration: SpatialRegistration,
        weakest: DegenerateDirection,
        view: ProjectiveTarget,
        evidence: &PoseEvidence,
        expected_normal_repeatability: f64,
    ) -> Self {
        let PoseEvidence { support, overlap, agreement, normal_repeatability } = *evidence;
        Self {
            registration,
            weakest,
            view,
            support,
            overlap,
            agreement,
            normal_repeatability,
            expected_normal_repeatability,
            degenerate_sigma: None,
            is_tracked_on_map: false,
            second_basin: None,
            photometric_ncc: None,
            is_placed_by_brightness: false,
        }
    }

    /// Standard deviation (m) along the weakest direction; see [`DegenerateDirection::sigma`].
    pub(super) fn weakest_sigma(&self) -> f64 {
        self.weakest.sigma(&self.registration.information)
    }

    /// Whether enough surfaces face along the weakest direction.
    pub(super) fn has_constraining_surfaces(&self) -> bool {
        self.weakest.share > WELL_CONSTRAINED_SHARE
    }

    /// Whether enough surfaces or small residuals constrain the weakest direction: to the tolerance of surfaces that agree (of 295 such
    /// frames of generated flats one was off by 4 cm, the others by less than 3). Information from the noise of normals does not
    /// count: it adds up with the number of points on a bare wall, and the noise moves with the camera.
    pub(super) fn is_well_constrained(&self) -> bool {
        let sigma = ERROR_RATIO * self.weakest_sigma() / self.weakest.informative_share.sqrt();
        self.has_constraining_surfaces() || THREE_SIGMA * sigma < FINE_TOLERANCE
    }

    /// Whether neither surfaces nor colours constrain the position along one direction.
    pub(super) fn is_degenerate(&self) -> bool {
        self.degenerate_sigma.is_some()
    }

    /// The pose.
    pub(super) fn T_world_sensor(&self) -> &Pose3 {
        &self.registration.T_target_source
    }

    /// The overlap as a share of what this camera's frames can have. The surfels of a noisy camera have other normals in every
    /// image: their repeatability is 0.6 to 0.9 for a RealSense D435, and 0.9 to 0.98 for a Kinect.
    fn relative_overlap(&self) -> f64 {
        (self.overlap / self.expected_normal_repeatability).min(1.0)
    }

    /// Whether most of the frame that can lie on the map does.
    fn is_mostly_mapped(&self) -> bool {
        self.relative_overlap() > MOSTLY_MAPPED_OVERLAP
    }

    /// Whether too little of the frame lies on the map, or too much of it in free space.
    pub(super) fn is_contradicted(&self) -> bool {
        self.overlap < LIMITS.lost_overlap || self.agreement < LIMITS.doubtful_agreement
    }

    /// Whether the evidence suffices for a pose in this relation to the prediction.
    pub(super) fn is_accepted(&self, gate: PredictionGate) -> bool {
        let is_revisit = self.photometric_ncc.is_some_and(is_same_place);
        let gate = if gate == PredictionGate::NoPrediction && is_revisit { PredictionGate::Outside } else { gate };
        let min_agreement = match gate {
            PredictionGate::Inside if self.is_mostly_mapped() => self.limits().doubtful_agreement,
            // No other pose can agree distinctly better ...
            PredictionGate::Inside => 1.0 - MIN_AGREEMENT_DIFFERENCE,
            // ... or half as much better, where more poses are possible.
            _ => 1.0 - MIN_AGREEMENT_DIFFERENCE / 2.0,
        };
        let min_overlap = match gate {
            PredictionGate::Inside => MOSTLY_MAPPED_OVERLAP / 4.0,
            PredictionGate::InsideAfterGap | PredictionGate::Outside => MOSTLY_MAPPED_OVERLAP / 2.0,
            PredictionGate::NoPrediction => MOSTLY_MAPPED_OVERLAP,
        };
        self.relative_overlap() > min_overlap
            && self.agreement > min_agreement
            && !self.is_degenerate()
            && self.second_basin.is_none()
            && self.registration.converged
    }

    /// The limits of the evidence. Less agreement suffices where the frame before it alone gives the same pose as the map: what contradicts
    /// the map then is the error of its surfaces, not of the pose.
    fn limits(&self) -> Limits {
        let is_confirmed = self.is_tracked_on_map && self.is_mostly_mapped();
        let doubtful_agreement = f64::midpoint(LIMITS.lost_agreement, LIMITS.doubtful_agreement);
        if is_confirmed { Limits { doubtful_agreement, ..LIMITS } } else { LIMITS }
    }

    /// Whether nothing contradicts it.
    pub(super) fn is_plausible(&self) -> bool {
        !self.is_contradicted() && (self.is_degenerate() || self.registration.converged)
    }

    /// Whether it may start or continue a tentative branch: plausible, but with too little evidence to be accepted.
    pub(super) fn is_tentative(&self, gate: PredictionGate) -> bool {
        self.is_degenerate_inside_gate(gate)
            || (self.is_plausible()
                && !self.is_degenerate()
                && gate != PredictionGate::NoPrediction
                && (self.agreement > 1.0 - MIN_AGREEMENT_DIFFERENCE || self.is_accepted(gate)))
    }

    /// Whether it lies inside the gate and is undetermined along one direction only. Outside the gate that says nothing: a
    /// bare wall fits anywhere.
    pub(super) fn is_degenerate_inside_gate(&self, gate: PredictionGate) -> bool {
        self.is_degenerate()
            && self.is_plausible()
            && matches!(gate, PredictionGate::Inside | PredictionGate::InsideAfterGap)
    }

    /// Whether the map that it was registered to constrains all directions.
    pub(super) fn is_constrained_by_map(&self) -> bool {
        self.relative_overlap() > MOSTLY_MAPPED_OVERLAP / 2.0
            && !self.is_contradicted()
            && !self.is_degenerate()
            && self.registration.converged
    }

    /// The assessment of a pose in this relation to the prediction.
    pub(super) fn assessment_at(&self, gate: PredictionGate) -> Assessment {
        let mut assessment = self.assessment();
        if let Some(offset) = self.second_basin {
            assessment.doubt_position(offset.norm());
        }
        if assessment.status != Status::Good || self.is_accepted(gate) {
            return assessment;
        }
        let reason = "it fits the map, but the overlap is too small to exclude another pose";
        Assessment { status: Status::Doubtful, reason: reason.to_owned(), ..assessment }
    }

    /// The assessment by overlap, agreement, degeneracy and convergence alone.
    pub(super) fn assessment(&self) -> Assessment {
        let registration = &self.registration;
        let evidence = Evidence {
            num_pairs: registration.last.num_inliers,
            overlap: self.overlap,
            agreement: Some(self.agreement),
            degenerate: self.is_degenerate().then_some(Unconstrained::Position),
            residual: registration.last.inlier_rmse,
            moving_after: (!registration.converged).then_some(registration.history.len()),
        };
        Assessment::of(&evidence, &self.limits())
    }
}
