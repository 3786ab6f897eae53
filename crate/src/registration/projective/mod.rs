//! Projective data association: the correspondence of a point is looked up in the cell that it projects to.
//!
//! Blais and Levine, "Registering multiview range data to create 3D computer objects", PAMI 17 (1995). Surfels are
//! rasterized once; a query then costs a projection and nine comparisons, whatever the size of the map.
//!
//! In: surfels and a view. Out: [`ProjectiveTarget`], a target for ICP that also knows free space.

mod cell_points;
mod packed_surfel;
mod point_batch;
mod rasterizer;
mod view_transform;

pub use packed_surfel::PackedSurfel;
pub use point_batch::PointBatch;
pub use rasterizer::SurfelRasterizer;

use nalgebra::Vector3;

use cell_points::CellPoints;
use point_batch::in_lanes;
use view_transform::{LANES, ViewTransform, between, dot, double};

use super::free_space::FreeSpaceTest;
use super::target::{LastSearch, SurfaceTarget, Target};
use crate::camera::surfel_image::cell_camera;
use crate::camera::{Pinhole, Surfel, SurfelImage};
use crate::geometry::Pose3;
use crate::geometry::algebra::single;
use crate::search::Neighbor;

/// Surfels by the cell that they project to in a view.
#[derive(Clone)]
pub struct ProjectiveTarget {
    view: ViewTransform,
    /// Index into `pieces` by cell, row by row; that of the last one where the cell is empty.
    cells: Vec<u32>,
    /// The surfels in the order of their cells; after them one that is infinitely far away.
    pieces: Vec<Piece>,
    /// The caller's number of each surfel; empty for views without numbers.
    numbers: Vec<u64>,
    /// The points by cell, for views that frames are registered to; keyframes do without them to save memory.
    cell_points: Option<CellPoints>,
}

/// The surfel of a cell, in the world frame, with all data of a query side by side in memory. Single precision resolves
/// micrometres.
#[derive(Clone, Copy)]
struct Piece {
    point: [f32; 3],
    sigma: f32,
    normal: [f32; 3],
    /// Along the view's optical axis (m).
    depth: f32,
}

/// Marks an empty cell.
const EMPTY_CELL: u32 = u32::MAX;
/// The surfel of empty cells: infinitely far away.
const NO_SURFEL: Piece = Piece { point: [f32::INFINITY; 3], sigma: 0.0, normal: [0.0; 3], depth: f32::INFINITY };
/// Beyond the tolerance, a point is in front of or behind a surface only by more than this share of the depth: the depth of
/// oblique surfaces changes within a cell.
const SIGHT_TOLERANCE: f32 = 0.02;

impl Piece {
    /// From a surfel in the view's own frame.
    #[inline]
    fn of_own(surfel: &Surfel) -> Self {
        Self {
            point: single(&surfel.point),
            sigma: surfel.sigma as f32,
            normal: single(&surfel.normal),
            depth: surfel.point.z as f32,
        }
    }

    #[inline]
    fn surfel(&self) -> Surfel {
        Surfel { point: double(self.point), normal: double(self.normal), sigma: self.sigma.into() }
    }

    /// What is seen of a point (world frame) at a depth in the view.
    #[inline]
    fn classify(&self, index: u32, point: &[f32; 3], depth: f32, tolerance: f32) -> FreeSpaceTest<u32> {
        if dot(&self.normal, &between(&self.point, point)).abs() <= tolerance {
            return FreeSpaceTest::Agreeing(index);
        }
        // Nothing is in front of an infinite depth less an infinite margin, nor behind.
        let margin = tolerance + SIGHT_TOLERANCE * self.depth;
        if depth < self.depth - margin {
            FreeSpaceTest::InFreeSpace
        } else if depth > self.depth + margin {
            FreeSpaceTest::Hidden
        } else {
            FreeSpaceTest::Unknown
        }
    }
}

impl ProjectiveTarget {
    /// Rasterizes surfels (world frame), numbered in their order, in the view from `T_world_view` of a camera whose pixels are
    /// the cells. The nearest in each cell is kept; surfels that face away are not visible.
    pub fn draw<'a>(surfels: impl Iterator<Item = &'a Surfel>, camera: &Pinhole, T_world_view: &Pose3) -> Self {
        let surfels: Vec<PackedSurfel> = surfels.map(|surfel| PackedSurfel::new(surfel, 0)).collect();
        let mut rasterizer = SurfelRasterizer::new(camera, T_world_view);
        rasterizer.add(0, &surfels);
        rasterizer.finish()
    }

    /// A frame as its own camera sees it, in its camera's frame: by its own cells, or by squares of `side` times `side` of
    /// them, of which the nearest surfel is kept. The same as rasterizing it from there, without any projection.
    pub fn of_frame(frame: &SurfelImage, side: usize) -> Self {
        let camera = cell_camera(&frame.camera, side * frame.cell_size);
        let num_cells = camera.width * camera.height;
        let (mut cells, mut pieces) = (Vec::with_capacity(num_cells), Vec::with_capacity(num_cells + 1));
        for row in 0..camera.height {
            for column in 0..camera.width {
                let mut nearest: Option<&Surfel> = None;
                for row in row * side..(row + 1) * side {
                    let first = row * frame.columns + column * side;
                    for surfel in frame.cells[first..first + side].iter().flatten() {
                        if nearest.is_none_or(|nearest| nearest.point.z as f32 > surfel.point.z as f32) {
                            nearest = Some(surfel);
                        }
                    }
                }
                cells.push(nearest.map_or(EMPTY_CELL, |_| pieces.len() as u32));
                pieces.extend(nearest.map(Piece::of_own));
            }
        }
        cells.iter_mut().filter(|cell| **cell == EMPTY_CELL).for_each(|cell| *cell = pieces.len() as u32);
        let numbers = Vec::new();
        pieces.push(NO_SURFEL);
        Self { view: ViewTransform::new(&camera, &Pose3::identity()), cells, pieces, numbers, cell_points: None }
    }

    /// The same with its points by cell: for views that frames are registered to.
    #[must_use]
    pub(crate) fn with_cell_points(mut self) -> Self {
        let Pinhole { width, height, .. } = self.view.camera;
        let mut cell_points = CellPoints::new(width, height);
        for (row, cells) in self.cells.chunks_exact(width.max(1)).enumerate() {
            let [xs, ys, zs] = cell_points.row(row);
            for (((&index, x), y), z) in cells.iter().zip(xs).zip(ys).zip(zs) {
                [*x, *y, *z] = self.pieces[index as usize].point;
            }
        }
        self.cell_points = Some(cell_points);
        self
    }

    /// From surfels in the view's frame, each in a cell of its own, whose index (row by row) is its tag.
    pub(crate) fn from_cells(camera: &Pinhole, packed: &[PackedSurfel]) -> Self {
        let mut cells = vec![packed.len() as u32; camera.width * camera.height];
        let mut pieces = Vec::with_capacity(packed.len() + 1);
        for &PackedSurfel { point, sigma, normal, tag } in packed {
            if let Some(index) = cells.get_mut(tag as usize) {
                *index = pieces.len() as u32;
            }
            pieces.push(Piece { point, sigma, normal, depth: point[2] });
        }
        pieces.push(NO_SURFEL);
        Self {
            view: ViewTransform::new(camera, &Pose3::identity()),
            cells,
            pieces,
            numbers: Vec::new(),
            cell_points: None,
        }
    }

    /// Each of [`surfels`](Self::surfels) with its cell as its tag.
    pub(crate) fn packed_surfels(&self) -> Vec<PackedSurfel> {
        let seen = (0..).zip(&self.cells).filter(|(_, index)| (**index as usize) < self.len());
        let packed = |(tag, &index): (u32, &u32)| {
            let Piece { point, sigma, normal, .. } = self.pieces[index as usize];
            PackedSurfel { point, sigma, normal, tag }
        };
        let mut all = Vec::with_capacity(self.len());
        all.extend(seen.map(packed));
        all
    }

    /// Memory on the heap (bytes).
    pub(crate) fn num_bytes(&self) -> usize {
        size_of::<u32>() * self.cells.capacity()
            + size_of::<Piece>() * self.pieces.capacity()
            + size_of::<u64>() * self.numbers.capacity()
            + self.cell_points.as_ref().map_or(0, CellPoints::num_bytes)
    }

    /// Number of cells with a surfel.
    pub fn len(&self) -> usize {
        self.pieces.len() - 1
    }

    /// Whether all cells are empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The camera whose pixels are the cells.
    pub fn camera(&self) -> &Pinhole {
        &self.view.camera
    }

    /// All visible surfels, world frame, row by row of the cells.
    pub fn surfels(&self) -> impl ExactSizeIterator<Item = Surfel> {
        self.pieces[..self.len()].iter().map(Piece::surfel)
    }

    /// The caller's number of a surfel; its index where it has none.
    pub fn number(&self, index: u32) -> u64 {
        self.numbers.get(index as usize).copied().unwrap_or(index.into())
    }

    /// What is seen of a point (world frame) from the view in its own cell, surfaces `tolerance` (m) off along their
    /// normal agreeing.
    #[inline]
    pub fn classify(&self, point: &Vector3<f64>, tolerance: f64) -> FreeSpaceTest<Surfel> {
        let point = single(point);
        let seen = self.view.T_view_world.act(&point);
        let test = |(column, row): (usize, usize)| {
            let index = self.cells[row * self.view.camera.width + column];
            self.pieces[index as usize].classify(index, &point, seen[2], tolerance as f32)
        };
        self.with_surfel(self.view.cell(&seen).map_or(FreeSpaceTest::Unknown, test))
    }

    /// The same with the benefit of the doubt: at the border of an object its own cell and the eight around it see the
    /// object and what is behind. One that agrees is enough, and only where none agrees or hides it the point stands in
    /// free space.
    pub fn classify_leniently(&self, point: &Vector3<f64>, tolerance: f64) -> FreeSpaceTest<Surfel> {
        let (point, tolerance) = (single(point), tolerance as f32);
        let seen = self.view.T_view_world.act(&point);
        let Some((column, row)) = self.view.cell(&seen) else { return FreeSpaceTest::Unknown };
        let test = |index: u32| self.pieces[index as usize].classify(index, &point, seen[2], tolerance);
        let mut best = test(self.cells[row * self.view.camera.width + column]);
        if matches!(best, FreeSpaceTest::Agreeing(_)) {
            return self.with_surfel(best);
        }
        for cells in self.cells_around(column, row) {
            for &index in &self.cells[cells] {
                match (test(index), &best) {
                    (found @ FreeSpaceTest::Agreeing(_), _) => return self.with_surfel(found),
                    (FreeSpaceTest::Hidden, FreeSpaceTest::InFreeSpace) => best = FreeSpaceTest::Hidden,
                    _ => {}
                }
            }
        }
        self.with_surfel(best)
    }

    #[inline]
    fn with_surfel(&self, test: FreeSpaceTest<u32>) -> FreeSpaceTest<Surfel> {
        match test {
            FreeSpaceTest::Agreeing(index) => FreeSpaceTest::Agreeing(self.pieces[index as usize].surfel()),
            FreeSpaceTest::InFreeSpace => FreeSpaceTest::InFreeSpace,
            FreeSpaceTest::Hidden => FreeSpaceTest::Hidden,
            FreeSpaceTest::Unknown => FreeSpaceTest::Unknown,
        }
    }

    /// [`nearest`](Target::nearest) of many points, each within a distance of its own (m): `found` is called with each one's index.
    pub(crate) fn nearest_of_each(
        &self,
        queries: &[Vector3<f64>],
        max_distance: impl Fn(usize) -> f64,
        mut found: impl FnMut(usize, Option<Neighbor>),
    ) {
        for (first, chunk) in (0..).step_by(LANES).zip(queries.chunks(LANES)) {
            let points = in_lanes(chunk);
            let seen = self.view.T_view_world.act_on_all(&points);
            let ([u, v], depths) = (self.view.project_all(&seen), seen[2].to_array());
            let [x, y, z] = points.map(|axis| axis.to_array());
            for lane in 0..chunk.len() {
                let (index, query) = (first + lane, [x[lane], y[lane], z[lane]]);
                let cell = self.view.inside(u[lane], v[lane], depths[lane]);
                let max_distance = max_distance(index);
                let sq_limit = (max_distance * max_distance) as f32;
                found(index, cell.and_then(|cell| self.nearest_around(&query, cell, sq_limit)));
            }
        }
    }

    /// The nearest surfel in a cell and the eight around it, within a limit (squared, m^2).
    #[inline]
    fn nearest_around(&self, query: &[f32; 3], (column, row): (usize, usize), sq_limit: f32) -> Option<Neighbor> {
        if let Some(cell_points) = &self.cell_points {
            let nearest = cell_points.nearest(query, column, row, sq_limit)?;
            let cell = (row + nearest.row - 1) * self.view.camera.width + column + nearest.column - 1;
            return Some(Neighbor { index: self.cells[cell], sq_distance: nearest.sq_distance });
        }
        // Distance and index in one integer, the distance first: the bits of positive floats have the order of the floats. The
        // minimum then needs no branch that could be mispredicted.
        let ranked = |sq_distance: f32, index: u32| u64::from(sq_distance.to_bits()) << 32 | u64::from(index);
        let limit = ranked(sq_limit, 0);
        let mut best = limit;
        for cells in self.cells_around(column, row) {
            for &index in &self.cells[cells] {
                let off = between(&self.pieces[index as usize].point, query);
                best = best.min(ranked(dot(&off, &off), index));
            }
        }
        (best < limit).then_some(Neighbor { index: best as u32, sq_distance: f32::from_bits((best >> 32) as u32) })
    }

    /// A cell and its neighbours, row by row.
    #[inline]
    fn cells_around(&self, column: usize, row: usize) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let (width, height) = (self.view.camera.width, self.view.camera.height);
        let (left, right) = (column.saturating_sub(1), (column + 2).min(width));
        (row.saturating_sub(1)..(row + 2).min(height)).map(move |row| row * width + left..row * width + right)
    }
}

impl SurfaceTarget for ProjectiveTarget {}

impl Target for ProjectiveTarget {
    type Point = Vector3<f64>;

    /// The nearest of the surfels in the point's cell and the eight around it.
    fn nearest(&self, query: &Vector3<f64>, max_distance: f64) -> Option<Neighbor> {
        let query = single(query);
        let cell = self.view.cell(&self.view.T_view_world.act(&query))?;
        self.nearest_around(&query, cell, (max_distance * max_distance) as f32)
    }

    fn nearest_of_all(
        &self,
        queries: &[Vector3<f64>],
        max_distance: f64,
        _last: &mut [LastSearch<Vector3<f64>>],
        found: impl FnMut(usize, Option<Neighbor>),
    ) {
        self.nearest_of_each(queries, |_| max_distance, found);
    }

    #[inline]
    fn point(&self, index: u32) -> Vector3<f64> {
        double(self.pieces[index as usize].point)
    }

    #[inline]
    fn normal(&self, index: u32) -> Option<Vector3<f64>> {
        Some(double(self.pieces[index as usize].normal))
    }

    #[inline]
    fn sigma(&self, index: u32) -> f64 {
        self.pieces[index as usize].sigma.into()
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
            sigma: 0.004,
        };
        let pieces = (-30..=30).flat_map(|i| (-20..=20).map(move |j| piece(i, j))).collect();
        let camera = Pinhole::new(80, 60, [60.0, 60.0, 39.5, 29.5]).unwrap();
        (pieces, camera, <Pose3 as RigidMotion>::exp(&Vector6::new(0.0, 0.1, 0.02, 0.5, 0.1, 0.0)))
    }

    #[test]
    fn the_nearest_surfel_is_that_of_a_brute_force_search() {
        let (pieces, camera, T) = wall();
        let target = ProjectiveTarget::draw(pieces.iter(), &camera, &T);
        let mut found = 0;
        for step in 0..500 {
            let x = f64::from(step);
            let query = Vector3::new(1.2 * (x * 0.37).sin(), 0.8 * (x * 0.73).cos(), 2.0 + 0.02 * (x * 1.1).sin());
            let Some(neighbor) = target.nearest(&query, 0.045) else { continue };
            let truly = pieces.iter().map(|piece| (piece.point - query).norm()).fold(f64::INFINITY, f64::min);
            assert!((f64::from(neighbor.sq_distance).sqrt() - truly).abs() < 1e-6);
            let known = &pieces[target.number(neighbor.index) as usize];
            assert!((known.point - target.point(neighbor.index)).norm() < 1e-6);
            assert_eq!(target.normal(neighbor.index), Some(-Vector3::z()));
            assert!((target.sigma(neighbor.index) - 0.004).abs() < 1e-9);
            found += 1;
        }
        assert!(found > 300, "{found}");
        assert_eq!(target.nearest(&Vector3::new(0.0, 0.0, -1.0), 10.0), None);
        assert_eq!(target.nearest(&Vector3::new(0.01, 0.0, 1.0), 0.5), None);
        assert_eq!(target.nearest(&Vector3::new(f64::NAN, 0.0, 1.0), 0.5), None);
    }

    #[test]
    fn vector_units_find_the_same_as_a_scalar_search() {
        let (pieces, _, T) = wall();
        // The wall reaches beyond the border of a narrow view, and has a piece in every cell of a coarse one.
        for (width, height, focal) in [(80, 60, 60.0), (23, 17, 60.0), (9, 7, 6.0), (1, 1, 1.0)] {
            let middle = [(width as f64 - 1.0) / 2.0, (height as f64 - 1.0) / 2.0];
            let camera = Pinhole::new(width, height, [focal, focal, middle[0], middle[1]]).unwrap();
            let target = ProjectiveTarget::draw(pieces.iter(), &camera, &T);
            let one_by_one = ProjectiveTarget { cell_points: None, ..target.clone() };
            let mut found = 0;
            for step in 0..4000 {
                let x = f64::from(step);
                let query = Vector3::new(1.6 * (x * 0.37).sin(), 1.1 * (x * 0.73).cos(), 2.0 + 0.1 * (x * 1.1).sin());
                for max_distance in [0.02, 0.1, 1.0] {
                    let nearest = target.nearest(&query, max_distance);
                    assert_eq!(nearest, one_by_one.nearest(&query, max_distance));
                    found += usize::from(nearest.is_some());
                }
            }
            assert!(found > 100, "{found} in {width} x {height}");
            assert_eq!(target.nearest(&pieces[0].point, f64::NAN), None);
        }
    }

    #[test]
    fn a_frame_seen_by_its_own_camera_equals_its_rasterization() {
        let camera = Pinhole::new(162, 121, [120.0, 120.0, 79.5, 59.5]).unwrap();
        let cells = cell_camera(&camera, 4);
        let surfel = |cell: usize| {
            let ray = cells.ray((cell % cells.width) as f64, (cell / cells.width) as f64);
            let depth = 2.0 + (cell as f64 * 0.7).sin();
            (cell % 7 != 3).then_some(Surfel { point: ray * depth, normal: -ray.normalize(), sigma: 0.01 })
        };
        let (columns, rows) = (cells.width, cells.height);
        let cells = (0..columns * rows).map(surfel).collect();
        let cells = std::sync::Arc::new(cells);
        let frame = SurfelImage { camera, cell_size: 4, columns, rows, cells, brightness: None };
        for side in [1, 2] {
            let camera = cell_camera(&frame.camera, side * frame.cell_size);
            let drawn = ProjectiveTarget::draw(frame.surfels(), &camera, &Pose3::identity());
            let own = ProjectiveTarget::of_frame(&frame, side);
            assert_eq!((own.len(), own.camera()), (drawn.len(), drawn.camera()));
            assert!(own.len() > 200 && own.surfels().eq(drawn.surfels()));
            assert_eq!(own.cells, drawn.cells);
        }
    }

    #[test]
    fn in_front_is_free_and_behind_is_hidden() {
        let (pieces, _, T) = wall();
        let camera = Pinhole::new(40, 30, [30.0, 30.0, 19.5, 14.5]).unwrap(); // a piece in every cell
        let target = ProjectiveTarget::draw(pieces.iter(), &camera, &T);
        for classify in [ProjectiveTarget::classify, ProjectiveTarget::classify_leniently] {
            let see = |z| classify(&target, &Vector3::new(0.1, 0.2, z), 0.03);
            assert!(matches!(see(2.02), FreeSpaceTest::Agreeing(_)));
            assert_eq!(see(1.5), FreeSpaceTest::InFreeSpace);
            assert_eq!(see(3.0), FreeSpaceTest::Hidden);
            assert_eq!(classify(&target, &Vector3::new(50.0, 0.0, 2.0), 0.03), FreeSpaceTest::Unknown);
        }
    }

    #[test]
    fn the_nearest_of_a_cell_hides_the_others_and_backs_are_not_seen() {
        let (mut pieces, camera, _) = wall();
        let near = Surfel { point: Vector3::new(0.0, 0.0, 1.0), normal: -Vector3::z(), sigma: 0.0 };
        let back = Surfel { point: Vector3::new(0.3, 0.0, 1.0), normal: Vector3::z(), sigma: 0.0 };
        pieces.extend([near, back]);
        let target = ProjectiveTarget::draw(pieces.iter(), &camera, &Pose3::identity());
        assert!(matches!(target.classify(&near.point, 0.01), FreeSpaceTest::Agreeing(seen) if seen == near));
        assert!(target.surfels().all(|seen| seen.normal == -Vector3::z()));
        assert_eq!(target.len(), target.surfels().len());
        assert!(!target.is_empty());
    }
}
