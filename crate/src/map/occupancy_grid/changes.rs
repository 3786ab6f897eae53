//! What changed between two grids of one place.

use std::collections::HashMap;

use nalgebra::Vector2;
use serde::Serialize;

use super::{Cell, LOG_ODDS_HIT, OccupancyGrid};
use crate::geometry::connected_parts::connected_parts;

/// What became of a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum ChangeKind {
    /// Something stands where it was free.
    New,
    /// It is free where something stood.
    Gone,
}

/// Neighbouring cells that changed in the same way.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Change {
    /// What became of them.
    pub kind: ChangeKind,
    /// Their middle, x and y (m, world frame).
    pub middle: [f64; 2],
    /// The larger side of their box (m).
    pub size: f64,
    /// The middle of each, x and y (m, world frame).
    pub cells: Vec<[f64; 2]>,
}

/// Two grids of one map are off from each other by up to this many cells, a wall's thickness in cells included.
const SLACK: isize = 3;
/// A wall counts where the returns outweigh the beams through it by this many: one person who passes leaves fewer in most cells.
const MIN_HITS: f32 = 3.0;
/// Fewer neighbouring cells are no object: they are what noise leaves.
const MIN_CELLS: usize = 4;

impl OccupancyGrid {
    /// What changed from this grid to a later one of the same map, both with cells of one side and without a turn: what is occupied
    /// in one is free in the other, and no wall of that is near. The largest first.
    pub fn changes(&self, later: &Self) -> Vec<Change> {
        let gone = self.objects_not_in(later, ChangeKind::Gone);
        let new = later.objects_not_in(self, ChangeKind::New);
        let mut all: Vec<Change> = gone.into_iter().chain(new).collect();
        all.sort_by_key(|change| std::cmp::Reverse(change.cells.len()));
        all
    }

    fn objects_not_in(&self, other: &Self, kind: ChangeKind) -> Vec<Change> {
        let cells = self.cells_not_in(other);
        let numbers: HashMap<(usize, usize), usize> = cells.iter().enumerate().map(|(i, &cell)| (cell, i)).collect();
        let neighbors = |&(x, y): &(usize, usize)| [(x + 1, y), (x, y + 1), (x + 1, y + 1), (x.wrapping_sub(1), y + 1)];
        let edges = cells.iter().enumerate().flat_map(|(i, cell)| {
            let joined = neighbors(cell).into_iter().filter_map(|neighbor| numbers.get(&neighbor).copied());
            joined.map(move |j| [i, j]).collect::<Vec<_>>()
        });
        let parts = connected_parts(cells.len(), edges);
        let mut members: HashMap<usize, Vec<[f64; 2]>> = HashMap::new();
        for (&(x, y), part) in cells.iter().zip(parts) {
            let middle = self.origin + Vector2::new(x as f64 + 0.5, y as f64 + 0.5) * self.resolution;
            members.entry(part).or_default().push(middle.into());
        }
        let mut objects: Vec<(usize, Vec<[f64; 2]>)> =
            members.into_iter().filter(|(_, cells)| cells.len() >= MIN_CELLS).collect();
        objects.sort_by_key(|(part, _)| *part);
        objects.into_iter().map(|(_, cells)| change(kind, cells, self.resolution)).collect()
    }

    /// The cells that are clearly occupied here, free in another grid, and there not near anything occupied or unknown.
    fn cells_not_in(&self, other: &Self) -> Vec<(usize, usize)> {
        let offset = ((self.origin - other.origin) / self.resolution).map(|value| value.round() as isize);
        let is_free_around = |x: usize, y: usize| {
            let mut around = (-SLACK..=SLACK).flat_map(|dy| (-SLACK..=SLACK).map(move |dx| (dx, dy)));
            around.all(|(dx, dy)| {
                let x = x.checked_add_signed(offset.x + dx).filter(|&x| x < other.width);
                let y = y.checked_add_signed(offset.y + dy).filter(|&y| y < other.height);
                x.zip(y).is_some_and(|(x, y)| other.cell(x, y) == Cell::Free)
            })
        };
        let is_clear = |&(x, y): &(usize, usize)| {
            self.log_odds[y * self.width + x] >= MIN_HITS * LOG_ODDS_HIT && is_free_around(x, y)
        };
        (0..self.height).flat_map(|y| (0..self.width).map(move |x| (x, y))).filter(is_clear).collect()
    }
}

fn change(kind: ChangeKind, cells: Vec<[f64; 2]>, resolution: f64) -> Change {
    let (mut low, mut high, mut sum) =
        (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY), Vector2::zeros());
    for cell in cells.iter().map(|&cell| Vector2::from(cell)) {
        (low, high, sum) = (low.inf(&cell), high.sup(&cell), sum + cell);
    }
    let middle = sum / cells.len() as f64;
    Change { kind, middle: middle.into(), size: (high - low).amax() + resolution, cells }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Pose2, RigidMotion};
    use crate::map::occupancy_grid::RESOLUTION;
    use crate::preprocess::planar_scan::PlanarScan;

    /// The four sides of an upright square.
    fn square(middle: [f64; 2], half: f64) -> Vec<[Vector2<f64>; 2]> {
        let corner = |x: f64, y: f64| Vector2::new(middle[0] + x * half, middle[1] + y * half);
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        (0..4).map(|side| [corners[side], corners[(side + 1) % 4]]).collect()
    }

    /// A room of 8 m with a box of 0.5 m at each of some places, seen from nine poses that are off by a few centimetres in turn.
    fn grid(boxes: &[[f64; 2]], off: f64) -> OccupancyGrid {
        let walls: Vec<_> =
            square([0.0, 0.0], 4.0).into_iter().chain(boxes.iter().flat_map(|&at| square(at, 0.25))).collect();
        let cast = |from: &Vector2<f64>, along: &Vector2<f64>| {
            let hit = |[a, b]: &[Vector2<f64>; 2]| {
                let wall = b - a;
                let scale = along.perp(&wall);
                let (range, share) = ((a - from).perp(&wall) / scale, (a - from).perp(along) / scale);
                (range > 0.0 && (0.0..=1.0).contains(&share)).then_some(range)
            };
            along * walls.iter().filter_map(hit).fold(f64::INFINITY, f64::min)
        };
        let poses = (0..9).map(|i| Vector2::new(f64::from(i % 3 - 1) * 0.8, f64::from(i / 3 - 1) * 0.8 - 2.0));
        let scan = |from: Vector2<f64>| {
            let beams = (0..720).map(|beam| Pose2::new(Vector2::zeros(), f64::from(beam).to_radians() / 2.0));
            let points = beams.map(|turn| cast(&from, &turn.act(&Vector2::x()))).filter(|p| p.norm() < 30.0).collect();
            (PlanarScan::new(points), Pose2::new(from + Vector2::new(off, -off), 0.0))
        };
        let scans: Vec<_> = poses.map(scan).collect();
        let placed: Vec<_> = scans.iter().map(|(scan, pose)| (scan, *pose)).collect();
        OccupancyGrid::new(&placed, &[], RESOLUTION)
    }

    #[test]
    fn a_box_that_was_moved_is_gone_at_one_place_and_new_at_the_other() {
        let before = grid(&[[-1.5, 1.0], [2.0, 1.0]], 0.0);
        let later = grid(&[[0.2, 1.0], [2.0, 1.0]], 0.06);
        let found = before.changes(&later);
        // The far sides are not seen, and a corner may part those that are.
        for (kind, at) in [(ChangeKind::Gone, [-1.5, 1.0]), (ChangeKind::New, [0.2, 1.0])] {
            let of_kind: Vec<&Change> = found.iter().filter(|change| change.kind == kind).collect();
            let off = |change: &&Change| (Vector2::from(change.middle) - Vector2::from(at)).norm();
            assert!(of_kind.iter().all(|change| off(change) < 0.4), "{of_kind:?}");
            assert!(of_kind.first().is_some_and(|largest| (0.4..0.7).contains(&largest.size)), "{of_kind:?}");
        }
    }

    #[test]
    fn the_same_room_seen_again_a_little_off_has_not_changed() {
        let boxes = [[-1.5, 1.0], [2.0, 1.0]];
        assert_eq!(grid(&boxes, 0.0).changes(&grid(&boxes, 0.08)), []);
        assert_eq!(grid(&boxes, 0.0).changes(&OccupancyGrid::new(&[], &[], RESOLUTION)), []);
    }
}
