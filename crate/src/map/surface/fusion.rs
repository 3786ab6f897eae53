//! Depth images into the field, and the field to a mesh.

use serde::{Deserialize, Serialize};

use super::blocks::{Blocks, VOXELS, Voxel};
use super::extraction::extract;
use super::view::View;
use crate::error::{Error, Result};
use crate::geometry::{Pose3, TriangleMesh};
use crate::preprocess::depth_surfels::DepthModel;
use crate::preprocess::map_image::MapImage;

/// How a surface is made.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct SurfaceOptions {
    /// Side of a voxel (m). It doubles whenever the field exceeds `max_megabytes`.
    pub voxel_size: f64,
    /// Memory of the field (MB).
    pub max_megabytes: f64,
    /// Parts of the surface that are smaller than this are left out (m^2); 0: those under a square of ten voxels.
    pub min_island_area: f64,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self { voxel_size: 0.02, max_megabytes: 400.0, min_island_area: 0.0 }
    }
}

impl SurfaceOptions {
    /// # Errors
    /// When a value is out of its limits.
    pub fn check(&self) -> Result<()> {
        let limits = [
            ("voxel_size", self.voxel_size, 1e-3, 1.0, "m"),
            ("max_megabytes", self.max_megabytes, 10.0, 3000.0, "MB"),
            ("min_island_area", self.min_island_area, 0.0, 1e4, "m^2"),
        ];
        for (name, value, low, high, unit) in limits {
            if !(low..=high).contains(&value) {
                let problem = format!("{name} = {value} is not possible");
                return Err(Error::whole(problem, format!("Give a number from {low} to {high} {unit}")));
            }
        }
        Ok(())
    }
}

/// Bytes of a block: its voxels, and about as much for finding it as a corner and a number in a hash table take.
const BLOCK_BYTES: usize = VOXELS * size_of::<Voxel>() + 64;

/// A truncated signed distance field over depth images at their poses.
#[derive(Debug, Clone)]
pub struct SurfaceFusion {
    options: SurfaceOptions,
    voxel_size: f32,
    blocks: Blocks,
    num_frames: usize,
    /// Sum of the squared deviations of the measurements from the mean before, in units of the variance expected of them.
    deviation_sum: f64,
    num_deviations: u64,
}

impl SurfaceFusion {
    /// An empty field.
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub fn new(options: SurfaceOptions) -> Result<Self> {
        options.check()?;
        Ok(Self {
            options,
            voxel_size: options.voxel_size as f32,
            blocks: Blocks::default(),
            num_frames: 0,
            deviation_sum: 0.0,
            num_deviations: 0,
        })
    }

    /// Side of a voxel (m): that of the options, or larger where the memory was not enough.
    pub fn voxel_size(&self) -> f64 {
        f64::from(self.voxel_size)
    }

    /// Number of images in the field.
    pub fn num_frames(&self) -> usize {
        self.num_frames
    }

    /// Memory of the field (bytes).
    pub fn num_bytes(&self) -> usize {
        self.blocks.len() * BLOCK_BYTES
    }

    /// Adds a depth image; `model` is how its depth was measured.
    pub fn integrate(&mut self, image: &MapImage, model: &DepthModel, T_world_camera: &Pose3) {
        if !T_world_camera.to_homogeneous().iter().all(|entry| entry.is_finite()) {
            return;
        }
        self.num_frames += 1;
        let mut view = View::new(image, model, T_world_camera, self.voxel_size);
        let touched = loop {
            if let Some(touched) = self.touch(&view) {
                break touched;
            }
            self.coarsen();
            view.voxel_size = self.voxel_size;
            view.read_pixels();
        };
        for number in touched {
            let (sum, count) = view.add_to_block(self.blocks.corners[number], &mut self.blocks.voxels[number]);
            self.deviation_sum += f64::from(sum);
            self.num_deviations += count;
        }
        for (number, corner) in self.blocks.corners.iter().enumerate() {
            if self.blocks.last_frames[number] != self.num_frames as u32 {
                self.blocks.seen_through[number] += view.information_through(*corner);
            }
        }
    }

    /// The numbers of the blocks that an image touches, each once; `None` where they are more than the memory has room for.
    fn touch(&mut self, view: &View) -> Option<Vec<usize>> {
        let max_blocks = (self.options.max_megabytes * 1e6) as usize / BLOCK_BYTES;
        let (blocks, frame) = (&mut self.blocks, self.num_frames as u32);
        let mut touched = Vec::new();
        view.visit_touched_blocks(|corner| {
            let number = blocks.insert(corner);
            if std::mem::replace(&mut blocks.last_frames[number], frame) != frame {
                touched.push(number);
            }
            blocks.len() <= max_blocks
        })
        .then_some(touched)
    }

    fn coarsen(&mut self) {
        self.blocks = self.blocks.coarsened();
        self.voxel_size *= 2.0;
    }

    /// Ratio of the variance that the measurements have to the one that the sensor's noise explains, at least 1: errors of poses and
    /// of the camera's model add to it.
    pub fn variance_ratio(&self) -> f64 {
        if self.num_deviations == 0 {
            return 1.0;
        }
        (self.deviation_sum / self.num_deviations as f64).max(1.0)
    }

    /// The surface.
    pub fn mesh(&self) -> TriangleMesh {
        let mut mesh = extract(&self.blocks, self.voxel_size, self.variance_ratio() as f32);
        let side = 10.0 * self.voxel_size;
        let given = self.options.min_island_area as f32;
        mesh = mesh.without_islands(if given > 0.0 { given } else { side * side });
        mesh.set_normals();
        mesh
    }
}
