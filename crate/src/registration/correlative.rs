//! The globally best pose of a planar scan in a window, without a first guess.
//!
//! The target is drawn into a grid of likelihoods; a pose scores the sum over the source's points. Branch and bound over
//! a pyramid of sliding maxima finds the best of all poses on the grid without looking at most of them: Olson,
//! "Real-time correlative scan matching", ICRA 2009; Hess et al., "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016,
//! algorithm 3 and eqs. 14-16.

use nalgebra::{Vector2, Vector3};
use serde::Serialize;

use crate::geometry::{Pose2, RigidMotion};

/// Where to search, around a centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchWindow {
    /// Half width in x and in y (m).
    pub translation: f64,
    /// Half width of the turn (rad).
    pub rotation: f64,
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

/// Side of a cell (m).
pub const RESOLUTION: f64 = 0.1;
/// Standard deviation of the likelihood around a target point, in cells of that side (m).
const SIGMA: f64 = 0.12;
/// Levels of the pyramid; the coarsest looks at 2^5 cells at once.
const NUM_LEVELS: usize = 6;
/// Around a pose nothing is left out.
const NOWHERE: SearchWindow = SearchWindow { translation: 0.0, rotation: 0.0 };
/// Points further out turn the search needlessly fine (m).
const MAX_LEVER: f64 = 10.0;
/// Most cells of a grid; a larger target gets larger cells.
const MAX_CELLS: f64 = 4e6;

/// A target drawn into a pyramid of likelihoods.
pub struct LikelihoodGrid {
    resolution: f64,
    /// Standard deviation of the likelihood around a target point (m).
    sigma: f64,
    /// Position of the corner of cell (0, 0) (m).
    corner: Vector2<f64>,
    width: i32,
    height: i32,
    /// `levels[h][y * width + x]` is the largest likelihood in the 2^h x 2^h cells from (x, y) on.
    levels: Vec<Vec<u8>>,
}

impl LikelihoodGrid {
    /// Draws target points (m, finite).
    pub fn new(points: &[Vector2<f64>]) -> Self {
        Self::with_resolution(points, RESOLUTION)
    }

    /// The same in cells of another side (m); the likelihood is as much wider as they are.
    pub fn with_resolution(points: &[Vector2<f64>], resolution: f64) -> Self {
        let (low, high) = points.iter().fold(
            (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY)),
            |(low, high): (Vector2<f64>, Vector2<f64>), p| (low.inf(p), high.sup(p)),
        );
        if points.is_empty() {
            return Self {
                resolution,
                sigma: SIGMA,
                corner: Vector2::zeros(),
                width: 0,
                height: 0,
                levels: vec![Vec::new(); NUM_LEVELS],
            };
        }
        let extent = high - low;
        let sigma = SIGMA * (resolution / RESOLUTION);
        let resolution = resolution.max((extent.x * extent.y / MAX_CELLS).sqrt()).max(extent.amax() / MAX_CELLS);
        let reach = (3.0 * sigma / resolution).ceil() as i32;
        // Sliding maxima reach up to 2^h - 1 cells to the lower left of the first drawn cell.
        let margin = reach + (1 << (NUM_LEVELS - 1));
        let corner = low - Vector2::repeat(resolution * margin as f64);
        let width = (extent.x / resolution) as i32 + 2 + margin + reach;
        let height = (extent.y / resolution) as i32 + 2 + margin + reach;
        let mut grid = Self { resolution, sigma, corner, width, height, levels: Vec::with_capacity(NUM_LEVELS) };
        let finest = grid.draw(points, reach);
        grid.levels.push(finest);
        for level in 1..NUM_LEVELS {
            let coarser = grid.sliding_maximum(&grid.levels[level - 1], 1 << (level - 1));
            grid.levels.push(coarser);
        }
        grid
    }

    fn cell(&self, point: &Vector2<f64>) -> (i32, i32) {
        let cell = (point - self.corner) / self.resolution;
        (cell.x.floor() as i32, cell.y.floor() as i32)
    }

    /// Likelihood 255 * exp(-d^2 / 2 sigma^2), by the distance d of a cell to the nearest cell with a point.
    fn draw(&self, points: &[Vector2<f64>], reach: i32) -> Vec<u8> {
        let side = 2 * reach as usize + 1;
        let stamp: Vec<u8> = (0..side * side)
            .map(|cell| {
                let (dx, dy) = ((cell % side) as f64 - reach as f64, (cell / side) as f64 - reach as f64);
                let sq_distance = (dx * dx + dy * dy) * self.resolution * self.resolution;
                (255.0 * (-sq_distance / (2.0 * self.sigma * self.sigma)).exp()) as u8
            })
            .collect();
        let width = self.width as usize;
        let mut cells = vec![0u8; width * self.height as usize];
        for point in points {
            let (x, y) = self.cell(point); // at least `reach` cells away from every border
            let first = (y - reach) as usize * width + (x - reach) as usize;
            for (row, stamp_row) in stamp.chunks_exact(side).enumerate() {
                maximum(&mut cells[first + row * width..][..side], stamp_row);
            }
        }
        cells
    }

    /// The largest of four squares of a finer level, `shift` cells apart; whole rows at once.
    fn sliding_maximum(&self, finer: &[u8], shift: usize) -> Vec<u8> {
        let width = self.width as usize;
        let mut coarser = finer.to_vec();
        for (row, finer_row) in coarser.chunks_exact_mut(width).zip(finer.chunks_exact(width)) {
            let overlap = width.saturating_sub(shift);
            maximum(&mut row[..overlap], &finer_row[width - overlap..]);
        }
        for first in (0..coarser.len()).step_by(width) {
            let (rows, below) = coarser.split_at_mut((first + shift * width).min(finer.len()));
            if let Some(row_below) = below.get(..width) {
                maximum(&mut rows[first..first + width], row_below); // upwards: the rows below are not written yet
            }
        }
        coarser
    }

    fn likelihood(&self, level: usize, x: i32, y: i32) -> u32 {
        if x < 0 || y < 0 || x >= self.width || y >= self.height {
            return 0;
        }
        u32::from(self.levels[level][y as usize * self.width as usize + x as usize])
    }

    /// Mean likelihood of a source's points at a pose, 0..=1.
    pub fn score(&self, source: &[Vector2<f64>], T_target_source: &Pose2) -> f64 {
        let likelihood = |point| {
            let (x, y) = self.cell(&T_target_source.act(point));
            self.likelihood(0, x, y)
        };
        source.iter().map(likelihood).sum::<u32>() as f64 / (255.0 * source.len().max(1) as f64)
    }

    /// Parts the cells of a source by whether shifts of up to `half_cells` keep them on the grid; what no shift brings
    /// onto it is left out.
    fn rotated_source(&self, turn: i32, cells: impl Iterator<Item = (i32, i32)>, half_cells: i32) -> RotatedSource {
        let mut rotated = RotatedSource { turn, inside: Vec::with_capacity(cells.size_hint().0), border: Vec::new() };
        for (x, y) in cells {
            let is_inside = |cell: i32, size: i32| cell >= half_cells && cell < size - half_cells;
            let is_near = |cell: i32, size: i32| cell >= -half_cells && cell < size + half_cells;
            if is_inside(x, self.width) && is_inside(y, self.height) {
                rotated.inside.push(y * self.width + x);
            } else if is_near(x, self.width) && is_near(y, self.height) {
                rotated.border.push((x, y));
            }
        }
        rotated
    }

    /// The best pose within `window` around `center`, on a grid of the map's cells and of rotations that move a point
    /// 10 m away by one cell. `None` for an empty source.
    pub fn search(&self, source: &[Vector2<f64>], center: &Pose2, window: SearchWindow) -> Option<CorrelativeMatch> {
        self.search_apart(source, center, window, (&[], NOWHERE), (0.0, f64::INFINITY), |_| ())
    }

    /// What [`search`](Self::search) looks into, in the order in which it does: each block of poses whose bound beats the best pose
    /// so far, on level 0 each pose that becomes the best.
    pub fn search_path(&self, source: &[Vector2<f64>], center: &Pose2, window: SearchWindow) -> Vec<SearchedBlock> {
        let (mut path, sum) = (Vec::new(), 255.0 * source.len() as f64);
        let turn_step = self.turn_step(source);
        self.search_apart(source, center, window, (&[], NOWHERE), (0.0, f64::INFINITY), |block| {
            path.push(SearchedBlock {
                level: block.level,
                turn: f64::from(block.turn) * turn_step,
                x: f64::from(block.x) * self.resolution,
                y: f64::from(block.y) * self.resolution,
                side: f64::from(1 << block.level) * self.resolution,
                bound: f64::from(block.bound) / sum,
            });
        });
        path
    }

    /// The turn (rad) that moves the source's furthest point, or one [`MAX_LEVER`] away, by one cell.
    fn turn_step(&self, source: &[Vector2<f64>]) -> f64 {
        let lever = source.iter().map(Vector2::norm).fold(self.resolution, f64::max).min(MAX_LEVER);
        2.0 * (self.resolution / (2.0 * lever)).asin()
    }

    /// The best pose of the window that lies apart from known ones by more than the window beside them, and
    /// scores at least the first of `scores`: the second basin, where there is one. One that scores the second is enough:
    /// no better one is looked for.
    pub fn rival(
        &self,
        source: &[Vector2<f64>],
        center: &Pose2,
        window: SearchWindow,
        apart_from: (&[Pose2], SearchWindow),
        scores: (f64, f64),
    ) -> Option<CorrelativeMatch> {
        self.search_apart(source, center, window, apart_from, scores, |_| ())
    }

    fn search_apart(
        &self,
        source: &[Vector2<f64>],
        center: &Pose2,
        window: SearchWindow,
        (known, apart): (&[Pose2], SearchWindow),
        (least_score, enough_score): (f64, f64),
        visit: impl FnMut(&Candidate),
    ) -> Option<CorrelativeMatch> {
        if source.is_empty() {
            return None;
        }
        let turn_step = self.turn_step(source);
        let turns = (window.rotation / turn_step).ceil() as i32;
        let half_cells = (window.translation / self.resolution).ceil() as i32;
        let excluded = |known: &Pose2| {
            let away = (known.translation.vector - center.translation.vector) / self.resolution;
            let turn = (center.rotation.inverse() * known.rotation).angle() / turn_step;
            Excluded { away, turn, radius: apart.translation / self.resolution, turns: apart.rotation / turn_step }
        };
        let excluded = known.iter().map(excluded).collect();

        let rotated: Vec<RotatedSource> = (-turns..=turns)
            .map(|turn| {
                let rotation = nalgebra::UnitComplex::new(turn as f64 * turn_step) * center.rotation;
                let cells = source.iter().map(|p| self.cell(&(rotation * p + center.translation.vector)));
                self.rotated_source(turn, cells, half_cells)
            })
            .collect();
        let sum = |score: f64| (score * 255.0 * source.len() as f64) as u32; // saturates
        let (floor, enough) = (sum(least_score), sum(enough_score));
        let best =
            Search { grid: self, rotated: &rotated, half_cells, excluded, floor, enough, best: None, visit }.run()?;
        let turned = nalgebra::UnitComplex::new(best.turn as f64 * turn_step) * center.rotation;
        let shift = Vector2::new(best.x as f64, best.y as f64) * self.resolution;
        let pose = Pose2::exp(&Vector3::new(turned.angle(), 0.0, 0.0));
        Some(CorrelativeMatch {
            T_target_source: Pose2::from_parts((center.translation.vector + shift).into(), pose.rotation),
            score: f64::from(best.bound) / (255.0 * source.len() as f64),
        })
    }
}

/// Poses that a search passes over, in cells and steps of turn from the centre of its window.
#[derive(Debug, Clone, Copy)]
struct Excluded {
    away: Vector2<f64>,
    turn: f64,
    radius: f64,
    turns: f64,
}

impl Excluded {
    /// Whether all translations from (x, y) to (x, y) + side - 1 under this turn are passed over.
    fn covers(&self, turn: i32, x: i32, y: i32, side: i32) -> bool {
        let far = |low: i32, away: f64| (f64::from(low) - away).abs().max((f64::from(low + side - 1) - away).abs());
        (f64::from(turn) - self.turn).abs() <= self.turns
            && far(x, self.away.x).hypot(far(y, self.away.y)) <= self.radius
    }
}

/// Raises each of `values` to its counterpart in `others`.
fn maximum(values: &mut [u8], others: &[u8]) {
    for (value, &other) in values.iter_mut().zip(others) {
        *value = (*value).max(other);
    }
}

/// The source under one turn, as cells of the grid.
struct RotatedSource {
    turn: i32,
    /// Indices of the cells that every shift of the window keeps on the grid.
    inside: Vec<i32>,
    /// Those that some shifts take off it.
    border: Vec<(i32, i32)>,
}

/// All translations from (x, y) to (x, y) + 2^level - 1 cells, under one turn.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    bound: u32,
    level: usize,
    rotated: usize,
    turn: i32,
    x: i32,
    y: i32,
}

/// The highest bound first; among equals the smallest turn, then the smallest shift: the same answer everywhere.
fn sort_by_promise(candidates: &mut [Candidate]) {
    candidates.sort_by_key(|c| (std::cmp::Reverse(c.bound), c.turn.abs(), c.x.abs() + c.y.abs(), c.turn, c.x, c.y));
}

struct Search<'a, V> {
    grid: &'a LikelihoodGrid,
    rotated: &'a [RotatedSource],
    half_cells: i32,
    excluded: Vec<Excluded>,
    /// Sums at or below this are not looked for.
    floor: u32,
    /// A sum of this much ends the search.
    enough: u32,
    best: Option<Candidate>,
    /// Is told of every candidate that is looked into.
    visit: V,
}

impl<V: FnMut(&Candidate)> Search<'_, V> {
    /// Depth first, the most promising candidate first (Hess et al. 2016, algorithm 3).
    fn run(mut self) -> Option<Candidate> {
        let top = NUM_LEVELS - 1;
        let stride = 1 << top;
        let mut candidates = Vec::new();
        for rotated in 0..self.rotated.len() {
            let mut y = -self.half_cells;
            while y <= self.half_cells {
                let mut x = -self.half_cells;
                while x <= self.half_cells {
                    candidates.push(self.candidate(top, rotated, x, y));
                    x += stride;
                }
                y += stride;
            }
        }
        self.branch(&mut candidates);
        self.best
    }

    fn branch(&mut self, candidates: &mut [Candidate]) {
        sort_by_promise(candidates);
        for candidate in candidates {
            let is_beaten = match self.best {
                Some(best) => candidate.bound <= best.bound || best.bound >= self.enough,
                None => candidate.bound < self.floor,
            };
            if is_beaten {
                return;
            }
            if self.excluded.iter().any(|e| e.covers(candidate.turn, candidate.x, candidate.y, 1 << candidate.level)) {
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
                if x <= self.half_cells && y <= self.half_cells {
                    children[count] = self.candidate(level, candidate.rotated, x, y);
                    count += 1;
                }
            }
            self.branch(&mut children[..count]);
        }
    }

    /// Bounds the score of the candidate's poses; no further than it takes to see that it cannot beat the best.
    fn candidate(&self, level: usize, rotated: usize, x: i32, y: i32) -> Candidate {
        let RotatedSource { turn, inside, border } = &self.rotated[rotated];
        let to_beat = self.best.map_or(self.floor, |best| best.bound);
        let mut left = 255 * (inside.len() + border.len()) as u32;
        let mut bound = 0;
        let shift = y * self.grid.width + x;
        let cells = &self.grid.levels[level];
        for indices in inside.chunks(16) {
            bound += indices.iter().map(|&index| u32::from(cells[(index + shift) as usize])).sum::<u32>();
            left -= 255 * indices.len() as u32;
            if bound + left < to_beat {
                return Candidate { bound, level, rotated, turn: *turn, x, y };
            }
        }
        bound += border.iter().map(|&(cx, cy)| self.grid.likelihood(level, cx + x, cy + y)).sum::<u32>();
        Candidate { bound, level, rotated, turn: *turn, x, y }
    }
}

#[cfg(test)]
mod tests {
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
            let path = grid.search_path(&source, &Pose2::identity(), window);
            let last = path.iter().rfind(|block| block.level == 0).unwrap();
            let there = Vector2::new(last.x, last.y);
            assert!((found.T_target_source.translation.vector - there).norm() < 1e-12);
            assert_eq!((last.bound, path[0].level), (found.score, NUM_LEVELS - 1));

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
    fn nothing_to_match_is_no_match() {
        let window = SearchWindow { translation: 1.0, rotation: 0.1 };
        assert!(LikelihoodGrid::new(&room()).search(&[], &Pose2::identity(), window).is_none());
        let nowhere = LikelihoodGrid::new(&[]).search(&room(), &Pose2::identity(), window).unwrap();
        assert_eq!(nowhere.score, 0.0);
        let one = LikelihoodGrid::new(&[Vector2::new(1e3, -1e3)]);
        assert_eq!(one.search(&[Vector2::zeros()], &Pose2::translation(1e3, -1e3), window).unwrap().score, 1.0);
    }
}
