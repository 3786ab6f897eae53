//! Tracking: a frame is registered to the frame before it alone, whatever the map says.
//!
//! In a video two frames that follow each other show much the same. Their relation is certain even where noise, moving objects
//! or drift make a frame contradict the map. So a frame is not lost while tracking holds, and the map goes on growing.

use std::sync::Arc;

use super::super::frame_matcher::{FrameMatcher, SAME_POSE_DISTANCE};
use super::super::pose_hypothesis::PoseHypothesis;
use super::super::prediction_gate::PredictionGate;
use super::super::reference_map::ReferenceMap;
use super::{Chain, Outcome, SpatialEstimate};
use crate::geometry::Pose3;
use crate::map::keyframes::apart;
use crate::odometry::assessment::Status;
use crate::registration::prepared_surfels::PreparedSurfels;

/// Overlap (0..=1) of a frame with the one before it above which it may be tracked. Of a noisy camera's surfaces hardly more
/// than half agree within the tolerance, even while the camera stands still.
const MIN_TRACKED_OVERLAP: f64 = 0.3;
/// Distance (m, two metres per radian) from the last pose or from the constant-velocity prediction up to which a frame may be
/// tracked: the registration converges from there, and few repetitive structures have a period as short.
const MAX_TRACKED_DISTANCE: f64 = 0.3;

/// A frame with its pose, to which the next one may be registered.
#[derive(Clone)]
pub(super) struct PosedFrame {
    frame: Arc<PreparedSurfels>,
    pub(super) T_world_sensor: Pose3,
}

impl PosedFrame {
    pub(super) fn new(frame: &PreparedSurfels, T_world_sensor: Pose3) -> Self {
        Self { frame: Arc::new(frame.clone()), T_world_sensor }
    }
}

impl Chain {
    /// The estimate of a frame that the map does not accept near the prediction (`by_map`), but that follows the frame before it
    /// as in a video; `None` if it does not.
    pub(super) fn follow(&mut self, number: u32, frame: &PreparedSurfels, by_map: &PoseHypothesis) -> Option<Outcome> {
        if let Some(tracked) = self.track(&self.last, frame, &self.last_motion) {
            return Some(self.append_tracked(number, frame, by_map, &tracked));
        }
        let rejected = self.rejected.as_ref()?;
        let tracked = self.track(rejected, frame, &Pose3::identity())?;
        Some(self.reject_tracked(frame, tracked).into())
    }

    /// The pose of a frame by the one before it, if the two determine it.
    fn track(&self, before: &PosedFrame, frame: &PreparedSurfels, last_motion: &Pose3) -> Option<PoseHypothesis> {
        let (mut reference, T_world_before) = (ReferenceMap::default(), before.T_world_sensor);
        let view = reference.map.view(&before.frame.image, &T_world_before);
        reference.insert(&before.frame, 0, &T_world_before, &view);
        let matcher = FrameMatcher::new(&reference, frame, self.options);
        let predictions = [T_world_before, T_world_before * last_motion];
        let is_tracked = |found: &PoseHypothesis| {
            let T_world_sensor = found.T_world_sensor();
            let is_near = predictions.iter().any(|T| apart(T, T_world_sensor) < MAX_TRACKED_DISTANCE);
            is_near && found.overlap > MIN_TRACKED_OVERLAP && found.is_accepted(PredictionGate::Inside)
        };
        let found = predictions.iter().map(|T| matcher.register_at(*T)).filter(is_tracked);
        let found = found.max_by(|a, b| a.support.total_cmp(&b.support));
        // From coarse to fine for fast motions: that may leave the basin of a good prediction.
        found.or_else(|| Some(matcher.best_of(&predictions, &T_world_before)).filter(is_tracked))
    }

    /// Adds a tracked frame to the map. Where the pose by the map is about the same, that is taken, for it drifts less.
    fn append_tracked(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        by_map: &PoseHypothesis,
        tracked: &PoseHypothesis,
    ) -> Outcome {
        let matcher = self.matcher(frame);
        let is_same = |hypothesis: &PoseHypothesis| {
            apart(hypothesis.T_world_sensor(), tracked.T_world_sensor()) < SAME_POSE_DISTANCE
        };
        let guess = if is_same(by_map) { by_map } else { tracked };
        let mut hypothesis = matcher.register_at(*guess.T_world_sensor());
        if !is_same(&hypothesis) {
            hypothesis = matcher.at_pose_of(tracked);
        }
        let gate = self.gate_of(&hypothesis);
        if self.is_accepted(&hypothesis, gate) {
            return self.accept(number, frame, hypothesis);
        }
        let mut assessment = hypothesis.assessment_at(gate, self.is_photometrically_consistent(&hypothesis));
        if assessment.status == Status::Lost {
            assessment.mark_tracked(hypothesis.overlap);
        }
        self.append(number, frame, hypothesis, Some(assessment)).into()
    }

    /// The estimate of a frame that follows a rejected one. Its position relative to the map is as uncertain.
    fn reject_tracked(&mut self, frame: &PreparedSurfels, tracked: PoseHypothesis) -> SpatialEstimate {
        let (T_world_sensor, mut assessment) = (*tracked.T_world_sensor(), tracked.assessment());
        assessment.mark_dependent_on_uncertain_pose();
        self.rejected = Some(PosedFrame::new(frame, T_world_sensor));
        self.num_rejected += 1;
        let (registration, overlap) = (Some(tracked.registration), tracked.overlap);
        SpatialEstimate { T_world_sensor, overlap, assessment, registration, is_in_map: false }
    }
}

impl FrameMatcher<'_> {
    /// A registration to another reference, with the evidence of this one.
    fn at_pose_of(&self, tracked: &PoseHypothesis) -> PoseHypothesis {
        let (registration, view) = (tracked.registration.clone(), self.view_from(tracked.T_world_sensor()));
        let evidence = self.evidence(&view, &self.middle, tracked.T_world_sensor());
        PoseHypothesis::new(registration, view, &evidence)
    }
}
