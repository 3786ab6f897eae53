//! Distance of estimated poses in space to a reference, whatever the reference's conventions.

use std::collections::HashMap;

use nalgebra::Isometry3;

use super::{AlignedError, POSITIONS_ALONE, TrajectoryError};
use crate::error::{Error, Result};
use crate::evaluation::associate::{MAX_TIME_DIFFERENCE, by_time};
use crate::evaluation::convention::{KnownConvention, PoseConvention, interpret};
use crate::evaluation::motion_ratio::{MotionSize, motions, ratio_of};
use crate::geometry::Pose3;
use crate::geometry::pose_distance::METRES_PER_RADIAN;
use crate::io::length_unit::MILLIMETRE;
use crate::io::trajectory::{Contents, Trajectory};

/// A frame whose pose was estimated, as far as it is to be compared.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EstimatedFrame {
    /// Its place in the recording, counted from 0.
    pub index: usize,
    /// The number in its name, where it has one.
    pub number: Option<usize>,
    /// When it was taken (s), where known.
    pub time: Option<f64>,
    /// `T_world_sensor` (x right, y down, z forward); none where the frame is lost.
    pub T_world_sensor: Option<Pose3>,
    /// Whether the pose is to be trusted.
    pub is_good: bool,
}

/// Compares the frames of a recording of `num_recorded` frames with a reference: by time where both have times, by their
/// index in the recording where the reference has none, or numbers in their place; where it has more poses than there are frames, by the
/// numbers in the frames' names. Positions in millimetres become metres.
///
/// # Errors
/// When the reference has another number of poses than the recording has frames and neither times nor numbers tell which belong together.
pub(crate) fn spatial_error(
    frames: &[EstimatedFrame],
    num_recorded: usize,
    name: &str,
    reference: &Contents,
    known: KnownConvention,
) -> Result<TrajectoryError<Pose3>> {
    let errors = pairings(frames, num_recorded, &reference.trajectory)?.into_iter().map(|pairing| {
        let error = error_of(frames, &pairing.partners, name, reference, known);
        TrajectoryError { convention: error.convention.clone() + pairing.words, ..error }
    });
    let difference = |error: &TrajectoryError<Pose3>| difference_of_motions(frames, error);
    errors.min_by(|a, b| difference(a).total_cmp(&difference(b))).ok_or_else(|| {
        let num_rows = reference.trajectory.num_rows();
        let problem = format!("The reference has {num_rows} poses, but the recording has {num_recorded} frames");
        let remedy = if num_rows > num_recorded {
            "Give the poses of these frames alone, or drop all frames of the recording"
        } else {
            "Give one pose for each frame"
        };
        Error::whole(problem, remedy)
    })
}

/// Sum of the differences between the sizes of the steps and turns from frame to frame of the estimate and of the reference (m, two metres
/// per radian). Poses that are paired one off lie on the same path, but do not move alike.
fn difference_of_motions(frames: &[EstimatedFrame], error: &TrajectoryError<Pose3>) -> f64 {
    let both: Vec<(Pose3, Pose3)> = frames
        .iter()
        .zip(&error.reference)
        .filter_map(|(frame, reference)| Some((frame.T_world_sensor?, (*reference)?)))
        .collect();
    let has_turns = error.rotation_errors.iter().any(Option::is_some);
    let difference = |(estimate, reference): (MotionSize, MotionSize)| {
        let turns = if has_turns { METRES_PER_RADIAN * (estimate.turn - reference.turn).abs() } else { 0.0 };
        (estimate.step - reference.step).abs() + turns
    };
    motions(&both, 1).map(difference).sum()
}

fn error_of(
    frames: &[EstimatedFrame],
    partners: &[Option<usize>],
    name: &str,
    reference: &Contents,
    known: KnownConvention,
) -> TrajectoryError<Pose3> {
    let matched: Vec<(Pose3, usize)> =
        frames.iter().zip(partners).filter_map(|(frame, partner)| Some((frame.T_world_sensor?, (*partner)?))).collect();
    let interpreted = interpret(&reference.trajectory, reference.format, &matched, known);
    let positions = &reference.trajectory.positions;
    let (poses, convention) = match interpreted {
        Some((poses, convention)) => (poses, Some(convention)),
        None => (positions.iter().map(|p| Isometry3::translation(p.x, p.y, p.z)).collect(), None),
    };
    let both: Vec<(Pose3, Pose3)> =
        matched.iter().filter_map(|&(estimate, partner)| Some((estimate, *poses.get(partner)?))).collect();
    if is_in_millimetres(&both) {
        let mut reference = reference.clone();
        reference.trajectory.positions.iter_mut().for_each(|position| *position *= MILLIMETRE.metres);
        let error = error_of(frames, partners, name, &reference, known);
        return TrajectoryError { convention: error.convention + ", positions in millimetres", ..error };
    }
    let mut good = frames.iter().zip(partners).filter(|(frame, _)| frame.is_good);
    let first_good = good.find_map(|(frame, partner)| Some((frame.T_world_sensor?, (*partner)?)));
    let to_estimate = first_good.or(matched.first().copied()).map_or_else(Pose3::identity, |(estimate, partner)| {
        estimate * poses.get(partner).map_or_else(Pose3::identity, Pose3::inverse)
    });
    let moved: Vec<Option<Pose3>> =
        partners.iter().map(|partner| Some(to_estimate * poses.get((*partner)?)?)).collect();
    let has_rotations = convention.is_some();
    let compare = |(frame, partner): (&EstimatedFrame, &Option<Pose3>)| {
        let (pose, partner) = (frame.T_world_sensor?, (*partner)?);
        let angle = || (pose.rotation.inverse() * partner.rotation).angle();
        Some(((pose.translation.vector - partner.translation.vector).norm(), has_rotations.then(angle)))
    };
    let errors: Vec<_> = frames.iter().zip(&moved).map(compare).collect();
    let reading = convention.map_or_else(|| POSITIONS_ALONE.to_owned(), PoseConvention::words);
    let pairs: Vec<(Pose3, Pose3)> =
        frames.iter().zip(&moved).filter_map(|(frame, partner)| Some((frame.T_world_sensor?, (*partner)?))).collect();
    TrajectoryError::new(name, &errors, moved, reading).with_alignment(AlignedError::in_space(&pairs), &pairs)
}

/// A reference's steps are in millimetres where they are as long in them as the estimate's within this factor: depth scales and units of
/// clouds differ by other ones.
const UNIT_FACTOR: f64 = 1.2;

/// Whether the motions of the reference are a thousand times as large as the estimate's. Pairs: estimate, reference.
fn is_in_millimetres(pairs: &[(Pose3, Pose3)]) -> bool {
    ratio_of(pairs).translation.is_some_and(|ratio| (ratio / MILLIMETRE.metres).ln().abs() < UNIT_FACTOR.ln())
}

/// Which pose of a reference belongs to each frame, and in words how that is known where it is not by time or for all in their order.
struct Pairing {
    /// Index in the reference; `None` without a partner.
    partners: Vec<Option<usize>>,
    words: &'static str,
}

/// How the frames may be paired with the poses of the reference.
fn pairings(frames: &[EstimatedFrame], num_recorded: usize, reference: &Trajectory) -> Result<Vec<Pairing>> {
    let times: Option<Vec<f64>> = frames.iter().map(|frame| frame.time).collect();
    if let (Some(stamps), Some(times)) = (&reference.stamps, times) {
        match by_time(stamps, &times, MAX_TIME_DIFFERENCE, 0.0) {
            Ok(pairs) => {
                let mut partners = vec![None; frames.len()];
                for pair in pairs {
                    partners[pair.estimate] = Some(pair.reference);
                }
                return Ok(vec![Pairing { partners, words: "" }]);
            }
            // Numbers in the place of times tell the order of the poses alone.
            Err(error) if !stamps.windows(2).all(|pair| pair[1] - pair[0] == 1.0) => return Err(error),
            Err(_) => {}
        }
    }
    if reference.num_rows() == num_recorded {
        let partners = frames.iter().map(|frame| reference.index_of_row(frame.index)).collect();
        return Ok(vec![Pairing { partners, words: "" }]);
    }
    Ok(by_number(frames, num_recorded, reference))
}

/// Pairings of frames that were taken out of a longer recording, by the numbers in their names: with the poses of these numbers, or
/// with the rows, counted from 0 or from 1. None where the numbers do not grow or exceed the rows, or the
/// reference is no longer than the recording.
fn by_number(frames: &[EstimatedFrame], num_recorded: usize, reference: &Trajectory) -> Vec<Pairing> {
    let Some(numbers) = frames.iter().map(|frame| frame.number).collect::<Option<Vec<usize>>>() else {
        return Vec::new();
    };
    let (&[first, ..], Some(&last)) = (&numbers[..], numbers.last()) else { return Vec::new() };
    if !numbers.is_sorted_by(|a, b| a < b) || reference.num_rows() <= num_recorded {
        return Vec::new();
    }
    let labels = reference.numbers.as_ref().or(reference.stamps.as_ref());
    if let Some(labels) = labels.filter(|labels| labels.iter().all(|label| *label >= 0.0 && label.fract() == 0.0)) {
        let rows: HashMap<usize, usize> = labels.iter().map(|&label| label as usize).zip(0..).collect();
        let partners: Vec<Option<usize>> = numbers.iter().map(|number| rows.get(number).copied()).collect();
        return if partners.contains(&None) {
            Vec::new()
        } else {
            vec![Pairing { partners, words: ", poses by number" }]
        };
    }
    let ways = [(0, ", rows by the numbers of the frames from 0"), (1, ", rows by the numbers of the frames from 1")];
    let fits = |&(base, _): &(usize, &str)| first >= base && last - base < reference.num_rows();
    let pairing = |(base, words)| Pairing {
        partners: numbers.iter().map(|number| reference.index_of_row(number - base)).collect(),
        words,
    };
    ways.into_iter().filter(fits).map(pairing).collect()
}

/// The number that a frame's name ends with, before its ending: 12 of `depth/frame-000012.depth.png`.
pub(crate) fn number_in_name(name: &str) -> Option<usize> {
    let stem = name.rsplit('/').next()?;
    let digits = stem.split(|letter: char| !letter.is_ascii_digit()).rfind(|digits| !digits.is_empty())?;
    digits.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::trajectory::TrajectoryFormat;
    use nalgebra::{UnitQuaternion, Vector3};

    fn turn(angle: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle)
    }

    fn pose(x: f64, angle: f64) -> Pose3 {
        Isometry3::from_parts(nalgebra::Translation3::new(x, 0.0, 2.0 * x), turn(angle))
    }

    fn frames(poses: &[Option<Pose3>]) -> Vec<EstimatedFrame> {
        let frame = |(index, pose): (usize, &Option<Pose3>)| EstimatedFrame {
            index,
            number: None,
            time: None,
            T_world_sensor: *pose,
            is_good: true,
        };
        poses.iter().enumerate().map(frame).collect()
    }

    fn contents(trajectory: Trajectory) -> Contents {
        Contents { trajectory, format: TrajectoryFormat::Tum, notes: Vec::new() }
    }

    #[test]
    fn the_first_poses_are_made_equal_and_lost_frames_do_not_count() {
        let truth: Vec<Pose3> = (0..4).map(|i| pose(f64::from(i), 0.2 * f64::from(i))).collect();
        let world = pose(3.0, 1.0);
        let reference = contents(Trajectory::from_poses(&truth.iter().map(|pose| world * pose).collect::<Vec<_>>()));
        let mut estimate: Vec<Option<Pose3>> = truth.iter().copied().map(Some).collect();
        estimate[2] = None;
        estimate[3] = Some(truth[3] * pose(0.1, 0.01));
        let error = spatial_error(&frames(&estimate), 4, "ref.txt", &reference, KnownConvention::default()).unwrap();
        assert_eq!((error.num_matched, error.errors[2], error.errors.len()), (3, None, 4));
        let off = 0.1 * 5f64.sqrt();
        assert!((error.max - off).abs() < 1e-9 && (error.mean - off / 3.0).abs() < 1e-9);
        assert!((error.rotation_errors[3].unwrap() - 0.01).abs() < 1e-9);
        assert!(error.reference[2].unwrap().translation.vector.x > 1.9);

        // A doubtful frame is no anchor: the next good one is.
        let mut doubtful = frames(&estimate);
        doubtful[0].T_world_sensor = Some(pose(0.5, 0.3));
        doubtful[0].is_good = false;
        let error = spatial_error(&doubtful, 4, "ref.txt", &reference, KnownConvention::default()).unwrap();
        assert!(error.errors[1].unwrap() < 1e-9 && error.errors[0].unwrap() > 1.0, "{error:?}");
    }

    #[test]
    fn frames_that_were_left_out_keep_their_places_and_times_decide_where_there_are_any() {
        let truth: Vec<Pose3> = (0..5).map(|i| pose(f64::from(i), 0.1)).collect();
        let reference = contents(Trajectory::from_poses(&truth));
        let mut left = frames(&truth.iter().copied().map(Some).collect::<Vec<_>>());
        left.remove(1);
        assert!(spatial_error(&left, 5, "ref.txt", &reference, KnownConvention::default()).unwrap().max < 1e-9);
        let refused =
            spatial_error(&left, 4, "ref.txt", &reference, KnownConvention::default()).unwrap_err().to_string();
        assert!(refused.contains("5 poses") && refused.contains("4 frames"), "{refused}");

        // The reference has no pose of the third frame.
        let mut with_gap = contents(Trajectory::from_poses(&[truth[0], truth[1], truth[3], truth[4]]));
        with_gap.trajectory.undefined = vec![2];
        let error = spatial_error(&left, 5, "ref.txt", &with_gap, KnownConvention::default()).unwrap();
        assert!(error.max < 1e-9 && error.num_matched == 3 && error.errors[1].is_none());

        let stamped = Trajectory::from_poses(&truth).with_stamps(vec![1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        for frame in &mut left {
            frame.time = Some(frame.index as f64 + 1.005);
        }
        left[3].time = Some(9.0);
        let error = spatial_error(&left, 4, "ref.txt", &contents(stamped), KnownConvention::default()).unwrap();
        assert!(error.max < 1e-9 && error.num_matched == 3);
    }

    #[test]
    fn numbers_in_the_place_of_times_are_matched_by_order_and_other_times_are_refused() {
        let truth: Vec<Pose3> = (0..5).map(|i| pose(f64::from(i), 0.1)).collect();
        let mut timed = frames(&truth.iter().copied().map(Some).collect::<Vec<_>>());
        for frame in &mut timed {
            frame.time = Some(1.6e9 + 0.1 * frame.index as f64);
        }
        let compared = |stamps: [f64; 5]| {
            let reference = contents(Trajectory::from_poses(&truth).with_stamps(stamps.to_vec()).unwrap());
            spatial_error(&timed, 5, "ref.txt", &reference, KnownConvention::default())
        };
        let error = compared([0.0, 1.0, 2.0, 3.0, 4.0]).unwrap();
        assert!(error.max < 1e-9 && error.num_matched == 5);
        let refused = compared([0.0, 0.1, 0.2, 0.3, 0.4]).unwrap_err().to_string();
        assert!(refused.contains("No time of the estimate"), "{refused}");
    }

    #[test]
    fn frames_of_a_longer_recording_are_paired_by_their_numbers() {
        let truth: Vec<Pose3> = (0..9).map(|i| pose(0.1 * f64::from(i * i), 0.1 * f64::from(i))).collect();
        // Numbers of frames, their poses' places in the truth, and what is said.
        let compared = |numbers: [usize; 4], base: usize, reference: Trajectory| {
            let mut taken = frames(&numbers.map(|number| Some(truth[number - base])));
            for (frame, number) in taken.iter_mut().zip(numbers) {
                frame.number = Some(number);
            }
            spatial_error(&taken, 4, "ref.txt", &contents(reference), KnownConvention::default())
        };
        let rows = || Trajectory::from_poses(&truth);
        let error = compared([0, 2, 5, 8], 0, rows()).unwrap();
        assert!(error.max < 1e-9 && error.convention.ends_with("from 0"), "{}", error.convention);
        let error = compared([1, 3, 6, 9], 1, rows()).unwrap();
        assert!(error.max < 1e-9 && error.convention.ends_with("from 1"));
        // Both may be: the poses tell.
        assert!(compared([1, 3, 5, 7], 1, rows()).unwrap().convention.ends_with("from 1"));
        assert!(compared([1, 3, 5, 7], 0, rows()).unwrap().convention.ends_with("from 0"));
        let stamped = rows().with_stamps((3..12).map(f64::from).collect()).unwrap();
        let error = compared([3, 5, 7, 11], 3, stamped).unwrap();
        assert!(error.max < 1e-9 && error.convention.ends_with("by number"));
        for numbers in [[0, 2, 5, 10], [5, 2, 3, 4]] {
            let mut taken = frames(&[Some(truth[0]); 4]);
            taken.iter_mut().zip(numbers).for_each(|(frame, number)| frame.number = Some(number));
            assert!(spatial_error(&taken, 4, "ref.txt", &contents(rows()), KnownConvention::default()).is_err());
        }
        // In the middle of a run there are fewer frames than poses, of a reference that is too short as well.
        let mut first = frames(&[Some(truth[0]), Some(truth[1])]);
        first.iter_mut().zip(0..).for_each(|(frame, number)| frame.number = Some(number));
        assert!(spatial_error(&first, 20, "ref.txt", &contents(rows()), KnownConvention::default()).is_err());
        let names = ["depth/frame-000012.depth.png", "7.pcd", "a2/b", "scan_1_02.png"].map(number_in_name);
        assert_eq!(names, [Some(12), Some(7), None, Some(2)]);
    }

    #[test]
    fn positions_in_millimetres_become_metres() {
        let truth: Vec<Pose3> = (0..30).map(|i| pose(0.2 * f64::from(i), 0.1 * f64::from(i))).collect();
        let mut reference = Trajectory::from_poses(&truth);
        reference.positions.iter_mut().for_each(|position| *position *= 1000.0);
        let estimate = frames(&truth.iter().copied().map(Some).collect::<Vec<_>>());
        let error = spatial_error(&estimate, 30, "ref.txt", &contents(reference), KnownConvention::default()).unwrap();
        assert!(error.max < 1e-9 && error.convention.ends_with("positions in millimetres"), "{}", error.convention);
    }
}
