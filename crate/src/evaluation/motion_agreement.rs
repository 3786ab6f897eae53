//! Whether the motions of an estimate are those of the reference; if not, the reference belongs to another recording or the
//! estimate is wrong.

use super::motion_ratio::{FRAME_GAPS, MAX_DEVIATION, MIN_MOTIONS, MotionSize, motions, ratio_of, tells, widest_gap};
use super::pair_conventions::is_beyond_chance;
use crate::geometry::Pose3;
use crate::geometry::pose_distance::METRES_PER_RADIAN;

/// Share below which a reference is reported as misfitting. Measured: see [`motion_agreement`].
const MIN_AGREEMENT: f64 = 0.6;

/// Share of the motions between frames that are equally large in the estimate and in the reference, whose unit of length may
/// differ; `None` where the frames move too little. The compared frames are as far apart as the recording allows, since
/// consecutive frames often have equal distances everywhere.
///
/// Measured on the recordings at hand: at least 0.92, even where the estimate drifts; for a reference of another recording or
/// in another order at most 0.55 with orientations, and 0.7 without.
fn motion_agreement(pairs: &[(Pose3, Pose3)], has_orientations: bool) -> Option<f64> {
    let scale = ratio_of(pairs).translation.unwrap_or(1.0);
    FRAME_GAPS.iter().rev().find_map(|&gap| {
        let noise = MotionSize::noise(gap);
        let [mut num_moving, mut num_agreeing] = [0_usize; 2];
        for (motion, reference) in motions(pairs, gap) {
            let steps = (motion.step / scale, reference.step, noise.step);
            let turns = (motion.turn, reference.turn, noise.turn);
            let sizes = if has_orientations { [steps, turns] } else { [steps, steps] };
            // Smaller motions always agree.
            if sizes.iter().any(|(a, b, noise)| tells(a.max(*b), *noise)) {
                num_moving += 1;
                let agree = sizes.iter().all(|(a, b, noise)| (a - b).abs() <= MAX_DEVIATION * a.max(*b) + noise);
                num_agreeing += usize::from(agree);
            }
        }
        (num_moving >= MIN_MOTIONS).then(|| num_agreeing as f64 / num_moving as f64)
    })
}

/// Differences between the sizes of the motions of the estimate and of the reference (m), whose unit of length may differ: the
/// mean of their absolute values, and the number of runs of one sign, since neighbouring motions of a smooth path are not independent.
fn differences(pairs: &[(Pose3, Pose3)], has_orientations: bool) -> (f64, usize) {
    let scale = ratio_of(pairs).translation.unwrap_or(1.0);
    let difference = |(motion, reference): (MotionSize, MotionSize)| {
        let turn = if has_orientations { METRES_PER_RADIAN * (motion.turn - reference.turn) } else { 0.0 };
        [motion.step / scale - reference.step, turn]
    };
    let all: Vec<[f64; 2]> = motions(pairs, widest_gap(pairs.len())).map(difference).collect();
    let mean = all.iter().map(|[step, turn]| step.abs() + turn.abs()).sum::<f64>() / all.len() as f64;
    let is_more = |[step, turn]: &[f64; 2]| step + turn > 0.0;
    (mean, 1 + all.windows(2).filter(|pair| is_more(&pair[0]) != is_more(&pair[1])).count())
}

/// That the motions of the estimate are those of the reference taken from its last pose to its first.
pub(super) fn reversal(name: &str, pairs: &[(Pose3, Pose3)], has_orientations: bool) -> Option<String> {
    let last_first = pairs.iter().zip(pairs.iter().rev()).map(|(estimate, reference)| (estimate.0, reference.1));
    let last_first: Vec<(Pose3, Pose3)> = last_first.collect();
    let (as_read, num_independent) = differences(pairs, has_orientations);
    let (reversed, _) = differences(&last_first, has_orientations);
    is_beyond_chance(as_read, reversed, num_independent).then(|| {
        format!(
            "{name}: its poses are in reverse order, or the estimate's are: taken from the last to the first, its motions differ \
             from the estimate's by {reversed:.2} m in the mean, a radian counting as 2 m, and as read by {as_read:.2} m. Reverse \
             the order in the file"
        )
    })
}

/// Whether the motions of a reference are those of the estimate, `None` where too few move; with a note where they are not, or are
/// in reverse order.
/// `pairs`: estimate and reference of each frame.
pub(super) fn agreement(
    name: &str,
    pairs: &[(Pose3, Pose3)],
    has_orientations: bool,
) -> (Option<bool>, Option<String>) {
    let share = motion_agreement(pairs, has_orientations);
    let stands_still = pairs.iter().all(|(_, reference)| *reference == pairs[0].1);
    let note = |share: f64| {
        if stands_still {
            return format!("{name}: all of its poses are the same: it tells nothing of the motion");
        }
        format!(
            "{name}: only {:.0} % of its motions between frames are as large as the estimate's: it is of another recording, \
             its rows are in another order, or the estimate is wrong",
            100.0 * share
        )
    };
    let reversal = reversal(name, pairs, has_orientations);
    let misfit = reversal.or_else(|| share.filter(|share| *share < MIN_AGREEMENT).map(note));
    (share.map(|share| share >= MIN_AGREEMENT), misfit)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    /// A drive with turns whose times depend on `phase`; steps of about 0.3 m with 5 mm of noise.
    fn drive(count: u32, phase: f64) -> Vec<Pose3> {
        let mut pose = Isometry3::new(Vector3::new(3.0, phase, 0.0), Vector3::z() * phase);
        let step = |i: u32| {
            let t = f64::from(i);
            let noise = 5e-3 * (f64::from(i * 7919 % 13) / 6.0 - 1.0);
            let turn = 0.25 * (0.3 * t + phase).sin().powi(3);
            let ahead = 0.3 + 0.1 * (0.11 * t + 2.0 * phase).cos() + noise;
            pose *= Isometry3::new(Vector3::new(ahead, 0.0, 0.0), Vector3::z() * turn);
            pose
        };
        (0..count).map(step).collect()
    }

    fn pairs(estimate: Vec<Pose3>, reference: Vec<Pose3>) -> Vec<(Pose3, Pose3)> {
        estimate.into_iter().zip(reference).collect()
    }

    #[test]
    fn the_reference_of_another_drive_is_reported_and_drift_and_other_units_are_not() {
        let told = |pairs: &[(Pose3, Pose3)]| agreement("gt.txt", pairs, true).1.is_some();
        let drive_a = drive(200, 0.0);
        assert!(told(&pairs(drive_a.clone(), drive(200, 1.4))));

        let bias = Isometry3::new(Vector3::new(0.004, -0.003, 0.0), Vector3::z() * 0.004);
        let mut drifting = Pose3::identity();
        let drifted = |step: &[Pose3]| {
            drifting *= step[0].inverse() * step[1] * bias;
            drifting
        };
        assert!(!told(&pairs(drive_a.windows(2).map(drifted).collect(), drive_a[1..].to_vec())));
        let millimetres = |pose: &Pose3| Isometry3::from_parts((1e3 * pose.translation.vector).into(), pose.rotation);
        assert!(!told(&pairs(drive_a.iter().map(millimetres).collect(), drive_a.clone())));
        assert!(!told(&pairs(drive_a[..4].to_vec(), drive(4, 1.4))), "too few motions");
        let (_, note) = agreement("gt.txt", &pairs(drive_a.clone(), vec![drive_a[0]; drive_a.len()]), true);
        assert_eq!(note.unwrap(), "gt.txt: all of its poses are the same: it tells nothing of the motion");
    }

    #[test]
    fn a_reference_in_reverse_order_is_told_as_such() {
        let told = |estimate: &[Pose3], reference: &[Pose3], has_orientations: bool| {
            let note = agreement("gt.txt", &pairs(estimate.to_vec(), reference.to_vec()), has_orientations).1;
            note.is_some_and(|note| note.starts_with("gt.txt: its poses are in reverse order"))
        };
        let noisy = |poses: Vec<Pose3>| -> Vec<Pose3> {
            let noise = |i: u32| Isometry3::new(Vector3::y() * 0.02 * f64::from(i).sin(), Vector3::z() * 0.005);
            poses.iter().zip(0..).map(|(pose, i)| pose * noise(i)).collect()
        };
        for (count, phase) in [(16, 0.0), (16, 2.0), (60, 1.0), (200, 0.0), (900, 3.0)] {
            let (reference, estimate) = (drive(count, phase), noisy(drive(count, phase)));
            let reversed: Vec<Pose3> = reference.iter().rev().copied().collect();
            assert!(told(&estimate, &reversed, true), "{count} {phase}");
            assert!(!told(&estimate, &reference, true), "{count} {phase}");
            assert!(!told(&estimate, &drive(count, phase + 1.4), true), "{count} {phase}");
        }
        let (reference, estimate) = (drive(200, 0.0), noisy(drive(200, 0.0)));
        let reversed: Vec<Pose3> = reference.iter().rev().copied().collect();
        assert!(told(&estimate, &reversed, false) && !told(&estimate, &reference, false));
    }

    #[test]
    fn positions_alone_are_compared_by_distances() {
        let place = |i: u32, phase: f64| {
            let t = f64::from(i);
            Isometry3::translation((0.1 * t + phase).sin() * 8.0, (0.17 * t + 3.0 * phase).cos() * 5.0, 0.0)
        };
        let path = |phase: f64| (0..150).map(|i| place(i, phase)).collect::<Vec<_>>();
        assert!(motion_agreement(&pairs(path(0.0), path(0.0)), false) == Some(1.0));
        assert!(motion_agreement(&pairs(path(0.0), path(1.0)), false).unwrap() < MIN_AGREEMENT);
        assert_eq!(motion_agreement(&vec![(Pose3::identity(), Pose3::identity()); 50], false), None, "nothing moves");
    }
}
