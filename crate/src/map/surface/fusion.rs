//! Depth images into the field, and the field to a mesh.

#![allow(clippy::cast_possible_wrap, reason = "blocks have eight voxels along a side")]

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::blocks::{Block, BlockColors, BlockState, Blocks, Layers, PART_VOXELS, SIDE, index};
use super::extraction::extract;
use super::holes::fill_holes;
use super::level::Level;
use super::pixels::{NUM_LEVELS, Optics, WEIGHT_INFORMATION, side_at};
use super::scatter::PlacedImage;
use super::spread::spread;
use super::view::{FreeSpace, View};
use crate::error::{Error, Result};
use crate::geometry::quantile::{MIN_SAMPLE, quantile};
use crate::geometry::{Pose3, TriangleMesh};
use crate::preprocess::depth_surfels::DepthModel;
use crate::preprocess::map_image::MapImage;

/// How a surface is made.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct SurfaceOptions {
    /// Side of a voxel (m). It doubles whenever the field exceeds `max_megabytes`, and grows where clouds have too few points for it.
    pub voxel_size: f64,
    /// Memory of the field (MB).
    pub max_megabytes: f64,
    /// Parts of the surface that are smaller than this are left out (m^2); 0: those under a square of ten standard deviations of
    /// their vertices, of clouds of ten voxels.
    pub min_island_area: f64,
    /// Holes of the surface are filled up to this extent (m); 0: none. What was seen to be empty stays open.
    pub max_hole_size: f64,
}

impl Default for SurfaceOptions {
    fn default() -> Self {
        Self { voxel_size: 0.02, max_megabytes: 400.0, min_island_area: 0.0, max_hole_size: 0.0 }
    }
}

impl SurfaceOptions {
    /// Parts of the surface of clouds that are smaller than this are left out, where voxels have this side (m): m^2.
    pub(super) fn min_island_area(&self, voxel_size: f32) -> f32 {
        let (given, side) = (self.min_island_area as f32, 10.0 * voxel_size);
        if given > 0.0 { given } else { side * side }
    }

    /// # Errors
    /// When a value is out of its limits.
    pub fn check(&self) -> Result<()> {
        let limits = [
            ("voxel_size", self.voxel_size, 1e-3, 1.0, "m"),
            ("max_megabytes", self.max_megabytes, 10.0, 3000.0, "MB"),
            ("min_island_area", self.min_island_area, 0.0, 1e4, "m^2"),
            ("max_hole_size", self.max_hole_size, 0.0, 10.0, "m"),
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

/// Bytes of a block, and about as much for finding it as a corner and a number in a hash table take.
pub(super) const BLOCK_BYTES: usize = size_of::<Block>() + size_of::<BlockState>() + 48;
/// Bytes of the colours of a block.
pub(super) const COLOR_BYTES: usize = size_of::<BlockColors>();

/// An image in the field.
#[derive(Debug, Clone)]
struct Added {
    T_world_camera: Pose3,
    free_space: FreeSpace,
    /// Side of a voxel when it was added (m).
    voxel_size: f32,
}

/// A truncated signed distance field over depth images at their poses.
#[derive(Debug, Clone)]
pub struct SurfaceFusion {
    options: SurfaceOptions,
    voxel_size: f32,
    /// From the finest on.
    levels: [Level; NUM_LEVELS],
    optics: Option<Optics>,
    images: Vec<Added>,
    /// Those that are in the field while their noise is not known.
    first: Vec<PlacedImage>,
    /// Standard deviation of a depth over its square by which the first images differ (1/m).
    scatter: Option<f64>,
    has_colors: bool,
}

impl SurfaceFusion {
    /// An empty field.
    ///
    /// # Errors
    /// When an option is out of its limits.
    pub fn new(options: SurfaceOptions) -> Result<Self> {
        options.check()?;
        Ok(Self::empty(options, options.voxel_size as f32))
    }

    fn empty(options: SurfaceOptions, voxel_size: f32) -> Self {
        Self {
            options,
            voxel_size,
            levels: Default::default(),
            optics: None,
            images: Vec::new(),
            first: Vec::new(),
            scatter: None,
            has_colors: false,
        }
    }

    /// Side of a voxel (m): that of the options, or larger where the memory was not enough.
    pub fn voxel_size(&self) -> f64 {
        f64::from(self.voxel_size)
    }

    /// Number of images in the field.
    pub fn num_frames(&self) -> usize {
        self.images.len()
    }

    /// Memory of the field (bytes).
    pub fn num_bytes(&self) -> usize {
        self.num_blocks() * self.block_bytes()
    }

    fn num_blocks(&self) -> usize {
        self.levels.iter().map(|level| level.blocks.len()).sum()
    }

    fn block_bytes(&self) -> usize {
        BLOCK_BYTES + if self.has_colors { COLOR_BYTES } else { 0 }
    }

    /// Adds a depth image; `model` is how its depth was measured, with the noise that is seen within an image.
    pub fn integrate(&mut self, image: &MapImage, model: &DepthModel, T_world_camera: &Pose3) {
        if !T_world_camera.to_homogeneous().iter().all(|entry| entry.is_finite()) {
            return;
        }
        self.add(image, model, T_world_camera);
        if self.scatter.is_none() && model.square_noise > 0.0 {
            self.first.push(PlacedImage { image: image.clone(), model: *model, T_world_camera: *T_world_camera });
            // Single pairs of a D435 give 3.6e-3 to 7e-3 /m, where 6.3e-3 is true.
            if self.first.len() == MIN_SAMPLE {
                self.measure_scatter();
            }
        }
    }

    /// Measures by how much each of the first images differs from the last before it that sees the same: farther apart, errors of poses are
    /// in it. The field is made anew where that is more than their models say.
    fn measure_scatter(&mut self) {
        let first = std::mem::take(&mut self.first);
        let of_image = |at: usize| first[..at].iter().rev().find_map(|before| before.noise_between(&first[at]));
        let mut of_images: Vec<f64> = (1..first.len()).filter_map(of_image).collect();
        let scatter = quantile(&mut of_images, 0.5).unwrap_or(0.0);
        self.scatter = Some(scatter);
        if first.iter().any(|placed| placed.model.square_noise < scatter) {
            *self = self.emptied();
            for PlacedImage { image, model, T_world_camera } in &first {
                self.add(image, model, T_world_camera);
            }
        }
    }

    /// How depth was measured, with the noise that images differ by.
    fn measured_model(&self, model: &DepthModel) -> DepthModel {
        let scatter = self.scatter.filter(|_| model.square_noise > 0.0).unwrap_or(0.0);
        DepthModel { square_noise: model.square_noise.max(scatter), ..*model }
    }

    fn add(&mut self, image: &MapImage, model: &DepthModel, T_world_camera: &Pose3) {
        let model = &self.measured_model(model);
        self.has_colors |= image.colors.is_some();
        let max_blocks = (self.options.max_megabytes * 1e6) as usize / self.block_bytes();
        loop {
            let optics = self.optics(image, model);
            let view = View::new(image, &optics, T_world_camera, self.voxel_size);
            let before = self.images.iter().map(|added| &added.free_space);
            for (number, level) in self.levels.iter_mut().enumerate() {
                level.insert_touched(number, &view, &before);
            }
            if self.num_blocks() <= max_blocks {
                let free_space = self.change::<false>(&view);
                self.images.push(Added { T_world_camera: *T_world_camera, free_space, voxel_size: self.voxel_size });
                self.optics = Some(optics);
                return;
            }
            self.coarsen();
        }
    }

    /// Adds an image, or takes it out.
    fn change<const IS_TAKEN_OUT: bool>(&mut self, view: &View) -> FreeSpace {
        let free_space = view.free_space();
        for (number, level) in self.levels.iter_mut().enumerate() {
            level.change::<IS_TAKEN_OUT>(number, view, &free_space);
        }
        free_space
    }

    /// What all images have in common: made anew where an image differs from the one before.
    fn optics(&mut self, image: &MapImage, model: &DepthModel) -> Optics {
        let known = self.optics.take().filter(|optics| optics.is_of(image, model, self.voxel_size));
        known.unwrap_or_else(|| Optics::new(image, model, self.voxel_size))
    }

    fn coarsen(&mut self) {
        self.levels.iter_mut().for_each(|level| level.blocks = level.blocks.coarsened());
        self.voxel_size *= 2.0;
        self.images.iter_mut().for_each(|added| added.free_space.double_voxels());
    }

    /// Takes an image out again that was added at this pose: what is left is as if it had not been there. Returns whether it was
    /// possible; it is not once the voxels have been doubled.
    pub fn take_out(&mut self, image: &MapImage, model: &DepthModel, T_world_camera: &Pose3) -> bool {
        let is_it = |added: &Added| added.T_world_camera == *T_world_camera && added.voxel_size == self.voxel_size;
        let Some(at) = self.images.iter().position(is_it) else { return false };
        self.first.retain(|placed| placed.T_world_camera != *T_world_camera);
        let optics = self.optics(image, &self.measured_model(model));
        self.change::<true>(&View::new(image, &optics, T_world_camera, self.voxel_size));
        self.optics = Some(optics);
        self.images.remove(at);
        true
    }

    /// An empty field with voxels as large as these have become, and the noise that was measured.
    #[must_use]
    pub fn emptied(&self) -> Self {
        Self { scatter: self.scatter, ..Self::empty(self.options, self.voxel_size) }
    }

    /// Ratio of the variance that the measurements have to the one that the sensor's noise explains, at least 1: errors of poses and
    /// of the camera's model add to it.
    pub fn variance_ratio(&self) -> f64 {
        let (mut sum, mut num_further) = (0.0, 0);
        for (number, level) in self.levels.iter().enumerate() {
            let (squares, count) = level.scatter();
            sum += squares * f64::from(side_at(number).powi(2));
            num_further += count;
        }
        let unit = f64::from(WEIGHT_INFORMATION * self.voxel_size.powi(2));
        if num_further > 0 { (unit * sum / num_further as f64).max(1.0) } else { 1.0 }
    }

    /// Blocks of the finest level with what coarser ones measured in them; the others are in the finest level itself.
    fn spread(&self) -> Blocks {
        let mut all = Blocks::default();
        for pair in self.levels.windows(2).rev() {
            all = spread(Layers(&[&all, &pair[1].blocks]), &pair[0].blocks);
        }
        all
    }

    /// The surface.
    pub fn mesh(&self) -> TriangleMesh {
        let spread = self.spread();
        let blocks = [&spread, &self.levels[0].blocks];
        let blocks = Layers(&blocks);
        let variance = self.variance_ratio() as f32 / WEIGHT_INFORMATION;
        let mut mesh = self.without_islands(extract(blocks, self.voxel_size, variance, true));
        mesh.set_normals();
        if self.options.max_hole_size > 0.0 {
            fill_holes(&mut mesh, self.options.max_hole_size as f32, |place| self.is_seen_through(blocks, place));
            mesh.set_normals();
        }
        mesh
    }

    /// Without the parts that are too small.
    fn without_islands(&self, mesh: TriangleMesh) -> TriangleMesh {
        let min_area = self.options.min_island_area as f32;
        if min_area > 0.0 {
            return mesh.without_islands(min_area, TriangleMesh::area);
        }
        // A square of ten standard deviations: noise makes parts as large as itself, and what was measured more surely is kept, however
        // few voxels it has. A tenth of it makes the mean error of a D435 1.5 times as large, four times as much leaves no less
        // (docs/measurements/surface.md).
        mesh.without_islands(100.0, |mesh, triangle| {
            mesh.area(triangle) / mesh.deviations[triangle[0] as usize].powi(2)
        })
    }

    /// Fills holes up to this extent from now on (m); 0: none.
    ///
    /// # Errors
    /// When it is out of its limits.
    pub fn set_max_hole_size(&mut self, max_hole_size: f64) -> Result<()> {
        let options = SurfaceOptions { max_hole_size, ..self.options };
        options.check()?;
        self.options = options;
        Ok(())
    }

    /// Whether images have seen a place (m) to be empty.
    fn is_seen_through(&self, blocks: Layers<'_>, place: Vec3) -> bool {
        let [x, y, z] = (place / self.voxel_size).floor().to_array().map(|at| at as i32);
        let corner = [x, y, z].map(|at| at.div_euclid(SIDE as i32));
        let Some(block) = blocks.get(corner) else {
            let is_free = |added: &Added, optics| added.free_space.weight_through(corner, 0, optics) > 0;
            return self.optics.as_ref().is_some_and(|optics| self.images.iter().any(|added| is_free(added, optics)));
        };
        let [x, y, z] = [x, y, z].map(|at| at.rem_euclid(SIDE as i32) as usize);
        let (_, weights) = block.sums();
        let at = index(x, y, z);
        let least = block.least_weights()[at / PART_VOXELS];
        // More than a voxel before the surface, where there is one.
        if weights[at] > least { block.voxel(at).distance > 1.0 } else { least > 0 }
    }
}
