//! What frames that are part of the map have shown.

use crate::camera::surfel_image::SurfelImage;
use crate::geometry::Pose3;
use crate::key_views::KeyViews;
use crate::registration::projective::ProjectiveTarget;
use crate::surfel_map::SurfelMap;

/// The map, and what key frames looked through.
#[derive(Clone, Default)]
pub(super) struct Seen {
    pub(super) map: SurfelMap,
    pub(super) key_views: KeyViews,
}

impl Seen {
    /// Adds a frame. `view` is the map as seen from about there.
    pub(super) fn insert(&mut self, frame: &SurfelImage, T_world_camera: &Pose3, view: &ProjectiveTarget) {
        self.map.insert(frame, T_world_camera, view);
        self.key_views.add(frame, T_world_camera);
    }
}
