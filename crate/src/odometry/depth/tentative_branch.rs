//! Frames since one whose place is not certain, be it open along a direction or held by little: where that one is off, so
//! are those after it, until one knows from what was seen before all of them where it is.

use nalgebra::Vector3;

use super::evidence::FINE_TOLERANCE;
use super::matching::{Matching, is_well_constrained};
use super::pose_hypothesis::{PoseHypothesis, PredictionGate};
use super::reference_map::ReferenceMap;
use super::{DepthOptions, SAME_PLACE};
use crate::geometry::Pose3;
use crate::map::keyframes::apart;
use crate::registration::degeneracy::DegenerateDirection;
use crate::registration::prepared_surfels::PreparedSurfels;

/// A frame that is open along a direction is to blame for what is off that way (cosine).
const BLAMED_COSINE: f64 = 0.5;

#[derive(Clone, Default)]
pub(super) struct TentativeBranch {
    before: ReferenceMap,
    T_world_before: Pose3,
    frames: Vec<BranchFrame>,
}

#[derive(Clone)]
struct BranchFrame {
    number: u32,
    /// Where its own place is not certain.
    doubt: Option<PoseUncertainty>,
    /// Whether it is known that those after it are not off by it.
    is_settled: bool,
}

/// How a frame may be off.
#[derive(Clone, Copy)]
pub(super) enum PoseUncertainty {
    /// Along this direction (unit vector in the world).
    Along(Vector3<f64>),
    Anywhere,
}

/// What a later frame tells of one of them.
pub(super) struct BranchCorrection {
    pub(super) number: u32,
    /// How it is moved, in the world.
    pub(super) motion: Pose3,
    /// Whether it is where that leads for sure.
    pub(super) is_certain: bool,
}

/// What a frame tells of those since the open one.
pub(super) enum BranchOutcome {
    /// It shows too little of what was known before them.
    Nothing,
    /// They have led to where it is by what was known before them.
    Confirmed(Box<PoseHypothesis>),
    /// They have not, and this is where it is.
    BranchCorrection(Box<PoseHypothesis>),
}

impl TentativeBranch {
    /// `before` is what was seen before them, and where the last frame was.
    pub(super) fn new(before: ReferenceMap, T_world_before: Pose3) -> Self {
        Self { before, T_world_before, frames: Vec::new() }
    }

    pub(super) fn before(&self) -> &ReferenceMap {
        &self.before
    }

    pub(super) fn into_before(self) -> ReferenceMap {
        self.before
    }

    pub(super) fn T_world_before(&self) -> Pose3 {
        self.T_world_before
    }

    /// Takes in a frame, with how it may be off if its own place is not certain.
    pub(super) fn push(&mut self, number: u32, doubt: Option<PoseUncertainty>) {
        self.frames.push(BranchFrame { number, doubt, is_settled: false });
    }

    /// Whether those after them may be anywhere, and not only a little off.
    pub(super) fn has_unbounded_error(&self) -> bool {
        self.frames.iter().any(|frames| !frames.is_settled && matches!(frames.doubt, Some(PoseUncertainty::Anywhere)))
    }

    /// Whether the place of the last of them hangs on nothing but those before it.
    pub(super) fn ends_with_certain_pose(&self) -> bool {
        self.frames.last().is_some_and(|frames| frames.doubt.is_none())
    }

    /// Takes in what has been found out of some of them: they do not lead astray.
    pub(super) fn settle(&mut self, told: &Self) {
        for frames in &mut self.frames {
            frames.is_settled |= told.frames.iter().any(|told| told.number == frames.number);
        }
    }

    pub(super) fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether a frame is where it seemed to be if they have led to where the next one is: its own place must be certain.
    pub(super) fn confirms(&self, number: u32) -> bool {
        self.frames.iter().any(|frames| frames.number == number && frames.doubt.is_none())
    }

    /// The numbers of those whose own place is not certain.
    pub(super) fn uncertain(&self) -> Vec<u32> {
        self.frames.iter().filter(|frames| frames.doubt.is_some()).map(|frames| frames.number).collect()
    }

    /// What a frame tells that they have led to this place.
    pub(super) fn resolved_by(
        &self,
        frame: &PreparedSurfels,
        T_world_found: &Pose3,
        options: DepthOptions,
    ) -> BranchOutcome {
        let found = Matching::new(&self.before, frame, options).settled(*T_world_found);
        if !found.is_constrained_by_map() || !found.is_accepted(PredictionGate::InsideAfterGap) {
            return BranchOutcome::Nothing;
        }
        if apart(&found.registration.T_target_source, T_world_found) < SAME_PLACE {
            return BranchOutcome::Confirmed(Box::new(found));
        }
        // What moves others must be held itself: along a bare wall the borders of things tell one place from another, but
        // not for sure.
        let (weakest, share) = DegenerateDirection::weakest(&found.registration.correspondences, FINE_TOLERANCE);
        let is_constrained = found.photometric_ncc.is_some()
            || is_well_constrained(share, weakest.sigma(&found.registration.information));
        if is_constrained { BranchOutcome::BranchCorrection(Box::new(found)) } else { BranchOutcome::Nothing }
    }

    /// How they are moved by what a frame after them tells: it is off by `motion` (of the world), which takes the camera from
    /// `from` to `to`. Those that may be off that way share it. What came before all of them was right, and what came after
    /// is off by all of it; what lies between hangs on the share.
    pub(super) fn moved_by(&self, motion: &Pose3, off: &Vector3<f64>) -> Vec<BranchCorrection> {
        let may_be_off = |frames: &BranchFrame| match frames.doubt {
            _ if frames.is_settled => false,
            Some(PoseUncertainty::Along(direction)) => direction.dot(off).abs() > BLAMED_COSINE * off.norm(),
            Some(PoseUncertainty::Anywhere) => true,
            None => false,
        };
        let num_off = self.frames.iter().filter(|frames| may_be_off(frames)).count();
        let mut passed = 0;
        let moved = |frames: &BranchFrame| {
            passed += usize::from(may_be_off(frames));
            let share = if num_off == 0 { 1.0 } else { passed as f64 / num_off as f64 };
            let shared = Pose3::identity().try_lerp_slerp(motion, share, 1e-9).unwrap_or(*motion);
            let is_certain = frames.doubt.is_none() && num_off > 0 && (passed == 0 || passed == num_off);
            BranchCorrection { number: frames.number, motion: shared, is_certain }
        };
        self.frames.iter().map(moved).collect()
    }

    /// The same where nothing is told of where they are.
    pub(super) fn not_moved(&self) -> Vec<BranchCorrection> {
        let stays = |frames: &BranchFrame| BranchCorrection {
            number: frames.number,
            motion: Pose3::identity(),
            is_certain: false,
        };
        self.frames.iter().map(stays).collect()
    }

    /// Moves what was seen before them by `motion` (of the world) of each frame's number.
    pub(super) fn apply_corrections(&mut self, motion: &impl Fn(u32) -> Pose3) {
        self.before.apply_corrections(motion);
        if let Some(first) = self.frames.first() {
            self.T_world_before = motion(first.number) * self.T_world_before;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALONG_X: Option<PoseUncertainty> = Some(PoseUncertainty::Along(Vector3::new(1.0, 0.0, 0.0)));
    const ALONG_Z: Option<PoseUncertainty> = Some(PoseUncertainty::Along(Vector3::new(0.0, 0.0, 1.0)));

    fn frames(doubts: &[Option<PoseUncertainty>]) -> TentativeBranch {
        let mut branch = TentativeBranch::default();
        for (number, doubt) in (0..).zip(doubts) {
            branch.push(number, *doubt);
        }
        branch
    }

    /// How far along x (m) each is moved, and whether it is then certain, where the last is off by 0.4 m.
    fn moved(branch: &TentativeBranch) -> Vec<(f64, bool)> {
        let off = Vector3::new(0.4, 0.0, 0.0);
        let moved = branch.moved_by(&Pose3::translation(off.x, off.y, off.z), &off);
        moved.iter().map(|moved| (moved.motion.translation.vector.x, moved.is_certain)).collect()
    }

    #[test]
    fn what_came_before_the_one_that_is_off_stays_and_what_came_after_goes_with_it() {
        let one = frames(&[ALONG_Z, None, ALONG_X, None, None]);
        assert_eq!(moved(&one), [(0.0, false), (0.0, true), (0.4, false), (0.4, true), (0.4, true)]);
    }

    #[test]
    fn what_lies_between_two_that_may_be_off_is_not_certain() {
        let two = frames(&[ALONG_X, None, ALONG_X, None]);
        assert_eq!(moved(&two), [(0.2, false), (0.2, false), (0.4, false), (0.4, true)]);
        let anywhere = frames(&[ALONG_X, None, Some(PoseUncertainty::Anywhere), None]);
        assert_eq!(moved(&anywhere), moved(&two));
        assert!(anywhere.has_unbounded_error() && !two.has_unbounded_error());
        // Nothing tells where it went astray.
        assert!(moved(&frames(&[ALONG_Z, None])).iter().all(|(_, is_certain)| !is_certain));
    }

    #[test]
    fn one_whose_share_is_known_already_is_not_to_blame() {
        let mut outer = frames(&[ALONG_X, None, Some(PoseUncertainty::Anywhere), None]);
        let mut inner = TentativeBranch::default();
        inner.push(2, Some(PoseUncertainty::Anywhere));
        outer.settle(&inner);
        assert_eq!(moved(&outer), [(0.4, false), (0.4, true), (0.4, false), (0.4, true)]);
        assert!(!outer.has_unbounded_error() && outer.ends_with_certain_pose() && !inner.ends_with_certain_pose());
        assert!(outer.confirms(1) && !outer.confirms(2));
    }
}
