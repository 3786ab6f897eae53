//! The globally best pose of a planar scan in a window, without a first guess.
//!
//! The target is drawn into a grid of likelihoods; a pose scores the sum over the source's points. Branch and bound over
//! a pyramid of sliding maxima finds the best of all poses on the grid without looking at most of them: Olson,
//! "Real-time correlative scan matching", ICRA 2009; Hess et al., "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016,
//! algorithm 3 and eqs. 14-16.

use nalgebra::{Vector2, Vector3};

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

/// Side of a cell (m).
const RESOLUTION: f64 = 0.1;
/// Standard deviation of the likelihood around a target point (m).
const SIGMA: f64 = 0.12;
/// Levels of the pyramid; the coarsest looks at 2^5 cells at once.
const NUM_LEVELS: usize = 6;
/// Points further out turn the search needlessly fine (m).
const MAX_LEVER: f64 = 10.0;
/// Most cells of a grid; a larger target gets larger cells.
const MAX_CELLS: f64 = 4e6;

/// A target drawn into a pyramid of likelihoods.
pub struct LikelihoodGrid {
    resolution: f64,
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
        let (low, high) = points.iter().fold(
            (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY)),
            |(low, high): (Vector2<f64>, Vector2<f64>), p| (low.inf(p), high.sup(p)),
        );
        if points.is_empty() {
            return Self {
                resolution: RESOLUTION,
                corner: Vector2::zeros(),
                width: 0,
                height: 0,
                levels: vec![Vec::new()],
            };
        }
        let extent = high - low;
        let resolution = RESOLUTION.max((extent.x * extent.y / MAX_CELLS).sqrt()).max(extent.amax() / MAX_CELLS);
        let reach = (3.0 * SIGMA / resolution).ceil() as i32;
        // Sliding maxima reach up to 2^h - 1 cells to the lower left of the first drawn cell.
        let margin = reach + (1 << (NUM_LEVELS - 1));
        let corner = low - Vector2::repeat(resolution * margin as f64);
        let width = (extent.x / resolution) as i32 + 1 + margin + reach;
        let height = (extent.y / resolution) as i32 + 1 + margin + reach;
        let mut grid = Self { resolution, corner, width, height, levels: Vec::with_capacity(NUM_LEVELS) };
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

    /// Likelihood 255 * exp(-d^2 / 2 sigma^2) by the distance d of a cell's centre to the nearest point.
    fn draw(&self, points: &[Vector2<f64>], reach: i32) -> Vec<u8> {
        let mut cells = vec![0u8; self.width as usize * self.height as usize];
        for point in points {
            let (x, y) = self.cell(point);
            for row in (y - reach).max(0)..=(y + reach).min(self.height - 1) {
                for column in (x - reach).max(0)..=(x + reach).min(self.width - 1) {
                    let center = self.corner + Vector2::new(column as f64 + 0.5, row as f64 + 0.5) * self.resolution;
                    let likelihood = 255.0 * (-(center - point).norm_squared() / (2.0 * SIGMA * SIGMA)).exp();
                    let cell = &mut cells[row as usize * self.width as usize + column as usize];
                    *cell = (*cell).max(likelihood as u8);
                }
            }
        }
        cells
    }

    fn sliding_maximum(&self, finer: &[u8], shift: i32) -> Vec<u8> {
        let at = |x: i32, y: i32| {
            if x < self.width && y < self.height { finer[y as usize * self.width as usize + x as usize] } else { 0 }
        };
        let mut coarser = Vec::with_capacity(finer.len());
        for y in 0..self.height {
            for x in 0..self.width {
                coarser.push(at(x, y).max(at(x + shift, y)).max(at(x, y + shift)).max(at(x + shift, y + shift)));
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

    /// The best pose within `window` around `center`, on a lattice of the grid's cells and of turns that move a point
    /// 10 m away by one cell. `None` for an empty source.
    pub fn search(&self, source: &[Vector2<f64>], center: &Pose2, window: SearchWindow) -> Option<CorrelativeMatch> {
        if source.is_empty() {
            return None;
        }
        let lever = source.iter().map(|p| p.norm()).fold(self.resolution, f64::max).min(MAX_LEVER);
        let turn_step = 2.0 * (self.resolution / (2.0 * lever)).asin();
        let turns = (window.rotation / turn_step).ceil() as i32;
        let half_cells = (window.translation / self.resolution).ceil() as i32;

        let rotated: Vec<RotatedSource> = (-turns..=turns)
            .map(|turn| RotatedSource {
                turn,
                cells: source
                    .iter()
                    .map(|p| {
                        let turned = nalgebra::UnitComplex::new(turn as f64 * turn_step) * center.rotation * p;
                        self.cell(&(turned + center.translation.vector))
                    })
                    .collect(),
            })
            .collect();
        let best = Search { grid: self, rotated: &rotated, half_cells, best: None }.run()?;
        let turned = nalgebra::UnitComplex::new(best.turn as f64 * turn_step) * center.rotation;
        let shift = Vector2::new(best.x as f64, best.y as f64) * self.resolution;
        let pose = Pose2::exp(&Vector3::new(turned.angle(), 0.0, 0.0));
        Some(CorrelativeMatch {
            T_target_source: Pose2::from_parts((center.translation.vector + shift).into(), pose.rotation),
            score: f64::from(best.bound) / (255.0 * source.len() as f64),
        })
    }
}

/// The source under one turn, as cells of the grid.
struct RotatedSource {
    turn: i32,
    cells: Vec<(i32, i32)>,
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

struct Search<'a> {
    grid: &'a LikelihoodGrid,
    rotated: &'a [RotatedSource],
    half_cells: i32,
    best: Option<Candidate>,
}

impl Search<'_> {
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
        self.branch(candidates);
        self.best
    }

    fn branch(&mut self, mut candidates: Vec<Candidate>) {
        // Among equals the smallest turn, then the smallest shift: the same answer everywhere.
        candidates.sort_by_key(|c| (std::cmp::Reverse(c.bound), c.turn.abs(), c.x.abs() + c.y.abs(), c.turn, c.x, c.y));
        for candidate in candidates {
            if self.best.is_some_and(|best| candidate.bound <= best.bound) {
                return;
            }
            if candidate.level == 0 {
                self.best = Some(candidate);
                continue;
            }
            let level = candidate.level - 1;
            let half = 1 << level;
            let children = [(0, 0), (half, 0), (0, half), (half, half)]
                .into_iter()
                .map(|(dx, dy)| (candidate.x + dx, candidate.y + dy))
                .filter(|&(x, y)| x <= self.half_cells && y <= self.half_cells)
                .map(|(x, y)| self.candidate(level, candidate.rotated, x, y))
                .collect();
            self.branch(children);
        }
    }

    fn candidate(&self, level: usize, rotated: usize, x: i32, y: i32) -> Candidate {
        let source = &self.rotated[rotated];
        let bound = source.cells.iter().map(|&(cx, cy)| self.grid.likelihood(level, cx + x, cy + y)).sum();
        Candidate { bound, level, rotated, turn: source.turn, x, y }
    }
}
