//! Registration of one depth frame to another, with or without an initial guess.

use super::frame_matcher::FrameMatcher;
use super::pose_hypothesis::PoseHypothesis;
use super::reference_map::ReferenceMap;
use super::{DepthOptions, SpatialEstimate};
use crate::geometry::Pose3;
use crate::registration::prepared_surfels::PreparedSurfels;

/// A target frame. Other frames are registered to it independently of each other; poses are in its frame.
pub struct PairRegistration {
    reference: ReferenceMap,
}

/// The search for an initial pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Search {
    /// Within about 0.2 m and 10 degrees of a guess.
    From(Pose3),
    /// Any rotation about the target camera's y axis, and translations by up to a metre: the search for lost frames.
    AllAround,
    /// Any rotation about the target camera's y axis, and translations by up to four metres forward, back and sideways.
    Anywhere,
}

impl PairRegistration {
    /// With this frame as the target.
    pub fn new(target: &PreparedSurfels) -> Self {
        let (mut reference, identity) = (ReferenceMap::default(), Pose3::identity());
        let view = reference.map.view(&target.image, &identity);
        reference.insert(target, 0, &identity, &view);
        Self { reference }
    }

    /// Registers another frame; the estimate's pose maps it into the target's frame.
    pub fn register(&self, frame: &PreparedSurfels, search: Search, options: DepthOptions) -> SpatialEstimate {
        let matcher = FrameMatcher::new(&self.reference, frame, options);
        let hypothesis = match search {
            Search::From(guess) => {
                better_supported(matcher.best_near(matcher.propose_near(&[guess], &guess)), matcher.register_at(guess))
            }
            Search::AllAround => matcher.best_of(matcher.propose_all_around(&Pose3::identity())),
            Search::Anywhere => matcher.best_of(matcher.propose_anywhere(&Pose3::identity())),
        };
        let assessment = hypothesis.assessment();
        SpatialEstimate::outside_map(hypothesis, assessment)
    }
}

/// A coarse-to-fine registration may leave the basin of a good guess, a fine one alone may not reach the solution.
fn better_supported(coarse_to_fine: PoseHypothesis, fine: PoseHypothesis) -> PoseHypothesis {
    if fine.support > coarse_to_fine.support { fine } else { coarse_to_fine }
}
