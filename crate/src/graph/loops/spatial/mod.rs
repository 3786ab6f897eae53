//! Loops in space: places that come into view again, and the poses of all frames once they are known.
//!
//! A chain that registers each frame to one map hides what it has added up in errors: where its path comes back, the frame
//! is drawn to the old surfaces within a few steps, and the map stays bent behind it. So in places seen before a frame is
//! registered twice, to what the last frames saw and to what was seen there earlier. Where the two do not meet, that is
//! what the way round has added up: it is spread over the way by a graph of all relations (see
//! [`relation_graph`](crate::graph::pose_graph)), as surely as each is known.

mod stored_surfaces;
mod submap;

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Matrix6, Vector6};
use serde::Serialize;

use self::stored_surfaces::StoredSurfaces;
use self::submap::{FrameSurfaces, Search, Submap, SubmapRegistration};
use crate::geometry::{Pose3, RigidMotion};
use crate::graph::pose_graph::{PoseRelation, SpatialRelation, solve_relations};
use crate::map::keyframes::{apart, apart_within};
use crate::odometry::depth::SpatialEstimate;
use crate::registration::prepared_surfels::PreparedSurfels;
use crate::registration::spatial::SpatialRegistration;

/// What a place's frames saw may come into view again after a way so long (m, turns included, two metres a radian).
const MIN_LOOP_PATH_LENGTH: f64 = 8.0;
/// Frames nearer to each other than this (m, turns included) see the same, ...
const MAX_REVISIT_DISTANCE: f64 = 1.2;
/// ... by what the way between them may have added up: this share of it, ...
const DRIFT_RATE: f64 = 0.02;
/// ... but no more than this (m).
const MAX_DRIFT: f64 = 1.5;
/// A place is what was seen on so long a way (m, turns included) before and after, ...
const SUBMAP_HALF_LENGTH: f64 = 2.0;
/// ... by at most so many frames.
const MAX_SUBMAP_FRAMES: usize = 6;
/// Loops are looked for after every so long a way (m, turns included), ...
const DETECTION_SPACING: f64 = 0.5;
/// ... in so many places.
const PLACES: usize = 2;
/// Where the way round ends further from where it should (m) ...
const MIN_GAP_TRANSLATION: f64 = 0.03;
/// ... or turned by more (rad), the loop is closed.
const MIN_GAP_ROTATION: f64 = 0.012;
/// How well a registration to the map is known at best (rad, m), ...
const CHAIN_SIGMA: (f64, f64) = (1.5e-3, 4e-3);
/// ... one to a few frames, ...
const SUBMAP_SIGMA: (f64, f64) = (2e-3, 6e-3);
/// ... and what nothing measures (rad, m).
const UNKNOWN: (f64, f64) = (0.3, 0.5);
/// Steps of the solution, first with all loops and then with those that fit.
const SOLVER_ITERATIONS: usize = 15;
/// So many of the last checks decide whether a solution is kept ...
const MAX_VALIDATION_LOOPS: usize = 12;
/// ... for which agreement and overlap must be better by so much together (shares, 0..=1), ...
const MIN_IMPROVEMENT: f64 = 0.01;
/// ... and neither may be worse by more than this.
const MAX_DETERIORATION: f64 = 0.004;
/// Surfaces that are kept take at most this much memory (bytes): of more, frames near to others on the way give up theirs, ...
const MAX_BYTES: usize = 64 << 20;
/// ... until this much is left.
const TARGET_BYTES: usize = 48 << 20;
/// How long a way (m, turns included) lies at least between the frames that are left then, at first, ...
const INITIAL_SPACING: f64 = 0.1;
/// ... times this whenever that is still too much, ...
const SPACING_GROWTH: f64 = 1.5;
/// ... and at most.
const MAX_SPACING: f64 = 1e3;

/// A frame of the graph.
struct Node {
    /// Its number among all frames.
    frame: u32,
    T_world_camera: Pose3,
    /// Where the last frames alone put it, on a way through places seen before.
    T_world_local: Pose3,
    /// Length of the way to it (m, turns included).
    path: f64,
    surfaces: Option<StoredSurfaces>,
}

/// What the search has come to.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct LoopReport {
    /// How often a way round was closed.
    pub num_closed: usize,
    /// How far a pose was moved by it at the most (m).
    pub farthest_move: f64,
}

impl LoopReport {
    /// The same in plain words, where there is something to tell.
    pub fn note(&self) -> Option<String> {
        let times = if self.num_closed == 1 { "once".to_owned() } else { format!("{} times", self.num_closed) };
        let centimetres = 100.0 * self.farthest_move;
        (self.num_closed > 0).then(|| {
            format!(
                "The path came back to places seen before and did not quite meet them: {times} the error was spread over \
                 the way round, which moved frames by up to {centimetres:.1} cm"
            )
        })
    }
}

/// The search for loops along a chain of frames.
#[derive(Default)]
pub struct SpatialLoops {
    nodes: Vec<Node>,
    /// From each node to the next one.
    chain: Vec<SpatialRelation>,
    loops: Vec<SpatialRelation>,
    /// The node at which loops were looked for last.
    last_detection: usize,
    /// What the last look found missing (a motion of the world), on the present way through places seen before.
    pending_gap: Option<Pose3>,
    has_open_loop: bool,
    report: LoopReport,
    /// What the surfaces of older frames take.
    num_packed_bytes: usize,
    /// How long a way lies at least between older frames that still have surfaces.
    spacing: f64,
}

/// How frames are to be moved: the number of the first of them, and the motion (of the world) from there on.
pub type FrameMotions = Vec<(u32, Pose3)>;

impl SpatialLoops {
    /// What the search has come to.
    pub fn report(&self) -> LoopReport {
        self.report
    }

    /// Takes in a frame as the chain has found it; one that is no part of the map is none of the graph.
    pub fn add(&mut self, number: u32, frame: &PreparedSurfels, estimate: &SpatialEstimate) {
        if !estimate.is_in_map {
            return;
        }
        let (surfaces, T_world_camera) = (FrameSurfaces::new(frame), estimate.T_world_sensor);
        let Some(last) = self.nodes.last() else {
            return self.push(number, T_world_camera, T_world_camera, surfaces);
        };
        let (T_last, T_last_local, is_next) = (last.T_world_camera, last.T_world_local, last.frame + 1 == number);
        let here = self.nodes.len();
        let is_new = self.revisited(here, &T_world_camera, last.path).is_empty();
        // In a place seen before, the chain's own motion is partly the way back to the old surfaces.
        let guess = T_last.inverse() * T_world_camera;
        let local = (is_next && !is_new).then(|| self.register_to_recent(&surfaces, &guess)).flatten();
        let measured = estimate.registration.as_ref().filter(|_| is_next);
        let relation = if let Some(held) = local {
            relation(here - 1, here, held.T_submap_camera, &held.information, SUBMAP_SIGMA)
        } else {
            let information = measured.map(|registration| in_frame_of(&T_last, registration)).unwrap_or_default();
            relation(here - 1, here, guess, &information, CHAIN_SIGMA)
        };
        let T_world_local = if is_new { T_world_camera } else { T_last_local * relation.T_from_to };
        self.pending_gap = self.pending_gap.filter(|_| !is_new);
        self.chain.push(relation);
        self.push(number, T_world_camera, T_world_local, surfaces);
        if self.nodes[here].path - self.nodes[self.last_detection].path > DETECTION_SPACING {
            self.detect_loops(here);
        }
    }

    fn push(&mut self, frame: u32, T_world_camera: Pose3, T_world_local: Pose3, surfaces: FrameSurfaces) {
        let step = self.nodes.last().map_or(0.0, |last| apart(&last.T_world_camera, &T_world_camera));
        let path = self.nodes.last().map_or(0.0, |last| last.path) + step;
        let surfaces = Some(StoredSurfaces::Whole(Arc::new(surfaces)));
        self.nodes.push(Node { frame, T_world_camera, T_world_local, path, surfaces });
        let older = self.nodes.len().saturating_sub(2 * MAX_SUBMAP_FRAMES);
        if let Some(kept) = older.checked_sub(1).and_then(|oldest| self.nodes[oldest].surfaces.as_mut()) {
            kept.pack();
            self.num_packed_bytes += kept.num_packed_bytes();
        }
        if self.num_packed_bytes > MAX_BYTES {
            self.thin(older);
            while self.num_packed_bytes > TARGET_BYTES && self.spacing < MAX_SPACING {
                self.spacing = f64::max(INITIAL_SPACING, SPACING_GROWTH * self.spacing);
                self.thin(older);
            }
        }
    }

    /// Of the first so many nodes, those that follow another one too soon give up their surfaces.
    fn thin(&mut self, older: usize) {
        let (mut last, mut num_bytes) = (f64::NEG_INFINITY, 0);
        for node in &mut self.nodes[..older] {
            let Some(kept) = &node.surfaces else { continue };
            if node.path - last < self.spacing {
                node.surfaces = None;
            } else {
                last = node.path;
                num_bytes += kept.num_packed_bytes();
            }
        }
        self.num_packed_bytes = num_bytes;
    }

    /// The chain has found out where the frames before the last one really are.
    pub fn apply_pose_updates(&mut self, pose_of: impl Fn(u32) -> Pose3) {
        for index in 0..self.nodes.len() {
            let T_world_camera = pose_of(self.nodes[index].frame);
            if apart(&self.nodes[index].T_world_camera, &T_world_camera) < 1e-6 {
                continue;
            }
            self.nodes[index].T_world_camera = T_world_camera;
            self.nodes[index].T_world_local = T_world_camera;
            for next in [index, index + 1] {
                if let Some(relation) = next.checked_sub(1).and_then(|before| self.chain.get_mut(before)) {
                    let (from, to) = (&self.nodes[relation.from], &self.nodes[relation.to]);
                    relation.T_from_to = from.T_world_camera.inverse() * to.T_world_camera;
                }
            }
        }
    }

    /// Nodes that a camera at this pose may see the same as, the nearest first, after a way of this length.
    fn revisited(&self, before: usize, T_world_camera: &Pose3, path: f64) -> Vec<usize> {
        let near = self.nodes[..before].iter().enumerate().filter_map(|(index, node)| {
            if path - node.path <= MIN_LOOP_PATH_LENGTH || node.surfaces.is_none() {
                return None;
            }
            let drift = (DRIFT_RATE * (path - node.path)).min(MAX_DRIFT);
            Some((apart_within(&node.T_world_camera, T_world_camera, MAX_REVISIT_DISTANCE + drift)?, index))
        });
        let mut near: Vec<(f64, usize)> = near.collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut chosen: Vec<usize> = Vec::new();
        for (_, index) in near {
            let is_new =
                |other: &usize| (self.nodes[*other].path - self.nodes[index].path).abs() > 2.0 * SUBMAP_HALF_LENGTH;
            if chosen.len() < PLACES && chosen.iter().all(is_new) {
                chosen.push(index);
            }
        }
        chosen
    }

    /// The last nodes.
    fn recent(&self) -> Range<usize> {
        let path = self.nodes.last().map_or(0.0, |node| node.path);
        let first = self.nodes.partition_point(|node| node.path < path - SUBMAP_HALF_LENGTH);
        first.max(self.nodes.len().saturating_sub(MAX_SUBMAP_FRAMES))..self.nodes.len()
    }

    /// Nodes about one, those that have surfaces.
    fn about(&self, index: usize) -> Vec<usize> {
        let path = self.nodes[index].path;
        let is_near = |&node: &usize| (self.nodes[node].path - path).abs() <= SUBMAP_HALF_LENGTH;
        let has_surfaces = |node: &usize| self.nodes[*node].surfaces.is_some();
        let before = (0..index).rev().take_while(is_near).filter(has_surfaces).take(MAX_SUBMAP_FRAMES / 2);
        let from = (index..self.nodes.len()).take_while(is_near).filter(has_surfaces).take(MAX_SUBMAP_FRAMES / 2 + 1);
        let mut about: Vec<usize> = before.chain(from).collect();
        about.sort_unstable();
        about
    }

    /// What some nodes saw, in the frame of one of them.
    fn place(
        &self,
        nodes: impl IntoIterator<Item = usize>,
        in_frame_of: usize,
        pose: impl Fn(usize) -> Pose3,
    ) -> Submap<'_> {
        let T_submap_world = pose(in_frame_of).inverse();
        let frames = nodes.into_iter().filter_map(|node| {
            let seen = self.nodes[node].surfaces.as_ref()?.seen();
            Some((seen, T_submap_world * pose(node)))
        });
        Submap::new(frames.collect())
    }

    /// Where the last nodes put a frame, in the frame of the last one.
    fn register_to_recent(&self, frame: &FrameSurfaces, guess: &Pose3) -> Option<SubmapRegistration> {
        let last = self.nodes.len() - 1;
        self.place(self.recent(), last, |node| self.nodes[node].T_world_local).find(frame, guess, Search::Here)
    }

    /// Looks for a node in the places seen long before it.
    fn detect_loops(&mut self, node: usize) {
        let Node { T_world_camera, T_world_local, path, .. } = self.nodes[node];
        let Some(surfaces) = self.nodes[node].surfaces.as_ref().map(StoredSurfaces::surfaces) else {
            return;
        };
        let places = self.revisited(node, &T_world_camera, path);
        if places.is_empty() {
            return;
        }
        self.last_detection = node;
        for place in places {
            let T_submap_world = self.nodes[place].T_world_camera.inverse();
            let drift = (DRIFT_RATE * (path - self.nodes[place].path)).min(MAX_DRIFT);
            let look = |search| {
                let guess = T_submap_world * T_world_camera;
                self.place(self.about(place), place, |node| self.nodes[node].T_world_camera)
                    .find(&surfaces, &guess, search)
            };
            let Some(held) =
                look(Search::Near).or_else(|| (drift > MIN_GAP_TRANSLATION).then(|| look(Search::Wide)).flatten())
            else {
                continue;
            };
            let T_world_found = T_submap_world.inverse() * held.T_submap_camera;
            if is_apart(&T_world_found, &T_world_local) {
                // Twice the same is no mistake.
                let again = self
                    .pending_gap
                    .is_some_and(|pending_gap| !is_apart(&T_world_found, &(pending_gap * T_world_local)));
                self.has_open_loop |= again;
                self.pending_gap = Some(T_world_found * T_world_local.inverse());
            } else {
                self.pending_gap = None;
                // The next frame is registered to all of the last ones: they go on together from where the map has them.
                for recent in self.recent() {
                    self.nodes[recent].T_world_local = self.nodes[recent].T_world_camera;
                }
            }
            let found = relation(place, node, held.T_submap_camera, &held.information, SUBMAP_SIGMA);
            self.loops.push(PoseRelation { is_switchable: true, ..found });
        }
    }

    /// No frame will follow: what was found missing once counts.
    pub fn finish(&mut self) {
        self.has_open_loop |= self.pending_gap.take().is_some();
    }

    /// Closes what is open: how the frames are to be moved, if what was seen agrees that this is better.
    pub fn close(&mut self) -> Option<FrameMotions> {
        if !std::mem::take(&mut self.has_open_loop) {
            return None;
        }
        let mut poses: Vec<Pose3> = self.nodes.iter().map(|node| node.T_world_camera).collect();
        let sure = self.loops.iter().map(|found| PoseRelation { is_switchable: false, ..*found });
        let all: Vec<SpatialRelation> = self.chain.iter().copied().chain(sure).collect();
        solve_relations(&mut poses, &all, SOLVER_ITERATIONS);
        let all: Vec<SpatialRelation> = self.chain.iter().chain(&self.loops).copied().collect();
        solve_relations(&mut poses, &all, SOLVER_ITERATIONS);
        let present: Vec<Pose3> = self.nodes.iter().map(|node| node.T_world_camera).collect();
        let (before, after) = (self.agreement(&present), self.agreement(&poses));
        let (agreement, overlap) = (after.0 - before.0, after.1 - before.1);
        if agreement + overlap < MIN_IMPROVEMENT || agreement < -MAX_DETERIORATION || overlap < -MAX_DETERIORATION {
            return None;
        }
        let mut motions = Vec::with_capacity(self.nodes.len());
        for (node, pose) in self.nodes.iter_mut().zip(poses) {
            let moved = (node.T_world_camera.inverse() * pose).translation_norm();
            self.report.farthest_move = self.report.farthest_move.max(moved);
            motions.push((node.frame, pose * node.T_world_camera.inverse()));
            (node.T_world_camera, node.T_world_local) = (pose, pose);
        }
        self.report.num_closed += 1;
        Some(motions)
    }

    /// How well the frames of the last loops fit the places they have come back to, and the frames before them, were all at
    /// these poses: the agreement, and the share of their surface that lies on what was seen.
    fn agreement(&self, poses: &[Pose3]) -> (f64, f64) {
        let (mut agreement, mut overlap, mut count) = (0.0, 0.0, 0.0);
        for found in self.loops.iter().rev().take(MAX_VALIDATION_LOOPS) {
            let (place, node) = (found.from, found.to);
            let Some(kept) = &self.nodes[node].surfaces else { continue };
            let surfaces = kept.surfaces();
            let recent = (node.saturating_sub(MAX_SUBMAP_FRAMES)..node).collect();
            for (nodes, place) in [(self.about(place), place), (recent, node - 1)] {
                let fit = self
                    .place(nodes, place, |node| poses[node])
                    .fit(&surfaces, &(poses[place].inverse() * poses[node]));
                (overlap, agreement, count) = (overlap + fit.0, agreement + fit.1, count + 1.0);
            }
        }
        (agreement / f64::max(count, 1.0), overlap / f64::max(count, 1.0))
    }
}

/// Whether two poses of a frame are further apart than registrations are wrong.
fn is_apart(a: &Pose3, b: &Pose3) -> bool {
    let off = a.inverse() * b;
    off.translation_norm() > MIN_GAP_TRANSLATION || off.rotation_angle() > MIN_GAP_ROTATION
}

/// The information of a registration to the world's frame, as that of the motion from a pose there.
fn in_frame_of(T_world_from: &Pose3, registration: &SpatialRegistration) -> Matrix6<f64> {
    let adjoint = T_world_from.adjoint();
    adjoint.tr_mul(&(registration.information * adjoint))
}

/// A relation that is known by what was measured, but no better than `best` and no worse than [`UNKNOWN`].
fn relation(from: usize, to: usize, T_from_to: Pose3, information: &Matrix6<f64>, best: (f64, f64)) -> SpatialRelation {
    let diagonal = |(rotation, translation): (f64, f64), power: i32| {
        let of = |sigma: f64| sigma.powi(power);
        let (r, t) = (of(rotation), of(translation));
        Matrix6::from_diagonal(&Vector6::new(r, r, r, t, t, t))
    };
    let covariance = (information + diagonal(UNKNOWN, -2)).try_inverse().unwrap_or_else(|| diagonal(UNKNOWN, 2));
    let information = (covariance + diagonal(best, 2)).try_inverse().unwrap_or_else(|| diagonal(UNKNOWN, -2));
    PoseRelation { from, to, T_from_to, information, is_switchable: false }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::odometry::assessment::Assessment;

    #[test]
    fn what_is_kept_of_a_long_way_is_bounded_and_spread_over_it() {
        let (frame, mut loops) = (stored_surfaces::tests::wall(), SpatialLoops::default());
        let num_frames = 1200;
        for number in 0..num_frames {
            let T_world_sensor = Pose3::translation(0.05 * f64::from(number), 0.0, 0.0);
            let assessment = Assessment::first();
            let estimate =
                SpatialEstimate { T_world_sensor, registration: None, overlap: 1.0, assessment, is_in_map: true };
            loops.add(number, &frame, &estimate);
            assert!(loops.num_packed_bytes <= MAX_BYTES, "{} bytes", loops.num_packed_bytes);
        }
        let counted: usize =
            loops.nodes.iter().flat_map(|node| &node.surfaces).map(StoredSurfaces::num_packed_bytes).sum();
        assert_eq!(counted, loops.num_packed_bytes);
        let paths: Vec<f64> = loops.nodes.iter().filter(|node| node.surfaces.is_some()).map(|node| node.path).collect();
        assert!(paths.len() < 400, "{} frames keep their surfaces", paths.len());
        assert_eq!(paths[0], 0.0);
        let widest = paths.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        assert!(widest < 0.4, "{widest} m without surfaces");
        assert_eq!(loops.about(600).len(), MAX_SUBMAP_FRAMES + 1, "a place has as many frames as ever");
    }
}
