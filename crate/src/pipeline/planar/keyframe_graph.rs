//! The graph between the chain and the joint solution: keyframes, the relations between them, loops, and the certain pieces
//! that come of them.

use std::rc::Rc;

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::geometry::quantile::THREE_SIGMA;
use crate::geometry::{Pose2, RigidMotion};
use crate::graph::joint_scan_registration::{Edge, MAX_NEIGHBOR_DISTANCE, OdometryFactor, edges_between};
use crate::graph::loops::planar::{ChainLink, LoopClosure, LoopTrials, Uncertainty};
use crate::graph::pose_graph::{BetweenFactor, PlanarFactor};
use crate::io::pose_graph::{Edge as MotionEdge, PoseGraph};
use crate::map::local::is_new_view;
use crate::odometry::assessment::Status;
use crate::odometry::planar::assess::{MIN_OVERLAP, PLAUSIBLE_AGREEMENT};
use crate::odometry::planar::information::{openness, seen_from, softened_covariance};
use crate::odometry::planar::odometry_model::{MIN_SURE, OdometryModel, UNREGISTERED};
use crate::odometry::planar::{
    FrameEstimate, Link, MIN_FRAMES_KNOWN_MOTION, MeasuredMotion, REGISTRATION_SIGMA, UNKNOWN_SIGMA,
};
use crate::preprocess::planar_scan::PlanarScan;
use crate::search::order::ascending;

/// From this many placed scans on a sequence is long: its keyframes are some of its scans, and each is matched with a few others.
const LONG_SEQUENCE: usize = 100;
/// A direction that the walls leave open is known, without measured motion, by the motion before: to a share of it and
/// this (rad, m). With a third of what a motion may change by, the corridor has one stretch falsely good from scans alone (none).
const OPEN_DIRECTION_SIGMA: (f64, f64) = (0.03, 0.03);
/// That share.
const OPEN_DIRECTION_SHARE: f64 = 0.3;
/// Openness of a link above which it divides two submaps.
const MAX_OPENNESS: f64 = 0.1;
/// Keyframes that each keyframe is matched with among those just before it and, at most, among the earlier ones that saw the same place.
const NUM_MATCHED: usize = 3;
/// Standard deviation of a match's residuals (m): the pose graph's relations are weighted in its units.
const MATCH_SIGMA: f64 = 0.08;

/// Keyframes of a chain and how the other frames are attached to them.
pub struct KeyframeGraph {
    /// The keyframes' indices among all frames.
    pub nodes: Vec<usize>,
    /// For each frame the number of its keyframe, and its pose in that one's frame.
    hangs_on: Vec<(usize, Pose2)>,
    is_long: bool,
    /// Whether there is measured motion for any frame.
    has_measured_motion: bool,
    /// Whether a keyframe is good and the odometry leads to it from the one before.
    is_confirmed: Vec<bool>,
    /// Whether a keyframe was placed by measured motion alone.
    is_carried: Vec<bool>,
    /// The loops between keyframes.
    pub closure: LoopClosure,
}

impl KeyframeGraph {
    /// Picks the keyframes of a chain. There has to be a frame that is not lost.
    pub fn new(
        estimates: &[FrameEstimate],
        scans: &[Rc<PlanarScan>],
        poses: &[Pose2],
        odometry: &OdometryModel,
    ) -> Self {
        let is_long = estimates.iter().filter(|estimate| estimate.link != Link::Lost).count() >= LONG_SEQUENCE;
        let (nodes, hangs_on) = keyframes(estimates, poses, is_long);
        let link = |&node: &usize| {
            let scan = Rc::clone(&scans[node]);
            ChainLink {
                scan,
                T_world_sensor: poses[node],
                is_weak: false,
                is_broken: false,
                begins_recording: estimates[node].link == Link::Start && estimates[node].registration.is_none(),
            }
        };
        let mut links: Vec<ChainLink> = nodes.iter().map(link).collect();
        let (mut chain, mut is_confirmed) = (Vec::new(), vec![false]);
        for (node, pair) in nodes.windows(2).enumerate() {
            let relations = Relations::between(pair[0], pair[1], estimates, odometry);
            links[node + 1].is_weak = relations.openness.is_none_or(|open| open > MAX_OPENNESS);
            links[node + 1].is_broken = relations.openness.is_none();
            let is_good = estimates[pair[1]].assessment().status == Status::Good;
            is_confirmed.push(is_good && odometry.between(pair[0], pair[1]).is_some());
            chain.extend(relations.between_nodes(node));
        }
        Self {
            is_carried: nodes.iter().map(|&node| estimates[node].link == Link::Carried).collect(),
            has_measured_motion: odometry.is_measured(),
            is_confirmed,
            closure: LoopClosure::new(links, chain),
            nodes,
            hangs_on,
            is_long,
        }
    }

    /// Whether there are enough scans for keyframes to be chosen.
    pub fn is_long(&self) -> bool {
        self.is_long
    }

    /// The number of a frame's keyframe, and its pose in that one's frame.
    pub fn attached(&self, frame: usize) -> (usize, Pose2) {
        self.hangs_on[frame]
    }

    /// Puts the keyframes at these poses, and every other frame with its keyframe.
    pub fn place(&self, of_nodes: &[Pose2], poses: &mut [Pose2]) {
        for (pose, (node, T_node_frame)) in poses.iter_mut().zip(&self.hangs_on) {
            *pose = of_nodes[*node] * T_node_frame;
        }
    }

    /// For each frame the number of the certain piece it belongs to, 0 being the main one: the largest.
    pub fn pieces(&self) -> Vec<usize> {
        let mut of_nodes = self.closure.pieces();
        let size = |piece: usize| of_nodes.iter().filter(|&&of| of == piece).count();
        let num_pieces = of_nodes.iter().max().map_or(0, |last| last + 1);
        // Earlier pieces win where there are several of one size.
        let largest = (0..num_pieces).max_by_key(|&piece| (size(piece), std::cmp::Reverse(piece))).unwrap_or(0);
        for piece in &mut of_nodes {
            *piece = match *piece {
                0 => largest,
                main if main == largest => 0,
                other => other,
            };
        }
        self.hangs_on.iter().map(|(node, _)| of_nodes[*node]).collect()
    }

    /// How well frames are known to each other, for keyframes spread over the way that are near each other.
    pub fn uncertainties(&self) -> Vec<Uncertainty> {
        let of_nodes = self.closure.uncertainties().into_iter();
        of_nodes.map(|of| Uncertainty { from: self.nodes[of.from], to: self.nodes[of.to], ..of }).collect()
    }

    /// What the search for loops compared; nodes are frames.
    pub fn loop_trials(&self) -> LoopTrials {
        let mut all = self.closure.trials();
        for trial in &mut all.trials {
            (trial.target, trial.source) = (self.nodes[trial.target], self.nodes[trial.source]);
        }
        for (target, source) in &mut all.loops {
            (*target, *source) = (self.nodes[*target], self.nodes[*source]);
        }
        for anchor in &mut all.anchors {
            *anchor = self.nodes[*anchor];
        }
        all
    }

    /// What the chain and the loops tell of the motions between keyframes at these poses, as far as it fits.
    pub fn odometry_factors(&self, of_nodes: &[Pose2]) -> Vec<OdometryFactor<Pose2>> {
        let factors = self.closure.factors();
        let known = factors.iter().map(|factor| {
            let weight = factor.weight(factor.squared_distance(of_nodes)) * MATCH_SIGMA * MATCH_SIGMA;
            let BetweenFactor { from, to, T_from_to, information, .. } = *factor;
            OdometryFactor { from, to, T_from_to, information: information * weight }
        });
        known.collect()
    }

    /// The keyframes where the graph has them, by their frames, and the motions between them with the information that is left to each where
    /// the others contradict it.
    pub fn pose_graph(&self) -> PoseGraph<Pose2> {
        let poses = self.closure.solved_poses();
        let edge = |factor: PlanarFactor| {
            let weight = factor.weight(factor.squared_distance(&poses));
            let BetweenFactor { from, to, T_from_to, information, .. } = factor;
            // From a perturbation on the left to one on the right.
            let adjoint = T_from_to.adjoint();
            MotionEdge { from, to, T_from_to, information: adjoint.transpose() * information * adjoint * weight }
        };
        let edges = self.closure.factors().into_iter().map(edge).collect();
        let ids = self.nodes.iter().map(|&node| node as u64).collect();
        PoseGraph { ids, num_given: poses.len(), poses, fixed: Vec::new(), edges }
    }

    /// Frames whose place one loop that was put in by hand tells alone.
    pub fn hang_by_one_hand(&self) -> Vec<usize> {
        let hang = self.closure.hang_by_one_hand();
        (0..self.hangs_on.len()).filter(|&frame| hang[self.hangs_on[frame].0]).collect()
    }

    /// Frames of pieces that are too small to be sure of, unless the odometry confirms every step between their keyframes: of the main
    /// piece all but the first frame, where a doubt came before the motion was known.
    pub fn in_small_pieces(&self, pieces: &[usize]) -> Vec<usize> {
        let mut nodes = vec![Vec::new(); pieces.iter().max().map_or(0, |last| last + 1)];
        for (number, &node) in self.nodes.iter().enumerate() {
            nodes[pieces[node]].push(number);
        }
        let is_unsure = nodes.len() > 1 && !self.has_measured_motion && !is_motion_known(&nodes[0]);
        let first = pieces.iter().position(|&piece| piece == 0);
        let is_step_sure = |pair: &[usize]| pair[0] + 1 == pair[1] && self.is_confirmed[pair[1]];
        let is_sure =
            |of: &Vec<usize>| of.len() >= MIN_SURE || (is_motion_known(of) && of.windows(2).all(is_step_sure));
        let are_sure: Vec<bool> = nodes.iter().map(is_sure).collect();
        let is_small = |&frame: &usize| match pieces[frame] {
            0 => is_unsure && Some(frame) != first,
            piece => !are_sure[piece],
        };
        (0..pieces.len()).filter(is_small).collect()
    }

    /// Which keyframes are matched with which in the joint solution. Points find partners in whatever lies near, so scans
    /// that only share a place, as two that look in opposite directions, must not meet, nor those of recordings of which none leads to
    /// the other.
    pub fn edges(&self, of_nodes: &[Pose2], matched: usize) -> Vec<Edge> {
        let parts = self.closure.parts_of_keyframes();
        let is_known = |edge: &Edge| parts[edge.target] == parts[edge.source];
        if self.is_long {
            return (1..of_nodes.len()).flat_map(|later| self.edges_of(later, of_nodes)).filter(is_known).collect();
        }
        let positions: Vec<Vector2<f64>> = of_nodes.iter().map(|pose| pose.translation.vector).collect();
        let mut edges = edges_between(&positions, matched);
        edges.retain(|edge| is_known(edge) && self.see_the_same(edge.target, edge.source, of_nodes));
        edges
    }

    /// The edges of a keyframe to those before it, and to those of earlier times that see the same as it sees.
    fn edges_of(&self, later: usize, of_nodes: &[Pose2]) -> Vec<Edge> {
        let window = later.saturating_sub(NUM_MATCHED);
        let apart = |earlier: usize| {
            let T = of_nodes[earlier].inverse() * of_nodes[later];
            T.translation_norm() + T.rotation_angle()
        };
        let sees_same = |&earlier: &usize| self.see_the_same(earlier, later, of_nodes);
        let near: Vec<(f64, usize)> = (0..window)
            .map(|earlier| (apart(earlier), earlier))
            .filter(|(apart, _)| *apart < MAX_NEIGHBOR_DISTANCE)
            .collect();
        let nearest_first = ascending(near.iter().map(|(apart, _)| *apart)).into_iter().map(|index| near[index].1);
        let revisited = nearest_first.filter(sees_same).take(NUM_MATCHED);
        let before = (window..later).filter(sees_same);
        revisited.chain(before).map(|target| Edge { source: later, target }).collect()
    }

    /// Whether two keyframes agree about a good part of what they see.
    fn see_the_same(&self, first: usize, second: usize, of_nodes: &[Pose2]) -> bool {
        if self.is_carried[first] || self.is_carried[second] {
            return false; // the chain has found that it fits nothing there
        }
        let seen = self.closure.free_space(first, second, &(of_nodes[first].inverse() * of_nodes[second]));
        let all = self.closure.num_points(first) + self.closure.num_points(second);
        seen.agreement() > PLAUSIBLE_AGREEMENT && seen.agreeing as f64 > MIN_OVERLAP * all as f64
    }
}

/// Whether there are more keyframes than those before the motion is known.
fn is_motion_known(nodes: &[usize]) -> bool {
    nodes.len() > MIN_FRAMES_KNOWN_MOTION + 1
}

/// The motion between two frames, by the chain, and its covariance (a perturbation on the left, rotation first): what registration and
/// odometry tell, and the motion before where they leave a direction open. `None` where nothing ties the two.
pub fn motion_between(
    before: usize,
    frame: usize,
    estimates: &[FrameEstimate],
    odometry: &OdometryModel,
) -> Option<(Pose2, Matrix3<f64>)> {
    let relations = Relations::between(before, frame, estimates, odometry);
    let covariance = covariance(&relations.all).filter(|_| relations.openness.is_some())?;
    Some((estimates[before].T_world_sensor.inverse() * estimates[frame].T_world_sensor, covariance))
}

/// The relations between two keyframes that follow each other, and what they leave open together.
struct Relations {
    all: Vec<PlanarFactor>,
    /// As a share of what is certain enough, 0 where that is certain and nothing speaks against the registration; `None` where
    /// nothing certain ties the two.
    openness: Option<f64>,
}

impl Relations {
    fn between(before: usize, frame: usize, estimates: &[FrameEstimate], odometry: &OdometryModel) -> Self {
        let (estimate, T_world_before) = (&estimates[frame], estimates[before].T_world_sensor);
        let is_start = estimate.link == Link::Start;
        let mut all = Vec::new();
        let measured = odometry.between(before, frame);
        let T_before_frame = T_world_before.inverse() * estimate.T_world_sensor;
        let registered = estimate.registration.as_ref().filter(|_| {
            estimate.link == Link::Registered
                || (estimate.link == Link::Doubted && estimate.registered.agreement > PLAUSIBLE_AGREEMENT)
        });
        if let Some(registration) = registered.filter(|_| !is_start) {
            let worst = expected(&T_before_frame, measured.is_some());
            let information = seen_from(&estimate.information, &T_world_before);
            let covariance = softened_covariance(&information, REGISTRATION_SIGMA, worst);
            // Without measured motion to fall back on, the registration is all there is.
            all.push(relation(
                T_world_before.inverse() * registration.T_target_source,
                &covariance,
                measured.is_some(),
            ));
        }
        if let Some(MeasuredMotion { T_before_sensor, covariance }) = &measured {
            // Wheels that slipped give way to a registration that nothing speaks against.
            all.push(relation(*T_before_sensor, covariance, estimate.link == Link::Registered));
        }
        if all.is_empty() {
            // A doubted registration lies somewhere in the window that was searched.
            let searched = (UNKNOWN_SIGMA.0 / THREE_SIGMA, UNKNOWN_SIGMA.1 / THREE_SIGMA);
            let sigma = if estimate.link == Link::Doubted && !is_start { searched } else { untold() };
            all.push(relation(T_before_frame, &diagonal(sigma), true));
        }
        let is_tied = estimate.link == Link::Registered || measured.is_some();
        let left = covariance(&all).filter(|_| is_tied && !(is_start && measured.is_none()));
        let is_sure = estimate.link == Link::Registered;
        let open = left.map(|left| openness(&T_before_frame, &left));
        let openness = open.map(|open| if is_sure && open < 1.0 { 0.0 } else { open });
        Self { all, openness }
    }

    /// As relations between node `from` and the next.
    fn between_nodes(self, from: usize) -> impl Iterator<Item = PlanarFactor> {
        self.all.into_iter().map(move |relation| BetweenFactor { from, to: from + 1, ..relation })
    }
}

/// A relation of which the nodes are still to be named.
fn relation(T_from_to: Pose2, covariance: &Matrix3<f64>, is_switchable: bool) -> PlanarFactor {
    let information = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
    BetweenFactor { from: 0, to: 0, T_from_to, information, is_switchable }
}

/// What several relations leave uncertain together; `None` where they leave a direction open.
fn covariance(relations: &[PlanarFactor]) -> Option<Matrix3<f64>> {
    relations.iter().map(|relation| relation.information).sum::<Matrix3<f64>>().try_inverse()
}

/// The keyframes' indices, and for each frame the number of its keyframe and its pose in that one's frame. A keyframe is the
/// first frame of a piece and, of a long sequence, each one that has moved far enough since the last keyframe.
fn keyframes(estimates: &[FrameEstimate], poses: &[Pose2], is_long: bool) -> (Vec<usize>, Vec<(usize, Pose2)>) {
    let (mut nodes, mut hangs_on) = (Vec::<usize>::new(), Vec::new());
    for (frame, estimate) in estimates.iter().enumerate() {
        let since = nodes.last().map(|&node| poses[node].inverse() * poses[frame]);
        let is_keyframe = estimate.link == Link::Start || since.is_none_or(|motion| !is_long || is_new_view(&motion));
        if estimate.link != Link::Lost && is_keyframe {
            nodes.push(frame);
            hangs_on.push((nodes.len() - 1, Pose2::identity()));
        } else {
            hangs_on.push((nodes.len().saturating_sub(1), since.unwrap_or(poses[frame])));
        }
    }
    for frame in 0..nodes.first().copied().unwrap_or(0) {
        hangs_on[frame].1 = poses[nodes[0]].inverse() * poses[frame];
    }
    (nodes, hangs_on)
}

/// Standard deviation of a motion that nothing tells, across a break of the chain or to an implausible pose (rad, m): the heading is as
/// open as a registration may leave it, and the position lies within the usual search.
fn untold() -> (f64, f64) {
    let ((heading, _), (_, position)) = (UNREGISTERED, UNKNOWN_SIGMA);
    (heading, position)
}

/// How well a motion is known without any registration of it (rad, m).
fn expected(motion: &Pose2, is_measured: bool) -> (f64, f64) {
    if is_measured {
        return untold(); // the measured motion is a relation of its own
    }
    (
        OPEN_DIRECTION_SIGMA.0 + OPEN_DIRECTION_SHARE * motion.rotation_angle(),
        OPEN_DIRECTION_SIGMA.1 + OPEN_DIRECTION_SHARE * motion.translation_norm(),
    )
}

fn diagonal((rotation, translation): (f64, f64)) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(rotation, translation, translation).map(|sigma: f64| sigma * sigma))
}
