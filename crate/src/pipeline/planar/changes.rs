//! What changed in a building between several recordings of it.

use serde::Serialize;

use super::Reconstruction;
use super::run::Run;
use crate::map::occupancy_grid::{Change, OccupancyGrid, RESOLUTION};

/// What a recording shows otherwise than those before it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct RecordingChanges {
    /// Number of the recording, from 1: nothing comes before the first.
    pub recording: usize,
    /// Its name.
    pub name: String,
    /// What is new or gone, the largest first.
    pub changes: Vec<Change>,
}

impl Reconstruction {
    /// What each recording that is joined with earlier ones shows otherwise than they do, in the main piece of the map; empty before the
    /// run is done. A grid is made of each recording, so that a long log takes a second.
    pub fn changes(&self) -> Vec<RecordingChanges> {
        let Some(run) = &self.run else { return Vec::new() };
        let later = run.later_recordings();
        let is_joined = |number: &usize| later[number - 1].joined.is_some_and(|(_, piece)| piece == 0);
        let of = |number: usize| {
            let name = self.name_of_recording(later[number - 1].first_frame);
            let changes = run.grid_of_recordings(0..number).changes(&run.grid_of_recordings(number..number + 1));
            RecordingChanges { recording: number, name: name.to_owned(), changes }
        };
        (1..=later.len()).filter(is_joined).map(of).collect()
    }
}

impl Run {
    /// The grid of the good scans of some recordings in the main piece.
    fn grid_of_recordings(&self, numbers: std::ops::Range<usize>) -> OccupancyGrid {
        let is_of = |&frame: &usize| numbers.contains(&self.recordings[frame]) && self.piece(frame) == 0;
        let frames = self.mapped().filter(is_of).filter(|&frame| self.is_good(frame));
        let placed: Vec<_> = frames.map(|frame| (self.scans[frame].as_ref(), self.pose_in_map(frame))).collect();
        OccupancyGrid::new(&placed, &[], RESOLUTION)
    }
}
