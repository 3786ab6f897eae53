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

/// Standard deviation of a return from the wall of a map, but for what the cells add (m): the laser's noise, and the errors of the map.
const SIGMA: f64 = 0.04;
/// A length along which returns of unknown surfaces are spread (m): the median range of the logs' scans is 3 to 5 m.
const REACH: f64 = 10.0;
/// Share of the returns of what is not in the map: people, and what was moved.
pub(super) const NEW: f64 = 0.1;
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
}

impl Fit {
    /// Mean score of a beam.
    pub fn mean(&self) -> f64 {
        self.score / self.num_beams.max(1) as f64
    }

    /// Share of the beams that end on a wall of the map.
    pub fn explained(&self) -> f64 {
        self.num_explained as f64 / self.num_beams.max(1) as f64
    }
}

/// The scores of one map's returns.
#[derive(Debug, Clone, Copy)]
pub struct BeamModel {
    /// Standard deviation of a return from a wall (m).
    pub(super) sigma: f64,
    /// Density of a return on a wall, over that of one anywhere.
    peak: f64,
}

impl BeamModel {
    /// That of a map.
    pub fn of(field: &MapField) -> Self {
        // A wall is known to be somewhere in a cell, evenly; so is the middle of its cells.
        Self::with_sigma((SIGMA * SIGMA + 2.0 * field.resolution * field.resolution / 12.0).sqrt())
    }

    fn with_sigma(sigma: f64) -> Self {
        Self { sigma, peak: (1.0 - NEW) * REACH / (sigma * std::f64::consts::TAU.sqrt()) }
    }

    /// For returns whose position is less certain by this standard deviation (m).
    pub(super) fn widened(&self, sigma: f64) -> Self {
        Self::with_sigma(self.sigma.hypot(sigma))
    }

    /// The score of a return at this distance from a wall (m).
    fn score(&self, distance: f64) -> f64 {
        (NEW + self.peak * Self::hit(distance, self.sigma)).ln()
    }

    /// The probability that a return at this distance is of the wall, by a given standard deviation.
    pub(super) fn weight(&self, distance: f64, sigma: f64) -> f64 {
        let hit = self.peak * Self::hit(distance, sigma);
        hit / (NEW + hit)
    }

    fn hit(distance: f64, sigma: f64) -> f64 {
        (-0.5 * (distance / sigma).powi(2)).exp()
    }

    /// The least and the largest score.
    pub(super) fn limits(&self) -> (f64, f64) {
        (NEW.ln(), self.score(0.0))
    }
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
            fit.num_explained += usize::from(score > 0.0 && !is_through);
            fit.score += if is_through { score.min(NEW.ln()) } else { score };
        }
        fit
    }

    /// The sum of the scores of returns in a sensor's frame, at a pose in the world: the logarithm of their likelihood over that of returns
    /// from anywhere, if they were independent.
    pub fn score(&self, ends: &[Vector2<f64>], T_world_sensor: &Pose2) -> f64 {
        let (model, T_grid_sensor) = (BeamModel::of(self), self.T_world_grid.inverse() * T_world_sensor);
        ends.iter().map(|end| self.score_of_end(&model, &T_grid_sensor.act(end))).sum()
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
        while along < length - THREE_SIGMA * model.sigma {
            let point = origin + along * direction;
            let Some(cell) = self.index(&point) else { return false };
            has_met |= self.cells[cell] == Cell::Occupied;
            let distance = self.distance(cell, &point);
            if has_met && distance > THREE_SIGMA * model.sigma {
                return true;
            }
            // No wall is nearer; the last cell before one is not passed over.
            along += (distance - self.resolution).max(0.5 * self.resolution);
        }
        false
    }
}
