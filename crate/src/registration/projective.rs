//! A target seen from one place: the partner of a point is looked up where the point would be seen.
//!
//! Blais and Levine, "Registering multiview range data to create 3D computer objects", PAMI 17 (1995). Surfaces are drawn
//! into a grid of cells once; from then on a look-up costs a projection and nine comparisons, whatever the map's size.

use nalgebra::{Matrix3, Vector3};

use super::target::Target;
use crate::camera::{Pinhole, Surfel};
use crate::geometry::Pose3;
use crate::search::Neighbor;

/// Pieces of surface by the cell that they are seen in from a view.
pub struct ProjectiveTarget {
    camera: Pinhole,
    R_view_world: Matrix3<f64>,
    t_view_world: Vector3<f64>,
    /// Index into `surfels` by cell, row by row; [`EMPTY`] where nothing is seen.
    cells: Vec<u32>,
    surfels: Vec<Surfel>,
    /// Index of each of `surfels` in what was drawn.
    origins: Vec<u32>,
}

const EMPTY: u32 = u32::MAX;
/// Nearer than this (m) nothing is drawn: it would be all there is to see.
const MIN_DEPTH: f64 = 0.05;
/// Surfaces within this share of each other's depth compete by nothing but depth.
const SIGHT_TOLERANCE: f64 = 0.02;

/// What is seen of a point from the view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sight<'a> {
    /// The surface at the point's depth, give or take the tolerance.
    Agreeing(&'a Surfel),
    /// A surface behind the point: the view looked through where it lies.
    InFreeSpace,
    /// A surface in front of it: nothing can be said.
    Hidden,
    /// Nothing is known there.
    Unknown,
}

impl ProjectiveTarget {
    /// Draws pieces of surface (world frame) as a camera sees them whose pixels are the cells, the view being at
    /// `T_world_view`. Of those in one cell the nearest is kept; what faces away is not drawn.
    pub fn draw<'a>(surfels: impl Iterator<Item = &'a Surfel>, camera: &Pinhole, T_world_view: &Pose3) -> Self {
        let T_view_world = T_world_view.inverse();
        let R = T_view_world.rotation.to_rotation_matrix().into_inner();
        let t = T_view_world.translation.vector;
        let mut target = Self {
            camera: *camera,
            R_view_world: R,
            t_view_world: t,
            cells: vec![EMPTY; camera.width * camera.height],
            surfels: Vec::new(),
            origins: Vec::new(),
        };
        let eye = T_world_view.translation.vector;
        let mut depths = vec![f32::INFINITY; target.cells.len()];
        let mut origins = vec![(EMPTY, Vector3::zeros()); 0];
        origins.reserve(target.cells.len());
        let mut owner = vec![EMPTY; target.cells.len()];
        let mut drawn: Vec<&Surfel> = Vec::new();
        for (index, surfel) in surfels.enumerate() {
            if (surfel.point - eye).dot(&surfel.normal) >= 0.0 {
                continue;
            }
            let point = R * surfel.point + t;
            let Some(cell) = target.cell(&point) else { continue };
            if (point.z as f32) < depths[cell] {
                depths[cell] = point.z as f32;
                owner[cell] = drawn.len() as u32;
                drawn.push(surfel);
                origins.push((index as u32, surfel.point));
            }
        }
        for (cell, &owner) in target.cells.iter_mut().zip(&owner) {
            if owner != EMPTY {
                *cell = target.surfels.len() as u32;
                target.surfels.push(*drawn[owner as usize]);
                target.origins.push(origins[owner as usize].0);
            }
        }
        target
    }

    /// The cell that a point in the view's frame is seen in.
    #[inline]
    fn cell(&self, point: &Vector3<f64>) -> Option<usize> {
        if point.z < MIN_DEPTH {
            return None;
        }
        let (u, v) =
            (self.camera.fx * point.x / point.z + self.camera.cx, self.camera.fy * point.y / point.z + self.camera.cy);
        let (column, row) = ((u + 0.5).floor(), (v + 0.5).floor());
        let inside =
            column >= 0.0 && row >= 0.0 && column < self.camera.width as f64 && row < self.camera.height as f64;
        inside.then(|| row as usize * self.camera.width + column as usize)
    }

    /// Number of cells in which something is seen.
    pub fn len(&self) -> usize {
        self.surfels.len()
    }

    /// Whether nothing is seen.
    pub fn is_empty(&self) -> bool {
        self.surfels.is_empty()
    }

    /// What was drawn in some cell, world frame.
    pub fn surfel(&self, index: u32) -> &Surfel {
        &self.surfels[index as usize]
    }

    /// The index that a piece of surface had in what was drawn.
    pub fn origin(&self, index: u32) -> usize {
        self.origins[index as usize] as usize
    }

    /// What is seen of a point (world frame) from the view, surfaces `tolerance` (m) off along their normal agreeing.
    #[inline]
    pub fn look_at(&self, point: &Vector3<f64>, tolerance: f64) -> Sight<'_> {
        let seen = self.R_view_world * point + self.t_view_world;
        let Some(cell) = self.cell(&seen) else { return Sight::Unknown };
        let Some(surfel) = self.surfels.get(self.cells[cell] as usize) else { return Sight::Unknown };
        if surfel.normal.dot(&(point - surfel.point)).abs() <= tolerance {
            return Sight::Agreeing(surfel);
        }
        let depth = self.R_view_world.row(2).transpose().dot(&surfel.point) + self.t_view_world.z;
        let margin = tolerance + SIGHT_TOLERANCE * depth;
        if seen.z < depth - margin {
            Sight::InFreeSpace
        } else if seen.z > depth + margin {
            Sight::Hidden
        } else {
            Sight::Unknown
        }
    }
}

impl Target<3> for ProjectiveTarget {
    /// The nearest of the pieces seen in the point's cell and the eight around it.
    fn nearest(&self, query: &Vector3<f64>, max_distance: f64) -> Option<Neighbor> {
        let cell = self.cell(&(self.R_view_world * query + self.t_view_world))?;
        let width = self.camera.width;
        let (row, column) = (cell / width, cell % width);
        let columns = column.saturating_sub(1)..(column + 2).min(width);
        let mut best = Neighbor { index: EMPTY, sq_distance: (max_distance * max_distance) as f32 };
        for row in row.saturating_sub(1)..(row + 2).min(self.camera.height) {
            for &index in &self.cells[row * width..][columns.clone()] {
                if let Some(surfel) = self.surfels.get(index as usize) {
                    let sq_distance = (surfel.point - query).norm_squared() as f32;
                    if sq_distance < best.sq_distance {
                        best = Neighbor { index, sq_distance };
                    }
                }
            }
        }
        (best.index != EMPTY).then_some(best)
    }

    fn point(&self, index: u32) -> &Vector3<f64> {
        &self.surfels[index as usize].point
    }

    fn normal(&self, index: u32) -> Option<&Vector3<f64>> {
        Some(&self.surfels[index as usize].normal)
    }

    fn deviation(&self, index: u32) -> f64 {
        self.surfels[index as usize].deviation
    }
}
