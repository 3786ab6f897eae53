//! Registration without an initial guess, by features that are invariant under rigid motions.

pub mod consistency;
pub mod fpfh;
pub mod matching;
pub mod ransac;
pub mod scale;

use glam::Vec3;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::geometry::Pose3;
use crate::search::{KdTree, Neighborhood};
use crate::{Error, Result};
use consistency::consistent_motion;
use fpfh::fpfh;
use matching::{FeatureIndex, mutual_matches};
use ransac::{RansacOptions, ransac};

/// How the motion is found from matches most of which are wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum GlobalMethod {
    /// From matches with consistent mutual distances.
    #[default]
    Consistency,
    /// By RANSAC, from random samples of three matches.
    Ransac {
        /// Seed of the random samples; the same clouds and seed give the same motion on every platform.
        seed: u64,
    },
}

/// Points (m) with their features, the source or target of a global registration.
pub struct DescribedCloud {
    points: Vec<Vec3>,
    index: FeatureIndex,
}

impl DescribedCloud {
    /// Computes the features of the points of `tree`, which was built from `points` (m).
    ///
    /// # Panics
    /// When there is not one entry of `normals` for each point.
    pub fn new(
        points: &[Vec3],
        normals: &[Option<Vector3<f64>>],
        tree: &KdTree<3>,
        neighborhood: Neighborhood,
    ) -> Self {
        Self { points: points.to_vec(), index: FeatureIndex::new(fpfh(points, normals, tree, neighborhood)) }
    }
}

/// A motion and the matches that agree with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Consensus {
    /// Maps source points into the target's frame.
    pub T_target_source: Pose3,
    /// Number of matches that agree with it.
    pub num_inliers: usize,
    /// Root mean square of their distances (m).
    pub inlier_rmse: f64,
}

impl Consensus {
    /// Counts the pairs (source, target) whose distance under `T` is at most `max_distance` (m).
    fn of(T: &Pose3, pairs: &[(Vector3<f64>, Vector3<f64>)], max_distance: f64) -> Self {
        let (R, t) = (T.rotation.to_rotation_matrix().into_inner(), T.translation.vector);
        let sq_limit = max_distance * max_distance;
        let (mut num_inliers, mut sum) = (0, 0.0);
        for (p, q) in pairs {
            let sq_distance = (R * p + t - q).norm_squared();
            let inside = sq_distance <= sq_limit;
            num_inliers += usize::from(inside);
            sum += if inside { sq_distance } else { 0.0 };
        }
        Self { T_target_source: *T, num_inliers, inlier_rmse: (sum / num_inliers.max(1) as f64).sqrt() }
    }

    fn is_better_than(&self, other: &Self) -> bool {
        self.num_inliers > other.num_inliers
            || (self.num_inliers == other.num_inliers && self.inlier_rmse < other.inlier_rmse)
    }
}

/// A motion found without a guess, with its evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlobalRegistration {
    /// The motion and what agrees with it.
    pub consensus: Consensus,
    /// Number of matches between points of both clouds.
    pub num_matches: usize,
}

/// Most source points for which matches are searched, since matching takes most of the time.
const MAX_MATCHED_POINTS: usize = 5000;
/// Fewest inliers of an accepted motion. Measured on pairs of frames of two rendered floors: at most 23 of hundreds or thousands
/// of matches agree where the frames show different rooms, 90 and more where they overlap by a third.
const MIN_INLIERS: usize = 30;
/// Smallest share of inliers among the matches for which [`MIN_SURE_INLIERS`] inliers suffice.
const SURE_SHARE: f64 = 0.4;
/// Fewest inliers of an accepted motion where their share of the matches is at least [`SURE_SHARE`].
const MIN_SURE_INLIERS: usize = 12;

/// Registers `source` to `target` without a guess. `target_tree` was built from the target's points. A match agrees with a motion
/// that brings its two points to within `max_correspondence_distance` (m).
///
/// # Errors
/// When there are too few matches, or too few of them agree on one motion: the clouds may not overlap.
pub fn register_globally(
    source: &DescribedCloud,
    target: &DescribedCloud,
    target_tree: &KdTree<3>,
    method: GlobalMethod,
    max_correspondence_distance: f64,
) -> Result<GlobalRegistration> {
    let max_points = match method {
        GlobalMethod::Consistency => MAX_MATCHED_POINTS,
        GlobalMethod::Ransac { .. } => usize::MAX,
    };
    let matches = mutual_matches(&source.index, &target.index, max_points);
    let double = |p: Vec3| Vector3::new(f64::from(p.x), f64::from(p.y), f64::from(p.z));
    let pairs: Vec<_> = matches
        .iter()
        .map(|m| (double(source.points[m.source as usize]), double(target.points[m.target as usize])))
        .collect();
    let consensus = match method {
        GlobalMethod::Consistency => consistent_motion(&pairs, max_correspondence_distance),
        GlobalMethod::Ransac { seed } => ransac(
            &pairs,
            &source.points,
            (&target.points, target_tree),
            &RansacOptions { max_correspondence_distance, seed, ..RansacOptions::default() },
        ),
    };
    accepted(consensus, matches.len())
}

/// The consensus, if enough of the matches agree on it.
fn accepted(consensus: Option<Consensus>, num_matches: usize) -> Result<GlobalRegistration> {
    let remedy = "Give clouds that overlap more, or a first guess";
    let consensus = consensus.ok_or_else(|| {
        Error::whole(format!("{num_matches} points look alike, and no three of them agree on a motion"), remedy)
    })?;
    let num_inliers = consensus.num_inliers;
    let is_sure = num_inliers >= MIN_SURE_INLIERS && num_inliers as f64 >= SURE_SHARE * num_matches as f64;
    if num_inliers < MIN_INLIERS && !is_sure {
        let problem = format!("Only {num_inliers} of {num_matches} points that look alike agree on a motion");
        return Err(Error::whole(problem, remedy));
    }
    Ok(GlobalRegistration { consensus, num_matches })
}
