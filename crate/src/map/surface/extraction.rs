//! The zero level of the field as triangles: a vertex for each cell that the surface crosses, at the mean of the crossings of its
//! edges, and two triangles for each edge that it crosses (Gibson, "Constrained elastic surface nets", MICCAI 1998).

#![allow(clippy::cast_possible_wrap, reason = "positions within a block are below ten")]

use glam::Vec3;

use super::blocks::{Blocks, KnownBlock, PART_VOXELS, SIDE, VOXELS, Voxel, index, positions};
use crate::geometry::TriangleMesh;
use crate::preprocess::depth_surfels::SHARED_ERROR;

/// Corners along a side of a block's cells: its own and the first of the next block.
const CORNERS: usize = SIDE + 1;
/// A corner that lies behind the surface.
const BEHIND: u8 = 1;
/// A corner in front of it.
const IN_FRONT: u8 = 2;
/// A corner where nothing was measured: another bit, so that the union over a cell tells what it has.
const UNKNOWN: u8 = 4;
/// A distance changes by at most a voxel from one voxel to the next. Where it changes by more than this, it is no surface but the edge
/// between two. To allow for three standard deviations of both in place of this makes of 40 noisy views of a flat 1.6 times as many
/// triangles, three times as far from the truth, for 1.5 % more of it (`cargo measure surface_scores`).
const MAX_CHANGE: f32 = 2.0;
/// No vertex.
const NONE: u32 = u32::MAX;
/// The edges of a cell: corners as bits x, y, z.
const EDGES: [[usize; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/// The vertices of a block's cells.
type CellVertices = Option<Box<[u32; VOXELS]>>;

/// A mesh that grows by the vertices of cells.
#[derive(Default)]
struct Extraction {
    mesh: TriangleMesh,
    has_colors: bool,
    /// By block.
    vertices: Vec<CellVertices>,
    /// Of each vertex its cell, and the corners of that behind the surface, as bits.
    cells: Vec<([i32; 3], u8)>,
}

/// The surface of a field with voxels of this size (m); `variance` is that of a weight of 1 (m^2). Normals are left out.
pub(super) fn extract(blocks: &Blocks, voxel_size: f32, variance: f32) -> TriangleMesh {
    let mut extraction = Extraction::default();
    for state in &blocks.states {
        let corners = Corners::of(blocks, state.corner);
        let vertices = extraction.add_vertices(&corners, state.corner, voxel_size, variance);
        extraction.vertices.push(vertices);
    }
    if !extraction.has_colors {
        extraction.mesh.colors.clear();
    }
    extraction.add_triangles(blocks);
    extraction.mesh
}

/// The corners of a block's cells.
struct Corners<'a> {
    /// The block and the next ones, along x, y and z as bits.
    blocks: [Option<KnownBlock<'a>>; 8],
    /// What each corner is.
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
    /// The corners behind the surface, as bits.
    behind: u8,
}

const fn corner_index(x: usize, y: usize, z: usize) -> usize {
    (z * CORNERS + y) * CORNERS + x
}

impl<'a> Corners<'a> {
    fn of(blocks: &'a Blocks, corner: [i32; 3]) -> Self {
        let mut all = Self { blocks: [None; 8], kinds: [UNKNOWN; CORNERS * CORNERS * CORNERS] };
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
                        all.kinds[to + x] = if is_there { kind } else { UNKNOWN };
                    }
                }
            }
        }
        all
    }

    /// Visits the cells that the surface crosses and whose corners are all known.
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

    /// A corner that is known.
    fn voxel(&self, x: usize, y: usize, z: usize) -> Voxel {
        let block = self.blocks[(z / SIDE * 2 + y / SIDE) * 2 + x / SIDE];
        block.map_or_else(Voxel::default, |block| block.voxel(index(x % SIDE, y % SIDE, z % SIDE)))
    }

    /// The vertex of a cell that the surface crosses; none where the distances change by too much.
    fn vertex(&self, x: usize, y: usize, z: usize) -> Option<CellVertex> {
        let mut voxels = [Voxel::default(); 8];
        let (mut weight, mut noisy_views, mut behind) = (0.0, 0.0, 0);
        for (bits, voxel) in voxels.iter_mut().enumerate() {
            *voxel = self.voxel(x + (bits & 1), y + (bits >> 1 & 1), z + (bits >> 2));
            weight += voxel.weight / 8.0;
            noisy_views += voxel.noisy_views / 8.0;
            behind |= u8::from(voxel.distance < 0.0) << bits;
        }
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for [from, to] in EDGES {
            let (a, b) = (voxels[from].distance, voxels[to].distance);
            if (a < 0.0) == (b < 0.0) {
                continue;
            }
            if (a - b).abs() > MAX_CHANGE {
                return None;
            }
            let place = |bits: usize| Vec3::new((bits & 1) as f32, (bits >> 1 & 1) as f32, (bits >> 2) as f32);
            sum += place(from).lerp(place(to), a / (a - b));
            count += 1.0;
        }
        Some(CellVertex { place: sum / count, color: mean_color(&voxels), weight, noisy_views, behind })
    }
}

fn mean_color(voxels: &[Voxel; 8]) -> Option<[u8; 3]> {
    let (mut sum, mut count) = ([0u32; 3], 0);
    for color in voxels.iter().filter_map(|voxel| voxel.color) {
        for (sum, value) in sum.iter_mut().zip(color) {
            *sum += u32::from(value);
        }
        count += 1;
    }
    (count > 0).then(|| sum.map(|sum| ((sum + count / 2) / count) as u8))
}

impl Extraction {
    fn add_vertices(&mut self, corners: &Corners, block: [i32; 3], voxel_size: f32, variance: f32) -> CellVertices {
        let mut numbers: CellVertices = None;
        corners.for_each_crossed(|x, y, z| {
            let Some(vertex) = corners.vertex(x, y, z) else { return };
            numbers.get_or_insert_with(|| Box::new([NONE; VOXELS]))[index(x, y, z)] = self.cells.len() as u32;
            let cell = [x, y, z].map(|at| at as i32);
            let cell = [0, 1, 2].map(|axis| block[axis] * SIDE as i32 + cell[axis]);
            // Corners of cells are the centres of voxels.
            let place = Vec3::new(cell[0] as f32, cell[1] as f32, cell[2] as f32) + vertex.place + 0.5;
            self.cells.push((cell, vertex.behind));
            self.mesh.positions.push(place * voxel_size);
            // That of the mean of independent views, and what noise they share, which is in each of them.
            let views = 1.0 + (SHARED_ERROR * SHARED_ERROR) as f32 * vertex.noisy_views;
            self.mesh.deviations.push((views * variance / vertex.weight).sqrt());
            self.mesh.colors.push(vertex.color.unwrap_or([128; 3]));
            self.has_colors |= vertex.color.is_some();
        });
        numbers
    }

    /// Two triangles for each edge from the first corner of a cell that the surface crosses, between the four cells around it.
    fn add_triangles(&mut self, blocks: &Blocks) {
        for vertex in 0..self.cells.len() {
            let (cell, behind) = self.cells[vertex];
            for axis in 0..3 {
                let is_behind = behind & 1 == 1;
                if is_behind == (behind >> (1 << axis) & 1 == 1) {
                    continue;
                }
                let before = |right: bool, up: bool| {
                    let mut cell = cell;
                    cell[(axis + 1) % 3] -= i32::from(right);
                    cell[(axis + 2) % 3] -= i32::from(up);
                    self.vertex_of(blocks, cell)
                };
                let around = (before(true, true), before(false, true), before(true, false));
                if let (Some(a), Some(b), Some(d)) = around {
                    let c = vertex as u32;
                    add_quad(&mut self.mesh, if is_behind { [a, b, c, d] } else { [d, c, b, a] });
                }
            }
        }
    }

    fn vertex_of(&self, blocks: &Blocks, [x, y, z]: [i32; 3]) -> Option<u32> {
        let side = SIDE as i32;
        let block = blocks.number([x.div_euclid(side), y.div_euclid(side), z.div_euclid(side)])?;
        let [x, y, z] = [x.rem_euclid(side), y.rem_euclid(side), z.rem_euclid(side)];
        let vertices = self.vertices[block].as_ref()?;
        Some(vertices[index(x as usize, y as usize, z as usize)]).filter(|&vertex| vertex != NONE)
    }
}

/// Two triangles, divided along the shorter diagonal.
fn add_quad(mesh: &mut TriangleMesh, [a, b, c, d]: [u32; 4]) {
    let length = |from: u32, to: u32| mesh.positions[from as usize].distance_squared(mesh.positions[to as usize]);
    let halves = if length(a, c) <= length(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
    mesh.triangles.extend(halves);
}
