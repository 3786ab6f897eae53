//! The trajectory that a run in space is compared with.

use crate::error::Result;
use crate::evaluation::convention::KnownConvention;
use crate::evaluation::trajectory_error::{EstimatedFrame, TrajectoryError, spatial_error};
use crate::geometry::Pose3;
use crate::io::trajectory::Contents;

/// A reference trajectory: used for the comparison alone.
pub(super) struct Reference {
    pub name: String,
    pub contents: Contents,
    /// Number of frames of the recording, whether they could be used or not.
    pub num_recorded: usize,
}

impl Reference {
    /// The errors of these frames; the convention of the poses is found from the data as far as it is not known.
    ///
    /// # Errors
    /// When no pose belongs to a frame.
    pub(super) fn error(&self, frames: &[EstimatedFrame], known: KnownConvention) -> Result<TrajectoryError<Pose3>> {
        spatial_error(frames, self.num_recorded, &self.name, &self.contents, known)
    }
}
