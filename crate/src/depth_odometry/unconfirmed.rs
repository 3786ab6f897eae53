//! Frames since one whose place is not certain, be it open along a direction or held by little: where that one is off, so
//! are those after it, until one knows from what was seen before all of them where it is.

use super::found::{Found, Reach};
use super::matching::Matching;
use super::seen::Seen;
use super::{DepthOptions, SAME_PLACE};
use crate::camera::surfel_image::SurfelImage;
use crate::geometry::Pose3;
use crate::key_views::apart;

#[derive(Clone)]
pub(super) struct Unconfirmed {
    before: Seen,
    T_world_before: Pose3,
    since: Vec<Since>,
}

#[derive(Clone)]
struct Since {
    number: u32,
    /// Whether its own place is not certain, ...
    is_open: bool,
    /// ... and not only along a direction.
    may_be_elsewhere: bool,
}

/// What a frame tells of those since the open one.
pub(super) enum Told {
    /// It shows too little of what was known before them.
    Nothing,
    /// They have led to where it is by what was known before them.
    Confirmed(Box<Found>),
    /// They have not, and this is where it is.
    Moved(Box<Found>),
}

impl Unconfirmed {
    /// `before` is what was seen before them, and where the last frame was.
    pub(super) fn new(before: Seen, T_world_before: Pose3) -> Self {
        Self { before, T_world_before, since: Vec::new() }
    }

    pub(super) fn before(&self) -> &Seen {
        &self.before
    }

    pub(super) fn into_before(self) -> Seen {
        self.before
    }

    pub(super) fn T_world_before(&self) -> Pose3 {
        self.T_world_before
    }

    /// Takes in a frame; `is_open` if its own place is not certain, and then `is_along` if only along a direction.
    pub(super) fn push(&mut self, number: u32, is_open: bool, is_along: bool) {
        self.since.push(Since { number, is_open, may_be_elsewhere: is_open && !is_along });
    }

    /// Whether those after them may be anywhere, and not only a little off.
    pub(super) fn may_be_elsewhere(&self) -> bool {
        self.since.iter().any(|since| since.may_be_elsewhere)
    }

    pub(super) fn len(&self) -> usize {
        self.since.len()
    }

    /// Whether a frame is where it seemed to be if they have led to where the next one is: its own place must be certain.
    pub(super) fn confirms(&self, number: u32) -> bool {
        self.since.iter().any(|since| since.number == number && !since.is_open)
    }

    /// The numbers of those whose own place is not certain.
    pub(super) fn uncertain(&self) -> Vec<u32> {
        self.since.iter().filter(|since| since.is_open).map(|since| since.number).collect()
    }

    /// What a frame tells that they have led to this place.
    pub(super) fn told_by(&self, frame: &SurfelImage, T_world_found: &Pose3, options: DepthOptions) -> Told {
        let found = Matching::new(&self.before, frame, options).settled(*T_world_found);
        if !found.is_anchored() || !found.is_firm(Reach::Near) {
            return Told::Nothing;
        }
        if apart(&found.registration.T_target_source, T_world_found) > SAME_PLACE {
            return Told::Moved(Box::new(found));
        }
        Told::Confirmed(Box::new(found))
    }

    /// How they are moved by what a frame after them tells: those whose own place is not certain share it, all others are off by
    /// all that came before.
    pub(super) fn moved_by(&self, motion: &Pose3) -> Vec<(u32, Pose3)> {
        let num_open = self.since.iter().filter(|since| since.is_open).count().max(1) as f64;
        let mut passed = 0.0;
        let share = |since: &Since| {
            passed += f64::from(u8::from(since.is_open));
            let share = Pose3::identity().try_lerp_slerp(motion, passed / num_open, 1e-9).unwrap_or(*motion);
            (since.number, share)
        };
        self.since.iter().map(share).collect()
    }

    /// Moves what was seen before them by `motion` (of the world) of each frame's number.
    pub(super) fn move_frames(&mut self, motion: &impl Fn(u32) -> Pose3) {
        self.before.move_frames(motion);
        if let Some(first) = self.since.first() {
            self.T_world_before = motion(first.number) * self.T_world_before;
        }
    }
}
