//! Loops of a long drive: places that come into view again, found, verified and taken into the graph.
//!
//! Scans in a row are joined to submaps (Hess et al., "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016). Each is looked
//! for wherever the graph's covariance allows that it came back, the surest pairs first. A match has to be seen by both
//! sides in the same way, to be the only one of its window, and to agree with the other matches; where the window was wide,
//! others have to support it. Then the graph is solved, what no longer fits is taken back, and with the covariances that
//! have shrunk the search begins again, until nothing more is found.

use std::rc::Rc;

use nalgebra::{Matrix2, Matrix3};

use crate::geometry::{Pose2, RigidMotion};
use crate::graph::pose_graph::{BetweenFactor, PlanarFactor, optimize_poses};
use crate::odometry::planar::ablation::Ablation;
use crate::odometry::planar::information::{chained, position_covariance};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::correlative::SearchWindow;
use crate::registration::free_space::FreeSpaceTally;
use crate::registration::icp::IcpOptions;
use crate::search::order::ascending;

mod consistency;
mod matching;
mod submap;
mod uncertainty;

use consistency::{Candidate, Relation, compare, consistent_set};
use matching::{MAX_RIVAL, Sought, Target, free_space_between, match_stretches};
use submap::{Keyframe, Submap};
use uncertainty::RelativeCovariances;

/// A scan of the chain, as it comes in.
pub struct ChainLink {
    /// Its returns.
    pub scan: Rc<PlanarScan>,
    /// Where the chain put it.
    pub T_world_sensor: Pose2,
    /// Whether no uncontradicted registration connects it to the scan before.
    pub is_weak: bool,
}

/// A submap ends after this way (m) ...
const SUBMAP_LENGTH: f64 = 4.0;
/// ... or so many scans.
const SUBMAP_SCANS: usize = 40;
/// Submaps less than so many after each other have been matched by the chain.
const NEIGHBORS: usize = 3;
/// Unless this much or more is left open between them (m, rad): then the chain has not.
const LOOSE: (f64, f64) = (0.12, 0.03);
/// In a round a submap is looked for in so many others.
const CANDIDATES: usize = 4;
/// The window of the search in standard deviations.
const SIGMAS: f64 = 3.0;
/// The window's margin (m, rad).
const MARGIN: SearchWindow = SearchWindow { translation: 0.2, rotation: 0.03 };
/// The widest window (m).
const WIDEST: f64 = 12.0;
/// Where less than this is left open (m, rad), the graph needs no loop more.
const SETTLED: (f64, f64) = (0.05, 0.012);
/// Submaps that seem to share less than this of what they show are not matched.
const MIN_OVERLAP: f64 = 0.3;
/// A match in a window no wider than this (m, rad) is believed alone: what else would fit is no further off.
const ALONE: SearchWindow = SearchWindow { translation: 1.0, rotation: 0.3 };
/// Up to this one (m, rad) it takes one other match that supports it; beyond, two.
const IN_PAIRS: SearchWindow = SearchWindow { translation: 4.0, rotation: 0.8 };
/// A match needs this share of returns that agree, ...
const MIN_AGREEMENT: f64 = 0.85;
/// ... so many that both sides see ...
const MIN_SEEN: usize = 150;
/// ... and this share of returns with a partner.
const MIN_FITNESS: f64 = 0.25;
/// A loop that has lost more than this share of its weight is taken back.
const FITTING: f64 = 0.25;
/// Steps of the graph's solution after each round.
const STEPS: usize = 20;
/// What searches may cost for each keyframe, in windows of a metre and a tenth of a radian: about a millisecond ...
const BUDGET: f64 = 60.0;
/// ... and the share of what is left of it that a round may spend.
const ROUND_SHARE: f64 = 0.4;
/// Rounds at the most.
const MAX_ROUNDS: usize = 12;

/// A pair of submaps to be matched.
#[derive(Debug, Clone, Copy)]
struct Pair {
    target: usize,
    source: usize,
    guess: Pose2,
    window: SearchWindow,
}

impl Pair {
    /// What its search costs, in windows of a metre and a tenth of a radian.
    fn cost(&self) -> f64 {
        1.0 + self.window.translation.powi(2) * (self.window.rotation / 0.1)
    }
}

/// A loop of the graph.
struct Loop {
    candidate: Candidate,
    relation: PlanarFactor,
}

/// The search for loops.
pub struct LoopClosure {
    keyframes: Vec<Keyframe>,
    links: Vec<ChainLink>,
    /// Between keyframes that follow each other.
    chain: Vec<PlanarFactor>,
    /// Pose of each keyframe, as the graph has it now.
    poses: Vec<Pose2>,
    submaps: Vec<Submap>,
    covariances: Option<RelativeCovariances>,
    loops: Vec<Loop>,
    /// Matches that are no loops yet, with the window each was found in.
    pool: Vec<(Candidate, SearchWindow)>,
    /// For each source the windows that were searched for it, in vain or with success: (target, half width (m)).
    searched: Vec<Vec<(usize, f64)>>,
    queue: Vec<Pair>,
    /// What is left for searches, in the unit of [`Pair::cost`].
    budget: f64,
    num_queued: usize,
    round: usize,
    is_done: bool,
    without: Ablation,
}

impl LoopClosure {
    /// Joins the links of a chain to submaps. `chain` relates keyframes that follow each other.
    pub fn new(links: Vec<ChainLink>, mut chain: Vec<PlanarFactor>, without: Ablation) -> Self {
        for relation in &mut chain {
            relation.is_switchable &= !without.robust_kernel;
        }
        let keyframes: Vec<Keyframe> = links.iter().map(|link| Keyframe::new(Rc::clone(&link.scan))).collect();
        let mut poses: Vec<Pose2> = links.iter().map(|link| link.T_world_sensor).collect();
        optimize_poses(&mut poses, &chain, STEPS);
        let mut submaps = Vec::new();
        let (mut start, mut driven) = (0, 0.0);
        for index in 1..=links.len() {
            let is_end = index == links.len();
            driven += if is_end { 0.0 } else { (poses[index - 1].inverse() * poses[index]).translation_norm() };
            if is_end || driven > SUBMAP_LENGTH || index - start >= SUBMAP_SCANS || links[index].is_weak {
                submaps.push(Submap::new(start..index, &keyframes, &poses));
                (start, driven) = (index, 0.0);
            }
        }
        let (num_keyframes, num_submaps) = (keyframes.len(), submaps.len());
        Self {
            keyframes,
            links,
            chain,
            poses,
            submaps,
            covariances: None,
            loops: Vec::new(),
            pool: Vec::new(),
            searched: vec![Vec::new(); num_submaps],
            queue: Vec::new(),
            budget: BUDGET * num_keyframes as f64,
            num_queued: 0,
            round: 0,
            is_done: false,
            without,
        }
    }

    /// Pairs of this round that are done, and all.
    pub fn progress(&self) -> (usize, usize) {
        (self.num_queued - self.queue.len(), self.num_queued.max(1))
    }

    /// Whether nothing more is found.
    pub fn is_done(&self) -> bool {
        self.is_done
    }

    /// Returns of a scan of the chain.
    pub fn num_points(&self, link: usize) -> usize {
        self.keyframes[link].scan.points.len()
    }

    /// How two scans of the chain look from each other, the second at this pose in the frame of the first.
    pub fn free_space(&self, first: usize, second: usize, T_first_second: &Pose2) -> FreeSpaceTally {
        free_space_between(&self.keyframes[first], &self.keyframes[second], T_first_second)
    }

    /// The pose of every keyframe.
    pub fn solved_poses(&self) -> Vec<Pose2> {
        self.poses.clone()
    }

    /// The chain's relations, and the loops between anchors.
    pub fn relations(&self) -> Vec<PlanarFactor> {
        self.chain.iter().chain(self.loops.iter().map(|closed| &closed.relation)).copied().collect()
    }

    /// The loops as pairs of keyframes.
    pub fn loops(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.loops.iter().map(|closed| (closed.relation.from, closed.relation.to))
    }

    /// One piece of work: matches the pairs of one target, or begins the next round.
    pub fn advance(&mut self, options: &IcpOptions) {
        if let Some(pair) = self.queue.last().copied() {
            let target = self.target(pair.target);
            while let Some(pair) = self.queue.pop_if(|next| next.target == pair.target) {
                self.match_pair(&target, &pair, options);
            }
            return;
        }
        let has_news = self.round == 0 || self.accept();
        if !has_news || self.round == MAX_ROUNDS {
            self.is_done = true;
            return;
        }
        self.round += 1;
        self.covariances = RelativeCovariances::new(&self.anchor_poses(), &self.anchor_relations());
        self.queue = self.pairs();
        self.num_queued = self.queue.len();
        self.is_done = self.queue.is_empty();
    }

    fn anchor_poses(&self) -> Vec<Pose2> {
        self.submaps.iter().map(|submap| self.poses[submap.anchor]).collect()
    }

    /// The graph between anchors: the chain summed up, and the loops.
    fn anchor_relations(&self) -> Vec<PlanarFactor> {
        let mut informations = vec![Matrix3::zeros(); self.keyframes.len()];
        for relation in &self.chain {
            informations[relation.to] += relation.information * relation.weight(relation.squared_distance(&self.poses));
        }
        let mut relations = Vec::new();
        for (index, pair) in self.submaps.windows(2).enumerate() {
            let (from, to) = (pair[0].anchor, pair[1].anchor);
            let (mut T, mut covariance) = (Pose2::identity(), Matrix3::zeros());
            let steps = self.poses[from..=to].windows(2).map(|pair| pair[0].inverse() * pair[1]);
            for (step, information) in steps.zip(&informations[from + 1..=to]) {
                let of_step = information.try_inverse().unwrap_or_else(|| Matrix3::identity() * 1e4);
                covariance = chained((&T, &covariance), &of_step);
                T *= step;
            }
            let information = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
            relations.push(BetweenFactor {
                from: index,
                to: index + 1,
                T_from_to: T,
                information,
                is_switchable: false,
            });
        }
        relations.extend(self.loops.iter().map(|closed| BetweenFactor {
            from: closed.candidate.target,
            to: closed.candidate.source,
            ..closed.relation
        }));
        relations
    }

    /// The pairs of submaps that may show the same place, those of one target together.
    fn pairs(&mut self) -> Vec<Pair> {
        let Some(covariances) = &self.covariances else { return Vec::new() };
        let mut pairs = Vec::new();
        for source in 1..self.submaps.len() {
            let mut candidates: Vec<(f64, Pair)> = Vec::new();
            for target in 0..source {
                candidates.extend(self.pair(target, source, covariances));
            }
            let mut chosen: Vec<Pair> = Vec::new();
            for index in ascending(candidates.iter().map(|candidate| -candidate.0)) {
                let pair = candidates[index].1;
                if chosen.len() < CANDIDATES && chosen.iter().all(|other| other.target.abs_diff(pair.target) > 1) {
                    chosen.push(pair);
                }
            }
            pairs.extend(chosen);
        }
        self.keep_affordable(&mut pairs);
        for pair in &pairs {
            self.searched[pair.source].push((pair.target, pair.window.translation));
        }
        pairs.sort_by_key(|pair| std::cmp::Reverse((pair.target, pair.source)));
        pairs
    }

    /// Wide windows take long to search: the narrowest first, as many as a share of what is left to spend allows.
    fn keep_affordable(&mut self, pairs: &mut Vec<Pair>) {
        pairs.sort_by(|a, b| a.cost().total_cmp(&b.cost()).then((a.source, a.target).cmp(&(b.source, b.target))));
        let most = self.budget * ROUND_SHARE;
        let mut spent = 0.0;
        pairs.retain(|pair| {
            spent += pair.cost();
            spent <= most
        });
        self.budget -= spent.min(most);
    }

    /// Whether a submap may have come back to another, with how likely that is.
    fn pair(&self, target: usize, source: usize, covariances: &RelativeCovariances) -> Option<(f64, Pair)> {
        let (a, b) = (&self.submaps[target], &self.submaps[source]);
        let guess = self.poses[a.anchor].inverse() * self.poses[b.anchor];
        let covariance = covariances.between(target, source);
        let position: Matrix2<f64> = position_covariance(&guess, &covariance);
        let sigma = position.symmetric_eigenvalues().max().max(0.0).sqrt();
        let heading_sigma = covariance[(0, 0)].max(0.0).sqrt();
        let is_tied = |most: (f64, f64)| sigma < most.0 && heading_sigma < most.1;
        if is_tied(SETTLED) || (source < target + NEIGHBORS && is_tied(LOOSE)) {
            return None;
        }
        let window = SearchWindow {
            translation: (MARGIN.translation + SIGMAS * sigma).min(WIDEST),
            rotation: (MARGIN.rotation + SIGMAS * heading_sigma).min(std::f64::consts::PI),
        };
        // Discs that show the same place share a good part of their area.
        let reach = (a.radius + b.radius) * (1.0 - MIN_OVERLAP);
        let apart = guess.translation_norm();
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

    /// A submap with those next to it.
    fn target(&self, target: usize) -> Target {
        let mut range = self.submaps[target].keyframes.clone();
        if target > 0 && !self.links[range.start].is_weak {
            range.start = self.submaps[target - 1].keyframes.start;
        }
        if target + 1 < self.submaps.len() && !self.links[range.end].is_weak {
            range.end = self.submaps[target + 1].keyframes.end;
        }
        Target::new(range, self.submaps[target].anchor, &self.keyframes, &self.poses)
    }

    fn match_pair(&mut self, target: &Target, pair: &Pair, options: &IcpOptions) {
        let submap = &self.submaps[pair.source];
        let source = Sought::new(submap.keyframes.clone(), submap.anchor, &self.keyframes, &self.poses);
        let Some(found) = match_stretches(target, &source, &self.keyframes, &pair.guess, pair.window, options) else {
            return;
        };
        let is_seen = found.agreement > MIN_AGREEMENT && found.num_seen > MIN_SEEN && found.fitness > MIN_FITNESS;
        if is_seen && (found.rival < MAX_RIVAL || self.without.second_basin) {
            self.pool.push((Candidate { target: pair.target, source: pair.source, found }, pair.window));
        }
    }

    /// Takes the matches that agree into the graph, solves it, and takes back what does not fit. Whether anything changed.
    fn accept(&mut self) -> bool {
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
            if self.without.consistent_sets || support.is_some_and(|support| support >= support_needed(window)) {
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

    fn enter(&mut self, candidate: Candidate) {
        let relation = BetweenFactor {
            from: self.submaps[candidate.target].anchor,
            to: self.submaps[candidate.source].anchor,
            T_from_to: candidate.found.T_target_source,
            information: candidate.found.covariance.try_inverse().unwrap_or_else(Matrix3::zeros),
            is_switchable: !self.without.robust_kernel,
        };
        self.loops.push(Loop { candidate, relation });
    }

    /// Solves, and takes loops back as long as there are some that do not fit. Loops from `num_old` on are new: far off as
    /// the chain may be, they count in full at first, or their weight would never let them in (graduated non-convexity:
    /// Yang et al., RA-L 2020, in two steps).
    fn solve(&mut self, num_old: usize) {
        let mut relations = self.relations();
        for relation in &mut relations[self.chain.len() + num_old..] {
            relation.is_switchable = false;
        }
        optimize_poses(&mut self.poses, &relations, STEPS);
        loop {
            let relations = self.relations();
            optimize_poses(&mut self.poses, &relations, STEPS);
            let poses = &self.poses;
            let before = self.loops.len();
            self.loops.retain(|closed| closed.relation.weight(closed.relation.squared_distance(poses)) > FITTING);
            if self.loops.len() == before {
                return;
            }
        }
    }
}

/// How many other matches have to support one that was found in a window.
fn support_needed(window: SearchWindow) -> usize {
    let is_within = |limit: SearchWindow| window.translation <= limit.translation && window.rotation <= limit.rotation;
    if is_within(ALONE) {
        0
    } else if is_within(IN_PAIRS) {
        1
    } else {
        2
    }
}
