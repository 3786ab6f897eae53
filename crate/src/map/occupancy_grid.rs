//! An occupancy grid of placed scans: what is free, what is occupied and what nobody saw.
//!
//! Every beam is followed from the sensor to its return; the cells on its way become more likely free, the one at its end
//! more likely occupied, in log odds: Thrun, Burgard and Fox, "Probabilistic Robotics" (2005), tables 9.1 and 9.2. A scan
//! says one thing of a cell at the most, and "occupied" goes before "free": beams that graze a wall do not wear it away.
//! Beams without a return say nothing: black walls and glass return nothing either.

use std::fmt::Write as _;

use nalgebra::Vector2;

use crate::geometry::{Pose2, RigidMotion};
use crate::preprocess::planar_scan::PlanarScan;

/// What is known of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cell {
    /// Beams passed through it.
    Free,
    /// Beams ended in it.
    Occupied,
    /// No beam, or contradicting ones.
    Unknown,
}

/// A map of square cells, axes along the world's.
#[derive(Debug, Clone, PartialEq)]
pub struct OccupancyGrid {
    /// Side of a cell (m).
    pub resolution: f64,
    /// The corner of the first cell with the least x and y (m).
    pub origin: Vector2<f64>,
    /// Cells along x.
    pub width: usize,
    /// Cells along y.
    pub height: usize,
    /// log(p / (1 - p)) of each cell being occupied, row by row from the least y on.
    log_odds: Vec<f32>,
}

/// Side of a cell unless it is asked for (m).
pub const RESOLUTION: f64 = 0.05;
/// A return makes its cell this much likelier occupied: p = 0.7.
const LOG_ODDS_HIT: f32 = 0.85;
/// A beam makes the cells on its way this much likelier free: p = 0.4.
const LOG_ODDS_MISS: f32 = -0.4;
/// No cell is surer than this: what changed, as a door, can be unlearned.
const MAX_LOG_ODDS: f32 = 3.5;
/// As ROS's map_server has them: a cell is occupied above this probability ...
const OCCUPIED_THRESHOLD: f64 = 0.65;
/// ... and free below this one.
const FREE_THRESHOLD: f64 = 0.196;
/// Beams are followed no further (m): far returns are few, and would make the grid large.
const LONGEST_BEAM: f64 = 30.0;
/// A map of more cells than this gets larger ones.
const MAX_CELLS: f64 = 16e6;

impl OccupancyGrid {
    /// Draws scans at their poses, `T_world_sensor`. The cells are of side `resolution` (m), larger where there would be
    /// too many.
    pub fn new(placed: &[(&PlanarScan, Pose2)], resolution: f64) -> Self {
        let (mut low, mut high) = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
        for (scan, T) in placed {
            let sensor = T.translation.vector;
            let ends = scan.points.iter().map(|point| T.act(&end_of_beam(point).0));
            for point in ends.chain([sensor]) {
                (low, high) = (low.inf(&point), high.sup(&point));
            }
        }
        if placed.is_empty() {
            return Self { resolution, origin: Vector2::zeros(), width: 0, height: 0, log_odds: Vec::new() };
        }
        let extent = high - low;
        let resolution = resolution.max((extent.x * extent.y / MAX_CELLS).sqrt()).max(extent.amax() / MAX_CELLS);
        // Corners on multiples of the cells' side: the same place falls into the same cell whatever was seen beside.
        let origin = low.map(|value| ((value / resolution).floor() - 1.0) * resolution);
        let size = (high - origin).map(|value| (value / resolution) as usize + 2);
        let mut grid = Self { resolution, origin, width: size.x, height: size.y, log_odds: vec![0.0; size.x * size.y] };
        let mut marks = Marks { of_scan: vec![0; grid.log_odds.len()], scan: 0 };
        for (scan, T) in placed {
            grid.add(scan, T, &mut marks);
        }
        grid
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

    /// The cells from the sensor to the one before the end (Amanatides and Woo, "A fast voxel traversal algorithm for ray
    /// tracing", Eurographics 1987).
    fn follow(&mut self, from: &Vector2<f64>, to: &Vector2<f64>, marks: &mut Marks) {
        let scale = |point: &Vector2<f64>| (point - self.origin) / self.resolution;
        let (start, end) = (scale(from), scale(to));
        let along = end - start;
        let mut cell = start.map(|value| value.floor() as i64);
        let last = end.map(|value| value.floor() as i64);
        let step = along.map(|value| if value >= 0.0 { 1i64 } else { -1 });
        let per_cell = along.map(|value| if value == 0.0 { f64::INFINITY } else { 1.0 / value.abs() });
        let border = |axis: usize| {
            let next =
                if step[axis] > 0 { cell[axis] as f64 + 1.0 - start[axis] } else { start[axis] - cell[axis] as f64 };
            if along[axis] == 0.0 { f64::INFINITY } else { next * per_cell[axis] }
        };
        let mut next = Vector2::new(border(0), border(1));
        let num_steps = (last - cell).abs().sum();
        for _ in 0..num_steps {
            let index = cell.y as usize * self.width + cell.x as usize;
            if marks.first(index) {
                self.log_odds[index] = (self.log_odds[index] + LOG_ODDS_MISS).max(-MAX_LOG_ODDS);
            }
            let axis = usize::from(next.y < next.x);
            cell[axis] += step[axis];
            next[axis] += per_cell[axis];
        }
    }

    fn index(&self, point: &Vector2<f64>) -> usize {
        let cell = (point - self.origin) / self.resolution;
        cell.y as usize * self.width + cell.x as usize
    }

    /// What is known of the cell in column `x`, row `y`, from the corner with the least of both.
    ///
    /// # Panics
    /// Outside the grid.
    pub fn cell(&self, x: usize, y: usize) -> Cell {
        let log_odds = f64::from(self.log_odds[y * self.width + x]);
        let probability = 1.0 - 1.0 / (1.0 + log_odds.exp());
        if probability > OCCUPIED_THRESHOLD {
            Cell::Occupied
        } else if probability < FREE_THRESHOLD {
            Cell::Free
        } else {
            Cell::Unknown
        }
    }

    /// A grey value a cell, row by row from the largest y down, as a picture has them: 0 occupied, 254 free, 205 unknown.
    /// These are the values that ROS's map_saver writes.
    pub fn grey_values(&self) -> Vec<u8> {
        let value = |(x, y)| match self.cell(x, y) {
            Cell::Occupied => 0,
            Cell::Free => 254,
            Cell::Unknown => 205,
        };
        (0..self.height).rev().flat_map(|y| (0..self.width).map(move |x| (x, y))).map(value).collect()
    }

    /// The picture as a PGM file.
    pub fn pgm(&self) -> Vec<u8> {
        let mut bytes = format!("P5\n{} {}\n255\n", self.width, self.height).into_bytes();
        bytes.extend(self.grey_values());
        bytes
    }

    /// What ROS's map_server needs to know of the picture, as YAML. `image` is the name of the picture's file.
    pub fn yaml(&self, image: &str) -> String {
        let mut text = format!("image: {image}\nmode: trinary\n");
        let _ = writeln!(text, "resolution: {}", self.resolution);
        let _ = writeln!(text, "origin: [{:.6}, {:.6}, 0.0]", self.origin.x, self.origin.y);
        let _ = writeln!(text, "negate: 0\noccupied_thresh: {OCCUPIED_THRESHOLD}\nfree_thresh: {FREE_THRESHOLD}");
        text
    }
}

/// Where a beam is followed to, in the sensor's frame, and whether its return lies there.
fn end_of_beam(point: &Vector2<f64>) -> (Vector2<f64>, bool) {
    let range = point.norm();
    if range <= LONGEST_BEAM { (*point, true) } else { (point * (LONGEST_BEAM / range), false) }
}

/// Which cells a scan has spoken of.
struct Marks {
    of_scan: Vec<u32>,
    scan: u32,
}

impl Marks {
    fn first(&mut self, cell: usize) -> bool {
        std::mem::replace(&mut self.of_scan[cell], self.scan) != self.scan
    }
}
