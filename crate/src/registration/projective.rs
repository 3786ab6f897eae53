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
#[derive(Clone)]
pub struct ProjectiveTarget {
    camera: Pinhole,
    R_view_world: Matrix3<f64>,
    t_view_world: Vector3<f64>,
    /// Index into `surfels` by cell, row by row; [`EMPTY`] where nothing is seen.
    cells: Vec<u32>,
    surfels: Vec<Surfel>,
    /// The caller's number of each of `surfels`.
    numbers: Vec<u64>,
}

const EMPTY: u32 = u32::MAX;
/// Nearer than this (m) nothing is drawn: it would be all there is to see.
const MIN_DEPTH: f64 = 0.05;
/// In front and behind are told apart only beyond this share of the depth, and the tolerance: oblique surfaces change
/// their depth within a cell.
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
    /// Draws pieces of surface (world frame), each with a number of the caller's, as a camera sees them whose pixels are
    /// the cells, the view being at `T_world_view`. Of those in one cell the nearest is kept; what faces away is not drawn.
    pub fn draw<'a>(surfels: impl Iterator<Item = (u64, &'a Surfel)>, camera: &Pinhole, T_world_view: &Pose3) -> Self {
        let T_view_world = T_world_view.inverse();
        let (R, t) = (T_view_world.rotation.to_rotation_matrix().into_inner(), T_view_world.translation.vector);
        let mut target = Self {
            camera: *camera,
            R_view_world: R,
            t_view_world: t,
            cells: vec![EMPTY; camera.width * camera.height],
            surfels: Vec::new(),
            numbers: Vec::new(),
        };
        let eye = T_world_view.translation.vector;
        let mut depths = vec![f32::INFINITY; target.cells.len()];
        for (number, surfel) in surfels {
            if (surfel.point - eye).dot(&surfel.normal) >= 0.0 {
                continue;
            }
            let point = R * surfel.point + t;
            let Some(cell) = target.cell(&point) else { continue };
            let depth = point.z as f32;
            if depth >= depths[cell] {
                continue;
            }
            depths[cell] = depth;
            if let Some(hidden) = target.surfels.get_mut(target.cells[cell] as usize) {
                *hidden = *surfel;
                target.numbers[target.cells[cell] as usize] = number;
            } else {
                target.cells[cell] = target.surfels.len() as u32;
                target.surfels.push(*surfel);
                target.numbers.push(number);
            }
        }
        target
    }

    /// Of pieces of surface in their cells (row by row), each in a cell of its own, in the view's frame. They are numbered
    /// in their order.
    pub(crate) fn from_cells(camera: &Pinhole, pieces: impl ExactSizeIterator<Item = (u32, Surfel)>) -> Self {
        let mut target = Self::draw(std::iter::empty(), camera, &Pose3::identity());
        target.numbers = (0..pieces.len() as u64).collect();
        target.surfels.reserve_exact(pieces.len());
        for (cell, surfel) in pieces {
            if let Some(index) = target.cells.get_mut(cell as usize) {
                *index = target.surfels.len() as u32;
            }
            target.surfels.push(surfel);
        }
        target
    }

    /// The cell of each of [`surfels`](Self::surfels).
    pub(crate) fn cells_of_surfels(&self) -> Vec<u32> {
        let mut cells = vec![0; self.surfels.len()];
        for (cell, &index) in (0..).zip(&self.cells) {
            if let Some(own) = cells.get_mut(index as usize) {
                *own = cell;
            }
        }
        cells
    }

    /// Gives back memory that it does not need, to be kept for long.
    pub(crate) fn shrink(&mut self) {
        self.surfels.shrink_to_fit();
        self.numbers.shrink_to_fit();
    }

    /// What it takes on the heap.
    pub(crate) fn num_bytes(&self) -> usize {
        size_of::<u32>() * self.cells.capacity()
            + size_of::<Surfel>() * self.surfels.capacity()
            + size_of::<u64>() * self.numbers.capacity()
    }

    /// The cell that a point in the view's frame is seen in.
    #[inline]
    fn cell(&self, point: &Vector3<f64>) -> Option<usize> {
        if point.z < MIN_DEPTH {
            return None;
        }
        let (u, v) =
            (self.camera.fx * point.x / point.z + self.camera.cx, self.camera.fy * point.y / point.z + self.camera.cy);
        // A cast cuts off towards zero and saturates: what is left of or above the image must be told apart first.
        if u < -0.5 || v < -0.5 {
            return None;
        }
        let (column, row) = ((u + 0.5) as usize, (v + 0.5) as usize);
        (column < self.camera.width && row < self.camera.height).then(|| row * self.camera.width + column)
    }

    /// Number of cells in which something is seen.
    pub fn len(&self) -> usize {
        self.surfels.len()
    }

    /// Whether nothing is seen.
    pub fn is_empty(&self) -> bool {
        self.surfels.is_empty()
    }

    /// The camera whose pixels are the cells.
    pub fn camera(&self) -> &Pinhole {
        &self.camera
    }

    /// Everything that was drawn and is seen, world frame.
    pub fn surfels(&self) -> &[Surfel] {
        &self.surfels
    }

    /// The caller's number of a piece of surface.
    pub fn number(&self, index: u32) -> u64 {
        self.numbers[index as usize]
    }

    /// What is seen of a point (world frame) from the view in its own cell, surfaces `tolerance` (m) off along their
    /// normal agreeing.
    #[inline]
    pub fn look_at(&self, point: &Vector3<f64>, tolerance: f64) -> Sight<'_> {
        let seen = self.R_view_world * point + self.t_view_world;
        self.cell(&seen).map_or(Sight::Unknown, |cell| self.sight(cell, point, &seen, tolerance))
    }

    /// The same with the benefit of the doubt: at the border of an object its own cell and the eight around it see the
    /// object and what is behind. One that agrees is enough, and only where none agrees or hides it the point stands in
    /// free space.
    pub fn look_around(&self, point: &Vector3<f64>, tolerance: f64) -> Sight<'_> {
        let seen = self.R_view_world * point + self.t_view_world;
        let Some(cell) = self.cell(&seen) else { return Sight::Unknown };
        let mut best = self.sight(cell, point, &seen, tolerance);
        for cell in self.cells_around(cell).flatten() {
            match (self.sight(cell, point, &seen, tolerance), best) {
                (_, Sight::Agreeing(_)) => return best,
                (sight @ Sight::Agreeing(_), _) | (sight @ Sight::Hidden, Sight::InFreeSpace) => best = sight,
                _ => {}
            }
        }
        best
    }

    /// The cell and its neighbours, row by row.
    fn cells_around(&self, cell: usize) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let (width, height) = (self.camera.width, self.camera.height);
        let (row, column) = (cell / width, cell % width);
        let (left, right) = (column.saturating_sub(1), (column + 2).min(width));
        (row.saturating_sub(1)..(row + 2).min(height)).map(move |row| row * width + left..row * width + right)
    }

    #[inline]
    fn sight(&self, cell: usize, point: &Vector3<f64>, seen: &Vector3<f64>, tolerance: f64) -> Sight<'_> {
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
        let mut best = Neighbor { index: EMPTY, sq_distance: (max_distance * max_distance) as f32 };
        for cells in self.cells_around(cell) {
            for &index in &self.cells[cells] {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::RigidMotion;
    use nalgebra::Vector6;

    /// A wall 2 m ahead in pieces 5 cm apart, as seen from a place half a metre aside and turned a little.
    fn wall() -> (Vec<Surfel>, Pinhole, Pose3) {
        let piece = |i: i32, j: i32| Surfel {
            point: Vector3::new(0.05 * f64::from(i), 0.05 * f64::from(j), 2.0),
            normal: -Vector3::z(),
            deviation: 0.004,
        };
        let pieces = (-30..=30).flat_map(|i| (-20..=20).map(move |j| piece(i, j))).collect();
        let camera = Pinhole::new(80, 60, [60.0, 60.0, 39.5, 29.5]).unwrap();
        (pieces, camera, <Pose3 as RigidMotion<3, 6>>::exp(&Vector6::new(0.0, 0.1, 0.02, 0.5, 0.1, 0.0)))
    }

    #[test]
    fn the_nearest_is_the_nearest_by_brute_force() {
        let (pieces, camera, T) = wall();
        let target = ProjectiveTarget::draw((0..).zip(&pieces), &camera, &T);
        let mut found = 0;
        for step in 0..500 {
            let x = f64::from(step);
            let query = Vector3::new(1.2 * (x * 0.37).sin(), 0.8 * (x * 0.73).cos(), 2.0 + 0.02 * (x * 1.1).sin());
            let Some(neighbor) = target.nearest(&query, 0.045) else { continue };
            let truly = pieces.iter().map(|piece| (piece.point - query).norm()).fold(f64::INFINITY, f64::min);
            assert!((f64::from(neighbor.sq_distance).sqrt() - truly).abs() < 1e-6);
            assert_eq!(pieces[target.number(neighbor.index) as usize].point, *target.point(neighbor.index));
            assert_eq!(target.normal(neighbor.index), Some(&-Vector3::z()));
            assert_eq!(target.deviation(neighbor.index), 0.004);
            found += 1;
        }
        assert!(found > 300, "{found}");
        assert_eq!(target.nearest(&Vector3::new(0.0, 0.0, -1.0), 10.0), None);
        assert_eq!(target.nearest(&Vector3::new(0.01, 0.0, 1.0), 0.5), None);
        assert_eq!(target.nearest(&Vector3::new(f64::NAN, 0.0, 1.0), 0.5), None);
    }

    #[test]
    fn in_front_is_free_and_behind_is_hidden() {
        let (pieces, _, T) = wall();
        let camera = Pinhole::new(40, 30, [30.0, 30.0, 19.5, 14.5]).unwrap(); // a piece in every cell
        let target = ProjectiveTarget::draw((0..).zip(&pieces), &camera, &T);
        for look in [ProjectiveTarget::look_at, ProjectiveTarget::look_around] {
            let see = |z| look(&target, &Vector3::new(0.1, 0.2, z), 0.03);
            assert!(matches!(see(2.02), Sight::Agreeing(_)));
            assert_eq!(see(1.5), Sight::InFreeSpace);
            assert_eq!(see(3.0), Sight::Hidden);
            assert_eq!(look(&target, &Vector3::new(50.0, 0.0, 2.0), 0.03), Sight::Unknown);
        }
    }

    #[test]
    fn the_nearest_of_a_cell_hides_the_others_and_backs_are_not_seen() {
        let (mut pieces, camera, _) = wall();
        let near = Surfel { point: Vector3::new(0.0, 0.0, 1.0), normal: -Vector3::z(), deviation: 0.0 };
        let back = Surfel { point: Vector3::new(0.3, 0.0, 1.0), normal: Vector3::z(), deviation: 0.0 };
        pieces.extend([near, back]);
        let target = ProjectiveTarget::draw((0..).zip(&pieces), &camera, &Pose3::identity());
        assert!(matches!(target.look_at(&near.point, 0.01), Sight::Agreeing(seen) if *seen == near));
        assert!(target.surfels().iter().all(|seen| seen.normal == -Vector3::z()));
        assert_eq!(target.len(), target.surfels().len());
        assert!(!target.is_empty());
    }
}
