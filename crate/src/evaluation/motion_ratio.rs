//! Ratios of the translations and rotations of a trajectory to those of a reference.
//!
//! They are medians over pairs of frames, which are robust to a trajectory that is wrong in places.

use crate::geometry::Pose3;
use crate::geometry::quantile::{MIN_SAMPLE, error_of_median, quantile};

/// Motions of the estimate divided by those of the reference; `None` where the pairs are too few or disagree.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct MotionRatio {
    /// Ratio of distances.
    pub translation: Option<f64>,
    /// Ratio of angles.
    pub rotation: Option<f64>,
}

/// Differences of frame numbers of the compared pairs: consecutive frames, and longer gaps for slow cameras.
pub(super) const FRAME_GAPS: [usize; 4] = [1, 2, 5, 20];
/// Fewest motions of which a share is computed, or for which a wider gap between their frames is preferred: the noise is then smaller
/// beside the motion.
pub(super) const MIN_MOTIONS: usize = 20;
/// Most frames or motions, evenly spread, that are compared: medians and shares of so many are known to 3.5 % (1 / (2 sqrt(200))).
pub(super) const MAX_SAMPLES: usize = 200;
/// Assumed noise of an estimated motion between consecutive frames. Over several frames it grows with the square root of their number.
const NOISE: MotionSize = MotionSize { step: 0.01, turn: 0.02 };
/// Smallest ratio of a motion to its noise for which it is compared. Its size is then known to a fifth.
const MIN_SIGNAL_TO_NOISE: f64 = 5.0;
/// Largest share by which two motions that are equal differ by that noise.
pub(super) const MAX_DEVIATION: f64 = 1.0 / MIN_SIGNAL_TO_NOISE;
/// Largest rotation that is compared (rad); beyond pi the angle is ambiguous.
const MAX_TURN: f64 = 2.0;
/// Number of standard errors of the median by which the logarithm of the ratio must differ from zero.
const MIN_SIGNIFICANCE: f64 = 4.0;

/// The ratios; poses are `T_world_sensor`, each list in its own world frame.
pub(crate) fn motion_ratio(estimate: &[Option<Pose3>], reference: &[Option<Pose3>]) -> MotionRatio {
    let both: Vec<(Pose3, Pose3)> = estimate.iter().zip(reference).filter_map(|(a, b)| Some(((*a)?, (*b)?))).collect();
    ratio_of(&both)
}

/// The ratios for corresponding poses of the estimate and the reference.
pub(super) fn ratio_of(pairs: &[(Pose3, Pose3)]) -> MotionRatio {
    let (steps, turns) = logarithms_of(pairs);
    let factor = |logarithms| CommonFactor::of(logarithms).and_then(|common| common.significant());
    MotionRatio { translation: factor(steps), rotation: factor(turns) }
}

/// Logarithms of the ratios of the distances and of the angles of corresponding motions.
fn logarithms_of(pairs: &[(Pose3, Pose3)]) -> (Vec<f64>, Vec<f64>) {
    let [mut steps, mut turns] = [Vec::new(), Vec::new()];
    for gap in FRAME_GAPS {
        let noise = MotionSize::noise(gap);
        for (motion, reference) in motions(pairs, gap) {
            if tells(reference.step, noise.step) && motion.step > 0.0 {
                steps.push((motion.step / reference.step).ln());
            }
            let is_below = motion.turn.max(reference.turn) < MAX_TURN;
            if tells(reference.turn, noise.turn) && is_below && motion.turn > 0.0 {
                turns.push((motion.turn / reference.turn).ln());
            }
        }
    }
    (steps, turns)
}

/// The widest gap between frames that leaves enough motions which share no frame.
pub(super) fn widest_gap(num_poses: usize) -> usize {
    FRAME_GAPS.into_iter().rev().find(|gap| num_poses >= gap * MIN_MOTIONS).unwrap_or(1)
}

/// Size of the motion between two frames. It is independent of the world frame and, apart from the lever arm, of where the
/// sensor is mounted.
pub(super) struct MotionSize {
    /// Distance (m).
    pub step: f64,
    /// Angle (rad).
    pub turn: f64,
}

impl MotionSize {
    /// That of the noise of a motion between frames that are `gap` apart.
    pub fn noise(gap: usize) -> Self {
        let growth = (gap as f64).sqrt();
        Self { step: growth * NOISE.step, turn: growth * NOISE.turn }
    }
}

/// Whether a motion of this size is compared.
pub(super) fn tells(size: f64, noise: f64) -> bool {
    size > MIN_SIGNAL_TO_NOISE * noise
}

/// The motions of the estimate and of the reference between the same frames, `gap` frames apart.
pub(super) fn motions(pairs: &[(Pose3, Pose3)], gap: usize) -> impl Iterator<Item = (MotionSize, MotionSize)> {
    let size = |a: &Pose3, b: &Pose3| {
        let motion = a.inverse() * b;
        MotionSize { step: motion.translation.vector.norm(), turn: motion.rotation.angle() }
    };
    pairs.iter().zip(pairs.iter().skip(gap)).map(move |(a, b)| (size(&a.0, &b.0), size(&a.1, &b.1)))
}

/// Whether the distances and the angles of the estimate are those of the reference within `factor`, significantly: what lies
/// within the standard errors of the ratio lies within the factor, too.
pub(crate) fn motions_agree(
    estimate: &[Option<Pose3>],
    reference: &[Option<Pose3>],
    factor: f64,
) -> MotionAgreementWithin {
    let both: Vec<(Pose3, Pose3)> = estimate.iter().zip(reference).filter_map(|(a, b)| Some(((*a)?, (*b)?))).collect();
    let (steps, turns) = logarithms_of(&both);
    let agrees = |logarithms| {
        CommonFactor::of(logarithms)
            .is_some_and(|common| common.logarithm.abs() + MIN_SIGNIFICANCE * common.error < factor.ln())
    };
    MotionAgreementWithin { translation: agrees(steps), rotation: agrees(turns) }
}

/// Whether distances and angles agree within a factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MotionAgreementWithin {
    /// Distances.
    pub translation: bool,
    /// Angles.
    pub rotation: bool,
}

/// The factor that ratios have in common, as a logarithm.
struct CommonFactor {
    /// Median of the logarithms.
    logarithm: f64,
    /// Standard error of the median.
    error: f64,
    /// Median absolute deviation.
    spread: f64,
}

impl CommonFactor {
    /// Of these logarithms; none of too few.
    fn of(mut logarithms: Vec<f64>) -> Option<Self> {
        if logarithms.len() < MIN_SAMPLE {
            return None;
        }
        let logarithm = quantile(&mut logarithms, 0.5)?;
        let mut deviations: Vec<f64> = logarithms.iter().map(|value| (value - logarithm).abs()).collect();
        let spread = quantile(&mut deviations, 0.5)?;
        Some(Self { logarithm, error: error_of_median(spread, logarithms.len()), spread })
    }

    /// The factor, where the ratios agree on it and it differs from one significantly.
    fn significant(&self) -> Option<f64> {
        // A broken trajectory scatters more, but still shows a large factor.
        let is_common = self.spread <= MAX_DEVIATION * self.logarithm.abs().max(1.0);
        (is_common && self.logarithm.abs() >= MIN_SIGNIFICANCE * self.error).then(|| self.logarithm.exp())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

    use super::*;

    fn path(count: u32, scale: f64, turn: f64) -> Vec<Option<Pose3>> {
        let pose = |i: u32| {
            let t = f64::from(i);
            let position = Vector3::new((0.3 * t).sin(), 0.0, 0.1 * t + (0.2 * t).cos()) * scale;
            let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn * 0.08 * t);
            Some(Isometry3::from_parts(Translation3::from(position), rotation))
        };
        (0..count).map(pose).collect()
    }

    #[test]
    fn a_common_factor_is_found_even_where_part_of_the_path_is_broken() {
        let reference = path(40, 1.0, 1.0);
        let mut estimate = path(40, 6.55, 1.0);
        for pose in &mut estimate[30..] {
            *pose = Some(Isometry3::translation(3.0, 1.0, 2.0) * pose.unwrap());
        }
        estimate[7] = None;
        let ratio = motion_ratio(&estimate, &reference);
        assert!((ratio.translation.unwrap() / 6.55 - 1.0).abs() < 1e-3, "{ratio:?}");
        assert!((ratio.rotation.unwrap() - 1.0).abs() < 1e-6);
        assert!((motion_ratio(&path(40, 1.0, 0.8), &reference).rotation.unwrap() - 0.8).abs() < 1e-6);
    }

    #[test]
    fn motions_agree_within_a_factor_only_where_enough_of_them_tell() {
        let reference = path(40, 1.0, 1.0);
        let agree = |estimate: &[Option<Pose3>]| {
            let MotionAgreementWithin { translation, rotation } = motions_agree(estimate, &reference, 1.05);
            (translation, rotation)
        };
        assert_eq!(agree(&path(40, 1.0, 1.0)), (true, true));
        assert_eq!(agree(&path(40, 1.1, 1.0)), (false, true));
        assert_eq!(agree(&path(40, 1.0, 0.9)), (true, false));
        assert_eq!(agree(&path(3, 1.0, 1.0)), (false, false), "too few");
    }

    #[test]
    fn motions_without_a_common_ratio_give_none() {
        let wild: Vec<Option<Pose3>> =
            (0..40).map(|i: u32| Some(Isometry3::translation(f64::from(i * i * 7919 % 97), 0.0, 0.0))).collect();
        assert_eq!(motion_ratio(&wild, &path(40, 1.0, 1.0)).translation, None);
        assert_eq!(motion_ratio(&path(3, 2.0, 1.0), &path(3, 1.0, 1.0)), MotionRatio::default(), "too few");
        let still = vec![Some(Isometry3::identity()); 40];
        assert_eq!(motion_ratio(&still, &still), MotionRatio::default());
    }
}
