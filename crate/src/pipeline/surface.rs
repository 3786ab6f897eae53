//! The surface of a recording of depth images or clouds, at the poses that a run gives them: all at its end, or frame by frame while it goes on.

use std::collections::{BTreeMap, BTreeSet};

use crate::error::{Error, Result};
use crate::geometry::{PointCloud, Pose3, TriangleMesh};
use crate::map::keyframes::is_keyframe;
use crate::map::surface::{CloudFusion, SurfaceFusion, SurfaceOptions};
use crate::pipeline::prepared_frame::{ColorFile, DecodeConfig, MapPoints, PreparedFrame, map_image};
use crate::preprocess::depth_surfels::DepthModel;
use crate::preprocess::map_image::MapImage;

/// A frame whose surfaces have moved by less than this is left as it is (m): half of the least standard deviation of a depth.
const MAX_MOTION: f64 = 5e-4;
/// The same while the run goes on and poses still change (voxels): a quarter of the least truncation moves the surface, and changes it
/// nowhere else.
const MAX_PENDING_MOTION: f64 = 0.5;

/// Larger images are thinned: the field counts pixels in single precision, whose whole numbers end at twice this.
const MAX_PIXELS: usize = 1 << 22;

/// A depth image as the surface takes it.
#[derive(Debug, Clone)]
pub struct SurfaceImage {
    image: MapImage,
    model: DepthModel,
}

/// What a run has kept of a frame, as the surface takes it.
#[derive(Debug, Clone)]
pub enum SurfaceFrame {
    /// A depth image.
    Image(SurfaceImage),
    /// A cloud, in the frame of its coordinates.
    Cloud(PointCloud),
}

/// A frame in the field.
#[derive(Debug, Clone)]
struct Placed {
    T_world_sensor: Pose3,
    /// Pixels or points, and their mean depth or distance (m): a frame that was thinned out, or read in another way, since cannot be
    /// taken out.
    num_points: usize,
    depth: f64,
}

/// What frames are put in.
#[derive(Debug, Clone)]
enum Field {
    Images(Box<SurfaceFusion>),
    Clouds(CloudFusion),
}

/// A surface that grows by frames at known poses.
#[derive(Debug, Clone)]
pub struct SurfaceReconstruction {
    decode_config: DecodeConfig,
    field: Field,
    /// The frames that are in it, by number.
    placed: BTreeMap<usize, Placed>,
    /// The frames that are to be in it.
    followed: BTreeMap<usize, Pose3>,
    /// Whether the run had ended when they were put in.
    is_final: bool,
}

impl SurfaceReconstruction {
    /// Without frames. `decode_config` tells how they are read: that of the run.
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub fn new(decode_config: DecodeConfig, options: SurfaceOptions) -> Result<Self> {
        let field = match &decode_config.cloud {
            Some(reading) => {
                let viewpoint = glam::DVec3::from_array(reading.viewpoint).as_vec3();
                Field::Clouds(CloudFusion::new(options, viewpoint, decode_config.settings.map_voxel_size)?)
            }
            None => Field::Images(Box::new(SurfaceFusion::new(options)?)),
        };
        Ok(Self { decode_config, field, placed: BTreeMap::new(), followed: BTreeMap::new(), is_final: false })
    }

    /// Reads a depth image, with the colours of its pixels where it has any.
    ///
    /// # Errors
    /// When the depth image is broken or of another size than the first of the run; the error names it.
    pub fn read(&self, name: &str, depth: &[u8], color: Option<ColorFile<'_>>) -> Result<SurfaceImage> {
        let (image, model) = map_image(&self.decode_config, name, depth, color)?;
        Ok(SurfaceImage::new(image, model))
    }

    /// What a run has kept of a frame ([`SpatialReconstruction::kept_points`]).
    ///
    /// # Errors
    /// When the bytes are none of it.
    ///
    /// [`SpatialReconstruction::kept_points`]: crate::pipeline::spatial::SpatialReconstruction::kept_points
    pub fn read_kept(&self, bytes: &[u8]) -> Result<SurfaceFrame> {
        match (PreparedFrame::from_bytes(bytes)?.map_points, &self.decode_config.depth) {
            (MapPoints::Image(image, quantisation), Some(depth)) => {
                let model = self.decode_config.depth_model(depth, quantisation);
                Ok(SurfaceFrame::Image(SurfaceImage::new(image, model)))
            }
            (MapPoints::Cloud(cloud), None) => Ok(SurfaceFrame::Cloud(cloud)),
            _ => Err(Error::whole("This frame is of another recording", "Give frames of the run")),
        }
    }

    /// Adds an image at its pose; a pose that is none changes nothing, nor does an image among clouds.
    pub fn add(&mut self, image: &SurfaceImage, T_world_camera: &Pose3) {
        if let Field::Images(fusion) = &mut self.field {
            fusion.integrate(&image.image, &image.model, T_world_camera);
        }
    }

    /// Takes in which frames are to be in the surface from now on, by number, and at which poses: those of a run, which goes on unless
    /// `is_final`. Returns the frames that are to be [put](Self::put), in this order: new ones, those that have moved, and those that are
    /// no longer in it. Of images keyframes come first, whose differences tell the noise; while the run goes on, the others wait. Clouds
    /// are complete only when the run has ended, so all are put anew then, and after any change since.
    pub fn follow(&mut self, frames: impl IntoIterator<Item = (usize, Pose3)>, is_final: bool) -> Vec<usize> {
        self.followed = frames.into_iter().collect();
        let keyframes = self.keyframes();
        if !is_final {
            self.followed.retain(|frame, _| keyframes.contains(frame));
        }
        let max_motion = if is_final { MAX_MOTION } else { MAX_PENDING_MOTION * self.voxel_size() };
        let (placed, followed) = (&self.placed, &self.followed);
        let stays = |frame: &usize, T: &Pose3| placed.get(frame).is_some_and(|placed| placed.motion(T) <= max_motion);
        let stay: Vec<usize> = followed.iter().filter(|(frame, T)| stays(frame, T)).map(|(frame, _)| *frame).collect();
        let is_unchanged = stay.len() == placed.len() && stay.len() == followed.len();
        let is_incomplete = self.is_of_clouds() && is_final && !(self.is_final && is_unchanged);
        self.is_final = is_final;
        if is_incomplete || stay.len() * 2 < placed.len() {
            // To take most of them out and put them in again takes longer than all anew.
            self.start_over();
        }
        let all = self.placed.keys().chain(self.followed.keys()).copied();
        let all: BTreeSet<usize> = all.collect();
        let is_left = |frame: &usize| self.placed.contains_key(frame) && stay.binary_search(frame).is_ok();
        let (first, then): (Vec<_>, Vec<_>) =
            all.into_iter().filter(|frame| !is_left(frame)).partition(|frame| keyframes.contains(frame));
        [first, then].concat()
    }

    /// All clouds; of images those that are in the surface, and keyframes beside them.
    fn keyframes(&self) -> BTreeSet<usize> {
        let mut keyframes: BTreeMap<usize, &Pose3> = BTreeMap::new();
        for (frame, T_world_camera) in &self.followed {
            let is_in_surface = self.is_of_clouds() || self.placed.contains_key(frame);
            if is_in_surface || is_keyframe(T_world_camera, keyframes.values().copied()) {
                keyframes.insert(*frame, T_world_camera);
            }
        }
        keyframes.into_keys().collect()
    }

    /// Puts a frame in at the pose that it is to have, in place of the one that it has had; out where it is to have none.
    pub fn put(&mut self, frame: usize, points: &SurfaceFrame) {
        let before = self.placed.remove(&frame);
        let is_out = before.is_none_or(|before| self.take_out(frame, points, &before));
        if !is_out {
            // The next call of `follow` asks for all others again.
            self.start_over();
        }
        let Some(&T_world_sensor) = self.followed.get(&frame) else { return };
        match (&mut self.field, points) {
            (Field::Images(fusion), SurfaceFrame::Image(SurfaceImage { image, model })) => {
                fusion.integrate(image, model, &T_world_sensor);
            }
            (Field::Clouds(fusion), SurfaceFrame::Cloud(cloud)) => fusion.put(frame, cloud.clone(), T_world_sensor),
            _ => return,
        }
        let (num_points, depth) = points.size();
        self.placed.insert(frame, Placed { T_world_sensor, num_points, depth });
    }

    /// Whether a frame could be taken out that was put in as told.
    fn take_out(&mut self, frame: usize, points: &SurfaceFrame, before: &Placed) -> bool {
        match (&mut self.field, points) {
            (Field::Images(fusion), SurfaceFrame::Image(SurfaceImage { image, model })) => {
                points.size() == (before.num_points, before.depth)
                    && fusion.take_out(image, model, &before.T_world_sensor)
            }
            (Field::Clouds(fusion), _) => {
                fusion.take_out(frame);
                true
            }
            _ => true,
        }
    }

    fn start_over(&mut self) {
        match &mut self.field {
            Field::Images(fusion) => **fusion = fusion.emptied(),
            Field::Clouds(fusion) => self.placed.keys().for_each(|&frame| fusion.take_out(frame)),
        }
        self.placed.clear();
    }

    /// Whether its frames are clouds.
    pub fn is_of_clouds(&self) -> bool {
        matches!(self.field, Field::Clouds(_))
    }

    /// Number of frames in it.
    pub fn num_frames(&self) -> usize {
        match &self.field {
            Field::Images(fusion) => fusion.num_frames(),
            Field::Clouds(fusion) => fusion.num_frames(),
        }
    }

    /// Memory of the field of images, or of the points of clouds (bytes).
    pub fn num_bytes(&self) -> usize {
        match &self.field {
            Field::Images(fusion) => fusion.num_bytes(),
            Field::Clouds(fusion) => fusion.num_bytes(),
        }
    }

    /// Side of a voxel (m): that of the options, or larger where the memory was not enough or clouds have too few points.
    pub fn voxel_size(&self) -> f64 {
        match &self.field {
            Field::Images(fusion) => fusion.voxel_size(),
            Field::Clouds(fusion) => fusion.voxel_size(),
        }
    }

    /// Fills holes up to this extent from now on (m); 0: none. Those of clouds stay open.
    ///
    /// # Errors
    /// When it is out of its limits.
    pub fn set_max_hole_size(&mut self, max_hole_size: f64) -> Result<()> {
        match &mut self.field {
            Field::Images(fusion) => fusion.set_max_hole_size(max_hole_size),
            Field::Clouds(_) => Ok(()),
        }
    }

    /// The surface.
    pub fn mesh(&mut self) -> TriangleMesh {
        match &mut self.field {
            Field::Images(fusion) => fusion.mesh(),
            Field::Clouds(fusion) => fusion.mesh(),
        }
    }
}

impl SurfaceImage {
    fn new(mut image: MapImage, model: DepthModel) -> Self {
        while image.depths.len() > MAX_PIXELS {
            image = image.thinned(0, 0);
        }
        Self { image, model }
    }
}

impl SurfaceFrame {
    /// Number of pixels or points, and their mean depth or distance (m).
    fn size(&self) -> (usize, f64) {
        match self {
            Self::Image(SurfaceImage { image, .. }) => (image.depths.len(), image.mean_depth()),
            Self::Cloud(cloud) => {
                let sum: f64 = cloud.positions.iter().map(|point| f64::from(point.length())).sum();
                (cloud.len(), sum / cloud.len().max(1) as f64)
            }
        }
    }
}

impl Placed {
    /// By how much another pose moves what it sees (m).
    fn motion(&self, T_world_sensor: &Pose3) -> f64 {
        let change = self.T_world_sensor.inverse() * T_world_sensor;
        change.translation.vector.norm() + change.rotation.angle() * self.depth
    }
}
