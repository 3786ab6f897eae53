//! A stretch of scans whose poses relative to each other are known, searched for in a whole map at once.

use super::field::MapField;
use super::likelihood::BeamModel;
use super::places::{CERTAIN, odds_of, places, probabilities};
use super::search::Search;
use super::window::{Window, beams_of};
use crate::geometry::{Pose2, RigidMotion};
use crate::map::occupancy_grid::OccupancyGrid;
use crate::odometry::planar::MeasuredMotion;
use crate::preprocess::planar_scan::PlanarScan;
use nalgebra::Matrix3;

/// A map in which stretches are searched for.
pub struct StretchSearch {
    field: MapField,
    model: BeamModel,
    search: Search,
}

impl StretchSearch {
    /// Prepares a map; `None` where it has no walls or no free space.
    pub fn new(grid: &OccupancyGrid) -> Option<Self> {
        let field = MapField::new(grid);
        field.is_usable().then(|| Self { model: BeamModel::of(&field), search: Search::new(&field), field })
    }

    /// The motion that brings the scans from the frame of their poses to where they are in the world of the map; `None` where that is not
    /// certain. The scans are in the order in which they were taken, over at most [`LONGEST_STRETCH`](super::LONGEST_STRETCH).
    pub fn certain_place(&self, scans: &[(&PlanarScan, Pose2)]) -> Option<Pose2> {
        let mut window = Window::default();
        for (frame, (scan, pose)) in scans.iter().enumerate() {
            let before = scans[frame.saturating_sub(1)].1;
            let motion = MeasuredMotion { T_before_sensor: before.inverse() * pose, covariance: Matrix3::zeros() };
            window.add(frame, beams_of(scan), &motion);
        }
        let joined = window.joined();
        let found = places(&self.field, &self.model, &self.search, &joined);
        let best = found.all.first().filter(|best| found.is_complete && best.log_odds > odds_of(CERTAIN))?;
        let (of_places, _) = probabilities(&found.all.iter().map(|place| place.log_odds).collect::<Vec<_>>());
        let T_frame_middle = scans.get(window.scans[joined.middle].frame)?.1;
        (of_places[0] >= CERTAIN).then(|| (self.field.in_world(&best.pose) * T_frame_middle.inverse()).renormalized())
    }
}
