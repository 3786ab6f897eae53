//! Nearest points in the plane within one distance, by a table of candidates for each cell of a grid.
//!
//! The table pays where millions of queries are made.

use nalgebra::Vector2;

use super::Neighbor;
use crate::geometry::algebra::single;

/// Cells along the largest distance. Smaller cells hold as many candidates for queries that are far from all points.
const CELLS_PER_DISTANCE: f64 = 16.0;
/// Most cells of a table; for large extents the cells are made larger.
const MAX_TABLE_CELLS: f64 = (1 << 20) as f64;
/// Most visits of cells while a table is built, about a tenth of a second. Beyond, no table is built.
const MAX_VISITS: f64 = (1 << 25) as f64;

/// Consecutive positions on a line with the same nearest point, or with none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// Index of the first position after the span.
    pub end: usize,
    /// Index of the nearest point; `None` where there is none within the distance.
    pub nearest: Option<u32>,
}

/// For each cell of a grid, the points that may be the nearest to a position in it, within one distance.
///
/// A point is no candidate of a cell where another one is nearer to all four corners: the difference of two squared distances
/// is linear in the position, so the other one is nearer everywhere in the cell. Results are those of a
/// [`KdTree`](super::KdTree): distances in single precision, among equal ones the smallest index.
#[derive(Debug, Clone)]
pub struct NearestTable {
    corner: Vector2<f64>,
    cells_per_metre: f64,
    width: usize,
    height: usize,
    /// Index in `candidates` of the first one of each cell, and the total number at the end.
    starts: Vec<u32>,
    /// Whether each cell has a single candidate, which is within the distance of every position in it.
    is_sure: Vec<bool>,
    candidates: Vec<Candidate>,
    max_distance: f64,
}

#[derive(Debug, Clone, Copy)]
struct Candidate {
    position: [f32; 2],
    index: u32,
}

impl NearestTable {
    /// A table of finite points (m) for queries within `max_distance` (m); `None` where it would take too long to build or
    /// have no extent.
    pub fn new(points: &[Vector2<f64>], max_distance: f64) -> Option<Self> {
        let low = points.iter().fold(Vector2::repeat(f64::INFINITY), |low, p| low.inf(p));
        let high = points.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
        let extent = high - low + Vector2::repeat(2.0 * max_distance);
        let side = (max_distance / CELLS_PER_DISTANCE).max((extent.x * extent.y / MAX_TABLE_CELLS).sqrt());
        let visits = points.len() as f64 * (2.0 * max_distance / side + 2.0).powi(2);
        if !(side > 0.0 && extent.amax() / side < MAX_TABLE_CELLS && visits <= MAX_VISITS) {
            return None;
        }
        // One more cell on every side, for rounding.
        let corner = low - Vector2::repeat(max_distance + side);
        let [width, height] = [extent.x, extent.y].map(|extent| (extent / side) as usize + 3);
        let far = corner.amax().max((corner + extent).amax());
        let mut table = Self {
            corner,
            cells_per_metre: 1.0 / side,
            width,
            height,
            starts: Vec::new(),
            is_sure: Vec::new(),
            candidates: Vec::new(),
            max_distance,
        };
        table.fill(points, side, rounding(max_distance + 2.0 * side, far));
        Some(table)
    }

    /// Largest distance of a result (m).
    pub fn max_distance(&self) -> f64 {
        self.max_distance
    }

    /// The nearest point within the distance of `query` (m).
    #[inline]
    pub fn nearest(&self, query: &Vector2<f64>) -> Option<Neighbor> {
        self.nearest_of(self.cell(query), query)
    }

    /// Finds the candidates of all cells. `tolerance` is the error of differences of squared distances in single precision
    /// (m^2).
    fn fill(&mut self, points: &[Vector2<f64>], side: f64, tolerance: f64) {
        let half_diagonal = side * std::f64::consts::FRAC_1_SQRT_2;
        let nearest = self.nearest_to_centers(points, side);
        let of_cell = self.candidates_of_cells(points, side, &nearest, tolerance);
        let starts = self.store(points, &of_cell);
        let is_sure = |cell: usize| {
            let only = starts[cell + 1] == starts[cell] + 1;
            only && nearest[cell].1.sqrt() + half_diagonal < self.max_distance - tolerance.sqrt()
        };
        self.is_sure = (0..self.width * self.height).map(is_sure).collect();
        self.starts = starts;
    }

    /// Pairs of a cell and the index of a point that may be the nearest to a position in it, in the order of the points.
    fn candidates_of_cells(
        &self,
        points: &[Vector2<f64>],
        side: f64,
        nearest: &[(u32, f64)],
        tolerance: f64,
    ) -> Vec<(u32, u32)> {
        let diagonal = side * std::f64::consts::SQRT_2;
        let mut of_cell: Vec<(u32, u32)> = Vec::new();
        for (index, point) in points.iter().enumerate() {
            self.for_cells_around(point, |cell, center| {
                let (rival, sq_distance) = nearest[cell];
                let reach = sq_distance.sqrt() + diagonal;
                let to_center = (center - point).norm_squared();
                if to_center > reach * reach + tolerance || rival == u32::MAX {
                    return;
                }
                let rival = points[rival as usize];
                let is_beaten = corners(&center, side)
                    .iter()
                    .all(|at| (at - point).norm_squared() > (at - rival).norm_squared() + tolerance);
                if !is_beaten {
                    of_cell.push((cell as u32, index as u32));
                }
            });
        }
        of_cell
    }

    /// Stores the candidates in the order of their cells; returns the index of the first one of each cell.
    fn store(&mut self, points: &[Vector2<f64>], of_cell: &[(u32, u32)]) -> Vec<u32> {
        let mut starts = vec![0; self.width * self.height + 1];
        for &(cell, _) in of_cell {
            starts[cell as usize + 1] += 1;
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        self.candidates = vec![Candidate { position: [0.0; 2], index: 0 }; of_cell.len()];
        for &(cell, index) in of_cell {
            let slot = &mut next[cell as usize];
            let point = points[index as usize];
            self.candidates[*slot as usize] = Candidate { position: single(&point), index };
            *slot += 1;
        }
        starts
    }

    /// The index of the point nearest to each cell's centre, with its squared distance (m^2); `u32::MAX` where no point is
    /// within the distance.
    fn nearest_to_centers(&self, points: &[Vector2<f64>], side: f64) -> Vec<(u32, f64)> {
        let reach = self.max_distance + side;
        let mut nearest = vec![(u32::MAX, reach * reach); self.width * self.height];
        for (index, point) in points.iter().enumerate() {
            self.for_cells_around(point, |cell, center| {
                let sq_distance = (center - point).norm_squared();
                if sq_distance < nearest[cell].1 {
                    nearest[cell] = (index as u32, sq_distance);
                }
            });
        }
        nearest
    }

    /// Calls `visit` with every cell that holds a position within the distance of a point, and with the cell's centre.
    fn for_cells_around(&self, point: &Vector2<f64>, mut visit: impl FnMut(usize, Vector2<f64>)) {
        let side = 1.0 / self.cells_per_metre;
        let reach = Vector2::repeat(self.max_distance + side / 2.0);
        let first = ((point - reach - self.corner) / side).map(|x| x.max(0.0) as usize);
        let last = ((point + reach - self.corner) / side).map(|x| x as usize);
        for y in first.y..=last.y.min(self.height - 1) {
            for x in first.x..=last.x.min(self.width - 1) {
                let center = self.corner + Vector2::new(x as f64 + 0.5, y as f64 + 0.5) * side;
                visit(y * self.width + x, center);
            }
        }
    }

    /// Index of the cell that `query` lies in; outside the grid that of cell 0, which has no candidates.
    #[inline]
    fn cell(&self, query: &Vector2<f64>) -> usize {
        let at = (query - self.corner) * self.cells_per_metre;
        let is_inside = at.x >= 0.0 && at.y >= 0.0 && at.x < self.width as f64 && at.y < self.height as f64;
        if is_inside { at.y as usize * self.width + at.x as usize } else { 0 }
    }

    /// The nearest point within the distance of `query` among the candidates of its cell.
    #[inline]
    fn nearest_of(&self, cell: usize, query: &Vector2<f64>) -> Option<Neighbor> {
        let query = single(query);
        let limit = self.max_distance as f32;
        let mut best = Neighbor { index: u32::MAX, sq_distance: limit * limit };
        for candidate in &self.candidates[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
            let offset = [candidate.position[0] - query[0], candidate.position[1] - query[1]];
            let sq_distance = offset[0] * offset[0] + offset[1] * offset[1];
            // Candidates are sorted by index: among equal distances the first one is kept.
            if sq_distance < best.sq_distance || (sq_distance == best.sq_distance && best.index == u32::MAX) {
                best = Neighbor { index: candidate.index, sq_distance };
            }
        }
        (best.index != u32::MAX).then_some(best)
    }

    /// Replaces the content of `spans` by the nearest points of `start + shift` for each of `shifts`, small steps on a line.
    pub fn along(&self, start: &Vector2<f64>, shifts: &[Vector2<f64>], spans: &mut Vec<Span>) {
        spans.clear();
        let mut push = |end: usize, nearest: Option<u32>| match spans.last_mut() {
            Some(last) if last.nearest == nearest => last.end = end,
            _ => spans.push(Span { end, nearest }),
        };
        for (step, shift) in shifts.iter().enumerate() {
            let moved = start + shift;
            let cell = self.cell(&moved);
            let first = self.starts[cell] as usize;
            let nearest = if self.is_sure[cell] {
                Some(self.candidates[first].index)
            } else if self.starts[cell + 1] as usize == first {
                None
            } else {
                self.nearest_of(cell, &moved).map(|nearest| nearest.index)
            };
            push(step + 1, nearest);
        }
    }
}

/// Bound of the rounding error (m^2) of differences of squared distances in single precision, for distances up to `distance`
/// (m) between coordinates up to `far` (m): a few units in the last place of each.
fn rounding(distance: f64, far: f64) -> f64 {
    16.0 * f64::from(f32::EPSILON) * distance * (distance + far)
}

fn corners(center: &Vector2<f64>, side: f64) -> [Vector2<f64>; 4] {
    let half = side / 2.0;
    [(-half, -half), (half, -half), (-half, half), (half, half)].map(|(x, y)| center + Vector2::new(x, y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::KdTree;

    #[test]
    fn finds_what_the_tree_finds() {
        let mut state = 11_u64;
        let mut random = |scale: f64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * scale
        };
        for (count, extent, max_distance) in [(1, 1.0, 0.5), (300, 8.0, 0.5), (300, 8.0, 5.0), (2000, 100.0, 0.5)] {
            let mut points: Vec<Vector2<f64>> =
                (0..count).map(|_| Vector2::new(random(extent), random(extent))).collect();
            // Equal points, and a lattice, of which many points are equally far from a query.
            points.push(points[0]);
            points.extend((0..40).map(|i| Vector2::new(f64::from(i % 8), f64::from(i / 8)) * 0.125));
            let tree = KdTree::build(&points.iter().map(single).collect::<Vec<_>>());
            let table = NearestTable::new(&points, max_distance).expect("a table");
            let mut found = 0;
            for nth in 0..20_000 {
                let mut place = Vector2::new(random(1.3 * extent), random(1.3 * extent));
                if nth % 2 == 0 {
                    place = place.map(|x| (x * 16.0).round() / 16.0);
                }
                let expected = tree.nearest(&single(&place), max_distance as f32);
                assert_eq!(table.nearest(&place), expected, "{place} of {count} within {max_distance} m");
                found += usize::from(expected.is_some());
            }
            assert!(found > 100, "{found} have a neighbour");
            let (start, step) = (points[0] - Vector2::new(1.0, 0.01), Vector2::new(0.013, 0.0));
            let shifts: Vec<Vector2<f64>> = (0..200).map(|i| step * f64::from(i)).collect();
            let mut spans = Vec::new();
            table.along(&start, &shifts, &mut spans);
            let along =
                spans.iter().scan(0, |first, span| Some((std::mem::replace(first, span.end)..span.end, span.nearest)));
            let along: Vec<Option<u32>> = along.flat_map(|(places, nearest)| places.map(move |_| nearest)).collect();
            let one_by_one = shifts.iter().map(|shift| table.nearest(&(start + shift)).map(|nearest| nearest.index));
            assert_eq!(along, one_by_one.collect::<Vec<_>>());
        }
        assert!(NearestTable::new(&[], 0.5).is_none() && NearestTable::new(&[Vector2::zeros()], 0.0).is_none());
        assert!(NearestTable::new(&[Vector2::zeros()], f64::INFINITY).is_none());
    }
}
