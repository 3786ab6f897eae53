//! The best of all poses of a planar scan in a window around a first guess: a global search, which no local minimum ends.
//!
//! The target is drawn into a grid of likelihoods; a pose scores the sum over the source's points. Branch and bound over
//! a pyramid of sliding maxima finds the best of all poses on the grid without looking at most of them: Olson,
//! "Real-time correlative scan matching", ICRA 2009; Hess et al., "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016,
//! algorithm 3 and eqs. 14-16.

use nalgebra::{Vector2, Vector3};
use serde::Serialize;

mod blocks;
mod branch_and_bound;
mod grid;
mod turns;

use crate::error::{Error, Result};
use crate::geometry::{Pose2, RigidMotion};
use blocks::{Blocks, Candidate};
use branch_and_bound::{Excluded, Search};
pub use grid::{LikelihoodGrid, RESOLUTION};
use turns::Turns;

/// Where to search, around a centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchWindow {
    /// Half width in x and in y (m).
    pub translation: f64,
    /// Half width of the turn (rad).
    pub rotation: f64,
}

/// Largest half width of a search that a caller may ask for (m, rad).
const MAX_SEARCH: f64 = 20.0;

impl SearchWindow {
    /// This window, if its half widths are neither negative nor too large: time and memory grow with them.
    ///
    /// # Errors
    /// When a half width is not from 0 to 20 m or rad.
    pub fn checked(self) -> Result<Self> {
        let Self { translation, rotation } = self;
        if [translation, rotation].iter().all(|half_width| (0.0..=MAX_SEARCH).contains(half_width)) {
            return Ok(self);
        }
        let problem = format!("The search window of {translation} m and {rotation} rad is negative or too large");
        Err(Error::whole(problem, format!("Give half widths from 0 to {MAX_SEARCH}")))
    }
}

/// The best pose of a window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrelativeMatch {
    /// Maps source points into the target frame.
    pub T_target_source: Pose2,
    /// Mean likelihood of the source's points, 0..=1.
    pub score: f64,
}

/// Poses that a search looked into together: translations by `x..x + side` and `y..y + side` from the centre, under one turn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct SearchedBlock {
    /// Level of the pyramid; 0 is a single pose.
    pub level: usize,
    /// Turn from the centre (rad).
    pub turn: f64,
    /// Least translation along x from the centre (m).
    pub x: f64,
    /// Least translation along y from the centre (m).
    pub y: f64,
    /// Side of the block (m).
    pub side: f64,
    /// None of its poses scores more: mean likelihood of the source's points, 0..=1.
    pub bound: f64,
}

/// Points further out turn the search needlessly fine (m).
const MAX_LEVER: f64 = 10.0;

/// A source in a window about a centre, ready to be looked for: once for the best pose, again for others.
pub struct WindowSearch<'a> {
    grid: &'a LikelihoodGrid,
    center: Pose2,
    /// The turn (rad) that moves the source's furthest point, or one [`MAX_LEVER`] away, by one cell.
    turn_step: f64,
    source: &'a [Vector2<f64>],
    blocks: Blocks<'a>,
}

impl LikelihoodGrid {
    /// Prepares the search for a source within `window` around `center`: translations in steps of one cell, rotations in steps
    /// that move the source's furthest point by one cell, or a point 10 m away where the furthest is farther away.
    pub fn window<'a>(&'a self, source: &'a [Vector2<f64>], center: &Pose2, window: SearchWindow) -> WindowSearch<'a> {
        let furthest = source.iter().map(Vector2::norm).fold(0.0, f64::max);
        // The cells of a target of many kilometres are larger than 10 m.
        let lever = furthest.min(MAX_LEVER).max(self.resolution);
        let turn_step = 2.0 * (self.resolution / (2.0 * lever)).asin();
        let turns = (window.rotation / turn_step).ceil() as i32;
        let half_cells = (window.translation / self.resolution).ceil() as i32;
        let blocks = Blocks::new(Turns::new(self, source, center, (turn_step, turns), half_cells));
        WindowSearch { grid: self, center: *center, turn_step, source, blocks }
    }

    /// The best pose within `window` around `center`. `None` for an empty source.
    pub fn search(&self, source: &[Vector2<f64>], center: &Pose2, window: SearchWindow) -> Option<CorrelativeMatch> {
        self.window(source, center, window).best()
    }
}

impl WindowSearch<'_> {
    /// The best pose of the window. `None` for an empty source.
    pub fn best(&self) -> Option<CorrelativeMatch> {
        self.run(Vec::new(), (0, u32::MAX), |_| ())
    }

    /// The same where it scores at least this (mean likelihood, 0..=1), and sooner where none does. `None` there.
    pub fn best_above(&self, score: f64) -> Option<CorrelativeMatch> {
        let floor = (score * 255.0 * self.source.len() as f64) as u32; // saturates
        self.run(Vec::new(), (floor, u32::MAX), |_| ())
    }

    /// The best pose, sooner than by [`best`](Self::best) where a pose near this one scores well: only what scores as much is looked for.
    pub fn best_from(&self, known: &Pose2) -> Option<CorrelativeMatch> {
        let (away, turn) = self.place(known);
        let (x, y) = (away.x.round() as i32, away.y.round() as i32);
        let turns = &self.blocks.turns;
        let is_inside = x.abs() <= turns.half_cells && y.abs() <= turns.half_cells;
        let turned = turns.index_of(turn.round() as i32).filter(|_| is_inside);
        let sum = turned.map_or(0, |index| turns.get(index).sum(self.grid, (x, y)));
        self.run(Vec::new(), (sum, u32::MAX), |_| ())
    }

    /// Where a pose lies from the centre, in cells and steps of turn.
    fn place(&self, pose: &Pose2) -> (Vector2<f64>, f64) {
        let away = (pose.translation.vector - self.center.translation.vector) / self.grid.resolution;
        (away, (self.center.rotation.inverse() * pose.rotation).angle() / self.turn_step)
    }

    /// Mean likelihood of the source's points at a pose, 0..=1.
    pub fn score(&self, T_target_source: &Pose2) -> f64 {
        self.grid.score(self.source, T_target_source)
    }

    /// What [`best`](Self::best) looks into, in the order in which it does: each block of poses whose bound beats the best
    /// pose so far, on level 0 each pose that becomes the best.
    pub fn path(&self) -> Vec<SearchedBlock> {
        let (mut path, sum, resolution) = (Vec::new(), 255.0 * self.source.len() as f64, self.grid.resolution);
        self.run(Vec::new(), (0, u32::MAX), |block| {
            path.push(SearchedBlock {
                level: block.level,
                turn: f64::from(block.turn) * self.turn_step,
                x: f64::from(block.x) * resolution,
                y: f64::from(block.y) * resolution,
                side: f64::from(1 << block.level) * resolution,
                bound: f64::from(block.bound) / sum,
            });
        });
        path
    }

    /// The best pose of the window that differs from each of the `known` ones by more than `min_distance` in translation or in
    /// rotation, if its score is at least `min_score`: the second basin, where there is one. The search ends at the first pose
    /// that scores at least `enough_score`.
    pub fn rival(
        &self,
        known: &[Pose2],
        min_distance: SearchWindow,
        min_score: f64,
        enough_score: f64,
    ) -> Option<CorrelativeMatch> {
        let excluded = |known: &Pose2| {
            let (away, turn) = self.place(known);
            let radius = min_distance.translation / self.grid.resolution;
            Excluded { away, turn, radius, turns: min_distance.rotation / self.turn_step }
        };
        let whole = 255.0 * self.source.len() as f64;
        let sums = ((min_score * whole) as u32, (enough_score * whole) as u32); // saturates
        self.run(known.iter().map(excluded).collect(), sums, |_| ())
    }

    fn run(
        &self,
        excluded: Vec<Excluded>,
        (floor, enough): (u32, u32),
        visit: impl FnMut(&Candidate),
    ) -> Option<CorrelativeMatch> {
        if self.source.is_empty() {
            return None;
        }
        let Self { grid, blocks, .. } = self;
        let best = Search { blocks, excluded, floor, enough, best: None, visit }.run()?;
        let turned = nalgebra::UnitComplex::new(best.turn as f64 * self.turn_step) * self.center.rotation;
        let shift = Vector2::new(best.x as f64, best.y as f64) * grid.resolution;
        let pose = Pose2::exp(&Vector3::new(turned.angle(), 0.0, 0.0));
        Some(CorrelativeMatch {
            T_target_source: Pose2::from_parts((self.center.translation.vector + shift).into(), pose.rotation),
            score: f64::from(best.bound) / (255.0 * self.source.len() as f64),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::grid::NUM_LEVELS;
    use super::*;

    /// Walls of an L-shaped room, a point every 7 cm.
    fn room() -> Vec<Vector2<f64>> {
        let corners = [[0.0, 0.0], [6.0, 0.0], [6.0, 3.0], [2.5, 3.0], [2.5, 5.0], [0.0, 5.0], [0.0, 0.0]];
        let wall = |pair: &[[f64; 2]]| {
            let (a, b) = (Vector2::from(pair[0]), Vector2::from(pair[1]));
            let count = ((b - a).norm() / 0.07) as usize;
            (0..count).map(move |i| a + (b - a) * (i as f64 / count as f64)).collect::<Vec<_>>()
        };
        corners.windows(2).flat_map(wall).collect()
    }

    #[test]
    fn every_level_holds_the_maximum_of_its_cells() {
        let grid = LikelihoodGrid::new(&room());
        for level in 1..NUM_LEVELS {
            let side = 1 << level;
            for (x, y) in [(0, 0), (13, 27), (40, 40), (grid.width - 1, grid.height - 1), (31, 1)] {
                let cells = (0..side * side).map(|cell| grid.likelihood(0, x + cell % side, y + cell / side));
                assert_eq!(grid.likelihood(level, x, y), cells.max().unwrap(), "level {level} at {x}, {y}");
            }
        }
    }

    #[test]
    fn finds_the_best_of_all_poses_in_the_window() {
        let room = room();
        let grid = LikelihoodGrid::new(&room);
        let window = SearchWindow { translation: 0.8, rotation: 0.3 };
        for seed in 0..6 {
            let T = Pose2::exp(&Vector3::new(0.25 * f64::from(seed).sin(), 0.6 * f64::from(seed).cos(), 0.3));
            let source: Vec<_> = room.iter().skip(seed as usize).step_by(9).map(|p| T.inverse().act(p)).collect();
            let found = grid.search(&source, &Pose2::identity(), window).unwrap();
            let search = grid.window(&source, &Pose2::identity(), window);
            for known in [T, Pose2::identity(), Pose2::translation(9.0, 9.0)] {
                assert_eq!(search.best_from(&known).unwrap().score, found.score, "seed {seed}");
            }
            let path = search.path();
            let last = path.iter().rfind(|block| block.level == 0).unwrap();
            let there = Vector2::new(last.x, last.y);
            assert!((found.T_target_source.translation.vector - there).norm() < 1e-12);
            assert_eq!((last.bound, path[0].level), (found.score, 2), "17 shifts across: blocks of 4 x 4");

            let lever = source.iter().map(Vector2::norm).fold(0.0, f64::max).min(MAX_LEVER);
            let turn_step = 2.0 * (RESOLUTION / (2.0 * lever)).asin();
            let turns = (window.rotation / turn_step).ceil() as i32;
            let mut best = 0;
            for turn in -turns..=turns {
                let R = nalgebra::UnitComplex::new(f64::from(turn) * turn_step);
                for (dx, dy) in (-8..=8).flat_map(|dx| (-8..=8).map(move |dy| (dx, dy))) {
                    let score = source.iter().map(|p| {
                        let (x, y) = grid.cell(&(R * p));
                        grid.likelihood(0, x + dx, y + dy)
                    });
                    best = best.max(score.sum::<u32>());
                }
            }
            assert!((found.score - f64::from(best) / (255.0 * source.len() as f64)).abs() < 1e-12, "seed {seed}");
            let error = T.inverse() * found.T_target_source;
            assert!(error.translation_norm() < 0.15 && error.rotation_angle() < 0.03, "seed {seed}: {error}");
        }
    }

    #[test]
    fn several_points_in_a_cell_count_as_often() {
        let grid = LikelihoodGrid::new(&room());
        let window = SearchWindow { translation: 6.0, rotation: 0.4 }; // far beyond the grid
        let T = Pose2::exp(&Vector3::new(0.2, 0.4, -0.3));
        let once: Vec<_> = room().iter().step_by(5).map(|p| T.inverse().act(p)).collect();
        for count in [2, 4, 7] {
            let often: Vec<_> = once.iter().flat_map(|point| vec![*point; count]).collect();
            let [once, often] = [&once, &often].map(|source| grid.window(source, &Pose2::identity(), window));
            assert_eq!(often.best().map(|best| best.score), once.best().map(|best| best.score), "{count} times");
            assert_eq!(often.best_from(&T).map(|best| best.score), once.best().map(|best| best.score));
        }
    }

    #[test]
    fn windows_of_zero_to_twenty_metres_can_be_searched() {
        let window = |translation, rotation| SearchWindow { translation, rotation };
        for searched in [window(0.0, 0.0), window(MAX_SEARCH, 0.5)] {
            assert_eq!(searched.checked(), Ok(searched));
        }
        let too_much = [(-0.1, 0.0), (0.0, 1.01 * MAX_SEARCH), (f64::NAN, 0.0), (1.0, f64::INFINITY)];
        for refused in too_much.map(|(translation, rotation)| window(translation, rotation)) {
            assert!(refused.checked().is_err(), "{refused:?}");
        }
    }

    #[test]
    fn nothing_to_match_is_no_match() {
        let window = SearchWindow { translation: 1.0, rotation: 0.1 };
        assert!(LikelihoodGrid::new(&room()).search(&[], &Pose2::identity(), window).is_none());
        let nowhere = LikelihoodGrid::new(&[]).search(&room(), &Pose2::identity(), window).unwrap();
        assert_eq!(nowhere.score, 0.0);
        let wide = [Vector2::zeros(), Vector2::repeat(1e6)];
        let found = LikelihoodGrid::new(&wide).search(&wide, &Pose2::identity(), window).unwrap();
        assert_eq!((found.score, found.T_target_source), (1.0, Pose2::identity()));
        let one = LikelihoodGrid::new(&[Vector2::new(1e3, -1e3)]);
        assert_eq!(one.search(&[Vector2::zeros()], &Pose2::translation(1e3, -1e3), window).unwrap().score, 1.0);
    }
}
