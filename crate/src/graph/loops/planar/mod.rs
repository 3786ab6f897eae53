//! Loops of a long drive: places that come into view again, found, verified and taken into the graph.
//!
//! Scans in a row are joined to submaps (Hess et al., "Real-time loop closure in 2D LIDAR SLAM", ICRA 2016). In the order
//! they were driven, each is looked for in those before it that it may have come back to: how far to look is what the
//! graph leaves open between the two. A match enters when the sensors saw the same there, and does not contradict the
//! graph; where much is left open, only together with another match that agrees with it (Olson, "Recognizing places using
//! spectrally clustered local matches", RAS 57 (2009), in its simplest form: pairs). After each the graph is solved again,
//! so what is left open stays small.

use std::rc::Rc;

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Pose2, RigidMotion};
use crate::graph::pose_graph::{PlanarRelation, PoseRelation, solve_relations};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::correlative::SearchWindow;
use crate::registration::free_space::FreeSpaceTally;
use crate::registration::icp::IcpOptions;

mod matching;
mod submap;
mod uncertainty;

use matching::{SubmapMatch, free_space_between, match_submaps};
use submap::{Keyframe, Submap};
use uncertainty::{Drift, chained_covariance, drifts_from};

/// A scan of the chain, as it comes in.
pub struct ChainLink {
    /// Its returns.
    pub scan: Rc<PlanarScan>,
    /// Where the chain put it.
    pub T_world_sensor: Pose2,
    /// Covariance of the motion from the scan before, by a perturbation on its left, rotation first.
    pub covariance: Matrix3<f64>,
    /// Whether nothing speaks against that motion.
    pub is_trusted: bool,
}

/// A submap ends after this way (m) ...
const SUBMAP_LENGTH: f64 = 4.0;
/// ... or so many scans.
const SUBMAP_SCANS: usize = 25;
/// Submaps less than so many after each other have been matched by the chain.
const NEIGHBORS: usize = 3;
/// A submap is looked for in so many others.
const CANDIDATES: usize = 4;
/// Anchors further apart (m) see different things.
const REACH: f64 = 10.0;
/// Submaps that seem to share less than this of what they show are not matched.
const MIN_OVERLAP: f64 = 0.5;
/// The window of the search in standard deviations.
const SIGMAS: f64 = 3.0;
/// The window's margin (m, rad).
const MARGIN: SearchWindow = SearchWindow { translation: 0.15, rotation: 0.03 };
/// The widest window (m).
const WIDEST: f64 = 6.0;
/// Where more is left open than this (m, rad), one match alone is not believed.
const ALONE: SearchWindow = SearchWindow { translation: 1.2, rotation: 0.25 };
/// A match needs this share of returns that agree ...
const MIN_AGREEMENT: f64 = 0.94;
/// ... and of returns with a partner.
const MIN_FITNESS: f64 = 0.3;
/// What a match is known by at best (rad, m): matches of submaps share what is wrong inside these.
const MATCH_SIGMA: (f64, f64) = (0.004, 0.02);
/// A match may be off from the graph by this squared Mahalanobis distance.
const GATE: f64 = 20.0;
/// Two matches agree when they differ by less (m, rad).
const AGREE: SearchWindow = SearchWindow { translation: 0.35, rotation: 0.07 };
/// A loop that has lost more than this share of its weight does not fit.
const FITTING: f64 = 0.25;
/// Steps of the graph's solution after each match.
const STEPS: usize = 8;
/// Steps of the last solution, of all scans.
const LAST_STEPS: usize = 30;

/// The search for loops, one submap after the other.
pub struct LoopClosure {
    keyframes: Vec<Keyframe>,
    links: Vec<ChainLink>,
    submaps: Vec<Submap>,
    /// Pose of each submap's anchor.
    poses: Vec<Pose2>,
    /// Between the anchors of the submaps: the chain, then loops.
    relations: Vec<PlanarRelation>,
    drifts: Vec<(usize, usize, Drift)>,
    /// Matches that wait for another one.
    pending: Vec<(usize, usize, SubmapMatch)>,
    loops: Vec<PlanarRelation>,
    next: usize,
}

impl LoopClosure {
    /// Joins the links of a chain to submaps.
    pub fn new(links: Vec<ChainLink>) -> Self {
        let keyframes: Vec<Keyframe> = links.iter().map(|link| Keyframe::new(Rc::clone(&link.scan))).collect();
        let poses: Vec<Pose2> = links.iter().map(|link| link.T_world_sensor).collect();
        let mut submaps = Vec::new();
        let (mut start, mut driven) = (0, 0.0);
        for index in 1..=links.len() {
            let is_end = index == links.len();
            let step = if is_end { 0.0 } else { (poses[index - 1].inverse() * poses[index]).translation_norm() };
            driven += step;
            if is_end || driven > SUBMAP_LENGTH || index - start >= SUBMAP_SCANS || !links[index].is_trusted {
                submaps.push(Submap::new(start..index, &keyframes, &poses));
                (start, driven) = (index, 0.0);
            }
        }
        let anchors: Vec<Pose2> = submaps.iter().map(|submap| poses[submap.anchor]).collect();
        let mut closure = Self {
            keyframes,
            links,
            submaps,
            poses: anchors,
            relations: Vec::new(),
            drifts: Vec::new(),
            pending: Vec::new(),
            loops: Vec::new(),
            next: 1,
        };
        closure.add_chain();
        closure
    }

    fn add_chain(&mut self) {
        for later in 1..self.submaps.len() {
            let (from, to) = (self.submaps[later - 1].anchor, self.submaps[later].anchor);
            let motions: Vec<Pose2> = (from + 1..=to).map(|index| self.motion(index)).collect();
            let covariances = self.links[from + 1..=to].iter().map(|link| &link.covariance);
            let covariance = chained_covariance(motions.iter().zip(covariances));
            let length = motions.iter().map(RigidMotion::translation_norm).sum();
            let information = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
            let T_from_to = self.poses[later - 1].inverse() * self.poses[later];
            let is_switchable = self.links[from + 1..=to].iter().any(|link| !link.is_trusted);
            self.relations.push(PoseRelation { from: later - 1, to: later, T_from_to, information, is_switchable });
            self.drifts.push((later - 1, later, Drift::new(&covariance, length)));
        }
    }

    /// The chain's motion from the scan before to this one.
    fn motion(&self, index: usize) -> Pose2 {
        self.links[index - 1].T_world_sensor.inverse() * self.links[index].T_world_sensor
    }

    /// Submaps done, and all.
    pub fn progress(&self) -> (usize, usize) {
        (self.next.min(self.submaps.len()), self.submaps.len())
    }

    /// Whether every submap has been looked for.
    pub fn is_done(&self) -> bool {
        self.next >= self.submaps.len()
    }

    /// The loops found, between submaps, as pairs of scans.
    pub fn loops(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.loops.iter().map(|relation| (self.submaps[relation.from].anchor, self.submaps[relation.to].anchor))
    }

    /// Returns of a scan of the chain.
    pub fn num_points(&self, link: usize) -> usize {
        self.keyframes[link].scan.points.len()
    }

    /// How two scans of the chain look from each other, the second at this pose in the frame of the first.
    pub fn free_space(&self, first: usize, second: usize, T_first_second: &Pose2) -> FreeSpaceTally {
        free_space_between(&self.keyframes[first], &self.keyframes[second], T_first_second)
    }

    /// Looks for the next submap in those before it.
    pub fn advance(&mut self, options: &IcpOptions) {
        if self.is_done() {
            return;
        }
        let source = self.next;
        self.next += 1;
        let drifts = drifts_from(source, self.submaps.len(), &self.drifts);
        let mut found = false;
        for (target, drift) in self.candidates(source, &drifts) {
            found |= self.try_match(target, source, &drift, options);
        }
        if found {
            self.solve();
        }
    }

    /// The submaps that this one most likely overlaps with, and what is left open between them.
    fn candidates(&self, source: usize, drifts: &[Option<Drift>]) -> Vec<(usize, Drift)> {
        let mut candidates: Vec<(f64, usize, Drift)> = Vec::new();
        for (target, drift) in drifts.iter().enumerate().take(source.saturating_sub(NEIGHBORS - 1)) {
            let Some(drift) = *drift else { continue };
            let between = self.poses[target].inverse() * self.poses[source];
            let apart = between.translation_norm();
            if apart < REACH + drift.position_sigma().min(WIDEST) {
                let (a, b) = (&self.submaps[target], &self.submaps[source]);
                let overlap = a.overlap(b, &between).min(b.overlap(a, &between.inverse()));
                if overlap > MIN_OVERLAP {
                    candidates.push((overlap, target, drift));
                }
            }
        }
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        // Of submaps that follow each other one is enough.
        let mut chosen: Vec<(usize, Drift)> = Vec::new();
        for (_, target, drift) in candidates {
            if chosen.len() < CANDIDATES && chosen.iter().all(|(other, _)| other.abs_diff(target) > 1) {
                chosen.push((target, drift));
            }
        }
        chosen
    }

    /// Matches two submaps; whether something entered the graph.
    fn try_match(&mut self, target: usize, source: usize, drift: &Drift, options: &IcpOptions) -> bool {
        let guess = self.poses[target].inverse() * self.poses[source];
        let window = SearchWindow {
            translation: (MARGIN.translation + SIGMAS * drift.position_sigma()).min(WIDEST),
            rotation: (MARGIN.rotation + SIGMAS * drift.heading_sigma()).min(std::f64::consts::PI),
        };
        let (a, b) = (&self.submaps[target], &self.submaps[source]);
        let Some(found) = match_submaps(a, b, &self.keyframes, &guess, window, options) else { return false };
        if found.agreement < MIN_AGREEMENT || found.fitness < MIN_FITNESS {
            return false;
        }
        let is_open = window.translation > ALONE.translation || window.rotation > ALONE.rotation;
        if !is_open {
            return self.enter(target, source, &found, drift);
        }
        let partner =
            self.pending.iter().position(|(a, b, other)| self.agree((target, source, &found), (*a, *b, other)));
        let Some(partner) = partner else {
            self.pending.push((target, source, found));
            return false;
        };
        let (a, b, other) = self.pending.swap_remove(partner);
        let entered = self.enter(target, source, &found, drift);
        self.enter(a, b, &other, drift) || entered
    }

    /// Whether two matches say the same of where the later stretch lies in the earlier one.
    fn agree(&self, (a, b, one): (usize, usize, &SubmapMatch), (c, d, other): (usize, usize, &SubmapMatch)) -> bool {
        const NEAR: usize = 4;
        if (a, b) == (c, d) || a.abs_diff(c) > NEAR || b.abs_diff(d) > NEAR {
            return false;
        }
        let chain = |from: usize, to: usize| self.poses[from].inverse() * self.poses[to];
        let around = one.T_target_source * chain(b, d);
        let apart = around.inverse() * chain(a, c) * other.T_target_source;
        apart.translation_norm() < AGREE.translation && apart.rotation_angle() < AGREE.rotation
    }

    /// Takes a match into the graph, unless it contradicts what is known.
    fn enter(&mut self, target: usize, source: usize, found: &SubmapMatch, drift: &Drift) -> bool {
        let covariance = softened(&found.information);
        let relation = PoseRelation {
            from: target,
            to: source,
            T_from_to: found.T_target_source,
            information: covariance.try_inverse().unwrap_or_else(Matrix3::zeros),
            is_switchable: true,
        };
        let residual = relation.residual(&self.poses[target], &self.poses[source]);
        let (sq_translation, sq_rotation) = (drift.position_sigma().powi(2), drift.rotation);
        let open = Matrix3::from_diagonal(&Vector3::new(sq_rotation, sq_translation, sq_translation)) + covariance;
        let Some(information) = open.try_inverse() else { return false };
        if residual.dot(&(information * residual)) > GATE {
            return false;
        }
        let length = found.T_target_source.translation_norm();
        self.drifts.push((target, source, Drift::new(&covariance, length)));
        self.relations.push(relation);
        self.loops.push(relation);
        true
    }

    fn solve(&mut self) {
        let built = self.next;
        let within = |relation: &&PlanarRelation| relation.to < built && relation.from < built;
        let relations: Vec<PlanarRelation> = self.relations.iter().filter(within).copied().collect();
        let last = self.poses[built - 1];
        solve_relations(&mut self.poses[..built], &relations, STEPS);
        // What comes later is carried along.
        let T_moved = self.poses[built - 1] * last.inverse();
        for pose in &mut self.poses[built..] {
            *pose = T_moved * *pose;
            // Products of many rotations lose their unit length, and then scale what they turn.
            pose.rotation.renormalize();
        }
    }

    /// The pose of every link when all is solved together.
    pub fn solved_poses(&self) -> Vec<Pose2> {
        let mut poses = Vec::with_capacity(self.links.len());
        for (submap, anchor) in self.submaps.iter().zip(&self.poses) {
            poses.extend(submap.T_anchor_keyframe.iter().map(|T| anchor * T));
        }
        solve_relations(&mut poses, &self.relations_of_links(), LAST_STEPS);
        poses
    }

    /// For each link whether trusted motions and loops that fit lead to it from the first one.
    pub fn is_connected(&self, poses: &[Pose2]) -> Vec<bool> {
        let trusted: Vec<PlanarRelation> = self
            .relations_of_links()
            .into_iter()
            .filter(|relation| !relation.is_switchable || relation.weight(relation.squared_distance(poses)) > FITTING)
            .filter(|relation| relation.to != relation.from + 1 || self.links[relation.to].is_trusted)
            .collect();
        let mut neighbors = vec![Vec::new(); self.links.len()];
        for relation in &trusted {
            neighbors[relation.from].push(relation.to);
            neighbors[relation.to].push(relation.from);
        }
        let mut is_connected = vec![false; self.links.len()];
        let mut open = vec![0; self.links.len().min(1)];
        while let Some(link) = open.pop() {
            if !std::mem::replace(&mut is_connected[link], true) {
                open.extend(&neighbors[link]);
            }
        }
        is_connected
    }

    /// The chain's motions, and the loops between anchors.
    pub fn relations_of_links(&self) -> Vec<PlanarRelation> {
        let chain = (1..self.links.len()).map(|index| PoseRelation {
            from: index - 1,
            to: index,
            T_from_to: self.motion(index),
            information: self.links[index].covariance.try_inverse().unwrap_or_else(Matrix3::zeros),
            is_switchable: !self.links[index].is_trusted,
        });
        let loops = self.loops.iter().map(|relation| PoseRelation {
            from: self.submaps[relation.from].anchor,
            to: self.submaps[relation.to].anchor,
            ..*relation
        });
        chain.chain(loops).collect()
    }
}

/// The covariance of a match: no better than [`MATCH_SIGMA`], and no worse than a wide search leaves it.
fn softened(information: &Matrix3<f64>) -> Matrix3<f64> {
    softened_covariance(information, MATCH_SIGMA, (0.5, 3.0))
}

/// The inverse of an information matrix (rotation first), which may leave directions open: what is known at best, and at
/// worst (rad, m).
pub fn softened_covariance(information: &Matrix3<f64>, best: (f64, f64), worst: (f64, f64)) -> Matrix3<f64> {
    let diagonal = |(rotation, translation): (f64, f64), power: i32| {
        Matrix3::from_diagonal(&Vector3::new(rotation, translation, translation).map(|sigma: f64| sigma.powi(power)))
    };
    let prior = diagonal(worst, -2);
    (information + prior).try_inverse().unwrap_or_else(|| diagonal(worst, 2)) + diagonal(best, 2)
}
