//! Which matches enter the graph, and which loops are taken back.

use nalgebra::Matrix3;

use super::consistency::{Candidate, Relation, compare, consistent_set};
use super::matching::search_cost;
use super::{Loop, LoopClosure, Origin};
use crate::geometry::mahalanobis;
use crate::graph::pose_graph::{BetweenFactor, optimize_poses};
use crate::registration::correlative::SearchWindow;

/// Widest search window (m, rad) in which a match needs no other to support it: what else would fit is no further off. With 0.6 m and
/// 0.25 rad the third campus has 4 stretches falsely good; with 1.5 m and 0.45 rad 18, and 53 places.
pub(super) const MAX_WINDOW_ALONE: SearchWindow = SearchWindow { translation: 1.0, rotation: 0.3 };
/// Widest search window (m, rad) in which one supporting match is enough; beyond, two are needed. With one
/// everywhere, 118 of 606 places of the third campus are wrong (26); with two everywhere, the corridor has 1896 good frames (1928).
const MAX_WINDOW_IN_PAIRS: SearchWindow = SearchWindow { translation: 4.0, rotation: 0.8 };

impl LoopClosure {
    /// Takes the matches that agree into the graph, solves it, and takes back what does not fit. Whether anything changed.
    pub(super) fn accept(&mut self) -> bool {
        let Some(covariances) = &self.covariances else { return false };
        let poses = self.anchor_poses();
        let num_loops = self.loops.len();
        let all: Vec<&Candidate> =
            self.loops.iter().map(|closed| &closed.candidate).chain(self.pool.iter().map(|(c, _)| c)).collect();
        let relations: Vec<Vec<Relation>> =
            all[num_loops..].iter().map(|a| all.iter().map(|b| compare(a, b, &poses, covariances)).collect()).collect();
        let support = consistent_set(&relations, num_loops);
        let (mut entered, mut rest) = (Vec::new(), Vec::new());
        for ((candidate, window), support) in std::mem::take(&mut self.pool).into_iter().zip(support) {
            if support.is_some_and(|support| self.has_searched_little() || support >= support_needed(window)) {
                entered.push(candidate);
            } else {
                rest.push((candidate, window));
            }
        }
        self.pool = rest;
        let has_news = !entered.is_empty();
        for candidate in entered {
            self.enter(candidate);
        }
        if has_news {
            self.solve(num_loops);
        }
        has_news
    }

    /// Whether all windows searched so far are together no more than one in which a match needs no other: what fits by chance becomes more
    /// with what is searched.
    fn has_searched_little(&self) -> bool {
        self.spent <= search_cost(MAX_WINDOW_ALONE)
    }

    pub(super) fn enter(&mut self, candidate: Candidate) {
        let factor = BetweenFactor {
            from: self.submaps[candidate.target].anchor,
            to: self.submaps[candidate.source].anchor,
            T_from_to: candidate.found.T_target_source,
            information: candidate.found.covariance.try_inverse().unwrap_or_else(Matrix3::zeros),
            is_switchable: true,
        };
        self.loops.push(Loop { candidate, factor, origin: Origin::Search });
    }

    /// Solves, and takes loops back as long as there are some that do not fit. Loops from `num_old` on are new: far off as
    /// the chain may be, they count in full at first, or their weight would never let them in (graduated non-convexity:
    /// Yang et al., RA-L 2020, in two steps).
    pub(super) fn solve(&mut self, num_old: usize) {
        let mut factors = self.factors();
        for factor in &mut factors[self.chain.len() + num_old..] {
            factor.is_switchable = false;
        }
        optimize_poses(&mut self.poses, &factors);
        loop {
            let factors = self.factors();
            optimize_poses(&mut self.poses, &factors);
            let poses = &self.poses;
            let before = self.loops.len();
            self.loops.retain(|Loop { factor, .. }| {
                !factor.is_switchable || factor.squared_distance(poses) < mahalanobis::ONE_IN_HUNDRED_THOUSAND
            });
            if self.loops.len() == before {
                return;
            }
        }
    }
}

/// How many other matches have to support one that was found in a window.
fn support_needed(window: SearchWindow) -> usize {
    let is_within = |limit: SearchWindow| window.translation <= limit.translation && window.rotation <= limit.rotation;
    if is_within(MAX_WINDOW_ALONE) {
        0
    } else if is_within(MAX_WINDOW_IN_PAIRS) {
        1
    } else {
        2
    }
}
