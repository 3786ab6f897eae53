//! The source of a window under its turns, each made when a search first needs it.

use std::cell::{OnceCell, RefCell};
use std::ops::Range;

use nalgebra::{UnitComplex, Vector2};

use super::grid::{LikelihoodGrid, MAX_SQUARE};
use crate::geometry::Pose2;

/// Most points that one entry of a [`RotatedSource`] stands for.
const MAX_COUNT: usize = 4;
/// After so many points it is checked whether a pose can still beat the best.
const POINTS_TO_A_CHECK: usize = 16;
/// Rounding moves a cell by less than this share of its side.
const CELL_ROUNDING: f64 = 1e-6;

/// The source under one turn, as cells of the grid. Points that no shift of the window moves onto the grid are left out.
pub(super) struct RotatedSource {
    /// Neighbouring points in one cell are one entry. Segment after segment: those of one point that some shift moves off
    /// the grid (which score little, so that a bad pose is known sooner), those of one point that stay on it under every
    /// shift, the same of two points, and so on.
    cells: Vec<(i32, i32)>,
    ends: [usize; 2 * MAX_COUNT],
    /// Segments up to the last that is not empty.
    num_segments: usize,
    num_points: u32,
}

/// Entries before they are sorted, each with its segment.
type Entries = Vec<((i32, i32), usize)>;

/// Entries of a [`RotatedSource`] that count alike.
pub(super) struct Segment<'a> {
    pub cells: &'a [(i32, i32)],
    /// Points that each entry stands for.
    pub count: u32,
    /// Whether every shift leaves them on the grid.
    pub is_inside: bool,
}

impl RotatedSource {
    /// From all cells of the source, which are shifted from the first to the last of `shifts` on a grid of this size.
    fn new(size: (i32, i32), cells: &[(i32, i32)], shifts: (i32, i32), entries: &mut Entries) -> Self {
        let first = |cell: i32| cell.saturating_add(shifts.0);
        let last = |cell: i32| cell.saturating_add(shifts.1);
        let is_on = |cell: i32, size: i32| last(cell) >= 0 && first(cell) < size;
        let stays_on = |cell: i32, size: i32| first(cell) >= 0 && last(cell) < size;
        entries.clear();
        for &cell in cells {
            match entries.last_mut() {
                Some((last, segment)) if *last == cell && *segment < 2 * (MAX_COUNT - 1) => *segment += 2,
                _ if is_on(cell.0, size.0) && is_on(cell.1, size.1) => {
                    let is_inside = stays_on(cell.0, size.0) && stays_on(cell.1, size.1);
                    entries.push((cell, usize::from(is_inside)));
                }
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
        Self { cells, ends, num_segments, num_points }
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

    /// An upper bound of the sums of all shifts from (x, y) to (x, y) + 2^level - 1. The computation ends as soon as the bound is
    /// known to be below `to_beat`.
    pub(super) fn bound(&self, grid: &LikelihoodGrid, level: usize, (x, y): (i32, i32), to_beat: u32) -> u32 {
        let (cells, width) = (grid.level(level), grid.width);
        let mut left = 255 * self.num_points;
        let mut bound = 0;
        for Segment { cells: of_segment, count, is_inside } in self.segments() {
            for points in of_segment.chunks(POINTS_TO_A_CHECK) {
                let at = |&(cx, cy): &(i32, i32)| {
                    if is_inside {
                        u32::from(cells[((cy + y) * width + cx + x) as usize])
                    } else {
                        // Negative ones wrap round to beyond the size.
                        let (x, y) = ((cx + x) as u32, (cy + y) as u32);
                        let is_on = x < width as u32 && y < grid.height as u32;
                        if is_on { u32::from(cells[(y * width as u32 + x) as usize]) } else { 0 }
                    }
                };
                bound += count * points.iter().map(at).sum::<u32>();
                left -= 255 * count * points.len() as u32;
                if bound + left < to_beat {
                    return bound + left;
                }
            }
        }
        bound
    }
}

/// The source under every turn of a window.
pub(super) struct Turns<'a> {
    pub grid: &'a LikelihoodGrid,
    source: &'a [Vector2<f64>],
    center: Pose2,
    /// The turn (rad) of one step.
    pub step: f64,
    /// Turns reach so many steps to either side.
    half: i32,
    /// Shifts in x and y reach so far.
    pub half_cells: i32,
    /// The steps of each turn from the centre, and the source under it.
    made: Vec<(i32, OnceCell<RotatedSource>)>,
    /// Cells and entries of the turn that is made; the memory is used again.
    buffers: RefCell<(Vec<(i32, i32)>, Entries)>,
}

/// The source under several turns, for blocks of one side: for each number of blocks across those whose square covers all cells
/// of a point under these turns and all that a block moves them to.
pub(super) struct TurnedSource {
    pub by_width: Vec<(usize, RotatedSource)>,
    /// Points that no such square covers.
    pub num_uncovered: u32,
}

impl<'a> Turns<'a> {
    pub(super) fn new(
        grid: &'a LikelihoodGrid,
        source: &'a [Vector2<f64>],
        center: &Pose2,
        (step, half): (f64, i32),
        half_cells: i32,
    ) -> Self {
        let made = (-half..=half).map(|turn| (turn, OnceCell::new())).collect();
        Self { grid, source, center: *center, step, half, half_cells, made, buffers: RefCell::default() }
    }

    pub(super) fn len(&self) -> usize {
        self.made.len()
    }

    /// Steps of a turn from the centre.
    pub(super) fn turn(&self, index: usize) -> i32 {
        self.made[index].0
    }

    /// The index of a turn by so many steps; `None` outside the window.
    pub(super) fn index_of(&self, turn: i32) -> Option<usize> {
        (turn.abs() <= self.half).then_some((turn + self.half) as usize)
    }

    fn rotation(&self, index: usize) -> UnitComplex<f64> {
        UnitComplex::new(f64::from(self.turn(index)) * self.step) * self.center.rotation
    }

    /// The source under one turn.
    pub(super) fn get(&self, index: usize) -> &RotatedSource {
        self.made[index].1.get_or_init(|| {
            let (rotation, shift) = (self.rotation(index), self.center.translation.vector);
            let (cells, entries) = &mut *self.buffers.borrow_mut();
            cells.clear();
            cells.extend(self.source.iter().map(|p| self.grid.cell(&(rotation * p + shift))));
            let size = (self.grid.width, self.grid.height);
            RotatedSource::new(size, cells, (-self.half_cells, self.half_cells), entries)
        })
    }

    /// The source under all of these turns, for the window's blocks of a level, of which the first is at `-half_cells`.
    pub(super) fn together(&self, turns: &Range<usize>, level: usize) -> TurnedSource {
        let (first, last) = (self.rotation(turns.start), self.rotation(turns.end - 1));
        let shift = self.center.translation.vector;
        // An arc leaves its chord by no more than its height.
        let height = 1.0 - (0.5 * (turns.len() - 1) as f64 * self.step).cos();
        let mut corners: [Vec<(i32, i32)>; MAX_SQUARE as usize] = Default::default();
        let mut num_uncovered = 0;
        for point in self.source {
            let (a, b) = (first * point + shift, last * point + shift);
            let margin = Vector2::repeat(height * point.norm() + CELL_ROUNDING * self.grid.resolution);
            let (low, high) = (self.grid.cell(&(a.inf(&b) - margin)), self.grid.cell(&(a.sup(&b) + margin)));
            let block = |cell: i32| (cell.saturating_sub(self.half_cells) >> level).saturating_add(MAX_SQUARE);
            let corner = (block(low.0), block(low.1));
            let end = (1 << level) - 1;
            let last = |cell: i32| block(cell.saturating_add(end));
            let more = last(high.0).saturating_sub(corner.0).max(last(high.1).saturating_sub(corner.1));
            match corners.get_mut(more as usize) {
                Some(corners) => corners.push(corner),
                None => num_uncovered += 1,
            }
        }
        let (size, shifts) = (self.grid.size_in_blocks(level), (0, (2 * self.half_cells) >> level));
        let corners = (1..).zip(&corners).filter(|(_, corners)| !corners.is_empty());
        let (_, entries) = &mut *self.buffers.borrow_mut();
        let mut of_width = |corners: &Vec<(i32, i32)>| RotatedSource::new(size, corners, shifts, entries);
        let by_width = corners.map(|(width, corners)| (width, of_width(corners)));
        TurnedSource { by_width: by_width.collect(), num_uncovered }
    }
}
