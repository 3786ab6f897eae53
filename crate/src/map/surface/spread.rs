//! A field of voxels twice as large, in the voxels of this one.

#![allow(clippy::cast_possible_wrap, reason = "positions within a block are below ten")]

use super::blocks::{Blocks, KnownBlock, Layers, PART_SIDE, PART_VOXELS, SIDE, STEPS, index, positions};
use super::pixels::MIN_TRUNCATION_VOXELS;

/// Voxels along a side of a block with one more at each end.
const PADDED: usize = SIDE + 2;

/// Distances of the voxels of a block, and of those next to its faces (voxel sides); NaN where nothing was measured.
struct Distances(Box<[f32; PADDED * PADDED * PADDED]>);

const fn padded_index(x: usize, y: usize, z: usize) -> usize {
    (z * PADDED + y) * PADDED + x
}

impl Distances {
    fn of(blocks: Layers<'_>, corner: [i32; 3]) -> Self {
        let mut all = Box::new([f32::NAN; PADDED * PADDED * PADDED]);
        let mut put = |block: &KnownBlock, from: [usize; 3], to: [usize; 3]| {
            let (distances, weights) = block.sums();
            let at = index(from[0], from[1], from[2]);
            if weights[at] > 0 {
                all[padded_index(to[0], to[1], to[2])] = distances[at] as f32 / (weights[at] as f32 * STEPS);
            }
        };
        if let Some(block) = blocks.get(corner) {
            for (z, y, x) in positions(SIDE) {
                put(&block, [x, y, z], [x + 1, y + 1, z + 1]);
            }
        }
        for axis in 0..3 {
            for (step, from, to) in [(-1, SIDE - 1, 0), (1, 0, PADDED - 1)] {
                let mut next = corner;
                next[axis] += step;
                let Some(block) = blocks.get(next) else { continue };
                for u in 0..SIDE {
                    for v in 0..SIDE {
                        let mut voxel = [u, v, v];
                        (voxel[(axis + 1) % 3], voxel[(axis + 2) % 3]) = (u, v);
                        let mut place = voxel.map(|at| at + 1);
                        (voxel[axis], place[axis]) = (from, to);
                        put(&block, voxel, place);
                    }
                }
            }
        }
        Self(all)
    }

    /// How the distance changes from a voxel along each axis, a step down and a step up: by no more than the step. What is known on one
    /// side alone goes on to the other.
    fn changes(&self, [x, y, z]: [usize; 3]) -> [[f32; 2]; 3] {
        let at = padded_index(x + 1, y + 1, z + 1);
        let here = self.0[at];
        [1, PADDED, PADDED * PADDED].map(|stride| {
            let down = self.0[at - stride] - here;
            let up = self.0[at + stride] - here;
            let [down, up] = match (down.is_nan(), up.is_nan()) {
                (true, true) => [0.0, 0.0],
                (true, false) => [-up, up],
                (false, true) => [down, -down],
                (false, false) => [down, up],
            };
            [down.clamp(-1.0, 1.0), up.clamp(-1.0, 1.0)]
        })
    }
}

/// The blocks in which a field of voxels twice as large has a surface, in the voxels of another, `fine`, whose sums are in them, too. What
/// `coarse` measured in a voxel counts in each of the eight as if that had been measured, the distance by its slope.
pub(super) fn spread(coarse: Layers<'_>, fine: &Blocks) -> Blocks {
    let mut all = Blocks::default();
    for corner in coarse.corners() {
        let Some(known) = coarse.get(corner) else { continue };
        let mut distances = None;
        for (part, (z0, y0, x0)) in positions(2).enumerate() {
            if !has_surface(&known, part) {
                continue;
            }
            let distances = distances.get_or_insert_with(|| Distances::of(coarse, corner));
            let first = [x0, y0, z0];
            let child = [0, 1, 2].map(|axis| 2 * corner[axis] + first[axis] as i32);
            add_child(&mut all, child, fine.get(child), (&known, part), first.map(|at| at * PART_SIDE), distances);
        }
    }
    all
}

/// Whether a part of a block has voxels that were measured next to a surface, or behind it.
fn has_surface(block: &KnownBlock, part: usize) -> bool {
    let (distances, weights) = block.sums();
    let least = block.least_weights()[part];
    let range = part * PART_VOXELS..(part + 1) * PART_VOXELS;
    let mut voxels = distances[range.clone()].iter().zip(&weights[range]);
    voxels.any(|(&distance, &weight)| {
        weight > least && (distance as f32) < MIN_TRUNCATION_VOXELS * STEPS * weight as f32
    })
}

/// Adds the block that a part of a coarser one is, and what is known of it already.
fn add_child(
    all: &mut Blocks,
    corner: [i32; 3],
    before: Option<KnownBlock>,
    (coarse, part): (&KnownBlock, usize),
    first: [usize; 3],
    distances: &Distances,
) {
    let number = all.insert(corner);
    if coarse.has_colors() {
        all.add_colors();
    }
    let Some((block, mut colors)) = all.get_mut(number) else { return };
    if let Some(before) = before {
        before.copy_to(block, colors.as_deref_mut());
    }
    let (least, share) = (coarse.least_weights()[part], coarse.noise_share(part));
    block.seen_through.iter_mut().for_each(|of_part| *of_part = (*of_part).max(least));
    block.noise_shares.iter_mut().for_each(|of_part| *of_part += share);
    let (_, weights) = coarse.sums();
    for (z, y, x) in positions(PART_SIDE) {
        let voxel = [x + first[0], y + first[1], z + first[2]];
        let from = index(voxel[0], voxel[1], voxel[2]);
        if weights[from] <= 0 {
            continue;
        }
        let here = distances.0[padded_index(voxel[0] + 1, voxel[1] + 1, voxel[2] + 1)];
        let changes = distances.changes(voxel);
        for (up_z, up_y, up_x) in positions(2) {
            let to = index(2 * x + up_x, 2 * y + up_y, 2 * z + up_z);
            let change = changes[0][up_x] + changes[1][up_y] + changes[2][up_z];
            block.add(to, weights[from], 2.0 * (here + 0.25 * change));
            if let (Some(colors), Some(sum)) = (&mut colors, coarse.color_sum(from)) {
                colors[to].add_sum(sum);
            }
        }
    }
}
