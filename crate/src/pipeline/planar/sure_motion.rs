//! How far a robot gets between two scans, by its surest motions, and what cannot be told from chance beyond that.

use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::{FrameEstimate, Link, MIN_FRAMES_KNOWN_MOTION, MeasuredMotion, continues, may_follow};

/// Fewer sure motions do not bound the next one: one in this many is longer than all before.
const MIN_SURE_MOTIONS: usize = 20;

/// Takes registrations without measured motion for implausible that lie further from the scan before than what would continue the
/// log's longest sure motion. Such a place was found by a search over metres and all headings, where one that looks alike is found
/// as well; and the right place cannot be compared with it where the scan, after a turn, sees next to nothing of the map. Those that
/// were doubtful before count as well: the place tells nothing of where loops are to be looked for.
pub fn mark_beyond_sure(motions: &[Option<MeasuredMotion>], estimates: &mut [FrameEstimate]) {
    let sure = (1..estimates.len()).filter(|&frame| is_sure(frame, estimates));
    let distances: Vec<f64> = sure.map(|frame| motion(frame, estimates).translation_norm()).collect();
    if distances.len() < MIN_SURE_MOTIONS {
        return;
    }
    let longest = distances.into_iter().fold(0.0, f64::max);
    for frame in 1..estimates.len() {
        let moved = motion(frame, estimates).translation_norm();
        let is_registered = matches!(estimates[frame].link, Link::Registered | Link::Doubted);
        if motions[frame].is_none() && is_registered && !may_follow(moved, longest) {
            let estimate = &mut estimates[frame];
            estimate.link = Link::Implausible;
            estimate.assessment.doubt(&format!(
                "it lies {moved:.1} m from the scan before, and the longest step that is sure is {longest:.1} m: the place may only look alike"
            ));
        }
    }
}

/// The motion to a frame from the one before.
fn motion(frame: usize, estimates: &[FrameEstimate]) -> Pose2 {
    estimates[frame - 1].T_world_sensor.inverse() * estimates[frame].T_world_sensor
}

/// Whether a registration continues the motion of registrations before it.
fn is_sure(frame: usize, estimates: &[FrameEstimate]) -> bool {
    frame > MIN_FRAMES_KNOWN_MOTION
        && (frame - MIN_FRAMES_KNOWN_MOTION..=frame).all(|frame| estimates[frame].link == Link::Registered)
        && continues(&motion(frame - 1, estimates), &motion(frame, estimates))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector2};

    use super::*;
    use crate::odometry::assessment::{Assessment, Status};

    /// A chain of these motions, each registered.
    fn chain(motions: &[Pose2]) -> Vec<FrameEstimate> {
        let mut T_world_sensor = Pose2::identity();
        let estimate = |motion: &Pose2| {
            T_world_sensor *= *motion;
            FrameEstimate {
                T_world_sensor,
                registration: None,
                assessment: Assessment::first(),
                link: Link::Registered,
                information: Matrix3::zeros(),
                references: Vec::new(),
            }
        };
        motions.iter().map(estimate).collect()
    }

    fn implausible(estimates: &[FrameEstimate]) -> Vec<usize> {
        (0..estimates.len()).filter(|&frame| estimates[frame].link == Link::Implausible).collect()
    }

    /// Steps of a metre, a turn on the spot, and two steps elsewhere under another heading (m): the second is 30 scans later.
    fn drive(num_before: usize, elsewhere: [f64; 2]) -> Vec<Pose2> {
        let step = |count: usize| vec![Pose2::translation(1.0, 0.0); count];
        let jump = |distance: f64| vec![Pose2::new(Vector2::new(0.0, distance), 1.7)];
        let turn = vec![Pose2::new(Vector2::new(0.02, 0.0), -0.5); 3];
        [step(num_before), turn, jump(elsewhere[0]), step(30), jump(elsewhere[1]), step(2)].concat()
    }

    #[test]
    fn a_step_that_would_continue_no_sure_motion_is_implausible() {
        let mut estimates = chain(&drive(30, [1.75, 2.9]));
        let unmeasured = vec![None; estimates.len()];
        mark_beyond_sure(&unmeasured, &mut estimates);
        assert_eq!(implausible(&estimates), [64], "0.3 m and half of the metre more than a metre may follow one");
        let Assessment { status, reason, .. } = &estimates[64].assessment;
        assert_eq!(*status, Status::Doubtful);
        assert!(reason.contains("2.9 m from the scan before") && reason.contains("sure is 1.0 m"), "{reason}");
    }

    #[test]
    fn motions_later_in_the_log_count_and_doubted_ones_do_not() {
        let mut estimates = chain(&drive(3, [2.9, 2.9]));
        estimates[37].link = Link::Doubted;
        estimates[37].assessment.doubt("people stand in the way");
        let unmeasured = vec![None; estimates.len()];
        mark_beyond_sure(&unmeasured, &mut estimates);
        assert_eq!(implausible(&estimates), [6, 37]);
        assert_eq!(estimates[37].assessment.reason, "people stand in the way");
    }

    #[test]
    fn a_few_sure_motions_bound_nothing_and_measured_motion_is_not_bounded() {
        let mut few = chain(&[vec![Pose2::translation(1.0, 0.0); 20], drive(0, [2.9, 0.0])[..4].to_vec()].concat());
        let unmeasured = vec![None; few.len()];
        mark_beyond_sure(&unmeasured, &mut few);
        assert!(implausible(&few).is_empty(), "17 sure steps, 2 sure turns");

        let mut measured = chain(&drive(30, [2.9, 2.9]));
        let motion = MeasuredMotion { T_before_sensor: Pose2::identity(), covariance: Matrix3::identity() };
        mark_beyond_sure(&vec![Some(motion); measured.len()], &mut measured);
        assert!(implausible(&measured).is_empty());
    }
}
