//! What moved while the sensor did, once all clouds are placed: it is taken out of what they give to the map.

use glam::Vec3;
use nalgebra::Vector3;

use super::SpatialReconstruction;
use crate::geometry::{Pose3, RigidMotion};
use crate::map::seen_through::SeenThrough;
use crate::odometry::assessment::Status;
use crate::odometry::cloud::{CloudOptions, FREE_SPACE_TOLERANCE};
use crate::pipeline::prepared_frame::{DecodeConfig, MapPoints};

/// The search for what moved, and what came of it.
#[derive(Default)]
pub(super) struct Moved {
    search: Option<SeenThrough>,
    /// Where clouds are; `None` for those that are not good.
    poses: Vec<Option<Pose3>>,
    /// The next cloud that is looked at.
    next: usize,
    /// Points that have been taken out.
    pub num_points: usize,
}

impl Moved {
    /// Whether clouds are being looked at.
    pub fn is_searching(&self) -> bool {
        self.search.is_some()
    }

    /// Forgets a search that was not finished.
    pub fn stop(&mut self) {
        self.search = None;
    }

    /// How many points are missing in the map, of which `num_left` are left; `None` where none is.
    pub fn note(&self, num_left: usize) -> Option<String> {
        let share = 100.0 * self.num_points as f64 / (self.num_points + num_left) as f64;
        (self.num_points > 0).then(|| {
            format!(
                "What moved is left out of the map: {} points ({share:.1} %) lie where later clouds see through",
                self.num_points
            )
        })
    }
}

impl SpatialReconstruction {
    /// Looks at one more cloud, or, after the last one, takes out what moved; whether there is more to do.
    #[inline(never)]
    pub(super) fn look_for_moved(&mut self) -> bool {
        let of_clouds = self.decode_config.as_ref().filter(|config| config.cloud.is_some());
        let Some(options) = of_clouds.map(DecodeConfig::cloud_options).filter(|options| options.tests_free_space)
        else {
            return false;
        };
        if !self.moved.is_searching() {
            (self.moved.poses, self.moved.next) = (self.poses_up_to(Status::Good), 0);
            self.moved.search = Some(new_search(&options, &self.moved.poses));
        }
        let number = self.moved.next;
        let (Some(search), Some(pose)) = (&mut self.moved.search, self.moved.poses.get(number)) else {
            self.take_out_moved();
            return false;
        };
        let points = self.frames.get(number).map(|frame| &frame.map_points);
        if let (Some(MapPoints::Cloud(cloud)), Some(pose)) = (points, pose) {
            search.add(number as u32, cloud, pose);
        }
        self.moved.next += 1;
        true
    }

    fn take_out_moved(&mut self) {
        let Some(search) = self.moved.search.take() else { return };
        let mut num_points = 0;
        for (number, pose) in std::mem::take(&mut self.moved.poses).iter().enumerate() {
            let Some(pose) = pose else { continue };
            let in_world = |point: &Vec3| pose.act(&Vector3::from(point.as_dvec3().to_array()));
            num_points += self.frames.take_out(number, |point| search.has_gone(number as u32, &in_world(point)));
        }
        if num_points > 0 {
            self.moved.num_points += num_points;
            self.stitched = None;
        }
    }
}

fn new_search(options: &CloudOptions, poses: &[Option<Pose3>]) -> SeenThrough {
    SeenThrough::new(options.voxel_size, FREE_SPACE_TOLERANCE * options.voxel_size, poses.iter().flatten().count())
}
