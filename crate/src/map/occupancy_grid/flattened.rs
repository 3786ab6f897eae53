//! A map in space flattened to a grid: what stands in a band of heights over the floor.
//!
//! The band is divided into cubes with the side of a cell. A frame says of a cube that something is in it where one of its points is, and
//! otherwise that nothing is where one of its rays passes; these sums of log odds are those of planar scans. A cell is occupied where a cube
//! over it is. It is free where rays passed close over the floor, or the floor was seen, and no cube over it is in doubt: things stand on
//! the floor, and what was only looked over stays unknown.

use std::borrow::Cow;

use nalgebra::Vector3;
use rustc_hash::{FxHashMap, FxHashSet};

use super::{LOG_ODDS_HIT, LOG_ODDS_MISS, LONGEST_BEAM, MAX_GRID_CELLS, MAX_LOG_ODDS, Marks, OccupancyGrid};
use crate::geometry::{PointCloud, Pose3, RigidMotion};

/// Most cubes: a bit each takes an eighth of the memory of the cells' log odds and marks together.
const MAX_CUBES: f64 = 8.0 * MAX_GRID_CELLS;

impl OccupancyGrid {
    /// The grid of clouds, each from where it was measured, at their `T_floor_sensor`: the floor is the plane z = 0 with z upwards.
    /// `band`: its lowest and highest height over the floor (m), the lowest above 0. The side of a cell is `resolution` (m), or more
    /// where there would be too many cubes.
    pub fn flattened<'a>(
        frames: impl Iterator<Item = (Cow<'a, PointCloud>, Pose3)> + Clone,
        band: [f64; 2],
        resolution: f64,
    ) -> Self {
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for (cloud, T_floor_sensor) in frames.clone() {
            for place in ends(&cloud, &T_floor_sensor).map(|(end, _)| end).chain([T_floor_sensor.translation.vector]) {
                (low, high) = (low.inf(&place), high.sup(&place));
            }
        }
        if low.x > high.x {
            return Self { resolution, ..Self::default() };
        }
        let (extent, thickness) = ((high - low).xy(), band[1] - band[0]);
        let resolution = resolution
            .max((extent.x * extent.y * thickness / MAX_CUBES).cbrt())
            .max((extent.x * extent.y / MAX_GRID_CELLS).sqrt());
        let mut columns = Columns::new(Self::unknown(&low.xy(), &high.xy(), resolution), band);
        for (cloud, T_floor_sensor) in frames.clone() {
            columns.hold_points(&cloud, &T_floor_sensor);
        }
        for (cloud, T_floor_sensor) in frames {
            columns.add(&cloud, &T_floor_sensor);
        }
        columns.into_grid()
    }
}

/// The end of each ray at the floor, and whether it is the point: rays are followed as far as those of planar scans.
fn ends<'a>(cloud: &'a PointCloud, T_floor_sensor: &'a Pose3) -> impl Iterator<Item = (Vector3<f64>, bool)> + 'a {
    cloud.positions.iter().filter(|point| point.is_finite()).map(|point| {
        let point = Vector3::from(point.as_dvec3().to_array());
        let range = point.norm();
        let is_point = range <= LONGEST_BEAM;
        (T_floor_sensor.act(&if is_point { point } else { point * (LONGEST_BEAM / range) }), is_point)
    })
}

/// The cubes of the band over the cells of a grid. Cubes are counted from the grid's origin and the lower end of the band.
struct Columns {
    /// Its log odds are those of rays close over the floor and of the floor alone: none says that something is there.
    grid: OccupancyGrid,
    band: [f64; 2],
    origin: Vector3<f64>,
    num_layers: usize,
    /// Rays through these tell that a cell is free: as high above the band's lower end as that is above the floor, for what may stand
    /// below the one is as high as what would stand in the other unseen.
    num_low_layers: usize,
    /// A bit for each cube, column by column: whether a frame has a point in it.
    has_point: Vec<u64>,
    /// The cubes with points, by their numbers.
    cubes: FxHashMap<usize, Cube>,
    frame: u32,
    marks: Marks,
}

/// A cube that a frame has a point in.
#[derive(Default)]
struct Cube {
    log_odds: f32,
    /// The last frame that has updated it.
    frame: u32,
}

impl Columns {
    fn new(grid: OccupancyGrid, band: [f64; 2]) -> Self {
        let num_layers = ((band[1] - band[0]) / grid.resolution).ceil().max(1.0) as usize;
        let num_low_layers = ((band[0] / grid.resolution).ceil() as usize).clamp(1, num_layers);
        let num_columns = grid.log_odds.len();
        Self {
            origin: grid.origin.push(band[0]),
            grid,
            band,
            num_layers,
            num_low_layers,
            has_point: vec![0; (num_columns * num_layers).div_ceil(64)],
            cubes: FxHashMap::default(),
            frame: 0,
            marks: Marks { of_scan: vec![0; num_columns], scan: 0 },
        }
    }

    /// Of other cubes nothing is said but that rays pass them.
    fn hold_points(&mut self, cloud: &PointCloud, T_floor_sensor: &Pose3) {
        for (end, is_point) in ends(cloud, T_floor_sensor) {
            if is_point && self.is_in_band(&end) {
                let cube = self.index(&end);
                self.has_point[cube / 64] |= 1 << (cube % 64);
                self.cubes.entry(cube).or_default();
            }
        }
    }

    /// Of a frame, one ray to each cube is followed: those of its other points pass by the same cubes.
    fn add(&mut self, cloud: &PointCloud, T_floor_sensor: &Pose3) {
        self.frame += 1;
        self.marks.scan = self.frame;
        let mut seen = FxHashSet::default();
        let mut rays: Vec<_> = ends(cloud, T_floor_sensor).collect();
        rays.retain(|(end, _)| seen.insert(self.in_cubes(end).map(|along| along.floor() as i32)));
        for (end, _) in rays.iter().filter(|(_, is_point)| *is_point) {
            if self.is_in_band(end) {
                self.tell(self.index(end), LOG_ODDS_HIT);
            } else if end.z.abs() < self.band[0] {
                self.pass_column(self.index(end) / self.num_layers);
            }
        }
        for (end, _) in &rays {
            self.follow(&T_floor_sensor.translation.vector, end);
        }
    }

    /// Lowers the log odds of the cubes that a ray passes, and of the cells that it passes close over the floor, up to the cube before its end.
    ///
    /// Not inlined, for the same reason as [`OccupancyGrid::follow`].
    #[inline(never)]
    fn follow(&mut self, from: &Vector3<f64>, to: &Vector3<f64>) {
        let Some([start, end]) = self.within_band(from, to) else { return };
        let mut index = self.index(&start);
        let [start, end] = [start, end].map(|place| self.in_layers(&place));
        let strides = [self.num_layers.cast_signed(), (self.grid.width * self.num_layers).cast_signed(), 1];
        cubes_between(&start, &end, |axis, is_up| {
            if self.has_point[index / 64] >> (index % 64) & 1 == 1 {
                self.tell(index, LOG_ODDS_MISS);
            }
            if index % self.num_layers < self.num_low_layers {
                self.pass_column(index / self.num_layers);
            }
            index = index.wrapping_add_signed(if is_up { strides[axis] } else { -strides[axis] });
        });
    }

    /// What this frame says of a cube, the first time that it does.
    fn tell(&mut self, cube: usize, log_odds: f32) {
        let Some(cube) = self.cubes.get_mut(&cube) else { return };
        if std::mem::replace(&mut cube.frame, self.frame) != self.frame {
            cube.log_odds = (cube.log_odds + log_odds).clamp(-MAX_LOG_ODDS, MAX_LOG_ODDS);
        }
    }

    fn pass_column(&mut self, column: usize) {
        if self.marks.first(column) {
            let log_odds = &mut self.grid.log_odds[column];
            *log_odds = (*log_odds + LOG_ODDS_MISS).max(-MAX_LOG_ODDS);
        }
    }

    fn is_in_band(&self, place: &Vector3<f64>) -> bool {
        (self.band[0]..self.band[1]).contains(&place.z)
    }

    /// The part of a ray in the band; `None` where it passes above or below.
    fn within_band(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> Option<[Vector3<f64>; 2]> {
        let along = to - from;
        let at_height = |height: f64| (height - from.z) / along.z;
        let (start, end) = if along.z == 0.0 {
            (0.0, if self.is_in_band(from) { 1.0 } else { 0.0 })
        } else {
            let [a, b] = self.band.map(at_height);
            (a.min(b).max(0.0), a.max(b).min(1.0))
        };
        (start < end).then(|| [start, end].map(|share| from + along * share))
    }

    fn in_cubes(&self, place: &Vector3<f64>) -> Vector3<f64> {
        (place - self.origin) / self.grid.resolution
    }

    /// With what lies on the borders of the band, within rounding, in its first and last layer.
    fn in_layers(&self, place: &Vector3<f64>) -> Vector3<f64> {
        let cubes = self.in_cubes(place);
        Vector3::new(cubes.x, cubes.y, cubes.z.clamp(0.0, (self.num_layers as f64).next_down()))
    }

    fn index(&self, place: &Vector3<f64>) -> usize {
        let cube = self.in_layers(place).map(|along| along as usize);
        (cube.y * self.grid.width + cube.x) * self.num_layers + cube.z
    }

    /// A cell is what is most likely occupied over it, of the cubes with a point.
    fn into_grid(self) -> OccupancyGrid {
        let mut grid = self.grid;
        for (number, cube) in self.cubes {
            let cell = &mut grid.log_odds[number / self.num_layers];
            *cell = cell.max(cube.log_odds);
        }
        grid
    }
}

/// Steps from cube to cube along a line, up to the one before its end's: `step` is told the axis and whether the step goes up, in the cube
/// that is left (Amanatides and Woo, as in the plane). Coordinates are in cubes.
fn cubes_between(start: &Vector3<f64>, end: &Vector3<f64>, mut step: impl FnMut(usize, bool)) {
    let along = end - start;
    let (first, last) = (start.map(f64::floor), end.map(f64::floor));
    let mut num_left = (last - first).map(|steps| steps.abs() as usize);
    let per_cube = along.map(|along| 1.0 / along.abs());
    let mut next = Vector3::from_fn(|axis, _| {
        let to_border = if along[axis] >= 0.0 { first[axis] + 1.0 - start[axis] } else { start[axis] - first[axis] };
        // Rounding must not lead past the end.
        if num_left[axis] == 0 { f64::INFINITY } else { to_border * per_cube[axis] }
    });
    for _ in 0..num_left.sum() {
        let axis = next.imin();
        step(axis, along[axis] >= 0.0);
        num_left[axis] -= 1;
        next[axis] = if num_left[axis] == 0 { f64::INFINITY } else { next[axis] + per_cube[axis] };
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::map::occupancy_grid::Cell;

    /// Numbers in [0, 1) by the bits of a counter: the golden ratio's multiples fill it evenly.
    fn numbers() -> impl FnMut() -> f64 {
        let mut count = 0.0;
        move || {
            count += 1.0;
            (count * 0.618_033_988_749_895_f64).fract()
        }
    }

    /// Whether a line passes more than a corner of a cube.
    fn passes(start: &Vector3<f64>, end: &Vector3<f64>, cube: &Vector3<f64>) -> bool {
        let along = end - start;
        let (mut near, mut far) = (0.0f64, 1.0f64);
        for axis in 0..3 {
            let [a, b] = [0.0, 1.0].map(|side| (cube[axis] + side - start[axis]) / along[axis]);
            (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
        }
        far - near > 1e-9
    }

    #[test]
    fn a_ray_passes_the_cubes_that_it_meets_up_to_the_one_before_its_end() {
        let mut number = numbers();
        for _ in 0..300 {
            let [start, end] = [0, 1].map(|_| Vector3::from_fn(|_, _| 7.0 * number()));
            let (mut cube, mut passed) = (start.map(f64::floor), Vec::new());
            cubes_between(&start, &end, |axis, is_up| {
                passed.push(cube);
                cube[axis] += if is_up { 1.0 } else { -1.0 };
            });
            assert_eq!(cube, end.map(f64::floor));
            for index in 0..343 {
                let other = Vector3::new(index % 7, index / 7 % 7, index / 49).map(f64::from);
                let is_met = passes(&start, &end, &other) && other != end.map(f64::floor);
                assert_eq!(passed.contains(&other), is_met, "{other} between {start} and {end}");
            }
        }
    }

    /// A sensor so high over the floor (m), and points of the world seen from there.
    fn frame(height: f32, points: &[[f32; 3]]) -> (Cow<'static, PointCloud>, Pose3) {
        let positions = points.iter().map(|&[x, y, z]| Vec3::new(x, y, z - height)).collect();
        (Cow::Owned(PointCloud::from_positions(positions)), Pose3::translation(0.0, 0.0, f64::from(height)))
    }

    fn at(grid: &OccupancyGrid, x: f64, y: f64) -> Cell {
        let [x, y] = [x - grid.origin.x, y - grid.origin.y].map(|along| (along / grid.resolution) as usize);
        grid.cell(x, y)
    }

    #[test]
    fn what_stands_in_the_band_is_occupied_and_where_rays_pass_low_or_the_floor_is_seen_it_is_free() {
        // The foot of a wall ahead; a lamp over the band and floor to the left; a table to the right that others look over.
        let points = [[2.02, -2.02, 1.02], [3.02, 0.02, 0.32], [0.02, 2.02, 2.02], [0.02, 1.52, 0.02]];
        let over_table = frame(1.0, &points);
        let table = frame(1.0, &[[1.02, -1.02, 0.62]]);
        let frames = [vec![table.clone(), table], vec![over_table; 8]].concat();
        let grid = OccupancyGrid::flattened(frames.iter().cloned(), [0.2, 1.8], 0.05);
        assert_eq!([at(&grid, 3.02, 0.02), at(&grid, 2.82, 0.02)], [Cell::Occupied, Cell::Free]);
        assert_eq!([at(&grid, 1.52, 0.02), at(&grid, 0.52, -0.52)], [Cell::Unknown; 2], "looked over");
        assert_eq!(at(&grid, 1.02, -1.02), Cell::Occupied, "looked over, and seen");
        assert_eq!([at(&grid, 0.02, 1.52), at(&grid, 0.02, 2.02)], [Cell::Free, Cell::Unknown], "floor and lamp");
        assert_eq!(at(&grid, 2.52, 1.52), Cell::Unknown, "where no ray came");
        let low = OccupancyGrid::flattened(frames.iter().cloned(), [0.05, 0.5], 0.05);
        assert_eq!([at(&low, 1.02, -1.02), at(&low, 3.02, 0.02)], [Cell::Unknown, Cell::Occupied]);
    }

    #[test]
    fn what_later_frames_see_through_has_gone() {
        let (standing, gone) = (frame(0.32, &[[1.02, 0.02, 0.32]]), frame(0.32, &[[2.02, 0.02, 0.32]]));
        let frames = [vec![standing; 3], vec![gone; 12]].concat();
        let grid = OccupancyGrid::flattened(frames.into_iter(), [0.2, 1.8], 0.05);
        assert_eq!([at(&grid, 1.02, 0.02), at(&grid, 2.02, 0.02)], [Cell::Free, Cell::Occupied]);
    }
}
