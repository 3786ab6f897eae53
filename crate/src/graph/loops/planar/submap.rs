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
    /// Pose of each keyframe in the anchor's frame.
    pub T_anchor_keyframe: Vec<Pose2>,
    /// Returns (m), one a cell of [`FINE`].
    pub points: Vec<Vector2<f64>>,
    /// Their normals.
    pub normals: Vec<Option<Vector2<f64>>>,
    /// Indices of one return a cell of [`COARSE`].
    pub sparse: Vec<usize>,
    /// The cells of [`VICINITY`] with a return, and those around them.
    vicinity: FxHashSet<(i32, i32)>,
}

/// Side of the cells of which one return each is kept in a submap (m) ...
const FINE: f64 = 0.05;
/// ... and one each is looked for in another (m).
const COARSE: f64 = 0.15;
/// Side of the cells by which it is told, roughly, whether two submaps show the same (m).
const VICINITY: f64 = 0.4;
/// So many returns are asked for that.
const ASKED: usize = 80;

impl Submap {
    /// Lays keyframes over each other; `poses` are those of all keyframes.
    pub fn new(range: Range<usize>, keyframes: &[Keyframe], poses: &[Pose2]) -> Self {
        let anchor = usize::midpoint(range.start, range.end - 1);
        let T_anchor_world = poses[anchor].inverse();
        let T_anchor_keyframe: Vec<Pose2> = poses[range.clone()].iter().map(|pose| T_anchor_world * pose).collect();
        let (mut points, mut normals, mut sparse) = (Vec::new(), Vec::new(), Vec::new());
        let (mut fine, mut coarse) = (FxHashSet::default(), FxHashSet::default());
        for (keyframe, T) in keyframes[range.clone()].iter().zip(&T_anchor_keyframe) {
            for (point, normal) in keyframe.scan.points.iter().zip(&keyframe.scan.normals) {
                let point = T.act(point);
                if fine.insert(cell(&point, FINE)) {
                    if coarse.insert(cell(&point, COARSE)) {
                        sparse.push(points.len());
                    }
                    points.push(point);
                    normals.push(normal.map(|normal| T.rotate(&normal)));
                }
            }
        }
        let around = |point: &Vector2<f64>| {
            let (x, y) = cell(point, VICINITY);
            (-1..=1).flat_map(move |dx| (-1..=1).map(move |dy| (x + dx, y + dy)))
        };
        let vicinity = sparse.iter().flat_map(|&index: &usize| around(&points[index])).collect();
        Self { keyframes: range, anchor, T_anchor_keyframe, points, normals, sparse, vicinity }
    }

    /// Share of another submap's returns that lie near returns of this one, 0..=1, if it lies there.
    pub fn overlap(&self, other: &Self, T_self_other: &Pose2) -> f64 {
        let stride = other.sparse.len().div_ceil(ASKED).max(1);
        let asked = other.sparse.iter().step_by(stride).map(|&index| T_self_other.act(&other.points[index]));
        let (near, all) = asked.fold((0.0, 0.0), |(near, all), point| {
            (near + f64::from(self.vicinity.contains(&cell(&point, VICINITY))), all + 1.0)
        });
        near / f64::max(all, 1.0)
    }

    /// The returns that are looked for in another submap, as a scan.
    pub fn source(&self) -> PlanarScan {
        PlanarScan {
            points: self.sparse.iter().map(|&index| self.points[index]).collect(),
            normals: self.sparse.iter().map(|&index| self.normals[index]).collect(),
        }
    }
}

fn cell(point: &Vector2<f64>, side: f64) -> (i32, i32) {
    ((point.x / side).floor() as i32, (point.y / side).floor() as i32)
}
