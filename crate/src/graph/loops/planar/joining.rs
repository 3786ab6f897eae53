//! Pieces that were found in one another: joined by matches of their submaps, as any loop.

use super::LoopClosure;
use super::matching::Pair;
use crate::geometry::quantile::THREE_SIGMA;
use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::information::CERTAIN_SIGMA;
use crate::registration::correlative::SearchWindow;
use crate::registration::icp::IcpOptions;
use crate::search::order::ascending;

/// Submaps of the other piece that each is matched with.
const NUM_TARGETS: usize = 2;

impl LoopClosure {
    /// Moves a piece to where it was found and matches its submaps with those of the other piece that lie near it. Where none that
    /// support each other are found, all is as before. `piece_of` is the piece of each keyframe, `found` the motion of the piece in the
    /// world.
    pub fn join(&mut self, piece_of: &[usize], piece: usize, into: usize, found: &Pose2, options: &IcpOptions) {
        let (before, num_matches) = (self.poses.clone(), self.pool.len());
        self.move_piece(piece_of, piece, into, found);
        self.covariances = self.relative_covariances(false);
        for pair in self.pairs_between(piece_of, piece, into) {
            let target = self.target(pair.target);
            self.match_pair(&target, &pair, options);
        }
        let num_loops = self.loops.len();
        if self.accept() && self.loops.len() > num_loops {
            // With what is known now, more is found.
            self.begin_round();
        } else {
            // What was matched there says nothing of where the piece is.
            self.poses = before;
            self.pool.truncate(num_matches);
        }
    }

    /// Moves a piece that another one does not tell the place of, and with it all that its recording tells of other pieces: what
    /// connects them would else contradict every match.
    pub(super) fn move_piece(&mut self, piece_of: &[usize], piece: usize, into: usize, motion: &Pose2) {
        let parts = self.parts_of_keyframes();
        let part_of = |piece: usize| piece_of.iter().position(|&of| of == piece).map(|keyframe| parts[keyframe]);
        let (moved, is_apart) = (part_of(piece), part_of(piece) != part_of(into));
        for (keyframe, pose) in self.poses.iter_mut().enumerate() {
            if piece_of[keyframe] == piece || (is_apart && Some(parts[keyframe]) == moved) {
                *pose = (motion * *pose).renormalized();
            }
        }
    }

    /// For each submap of a piece the nearest ones of the other that may show the same place.
    fn pairs_between(&self, piece_of: &[usize], piece: usize, into: usize) -> Vec<Pair> {
        let of = |wanted: usize| {
            let is_of = move |&submap: &usize| piece_of[self.submaps[submap].anchor] == wanted;
            (0..self.submaps.len()).filter(is_of)
        };
        let others: Vec<usize> = of(into).collect();
        // Once for the place, and once for what the piece bends by. In windows as wide as this a match needs another one to support it.
        let sigmas = 2.0 * THREE_SIGMA;
        let window = SearchWindow { translation: sigmas * CERTAIN_SIGMA.1, rotation: sigmas * CERTAIN_SIGMA.0 };
        let pairs_of = |submap: usize| {
            let place = |submap: usize| self.poses[self.submaps[submap].anchor];
            let apart = |other: usize| (place(other).inverse() * place(submap)).translation_norm();
            let reach = |other: usize| self.submaps[submap].reach(&self.submaps[other]);
            let near: Vec<usize> = others.iter().copied().filter(|&other| apart(other) < reach(other)).collect();
            let nearest = ascending(near.iter().map(|&other| apart(other))).into_iter().take(NUM_TARGETS);
            let pair = |other: usize| {
                let (target, source) = (submap.min(other), submap.max(other));
                Pair { target, source, guess: place(target).inverse() * place(source), window }
            };
            nearest.map(|index| pair(near[index])).collect::<Vec<_>>()
        };
        of(piece).flat_map(pairs_of).collect()
    }
}
