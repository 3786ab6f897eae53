//! A tentative branch: the frames since one with an uncertain pose. An error of that pose carries over to all poses after
//! it, until a frame is registered to the map from before the branch and thereby resolves it.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use super::DepthOptions;
use super::frame_matcher::FrameMatcher;
use super::hypotheses::SAME_POSE_DISTANCE;
use super::pose_hypothesis::{PoseHypothesis, PoseUncertainty};
use super::prediction_gate::PredictionGate;
use super::reference_map::ReferenceMap;
use super::second_basin::SearchArea;
use crate::geometry::Pose3;
use crate::geometry::pose_distance::pose_distance;
use crate::registration::prepared_surfels::PreparedSurfels;

/// Cosine between a frame's undetermined direction and the observed error above which the frame may have caused it.
const MIN_ERROR_DIRECTION_COSINE: f64 = 0.5;

/// Largest standard deviation (m) that uncertain frames may leave to those after them: half of what makes a pair of frames
/// wrong, as for planar scans. In flats, positions that were right to 5 cm had up to 0.27 m; in a bare cube and before tiles,
/// where they were wrong by 0.4 m and more, it was 0.4 to 2 m.
const MAX_SIGMA: f64 = 0.25;

#[derive(Clone, Default)]
pub(super) struct TentativeBranch {
    /// The map before the branch, ...
    map_before: ReferenceMap,
    /// ... and how many members of the chain are in it.
    num_members_before: usize,
    frames: Vec<BranchFrame>,
}

#[derive(Clone)]
struct BranchFrame {
    number: u32,
    /// How its own registration may be wrong; `None` where it is certain relative to the frame before.
    uncertainty: Option<PoseUncertainty>,
    /// Whether a later frame has already corrected its error.
    is_resolved: bool,
}

/// The frames of a branch with uncertain positions that no later frame has resolved.
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

/// Frames that are certain relative to each other; see [`TentativeBranch::majority`].
#[derive(Debug, PartialEq)]
pub(super) struct Majority {
    pub(super) includes_map_before: bool,
    /// Numbers of the frames of the branch, ascending.
    pub(super) numbers: Vec<u32>,
}

/// The correction of one frame of a branch.
pub(super) struct BranchCorrection {
    pub(super) number: u32,
    /// Motion of the frame in the world.
    pub(super) motion: Pose3,
    /// Whether the corrected pose is certain.
    pub(super) is_certain: bool,
}

/// What a later frame says about a branch, by its registration to the map from before the branch.
pub(super) enum BranchOutcome {
    /// It overlaps that map too little.
    Unresolved,
    /// The registration agrees with the branch.
    Confirmed(Box<PoseHypothesis>),
    /// The registration differs: the branch is wrong by the difference.
    Refuted(Box<PoseHypothesis>),
}

impl TentativeBranch {
    /// A branch without frames, with the map from before it, in which there are so many members.
    pub(super) fn new(map_before: ReferenceMap, num_members_before: usize) -> Self {
        Self { map_before, num_members_before, ..Self::default() }
    }

    pub(super) fn num_members_before(&self) -> usize {
        self.num_members_before
    }

    pub(super) fn into_map_before(self) -> ReferenceMap {
        self.map_before
    }

    /// Adds a frame, with its uncertainty if its own registration is not certain.
    pub(super) fn push(&mut self, number: u32, uncertainty: Option<PoseUncertainty>) {
        self.frames.push(BranchFrame { number, uncertainty, is_resolved: false });
    }

    /// Its uncertain frames that no later frame has resolved.
    pub(super) fn unresolved(&self) -> UnresolvedFrames {
        let open = self.frames.iter().zip(self.covariances()).filter(|(frame, _)| frame.open().is_some());
        let unresolved = |(frame, sum): (&BranchFrame, Option<Matrix3<f64>>)| UnresolvedFrame {
            number: frame.number,
            sigma: sum.as_ref().map(largest_sigma),
        };
        UnresolvedFrames { frames: open.map(unresolved).collect() }
    }

    /// Covariance (m^2) of the position after each of its frames; `None` where nothing bounds it.
    fn covariances(&self) -> impl Iterator<Item = Option<Matrix3<f64>>> {
        self.frames.iter().scan(Some(Matrix3::zeros()), |sum, frame| {
            *sum = frame.added_to(*sum);
            Some(*sum)
        })
    }

    /// The frames that are certain relative to each other and to the map before the branch, in which `num_good_before` are good; or those
    /// of the branch that are certain relative to each other, where they are more, more than half of all, and how the two sets lie to
    /// each other is known roughly. `None` where nothing is uncertain.
    pub(super) fn majority(&self, num_good_before: usize) -> Option<Majority> {
        let numbers_of = |is_in: &dyn Fn(usize) -> bool| {
            let chosen = self.frames.iter().enumerate().filter(|(index, frame)| is_in(*index) && frame.is_certain());
            chosen.map(|(_, frame)| frame.number).collect::<Vec<u32>>()
        };
        let known: Vec<bool> = self.covariances().map(is_small).collect();
        if known.iter().all(|is_known| *is_known) {
            return None;
        }
        let with_map_before = numbers_of(&|index| known[index]);
        let run = self.longest_certain_run();
        let alone = numbers_of(&|index| run.contains(&index));
        let is_larger = alone.len() > num_good_before + with_map_before.len();
        if is_larger && 2 * alone.len() > self.num_members_before + self.frames.len() {
            Some(Majority { includes_map_before: false, numbers: alone })
        } else {
            Some(Majority { includes_map_before: true, numbers: with_map_before })
        }
    }

    /// The consecutive frames with the most certain registrations among which the errors add up to less than a wrong position,
    /// before a frame whose error nothing bounds.
    fn longest_certain_run(&self) -> Range<usize> {
        let (mut start, mut sum, mut num_certain) = (0, Matrix3::zeros(), 0);
        let (mut longest, mut most) = (0..0, 0);
        for (index, frame) in self.frames.iter().enumerate() {
            let Some(with_frame) = frame.added_to(Some(sum)) else { break };
            // The first frame's own error is that of all of them.
            (sum, num_certain) =
                (if index == 0 { sum } else { with_frame }, num_certain + usize::from(frame.is_certain()));
            while !is_small(Some(sum)) {
                num_certain -= usize::from(self.frames[start].is_certain());
                start += 1;
                sum -= self.frames[start].added_to(Some(Matrix3::zeros())).unwrap_or_default();
            }
            if num_certain > most {
                (longest, most) = (start..index + 1, num_certain);
            }
        }
        longest
    }

    /// Whether surfaces repeat where a frame of it is.
    pub(super) fn is_in_repetitive_place(&self) -> bool {
        self.frames.iter().any(|frame| matches!(frame.uncertainty, Some(PoseUncertainty::Period(_))))
    }

    /// Whether the last frame's own registration is certain.
    pub(super) fn ends_with_certain_pose(&self) -> bool {
        self.frames.last().is_some_and(BranchFrame::is_certain)
    }

    /// Marks those frames as resolved that are also part of a resolved branch.
    pub(super) fn mark_resolved(&mut self, resolved: &Self) {
        for frame in &mut self.frames {
            frame.is_resolved |= resolved.frames.iter().any(|other| other.number == frame.number);
        }
    }

    /// Numbers of the frames whose own registration is not certain.
    pub(super) fn uncertain(&self) -> Vec<u32> {
        self.frames.iter().filter(|frame| !frame.is_certain()).map(|frame| frame.number).collect()
    }

    /// What a frame with this pose at the end of the branch says about the branch, by its registration to the map from before it.
    pub(super) fn resolved_by(
        &self,
        frame: &PreparedSurfels,
        T_world_sensor: &Pose3,
        options: DepthOptions,
    ) -> BranchOutcome {
        let matcher = FrameMatcher::new(&self.map_before, frame, options);
        let anchored = matcher.register_at(*T_world_sensor);
        let leads_here = pose_distance(anchored.T_world_sensor(), T_world_sensor) < SAME_POSE_DISTANCE;
        let is_accepted = anchored.is_constrained_by_map() && anchored.is_accepted(PredictionGate::InsideAfterGap);
        if !is_accepted || matcher.second_basin(&anchored, &SearchArea::anywhere(&anchored)).is_some() {
            return BranchOutcome::Unresolved;
        }
        if leads_here {
            return BranchOutcome::Confirmed(Box::new(anchored));
        }
        // A pose that corrects others must be well constrained itself: along a bare wall, free space at the borders of
        // objects tells positions apart, but not reliably.
        let is_reliable = anchored.photometric_ncc.is_some() || anchored.is_well_constrained();
        if is_reliable { BranchOutcome::Refuted(Box::new(anchored)) } else { BranchOutcome::Unresolved }
    }

    /// The corrections of all frames where the end of the branch is off by `motion` (of the world), whose translation at the
    /// camera is `error` (m). The frames that may have caused it share it equally. Frames before the first of them are
    /// correct, frames after the last are off by all of it; those in between depend on how it is shared.
    pub(super) fn corrections(&self, motion: &Pose3, error: &Vector3<f64>) -> Vec<BranchCorrection> {
        let is_along =
            |direction: &Vector3<f64>| direction.dot(error).abs() > MIN_ERROR_DIRECTION_COSINE * error.norm();
        let may_have_caused = |frame: &BranchFrame| match frame.uncertainty {
            _ if frame.is_resolved => false,
            Some(PoseUncertainty::Along(direction, _)) => is_along(&direction),
            Some(PoseUncertainty::Period(offset)) => is_along(&offset.normalize()),
            Some(PoseUncertainty::Within(_) | PoseUncertainty::Unbounded) => true,
            None => false,
        };
        let num_causes = self.frames.iter().filter(|frame| may_have_caused(frame)).count();
        let mut num_passed = 0;
        let correction = |frame: &BranchFrame| {
            num_passed += usize::from(may_have_caused(frame));
            let share = if num_causes == 0 { 1.0 } else { num_passed as f64 / num_causes as f64 };
            let motion = Pose3::identity().try_lerp_slerp(motion, share, 1e-9).unwrap_or(*motion);
            let is_certain = frame.is_certain() && num_causes > 0 && (num_passed == 0 || num_passed == num_causes);
            BranchCorrection { number: frame.number, motion, is_certain }
        };
        self.frames.iter().map(correction).collect()
    }

    /// The corrections where the error is unknown: no motion, and no pose is certain.
    pub(super) fn unknown_corrections(&self) -> Vec<BranchCorrection> {
        let unknown = |frame: &BranchFrame| BranchCorrection {
            number: frame.number,
            motion: Pose3::identity(),
            is_certain: false,
        };
        self.frames.iter().map(unknown).collect()
    }

    /// Moves the map before the branch by `motion` (of the world) of each frame's number.
    pub(super) fn apply_corrections(&mut self, motion: &impl Fn(u32) -> Pose3) {
        self.map_before.apply_corrections(motion);
    }
}

impl BranchFrame {
    /// Whether its own registration is certain.
    fn is_certain(&self) -> bool {
        self.uncertainty.is_none()
    }

    /// What it leaves open; `None` if it is certain or resolved.
    fn open(&self) -> Option<PoseUncertainty> {
        self.uncertainty.filter(|_| !self.is_resolved)
    }

    /// A covariance (m^2; `None` is not bounded) with what it leaves open.
    fn added_to(&self, sum: Option<Matrix3<f64>>) -> Option<Matrix3<f64>> {
        match self.open() {
            Some(open) => Some(sum? + open.covariance()?),
            None => sum,
        }
    }
}

/// The standard deviation (m) along the direction where it is largest.
fn largest_sigma(covariance: &Matrix3<f64>) -> f64 {
    covariance.symmetric_eigenvalues().max().max(0.0).sqrt()
}

/// Whether an error of this covariance (m^2; `None` is not bounded) is too small for a wrong position.
fn is_small(covariance: Option<Matrix3<f64>>) -> bool {
    covariance.is_some_and(|covariance| largest_sigma(&covariance) <= MAX_SIGMA)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALONG_X: Option<PoseUncertainty> = Some(PoseUncertainty::Along(Vector3::new(1.0, 0.0, 0.0), 0.3));
    const ALONG_Z: Option<PoseUncertainty> = Some(PoseUncertainty::Along(Vector3::new(0.0, 0.0, 1.0), 0.3));
    const UNBOUNDED: Option<PoseUncertainty> = Some(PoseUncertainty::Unbounded);

    fn branch(uncertainties: &[Option<PoseUncertainty>]) -> TentativeBranch {
        let mut branch = TentativeBranch::default();
        for (number, uncertainty) in (0..).zip(uncertainties) {
            branch.push(number, *uncertainty);
        }
        branch
    }

    /// Whether the position of a frame after its last one may be wrong.
    fn is_uncertain(branch: &TentativeBranch) -> bool {
        !branch.covariances().last().is_some_and(is_small)
    }

    /// The correction along x (m) of each frame, and whether it is certain, where the end is off by 0.4 m.
    fn corrections(branch: &TentativeBranch) -> Vec<(f64, bool)> {
        let error = Vector3::new(0.4, 0.0, 0.0);
        let corrections = branch.corrections(&Pose3::translation(error.x, error.y, error.z), &error);
        corrections.iter().map(|one| (one.motion.translation.vector.x, one.is_certain)).collect()
    }

    #[test]
    fn frames_before_the_cause_stay_and_frames_after_it_move_by_the_whole_error() {
        let one = branch(&[ALONG_Z, None, ALONG_X, None, None]);
        assert_eq!(corrections(&one), [(0.0, false), (0.0, true), (0.4, false), (0.4, true), (0.4, true)]);
    }

    #[test]
    fn frames_between_two_possible_causes_are_not_certain() {
        let two = branch(&[ALONG_X, None, ALONG_X, None]);
        assert_eq!(corrections(&two), [(0.2, false), (0.2, false), (0.4, false), (0.4, true)]);
        let unbounded = branch(&[ALONG_X, None, UNBOUNDED, None]);
        assert_eq!(corrections(&unbounded), corrections(&two));
        assert!(is_uncertain(&unbounded) && is_uncertain(&two));
        // Without a possible cause no pose is certain.
        assert!(corrections(&branch(&[ALONG_Z, None])).iter().all(|(_, is_certain)| !is_certain));
    }

    #[test]
    fn small_errors_make_a_branch_uncertain_together() {
        let along = |x, y| Some(PoseUncertainty::Along(Vector3::new(x, y, 0.0), 0.2));
        assert!(!is_uncertain(&branch(&[along(1.0, 0.0), along(0.0, 1.0), None])));
        assert!(is_uncertain(&branch(&[along(1.0, 0.0), None, along(1.0, 0.0)])));
    }

    #[test]
    fn a_resolved_frame_is_no_possible_cause() {
        let mut outer = branch(&[ALONG_X, None, UNBOUNDED, None]);
        let mut inner = TentativeBranch::default();
        inner.push(2, UNBOUNDED);
        outer.mark_resolved(&inner);
        assert_eq!(corrections(&outer), [(0.4, false), (0.4, true), (0.4, false), (0.4, true)]);
        assert!(is_uncertain(&outer) && outer.ends_with_certain_pose() && !inner.ends_with_certain_pose());
    }

    #[test]
    fn an_uncertain_frame_leaves_the_sum_of_all_errors_up_to_it() {
        let within = Some(PoseUncertainty::Within(0.2));
        let branch = branch(&[ALONG_X, None, ALONG_X, ALONG_Z, within, UNBOUNDED, ALONG_X]);
        let sigmas = branch.unresolved().frames.into_iter().map(|frame| (frame.number, frame.sigma));
        let (two, ball) = (0.3 * 2_f64.sqrt(), (0.18 + 0.04 / 5.0_f64).sqrt());
        let expected = [(0, Some(0.3)), (2, Some(two)), (3, Some(two)), (4, Some(ball)), (5, None), (6, None)];
        for ((number, sigma), (expected_number, expected_sigma)) in sigmas.zip(expected) {
            assert_eq!((number, sigma.is_some()), (expected_number, expected_sigma.is_some()));
            assert!(
                (sigma.unwrap_or_default() - expected_sigma.unwrap_or_default()).abs() < 1e-9,
                "{number}: {sigma:?}"
            );
        }
    }

    #[test]
    fn the_larger_part_beside_an_uncertain_frame_is_certain() {
        let of = |frames: &[Option<PoseUncertainty>], num_before: usize| {
            let branch = TentativeBranch { num_members_before: num_before, ..branch(frames) };
            branch.majority(num_before).map(|majority| (majority.includes_map_before, majority.numbers))
        };
        let later = [ALONG_X, None, None, None, None, ALONG_X, None];
        assert_eq!(of(&later, 0), Some((false, vec![1, 2, 3, 4])));
        assert_eq!(of(&later, 1), Some((true, vec![])), "half of all is no majority");
        assert_eq!(of(&[ALONG_X, None, None, None], 2), Some((true, vec![])));
        assert_eq!(of(&[ALONG_X, None, None, None, None], 2), Some((false, vec![1, 2, 3, 4])));
        assert_eq!(of(&[UNBOUNDED, None, None, None, None], 2), Some((true, vec![])), "they may be anywhere");
        let small = Some(PoseUncertainty::Along(Vector3::new(1.0, 0.0, 0.0), 0.2));
        let drifting = [ALONG_X, None, small, None, None, small, None, None, None];
        assert_eq!(of(&drifting, 0), Some((false, vec![3, 4, 6, 7, 8])), "two small errors add up");
        assert_eq!(of(&[None, small, None], 5), None, "nothing is uncertain");
    }
}
