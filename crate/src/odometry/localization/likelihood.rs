//! How likely returns are at a pose: the likelihood field, with beams that a wall should have stopped.
//!
//! Thrun, Burgard and Fox, "Probabilistic Robotics" (2005), sections 6.3 and 6.4. Returns of people are the uniform part of the mixture,
//! so that no number of them makes a pose impossible. A score is the logarithm of the density of a return over that of one that may be
//! anywhere along [`REACH`]; where the map knows nothing it is 0.

use nalgebra::Vector2;

use super::field::MapField;
use crate::geometry::quantile::THREE_SIGMA;
use crate::geometry::{Pose2, RigidMotion};
use crate::map::occupancy_grid::Cell;

/// A beam, from the sensor to its return, in the frame of a scan or of several (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// Where the sensor was.
    pub origin: Vector2<f64>,
    /// Its return.
    pub end: Vector2<f64>,
}

impl Beam {
    /// The beam in another frame.
    #[must_use]
    pub fn moved(&self, T_target_source: &Pose2) -> Self {
        Self { origin: T_target_source.act(&self.origin), end: T_target_source.act(&self.end) }
    }
}

/// Standard deviation of a return from the wall of a map, but for that of the wall in its cells (m): the laser's noise, and the errors of
/// the map.
const RETURN_SIGMA: f64 = 0.04;
/// A length along which returns of unknown surfaces are spread (m): the median range of the logs' scans is 3 to 5 m.
const REACH: f64 = 10.0;
/// Share of the returns of what is not in the map: people, and what was moved.
pub(super) const NEW: f64 = 0.1;
/// Share of the returns of a robot that is elsewhere which end on walls, at the place that fits best: of the best places for windows in the
/// grids of other buildings, of cells of 5 cm, 94 of 100 have less (a mean score of 1.5); of those at their right places in the grid of
/// every other scan 3 of 100. A map that draws its walls thick scores less for the same share.
const CHANCE_HITS: f64 = 0.63;
/// Around the sensor a cell is not one that stopped a beam (m).
const BLIND: f64 = 0.2;

/// What beams say of a pose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Fit {
    /// Sum of the scores of all beams.
    pub score: f64,
    /// Number of beams.
    pub num_beams: usize,
    /// Those that end on a wall of the map.
    pub num_explained: usize,
    /// Those that end where the map does not know what is there.
    pub num_unknown: usize,
    /// Those that passed through a wall of the map.
    pub num_through: usize,
    /// Over the beams that end on walls, the sum of the variances of their surfaces (m^2), ...
    wall_variance: f64,
    /// ... of their squared distances from them (m^2), ...
    sq_residual: f64,
    /// ... and of their squared lengths (m^2).
    sq_length: f64,
}

impl Fit {
    /// Mean score of a beam.
    pub fn mean(&self) -> f64 {
        self.score / self.num_beams.max(1) as f64
    }

    /// Variances of the heading (rad^2) and of the position (m^2) that all these beams share, which no number of them makes smaller: the
    /// walls are known no better than they are thin, and no better than the returns lie on them.
    pub(super) fn shared_variances(&self) -> (f64, f64) {
        let sum = self.wall_variance.max(self.sq_residual);
        (sum / self.sq_length.max(f64::MIN_POSITIVE), sum / self.num_explained.max(1) as f64)
    }

    /// Share of the beams that end on a wall of the map.
    pub fn explained(&self) -> f64 {
        self.num_explained as f64 / self.num_beams.max(1) as f64
    }
}

/// The scores of returns.
#[derive(Debug, Clone, Copy)]
pub struct BeamModel {
    /// Variance of a return from a wall, but for the wall's own (m^2).
    variance: f64,
    /// Mean score of the returns of a robot that is elsewhere, at the place that fits best.
    pub(super) elsewhere: f64,
}

impl BeamModel {
    /// That of a map.
    pub fn of(field: &MapField) -> Self {
        let model = Self { variance: RETURN_SIGMA * RETURN_SIGMA, elsewhere: 0.0 };
        // Half of a squared standard deviation off, in the mean.
        let hit = field.mean_of_walls(|variance| peak(model.sigma(variance)).ln() - 0.5);
        Self { elsewhere: CHANCE_HITS * hit + (1.0 - CHANCE_HITS) * NEW.ln(), ..model }
    }

    /// For returns whose position is less certain by this standard deviation (m).
    pub(super) fn widened(&self, sigma: f64) -> Self {
        Self { variance: self.variance + sigma * sigma, ..*self }
    }

    /// Standard deviation of a return from a wall of this variance (m).
    pub(super) fn sigma(&self, variance: f64) -> f64 {
        (self.variance + variance).sqrt()
    }

    /// The score of a return at this distance from a wall of this variance.
    fn score(&self, (distance, variance): (f64, f64)) -> f64 {
        let sigma = self.sigma(variance);
        (NEW + peak(sigma) * hit(distance, sigma)).ln()
    }

    /// The probability that a return is of a wall at this distance, of this variance; by a standard deviation that is so many times wider.
    pub(super) fn weight(&self, (distance, variance): (f64, f64), width: f64) -> f64 {
        let sigma = self.sigma(variance);
        let hit = peak(sigma) * hit(distance, width * sigma);
        hit / (NEW + hit)
    }

    /// The least and the largest score.
    pub(super) fn limits(&self) -> (f64, f64) {
        (NEW.ln(), self.score((0.0, 0.0)))
    }
}

/// Density of a return on a wall, over that of one anywhere.
fn peak(sigma: f64) -> f64 {
    (1.0 - NEW) * REACH / (sigma * std::f64::consts::TAU.sqrt())
}

fn hit(distance: f64, sigma: f64) -> f64 {
    (-0.5 * (distance / sigma).powi(2)).exp()
}

impl MapField {
    /// What beams say of a pose of their frame.
    pub fn fit(&self, model: &BeamModel, beams: &[Beam], T_grid_frame: &Pose2) -> Fit {
        let mut fit = Fit { num_beams: beams.len(), ..Fit::default() };
        for beam in beams {
            let Beam { origin, end } = beam.moved(T_grid_frame);
            let score = self.score_of_end(model, &end);
            let is_through = self.is_through(model, &origin, &end);
            fit.num_through += usize::from(is_through);
            fit.num_unknown += usize::from(score == 0.0 && !is_through);
            if score > 0.0 && !is_through {
                let (distance, variance) = self.index(&end).map_or((0.0, 0.0), |cell| self.distance(cell, &end));
                fit.num_explained += 1;
                fit.wall_variance += variance;
                fit.sq_residual += distance * distance;
                fit.sq_length += (end - origin).norm_squared();
            }
            fit.score += if is_through { score.min(NEW.ln()) } else { score };
        }
        fit
    }

    /// The sum of the scores of returns in a sensor's frame, at a pose in the world: the logarithm of their likelihood over that of returns
    /// from anywhere, if they were independent.
    pub fn score(&self, model: &BeamModel, ends: &[Vector2<f64>], T_world_sensor: &Pose2) -> f64 {
        let T_grid_sensor = self.T_world_grid.inverse() * T_world_sensor;
        ends.iter().map(|end| self.score_of_end(model, &T_grid_sensor.act(end))).sum()
    }

    /// The scores of a return in the middle of each cell, row by row from the smallest y, from 0 for the least to 1 for the largest one.
    pub fn picture(&self) -> Vec<f32> {
        let model = BeamModel::of(self);
        let (least, largest) = model.limits();
        let middle = |cell: usize| {
            Vector2::new((cell % self.width) as f64 + 0.5, (cell / self.width) as f64 + 0.5) * self.resolution
        };
        let score = |cell: usize| ((self.score_of_end(&model, &middle(cell)) - least) / (largest - least)) as f32;
        (0..self.width * self.height).map(score).collect()
    }

    /// The score of a return.
    pub(super) fn score_of_end(&self, model: &BeamModel, end: &Vector2<f64>) -> f64 {
        let Some(cell) = self.index(end) else { return 0.0 };
        let score = model.score(self.distance(cell, end));
        if self.cells[cell] == Cell::Unknown { score.max(0.0) } else { score }
    }

    /// Whether a beam goes on well beyond a wall that it meets. One that follows a wall does not.
    fn is_through(&self, model: &BeamModel, origin: &Vector2<f64>, end: &Vector2<f64>) -> bool {
        let length = (end - origin).norm();
        let direction = (end - origin) / length.max(f64::MIN_POSITIVE);
        let (mut along, mut has_met) = (BLIND, false);
        while along < length {
            let point = origin + along * direction;
            let Some(cell) = self.index(&point) else { return false };
            has_met |= self.cells[cell] == Cell::Occupied;
            let (distance, variance) = self.distance(cell, &point);
            let beyond = THREE_SIGMA * model.sigma(variance);
            if has_met && distance > beyond && length - along > beyond {
                return true;
            }
            // No wall is nearer; the last cell before one is not passed over.
            along += (distance - self.resolution).max(0.5 * self.resolution);
        }
        false
    }
}
