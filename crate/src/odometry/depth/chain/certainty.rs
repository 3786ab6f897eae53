//! Certainty: every member is as far off as the covariances of the registrations before it add up to. Members are good where that is little.

use std::ops::Range;

use nalgebra::Matrix3;

use super::super::hypotheses::{CONVERGING_DISTANCE, MIN_DISTANCE, REACH_ALL_AROUND, SAME_POSE_DISTANCE};
use super::super::pose_hypothesis::PoseHypothesis;
use super::{Chain, Member};
use crate::geometry::Pose3;
use crate::geometry::pose_distance::pose_distance;
use crate::odometry::assessment::Status;

/// The frames with uncertain positions that no later frame has resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct UnresolvedFrames {
    /// In the order of registration.
    pub frames: Vec<UnresolvedFrame>,
}

/// One of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnresolvedFrame {
    /// Its number in the order of registration, from 0.
    pub number: u32,
    /// Standard deviation (m) that it and those before it leave to the frames after it, along the direction where it is largest;
    /// none where nothing bounds it.
    pub sigma: Option<f64>,
}

impl Chain {
    /// Takes what is uncertain before the members into their assessments. Returns those whose assessment has changed.
    pub(in super::super) fn reassess(&mut self) -> Vec<Member> {
        let certain = largest_certain_range(&self.members);
        let mut changed = Vec::new();
        for (index, member) in self.members.iter_mut().enumerate() {
            let mut assessment = member.registered.clone();
            match (certain.contains(&index), certain.start) {
                (true, _) => {}
                (false, 0) => assessment.mark_dependent_on_uncertain_pose(),
                (false, _) => assessment.mark_outside_majority(),
            }
            if assessment != member.assessment {
                member.assessment = assessment;
                changed.push(member.clone());
            }
        }
        changed
    }

    /// The members with uncertain positions that no later frame has resolved; `None` where there are none.
    pub(in super::super) fn unresolved(&self) -> Option<UnresolvedFrames> {
        let mut sum = Some(Matrix3::zeros());
        let open = self.members.iter().filter(|member| !member.is_certain()).map(|member| {
            sum = sum.zip(member.open).map(|(sum, open)| sum + open);
            UnresolvedFrame { number: member.number, sigma: sum.as_ref().map(largest_sigma) }
        });
        let frames: Vec<UnresolvedFrame> = open.collect();
        (!frames.is_empty()).then_some(UnresolvedFrames { frames })
    }

    /// Covariance (m^2) of the next frame's position, where its pose is not accepted; `None` where nothing bounds it. The camera
    /// comes no farther than it did before, and in a video it stays near the prediction.
    pub(super) fn open_covariance(&self, hypothesis: &PoseHypothesis) -> Option<Matrix3<f64>> {
        if hypothesis.second_basin.is_some() {
            return None;
        }
        let num_steps = 1 + self.num_rejected;
        if let Some(sigma) = hypothesis.degenerate_sigma {
            // The camera and the pose are both within reach of the last pose: a uniform distribution.
            let direction = hypothesis.weakest.direction;
            let step = hypothesis.T_world_sensor().translation.vector - self.last.T_world_sensor.translation.vector;
            let largest_error = self.motion_prior.reach(num_steps).map(|reach| reach + step.dot(&direction).abs());
            let sigma = largest_error.map_or(sigma, |largest| sigma.min(largest / 3.0_f64.sqrt()));
            return Some(direction * direction.transpose() * (sigma * sigma));
        }
        let radius = if hypothesis.is_tracked_on_map {
            SAME_POSE_DISTANCE
        } else if self.stays_near(1) && self.is_near_prediction(hypothesis.T_world_sensor()) {
            f64::from(num_steps) * CONVERGING_DISTANCE
        } else {
            return None;
        };
        // Of a uniform distribution in a ball.
        Some(Matrix3::from_diagonal_element(radius * radius / 5.0))
    }

    /// Whether a frame goes on from the one before it as in a video, though the evidence for its pose does not suffice: no other
    /// pose is within reach of the camera.
    pub(in super::super) fn goes_on(&self, near: &PoseHypothesis) -> bool {
        self.num_rejected == 0
            && self.stays_near(1)
            && self.is_near_prediction(near.T_world_sensor())
            && near.registration.converged
            && !near.is_degenerate()
            && near.assessment().status != Status::Lost
    }

    /// Whether the camera stays within reach of a search all around in so many steps, as in a video.
    pub(super) fn stays_near(&self, num_steps: u32) -> bool {
        self.motion_prior.reach_with_rotation(num_steps).is_some_and(|reach| reach < REACH_ALL_AROUND)
    }

    /// Whether a pose is as near the last one or the constant-velocity prediction as hypotheses that converge to the same pose, for each
    /// frame since.
    pub(super) fn is_near_prediction(&self, T_world_sensor: &Pose3) -> bool {
        let near = f64::from(1 + self.num_rejected) * CONVERGING_DISTANCE;
        self.last.predictions().iter().any(|T| pose_distance(T, T_world_sensor) < near)
    }
}

/// The consecutive members among which the covariances add up to little, two standard deviations being less than the distance to another
/// position (in flats, positions that were right to 5 cm had a standard deviation of up to 0.27 m; in a bare cube and before tiles, where
/// they were wrong by 0.4 m and more, it was 0.4 to 2 m): the first ones, or those with the most good members, if
/// these are most of all and it is known roughly how they lie to the first ones.
fn largest_certain_range(members: &[Member]) -> Range<usize> {
    let is_good = |member: &Member| usize::from(member.registered.status == Status::Good);
    let (mut start, mut sum, mut num_good) = (0, Matrix3::zeros(), 0);
    let (mut first, mut num_first, mut best, mut num_best) = (0..0, 0, 0..0, 0);
    for (index, member) in members.iter().enumerate() {
        let Some(open) = member.open else { break };
        (sum, num_good) = (sum + open, num_good + is_good(member));
        while 2.0 * largest_sigma(&sum) > MIN_DISTANCE {
            num_good -= is_good(&members[start]);
            start += 1;
            // The error of the first one is that of all of them.
            sum -= members[start].open.unwrap_or_default();
        }
        if start == 0 {
            (first, num_first) = (0..index + 1, num_good);
        }
        if num_good > num_best {
            (best, num_best) = (start..index + 1, num_good);
        }
    }
    if num_best > num_first && 2 * num_best > members.len() { best } else { first }
}

/// The standard deviation (m) along the direction where it is largest.
fn largest_sigma(covariance: &Matrix3<f64>) -> f64 {
    covariance.symmetric_eigenvalues().max().max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::odometry::assessment::Assessment;

    /// Of members whose positions along x are open by these standard deviations (m); `None` where nothing bounds them.
    fn certain_range(sigmas: &[Option<f64>]) -> Range<usize> {
        let member = |(number, sigma): (u32, &Option<f64>)| {
            let mut registered = Assessment::first();
            if *sigma != Some(0.0) {
                registered.doubt("uncertain");
            }
            let open = sigma.map(|sigma| Matrix3::from_diagonal(&Vector3::new(sigma * sigma, 0.0, 0.0)));
            Member { open, ..Member::new(number, Pose3::identity(), registered) }
        };
        largest_certain_range(&(0..).zip(sigmas).map(member).collect::<Vec<Member>>())
    }

    #[test]
    fn frames_are_certain_until_covariances_add_up() {
        assert_eq!(certain_range(&[Some(0.0), Some(0.0)]), 0..2);
        assert_eq!(certain_range(&[Some(0.0), Some(0.2), Some(0.0)]), 0..3);
        assert_eq!(certain_range(&[Some(0.0), Some(0.0), Some(0.2), Some(0.0), Some(0.2), Some(0.0)]), 0..4);
    }

    #[test]
    fn frames_after_an_uncertain_one_are_certain_where_they_are_most_of_all() {
        assert_eq!(certain_range(&[Some(0.0), Some(0.3), Some(0.0), Some(0.0)]), 0..1);
        assert_eq!(certain_range(&[Some(0.0), Some(0.3), Some(0.0), Some(0.0), Some(0.0)]), 1..5);
        assert_eq!(certain_range(&[Some(0.0), Some(0.3), Some(0.2), Some(0.0), Some(0.0), Some(0.0), Some(0.0)]), 1..7);
        let drifting = [0.0, 0.3, 0.0, 0.2, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0].map(Some);
        assert_eq!(certain_range(&drifting), 3..11, "two small errors add up");
        // Nothing tells how they lie to those before.
        assert_eq!(certain_range(&[Some(0.0), None, Some(0.0), Some(0.0), Some(0.0), Some(0.0)]), 0..1);
    }
}
