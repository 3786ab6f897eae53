//! A few scans in a row, laid over each other: more to recognise a place by than a single scan.

use std::ops::Range;
use std::rc::Rc;

use nalgebra::Vector2;
use rustc_hash::FxHashSet;

use crate::geometry::{Pose2, RigidMotion};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::free_space::beams::RangeProfile;

/// A keyframe: a scan that is a node of the graph.
pub struct Keyframe {
    /// Its returns.
    pub scan: Rc<PlanarScan>,
    /// Its ranges by bearing.
    pub profile: RangeProfile,
}

impl Keyframe {
    /// From a scan.
    pub fn new(scan: Rc<PlanarScan>) -> Self {
        Self { profile: RangeProfile::new(&scan.points), scan }
    }
}

/// Keyframes in a row, in the frame of the one in their middle.
pub struct Submap {
    /// Its keyframes.
    pub keyframes: Range<usize>,
    /// The keyframe whose frame it is in.
    pub anchor: usize,
    /// Distance from the anchor within which four fifths of its returns lie, at most `MAX_COMPARED_RANGE` (m).
    pub radius: f64,
}

/// Returns further from their sensor are left out where places are compared (m): a small error of heading moves them far,
/// and they are few. After a longer way a place is seen from elsewhere in between.
pub const MAX_COMPARED_RANGE: f64 = 15.0;
/// Submaps that seem to share less than this of what they show are not matched. With a quarter, as a match needs at least, others are
/// searched first, and 307 of 339 pairs of Belgioioso with `wheels_stop` are wrong (9).
const MIN_SHARED: f64 = 0.3;
/// Share of a submap's returns that lie within its radius.
const RADIUS_SHARE: f64 = 0.8;
/// Side of the cells that keep one return for the radius (m). With 0.15 m the corridor is in 22 pieces (19).
const RADIUS_CELL: f64 = 0.3;

impl Submap {
    /// Of these keyframes; `poses` are those of all.
    pub fn new(range: Range<usize>, keyframes: &[Keyframe], poses: &[Pose2]) -> Self {
        let anchor = usize::midpoint(range.start, range.end - 1);
        let points = overlaid(range.clone(), keyframes, poses, &poses[anchor], RADIUS_CELL, 0.0).0;
        let mut distances: Vec<f64> = points.iter().map(Vector2::norm).collect();
        distances.sort_by(f64::total_cmp);
        let radius = distances.get((RADIUS_SHARE * distances.len() as f64) as usize).copied().unwrap_or(0.0);
        Self { keyframes: range, anchor, radius: radius.min(MAX_COMPARED_RANGE) }
    }

    /// Distance (m) within which both may show one place.
    pub fn reach(&self, other: &Self) -> f64 {
        (self.radius + other.radius) * (1.0 - MIN_SHARED)
    }
}

/// The returns of keyframes with their normals, in the frame of one pose; one a cell of this side (m), with the surfaces
/// between the beams filled at this spacing (m) unless it is zero.
pub fn overlaid(
    range: Range<usize>,
    keyframes: &[Keyframe],
    poses: &[Pose2],
    T_world_anchor: &Pose2,
    cell: f64,
    filled: f64,
) -> (Vec<Vector2<f64>>, Vec<Option<Vector2<f64>>>) {
    let T_anchor_world = T_world_anchor.inverse();
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    let mut taken = FxHashSet::default();
    for index in range {
        let T = T_anchor_world * poses[index];
        let scan = &keyframes[index].scan;
        let surface = if filled > 0.0 {
            scan.surface(filled)
        } else {
            scan.points.iter().copied().zip(scan.normals.iter().copied()).collect()
        };
        for (point, normal) in surface {
            if point.norm() > MAX_COMPARED_RANGE {
                continue;
            }
            let point = T.act(&point);
            if taken.insert(((point.x / cell).floor() as i32, (point.y / cell).floor() as i32)) {
                points.push(point);
                normals.push(normal.map(|normal| T.rotate(&normal)));
            }
        }
    }
    (points, normals)
}
