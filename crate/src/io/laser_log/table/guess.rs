//! What the columns of a table of ranges most probably are: from the names above them, the numbers in them, and from what
//! lasers there are.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use super::format::{TIMES, UNITS};
use super::names::{
    BEAMS, CLOCKS, HEADINGS, MAX_RADIANS, MIN_SCAN_NUMBERS, RANGES, bare, heading_unit, may_be_bearing, series, unit_in,
};
use super::rows::{Row, Table};
use super::{AngleColumn, Layout, OdometryColumns, PoseColumns, TableFormat};
use crate::{Error, Result};

/// Lines that a guess is made from.
pub(super) const GUESS_LINES: usize = 20;
/// Of fewer lines, numbers that grow from line to line, or stay the same, may be ranges.
const MIN_GROWING_LINES: usize = 3;
/// Times stand among the outermost columns.
const MAX_TIME_COLUMN: usize = 3;
/// The ranges of neighbouring beams differ by less than this share of their size in at least one line.
const UNLIKE: f64 = 0.1;
/// What lasers write in place of a range.
const NO_RETURN: f64 = -1.0;
/// A median range from here on can be no metres (m) ...
const MAX_METRES: f64 = 60.0;
/// ... and from here on no centimetres.
const MAX_CENTIMETRES: f64 = 1500.0;
/// More readings than this of no known laser are taken for a full turn: lasers that turn are the common ones.
const MIN_FULL_TURN: usize = 200;
/// Of a full turn the last reading is a neighbour of the first, and differs from it by less than so many of the neighbours in its
/// line do, by the median of the lines: 0.3 to 0.5 measured with an RPLIDAR, 0.96 to 0.98 with 360 readings over a half turn
/// (Freiburg 079 and 101). Of lines that have nothing to do with each other 1 in 100,000 tables lies beyond.
const MAX_SEAM_RANK: f64 = 0.9;
/// Times since 1970 of at least so much have this unit (s); smaller ones are told by their steps.
const EPOCH_UNITS: [(f64, f64); 4] = [(1e17, 1e-9), (1e14, 1e-6), (1e11, 1e-3), (1e8, 1.0)];
/// Units of time (s), by the steps between scans in them.
const STEP_UNITS: [(f64, f64); 4] = [(5e6, 1e-9), (5e3, 1e-6), (5.0, 1e-3), (0.0, 1.0)];

/// A format, and why it may be wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Guess {
    /// Complete: a table can be read by it.
    pub format: TableFormat,
    /// What had to be assumed, in a whole sentence; `None` where the numbers tell all.
    pub doubt: Option<String>,
}

/// Fields of view (rad) of lasers that are common, by the number of their readings.
fn field_of_view(num_readings: usize) -> Option<f64> {
    let degrees = match num_readings {
        // SICK LMS: steps of 1, 0.5 and 0.25 degrees.
        180 | 181 | 361 | 721 => 180.0,
        // Hokuyo URG-04LX and UST, UTM: steps of 360/1024 and 0.25 degrees.
        682 | 683 => 240.0,
        1080 | 1081 | 541 => 270.0,
        // All round: RPLIDAR, LDS, XV-11.
        360 | 400 | 720 | 1440 => 360.0,
        _ => return None,
    };
    Some(f64::to_radians(degrees))
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
    let range = find(&RANGES).filter(|_| names.len() < MIN_SCAN_NUMBERS)?;
    let beam = names.iter().position(|name| BEAMS.contains(&bare(name))).map(|beam| NamedReading::Beam(beam, range));
    // Beside a position, an angle is a heading where the beams are counted.
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

pub(super) fn guess(table: &Table) -> Result<Guess> {
    let rows = &table.rows[..];
    let Some(first) = rows.first() else { return Err(Error::whole("The file holds no table", "Give a laser log")) };
    match named_reading(&table.names) {
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
    let rows = &rows[..rows.len().min(GUESS_LINES)];
    if is_breezy(rows) {
        return Ok(Guess { format: breezy(), doubt: None });
    }
    if first.values.len() < MIN_SCAN_NUMBERS {
        let problem = format!("The lines of this table have {} numbers, which do not make scans", first.values.len());
        return Err(Error::whole(problem, super::format::SAY_COLUMNS));
    }
    Ok(guess_scans(table, rows))
}

/// An angle and a range a line.
fn guess_readings(table: &Table, angle: usize, range: usize) -> Guess {
    let rows = &table.rows;
    let most = rows.iter().filter_map(|row| row.values.get(angle)).fold(0.0, |most: f64, angle| most.max(angle.abs()));
    let unit = if most > MAX_RADIANS { 1f64.to_radians() } else { 1.0 };
    // What the SDK of RPLIDARs prints, and what its frame grabber writes, with its spelling: they turn clockwise.
    let is_rplidar = table.names == ["theta", "dist", "q"] || table.names == ["angule", "distance", "quality"];
    let unit = if is_rplidar { -unit } else { unit };
    let layout = Layout::ReadingPerLine { range, angle: Some(AngleColumn { column: angle, unit }) };
    let format = TableFormat::of(layout, 0.0, 0.0);
    Guess { format: with_columns_beside(table, &format, [angle, range], range), doubt: None }
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
    Guess { format: with_columns_beside(table, &format, [beam, range], range), doubt }
}

/// A reading's format with its unit, and what the columns beside it are.
fn with_columns_beside(table: &Table, format: &TableFormat, taken: [usize; 2], range: usize) -> TableFormat {
    let rows = &table.rows;
    let named = unit_named(table.names.get(range..=range).unwrap_or_default());
    let unit = named.unwrap_or_else(|| unit_of(rows.iter().filter_map(|row| row.values.get(range).copied()).collect()));
    let beside = Beside::of(table, rows, (0..table.width()).filter(|column| !taken.contains(column)));
    TableFormat { unit, time: beside.time(), odometry: beside.poses(unit), ..format.clone() }
}

/// A scan a line: where the ranges begin and end, and what stands beside them.
fn guess_scans(table: &Table, rows: &[Row]) -> Guess {
    let width = table.width();
    if let Some(format) = message_columns(&rows[0].values) {
        return Guess { format, doubt: None };
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
    let beside = Beside::of(table, rows, (0..first).chain(end..width));
    // A robot that drives ahead has an x that grows, too.
    let is_of_pose =
        |column: usize| [&["x"][..], &["y"], &HEADINGS].iter().any(|words| beside.is_called(column, words));
    let may_be_time = |&column: &usize| is_growing(rows, column) && !is_counter(rows, column) && !is_of_pose(column);
    let growing = || beside.columns.iter().copied().find(may_be_time);
    let time = beside.time().or_else(|| growing().map(|column| (column, time_unit(rows, column))));
    let readings =
        rows.iter().flat_map(|row| row.values[first.min(row.values.len())..end.min(row.values.len())].to_vec());
    let named = unit_named(table.names.get(first..end).unwrap_or_default());
    let unit = named.unwrap_or_else(|| unit_of(readings.collect()));
    let format = TableFormat::of(Layout::ScanPerLine { first, end }, start, step);
    let format = TableFormat { unit, time, odometry: beside.poses(unit), has_wheels: false, ..format };
    Guess { format, doubt: doubt.or(doubted) }
}

/// The columns beside the ranges.
struct Beside<'a> {
    names: &'a [String],
    rows: &'a [Row],
    columns: Vec<usize>,
}

impl<'a> Beside<'a> {
    fn of(table: &'a Table, rows: &'a [Row], columns: impl Iterator<Item = usize>) -> Self {
        Self { names: &table.names, rows, columns: columns.collect() }
    }

    /// Whether a column has such a name.
    fn is_called(&self, column: usize, words: &[&str]) -> bool {
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
    fn time(&self) -> Option<(usize, f64)> {
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
    fn poses(&self, table_unit: f64) -> Option<OdometryColumns> {
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

/// A `LaserScan` without names, as `ros2 topic echo --csv` writes it: angle_min, angle_max, angle_increment, time_increment,
/// scan_time, range_min, range_max, then the ranges that these angles make.
fn message_columns(values: &[f64]) -> Option<TableFormat> {
    let is_even = |at: &usize| {
        let [low, high, step, _, _, nearest, farthest] = values[*at..*at + 7] else { return false };
        let steps = (high - low) / step;
        let is_angle = low < high && high - low < 1.01 * TAU && step > 0.0 && (steps - steps.round()).abs() < 0.1;
        is_angle && nearest >= 0.0 && farthest > nearest && *at + 8 + steps.round() as usize <= values.len()
    };
    let at = (0..values.len().saturating_sub(7).min(MIN_SCAN_NUMBERS)).find(is_even)?;
    let (first, step) = (at + 7, values[at + 2]);
    let count = 1 + ((values[at + 1] - values[at]) / step).round() as usize;
    let layout = Layout::ScanPerLine { first, end: first + count };
    (count >= MIN_SCAN_NUMBERS).then(|| TableFormat::of(layout, values[at], step))
}

/// The columns of the ranges, from the first to before the second: as many as a known laser has, where that leaves nothing among
/// them that is no range and nothing beside them without need; and what is to be asked where they may lie elsewhere as well.
fn block_of_ranges(table: &Table, rows: &[Row]) -> (usize, usize, Option<String>) {
    let width = table.width();
    let is_none: Vec<bool> = (0..width).map(|column| is_no_range(rows, column)).collect();
    let most = MIN_SCAN_NUMBERS.min(width - MIN_SCAN_NUMBERS);
    // From the outermost column that is no range; what grows may be a range that does.
    let front = (0..most).rev().find(|&column| is_none[column]).map_or(0, |column| column + 1);
    let back = (0..most).find(|&back| is_none[width - most + back]).map_or(0, |back| most - back);
    let beside = |extra: usize| (0..=extra).map(move |before| (front + before, back + extra - before));
    let fits = |&(front, back): &(usize, usize)| {
        let count = width.saturating_sub(front + back);
        count >= MIN_SCAN_NUMBERS && field_of_view(count).is_some()
    };
    let Some(extra) = (0..=most).find(|&extra| beside(extra).any(|place| fits(&place))) else {
        return (front, width - back, None);
    };
    let (front, back) = beside(extra).find(fits).unwrap_or((front, back));
    let (first, end) = (front, width - back);
    if extra == 0 && field_of_view(end - first - 1).is_some() && is_apart(rows, first, end) {
        let [count, from] = [end - first - 1, first + 2];
        let doubt = format!("The {count} ranges may begin at column {from}, as is assumed, or one column before.");
        return (first + 1, end, Some(doubt));
    }
    let doubt = (extra > 0).then(|| {
        let [count, from] = [end - first, first + 1];
        format!("The {count} ranges may begin at column {from}, as is assumed, or up to {extra} further on.")
    });
    (first, end, doubt)
}

/// Neighbours of a reading that tell how much the readings of a line change from one to the next.
const NEIGHBORS: usize = 10;
/// A column differs from the next by this many times the largest change among its neighbours, where it is none of the ranges.
const APART: f64 = 3.0;

/// Whether a column has in every line a value far from what follows: a speed or a steering angle before the ranges.
fn is_apart(rows: &[Row], first: usize, end: usize) -> bool {
    let is_far = |row: &Row| {
        let Some(values) = row.values.get(first..end.min(first + NEIGHBORS + 2)) else { return false };
        let change = |pair: &[f64]| (pair[1] - pair[0]).abs();
        let largest = values[1..].windows(2).map(change).fold(0.0, f64::max);
        largest > 0.0 && change(&values[..2]) > APART * largest
    };
    rows.len() >= MIN_GROWING_LINES && rows.iter().all(is_far)
}

/// The ranges of lines that count them.
struct CountedBlock {
    first: usize,
    end: usize,
    /// Of the first reading, and from one to the next (rad), where the lines tell.
    bearings: Option<(f64, f64)>,
}

/// The columns of the ranges behind one that counts them, the same in every line. What is the same in every line as well, behind
/// the count, are the angles of the first and the last reading; nothing but a pose may follow the ranges.
fn counted_block(rows: &[Row], width: usize) -> Option<CountedBlock> {
    let count_at = |column: usize| rows[0].values[column] as usize;
    let is_count = |&column: &usize| {
        let (count, behind) = (count_at(column), width - column - 1);
        let is_same = |row: &Row| row.values.get(column) == Some(&(count as f64));
        (MIN_SCAN_NUMBERS..=behind).contains(&count) && behind - count < MIN_SCAN_NUMBERS && rows.iter().all(is_same)
    };
    let column = (0..MIN_SCAN_NUMBERS.min(width)).find(is_count).filter(|_| rows.len() >= MIN_GROWING_LINES)?;
    let (count, behind) = (count_at(column), column + 1);
    let value = |column: usize| rows[0].values[column];
    let is_same = |column: &usize| rows.iter().all(|row| row.values.get(*column) == Some(&value(*column)));
    let num_constant = (behind..width - count).take_while(is_same).count();
    // Where the ranges do not change either, as of a robot that stands, nothing tells.
    let num_constant = if is_same(&(behind + num_constant)) { 0 } else { num_constant };
    let first = behind + num_constant;
    let bearings = match num_constant {
        0 => None,
        1 => angle_span(value(behind), -value(behind)),
        _ => angle_span(value(behind), value(behind + 1)),
    };
    let steps = (count - 1) as f64;
    Some(CountedBlock { first, end: first + count, bearings: bearings.map(|(start, view)| (start, view / steps)) })
}

/// The angle of the first reading and the view up to that of the last (rad), where two numbers can be those: radians, or degrees
/// where they are too large for that.
fn angle_span(start: f64, end: f64) -> Option<(f64, f64)> {
    let unit = if start.abs().max(end.abs()) > MAX_RADIANS { 1f64.to_radians() } else { 1.0 };
    let view = unit * (end - start);
    (start < 0.0 && view > FRAC_PI_4 && view < 1.01 * TAU).then_some((unit * start, view))
}

/// Whether a column can hold no ranges.
fn is_no_range(rows: &[Row], column: usize) -> bool {
    let is_word = rows.iter().any(|row| row.words.contains(&column));
    let is_negative = |row: &Row| row.values.get(column).is_some_and(|&value| value < 0.0 && value != NO_RETURN);
    is_word || rows.iter().any(is_negative) || is_time(rows, column)
}

/// Whether the numbers of one of the outermost columns grow from line to line, and are not those of the next beam.
fn is_time(rows: &[Row], column: usize) -> bool {
    let width = rows[0].values.len();
    let inner = if column < MAX_TIME_COLUMN { column + 1 } else { column - 1 };
    let is_unlike = |row: &Row| {
        let [Some(value), Some(next)] = [row.values.get(column), row.values.get(inner)] else { return false };
        (value - next).abs() > UNLIKE * value.abs().max(next.abs())
    };
    let is_outer = column < MAX_TIME_COLUMN || column + MAX_TIME_COLUMN >= width;
    is_outer && rows.len() >= MIN_GROWING_LINES && is_growing(rows, column) && rows.iter().all(is_unlike)
}

/// Whether a column's values grow from line to line.
fn is_growing(rows: &[Row], column: usize) -> bool {
    let values: Vec<f64> = rows.iter().filter_map(|row| row.values.get(column).copied()).collect();
    values.len() > 1 && values.len() == rows.len() && values.windows(2).all(|pair| pair[0] < pair[1])
}

/// Whether a column counts the lines.
fn is_counter(rows: &[Row], column: usize) -> bool {
    let values = || rows.iter().map(|row| row.values[column]);
    let begin = rows[0].values[column];
    (begin == 0.0 || begin == 1.0) && values().enumerate().all(|(index, value)| value == begin + index as f64)
}

/// Seconds of the unit of times.
fn time_unit(rows: &[Row], column: usize) -> f64 {
    let times: Vec<f64> = rows.iter().filter_map(|row| row.values.get(column).copied()).collect();
    let first = times.first().copied().unwrap_or(0.0);
    let mut steps: Vec<f64> = times.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    steps.sort_by(f64::total_cmp);
    let step = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let unit_from =
        |units: &[(f64, f64)], value: f64| units.iter().find(|(least, _)| value >= *least).map(|unit| unit.1);
    unit_from(&EPOCH_UNITS, first).or_else(|| unit_from(&STEP_UNITS, step)).unwrap_or(1.0)
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

/// Where the two ends of a scan meet: the share of neighbours in its line that differ by less than the first and the last reading
/// do, median of lines spread over the table; `None` where no line has returns at both ends.
fn seam_rank(rows: &[Row], first: usize, end: usize) -> Option<f64> {
    let rank = |row: &Row| {
        let readings = row.values.get(first..end)?;
        let largest = readings.iter().fold(0.0, |most: f64, &reading| most.max(reading));
        // The largest may stand for no return.
        let is_return = |reading: &&f64| reading.is_finite() && **reading > 0.0 && **reading < largest;
        let returns: Vec<f64> = readings.iter().filter(is_return).copied().collect();
        let [at_first, at_last] = [readings.first().filter(is_return)?, readings.last().filter(is_return)?];
        let is_less = |pair: &&[f64]| (pair[0] - pair[1]).abs() < (at_first - at_last).abs();
        Some(returns.windows(2).filter(is_less).count() as f64 / returns.len() as f64)
    };
    let mut ranks: Vec<f64> = rows.iter().step_by(rows.len().div_ceil(GUESS_LINES).max(1)).filter_map(rank).collect();
    ranks.sort_by(f64::total_cmp);
    ranks.get(ranks.len() / 2).copied()
}

/// Bearing of the first reading and the step between two (rad), for a laser that looks ahead; and what was assumed, where no
/// known laser has so many readings, or where its ends would have to meet and do not (`seam`: see [`seam_rank`]).
fn view_of(num_readings: usize, seam: impl Fn() -> Option<f64>) -> (f64, f64, Option<String>) {
    let known = field_of_view(num_readings);
    let view = known.unwrap_or(if num_readings >= MIN_FULL_TURN { TAU } else { PI });
    let is_open = view > 6.0 && seam().is_none_or(|rank| rank > MAX_SEAM_RANK);
    let view = if is_open { PI } else { view };
    let taken = format!("{num_readings} readings: they are taken to cover {:.0} degrees.", view.to_degrees());
    let doubt = match known {
        None => Some(format!("No known laser has {taken}")),
        Some(_) => is_open.then(|| format!("The last does not meet the first, as in a full turn, of {taken}")),
    };
    let is_round = view > 6.0;
    // All round the first reading follows the last; of an even number the last one is left out.
    let num_steps = if is_round || num_readings.is_multiple_of(2) { num_readings } else { num_readings - 1 };
    (if is_round { 0.0 } else { -view / 2.0 }, view / num_steps.max(1) as f64, doubt)
}

/// Metres of the unit that a column's name says: `distance_mm`, `range (cm)`.
fn unit_named(names: &[String]) -> Option<f64> {
    names.iter().find_map(|name| unit_in(name, &UNITS))
}

/// Metres of a unit of these readings.
fn unit_of(mut readings: Vec<f64>) -> f64 {
    readings.retain(|&reading| reading.is_finite() && (reading > 1.0 || reading.fract() != 0.0 && reading > 0.0));
    readings.sort_by(f64::total_cmp);
    let median = readings.get(readings.len() / 2).copied().unwrap_or(0.0);
    let is_whole = readings.iter().all(|reading| reading.fract() == 0.0);
    match median {
        median if median < MAX_METRES && !(is_whole && median > 20.0) => 1.0,
        median if median < MAX_CENTIMETRES && !(is_whole && readings.last() > Some(&5000.0)) => 0.01,
        _ => 1e-3,
    }
}
