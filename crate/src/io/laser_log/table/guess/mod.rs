//! What the columns of a table of ranges most probably are: from the names above them, the numbers in them, and from what
//! lasers there are.

use std::f64::consts::TAU;

use super::format::SAY_COLUMNS;
use super::names::{BEAMS, HEADINGS, MIN_SCAN_NUMBERS, RANGES, bare, may_be_bearing, series};
use super::rows::{Row, Table};
use super::{AngleColumn, Layout, OdometryColumns, TableFormat};
use crate::io::laser_log::units::MAX_RADIANS;
use crate::io::length_unit::{JudgedUnit, UNITS, unit_in};
use crate::{Error, Result};

mod ranges;
mod view;

use super::numbers::{GUESS_LINES, MIN_GROWING_LINES, is_counter, is_growing, time_unit, unit_of};
use super::other_columns::OtherColumns;
use ranges::{block_of_ranges, counted_block};
pub(super) use view::field_of_view;
use view::{seam_rank, view_of};

/// A format, and why it may be wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Guess {
    /// Complete: a table can be read by it.
    pub format: TableFormat,
    /// What had to be assumed, in a whole sentence; `None` where the numbers tell all.
    pub doubt: Option<String>,
    /// What is likely but not certain, in a whole sentence.
    pub note: Option<String>,
}

impl From<TableFormat> for Guess {
    fn from(format: TableFormat) -> Self {
        Self { format, doubt: None, note: None }
    }
}

/// Two columns, the first of which counts, perhaps again and again: a step and its range.
pub(super) fn is_counted(rows: &[Row]) -> bool {
    let Some(begin) = rows.first().map(|row| row.values[0]) else { return false };
    let follows = |pair: &[Row]| {
        let [before, now] = [pair[0].values[0], pair[1].values[0]];
        now == before + 1.0 || now == begin
    };
    let is_pair = |row: &Row| row.values.len() == 2 && row.words.is_empty();
    rows.len() >= GUESS_LINES
        && (begin == 0.0 || begin == 1.0)
        && rows.iter().all(is_pair)
        && rows.windows(2).all(follows)
}

/// The columns of a reading a line, by their names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NamedReading {
    /// An angle, and a range.
    Angle(usize, usize),
    /// The number of a beam in its scan, and a range.
    Beam(usize, usize),
}

pub(super) fn named_reading(names: &[String]) -> Option<NamedReading> {
    let find = |words: &[&str]| names.iter().position(|name| words.iter().any(|word| name.starts_with(word)));
    let is_there = |word: &str| names.iter().any(|name| bare(name) == word);
    // Without x and y beside it, r is a range in polar coordinates.
    let named_r = || names.iter().position(|name| !is_there("x") && ["r", "rho"].contains(&bare(name)));
    let range = find(&RANGES).or_else(named_r).filter(|_| names.len() < MIN_SCAN_NUMBERS)?;
    let beam = names.iter().position(|name| BEAMS.contains(&bare(name))).map(|beam| NamedReading::Beam(beam, range));
    // Where the beams are counted, an angle beside x and y is a heading.
    let is_heading = beam.is_some() && is_there("x") && is_there("y");
    let angle = bearings(names).find(|&column| !is_heading && column != range);
    angle.map(|angle| NamedReading::Angle(angle, range)).or(beam)
}

/// The columns that may be a reading's bearing by their names; a heading may be among them.
fn bearings(names: &[String]) -> impl Iterator<Item = usize> + '_ {
    (0..names.len()).filter(|&column| may_be_bearing(&names[column]))
}

/// Of several columns that may be the bearing, the one that changes most often from line to line: a heading stays as it is while
/// the laser turns.
fn most_changing(table: &Table, angle: usize, range: usize) -> usize {
    let num_changes = |column: usize| {
        let value = |row: &Row| row.values.get(column).copied();
        table.rows.windows(2).filter(|pair| value(&pair[0]) != value(&pair[1])).count()
    };
    let others = bearings(&table.names).filter(|&column| column != range && column < table.width());
    others.fold(angle, |best, next| if num_changes(next) > num_changes(best) { next } else { best })
}

/// Most different numbers of labels, which are bytes: ranges that are whole numbers are larger.
const MOST_LABELS: usize = 12;

/// Whether lines as long as a scan's hold labels, a few small whole numbers, behind their first number.
pub(super) fn are_labels(rows: &[Row]) -> bool {
    let rows = &rows[..rows.len().min(GUESS_LINES)];
    let mut different: Vec<f64> = Vec::new();
    let mut is_label = |&value: &f64| {
        if !different.contains(&value) && value.is_finite() {
            different.push(value);
        }
        value.is_nan() || value.fract() == 0.0 && value.abs() <= f64::from(u8::MAX) && different.len() <= MOST_LABELS
    };
    let mut is_of_labels = |row: &Row| row.values.len() > MIN_SCAN_NUMBERS && row.values[1..].iter().all(&mut is_label);
    rows.len() >= MIN_GROWING_LINES && rows.iter().all(&mut is_of_labels) && different.len() > 1
}

/// How names of an angle out of the plane of the bearings begin.
const ELEVATIONS: [&str; 3] = ["elevation", "vertical", "inclination"];

/// The name of a column of elevations, where they differ.
fn elevation(table: &Table) -> Option<&str> {
    let is_called = |name: &String| ELEVATIONS.iter().any(|word| name.starts_with(word));
    let column = table.names.iter().position(is_called)?;
    let value = |row: &Row| row.values.get(column).copied();
    let differ = table.rows.windows(2).any(|pair| value(&pair[0]) != value(&pair[1]));
    differ.then(|| table.names[column].as_str())
}

pub(super) fn guess(table: &Table) -> Result<Guess> {
    let rows = &table.rows[..];
    let Some(first) = rows.first() else { return Err(Error::whole("The file holds no table", "Give a laser log")) };
    if are_labels(rows) {
        return Err(Error::whole("The numbers of this table are labels: few different whole numbers", SAY_COLUMNS));
    }
    let named = named_reading(&table.names);
    if let Some(name) = named.as_ref().and_then(|_| elevation(table)) {
        let problem =
            format!("These are points in space, with \"{name}\" beside their bearings, and no scans of one plane");
        let remedy = "Write x, y and z under these names in place of azimuth a, elevation e and range r: r cos(e) cos(a), \
                      r cos(e) sin(a), r sin(e); a file a cloud";
        return Err(Error::whole(problem, remedy));
    }
    match named {
        Some(NamedReading::Angle(angle, range)) if angle.max(range) < table.width() => {
            return Ok(guess_readings(table, most_changing(table, angle, range), range));
        }
        Some(NamedReading::Beam(beam, range)) if beam.max(range) < table.width() => {
            return Ok(guess_counted(table, beam, range));
        }
        _ => {}
    }
    if is_counted(&rows[..rows.len().min(GUESS_LINES)]) {
        return Ok(guess_counted(table, 0, 1));
    }
    if rows.len() >= MIN_SCAN_NUMBERS && rows.iter().all(|row| row.values.len() == 1) {
        return Ok(guess_column(table));
    }
    let rows = &rows[..rows.len().min(GUESS_LINES)];
    if is_breezy(rows) {
        return Ok(breezy().into());
    }
    if first.values.len() < MIN_SCAN_NUMBERS {
        let problem = format!("The lines of this table have {} numbers, which do not make scans", first.values.len());
        return Err(Error::whole(problem, SAY_COLUMNS));
    }
    Ok(guess_scans(table, rows))
}

/// An angle and a range a line.
fn guess_readings(table: &Table, angle: usize, range: usize) -> Guess {
    let rows = &table.rows;
    let most = rows.iter().filter_map(|row| row.values.get(angle)).fold(0.0, |most: f64, angle| most.max(angle.abs()));
    let unit = angle_unit(most);
    let is_of_sdk = RPLIDAR_UNITS.iter().any(|degrees| degrees.to_radians() == unit);
    let unit = if is_of_sdk || is_rplidar(table, angle, range) { -unit } else { unit };
    let layout = Layout::ReadingPerLine { range, angle: Some(AngleColumn { column: angle, unit }) };
    let format = TableFormat::of(layout, 0.0, 0.0);
    with_columns_beside(table, format, angle, range)
}

/// Degrees of the units in which the SDK of RPLIDARs has its angles.
const RPLIDAR_UNITS: [f64; 2] = [1.0 / 64.0, 90.0 / 16_384.0];
/// A full turn in a unit of angles ends so near to its end (share of a turn): between two readings.
const SAME_TURN: f64 = 0.05;

/// Radians of a unit of angles up to this one: those of a turn are in degrees, or in a part of them in which they are a turn.
fn angle_unit(most: f64) -> f64 {
    if most <= MAX_RADIANS {
        return 1.0;
    }
    let is_turn = |degrees: &f64| (most * degrees / 360.0 - 1.0).abs() < SAME_TURN;
    let parts = RPLIDAR_UNITS.into_iter().chain([0.01]);
    parts.into_iter().find(is_turn).unwrap_or(1.0).to_radians()
}

/// Whether these are readings of an RPLIDAR, which turns clockwise: under the names that its SDK and its frame grabber print, or in its
/// units, 64ths of a degree and quarters of a millimetre. A quality beside them has other lasers, too.
fn is_rplidar(table: &Table, angle: usize, range: usize) -> bool {
    let value = |row: &Row, column: usize| row.values.get(column).copied().unwrap_or(f64::NAN);
    let angles = || table.rows.iter().map(move |row| value(row, angle));
    let is_round = !angles().any(|angle| angle < 0.0) && angles().any(|angle| angle > 180.0);
    let is_printed = table.names == ["theta", "dist", "q"] || table.names == ["angule", "distance", "quality"];
    let is_multiple = |value: f64, parts: f64| value.is_nan() || (value * parts).fract() == 0.0;
    let in_its_units = |row: &Row| is_multiple(value(row, angle), 64.0) && is_multiple(value(row, range), 4.0);
    let has_fractions = angles().any(|angle| angle.fract() != 0.0);
    is_printed || is_round && has_fractions && table.rows.iter().all(in_its_units)
}

/// The number of a beam and a range a line, of one scan or of several.
fn guess_counted(table: &Table, beam: usize, range: usize) -> Guess {
    let rows = &table.rows;
    let begin = rows[0].values[beam];
    let is_begin = |row: &Row| row.values.get(beam) == Some(&begin);
    let count = rows.iter().skip(1).position(is_begin).map_or(rows.len(), |index| index + 1);
    let (start, step, doubt) = view_of(count, || Some(0.0));
    let angle = (count < rows.len()).then_some(AngleColumn { column: beam, unit: step });
    let start = if angle.is_some() { start - begin * step } else { start };
    let format = TableFormat::of(Layout::ReadingPerLine { range, angle }, start, step);
    Guess { doubt, ..with_columns_beside(table, format, beam, range) }
}

/// A number a line: the ranges of one scan, if they are some.
fn guess_column(table: &Table) -> Guess {
    let readings: Vec<f64> = table.rows.iter().map(|row| row.values[0]).collect();
    let count = readings.len();
    let (start, step, _) = view_of(count, || Some(0.0));
    let layout = Layout::ReadingPerLine { range: 0, angle: None };
    let (unit, note) = unit_told(table.unit, &table.names, readings);
    let doubt = format!(
        "The numbers may make one scan of {count} readings, {:.4} degrees apart from {:.4} degrees on, which nothing says.",
        step.to_degrees(),
        start.to_degrees()
    );
    Guess { format: TableFormat { unit, ..TableFormat::of(layout, start, step) }, doubt: Some(doubt), note }
}

/// The format of a reading a line with its unit, and what the columns beside its bearing (an angle or the number of a beam) and
/// its range are.
fn with_columns_beside(table: &Table, mut format: TableFormat, bearing: usize, range: usize) -> Guess {
    let rows = &table.rows;
    let readings = rows.iter().filter_map(|row| row.values.get(range).copied()).collect();
    let (unit, note) = unit_told(table.unit, table.names.get(range..=range).unwrap_or_default(), readings);
    let others = OtherColumns::of(table, rows, (0..table.width()).filter(|column| ![bearing, range].contains(column)));
    (format.unit, format.time, format.odometry) = (unit, others.time(), others.poses(unit));
    Guess { format, doubt: None, note }
}

/// Metres of a unit of the readings, as a comment says, by the names of their columns, or by the readings; and what else it may be.
fn unit_told(said: Option<f64>, names: &[String], readings: Vec<f64>) -> (f64, Option<String>) {
    if let Some(unit) = said.or_else(|| unit_named(names)) {
        return (unit, None);
    }
    let JudgedUnit { unit, alternatives, median, .. } = unit_of(readings);
    let note = alternatives.first().map(|other| {
        format!(
            "Its ranges (median {median:.4}) are taken for {}, and may be {}: then give unit={}.",
            unit.name, other.name, other.symbol
        )
    });
    (unit.metres, note)
}

/// A scan a line: where the ranges begin and end, and what stands beside them.
fn guess_scans(table: &Table, rows: &[Row]) -> Guess {
    let width = table.width();
    if let Some(format) = message_columns(&rows[0].values) {
        return format.into();
    }
    let named = series(&table.names).filter(|named| named.end <= width);
    let counted = if named.is_some() { None } else { counted_block(rows, width) };
    let (first, end, doubted) = match (&named, &counted) {
        (Some(named), _) => (named.first, named.end, None),
        (_, Some(counted)) => (counted.first, counted.end, None),
        _ => block_of_ranges(table, rows),
    };
    let told = named.and_then(|named| named.bearings).or(counted.and_then(|counted| counted.bearings));
    let known = told.map(|(start, step)| (start, step, None));
    let (start, step, doubt) = known.unwrap_or_else(|| view_of(end - first, || seam_rank(&table.rows, first, end)));
    let others = OtherColumns::of(table, rows, (0..first).chain(end..width));
    // A robot that drives ahead has an x that grows, too.
    let is_of_pose =
        |column: usize| [&["x"][..], &["y"], &HEADINGS].iter().any(|words| others.is_called(column, words));
    let may_be_time = |&column: &usize| is_growing(rows, column) && !is_counter(rows, column) && !is_of_pose(column);
    let growing = || others.columns.iter().copied().find(may_be_time);
    let time = others.time().or_else(|| growing().map(|column| (column, time_unit(rows, column))));
    let readings =
        rows.iter().flat_map(|row| row.values[first.min(row.values.len())..end.min(row.values.len())].to_vec());
    let (unit, note) = unit_told(table.unit, table.names.get(first..end).unwrap_or_default(), readings.collect());
    let format = TableFormat::of(Layout::ScanPerLine { first, end }, start, step);
    let format = TableFormat { unit, time, odometry: others.poses(unit), has_wheels: false, ..format };
    Guess { format, doubt: doubt.or(doubted), note }
}

/// A `LaserScan` without names, as `ros2 topic echo --csv` writes it: angle_min, angle_max, angle_increment, time_increment,
/// scan_time, range_min, range_max, then the ranges that these angles make.
fn message_columns(values: &[f64]) -> Option<TableFormat> {
    let is_even = |at: &usize| {
        let [low, high, step, _, _, nearest, farthest] = values[*at..*at + 7] else { return false };
        let steps = (high - low) / step;
        let is_angle = low < high && high - low < 1.01 * TAU && step > 0.0 && (steps - steps.round()).abs() < 0.1;
        is_angle && nearest >= 0.0 && farthest > nearest && steps.round() <= (values.len() - *at - 8) as f64
    };
    let at = (0..values.len().saturating_sub(7).min(MIN_SCAN_NUMBERS)).find(is_even)?;
    let (first, step) = (at + 7, values[at + 2]);
    let count = 1 + ((values[at + 1] - values[at]) / step).round() as usize;
    let layout = Layout::ScanPerLine { first, end: first + count };
    (count >= MIN_SCAN_NUMBERS).then(|| TableFormat::of(layout, values[at], step))
}

fn is_breezy(rows: &[Row]) -> bool {
    let is_row = |row: &Row| matches!(row.values.len(), 706 | 707);
    rows.iter().all(is_row) && is_growing(rows, 0) && rows[0].values[0] > 1e3
}

/// The `.dat` of BreezySLAM's example: a URG-04LX on the robot of the Paris School of Mines. 24 numbers (the time in us
/// first, the ticks of the wheels third and fourth), 682 ranges in mm, one more number.
fn breezy() -> TableFormat {
    let layout = Layout::ScanPerLine { first: 24, end: 24 + 682 };
    TableFormat {
        unit: 1e-3,
        time: Some((0, 1e-6)),
        // Wheels of 77 mm radius, 330 mm apart, 2000 ticks a turn.
        odometry: Some(OdometryColumns::Wheels { columns: [2, 3], metres_per_tick: TAU * 0.077 / 2000.0, track: 0.33 }),
        has_wheels: true,
        ahead: 0.145,
        ..TableFormat::of(layout, -120f64.to_radians(), TAU / 1024.0)
    }
}

/// Metres of the unit that a column's name says: `distance_mm`, `range (cm)`.
fn unit_named(names: &[String]) -> Option<f64> {
    // The SDK of RPLIDARs has quarters of millimetres: `dist_q2`, `dist_mm_q2`.
    let named = |name: &String| if name.ends_with("q2") { Some(0.25e-3) } else { unit_in(name, &UNITS) };
    names.iter().find_map(named)
}
