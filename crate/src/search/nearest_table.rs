//! Nearest points in the plane by a table: for millions of queries, all within one distance.

use nalgebra::Vector2;

use super::Neighbor;

/// Cells of the table to the largest distance: where points are that far from their partners, smaller cells have as many
/// candidates.
const CELLS_PER_DISTANCE: f64 = 16.0;
/// Most cells; a larger target gets larger ones.
const MAX_CELLS: f64 = (1 << 20) as f64;
/// A table that takes more looks at a cell to make than this is not worth its time (about a tenth of a second).
const MAX_LOOKS: f64 = (1 << 25) as f64;

/// Consecutive places along a line, up to `end`, with the same nearest point, or none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// The first place that belongs to the next span.
    pub end: usize,
    /// Index of the nearest point.
    pub nearest: Option<u32>,
}

/// For each cell of a grid the target points that may be the nearest to a place in it, within one distance.
///
/// A point is none of them where another one is nearer to all four corners: the difference of two squared distances is linear, so
/// that it is nearer everywhere in the cell. What is found is what a [`KdTree`](super::KdTree) finds: distances in single
/// precision, of equal ones the smallest index.
#[derive(Debug, Clone)]
pub struct NearestTable {
    corner: Vector2<f64>,
    cells_per_metre: f64,
    width: usize,
    height: usize,
    /// Where the candidates of each cell begin, and of the one past the last.
    starts: Vec<u32>,
    /// Of each cell, whether it has one candidate, and that within the distance from everywhere in it.
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
    /// For finite points (m), of which those within `max_distance` (m) are looked for; `None` where a table would take too long
    /// to make, or would have no size.
    pub fn new(points: &[Vector2<f64>], max_distance: f64) -> Option<Self> {
        let low = points.iter().fold(Vector2::repeat(f64::INFINITY), |low, p| low.inf(p));
        let high = points.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
        let extent = high - low + Vector2::repeat(2.0 * max_distance);
        let side = (max_distance / CELLS_PER_DISTANCE).max((extent.x * extent.y / MAX_CELLS).sqrt());
        let looks = points.len() as f64 * (2.0 * max_distance / side + 2.0).powi(2);
        if !(side > 0.0 && extent.amax() / side < MAX_CELLS && looks <= MAX_LOOKS) {
            return None;
        }
        // One cell more on every side, for rounding.
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

    /// The distance that points are looked for within (m).
    pub fn max_distance(&self) -> f64 {
        self.max_distance
    }

    /// The nearest point to a place within the distance.
    #[inline]
    pub fn nearest(&self, place: &Vector2<f64>) -> Option<Neighbor> {
        self.nearest_of(self.cell(place), place)
    }

    /// `tolerance` (m^2): differences of squared distances in single precision are right to this much.
    fn fill(&mut self, points: &[Vector2<f64>], side: f64, tolerance: f64) {
        let half_diagonal = side * std::f64::consts::FRAC_1_SQRT_2;
        let nearest = self.nearest_to_centers(points, side);
        let mut of_cell: Vec<(u32, u32)> = Vec::new();
        for (index, point) in points.iter().enumerate() {
            self.for_cells_around(point, |cell, center| {
                let (rival, sq_distance) = nearest[cell];
                let reach = sq_distance.sqrt() + 2.0 * half_diagonal;
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
        let mut starts = vec![0; self.width * self.height + 1];
        for &(cell, _) in &of_cell {
            starts[cell as usize + 1] += 1;
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        self.candidates = vec![Candidate { position: [0.0; 2], index: 0 }; of_cell.len()];
        for (cell, index) in of_cell {
            let place = &mut next[cell as usize];
            let point = points[index as usize];
            self.candidates[*place as usize] = Candidate { position: single(&point), index };
            *place += 1;
        }
        let is_sure = |cell: usize| {
            let only = starts[cell + 1] == starts[cell] + 1;
            only && nearest[cell].1.sqrt() + half_diagonal < self.max_distance - tolerance.sqrt()
        };
        self.is_sure = (0..self.width * self.height).map(is_sure).collect();
        self.starts = starts;
    }

    /// The point nearest to each cell's centre, with its squared distance (m^2); `u32::MAX` where none is in reach.
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

    /// Every cell that holds a place within the distance of a point, with its centre.
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

    /// The number of the cell that a place lies in; that of cell 0, which is empty, where it lies in none.
    #[inline]
    fn cell(&self, place: &Vector2<f64>) -> usize {
        let at = (place - self.corner) * self.cells_per_metre;
        let is_inside = at.x >= 0.0 && at.y >= 0.0 && at.x < self.width as f64 && at.y < self.height as f64;
        if is_inside { at.y as usize * self.width + at.x as usize } else { 0 }
    }

    /// The nearest point within the distance among the candidates of the cell that a place lies in.
    #[inline]
    fn nearest_of(&self, cell: usize, place: &Vector2<f64>) -> Option<Neighbor> {
        let query = single(place);
        let limit = self.max_distance as f32;
        let mut best = Neighbor { index: u32::MAX, sq_distance: limit * limit };
        for candidate in &self.candidates[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
            let offset = [candidate.position[0] - query[0], candidate.position[1] - query[1]];
            let sq_distance = offset[0] * offset[0] + offset[1] * offset[1];
            // Candidates stand by their indices: the first of equals stays.
            if sq_distance < best.sq_distance || (sq_distance == best.sq_distance && best.index == u32::MAX) {
                best = Neighbor { index: candidate.index, sq_distance };
            }
        }
        (best.index != u32::MAX).then_some(best)
    }

    /// The nearest points of `start + shift` for each of `shifts`, which go along a line in small steps.
    pub fn along(&self, start: &Vector2<f64>, shifts: &[Vector2<f64>], spans: &mut Vec<Span>) {
        spans.clear();
        let mut push = |end: usize, nearest: Option<u32>| match spans.last_mut() {
            Some(last) if last.nearest == nearest => last.end = end,
            _ => spans.push(Span { end, nearest }),
        };
        for (place, shift) in shifts.iter().enumerate() {
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
            push(place + 1, nearest);
        }
    }
}

/// Bound of the rounding of differences of squared distances (m^2) up to `distance` (m) between coordinates up to `far` (m), in
/// single precision: a few units in the last place of each.
fn rounding(distance: f64, far: f64) -> f64 {
    16.0 * f64::from(f32::EPSILON) * distance * (distance + far)
}

fn corners(center: &Vector2<f64>, side: f64) -> [Vector2<f64>; 4] {
    let half = side / 2.0;
    [(-half, -half), (half, -half), (-half, half), (half, half)].map(|(x, y)| center + Vector2::new(x, y))
}

fn single(point: &Vector2<f64>) -> [f32; 2] {
    [point.x as f32, point.y as f32]
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
            // Equal points, and rows of them, of which many are equally far from a place.
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
