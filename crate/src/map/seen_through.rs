//! What moved: surfaces that later sweeps see through.
//!
//! Space is divided into cells. A sweep with a point in a cell says that something is there; one whose rays past the cell all end behind it
//! says that nothing is. Cells change from one state to the other by Page's test, "Continuous inspection schemes", Biometrika 41 (1954): the
//! sum of the log likelihood ratios, of which nothing is kept that speaks for the state that the cell is in already.

use nalgebra::Vector3;
use rustc_hash::FxHashMap;

use crate::geometry::{PointCloud, Pose3, RigidMotion};
use crate::preprocess::voxel_hash::{Voxel, VoxelHash};
use crate::registration::free_space::sphere::SphericalView;

/// Share of the sweeps that say the wrong thing of a cell: at most 0.003 in `cargo measure moving`, where nothing moves; poses and
/// surfaces of recordings are worse.
const WRONG_SHARE: f64 = 0.02;
/// Share of the cells at rest that may be found empty.
const MAX_FALSE: f64 = 1e-3;
/// Sweeps say something of cells up to this distance (sides of a cell): these then fill half of a cell of the sweep's view, of which nine
/// must agree. Beyond it, posts are missed by neighbouring beams.
const REACH: f64 = 45.0;
/// Cells along the side of a block.
const BLOCK_SIDE: i32 = 8;

/// Cells of space, and what sweeps have said of each.
pub(crate) struct SeenThrough {
    hash: VoxelHash,
    cells: Vec<Cell>,
    /// Numbers of the cells in each block.
    blocks: FxHashMap<Voxel, Vec<u32>>,
    /// Sweeps that must contradict the state of a cell, beyond those that agree with it.
    num_deciding: u8,
    tolerance: f64,
}

/// A cell that a sweep had a point in.
struct Cell {
    corner: Voxel,
    /// The last sweep with a point in it.
    last_seen: u32,
    /// The sweep by which it was last found empty, ...
    emptied_at: u32,
    /// ... as it is now.
    is_empty: bool,
    /// Sweeps that contradict its state, less those that agree since.
    num_contradictions: u8,
}

impl SeenThrough {
    /// Without sweeps, of which there will be so many; `voxel_size`: side of a cell (m), `tolerance`: what lies less in front of what a sweep
    /// saw is not seen through (m).
    pub(crate) fn new(voxel_size: f64, tolerance: f64, num_sweeps: usize) -> Self {
        // Of n tests a share of n exp(-threshold) decides wrongly at most (Lorden, "Procedures for reacting to a change in distribution",
        // Annals of Mathematical Statistics 42 (1971)).
        let threshold = (num_sweeps.max(1) as f64 / MAX_FALSE).ln();
        let num_deciding = (threshold / ((1.0 - WRONG_SHARE) / WRONG_SHARE).ln()).ceil() as u8;
        let (hash, cells, blocks) = (VoxelHash::new(voxel_size), Vec::new(), FxHashMap::default());
        Self { hash, cells, blocks, num_deciding, tolerance }
    }

    /// Adds the sweep of this number, later than the ones before, from where it was measured.
    pub(crate) fn add(&mut self, number: u32, sweep: &PointCloud, T_world_sensor: &Pose3) {
        let points: Vec<Vector3<f64>> =
            sweep.positions.iter().map(|point| Vector3::from(point.as_dvec3().to_array())).collect();
        let reach = REACH * self.hash.voxel_size();
        for point in &points {
            self.see(number, &T_world_sensor.act(point), point.norm_squared() <= reach * reach);
        }
        let (view, T_sensor_world) = (SphericalView::new(&points, Vector3::zeros()), T_world_sensor.inverse());
        for index in self.near(&T_world_sensor.translation.vector, reach) {
            let cell = &mut self.cells[index as usize];
            let corner = Vector3::from(cell.corner.map(f64::from));
            let middle = T_sensor_world.act(&(corner.add_scalar(0.5) * self.hash.voxel_size()));
            if cell.last_seen != number
                && middle.norm_squared() <= reach * reach
                && view.is_surrounded_by_free_space(&middle, self.tolerance)
            {
                cell.tell(number, true, self.num_deciding);
            }
        }
    }

    /// A sweep has a point here; `is_near`: within reach.
    fn see(&mut self, number: u32, point: &Vector3<f64>, is_near: bool) {
        let Some(corner) = self.hash.voxel(point) else { return };
        let index = self.hash.insert(corner);
        if index as usize == self.cells.len() {
            let (emptied_at, is_empty, num_contradictions) = (0, false, 0);
            self.cells.push(Cell { corner, last_seen: number, emptied_at, is_empty, num_contradictions });
            self.blocks.entry(corner.map(|x| x.div_euclid(BLOCK_SIDE))).or_default().push(index);
            return;
        }
        let cell = &mut self.cells[index as usize];
        if std::mem::replace(&mut cell.last_seen, number) != number && is_near {
            cell.tell(number, false, self.num_deciding);
        }
    }

    /// Numbers of the cells in blocks that are within reach of a position (m).
    fn near(&self, center: &Vector3<f64>, reach: f64) -> Vec<u32> {
        let side = f64::from(BLOCK_SIDE) * self.hash.voxel_size();
        let [low, high] = [-reach, reach].map(|off| center.map(|x| ((x + off) / side).floor() as i32));
        let along = |axis: usize| low[axis]..=high[axis];
        let blocks = along(0).flat_map(|x| along(1).flat_map(move |y| along(2).map(move |z| [x, y, z])));
        blocks.filter_map(|block| self.blocks.get(&block)).flatten().copied().collect()
    }

    /// Whether nothing is any more where the sweep of this number had a point (world frame).
    pub(crate) fn has_gone(&self, number: u32, point: &Vector3<f64>) -> bool {
        let index = self.hash.voxel(point).and_then(|corner| self.hash.number(&corner));
        index.map(|index| &self.cells[index as usize]).is_some_and(|cell| cell.is_empty || number < cell.emptied_at)
    }
}

impl Cell {
    /// A sweep says whether it is empty.
    fn tell(&mut self, number: u32, is_empty: bool, num_deciding: u8) {
        if is_empty == self.is_empty {
            self.num_contradictions = self.num_contradictions.saturating_sub(1);
            return;
        }
        self.num_contradictions += 1;
        if self.num_contradictions == num_deciding {
            (self.is_empty, self.num_contradictions) = (is_empty, 0);
            self.emptied_at = if is_empty { number } else { self.emptied_at };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall 4 m ahead, and a panel in front of it where there is one at this distance (m).
    fn sweep(panel: Option<f32>) -> PointCloud {
        let grid = |half: i32, step: f32, x: f32| {
            (-half..=half)
                .flat_map(move |y| (-half..=half).map(move |z| glam::Vec3::new(x, step * y as f32, step * z as f32)))
        };
        let panel = panel.into_iter().flat_map(|x| grid(8, 0.05, x));
        PointCloud::from_positions(grid(60, 0.05, 4.0).chain(panel).collect())
    }

    #[test]
    fn what_was_there_for_a_while_has_gone_and_what_came_to_stay_has_not() {
        let mut search = SeenThrough::new(0.1, 0.3, 40);
        let panel_at = |number: u32| match number {
            5..10 => Some(2.0),
            20.. => Some(3.0),
            _ => None,
        };
        for number in 0..40 {
            search.add(number, &sweep(panel_at(number)), &Pose3::identity());
        }
        let has_gone = |number, x| search.has_gone(number, &Vector3::new(x, 0.05, 0.05));
        assert!(has_gone(5, 2.0) && has_gone(9, 2.0));
        assert!(!has_gone(5, 3.0) && !has_gone(30, 3.0) && !has_gone(5, 4.0) && !has_gone(5, 1.0));
    }

    #[test]
    fn a_few_sweeps_that_miss_a_surface_do_not_make_it_vanish() {
        let mut search = SeenThrough::new(0.1, 0.3, 40);
        for number in 0..40 {
            search.add(number, &sweep((number % 2 == 0).then_some(2.0)), &Pose3::identity());
        }
        assert!(!search.has_gone(0, &Vector3::new(2.0, 0.05, 0.05)));
    }
}
