//! Calibration of measured motion against the registered chain: its scale, its noise, and where the two contradict each other.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::mahalanobis;
use crate::geometry::quantile::quantile;
use crate::geometry::{Pose2, RigidMotion};
use crate::odometry::planar::information::{chained, seen_from, sigmas, softened_covariance};
use crate::odometry::planar::motion_noise::{Comparison, MotionNoise};
use crate::odometry::planar::{FrameEstimate, Link, MeasuredMotion, REGISTRATION_SIGMA};

/// Fewer registered steps than this say nothing of the size of what is measured.
const MIN_CALIBRATING: usize = 50;
/// A step counts that is registered to this share of what the measurement is known to; ...
const CALIBRATING_SHARE: f64 = 0.5;
/// ... it tells the size where it goes this far (m).
const CALIBRATING_WAY: f64 = 0.1;
/// Registered steps are themselves too long or too short by up to this share: 0.1 to 0.4 % in the median of four logs.
const REGISTERED_SCALE: f64 = 0.005;
/// What a registration leaves open of a direction that nothing constrains (rad, m).
const UNREGISTERED: (f64, f64) = (1.0, 1.0);
/// Chain and measured motion are compared over up to so many steps: each may be likely, and all of them short together.
const MAX_STEPS: usize = 5;
/// They part where their squared Mahalanobis distance is larger.
const PARTED: f64 = mahalanobis::ONE_IN_THOUSAND;

/// The motions with the scale and the noise that all the registered steps of a chain give them. Wheels are off by a few parts in a
/// hundred, which adds up over a way that the walls leave open.
pub fn calibrated(motions: &[Option<MeasuredMotion>], estimates: &[FrameEstimate]) -> Vec<Option<MeasuredMotion>> {
    let steps = (1..motions.len()).filter_map(|frame| registered_step(frame, motions, estimates));
    let mut comparisons: Vec<Comparison> = steps.collect();
    let ratio = |comparison: &Comparison| {
        let measured = comparison.steps[0].translation.vector;
        let ratio = comparison.registered.translation.vector.dot(&measured) / measured.norm_squared();
        (measured.norm() > CALIBRATING_WAY).then_some(ratio)
    };
    let mut ratios: Vec<f64> = comparisons.iter().filter_map(ratio).collect();
    let Some(median) = quantile(&mut ratios, 0.5).filter(|_| ratios.len() >= MIN_CALIBRATING) else {
        return motions.to_vec();
    };
    let off = median - 1.0;
    let scale = 1.0 + off.signum() * (off.abs() - REGISTERED_SCALE).max(0.0);
    let scaled = |motion: &Pose2| Pose2 { translation: (motion.translation.vector * scale).into(), ..*motion };
    for comparison in &mut comparisons {
        comparison.steps[0] = scaled(&comparison.steps[0]);
    }
    let noise = MotionNoise::fitted(&comparisons);
    let calibrated = |motion: &MeasuredMotion| {
        let T_before_sensor = scaled(&motion.T_before_sensor);
        MeasuredMotion { T_before_sensor, covariance: noise.covariance(&T_before_sensor) }
    };
    motions.iter().map(|motion| motion.as_ref().map(calibrated)).collect()
}

/// A measured step with its registration, where that one tells more than the measurement.
fn registered_step(
    frame: usize,
    motions: &[Option<MeasuredMotion>],
    estimates: &[FrameEstimate],
) -> Option<Comparison> {
    let MeasuredMotion { T_before_sensor, covariance } = motions[frame].as_ref()?;
    let estimate = Some(&estimates[frame]).filter(|estimate| estimate.link == Link::Registered)?;
    let T_world_before = &estimates[frame - 1].T_world_sensor;
    let position = |covariance: &Matrix3<f64>| sigmas(T_before_sensor, covariance).1;
    let is_telling = position(&registered_covariance(frame, estimates)) < CALIBRATING_SHARE * position(covariance);
    let T_world_registered = estimate.registration.as_ref()?.T_target_source;
    is_telling.then(|| Comparison {
        steps: vec![*T_before_sensor],
        registered: T_world_before.inverse() * T_world_registered,
    })
}

/// Covariance of a frame's registered motion from the frame before.
fn registered_covariance(frame: usize, estimates: &[FrameEstimate]) -> Matrix3<f64> {
    let information = seen_from(&estimates[frame].information, &estimates[frame - 1].T_world_sensor);
    softened_covariance(&information, REGISTRATION_SIGMA, UNREGISTERED)
}

/// Marks as doubtful the least likely step of every stretch along which chain and measured motion contradict each other, and adds
/// their difference to the covariance of its measured motion: the ground ahead of a robot may seem to move with it, or wheels may
/// slip, and nothing shows which.
pub fn doubt_where_parted(motions: &mut [Option<MeasuredMotion>], estimates: &mut [FrameEstimate]) {
    let parted: Vec<Parted> = (1..motions.len()).filter_map(|last| parted(last, motions, estimates)).collect();
    for Parted { frame, num_steps, off, distance } in parted {
        let estimate = &mut estimates[frame];
        estimate.link = Link::Doubted;
        let heading = off[0].abs().to_degrees();
        estimate.assessment.doubt(&format!(
            "over {num_steps} steps the scans and the measured motion differ by {distance:.2} m and {heading:.1} degrees, and nothing \
             shows which is right"
        ));
        if let Some(motion) = &mut motions[frame] {
            motion.covariance += off * off.transpose();
        }
    }
}

/// A stretch along which chain and measured motion part.
struct Parted {
    /// The step that is least likely.
    frame: usize,
    num_steps: usize,
    /// By a perturbation on the left, rotation first.
    off: Vector3<f64>,
    /// What the ends are apart (m).
    distance: f64,
}

/// The shortest stretch up to this frame along which chain and measured motion part.
fn parted(last: usize, motions: &[Option<MeasuredMotion>], estimates: &[FrameEstimate]) -> Option<Parted> {
    let (mut T_measured, mut covariance) = (Pose2::identity(), Matrix3::zeros());
    for first in (1..=last).rev().take(MAX_STEPS) {
        let motion = motions[first].as_ref().filter(|_| estimates[first].link == Link::Registered)?;
        let of_step = motion.covariance + registered_covariance(first, estimates);
        covariance = chained((&motion.T_before_sensor, &of_step), &covariance);
        T_measured = motion.T_before_sensor * T_measured;
        let apart = T_measured * registered_motion(first, last, estimates).inverse();
        if first == last || mahalanobis::squared(&apart.log(), &covariance) < PARTED {
            continue;
        }
        let unlikeliness = |frame: &usize| {
            motions[*frame].as_ref().map_or(0.0, |motion| {
                let apart = motion.T_before_sensor * registered_motion(*frame, *frame, estimates).inverse();
                mahalanobis::squared(&apart.log(), &motion.covariance)
            })
        };
        let frame = (first..=last).max_by(|a, b| unlikeliness(a).total_cmp(&unlikeliness(b)))?;
        let (num_steps, distance) = (last - first + 1, apart.translation_norm());
        return Some(Parted { frame, num_steps, off: apart.log(), distance });
    }
    None
}

/// The motion of the chain over the steps from `first` to `last`.
fn registered_motion(first: usize, last: usize, estimates: &[FrameEstimate]) -> Pose2 {
    estimates[first - 1].T_world_sensor.inverse() * estimates[last].T_world_sensor
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::odometry::assessment::{Assessment, Status};

    /// A chain along x of these steps (m), each registered to a centimetre, and a metre measured for each of them.
    fn chain(steps: &[f64]) -> (Vec<Option<MeasuredMotion>>, Vec<FrameEstimate>) {
        let noise = MotionNoise { translation_scale: 1.0, rotation_scale: 1.0 };
        let T_before_sensor = Pose2::translation(1.0, 0.0);
        let measured = MeasuredMotion { T_before_sensor, covariance: noise.covariance(&T_before_sensor) };
        let mut x = 0.0;
        let estimate = |step: &f64| {
            x += step;
            FrameEstimate {
                T_world_sensor: Pose2::translation(x, 0.0),
                registration: None,
                assessment: Assessment::first(),
                link: Link::Registered,
                information: Pose2::translation(-x, 0.0)
                    .adjoint()
                    .tr_mul(&(Matrix3::from_diagonal(&Vector3::repeat(1e4)) * Pose2::translation(-x, 0.0).adjoint())),
                references: Vec::new(),
            }
        };
        (vec![Some(measured); steps.len()], steps.iter().map(estimate).collect())
    }

    #[test]
    fn steps_that_are_likely_one_by_one_and_short_together_are_doubted() {
        let mut steps = vec![1.0; 20];
        steps[8..13].copy_from_slice(&[0.905, 0.905, 0.895, 0.905, 0.905]);
        let (mut motions, mut estimates) = chain(&steps);
        doubt_where_parted(&mut motions, &mut estimates);
        let doubted: Vec<usize> = (0..20).filter(|&frame| estimates[frame].link == Link::Doubted).collect();
        assert_eq!(doubted, [10], "the step that is off most");
        assert_eq!(estimates[10].assessment.status, Status::Doubtful);
        assert!(estimates[10].assessment.reason.contains("over 5 steps"), "{}", estimates[10].assessment.reason);
        let along = |frame: usize| motions[frame].as_ref().unwrap().covariance[(1, 1)].sqrt();
        assert!(along(10) > 0.4 && along(9) < 0.1, "{} {}", along(10), along(9));
    }

    #[test]
    fn steps_within_the_noise_are_not() {
        let steps: Vec<f64> = (0..40).map(|step| if step % 2 == 0 { 1.08 } else { 0.92 }).collect();
        let (mut motions, mut estimates) = chain(&steps);
        doubt_where_parted(&mut motions, &mut estimates);
        assert!(estimates.iter().all(|estimate| estimate.link == Link::Registered));
    }
}
