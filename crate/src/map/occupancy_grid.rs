//! An occupancy grid of scans at given poses: free, occupied and unknown cells.
//!
//! Each beam is traced from the sensor to its return. It lowers the log odds of the cells that it crosses and raises those of
//! the cell at its end: Thrun, Burgard and Fox, "Probabilistic Robotics" (2005), tables 9.1 and 9.2. A scan updates a cell at
//! most once, and "occupied" takes precedence over "free", so that beams that graze a wall do not erase it. Beams without a
//! return are ignored, since black walls and glass give none either.
//!
//! Where the sensor and the robot were, nothing else was: a planner that starts there needs these cells to be free, whatever
//! the beams of other scans say.

mod changes;
mod edits;
mod flattened;
mod lattice;

use std::fmt::Write as _;

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::geometry::{Pose2, RigidMotion};
use crate::io::occupancy_map::{FREE_THRESH, OCCUPIED_THRESH, OccupancyMap};
use crate::preprocess::planar_scan::PlanarScan;
pub use changes::{Change, ChangeKind};
pub use edits::Shape;
use lattice::Lattice;

/// The state of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum Cell {
    /// Beams crossed it.
    Free,
    /// Beams ended in it.
    Occupied,
    /// No beam reached it, or the beams contradict each other.
    Unknown,
}

/// A grid of square cells.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OccupancyGrid {
    /// Side of a cell (m).
    pub resolution: f64,
    /// Corner of the grid at its first cell (m, world frame).
    pub origin: Vector2<f64>,
    /// Turn of the grid's x axis from the world's (rad): 0 in all but some grids from files.
    pub yaw: f64,
    /// Cells along x.
    pub width: usize,
    /// Cells along y.
    pub height: usize,
    /// What a reader of the YAML file is to know, in whole sentences; empty where there is nothing.
    pub remark: String,
    /// log(p / (1 - p)), p being the probability that the cell is occupied; row by row from the smallest y.
    log_odds: Vec<f32>,
}

/// Default side of a cell (m).
pub const RESOLUTION: f64 = 0.05;
/// Increment of a cell's log odds by a return: p = 0.7.
const LOG_ODDS_HIT: f32 = 0.85;
/// Increment of a cell's log odds by a beam that crosses it: p = 0.4.
const LOG_ODDS_MISS: f32 = -0.4;
/// Increment of the log odds of a cell in which the sensor or the robot was: p = 0.001. Only a pose that is off by a cell can
/// have it there while the cell is occupied. It outweighs the bound of what beams can say against it, 3.5, by more than the
/// 1.41 that a free cell needs, so that such a cell is always free.
const LOG_ODDS_STAYED: f32 = -6.9;
/// Increment of the log odds of a cell on the arc between two consecutive poses, by which the robot may have driven: p = 0.1. Free
/// where no beam says otherwise, and unknown with one return, since the way from one pose to the next may have been another.
const LOG_ODDS_PASSED: f32 = -2.2;
/// Bound of a cell's log odds, so that changes of the scene, such as a door, can still be learned.
const MAX_LOG_ODDS: f32 = 3.5;
/// Length up to which beams are traced (m): returns beyond are few and would make the grid large.
const LONGEST_BEAM: f64 = 30.0;
/// Most points of an arc; between those of a longer one the way is straight.
const MAX_ARC_POINTS: f64 = 1e4;
/// Most cells of a grid; for larger maps the cells are made larger.
const MAX_GRID_CELLS: f64 = 16e6;

impl OccupancyGrid {
    /// The grid of scans at their `T_world_sensor`. The side of a cell is `resolution` (m), or more where there would be too many
    /// cells. `drives`: consecutive poses of what moved through the map, the sensor and the robot that carries it.
    pub fn new(placed: &[(&PlanarScan, Pose2)], drives: &[Vec<Pose2>], resolution: f64) -> Self {
        let (mut low, mut high) = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
        for (scan, T) in placed {
            widen(&mut low, &mut high, scan, T);
        }
        let arcs: Vec<Vec<Vector2<f64>>> = drives.iter().map(|drive| arcs_through(drive, resolution)).collect();
        for point in arcs.iter().flatten().chain(drives.iter().flatten().map(|T| &T.translation.vector)) {
            (low, high) = (low.inf(point), high.sup(point));
        }
        if placed.is_empty() {
            return Self { resolution, ..Self::default() };
        }
        let extent = high - low;
        let resolution =
            resolution.max((extent.x * extent.y / MAX_GRID_CELLS).sqrt()).max(extent.amax() / MAX_GRID_CELLS);
        let mut grid = Self::unknown(&low, &high, resolution);
        let mut marks = Marks { of_scan: vec![0; grid.log_odds.len()], scan: 0 };
        for (scan, T) in placed {
            grid.add(scan, T, &mut marks);
        }
        grid.add_drives(drives, &arcs, &mut marks);
        grid
    }

    /// A grid around what lies between these corners, in which nothing is known.
    fn unknown(low: &Vector2<f64>, high: &Vector2<f64>, resolution: f64) -> Self {
        // The origin is a multiple of the resolution, so that the cells do not depend on the extent of the map.
        let origin = low.map(|value| ((value / resolution).floor() - 1.0) * resolution);
        let size = (high - origin).map(|value| (value / resolution) as usize + 2);
        let (width, height, log_odds) = (size.x, size.y, vec![0.0; size.x * size.y]);
        Self { resolution, origin, yaw: 0.0, width, height, remark: String::new(), log_odds }
    }

    /// The grid of a map from a file.
    pub fn of_map(map: &OccupancyMap) -> Self {
        let log_odds = |&occupied: &f32| {
            // Unknown is NaN, which no bound changes.
            let odds = (occupied / (1.0 - occupied)).ln().clamp(-MAX_LOG_ODDS, MAX_LOG_ODDS);
            if odds.is_nan() { 0.0 } else { odds }
        };
        Self {
            resolution: map.resolution,
            origin: map.T_world_grid.translation.vector,
            yaw: map.T_world_grid.rotation.angle(),
            width: map.width,
            height: map.height,
            remark: map.notes.join(" "),
            log_odds: map.occupancy.iter().map(log_odds).collect(),
        }
    }

    /// The grid in the world: its corner, and its axes along its rows and columns.
    pub fn T_world_grid(&self) -> Pose2 {
        Pose2::new(self.origin, self.yaw)
    }

    /// Each cell once: the poses of several passes share their errors.
    fn add_drives(&mut self, drives: &[Vec<Pose2>], arcs: &[Vec<Vector2<f64>>], marks: &mut Marks) {
        marks.scan += 1;
        for T in drives.iter().flatten() {
            let cell = self.index(&T.translation.vector);
            if marks.first(cell) {
                self.log_odds[cell] = (self.log_odds[cell] + LOG_ODDS_STAYED).max(-MAX_LOG_ODDS);
            }
        }
        let lattice = self.lattice();
        for pair in arcs.iter().flat_map(|arc| arc.windows(2)) {
            lattice.cells_between(&pair[0], &pair[1], |cell| {
                if marks.first(cell) {
                    self.log_odds[cell] = (self.log_odds[cell] + LOG_ODDS_PASSED).max(-MAX_LOG_ODDS);
                }
            });
        }
    }

    fn add(&mut self, scan: &PlanarScan, T_world_sensor: &Pose2, marks: &mut Marks) {
        marks.scan += 1;
        let sensor = T_world_sensor.translation.vector;
        let ends: Vec<_> = scan.points.iter().map(end_of_beam).map(|(p, hit)| (T_world_sensor.act(&p), hit)).collect();
        for (point, _) in ends.iter().filter(|(_, is_hit)| *is_hit) {
            let cell = self.index(point);
            if marks.first(cell) {
                self.log_odds[cell] = (self.log_odds[cell] + LOG_ODDS_HIT).min(MAX_LOG_ODDS);
            }
        }
        for (point, _) in &ends {
            self.follow(&sensor, point, marks);
        }
    }

    /// Lowers the log odds of the cells from the sensor to the one before the end of a beam.
    ///
    /// Not inlined: a browser switches to optimised code only when a function is next called, and a grid is computed in one call.
    #[inline(never)]
    fn follow(&mut self, from: &Vector2<f64>, to: &Vector2<f64>, marks: &mut Marks) {
        self.lattice().cells_between(from, to, |index| {
            if marks.first(index) {
                let log_odds = self.log_odds[index] + LOG_ODDS_MISS;
                self.log_odds[index] = if log_odds < -MAX_LOG_ODDS { -MAX_LOG_ODDS } else { log_odds };
            }
        });
    }

    fn lattice(&self) -> Lattice {
        Lattice { resolution: self.resolution, origin: self.origin, width: self.width }
    }

    fn index(&self, point: &Vector2<f64>) -> usize {
        let cell = (point - self.origin) / self.resolution;
        cell.y as usize * self.width + cell.x as usize
    }

    /// The state of the cell in column `x` and row `y`, counted from `origin`.
    ///
    /// # Panics
    /// Outside the grid.
    pub fn cell(&self, x: usize, y: usize) -> Cell {
        Thresholds::default().cell(self.log_odds[y * self.width + x])
    }

    /// Grey values of the cells in the row order of an image, from the largest y down: 0 occupied, 254 free, 205 unknown, the
    /// values that ROS's map_saver writes.
    pub fn grey_values(&self) -> Vec<u8> {
        let mut values = Vec::with_capacity(self.log_odds.len());
        let thresholds = Thresholds::default();
        for row in self.log_odds.chunks_exact(self.width.max(1)).rev() {
            thresholds.push_grey_values(row, &mut values);
        }
        values
    }

    /// The grey values as a PGM file.
    pub fn pgm(&self) -> Vec<u8> {
        let mut bytes = format!("P5\n{} {}\n255\n", self.width, self.height).into_bytes();
        bytes.extend(self.grey_values());
        bytes
    }

    /// The YAML file of ROS's map_server for the PGM file of the name `image`.
    pub fn yaml(&self, image: &str) -> String {
        let mut text = format!("image: {image}\nmode: trinary\n");
        let _ = writeln!(text, "resolution: {}", self.resolution);
        let _ = writeln!(text, "origin: [{:.6}, {:.6}, {:?}]", self.origin.x, self.origin.y, self.yaw);
        let _ = writeln!(text, "negate: 0\noccupied_thresh: {OCCUPIED_THRESH}\nfree_thresh: {FREE_THRESH}");
        if !self.remark.is_empty() {
            let _ = writeln!(text, "# {}", self.remark);
        }
        text
    }
}

/// Points along arcs of constant curvature and speed from each pose to the next, closer to each other than cells of this side,
/// as far as a wheeled robot turns between two scans.
fn arcs_through(drive: &[Pose2], resolution: f64) -> Vec<Vector2<f64>> {
    let arc = |pair: &[Pose2]| {
        let motion = (pair[0].inverse() * pair[1]).log();
        let count = (motion.norm() / resolution).ceil().clamp(1.0, MAX_ARC_POINTS) as usize;
        let start = pair[0];
        (0..count).map(move |i| (start * Pose2::exp(&(motion * (i as f64 / count as f64)))).translation.vector)
    };
    drive.windows(2).flat_map(arc).chain(drive.last().map(|T| T.translation.vector)).collect()
}

/// The log odds beyond which a cell is occupied, or free.
struct Thresholds {
    occupied: f64,
    free: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        let log_odds = |probability: f64| (probability / (1.0 - probability)).ln();
        Self { occupied: log_odds(OCCUPIED_THRESH), free: log_odds(FREE_THRESH) }
    }
}

impl Thresholds {
    fn cell(&self, log_odds: f32) -> Cell {
        let log_odds = f64::from(log_odds);
        if log_odds > self.occupied {
            Cell::Occupied
        } else if log_odds < self.free {
            Cell::Free
        } else {
            Cell::Unknown
        }
    }

    /// Not inlined, for the same reason as [`OccupancyGrid::follow`].
    #[inline(never)]
    fn push_grey_values(&self, log_odds: &[f32], values: &mut Vec<u8>) {
        values.extend(log_odds.iter().map(|&log_odds| match self.cell(log_odds) {
            Cell::Occupied => 0,
            Cell::Free => 254,
            Cell::Unknown => 205,
        }));
    }
}

/// The end of a beam in the sensor frame (m), shortened to [`LONGEST_BEAM`], and whether it is the return.
fn end_of_beam(point: &Vector2<f64>) -> (Vector2<f64>, bool) {
    let range = point.norm();
    if range <= LONGEST_BEAM { (*point, true) } else { (point * (LONGEST_BEAM / range), false) }
}

/// Extends a box by a scan's sensor and the ends of its beams. Not inlined, for the same reason as [`OccupancyGrid::follow`].
#[inline(never)]
fn widen(low: &mut Vector2<f64>, high: &mut Vector2<f64>, scan: &PlanarScan, T_world_sensor: &Pose2) {
    let ends = scan.points.iter().map(|point| T_world_sensor.act(&end_of_beam(point).0));
    for point in ends.chain([T_world_sensor.translation.vector]) {
        (*low, *high) = (low.inf(&point), high.sup(&point));
    }
}

/// The cells that the current scan has updated.
struct Marks {
    of_scan: Vec<u32>,
    scan: u32,
}

impl Marks {
    fn first(&mut self, cell: usize) -> bool {
        std::mem::replace(&mut self.of_scan[cell], self.scan) != self.scan
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::occupancy_map::{MapYaml, of_picture};

    #[test]
    fn driven_cells_are_free_whatever_beams_say_and_ways_between_poses_unless_a_beam_ended_there() {
        // A laser that stands still sees a wall 1 m ahead, and later drives through it by an arc to the left.
        let wall: Vec<Vector2<f64>> = (-40..=40).map(|i| Vector2::new(1.02, 0.05 * f64::from(i))).collect();
        let scan = PlanarScan { points: wall, ..PlanarScan::default() };
        let placed: Vec<(&PlanarScan, Pose2)> = vec![(&scan, Pose2::identity()); 20];
        let drive = vec![
            Pose2::identity(),
            Pose2::new(Vector2::new(1.02, 0.0), 0.0),
            Pose2::new(Vector2::new(3.02, 2.0), std::f64::consts::FRAC_PI_2),
        ];
        let blind = OccupancyGrid::new(&placed, &[], 0.05);
        let driven = OccupancyGrid::new(&placed, std::slice::from_ref(&drive), 0.05);
        let at = |grid: &OccupancyGrid, x: f64, y: f64| {
            let cell = (Vector2::new(x, y) - grid.origin) / grid.resolution;
            grid.cell(cell.x as usize, cell.y as usize)
        };
        assert_eq!((at(&blind, 1.02, 0.0), at(&blind, 1.02, 0.3)), (Cell::Occupied, Cell::Occupied));
        for T in &drive {
            assert_eq!(at(&driven, T.translation.x, T.translation.y), Cell::Free);
        }
        assert_eq!(at(&driven, 1.02, 0.3), Cell::Occupied, "beside the robot's way the wall stays");
        // Along the quarter of a circle about (1.02, 2) that no beam reaches.
        for degrees in 5..90 {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            assert_eq!(at(&driven, 1.02 + 2.0 * sin, 2.0 - 2.0 * cos), Cell::Free, "{degrees} degrees");
        }
        assert_eq!(at(&driven, 2.02, 1.0), Cell::Unknown, "beside the arc");
        let seen_once =
            OccupancyGrid::new(&placed[..1], &[vec![Pose2::identity(), Pose2::new(Vector2::new(2.0, 0.0), 0.0)]], 0.05);
        assert_eq!(at(&seen_once, 1.02, 0.0), Cell::Unknown, "a beam ended on the way");
        assert_eq!((at(&seen_once, 0.52, 0.0), at(&seen_once, 1.52, 0.0)), (Cell::Free, Cell::Free));
    }

    #[test]
    fn a_grid_is_read_again_from_its_own_files() {
        let scan = PlanarScan::new((0..90).map(|i| Vector2::new(2.0, 0.05 * f64::from(i) - 2.2)).collect());
        let grid = OccupancyGrid::new(&[(&scan, Pose2::identity()); 3], &[vec![Pose2::identity()]], 0.05);
        let cells = |grid: &OccupancyGrid| -> Vec<Cell> {
            (0..grid.width * grid.height).map(|index| grid.cell(index % grid.width, index / grid.width)).collect()
        };
        for yaw in [0.0, -0.7] {
            let yaml = OccupancyGrid { yaw, ..grid.clone() }.yaml("map.pgm");
            let map = of_picture(&MapYaml::read(yaml.as_bytes()).unwrap(), &grid.pgm()).unwrap();
            let again = OccupancyGrid::of_map(&map);
            assert_eq!((again.width, again.height, again.resolution), (grid.width, grid.height, grid.resolution));
            assert_eq!(cells(&again), cells(&grid));
            let corner = again.T_world_grid();
            assert!(
                (corner.translation.vector - grid.origin).norm() < 1e-6
                    && (corner.rotation.angle() - yaw).abs() < 1e-12
            );
        }
        for cell in [Cell::Free, Cell::Occupied, Cell::Unknown] {
            assert!(cells(&grid).contains(&cell), "{cell:?}");
        }
    }

    #[test]
    fn cells_are_classified_by_their_probability() {
        let mut grid = OccupancyGrid {
            resolution: 1.0,
            origin: Vector2::zeros(),
            yaw: 0.0,
            width: 71,
            height: 1,
            remark: String::new(),
            log_odds: (-35..=35).map(|tenths| tenths as f32 / 10.0).collect(),
        };
        let by_probability = |log_odds: f32| match 1.0 - 1.0 / (1.0 + f64::from(log_odds).exp()) {
            probability if probability > OCCUPIED_THRESH => (Cell::Occupied, 0),
            probability if probability < FREE_THRESH => (Cell::Free, 254),
            _ => (Cell::Unknown, 205),
        };
        let expected: Vec<_> = grid.log_odds.iter().map(|&log_odds| by_probability(log_odds)).collect();
        let found: Vec<_> = (0..71).map(|x| grid.cell(x, 0)).zip(grid.grey_values()).collect();
        assert_eq!(found, expected);
        assert_eq!([found[0].0, found[35].0, found[70].0], [Cell::Free, Cell::Unknown, Cell::Occupied]);
        (grid.width, grid.height) = (1, 71);
        let from_the_top: Vec<u8> = expected.iter().rev().map(|&(_, grey)| grey).collect();
        assert_eq!(grid.grey_values(), from_the_top);
    }
}
