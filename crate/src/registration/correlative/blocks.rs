//! Bounds of the blocks of a window: for several turns at once, and for single turns where these do not rule a block out.

use std::cell::{OnceCell, RefCell};
use std::ops::Range;

use super::grid::{BlockRows, Buffers, LANES, NUM_LEVELS};
use super::turns::{RotatedSource, Segment, Turns};

/// Most blocks across a window.
const MOST_ACROSS: i32 = 16;
/// Number of neighbouring turns that are bounded together.
const TURNS_TOGETHER: usize = 8;

/// All translations from (x, y) to (x, y) + 2^level - 1 cells, under one turn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub bound: u32,
    pub level: usize,
    /// Its place among the blocks that searches have needed.
    pub index: usize,
    pub rotated: usize,
    pub turn: i32,
    pub x: i32,
    pub y: i32,
}

/// Rows of [`LANES`] blocks, one below the other; 0 where the window has no such block.
type Column = Vec<[u32; LANES]>;

/// All blocks of one level of the pyramid: of the finest that has at most [`MOST_ACROSS`] blocks across the window, on levels 0 and
/// 1 half as many. The bounds of larger blocks are too loose, and smaller blocks are too many.
pub(super) struct Blocks<'a> {
    pub turns: Turns<'a>,
    pub level: usize,
    /// Shifts of the blocks' corners, in x and in y.
    shifts: Vec<i32>,
    /// Turns that are bounded together.
    groups: Vec<Range<usize>>,
    /// The bounds of the blocks under each group of turns, column by column.
    bounds: Vec<Column>,
    /// The largest entry of each column of `bounds`.
    largest: Vec<u32>,
    /// The bounds of single turns, column by column, where they were needed.
    of_turns: Vec<OnceCell<Column>>,
    known: RefCell<Known>,
}

/// All blocks whose bounds are at least `least`, which is the smallest bound that a search has needed.
struct Known {
    least: u32,
    candidates: Vec<Candidate>,
    /// The bounds of the quarters of each candidate, as tight as searches have needed them.
    quarters: Vec<[u32; 4]>,
}

impl<'a> Blocks<'a> {
    pub(super) fn new(turns: Turns<'a>) -> Self {
        let across = 2 * turns.half_cells + 1;
        let is_enough = |&level: &usize| across <= if level < 2 { MOST_ACROSS / 2 } else { MOST_ACROSS } << level;
        let level = (0..NUM_LEVELS - 1).find(is_enough).unwrap_or(NUM_LEVELS - 1);
        let shifts: Vec<i32> = (-turns.half_cells..=turns.half_cells).step_by(1 << level).collect();
        let starts = (0..turns.len()).step_by(TURNS_TOGETHER);
        let groups: Vec<Range<usize>> = starts.map(|start| start..(start + TURNS_TOGETHER).min(turns.len())).collect();
        let num_columns = shifts.len().div_ceil(LANES);
        let of_turns = (0..turns.len() * num_columns).map(|_| OnceCell::new()).collect();
        let known = RefCell::new(Known { least: u32::MAX, candidates: Vec::new(), quarters: Vec::new() });
        let (bounds, largest) = (Vec::new(), Vec::new());
        let mut blocks = Self { turns, level, shifts, groups, bounds, largest, of_turns, known };
        blocks.bounds = blocks.together();
        blocks.largest = blocks.bounds.iter().map(|column| column.iter().flatten().fold(0, |a, &b| a.max(b))).collect();
        blocks
    }

    /// The bounds of all groups of turns.
    fn together(&self) -> Vec<Column> {
        let (mut bounds, mut buffers) = (Vec::with_capacity(self.groups.len()), Buffers::default());
        for group in &self.groups {
            let source = self.turns.together(group, self.level);
            for (first, xs) in (0_i32..).step_by(LANES).zip(self.shifts.chunks(LANES)) {
                let mut column = vec![[255 * source.num_uncovered; LANES]; self.shifts.len()];
                for (width, rotated) in &source.by_width {
                    let squares = self.turns.grid.squares(self.level, *width);
                    add_to(&mut column, squares, rotated, (first, 0), &mut buffers);
                }
                cut(&mut column, xs.len());
                bounds.push(column);
            }
        }
        bounds
    }

    /// The largest of all bounds.
    pub(super) fn largest(&self) -> u32 {
        self.largest.iter().fold(0, |most, &bound| bound.max(most))
    }

    /// All blocks whose bound is at least `least` and below `end`.
    pub(super) fn between(&self, least: u32, end: u32) -> Vec<Candidate> {
        let known = &mut *self.known.borrow_mut();
        if least < known.least {
            let end = std::mem::replace(&mut known.least, least);
            self.visit(least, |candidate| {
                if candidate.bound < end {
                    known.candidates.push(Candidate { index: known.candidates.len(), ..candidate });
                    known.quarters.push([u32::MAX; 4]);
                }
            });
        }
        let is_between = |candidate: &&Candidate| (least..end).contains(&candidate.bound);
        known.candidates.iter().filter(is_between).copied().collect()
    }

    /// The bound of a quarter of a block, where it may be at least `to_beat`.
    pub(super) fn quarter(&self, block: usize, number: usize, child: &Candidate, to_beat: u32) -> u32 {
        let known = &mut self.known.borrow_mut().quarters[block][number];
        if *known >= to_beat {
            *known = self.bound(child, to_beat);
        }
        *known
    }

    /// The bound of a candidate. The computation ends as soon as the bound is known to be below `to_beat`.
    pub(super) fn bound(&self, candidate: &Candidate, to_beat: u32) -> u32 {
        let Turns { grid, .. } = self.turns;
        self.turns.get(candidate.rotated).bound(grid, candidate.level, (candidate.x, candidate.y), to_beat)
    }

    /// Calls `visit` with every block whose bound is at least `least`.
    fn visit(&self, least: u32, mut visit: impl FnMut(Candidate)) {
        let num_columns = self.shifts.len().div_ceil(LANES);
        for (index, (column, &largest)) in self.bounds.iter().zip(&self.largest).enumerate() {
            if largest < least {
                continue;
            }
            let (group, column_index) = (index / num_columns, index % num_columns);
            let num_left = column.iter().flatten().filter(|&&bound| bound >= least).count();
            for turn in self.groups[group].clone() {
                let known = &self.of_turns[turn * num_columns + column_index];
                // A whole row takes about as long as one of its blocks.
                let known = if num_left > column.len() {
                    Some(known.get_or_init(|| self.of_turn(turn, column_index)))
                } else {
                    known.get()
                };
                self.visit_column((turn, column_index), column, known, least, &mut visit);
            }
        }
    }

    /// The bounds of a column under one turn.
    fn of_turn(&self, turn: usize, column_index: usize) -> Column {
        let xs = &self.shifts[column_index * LANES..];
        let mut column = vec![[0; LANES]; self.shifts.len()];
        let rows = self.turns.grid.block_rows(self.level);
        add_to(&mut column, rows, self.turns.get(turn), (xs[0], self.shifts[0]), &mut Buffers::default());
        cut(&mut column, xs.len());
        column
    }

    /// Calls `visit` with the blocks of a column under one turn whose bound is at least `least`; `known` are the column's bounds
    /// under this turn, where they have been computed.
    fn visit_column(
        &self,
        (turn, column_index): (usize, usize),
        together: &Column,
        known: Option<&Column>,
        least: u32,
        visit: &mut impl FnMut(Candidate),
    ) {
        let xs = &self.shifts[column_index * LANES..];
        for (row, (together, &y)) in together.iter().zip(&self.shifts).enumerate() {
            for (lane, (&x, &together)) in xs.iter().zip(together).enumerate() {
                if together < least {
                    continue;
                }
                let grid = self.turns.grid;
                let bound = known.map_or_else(
                    || self.turns.get(turn).bound(grid, self.level, (x, y), least),
                    |column| column[row][lane],
                );
                if bound >= least {
                    let of_turn = self.turns.turn(turn);
                    visit(Candidate { bound, level: self.level, index: 0, rotated: turn, turn: of_turn, x, y });
                }
            }
        }
    }
}

/// Adds what a source scores in a column whose first block is at `shift`.
fn add_to(column: &mut Column, rows: &BlockRows, source: &RotatedSource, shift: (i32, i32), buffers: &mut Buffers) {
    for Segment { cells, count, is_inside } in source.segments() {
        // The sum of the likelihoods of so many points fits 16 bits.
        for points in cells.chunks(usize::from(u16::MAX / u16::from(u8::MAX))) {
            rows.add_to(column, points, (count, is_inside), shift, buffers);
        }
    }
}

/// Sets the bounds of blocks that the window does not have to 0.
fn cut(column: &mut Column, num_lanes: usize) {
    for row in column {
        row[num_lanes.min(LANES)..].fill(0);
    }
}

#[cfg(test)]
mod tests {
    use super::super::LikelihoodGrid;
    use super::*;
    use crate::geometry::Pose2;
    use nalgebra::Vector2;

    /// Returns in all directions, from near to far beyond the grid.
    fn source(step: f64) -> Vec<Vector2<f64>> {
        let range = |index: f64| 0.3 + 0.7 * (0.37 * index).sin().abs() * index;
        (0..90)
            .map(f64::from)
            .map(|index| range(index) * Vector2::new((index * step).cos(), (index * step).sin()))
            .collect()
    }

    #[test]
    fn points_beyond_all_cells_are_passed_over() {
        let grid = LikelihoodGrid::new(&source(0.11)[..60]);
        let far = [[1e12, 0.0], [0.0, -1e12], [-1e30, 1e30], [3.0, 1.0]].map(Vector2::from);
        for half_cells in [3, 30] {
            let blocks = Blocks::new(Turns::new(&grid, &far, &Pose2::identity(), (0.01, 9), half_cells));
            let most = 255 * far.len() as u32;
            assert!(blocks.between(0, u32::MAX).iter().all(|candidate| candidate.bound <= 255));
            assert!(blocks.largest() <= most);
        }
    }

    #[test]
    fn turns_together_score_at_least_what_each_of_them_does() {
        let grid = LikelihoodGrid::new(&source(0.11)[..60]);
        for (half_cells, half) in [(2, 9), (7, 30), (25, 40), (70, 21), (200, 8)] {
            let source = source(0.13);
            let center = Pose2::new(Vector2::new(0.4, -7.0), 2.1);
            let blocks = Blocks::new(Turns::new(&grid, &source, &center, (0.01, half), half_cells));
            let num_columns = blocks.shifts.len().div_ceil(LANES);
            let mut num_ruled_out = 0;
            for (group, turns) in blocks.groups.iter().enumerate() {
                for (turn, column) in turns.clone().flat_map(|turn| (0..num_columns).map(move |column| (turn, column)))
                {
                    let together = blocks.bounds[group * num_columns + column].as_flattened();
                    let alone = blocks.of_turn(turn, column);
                    assert!(together.iter().zip(alone.as_flattened()).all(|(together, alone)| together >= alone));
                    num_ruled_out += together.iter().filter(|&&bound| bound < blocks.largest() / 2).count();
                }
            }
            assert!(half_cells < 25 || num_ruled_out > 0, "{half_cells} cells: no block is told from another");
            let (mut shown, least) = (Vec::new(), blocks.largest() / 2);
            blocks.visit(least, |candidate| shown.push((candidate.rotated, candidate.x, candidate.y, candidate.bound)));
            let mut expected = Vec::new();
            for (turn, &x, &y) in (0..blocks.turns.len())
                .flat_map(|turn| blocks.shifts.iter().map(move |x| (turn, x)))
                .flat_map(|(turn, x)| blocks.shifts.iter().map(move |y| (turn, x, y)))
            {
                let bound = blocks.turns.get(turn).bound(&grid, blocks.level, (x, y), 0);
                if bound >= least {
                    expected.push((turn, x, y, bound));
                }
            }
            shown.sort_unstable();
            expected.sort_unstable();
            assert_eq!(shown, expected, "{half_cells} cells");
        }
    }
}
