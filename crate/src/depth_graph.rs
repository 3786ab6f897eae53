//! All depth frames at once: each is matched with the frames before it and with those that looked at the same place
//! earlier, and all poses are solved for jointly.
//!
//! The chain registers a frame to the map as it was then, and never moves what is in the map; here errors are spread over
//! all frames, and where a path comes back to a place its end meets its beginning.

use crate::camera::surfel_image::{SurfelImage, cell_camera};
use crate::depth_odometry::SurfelCloud;
use crate::geometry::Pose3;
use crate::geometry::rotation::angle_of;
use crate::pose_graph::{Edge, Node, PoseGraph};
use crate::registration::factors::PointToSurfel;
use crate::registration::icp::{Criteria, IcpOptions, IterationRecord, Rejection, Weighting};
use crate::registration::projective::ProjectiveTarget;
use crate::registration::robust_kernel::RobustKernel;

/// A frame as it is matched with others.
#[derive(Clone)]
pub struct GraphFrame {
    source: SurfelCloud,
    target: ProjectiveTarget,
}

/// Points of a frame that look for partners in another.
const SOURCE_POINTS: usize = 700;
/// Points that look for partners in one piece of work: some milliseconds.
const POINTS_A_STEP: usize = 50_000;
/// Each frame is matched with so many frames before it ...
const WINDOW: usize = 6;
/// ... and with so many of the nearest among those before these.
const REVISITED: usize = 6;
/// Frames further apart (m) ...
const MAX_DISTANCE: f64 = 3.0;
/// ... or turned by more (rad) are not matched: they hardly see the same.
const MAX_ANGLE: f64 = 1.0;
/// A turn by a radian takes as much out of view as a move by so many metres.
const METRES_A_RADIAN: f64 = 2.0;

impl GraphFrame {
    /// From the surfaces of a depth image. It is kept for every frame, so of four neighbouring pieces one is enough.
    pub fn new(frame: &SurfelImage) -> Self {
        let camera = cell_camera(&frame.camera, 2 * frame.cell_size);
        Self {
            source: SurfelCloud::new(frame).at_most(SOURCE_POINTS),
            target: ProjectiveTarget::draw((0..).zip(frame.surfels()), &camera, &Pose3::identity()),
        }
    }
}

/// The joint solution, one piece of work after the other.
pub struct DepthGraph {
    graph: PoseGraph<3, 6, Pose3>,
}

impl DepthGraph {
    /// Starts from the poses (`T_world_camera`) of some frames, the first of which stays as it is.
    pub fn new(poses: Vec<Pose3>) -> Self {
        let edges = edges_between(&poses);
        Self { graph: PoseGraph::new(poses, edges) }
    }

    /// Does one piece of work with the frames whose poses are solved for; whether nothing is left to do.
    pub fn advance<'a>(&mut self, frames: impl Iterator<Item = &'a GraphFrame>) -> bool {
        let options = options();
        if !self.graph.is_done(&options) {
            let nodes: Vec<_> =
                frames.map(|frame| Node { source: frame.source.source(), target: &frame.target }).collect();
            self.graph.advance::<PointToSurfel>(&nodes, &options, POINTS_A_STEP);
        }
        self.graph.is_done(&options)
    }

    /// The poses as they are now.
    pub fn poses(&self) -> &[Pose3] {
        self.graph.poses()
    }

    /// One record an iteration.
    pub fn history(&self) -> &[IterationRecord] {
        self.graph.history()
    }

    /// Share of the current iteration that is done, as (edges matched, edges in all).
    pub fn progress(&self) -> (usize, usize) {
        self.graph.progress()
    }
}

fn options() -> IcpOptions {
    IcpOptions {
        rejection: Rejection { max_correspondence_distance: 0.15, max_normal_angle: 0.4, trim_fraction: 0.0 },
        weighting: Weighting { robust_kernel: RobustKernel::GemanMcclure, robust_kernel_width: 0.03 },
        criteria: Criteria { max_iterations: 12, rotation_eps: 5e-5, translation_eps: 1e-4 },
    }
}

/// Each frame with those before it and with those before these that looked at the same place, both ways.
fn edges_between(poses: &[Pose3]) -> Vec<Edge> {
    let apart = |a: &Pose3, b: &Pose3| {
        let between = a.inverse() * b;
        let (distance, angle) = (between.translation.vector.norm(), angle_of(&between.rotation));
        (distance < MAX_DISTANCE && angle < MAX_ANGLE).then_some(distance + METRES_A_RADIAN * angle)
    };
    let mut edges = Vec::new();
    for later in 0..poses.len() {
        let window = later.saturating_sub(WINDOW);
        let mut revisited: Vec<(f64, usize)> =
            (0..window).filter_map(|earlier| Some((apart(&poses[earlier], &poses[later])?, earlier))).collect();
        revisited.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        revisited.truncate(REVISITED);
        let before = (window..later).filter(|&earlier| apart(&poses[earlier], &poses[later]).is_some());
        for earlier in revisited.into_iter().map(|(_, earlier)| earlier).chain(before) {
            edges.push(Edge { source: later, target: earlier });
            edges.push(Edge { source: earlier, target: later });
        }
    }
    edges
}
