//! Tables of ranges without words: a scan a line, or a reading a line. What the columns mean is said by a comment
//! (`# table: FORMAT`), guessed from the numbers and from what lasers there are, or given.
//!
//! As text, a [`TableFormat`] is `name=value` pairs separated by commas, columns counted from 1:
//! `ranges=25:706,unit=mm,start=-120deg,step=0.3516deg,time=1:us,odometry=2:3:4`. What such a text leaves out is guessed.

use std::f64::consts::TAU;

use super::fields::tolerate;
use super::{Bearings, LaserLog, LaserScan, OdometryOrigin, pose};
use crate::geometry::Pose2;
use crate::io::limits::MAX_BEAMS;
use crate::{Error, Result};

mod clock;
mod direction;
mod format;
mod guess;
mod names;
mod numbers;
mod odometry;
mod other_columns;
mod preview;
mod quoted_commas;
mod rows;
mod sweeps;

use direction::{is_direction_open, note_on_direction};
pub use guess::Guess;
pub use odometry::read_wheel_paths;
pub use preview::{TableFacts, describe};
use rows::{Row, Table};
use sweeps::ends_of_sweeps;

/// What the lines of a table of ranges mean. Columns are counted from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct TableFormat {
    /// Which columns hold the ranges.
    pub layout: Layout,
    /// Metres of a unit of the ranges, and of the poses' positions.
    pub unit: f64,
    /// Bearing of the first reading (rad).
    pub start: f64,
    /// From one reading to the next (rad), counter-clockwise.
    pub step: f64,
    /// The time's column and its unit (s).
    pub time: Option<(usize, f64)>,
    /// Columns of the odometry.
    pub odometry: Option<OdometryColumns>,
    /// Whether the odometry is the wheels' own; otherwise a program may have corrected it.
    pub has_wheels: bool,
    /// Columns of the reference pose, which was measured or corrected.
    pub reference: Option<PoseColumns>,
    /// Distance of the laser ahead of the robot's centre (m).
    pub ahead: f64,
}

/// Which lines and columns of a table hold the ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Layout {
    /// A scan a line, in the columns from `first` to before `end`.
    ScanPerLine {
        /// First column of the ranges.
        first: usize,
        /// The column after the last one.
        end: usize,
    },
    /// A reading a line; without angles the whole table is one scan.
    ReadingPerLine {
        /// The column of the range.
        range: usize,
        /// The column of its angle: a scan ends where the angle jumps back.
        angle: Option<AngleColumn>,
    },
}

/// A column of angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AngleColumn {
    /// Index of the column.
    pub column: usize,
    /// Radians of a unit of the angles; negative where they grow clockwise.
    pub unit: f64,
}

/// Columns of a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseColumns {
    /// Columns of x, y and the heading.
    pub columns: [usize; 3],
    /// Metres of a unit of x and y; `None` where they are in the table's unit.
    pub unit: Option<f64>,
    /// Radians of a unit of the heading.
    pub heading: f64,
}

/// Columns of odometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OdometryColumns {
    /// Poses by odometry.
    Pose(PoseColumns),
    /// Counts of the encoders of the left and the right wheel (ticks).
    Wheels {
        /// Columns of the left and the right wheel.
        columns: [usize; 2],
        /// Distance that a wheel rolls in a tick (m).
        metres_per_tick: f64,
        /// Distance between the wheels (m).
        track: f64,
    },
}

impl TableFormat {
    /// A format in metres, without times and poses.
    fn of(layout: Layout, start: f64, step: f64) -> Self {
        Self {
            layout,
            unit: 1.0,
            start,
            step,
            time: None,
            odometry: None,
            has_wheels: false,
            reference: None,
            ahead: 0.0,
        }
    }

    /// What the columns of a table most probably are.
    ///
    /// # Errors
    /// When its lines do not look like scans: then the format has to be given.
    pub fn guess(text: &[u8]) -> Result<Guess> {
        guess_of(&Table::read(text, usize::MAX))
    }
}

/// The format of a table by its comment and its numbers.
fn guess_of(table: &Table) -> Result<Guess> {
    let guess = guess::guess(table);
    let Some(said) = &table.format else { return guess };
    match guess {
        Err(_) => Ok(said.parse::<TableFormat>()?.into()),
        Ok(Guess { format, doubt, note }) => {
            let says_angles = said.contains("start=") && said.contains("step=");
            let note = note.filter(|_| !said.contains("unit="));
            Ok(Guess { format: format.changed(said)?, doubt: doubt.filter(|_| !says_angles), note })
        }
    }
}

/// The longest run of numbered names, where it is as long as a scan: its columns.
pub(super) fn series_of_names(names: &[String]) -> Option<std::ops::Range<usize>> {
    names::series(names).map(|series| series.first..series.end)
}

/// Whether the beginning of a file is a table of ranges.
pub(super) fn looks_like_table(head: &[u8]) -> bool {
    let is_cut = !head.ends_with(b"\n");
    let Table { mut rows, names, .. } = Table::read(head, numbers::GUESS_LINES);
    if is_cut && rows.len() > 1 && rows.len() < numbers::GUESS_LINES {
        rows.pop();
    }
    let is_scan = |row: &Row| row.values.len() - row.words.len() >= names::MIN_SCAN_NUMBERS;
    let is_readings = rows.len() >= 2 && guess::named_reading(&names).is_some();
    !rows.is_empty()
        && !guess::are_labels(&rows)
        && (rows.iter().all(is_scan) || is_readings || guess::is_counted(&rows) || names::are_scans(&names))
}

/// Whether the beginning of a file is a number a line, which may be the ranges of a scan.
pub(super) fn looks_like_column(head: &[u8]) -> bool {
    let Table { rows, .. } = Table::read(head, numbers::GUESS_LINES);
    rows.len() >= numbers::GUESS_LINES && rows.iter().all(|row| row.values.len() == 1 && row.words.is_empty())
}

/// Reads a table whose format is guessed, and says how it was read.
#[inline(never)]
pub(super) fn read_guessed(text: &[u8]) -> Result<LaserLog> {
    let table = Table::read(text, usize::MAX);
    let Guess { format, doubt, note } = guess_of(&table)?;
    if let Some(doubt) = doubt {
        let turned = if table.width() > 1 && guess::field_of_view(table.rows.len()).is_some() {
            format!("; if a column is a scan, as the {} lines may mean, write a scan a line", table.rows.len())
        } else {
            String::new()
        };
        let remedy = format!("If they do not, say what the columns are; if they do, give --table {format}{turned}");
        return Err(Error::whole(format!("This may be a table of ranges. {}", doubt.trim_end_matches('.')), remedy));
    }
    let mut log = read_rows(&table, &format)?;
    log.notes.push(format!(
        "A table of ranges, read as --table {format}. Give another format if that is not what its columns are."
    ));
    log.notes.extend(table.between.as_ref().map(|name| {
        format!("The columns between those of the ranges, {name} and so on, are neither used nor counted.")
    }));
    log.notes.extend(note);
    let is_told = table.format.is_some() && !table.has_unknown_direction;
    log.notes.extend(note_on_direction(&table, &format).filter(|_| !is_told));
    log.may_be_mirrored = !is_told && is_direction_open(&table, &format);
    log.losses.extend(other_columns::loss_of_positions(&table.names));
    Ok(log)
}

/// Reads a table of the format that a text gives. What it leaves out is guessed, but no times and no poses where it names the
/// ranges: then it is meant to be whole.
///
/// # Errors
/// Names what is wrong with the format, or the line that has no such columns.
pub fn read_given(text: &[u8], given: &str) -> Result<LaserLog> {
    let table = Table::read(text, usize::MAX);
    let are_bearings_given = given.contains("start=") || given.contains("step=") || given.contains("angle=");
    Ok(LaserLog { are_bearings_given, ..read_rows(&table, &format_given(&table, given)?)? })
}

fn format_given(table: &Table, given: &str) -> Result<TableFormat> {
    match guess_of(table) {
        Err(_) => given.parse(),
        Ok(guess) if given.contains("range") => {
            let TableFormat { layout, unit, start, step, .. } = guess.format;
            TableFormat { unit, ..TableFormat::of(layout, start, step) }.changed(given)
        }
        Ok(guess) => guess.format.changed(given),
    }
}

/// Reads a table of this format. Lines before the first one of numbers are stepped over.
///
/// # Errors
/// Names the line that has no such columns.
pub fn read_as(text: &[u8], format: &TableFormat) -> Result<LaserLog> {
    read_rows(&Table::read(text, usize::MAX), format)
}

fn read_rows(table: &Table, format: &TableFormat) -> Result<LaserLog> {
    if table.rows.is_empty() {
        return Err(no_rows());
    }
    let mut damaged: Vec<(usize, Error)> = table.strays.iter().map(|&line| (line, no_number(line))).collect();
    let mut losses = Vec::new();
    let mut rows: Vec<&Row> = Vec::with_capacity(table.rows.len());
    for (index, row) in table.rows.iter().enumerate() {
        match format.fault(row) {
            None => rows.push(row),
            // A recorder that was switched off leaves half a line behind.
            Some(_) if index + 1 == table.rows.len() && index > 0 && row.words.is_empty() => {
                losses.push("The last line is cut off and was left out.".to_owned());
            }
            Some(error) => damaged.push((row.line, error)),
        }
    }
    damaged.sort_by_key(|(line, _)| *line);
    let (damaged_lines, faults): (Vec<usize>, Vec<Error>) = damaged.into_iter().unzip();
    losses.extend(tolerate(&faults, rows.len())?);
    // Lines that were left out keep their numbers.
    let number = |index: usize, row: &Row| index + damaged_lines.partition_point(|&line| line < row.line);
    let scans = match format.layout {
        Layout::ReadingPerLine { range, angle } => format.scans_of_readings(&rows, range, angle),
        Layout::ScanPerLine { first, end } => {
            let mut scans: Vec<LaserScan> = Vec::with_capacity(rows.len());
            for (index, row) in rows.iter().enumerate() {
                let ranges = row.values[first..end].iter().map(|&value| format.range_of(value)).collect();
                let bearings = Bearings::Even { start: format.start, step: format.step };
                scans.push(format.scan(number(index, row), row, ranges, bearings));
            }
            format.add_poses(&mut scans, &rows);
            scans
        }
    };
    let T_robot_laser = Pose2::new(nalgebra::Vector2::new(format.ahead, 0.0), 0.0);
    let odometry_origin = if format.has_wheels { OdometryOrigin::Wheels } else { OdometryOrigin::Unknown };
    Ok(LaserLog { scans, T_robot_laser, odometry_origin, losses, ..LaserLog::default() })
}

fn no_rows() -> Error {
    Error::whole("The file holds no line of numbers", "Give a table of ranges")
}

fn no_number(line: usize) -> Error {
    Error::line(line, "A word in this line is not a number", "Correct the line or remove it")
}

impl TableFormat {
    /// What keeps a row from being read.
    fn fault(&self, row: &Row) -> Option<Error> {
        let (needed, end) = match self.layout {
            Layout::ScanPerLine { first, end } => ((first..end), end),
            Layout::ReadingPerLine { range, .. } => ((range..range + 1), range + 1),
        };
        let angle = match self.layout {
            Layout::ReadingPerLine { angle: Some(angle), .. } => Some(angle.column),
            _ => None,
        };
        let end = end.max(angle.map_or(0, |column| column + 1));
        let has = row.values.len();
        if has < end {
            let problem = format!("The line has {has} numbers, but the table's format needs {end}");
            return Some(Error::line(row.line, problem, "Correct the line, or the table's format"));
        }
        row.words.iter().any(|column| needed.contains(column) || angle == Some(*column)).then(|| no_number(row.line))
    }

    /// A range (m); NaN where nothing came back: lasers write 0 or 1 of their units there, or less than nothing.
    fn range_of(&self, value: f64) -> f32 {
        if value > 1.0 || value > 0.0 && self.unit == 1.0 { (self.unit * value) as f32 } else { f32::NAN }
    }

    fn scan(&self, number: usize, row: &Row, ranges: Vec<f32>, bearings: Bearings) -> LaserScan {
        LaserScan {
            number,
            line: row.line,
            bearings,
            ranges,
            max_range: f64::INFINITY,
            time: self.time.and_then(|(column, seconds)| Some(seconds * row.values.get(column)?)),
            reference: self.reference.and_then(|columns| self.pose_of(row, columns)),
            odometry: None,
        }
    }

    /// Readings one after the other: a scan ends where its angles jump back, or turn back.
    fn scans_of_readings(&self, rows: &[&Row], range: usize, angle: Option<AngleColumn>) -> Vec<LaserScan> {
        let range_of = |row: &&Row| self.range_of(row.values[range]);
        let Some(AngleColumn { column, unit }) = angle else {
            let ranges: Vec<f32> = rows.iter().take(MAX_BEAMS).map(range_of).collect();
            let bearings = Bearings::Even { start: self.start, step: self.step };
            return rows.first().map(|row| self.scan(0, row, ranges, bearings)).into_iter().collect();
        };
        let angles: Vec<f64> = rows.iter().map(|row| row.values[column]).collect();
        let ends = ends_of_sweeps(&angles, TAU / unit.abs());
        let mut begin = 0;
        let (mut scans, mut first_rows): (Vec<LaserScan>, Vec<&Row>) = (Vec::new(), Vec::new());
        for end in ends {
            let beams = begin..end.min(begin + MAX_BEAMS);
            let bearings = angles[beams.clone()].iter().map(|angle| self.start + unit * angle).collect();
            let ranges = rows[beams].iter().map(range_of).collect();
            scans.push(self.scan(scans.len(), rows[begin], ranges, Bearings::Listed(bearings)));
            first_rows.push(rows[begin]);
            begin = end;
        }
        self.add_poses(&mut scans, &first_rows);
        scans
    }

    fn pose_of(&self, row: &Row, PoseColumns { columns, unit, heading }: PoseColumns) -> Option<Pose2> {
        let value = |at: usize| row.values.get(columns[at]).copied().filter(|value| value.is_finite());
        let unit = unit.unwrap_or(self.unit);
        pose(unit * value(0)?, unit * value(1)?, heading * value(2)?)
    }
}
