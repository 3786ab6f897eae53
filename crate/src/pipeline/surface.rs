//! The surface of a recording of depth images, at the poses that a run gives them: all at its end, or frame by frame while it goes on.

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::geometry::{Pose3, TriangleMesh};
use crate::map::surface::{SurfaceFusion, SurfaceOptions};
use crate::pipeline::prepared_frame::{ColorFile, DecodeConfig, MapPoints, PreparedFrame, map_image};
use crate::preprocess::depth_surfels::DepthModel;
use crate::preprocess::map_image::MapImage;

/// A frame whose surfaces have moved by less than this is left as it is (m): half of the least standard deviation of a depth.
const MAX_MOTION: f64 = 5e-4;
/// The same while the run goes on and poses still change (voxels): a quarter of the least truncation moves the surface, and changes it
/// nowhere else.
const MAX_PENDING_MOTION: f64 = 0.5;

/// A depth image as the surface takes it.
#[derive(Debug, Clone)]
pub struct SurfaceImage {
    image: MapImage,
    model: DepthModel,
}

/// A frame in the field.
#[derive(Debug, Clone)]
struct Placed {
    T_world_camera: Pose3,
    /// Pixels of its image and their mean depth (m): one that was thinned out, or read in another way, since cannot be taken out.
    num_pixels: usize,
    depth: f64,
}

/// A surface that grows by depth images at known poses.
#[derive(Debug, Clone)]
pub struct SurfaceReconstruction {
    decode_config: DecodeConfig,
    fusion: SurfaceFusion,
    /// The frames that are in it, by number.
    placed: BTreeMap<usize, Placed>,
    /// The frames that are to be in it.
    followed: BTreeMap<usize, Pose3>,
}

impl SurfaceReconstruction {
    /// Without images. `decode_config` tells how their depth is read: that of the run.
    ///
    /// # Errors
    /// When an option is out of its limits, or the frames of the run are clouds.
    pub fn new(decode_config: DecodeConfig, options: SurfaceOptions) -> Result<Self> {
        if decode_config.depth.is_none() {
            let problem = "A surface is made of depth images, and the frames of this recording are clouds";
            return Err(Error::whole(problem, "The map of points is there: save it in place of the surface"));
        }
        let fusion = SurfaceFusion::new(options)?;
        Ok(Self { decode_config, fusion, placed: BTreeMap::new(), followed: BTreeMap::new() })
    }

    /// Reads a depth image, with the colours of its pixels where it has any.
    ///
    /// # Errors
    /// When the depth image is broken or of another size than the first of the run; the error names it.
    pub fn read(&self, name: &str, depth: &[u8], color: Option<ColorFile<'_>>) -> Result<SurfaceImage> {
        let (image, model) = map_image(&self.decode_config, name, depth, color)?;
        Ok(SurfaceImage { image, model })
    }

    /// The image that a run has kept of a frame ([`SpatialReconstruction::kept_image`]).
    ///
    /// # Errors
    /// When the bytes are none of it.
    ///
    /// [`SpatialReconstruction::kept_image`]: crate::pipeline::spatial::SpatialReconstruction::kept_image
    pub fn read_kept(&self, bytes: &[u8]) -> Result<SurfaceImage> {
        let (MapPoints::Image(image, quantisation), Some(depth)) =
            (PreparedFrame::from_bytes(bytes)?.map_points, &self.decode_config.depth)
        else {
            return Err(Error::whole("This frame has no depth image", "Give depth images"));
        };
        Ok(SurfaceImage { image, model: self.decode_config.depth_model(depth, quantisation) })
    }

    /// Adds an image at its pose; a pose that is none changes nothing.
    pub fn add(&mut self, image: &SurfaceImage, T_world_camera: &Pose3) {
        self.fusion.integrate(&image.image, &image.model, T_world_camera);
    }

    /// Takes in which frames are to be in the surface from now on, by number, and at which poses: those of a run, which goes on unless
    /// `is_final`. Returns the frames whose images are to be [put](Self::put): new ones, those that have moved, and those that are
    /// no longer in it.
    pub fn follow(&mut self, frames: impl IntoIterator<Item = (usize, Pose3)>, is_final: bool) -> Vec<usize> {
        self.followed = frames.into_iter().collect();
        let max_motion = if is_final { MAX_MOTION } else { MAX_PENDING_MOTION * self.fusion.voxel_size() };
        let (placed, followed) = (&self.placed, &self.followed);
        let stays = |frame: &usize, T: &Pose3| placed.get(frame).is_some_and(|placed| placed.motion(T) <= max_motion);
        let stay: Vec<usize> = followed.iter().filter(|(frame, T)| stays(frame, T)).map(|(frame, _)| *frame).collect();
        if stay.len() * 2 < placed.len() {
            // To take most of them out and put them in again takes longer than all anew.
            self.start_over();
        }
        let all = self.placed.keys().chain(self.followed.keys()).copied();
        let all: std::collections::BTreeSet<usize> = all.collect();
        let is_left = |frame: &usize| self.placed.contains_key(frame) && stay.binary_search(frame).is_ok();
        all.into_iter().filter(|frame| !is_left(frame)).collect()
    }

    /// Puts a frame in at the pose that it is to have, in place of the one that it has had; out where it is to have none.
    pub fn put(&mut self, frame: usize, image: &SurfaceImage) {
        let SurfaceImage { image, model } = image;
        if let Some(placed) = self.placed.remove(&frame) {
            let is_same = (placed.num_pixels, placed.depth) == (image.depths.len(), image.mean_depth());
            if !(is_same && self.fusion.take_out(image, model, &placed.T_world_camera)) {
                // The next call of `follow` asks for all others again.
                self.start_over();
            }
        }
        if let Some(&T_world_camera) = self.followed.get(&frame) {
            self.fusion.integrate(image, model, &T_world_camera);
            let (num_pixels, depth) = (image.depths.len(), image.mean_depth());
            self.placed.insert(frame, Placed { T_world_camera, num_pixels, depth });
        }
    }

    fn start_over(&mut self) {
        self.fusion = self.fusion.emptied();
        self.placed.clear();
    }

    /// The field.
    pub fn fusion(&self) -> &SurfaceFusion {
        &self.fusion
    }

    /// Fills holes up to this extent from now on (m); 0: none.
    ///
    /// # Errors
    /// When it is out of its limits.
    pub fn set_max_hole_size(&mut self, max_hole_size: f64) -> Result<()> {
        self.fusion.set_max_hole_size(max_hole_size)
    }

    /// The surface.
    pub fn mesh(&self) -> TriangleMesh {
        self.fusion.mesh()
    }
}

impl Placed {
    /// By how much another pose moves what it sees (m).
    fn motion(&self, T_world_camera: &Pose3) -> f64 {
        let change = self.T_world_camera.inverse() * T_world_camera;
        change.translation.vector.norm() + change.rotation.angle() * self.depth
    }
}
