//! Pieces of a map that show another recording, searched for in the largest one: nothing tells where that begins. Within a recording the
//! graph tells where a place may have come back, and the search for loops looks there.

use std::collections::HashSet;
use std::rc::Rc;

use super::keyframe_graph::KeyframeGraph;
use crate::geometry::quantile::THREE_SIGMA;
use crate::geometry::{Pose2, RigidMotion};
use crate::map::occupancy_grid::{OccupancyGrid, RESOLUTION};
use crate::odometry::localization::{LONGEST_STRETCH, StretchSearch};
use crate::odometry::planar::information::CERTAIN_SIGMA;
use crate::odometry::planar::odometry_model::MIN_SURE;
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::icp::IcpOptions;

/// Most stretches of a piece that are searched for: two recordings may have little in common, and a search takes up to half a second.
const MAX_STRETCHES: usize = 12;
/// The search ends when so many are certain; a piece with fewer stretches needs all of them.
const NUM_CERTAIN: usize = 2;

/// A search for the pieces of a graph. It is known by what it does alone, so that the part of the engine that a page begins with, which
/// begins none, does without.
pub trait PieceSearch {
    /// Searches for one stretch, or joins the piece whose stretches were found. Whether there is more to do.
    fn advance(&mut self, graph: &mut KeyframeGraph, scans: &[Rc<PlanarScan>], options: &IcpOptions) -> bool;

    /// Number of pieces before any was joined.
    fn num_pieces(&self) -> usize;
}

/// See [`Joining::begin`].
pub type BeginJoining = fn(&KeyframeGraph, &[Rc<PlanarScan>], &[usize]) -> Option<Box<dyn PieceSearch>>;

/// The search for the pieces.
pub struct Joining {
    /// The piece of each keyframe.
    piece_of: Vec<usize>,
    /// The one that the others are searched for in.
    largest: usize,
    map: Option<StretchSearch>,
    /// What is left to be searched for, the largest piece last.
    waiting: Vec<Piece>,
    num_pieces: usize,
}

/// A piece to be found.
struct Piece {
    number: usize,
    /// Stretches of keyframes.
    stretches: Vec<Vec<usize>>,
    /// Where each that was searched for is, if certain: the motion of the piece, with the middle of the stretch.
    found: Vec<Option<(Pose2, Pose2)>>,
    /// Whether the stretches are the halves of one.
    is_halved: bool,
}

impl Joining {
    /// Prepares to search for the pieces of a graph; `None` where there is none to search for. `recordings` has the number of the recording
    /// of each frame.
    pub fn begin(
        graph: &KeyframeGraph,
        scans: &[Rc<PlanarScan>],
        recordings: &[usize],
    ) -> Option<Box<dyn PieceSearch>> {
        if recordings.last() == recordings.first() {
            return None;
        }
        let piece_of = graph.closure.pieces();
        let poses = graph.closure.solved_poses();
        let mut members: Vec<Vec<usize>> = vec![Vec::new(); piece_of.iter().max().map_or(0, |last| last + 1)];
        for (keyframe, &piece) in piece_of.iter().enumerate() {
            members[piece].push(keyframe);
        }
        // The first of several of one size.
        let largest = (0..members.len()).rev().max_by_key(|&piece| members[piece].len())?;
        let recording = |keyframe: &usize| recordings[graph.nodes[*keyframe]];
        let known: HashSet<usize> = members[largest].iter().map(recording).collect();
        let is_other = |&piece: &usize| {
            members[piece].len() >= MIN_SURE
                && !members[piece].iter().any(|keyframe| known.contains(&recording(keyframe)))
        };
        let mut others: Vec<usize> = (0..members.len()).filter(is_other).collect();
        others.sort_by_key(|&piece| (members[piece].len(), std::cmp::Reverse(piece)));
        if others.is_empty() {
            return None;
        }
        let placed = |&keyframe: &usize| (scans[graph.nodes[keyframe]].as_ref(), poses[keyframe]);
        let placed: Vec<_> = members[largest].iter().map(placed).collect();
        let map = StretchSearch::new(&OccupancyGrid::new(&placed, &[], RESOLUTION));
        let piece = |number: usize| {
            let stretches = stretches(&members[number], &poses);
            Piece { number, stretches, found: Vec::new(), is_halved: false }
        };
        let waiting = others.into_iter().map(piece).collect();
        Some(Box::new(Self { piece_of, largest, map, waiting, num_pieces: members.len() }))
    }
}

impl PieceSearch for Joining {
    fn advance(&mut self, graph: &mut KeyframeGraph, scans: &[Rc<PlanarScan>], options: &IcpOptions) -> bool {
        let (Some(map), Some(piece)) = (&self.map, self.waiting.last_mut()) else { return false };
        let poses = graph.closure.solved_poses();
        let num_certain = piece.found.iter().flatten().count();
        if let Some(stretch) = piece.stretches.get(piece.found.len()).filter(|_| num_certain < NUM_CERTAIN) {
            let placed = |&keyframe: &usize| (scans[graph.nodes[keyframe]].as_ref(), poses[keyframe]);
            let placed: Vec<_> = stretch.iter().map(placed).collect();
            let middle = placed[placed.len() / 2].1;
            piece.found.push(map.certain_place(&placed).map(|motion| (motion, middle)));
            return true;
        }
        if piece.halve_the_only_certain() {
            return true;
        }
        let (number, motion) = (piece.number, piece.agreed_motion());
        self.waiting.pop();
        if let Some(motion) = motion {
            graph.closure.join(&self.piece_of, number, self.largest, &motion, options);
        }
        true
    }

    fn num_pieces(&self) -> usize {
        self.num_pieces
    }
}

impl Piece {
    /// Searches for the two halves of the only stretch that is certain, in place of all: two recordings may share just one stretch, and
    /// its halves can bear each other out as two stretches can. Whether there was one.
    fn halve_the_only_certain(&mut self) -> bool {
        let certain: Vec<usize> = (0..self.found.len()).filter(|&index| self.found[index].is_some()).collect();
        let &[only] = certain.as_slice() else { return false };
        if self.is_halved || self.stretches.len() < NUM_CERTAIN {
            return false;
        }
        let mut first = self.stretches.swap_remove(only);
        let second = first.split_off(first.len() / 2);
        (self.stretches, self.found, self.is_halved) = (vec![first, second], Vec::new(), true);
        true
    }

    /// The motion that the certain stretches agree about.
    fn agreed_motion(&self) -> Option<Pose2> {
        let certain: Vec<&(Pose2, Pose2)> = self.found.iter().flatten().collect();
        let (motion, _) = certain.first()?;
        let agrees = |(other, middle): &&(Pose2, Pose2)| {
            let off = (motion * middle).inverse() * (other * middle);
            off.rotation_angle() < THREE_SIGMA * CERTAIN_SIGMA.0
                && off.translation_norm() < THREE_SIGMA * CERTAIN_SIGMA.1
        };
        let is_enough = certain.len() >= NUM_CERTAIN.min(self.stretches.len());
        (is_enough && certain.iter().all(agrees)).then_some(*motion)
    }
}

/// Keyframes in a row, as long as a stretch may be, spread over a piece.
fn stretches(members: &[usize], poses: &[Pose2]) -> Vec<Vec<usize>> {
    let mut all: Vec<Vec<usize>> = Vec::new();
    let mut way = 0.0;
    for (index, &keyframe) in members.iter().enumerate() {
        let before = members[index.saturating_sub(1)];
        way += (poses[before].inverse() * poses[keyframe]).translation_norm();
        match all.last_mut() {
            Some(last) if before + 1 == keyframe && way < LONGEST_STRETCH => last.push(keyframe),
            _ => {
                all.push(vec![keyframe]);
                way = 0.0;
            }
        }
    }
    // Those that are longest show most.
    all.sort_by_key(|stretch| std::cmp::Reverse(stretch.len()));
    all.truncate(MAX_STRETCHES);
    all
}
