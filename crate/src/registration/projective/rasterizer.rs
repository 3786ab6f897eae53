//! Rasterization of surfels into the cells of a view with a depth buffer.

use super::cell_points::CellPoints;
use super::packed_surfel::PackedSurfel;
use super::view_transform::{MIN_DEPTH, Transform, ViewTransform, between, dot};
use super::{NO_SURFEL, Piece, ProjectiveTarget};
use crate::camera::Pinhole;
use crate::geometry::Pose3;
use crate::geometry::algebra::single;
use crate::geometry::scalar::ROUND_BY;

/// A depth buffer that surfels are added to.
///
/// Distant surfaces have many surfels in a cell. So the loop over all surfels only finds the nearest of each cell, without a
/// branch that could be mispredicted; the surfel itself is fetched at the end, once per cell.
pub struct SurfelRasterizer<'a> {
    camera: Pinhole,
    T_world_view: Pose3,
    /// For each cell the depth of the nearest surfel and, in the lower half, its index among all that were added. The bits of
    /// positive floats have the order of the floats, so the minimum is the nearest, and the first of several. One more cell
    /// at the end is for surfels out of view.
    nearest: Vec<u64>,
    batches: Vec<SurfelBatch<'a>>,
    /// The batch of each run of [`STRIDE`] indices.
    batch_of: Vec<u32>,
}

/// Surfels that were added together.
struct SurfelBatch<'a> {
    surfels: &'a [PackedSurfel],
    /// The caller's number of the first.
    first_number: u64,
    /// The index of the first.
    start: usize,
    /// Transform to the world frame, where they are in another.
    moved: Option<Transform>,
}

/// An empty cell.
const NONE: u64 = u64::MAX;
/// Surfels that are projected together.
const RUN: usize = 256;
/// The indices of a batch begin at a multiple of this, so that an index leads to its batch.
const STRIDE: usize = 16;

impl<'a> SurfelRasterizer<'a> {
    /// An empty buffer for the view from `T_world_view` of a camera whose pixels are the cells.
    pub fn new(camera: &Pinhole, T_world_view: &Pose3) -> Self {
        Self {
            camera: *camera,
            T_world_view: *T_world_view,
            nearest: vec![NONE; camera.width * camera.height + 1],
            batches: Vec::new(),
            batch_of: Vec::new(),
        }
    }

    /// Adds surfels in the world frame with consecutive numbers, from `first_number` on.
    pub fn add(&mut self, first_number: u64, surfels: &'a [PackedSurfel]) {
        let T_batch_view = self.T_world_view;
        let start = self.put(surfels, &T_batch_view);
        self.batches.push(SurfelBatch { surfels, first_number, start, moved: None });
    }

    /// The same in a frame of their own.
    pub fn add_moved(&mut self, first_number: u64, surfels: &'a [PackedSurfel], T_world_batch: &Pose3) {
        let start = self.put(surfels, &(T_world_batch.inverse() * self.T_world_view));
        let moved = Some(Transform::new(T_world_batch));
        self.batches.push(SurfelBatch { surfels, first_number, start, moved });
    }

    /// Adds surfels to the depth buffer, the view's pose being given in their frame; returns the index of the first.
    fn put(&mut self, surfels: &[PackedSurfel], T_batch_view: &Pose3) -> usize {
        let start = STRIDE * self.batch_of.len();
        self.batch_of.resize(self.batch_of.len() + surfels.len().div_ceil(STRIDE), self.batches.len() as u32);
        let view = ViewTransform::new(&self.camera, T_batch_view);
        let viewpoint = single(&T_batch_view.translation.vector);
        let (mut cells, mut depths) = ([0; RUN], [0.0; RUN]);
        for (run, first) in surfels.chunks(RUN).zip((start..).step_by(RUN)) {
            look_up(&view, &viewpoint, run, &mut cells, &mut depths);
            for ((&cell, depth), place) in cells.iter().zip(&depths).take(run.len()).zip(first..) {
                let nearest = &mut self.nearest[cell as usize];
                *nearest = (*nearest).min(u64::from(depth.to_bits()) << 32 | place as u64);
            }
        }
        start
    }

    /// The view of the nearest surfel in each cell.
    pub fn finish(self) -> ProjectiveTarget {
        let Pinhole { width, height, .. } = self.camera;
        let nearest = &self.nearest[..width * height];
        let num_seen = nearest.iter().filter(|nearest| **nearest != NONE).count();
        let (mut pieces, mut numbers) = (Vec::with_capacity(num_seen + 1), Vec::with_capacity(num_seen));
        let mut cell_points = CellPoints::new(width, height);
        let mut cells = Vec::with_capacity(nearest.len());
        for (row, nearest) in nearest.chunks_exact(width.max(1)).enumerate() {
            let [xs, ys, zs] = cell_points.row(row);
            for (((&nearest, x), y), z) in nearest.iter().zip(xs).zip(ys).zip(zs) {
                if nearest == NONE {
                    cells.push(num_seen as u32);
                    continue;
                }
                let (depth, place) = (f32::from_bits((nearest >> 32) as u32), nearest as u32 as usize);
                let batch = &self.batches[self.batch_of[place / STRIDE] as usize];
                let index = place - batch.start;
                let piece = batch.piece(index, depth);
                [*x, *y, *z] = piece.point;
                cells.push(pieces.len() as u32);
                pieces.push(piece);
                numbers.push(batch.first_number + index as u64);
            }
        }
        pieces.push(NO_SURFEL);
        let view = ViewTransform::new(&self.camera, &self.T_world_view);
        ProjectiveTarget { view, cells, pieces, numbers, cell_points: Some(cell_points) }
    }
}

impl SurfelBatch<'_> {
    fn piece(&self, index: usize, depth: f32) -> Piece {
        let PackedSurfel { point, sigma, normal, .. } = self.surfels[index];
        match &self.moved {
            None => Piece { point, sigma, normal, depth },
            Some(T) => Piece { point: T.act(&point), sigma, normal: T.turn(&normal), depth },
        }
    }
}

/// The cells that surfels project to, the one behind all cells where they are not visible, and their depths. Written for
/// vector units.
#[expect(clippy::needless_bitwise_bool, reason = "branches could be mispredicted, and prevent vectorization")]
#[inline]
fn look_up(
    view: &ViewTransform,
    viewpoint: &[f32; 3],
    surfels: &[PackedSurfel],
    cells: &mut [u32; RUN],
    depths: &mut [f32; RUN],
) {
    let (width, height) = (view.camera.width, view.camera.height);
    let (last_column, last_row, behind) = (width as f32, height as f32, (width * height) as u32);
    for ((surfel, cell), depth) in surfels.iter().zip(cells).zip(depths) {
        let facing = dot(&between(viewpoint, &surfel.point), &surfel.normal);
        let seen = view.T_view_world.act(&surfel.point);
        let [u, v] = view.project(&seen);
        // Not a number fails all of these.
        let is_seen =
            (facing < 0.0) & (seen[2] >= MIN_DEPTH) & (u >= 0.0) & (v >= 0.0) & (u < last_column) & (v < last_row);
        let inside = floor(v).wrapping_mul(width as u32).wrapping_add(floor(u));
        *cell = if is_seen { inside } else { behind };
        *depth = seen[2];
    }
}

/// The floor of a number from 0 to four million. Without checks for other numbers, this vectorizes.
#[inline]
fn floor(x: f32) -> u32 {
    let nearest = x + ROUND_BY;
    let is_above = u32::from(nearest - ROUND_BY > x);
    nearest.to_bits().wrapping_sub(ROUND_BY.to_bits()).wrapping_sub(is_above)
}

#[cfg(test)]
mod tests {
    use super::floor;

    #[test]
    fn floor_is_exact_up_to_four_million() {
        for whole in [0u32, 1, 2, 63, 64, 255, 1023, 4_000_000] {
            let x = whole as f32;
            assert_eq!(floor(x), whole);
            assert_eq!(floor(x.next_up()), whole);
            assert_eq!(floor(x + 0.5), (x + 0.5) as u32);
            assert!(whole == 0 || floor(x.next_down()) == whole - 1);
        }
    }
}
