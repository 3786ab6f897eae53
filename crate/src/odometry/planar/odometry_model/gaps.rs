//! Gaps of the odometry.

use super::super::MeasuredMotion;
use super::super::UNKNOWN_SIGMA;
use super::super::information::sigmas;
use super::super::motion_noise::MotionChange;
use super::OdometryModel;
use crate::geometry::{Pose2, RigidMotion};

impl OdometryModel {
    /// Fills gaps of the odometry between two of its poses (of the sensor) in equal steps, as far as these are known well enough:
    /// by how much steps differ from that where the odometry tells them. Nothing leads to a frame with which another recording begins.
    #[must_use]
    pub fn bridged(mut self, poses: &[Option<Pose2>], begins_recording: impl Fn(usize) -> bool) -> Self {
        let known: Vec<usize> = (0..poses.len()).filter(|&frame| poses[frame].is_some()).collect();
        let part = |first: usize, last: usize, num_steps: usize| {
            let T_first_last = poses[first]?.inverse() * poses[last]?;
            Some(Pose2::exp(&(T_first_last.log() * (num_steps as f64 / (last - first) as f64))))
        };
        for pair in
            known.windows(2).filter(|pair| pair[1] - pair[0] > 1 && !(pair[0] + 1..=pair[1]).any(&begins_recording))
        {
            let (first, last) = (pair[0], pair[1]);
            let length = last - first;
            let Some(step) = part(first, last, 1) else { continue };
            let half = length / 2;
            let to_middle = |first: usize| {
                Some((part(first, first + length, half)?, poses[first]?.inverse() * poses[first + half]?))
            };
            let Some(change) = MotionChange::of((0..poses.len() - length).filter_map(to_middle)) else { continue };
            let bridge = MeasuredMotion {
                T_before_sensor: step,
                covariance: self.noise.covariance(&step) + change.covariance(&step),
            };
            let (heading, position) = sigmas(&step, &bridge.covariance);
            if heading < UNKNOWN_SIGMA.0 && position < UNKNOWN_SIGMA.1 {
                self.steps[first + 1..=last].fill(Some(bridge));
                self.bridged[first + 1..=last].fill(Some(change));
            }
        }
        self
    }
}
