//! All places of a map where returns fit: branch and bound over every pose of a lattice, the most promising block first.
//!
//! Hess et al., "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016, section V.B; there for the best pose of a window, here for all
//! places that score nearly as much as the best one. A block spans turns as well as translations. Its bound is the sum, over the returns, of
//! the largest score of the cells to which its poses move the return.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};

use nalgebra::{UnitComplex, Vector2};

use super::field::MapField;
use super::likelihood::BeamModel;
use super::pooled::{Pooled, Reach, layer_of};
use crate::geometry::Pose2;
use crate::geometry::quantile::quantile;
use crate::map::occupancy_grid::Cell;

/// Least side of a cell of the lattice (m), of which a scan gives one beam each.
pub(super) const LATTICE: f64 = 0.2;
/// The coarsest blocks have 2^TOP cells a side and span as many turns.
const TOP: usize = 5;
/// Returns after whose sum a block may be left: few enough to leave early, more than a comparison costs.
const CHUNK: usize = 16;
/// The turn from one pose of the lattice to the next moves this share of the returns by a cell at most.
const LEVER_QUANTILE: f64 = 0.8;
/// Poses within these distances of a place are the same place (m, rad).
pub(super) const SAME_PLACE: (f64, f64) = (0.5, 0.2);

/// When a search ends without having found all places.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    /// Most blocks that are looked into.
    pub blocks: usize,
    /// Most places.
    pub places: usize,
}

/// What a search looks for.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// Least mean score of the returns of a place.
    pub least_mean: f64,
    /// Places whose sum of scores is less than the best one's by more than this are left out.
    pub margin: f64,
}

/// What a search found.
#[derive(Debug, Clone, Default)]
pub struct Found {
    /// Poses of the lattice, the best one first: the frame of the returns in the grid's.
    pub places: Vec<Pose2>,
    /// Whether there are no others.
    pub is_complete: bool,
    /// The sum of scores that no other place exceeds.
    pub others_at_most: f64,
}

/// A map ready to be searched.
#[derive(Debug, Clone)]
pub struct Search {
    /// Side of a cell of the lattice (m).
    side: f64,
    scores: Pooled,
    /// Cells in which a robot can be: 255, others 0.
    free: Pooled,
    /// Score of a value of 0, and of one more.
    scale: (f64, f64),
}

/// Poses that are looked at together: translations from (x, y) to (x, y) + 2^level - 1, turns from `2^level * turn` on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Block {
    bound: u32,
    level: usize,
    turn: usize,
    x: i32,
    y: i32,
}

impl Ord for Block {
    /// The larger bound first, then the finer one; the rest makes the order the same everywhere.
    fn cmp(&self, other: &Self) -> Ordering {
        let rest = |block: &Self| (usize::MAX - block.level, block.turn, block.x, block.y);
        self.bound.cmp(&other.bound).then_with(|| rest(self).cmp(&rest(other)))
    }
}

impl PartialOrd for Block {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Search {
    /// Prepares a map.
    pub fn new(field: &MapField) -> Self {
        let step = (LATTICE / field.resolution).round().max(1.0) as usize;
        let side = step as f64 * field.resolution;
        // A pose is off from that of the lattice by half a cell, the return by as much from the middle of its cell.
        let model = BeamModel::of(field).widened(side * (2.0_f64 / 12.0).sqrt());
        let (width, height) = (field.width.div_ceil(step), field.height.div_ceil(step));
        let (low, high) = model.limits();
        let scale = (high - low) / f64::from(u8::MAX);
        let value = |score: f64| ((score - low) / scale).round().clamp(0.0, f64::from(u8::MAX)) as u8;
        let middle = |cell: usize| Vector2::new((cell % width) as f64 + 0.5, (cell / width) as f64 + 0.5) * side;
        let scores: Vec<u8> =
            (0..width * height).map(|cell| value(field.score_of_end(&model, &middle(cell)))).collect();
        let mut free = vec![0; width * height];
        for (cell, _) in field.cells.iter().enumerate().filter(|(_, state)| **state == Cell::Free) {
            free[cell / field.width / step * width + cell % field.width / step] = u8::MAX;
        }
        Self {
            side,
            scores: Pooled::new(&scores, width, value(0.0)),
            free: Pooled::new(&free, width, 0),
            scale: (low, scale),
        }
    }

    /// All places where returns score what is wanted. A robot was at the origin of their frame.
    pub fn places(&self, ends: &[Vector2<f64>], wanted: &Wanted, budget: &Budget) -> Found {
        let mut found = Places::default();
        if ends.is_empty() {
            return Found { is_complete: true, ..Found::default() };
        }
        let turns = Turns::new(self.side, &interleaved(ends), &self.scores);
        let floor = self.value_of(wanted.least_mean * ends.len() as f64, ends.len());
        let margin = (wanted.margin / self.scale.1).ceil() as u32;
        let mut blocks = self.first_blocks(&turns, floor);
        let mut num_blocks = 0;
        while let Some(block) = blocks.pop() {
            let least = floor.max(found.best.saturating_sub(margin));
            let is_out_of_budget = num_blocks >= budget.blocks || found.poses.len() >= budget.places;
            if block.bound < least || is_out_of_budget {
                let others_at_most = self.score_of(block.bound.max(least), ends.len());
                return Found { places: found.poses, is_complete: block.bound < least, others_at_most };
            }
            num_blocks += 1;
            let pose = self.pose(&turns, &block);
            if block.level <= 1 && found.is_known(&pose) {
                continue;
            }
            if block.level == 0 {
                found.add(pose, block.bound);
            } else {
                self.divide(&turns, &block, least, &mut blocks);
            }
        }
        let least = floor.max(found.best.saturating_sub(margin));
        Found { places: found.poses, is_complete: true, others_at_most: self.score_of(least, ends.len()) }
    }

    /// The sum of scores of a sum of values.
    fn score_of(&self, value: u32, num_ends: usize) -> f64 {
        self.scale.0 * num_ends as f64 + self.scale.1 * f64::from(value)
    }

    /// The sum of values with this sum of scores.
    fn value_of(&self, score: f64, num_ends: usize) -> u32 {
        ((score - self.scale.0 * num_ends as f64) / self.scale.1).floor().max(0.0) as u32
    }

    fn first_blocks(&self, turns: &Turns, least: u32) -> BinaryHeap<Block> {
        let ((width, height), side) = (self.scores.size(), 1 << TOP);
        let mut blocks = BinaryHeap::new();
        for (x, y) in (0..height).step_by(side).flat_map(|y| (0..width).step_by(side).map(move |x| (x, y))) {
            for (turn, ends) in turns.levels[TOP].iter().enumerate() {
                let most: Vec<u32> = ends.chunks().map(|chunk| u32::from(u8::MAX) * chunk.len() as u32).collect();
                self.push(turns, Block { bound: 0, level: TOP, turn, x, y }, &most, least, &mut blocks);
            }
        }
        blocks
    }

    fn divide(&self, turns: &Turns, block: &Block, least: u32, blocks: &mut BinaryHeap<Block>) {
        let (level, half) = (block.level - 1, 1 << (block.level - 1));
        let last = turns.levels[level].len() - 1;
        let most: Vec<u32> = turns.levels[block.level][block.turn].most(&self.scores, block).collect();
        for (x, y) in [(0, 0), (half, 0), (0, half), (half, half)].map(|(x, y)| (block.x + x, block.y + y)) {
            for turn in 2 * block.turn..=(2 * block.turn + 1).min(last) {
                self.push(turns, Block { bound: 0, level, turn, x, y }, &most, least, blocks);
            }
        }
    }

    /// Adds a block where its bound is not too low and a robot can be in it. `most`: what each chunk of the returns scores at most, by the
    /// block that it is a part of: from there the bound comes down chunk by chunk, until it is too low.
    fn push(&self, turns: &Turns, block: Block, most: &[u32], least: u32, blocks: &mut BinaryHeap<Block>) {
        let layer = layer_of(1 << block.level).unwrap_or_default();
        if self.free.max(layer, block.x, block.y) == 0 {
            return;
        }
        let mut bound = most.iter().sum::<u32>();
        for (here, most) in turns.levels[block.level][block.turn].most(&self.scores, &block).zip(most) {
            bound -= most.saturating_sub(here);
            if bound < least {
                return;
            }
        }
        blocks.push(Block { bound, ..block });
    }

    /// The pose in the middle of a block.
    fn pose(&self, turns: &Turns, block: &Block) -> Pose2 {
        let half = 0.5 * f64::from(1 << block.level);
        let middle = Vector2::new(f64::from(block.x) + half, f64::from(block.y) + half) * self.side;
        Pose2::new(middle, ((block.turn << block.level) as f64 + half - 0.5) * turns.step)
    }
}

/// Where the turns of a block move a return, from the cell of the sensor: the corner, and the layer of the squares that cover it.
#[derive(Debug, Clone, Copy)]
struct TurnedEnd {
    x: i32,
    y: i32,
    layer: Option<usize>,
    /// Where its value is for a sensor in the cell (0, 0).
    offset: u32,
}

impl TurnedEnd {
    /// Of a return in a block of translations of this side.
    fn of(&[x, to_x, y, to_y]: &Reach, side: i32, scores: &Pooled) -> Self {
        let layer = layer_of((to_x - x).max(to_y - y) + side);
        Self { x, y, layer, offset: scores.offset(layer.unwrap_or_default(), x, y) }
    }

    /// The largest score from a cell of the sensor, wherever it is.
    fn max(&self, scores: &Pooled, x: i32, y: i32) -> u32 {
        self.layer.map_or(u32::from(u8::MAX), |layer| scores.max(layer, self.x + x, self.y + y))
    }
}

/// Where the turns of a block move all returns.
struct TurnedEnds {
    ends: Vec<TurnedEnd>,
    /// The corners of all of them; `None` where no square covers one.
    corners: Option<Reach>,
}

impl TurnedEnds {
    fn of(reaches: &[Reach], side: i32, scores: &Pooled) -> Self {
        let ends: Vec<TurnedEnd> = reaches.iter().map(|reach| TurnedEnd::of(reach, side, scores)).collect();
        let corners = ends.iter().map(|end| [end.x, end.x, end.y, end.y]).reduce(|all, end| covering(&all, &end));
        Self { corners: corners.filter(|_| ends.iter().all(|end| end.layer.is_some())), ends }
    }

    fn chunks(&self) -> impl Iterator<Item = &[TurnedEnd]> {
        self.ends.chunks(CHUNK)
    }

    /// What each chunk of the returns scores at most in a block.
    fn most<'a>(&'a self, scores: &'a Pooled, &Block { x, y, .. }: &Block) -> impl Iterator<Item = u32> + 'a {
        let moved = |[from_x, to_x, from_y, to_y]: Reach| [from_x + x, to_x + x, from_y + y, to_y + y];
        let are_held = self.corners.is_some_and(|corners| scores.holds(&moved(corners)));
        let shift = scores.shift(x, y);
        self.chunks().map(move |chunk| {
            if are_held {
                chunk.iter().map(|end| scores.at(end.offset.wrapping_add(shift))).sum()
            } else {
                chunk.iter().map(|end| end.max(scores, x, y)).sum::<u32>()
            }
        })
    }
}

/// The returns under the turns of all blocks.
struct Turns {
    /// From one turn of the lattice to the next (rad).
    step: f64,
    /// For each level and block of turns the returns.
    levels: Vec<Vec<TurnedEnds>>,
}

impl Turns {
    fn new(side: f64, ends: &[Vector2<f64>], scores: &Pooled) -> Self {
        let lever = quantile(&mut ends.iter().map(Vector2::norm).collect::<Vec<_>>(), LEVER_QUANTILE);
        let count = (std::f64::consts::TAU * lever.unwrap_or_default().max(side) / side).ceil().max(8.0);
        let step = std::f64::consts::TAU / count;
        let reaches = |turn: usize| -> Vec<Reach> {
            let rotation = UnitComplex::new(turn as f64 * step);
            // The sensor is in the middle of its cell.
            let cells = ends.iter().map(|end| (rotation * end / side).map(|value| (value + 0.5).floor() as i32));
            cells.map(|cell| [cell.x, cell.x, cell.y, cell.y]).collect()
        };
        let mut reaches: Vec<Vec<Reach>> = (0..count as usize).map(reaches).collect();
        let mut levels = Vec::new();
        for level in 0..=TOP {
            levels.push(reaches.iter().map(|group| TurnedEnds::of(group, 1 << level, scores)).collect());
            reaches = reaches.chunks(2).map(joined).collect();
        }
        Self { step, levels }
    }
}

/// The returns in an order in which each chunk has some from everywhere.
fn interleaved(ends: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let num_chunks = ends.len().div_ceil(CHUNK);
    (0..num_chunks).flat_map(|first| ends.iter().skip(first).step_by(num_chunks)).copied().collect()
}

/// The reaches of blocks of turns together.
fn joined(groups: &[Vec<Reach>]) -> Vec<Reach> {
    let mut joined = groups[0].clone();
    for (reach, other) in joined.iter_mut().zip(groups.iter().skip(1).flatten()) {
        *reach = covering(reach, other);
    }
    joined
}

/// The cells from the least to the largest of two reaches.
fn covering(a: &Reach, b: &Reach) -> Reach {
    [a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3])]
}

/// Places found so far.
#[derive(Default)]
struct Places {
    poses: Vec<Pose2>,
    /// The largest sum.
    best: u32,
    /// The places by where they are.
    known: HashMap<[i32; 3], Vec<Pose2>>,
}

/// The place of a pose among neighbours in x, y and heading.
fn neighbourhood(pose: &Pose2) -> [i32; 3] {
    let at = |value: f64, side: f64| (value / side).floor() as i32;
    let heading = pose.rotation.angle().rem_euclid(std::f64::consts::TAU);
    [at(pose.translation.x, SAME_PLACE.0), at(pose.translation.y, SAME_PLACE.0), at(heading, SAME_PLACE.1)]
}

/// Whether two poses are one place.
pub(super) fn are_one_place(a: &Pose2, b: &Pose2) -> bool {
    (a.translation.vector - b.translation.vector).norm() < SAME_PLACE.0
        && (a.rotation.inverse() * b.rotation).angle().abs() < SAME_PLACE.1
}

impl Places {
    fn is_known(&self, pose: &Pose2) -> bool {
        let [x, y, turn] = neighbourhood(pose);
        let last = (std::f64::consts::TAU / SAME_PLACE.1).floor() as i32;
        let turns = [turn - 1, turn, turn + 1].map(|turn| turn.rem_euclid(last + 1));
        let around = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y)));
        let mut cells = around.flat_map(|(x, y)| turns.map(|turn| [x, y, turn]));
        cells
            .any(|cell| self.known.get(&cell).is_some_and(|known| known.iter().any(|known| are_one_place(known, pose))))
    }

    fn add(&mut self, pose: Pose2, sum: u32) {
        self.known.entry(neighbourhood(&pose)).or_default().push(pose);
        self.best = self.best.max(sum);
        self.poses.push(pose);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::RigidMotion;
    use crate::map::occupancy_grid::OccupancyGrid;
    use crate::preprocess::planar_scan::PlanarScan;

    /// Returns from the walls of an L-shaped room, seen from here.
    fn scan_from(at: Vector2<f64>) -> PlanarScan {
        let corners =
            [[0.0, 0.0], [6.0, 0.0], [6.0, 3.0], [2.5, 3.0], [2.5, 5.0], [0.0, 5.0], [0.0, 0.0]].map(Vector2::from);
        let range = |direction: Vector2<f64>| {
            let hit = |pair: &[Vector2<f64>]| {
                let (along, offset) = (pair[1] - pair[0], pair[0] - at);
                let determinant = direction.perp(&along);
                let (range, share) = (offset.perp(&along) / determinant, offset.perp(&direction) / determinant);
                (range > 0.0 && (0.0..=1.0).contains(&share)).then_some(range)
            };
            corners.windows(2).filter_map(hit).fold(f64::INFINITY, f64::min)
        };
        let directions =
            (0..180).map(|beam| f64::from(2 * beam).to_radians().sin_cos()).map(|(sin, cos)| Vector2::new(cos, sin));
        PlanarScan::new(directions.map(|direction| direction * range(direction)).collect())
    }

    /// The map of the room, and the returns seen from a pose in it.
    fn room_and_scan(truth: &Pose2) -> (MapField, Vec<Vector2<f64>>) {
        let places = [[1.0, 1.0], [5.0, 1.0], [1.0, 4.0], [3.0, 2.0]].map(Vector2::from);
        let scans = places.map(scan_from);
        let placed: Vec<_> = scans.iter().zip(places).map(|(scan, at)| (scan, Pose2::new(at, 0.0))).collect();
        let seen = scan_from(truth.translation.vector);
        let ends = seen.points.iter().step_by(6).map(|point| truth.rotation.inverse() * point).collect();
        (MapField::new(&OccupancyGrid::new(&placed, &[], 0.05)), ends)
    }

    #[test]
    fn every_pose_of_the_lattice_that_scores_enough_is_at_a_place_that_was_found() {
        let truth = Pose2::new(Vector2::new(4.3, 1.7), 2.0);
        let (field, ends) = room_and_scan(&truth);
        let search = Search::new(&field);
        let (margin, budget) = (1.2 * ends.len() as f64, Budget { blocks: usize::MAX, places: usize::MAX });
        let found = search.places(&ends, &Wanted { least_mean: 0.0, margin }, &budget);
        assert!(found.is_complete);
        let off = field.in_world(&found.places[0]).inverse() * truth;
        assert!(off.translation_norm() < 0.2 && off.rotation_angle() < 0.1, "{off}");
        // Every pose of the lattice, looked at one by one.
        let turns = Turns::new(search.side, &ends, &search.scores);
        let (width, height) = search.scores.size();
        let cells = || (0..width * height).map(|cell| (cell % width, cell / width));
        let sum = |turn: usize, (x, y): (i32, i32)| {
            turns.levels[0][turn].ends.iter().map(|end| end.max(&search.scores, x, y)).sum::<u32>()
        };
        let all: Vec<(usize, (i32, i32), u32)> = (0..turns.levels[0].len())
            .flat_map(|turn| cells().map(move |at| (turn, at)))
            .filter(|(_, (x, y))| search.free.max(0, *x, *y) > 0)
            .map(|(turn, at)| (turn, at, sum(turn, at)))
            .collect();
        let best = all.iter().map(|(.., sum)| *sum).max().unwrap();
        let enough = best - (margin / search.scale.1).floor() as u32;
        let scoring: Vec<_> = all.iter().filter(|(.., sum)| *sum >= enough).collect();
        assert!(scoring.len() > 10, "{}", scoring.len());
        for (turn, (x, y), bound) in scoring {
            let pose = search.pose(&turns, &Block { bound: *bound, level: 0, turn: *turn, x: *x, y: *y });
            // A block of two cells may reach beyond the place in whose neighbourhood its middle lies.
            let is_near = |place: &Pose2| {
                let off = place.inverse() * pose;
                off.translation_norm() < SAME_PLACE.0 + search.side && off.rotation_angle() < SAME_PLACE.1 + turns.step
            };
            assert!(found.places.iter().any(is_near), "{pose} was not found");
        }
        assert!(search.score_of(enough, ends.len()) + search.scale.1 >= found.others_at_most);
    }

    #[test]
    fn a_search_out_of_budget_says_what_the_others_may_score() {
        let truth = Pose2::new(Vector2::new(1.2, 3.0), -1.0);
        let (field, ends) = room_and_scan(&truth);
        let search = Search::new(&field);
        let wanted = Wanted { least_mean: 0.0, margin: 100.0 };
        let some = search.places(&ends, &wanted, &Budget { blocks: 40, places: 100 });
        let all = search.places(&ends, &wanted, &Budget { blocks: usize::MAX, places: 1000 });
        assert!(!some.is_complete && all.is_complete);
        assert!(some.places.len() < all.places.len() && some.others_at_most > all.others_at_most);
        assert!(search.places(&[], &wanted, &Budget { blocks: 40, places: 100 }).places.is_empty());
    }
}
