//! A target seen from one place: the partner of a point is looked up where the point would be seen.
//!
//! Blais and Levine, "Registering multiview range data to create 3D computer objects", PAMI 17 (1995). Surfaces are drawn
//! into a grid of cells once; from then on a look-up costs a projection and nine comparisons, whatever the map's size.

use nalgebra::Vector3;

use super::target::Target;
use crate::camera::surfel_image::cell_camera;
use crate::camera::{Pinhole, Surfel, SurfelImage};
use crate::geometry::Pose3;
use crate::search::Neighbor;

/// Pieces of surface by the cell that they are seen in from a view.
#[derive(Clone)]
pub struct ProjectiveTarget {
    eye: Eye,
    /// Index into `pieces` by cell, row by row; of the last one where nothing is seen.
    cells: Vec<u32>,
    /// In the order of their cells; after them one that is infinitely far away.
    pieces: Vec<Piece>,
    /// The caller's number of each piece; empty where there are none.
    numbers: Vec<u64>,
}

/// What is seen in a cell, in the world's frame: all that looking needs, side by side in memory. Single precision tells
/// micrometres apart.
#[derive(Clone, Copy)]
struct Piece {
    point: [f32; 3],
    deviation: f32,
    normal: [f32; 3],
    /// From the view along its axis.
    depth: f32,
}

const NOTHING: Piece = Piece { point: [f32::INFINITY; 3], deviation: 0.0, normal: [0.0; 3], depth: f32::INFINITY };
/// Nearer than this (m) nothing is drawn: it would be all there is to see.
const MIN_DEPTH: f32 = 0.05;
/// In front and behind are told apart only beyond this share of the depth, and the tolerance: oblique surfaces change
/// their depth within a cell.
const SIGHT_TOLERANCE: f32 = 0.02;
/// Points that are moved and projected together.
const LANES: usize = 16;

/// What is seen of a point from the view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sight {
    /// The surface at the point's depth, give or take the tolerance.
    Agreeing(Surfel),
    /// A surface behind the point: the view looked through where it lies.
    InFreeSpace,
    /// A surface in front of it: nothing can be said.
    Hidden,
    /// Nothing is known there.
    Unknown,
}

/// As [`Sight`], with the index of what agrees.
#[derive(Clone, Copy)]
enum Look {
    Agreeing(u32),
    InFreeSpace,
    Hidden,
    Unknown,
}

/// A pose in single precision, by the rows of its matrix.
#[derive(Clone, Copy)]
struct Transform {
    rows: [[f32; 3]; 3],
    shift: [f32; 3],
}

impl Transform {
    fn new(T: &Pose3) -> Self {
        let R = T.rotation.to_rotation_matrix().into_inner();
        Self { rows: std::array::from_fn(|row| single(&R.row(row).transpose())), shift: single(&T.translation.vector) }
    }

    #[inline]
    fn act(&self, p: &[f32; 3]) -> [f32; 3] {
        std::array::from_fn(|axis| dot(&self.rows[axis], p) + self.shift[axis])
    }

    /// The same for as many points as vector units like.
    #[inline]
    fn act_on_all(&self, [x, y, z]: &[[f32; LANES]; 3]) -> [[f32; LANES]; 3] {
        std::array::from_fn(|axis| {
            let ([a, b, c], shift) = (self.rows[axis], self.shift[axis]);
            std::array::from_fn(|lane| a * x[lane] + b * y[lane] + c * z[lane] + shift)
        })
    }
}

/// Where a camera stands whose pixels are the cells.
#[derive(Clone, Copy)]
struct Eye {
    camera: Pinhole,
    T_view_world: Transform,
    /// fx, fy, and the optical axis from the outer corner of the first cell.
    intrinsics: [f32; 4],
}

impl Eye {
    fn new(camera: &Pinhole, T_world_view: &Pose3) -> Self {
        let Pinhole { fx, fy, cx, cy, .. } = *camera;
        let intrinsics = [fx, fy, cx + 0.5, cy + 0.5].map(|x| x as f32);
        Self { camera: *camera, T_view_world: Transform::new(&T_world_view.inverse()), intrinsics }
    }

    /// Column and row of the cell that a point in the view's frame is seen in.
    #[inline]
    fn cell(&self, [x, y, z]: &[f32; 3]) -> Option<(usize, usize)> {
        let [fx, fy, cx, cy] = self.intrinsics;
        let away = 1.0 / z;
        self.inside(fx * x * away + cx, fy * y * away + cy, *z)
    }

    /// The same for many points: their columns and rows as fractions.
    #[inline]
    fn project_all(&self, [x, y, z]: &[[f32; LANES]; 3]) -> [[f32; LANES]; 2] {
        let [fx, fy, cx, cy] = self.intrinsics;
        let away: [f32; LANES] = std::array::from_fn(|lane| 1.0 / z[lane]);
        [
            std::array::from_fn(|lane| fx * x[lane] * away[lane] + cx),
            std::array::from_fn(|lane| fy * y[lane] * away[lane] + cy),
        ]
    }

    /// Column and row as whole numbers, where they are in the image and in front of the camera.
    #[inline]
    fn inside(&self, u: f32, v: f32, z: f32) -> Option<(usize, usize)> {
        // Not a number fails all of these.
        if !(z >= MIN_DEPTH && u >= 0.0 && v >= 0.0) {
            return None;
        }
        let (column, row) = (u as usize, v as usize);
        (column < self.camera.width && row < self.camera.height).then_some((column, row))
    }
}

#[inline]
fn dot(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn between(a: &[f32; 3], b: &[f32; 3]) -> [f32; 3] {
    [b[0] - a[0], b[1] - a[1], b[2] - a[2]]
}

#[inline]
fn single(p: &Vector3<f64>) -> [f32; 3] {
    [p.x as f32, p.y as f32, p.z as f32]
}

#[inline]
fn double([x, y, z]: [f32; 3]) -> Vector3<f64> {
    Vector3::new(x.into(), y.into(), z.into())
}

impl Piece {
    /// Of a surface in the view's own frame.
    #[inline]
    fn of_own(surfel: &Surfel) -> Self {
        Self {
            point: single(&surfel.point),
            deviation: surfel.deviation as f32,
            normal: single(&surfel.normal),
            depth: surfel.point.z as f32,
        }
    }

    #[inline]
    fn surfel(&self) -> Surfel {
        Surfel { point: double(self.point), normal: double(self.normal), deviation: self.deviation.into() }
    }

    /// What is seen of a point (world frame) at a depth in the view.
    #[inline]
    fn look(&self, index: u32, point: &[f32; 3], depth: f32, tolerance: f32) -> Look {
        if dot(&self.normal, &between(&self.point, point)).abs() <= tolerance {
            return Look::Agreeing(index);
        }
        // Nothing is in front of an infinite depth less an infinite margin, nor behind.
        let margin = tolerance + SIGHT_TOLERANCE * self.depth;
        if depth < self.depth - margin {
            Look::InFreeSpace
        } else if depth > self.depth + margin {
            Look::Hidden
        } else {
            Look::Unknown
        }
    }
}

impl ProjectiveTarget {
    /// Draws pieces of surface (world frame), each with a number of the caller's, as a camera sees them whose pixels are
    /// the cells, the view being at `T_world_view`. Of those in one cell the nearest is kept; what faces away is not drawn.
    pub fn draw<'a>(surfels: impl Iterator<Item = (u64, &'a Surfel)>, camera: &Pinhole, T_world_view: &Pose3) -> Self {
        let mut drawing = Drawing::new(camera, T_world_view);
        for (number, surfel) in surfels {
            drawing.add_one(number, single(&surfel.point), single(&surfel.normal), surfel.deviation as f32);
        }
        drawing.finish()
    }

    /// A frame as its own camera sees it, in its camera's frame: by its own cells, or by squares of `side` times `side` of
    /// them, of which the nearest is kept. The same as drawing it from there, without projecting anything.
    pub fn of_frame(frame: &SurfelImage, side: usize) -> Self {
        let camera = cell_camera(&frame.camera, side * frame.cell_size);
        let num_cells = camera.width * camera.height;
        let (mut cells, mut pieces) = (Vec::with_capacity(num_cells), Vec::with_capacity(num_cells + 1));
        for row in 0..camera.height {
            for column in 0..camera.width {
                let rows = (row * side..(row + 1) * side).map(|row| row * frame.columns + column * side);
                let seen = rows.flat_map(|first| frame.cells[first..first + side].iter().flatten());
                let nearest = seen.fold(None, |nearest: Option<&Surfel>, surfel| match nearest {
                    Some(nearest) if nearest.point.z as f32 <= surfel.point.z as f32 => Some(nearest),
                    _ => Some(surfel),
                });
                cells.push(nearest.map_or(EMPTY, |_| pieces.len() as u32));
                pieces.extend(nearest.map(Piece::of_own));
            }
        }
        cells.iter_mut().filter(|cell| **cell == EMPTY).for_each(|cell| *cell = pieces.len() as u32);
        let numbers = Vec::new();
        pieces.push(NOTHING);
        Self { eye: Eye::new(&camera, &Pose3::identity()), cells, pieces, numbers }
    }

    /// Of pieces of surface in their cells, row by row, each in a cell of its own, in the view's frame.
    pub(crate) fn from_cells(camera: &Pinhole, pieces: impl ExactSizeIterator<Item = (u32, Surfel)>) -> Self {
        let mut cells = vec![pieces.len() as u32; camera.width * camera.height];
        let mut seen = Vec::with_capacity(pieces.len() + 1);
        for (cell, surfel) in pieces {
            if let Some(index) = cells.get_mut(cell as usize) {
                *index = seen.len() as u32;
            }
            seen.push(Piece::of_own(&surfel));
        }
        seen.push(NOTHING);
        Self { eye: Eye::new(camera, &Pose3::identity()), cells, pieces: seen, numbers: Vec::new() }
    }

    /// The cell of each of [`surfels`](Self::surfels).
    pub(crate) fn cells_of_surfels(&self) -> Vec<u32> {
        let mut cells = vec![0; self.len()];
        for (cell, &index) in (0..).zip(&self.cells) {
            if let Some(own) = cells.get_mut(index as usize) {
                *own = cell;
            }
        }
        cells
    }

    /// Gives back memory that it does not need, to be kept for long.
    pub(crate) fn shrink(&mut self) {
        self.pieces.shrink_to_fit();
        self.numbers.shrink_to_fit();
    }

    /// What it takes on the heap.
    pub(crate) fn num_bytes(&self) -> usize {
        size_of::<u32>() * self.cells.capacity()
            + size_of::<Piece>() * self.pieces.capacity()
            + size_of::<u64>() * self.numbers.capacity()
    }

    /// Number of cells in which something is seen.
    pub fn len(&self) -> usize {
        self.pieces.len() - 1
    }

    /// Whether nothing is seen.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The camera whose pixels are the cells.
    pub fn camera(&self) -> &Pinhole {
        &self.eye.camera
    }

    /// Everything that was drawn and is seen, world frame, row by row of the cells.
    pub fn surfels(&self) -> impl ExactSizeIterator<Item = Surfel> {
        self.pieces[..self.len()].iter().map(Piece::surfel)
    }

    /// The caller's number of a piece of surface; that of its place in the view where it was drawn without.
    pub fn number(&self, index: u32) -> u64 {
        self.numbers.get(index as usize).copied().unwrap_or(index.into())
    }

    /// What is seen of a point (world frame) from the view in its own cell, surfaces `tolerance` (m) off along their
    /// normal agreeing.
    #[inline]
    pub fn look_at(&self, point: &Vector3<f64>, tolerance: f64) -> Sight {
        let point = single(point);
        let seen = self.eye.T_view_world.act(&point);
        let look = |(column, row): (usize, usize)| {
            let index = self.cells[row * self.eye.camera.width + column];
            self.pieces[index as usize].look(index, &point, seen[2], tolerance as f32)
        };
        self.sight(self.eye.cell(&seen).map_or(Look::Unknown, look))
    }

    /// The same with the benefit of the doubt: at the border of an object its own cell and the eight around it see the
    /// object and what is behind. One that agrees is enough, and only where none agrees or hides it the point stands in
    /// free space.
    pub fn look_around(&self, point: &Vector3<f64>, tolerance: f64) -> Sight {
        let (point, tolerance) = (single(point), tolerance as f32);
        let seen = self.eye.T_view_world.act(&point);
        let Some((column, row)) = self.eye.cell(&seen) else { return Sight::Unknown };
        let look = |index: u32| self.pieces[index as usize].look(index, &point, seen[2], tolerance);
        let mut best = look(self.cells[row * self.eye.camera.width + column]);
        if matches!(best, Look::Agreeing(_)) {
            return self.sight(best);
        }
        for cells in self.cells_around(column, row) {
            for &index in &self.cells[cells] {
                match (look(index), &best) {
                    (look @ Look::Agreeing(_), _) => return self.sight(look),
                    (Look::Hidden, Look::InFreeSpace) => best = Look::Hidden,
                    _ => {}
                }
            }
        }
        self.sight(best)
    }

    /// Looks at all points in their own cells, their frame being at `T_world_points`; the normals of surfaces that agree
    /// differ by no more than an angle of this cosine.
    pub fn glance(&self, glances: &Glances, T_world_points: &Pose3, tolerance: f64, min_cosine: f32) -> Glanced {
        let (T_world_points, tolerance) = (Transform::new(T_world_points), tolerance as f32);
        let mut glanced = Glanced::default();
        for (points, normals) in glances.points.iter().zip(glances.normals.chunks(LANES)) {
            let moved = T_world_points.act_on_all(points);
            let seen = self.eye.T_view_world.act_on_all(&moved);
            let [u, v] = self.eye.project_all(&seen);
            for (lane, normal) in normals.iter().enumerate() {
                let depth = seen[2][lane];
                let Some((column, row)) = self.eye.inside(u[lane], v[lane], depth) else { continue };
                let index = self.cells[row * self.eye.camera.width + column];
                let piece = &self.pieces[index as usize];
                match piece.look(index, &moved.map(|axis| axis[lane]), depth, tolerance) {
                    Look::Agreeing(_) => {
                        let turned = T_world_points.rows.map(|row| dot(&row, normal));
                        glanced.agreeing += usize::from(dot(&turned, &piece.normal) > min_cosine);
                    }
                    Look::InFreeSpace => glanced.in_free_space += 1,
                    Look::Hidden | Look::Unknown => {}
                }
            }
        }
        glanced
    }

    #[inline]
    fn sight(&self, look: Look) -> Sight {
        match look {
            Look::Agreeing(index) => Sight::Agreeing(self.pieces[index as usize].surfel()),
            Look::InFreeSpace => Sight::InFreeSpace,
            Look::Hidden => Sight::Hidden,
            Look::Unknown => Sight::Unknown,
        }
    }

    /// A cell and its neighbours, row by row.
    #[inline]
    fn cells_around(&self, column: usize, row: usize) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let (width, height) = (self.eye.camera.width, self.eye.camera.height);
        let (left, right) = (column.saturating_sub(1), (column + 2).min(width));
        (row.saturating_sub(1)..(row + 2).min(height)).map(move |row| row * width + left..row * width + right)
    }
}

impl Target<3> for ProjectiveTarget {
    /// The nearest of the pieces seen in the point's cell and the eight around it.
    fn nearest(&self, query: &Vector3<f64>, max_distance: f64) -> Option<Neighbor> {
        let query = single(query);
        let (column, row) = self.eye.cell(&self.eye.T_view_world.act(&query))?;
        // Distances and indices in one number, the distance first: bits of positive floats are ordered as they are. So the
        // least is found without a branch that could be guessed wrong.
        let ranked = |sq_distance: f32, index: u32| u64::from(sq_distance.to_bits()) << 32 | u64::from(index);
        let limit = ranked((max_distance * max_distance) as f32, 0);
        let mut best = limit;
        for cells in self.cells_around(column, row) {
            for &index in &self.cells[cells] {
                let off = between(&self.pieces[index as usize].point, &query);
                best = best.min(ranked(dot(&off, &off), index));
            }
        }
        (best < limit).then_some(Neighbor { index: best as u32, sq_distance: f32::from_bits((best >> 32) as u32) })
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
    fn deviation(&self, index: u32) -> f64 {
        self.pieces[index as usize].deviation.into()
    }
}

/// Points with normals to be looked at many times, in the order that vector units want.
pub struct Glances {
    /// x, y and z, [`LANES`] of each in a row; what is left over is not a number, which is seen nowhere.
    points: Vec<[[f32; LANES]; 3]>,
    normals: Vec<[f32; 3]>,
}

impl Glances {
    /// From points (m) and their unit normals in one frame.
    pub fn new(points: &[Vector3<f64>], normals: &[Vector3<f64>]) -> Self {
        let in_lanes = |points: &[Vector3<f64>]| {
            let mut lanes = [[f32::NAN; LANES]; 3];
            for (lane, point) in points.iter().enumerate() {
                for (axis, values) in lanes.iter_mut().enumerate() {
                    values[lane] = point[axis] as f32;
                }
            }
            lanes
        };
        Self { points: points.chunks(LANES).map(in_lanes).collect(), normals: normals.iter().map(single).collect() }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.normals.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.normals.is_empty()
    }
}

/// How many of some points agree with what is seen where they are, and how many stand in free space.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Glanced {
    /// On the surface that is seen, and facing as it does.
    pub agreeing: usize,
    /// In front of it.
    pub in_free_space: usize,
}

/// Columns of numbers of pieces of surface, world frame, all of one length.
#[derive(Clone, Copy)]
pub struct Columns<'a> {
    /// x, y and z of the points (m).
    pub points: [&'a [f32]; 3],
    /// x, y and z of the unit normals.
    pub normals: [&'a [f32]; 3],
    /// Standard deviations along the normals (m).
    pub deviations: &'a [f32],
}

/// A view that is being drawn.
pub struct Drawing {
    eye: Eye,
    viewpoint: [f32; 3],
    /// The nearest depth of each cell.
    depths: Vec<f32>,
    /// Index into `pieces` by cell; [`EMPTY`] where nothing is seen.
    cells: Vec<u32>,
    pieces: Vec<Piece>,
    numbers: Vec<u64>,
}

const EMPTY: u32 = u32::MAX;

impl Drawing {
    /// Nothing yet, as seen from `T_world_view` by a camera whose pixels are the cells.
    pub fn new(camera: &Pinhole, T_world_view: &Pose3) -> Self {
        let num_cells = camera.width * camera.height;
        Self {
            eye: Eye::new(camera, T_world_view),
            viewpoint: single(&T_world_view.translation.vector),
            depths: vec![f32::INFINITY; num_cells],
            cells: vec![EMPTY; num_cells],
            pieces: Vec::with_capacity(num_cells / 2),
            numbers: Vec::with_capacity(num_cells / 2),
        }
    }

    /// Draws pieces of surface that have consecutive numbers, from `first` on.
    pub fn add(&mut self, first: u64, columns: Columns<'_>) {
        let Columns { points, normals, deviations } = columns;
        let lanes = |columns: [&[f32]; 3], start: usize| -> Option<[[f32; LANES]; 3]> {
            let [x, y, z] = columns.map(|column| column.get(start..)?.first_chunk::<LANES>().copied());
            Some([x?, y?, z?])
        };
        let mut start = 0;
        while let (Some(p), Some(n)) = (lanes(points, start), lanes(normals, start)) {
            let [x, y, z] = self.viewpoint;
            let facing: [f32; LANES] = std::array::from_fn(|lane| {
                (p[0][lane] - x) * n[0][lane] + (p[1][lane] - y) * n[1][lane] + (p[2][lane] - z) * n[2][lane]
            });
            let seen = self.eye.T_view_world.act_on_all(&p);
            let [u, v] = self.eye.project_all(&seen);
            for lane in 0..LANES {
                let depth = seen[2][lane];
                if facing[lane] < 0.0
                    && let Some(cell) = self.eye.inside(u[lane], v[lane], depth)
                {
                    let index = start + lane;
                    let (point, normal) = (p.map(|axis| axis[lane]), n.map(|axis| axis[lane]));
                    let piece = || Piece { point, deviation: deviations[index], normal, depth };
                    self.put(first + index as u64, cell, depth, piece);
                }
            }
            start += LANES;
        }
        for index in start..deviations.len() {
            let (point, normal) = (points.map(|axis| axis[index]), normals.map(|axis| axis[index]));
            self.add_one(first + index as u64, point, normal, deviations[index]);
        }
    }

    fn add_one(&mut self, number: u64, point: [f32; 3], normal: [f32; 3], deviation: f32) {
        let seen = self.eye.T_view_world.act(&point);
        if dot(&between(&self.viewpoint, &point), &normal) < 0.0
            && let Some(cell) = self.eye.cell(&seen)
        {
            let depth = seen[2];
            self.put(number, cell, depth, || Piece { point, deviation, normal, depth });
        }
    }

    #[inline]
    fn put(&mut self, number: u64, (column, row): (usize, usize), depth: f32, piece: impl FnOnce() -> Piece) {
        let cell = row * self.eye.camera.width + column;
        if depth >= self.depths[cell] {
            return;
        }
        self.depths[cell] = depth;
        if let Some(hidden) = self.pieces.get_mut(self.cells[cell] as usize) {
            *hidden = piece();
            self.numbers[self.cells[cell] as usize] = number;
        } else {
            self.cells[cell] = self.pieces.len() as u32;
            self.pieces.push(piece());
            self.numbers.push(number);
        }
    }

    /// What has come to be seen.
    pub fn finish(self) -> ProjectiveTarget {
        let Self { eye, mut cells, pieces: drawn, numbers: drawn_numbers, .. } = self;
        let (mut pieces, mut numbers) = (Vec::with_capacity(drawn.len() + 1), Vec::with_capacity(drawn.len()));
        // Neighbours are looked at together.
        for cell in &mut cells {
            if *cell == EMPTY {
                *cell = drawn.len() as u32;
            } else {
                let place = *cell as usize;
                *cell = pieces.len() as u32;
                pieces.push(drawn[place]);
                numbers.push(drawn_numbers[place]);
            }
        }
        pieces.push(NOTHING);
        ProjectiveTarget { eye, cells, pieces, numbers }
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
            let known = &pieces[target.number(neighbor.index) as usize];
            assert!((known.point - target.point(neighbor.index)).norm() < 1e-6);
            assert_eq!(target.normal(neighbor.index), Some(-Vector3::z()));
            assert!((target.deviation(neighbor.index) - 0.004).abs() < 1e-9);
            found += 1;
        }
        assert!(found > 300, "{found}");
        assert_eq!(target.nearest(&Vector3::new(0.0, 0.0, -1.0), 10.0), None);
        assert_eq!(target.nearest(&Vector3::new(0.01, 0.0, 1.0), 0.5), None);
        assert_eq!(target.nearest(&Vector3::new(f64::NAN, 0.0, 1.0), 0.5), None);
    }

    #[test]
    fn a_frame_seen_by_its_own_camera_is_as_if_it_had_been_drawn() {
        let camera = Pinhole::new(162, 121, [120.0, 120.0, 79.5, 59.5]).unwrap();
        let cells = cell_camera(&camera, 4);
        let surfel = |cell: usize| {
            let ray = cells.ray((cell % cells.width) as f64, (cell / cells.width) as f64);
            let depth = 2.0 + (cell as f64 * 0.7).sin();
            (cell % 7 != 3).then_some(Surfel { point: ray * depth, normal: -ray.normalize(), deviation: 0.01 })
        };
        let (columns, rows) = (cells.width, cells.height);
        let cells = (0..columns * rows).map(surfel).collect();
        let frame = SurfelImage { camera, cell_size: 4, columns, rows, cells, brightness: None };
        for side in [1, 2] {
            let camera = cell_camera(&frame.camera, side * frame.cell_size);
            let drawn = ProjectiveTarget::draw((0..).zip(frame.surfels()), &camera, &Pose3::identity());
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
        assert!(matches!(target.look_at(&near.point, 0.01), Sight::Agreeing(seen) if seen == near));
        assert!(target.surfels().all(|seen| seen.normal == -Vector3::z()));
        assert_eq!(target.len(), target.surfels().len());
        assert!(!target.is_empty());
    }
}
