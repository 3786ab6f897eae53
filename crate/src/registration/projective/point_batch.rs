//! A batch of points that is projected many times, to score hundreds of pose hypotheses.

use glam::Vec4;
use nalgebra::Vector3;

use super::ProjectiveTarget;
use super::view_transform::{LANES, Transform, dot};
use crate::geometry::Pose3;
use crate::geometry::algebra::single;
use crate::registration::free_space::{FreeSpaceTally, FreeSpaceTest};

/// Points with normals in the memory layout of vector units.
pub struct PointBatch {
    /// x, y and z of [`LANES`] points each; the last ones are padded with NaN, which is never visible.
    points: Vec<[Vec4; 3]>,
    normals: Vec<[f32; 3]>,
}

impl PointBatch {
    /// From points (m) and their unit normals in one frame.
    pub fn new(points: &[Vector3<f64>], normals: &[Vector3<f64>]) -> Self {
        Self { points: points.chunks(LANES).map(in_lanes).collect(), normals: normals.iter().map(single).collect() }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.normals.len()
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.normals.is_empty()
    }
}

/// At most [`LANES`] points; the rest is not a number.
#[inline]
pub(super) fn in_lanes(points: &[Vector3<f64>]) -> [Vec4; 3] {
    let mut lanes = [Vec4::NAN; 3];
    for (lane, point) in points.iter().enumerate().take(LANES) {
        for axis in 0..3 {
            lanes[axis][lane] = point[axis] as f32;
        }
    }
    lanes
}

impl ProjectiveTarget {
    /// The free-space test of all points in their own cells, counted, their frame being at `T_world_points`; the normals of surfaces that agree
    /// differ by no more than an angle of this cosine.
    pub fn tally(
        &self,
        point_batch: &PointBatch,
        T_world_points: &Pose3,
        tolerance: f64,
        min_cosine: f32,
    ) -> FreeSpaceTally {
        let (T_world_points, tolerance) = (Transform::new(T_world_points), tolerance as f32);
        let mut counts = FreeSpaceTally::default();
        for (points, normals) in point_batch.points.iter().zip(point_batch.normals.chunks(LANES)) {
            let moved = T_world_points.act_on_all(points);
            let seen = self.view.T_view_world.act_on_all(&moved);
            let ([u, v], depths) = (self.view.project_all(&seen), seen[2].to_array());
            let moved = moved.map(|axis| axis.to_array());
            for (lane, normal) in normals.iter().enumerate() {
                let depth = depths[lane];
                let Some((column, row)) = self.view.inside(u[lane], v[lane], depth) else { continue };
                let index = self.cells[row * self.view.camera.width + column];
                let piece = &self.pieces[index as usize];
                match piece.classify(index, &moved.map(|axis| axis[lane]), depth, tolerance) {
                    FreeSpaceTest::Agreeing(_) => {
                        let turned = T_world_points.rows.map(|row| dot(&row, normal));
                        counts.agreeing += usize::from(dot(&turned, &piece.normal) > min_cosine);
                    }
                    FreeSpaceTest::InFreeSpace => counts.in_free_space += 1,
                    FreeSpaceTest::Hidden | FreeSpaceTest::Unknown => {}
                }
            }
        }
        counts
    }
}
