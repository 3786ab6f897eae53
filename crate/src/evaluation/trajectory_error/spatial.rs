//! Distance of estimated poses in space to a reference, whatever the reference's conventions.

use nalgebra::Isometry3;

use super::{AlignedError, POSITIONS_ALONE, TrajectoryError};
use crate::error::{Error, Result};
use crate::evaluation::associate::{MAX_TIME_DIFFERENCE, by_time};
use crate::evaluation::convention::{KnownConvention, PoseConvention, interpret};
use crate::geometry::Pose3;
use crate::io::trajectory::{Contents, Trajectory};

/// A frame whose pose was estimated, as far as it is to be compared.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EstimatedFrame {
    /// Its place in the recording, counted from 0.
    pub index: usize,
    /// When it was taken (s), where known.
    pub time: Option<f64>,
    /// `T_world_sensor` (x right, y down, z forward); none where the frame is lost.
    pub T_world_sensor: Option<Pose3>,
    /// Whether the pose is to be trusted.
    pub is_good: bool,
}

/// Compares the frames of a recording of `num_recorded` frames with a reference: by time where both have times, by their
/// index in the recording where the reference has none, or numbers in their place.
///
/// # Errors
/// When the reference has another number of poses than the recording has frames and no times tell which belong together.
pub(crate) fn spatial_error(
    frames: &[EstimatedFrame],
    num_recorded: usize,
    name: &str,
    reference: &Contents,
    known: KnownConvention,
) -> Result<TrajectoryError<Pose3>> {
    let partners = partners(frames, num_recorded, &reference.trajectory)?;
    let matched: Vec<(Pose3, usize)> = frames
        .iter()
        .zip(&partners)
        .filter_map(|(frame, partner)| Some((frame.T_world_sensor?, (*partner)?)))
        .collect();
    let interpreted = interpret(&reference.trajectory, reference.format, &matched, known);
    let positions = &reference.trajectory.positions;
    let (poses, convention) = match interpreted {
        Some((poses, convention)) => (poses, Some(convention)),
        None => (positions.iter().map(|p| Isometry3::translation(p.x, p.y, p.z)).collect(), None),
    };
    let mut good = frames.iter().zip(&partners).filter(|(frame, _)| frame.is_good);
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
    Ok(TrajectoryError::new(name, &errors, moved, reading).with_alignment(AlignedError::in_space(&pairs), &pairs))
}

/// Index in the reference of each frame's partner.
fn partners(frames: &[EstimatedFrame], num_recorded: usize, reference: &Trajectory) -> Result<Vec<Option<usize>>> {
    let times: Option<Vec<f64>> = frames.iter().map(|frame| frame.time).collect();
    if let (Some(stamps), Some(times)) = (&reference.stamps, times) {
        match by_time(stamps, &times, MAX_TIME_DIFFERENCE, 0.0) {
            Ok(pairs) => {
                let mut partners = vec![None; frames.len()];
                for pair in pairs {
                    partners[pair.estimate] = Some(pair.reference);
                }
                return Ok(partners);
            }
            // Numbers in the place of times tell the order of the poses alone.
            Err(error) if !stamps.windows(2).all(|pair| pair[1] - pair[0] == 1.0) => return Err(error),
            Err(_) => {}
        }
    }
    if reference.num_rows() == num_recorded {
        return Ok(frames.iter().map(|frame| reference.index_of_row(frame.index)).collect());
    }
    let problem =
        format!("The reference has {} poses, but the recording has {num_recorded} frames", reference.num_rows());
    let remedy = if reference.num_rows() > num_recorded {
        "Give the poses of these frames alone, or drop all frames of the recording"
    } else {
        "Give one pose for each frame"
    };
    Err(Error::whole(problem, remedy))
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
}
