//! One submap laid over another: by search, by the registration loop, and judged by what the sensors saw.

use nalgebra::Matrix3;

use super::submap::{Keyframe, Submap};
use crate::geometry::{Pose2, RigidMotion};
use crate::registration::correlative::{LikelihoodGrid, SearchWindow};
use crate::registration::factors::PointToPlane;
use crate::registration::free_space::FreeSpaceTally;
use crate::registration::icp::{IcpOptions, Source, register};
use crate::registration::target::OrientedTarget;

/// Where a submap was found in another, with the evidence.
#[derive(Debug, Clone)]
pub struct SubmapMatch {
    /// Pose of the source's anchor in the target's.
    pub T_target_source: Pose2,
    /// By a perturbation on the left, rotation first.
    pub information: Matrix3<f64>,
    /// Share of the returns seen by both that agree, 0..=1.
    pub agreement: f64,
    /// Share of the source's returns that have a partner, 0..=1.
    pub fitness: f64,
}

/// Windows this small need no search: the registration finds home from there (m, rad).
const NO_SEARCH: SearchWindow = SearchWindow { translation: 0.3, rotation: 0.06 };
/// Every so many keyframes of a submap are asked what they saw.
const WITNESSES: usize = 4;

/// Registers `source` to `target` from a guess that may be off by `window`.
pub fn match_submaps(
    target: &Submap,
    source: &Submap,
    keyframes: &[Keyframe],
    guess: &Pose2,
    window: SearchWindow,
    options: &IcpOptions,
) -> Option<SubmapMatch> {
    let points = source.source();
    let mut start = *guess;
    if window.translation > NO_SEARCH.translation || window.rotation > NO_SEARCH.rotation {
        start = LikelihoodGrid::new(&target.points).search(&points.points, guess, window)?.T_target_source;
    }
    let oriented = OrientedTarget::new(target.points.clone(), target.normals.clone());
    let loop_source = Source { points: &points.points, normals: Some(&points.normals), sigmas: None };
    let registration = register(loop_source, &oriented, start, &PointToPlane, options);
    let T_target_source = registration.T_target_source;
    let tally = free_space_of(target, source, keyframes, &T_target_source);
    Some(SubmapMatch {
        T_target_source,
        information: registration.information,
        agreement: tally.agreement(),
        fitness: registration.fitness,
    })
}

/// How some keyframes of each submap look from those of the other.
fn free_space_of(target: &Submap, source: &Submap, keyframes: &[Keyframe], T_target_source: &Pose2) -> FreeSpaceTally {
    let mut tally = FreeSpaceTally::default();
    for (t, T_target_t) in witnesses(target) {
        for (s, T_source_s) in witnesses(source) {
            let T_t_s = T_target_t.inverse() * T_target_source * T_source_s;
            tally += free_space_between(&keyframes[t], &keyframes[s], &T_t_s);
        }
    }
    tally
}

/// How the returns of each of two keyframes look from the other, the second at this pose in the frame of the first.
pub fn free_space_between(first: &Keyframe, second: &Keyframe, T_first_second: &Pose2) -> FreeSpaceTally {
    let T_second_first = T_first_second.inverse();
    let mut tally = first.profile.tally(second.scan.points.iter().map(|p| T_first_second.act(p)));
    tally += second.profile.tally(first.scan.points.iter().map(|p| T_second_first.act(p)));
    tally
}

/// A few keyframes spread over a submap.
fn witnesses(submap: &Submap) -> impl Iterator<Item = (usize, &Pose2)> {
    let stride = submap.keyframes.len().div_ceil(WITNESSES).max(1);
    let offset = (submap.keyframes.len() - 1) % stride / 2;
    submap.keyframes.clone().zip(&submap.T_anchor_keyframe).skip(offset).step_by(stride)
}
