//! A registration with what speaks for and against it, and whether it is believed.

use crate::registration::projective::ProjectiveTarget;
use crate::registration::spatial::SpatialRegistration;
use crate::verdict::{Status, Verdict};

/// A place far from where the last frame was is believed when so much of the frame lies on it ...
const UNMISTAKABLE_OVERLAP: f64 = 0.5;
/// ... and so much of it agrees.
const UNMISTAKABLE_AGREEMENT: f64 = 0.98;
/// What was seen before frames in doubt holds a frame after them when it shows so much of it.
const ANCHORING_OVERLAP: f64 = 0.25;
/// A frame of which less than this share lies on the map is not believed: nothing ties it down.
const LOST_OVERLAP: f64 = 0.1;
/// Below this share of agreeing surface a registration is not believed ... On the recordings at hand, with up to three
/// frames of four left out, right registrations agree by 0.95 to 1, and ones that are wrong by half a metre mostly by less
/// than 0.9.
const LOST_AGREEMENT: f64 = 0.85;
/// ... and below this it is doubtful, and no part of the map.
const DOUBTFUL_AGREEMENT: f64 = 0.95;

/// A registration with what speaks for and against it.
pub(super) struct Found {
    pub(super) registration: SpatialRegistration,
    /// The map as seen from about there.
    pub(super) view: ProjectiveTarget,
    pub(super) support: f64,
    pub(super) overlap: f64,
    pub(super) agreement: f64,
    /// Whether it might as well stand somewhere else along a direction.
    pub(super) is_open: bool,
}

impl Found {
    /// Whether it stands in free space, or on nothing that is known.
    pub(super) fn is_contradicted(&self) -> bool {
        self.overlap < LOST_OVERLAP || self.agreement < DOUBTFUL_AGREEMENT
    }

    /// Whether it is beyond doubt though it is far from where the last frame was.
    pub(super) fn is_unmistakable(&self) -> bool {
        self.overlap > UNMISTAKABLE_OVERLAP
            && self.agreement > UNMISTAKABLE_AGREEMENT
            && !self.is_open
            && self.registration.converged
    }

    /// Whether what has been seen holds it in all directions.
    pub(super) fn is_anchored(&self) -> bool {
        self.overlap > ANCHORING_OVERLAP && !self.is_contradicted() && !self.is_open && self.registration.converged
    }

    pub(super) fn verdict(&self) -> Verdict {
        let percent = |share: f64| format!("{:.0} %", 100.0 * share);
        let with = |status, reason| Verdict { status, reason, agreement: self.agreement };
        if self.overlap < LOST_OVERLAP {
            let reason = format!("only {} of its surface lies on the map: too little overlap", percent(self.overlap));
            return with(Status::Lost, reason);
        }
        if self.agreement < LOST_AGREEMENT {
            let reason = format!(
                "{} of the surface in view stands where it or the map saw free space: it shows another place, or the \
                 motion is larger than the search",
                percent(1.0 - self.agreement)
            );
            return with(Status::Lost, reason);
        }
        if self.agreement < DOUBTFUL_AGREEMENT {
            let reason = format!("{} of the surface in view stands in free space", percent(1.0 - self.agreement));
            return with(Status::Doubtful, reason);
        }
        if self.is_open {
            return with(Status::Doubtful, "the surfaces in view leave the position along one direction open".into());
        }
        if !self.registration.converged {
            let iterations = self.registration.history.len();
            return with(Status::Doubtful, format!("it was still moving after {iterations} iterations"));
        }
        with(Status::Good, String::new())
    }
}
