//! Voxels in blocks of 8 x 8 x 8 that are found by hashing.

#![allow(clippy::cast_possible_wrap, reason = "positions within a block are below ten")]

use rustc_hash::FxHashMap;

/// Voxels along a side of a block.
pub(super) const SIDE: usize = 8;
/// Voxels of a block.
pub(super) const VOXELS: usize = SIDE * SIDE * SIDE;

/// Steps of a kept distance in a voxel's side: finer than a hundredth of any sensor's noise.
const STEPS: f32 = 1000.0;
/// Views of a colour after which later ones count as much as earlier ones: the mean over so many is within a level or two.
const MAX_COLOR_VIEWS: u8 = 32;

/// A voxel: 8 bytes, since a flat takes fifty million.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Voxel {
    /// Signed distance from the surface, positive in front of it (voxel sides / `STEPS`).
    distance: i16,
    /// The upper half of the bits of a single: three digits suffice for a weight. The sum ends at about 256 times what is added;
    /// from there on the mean follows what was measured last, and the deviation is told too large, not too small.
    information: u16,
    /// Mean colour.
    color: [u8; 3],
    /// Number of views of the colour.
    num_colors: u8,
}

impl Voxel {
    /// Sum of the inverse variances of what was measured here (1/m^2); 0 where nothing was.
    #[inline]
    pub(super) fn information(self) -> f32 {
        f32::from_bits(u32::from(self.information) << 16)
    }

    /// Signed distance (voxel sides).
    #[inline]
    pub(super) fn distance(self) -> f32 {
        f32::from(self.distance) / STEPS
    }

    /// The mean colour, where a view had one.
    pub(super) fn color(self) -> Option<[u8; 3]> {
        (self.num_colors > 0).then_some(self.color)
    }

    /// Adds a measured distance (voxel sides, at most 32). Returns the square of its deviation from the mean before, in units
    /// of the variance that is expected of it; `None` where it is the first.
    #[inline]
    pub(super) fn add(&mut self, distance: f32, information: f32) -> Option<f32> {
        let (before, old) = (self.information(), self.distance());
        let sum = before + information;
        let mean = old + (distance - old) * (information / sum);
        self.distance = round(mean * STEPS) as i16;
        // Rounded to nearest, or a weight that grows by little would never grow.
        self.information = ((sum.to_bits() + 0x8000) >> 16) as u16;
        (before > 0.0).then(|| (distance - old).powi(2) * (before * information / sum))
    }

    /// Adds a view of its colour.
    #[inline]
    pub(super) fn add_color(&mut self, color: [u8; 3]) {
        self.num_colors = (self.num_colors + 1).min(MAX_COLOR_VIEWS);
        let views = i32::from(self.num_colors);
        for (mean, value) in self.color.iter_mut().zip(color) {
            let off = i32::from(value) - i32::from(*mean);
            *mean = (i32::from(*mean) + (off + off.signum() * (views / 2)) / views) as u8;
        }
    }

    /// The mean of eight voxels, of one twice as large.
    fn merged(voxels: [Self; 8]) -> Self {
        let mut mean = Self::default();
        for voxel in voxels.into_iter().filter(|voxel| voxel.information > 0) {
            mean.add(voxel.distance() / 2.0, voxel.information());
            if let Some(color) = voxel.color() {
                mean.add_color(color);
            }
        }
        // Eight voxels that one frame saw are one measurement of the larger one.
        mean.information = ((mean.information() / 8.0).to_bits() >> 16) as u16;
        mean
    }
}

/// To the nearest whole number, below 2^22: where a single has no bits left for a fraction, adding rounds. Without an instruction of
/// the processor for it, `round_ties_even` is a call of a function.
#[inline]
fn round(value: f32) -> f32 {
    const SHIFT: f32 = 1.5 * (1 << 23) as f32;
    value + SHIFT - SHIFT
}

/// The blocks that hold a surface.
#[derive(Debug, Clone, Default)]
pub(super) struct Blocks {
    numbers: FxHashMap<[i32; 3], u32>,
    /// Corner of each block (blocks), in the order in which they were added.
    pub(super) corners: Vec<[i32; 3]>,
    pub(super) voxels: Vec<[Voxel; VOXELS]>,
    /// Information of views through each block that saw nothing in it (1/m^2).
    pub(super) seen_through: Vec<f32>,
    /// Number of the last frame that touched each block.
    pub(super) last_frames: Vec<u32>,
}

impl Blocks {
    pub(super) fn len(&self) -> usize {
        self.corners.len()
    }

    pub(super) fn number(&self, corner: [i32; 3]) -> Option<usize> {
        self.numbers.get(&corner).map(|&number| number as usize)
    }

    /// The number of a block, which is added where there is none.
    pub(super) fn insert(&mut self, corner: [i32; 3]) -> usize {
        let next = self.corners.len() as u32;
        let number = *self.numbers.entry(corner).or_insert(next);
        if number == next {
            self.corners.push(corner);
            self.voxels.push([Voxel::default(); VOXELS]);
            self.seen_through.push(0.0);
            self.last_frames.push(0);
        }
        number as usize
    }

    /// The same field in voxels twice as large.
    pub(super) fn coarsened(&self) -> Self {
        let mut coarse = Self::default();
        for (number, corner) in self.corners.iter().enumerate() {
            let parent = coarse.insert(corner.map(|at| at.div_euclid(2)));
            coarse.seen_through[parent] = coarse.seen_through[parent].max(self.seen_through[number]);
            let [x0, y0, z0] = corner.map(|at| at.rem_euclid(2) as usize * (SIDE / 2));
            let fine = &self.voxels[number];
            for (z, y, x) in positions(SIDE / 2) {
                let eight = std::array::from_fn(|part| {
                    fine[index(2 * x + (part & 1), 2 * y + (part >> 1 & 1), 2 * z + (part >> 2))]
                });
                coarse.voxels[parent][index(x0 + x, y0 + y, z0 + z)] = Voxel::merged(eight);
            }
        }
        coarse
    }
}

/// Index of a voxel in its block.
#[inline]
pub(super) const fn index(x: usize, y: usize, z: usize) -> usize {
    (z * SIDE + y) * SIDE + x
}

/// z, y and x of the voxels of a cube.
pub(super) fn positions(side: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..side).flat_map(move |z| (0..side).flat_map(move |y| (0..side).map(move |x| (z, y, x))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_voxel_is_the_weighted_mean_of_what_was_measured() {
        let mut voxel = Voxel::default();
        assert_eq!(voxel.add(1.5, 100.0), None);
        let deviation = voxel.add(-0.5, 300.0).unwrap();
        assert!((voxel.distance() - 0.0).abs() < 2.0 / STEPS, "{}", voxel.distance());
        assert!((deviation - 4.0 * 75.0).abs() < 2.0, "{deviation}");
        assert!((voxel.information() / 400.0 - 1.0).abs() < 0.01);
        for _ in 0..2000 {
            voxel.add(2.0, 1.0);
        }
        assert!((512.0..=2400.0).contains(&voxel.information()), "{}", voxel.information());
        assert!((voxel.distance() - 2.0).abs() < 0.3, "the mean follows later measurements: {}", voxel.distance());
        for distance in [-31.9, -0.0004, 0.0004, 0.2503, 31.9] {
            let mut voxel = Voxel::default();
            voxel.add(distance, 1.0);
            assert!((voxel.distance() - distance).abs() <= 0.51 / STEPS, "{distance}: {}", voxel.distance());
        }
    }

    #[test]
    fn colours_are_averaged() {
        let mut voxel = Voxel::default();
        assert_eq!(voxel.color(), None);
        for value in [100, 140, 100, 140, 100, 140] {
            voxel.add_color([value, 255, 0]);
        }
        let [red, green, blue] = voxel.color().unwrap();
        assert!(red.abs_diff(120) <= 6 && green == 255 && blue == 0, "{red}");
    }

    #[test]
    fn coarser_voxels_keep_a_plane() {
        let mut blocks = Blocks::default();
        for (bz, by, bx) in positions(2) {
            let number = blocks.insert([bx as i32 - 2, by as i32 - 2, bz as i32]);
            for (z, y, x) in positions(SIDE) {
                // The plane z = 6.5 voxels; a voxel is measured at its centre.
                blocks.voxels[number][index(x, y, z)].add((bz * SIDE + z) as f32 + 0.5 - 6.5, 64.0);
            }
        }
        let coarse = blocks.coarsened();
        assert_eq!(coarse.corners, [[-1, -1, 0]]);
        for (z, y, x) in positions(SIDE) {
            let voxel = coarse.voxels[0][index(x, y, z)];
            assert!((voxel.distance() - (z as f32 + 0.5 - 3.25)).abs() < 2.0 / STEPS, "{}", voxel.distance());
            assert!((voxel.information() / 64.0 - 1.0).abs() < 0.02, "{}", voxel.information());
        }
    }
}
