//! The result against the calibrated odometry: stretches of the path along which the two contradict each other.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::mahalanobis;
use crate::geometry::quantile::quantile;
use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::{FrameEstimate, MeasuredMotion};

/// Lengths of the stretches that are compared (m). Wheels that slip for a moment contradict a shorter one, and are right again
/// over these.
const STRETCH_LENGTHS: [f64; 3] = [5.0, 10.0, 20.0];
/// Squared Mahalanobis distance beyond which a stretch contradicts the odometry. Of the six logs at hand no stretch does (17.3 at
/// most); where the ground ahead seems to move on with the robot, 30 and more.
const CONTRADICTING: f64 = mahalanobis::ONE_IN_TEN_THOUSAND;
/// Odometry of which more than a tenth of the stretches lie beyond this has errors that add up along the path: its distances are
/// scaled down to it.
const USUAL: f64 = mahalanobis::ONE_IN_TEN;
/// Fewer stretches than this say nothing of what is usual.
const MIN_STRETCHES: usize = 50;

/// Doubts all frames along stretches whose motion by `poses` (`T_world_sensor`) contradicts the odometry: several steps in a row
/// may each be too short by as much as the odometry's noise explains, and loops confirm what is wrong in both rounds.
pub fn doubt_contradicted(motions: &[Option<MeasuredMotion>], poses: &[Pose2], estimates: &mut [FrameEstimate]) {
    let path = MeasuredPath::new(motions);
    for length in STRETCH_LENGTHS {
        let stretches: Vec<Stretch> =
            (0..motions.len()).filter_map(|first| path.stretch(first, length, poses)).collect();
        let mut distances: Vec<f64> = stretches.iter().map(|stretch| stretch.sq_distance).collect();
        let usual = quantile(&mut distances, 0.9).filter(|_| stretches.len() >= MIN_STRETCHES);
        let scale = usual.map_or(1.0, |distance| (distance / USUAL).max(1.0));
        for stretch in stretches.iter().filter(|stretch| stretch.sq_distance > scale * CONTRADICTING) {
            let reason = stretch.contradiction();
            for estimate in &mut estimates[stretch.first..=stretch.last] {
                estimate.assessment.doubt(&reason);
            }
        }
    }
}

/// A stretch of the path, from frame to frame.
struct Stretch {
    first: usize,
    last: usize,
    /// The motion by the result.
    estimated: Pose2,
    /// The motion by the odometry.
    measured: Pose2,
    /// Squared Mahalanobis distance of the two.
    sq_distance: f64,
}

impl Stretch {
    fn contradiction(&self) -> String {
        let told = |motion: &Pose2| {
            let (way, turn) = (motion.translation_norm(), motion.rotation.angle().to_degrees());
            format!("{way:.2} m and {turn:.1} degrees")
        };
        let (estimated, measured) = (told(&self.estimated), told(&self.measured));
        format!(
            "between frames {} and {} the result moves by {estimated}, the odometry by {measured}: they contradict each other",
            self.first, self.last
        )
    }
}

/// The odometry added up, so that the motion between any two frames and its covariance are differences of two sums.
struct MeasuredPath {
    poses: Vec<Pose2>,
    /// Sums of the steps' covariances, by a perturbation on the left of the pose.
    covariances: Vec<Matrix3<f64>>,
    /// Lengths of the path up to each frame (m).
    lengths: Vec<f64>,
    /// For each frame the first one from which on no motion is missing.
    unbroken_since: Vec<usize>,
}

impl MeasuredPath {
    fn new(motions: &[Option<MeasuredMotion>]) -> Self {
        let mut path = Self {
            poses: Vec::with_capacity(motions.len()),
            covariances: Vec::with_capacity(motions.len()),
            lengths: Vec::with_capacity(motions.len()),
            unbroken_since: Vec::with_capacity(motions.len()),
        };
        let (mut pose, mut covariance, mut length, mut since) = (Pose2::identity(), Matrix3::zeros(), 0.0, 0);
        for (frame, motion) in motions.iter().enumerate() {
            if let Some(motion) = motion.as_ref().filter(|_| frame > 0) {
                let adjoint = pose.adjoint();
                covariance += adjoint * motion.covariance * adjoint.transpose();
                pose *= motion.T_before_sensor;
                length += motion.T_before_sensor.translation_norm();
            } else {
                since = frame;
            }
            path.poses.push(pose);
            path.covariances.push(covariance);
            path.lengths.push(length);
            path.unbroken_since.push(since);
        }
        path
    }

    /// The stretch of this length (m) from a frame on; `None` where the path ends before, or a motion in it is missing.
    fn stretch(&self, first: usize, length: f64, poses: &[Pose2]) -> Option<Stretch> {
        let end = self.lengths[first] + length;
        let last = first + self.lengths[first..].partition_point(|&reached| reached < end);
        if last == self.lengths.len() || self.unbroken_since[last] > first {
            return None;
        }
        let measured = self.poses[first].inverse() * self.poses[last];
        let estimated = poses[first].inverse() * poses[last];
        let adjoint = self.poses[first].inverse().adjoint();
        let covariance = adjoint * (self.covariances[last] - self.covariances[first]) * adjoint.transpose();
        let off: Vector3<f64> = (estimated * measured.inverse()).log();
        let sq_distance = mahalanobis::squared(&off, &covariance);
        Some(Stretch { first, last, estimated, measured, sq_distance })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::odometry::assessment::{Assessment, Status};
    use crate::odometry::planar::Link;
    use crate::odometry::planar::information::chained;
    use crate::odometry::planar::motion_noise::MotionNoise;

    const NOISE: MotionNoise = MotionNoise { translation_scale: 1.0, rotation_scale: 1.0 };

    /// What the odometry tells of these steps.
    fn measured(steps: &[Pose2]) -> Vec<Option<MeasuredMotion>> {
        let motion = |step: &Pose2| MeasuredMotion { T_before_sensor: *step, covariance: NOISE.covariance(step) };
        steps.iter().map(|step| Some(motion(step))).collect()
    }

    /// The frames that are doubted after a drive in `steps`, of which the odometry measured `of_odometry`.
    fn doubted(steps: &[Pose2], of_odometry: &[Option<MeasuredMotion>]) -> Vec<usize> {
        let mut pose = Pose2::identity();
        let poses: Vec<Pose2> = std::iter::once(pose)
            .chain(steps[1..].iter().map(|step| {
                pose *= step;
                pose
            }))
            .collect();
        let estimate = |pose: &Pose2| FrameEstimate {
            T_world_sensor: *pose,
            registration: None,
            assessment: Assessment::first(),
            link: Link::Registered,
            information: Matrix3::identity(),
            references: Vec::new(),
        };
        let mut estimates: Vec<FrameEstimate> = poses.iter().map(estimate).collect();
        doubt_contradicted(of_odometry, &poses, &mut estimates);
        (0..estimates.len()).filter(|&frame| estimates[frame].assessment.status == Status::Doubtful).collect()
    }

    /// A drive of 100 steps of a metre, with a bend.
    fn drive() -> Vec<Pose2> {
        (0..100).map(|step| Pose2::exp(&Vector3::new(if step % 20 < 4 { 0.3 } else { 0.0 }, 1.0, 0.0))).collect()
    }

    fn scaled(steps: &[Pose2], range: std::ops::Range<usize>, scale: f64) -> Vec<Pose2> {
        let mut steps = steps.to_vec();
        for step in &mut steps[range] {
            step.translation.vector *= scale;
        }
        steps
    }

    #[test]
    fn a_result_that_falls_behind_the_odometry_step_by_step_is_doubted_along_that_stretch() {
        let truth = drive();
        let of_odometry = measured(&truth);
        assert_eq!(doubted(&truth, &of_odometry), Vec::<usize>::new());
        // 0.25 m a step are 3.5 standard deviations each, 9 over seven steps.
        let short = doubted(&scaled(&truth, 50..57, 0.75), &of_odometry);
        assert!((50..57).all(|frame| short.contains(&frame)), "{short:?}");
        assert!(short.iter().all(|frame| (30..78).contains(frame)), "{short:?}");
    }

    #[test]
    fn a_momentary_slip_of_the_wheels_is_not_doubted() {
        let truth = drive();
        let of_odometry = measured(&scaled(&truth, 50..51, 1.4));
        assert_eq!(doubted(&truth, &of_odometry), Vec::<usize>::new());
    }

    #[test]
    fn errors_that_add_up_all_along_the_path_are_the_odometry_s_own() {
        let truth = drive();
        let of_odometry = measured(&scaled(&truth, 0..100, 1.5));
        assert_eq!(doubted(&truth, &of_odometry), Vec::<usize>::new());
        let few = doubted(&truth[..15], &of_odometry[..15]);
        assert!(!few.is_empty(), "ten stretches do not tell what is usual");
    }

    #[test]
    fn stretches_with_a_gap_are_not_compared() {
        let truth = drive();
        let mut of_odometry = measured(&truth);
        for gap in (2..100).step_by(4) {
            of_odometry[gap] = None;
        }
        assert_eq!(doubted(&scaled(&truth, 50..57, 0.5), &of_odometry), Vec::<usize>::new());
    }

    #[test]
    fn the_covariance_of_a_stretch_is_that_of_its_steps_one_after_the_other() {
        let steps = drive();
        let motions = measured(&steps);
        let path = MeasuredPath::new(&motions);
        let (first, last) = (3, 27);
        let mut sum = (Pose2::identity(), Matrix3::zeros());
        for motion in motions[first + 1..=last].iter().flatten() {
            sum.1 = chained((&sum.0, &sum.1), &motion.covariance);
            sum.0 *= motion.T_before_sensor;
        }
        let poses = vec![Pose2::identity(); steps.len()];
        let stretch = path.stretch(first, 23.9, &poses).unwrap();
        assert_eq!((stretch.first, stretch.last), (first, last));
        assert!((stretch.measured.inverse() * sum.0).log().norm() < 1e-12);
        let off = stretch.measured.inverse().log();
        let expected = off.dot(&(sum.1.try_inverse().unwrap() * off));
        assert!((stretch.sq_distance / expected - 1.0).abs() < 1e-9, "{} {expected}", stretch.sq_distance);
    }
}
