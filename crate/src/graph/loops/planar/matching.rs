//! One stretch of the way laid over another: by search, by the registration loop, and judged by what the sensors saw and
//! by whether it fits anywhere else.

use std::ops::Range;

use nalgebra::{Matrix3, Vector2};

use super::submap::{Keyframe, overlaid};
use crate::geometry::{Pose2, RigidMotion};
use crate::map::local::{PlanarRegistration, SURFACE_SPACING};
use crate::odometry::planar::hypothesis::NUM_SEARCHED_POINTS;
use crate::odometry::planar::information::{motion_information, softened_covariance};
use crate::odometry::planar::{MIN_RIVAL_DISTANCE, RIVAL_SHARE};
use crate::registration::correlative::{LikelihoodGrid, SearchWindow};
use crate::registration::factors::PointToPlane;
use crate::registration::free_space::FreeSpaceTally;
use crate::registration::icp::{IcpOptions, Source, register};
use crate::registration::target::OrientedTarget;

/// A pair of submaps to be matched.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// Submap looked in.
    pub target: usize,
    /// Submap looked for.
    pub source: usize,
    /// Where it may be in the target.
    pub guess: Pose2,
    /// How far off that may be.
    pub window: SearchWindow,
}

/// What the search of a window costs, in windows of a metre and a tenth of a radian.
pub fn search_cost(window: SearchWindow) -> f64 {
    1.0 + window.translation.powi(2) * (window.rotation / 0.1)
}

/// Where a stretch was found in another, with the evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct SubmapMatch {
    /// Pose of the source's anchor in the target's.
    pub T_target_source: Pose2,
    /// By a perturbation on the left, rotation first.
    pub covariance: Matrix3<f64>,
    /// Share of the returns seen by both that agree, 0..=1.
    pub agreement: f64,
    /// Share of the source's returns that have a partner, 0..=1.
    pub fitness: f64,
    /// How well another place of the window scores, as a share of this one; 0 where none is a rival.
    pub rival: f64,
}

/// A stretch to be looked in.
pub struct TargetStretch {
    oriented: OrientedTarget<2>,
    grid: LikelihoodGrid,
    /// Keyframes whose free space is tested, each with its pose in the frame of the anchor.
    reference_keyframes: Vec<(usize, Pose2)>,
}

/// A stretch to be looked for.
pub struct SourceStretch {
    points: Vec<Vector2<f64>>,
    normals: Vec<Option<Vector2<f64>>>,
    reference_keyframes: Vec<(usize, Pose2)>,
}

/// The target keeps one return in each cell of this side (m), ...
const TARGET_SPACING: f64 = 0.05;
/// ... and the source one in each of these (m). With 0.1 m for both, Belgioioso is in 2 pieces (1).
const SOURCE_SPACING: f64 = 0.15;
/// Keyframes of a submap whose free space a match is tested against.
const MAX_REFERENCE_KEYFRAMES: usize = 5;
/// What a match is known by at best (rad, m): matches of stretches share what is wrong inside these.
pub const MATCH_SIGMA: (f64, f64) = (0.005, 0.03);
/// Smallest score of a pose, as a share of the source's own likelihood. With 0.7 and 1.4 times as much: `docs/measurements/laser.md`,
/// leave one out.
const MIN_SCORE: f64 = 0.35;

impl TargetStretch {
    /// Of these keyframes, in the frame of one of them.
    pub fn new(range: Range<usize>, anchor: usize, keyframes: &[Keyframe], poses: &[Pose2]) -> Self {
        let (points, normals) =
            overlaid(range.clone(), keyframes, poses, &poses[anchor], TARGET_SPACING, SURFACE_SPACING);
        Self {
            grid: LikelihoodGrid::new(&points),
            oriented: OrientedTarget::new(points, normals),
            reference_keyframes: reference_keyframes(range, anchor, poses),
        }
    }
}

impl SourceStretch {
    /// Of these keyframes, in the frame of one of them.
    pub fn new(range: Range<usize>, anchor: usize, keyframes: &[Keyframe], poses: &[Pose2]) -> Self {
        let (points, normals) = overlaid(range.clone(), keyframes, poses, &poses[anchor], SOURCE_SPACING, 0.0);
        Self { points, normals, reference_keyframes: reference_keyframes(range, anchor, poses) }
    }
}

/// Registers `source` to `target` from a guess that may be off by `window`.
pub fn match_stretches(
    target: &TargetStretch,
    source: &SourceStretch,
    keyframes: &[Keyframe],
    guess: &Pose2,
    window: SearchWindow,
    options: &IcpOptions,
) -> Option<SubmapMatch> {
    let stride = source.points.len().div_ceil(NUM_SEARCHED_POINTS).max(1);
    let searched: Vec<Vector2<f64>> = source.points.iter().step_by(stride).copied().collect();
    let search = target.grid.window(&searched, guess, window);
    let best = search.best_above(MIN_SCORE).filter(|best| best.score > MIN_SCORE)?;
    let (start, score) = (best.T_target_source, RIVAL_SHARE * best.score);
    let rival = search.rival(&[start], MIN_RIVAL_DISTANCE, score, score).map_or(0.0, |other| other.score / best.score);
    let found: PlanarRegistration = register(
        Source { points: &source.points, normals: Some(&source.normals), sigmas: None },
        &target.oriented,
        start,
        &PointToPlane,
        options,
    );
    let T_target_source = found.T_target_source;
    let seen = free_space_of(target, source, keyframes, &T_target_source);
    let worst = (window.rotation.max(0.05), window.translation.max(0.3));
    Some(SubmapMatch {
        T_target_source,
        covariance: softened_covariance(&motion_information(&found, &Pose2::identity()), MATCH_SIGMA, worst),
        agreement: seen.agreement(),
        fitness: found.fitness,
        rival,
    })
}

/// How some keyframes of each stretch look from those of the other.
fn free_space_of(
    target: &TargetStretch,
    source: &SourceStretch,
    keyframes: &[Keyframe],
    T_target_source: &Pose2,
) -> FreeSpaceTally {
    let mut tally = FreeSpaceTally::default();
    for (t, T_target_t) in &target.reference_keyframes {
        for (s, T_source_s) in &source.reference_keyframes {
            let T_t_s = T_target_t.inverse() * T_target_source * T_source_s;
            tally += free_space_between(&keyframes[*t], &keyframes[*s], &T_t_s);
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

/// A few keyframes spread over a stretch, each with its pose in the frame of the anchor.
fn reference_keyframes(range: Range<usize>, anchor: usize, poses: &[Pose2]) -> Vec<(usize, Pose2)> {
    let stride = range.len().div_ceil(MAX_REFERENCE_KEYFRAMES).max(1);
    let offset = (range.len() - 1) % stride / 2;
    let T_anchor_world = poses[anchor].inverse();
    range.skip(offset).step_by(stride).map(|index| (index, T_anchor_world * poses[index])).collect()
}
