//! Voxels in blocks of 8 x 8 x 8 that are found by hashing.
//!
//! A voxel holds sums of whole numbers, so that what an image added can be taken out again to the last bit, in any order.

#![allow(clippy::cast_possible_wrap, reason = "positions within a block are below ten")]

use rustc_hash::FxHashMap;

/// Voxels along a side of a block.
pub(super) const SIDE: usize = 8;
/// Voxels of a block.
pub(super) const VOXELS: usize = SIDE * SIDE * SIDE;
/// Voxels along a side of a part of a block: each part is skipped or measured as a whole.
pub(super) const PART_SIDE: usize = 4;
/// Voxels of a part.
pub(super) const PART_VOXELS: usize = PART_SIDE * PART_SIDE * PART_SIDE;
/// Parts of a block.
pub(super) const PARTS: usize = VOXELS / PART_VOXELS;

/// Steps of a distance in a voxel's side: rounding to them adds a standard deviation of 0.5 % of a voxel.
pub(super) const STEPS: f32 = 64.0;
/// Weight of the best measurement, of a deviation of a millimetre seen at a right angle; one of 64 mm has the weight 1. The product
/// with a distance stays below 2^20 for voxels of a millimetre or more (2 voxels or three deviations, in steps), so that two
/// thousand such views fit in 31 bits.
pub(super) const MAX_WEIGHT: f32 = 4095.0;
/// A share of 1, in whole numbers.
pub(super) const WHOLE_SHARE: f32 = 64.0;
/// Views of a colour after which later ones are left out: the sums have 16 bits each.
const MAX_COLOR_VIEWS: u64 = u16::MAX as u64 / u8::MAX as u64;

/// Sums of red, green, blue and 1 over the views of a colour, 16 bits each.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct ColorSum(u64);

impl ColorSum {
    /// Adds a view, or takes it out.
    #[inline]
    pub(super) fn add(&mut self, [red, green, blue]: [u8; 3], is_taken_out: bool) {
        if self.0 >> 48 == MAX_COLOR_VIEWS {
            return;
        }
        let one = 1 << 48 | u64::from(blue) << 32 | u64::from(green) << 16 | u64::from(red);
        self.0 = if is_taken_out { self.0.wrapping_sub(one) } else { self.0 + one };
    }

    /// Adds the views of another, as long as there is room for them.
    pub(super) fn add_sum(&mut self, other: Self) {
        if (self.0 >> 48) + (other.0 >> 48) <= MAX_COLOR_VIEWS {
            self.0 += other.0;
        }
    }

    /// The mean, where there was a view.
    pub(super) fn mean(self) -> Option<[u8; 3]> {
        let count = (self.0 >> 48) as u32;
        (count > 0).then(|| [0, 16, 32].map(|shift| ((u32::from((self.0 >> shift) as u16) + count / 2) / count) as u8))
    }
}

/// What was measured at the place of a voxel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Voxel {
    /// Signed distance from the surface, positive in front of it (voxel sides).
    pub distance: f32,
    /// Sum of the weights; 0 where nothing was measured.
    pub weight: f32,
    /// Of the images that measured around it, how many have errors that others share: each counts by the share of noise in its variance.
    pub noisy_views: f32,
    /// The mean colour, where a view had one.
    pub color: Option<[u8; 3]>,
}

/// A block: sums over the images, by voxel.
#[derive(Debug, Clone)]
pub(super) struct Block {
    /// Weights times distances (steps).
    pub distances: [i32; VOXELS],
    pub weights: [i32; VOXELS],
    /// Of each part, weight of the views of the block that saw through it.
    pub seen_through: [i32; PARTS],
    /// Of each part, sum of [`Optics::noise_share`](super::pixels::Optics::noise_share) over the images that measured something in it.
    pub noise_shares: [i32; PARTS],
}

/// The colours of a block.
pub(super) type BlockColors = [ColorSum; VOXELS];

/// What is looked at of each block for every image.
#[derive(Debug, Clone, Copy)]
pub(super) struct BlockState {
    /// Corner (blocks).
    pub corner: [i32; 3],
    /// Weight of the views through all of the block that saw nothing in it.
    pub seen_through: i32,
    /// Number of the last image that touched the block.
    pub last_touched: u32,
}

impl Block {
    fn new() -> Self {
        Self { distances: [0; VOXELS], weights: [0; VOXELS], seen_through: [0; PARTS], noise_shares: [0; PARTS] }
    }

    /// Adds a distance (voxel sides) to those of a voxel. Sums end at the largest number.
    pub(super) fn add(&mut self, at: usize, weight: i32, distance: f32) {
        self.weights[at] = self.weights[at].saturating_add(weight);
        self.distances[at] =
            self.distances[at].saturating_add((weight as f32 * distance * STEPS).round_ties_even() as i32);
    }

    /// Sum of the squares of the mean distances (steps^2), by their weights, and the number of voxels that were measured.
    pub(super) fn square_sum(&self) -> (f64, i64) {
        let measured = self.distances.iter().zip(&self.weights).filter(|&(_, &weight)| weight > 0);
        measured.fold((0.0, 0), |(sum, count), (&distance, &weight)| {
            (sum + f64::from(distance).powi(2) / f64::from(weight), count + 1)
        })
    }

    /// Adds a block of voxels half as large, and the colours of that to those of this one.
    fn add_finer(&mut self, fine: &Self, state: &BlockState, mut colors: Option<(&mut BlockColors, &BlockColors)>) {
        let [x0, y0, z0] = state.corner.map(|at| at.rem_euclid(2) as usize * PART_SIDE);
        let part = part_index(x0, y0, z0);
        self.seen_through[part] = state.seen_through + fine.seen_through.iter().sum::<i32>() / PARTS as i32;
        self.noise_shares[part] = fine.noise_shares.iter().copied().fold(0, i32::max);
        for (z, y, x) in positions(PART_SIDE) {
            let eight: [usize; 8] =
                std::array::from_fn(|bits| index(2 * x + (bits & 1), 2 * y + (bits >> 1 & 1), 2 * z + (bits >> 2)));
            let at = index(x0 + x, y0 + y, z0 + z);
            // Eight voxels that one image saw are one measurement of the larger one, and half as many of its sides from the surface.
            let sum = |sums: &[i32; VOXELS]| eight.iter().map(|&at| i64::from(sums[at])).sum::<i64>();
            self.weights[at] = (sum(&fine.weights) / 8) as i32;
            self.distances[at] = (sum(&fine.distances) / 16) as i32;
            let Some((coarse, fine)) = &mut colors else { continue };
            for color in eight.iter().filter_map(|&at| fine[at].mean()) {
                coarse[at].add(color, false);
            }
        }
    }
}

/// Large things in slabs of a megabyte: they grow to the whole memory, where one vector would be copied to a larger place, and
/// an allocation each would take as long as measuring.
#[derive(Debug, Clone)]
struct Slabs<T>(Vec<Vec<T>>);

impl<T> Slabs<T> {
    /// Of a slab.
    const LENGTH: usize = (1 << 20) / size_of::<T>();

    fn len(&self) -> usize {
        self.0.last().map_or(0, |last| (self.0.len() - 1) * Self::LENGTH + last.len())
    }

    fn push(&mut self, value: T) {
        if self.0.last().is_none_or(|last| last.len() == Self::LENGTH) {
            self.0.push(Vec::with_capacity(Self::LENGTH));
        }
        if let Some(last) = self.0.last_mut() {
            last.push(value);
        }
    }

    fn get(&self, number: usize) -> Option<&T> {
        self.0.get(number / Self::LENGTH)?.get(number % Self::LENGTH)
    }

    fn get_mut(&mut self, number: usize) -> Option<&mut T> {
        self.0.get_mut(number / Self::LENGTH)?.get_mut(number % Self::LENGTH)
    }
}

impl<T> Default for Slabs<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

/// The blocks that hold a surface.
#[derive(Debug, Clone, Default)]
pub(super) struct Blocks {
    numbers: FxHashMap<[i32; 3], u32>,
    /// In the order in which the blocks were added.
    pub(super) states: Vec<BlockState>,
    all: Slabs<Block>,
    /// Of each block, where an image has had colours; of none before.
    colors: Slabs<BlockColors>,
}

/// A block with its state.
#[derive(Clone, Copy)]
pub(super) struct KnownBlock<'a> {
    state: &'a BlockState,
    block: &'a Block,
    colors: Option<&'a BlockColors>,
}

impl KnownBlock<'_> {
    /// Of each part, the weight that a voxel has to exceed: what was seen through as often as it was seen has moved, or was never there.
    pub(super) fn least_weights(&self) -> [i32; PARTS] {
        self.block.seen_through.map(|of_part| of_part + self.state.seen_through)
    }

    /// Weights times distances, and weights.
    pub(super) fn sums(&self) -> (&[i32; VOXELS], &[i32; VOXELS]) {
        (&self.block.distances, &self.block.weights)
    }

    /// The same sums as a block of its own, whose state saw nothing.
    pub(super) fn copy_to(&self, block: &mut Block, colors: Option<&mut BlockColors>) {
        *block = self.block.clone();
        block.seen_through = self.least_weights();
        if let (Some(to), Some(from)) = (colors, self.colors) {
            to.clone_from(from);
        }
    }

    /// The same as [`Block::noise_shares`].
    pub(super) fn noise_share(&self, part: usize) -> i32 {
        self.block.noise_shares[part]
    }

    pub(super) fn has_colors(&self) -> bool {
        self.colors.is_some()
    }

    pub(super) fn color_sum(&self, index: usize) -> Option<ColorSum> {
        self.colors.map(|colors| colors[index])
    }

    /// A voxel that was measured.
    pub(super) fn voxel(&self, index: usize) -> Voxel {
        let weight = self.block.weights[index] as f32;
        let distance = self.block.distances[index] as f32 / (weight * STEPS);
        let noisy_views = self.block.noise_shares[index / PART_VOXELS] as f32 / WHOLE_SHARE;
        let color = self.colors.and_then(|colors| colors[index].mean());
        Voxel { distance, weight, noisy_views, color }
    }
}

/// Blocks of one field: of those that several have, the first has what counts.
#[derive(Clone, Copy)]
pub(super) struct Layers<'a>(pub &'a [&'a Blocks]);

impl<'a> Layers<'a> {
    pub(super) fn get(self, corner: [i32; 3]) -> Option<KnownBlock<'a>> {
        self.0.iter().find_map(|blocks| blocks.get(corner))
    }

    /// The corner of each block.
    pub(super) fn corners(self) -> impl Iterator<Item = [i32; 3]> {
        (0..).zip(self.0).flat_map(move |(number, blocks)| {
            let is_new =
                move |corner: &[i32; 3]| self.0[..number].iter().all(|before| before.number(*corner).is_none());
            blocks.states.iter().map(|state| state.corner).filter(is_new)
        })
    }
}

impl Blocks {
    pub(super) fn len(&self) -> usize {
        self.states.len()
    }

    /// From now on images have colours.
    pub(super) fn add_colors(&mut self) {
        while self.colors.len() < self.len() {
            self.colors.push([ColorSum::default(); VOXELS]);
        }
    }

    pub(super) fn number(&self, corner: [i32; 3]) -> Option<usize> {
        self.numbers.get(&corner).map(|&number| number as usize)
    }

    pub(super) fn get(&self, corner: [i32; 3]) -> Option<KnownBlock<'_>> {
        let number = self.number(corner)?;
        Some(KnownBlock { state: &self.states[number], block: self.all.get(number)?, colors: self.colors.get(number) })
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Block> {
        self.all.0.iter().flatten()
    }

    /// A block with its colours, where there are any.
    pub(super) fn get_mut(&mut self, number: usize) -> Option<(&mut Block, Option<&mut BlockColors>)> {
        Some((self.all.get_mut(number)?, self.colors.get_mut(number)))
    }

    /// The number of a block, which is added where there is none.
    pub(super) fn insert(&mut self, corner: [i32; 3]) -> usize {
        let next = self.len() as u32;
        let number = *self.numbers.entry(corner).or_insert(next);
        if number == next {
            self.states.push(BlockState { corner, seen_through: 0, last_touched: 0 });
            self.all.push(Block::new());
        }
        number as usize
    }

    /// The same field in voxels twice as large.
    pub(super) fn coarsened(&self) -> Self {
        let mut coarse = Self::default();
        for (number, (state, fine)) in self.states.iter().zip(self.iter()).enumerate() {
            let parent = coarse.insert(state.corner.map(|at| at.div_euclid(2)));
            let fine_colors = self.colors.get(number);
            if fine_colors.is_some() {
                coarse.add_colors();
            }
            let Some((block, colors)) = coarse.get_mut(parent) else { continue };
            block.add_finer(fine, state, colors.zip(fine_colors));
        }
        coarse
    }
}

/// Index of a voxel in its block: part by part, so that a part which is skipped is not read from memory.
#[inline]
pub(super) const fn index(x: usize, y: usize, z: usize) -> usize {
    let [within_x, within_y, within_z] = [x % PART_SIDE, y % PART_SIDE, z % PART_SIDE];
    part_index(x, y, z) * PART_VOXELS + (within_z * PART_SIDE + within_y) * PART_SIDE + within_x
}

/// Index of the part of a block that a voxel is in.
#[inline]
pub(super) const fn part_index(x: usize, y: usize, z: usize) -> usize {
    (z / PART_SIDE * 2 + y / PART_SIDE) * 2 + x / PART_SIDE
}

/// z, y and x of the voxels of a cube.
pub(super) fn positions(side: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..side).flat_map(move |z| (0..side).flat_map(move |y| (0..side).map(move |x| (z, y, x))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_averaged_and_taken_out_again() {
        let mut sum = ColorSum::default();
        assert_eq!(sum.mean(), None);
        for value in [100, 140, 100, 140] {
            sum.add([value, 255, 0], false);
        }
        assert_eq!(sum.mean(), Some([120, 255, 0]));
        sum.add([140, 255, 0], true);
        sum.add([140, 255, 0], true);
        assert_eq!(sum.mean(), Some([100, 255, 0]));
        for _ in 0..1000 {
            sum.add([255; 3], false);
        }
        assert_eq!(sum.mean().map(|[red, ..]| red > 250), Some(true), "further views do not spill over");
    }

    #[test]
    fn coarser_voxels_keep_a_plane() {
        let mut blocks = Blocks::default();
        for (bz, by, bx) in positions(2) {
            let number = blocks.insert([bx as i32 - 2, by as i32 - 2, bz as i32]);
            let (block, _) = blocks.get_mut(number).unwrap();
            for (z, y, x) in positions(SIDE) {
                // The plane z = 6.5 voxels; a voxel is measured at its centre.
                let distance = (bz * SIDE + z) as f32 + 0.5 - 6.5;
                block.weights[index(x, y, z)] = 640;
                block.distances[index(x, y, z)] = (640.0 * STEPS * distance) as i32;
            }
        }
        let coarse = blocks.coarsened();
        assert_eq!(coarse.states.iter().map(|state| state.corner).collect::<Vec<_>>(), [[-1, -1, 0]]);
        for (z, y, x) in positions(SIDE) {
            let voxel = coarse.get([-1, -1, 0]).unwrap().voxel(index(x, y, z));
            assert!((voxel.distance - (z as f32 + 0.5 - 3.25)).abs() < 1e-3, "{}", voxel.distance);
            assert!((voxel.weight - 640.0).abs() < 1.0, "{}", voxel.weight);
        }
    }
}
