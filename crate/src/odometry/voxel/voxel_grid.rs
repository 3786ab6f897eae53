//! Nearest neighbours in a map that grows: a hash table of cells, each with a list of the points in it.
//!
//! Adding a point and finding one both take a time that does not depend on the size of the map, as with the voxel hash
//! of Vizzo et al. 2023, section III-C. Unlike there, the search is exact: it goes outwards cell by cell until no nearer point
//! can be left.

use nalgebra::Vector3;

use crate::preprocess::voxel_hash::VoxelHash;
use crate::search::Neighbor;

/// A point, by its number, and the voxel of its cell that it lies in.
#[derive(Debug, Clone, Copy)]
struct Entry {
    voxel: u16,
    point: u32,
}

/// Cells of a few voxels a side.
#[derive(Debug, Clone)]
pub(super) struct VoxelGrid {
    /// Voxels along a side of a cell.
    width: i32,
    /// The voxel of a point, and the index of each cell in `cells`.
    hash: VoxelHash,
    cells: Vec<Cell>,
}

/// The points of a cell, and where it lies, counted in cells.
#[derive(Debug, Clone)]
struct Cell {
    corner: [i32; 3],
    entries: Vec<Entry>,
}

/// Largest number of points a voxel with which cells are wide: few cells to look into, whose lists are still short.
const FEW_POINTS: usize = 2;
/// Width of such a cell (voxels), ...
const WIDE_CELL_VOXELS: i32 = 4;
/// ... and of one with more points.
const NARROW_CELL_VOXELS: i32 = 2;
/// Width of a cell in spacings of the points, where these are wider than voxels: most cells would be empty otherwise.
const CELL_SPACINGS: f64 = 4.0;
/// The voxels of a cell are numbered with 16 bits.
const MAX_CELL_VOXELS: i32 = 40;

impl VoxelGrid {
    /// A grid without points; `voxel_size` (m) is positive, `spacing` (m) is how far apart the points of a frame lie, roughly.
    pub(super) fn new(voxel_size: f64, points_per_voxel: usize, spacing: f64) -> Self {
        let narrowest = if points_per_voxel <= FEW_POINTS { WIDE_CELL_VOXELS } else { NARROW_CELL_VOXELS };
        let width = ((CELL_SPACINGS * spacing / voxel_size).ceil() as i32).clamp(narrowest, MAX_CELL_VOXELS);
        Self { width, hash: VoxelHash::new(voxel_size), cells: Vec::new() }
    }

    /// Forgets all points.
    pub(super) fn clear(&mut self) {
        self.hash.clear();
        self.cells.clear();
    }

    /// The cell of a point and its voxel in it; `None` where it is not finite or too far away.
    fn place(&self, point: &Vector3<f64>) -> Option<([i32; 3], u16)> {
        let voxel = self.hash.voxel(point)?;
        let [x, y, z] = voxel.map(|v| v.rem_euclid(self.width));
        Some((voxel.map(|v| v.div_euclid(self.width)), ((z * self.width + y) * self.width + x) as u16))
    }

    /// The points of a cell that has some.
    fn entries(&self, cell: &[i32; 3]) -> Option<&[Entry]> {
        self.hash.number(cell).map(|index| self.cells[index as usize].entries.as_slice())
    }

    /// The numbers of the points in the voxel of a point, in the order in which they came, into `found`. Whether there is
    /// such a voxel.
    pub(super) fn voxel_of(&self, point: &Vector3<f64>, found: &mut Vec<u32>) -> bool {
        found.clear();
        let Some((cell, voxel)) = self.place(point) else { return false };
        let entries = self.entries(&cell).unwrap_or_default();
        found.extend(entries.iter().filter(|entry| entry.voxel == voxel).map(|entry| entry.point));
        true
    }

    /// Adds a point by its number. Points out of reach are not found again.
    pub(super) fn insert(&mut self, point: &Vector3<f64>, number: u32) {
        if let Some((cell, voxel)) = self.place(point) {
            let index = self.hash.insert(cell) as usize;
            if index == self.cells.len() {
                self.cells.push(Cell { corner: cell, entries: Vec::new() });
            }
            self.cells[index].entries.push(Entry { voxel, point: number });
        }
    }

    /// Makes a point the last one of its voxel.
    pub(super) fn make_last(&mut self, point: &Vector3<f64>, number: u32) {
        let Some((cell, voxel)) = self.place(point) else { return };
        let Some(index) = self.hash.number(&cell) else { return };
        let entries = &mut self.cells[index as usize].entries;
        entries.retain(|entry| entry.point != number);
        entries.push(Entry { voxel, point: number });
    }

    /// The nearest of `points` within `max_distance` (m); of equal distances the smallest number wins.
    pub(super) fn nearest(&self, points: &[Vector3<f64>], query: &Vector3<f64>, max_distance: f64) -> Option<Neighbor> {
        let (center, _) = self.place(query)?;
        let side = self.hash.voxel_size() * f64::from(self.width);
        let to_wall = distance_to_wall(query, center, side);
        let mut search = NearestSearch { points, query, side, best: None, limit: max_distance * max_distance };
        for layer in 0_i32.. {
            let nearest_possible = if layer == 0 { 0.0 } else { to_wall + f64::from(layer - 1) * side };
            if nearest_possible * nearest_possible > search.limit {
                break;
            }
            if (2 * layer as usize + 1).pow(2) > self.cells.len() {
                // The map is smaller than what is left to search: all of it is quicker.
                for Cell { corner, entries } in &self.cells {
                    if search.reaches(*corner) {
                        search.visit(entries);
                    }
                }
                break;
            }
            for_each_of_layer(layer, |offset| {
                let cell: [i32; 3] = std::array::from_fn(|axis| center[axis].saturating_add(offset[axis]));
                if search.reaches(cell)
                    && let Some(entries) = self.entries(&cell)
                {
                    search.visit(entries);
                }
            });
        }
        search.best.map(|(sq_distance, index)| Neighbor { index, sq_distance: sq_distance as f32 })
    }
}

/// The search for the point nearest to a query.
struct NearestSearch<'a> {
    points: &'a [Vector3<f64>],
    query: &'a Vector3<f64>,
    /// Side of a cell (m).
    side: f64,
    /// The nearest point so far: its squared distance (m^2) and its number.
    best: Option<(f64, u32)>,
    /// Largest squared distance (m^2) of the nearest point: that of the nearest so far, if there is one.
    limit: f64,
}

impl NearestSearch<'_> {
    /// Whether a cell lies near enough to hold the nearest point.
    fn reaches(&self, cell: [i32; 3]) -> bool {
        sq_distance_to_cell(self.query, cell, self.side) <= self.limit
    }

    /// Compares the points of a cell with the nearest so far.
    fn visit(&mut self, entries: &[Entry]) {
        for entry in entries {
            let sq_distance = (self.points[entry.point as usize] - self.query).norm_squared();
            let wins = match self.best {
                None => sq_distance <= self.limit,
                Some((nearest, number)) => sq_distance < nearest || (sq_distance == nearest && entry.point < number),
            };
            if wins {
                (self.best, self.limit) = (Some((sq_distance, entry.point)), sq_distance);
            }
        }
    }
}

/// Distance (m) of a point from the nearest wall of its cell, which bounds the distance of every further layer of cells.
fn distance_to_wall(point: &Vector3<f64>, cell: [i32; 3], side: f64) -> f64 {
    (0..3)
        .map(|axis| {
            let inside = point[axis] - f64::from(cell[axis]) * side;
            inside.min(side - inside).max(0.0)
        })
        .fold(f64::INFINITY, f64::min)
}

fn sq_distance_to_cell(query: &Vector3<f64>, cell: [i32; 3], side: f64) -> f64 {
    (0..3)
        .map(|axis| {
            let low = f64::from(cell[axis]) * side;
            let outside = (low - query[axis]).max(query[axis] - low - side).max(0.0);
            outside * outside
        })
        .sum()
}

/// The cells that are `layer` away along one axis at least, and no more along any.
fn for_each_of_layer(layer: i32, mut visit: impl FnMut([i32; 3])) {
    for z in -layer..=layer {
        for y in -layer..=layer {
            if z.abs() == layer || y.abs() == layer {
                for x in -layer..=layer {
                    visit([x, y, z]);
                }
            } else {
                visit([-layer, y, z]);
                visit([layer, y, z]);
            }
        }
    }
}

// The synthetic worlds link this crate once more, which the browser's linker refuses.
#[cfg(not(target_arch = "wasm32"))]
#[cfg(test)]
mod tests {
    use super::*;
    use scanstitch_scene::random::Random;

    #[test]
    fn finds_what_looking_at_every_point_finds() {
        let mut random = Random::new(11);
        let mut point = || Vector3::from_fn(|_, _| random.normal());
        let points: Vec<Vector3<f64>> = (0..2000).map(|_| point()).collect();
        let queries: Vec<Vector3<f64>> = (0..500).map(|_| 1.5 * point()).collect();
        for (voxel_size, points_per_voxel, spacing) in [(0.05, 1, 0.0), (0.1, 20, 0.05), (3.0, 20, 0.2), (0.01, 1, 0.2)]
        {
            let mut grid = VoxelGrid::new(voxel_size, points_per_voxel, spacing);
            (0..).zip(&points).for_each(|(number, point)| grid.insert(point, number));
            for max_distance in [0.05, 0.4, 2.0] {
                for query in &queries {
                    let nearest = (0..).zip(&points).map(|(number, point)| ((point - query).norm_squared(), number));
                    let expected: Option<(f64, u32)> = nearest
                        .filter(|(sq_distance, _)| *sq_distance <= max_distance * max_distance)
                        .min_by(|a, b| a.partial_cmp(b).unwrap());
                    let found = grid.nearest(&points, query, max_distance);
                    assert_eq!(found.map(|found| found.index), expected.map(|(_, number)| number));
                }
            }
        }
    }

    #[test]
    fn strays_are_no_part_of_it() {
        let mut grid = VoxelGrid::new(0.1, 1, 0.0);
        let strays = [Vector3::new(f64::NAN, 0.0, 0.0), Vector3::new(1e30, 0.0, 0.0), Vector3::new(0.0, 0.0, 1.0)];
        (0..).zip(&strays).for_each(|(number, stray)| grid.insert(stray, number));
        assert_eq!(grid.nearest(&strays, &Vector3::zeros(), 100.0).unwrap().index, 2);
        assert_eq!(grid.nearest(&strays, &strays[0], 100.0), None);
        let mut found = Vec::new();
        assert!(!grid.voxel_of(&strays[1], &mut found) && grid.voxel_of(&strays[2], &mut found));
        assert_eq!(found, [2]);
    }
}
