//! Two depth frames alone: one is registered to the other, from a guess or from none.

use super::matching::Matching;
use super::pose_hypothesis::PoseHypothesis;
use super::reference_map::ReferenceMap;
use super::{DepthOptions, SpatialEstimate};
use crate::geometry::Pose3;
use crate::registration::prepared_surfels::PreparedSurfels;

/// A frame that others are registered to, one by one and apart from each other. Poses are in its own frame.
pub struct PairRegistration {
    seen: ReferenceMap,
}

/// Where a frame is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Search {
    /// Within about 0.2 m and 10 degrees of a guess.
    From(Pose3),
    /// Turned by any angle about this camera's y axis, and moved by up to a metre: what is done for frames that are lost.
    AllAround,
    /// Turned by any angle about this camera's y axis, and moved by up to four metres ahead and aside.
    Anywhere,
}

impl PairRegistration {
    /// A frame alone.
    pub fn new(frame: &PreparedSurfels) -> Self {
        let (mut seen, identity) = (ReferenceMap::default(), Pose3::identity());
        let view = seen.map.view(&frame.image, &identity);
        seen.insert(frame, 0, &identity, &view);
        Self { seen }
    }

    /// Registers another frame; the estimate's pose maps it into this frame.
    pub fn register(&self, frame: &PreparedSurfels, search: Search, options: DepthOptions) -> SpatialEstimate {
        let matching = Matching::new(&self.seen, frame, options);
        let found = match search {
            Search::From(guess) => nearer(matching.best_of(&[guess], &guess), matching.settled(guess)),
            Search::AllAround => matching.best_of_all_around(&Pose3::identity()),
            Search::Anywhere => matching.best_of_anywhere(&Pose3::identity()),
        };
        let (assessment, overlap) = (found.assessment(), found.overlap);
        let T_world_sensor = found.registration.T_target_source;
        SpatialEstimate {
            T_world_sensor,
            registration: Some(found.registration),
            overlap,
            assessment,
            is_in_map: false,
        }
    }
}

/// A wide registration may lead away from a good guess, a narrow one not to it.
fn nearer(wide: PoseHypothesis, narrow: PoseHypothesis) -> PoseHypothesis {
    if narrow.support > wide.support { narrow } else { wide }
}
