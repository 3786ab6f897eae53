//! Which matches agree with each other: pairwise consistency (Mangelson et al., "Pairwise consistent measurement set
//! maximization for robust multi-robot map merging", ICRA 2018), with the graph's covariances.

use nalgebra::Matrix3;

use super::matching::SubmapMatch;
use super::uncertainty::RelativeCovariances;
use crate::geometry::mahalanobis;
use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::information::{chained, inverted};
use crate::search::order::ascending;

/// A match between the anchors of two submaps.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Submap looked in.
    pub target: usize,
    /// Submap looked for.
    pub source: usize,
    /// What was found.
    pub found: SubmapMatch,
}

/// What two matches say of each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Relation {
    /// They agree, where they could have been far apart.
    Supports,
    /// Nothing: they may both be right whatever they say.
    Silent,
    /// They cannot both be right.
    Contradicts,
}

/// Two consistent matches support each other where the cycle through both has a smaller standard deviation (m, rad): about twice
/// what is certain. With what is certain, the corridor has 1896 good frames (1928), and with `wheels_stop` more pieces.
const MAX_CYCLE_SIGMA: (f64, f64) = (0.35, 0.09);

/// How far the way round through two matches is from closing.
#[derive(Debug, Clone, Copy)]
pub struct Cycle {
    /// Squared Mahalanobis distance.
    pub sq_distance: f64,
    /// Whether the matches could have been far apart.
    is_known: bool,
}

/// Compares two matches.
pub fn compare(a: &Candidate, b: &Candidate, poses: &[Pose2], covariances: &RelativeCovariances) -> Relation {
    relation(cycle(a, b, poses, covariances).as_ref())
}

/// What a cycle says of its matches.
pub fn relation(cycle: Option<&Cycle>) -> Relation {
    match cycle {
        Some(Cycle { sq_distance, .. }) if *sq_distance > mahalanobis::ONE_IN_HUNDRED_THOUSAND => Relation::Contradicts,
        Some(Cycle { sq_distance, is_known: true }) if *sq_distance < mahalanobis::ONE_IN_HUNDRED => Relation::Supports,
        _ => Relation::Silent,
    }
}

/// The way round through two matches: target to source by the first, along the graph to the source of the second,
/// back by the second, along the graph to the target of the first.
pub fn cycle(a: &Candidate, b: &Candidate, poses: &[Pose2], covariances: &RelativeCovariances) -> Option<Cycle> {
    let along = |from: usize, to: usize| (poses[from].inverse() * poses[to], covariances.between(from, to));
    let (sources, sources_covariance) = along(a.source, b.source);
    let (targets, targets_covariance) = along(b.target, a.target);
    let back = b.found.T_target_source.inverse();
    let back_covariance = inverted(&b.found.T_target_source, &b.found.covariance);
    let mut T = a.found.T_target_source;
    let mut covariance: Matrix3<f64> = a.found.covariance;
    for (motion, its_covariance) in
        [(sources, sources_covariance), (back, back_covariance), (targets, targets_covariance)]
    {
        covariance = chained((&T, &covariance), &its_covariance);
        T *= motion;
    }
    let off = T.log();
    let sq_distance = off.dot(&(covariance.try_inverse()? * off));
    let sigma = (covariance[(1, 1)] + covariance[(2, 2)]).sqrt();
    let is_known = sigma < MAX_CYCLE_SIGMA.0 && covariance[(0, 0)].sqrt() < MAX_CYCLE_SIGMA.1;
    Some(Cycle { sq_distance, is_known })
}

/// The largest set without a contradiction that this finds among new matches, given those that are in the graph already:
/// `relations[i]` are those of new match i to the old ones and then to the new ones. New matches are taken in the order of
/// how many others support them, each with those that it does not contradict. Returns for each how many of the set support
/// it, `None` where it is not in the set.
pub fn consistent_set(relations: &[Vec<Relation>], num_old: usize) -> Vec<Option<usize>> {
    let count = |row: &[Relation], of: Relation| row.iter().filter(|&&relation| relation == of).count();
    let worth = |index: usize| {
        count(&relations[index], Relation::Supports) as f64
            - 2.0 * count(&relations[index], Relation::Contradicts) as f64
    };
    let fits_old = |index: usize| {
        let old = &relations[index][..num_old];
        count(old, Relation::Contradicts) == 0 || count(old, Relation::Supports) > 2 * count(old, Relation::Contradicts)
    };
    let order = ascending((0..relations.len()).map(|index| -worth(index)));
    let mut chosen: Vec<usize> = Vec::new();
    for index in order.into_iter().filter(|&index| fits_old(index)) {
        if chosen.iter().all(|&other| relations[index][num_old + other] != Relation::Contradicts) {
            chosen.push(index);
        }
    }
    let mut support = vec![None; relations.len()];
    for &index in &chosen {
        let of_old = count(&relations[index][..num_old], Relation::Supports);
        let is_supporter =
            |other: &&usize| **other != index && relations[index][num_old + **other] == Relation::Supports;
        support[index] = Some(of_old + chosen.iter().filter(is_supporter).count());
    }
    support
}
