//! A chain of frames: each is registered to the map of those before it. Here is its state; every step of a frame's way is a
//! method in the file of its name, and `DepthOdometry::register_frame` is the whole way.

mod accept;
mod apply_motion_prior;
mod assess;
mod certainty;
mod relocalize;
mod search_near_prediction;
mod search_wider;
mod track;

use nalgebra::{Matrix3, Matrix6};

use self::accept::Branch;
use self::assess::Decision;
pub(super) use self::assess::Proposal;
pub use self::certainty::{UnresolvedFrame, UnresolvedFrames};
use self::track::PosedFrame;
use super::error_propagation::ErrorPropagation;
use super::frame_matcher::FrameMatcher;
use super::motion_prior::MotionPrior;
use super::reference_map::ReferenceMap;
use super::{ColorUse, DepthOptions, PoseUpdate, SpatialEstimate};
use crate::geometry::Pose3;
use crate::odometry::assessment::Assessment;
use crate::registration::prepared_surfels::PreparedSurfels;

/// Frames that are registered to each other, and their map.
#[derive(Clone)]
pub(super) struct Chain {
    options: DepthOptions,
    /// The content of all members, and of no other frames.
    reference: ReferenceMap,
    errors: ErrorPropagation,
    /// The frames of the map, in the order in which they were added.
    members: Vec<Member>,
    /// The last frame that was appended.
    last: PosedFrame,
    motion_prior: MotionPrior,
    /// The last doubtful frame that was rejected since the last one was appended: the next frame may be near it.
    rejected: Option<PosedFrame>,
    /// Frames since the last one that was appended.
    num_rejected: u32,
    /// Whether a frame fitted about as well at another position within reach.
    surfaces_repeat: bool,
    /// Each begins within the one before it.
    branches: Vec<Branch>,
}

/// A frame of a chain's map.
#[derive(Clone)]
pub(super) struct Member {
    /// Its number among all frames.
    pub(super) number: u32,
    pub(super) T_world_sensor: Pose3,
    /// Covariance (m^2) that its own registration leaves open of its position relative to the members before it, until a later
    /// frame resolves it; `None` where nothing bounds it.
    open: Option<Matrix3<f64>>,
    /// By its own registration, ...
    registered: Assessment,
    /// ... and by the certainty of those that it was registered to.
    pub(super) assessment: Assessment,
}

impl Member {
    fn new(number: u32, T_world_sensor: Pose3, registered: Assessment) -> Self {
        let open = Some(Matrix3::zeros());
        Self { number, T_world_sensor, open, assessment: registered.clone(), registered }
    }

    /// Whether nothing is open.
    fn is_certain(&self) -> bool {
        self.open == Some(Matrix3::zeros())
    }

    /// Its pose and assessment, told again.
    pub(super) fn pose_update(&self) -> PoseUpdate {
        let Self { number, T_world_sensor, assessment, .. } = self.clone();
        PoseUpdate { frame: number, T_world_sensor, assessment, is_replaced: false, registered: None }
    }
}

impl Chain {
    /// The chain that begins with this frame, at the world's origin.
    pub(super) fn new(options: DepthOptions, number: u32, frame: &PreparedSurfels) -> (Self, SpatialEstimate) {
        let (mut reference, T_world_sensor) = (ReferenceMap::default(), Pose3::identity());
        let view = reference.map.view(&frame.image, &T_world_sensor);
        reference.insert(frame, number, &T_world_sensor, &view);
        let (assessment, covariance) = (Assessment::first(), Some(Matrix6::zeros()));
        let estimate = SpatialEstimate {
            T_world_sensor,
            registration: None,
            overlap: 1.0,
            assessment,
            covariance,
            is_in_map: true,
        };
        let chain = Self {
            options,
            reference,
            errors: ErrorPropagation::from_first(number),
            members: vec![Member::new(number, T_world_sensor, Assessment::first())],
            last: PosedFrame::new(number, frame, T_world_sensor, Pose3::identity()),
            motion_prior: MotionPrior::default(),
            rejected: None,
            num_rejected: 0,
            surfaces_repeat: false,
            branches: Vec::new(),
        };
        (chain, estimate)
    }

    /// Frames from now on are registered by their depth alone.
    pub(super) fn disregard_colors(&mut self) {
        self.options.color = ColorUse::NotUsed;
    }

    pub(super) fn members(&self) -> &[Member] {
        &self.members
    }

    pub(super) fn is_member(&self, number: u32) -> bool {
        self.members.iter().rev().any(|member| member.number == number)
    }

    pub(super) fn surfaces_repeat(&self) -> bool {
        self.surfaces_repeat
    }

    pub(super) fn has_branches(&self) -> bool {
        !self.branches.is_empty()
    }

    /// Frames since the last one that was appended.
    pub(super) fn num_rejected(&self) -> u32 {
        self.num_rejected
    }

    /// Moves each frame's content by `motion` (of the world) of its number, frames being counted from 0. The prediction for
    /// the next frame moves with the last one that was appended.
    pub(super) fn apply_corrections(&mut self, motion: &impl Fn(u32) -> Pose3) {
        self.reference.apply_corrections(motion);
        for branch in &mut self.branches {
            branch.map_before.apply_corrections(motion);
        }
        let motion_of_last = motion(self.last.number);
        for posed in [Some(&mut self.last), self.rejected.as_mut()].into_iter().flatten() {
            posed.T_world_sensor = motion_of_last * posed.T_world_sensor;
        }
        for member in &mut self.members {
            member.T_world_sensor = motion(member.number) * member.T_world_sensor;
        }
    }

    /// A frame and the map.
    pub(super) fn matcher<'a>(&'a self, frame: &'a PreparedSurfels) -> FrameMatcher<'a> {
        FrameMatcher::new(&self.reference, frame, self.options)
    }
}
