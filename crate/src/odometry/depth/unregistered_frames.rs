//! Frames that are not part of the map yet, the latest within a bound of memory. Relocalization tries them again when the map has grown.

use std::collections::VecDeque;

use super::SpatialEstimate;
use crate::geometry::Pose3;
use crate::map::keyframes::MAX_BYTES;
use crate::odometry::assessment::Assessment;
use crate::registration::prepared_surfels::PreparedSurfels;

/// A frame that waits for relocalization.
#[derive(Clone)]
pub(super) struct UnregisteredFrame {
    /// Its number among all frames.
    pub(super) number: u32,
    pub(super) frame: PreparedSurfels,
    /// The best pose so far, which was not accepted.
    pub(super) T_world_sensor: Pose3,
    /// Why it was not.
    pub(super) assessment: Assessment,
}

/// The stored frames in the order of their numbers.
#[derive(Clone, Default)]
pub(super) struct UnregisteredFrames {
    frames: VecDeque<UnregisteredFrame>,
}

impl UnregisteredFrames {
    pub(super) fn push(&mut self, number: u32, frame: &PreparedSurfels, estimate: &SpatialEstimate) {
        let (T_world_sensor, assessment) = (estimate.T_world_sensor, estimate.assessment.clone());
        self.frames.push_back(UnregisteredFrame { number, frame: frame.clone(), T_world_sensor, assessment });
        while self.frames.iter().map(|stored| stored.frame.num_bytes()).sum::<usize>() > MAX_BYTES {
            self.frames.pop_front();
        }
    }

    pub(super) fn numbers(&self) -> Vec<u32> {
        self.frames.iter().map(|stored| stored.number).collect()
    }

    pub(super) fn get(&self, number: u32) -> Option<&UnregisteredFrame> {
        self.frames.iter().find(|stored| stored.number == number)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &UnregisteredFrame> {
        self.frames.iter()
    }

    pub(super) fn remove(&mut self, number: u32) {
        self.retain(|stored| stored != number);
    }

    /// Removes those whose numbers do not stay.
    pub(super) fn retain(&mut self, stays: impl Fn(u32) -> bool) {
        self.frames.retain(|stored| stays(stored.number));
    }

    /// Moves each by `motion` (of the world) of its number.
    pub(super) fn apply_corrections(&mut self, motion: &impl Fn(u32) -> Pose3) {
        for stored in &mut self.frames {
            stored.T_world_sensor = motion(stored.number) * stored.T_world_sensor;
        }
    }
}
