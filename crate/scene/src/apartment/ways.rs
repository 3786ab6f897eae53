//! The free space of the flat, in which the camera can walk.

use std::collections::VecDeque;

use nalgebra::Vector2;

use super::super::space::Solid;
use super::plan::Rectangle;

/// What lies in this range of heights stands in the way (m): not what one steps over, not what hangs high.
const IN_THE_WAY: [f64; 2] = [0.05, 1.75];

/// The floor in small squares.
#[derive(Debug, Clone)]
pub struct Ways {
    side: f64,
    columns: usize,
    rows: usize,
    blocked: Vec<bool>,
}

/// The boxes around what stands in the way, seen from above.
pub fn obstacles(solids: &[Solid]) -> impl Iterator<Item = Rectangle> {
    solids.iter().filter_map(|solid| {
        let (low, high) = solid.bounds();
        (low.z < IN_THE_WAY[1] && high.z > IN_THE_WAY[0]).then(|| Rectangle { low: low.xy(), high: high.xy() })
    })
}

impl Ways {
    /// A floor from (0, 0) to `size` in squares of this side (m), all of it free.
    pub fn new(size: Vector2<f64>, side: f64) -> Self {
        let (columns, rows) = ((size.x / side).ceil() as usize, (size.y / side).ceil() as usize);
        Self { side, columns, rows, blocked: vec![false; columns * rows] }
    }

    /// Nothing wider than this radius passes the rectangle (m).
    pub fn block(&mut self, obstacle: &Rectangle, radius: f64) {
        let around = obstacle.grown(radius);
        let first = |value: f64| (value / self.side).floor().max(0.0) as usize;
        for row in first(around.low.y)..self.rows.min(first(around.high.y) + 1) {
            for column in first(around.low.x)..self.columns.min(first(around.high.x) + 1) {
                let cell = row * self.columns + column;
                self.blocked[cell] |= obstacle.distance(&self.middle(cell)) < radius;
            }
        }
    }

    /// The square that a point lies in.
    pub fn cell(&self, point: &Vector2<f64>) -> Option<usize> {
        let (column, row) = ((point.x / self.side).floor(), (point.y / self.side).floor());
        let inside = column >= 0.0 && row >= 0.0 && column < self.columns as f64 && row < self.rows as f64;
        inside.then(|| row as usize * self.columns + column as usize)
    }

    /// The middle of a square (m).
    pub fn middle(&self, cell: usize) -> Vector2<f64> {
        Vector2::new((cell % self.columns) as f64 + 0.5, (cell / self.columns) as f64 + 0.5) * self.side
    }

    /// Whether one can stand here.
    pub fn is_free(&self, point: &Vector2<f64>) -> bool {
        self.cell(point).is_some_and(|cell| !self.blocked[cell])
    }

    /// Whether one can go straight from here to there.
    pub fn is_free_between(&self, from: &Vector2<f64>, to: &Vector2<f64>) -> bool {
        let steps = ((to - from).norm() / (0.5 * self.side)).ceil().max(1.0);
        (0..=steps as usize).all(|step| self.is_free(&from.lerp(to, step as f64 / steps)))
    }

    /// Squares to go from a point to every square, `u32::MAX` where there is no way; diagonals count as one and a half.
    pub fn distances(&self, from: &Vector2<f64>) -> Vec<u32> {
        let mut distances = vec![u32::MAX; self.blocked.len()];
        let Some(start) = self.cell(from).filter(|&cell| !self.blocked[cell]) else { return distances };
        // Ways of the same length form a ring; a diagonal's end joins the ring after the next. Lengths in half squares.
        let mut rings: VecDeque<Vec<usize>> = VecDeque::from([vec![start], Vec::new(), Vec::new(), Vec::new()]);
        distances[start] = 0;
        let mut length = 0;
        while rings.iter().any(|ring| !ring.is_empty()) {
            for cell in rings.pop_front().unwrap_or_default() {
                if distances[cell] < length {
                    continue;
                }
                for (next, cost) in self.neighbours(cell) {
                    if length + cost < distances[next] {
                        distances[next] = length + cost;
                        rings[cost as usize - 1].push(next);
                    }
                }
            }
            rings.push_back(Vec::new());
            length += 1;
        }
        distances
    }

    /// Metres of a length among [`distances`](Self::distances).
    pub fn metres(&self, length: u32) -> f64 {
        if length == u32::MAX { f64::INFINITY } else { f64::from(length) * self.side / 2.0 }
    }

    /// The free squares around one, and how far they are in half squares.
    fn neighbours(&self, cell: usize) -> impl Iterator<Item = (usize, u32)> + '_ {
        let (column, row) = (cell % self.columns, cell / self.columns);
        let columns = column.saturating_sub(1)..(column + 2).min(self.columns);
        let rows = row.saturating_sub(1)..(row + 2).min(self.rows);
        let around = rows.flat_map(move |y| columns.clone().map(move |x| (x, y)));
        around.filter_map(move |(x, y)| {
            let next = y * self.columns + x;
            let length = if x != column && y != row { 3 } else { 2 };
            (next != cell && !self.blocked[next]).then_some((next, length))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_with_a_gap_is_passed_by_the_gap_or_not_at_all() {
        let (a, b) = (Vector2::new(1.0, 1.0), Vector2::new(3.0, 1.0));
        let wall = |from: f64, to: f64| Rectangle { low: Vector2::new(1.9, from), high: Vector2::new(2.1, to) };
        let length = |ways: &Ways| ways.metres(ways.distances(&a)[ways.cell(&b).unwrap()]);
        let mut ways = Ways::new(Vector2::new(4.0, 3.0), 0.05);
        assert!((length(&ways) - 2.0).abs() < 0.06 && ways.is_free_between(&a, &b));
        ways.block(&wall(0.0, 2.2), 0.25);
        assert!(!ways.is_free_between(&a, &b));
        assert!((3.85..4.3).contains(&length(&ways)), "{}", length(&ways));
        ways.block(&wall(2.6, 3.0), 0.25);
        assert!(length(&ways).is_infinite());
        assert!(!ways.is_free(&Vector2::new(-0.1, 1.0)) && !ways.is_free(&Vector2::new(1.0, 3.2)));
    }
}
