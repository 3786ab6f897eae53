//! The places where a robot may be, each followed by registering scans to the map, with their odds to being elsewhere.

use nalgebra::{Matrix3, Vector3};

use super::field::MapField;
use super::likelihood::{Beam, BeamModel, Fit};
use super::places::{FoundPlace, NEGLIGIBLE, log_odds, probabilities};
use super::refine::{Prior, inverse, refine};
use super::search::are_one_place;
use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::MeasuredMotion;

/// Standard deviations of a pose in a window beside that of its middle (rad, m).
const WINDOW_SIGMA: (f64, f64) = (0.02, 0.1);

/// A pose in the grid's frame with its covariance (perturbation on the right, rotation first).
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimate {
    pub pose: Pose2,
    pub covariance: Matrix3<f64>,
}

impl Estimate {
    /// Of a scan in a window whose middle is here.
    pub(super) fn in_window(T_grid_middle: &Pose2, T_middle_scan: &Pose2) -> Self {
        let sigmas = Vector3::new(WINDOW_SIGMA.0, WINDOW_SIGMA.1, WINDOW_SIGMA.1);
        let covariance = Matrix3::from_diagonal(&sigmas.map(|sigma| sigma * sigma));
        Self { pose: (T_grid_middle * T_middle_scan).renormalized(), covariance }
    }

    /// After a motion.
    pub(super) fn moved(&self, motion: &MeasuredMotion) -> Self {
        let adjoint = motion.T_before_sensor.inverse().adjoint();
        Self {
            pose: (self.pose * motion.T_before_sensor).renormalized(),
            covariance: adjoint * (self.covariance + motion.covariance) * adjoint.transpose(),
        }
    }

    /// Before a motion that led here.
    pub(super) fn moved_back(&self, motion: &MeasuredMotion) -> Self {
        let adjoint = motion.T_before_sensor.adjoint();
        Self {
            pose: (self.pose * motion.T_before_sensor.inverse()).renormalized(),
            covariance: adjoint * self.covariance * adjoint.transpose() + motion.covariance,
        }
    }

    /// Registered to the map, and what the beams say of it.
    pub(super) fn registered(&self, field: &MapField, model: &BeamModel, beams: &[Beam]) -> (Self, Fit) {
        let prior = Prior { pose: self.pose, information: inverse(&self.covariance) };
        let refined = refine(field, model, beams, &self.pose, Some(&prior));
        let covariance = inverse(&(refined.information + prior.information));
        (Self { pose: refined.pose, covariance }, field.fit(model, beams, &refined.pose))
    }
}

/// A place where the robot may be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hypothesis {
    pub estimate: Estimate,
    /// The logarithm of its odds to being elsewhere.
    pub log_odds: f64,
    /// What the last scan that was registered says.
    pub fit: Fit,
}

/// All places where the robot may be.
#[derive(Debug, Clone, Default)]
pub(super) struct Belief {
    /// The most likely one first.
    pub hypotheses: Vec<Hypothesis>,
}

impl Belief {
    /// Of the places of a window, at its last scan. The best of many thousand poses fits by chance, too: what chose it does not speak
    /// for it against being elsewhere, only the scans to come do.
    pub(super) fn begun(places: &[FoundPlace], T_middle_last: &Pose2) -> Self {
        let best = places.first().map_or(0.0, |best| best.log_odds.max(0.0));
        let mut belief = Self::of(places, T_middle_last);
        belief.hypotheses.iter_mut().for_each(|hypothesis| hypothesis.log_odds -= best);
        belief
    }

    /// Of the places of a window, at its last scan.
    pub(super) fn of(places: &[FoundPlace], T_middle_last: &Pose2) -> Self {
        let hypothesis = |place: &FoundPlace| Hypothesis {
            estimate: Estimate::in_window(&place.pose, T_middle_last),
            log_odds: place.log_odds,
            fit: place.fit,
        };
        Self { hypotheses: places.iter().map(hypothesis).collect() }
    }

    /// Moves all of them.
    pub(super) fn move_on(&mut self, motion: &MeasuredMotion) {
        self.hypotheses.iter_mut().for_each(|hypothesis| hypothesis.estimate = hypothesis.estimate.moved(motion));
    }

    /// Registers all of them, and weighs them by so many new pieces of walls.
    pub(super) fn weigh(&mut self, field: &MapField, model: &BeamModel, beams: &[Beam], num_new: usize) {
        for hypothesis in &mut self.hypotheses {
            (hypothesis.estimate, hypothesis.fit) = hypothesis.estimate.registered(field, model, beams);
            hypothesis.log_odds += log_odds(num_new, hypothesis.fit.mean());
        }
        self.hypotheses.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
        let least = self.hypotheses.first().map_or(0.0, |best| best.log_odds.max(0.0)) - NEGLIGIBLE;
        let mut kept: Vec<Hypothesis> = Vec::new();
        for hypothesis in std::mem::take(&mut self.hypotheses) {
            let is_twin = kept.iter().any(|known| are_one_place(&known.estimate.pose, &hypothesis.estimate.pose));
            if hypothesis.log_odds > least && !is_twin {
                kept.push(hypothesis);
            }
        }
        self.hypotheses = kept;
    }

    /// Probability of each place, and of being elsewhere.
    pub(super) fn probabilities(&self) -> (Vec<f64>, f64) {
        probabilities(&self.hypotheses.iter().map(|hypothesis| hypothesis.log_odds).collect::<Vec<_>>())
    }
}
