//! A table's format as text: `name=value` pairs separated by commas.

use std::fmt;
use std::str::FromStr;

use super::{AngleColumn, Layout, OdometryColumns, PoseColumns, TableFormat};
use crate::io::length_unit::UNITS;
use crate::io::text::{number, quote};
use crate::io::time_unit::DAY;
use crate::{Error, Result};

pub(super) const TIMES: [(&str, f64); 5] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("d", DAY)];
/// A hundredth of a right angle (rad).
const GON: f64 = std::f64::consts::FRAC_PI_2 / 100.0;
const FORM: &str = "Write e.g. ranges=2:541,unit=m,start=-135deg,step=0.5deg,time=1:s,odometry=542:543:544";
/// What to do about a table that is no scan as it stands.
pub(super) const SAY_COLUMNS: &str =
    "Say what its columns are, e.g. --table ranges=2:541,unit=m,start=-135deg,step=0.5deg,time=1";

/// An angle (rad) in degrees, to four decimals; -0 becomes 0.
pub(super) fn degrees(angle: f64) -> f64 {
    (angle.to_degrees() * 1e4).round() / 1e4 + 0.0
}

/// The unit of a column of angles (rad) in degrees: of a turn it is counted up to 65,536 times.
pub(super) fn degrees_of_unit(unit: f64) -> f64 {
    (unit.to_degrees() * 1e12).round() / 1e12
}

impl fmt::Display for TableFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name_of =
            |units: &[(&'static str, f64)], value: f64| units.iter().find(|unit| unit.1 == value).map(|unit| unit.0);
        match self.layout {
            Layout::ScanPerLine { first, end } => write!(f, "ranges={}:{end}", first + 1)?,
            Layout::ReadingPerLine { range, angle: None } => write!(f, "range={}", range + 1)?,
            Layout::ReadingPerLine { range, angle: Some(AngleColumn { column, unit }) } => {
                write!(f, "range={},angle={}:{}deg", range + 1, column + 1, degrees_of_unit(unit))?;
            }
        }
        match name_of(&UNITS, self.unit) {
            Some(name) => write!(f, ",unit={name}")?,
            None => write!(f, ",unit={}", self.unit)?,
        }
        write!(f, ",start={}deg", degrees(self.start))?;
        if !matches!(self.layout, Layout::ReadingPerLine { angle: Some(_), .. }) {
            write!(f, ",step={}deg", degrees(self.step))?;
        }
        if let Some((column, seconds)) = self.time {
            write!(f, ",time={}:{}", column + 1, name_of(&TIMES, seconds).unwrap_or("s"))?;
        }
        match self.odometry {
            Some(OdometryColumns::Pose(columns)) => {
                write!(f, ",{}={columns}", if self.has_wheels { "odometry" } else { "poses" })?;
            }
            Some(OdometryColumns::Wheels { columns: [left, right], metres_per_tick, track }) => {
                write!(f, ",wheels={}:{}:{metres_per_tick:.6}:{track}", left + 1, right + 1)?;
            }
            None => {}
        }
        if let Some(columns) = self.reference {
            write!(f, ",reference={columns}")?;
        }
        if self.ahead == 0.0 { Ok(()) } else { write!(f, ",ahead={}", self.ahead) }
    }
}

impl fmt::Display for PoseColumns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, theta] = self.columns.map(|column| column + 1);
        write!(f, "{x}:{y}:{theta}")?;
        if let Some((name, _)) = UNITS.iter().find(|(_, metres)| Some(*metres) == self.unit) {
            write!(f, ":{name}")?;
        }
        if self.heading == 1.0 { Ok(()) } else { write!(f, ":deg") }
    }
}

impl FromStr for TableFormat {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let unknown = Layout::ReadingPerLine { range: usize::MAX, angle: None };
        Self::of(unknown, f64::NAN, f64::NAN).changed(text)
    }
}

impl TableFormat {
    /// This format with what a text says of it.
    ///
    /// # Errors
    /// Names what is no part of a format; or says what is missing, where nothing is known of the table itself.
    pub fn changed(mut self, text: &str) -> Result<Self> {
        for pair in text.split(',').map(str::trim).filter(|pair| !pair.is_empty()) {
            let Some((name, value)) = pair.split_once('=') else {
                return Err(Error::whole(format!("{} is not name=value", quote(pair.as_bytes())), FORM));
            };
            self.take(name, value)?;
        }
        let (has_ranges, has_angles) = match self.layout {
            Layout::ScanPerLine { .. } => (true, false),
            Layout::ReadingPerLine { range, angle } => (range != usize::MAX, angle.is_some()),
        };
        if has_angles && !self.start.is_finite() {
            self.start = 0.0;
        }
        if has_ranges && self.start.is_finite() && (has_angles || self.step.is_finite()) {
            return Ok(self);
        }
        Err(Error::whole("A table's format needs ranges (or range), start and step", FORM))
    }

    fn take(&mut self, name: &str, value: &str) -> Result<()> {
        let wrong =
            || Error::whole(format!("{} is not a value of {name} in a table's format", quote(value.as_bytes())), FORM);
        let parts: Vec<&str> = value.split(':').collect();
        let unit = |units: &[(&str, f64)], name: &str| {
            units.iter().find(|unit| unit.0 == name).map(|unit| unit.1).ok_or_else(wrong)
        };
        match (name, &parts[..]) {
            ("ranges" | "range", columns) => self.layout = self.layout_of(columns).ok_or_else(wrong)?,
            ("angle", [at, unit]) => self.set_angle(at, unit).ok_or_else(wrong)?,
            // A name, or metres.
            ("unit", [name]) => {
                let metres = number(name.as_bytes()).filter(|metres| metres.is_finite() && *metres > 0.0);
                self.unit = metres.map_or_else(|| unit(&UNITS, name), Ok)?;
            }
            ("start", [value]) => self.start = angle(value).ok_or_else(wrong)?,
            ("step", [value]) => self.step = angle(value).filter(|&step| step != 0.0).ok_or_else(wrong)?,
            ("time" | "odometry" | "poses" | "reference", ["none"]) => self.forget(name),
            ("time", [at]) => self.time = Some((column(at).ok_or_else(wrong)?, 1.0)),
            ("time", [at, name]) => self.time = Some((column(at).ok_or_else(wrong)?, unit(&TIMES, name)?)),
            ("odometry" | "poses", columns) => {
                self.odometry = Some(OdometryColumns::Pose(pose_columns(columns).ok_or_else(wrong)?));
                self.has_wheels = name == "odometry";
            }
            ("reference", columns) => self.reference = Some(pose_columns(columns).ok_or_else(wrong)?),
            ("wheels", parts) => {
                self.odometry = Some(wheels(parts).ok_or_else(wrong)?);
                self.has_wheels = true;
            }
            ("ahead", [value]) => {
                self.ahead = number(value.as_bytes()).filter(|value| value.is_finite()).ok_or_else(wrong)?;
            }
            ("angle" | "unit" | "start" | "step" | "time" | "ahead", _) => return Err(wrong()),
            _ => {
                let pair = format!("{name}={value}");
                return Err(Error::whole(format!("{} is nothing of a table's format", quote(pair.as_bytes())), FORM));
            }
        }
        Ok(())
    }

    fn layout_of(&self, columns: &[&str]) -> Option<Layout> {
        let angle = if let Layout::ReadingPerLine { angle, .. } = self.layout { angle } else { None };
        match columns {
            [range] => Some(Layout::ReadingPerLine { range: column(range)?, angle }),
            [first, last] => {
                let (first, end) = (column(first)?, column(last)? + 1);
                (end >= first + 2).then_some(Layout::ScanPerLine { first, end })
            }
            _ => None,
        }
    }

    /// The angle's column, and what one of it is: `deg`, `rad`, `gon`, or an angle; negative where angles grow clockwise.
    fn set_angle(&mut self, at: &str, unit: &str) -> Option<()> {
        let unit = match unit {
            "deg" => 1f64.to_radians(),
            "rad" => 1.0,
            "gon" => GON,
            value => angle(value).filter(|&unit| unit != 0.0)?,
        };
        let range = if let Layout::ReadingPerLine { range, .. } = self.layout { range } else { usize::MAX };
        self.layout = Layout::ReadingPerLine { range, angle: Some(AngleColumn { column: column(at)?, unit }) };
        Some(())
    }

    fn forget(&mut self, name: &str) {
        match name {
            "time" => self.time = None,
            "reference" => self.reference = None,
            _ => self.odometry = None,
        }
    }
}

/// A column, which is counted from 1 in texts.
fn column(part: &str) -> Option<usize> {
    part.parse().ok().filter(|&column: &usize| column > 0).map(|column| column - 1)
}

/// `X:Y:HEADING`, with the unit of x and y and that of the heading behind them where they are others than the table's and `rad`.
fn pose_columns(parts: &[&str]) -> Option<PoseColumns> {
    let [x, y, theta, units @ ..] = parts else { return None };
    let mut pose = PoseColumns { columns: [column(x)?, column(y)?, column(theta)?], unit: None, heading: 1.0 };
    for &unit in units {
        match unit {
            "deg" => pose.heading = 1f64.to_radians(),
            "rad" => pose.heading = 1.0,
            _ => pose.unit = Some(UNITS.iter().find(|(name, _)| *name == unit)?.1),
        }
    }
    (units.len() <= 2).then_some(pose)
}

fn wheels(parts: &[&str]) -> Option<OdometryColumns> {
    let [left, right, tick, track] = parts else { return None };
    let positive = |text: &str| number(text.as_bytes()).filter(|&value| value > 0.0);
    Some(OdometryColumns::Wheels {
        columns: [column(left)?, column(right)?],
        metres_per_tick: positive(tick)?,
        track: positive(track)?,
    })
}

/// Radians, degrees as `35deg`, or gon as `40gon`.
fn angle(text: &str) -> Option<f64> {
    let angle = match (text.strip_suffix("deg"), text.strip_suffix("gon")) {
        (Some(degrees), _) => number(degrees.as_bytes())?.to_radians(),
        (_, Some(gon)) => number(gon.as_bytes())? * GON,
        _ => number(text.as_bytes())?,
    };
    angle.is_finite().then_some(angle)
}
