//! The columns beside the ranges: the time, and where the robot was.

use super::format::TIMES;
use super::names::{CLOCKS, HEADINGS, bare, heading_unit};
use super::numbers::{MAX_METRES, time_unit};
use super::rows::{Row, Table};
use super::{OdometryColumns, PoseColumns};
use crate::io::laser_log::units::MAX_RADIANS;
use crate::io::length_unit::{UNITS, unit_in};

/// The columns that hold no ranges.
pub(super) struct OtherColumns<'a> {
    names: &'a [String],
    rows: &'a [Row],
    pub(super) columns: Vec<usize>,
}

impl<'a> OtherColumns<'a> {
    pub(super) fn of(table: &'a Table, rows: &'a [Row], columns: impl Iterator<Item = usize>) -> Self {
        Self { names: &table.names, rows, columns: columns.collect() }
    }

    /// Whether a column has such a name.
    pub(super) fn is_called(&self, column: usize, words: &[&str]) -> bool {
        self.names.get(column).is_some_and(|name| words.contains(&bare(name)))
    }

    /// The first column of such a name that holds numbers.
    fn named(&self, words: &[&str]) -> Option<(usize, &'a str)> {
        let name = |column: usize| self.names.get(column).map(String::as_str);
        let holds = |column: usize| !self.rows.iter().any(|row| row.words.contains(&column));
        let mut known = self.columns.iter().filter_map(|&column| Some((column, name(column)?)));
        known.find(|&(column, name)| words.contains(&bare(name)) && holds(column))
    }

    /// Whether positions beside ranges in smaller units are small numbers with fractions: wheels are not known to micrometres.
    fn is_in_metres(&self, columns: [usize; 2], table_unit: f64) -> bool {
        let values: Vec<f64> =
            self.rows.iter().flat_map(|row| columns.map(|column| row.values.get(column).copied())).flatten().collect();
        let are_small = values.iter().all(|value| value.abs() < MAX_METRES);
        table_unit < 1.0 && are_small && values.iter().any(|value| value.fract() != 0.0)
    }

    /// The column of the time and its unit (s).
    pub(super) fn time(&self) -> Option<(usize, f64)> {
        let is_clock = |column: &usize| {
            let is_time =
                |row: &Row| row.words.contains(column) && row.values.get(*column).is_some_and(|t| t.is_finite());
            self.rows.iter().all(is_time)
        };
        if let Some(column) = self.columns.iter().copied().find(is_clock) {
            return Some((column, 1.0));
        }
        let (column, name) = self.named(&CLOCKS)?;
        Some((column, unit_in(name, &TIMES).unwrap_or_else(|| time_unit(self.rows, column))))
    }

    /// Where the robot was; `table_unit`: metres of a unit of the ranges.
    pub(super) fn poses(&self, table_unit: f64) -> Option<OdometryColumns> {
        let ((x, x_name), (y, y_name)) = (self.named(&["x"])?, self.named(&["y"])?);
        let (theta, heading_name) = self.named(&HEADINGS)?;
        if are_unlike(x_name, y_name) {
            return None;
        }
        let unit = unit_in(x_name, &UNITS).or_else(|| self.is_in_metres([x, y], table_unit).then_some(1.0));
        let is_beyond = |row: &Row| row.values.get(theta).is_some_and(|heading| heading.abs() > MAX_RADIANS);
        let is_wide = !heading_name.contains("rad") && self.rows.iter().any(is_beyond);
        let heading = if is_wide { 1f64.to_radians() } else { heading_unit(heading_name) };
        Some(OdometryColumns::Pose(PoseColumns { columns: [x, y, theta], unit, heading }))
    }
}

/// Whether the names of two columns say different units of length.
fn are_unlike(x_name: &str, y_name: &str) -> bool {
    let [x, y] = [x_name, y_name].map(|name| unit_in(name, &UNITS));
    x.is_some() && y.is_some() && x != y
}

/// That positions are not used whose x and y are in different units by their names.
pub(super) fn loss_of_positions(names: &[String]) -> Option<String> {
    let named = |word: &str| names.iter().find(|name| bare(name) == word);
    let (x, y) = (named("x")?, named("y")?);
    are_unlike(x, y).then(|| {
        format!("The positions are in different units ({x}, {y}) and were not used. Save x and y in one unit.")
    })
}
