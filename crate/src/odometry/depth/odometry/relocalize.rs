//! Relocalization: frames that are not in the map are tried again, backwards from a frame after a gap and after the last frame.

use super::super::chain::{Chain, Outcome};
use super::super::estimate::PoseUpdate;
use super::DepthOdometry;
use crate::odometry::assessment::{Assessment, Status};
use crate::registration::prepared_surfels::PreparedSurfels;

/// Frames before a registered one that are relocalized, ...
const MAX_BACKWARD_FRAMES: u32 = 12;
/// ... until this many of them fail.
const MAX_BACKWARD_FAILURES: usize = 2;

/// Progress of relocalization backwards from a frame.
#[derive(Clone)]
pub(super) struct BackwardRelocalization {
    /// The frames from `start` until this one are left.
    end: u32,
    start: u32,
    num_failures: usize,
}

/// Progress of relocalization after the last frame.
#[derive(Clone)]
pub(super) struct RelocalizationRounds {
    /// Frames still to be tried in this round.
    to_try: Vec<u32>,
    /// Whether a frame has been relocalized in this round, which may help others.
    has_succeeded: bool,
}

impl DepthOdometry {
    /// After a registered frame: notes which frames wait, and tries one of those before it again.
    pub(super) fn relocalize_earlier(
        &mut self,
        number: u32,
        frame: &PreparedSurfels,
        outcome: &Outcome,
        is_after_gap: bool,
    ) {
        let Outcome { estimate, dropped, uncertain, .. } = outcome;
        let has_tentative_branches = self.chain.as_ref().is_some_and(Chain::has_tentative_branches);
        let stays =
            |number: u32| self.chain.as_ref().is_some_and(|chain| !has_tentative_branches && chain.is_member(number));
        self.unregistered_frames.retain(|number| !stays(number) && !uncertain.contains(&number));
        if estimate.assessment.status != Status::Good || has_tentative_branches {
            // It may be dropped later.
            self.unregistered_frames.push(number, frame, estimate);
        }
        self.drop_small_rival_chain();
        if is_after_gap || !dropped.is_empty() {
            let end = dropped.last().map_or(number, |member| member.number + 1);
            self.backward =
                Some(BackwardRelocalization { end, start: end.saturating_sub(MAX_BACKWARD_FRAMES), num_failures: 0 });
        }
        self.relocalize_backwards();
    }

    /// Tries to relocalize one of the unregistered frames after the last frame; whether there may be more to try.
    pub fn relocalize_next(&mut self) -> bool {
        let Some(chain) = &mut self.chain else { return false };
        let first_round = || RelocalizationRounds { to_try: Vec::new(), has_succeeded: true };
        let rounds = self.rounds.get_or_insert_with(first_round);
        if rounds.to_try.is_empty() {
            // Each round has one frame less, at least.
            if !rounds.has_succeeded {
                return false;
            }
            let numbers = self.unregistered_frames.numbers().into_iter();
            let to_try = numbers.filter(|number| !chain.is_member(*number)).collect();
            *rounds = RelocalizationRounds { to_try, has_succeeded: false };
        }
        let Some(number) = rounds.to_try.pop() else { return false };
        if self.relocalize(number, true)
            && let Some(rounds) = &mut self.rounds
        {
            rounds.has_succeeded = true;
        }
        true
    }

    /// Tries to relocalize the frames before a registered one, backwards from it: one with each frame that follows, so that the
    /// time of a frame is bounded.
    fn relocalize_backwards(&mut self) {
        let Some(BackwardRelocalization { end, start, num_failures }) = self.backward.take() else { return };
        let is_member = |number: u32| self.chain.as_ref().is_some_and(|chain| chain.is_member(number));
        let earlier = (start..end).rev().take_while(|number| !is_member(*number));
        let Some(number) = earlier.into_iter().find(|number| self.unregistered_frames.get(*number).is_some()) else {
            return;
        };
        let num_failures = num_failures + usize::from(!self.relocalize(number, false));
        if num_failures < MAX_BACKWARD_FAILURES {
            self.backward = Some(BackwardRelocalization { end: number, start, num_failures });
        }
    }

    /// Tries to register an unregistered frame again; whether it succeeded.
    fn relocalize(&mut self, number: u32, everywhere: bool) -> bool {
        let (Some(chain), Some(stored)) = (&mut self.chain, self.unregistered_frames.get(number)) else { return false };
        let Some(hypothesis) = chain.relocalize(stored, everywhere) else { return false };
        let assessment = Assessment { status: Status::Good, reason: String::new(), agreement: hypothesis.agreement };
        let mut estimate = chain.insert(number, &stored.frame, hypothesis, assessment, None);
        self.unregistered_frames.remove(number);
        self.reassess(number, &mut estimate);
        self.pose_updates.push(PoseUpdate::relocalized(number, estimate));
        true
    }
}
