//! What frames that are part of the map have shown.

use crate::geometry::Pose3;
use crate::map::keyframes::Keyframes;
use crate::map::surfel::SurfelMap;
use crate::registration::prepared_surfels::PreparedSurfels;
use crate::registration::projective::ProjectiveTarget;

/// The map, and what key frames looked through.
#[derive(Clone, Default)]
pub(super) struct ReferenceMap {
    pub(super) map: SurfelMap,
    pub(super) keyframes: Keyframes,
}

impl ReferenceMap {
    /// Adds a frame with its number. `view` is the map as seen from about there.
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

    /// Adds what some other frames have shown, moved by the `motion` (of the world) of their numbers; nothing of those without.
    pub(super) fn merge(&mut self, other: &Self, motion: &impl Fn(u32) -> Option<Pose3>) {
        self.map.merge(&other.map, motion);
        self.keyframes.merge(&other.keyframes, motion);
    }

    /// Moves what each frame has shown by its `motion` (of the world).
    pub(super) fn apply_corrections(&mut self, motion: &impl Fn(u32) -> Pose3) {
        self.map.apply_corrections(motion);
        self.keyframes.apply_corrections(motion);
    }
}
