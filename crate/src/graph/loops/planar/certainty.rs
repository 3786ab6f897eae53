//! How well places are known to each other, and the certain pieces of the graph that follow from it.

use super::LoopClosure;
use super::uncertainty::RelativeCovariances;
use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::information::{openness, sigmas};

/// Places of a piece that are nearer to each other than this (m) are known to each other: a stretch of 20 m, and half a submap
/// at both of its ends. A longer way may leave more open at its end.
const NEAR: f64 = 25.0;

/// Standard deviations of the motion between two nodes, as the chain and the loops leave it open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uncertainty {
    /// The node in whose frame the other one is.
    pub from: usize,
    /// The other node.
    pub to: usize,
    /// Of its heading (rad).
    pub heading: f64,
    /// Of its position (m).
    pub position: f64,
}

impl LoopClosure {
    /// For each keyframe the number of its piece. A piece grows from its first submap over links and loops, the surest first,
    /// by submaps that are known to all of it that is near.
    pub fn pieces(&self) -> Vec<usize> {
        let (neighbors, covariances) = (self.neighbors(), self.certain_covariances());
        let mut piece_of = vec![usize::MAX; self.submaps.len()];
        let mut num_pieces = 0;
        for root in 0..self.submaps.len() {
            if piece_of[root] == usize::MAX {
                for member in self.piece(root, &neighbors, &piece_of, covariances.as_ref()) {
                    piece_of[member] = num_pieces;
                }
                num_pieces += 1;
            }
        }
        let of_keyframes = |(submap, piece): (&super::Submap, usize)| submap.keyframes.clone().map(move |_| piece);
        self.submaps.iter().zip(piece_of).flat_map(of_keyframes).collect()
    }

    /// How well the keyframes in the middle of submaps are known to each other, for all that are near.
    pub fn uncertainties(&self) -> Vec<Uncertainty> {
        let Some(covariances) = self.certain_covariances() else { return Vec::new() };
        let pairs = (1..self.submaps.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
        let near = pairs.filter(|&(a, b)| self.motion(a, b).translation_norm() < NEAR);
        let uncertainty = |(a, b)| {
            let (heading, position) = sigmas(&self.motion(a, b), &covariances.between(a, b));
            Uncertainty { from: self.submaps[a].anchor, to: self.submaps[b].anchor, heading, position }
        };
        near.map(uncertainty).collect()
    }

    fn certain_covariances(&self) -> Option<RelativeCovariances> {
        RelativeCovariances::new(&self.anchor_poses(), &self.anchor_relations(true))
    }

    /// Pose of one submap's anchor in the frame of another one's.
    fn motion(&self, a: usize, b: usize) -> Pose2 {
        self.poses[self.submaps[a].anchor].inverse() * self.poses[self.submaps[b].anchor]
    }

    /// For each submap those that a link or a loop connects it with.
    fn neighbors(&self) -> Vec<Vec<usize>> {
        let mut neighbors = vec![Vec::new(); self.submaps.len()];
        let is_linked = |later: &usize| !self.links[self.submaps[*later].keyframes.start].is_broken;
        let chain = (1..self.submaps.len()).filter(is_linked).map(|later| (later - 1, later));
        let loops = self.loops.iter().map(|closed| (closed.candidate.target, closed.candidate.source));
        for (a, b) in chain.chain(loops) {
            neighbors[a].push(b);
            neighbors[b].push(a);
        }
        neighbors
    }

    /// The submaps of the piece of one submap that belong to none so far.
    fn piece(
        &self,
        root: usize,
        neighbors: &[Vec<usize>],
        piece_of: &[usize],
        covariances: Option<&RelativeCovariances>,
    ) -> Vec<usize> {
        let Some(covariances) = covariances else { return vec![root] };
        let between = |a: usize, b: usize| openness(&self.motion(a, b), &covariances.between(a, b));
        let mut is_tried: Vec<bool> = piece_of.iter().map(|&piece| piece != usize::MAX).collect();
        let (mut members, mut next) = (Vec::new(), vec![(0.0_f64, root)]);
        while let Some(surest) = (0..next.len()).min_by(|&a, &b| next[a].0.total_cmp(&next[b].0)) {
            let (_, submap) = next.swap_remove(surest);
            if std::mem::replace(&mut is_tried[submap], true) {
                continue;
            }
            let is_known = |&member: &usize| {
                self.motion(member, submap).translation_norm() > NEAR || between(member, submap) < 1.0
            };
            if members.iter().all(is_known) {
                members.push(submap);
                next.extend(neighbors[submap].iter().map(|&neighbor| (between(submap, neighbor), neighbor)));
            }
        }
        members
    }
}
