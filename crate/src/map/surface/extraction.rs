//! The zero level of the field as triangles: a vertex for each cell that the surface crosses, at the mean of the crossings of its
//! edges, and two triangles for each edge that it crosses (Gibson, "Constrained elastic surface nets", MICCAI 1998).

#![allow(clippy::cast_possible_wrap, reason = "positions within a block are below ten")]

use glam::Vec3;
use rustc_hash::{FxHashMap, FxHashSet};

use super::blocks::{KnownBlock, Layers, PART_VOXELS, SIDE, Voxel, index, positions};
use super::pixels::MIN_TRUNCATION_VOXELS;
use crate::geometry::TriangleMesh;
use crate::preprocess::depth_surfels::SHARED_ERROR;

/// Corners along a side of a block's cells: its own and the first of the next block.
const CORNERS: usize = SIDE + 1;
/// A corner that lies behind the surface: a bit, so that the union over a cell tells what it has.
const BEHIND: u8 = 1;
/// A corner in front of it.
const IN_FRONT: u8 = 2;
/// Between voxels whose distances change by more than this (voxels) there is no surface but the jump from one to another: so a voxel next
/// to a free one, whose distance is [`MIN_TRUNCATION_VOXELS`], has a surface between where it lies less than half of its side behind one.
/// A curtain behind an outline is no longer than that.
const MAX_CHANGE: f32 = MIN_TRUNCATION_VOXELS + 0.5;
/// The edges of a cell: corners as bits x, y, z.
const EDGES: [[usize; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/// Which cells of a block have a vertex. They are numbered in the order of z, y and x.
struct CellVertices {
    /// Corner (blocks).
    block: [i32; 3],
    /// The number of the first vertex.
    first: u32,
    /// By z; bit 8 y + x.
    layers: [u64; SIDE],
}

impl CellVertices {
    /// The number of a cell's vertex, where it has one.
    fn number(&self, [x, y, z]: [usize; 3]) -> Option<u32> {
        let bit = 1 << (SIDE * y + x);
        let before: u32 = self.layers[..z].iter().map(|layer| layer.count_ones()).sum();
        let in_layer = || (self.layers[z] & (bit - 1)).count_ones();
        (self.layers[z] & bit != 0).then(|| self.first + before + in_layer())
    }

    /// The cells with a vertex, in its order.
    fn cells(&self) -> impl Iterator<Item = [usize; 3]> {
        self.layers.iter().enumerate().flat_map(|(z, &layer)| {
            let not_empty = |left: u64| Some(left).filter(|&left| left != 0);
            let set = std::iter::successors(not_empty(layer), move |left| not_empty(left & (left - 1)));
            set.map(move |left| left.trailing_zeros() as usize).map(move |bit| [bit % SIDE, bit / SIDE, z])
        })
    }
}

/// A mesh that grows by the vertices of cells.
#[derive(Default)]
struct Extraction {
    mesh: TriangleMesh,
    has_colors: bool,
    has_rims: bool,
    vertices: Vec<CellVertices>,
    /// Where in that list a block is.
    by_block: FxHashMap<[i32; 3], u32>,
    /// Of each vertex, as bits 0 to 2, the axes along which the surface crosses the edge from the first corner of its cell; bit 3 where
    /// that corner lies behind the surface.
    crossings: Vec<u8>,
}

/// The surface of a field with voxels of this size (m); `variance` is that of a weight of 1 (m^2). Cells in which the
/// surface ends have vertices where `has_rims`. Normals are left out.
pub(super) fn extract(blocks: Layers<'_>, voxel_size: f32, variance: f32, has_rims: bool) -> TriangleMesh {
    let mut extraction = Extraction { has_rims, ..Extraction::default() };
    for block in with_blocks_before(blocks) {
        extraction.add_vertices(&Corners::of(blocks, block), block, voxel_size, variance);
    }
    if !extraction.has_colors {
        extraction.mesh.colors.clear();
    }
    extraction.add_triangles();
    extraction.mesh
}

/// The corners of the blocks, and of those before them whose cells reach into them.
fn with_blocks_before(blocks: Layers<'_>) -> Vec<[i32; 3]> {
    let mut all: Vec<[i32; 3]> = blocks.corners().collect();
    let mut before = FxHashSet::default();
    for &[x, y, z] in &all {
        let of_block = positions(2).map(|(dz, dy, dx)| [x - dx as i32, y - dy as i32, z - dz as i32]);
        before.extend(of_block.filter(|&corner| blocks.get(corner).is_none()));
    }
    all.extend(before);
    all
}

/// The corners of a block's cells.
struct Corners<'a> {
    /// The block and the next ones, along x, y and z as bits.
    blocks: [Option<KnownBlock<'a>>; 8],
    /// What each corner is; 0: not measured.
    kinds: [u8; CORNERS * CORNERS * CORNERS],
}

/// A vertex of a cell.
struct CellVertex {
    /// From the cell's first corner (voxels).
    place: Vec3,
    color: Option<[u8; 3]>,
    /// Means of the corners'.
    weight: f32,
    noisy_views: f32,
    /// Whether the surface ends in the cell: corners are not known, or edges jump.
    is_rim: bool,
    /// Whether the first corner lies behind the surface.
    is_behind: bool,
    /// The axes along which the surface crosses the edge from the first corner.
    is_crossed: [bool; 3],
}

const fn corner_index(x: usize, y: usize, z: usize) -> usize {
    (z * CORNERS + y) * CORNERS + x
}

impl<'a> Corners<'a> {
    fn of(blocks: Layers<'a>, corner: [i32; 3]) -> Self {
        let mut all = Self { blocks: [None; 8], kinds: [0; CORNERS * CORNERS * CORNERS] };
        for (bits, (dz, dy, dx)) in positions(2).enumerate() {
            let Some(block) = blocks.get([corner[0] + dx as i32, corner[1] + dy as i32, corner[2] + dz as i32]) else {
                continue;
            };
            all.blocks[bits] = Some(block);
            let ((distances, weights), least) = (block.sums(), block.least_weights());
            // Of the next block along an axis only its first voxels.
            let range = |next: usize| if next == 0 { 0..SIDE } else { 0..1 };
            for z in range(dz) {
                for y in range(dy) {
                    let to = corner_index(dx * SIDE, y + dy * SIDE, z + dz * SIDE);
                    for x in range(dx) {
                        let at = index(x, y, z);
                        let kind = if distances[at] < 0 { BEHIND } else { IN_FRONT };
                        let is_there = weights[at] > least[at / PART_VOXELS];
                        all.kinds[to + x] = if is_there { kind } else { 0 };
                    }
                }
            }
        }
        all
    }

    /// Visits the cells with corners on both sides of the surface.
    fn for_each_crossed(&self, mut work: impl FnMut(usize, usize, usize)) {
        for z in 0..SIDE {
            for y in 0..SIDE {
                let row = |y: usize, z: usize| &self.kinds[corner_index(0, y, z)..][..CORNERS];
                let (a, b, c, d) = (row(y, z), row(y + 1, z), row(y, z + 1), row(y + 1, z + 1));
                let mut kinds = [0; CORNERS];
                for x in 0..CORNERS {
                    kinds[x] = a[x] | b[x] | c[x] | d[x];
                }
                for x in 0..SIDE {
                    if kinds[x] | kinds[x + 1] == BEHIND | IN_FRONT {
                        work(x, y, z);
                    }
                }
            }
        }
    }

    /// A corner, where it is known.
    fn voxel(&self, [x, y, z]: [usize; 3]) -> Option<Voxel> {
        if self.kinds[corner_index(x, y, z)] == 0 {
            return None;
        }
        let block = self.blocks[(z / SIDE * 2 + y / SIDE) * 2 + x / SIDE]?;
        Some(block.voxel(index(x % SIDE, y % SIDE, z % SIDE)))
    }

    /// The vertex of a cell: the mean of where the surface crosses the edges between corners that are known; none where it crosses none, or
    /// more of them jump: that is noise.
    fn vertex(&self, x: usize, y: usize, z: usize) -> Option<CellVertex> {
        let corner = |bits: usize| self.voxel([x + (bits & 1), y + (bits >> 1 & 1), z + (bits >> 2)]);
        let voxels: [Option<Voxel>; 8] = std::array::from_fn(corner);
        // What is free is free up to the truncation, however far away the surface is that was seen behind it.
        let up_to = |distance: f32| if distance < MIN_TRUNCATION_VOXELS { distance } else { MIN_TRUNCATION_VOXELS };
        let distances = voxels.map(|voxel| voxel.map(|voxel| up_to(voxel.distance)));
        let (mut sum, mut count, mut num_jumps, mut is_crossed) = (Vec3::ZERO, 0.0, 0.0, [false; 3]);
        for [from, to] in EDGES {
            let (Some(a), Some(b)) = (distances[from], distances[to]) else { continue };
            if (a < 0.0) == (b < 0.0) {
                continue;
            }
            if (a - b).abs() > MAX_CHANGE {
                num_jumps += 1.0;
                continue;
            }
            if from == 0 {
                is_crossed[to / 2] = true;
            }
            let place = |bits: usize| Vec3::new((bits & 1) as f32, (bits >> 1 & 1) as f32, (bits >> 2) as f32);
            sum += place(from).lerp(place(to), a / (a - b));
            count += 1.0;
        }
        let known = || voxels.iter().flatten();
        let mean = |value: fn(&Voxel) -> f32| known().map(value).sum::<f32>() / known().count() as f32;
        (count > 0.0 && count >= num_jumps).then(|| CellVertex {
            place: sum / count,
            color: mean_color(known().filter_map(|voxel| voxel.color)),
            weight: mean(|voxel| voxel.weight),
            noisy_views: mean(|voxel| voxel.noisy_views),
            is_rim: num_jumps > 0.0 || known().count() < voxels.len(),
            is_behind: distances[0].is_some_and(|distance| distance < 0.0),
            is_crossed,
        })
    }
}

fn mean_color(colors: impl Iterator<Item = [u8; 3]>) -> Option<[u8; 3]> {
    let (mut sum, mut count) = ([0u32; 3], 0);
    for color in colors {
        for (sum, value) in sum.iter_mut().zip(color) {
            *sum += u32::from(value);
        }
        count += 1;
    }
    (count > 0).then(|| sum.map(|sum| ((sum + count / 2) / count) as u8))
}

impl Extraction {
    fn add_vertices(&mut self, corners: &Corners, block: [i32; 3], voxel_size: f32, variance: f32) {
        let mut vertices = CellVertices { block, first: self.crossings.len() as u32, layers: [0; SIDE] };
        corners.for_each_crossed(|x, y, z| {
            let is_kept = |vertex: &CellVertex| self.has_rims || !vertex.is_rim;
            let Some(vertex) = corners.vertex(x, y, z).filter(is_kept) else { return };
            vertices.layers[z] |= 1 << (SIDE * y + x);
            let axes = vertex.is_crossed.iter().enumerate().map(|(axis, &is_crossed)| u8::from(is_crossed) << axis);
            self.crossings.push(axes.sum::<u8>() | u8::from(vertex.is_behind) << 3);
            let cell = cell_at(block, [x, y, z]);
            // Corners of cells are the centres of voxels.
            let place = Vec3::new(cell[0] as f32, cell[1] as f32, cell[2] as f32) + vertex.place + 0.5;
            self.mesh.positions.push(place * voxel_size);
            // That of the mean of independent views, and what noise they share, which is in each of them.
            let views = 1.0 + (SHARED_ERROR * SHARED_ERROR) as f32 * vertex.noisy_views;
            // At a rim the vertex may lie anywhere in the cell.
            let of_place = if vertex.is_rim { voxel_size * voxel_size / 12.0 } else { 0.0 };
            self.mesh.deviations.push((views * variance / vertex.weight + of_place).sqrt());
            self.mesh.colors.push(vertex.color.unwrap_or([128; 3]));
            self.has_colors |= vertex.color.is_some();
        });
        if vertices.layers != [0; SIDE] {
            self.by_block.insert(block, self.vertices.len() as u32);
            self.vertices.push(vertices);
        }
    }

    /// Two triangles for each edge from the first corner of a cell that the surface crosses, between the four cells around it.
    fn add_triangles(&mut self) {
        let num_crossed: u32 = self.crossings.iter().map(|bits| (bits & 0b111).count_ones()).sum();
        self.mesh.triangles.reserve_exact(2 * num_crossed as usize);
        for block in &self.vertices {
            for (c, at) in (block.first..).zip(block.cells()) {
                let bits = self.crossings[c as usize];
                for axis in (0..3).filter(|axis| bits >> axis & 1 != 0) {
                    let before = |right: bool, up: bool| {
                        let mut cell = cell_at(block.block, at);
                        cell[(axis + 1) % 3] -= i32::from(right);
                        cell[(axis + 2) % 3] -= i32::from(up);
                        self.vertex_of(block, cell)
                    };
                    let around = (before(true, true), before(false, true), before(true, false));
                    if let (Some(a), Some(b), Some(d)) = around {
                        let is_behind = bits >> 3 != 0;
                        add_quad(&mut self.mesh, if is_behind { [a, b, c, d] } else { [d, c, b, a] });
                    }
                }
            }
        }
    }

    /// The vertex of a cell, which may lie in a block at hand.
    fn vertex_of(&self, at_hand: &CellVertices, [x, y, z]: [i32; 3]) -> Option<u32> {
        let side = SIDE as i32;
        let block = [x, y, z].map(|at| at.div_euclid(side));
        let other = || Some(&self.vertices[*self.by_block.get(&block)? as usize]);
        let vertices = if block == at_hand.block { at_hand } else { other()? };
        vertices.number([x, y, z].map(|at| at.rem_euclid(side) as usize))
    }
}

/// A cell of a block, among all.
fn cell_at(block: [i32; 3], [x, y, z]: [usize; 3]) -> [i32; 3] {
    let [at_x, at_y, at_z] = block.map(|at| at * SIDE as i32);
    [at_x + x as i32, at_y + y as i32, at_z + z as i32]
}

/// Two triangles, divided along the shorter diagonal.
fn add_quad(mesh: &mut TriangleMesh, [a, b, c, d]: [u32; 4]) {
    let length = |from: u32, to: u32| mesh.positions[from as usize].distance_squared(mesh.positions[to as usize]);
    let halves = if length(a, c) <= length(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
    mesh.triangles.extend(halves);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_of_a_block_are_numbered_in_the_order_of_z_y_and_x() {
        let is_there = |(z, y, x): (usize, usize, usize)| (5 * x + 3 * y + z) % 7 < 3;
        let mut layers = [0; SIDE];
        positions(SIDE).filter(|&at| is_there(at)).for_each(|(z, y, x)| layers[z] |= 1 << (SIDE * y + x));
        let vertices = CellVertices { block: [0; 3], first: 10, layers };
        let mut next = 10;
        for at in positions(SIDE) {
            let (z, y, x) = at;
            assert_eq!(vertices.number([x, y, z]), is_there(at).then_some(next));
            next += u32::from(is_there(at));
        }
        let cells: Vec<[usize; 3]> = vertices.cells().collect();
        let expected: Vec<[usize; 3]> = positions(SIDE).filter(|&at| is_there(at)).map(|(z, y, x)| [x, y, z]).collect();
        assert_eq!(cells, expected);
    }
}
