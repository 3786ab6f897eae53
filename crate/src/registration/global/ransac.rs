//! Random sample consensus over matches of features: a sample of three matches determines a motion, and the motion with the
//! largest overlap of the clouds is the result.
//!
//! Fischler and Bolles, "Random sample consensus", CACM 24 (1981); samples are rejected by the lengths of their edges before a
//! motion is computed (Buch et al., "Pose estimation using local structure-specific shape and appearance context", ICRA 2013).

use glam::{Mat3, Vec3};
use nalgebra::Vector3;

use super::Consensus;
use crate::geometry::Pose3;
use crate::geometry::random::Random;
use crate::registration::factors::best_rigid_motion;
use crate::search::{KdTree, RadiusGrid};

/// Options of [`ransac`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RansacOptions {
    /// Most samples.
    pub max_iterations: usize,
    /// Probability of having drawn a sample without outliers at which the search ends.
    pub confidence: f64,
    /// Smallest ratio of the lengths of corresponding edges of a sample, in (0, 1].
    pub edge_length_ratio: f64,
    /// Largest distance of an inlier (m).
    pub max_correspondence_distance: f64,
    /// Seed of the random samples; the same clouds and seed give the same motion on every platform.
    pub seed: u64,
}

impl Default for RansacOptions {
    /// The usual values with voxels of 5 cm, as in courses with Open3D.
    fn default() -> Self {
        Self {
            max_iterations: 100_000,
            confidence: 0.999,
            edge_length_ratio: 0.9,
            max_correspondence_distance: 0.075,
            seed: 1,
        }
    }
}

/// The motion with the most points of `source` (m) within the distance limit of a point of `target`, from samples of the matched
/// pairs (source, target), by which its inliers are counted. `None` where there are fewer than three pairs or no sample passes.
pub fn ransac(
    pairs: &[(Vector3<f64>, Vector3<f64>)],
    source: &[Vec3],
    (target, target_tree): (&[Vec3], &KdTree<3>),
    options: &RansacOptions,
) -> Option<Consensus> {
    if pairs.len() < 3 {
        return None;
    }
    let max_distance = options.max_correspondence_distance;
    let mut random = Random::new(options.seed);
    let mut best: Option<Consensus> = None;
    let mut overlap = Overlap::new(source, RadiusGrid::new(target, target_tree, max_distance as f32));
    let mut last = options.max_iterations;
    let mut iteration = 0;
    while iteration < last {
        iteration += 1;
        let sample = three_below(&mut random, pairs.len()).map(|index| pairs[index]);
        if !edges_agree(&sample, options.edge_length_ratio) {
            continue;
        }
        let Some(T) = best_rigid_motion::<Pose3>(sample.iter().map(|(p, q)| (*p, *q, 1.0))) else { continue };
        if Consensus::of(&T, &sample, max_distance).num_inliers == sample.len() && overlap.improves(&T) {
            let consensus = Consensus::of(&T, pairs, max_distance);
            let share = consensus.num_inliers as f64 / pairs.len() as f64;
            let needed = samples_needed(share, options.confidence);
            if needed < options.max_iterations as f64 {
                last = needed.ceil() as usize;
            }
            best = Some(consensus);
        }
    }
    best
}

/// Number of samples of three pairs of which one holds inliers only, with this confidence, where so large a share of the pairs
/// are inliers.
fn samples_needed(share: f64, confidence: f64) -> f64 {
    // 1 - share^3 would round to 1 for a small share.
    (1.0 - confidence).ln() / (-share.powi(3)).ln_1p()
}

/// Counts the points of the source within the distance limit of the target, and keeps the best count so far.
struct Overlap<'a> {
    /// In an order that visits all parts of the cloud early, so that the count of a worse motion is stopped early.
    source: Vec<Vec3>,
    target: RadiusGrid<'a>,
    most: usize,
}

/// Passes over the cloud in which its points are ordered, each with another offset.
const NUM_ROUNDS: usize = 64;

impl<'a> Overlap<'a> {
    fn new(source: &[Vec3], target: RadiusGrid<'a>) -> Self {
        let rounds = (0..NUM_ROUNDS).flat_map(|round| source.iter().copied().skip(round).step_by(NUM_ROUNDS));
        Self { source: rounds.collect(), target, most: 0 }
    }

    /// Whether more points are within the distance limit under `T` than under all earlier motions.
    fn improves(&mut self, T: &Pose3) -> bool {
        let R = T.rotation.to_rotation_matrix().into_inner().cast::<f32>();
        let R = Mat3::from_cols_slice(R.as_slice());
        let t = T.translation.vector;
        let t = Vec3::new(t.x as f32, t.y as f32, t.z as f32);
        let may_miss = self.source.len() - self.most;
        let mut misses = 0;
        for &point in &self.source {
            misses += usize::from(!self.target.has_within(R * point + t));
            if misses >= may_miss {
                return false;
            }
        }
        self.most = self.source.len() - misses;
        true
    }
}

/// Whether the edges of two triangles have about the same lengths.
fn edges_agree(sample: &[(Vector3<f64>, Vector3<f64>); 3], ratio: f64) -> bool {
    let sq_ratio = ratio * ratio;
    [(0, 1), (1, 2), (2, 0)].iter().all(|&(i, j)| {
        let source = (sample[i].0 - sample[j].0).norm_squared();
        let target = (sample[i].1 - sample[j].1).norm_squared();
        source >= sq_ratio * target && target >= sq_ratio * source
    })
}

/// Three different numbers in 0..count; there must be three.
fn three_below(random: &mut Random, count: usize) -> [usize; 3] {
    let a = random.below(count);
    let mut b = random.below(count - 1);
    b += usize::from(b >= a);
    let mut c = random.below(count - 2);
    let (low, high) = (a.min(b), a.max(b));
    c += usize::from(c >= low);
    c += usize::from(c >= high);
    [a, b, c]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fewer_the_inliers_the_more_samples_are_needed() {
        let needed = samples_needed(0.5, 0.999);
        assert!((needed - (1e-3f64.ln() / 0.875f64.ln())).abs() < 1e-9, "{needed}");
        // 3 inliers of a million pairs: 1 - share^3 is 1 in double precision.
        let needed = samples_needed(3e-6, 0.999);
        assert!((needed * 3e-6f64.powi(3) - 1e3f64.ln()).abs() < 1e-6, "{needed}");
        assert_eq!(samples_needed(1.0, 0.999).ceil(), 0.0);
    }
}
