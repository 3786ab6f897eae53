//! What a long sequence needs between the chain and the joint solution: keyframes, and loops between them.

use std::rc::Rc;

use nalgebra::Matrix3;

use crate::geometry::{Pose2, RigidMotion};
use crate::graph::joint_scan_registration::{Edge, KnownMotion};
use crate::graph::loops::planar::{ChainLink, LoopClosure, softened_covariance};
use crate::graph::pose_graph::PoseRelation;
use crate::odometry::assessment::Status;
use crate::odometry::planar::FrameEstimate;
use crate::preprocess::planar_scan::PlanarScan;

/// From this many scans on a sequence is long: its loops are looked for, and not every scan is matched with every other.
pub const LONG_SEQUENCE: usize = 100;
/// A scan is a keyframe when it has moved (m) ...
const KEYFRAME_MOVE: f64 = 0.1;
/// ... or turned (rad) by so much since the last one.
const KEYFRAME_TURN: f64 = 0.08;
/// A registration is known by no better than this (rad, m): its pairs of points are not independent.
const BEST: (f64, f64) = (0.003, 0.008);
/// A direction that the walls leave open is known by the first guess: by measured motion to a share of it ...
const MEASURED_SHARE: f64 = 0.1;
/// ... and this (rad, m), ...
const MEASURED: (f64, f64) = (0.01, 0.01);
/// ... and by the motion before to a share of it ...
const EXPECTED_SHARE: f64 = 0.3;
/// ... and this (rad, m).
const EXPECTED: (f64, f64) = (0.03, 0.03);
/// Doubtful registrations with more agreement than this are mostly right: people walked by.
const PLAUSIBLE: f64 = 0.75;
/// They are known by no better than this (rad, m).
const PLAUSIBLY: (f64, f64) = (0.02, 0.04);
/// A registration that is doubtful may be off by this (rad, m) ...
const DOUBTFUL: (f64, f64) = (0.3, 0.5);
/// ... and past a lost scan the chain may be anywhere near (rad, m).
const LOST: (f64, f64) = (1.0, 1.5);
/// Each keyframe is matched with so many before it ...
const WINDOW: usize = 3;
/// ... and with so many of those that looked at the same place earlier.
const REVISITED: usize = 3;
/// Keyframes further apart (m), a turn by a radian counted as much as a metre, are not matched.
const FAR: f64 = 3.0;
/// Nor are such whose returns agree by less than this where both see them ...
const EDGE_AGREEMENT: f64 = 0.8;
/// ... or which share less than this of what they see.
const EDGE_SHARE: f64 = 0.35;
/// Standard deviation of a match's residuals (m), in whose unit what is known besides is weighed against them.
const MATCH_SIGMA: f64 = 0.03;

/// Keyframes of a chain and how the other frames hang on them.
pub struct LongSequence {
    /// The keyframes' indices among all frames.
    pub nodes: Vec<usize>,
    /// For each frame the number of its keyframe, and its pose in that one's frame.
    hangs_on: Vec<(usize, Pose2)>,
    /// The loops between keyframes.
    pub closure: LoopClosure,
}

impl LongSequence {
    /// Picks the keyframes of a chain. There has to be a frame that is not lost.
    pub fn new(
        estimates: &[FrameEstimate],
        scans: &[Rc<PlanarScan>],
        poses: &[Pose2],
        motions: &[Option<Pose2>],
    ) -> Self {
        let (mut nodes, mut hangs_on): (Vec<usize>, Vec<(usize, Pose2)>) = (Vec::new(), Vec::new());
        let mut links = Vec::new();
        let mut worst_since = Status::Good;
        for (frame, estimate) in estimates.iter().enumerate() {
            let status = estimate.assessment.status;
            worst_since = worse(worst_since, status);
            let since = nodes.last().map(|&node: &usize| poses[node].inverse() * poses[frame]);
            let is_node = status != Status::Lost
                && since.is_none_or(|T| T.translation_norm() > KEYFRAME_MOVE || T.rotation_angle() > KEYFRAME_TURN);
            if is_node {
                links.push(ChainLink {
                    scan: Rc::clone(&scans[frame]),
                    T_world_sensor: poses[frame],
                    covariance: nodes.last().map_or_else(Matrix3::identity, |&before| {
                        let guess = guessed(&(poses[before].inverse() * poses[frame]), motions[frame].is_some());
                        link_covariance(estimate, &poses[before], worst_since, guess)
                    }),
                    is_trusted: worst_since == Status::Good
                        || (worst_since == Status::Doubtful && estimate.assessment.agreement > PLAUSIBLE),
                });
                nodes.push(frame);
                worst_since = Status::Good;
                hangs_on.push((nodes.len() - 1, Pose2::identity()));
            } else {
                hangs_on.push((nodes.len().saturating_sub(1), since.unwrap_or(poses[frame])));
            }
        }
        Self { nodes, hangs_on, closure: LoopClosure::new(links) }
    }

    /// Puts the keyframes at these poses, and every other frame with its keyframe.
    pub fn place(&self, of_nodes: &[Pose2], poses: &mut [Pose2]) {
        for (pose, (node, T_node_frame)) in poses.iter_mut().zip(&self.hangs_on) {
            *pose = of_nodes[*node] * T_node_frame;
        }
    }

    /// Frames whose place hangs on a registration that is doubted, or on a lost scan, and that no loop confirms.
    pub fn unconfirmed(&self, of_nodes: &[Pose2]) -> impl Iterator<Item = usize> + '_ {
        let is_connected = self.closure.is_connected(of_nodes);
        self.hangs_on.iter().enumerate().filter(move |(_, (node, _))| !is_connected[*node]).map(|(frame, _)| frame)
    }

    /// What the chain and the loops tell of the motions between keyframes at these poses, as far as it fits.
    pub fn known_motions(&self, of_nodes: &[Pose2]) -> Vec<KnownMotion<Pose2>> {
        let relations = self.closure.relations_of_links();
        let known = relations.iter().map(|relation| {
            let weight = relation.weight(relation.squared_distance(of_nodes)) * MATCH_SIGMA * MATCH_SIGMA;
            let PoseRelation { from, to, T_from_to, information, .. } = *relation;
            KnownMotion { from, to, T_from_to, information: information * weight }
        });
        known.collect()
    }

    /// Which keyframes are matched with which in the joint solution: those before each, and those of earlier times that
    /// see the same as it sees. Points find partners in whatever lies near, so scans that only share a place, as two
    /// that look in opposite directions, must not meet.
    pub fn edges(&self, of_nodes: &[Pose2]) -> Vec<Edge> {
        let mut edges = Vec::new();
        for later in 1..of_nodes.len() {
            let window = later.saturating_sub(WINDOW);
            let between = |earlier: usize| of_nodes[earlier].inverse() * of_nodes[later];
            let apart = |earlier: usize| between(earlier).translation_norm() + between(earlier).rotation_angle();
            let sees_same = |earlier: usize| {
                let seen = self.closure.free_space(earlier, later, &between(earlier));
                let all = self.closure.num_points(earlier) + self.closure.num_points(later);
                seen.agreement() > EDGE_AGREEMENT && seen.agreeing as f64 > EDGE_SHARE * all as f64
            };
            let mut revisited: Vec<(f64, usize)> =
                (0..window).map(|earlier| (apart(earlier), earlier)).filter(|(apart, _)| *apart < FAR).collect();
            revisited.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let revisited = revisited.into_iter().map(|(_, earlier)| earlier).filter(|&earlier| sees_same(earlier));
            for target in revisited.take(REVISITED).chain((window..later).filter(|&earlier| sees_same(earlier))) {
                edges.push(Edge { source: later, target });
            }
        }
        edges
    }
}

fn worse(a: Status, b: Status) -> Status {
    let rank = |status| match status {
        Status::Good => 0,
        Status::Doubtful => 1,
        Status::Lost => 2,
    };
    if rank(a) >= rank(b) { a } else { b }
}

/// How well a motion is known before any registration (rad, m).
fn guessed(motion: &Pose2, is_measured: bool) -> (f64, f64) {
    let (share, least) = if is_measured { (MEASURED_SHARE, MEASURED) } else { (EXPECTED_SHARE, EXPECTED) };
    (least.0 + share * motion.rotation_angle(), least.1 + share * motion.translation_norm())
}

/// Covariance of the motion from the keyframe before, which the registration measured in the world.
fn link_covariance(
    estimate: &FrameEstimate,
    T_world_before: &Pose2,
    worst_since: Status,
    guess: (f64, f64),
) -> Matrix3<f64> {
    let adjoint = T_world_before.adjoint();
    let information = estimate.registration.as_ref().map_or_else(Matrix3::zeros, |r| r.information);
    let best = match worst_since {
        Status::Good => BEST,
        Status::Doubtful if estimate.assessment.agreement > PLAUSIBLE => PLAUSIBLY,
        Status::Doubtful => DOUBTFUL,
        Status::Lost => LOST,
    };
    softened_covariance(&adjoint.tr_mul(&(information * adjoint)), best, guess)
}
