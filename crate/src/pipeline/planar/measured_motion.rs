//! Measured motion, held against what the scans say: how well it is known.

use std::rc::Rc;

use crate::geometry::{Pose2, RigidMotion};
use crate::map::local::LocalMap;
use crate::odometry::assessment::{Status, judge};
use crate::odometry::planar::motion_noise::{Comparison, MotionNoise};
use crate::odometry::planar::{MeasuredMotion, PlanarOptions};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::correlative::LikelihoodGrid;

/// So many stretches of the way are compared.
const COMPARED: usize = 48;
/// A stretch is as many steps as it takes to go this far (m) ...
const STRETCH: f64 = 0.5;
/// ... or to turn this much (rad).
const STRETCH_TURN: f64 = 0.25;
/// Motions near the border of the search are not compared: this share of its half width is left.
const INSIDE: f64 = 0.8;

/// The motions with the covariances that the log's own noise gives them.
pub fn judged(
    motions: &[Option<Pose2>],
    scan: &dyn Fn(usize) -> Rc<PlanarScan>,
    options: &PlanarOptions,
) -> Vec<Option<MeasuredMotion>> {
    if motions.iter().all(Option::is_none) {
        return vec![None; motions.len()];
    }
    let noise = MotionNoise::fitted(&comparisons(motions, scan, options));
    let measured = |motion: &Pose2| MeasuredMotion { T_before_sensor: *motion, covariance: noise.covariance(motion) };
    motions.iter().map(|motion| motion.as_ref().map(measured)).collect()
}

/// Stretches spread over the way, each with what a registration from scans alone makes of it, where that is sure.
fn comparisons(
    motions: &[Option<Pose2>],
    scan: &dyn Fn(usize) -> Rc<PlanarScan>,
    options: &PlanarOptions,
) -> Vec<Comparison> {
    let stretches = stretches(motions);
    let stride = stretches.len().div_ceil(COMPARED).max(1);
    let mut comparisons = Vec::new();
    for (from, steps) in stretches.into_iter().step_by(stride) {
        let mut map = LocalMap::new(1, options.metric);
        let target = scan(from);
        map.insert(Rc::clone(&target), Pose2::identity());
        let source = scan(from + steps.len());
        let grid = LikelihoodGrid::new(&target.points);
        let Some(found) = grid.search(&source.points, &Pose2::identity(), options.search) else { continue };
        let registration = map.register(&source, found.T_target_source, &options.icp);
        let verdict = judge(&registration, map.visibility(&source, &registration.T_target_source));
        if verdict.status == Status::Good {
            comparisons.push(Comparison { steps, registered: registration.T_target_source });
        }
    }
    comparisons.retain(|comparison| {
        let measured: Pose2 = comparison.steps.iter().fold(Pose2::identity(), |sum, step| sum * step);
        measured.translation_norm() < INSIDE * options.search.translation
            && measured.rotation_angle() < INSIDE * options.search.rotation
    });
    comparisons
}

/// Runs of steps without a gap that go some way: the frame each begins at, and its steps.
fn stretches(motions: &[Option<Pose2>]) -> Vec<(usize, Vec<Pose2>)> {
    let mut stretches = Vec::new();
    let (mut from, mut steps): (usize, Vec<Pose2>) = (0, Vec::new());
    let (mut way, mut turn) = (0.0, 0.0);
    for (frame, motion) in motions.iter().enumerate() {
        if let Some(motion) = motion {
            steps.push(*motion);
            way += motion.translation_norm();
            turn += motion.rotation_angle();
        }
        if motion.is_none() || way > STRETCH || turn > STRETCH_TURN {
            if motion.is_some() {
                stretches.push((from, std::mem::take(&mut steps)));
            }
            steps.clear();
            (from, way, turn) = (frame, 0.0, 0.0);
        }
    }
    stretches
}
