//! Branch and bound over the turns and shifts of a window.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::Vector2;

use super::blocks::{Blocks, Candidate};

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

/// A search in progress.
pub(super) struct Search<'a, V> {
    pub blocks: &'a Blocks<'a>,
    pub excluded: Vec<Excluded>,
    /// Smallest sum of a pose that is searched for.
    pub floor: u32,
    /// A sum of this much ends the search.
    pub enough: u32,
    pub best: Option<Candidate>,
    /// Called with every candidate that is expanded.
    pub visit: V,
}

impl<V: FnMut(&Candidate)> Search<'_, V> {
    /// The most promising block first, then what it leaves, depth first (Hess et al. 2016, algorithm 3). The better the best pose
    /// is, the fewer blocks need to be bounded: those that may have a large bound come before the others.
    pub(super) fn run(mut self) -> Option<Candidate> {
        let (largest, mut done) = (self.blocks.largest(), u32::MAX);
        for part in [8, 4, 2, 1] {
            let least = self.best.map_or(self.floor, |best| best.bound + 1).max(largest - largest / part);
            if least >= done || self.best.is_some_and(|best| best.bound >= self.enough) {
                break;
            }
            // A heap gives the first few in order, after which the search often ends, for less than sorting all of them.
            let mut candidates: BinaryHeap<_> = self.blocks.between(least, done).into_iter().map(Promising).collect();
            while let Some(Promising(candidate)) = candidates.pop()
                && !self.is_beaten(&candidate)
            {
                self.expand(&candidate);
            }
            done = least;
        }
        self.best
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
    fn expand(&mut self, candidate: &Candidate) {
        if self.is_excluded(candidate) {
            return;
        }
        (self.visit)(candidate);
        if candidate.level == 0 {
            self.best = Some(*candidate);
            return;
        }
        let (mut children, count) = self.children(candidate);
        let children = &mut children[..count];
        sort_few(children);
        for child in children {
            if self.is_beaten(child) {
                return;
            }
            self.expand(child);
        }
    }

    /// The quarters of a candidate that lie in the window, but for those that are passed over.
    fn children(&self, candidate: &Candidate) -> ([Candidate; 4], usize) {
        let level = candidate.level - 1;
        let half = 1 << level;
        let half_cells = self.blocks.turns.half_cells;
        let to_beat = self.best.map_or(self.floor, |best| best.bound + 1);
        let mut children = [*candidate; 4];
        let mut count = 0;
        for (number, (dx, dy)) in [(0, 0), (half, 0), (0, half), (half, half)].into_iter().enumerate() {
            let child = Candidate { level, x: candidate.x + dx, y: candidate.y + dy, ..*candidate };
            if child.x <= half_cells && child.y <= half_cells && !self.is_excluded(&child) {
                let bound = if candidate.level == self.blocks.level {
                    self.blocks.quarter(candidate.index, number, &child, to_beat)
                } else {
                    self.blocks.bound(&child, to_beat)
                };
                children[count] = Candidate { bound, ..child };
                count += 1;
            }
        }
        (children, count)
    }
}

/// A candidate that is greater than those after it in [`order`].
struct Promising(Candidate);

impl Ord for Promising {
    fn cmp(&self, other: &Self) -> Ordering {
        order(&other.0).cmp(&order(&self.0))
    }
}

impl PartialOrd for Promising {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Promising {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Promising {}

/// Insertion sort, in a tenth of the WebAssembly of the standard library's sort.
fn sort_few(candidates: &mut [Candidate]) {
    for end in 1..candidates.len() {
        for place in (1..=end).rev() {
            if order(&candidates[place]) < order(&candidates[place - 1]) {
                candidates.swap(place, place - 1);
            }
        }
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
