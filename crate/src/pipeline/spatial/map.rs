//! The map of a run: stitched while frames come, at the poses that are known then.

use std::borrow::Cow;

use super::SpatialReconstruction;
use super::stitched_map::StitchedMap;
use crate::geometry::{PointCloud, Pose3};
use crate::map::voxel::{VoxelCount, VoxelMap};
use crate::odometry::assessment::Status;
use crate::pipeline::prepared_frame::{MapPoints, PreparedFrame, Surfaces, ValuesSeen};
use crate::pipeline::spatial_report::MapSize;
use crate::pipeline::spatial_settings::Quantisation;

/// The newest frames, which are stitched only on request.
const MAX_PENDING_FRAMES: usize = 6;

impl SpatialReconstruction {
    /// The map so far: one point a voxel, coloured where the recording is, world frame. What has been added since the last
    /// request is stitched to it.
    pub fn map(&mut self) -> &VoxelMap {
        let poses = self.poses_up_to(Status::Good);
        let stitched = self.stitch(&poses);
        &self.stitched.insert(stitched).map
    }

    /// Stitches one more of the frames that are registered, so that less is left to do at the next request of the
    /// [map](Self::map), which becomes the same. The newest frames have to wait, as their poses may still change.
    pub fn stitch_ahead(&mut self) {
        let poses = self.poses_up_to(Status::Good);
        let num_settled = poses.len().saturating_sub(MAX_PENDING_FRAMES);
        let num_stitched =
            self.stitched.as_ref().filter(|stitched| self.is_of(stitched, &poses)).map_or(0, StitchedMap::num_frames);
        if num_stitched < num_settled {
            self.stitched = Some(self.stitch(&poses[..=num_stitched]));
        }
    }

    /// The map of the first frames at these poses, made from what there is of it.
    fn stitch(&mut self, poses: &[Option<Pose3>]) -> StitchedMap {
        let kept = self.stitched.take().filter(|stitched| self.is_of(stitched, poses));
        let voxel_size = self.decode_config.as_ref().map_or(1.0, |config| config.settings.map_voxel_size);
        let mut stitched = kept.unwrap_or_else(|| StitchedMap::new(voxel_size, self.map_quantisation()));
        for (frame, pose) in self.frames.iter().zip(poses).skip(stitched.num_frames()) {
            stitched.insert(&frame.map_points, *pose, self.depth_step(), self.settings.max_height);
        }
        stitched
    }

    fn is_of(&self, stitched: &StitchedMap, poses: &[Option<Pose3>]) -> bool {
        stitched.is_of(poses, self.map_quantisation())
    }

    fn map_quantisation(&self) -> Quantisation {
        self.quantisation().unwrap_or(Quantisation::Rounded)
    }

    /// Depth of one unit of an image (m); 0 for clouds.
    fn depth_step(&self) -> f64 {
        self.depth().map_or(0.0, |depth| depth.depth_step)
    }

    /// What the frames whose pose is good give to the map, in the sensor's frame, with their poses.
    pub(super) fn placed_clouds(&self) -> impl Iterator<Item = (Cow<'_, PointCloud>, Pose3)> + Clone {
        let poses = self.poses_up_to(Status::Good);
        let (quantisation, depth_step) = (self.map_quantisation(), self.depth_step());
        (0..poses.len()).filter_map(move |index| {
            let pose = poses[index]?;
            let cloud = match &self.frames.get(index)?.map_points {
                MapPoints::Image(image, prepared_as) => {
                    Cow::Owned(image.cloud(quantisation.shift_from(*prepared_as, depth_step)))
                }
                MapPoints::Cloud(cloud) => Cow::Borrowed(cloud),
            };
            Some((cloud, pose))
        })
    }

    /// What is kept of a frame for the map, by its number in the recording, for a surface ([`SurfaceReconstruction::read_kept`]);
    /// `None` where there is none.
    ///
    /// [`SurfaceReconstruction::read_kept`]: crate::pipeline::surface::SurfaceReconstruction::read_kept
    pub fn kept_points(&self, index: usize) -> Option<Vec<u8>> {
        let frame = self.frames.iter().find(|frame| frame.label.index == index)?;
        let map_points = match &frame.map_points {
            MapPoints::Image(image, prepared_as) => {
                let shift = self.map_quantisation().shift_from(*prepared_as, self.depth_step());
                MapPoints::Image(image.shifted(shift), self.map_quantisation())
            }
            cloud @ MapPoints::Cloud(_) => cloud.clone(),
        };
        let surfaces = Surfaces::Surfels(Vec::new());
        let (label, gyro, notes) = (frame.label.clone(), Vec::new(), Vec::new());
        Some(PreparedFrame { label, surfaces, map_points, gyro, notes, values: ValuesSeen::default() }.to_bytes())
    }

    /// What the map would take in voxels of other sizes (m, positive).
    pub fn map_sizes(&self, voxel_sizes: &[f64]) -> Vec<MapSize> {
        let finest = voxel_sizes.iter().copied().fold(f64::INFINITY, f64::min);
        let poses = self.poses_up_to(Status::Good);
        let max_height = self.settings.max_height;
        let count = |voxel_size| {
            let mut count = VoxelCount::new(voxel_size);
            for (frame, pose) in self.frames.iter().zip(&poses) {
                match (&frame.map_points, pose) {
                    (_, None) => {}
                    (MapPoints::Image(image, prepared_as), Some(pose)) => {
                        let shift = self.map_quantisation().shift_from(*prepared_as, self.depth_step());
                        count.insert_image(image, shift, pose, max_height);
                    }
                    (MapPoints::Cloud(cloud), Some(pose)) => count.insert(cloud, pose, max_height),
                }
            }
            count
        };
        let has_colors = self.frames.iter().any(|frame| match &frame.map_points {
            MapPoints::Image(image, _) => image.colors.is_some(),
            MapPoints::Cloud(cloud) => cloud.colors.is_some(),
        });
        // Position and normal in single precision, and three bytes of colour.
        let bytes_a_point = if has_colors { 27 } else { 24 };
        let finest_count = count(finest);
        let size = |&voxel_size: &f64| {
            let multiple = (voxel_size / finest).round();
            let is_multiple = (multiple * finest - voxel_size).abs() < 1e-9 * voxel_size;
            let num_points =
                if is_multiple { finest_count.coarser(multiple as i32).len() } else { count(voxel_size).len() };
            MapSize { voxel_size, num_points, num_bytes: num_points * bytes_a_point }
        };
        voxel_sizes.iter().map(size).collect()
    }
}
