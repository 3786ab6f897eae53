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
    /// What is seen in each cell, row by row.
    cells: Vec<Cell>,
    /// In the order of their cells.
    surfels: Vec<Surfel>,
    /// The caller's number of each of `surfels`.
    numbers: Vec<u64>,
}

/// The piece of surface that is seen in a cell, in the view's frame: what looking needs, side by side in memory. Single
/// precision tells micrometres apart.
#[derive(Clone, Copy)]
struct Cell {
    /// At infinity where nothing is seen.
    point: [f32; 3],
    /// Index into the surfels; [`EMPTY`] where nothing is seen.
    index: u32,
    normal: [f32; 3],
}

const EMPTY: u32 = u32::MAX;
const NOTHING: Cell = Cell { point: [f32::INFINITY; 3], index: EMPTY, normal: [0.0; 3] };
/// Nearer than this (m) nothing is drawn: it would be all there is to see.
const MIN_DEPTH: f64 = 0.05;
/// In front and behind are told apart only beyond this share of the depth, and the tolerance: oblique surfaces change
/// their depth within a cell.
const SIGHT_TOLERANCE: f32 = 0.02;

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

/// Points with normals to be looked at many times, in single precision and in the order that vector units want.
pub struct Glances {
    /// x, y and z, [`LANES`] of each in a row; what is left over is not a number, which is seen nowhere.
    points: Vec<[[f32; LANES]; 3]>,
    normals: Vec<[f32; 3]>,
}

/// Points that are moved and projected together.
const LANES: usize = 16;

impl Glances {
    /// From points (m) and their unit normals in one frame.
    pub fn new(points: &[Vector3<f64>], normals: &[Vector3<f64>]) -> Self {
        let transposed = |points: &[Vector3<f64>]| {
            let mut lanes = [[f32::NAN; LANES]; 3];
            for (lane, point) in points.iter().enumerate() {
                for (axis, values) in lanes.iter_mut().enumerate() {
                    values[lane] = point[axis] as f32;
                }
            }
            lanes
        };
        Self { points: points.chunks(LANES).map(transposed).collect(), normals: normals.iter().map(single).collect() }
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

#[inline]
fn dot(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn single(p: &Vector3<f64>) -> [f32; 3] {
    [p.x as f32, p.y as f32, p.z as f32]
}

/// As [`Sight`], for points whose partner is not asked for.
enum Look {
    Agreeing(u32),
    InFreeSpace,
    Hidden,
    Unknown,
}

impl ProjectiveTarget {
    /// Draws pieces of surface (world frame), each with a number of the caller's, as a camera sees them whose pixels are
    /// the cells, the view being at `T_world_view`. Of those in one cell the nearest is kept; what faces away is not drawn.
    pub fn draw<'a>(surfels: impl Iterator<Item = (u64, &'a Surfel)>, camera: &Pinhole, T_world_view: &Pose3) -> Self {
        let surfels: Vec<(u64, &Surfel)> = surfels.collect();
        let mut drawing = Drawing::new(camera, T_world_view);
        for (place, (_, surfel)) in (0..).zip(&surfels) {
            drawing.add_one(place, &single(&surfel.point), &single(&surfel.normal));
        }
        drawing.finish(|place| surfels[place as usize])
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

    /// Everything that was drawn and is seen, world frame, row by row of the cells.
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
        let look = |cell: usize| self.cells[cell].look(&single(&seen), tolerance as f32);
        self.sight(self.cell(&seen).map_or(Look::Unknown, look))
    }

    /// The same with the benefit of the doubt: at the border of an object its own cell and the eight around it see the
    /// object and what is behind. One that agrees is enough, and only where none agrees or hides it the point stands in
    /// free space.
    pub fn look_around(&self, point: &Vector3<f64>, tolerance: f64) -> Sight<'_> {
        let seen = self.R_view_world * point + self.t_view_world;
        let Some(cell) = self.cell(&seen) else { return Sight::Unknown };
        let (seen, tolerance) = (single(&seen), tolerance as f32);
        let mut best = self.cells[cell].look(&seen, tolerance);
        if matches!(best, Look::Agreeing(_)) {
            return self.sight(best);
        }
        for cells in self.cells_around(cell) {
            for cell in &self.cells[cells] {
                match (cell.look(&seen, tolerance), &best) {
                    (look @ Look::Agreeing(_), _) => return self.sight(look),
                    (Look::Hidden, Look::InFreeSpace) => best = Look::Hidden,
                    _ => {}
                }
            }
        }
        self.sight(best)
    }

    /// Looks at all points in their own cells, their frame being at `T_world_points`; the normals of surfaces that agree
    /// differ by no more than an angle of this cosine. As [`look_at`](Self::look_at), in single precision.
    pub fn glance(&self, glances: &Glances, T_world_points: &Pose3, tolerance: f64, min_cosine: f32) -> Glanced {
        let R = T_world_points.rotation.to_rotation_matrix().into_inner();
        let t = self.R_view_world * T_world_points.translation.vector + self.t_view_world;
        let (R, t, tolerance) = ((self.R_view_world * R).transpose(), single(&t), tolerance as f32);
        let rows: [[f32; 3]; 3] = std::array::from_fn(|row| single(&R.column(row).into_owned()));
        let Pinhole { fx, fy, cx, cy, .. } = self.camera;
        let [fx, fy, cx, cy] = [fx, fy, cx + 0.5, cy + 0.5].map(|x| x as f32);
        let (width, height) = (self.camera.width as f32, self.camera.height as f32);
        let mut glanced = Glanced::default();
        for ([x, y, z], normals) in glances.points.iter().zip(glances.normals.chunks(LANES)) {
            let moved: [[f32; LANES]; 3] = std::array::from_fn(|axis| {
                let ([a, b, c], shift) = (rows[axis], t[axis]);
                std::array::from_fn(|lane| a * x[lane] + b * y[lane] + c * z[lane] + shift)
            });
            let u: [f32; LANES] = std::array::from_fn(|lane| fx * moved[0][lane] / moved[2][lane] + cx);
            let v: [f32; LANES] = std::array::from_fn(|lane| fy * moved[1][lane] / moved[2][lane] + cy);
            for (lane, normal) in normals.iter().enumerate() {
                let (u, v, seen) = (u[lane], v[lane], [moved[0][lane], moved[1][lane], moved[2][lane]]);
                if !(seen[2] >= MIN_DEPTH as f32 && u >= 0.0 && v >= 0.0 && u < width && v < height) {
                    continue;
                }
                let cell = &self.cells[v as usize * self.camera.width + u as usize];
                match cell.look(&seen, tolerance) {
                    Look::Agreeing(_) => {
                        let turned = rows.map(|row| dot(&row, normal));
                        glanced.agreeing += usize::from(dot(&turned, &cell.normal) > min_cosine);
                    }
                    Look::InFreeSpace => glanced.in_free_space += 1,
                    Look::Hidden | Look::Unknown => {}
                }
            }
        }
        glanced
    }

    #[inline]
    fn sight(&self, look: Look) -> Sight<'_> {
        match look {
            Look::Agreeing(index) => Sight::Agreeing(&self.surfels[index as usize]),
            Look::InFreeSpace => Sight::InFreeSpace,
            Look::Hidden => Sight::Hidden,
            Look::Unknown => Sight::Unknown,
        }
    }

    /// The cell and its neighbours, row by row.
    #[inline]
    fn cells_around(&self, cell: usize) -> impl Iterator<Item = std::ops::Range<usize>> + use<> {
        let (width, height) = (self.camera.width, self.camera.height);
        let (row, column) = (cell / width, cell % width);
        let (left, right) = (column.saturating_sub(1), (column + 2).min(width));
        (row.saturating_sub(1)..(row + 2).min(height)).map(move |row| row * width + left..row * width + right)
    }
}

/// Columns of numbers of pieces of surface, world frame: points (m) and unit normals by axis, all of one length.
#[derive(Clone, Copy)]
pub struct Columns<'a> {
    /// x, y and z of the points.
    pub points: [&'a [f32]; 3],
    /// x, y and z of the normals.
    pub normals: [&'a [f32]; 3],
}

/// A view that is being drawn.
pub struct Drawing {
    camera: Pinhole,
    R_view_world: Matrix3<f64>,
    t_view_world: Vector3<f64>,
    /// The same in single precision, by rows.
    rows: [[f32; 3]; 3],
    shift: [f32; 3],
    eye: [f32; 3],
    cells: Vec<Cell>,
    /// What is seen in each cell, by a number of the caller's; `u64::MAX` where nothing is.
    numbers: Vec<u64>,
}

impl Drawing {
    /// Nothing yet, as seen from `T_world_view` by a camera whose pixels are the cells.
    pub fn new(camera: &Pinhole, T_world_view: &Pose3) -> Self {
        let T_view_world = T_world_view.inverse();
        let (R, t) = (T_view_world.rotation.to_rotation_matrix().into_inner(), T_view_world.translation.vector);
        let num_cells = camera.width * camera.height;
        Self {
            camera: *camera,
            R_view_world: R,
            t_view_world: t,
            rows: std::array::from_fn(|row| single(&R.row(row).transpose())),
            shift: single(&t),
            eye: single(&T_world_view.translation.vector),
            cells: vec![NOTHING; num_cells],
            numbers: vec![u64::MAX; num_cells],
        }
    }

    /// Draws pieces of surface that have consecutive numbers, from `first` on.
    pub fn add(&mut self, first: u64, Columns { points, normals }: Columns<'_>) {
        let lanes = |columns: [&'_ [f32]; 3], start: usize| -> Option<[[f32; LANES]; 3]> {
            let [x, y, z] = columns.map(|column| column.get(start..)?.first_chunk::<LANES>().copied());
            Some([x?, y?, z?])
        };
        let mut start = 0;
        while let (Some(p), Some(n)) = (lanes(points, start), lanes(normals, start)) {
            // Whole registers of a vector unit at a time; what is seen is looked at one by one.
            let facing: [f32; LANES] = std::array::from_fn(|lane| {
                (p[0][lane] - self.eye[0]) * n[0][lane]
                    + (p[1][lane] - self.eye[1]) * n[1][lane]
                    + (p[2][lane] - self.eye[2]) * n[2][lane]
            });
            let moved: [[f32; LANES]; 3] = std::array::from_fn(|axis| {
                let ([a, b, c], shift) = (self.rows[axis], self.shift[axis]);
                std::array::from_fn(|lane| a * p[0][lane] + b * p[1][lane] + c * p[2][lane] + shift)
            });
            let [fx, fy, cx, cy] = self.intrinsics();
            let u: [f32; LANES] = std::array::from_fn(|lane| fx * moved[0][lane] / moved[2][lane] + cx);
            let v: [f32; LANES] = std::array::from_fn(|lane| fy * moved[1][lane] / moved[2][lane] + cy);
            for lane in 0..LANES {
                if facing[lane] < 0.0 {
                    let seen = [moved[0][lane], moved[1][lane], moved[2][lane]];
                    self.put(first + (start + lane) as u64, &seen, u[lane], v[lane]);
                }
            }
            start += LANES;
        }
        for index in start..points[0].len() {
            self.add_one(first + index as u64, &points.map(|axis| axis[index]), &normals.map(|axis| axis[index]));
        }
    }

    fn add_one(&mut self, number: u64, point: &[f32; 3], normal: &[f32; 3]) {
        let from_eye: [f32; 3] = std::array::from_fn(|axis| point[axis] - self.eye[axis]);
        if dot(&from_eye, normal) < 0.0 {
            let moved: [f32; 3] = std::array::from_fn(|axis| dot(&self.rows[axis], point) + self.shift[axis]);
            let [fx, fy, cx, cy] = self.intrinsics();
            self.put(number, &moved, fx * moved[0] / moved[2] + cx, fy * moved[1] / moved[2] + cy);
        }
    }

    /// fx, fy, and the optical axis from the outer corner of the first cell.
    fn intrinsics(&self) -> [f32; 4] {
        let Pinhole { fx, fy, cx, cy, .. } = self.camera;
        [fx, fy, cx + 0.5, cy + 0.5].map(|x| x as f32)
    }

    #[inline]
    fn put(&mut self, number: u64, point: &[f32; 3], u: f32, v: f32) {
        let (width, height) = (self.camera.width as f32, self.camera.height as f32);
        if !(point[2] >= MIN_DEPTH as f32 && u >= 0.0 && v >= 0.0 && u < width && v < height) {
            return;
        }
        let place = v as usize * self.camera.width + u as usize;
        let cell = &mut self.cells[place];
        if point[2] < cell.point[2] {
            cell.point = *point;
            self.numbers[place] = number;
        }
    }

    /// What came to be seen; `surfel_of` tells the piece of surface of a number, and the number it is to have.
    pub fn finish<S: std::borrow::Borrow<Surfel>>(self, surfel_of: impl Fn(u64) -> (u64, S)) -> ProjectiveTarget {
        let Self { camera, R_view_world, t_view_world, mut cells, numbers: seen, .. } = self;
        let num_seen = seen.iter().filter(|&&number| number != u64::MAX).count();
        let (mut surfels, mut numbers) = (Vec::with_capacity(num_seen), Vec::with_capacity(num_seen));
        for (cell, number) in cells.iter_mut().zip(seen) {
            if number != u64::MAX {
                let (number, surfel) = surfel_of(number);
                let surfel = surfel.borrow();
                cell.index = surfels.len() as u32;
                cell.normal = single(&(R_view_world * surfel.normal));
                surfels.push(*surfel);
                numbers.push(number);
            }
        }
        ProjectiveTarget { camera, R_view_world, t_view_world, cells, surfels, numbers }
    }
}

impl Cell {
    /// What is seen of a point in the view's frame.
    #[inline]
    fn look(&self, seen: &[f32; 3], tolerance: f32) -> Look {
        if self.index == EMPTY {
            return Look::Unknown;
        }
        let off = [seen[0] - self.point[0], seen[1] - self.point[1], seen[2] - self.point[2]];
        if dot(&self.normal, &off).abs() <= tolerance {
            return Look::Agreeing(self.index);
        }
        let margin = tolerance + SIGHT_TOLERANCE * self.point[2];
        if off[2] < -margin {
            Look::InFreeSpace
        } else if off[2] > margin {
            Look::Hidden
        } else {
            Look::Unknown
        }
    }
}

impl Target<3> for ProjectiveTarget {
    /// The nearest of the pieces seen in the point's cell and the eight around it.
    fn nearest(&self, query: &Vector3<f64>, max_distance: f64) -> Option<Neighbor> {
        let seen = self.R_view_world * query + self.t_view_world;
        let cell = self.cell(&seen)?;
        let seen = single(&seen);
        let mut best = Neighbor { index: EMPTY, sq_distance: (max_distance * max_distance) as f32 };
        for cells in self.cells_around(cell) {
            for cell in &self.cells[cells] {
                // Empty cells are infinitely far away.
                let off = [seen[0] - cell.point[0], seen[1] - cell.point[1], seen[2] - cell.point[2]];
                let sq_distance = dot(&off, &off);
                if sq_distance < best.sq_distance {
                    best = Neighbor { index: cell.index, sq_distance };
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
