//! Files of a planar reconstruction beyond those that the page begins with: laser logs, other formats of the map.

use tsify::Ts;
use wasm_bindgen::prelude::*;

use super::point_cloud::{MapFormat, map_format};
use super::{Reconstruction, plain, thrown};
use crate::io::laser_log::table::{self, TableFacts};
use crate::io::{laser_log, point_cloud};
use crate::pipeline::report::AddedLog;

#[wasm_bindgen]
impl Reconstruction {
    /// Adds all scans of a laser log and starts over. Their poses are not used for the estimate, unless the setting
    /// `odometry` asks for it. `table` says what the columns of a table of ranges are, e.g.
    /// `ranges=2:541,unit=mm,start=-135deg,step=0.5deg`; what it leaves out is guessed, and without it all, which a note tells.
    ///
    /// # Errors
    /// When the file is no sound log, or `table` no format; what was added before stays.
    pub fn add_log(&mut self, name: &str, bytes: &[u8], table: Option<String>) -> Result<Ts<AddedLog>, JsValue> {
        let log = match table {
            None => laser_log::read(bytes),
            Some(format) => table::read_given(bytes, &format),
        };
        let log = log.map_err(|error| thrown(&error.in_file(name)))?;
        plain(&self.engine.add_log(name, &log))
    }

    /// The map as a file of this format.
    ///
    /// # Errors
    /// When there is no such format.
    pub fn map_file(&self, format: &MapFormat) -> Result<Vec<u8>, JsValue> {
        Ok(point_cloud::write(&self.engine.map().to_cloud(), map_format(format)?))
    }
}

/// What a table of ranges holds, and what comes of it by the `format` that `add_log` would be given; without it, by a guess.
/// `scan`: of which scan the points are wanted.
///
/// # Errors
/// When there are no lines of numbers in the file.
#[wasm_bindgen]
#[allow(clippy::needless_pass_by_value, reason = "optional strings cross by value")]
pub fn describe_table(
    name: &str,
    bytes: &[u8],
    format: Option<String>,
    scan: usize,
) -> Result<Ts<TableFacts>, JsValue> {
    let facts = table::describe(bytes, format.as_deref(), scan).map_err(|error| thrown(&error.in_file(name)))?;
    plain(&facts)
}

/// Whether a file that begins with these bytes is a laser log.
#[wasm_bindgen]
pub fn is_laser_log(head: &[u8]) -> bool {
    laser_log::is_laser_log(head)
}
