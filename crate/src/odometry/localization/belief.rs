//! The places where a robot may be, each followed by registering scans to the map, with their odds to being elsewhere.

use nalgebra::{Matrix3, Vector3};

use super::field::MapField;
use super::likelihood::{Beam, BeamModel, Fit};
use super::places::{FoundPlace, MAX_LOG_ODDS_OF_PLACE, log_odds, probabilities};
use super::refine::{Prior, inverse, refine};
use super::search::are_one_place;
use super::slide::Slide;
use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::MeasuredMotion;

/// Standard deviations of a pose in a window beside that of its middle (rad, m).
const WINDOW_SIGMA: (f64, f64) = (0.02, 0.1);

/// A pose in the grid's frame with its covariance (perturbation on the right, rotation first).
///
/// Scans that see the same piece of a wall share its error in the map, so what they tell of a pose is counted once: of what the scan before
/// told, the next one takes the place as far as it sees the same.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimate {
    pub pose: Pose2,
    pub covariance: Matrix3<f64>,
    /// The covariance without the scan that was registered last.
    rest: Matrix3<f64>,
}

impl Estimate {
    /// Of a scan in a window whose middle is here.
    pub(super) fn in_window(T_grid_middle: &Pose2, T_middle_scan: &Pose2) -> Self {
        let sigmas = Vector3::new(WINDOW_SIGMA.0, WINDOW_SIGMA.1, WINDOW_SIGMA.1);
        let covariance = Matrix3::from_diagonal(&sigmas.map(|sigma| sigma * sigma));
        Self { pose: (T_grid_middle * T_middle_scan).renormalized(), covariance, rest: covariance }
    }

    /// After a motion.
    pub(super) fn moved(&self, motion: &MeasuredMotion) -> Self {
        let adjoint = motion.T_before_sensor.inverse().adjoint();
        let moved = |covariance: &Matrix3<f64>| adjoint * (covariance + motion.covariance) * adjoint.transpose();
        Self {
            pose: (self.pose * motion.T_before_sensor).renormalized(),
            covariance: moved(&self.covariance),
            rest: moved(&self.rest),
        }
    }

    /// Before a motion that led here.
    pub(super) fn moved_back(&self, motion: &MeasuredMotion) -> Self {
        let adjoint = motion.T_before_sensor.adjoint();
        let moved = |covariance: &Matrix3<f64>| adjoint * covariance * adjoint.transpose() + motion.covariance;
        Self {
            pose: (self.pose * motion.T_before_sensor.inverse()).renormalized(),
            covariance: moved(&self.covariance),
            rest: moved(&self.rest),
        }
    }

    /// Registered to the map, and what the beams say of it. `shared`: the part of them that shows what was shown before.
    pub(super) fn registered(&self, field: &MapField, model: &BeamModel, beams: &[Beam], shared: f64) -> (Self, Fit) {
        let information = (1.0 - shared) * inverse(&self.covariance) + shared * inverse(&self.rest);
        let prior = Prior { pose: self.pose, information };
        let refined = refine(field, model, beams, &self.pose, Some(&prior));
        let slide = Slide::of(field, model, beams, &refined, &prior);
        let pose = slide.moved(&refined.pose);
        let covariance = slide.widened(&inverse(&(refined.information + information)));
        let rest = slide.contradicted(&inverse(&information));
        (Self { pose, covariance, rest }, field.fit(model, beams, &pose))
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
    pub(super) fn weigh(&mut self, field: &MapField, model: &BeamModel, beams: &[Beam], num_new: usize, shared: f64) {
        for hypothesis in &mut self.hypotheses {
            (hypothesis.estimate, hypothesis.fit) = hypothesis.estimate.registered(field, model, beams, shared);
            hypothesis.log_odds += log_odds(model, num_new, hypothesis.fit.mean());
        }
        self.hypotheses.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
        let least = self.hypotheses.first().map_or(0.0, |best| best.log_odds.max(0.0)) - MAX_LOG_ODDS_OF_PLACE;
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
