//! Branch and bound over the turns and shifts of a window.

use nalgebra::Vector2;

use super::grid::{LANES, LikelihoodGrid, NUM_LEVELS};

/// Poses that a search passes over, in cells and steps of turn from the centre of its window.
#[derive(Debug, Clone, Copy)]
pub(super) struct Excluded {
    pub away: Vector2<f64>,
    pub turn: f64,
    pub radius: f64,
    pub turns: f64,
}

impl Excluded {
    /// Whether all translations from (x, y) to (x, y) + side - 1 under this turn are passed over.
    fn covers(&self, turn: i32, x: i32, y: i32, side: i32) -> bool {
        let far = |low: i32, away: f64| (f64::from(low) - away).abs().max((f64::from(low + side - 1) - away).abs());
        (f64::from(turn) - self.turn).abs() <= self.turns
            && far(x, self.away.x).powi(2) + far(y, self.away.y).powi(2) <= self.radius * self.radius
    }
}

/// The source under one turn, as cells of the grid; what no shift brings onto it is left out.
pub(super) struct RotatedSource {
    /// Steps of turn from the centre.
    pub turn: i32,
    cells: Vec<(i32, i32)>,
}

impl RotatedSource {
    /// From all cells of the source.
    pub(super) fn new(
        grid: &LikelihoodGrid,
        turn: i32,
        cells: impl Iterator<Item = (i32, i32)>,
        half_cells: i32,
    ) -> Self {
        let is_near = |cell: i32, size: i32| cell >= -half_cells && cell < size + half_cells;
        Self { turn, cells: cells.filter(|&(x, y)| is_near(x, grid.width) && is_near(y, grid.height)).collect() }
    }
}

impl RotatedSource {
    /// The sum that a shift scores.
    pub(super) fn sum(&self, grid: &LikelihoodGrid, (x, y): (i32, i32)) -> u32 {
        self.cells.iter().map(|&(cx, cy)| grid.likelihood(0, cx + x, cy + y)).sum()
    }
}

/// All translations from (x, y) to (x, y) + 2^level - 1 cells, under one turn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub bound: u32,
    pub level: usize,
    pub rotated: usize,
    pub turn: i32,
    pub x: i32,
    pub y: i32,
}

/// Blocks across a window.
const MOST_ACROSS: i32 = 16;
/// Points that 16 bits hold the sum of.
const POINTS_AT_ONCE: usize = 256;

/// Bounds of all blocks of one level: the finest that has [`MOST_ACROSS`] of them across the window or fewer, half as many where
/// that are blocks of one cell or two. (Coarser ones bound too loosely; finer ones are too many.)
pub(super) struct Blocks {
    level: usize,
    /// Shifts in x and y reach so far.
    pub(super) half_cells: i32,
    /// Shifts of the blocks' corners, in x and in y.
    shifts: Vec<i32>,
    /// Turn by turn, column of [`LANES`] blocks by column, row by row.
    bounds: Vec<[u32; LANES]>,
}

impl Blocks {
    pub(super) fn new(grid: &LikelihoodGrid, rotated: &[RotatedSource], half_cells: i32) -> Self {
        let across = 2 * half_cells + 1;
        let is_enough = |&level: &usize| across <= if level < 2 { MOST_ACROSS / 2 } else { MOST_ACROSS } << level;
        let level = (0..NUM_LEVELS - 1).find(is_enough).unwrap_or(NUM_LEVELS - 1);
        let shifts: Vec<i32> = (-half_cells..=half_cells).step_by(1 << level).collect();
        let rows = grid.block_rows(level);
        let mut bounds = vec![[0; LANES]; rotated.len() * shifts.len() * shifts.len().div_ceil(LANES)];
        let mut columns = bounds.chunks_exact_mut(shifts.len());
        for source in rotated {
            for (&x, column) in shifts.iter().step_by(LANES).zip(&mut columns) {
                for points in source.cells.chunks(POINTS_AT_ONCE) {
                    rows.add_to(column, points, (x, shifts[0]));
                }
            }
        }
        Self { level, half_cells, shifts, bounds }
    }

    /// The largest bound.
    fn largest(&self) -> u32 {
        let columns = self.bounds.chunks_exact(self.shifts.len()).zip(self.shifts.chunks(LANES).cycle());
        let of_column = |(bounds, shifts): (&[[u32; LANES]], &[i32])| {
            bounds.iter().flat_map(|row| &row[..shifts.len()]).fold(0, |most, &bound| bound.max(most))
        };
        columns.map(of_column).max().unwrap_or(0)
    }

    /// Those whose bound is at least this.
    fn from<'a>(&'a self, rotated: &'a [RotatedSource], least: u32) -> impl Iterator<Item = Candidate> + 'a {
        let rows_of = |(rotated, source): (usize, &'a RotatedSource)| {
            let columns = self.shifts.chunks(LANES).flat_map(|columns| self.shifts.iter().map(move |&y| (columns, y)));
            columns.map(move |(columns, y)| (rotated, source.turn, columns, y))
        };
        let rows = rotated.iter().enumerate().flat_map(rows_of).zip(&self.bounds);
        rows.filter(move |(_, bounds)| bounds.iter().fold(0, |most, &bound| bound.max(most)) >= least).flat_map(
            move |((rotated, turn, columns, y), bounds)| {
                let is_candidate = move |(_, bound): &(&i32, &u32)| **bound >= least;
                let of_row = columns.iter().zip(bounds).filter(is_candidate);
                of_row.map(move |(&x, &bound)| Candidate { bound, level: self.level, rotated, turn, x, y })
            },
        )
    }
}

/// A search in progress.
pub(super) struct Search<'a, V> {
    pub grid: &'a LikelihoodGrid,
    pub rotated: &'a [RotatedSource],
    pub blocks: &'a Blocks,
    pub excluded: Vec<Excluded>,
    /// Sums below this are not looked for.
    pub floor: u32,
    /// A sum of this much ends the search.
    pub enough: u32,
    pub best: Option<Candidate>,
    /// Is told of every candidate that is looked into.
    pub visit: V,
}

impl<V: FnMut(&Candidate)> Search<'_, V> {
    /// The most promising block first, to the end; then what it leaves, depth first (Hess et al. 2016, algorithm 3).
    pub(super) fn run(mut self) -> Option<Candidate> {
        let (blocks, rotated) = (self.blocks, self.rotated);
        let least = if self.excluded.is_empty() { self.floor.max(blocks.largest()) } else { self.floor };
        let first = blocks.from(rotated, least).filter(|c| !self.is_excluded(c)).min_by_key(order)?;
        self.branch(&mut [first]);
        let least = self.best.map_or(self.floor, |best| best.bound + 1);
        let is_first = |c: &Candidate| (c.rotated, c.x, c.y) == (first.rotated, first.x, first.y);
        let mut others: Vec<Candidate> = blocks.from(rotated, least).filter(|c| !is_first(c)).collect();
        self.branch(&mut others);
        self.best
    }

    fn is_excluded(&self, c: &Candidate) -> bool {
        self.excluded.iter().any(|excluded| excluded.covers(c.turn, c.x, c.y, 1 << c.level))
    }

    fn branch(&mut self, candidates: &mut [Candidate]) {
        candidates.sort_unstable_by_key(order);
        for candidate in candidates {
            let is_beaten = match self.best {
                Some(best) => candidate.bound <= best.bound || best.bound >= self.enough,
                None => candidate.bound < self.floor,
            };
            if is_beaten {
                return;
            }
            if self.is_excluded(candidate) {
                continue;
            }
            (self.visit)(candidate);
            if candidate.level == 0 {
                self.best = Some(*candidate);
                continue;
            }
            let level = candidate.level - 1;
            let half = 1 << level;
            let mut children = [*candidate; 4];
            let mut count = 0;
            for (dx, dy) in [(0, 0), (half, 0), (0, half), (half, half)] {
                let (x, y) = (candidate.x + dx, candidate.y + dy);
                if x <= self.blocks.half_cells && y <= self.blocks.half_cells {
                    children[count] = self.candidate(level, candidate.rotated, x, y);
                    count += 1;
                }
            }
            self.branch(&mut children[..count]);
        }
    }

    /// Bounds the score of the candidate's poses; no further than it takes to see that it cannot beat the best.
    fn candidate(&self, level: usize, rotated: usize, x: i32, y: i32) -> Candidate {
        let RotatedSource { turn, cells } = &self.rotated[rotated];
        let to_beat = self.best.map_or(self.floor, |best| best.bound);
        let (width, height) = (self.grid.width as u32, self.grid.height as u32);
        let level_cells = self.grid.level(level);
        let mut left = 255 * cells.len() as u32;
        let mut bound = 0;
        for points in cells.chunks(16) {
            for &(cx, cy) in points {
                // Negative ones wrap round to beyond the size.
                let (x, y) = ((cx + x) as u32, (cy + y) as u32);
                if x < width && y < height {
                    bound += u32::from(level_cells[(y * width + x) as usize]);
                }
            }
            left -= 255 * points.len() as u32;
            if bound + left < to_beat {
                break;
            }
        }
        Candidate { bound, level, rotated, turn: *turn, x, y }
    }
}

/// The most promising first; among equals the smallest turn, then the smallest shift: the same answer everywhere.
fn order(c: &Candidate) -> impl Ord + use<> {
    (std::cmp::Reverse(c.bound), c.turn.abs(), c.x.abs() + c.y.abs(), c.turn, c.x, c.y)
}
