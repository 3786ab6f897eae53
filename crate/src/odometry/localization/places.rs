//! All places where a window may have been taken, with their odds to being elsewhere.

use super::field::MapField;
use super::likelihood::{BeamModel, Fit};
use super::refine::refine;
use super::search::{Budget, Search, Wanted, are_one_place};
use super::window::{JoinedBeams, evenly};
use crate::geometry::Pose2;

/// From this probability on a place is certain.
pub(super) const CERTAIN: f64 = 0.999;
/// The share of the score of a different piece of a wall that is independent of the others.
///
/// Measured: of 431 windows of five Radish buildings and fr079 in the grid of every other scan one scored more at a wrong place than at the
/// right one, by 4 in `score`; of 480 windows in the grids of other buildings no best place was ahead of the next by more than 49. With this
/// share a place is certain from 69 on.
const INDEPENDENT_SCORE: f64 = 0.1;
/// More pieces than this tell no more: of the errors of a long chain and of the map they all have their share.
const MOST_PIECES: usize = 200;
/// What a score of the search, on a lattice, may be less than after registration (a beam).
const LATTICE_LOSS: f64 = 0.15;
/// Largest logarithm of odds, of one in ten thousand. Places less likely than the best one, or than being elsewhere, by this factor are left
/// out: with hundreds of them one may still be certain. And a place is known at most this well: a robot may be carried away.
pub(super) const MAX_LOG_ODDS_OF_PLACE: f64 = 9.2;
/// Beams of a search.
const SEARCHED_BEAMS: usize = 150;
/// About half a second.
const BUDGET: Budget = Budget { blocks: 200_000, places: 200 };

/// A place of the beams' frame in the grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct FoundPlace {
    pub pose: Pose2,
    pub fit: Fit,
    /// The logarithm of its odds to being elsewhere.
    pub log_odds: f64,
}

/// The places of a map where beams may have been taken.
#[derive(Debug, Clone, Default)]
pub(super) struct Places {
    /// The most likely one first.
    pub all: Vec<FoundPlace>,
    /// Whether there are no others of weight.
    pub is_complete: bool,
    /// The logarithm of the odds to being elsewhere that no other place exceeds.
    others: f64,
}

impl Places {
    /// Whether it is certain that none of the places, found or not, is the right one.
    pub(super) fn are_all_wrong(&self) -> bool {
        let best = self.all.first().map_or(self.others, |best| best.log_odds.max(self.others));
        best < -odds_of(CERTAIN) && self.elsewhere() >= CERTAIN
    }

    /// Probability of being elsewhere.
    pub(super) fn elsewhere(&self) -> f64 {
        probabilities(&self.all.iter().map(|place| place.log_odds).collect::<Vec<_>>()).1
    }
}

/// The logarithm of the odds to being elsewhere of beams that show so many pieces of walls, at a mean score.
pub(super) fn log_odds(model: &BeamModel, num_pieces: usize, mean_score: f64) -> f64 {
    INDEPENDENT_SCORE * num_pieces.min(MOST_PIECES) as f64 * (mean_score - model.elsewhere)
}

/// All places of a map for the beams of a window.
pub(super) fn places(field: &MapField, model: &BeamModel, search: &Search, joined: &JoinedBeams) -> Places {
    let ends: Vec<_> = evenly(&joined.beams, SEARCHED_BEAMS).iter().map(|beam| beam.end).collect();
    // Of so many beams this mean difference is negligible.
    let margin =
        MAX_LOG_ODDS_OF_PLACE / (INDEPENDENT_SCORE * joined.num_pieces.clamp(1, MOST_PIECES) as f64) + LATTICE_LOSS;
    let wanted = Wanted { least_mean: model.elsewhere - margin, margin: margin * ends.len() as f64 };
    let found = search.places(&ends, &wanted, &BUDGET);
    let mut places: Vec<FoundPlace> = Vec::new();
    for place in found.places {
        let pose = refine(field, model, &joined.beams, &place, None).pose;
        let fit = field.fit(model, &joined.beams, &pose);
        let place = FoundPlace { pose, fit, log_odds: log_odds(model, joined.num_pieces, fit.mean()) };
        match places.iter_mut().find(|known| are_one_place(&known.pose, &pose)) {
            Some(twin) if twin.fit.score < place.fit.score => *twin = place,
            Some(_) => {}
            None => places.push(place),
        }
    }
    places.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    let least = places.first().map_or(0.0, |best| best.log_odds.max(0.0)) - MAX_LOG_ODDS_OF_PLACE;
    places.retain(|place| place.log_odds > least);
    let others = log_odds(model, joined.num_pieces, found.others_at_most / ends.len().max(1) as f64 + LATTICE_LOSS);
    Places { all: places, is_complete: found.is_complete, others }
}

/// The probabilities of places with these log odds, and of being elsewhere.
pub(super) fn probabilities(log_odds: &[f64]) -> (Vec<f64>, f64) {
    let largest = log_odds.iter().fold(0.0_f64, |largest, &odds| largest.max(odds));
    let sum = (-largest).exp() + log_odds.iter().map(|odds| (odds - largest).exp()).sum::<f64>();
    (log_odds.iter().map(|odds| (odds - largest).exp() / sum).collect(), (-largest).exp() / sum)
}

/// The logarithm of the odds of a probability.
pub(super) fn odds_of(probability: f64) -> f64 {
    (probability / (1.0 - probability)).ln()
}
