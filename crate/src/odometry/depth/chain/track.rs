//! Tracking: a frame is registered to the frame before it alone, whatever the map says.
//!
//! In a video two frames that follow each other show much the same. Their relation is certain even where noise, moving objects
//! or drift make a frame contradict the map. So a frame is not lost while tracking holds, and the map goes on growing.

use std::sync::Arc;

use super::super::DepthOptions;
use super::super::frame_matcher::FrameMatcher;
use super::super::hypotheses::{CONVERGING_DISTANCE, SAME_POSE_DISTANCE};
use super::super::pose_hypothesis::PoseHypothesis;
use super::super::prediction_gate::PredictionGate;
use super::super::reference_map::ReferenceMap;
use super::Chain;
use super::assess::Proposal;
use crate::geometry::Pose3;
use crate::geometry::pose_distance::pose_distance;
use crate::odometry::assessment::Status;
use crate::registration::prepared_surfels::PreparedSurfels;

/// Overlap (0..=1) of a frame with the one before it above which it may be tracked. Of a noisy camera's surfaces hardly more
/// than half agree within the tolerance, even while the camera stands still. Without it, one of three frames of d435_robot through a rolling
/// shutter are off by 83 mm in the mean (12 mm); with half of what the camera's frames can have, 9 of 30 frames of one of four, backwards, are
/// doubtful (none).
const MIN_TRACKED_OVERLAP: f64 = 0.3;

/// A frame with its pose, to which the next one may be registered.
#[derive(Clone)]
pub(super) struct PosedFrame {
    /// Its number among all frames.
    pub(super) number: u32,
    frame: Arc<PreparedSurfels>,
    pub(super) T_world_sensor: Pose3,
    /// Its motion from the frame before it that has a pose, which may be several frames earlier; identity where there is none.
    pub(super) motion: Pose3,
}

impl PosedFrame {
    pub(super) fn new(number: u32, frame: &PreparedSurfels, T_world_sensor: Pose3, motion: Pose3) -> Self {
        Self { number, frame: Arc::new(frame.clone()), T_world_sensor, motion }
    }

    /// Where the next frame may be: the same pose, and the constant-velocity prediction.
    pub(super) fn predictions(&self) -> [Pose3; 2] {
        [self.T_world_sensor, self.T_world_sensor * self.motion]
    }
}

impl Chain {
    /// The pose of a frame that the map does not accept near the prediction (`near`), but that follows the frame before it as
    /// in a video; `None` if it does not. Where the pose by the map is about the same, that is taken, for it drifts less.
    pub(in super::super) fn track(
        &self,
        frame: &PreparedSurfels,
        matcher: &FrameMatcher<'_>,
        near: &PoseHypothesis,
    ) -> Option<Proposal> {
        let Some(tracked) = self.track_from(&self.last, frame) else {
            let tracked = self.track_from(self.rejected.as_ref()?, frame)?;
            return Some(Proposal::TrackedFromRejected(tracked));
        };
        let is_same = |hypothesis: &PoseHypothesis| {
            pose_distance(hypothesis.T_world_sensor(), tracked.T_world_sensor()) < SAME_POSE_DISTANCE
        };
        let guess = if is_same(near) { near } else { &tracked };
        let by_map = matcher.register_at(*guess.T_world_sensor());
        if is_same(&by_map) {
            return Some(Proposal::Tracked(PoseHypothesis { is_tracked_on_map: true, ..by_map }));
        }
        let view = matcher.view_from(tracked.T_world_sensor());
        Some(Proposal::Tracked(matcher.with_evidence(tracked.registration, tracked.weakest, view)))
    }

    /// Pose of the world of a chain that this one replaces, by its last frame, from a guess; `None` where the evidence contradicts it.
    pub(in super::super) fn join_last_of(&self, replaced: &Self, T_world_replaced: &Pose3) -> Option<Pose3> {
        let PosedFrame { frame, T_world_sensor: T_replaced_last, .. } = &replaced.last;
        let found = self.matcher(frame).register_at(T_world_replaced * T_replaced_last);
        let is_contradicted = found.assessment().status == Status::Lost;
        (!is_contradicted).then(|| found.T_world_sensor() * T_replaced_last.inverse())
    }

    /// The pose of a frame by one before it alone, if the two determine it.
    fn track_from(&self, before: &PosedFrame, frame: &PreparedSurfels) -> Option<PoseHypothesis> {
        let (normal_repeatability, T_world_before) = (self.reference.normal_repeatability, before.T_world_sensor);
        let mut reference = ReferenceMap { normal_repeatability, ..ReferenceMap::default() };
        let view = reference.map.view(&before.frame.image, &T_world_before);
        reference.insert(&before.frame, 0, &T_world_before, &view);
        // The frame before has as much noise as this one; the map has less.
        let options = DepthOptions { noise: self.options.noise.of_difference(), ..self.options };
        let matcher = FrameMatcher::new(&reference, frame, options);
        let (predictions, stays_near) = (before.predictions(), self.stays_near(1));
        // Near the last pose or the constant-velocity prediction, in rotation too: upside down a bare room looks much the same.
        let is_tracked = |found: &PoseHypothesis| {
            let is_near = predictions.iter().any(|T| pose_distance(T, found.T_world_sensor()) < CONVERGING_DISTANCE);
            // Where no other pose is within reach of the camera, it need not be excluded by more agreement.
            let is_constrained =
                found.is_accepted(PredictionGate::Inside) || (stays_near && found.is_constrained_by_map());
            is_near && found.overlap > MIN_TRACKED_OVERLAP && is_constrained
        };
        let found = predictions.iter().map(|T| matcher.register_at(*T)).filter(is_tracked);
        let found = found.max_by(|a, b| a.support.total_cmp(&b.support));
        // From coarse to fine for fast motions: that may leave the basin of a good prediction.
        found
            .or_else(|| Some(matcher.best_near(matcher.propose_near(&predictions, &T_world_before))).filter(is_tracked))
    }
}
