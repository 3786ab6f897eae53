//! The reference that frames are registered to: the surfel map, and the keyframes.

use super::moving_average::MovingAverage;
use crate::geometry::Pose3;
use crate::map::keyframes::Keyframes;
use crate::map::surfel::SurfelMap;
use crate::registration::prepared_surfels::PreparedSurfels;
use crate::registration::projective::ProjectiveTarget;

/// Surfaces to register to, and keyframes for free space and brightness.
#[derive(Clone, Default)]
pub(super) struct ReferenceMap {
    pub(super) map: SurfelMap,
    pub(super) keyframes: Keyframes,
    /// The average of `PoseEvidence::normal_repeatability` over frames with certain poses.
    pub(super) normal_repeatability: MovingAverage,
}

impl ReferenceMap {
    /// The average repeatability of normals; 1 as long as there are too few frames.
    pub(super) fn expected_normal_repeatability(&self) -> f64 {
        self.normal_repeatability.average().unwrap_or(1.0)
    }

    /// Adds a frame by its number. `view` is the map as seen from about there.
    pub(super) fn insert(
        &mut self,
        frame: &PreparedSurfels,
        number: u32,
        T_world_camera: &Pose3,
        view: &ProjectiveTarget,
    ) {
        self.map.insert(&frame.image, number, T_world_camera, view);
        self.keyframes.add(frame, number, T_world_camera);
    }

    /// Moves each frame's content by its `motion` (of the world).
    pub(super) fn apply_corrections(&mut self, motion: &impl Fn(u32) -> Pose3) {
        self.map.apply_corrections(motion);
        self.keyframes.apply_corrections(motion);
    }
}
