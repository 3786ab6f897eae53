//! Loop closure in space: revisited places are detected, and the poses of all frames corrected.
//!
//! In: the frames of a chain with their estimates. Out: a correction of each frame's pose where a loop closes.
//!
//! Registration to one map hides drift: where the path comes back, the frame is drawn to the old surfaces within a few steps,
//! and the map stays bent behind it. In a revisited place a frame is therefore registered twice, to a submap of the recent
//! frames and to one of the earlier visit. The difference of the two poses is the drift around the loop;
//! `pose_graph` distributes it over all frames by the covariances of the registrations.
//! Read [`SpatialLoops::add`] first.

mod nodes;
mod stored_surfaces;
mod submap;

use nalgebra::Matrix6;
use serde::Serialize;

use self::nodes::{MAX_SUBMAP_FRAMES, Node, Nodes};
use self::stored_surfaces::StoredSurfaces;
use self::submap::{FrameSurfaces, SubmapRegistration};
use crate::geometry::pose_distance::pose_distance;
use crate::geometry::quantile::THREE_SIGMA;
use crate::geometry::{Pose3, RigidMotion};
use crate::graph::pose_graph::{BetweenFactor, SpatialFactor, optimize_poses};
use crate::odometry::depth::{
    FINE_TOLERANCE, MIN_AGREEMENT_DIFFERENCE, MIN_DISTANCE, SpatialEstimate, covariance_of_error, of_pose_distance,
};
use crate::odometry::planar::information::seen_from;
use crate::registration::prepared_surfels::PreparedSurfels;
use crate::registration::solver::Motion;

/// The loops that have been closed.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct LoopReport {
    /// Number of loop closures.
    pub num_closed: usize,
    /// Largest translation of a frame by a loop closure (m).
    pub farthest_move: f64,
}

impl LoopReport {
    /// A note on the loop closures, if there are any.
    pub fn note(&self) -> Option<String> {
        let loops =
            if self.num_closed == 1 { "1 loop was".to_owned() } else { format!("{} loops were", self.num_closed) };
        let centimetres = 100.0 * self.farthest_move;
        (self.num_closed > 0).then(|| {
            format!(
                "{loops} closed: the drift was distributed over the path; frames moved by up to {centimetres:.1} cm"
            )
        })
    }
}

/// Loop detection and closure along a chain of frames.
#[derive(Default)]
pub struct SpatialLoops {
    /// Degrees of freedom of the sensor.
    motion: Motion,
    nodes: Nodes,
    /// The factor of each node to the next one.
    chain: Vec<SpatialFactor>,
    /// The factors of loops.
    loops: Vec<SpatialFactor>,
    /// Node of the last detection.
    last_detection: usize,
    /// The gap found by the last registration to an earlier visit of the place that is being revisited (a motion of the world).
    /// A later detection must confirm it.
    unconfirmed_gap: Option<Pose3>,
    /// Whether a gap has been confirmed since the last closure.
    has_open_loop: bool,
    report: LoopReport,
}

/// Corrections of all frames: the number of the first frame, and the motion (of the world) from there on.
pub type FrameMotions = Vec<(u32, Pose3)>;

impl SpatialLoops {
    /// Without frames, of a sensor with these degrees of freedom.
    pub fn new(motion: Motion) -> Self {
        Self { motion, ..Self::default() }
    }

    /// Forgets all frames and loops.
    pub(crate) fn clear(&mut self) {
        *self = Self::new(self.motion);
    }

    /// The loops that have been closed.
    pub fn report(&self) -> LoopReport {
        self.report
    }

    /// Adds a frame with its estimate; frames that are not part of the map are ignored.
    #[inline(never)]
    pub fn add(&mut self, number: u32, frame: &PreparedSurfels, estimate: &SpatialEstimate) {
        if !estimate.is_in_map {
            return;
        }
        let (surfaces, T_world_camera) = (FrameSurfaces::new(frame), estimate.T_world_sensor);
        let Some(last) = self.nodes.all.last() else {
            return self.nodes.push(number, T_world_camera, T_world_camera, surfaces);
        };
        let (T_last, T_last_local, is_next) = (last.T_world_camera, last.T_world_local, last.frame + 1 == number);
        let here = self.nodes.len();
        let is_revisit = self.nodes.revisited(here, &T_world_camera, last.path_length).is_some();
        // In a revisited place the motion by the map is partly the pull towards the old surfaces.
        let motion = T_last.inverse() * T_world_camera;
        let local = (is_next && is_revisit).then(|| self.register_to_recent(&surfaces, &motion)).flatten();
        let measured = estimate.registration.as_ref().filter(|_| is_next);
        let factor = if let Some(found) = local {
            between_factor(here - 1, here, found.T_submap_camera, &found.information)
        } else {
            let information =
                measured.map(|registration| seen_from(&registration.information, &T_last)).unwrap_or_default();
            between_factor(here - 1, here, motion, &information)
        };
        let T_world_local = if is_revisit { T_last_local * factor.T_from_to } else { T_world_camera };
        self.unconfirmed_gap = self.unconfirmed_gap.filter(|_| is_revisit);
        self.chain.push(factor);
        self.nodes.push(number, T_world_camera, T_world_local, surfaces);
        let nodes = &self.nodes.all;
        if nodes[here].path_length - nodes[self.last_detection].path_length > MIN_DISTANCE {
            self.detect(here);
        }
    }

    /// Takes over the poses that the odometry has changed.
    pub(crate) fn apply_pose_updates(&mut self, pose_of: impl Fn(u32) -> Pose3) {
        let nodes = &mut self.nodes.all;
        for index in 0..nodes.len() {
            let T_world_camera = pose_of(nodes[index].frame);
            if pose_distance(&nodes[index].T_world_camera, &T_world_camera) < f64::EPSILON.sqrt() {
                continue;
            }
            nodes[index].T_world_camera = T_world_camera;
            nodes[index].T_world_local = T_world_camera;
            for next in [index, index + 1] {
                if let Some(factor) = next.checked_sub(1).and_then(|before| self.chain.get_mut(before)) {
                    let (from, to) = (&nodes[factor.from], &nodes[factor.to]);
                    factor.T_from_to = from.T_world_camera.inverse() * to.T_world_camera;
                }
            }
        }
    }

    /// The registration of a frame to the recent nodes, in the frame of the last one.
    fn register_to_recent(&self, frame: &FrameSurfaces, guess: &Pose3) -> Option<SubmapRegistration> {
        let last = self.nodes.len() - 1;
        let local = |node: usize| self.nodes.all[node].T_world_local;
        self.nodes.submap(self.nodes.recent(), last, local).register_finely(frame, *guess)
    }

    /// Registers a node to the submap of an earlier visit.
    fn detect(&mut self, node: usize) {
        let Node { T_world_camera, path_length, .. } = self.nodes.all[node];
        let Some(surfaces) = self.nodes.all[node].surfaces.as_ref().map(StoredSurfaces::surfaces) else {
            return;
        };
        let Some(visit) = self.nodes.revisited(node, &T_world_camera, path_length) else { return };
        self.last_detection = node;
        let T_visit_world = self.nodes.all[visit].T_world_camera.inverse();
        let global = |node: usize| self.nodes.all[node].T_world_camera;
        let submap = self.nodes.submap(self.nodes.around(visit), visit, global);
        let guess = T_visit_world * T_world_camera;
        let Some(found) = submap.register_coarse_to_fine(&surfaces, &guess) else { return };
        self.compare_with_recent(node, &(T_visit_world.inverse() * found.T_submap_camera));
        let found = between_factor(visit, node, found.T_submap_camera, &found.information);
        self.loops.push(BetweenFactor { is_switchable: true, ..found });
    }

    /// Compares a node's pose by an earlier visit with its pose by the recent frames. Two equal gaps in a row open a loop.
    fn compare_with_recent(&mut self, node: usize, T_world_found: &Pose3) {
        let T_world_local = self.nodes.all[node].T_world_local;
        if has_gap(T_world_found, &T_world_local) {
            let is_confirmed = self.unconfirmed_gap.is_some_and(|gap| !has_gap(T_world_found, &(gap * T_world_local)));
            self.has_open_loop |= is_confirmed;
            self.unconfirmed_gap = Some(T_world_found * T_world_local.inverse());
        } else {
            self.unconfirmed_gap = None;
            // The next frame is registered to all recent nodes: their local poses continue from their poses in the map.
            for recent in self.nodes.recent() {
                self.nodes.all[recent].T_world_local = self.nodes.all[recent].T_world_camera;
            }
        }
    }

    /// No frame will follow: an unconfirmed gap counts, too.
    pub fn finish(&mut self) {
        self.has_open_loop |= self.unconfirmed_gap.take().is_some();
    }

    /// Closes an open loop: the corrections of all frames, if the evidence is better with them.
    pub fn close(&mut self) -> Option<FrameMotions> {
        if !std::mem::take(&mut self.has_open_loop) {
            return None;
        }
        let present: Vec<Pose3> = self.nodes.all.iter().map(|node| node.T_world_camera).collect();
        let poses = self.solve(present.clone());
        let (before, after) = (self.evidence(&present), self.evidence(&poses));
        if after - before < MIN_AGREEMENT_DIFFERENCE {
            return None;
        }
        let mut motions = Vec::with_capacity(self.nodes.len());
        for (node, pose) in self.nodes.all.iter_mut().zip(poses) {
            let moved = (node.T_world_camera.inverse() * pose).translation_norm();
            self.report.farthest_move = self.report.farthest_move.max(moved);
            motions.push((node.frame, pose * node.T_world_camera.inverse()));
            (node.T_world_camera, node.T_world_local) = (pose, pose);
        }
        self.report.num_closed += 1;
        Some(motions)
    }

    /// The solution of the pose graph.
    fn solve(&self, mut poses: Vec<Pose3>) -> Vec<Pose3> {
        let fixed = self.loops.iter().map(|found| BetweenFactor { is_switchable: false, ..*found });
        let factors: Vec<SpatialFactor> = self.chain.iter().copied().chain(fixed).collect();
        optimize_poses(&mut poses, &factors);
        let factors: Vec<SpatialFactor> = self.chain.iter().chain(&self.loops).copied().collect();
        optimize_poses(&mut poses, &factors);
        if let (Motion::Planar, Some(&first)) = (self.motion, poses.first()) {
            for pose in &mut poses {
                *pose = first * self.motion.nearest(&(first.inverse() * *pose));
            }
        }
        poses
    }

    /// Sum of the mean agreement and the mean overlap of the latest loops' frames, with the submaps that they revisit and with the recent frames,
    /// if all nodes had these poses.
    fn evidence(&self, poses: &[Pose3]) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for found in self.loops.iter().rev().take(2 * MAX_SUBMAP_FRAMES) {
            let (visit, node) = (found.from, found.to);
            let Some(stored) = &self.nodes.all[node].surfaces else { continue };
            let surfaces = stored.surfaces();
            let recent = (node.saturating_sub(MAX_SUBMAP_FRAMES)..node).collect();
            for (nodes, origin) in [(self.nodes.around(visit), visit), (recent, node - 1)] {
                let submap = self.nodes.submap(nodes, origin, |node| poses[node]);
                let fit = submap.fit(&surfaces, &(poses[origin].inverse() * poses[node]));
                (sum, count) = (sum + fit.0 + fit.1, count + 1.0);
            }
        }
        sum / f64::max(count, 1.0)
    }
}

/// Whether two poses of a frame differ by more than the error of registrations.
fn has_gap(a: &Pose3, b: &Pose3) -> bool {
    pose_distance(a, b) > FINE_TOLERANCE
}

/// A factor of a registration with this information. Its error is no less than that of all registrations: three standard deviations
/// are a gap.
pub(super) fn between_factor(from: usize, to: usize, T_from_to: Pose3, information: &Matrix6<f64>) -> SpatialFactor {
    let (covariance, smallest) = (covariance_of_error(information), FINE_TOLERANCE / THREE_SIGMA);
    let information = (covariance + of_pose_distance(smallest, 2)).try_inverse().unwrap_or_else(Matrix6::zeros);
    BetweenFactor { from, to, T_from_to, information, is_switchable: false }
}
