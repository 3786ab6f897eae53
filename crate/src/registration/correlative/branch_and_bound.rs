//! Branch and bound over the turns and shifts of a window.

use nalgebra::Vector2;

use super::grid::{Buffers, LANES, LikelihoodGrid, NUM_LEVELS};

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

/// Most points that one entry of a [`RotatedSource`] stands for.
const MAX_COUNT: usize = 4;

/// The source under one turn, as cells of the grid; what no shift brings onto it is left out.
pub(super) struct RotatedSource {
    /// Steps of turn from the centre.
    pub turn: i32,
    /// Neighbouring points in one cell are one entry. Segment after segment: those of one point that some shift moves off
    /// the grid (which score little, so that a bad pose is known sooner), those of one point that stay on it under every
    /// shift, the same of two points, and so on.
    cells: Vec<(i32, i32)>,
    ends: [usize; 2 * MAX_COUNT],
    /// Segments up to the last that is not empty.
    num_segments: usize,
    num_points: u32,
}

/// Entries of a [`RotatedSource`] that count alike.
pub(super) struct Segment<'a> {
    pub cells: &'a [(i32, i32)],
    /// Points that each entry stands for.
    pub count: u32,
    /// Whether every shift leaves them on the grid.
    pub is_inside: bool,
}

impl RotatedSource {
    /// From all cells of the source; `entries` is a buffer, of cells and their segments.
    pub(super) fn new(
        grid: &LikelihoodGrid,
        turn: i32,
        cells: &[(i32, i32)],
        half_cells: i32,
        entries: &mut Vec<((i32, i32), usize)>,
    ) -> Self {
        // Negative ones wrap round to beyond any size.
        let is_within = |cell: i32, size: i32, by: i32| (cell.wrapping_add(by) as u32) < (size + 2 * by).max(0) as u32;
        let are_within = |(x, y): (i32, i32), by: i32| is_within(x, grid.width, by) && is_within(y, grid.height, by);
        entries.clear();
        for &cell in cells {
            match entries.last_mut() {
                Some((last, segment)) if *last == cell && *segment < 2 * (MAX_COUNT - 1) => *segment += 2,
                _ if are_within(cell, half_cells) => entries.push((cell, usize::from(are_within(cell, -half_cells)))),
                _ => {}
            }
        }
        let mut starts = [0; 2 * MAX_COUNT + 1];
        for (_, segment) in entries.iter() {
            starts[segment + 1] += 1;
        }
        for later in 1..starts.len() {
            starts[later] += starts[later - 1];
        }
        let mut cells = vec![(0, 0); entries.len()];
        for (cell, segment) in entries.iter() {
            cells[starts[*segment]] = *cell;
            starts[*segment] += 1;
        }
        // Each start has moved to the end of its segment.
        let ends: [usize; 2 * MAX_COUNT] = std::array::from_fn(|segment| starts[segment]);
        let num_segments = ends.partition_point(|&end| end < entries.len()) + 1;
        let num_points = entries.iter().map(|(_, segment)| (segment / 2 + 1) as u32).sum();
        Self { turn, cells, ends, num_segments, num_points }
    }

    /// Its entries, by how many points they stand for and whether they stay on the grid.
    pub(super) fn segments(&self) -> impl Iterator<Item = Segment<'_>> {
        let ends = &self.ends[..self.num_segments.min(self.ends.len())];
        let starts = std::iter::once(0).chain(ends.iter().copied());
        starts.zip(ends).enumerate().map(|(segment, (start, &end))| Segment {
            cells: &self.cells[start..end],
            count: (segment / 2 + 1) as u32,
            is_inside: segment % 2 == 1,
        })
    }

    /// The sum that a shift scores.
    pub(super) fn sum(&self, grid: &LikelihoodGrid, (x, y): (i32, i32)) -> u32 {
        let of_segment = |segment: Segment| {
            segment.count * segment.cells.iter().map(|&(cx, cy)| grid.likelihood(0, cx + x, cy + y)).sum::<u32>()
        };
        self.segments().map(of_segment).sum()
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
    /// Turn by turn, column of [`LANES`] blocks by column, row by row; 0 where the window has no such block.
    bounds: Vec<[u32; LANES]>,
    /// The largest of each row.
    largest: Vec<u32>,
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
        let mut buffers = Buffers::default();
        for source in rotated {
            for (xs, column) in shifts.chunks(LANES).zip(&mut columns) {
                for Segment { cells, count, is_inside } in source.segments() {
                    for points in cells.chunks(POINTS_AT_ONCE) {
                        let weight = (count, is_inside);
                        rows.add_to(column, points, weight, (xs[0], shifts[0]), &mut buffers);
                    }
                }
                for row in column {
                    row[xs.len()..].fill(0);
                }
            }
        }
        let largest = bounds.iter().map(|row| row.iter().fold(0, |most, &bound| bound.max(most))).collect();
        Self { level, half_cells, shifts, bounds, largest }
    }

    /// The largest bound.
    fn largest(&self) -> u32 {
        self.largest.iter().fold(0, |most, &bound| bound.max(most))
    }

    /// Shows all blocks whose bound is at least what `visit` last returned, which begins with `least`.
    fn visit(&self, rotated: &[RotatedSource], mut least: u32, mut visit: impl FnMut(Candidate) -> u32) {
        let rows = self.largest.chunks_exact(self.shifts.len()).zip(self.bounds.chunks_exact(self.shifts.len()));
        let num_columns = self.shifts.len().div_ceil(LANES);
        for (index, (largest, bounds)) in rows.enumerate() {
            let (rotated_index, xs) = (index / num_columns, &self.shifts[index % num_columns * LANES..]);
            for ((&largest, bounds), &y) in largest.iter().zip(bounds).zip(&self.shifts) {
                if largest < least {
                    continue;
                }
                for (&x, &bound) in xs.iter().zip(bounds) {
                    if bound >= least {
                        let turn = rotated[rotated_index].turn;
                        least = visit(Candidate { bound, level: self.level, rotated: rotated_index, turn, x, y });
                    }
                }
            }
        }
    }
}

/// After so many points it is checked whether a candidate can still beat the best.
const POINTS_TO_A_CHECK: usize = 16;

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
        let first = self.most_promising()?;
        self.look_into(&first);
        let least = self.best.map_or(self.floor, |best| best.bound + 1);
        let mut others = Vec::new();
        self.blocks.visit(self.rotated, least, |candidate| {
            if (candidate.rotated, candidate.x, candidate.y) != (first.rotated, first.x, first.y) {
                others.push(candidate);
            }
            least
        });
        self.look_into_all(&mut others);
        self.best
    }

    /// The first block in [`order`] that is not excluded.
    fn most_promising(&self) -> Option<Candidate> {
        let least = if self.excluded.is_empty() { self.floor.max(self.blocks.largest()) } else { self.floor };
        let mut first: Option<Candidate> = None;
        self.blocks.visit(self.rotated, least, |candidate| {
            let comes_first = first.is_none_or(|first| order(&candidate) < order(&first));
            if comes_first && !self.is_excluded(&candidate) {
                first = Some(candidate);
            }
            first.map_or(least, |first| first.bound)
        });
        first
    }

    fn is_excluded(&self, c: &Candidate) -> bool {
        self.excluded.iter().any(|excluded| excluded.covers(c.turn, c.x, c.y, 1 << c.level))
    }

    /// Whether neither this candidate nor one that comes after it can be the best.
    fn is_beaten(&self, candidate: &Candidate) -> bool {
        match self.best {
            Some(best) => candidate.bound <= best.bound || best.bound >= self.enough,
            None => candidate.bound < self.floor,
        }
    }

    /// Finds the best pose of a candidate, if it beats the best so far.
    fn look_into(&mut self, candidate: &Candidate) {
        if self.is_excluded(candidate) {
            return;
        }
        (self.visit)(candidate);
        if candidate.level == 0 {
            self.best = Some(*candidate);
            return;
        }
        let (mut children, count) = self.children(candidate);
        self.look_into_all(&mut children[..count]);
    }

    fn look_into_all(&mut self, candidates: &mut [Candidate]) {
        candidates.sort_unstable_by_key(order);
        for candidate in candidates {
            if self.is_beaten(candidate) {
                return;
            }
            self.look_into(candidate);
        }
    }

    /// The quarters of a candidate that lie in the window.
    fn children(&self, candidate: &Candidate) -> ([Candidate; 4], usize) {
        let level = candidate.level - 1;
        let half = 1 << level;
        let mut children = [*candidate; 4];
        let mut count = 0;
        for (dx, dy) in [(0, 0), (half, 0), (0, half), (half, half)] {
            let (x, y) = (candidate.x + dx, candidate.y + dy);
            if x <= self.blocks.half_cells && y <= self.blocks.half_cells {
                let bound = self.bound(level, &self.rotated[candidate.rotated], (x, y));
                children[count] = Candidate { bound, level, x, y, ..*candidate };
                count += 1;
            }
        }
        (children, count)
    }

    /// Bounds the scores of a candidate's poses; no further than it takes to see that it cannot beat the best.
    fn bound(&self, level: usize, rotated: &RotatedSource, (x, y): (i32, i32)) -> u32 {
        let (cells, width) = (self.grid.level(level), self.grid.width);
        let to_beat = self.best.map_or(self.floor, |best| best.bound);
        let mut left = 255 * rotated.num_points;
        let mut bound = 0;
        for Segment { cells: of_segment, count, is_inside } in rotated.segments() {
            for points in of_segment.chunks(POINTS_TO_A_CHECK) {
                let at = |&(cx, cy): &(i32, i32)| {
                    if is_inside {
                        u32::from(cells[((cy + y) * width + cx + x) as usize])
                    } else {
                        // Negative ones wrap round to beyond the size.
                        let (x, y) = ((cx + x) as u32, (cy + y) as u32);
                        let is_on = x < width as u32 && y < self.grid.height as u32;
                        if is_on { u32::from(cells[(y * width as u32 + x) as usize]) } else { 0 }
                    }
                };
                bound += count * points.iter().map(at).sum::<u32>();
                left -= 255 * count * points.len() as u32;
                if bound + left < to_beat {
                    return bound;
                }
            }
        }
        bound
    }
}

/// The most promising first; among equals the smallest turn, then the smallest shift: the same answer everywhere. In three
/// integers, of which the first decides nearly always.
fn order(c: &Candidate) -> impl Ord + Copy + use<> {
    let joined = |high: u32, low: u32| u64::from(high) << 32 | u64::from(low);
    // Turned into unsigned numbers of the same order.
    let [turn, x, y] = [c.turn, c.x, c.y].map(|value| (value as u32) ^ (1 << 31));
    let shift = c.x.unsigned_abs() + c.y.unsigned_abs();
    (joined(!c.bound, c.turn.unsigned_abs()), joined(shift, turn), joined(x, y))
}
