//! The surface of a recording of depth images: its files again, at the poses that a run gave them.

use crate::error::{Error, Result};
use crate::geometry::{Pose3, TriangleMesh};
use crate::map::surface::{SurfaceFusion, SurfaceOptions};
use crate::pipeline::prepared_frame::{ColorFile, DecodeConfig, map_image};

/// A surface that grows by depth images at known poses.
#[derive(Debug, Clone)]
pub struct SurfaceReconstruction {
    decode_config: DecodeConfig,
    fusion: SurfaceFusion,
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
        Ok(Self { decode_config, fusion: SurfaceFusion::new(options)? })
    }

    /// Adds a depth image, with the colours of its pixels where it has any.
    ///
    /// # Errors
    /// When the depth image is broken or of another size than the first of the run; the error names it. Nothing is added then.
    pub fn add(
        &mut self,
        name: &str,
        depth: &[u8],
        color: Option<ColorFile<'_>>,
        T_world_camera: &Pose3,
    ) -> Result<()> {
        let (image, model) = map_image(&self.decode_config, name, depth, color)?;
        self.fusion.integrate(&image, &model, T_world_camera);
        Ok(())
    }

    /// The field.
    pub fn fusion(&self) -> &SurfaceFusion {
        &self.fusion
    }

    /// The surface.
    pub fn mesh(&self) -> TriangleMesh {
        self.fusion.mesh()
    }
}
