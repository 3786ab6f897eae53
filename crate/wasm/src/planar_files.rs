//! Laser logs, odometry and other map formats for a planar reconstruction, which the page loads later.

use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::thrown::Thrown;

use crate::point_cloud::{MapFormat, map_format};
use crate::{Reconstruction, plain};
use scanstitch::io::laser_log::table::{self, TableFacts};
use scanstitch::io::{laser_log, point_cloud, trajectory};
use scanstitch::pipeline::planar::RecordingChanges;
use scanstitch::pipeline::report::AddedLog;

#[wasm_bindgen]
impl Reconstruction {
    /// Adds all scans of a laser log and restarts the run. Their poses are used for the estimate only if the setting `odometry`
    /// requests it. `table` describes the columns of a table of ranges, e.g.
    /// `ranges=2:541,unit=mm,start=-135deg,step=0.5deg`; missing parts are guessed, which a note reports.
    ///
    /// # Errors
    /// When the file is not a valid log, or `table` not a valid format; scans added before are kept.
    pub fn add_log(&mut self, name: &str, bytes: &[u8], table: Option<String>) -> Result<Ts<AddedLog>, Thrown> {
        let log = match table {
            None => laser_log::read(bytes),
            Some(format) => table::read_given(bytes, &format),
        };
        let log = log.map_err(|error| error.in_file(name))?;
        Ok(plain(&self.engine.add_log(name, &log)))
    }

    /// What each recording that is joined with earlier ones shows otherwise than they do, in the main piece of the map; empty before the
    /// run is done.
    ///
    /// # Errors
    /// No input causes an error.
    #[wasm_bindgen(unchecked_return_type = "RecordingChanges[]")]
    pub fn changes(&self) -> Result<Vec<Ts<RecordingChanges>>, Thrown> {
        Ok(self.engine.changes().iter().map(plain).collect())
    }

    /// Sets the odometry for the initial guesses, rows of `id x y theta`, TUM, or the paths of two wheels under names, and restarts the
    /// run.
    ///
    /// # Errors
    /// When the file is not a trajectory with headings.
    pub fn set_odometry(&mut self, name: &str, bytes: &[u8]) -> Result<(), Thrown> {
        let of_wheels = table::read_wheel_paths(bytes, self.engine.settings().wheel_track);
        let odometry = of_wheels.unwrap_or_else(|| trajectory::read(bytes)).map_err(|error| error.in_file(name))?;
        Ok(self.engine.set_odometry(name, odometry)?)
    }

    /// Removes the odometry and restarts the run.
    pub fn clear_odometry(&mut self) {
        self.engine.clear_odometry();
    }

    /// The map as a file of this format.
    ///
    /// # Errors
    /// When the format is unknown.
    pub fn map_file(&self, format: &MapFormat) -> Result<Vec<u8>, Thrown> {
        Ok(point_cloud::write(&self.engine.map().to_cloud(), map_format(format)?))
    }
}

/// The columns of a table of ranges, and the scans that it gives by a `format` as in `add_log`; without it, by a guess. `scan`:
/// index of the scan whose points are returned.
///
/// # Errors
/// When the file has no lines of numbers.
#[wasm_bindgen]
#[allow(clippy::needless_pass_by_value, reason = "optional strings cross by value")]
pub fn describe_table(name: &str, bytes: &[u8], format: Option<String>, scan: usize) -> Result<Ts<TableFacts>, Thrown> {
    let facts = table::describe(bytes, format.as_deref(), scan).map_err(|error| error.in_file(name))?;
    Ok(plain(&facts))
}

/// Whether a file that begins with these bytes is a laser log.
#[wasm_bindgen]
pub fn is_laser_log(head: &[u8]) -> bool {
    laser_log::is_laser_log(head)
}
