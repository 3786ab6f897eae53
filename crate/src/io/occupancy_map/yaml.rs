//! The YAML file of ROS's map_server: the few keys that it has, one a line.

use super::picture::Shade;
use crate::error::{Error, Result};
use crate::io::text::{lines, number, quote, refuse_pointer_and_utf16, without_byte_order_mark};

/// How a picture's shades become occupancy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Occupied, free or unknown, by the two thresholds.
    Trinary,
    /// Between the thresholds in proportion; unknown where the picture is transparent.
    Scale,
    /// The values 0 to 100 are per cent, all others unknown.
    Raw,
}

/// What a YAML file says of a map's picture.
#[derive(Debug, Clone, PartialEq)]
pub struct MapYaml {
    /// Name of the picture's file, from the folder of the YAML file or as a whole path.
    pub image: String,
    /// Side of a pixel (m).
    pub resolution: f64,
    /// x, y (m) and turn (rad) of the picture's lower left corner in the world.
    pub origin: [f64; 3],
    /// How shades become occupancy.
    pub mode: Mode,
    /// Whether white is occupied.
    pub negate: bool,
    /// From this probability on a pixel is occupied.
    pub occupied_thresh: f64,
    /// Up to this probability a pixel is free.
    pub free_thresh: f64,
}

const REMEDY: &str =
    "Write it as ROS's map_server does: image, resolution, origin, negate, occupied_thresh, free_thresh";

impl MapYaml {
    /// Reads the file.
    ///
    /// # Errors
    /// A key that is missing; a value that is none of its kind.
    pub fn read(bytes: &[u8]) -> Result<Self> {
        refuse_pointer_and_utf16(bytes)?;
        let entries = entries(without_byte_order_mark(bytes));
        let of = |key: &str| entries.iter().find(|entry| entry.key == key);
        let Some(image) = of("image").and_then(|entry| entry.values.first()) else {
            return Err(Error::whole("The file names no image", REMEDY));
        };
        let Some(resolution) = of("resolution") else {
            return Err(Error::whole("The file has no resolution", REMEDY));
        };
        let threshold = |key: &str, default: f64| of(key).map_or(Ok(default), Entry::one_number);
        let yaml = Self {
            image: image.clone(),
            resolution: checked_resolution(resolution.one_number()?).map_err(|error| resolution.located(error))?,
            origin: of("origin").map_or(Ok([0.0; 3]), Entry::three_numbers)?,
            mode: of("mode").map_or(Ok(Mode::Trinary), Entry::mode)?,
            negate: of("negate").map_or(Ok(false), Entry::truth)?,
            occupied_thresh: threshold("occupied_thresh", OCCUPIED_THRESH)?,
            free_thresh: threshold("free_thresh", FREE_THRESH)?,
        };
        yaml.checked()
    }

    /// A picture of which only the side of a pixel (m) is known: black is occupied, white is free, its lower left corner is the
    /// origin.
    ///
    /// # Errors
    /// A side that is not positive.
    pub fn of_scale(resolution: f64) -> Result<Self> {
        Ok(Self {
            image: String::new(),
            resolution: checked_resolution(resolution)?,
            origin: [0.0; 3],
            mode: Mode::Trinary,
            negate: false,
            occupied_thresh: OCCUPIED_THRESH,
            free_thresh: FREE_THRESH,
        })
    }

    fn checked(self) -> Result<Self> {
        let Self { occupied_thresh, free_thresh, .. } = self;
        if !(0.0..=1.0).contains(&occupied_thresh) {
            return Err(Error::whole(
                format!("occupied_thresh is {occupied_thresh}"),
                "It is a probability, from 0 to 1",
            ));
        }
        if !(0.0..=occupied_thresh).contains(&free_thresh) {
            let problem = format!("free_thresh is {free_thresh} and occupied_thresh is {occupied_thresh}");
            return Err(Error::whole(problem, "The one is at most as large as the other, and neither is negative"));
        }
        Ok(self)
    }

    /// The probability that a pixel of this shade is occupied; NaN where it is unknown.
    pub(super) fn occupancy(&self, Shade { value, is_opaque }: Shade) -> f32 {
        let shade = f64::from(value);
        let occupied = if self.negate { shade } else { 1.0 - shade };
        match self.mode {
            Mode::Raw => {
                let percent = (255.0 * shade).round();
                if percent <= 100.0 { (percent / 100.0) as f32 } else { f32::NAN }
            }
            Mode::Scale if !is_opaque => f32::NAN,
            _ if occupied >= self.occupied_thresh => 1.0,
            _ if occupied <= self.free_thresh => 0.0,
            Mode::Trinary => f32::NAN,
            Mode::Scale => ((occupied - self.free_thresh) / (self.occupied_thresh - self.free_thresh)) as f32,
        }
    }
}

/// The thresholds of ROS's map_saver: more probably occupied than the one a cell is a wall, less than the other it is free.
pub(crate) const OCCUPIED_THRESH: f64 = 0.65;
pub(crate) const FREE_THRESH: f64 = 0.196;

/// Cells finer than a millimetre or larger than a hundred metres are of another unit.
const RESOLUTIONS: (f64, f64) = (1e-3, 100.0);

/// The side of a cell (m), where it can be one.
pub(super) fn checked_resolution(resolution: f64) -> Result<f64> {
    if (RESOLUTIONS.0..=RESOLUTIONS.1).contains(&resolution) {
        return Ok(resolution);
    }
    Err(Error::whole(format!("The resolution is {resolution}"), "It is the side of a cell in metres, such as 0.05"))
}

/// A key with its value, or with the values of its list.
struct Entry {
    key: String,
    line: usize,
    values: Vec<String>,
}

/// The keys of the file; what is deeper than a list is left out.
fn entries(bytes: &[u8]) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for (line, text) in lines(bytes) {
        let text = String::from_utf8_lossy(text);
        let text = without_comment(&text).trim();
        if let Some(item) = text.strip_prefix("- ") {
            if let Some(entry) = entries.last_mut() {
                entry.values.push(unquoted(item));
            }
        } else if let Some((key, value)) = text.split_once(':') {
            let value = value.trim();
            let list =
                value.strip_prefix('[').map(|rest| rest.trim_end_matches(']').split(',').map(unquoted).collect());
            let single = || if value.is_empty() { Vec::new() } else { vec![unquoted(value)] };
            entries.push(Entry { key: unquoted(key), line, values: list.unwrap_or_else(single) });
        }
    }
    entries
}

/// A comment begins with `#` at the start or after a blank.
fn without_comment(text: &str) -> &str {
    let begins = |(at, _): &(usize, &str)| *at == 0 || text[..*at].ends_with([' ', '\t']);
    text.match_indices('#').find(begins).map_or(text, |(at, _)| &text[..at])
}

fn unquoted(text: &str) -> String {
    let text = text.trim();
    let inside = |mark: char| text.strip_prefix(mark).and_then(|rest| rest.strip_suffix(mark));
    inside('"').or_else(|| inside('\'')).unwrap_or(text).to_owned()
}

impl Entry {
    fn located(&self, error: Error) -> Error {
        Error::line(self.line, error.problem, error.remedy)
    }

    fn fault(&self, value: &str, kind: &str) -> Error {
        Error::line(self.line, format!("{}: {} is no {kind}", self.key, quote(value.as_bytes())), REMEDY)
    }

    fn one_number(&self) -> Result<f64> {
        let value = self.values.first().map_or("", String::as_str);
        number(value.as_bytes()).ok_or_else(|| self.fault(value, "number"))
    }

    fn three_numbers(&self) -> Result<[f64; 3]> {
        let numbers: Vec<f64> = self.values.iter().filter_map(|value| number(value.as_bytes())).collect();
        let Ok(numbers) = <[f64; 3]>::try_from(numbers) else {
            let count = self.values.len();
            let problem = format!("The {} is {count} numbers or words", self.key);
            return Err(Error::line(self.line, problem, "Write [x, y, yaw] in metres and radians"));
        };
        if numbers.iter().all(|value| value.is_finite()) {
            return Ok(numbers);
        }
        Err(Error::line(
            self.line,
            format!("The {} is {numbers:?}", self.key),
            "Write [x, y, yaw] in metres and radians",
        ))
    }

    fn truth(&self) -> Result<bool> {
        match self.values.first().map_or("", String::as_str).to_ascii_lowercase().as_str() {
            "0" | "false" | "no" | "off" => Ok(false),
            "1" | "true" | "yes" | "on" => Ok(true),
            other => Err(self.fault(other, "0 or 1")),
        }
    }

    fn mode(&self) -> Result<Mode> {
        match self.values.first().map_or("", String::as_str) {
            "trinary" => Ok(Mode::Trinary),
            "scale" => Ok(Mode::Scale),
            "raw" => Ok(Mode::Raw),
            other => Err(self.fault(other, "mode: trinary, scale or raw")),
        }
    }
}
