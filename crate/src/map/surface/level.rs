//! The field in voxels of one size, of the pixels that resolve it.

use super::blocks::{Block, Blocks, STEPS};
use super::pixels::{Optics, WEIGHT_INFORMATION};
use super::view::{FreeSpace, Squares, View};
use crate::geometry::Pose3;
use crate::preprocess::depth_surfels::DepthModel;
use crate::preprocess::map_image::MapImage;

/// Sizes of voxels, each twice as large as the one before.
pub(super) const NUM_LEVELS: i32 = 3;

/// The sums over the images in voxels of one size.
#[derive(Debug, Clone)]
pub(super) struct Level {
    /// How often a voxel of the finest level is doubled.
    doublings: i32,
    /// Side of a voxel (m).
    pub voxel_size: f32,
    pub blocks: Blocks,
    optics: Option<Optics>,
    /// Of each image.
    pub free_spaces: Vec<FreeSpace>,
    /// Number of changes by images.
    num_changes: u32,
    squares: Squares,
}

impl Level {
    /// Without images; `voxel_size` is that of the finest level (m).
    pub(super) fn new(doublings: i32, voxel_size: f32) -> Self {
        Self {
            doublings,
            voxel_size: voxel_size * 2f32.powi(doublings),
            blocks: Blocks::default(),
            optics: None,
            free_spaces: Vec::new(),
            num_changes: 0,
            squares: Squares::default(),
        }
    }

    /// The depths at which a voxel is as large as what a pixel sees, to the next level (m).
    fn depths(&self, image: &MapImage) -> [f32; 2] {
        let k: f32 = std::env::var("LEVEL_K").ok().and_then(|k| k.parse().ok()).unwrap_or(1.0);
        let begin = k * self.voxel_size * image.camera.fx.min(image.camera.fy) as f32;
        let low = if self.doublings == 0 { 0.0 } else { begin };
        let high = if self.doublings + 1 == NUM_LEVELS { f32::INFINITY } else { 2.0 * begin };
        [low, high]
    }

    /// What all images have in common: made anew where an image differs from the one before. It is to be put back.
    pub(super) fn optics(&mut self, image: &MapImage, model: &DepthModel) -> Optics {
        let known = self.optics.take().filter(|optics| optics.is_of(image, model, self.voxel_size));
        known.unwrap_or_else(|| Optics::new(image, model, self.voxel_size))
    }

    /// An image at its pose, as this level reads it.
    pub(super) fn view<'a>(&self, image: &'a MapImage, optics: &'a Optics, T_world_camera: &Pose3) -> View<'a> {
        View::new(image, optics, T_world_camera, self.voxel_size, self.depths(image))
    }

    /// Adds the blocks that an image touches, with what the images before see of them: if they had touched a block, it would be there.
    pub(super) fn insert_touched(&mut self, view: &View) {
        for &corner in &view.touched {
            let known = self.blocks.len();
            let number = self.blocks.insert(corner);
            if number == known {
                let weights = self.free_spaces.iter().map(|free_space| free_space.weight_through(corner, view.optics));
                self.blocks.states[number].seen_through = weights.sum();
            }
        }
    }

    pub(super) fn add(&mut self, view: &View) {
        self.change::<false>(view);
        self.free_spaces.push(view.free_space());
    }

    /// Takes out the image that was added as `number`.
    pub(super) fn take_out(&mut self, number: usize, view: &View) {
        self.change::<true>(view);
        self.free_spaces.remove(number);
    }

    /// Adds an image to the blocks, or takes it out.
    fn change<const IS_TAKEN_OUT: bool>(&mut self, view: &View) {
        self.num_changes += 1;
        for corner in &view.touched {
            let Some(number) = self.blocks.number(*corner) else { continue };
            self.blocks.states[number].last_touched = self.num_changes;
        }
        let free_space = view.free_space();
        let mut squares = Squares::default();
        if view.has_colors() {
            self.blocks.add_colors();
        }
        for number in 0..self.blocks.len() {
            let state = &mut self.blocks.states[number];
            if state.last_touched != self.num_changes {
                let through = free_space.weight_through(state.corner, view.optics);
                state.seen_through += if IS_TAKEN_OUT { -through } else { through };
                continue;
            }
            let corner = state.corner;
            if let Some((block, colors)) = self.blocks.get_mut(number) {
                view.change_block::<IS_TAKEN_OUT>(corner, block, colors, &mut squares);
            }
        }
        let sign = if IS_TAKEN_OUT { -1 } else { 1 };
        self.squares.sum += f64::from(sign) * squares.sum;
        self.squares.count += i64::from(sign) * squares.count;
    }

    /// Puts back what images have in common.
    pub(super) fn keep(&mut self, optics: Optics) {
        self.optics = Some(optics);
    }

    /// Doubles the voxels.
    pub(super) fn coarsen(&mut self) {
        self.blocks = self.blocks.coarsened();
        self.voxel_size *= 2.0;
        self.free_spaces.iter_mut().for_each(FreeSpace::double_voxels);
    }

    /// What the measurements scatter about their means, in variances of the sensor's noise, and how many they are but for these.
    pub(super) fn scatter(&self) -> (f64, i64) {
        let of_means = self.blocks.iter().map(Block::square_sum);
        let (sum, count) = of_means.fold((0.0, 0), |(sum, count), of_block| (sum + of_block.0, count + of_block.1));
        let unit = f64::from(WEIGHT_INFORMATION * (self.voxel_size / STEPS).powi(2));
        (unit * (self.squares.sum - sum), self.squares.count - count)
    }

    /// Whether an image has seen through a block (blocks).
    pub(super) fn is_free(&self, corner: [i32; 3]) -> bool {
        let is_free = |free_space: &FreeSpace, optics| free_space.weight_through(corner, optics) > 0;
        self.optics.as_ref().is_some_and(|optics| self.free_spaces.iter().any(|one| is_free(one, optics)))
    }
}
