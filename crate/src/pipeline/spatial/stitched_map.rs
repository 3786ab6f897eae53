//! The map of a run in space, stitched frame by frame.

use crate::geometry::Pose3;
use crate::map::voxel::VoxelMap;
use crate::pipeline::prepared_frame::MapPoints;
use crate::pipeline::spatial_settings::Quantisation;

/// A map with what it was made of: it is made anew where that has changed.
pub(super) struct StitchedMap {
    pub map: VoxelMap,
    quantisation: Quantisation,
    /// Of the frames in it, `T_world_sensor`; `None` for those that are not registered.
    poses: Vec<Option<Pose3>>,
}

impl StitchedMap {
    /// Without frames yet; `voxel_size` in metres.
    pub(super) fn new(voxel_size: f64, quantisation: Quantisation) -> Self {
        Self { map: VoxelMap::new(voxel_size), quantisation, poses: Vec::new() }
    }

    pub(super) fn num_frames(&self) -> usize {
        self.poses.len()
    }

    /// Whether it is the map of the first frames at these poses.
    pub(super) fn is_of(&self, poses: &[Option<Pose3>], quantisation: Quantisation) -> bool {
        self.quantisation == quantisation && poses.starts_with(&self.poses)
    }

    /// Adds the next frame. `depth_step`: depth of one unit of an image (m); `max_height`: points above it are left out (m).
    pub(super) fn insert(&mut self, points: &MapPoints, pose: Option<Pose3>, depth_step: f64, max_height: f64) {
        let frame = self.poses.len();
        match (points, &pose) {
            (_, None) => {}
            (MapPoints::Image(image, prepared_as), Some(pose)) => {
                let shift = self.quantisation.shift_from(*prepared_as, depth_step);
                self.map.insert_image(image, shift, pose, frame, max_height);
            }
            (MapPoints::Cloud(cloud), Some(pose)) => self.map.insert(cloud, pose, frame, max_height),
        }
        self.poses.push(pose);
    }
}
