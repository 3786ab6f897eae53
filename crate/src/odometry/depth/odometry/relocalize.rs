//! Relocalization: frames that are not in the map are tried again after the last frame.

use nalgebra::Matrix3;

use super::super::estimate::{PoseUpdate, SpatialEstimate};
use super::DepthOdometry;
use crate::odometry::assessment::{Assessment, Status};
use crate::registration::prepared_surfels::PreparedSurfels;

/// Progress of relocalization after the last frame.
#[derive(Clone)]
pub(super) struct RelocalizationRounds {
    /// Frames still to be tried in this round.
    to_try: Vec<u32>,
    /// Whether a frame has been relocalized in this round, which may help others.
    has_succeeded: bool,
}

impl DepthOdometry {
    /// After a registered frame: notes whether it may have to be found again.
    pub(super) fn note_unregistered(&mut self, number: u32, frame: &PreparedSurfels, estimate: &SpatialEstimate) {
        let Some(chain) = &self.chain else { return };
        if !chain.has_branches() {
            self.unregistered_frames.retain(|number| !chain.is_member(number));
        }
        if estimate.assessment.status != Status::Good || chain.has_branches() {
            // It may be dropped later.
            self.unregistered_frames.push(number, frame, estimate);
        }
        self.rival_chain = None;
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
        if self.relocalize(number)
            && let Some(rounds) = &mut self.rounds
        {
            rounds.has_succeeded = true;
        }
        true
    }

    /// Tries to register an unregistered frame again; whether it succeeded.
    fn relocalize(&mut self, number: u32) -> bool {
        let (Some(chain), Some(stored)) = (&mut self.chain, self.unregistered_frames.get(number)) else { return false };
        let Some(hypothesis) = chain.relocalize(stored) else { return false };
        let assessment = Assessment { status: Status::Good, reason: String::new(), agreement: hypothesis.agreement };
        let mut estimate = chain.insert(number, &stored.frame, hypothesis, assessment, Some(Matrix3::zeros()));
        self.unregistered_frames.remove(number);
        self.reassess(number, &mut estimate);
        self.pose_updates.push(PoseUpdate::relocalized(number, estimate));
        true
    }
}
