//! Frames that are no part of the map yet: they are tried again when more of it is known.

use std::collections::VecDeque;

use crate::geometry::Pose3;
use crate::registration::prepared_surfels::PreparedSurfels;

/// So many are kept, the latest: a frame takes a megabyte.
const MOST: usize = 40;

/// A frame that waits to be tried again.
#[derive(Clone)]
pub(super) struct UnregisteredFrame {
    /// Its number among all frames.
    pub(super) number: u32,
    pub(super) frame: PreparedSurfels,
    /// Where it seemed to be.
    pub(super) T_world_sensor: Pose3,
}

/// Those of them that are kept, in their order.
#[derive(Clone, Default)]
pub(super) struct UnregisteredFrames {
    frames: VecDeque<UnregisteredFrame>,
}

impl UnregisteredFrames {
    pub(super) fn push(&mut self, number: u32, frame: &PreparedSurfels, T_world_sensor: Pose3) {
        if self.frames.len() == MOST {
            self.frames.pop_front();
        }
        self.frames.push_back(UnregisteredFrame { number, frame: frame.clone(), T_world_sensor });
    }

    pub(super) fn numbers(&self) -> Vec<u32> {
        self.frames.iter().map(|left| left.number).collect()
    }

    pub(super) fn get(&self, number: u32) -> Option<&UnregisteredFrame> {
        self.frames.iter().find(|left| left.number == number)
    }

    pub(super) fn remove(&mut self, number: u32) {
        self.frames.retain(|left| left.number != number);
    }

    /// Moves each by `motion` (of the world) of its number.
    pub(super) fn apply_corrections(&mut self, motion: &impl Fn(u32) -> Pose3) {
        for left in &mut self.frames {
            left.T_world_sensor = motion(left.number) * left.T_world_sensor;
        }
    }
}
