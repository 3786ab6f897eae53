//! A second basin: another position that the frame fits about as well, as between pillars at equal distances.
//!
//! The frame and the map alone do not tell which of the two is right. A bound on the camera's motion may exclude the other one.

use nalgebra::Vector3;

use super::evidence::{MIN_AGREEMENT_DIFFERENCE, NUM_SCORED_POINTS, is_distinct, score};
use super::frame_matcher::{FrameMatcher, middle_options, rough_options};
use super::hypotheses::{GRID_STEP, MIN_DISTANCE, best_apart, grid_around};
use super::pose_hypothesis::PoseHypothesis;
use super::prediction_gate::{MAX_STEP, PredictionGate};
use super::propose::NUM_REFINED;
use crate::geometry::Pose3;

/// Where a camera may be (m).
pub(super) struct SearchArea {
    center: Vector3<f64>,
    radius: f64,
}

impl SearchArea {
    /// After a step from the last pose.
    pub(super) fn from_last(T_world_last: &Pose3, radius: f64) -> Self {
        Self { center: T_world_last.translation.vector, radius }
    }

    /// Without a pose before it: as far as a step and the position may be off.
    pub(super) fn anywhere(hypothesis: &PoseHypothesis) -> Self {
        Self { center: hypothesis.T_world_sensor().translation.vector, radius: MAX_STEP + MIN_DISTANCE }
    }

    fn contains(&self, T: &Pose3) -> bool {
        (T.translation.vector - self.center).norm() < self.radius
    }
}

impl FrameMatcher<'_> {
    /// The offset (m, in the world) from a pose to another position of the area that the frame fits about as well.
    pub(super) fn second_basin(&self, hypothesis: &PoseHypothesis, area: &SearchArea) -> Option<Vector3<f64>> {
        let view = &hypothesis.view;
        let offset = |T: &Pose3| T.translation.vector - hypothesis.T_world_sensor().translation.vector;
        let is_elsewhere = |T: &Pose3| offset(T).norm() > MIN_DISTANCE && area.contains(T);
        let sparse = self.sparse.point_batch();
        let refined = self.likely_positions(hypothesis, area, is_elsewhere).into_iter().filter_map(|guess| {
            let rough = self.register(view, &self.sparse, guess, &rough_options()).T_target_source;
            let is_possible = is_elsewhere(&rough) && score(view, &sparse, &rough) > 0.0;
            is_possible.then(|| self.register(view, &self.middle, rough, &middle_options()).T_target_source)
        });
        // One that has come back to the pose itself would hide the others.
        let elsewhere = refined.filter(is_elsewhere).map(|T| (self.evidence(view, &self.middle, &T), T));
        // The final registration moves a pose by centimetres, which does not make a lost one fit.
        let possible = elsewhere.filter(|(evidence, _)| !evidence.is_lost());
        let best = possible.max_by(|a, b| a.0.support.total_cmp(&b.0.support))?.1;
        let other = self.register_finely(best);
        let fits_as_well = other.agreement > hypothesis.agreement - MIN_AGREEMENT_DIFFERENCE
            && other.is_accepted(PredictionGate::Outside);
        let is_second =
            is_elsewhere(other.T_world_sensor()) && fits_as_well && !self.brightness_rules_out(&other, hypothesis);
        is_second.then(|| offset(other.T_world_sensor()))
    }

    /// Positions of a grid whose scores allow that the frame fits nearby, each far enough from those with higher scores.
    fn likely_positions(
        &self,
        hypothesis: &PoseHypothesis,
        area: &SearchArea,
        is_elsewhere: impl Fn(&Pose3) -> bool,
    ) -> Vec<Pose3> {
        let (T_world_sensor, view) = (hypothesis.T_world_sensor(), &hypothesis.view);
        let points = self.sparse.at_most(NUM_SCORED_POINTS).point_batch();
        let around = Pose3::from_parts(area.center.into(), T_world_sensor.rotation);
        let positions = grid_around(&around, 0..=0, 0.0, [area.radius; 2], GRID_STEP).filter(is_elsewhere);
        // Where more contradicts the map than agrees with it, no pose nearby fits.
        let scored = positions.map(|T| (score(view, &points, &T), T)).filter(|(score, _)| *score > 0.0).collect();
        let is_apart =
            |T: &Pose3, other: &Pose3| (other.translation.vector - T.translation.vector).norm() > MIN_DISTANCE;
        best_apart(scored, NUM_REFINED[0], is_apart)
    }

    /// Whether brightness tells a pose from another one that surfaces do not tell from it.
    fn brightness_rules_out(&self, other: &PoseHypothesis, hypothesis: &PoseHypothesis) -> bool {
        let Some(textured) = &self.textured else { return false };
        let ncc = |hypothesis: &PoseHypothesis| self.photometric_ncc(textured, hypothesis.T_world_sensor());
        ncc(hypothesis).is_some_and(|here| is_distinct(here, ncc(other).unwrap_or(0.0)))
    }
}
