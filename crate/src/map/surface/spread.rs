//! A field of voxels twice as large, in the voxels of this one.

#![allow(clippy::cast_possible_wrap, reason = "positions within a block are below ten")]

use super::blocks::{Blocks, KnownBlock, Layers, PART_SIDE, PART_VOXELS, SIDE, STEPS, index, positions};
use super::pixels::MIN_TRUNCATION_VOXELS;

/// By z, y and x, distances of the voxels of a block, and of those next to its faces, with one more at each end (voxel sides); NaN where
/// nothing was measured.
struct Distances(Box<[[[f32; SIDE + 2]; SIDE + 2]; SIDE + 2]>);

impl Distances {
    fn of(blocks: Layers<'_>, corner: [i32; 3]) -> Self {
        let mut all = Box::new([[[f32::NAN; SIDE + 2]; SIDE + 2]; SIDE + 2]);
        let mut put = |block: &KnownBlock, [x, y, z]: [usize; 3], to: [usize; 3]| {
            let ((distances, weights), at) = (block.sums(), index(x, y, z));
            if weights[at] > 0 {
                all[to[2]][to[1]][to[0]] = distances[at] as f32 / (weights[at] as f32 * STEPS);
            }
        };
        if let Some(block) = blocks.get(corner) {
            for (z, y, x) in positions(SIDE) {
                put(&block, [x, y, z], [x + 1, y + 1, z + 1]);
            }
        }
        for axis in 0..3 {
            for (step, from, to) in [(-1, SIDE - 1, 0), (1, 0, SIDE + 1)] {
                let mut next = corner;
                next[axis] += step;
                let Some(block) = blocks.get(next) else { continue };
                for (u, v) in (0..SIDE).flat_map(|u| (0..SIDE).map(move |v| (u, v))) {
                    let mut voxel = [0; 3];
                    (voxel[(axis + 1) % 3], voxel[(axis + 2) % 3]) = (u, v);
                    let mut place = voxel.map(|at| at + 1);
                    (voxel[axis], place[axis]) = (from, to);
                    put(&block, voxel, place);
                }
            }
        }
        Self(all)
    }

    /// The distance of a voxel, and how it changes along each axis, a step down and a step up: by no more than the step. What is known on
    /// one side alone goes on to the other.
    fn with_changes(&self, voxel: [usize; 3]) -> (f32, [[f32; 2]; 3]) {
        let [x, y, z] = voxel.map(|at| at + 1);
        let here = self.0[z][y][x];
        let around = [
            [self.0[z][y][x - 1], self.0[z][y][x + 1]],
            [self.0[z][y - 1][x], self.0[z][y + 1][x]],
            [self.0[z - 1][y][x], self.0[z + 1][y][x]],
        ];
        let changes = around.map(|of_axis| {
            let [down, up] = of_axis.map(|distance| distance - here);
            let [down, up] = match (down.is_nan(), up.is_nan()) {
                (true, true) => [0.0, 0.0],
                (true, false) => [-up, up],
                (false, true) => [down, -down],
                (false, false) => [down, up],
            };
            [down.clamp(-1.0, 1.0), up.clamp(-1.0, 1.0)]
        });
        (here, changes)
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

/// Whether a part of a block has voxels that were measured next to a surface.
fn has_surface(block: &KnownBlock, part: usize) -> bool {
    let (distances, weights) = block.sums();
    let least = block.least_weights()[part];
    let range = part * PART_VOXELS..(part + 1) * PART_VOXELS;
    let mut voxels = distances[range.clone()].iter().zip(&weights[range]);
    voxels.any(|(&distance, &weight)| {
        weight > least && (distance as f32).abs() < MIN_TRUNCATION_VOXELS * STEPS * weight as f32
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
        let (here, changes) = distances.with_changes(voxel);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A slanted plane, of which a corner was not measured.
    #[test]
    fn a_plane_stays_one_in_voxels_half_as_large() {
        let normal = glam::Vec3::new(0.36, 0.48, 0.8);
        let distance = |place: glam::Vec3| normal.dot(place) - 7.0;
        let mut coarse = Blocks::default();
        for (bz, by, bx) in positions(2) {
            let number = coarse.insert([bx as i32, by as i32, bz as i32 - 1]);
            let (block, _) = coarse.get_mut(number).unwrap();
            for (z, y, x) in positions(SIDE) {
                let voxel = [bx * SIDE + x, by * SIDE + y, bz * SIDE + z].map(|at| at as f32 + 0.5);
                let place = glam::Vec3::from_array(voxel) - glam::Vec3::Z * SIDE as f32;
                if voxel[0] + voxel[1] > 4.0 {
                    block.add(index(x, y, z), 100, distance(place));
                }
            }
        }
        let mut before = Blocks::default();
        let number = before.insert([3, 1, 1]);
        before.get_mut(number).unwrap().0.add(index(2, 3, 4), 50, 1.0);
        let fine = spread(Layers(&[&coarse]), &before);
        let mut num_near = 0;
        for state in &fine.states {
            let block = fine.get(state.corner).unwrap();
            for (z, y, x) in positions(SIDE) {
                let voxel = [x, y, z].map(|at| at as f32 + 0.5);
                let place = glam::Vec3::from_array([0, 1, 2].map(|axis| (8 * state.corner[axis]) as f32 + voxel[axis]));
                let at = index(x, y, z);
                if block.sums().1[at] == 0 {
                    continue;
                }
                let (mut expected, mut weight) = (2.0 * distance(place / 2.0), 100.0);
                if (state.corner, [x, y, z]) == ([3, 1, 1], [2, 3, 4]) {
                    (expected, weight) = ((2.0 * expected + 1.0) / 3.0, 150.0);
                }
                let found = block.voxel(at);
                assert!(
                    (found.distance - expected).abs() < 0.03 && found.weight == weight,
                    "{place}: {found:?}, {expected}"
                );
                num_near += u32::from(expected.abs() < 1.0);
            }
        }
        assert!(num_near > 1000, "{num_near}");
    }
}
