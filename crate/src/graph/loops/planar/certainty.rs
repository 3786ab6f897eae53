//! How well places are known to each other, and the certain pieces of the graph that follow from it.

use super::LoopClosure;
use super::submap::Submap;
use super::uncertainty::RelativeCovariances;
use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::information::{openness, sigmas};

/// Places of a piece that are nearer to each other than this (m) are known to each other: a stretch of 20 m, and half a submap
/// at both of its ends. A longer way may leave more open at its end.
const MAX_CERTAIN_DISTANCE: f64 = 25.0;

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
    /// For each keyframe the number of its piece. A piece grows from its first submap over links and loops, the most certain first.
    /// A submap joins it if its pose is certain relative to those of all its submaps within 25 m.
    pub fn pieces(&self) -> Vec<usize> {
        let (neighbors, covariances) = (self.neighbors(), self.relative_covariances(true));
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
        self.of_keyframes(&piece_of)
    }

    /// For each keyframe what holds for its submap.
    pub(super) fn of_keyframes<T: Copy>(&self, of_submaps: &[T]) -> Vec<T> {
        let of_submap = |(submap, value): (&Submap, &T)| std::iter::repeat_n(*value, submap.keyframes.len());
        self.submaps.iter().zip(of_submaps).flat_map(of_submap).collect()
    }

    /// How well the keyframes in the middle of submaps are known to each other, for all that are near.
    pub fn uncertainties(&self) -> Vec<Uncertainty> {
        let Some(covariances) = self.relative_covariances(true) else { return Vec::new() };
        let pairs = (1..self.submaps.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
        let near = pairs.filter(|&(a, b)| self.motion(a, b).translation_norm() < MAX_CERTAIN_DISTANCE);
        let uncertainty = |(a, b)| {
            let (heading, position) = sigmas(&self.motion(a, b), &covariances.between(a, b));
            Uncertainty { from: self.submaps[a].anchor, to: self.submaps[b].anchor, heading, position }
        };
        near.map(uncertainty).collect()
    }

    /// Pose of one submap's anchor in the frame of another one's.
    pub(super) fn motion(&self, a: usize, b: usize) -> Pose2 {
        self.poses[self.submaps[a].anchor].inverse() * self.poses[self.submaps[b].anchor]
    }

    /// For each submap those that a link or a loop connects it with.
    fn neighbors(&self) -> Vec<Vec<usize>> {
        let mut neighbors = vec![Vec::new(); self.submaps.len()];
        for [a, b] in self.connections(None) {
            neighbors[a].push(b);
            neighbors[b].push(a);
        }
        neighbors
    }

    /// The submaps that a certain link or a loop connects, without this loop.
    pub(super) fn connections(&self, without: Option<usize>) -> impl Iterator<Item = [usize; 2]> {
        let is_linked = |later: &usize| !self.links[self.submaps[*later].keyframes.start].is_broken;
        let chain = (1..self.submaps.len()).filter(is_linked).map(|later| [later - 1, later]);
        let loops = self.loops.iter().enumerate().filter(move |(index, _)| Some(*index) != without);
        chain.chain(loops.map(|(_, closed)| [closed.candidate.target, closed.candidate.source]))
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
                self.motion(member, submap).translation_norm() > MAX_CERTAIN_DISTANCE || between(member, submap) < 1.0
            };
            if members.iter().all(is_known) {
                members.push(submap);
                next.extend(neighbors[submap].iter().map(|&neighbor| (between(submap, neighbor), neighbor)));
            }
        }
        members
    }
}

#[cfg(test)]
mod tests {
    use std::rc::Rc;

    use nalgebra::{Matrix3, Vector2, Vector3};

    use super::*;
    use crate::graph::loops::planar::ChainLink;
    use crate::graph::pose_graph::BetweenFactor;
    use crate::preprocess::planar_scan::PlanarScan;

    const NUM_KEYFRAMES: usize = 120;

    /// A straight way in steps of a metre, each known to these deviations of heading (rad) and position (m), with broken links.
    fn way(heading: f64, position: f64, broken: &[usize]) -> LoopClosure {
        let scan = Rc::new(PlanarScan::new((0..40).map(|i| Vector2::new(0.1 * f64::from(i), 2.0)).collect()));
        let links = (0..NUM_KEYFRAMES).map(|index| {
            let is_broken = broken.contains(&index);
            let T_world_sensor = Pose2::translation(index as f64, 0.0);
            ChainLink { scan: Rc::clone(&scan), T_world_sensor, is_weak: is_broken, is_broken, begins_recording: false }
        });
        let variances = Vector3::new(heading, position, position).map(|sigma| sigma * sigma);
        let chain = (1..NUM_KEYFRAMES).map(|to| BetweenFactor {
            from: to - 1,
            to,
            T_from_to: Pose2::translation(1.0, 0.0),
            information: Matrix3::from_diagonal(&variances.map(f64::recip)),
            is_switchable: false,
        });
        LoopClosure::new(links.collect(), chain.collect())
    }

    #[test]
    fn a_heading_that_each_link_leaves_a_little_open_parts_a_long_way() {
        assert!(way(0.002, 0.01, &[]).pieces().iter().all(|&piece| piece == 0), "0.6 degrees over 25 m");
        let loose = way(0.01, 0.01, &[]);
        let pieces = loose.pieces();
        let changes: Vec<usize> = (1..NUM_KEYFRAMES).filter(|&index| pieces[index] != pieces[index - 1]).collect();
        assert!((4..20).contains(&changes.len()), "2.9 degrees over 25 m: {changes:?}");
        for known in loose.uncertainties() {
            let is_wide = known.heading > 0.044 || known.position > 0.25;
            assert!(!is_wide || pieces[known.from] != pieces[known.to], "{known:?}");
        }
    }

    #[test]
    fn the_uncertainty_of_a_way_is_the_sum_of_its_links() {
        let known = way(0.01, 0.02, &[]).uncertainties();
        let longest = known.iter().max_by_key(|known| known.to - known.from).unwrap();
        let steps = (longest.to - longest.from) as f64;
        assert!((longest.heading - 0.01 * steps.sqrt()).abs() < 1e-6, "{longest:?}");
        // The error of a link's heading turns all that comes after the keyframe it begins at.
        let turned: f64 = (1..=longest.to - longest.from).map(|length| (0.01 * length as f64).powi(2)).sum();
        let expected = (2.0 * 0.02f64.powi(2) * steps + turned).sqrt();
        assert!((longest.position - expected).abs() < 1e-6, "{longest:?}, not {expected}");
    }

    #[test]
    fn nothing_goes_over_a_broken_link_however_many_there_are() {
        let broken: Vec<usize> = (2..NUM_KEYFRAMES).step_by(2).collect();
        let pieces = way(0.002, 0.01, &broken).pieces();
        assert_eq!(pieces, (0..NUM_KEYFRAMES).map(|index| index / 2).collect::<Vec<_>>());
    }
}
