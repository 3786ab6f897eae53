//! Which submaps are matched in a round: those that may show the same place by the graph's covariance, the surest first, as
//! many as the search can afford.

use nalgebra::Matrix2;

use super::matching::{Pair, search_cost};
use super::uncertainty::RelativeCovariances;
use super::{LoopClosure, SEARCH_BUDGET};
use crate::geometry::RigidMotion;
use crate::geometry::connected_parts::connected_parts;
use crate::geometry::quantile::THREE_SIGMA;
use crate::odometry::planar::information::position_covariance;
use crate::registration::correlative::SearchWindow;
use crate::search::order::ascending;

/// Submaps less than this many apart in the sequence have been matched by the chain. Where they are matched again, 15 of 934 stretches of
/// the corridor are falsely good (4 of 848).
const NUM_CHAINED_SUBMAPS: usize = 3;
/// Standard deviation between such submaps (m, rad) from which on the chain has not matched them: about half of what is certain.
const LOOSE_SIGMA: (f64, f64) = (0.12, 0.03);
/// Submaps that one submap is matched with in a round, at most. Without this limit, that of the round and that of a submap's scans,
/// 368 of 606 places of the first campus are wrong (11), and 213 of 1,829 of the corridor (none).
const MAX_CANDIDATES: usize = 4;
/// Margin of the search window (m, rad) beside three standard deviations of the relative pose, ...
const WINDOW_MARGIN: SearchWindow = SearchWindow { translation: 0.2, rotation: 0.03 };
/// ... and its largest translation (m). With 15 m, 307 of 339 pairs of Belgioioso with `wheels_stop` are wrong (9).
const MAX_WINDOW: f64 = 12.0;
/// Standard deviation between two submaps (m, rad) below which a loop would tell nothing new: about a fifth of what is certain. With
/// more or less of it the corridor has more stretches falsely good (`docs/measurements/laser.md`, numbers merged).
const SETTLED_SIGMA: (f64, f64) = (0.05, 0.012);
/// Share of what is left of the budget that a round may spend: later rounds know better where to look (see `MAX_CANDIDATES`).
const ROUND_SHARE: f64 = 0.4;

impl LoopClosure {
    /// The pairs of submaps that may show the same place, those of one target together.
    pub(super) fn pairs(&mut self) -> Vec<Pair> {
        let Some(covariances) = &self.covariances else { return Vec::new() };
        let parts = self.parts();
        let (mut pairs, mut num_possible): (Vec<(f64, Pair)>, usize) = (Vec::new(), 0);
        for source in 1..self.submaps.len() {
            let mut candidates: Vec<(f64, Pair)> = Vec::new();
            for target in (0..source).filter(|&target| parts[target] == parts[source]) {
                candidates.extend(self.pair(target, source, covariances));
            }
            num_possible += candidates.len();
            let mut chosen: Vec<(f64, Pair)> = Vec::new();
            for index in ascending(candidates.iter().map(|candidate| -candidate.0)) {
                let target = candidates[index].1.target;
                if chosen.len() < MAX_CANDIDATES && chosen.iter().all(|(_, other)| other.target.abs_diff(target) > 1) {
                    chosen.push(candidates[index]);
                }
            }
            pairs.extend(chosen);
        }
        let num_likely = pairs.len();
        let mut pairs = self.affordable(&pairs);
        self.trials.rounds.push([num_possible, num_likely, pairs.len()]);
        for pair in &pairs {
            self.searched[pair.source].push((pair.target, pair.window.translation));
        }
        pairs.sort_by_key(|pair| std::cmp::Reverse((pair.target, pair.source)));
        pairs
    }

    /// For each submap the first one of its part: recordings of which none leads to another are parts of their own, and no covariance tells
    /// where one may show a place of the other.
    fn parts(&self) -> Vec<usize> {
        let begins = |submap: &usize| self.links[self.submaps[*submap].keyframes.start].begins_recording;
        let chain = (1..self.submaps.len()).filter(|submap| !begins(submap)).map(|submap| [submap - 1, submap]);
        let loops = self.loops.iter().map(|closed| [closed.candidate.target, closed.candidate.source]);
        connected_parts(self.submaps.len(), chain.chain(loops))
    }

    /// The same for each keyframe.
    pub fn parts_of_keyframes(&self) -> Vec<usize> {
        self.of_keyframes(&self.parts())
    }

    /// Wide windows take long to search: those that are the likeliest for what they cost first, as many as a share of what is
    /// left to spend allows.
    fn affordable(&mut self, pairs: &[(f64, Pair)]) -> Vec<Pair> {
        let most = self.spent + (SEARCH_BUDGET * self.links.len() as f64 - self.spent) * ROUND_SHARE;
        let mut affordable = Vec::new();
        for index in ascending(pairs.iter().map(|(likelihood, pair)| search_cost(pair.window) / likelihood)) {
            let pair = pairs[index].1;
            let spent = self.spent + search_cost(pair.window);
            if spent > most {
                break;
            }
            self.spent = spent;
            affordable.push(pair);
        }
        affordable
    }

    /// Whether a submap may have come back to another, with how likely that is.
    fn pair(&self, target: usize, source: usize, covariances: &RelativeCovariances) -> Option<(f64, Pair)> {
        let (a, b) = (&self.submaps[target], &self.submaps[source]);
        let guess = self.poses[a.anchor].inverse() * self.poses[b.anchor];
        // Discs that show the same place share a good part of their area. Most pairs are beyond any window.
        let reach = a.reach(b);
        let apart = guess.translation_norm();
        if apart > reach + MAX_WINDOW {
            return None;
        }
        let covariance = covariances.between(target, source);
        let position: Matrix2<f64> = position_covariance(&guess, &covariance);
        let sigma = position.symmetric_eigenvalues().max().max(0.0).sqrt();
        let heading_sigma = covariance[(0, 0)].max(0.0).sqrt();
        let is_tied = |most: (f64, f64)| sigma < most.0 && heading_sigma < most.1;
        if is_tied(SETTLED_SIGMA) || (source < target + NUM_CHAINED_SUBMAPS && is_tied(LOOSE_SIGMA)) {
            return None;
        }
        let window = SearchWindow {
            translation: (WINDOW_MARGIN.translation + THREE_SIGMA * sigma).min(MAX_WINDOW),
            rotation: (WINDOW_MARGIN.rotation + THREE_SIGMA * heading_sigma).min(std::f64::consts::PI),
        };
        if apart > reach + window.translation {
            return None;
        }
        let was_searched = |&(t, width): &(usize, f64)| t.abs_diff(target) <= 1 && window.translation > 0.5 * width;
        if self.searched[source].iter().any(was_searched) {
            return None;
        }
        let sq_width = reach * reach / 4.0 + sigma * sigma;
        let likelihood = (-0.5 * apart * apart / sq_width).exp() / (1.0 + sigma * sigma);
        Some((likelihood, Pair { target, source, guess, window }))
    }
}
