//! The zero level of the field as triangles: a vertex for each cell that the surface crosses, at the mean of the crossings of its
//! edges, and two triangles for each edge that it crosses (Gibson, "Constrained elastic surface nets", MICCAI 1998).

#![allow(clippy::cast_possible_wrap, reason = "positions within a block are below ten")]

use glam::Vec3;

use super::blocks::{Blocks, SIDE, VOXELS, Voxel, index, positions};
use crate::geometry::TriangleMesh;

/// Corners along a side of a block's cells: its own and the first of the next block.
const CORNERS: usize = SIDE + 1;
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

/// The surface of a field with voxels of this size (m); `variance` is that of a weight of 1 (m^2). Normals are left out.
pub(super) fn extract(blocks: &Blocks, voxel_size: f32, variance: f32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    let mut has_colors = false;
    let mut vertices: Vec<CellVertices> = Vec::with_capacity(blocks.len());
    for number in 0..blocks.len() {
        let corners = Corners::of(blocks, number);
        let mut numbers: CellVertices = None;
        for (z, y, x) in positions(SIDE) {
            let Some(vertex) = corners.vertex(x, y, z) else { continue };
            numbers.get_or_insert_with(|| Box::new([NONE; VOXELS]))[index(x, y, z)] = mesh.positions.len() as u32;
            let corner = Vec3::from(blocks.get(number).corner.map(|at| at as f32 * SIDE as f32));
            // Corners of cells are the centres of voxels.
            let place = corner + Vec3::new(x as f32, y as f32, z as f32) + vertex.place + 0.5;
            mesh.positions.push(place * voxel_size);
            mesh.deviations.push((variance / vertex.weight).sqrt());
            mesh.colors.push(vertex.color.unwrap_or([128; 3]));
            has_colors |= vertex.color.is_some();
        }
        vertices.push(numbers);
    }
    if !has_colors {
        mesh.colors.clear();
    }
    for number in 0..blocks.len() {
        add_triangles(blocks, number, &vertices, &mut mesh);
    }
    mesh
}

/// The voxels at the corners of a block's cells, as far as something was measured there.
struct Corners([Option<Voxel>; CORNERS * CORNERS * CORNERS]);

/// A vertex of a cell.
struct CellVertex {
    /// From the cell's first corner (voxels).
    place: Vec3,
    color: Option<[u8; 3]>,
    /// Mean of the corners'.
    weight: f32,
}

const fn corner_index(x: usize, y: usize, z: usize) -> usize {
    (z * CORNERS + y) * CORNERS + x
}

impl Corners {
    fn of(blocks: &Blocks, number: usize) -> Self {
        let corner = blocks.get(number).corner;
        let mut all = [None; CORNERS * CORNERS * CORNERS];
        for (dz, dy, dx) in positions(2) {
            let at = [corner[0] + dx as i32, corner[1] + dy as i32, corner[2] + dz as i32];
            let Some(other) = blocks.number(at) else { continue };
            let other = blocks.get(other);
            // Of the next block along an axis only its first voxels.
            let range = |next: usize| if next == 0 { 0..SIDE } else { 0..1 };
            for z in range(dz) {
                for y in range(dy) {
                    for x in range(dx) {
                        all[corner_index(x + dx * SIDE, y + dy * SIDE, z + dz * SIDE)] = other.voxel(x, y, z);
                    }
                }
            }
        }
        Self(all)
    }

    /// The vertex of the cell at this corner; `None` where the surface does not cross it or a corner was not measured.
    fn vertex(&self, x: usize, y: usize, z: usize) -> Option<CellVertex> {
        let mut voxels = [Voxel::default(); 8];
        for (bits, voxel) in voxels.iter_mut().enumerate() {
            *voxel = self.0[corner_index(x + (bits & 1), y + (bits >> 1 & 1), z + (bits >> 2))]?;
        }
        let distances = voxels.map(|voxel| voxel.distance);
        let num_behind = distances.iter().filter(|distance| **distance < 0.0).count();
        if num_behind == 0 || num_behind == 8 {
            return None;
        }
        let (mut sum, mut count) = (Vec3::ZERO, 0.0);
        for [from, to] in EDGES {
            let (a, b) = (distances[from], distances[to]);
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
        let weight = voxels.iter().map(|voxel| voxel.weight).sum::<f32>() / 8.0;
        Some(CellVertex { place: sum / count, color: mean_color(&voxels), weight })
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

/// Two triangles for each edge from a voxel of the block to the next that the surface crosses, between the four cells around it.
fn add_triangles(blocks: &Blocks, number: usize, vertices: &[CellVertices], mesh: &mut TriangleMesh) {
    let corner = blocks.get(number).corner;
    let vertex_at = |cell: [i32; 3]| -> Option<u32> {
        let block = std::array::from_fn(|axis| corner[axis] + cell[axis].div_euclid(SIDE as i32));
        let [x, y, z] = cell.map(|at| at.rem_euclid(SIDE as i32) as usize);
        let own = if block == corner { number } else { blocks.number(block)? };
        Some(vertices[own].as_ref()?[index(x, y, z)]).filter(|&vertex| vertex != NONE)
    };
    let corners = Corners::of(blocks, number);
    for (z, y, x) in positions(SIDE) {
        let Some(here) = corners.0[corner_index(x, y, z)] else { continue };
        for axis in 0..3 {
            let mut next = [x, y, z];
            next[axis] += 1;
            let Some(there) = corners.0[corner_index(next[0], next[1], next[2])] else { continue };
            let is_behind = here.distance < 0.0;
            if is_behind == (there.distance < 0.0) {
                continue;
            }
            let (right, up) = ((axis + 1) % 3, (axis + 2) % 3);
            let around = [[-1, -1], [0, -1], [0, 0], [-1, 0]].map(|[along_right, along_up]| {
                let mut cell = [x as i32, y as i32, z as i32];
                cell[right] += along_right;
                cell[up] += along_up;
                vertex_at(cell)
            });
            if let [Some(a), Some(b), Some(c), Some(d)] = around {
                add_quad(mesh, if is_behind { [a, b, c, d] } else { [d, c, b, a] });
            }
        }
    }
}

/// Two triangles, divided along the shorter diagonal.
fn add_quad(mesh: &mut TriangleMesh, [a, b, c, d]: [u32; 4]) {
    let length = |from: u32, to: u32| mesh.positions[from as usize].distance_squared(mesh.positions[to as usize]);
    let halves = if length(a, c) <= length(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
    mesh.triangles.extend(halves);
}
