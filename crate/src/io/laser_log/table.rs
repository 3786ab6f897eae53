//! Tables of ranges without words: a scan a line, or a reading a line. What the columns mean is guessed from the numbers
//! and from what lasers there are, or given.
//!
//! As text, a [`TableFormat`] is `name=value` pairs apart by commas, columns counted from 1:
//! `ranges=25:706,unit=mm,start=-120deg,step=0.3516deg,time=1:us,odometry=2:3:4`.

use std::fmt;
use std::str::FromStr;

use super::fields::lines;
use super::{Bearings, LaserLog, LaserScan, MAX_BEAMS, pose};
use crate::geometry::Pose2;
use crate::io::text::{number, quote};
use crate::{Error, Result};

/// What the lines of a table of ranges mean. Columns are counted from 0.
#[derive(Debug, Clone, PartialEq)]
pub struct TableFormat {
    /// Where the ranges stand.
    pub layout: Layout,
    /// Metres of a unit of the ranges, and of the odometry's positions.
    pub unit: f64,
    /// Bearing of the first reading (rad).
    pub start: f64,
    /// From one reading to the next (rad), counter-clockwise.
    pub step: f64,
    /// The time's column and its unit (s).
    pub time: Option<(usize, f64)>,
    /// What the robot's wheels measured.
    pub odometry: Option<OdometryColumns>,
    /// How far the laser sits ahead of the robot's centre (m).
    pub ahead: f64,
}

/// Where the ranges of a table stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// A scan a line, in the columns from `first` to before `end`.
    ScanPerLine {
        /// First column of the ranges.
        first: usize,
        /// The column after the last one.
        end: usize,
    },
    /// The whole table is one scan, a reading a line.
    ReadingPerLine {
        /// The column of the range.
        range: usize,
    },
}

/// Columns of odometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OdometryColumns {
    /// x, y (in the table's unit) and heading (rad).
    Pose([usize; 3]),
    /// What the left and the right wheel have turned, in ticks.
    Wheels {
        /// Columns of the left and the right wheel.
        columns: [usize; 2],
        /// What a wheel rolls in a tick (m).
        metres_per_tick: f64,
        /// Between the wheels (m).
        track: f64,
    },
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

/// Lines that a guess is made from.
const GUESS_LINES: usize = 20;
/// A line of a scan has this many numbers at least: a pose has 16 at the most.
const MIN_SCAN_NUMBERS: usize = 24;
/// A median range from here on can be no metres (m) ...
const MAX_METRES: f64 = 60.0;
/// ... and from here on no centimetres.
const MAX_CENTIMETRES: f64 = 1500.0;

/// Whether the beginning of a file is a table of ranges.
pub(super) fn looks_like_table(head: &[u8]) -> bool {
    let is_cut = !head.ends_with(b"\n");
    let mut rows: Vec<Vec<f64>> = first_rows(head);
    if is_cut && rows.len() > 1 && rows.len() < GUESS_LINES {
        rows.pop();
    }
    let is_scans = rows.iter().all(|row| row.len() >= MIN_SCAN_NUMBERS);
    !rows.is_empty() && (is_scans || is_counted(&rows))
}

/// Two columns, the first of which counts: a step and its range.
fn is_counted(rows: &[Vec<f64>]) -> bool {
    let begin = rows[0][0];
    let counts = |(index, row): (usize, &Vec<f64>)| row.len() == 2 && row[0] == begin + index as f64;
    rows.len() >= GUESS_LINES && (begin == 0.0 || begin == 1.0) && rows.iter().enumerate().all(counts)
}

fn first_rows(text: &[u8]) -> Vec<Vec<f64>> {
    let numeric = lines(text).filter_map(|(_, line)| row_of(line).filter(|row| !row.is_empty()));
    numeric.take(GUESS_LINES).collect()
}

/// The numbers of a line apart by spaces, commas, semicolons or tabs; `None` where one of the words is none.
fn row_of(line: &[u8]) -> Option<Vec<f64>> {
    let is_gap = |byte: &u8| byte.is_ascii_whitespace() || matches!(byte, b',' | b';');
    line.split(is_gap).filter(|word| !word.is_empty()).map(number).collect()
}

impl TableFormat {
    /// What the columns of a table most probably are.
    ///
    /// # Errors
    /// When no laser has this number of readings: then the format is to be given.
    pub fn guess(text: &[u8]) -> Result<Self> {
        let rows = first_rows(text);
        let Some(first) = rows.first() else { return Err(Error::whole("The file holds no table", "Give a laser log")) };
        if is_counted(&rows) {
            let readings: Vec<f64> = lines(text).filter_map(|(_, line)| row_of(line)?.get(1).copied()).collect();
            let (start, step) = view_of(readings.len())?;
            let layout = Layout::ReadingPerLine { range: 1 };
            return Ok(Self { layout, unit: unit_of(readings), start, step, time: None, odometry: None, ahead: 0.0 });
        }
        if is_breezy(&rows) {
            return Ok(Self::breezy());
        }
        let num_beside = (0..=MIN_SCAN_NUMBERS)
            .find(|&beside| first.len() > beside && field_of_view(first.len() - beside).is_some());
        let Some(num_beside) = num_beside else { return Err(unknown_view(first.len())) };
        let time = (0..num_beside).find(|&column| is_ascending(&rows, column)).map(|column| (column, 1.0));
        let (start, step) = view_of(first.len() - num_beside)?;
        let layout = Layout::ScanPerLine { first: num_beside, end: first.len() };
        let unit = unit_of(rows.iter().flat_map(|row| row[num_beside.min(row.len())..].to_vec()).collect());
        Ok(Self { layout, unit, start, step, time, odometry: None, ahead: 0.0 })
    }

    /// The `.dat` of BreezySLAM's example: a URG-04LX on the robot of the Paris School of Mines. 24 numbers (the time in us
    /// first, the ticks of the wheels third and fourth), 682 ranges in mm, one more number.
    fn breezy() -> Self {
        let step = std::f64::consts::TAU / 1024.0;
        Self {
            layout: Layout::ScanPerLine { first: 24, end: 24 + 682 },
            unit: 1e-3,
            start: -120f64.to_radians(),
            step,
            time: Some((0, 1e-6)),
            // Wheels of 77 mm radius, 330 mm apart, 2000 ticks a turn.
            odometry: Some(OdometryColumns::Wheels {
                columns: [2, 3],
                metres_per_tick: std::f64::consts::TAU * 0.077 / 2000.0,
                track: 0.33,
            }),
            ahead: 0.145,
        }
    }
}

fn is_breezy(rows: &[Vec<f64>]) -> bool {
    let is_row = |row: &Vec<f64>| matches!(row.len(), 706 | 707);
    rows.iter().all(is_row) && is_ascending(rows, 0) && rows[0][0] > 1e3
}

/// Whether a column's values grow from line to line.
fn is_ascending(rows: &[Vec<f64>], column: usize) -> bool {
    let values: Vec<f64> = rows.iter().filter_map(|row| row.get(column).copied()).collect();
    values.len() > 1 && values.len() == rows.len() && values.windows(2).all(|pair| pair[0] < pair[1])
}

/// Bearing of the first reading and the step between two (rad), for a laser that looks ahead.
fn view_of(num_readings: usize) -> Result<(f64, f64)> {
    let view = field_of_view(num_readings).ok_or_else(|| unknown_view(num_readings))?;
    let is_round = view > 6.0;
    // All round the first reading follows the last; of an even number the last one is left out.
    let num_steps = if is_round || num_readings.is_multiple_of(2) { num_readings } else { num_readings - 1 };
    Ok((if is_round { 0.0 } else { -view / 2.0 }, view / num_steps as f64))
}

fn unknown_view(num_readings: usize) -> Error {
    let problem = format!("This may be a table of ranges, but no known laser has {num_readings} readings");
    Error::whole(problem, "Say what its columns are, e.g. --table ranges=2:541,unit=m,start=-135deg,step=0.5deg,time=1")
}

/// Metres of a unit of these readings.
fn unit_of(mut readings: Vec<f64>) -> f64 {
    readings.retain(|&reading| reading > 1.0 || reading.fract() != 0.0 && reading > 0.0);
    readings.sort_by(f64::total_cmp);
    let median = readings.get(readings.len() / 2).copied().unwrap_or(0.0);
    let is_whole = readings.iter().all(|reading| reading.fract() == 0.0);
    match median {
        median if median < MAX_METRES && !(is_whole && median > 20.0) => 1.0,
        median if median < MAX_CENTIMETRES && !(is_whole && readings.last() > Some(&5000.0)) => 0.01,
        _ => 1e-3,
    }
}

impl fmt::Display for TableFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { layout, unit, start, step, time, odometry, ahead } = self;
        match layout {
            Layout::ScanPerLine { first, end } => write!(f, "ranges={}:{end}", first + 1)?,
            Layout::ReadingPerLine { range } => write!(f, "range={}", range + 1)?,
        }
        let unit = UNITS.iter().find(|(_, metres)| metres == unit).map_or("m", |(name, _)| name);
        write!(f, ",unit={unit},start={:.4}deg,step={:.4}deg", start.to_degrees(), step.to_degrees())?;
        if let Some((column, seconds)) = time {
            let unit = TIMES.iter().find(|(_, value)| value == seconds).map_or("s", |(name, _)| name);
            write!(f, ",time={}:{unit}", column + 1)?;
        }
        match odometry {
            Some(OdometryColumns::Pose([x, y, theta])) => write!(f, ",odometry={}:{}:{}", x + 1, y + 1, theta + 1)?,
            Some(OdometryColumns::Wheels { columns: [left, right], metres_per_tick, track }) => {
                write!(f, ",wheels={}:{}:{metres_per_tick:.6}:{track}", left + 1, right + 1)?;
            }
            None => {}
        }
        if *ahead == 0.0 { Ok(()) } else { write!(f, ",ahead={ahead}") }
    }
}

const UNITS: [(&str, f64); 3] = [("m", 1.0), ("cm", 0.01), ("mm", 1e-3)];
const TIMES: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
const FORM: &str = "Write e.g. ranges=2:541,unit=m,start=-135deg,step=0.5deg,time=1:s,odometry=542:543:544";

impl FromStr for TableFormat {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let fault = |problem: String| Error::whole(problem, FORM);
        let mut format = Self {
            layout: Layout::ReadingPerLine { range: 0 },
            unit: 1.0,
            start: f64::NAN,
            step: f64::NAN,
            time: None,
            odometry: None,
            ahead: 0.0,
        };
        let mut has_ranges = false;
        for pair in text.split(',').filter(|pair| !pair.is_empty()) {
            let Some((name, value)) = pair.split_once('=') else {
                return Err(fault(format!("{} is no name=value", quote(pair.as_bytes()))));
            };
            let wrong = || fault(format!("{} is no value of {name} in a table's format", quote(value.as_bytes())));
            let parts: Vec<&str> = value.split(':').collect();
            let column = |part: &str| {
                part.parse().ok().filter(|&column: &usize| column > 0).map(|column| column - 1).ok_or_else(wrong)
            };
            let unit = |units: &[(&str, f64)], name: &str| {
                units.iter().find(|unit| unit.0 == name).map(|unit| unit.1).ok_or_else(wrong)
            };
            match (name, &parts[..]) {
                ("ranges", [first, last]) => {
                    let (first, end) = (column(first)?, column(last)? + 1);
                    if end < first + 2 {
                        return Err(wrong());
                    }
                    format.layout = Layout::ScanPerLine { first, end };
                    has_ranges = true;
                }
                ("range", [range]) => {
                    format.layout = Layout::ReadingPerLine { range: column(range)? };
                    has_ranges = true;
                }
                ("unit", [name]) => format.unit = unit(&UNITS, name)?,
                ("start", [value]) => format.start = angle(value).ok_or_else(wrong)?,
                ("step", [value]) => format.step = angle(value).filter(|&step| step != 0.0).ok_or_else(wrong)?,
                ("time", [at]) => format.time = Some((column(at)?, 1.0)),
                ("time", [at, name]) => format.time = Some((column(at)?, unit(&TIMES, name)?)),
                ("odometry", [x, y, theta]) => {
                    format.odometry = Some(OdometryColumns::Pose([column(x)?, column(y)?, column(theta)?]));
                }
                ("wheels", [left, right, tick, track]) => {
                    let positive = |text: &str| number(text.as_bytes()).filter(|&value| value > 0.0).ok_or_else(wrong);
                    let columns = [column(left)?, column(right)?];
                    format.odometry = Some(OdometryColumns::Wheels {
                        columns,
                        metres_per_tick: positive(tick)?,
                        track: positive(track)?,
                    });
                }
                ("ahead", [value]) => {
                    format.ahead = number(value.as_bytes()).filter(|value| value.is_finite()).ok_or_else(wrong)?;
                }
                _ => return Err(fault(format!("{} is nothing of a table's format", quote(pair.as_bytes())))),
            }
        }
        let is_complete = has_ranges && format.start.is_finite() && format.step.is_finite();
        if is_complete {
            Ok(format)
        } else {
            Err(fault("A table's format needs ranges (or range), start and step".to_owned()))
        }
    }
}

/// Radians, or degrees as `35deg`.
fn angle(text: &str) -> Option<f64> {
    let angle = match text.strip_suffix("deg") {
        Some(degrees) => number(degrees.as_bytes())?.to_radians(),
        None => number(text.as_bytes())?,
    };
    angle.is_finite().then_some(angle)
}

/// Reads a table whose format is guessed, and says how it was read.
pub(super) fn read_guessed(text: &[u8]) -> Result<LaserLog> {
    let format = TableFormat::guess(text)?;
    let mut log = read_as(text, &format)?;
    log.notes.push(format!(
        "A table of ranges, read as --table {format}. Give another format if that is not what its columns are."
    ));
    Ok(log)
}

/// Reads a table of this format. Lines before the first one of numbers are stepped over.
///
/// # Errors
/// Names the line that has no such columns.
pub fn read_as(text: &[u8], format: &TableFormat) -> Result<LaserLog> {
    let mut rows: Vec<(usize, Vec<f64>)> = Vec::new();
    for (line, text) in lines(text).filter(|(_, text)| !text.trim_ascii().is_empty()) {
        match row_of(text) {
            Some(row) => rows.push((line, row)),
            None if rows.is_empty() => {}
            None => return Err(Error::line(line, "A word of this line is no number", "Correct the line or remove it")),
        }
    }
    let scan = |number: usize, line: usize, ranges: Vec<f32>, row: &[f64]| LaserScan {
        number,
        line,
        bearings: Bearings::Even { start: format.start, step: format.step },
        ranges,
        max_range: f64::INFINITY,
        time: format.time.and_then(|(column, seconds)| Some(seconds * row.get(column)?)),
        reference: None,
        odometry: None,
    };
    // Lasers write 0 or 1 of their units where nothing came back.
    let range_of = |value: f64| {
        if value > 1.0 || value > 0.0 && format.unit == 1.0 { (format.unit * value) as f32 } else { f32::NAN }
    };
    let mut scans = Vec::new();
    match format.layout {
        Layout::ReadingPerLine { range } => {
            let value = |(line, row): &(usize, Vec<f64>)| {
                row.get(range).map(|&value| range_of(value)).ok_or_else(|| missing(*line, row.len(), range + 1))
            };
            let ranges = rows.iter().take(MAX_BEAMS).map(value).collect::<Result<Vec<f32>>>()?;
            scans.push(scan(0, 1, ranges, &[]));
        }
        Layout::ScanPerLine { first, end } => {
            let num_rows = rows.len();
            for (index, (line, row)) in rows.iter().enumerate() {
                if row.len() < end && index + 1 == num_rows && index > 0 {
                    break; // A recorder that was switched off leaves half a line behind.
                }
                let Some(ranges) = row.get(first..end) else { return Err(missing(*line, row.len(), end)) };
                scans.push(scan(index, *line, ranges.iter().map(|&value| range_of(value)).collect(), row));
            }
            if let Some(odometry) = format.odometry {
                let poses = odometry.poses(&rows, format.unit);
                for (scan, pose) in scans.iter_mut().zip(poses) {
                    scan.odometry = pose;
                }
            }
        }
    }
    let num_left_out = rows.len().saturating_sub(scans.len());
    let losses = if num_left_out == 1 && scans.len() > 1 {
        vec!["The last line is cut off and was left out.".to_owned()]
    } else {
        Vec::new()
    };
    let T_robot_laser = Pose2::new(nalgebra::Vector2::new(format.ahead, 0.0), 0.0);
    Ok(LaserLog { scans, T_robot_laser, has_wheel_odometry: format.odometry.is_some(), losses, notes: Vec::new() })
}

fn missing(line: usize, has: usize, wants: usize) -> Error {
    Error::line(
        line,
        format!("The line has {has} numbers, and its ranges reach to the {wants}th"),
        "Correct the line, or the table's format",
    )
}

impl OdometryColumns {
    fn poses(&self, rows: &[(usize, Vec<f64>)], unit: f64) -> Vec<Option<Pose2>> {
        let value = |row: &[f64], column: usize| row.get(column).copied().filter(|value| value.is_finite());
        match *self {
            Self::Pose([x, y, theta]) => {
                let pose_of = |row: &[f64]| pose(unit * value(row, x)?, unit * value(row, y)?, value(row, theta)?);
                rows.iter().map(|(_, row)| pose_of(row)).collect()
            }
            Self::Wheels { columns: [left, right], metres_per_tick, track } => {
                let mut T_world_robot = Pose2::identity();
                let mut before: Option<[f64; 2]> = None;
                let pose_of = |(_, row): &(usize, Vec<f64>)| {
                    let now = [value(row, left)?, value(row, right)?];
                    let [dl, dr] =
                        before.replace(now).map_or([0.0; 2], |before| [now[0] - before[0], now[1] - before[1]]);
                    let (way, turn) = (0.5 * metres_per_tick * (dl + dr), metres_per_tick * (dr - dl) / track);
                    // On an arc, the chord leads half of the turn aside.
                    let chord = nalgebra::Vector2::new(way * (0.5 * turn).cos(), way * (0.5 * turn).sin());
                    T_world_robot *= Pose2::new(chord, turn);
                    Some(T_world_robot)
                };
                rows.iter().map(pose_of).collect()
            }
        }
    }
}
