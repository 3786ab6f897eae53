//! The last stretch of a recording as one rigid set of beams, chained by the motion from scan to scan.

use std::collections::HashSet;

use nalgebra::Vector2;

use super::likelihood::Beam;
use super::search::LATTICE;
use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::MeasuredMotion;
use crate::preprocess::planar_scan::PlanarScan;

/// A scan is a keyframe after this way (m) or this turn (rad): scans in between see the same, with the same people in it.
const KEYFRAME: (f64, f64) = (0.5, 0.35);
/// Side of the cells by which different pieces of walls are counted (m).
const PIECE: f64 = 0.3;
/// Longest way of a window or a stretch (m): over a longer one the chain bends by more than a cell of the search.
pub const LONGEST_STRETCH: f64 = 12.0;

/// One of its scans.
#[derive(Debug, Clone)]
pub(super) struct WindowScan {
    /// Number of the scan.
    pub frame: usize,
    /// In the frame of the window's first scan.
    pub pose: Pose2,
    /// Its beams in its own frame.
    pub beams: Vec<Beam>,
    /// From the scan before; of the first one, of no meaning.
    pub motion: MeasuredMotion,
    /// Part of the pieces of walls that it shows which scans before it have shown.
    pub shared: f64,
    /// Number of pieces of walls that no keyframe before it has shown, where it is one itself.
    pub num_new: Option<usize>,
    /// Way from the first scan (m).
    way: f64,
}

/// Consecutive scans with their poses in the frame of the first.
#[derive(Debug, Clone, Default)]
pub(super) struct Window {
    pub scans: Vec<WindowScan>,
    /// The last keyframe.
    last_keyframe: Pose2,
    /// The pieces of walls that its keyframes have shown.
    pieces: HashSet<(i32, i32)>,
}

/// The beams of all keyframes in the frame of one in the middle, so that turns move them little.
#[derive(Debug, Clone, Default)]
pub(super) struct JoinedBeams {
    pub beams: Vec<Beam>,
    /// Index of the scan in the middle.
    pub middle: usize,
    /// Number of different pieces of walls that they show.
    pub num_pieces: usize,
}

/// Beams of a scan whose returns are some way from each other.
pub(super) fn beams_of(scan: &PlanarScan) -> Vec<Beam> {
    let mut seen = HashSet::new();
    let ends = scan.points.iter().filter(|end| seen.insert(cell_of(end, LATTICE)));
    ends.map(|&end| Beam { origin: Vector2::zeros(), end }).collect()
}

fn cell_of(point: &Vector2<f64>, side: f64) -> (i32, i32) {
    ((point.x / side).floor() as i32, (point.y / side).floor() as i32)
}

/// So many of the beams at most, evenly chosen.
pub(super) fn evenly(beams: &[Beam], most: usize) -> Vec<Beam> {
    let count = beams.len().min(most);
    (0..count).map(|index| beams[index * beams.len() / count]).collect()
}

impl Window {
    /// Adds the next scan, after this motion from the one before. How many new pieces of walls it shows, where it is a keyframe.
    pub(super) fn add(&mut self, frame: usize, beams: Vec<Beam>, motion: &MeasuredMotion) -> Option<usize> {
        let (before, way) = self.scans.last().map_or((Pose2::identity(), 0.0), |scan| (scan.pose, scan.way));
        let (pose, way) = if self.scans.is_empty() {
            (before, way)
        } else {
            ((before * motion.T_before_sensor).renormalized(), way + motion.T_before_sensor.translation_norm())
        };
        let off = self.last_keyframe.inverse() * pose;
        let is_keyframe =
            self.scans.is_empty() || off.translation_norm() > KEYFRAME.0 || off.rotation_angle() > KEYFRAME.1;
        let pieces: HashSet<_> = beams.iter().map(|beam| cell_of(&pose.act(&beam.end), PIECE)).collect();
        let num_known = self.pieces.len();
        let num_shared = pieces.iter().filter(|&piece| self.pieces.contains(piece)).count();
        let shared = num_shared as f64 / pieces.len().max(1) as f64;
        if is_keyframe {
            self.last_keyframe = pose;
            self.pieces.extend(pieces);
        }
        let num_new = is_keyframe.then(|| self.pieces.len() - num_known);
        self.scans.push(WindowScan { frame, pose, beams, motion: *motion, shared, num_new, way });
        num_new
    }

    /// Takes out the scans from which the way to the last one is longer than that of the longest stretch.
    pub(super) fn shorten(&mut self) -> std::vec::Drain<'_, WindowScan> {
        let first = self.first_within(LONGEST_STRETCH);
        let num_too_far = self.scans.partition_point(|scan| scan.frame < first);
        self.scans.drain(..num_too_far)
    }

    /// Part of what the last scan shows that scans before it have shown.
    pub(super) fn shared(&self) -> f64 {
        self.scans.last().map_or(0.0, |last| last.shared)
    }

    /// The first scan within this way from the last one (m).
    pub(super) fn first_within(&self, way: f64) -> usize {
        let whole = self.scans.last().map_or(0.0, |last| last.way);
        self.scans.iter().find(|scan| scan.way >= whole - way).map_or(0, |scan| scan.frame)
    }

    /// Keeps the scans from this one on.
    pub(super) fn cut_before(&mut self, frame: usize) {
        self.scans.retain(|scan| scan.frame >= frame);
        if self.scans.is_empty() {
            self.pieces.clear();
        }
    }

    /// The beams of all keyframes.
    pub(super) fn joined(&self) -> JoinedBeams {
        let keyframes: Vec<usize> = (0..self.scans.len()).filter(|&scan| self.scans[scan].num_new.is_some()).collect();
        let Some(&middle) = keyframes.get(keyframes.len() / 2) else { return JoinedBeams::default() };
        let T_middle_first = self.scans[middle].pose.inverse();
        let mut beams = Vec::new();
        for scan in keyframes.iter().map(|&scan| &self.scans[scan]) {
            let T_middle_scan = T_middle_first * scan.pose;
            beams.extend(scan.beams.iter().map(|beam| beam.moved(&T_middle_scan)));
        }
        let pieces: HashSet<_> = beams.iter().map(|beam: &Beam| cell_of(&beam.end, PIECE)).collect();
        JoinedBeams { beams, middle, num_pieces: pieces.len() }
    }
}
