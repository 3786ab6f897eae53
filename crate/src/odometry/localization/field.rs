//! A map prepared for localisation: for every cell the nearest wall, and the walls with their normals.

use nalgebra::{Matrix2, Vector2};

use super::nearest_cells::{NONE, nearest_cells};
use crate::geometry::{Pose2, RigidMotion};
use crate::map::occupancy_grid::{Cell, OccupancyGrid};
use crate::{Error, Result};

/// A piece of a wall around an occupied cell, in the grid's frame (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wall {
    /// Mean of the occupied cells around.
    pub point: Vector2<f64>,
    /// Unit normal, where the cells form a line.
    pub normal: Option<Vector2<f64>>,
    /// Variance of the surface across the wall (m^2): a map that is unsure of a wall draws it thick.
    pub variance: f64,
}

/// A map prepared for localisation. Its frame has its origin in the corner of the grid and its axes along the grid's.
#[derive(Debug, Clone)]
pub struct MapField {
    /// Side of a cell (m).
    pub(super) resolution: f64,
    pub(super) width: usize,
    pub(super) height: usize,
    /// The grid in the world.
    pub(super) T_world_grid: Pose2,
    pub(super) cells: Vec<Cell>,
    /// Index of the nearest wall; `NONE` in a map without walls.
    nearest: Vec<u32>,
    walls: Vec<Wall>,
}

/// Cells to either side from which the direction of a wall is estimated.
const WALL_REACH: usize = 2;
/// Largest ratio of the variances across and along a wall for which it has a normal: that of cells in a row of five, three thick.
const MAX_WALL_RATIO: f64 = 1.0 / 3.0;

impl MapField {
    /// Prepares a grid.
    pub fn new(grid: &OccupancyGrid) -> Self {
        let (width, height) = (grid.width, grid.height);
        let cells: Vec<Cell> = (0..width * height).map(|index| grid.cell(index % width, index / width)).collect();
        let is_wall: Vec<bool> = cells.iter().map(|cell| *cell == Cell::Occupied).collect();
        let numbers = numbered(&is_wall);
        let nearest_cells = nearest_cells(&is_wall, width, height);
        let nearest =
            nearest_cells.iter().map(|&cell| if cell == NONE { NONE } else { numbers[cell as usize] }).collect();
        let mut field = Self {
            resolution: grid.resolution,
            width,
            height,
            T_world_grid: grid.T_world_grid(),
            cells,
            nearest,
            walls: Vec::new(),
        };
        field.walls = (0..width * height).filter(|&cell| is_wall[cell]).map(|cell| field.wall(cell)).collect();
        field
    }

    /// Whether it has both walls and free space.
    pub fn is_usable(&self) -> bool {
        !self.walls.is_empty() && self.cells.contains(&Cell::Free)
    }

    /// # Errors
    /// A map without walls or without free space.
    pub fn check(&self) -> Result<()> {
        let remedy = "Give a map with both; check negate, occupied_thresh and free_thresh of its YAML file";
        let problem = || Error::whole("The map has no walls or no free space", remedy);
        self.is_usable().then_some(()).ok_or_else(problem)
    }

    /// Number of cells of a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Indices of the free cells.
    pub(super) fn free_cells(&self) -> Vec<usize> {
        (0..self.cells.len()).filter(|&cell| self.cells[cell] == Cell::Free).collect()
    }

    /// The cell that holds a point of the grid's frame; `None` outside.
    pub(super) fn index(&self, point: &Vector2<f64>) -> Option<usize> {
        let (x, y) = ((point.x / self.resolution).floor(), (point.y / self.resolution).floor());
        let is_inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        is_inside.then(|| y as usize * self.width + x as usize)
    }

    /// The wall nearest to the middle of a cell.
    pub(super) fn nearest_wall(&self, cell: usize) -> Option<&Wall> {
        self.walls.get(self.nearest[cell] as usize)
    }

    /// Distance of a point in this cell from the surface of the nearest wall (m), and the variance of that surface (m^2).
    pub(super) fn distance(&self, cell: usize, point: &Vector2<f64>) -> (f64, f64) {
        self.nearest_wall(cell).map_or((f64::INFINITY, 0.0), |wall| {
            let off = point - wall.point;
            // The wall goes on to where the next cell's begins.
            let distance = wall.normal.map_or_else(
                || off.norm(),
                |normal| normal.dot(&off).hypot((normal.perp(&off).abs() - self.resolution).max(0.0)),
            );
            (distance, wall.variance)
        })
    }

    /// The mean of what is told of each wall's variance (m^2).
    pub(super) fn mean_of_walls(&self, told: impl Fn(f64) -> f64) -> f64 {
        self.walls.iter().map(|wall| told(wall.variance)).sum::<f64>() / self.walls.len().max(1) as f64
    }

    /// The wall at an occupied cell, by the occupied cells around it.
    fn wall(&self, cell: usize) -> Wall {
        let (x, y) = (cell % self.width, cell / self.width);
        let range = |at: usize, size: usize| at.saturating_sub(WALL_REACH)..(at + WALL_REACH + 1).min(size);
        let around = || {
            let cells = range(y, self.height).flat_map(|y| range(x, self.width).map(move |x| (x, y)));
            let occupied = cells.filter(|(x, y)| self.cells[y * self.width + x] == Cell::Occupied);
            occupied.map(|(x, y)| Vector2::new(x as f64 + 0.5, y as f64 + 0.5) * self.resolution)
        };
        let count = around().count() as f64;
        let point = around().sum::<Vector2<f64>>() / count;
        let covariance: Matrix2<f64> = around().map(|p| (p - point) * (p - point).transpose()).sum();
        let eigen = covariance.symmetric_eigen();
        let (across, along) = if eigen.eigenvalues[0] <= eigen.eigenvalues[1] { (0, 1) } else { (1, 0) };
        let is_line = count >= 3.0 && eigen.eigenvalues[across] <= MAX_WALL_RATIO * eigen.eigenvalues[along];
        let normal = is_line.then(|| eigen.eigenvectors.column(across).into_owned());
        // The surface is somewhere in its cell, evenly; so is the mean of the cells.
        let variance = eigen.eigenvalues[across].max(0.0) / count + 2.0 * self.resolution * self.resolution / 12.0;
        Wall { point, normal, variance }
    }

    /// A pose in the world, of one in the grid's frame.
    pub fn in_world(&self, T_grid_sensor: &Pose2) -> Pose2 {
        (self.T_world_grid * T_grid_sensor).renormalized()
    }
}

/// The walls' cells numbered in their order.
fn numbered(is_wall: &[bool]) -> Vec<u32> {
    let mut next = 0;
    is_wall
        .iter()
        .map(|&wall| {
            if wall {
                next += 1;
                next - 1
            } else {
                NONE
            }
        })
        .collect()
}
