//! The field in voxels of one size, of the pixels that see no less.

use super::blocks::{Block, Blocks, STEPS};
use super::view::{FreeSpace, Squares, View};

/// The sums over the images in voxels of one size.
#[derive(Debug, Clone, Default)]
pub(super) struct Level {
    pub blocks: Blocks,
    /// Number of changes by images.
    num_changes: u32,
    squares: Squares,
}

impl Level {
    /// Adds the blocks that an image touches, with what the images before see of them: if they had touched a block, it would be there.
    /// `level` is the number of this one.
    pub(super) fn insert_touched<'a>(
        &mut self,
        level: usize,
        view: &View,
        before: &(impl Iterator<Item = &'a FreeSpace> + Clone),
    ) {
        for &corner in &view.touched[level] {
            let known = self.blocks.len();
            let number = self.blocks.insert(corner);
            if number == known {
                let weights = before.clone().map(|free_space| free_space.weight_through(corner, level, view.optics));
                self.blocks.states[number].seen_through = weights.sum();
            }
        }
    }

    /// Adds an image to the blocks, or takes it out.
    pub(super) fn change<const IS_TAKEN_OUT: bool>(&mut self, level: usize, view: &View, free_space: &FreeSpace) {
        self.num_changes += 1;
        for corner in &view.touched[level] {
            let Some(number) = self.blocks.number(*corner) else { continue };
            self.blocks.states[number].last_touched = self.num_changes;
        }
        let mut squares = Squares::default();
        if view.has_colors() {
            self.blocks.add_colors();
        }
        for number in 0..self.blocks.len() {
            let state = &mut self.blocks.states[number];
            if state.last_touched != self.num_changes {
                let through = free_space.weight_through(state.corner, level, view.optics);
                state.seen_through += if IS_TAKEN_OUT { -through } else { through };
                continue;
            }
            let corner = state.corner;
            if let Some((block, colors)) = self.blocks.get_mut(number) {
                view.change_block::<IS_TAKEN_OUT>(corner, level, block, colors, &mut squares);
            }
        }
        let sign = if IS_TAKEN_OUT { -1 } else { 1 };
        self.squares.sum += f64::from(sign) * squares.sum;
        self.squares.count += i64::from(sign) * squares.count;
    }

    /// Sum of the weighted squares by which the measurements differ from their means (voxel sides), and how many they are but for these.
    pub(super) fn scatter(&self) -> (f64, i64) {
        let of_means = self.blocks.iter().map(Block::square_sum);
        let (sum, count) = of_means.fold((0.0, 0), |(sum, count), of_block| (sum + of_block.0, count + of_block.1));
        ((self.squares.sum - sum) / f64::from(STEPS * STEPS), self.squares.count - count)
    }
}
