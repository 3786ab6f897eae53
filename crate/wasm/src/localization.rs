//! Localisation in a map for JavaScript.

use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::thrown::Thrown;

use crate::occupancy_grid::OccupancyGrid;
use crate::{Reconstruction, plain};
use scanstitch::error::Error;
use scanstitch::geometry::RigidMotion;
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::{Localization as Run, LocalizationResult, LocatedScan};

/// The scans of a reconstruction, located in a map: call `step()` until it returns false, and `result()` at any time. Call `free()`
/// when it is no longer used.
#[wasm_bindgen]
pub struct Localization {
    pub(crate) run: Run,
}

#[wasm_bindgen]
impl Reconstruction {
    /// Prepares to locate the scans in a map, with their odometry. `step()` need not have been called.
    ///
    /// # Errors
    /// When the map has no walls or no free space.
    pub fn localization(&self, map: &OccupancyGrid) -> Result<Localization, Thrown> {
        Ok(Localization { run: self.engine.localization(&map.grid)? })
    }
}

#[wasm_bindgen]
impl Localization {
    /// Locates the next scan. False after the last one.
    pub fn step(&mut self) -> bool {
        self.run.step()
    }

    /// Number of scans located so far.
    pub fn num_located(&self) -> usize {
        self.run.locations().len()
    }

    /// Number of all scans.
    pub fn num_scans(&self) -> usize {
        self.run.scans().len()
    }

    /// The result so far.
    ///
    /// # Errors
    /// No input causes an error.
    pub fn result(&self) -> Result<Ts<LocalizationResult>, Thrown> {
        Ok(plain(&self.run.result()))
    }

    /// The result so far with an empty list of scans: `scan` tells of each.
    ///
    /// # Errors
    /// No input causes an error.
    pub fn outcome(&self) -> Result<Ts<LocalizationResult>, Thrown> {
        Ok(plain(&self.run.outcome()))
    }

    /// Where a scan was taken.
    ///
    /// # Errors
    /// When it has not been located yet.
    pub fn scan(&self, scan: usize) -> Result<Ts<LocatedScan>, Thrown> {
        let located = self.run.scan(scan);
        Ok(plain(&located.ok_or_else(|| Error::whole(format!("Scan {scan} has not been located yet"), "Call step()"))?))
    }

    /// Status (0 good, 1 doubtful, 2 lost), x, y (m) and theta (rad) of each scan so far at its most likely place; NaN where it has none.
    pub fn track(&self) -> Vec<f64> {
        let poses = self.run.poses();
        let states = self.run.locations().iter().zip(&poses).map(|(location, pose)| {
            let status = match location.status {
                Status::Good => 0.0,
                Status::Doubtful => 1.0,
                Status::Lost => 2.0,
            };
            pose.map_or([status, f64::NAN, f64::NAN, f64::NAN], |pose| {
                let position = pose.translation.vector;
                [status, position.x, position.y, pose.rotation.angle()]
            })
        });
        states.flatten().collect()
    }

    /// The returns of a scan at its most likely place: x y x y ... in the world (m); none where it has no place.
    pub fn scan_points(&self, scan: usize) -> Vec<f32> {
        let placed = self.run.locations().get(scan).and_then(|location| location.place).zip(self.run.scans().get(scan));
        let points = placed.iter().flat_map(|(place, scan)| scan.points.iter().map(|p| place.T_world_sensor.act(p)));
        points.flat_map(|p| [p.x as f32, p.y as f32]).collect()
    }

    /// The likelihood field of the map: how likely a return in each cell is, row by row from the largest y down, from 0 to 255 in its
    /// logarithm.
    pub fn likelihood_field(&self) -> Vec<u8> {
        let (scores, width) = self.run.likelihood_field();
        let rows = scores.chunks(width.max(1)).rev();
        rows.flatten().map(|score| (255.0 * score).round() as u8).collect()
    }

    /// The trajectory in TUM's format, a line for every scan whose place is certain.
    pub fn trajectory_tum(&self) -> String {
        self.run.trajectory_tum()
    }
}
