//! The joint registration of a graph's keyframes, over their points themselves.

use std::rc::Rc;

use super::keyframe_graph::KeyframeGraph;
use crate::geometry::Pose2;
use crate::graph::joint_scan_registration::{JointScanRegistration, Node};
use crate::pipeline::settings::Settings;
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::factors::{PointToPlane, PointToPoint};
use crate::registration::icp::{IcpOptions, Source};
use crate::registration::planar::PlanarMetric;
use crate::registration::target::{OrientedTarget, PointTarget};
use nalgebra::Vector2;

/// Points that look for partners in one piece of work: a few milliseconds.
pub const POINTS_A_STEP: usize = 20_000;

/// The joint solution and the frames that are its nodes.
pub struct Joint {
    frames: Vec<usize>,
    targets: JointTargets,
    pub registration: JointScanRegistration<Pose2>,
}

enum JointTargets {
    Points(Vec<PointTarget<2>>),
    Oriented(Vec<OrientedTarget<2>>),
}

impl Joint {
    /// Of the keyframes of a graph; `poses` are those of all frames.
    pub fn new(graph: &KeyframeGraph, scans: &[Rc<PlanarScan>], poses: &[Pose2], settings: &Settings) -> Self {
        let frames = graph.nodes.clone();
        let keyframes = frames.iter().map(|&frame| &scans[frame]);
        let targets = match settings.metric {
            PlanarMetric::PointToPoint => {
                JointTargets::Points(keyframes.map(|scan| PointTarget::new(scan.points.clone())).collect())
            }
            PlanarMetric::PointToLine => JointTargets::Oriented(
                keyframes.map(|scan| OrientedTarget::new(scan.points.clone(), scan.normals.clone())).collect(),
            ),
        };
        let poses: Vec<Pose2> = frames.iter().map(|&frame| poses[frame]).collect();
        let edges = graph.edges(&poses, settings.matched_scans);
        let known = graph.odometry_factors(&poses);
        Self { frames, targets, registration: JointScanRegistration::new(poses, edges).with_odometry_factors(known) }
    }

    /// Frees what edges are matched with: nothing is left to match.
    pub fn end(&mut self) {
        self.targets = JointTargets::Points(Vec::new());
    }

    /// Matches a few more edges, and takes a step when all are matched.
    pub fn advance(&mut self, scans: &[Rc<PlanarScan>], options: &IcpOptions) {
        let sources = self.frames.iter().map(|&frame| source(&scans[frame]));
        match &self.targets {
            JointTargets::Points(targets) => {
                let nodes: Vec<_> = sources.zip(targets).map(|(source, target)| Node { source, target }).collect();
                self.registration.advance(&PointToPoint, &nodes, options, POINTS_A_STEP);
            }
            JointTargets::Oriented(targets) => {
                let nodes: Vec<_> = sources.zip(targets).map(|(source, target)| Node { source, target }).collect();
                self.registration.advance(&PointToPlane, &nodes, options, POINTS_A_STEP);
            }
        }
    }
}

fn source(scan: &PlanarScan) -> Source<'_, Vector2<f64>> {
    Source { points: &scan.points, normals: Some(&scan.normals), sigmas: None }
}
