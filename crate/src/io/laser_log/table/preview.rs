//! A table as it would be read, to be looked at before it is.

use serde::Serialize;

use super::rows::Table;
use super::{Guess, format_given, guess_of, no_rows, read_rows};
use crate::Result;

/// Number of lines in [`TableFacts::cells`].
const SHOWN_LINES: usize = 6;

/// What a table holds, and what comes of it by a format.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct TableFacts {
    /// The format it is read by, whole, as text; empty where there is none.
    pub format: String,
    /// What had to be assumed; empty where the numbers tell all.
    pub doubt: String,
    /// Why it cannot be read so; empty where it can.
    pub problem: String,
    /// Lines of numbers.
    pub num_rows: usize,
    /// Columns of the first one.
    pub num_columns: usize,
    /// The words above the columns; empty where there are none.
    pub names: Vec<String>,
    /// The first lines, with all columns; `None` where a cell holds no number.
    pub cells: Vec<Vec<Option<f64>>>,
    /// Scans that come of it.
    pub num_scans: usize,
    /// x and y of the readings of the scan that was asked for (m).
    pub points: Vec<[f32; 2]>,
    /// Readings of that scan, those without a return among them.
    pub num_readings: usize,
}

/// A table by the format that a text gives, or, without one, by a guess; and its scan of this number.
///
/// # Errors
/// When the text is no table.
pub fn describe(text: &[u8], given: Option<&str>, scan: usize) -> Result<TableFacts> {
    let table = Table::read(text, usize::MAX);
    let guess = guess_of(&table);
    if table.rows.is_empty() {
        guess?;
        return Err(no_rows());
    }
    let doubt = guess.as_ref().ok().and_then(|guess| guess.doubt.clone()).unwrap_or_default();
    let format = match given {
        Some(given) => format_given(&table, given),
        None => guess.map(|Guess { format, .. }| format),
    };
    let log = format.as_ref().map_err(Clone::clone).and_then(|format| read_rows(&table, format));
    let cell = |value: &f64| Some(*value).filter(|value| value.is_finite());
    let cells = table.rows.iter().take(SHOWN_LINES).map(|row| row.values.iter().map(cell).collect());
    let shown = log.as_ref().ok().and_then(|log| log.scans.get(scan.min(log.scans.len().saturating_sub(1))));
    Ok(TableFacts {
        format: format.as_ref().map(ToString::to_string).unwrap_or_default(),
        doubt: if given.is_some() { String::new() } else { doubt },
        problem: log.as_ref().err().map(ToString::to_string).unwrap_or_default(),
        num_rows: table.rows.len(),
        num_columns: table.width(),
        names: table.names.clone(),
        cells: cells.collect(),
        num_scans: log.as_ref().map_or(0, |log| log.scans.len()),
        points: shown.map(super::LaserScan::points).unwrap_or_default(),
        num_readings: shown.map_or(0, |scan| scan.ranges.len()),
    })
}
