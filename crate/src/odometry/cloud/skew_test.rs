//! Whether sweeps are bent as the times of their points say: drivers keep the times of sweeps that they have straightened already.
//!
//! Each sweep is registered to the one before it twice, both straightened and both as they are. The logarithm of the ratio of what is
//! left over is tested for its sign (Student's t over sweeps).

use super::prepared::PreparedCloud;
use super::{CloudOptions, ROUGH_POINTS};
use crate::geometry::Pose3;
use crate::registration::spatial::register_in_space;

/// Fewest sweeps that decide.
const MIN_SWEEPS: usize = 5;
/// Least mean over its standard error. By chance one recording in 130 has as much with five sweeps, and one in 13,000 with 20 (Student's
/// t, both sides).
const SIGNIFICANT: f64 = 5.0;

/// The test, until it is decided.
#[derive(Default)]
pub(super) struct SkewTest {
    log_ratios: Vec<f64>,
    /// Whether they are bent, where that is significant.
    pub(super) verdict: Option<bool>,
}

impl SkewTest {
    /// Adds what is [left over](left_over) of a sweep and the one before it as they are, and straightened (m^2).
    pub(super) fn add(&mut self, bent: f64, straight: f64) {
        if bent > 0.0 && straight > 0.0 {
            self.log_ratios.push((bent / straight).ln());
        }
        let count = self.log_ratios.len() as f64;
        let mean = self.log_ratios.iter().sum::<f64>() / count;
        let square: f64 = self.log_ratios.iter().map(|ratio| (ratio - mean) * (ratio - mean)).sum();
        let error = (square / ((count - 1.0) * count)).sqrt();
        let is_significant = self.log_ratios.len() >= MIN_SWEEPS && mean.abs() > SIGNIFICANT * error;
        self.verdict = is_significant.then_some(mean > 0.0);
    }
}

/// Mean square distance of corresponding points (m^2) of two sweeps, registered from `T_last_this`, where points without a partner count as at the
/// limit.
pub(super) fn left_over([last, this]: [&PreparedCloud; 2], T_last_this: &Pose3, options: &CloudOptions) -> f64 {
    let ((first, finer), solver) = (options.stages(), options.motion.solver());
    let sample = this.at_most(ROUGH_POINTS);
    let found =
        register_in_space(options.metric, sample.source(), last.target(), *T_last_this, (&first, &finer), &solver);
    let limit = options.max_correspondence_distance;
    found.fitness * found.last.inlier_rmse.powi(2) + (1.0 - found.fitness) * limit * limit
}
