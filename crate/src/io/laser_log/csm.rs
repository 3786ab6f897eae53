//! The JSON of CSM, the Canonical Scan Matcher: an object a scan, one or many in a file.
//!
//! `readings` (m, `null` for none), `theta` (rad, a bearing a reading) or `min_theta` and `max_theta`; `valid` (0: the
//! reading is none); `odometry`, `estimate` and `true_pose` (x, y, theta; `null` where unknown); `timestamp` (s, or
//! [s, microseconds]). Objects may have `min_range` and `max_range` (m) as well: readings outside are none. Fields of other
//! names are stepped over.

use serde::Deserialize;

use super::{Bearings, LaserLog, LaserScan, pose};
use crate::io::limits::MAX_BEAMS;
use crate::{Error, Result};

/// Whether the beginning of a JSON file is one of scans.
pub(super) fn looks_like_csm(head: &[u8]) -> bool {
    let has = |name: &[u8]| head.windows(name.len()).any(|window| window == name);
    has(b"\"readings\"") || (has(b"\"nrays\"") && has(b"\"min_theta\""))
}

#[derive(Deserialize)]
struct RawScan {
    readings: Vec<Option<f64>>,
    theta: Option<Vec<Option<f64>>>,
    min_theta: Option<f64>,
    max_theta: Option<f64>,
    valid: Option<Vec<Option<f64>>>,
    #[serde(alias = "range_min")]
    min_range: Option<f64>,
    #[serde(alias = "range_max")]
    max_range: Option<f64>,
    odometry: Option<[Option<f64>; 3]>,
    estimate: Option<[Option<f64>; 3]>,
    true_pose: Option<[Option<f64>; 3]>,
    #[serde(alias = "time")]
    timestamp: Option<Timestamp>,
    /// Said by whoever converted angles that may grow clockwise.
    #[serde(default)]
    may_be_mirrored: bool,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Timestamp {
    Seconds(f64),
    SecondsAndMicroseconds([f64; 2]),
}

impl Timestamp {
    fn seconds(self) -> f64 {
        match self {
            Self::Seconds(seconds) => seconds,
            Self::SecondsAndMicroseconds([seconds, microseconds]) => seconds + 1e-6 * microseconds,
        }
    }
}

const CUT_OFF: &str = "The last scan of the file is cut off and was left out.";

#[inline(never)]
pub(super) fn read(bytes: &[u8]) -> Result<LaserLog> {
    let mut scans = Vec::new();
    let mut may_be_mirrored = false;
    let mut losses = Vec::new();
    let is_list = bytes.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'[');
    let mut lines = Lines { bytes, offset: 0, line: 1 };
    if is_list {
        let whole = serde_json::from_slice(bytes).or_else(|error| {
            let part = complete_part(bytes).filter(|_| error.is_eof()).ok_or(error)?;
            losses.push(CUT_OFF.to_owned());
            serde_json::from_slice(&part)
        });
        let raw_scans: Vec<RawScan> = whole.map_err(|error| fault(&error))?;
        for raw in raw_scans {
            may_be_mirrored |= raw.may_be_mirrored;
            scans.push(scan(raw, scans.len(), 1)?);
        }
    } else {
        let mut objects = serde_json::Deserializer::from_slice(bytes).into_iter::<RawScan>();
        while let Some(object) = objects.next() {
            match object {
                Ok(raw) => {
                    may_be_mirrored |= raw.may_be_mirrored;
                    scans.push(scan(raw, scans.len(), lines.at(objects.byte_offset()))?);
                }
                Err(error) if error.is_eof() && !scans.is_empty() => {
                    losses.push(CUT_OFF.to_owned());
                }
                Err(error) => return Err(fault(&error)),
            }
        }
    }
    Ok(LaserLog { scans, may_be_mirrored, losses, ..LaserLog::default() })
}

/// A list that was cut off, up to its last whole scan, and closed.
fn complete_part(bytes: &[u8]) -> Option<Vec<u8>> {
    let (mut depth, mut in_text, mut escaped, mut end) = (0_usize, false, false, None);
    for (at, &byte) in bytes.iter().enumerate() {
        match byte {
            _ if escaped => escaped = false,
            b'\\' if in_text => escaped = true,
            b'"' => in_text = !in_text,
            _ if in_text => {}
            b'{' | b'[' => depth += 1,
            b'}' | b']' => {
                depth = depth.checked_sub(1)?;
                if byte == b'}' && depth == 1 {
                    end = Some(at + 1);
                }
            }
            _ => {}
        }
    }
    let end = end.filter(|_| depth > 0)?;
    Some([&bytes[..end], b"]"].concat())
}

/// Lines are counted along: a file of many objects is gone through once.
struct Lines<'a> {
    bytes: &'a [u8],
    offset: usize,
    line: usize,
}

impl Lines<'_> {
    fn at(&mut self, offset: usize) -> usize {
        let end = offset.min(self.bytes.len()).max(self.offset);
        self.line += self.bytes[self.offset..end].split(|&byte| byte == b'\n').count() - 1;
        self.offset = end;
        self.line
    }
}

fn fault(error: &serde_json::Error) -> Error {
    let error = Error::json(error, "Correct the JSON: every scan is an object with readings and theta");
    Error { problem: format!("This is not a CSM scan ({})", error.problem), ..error }
}

fn scan(raw: RawScan, number: usize, line: usize) -> Result<LaserScan> {
    let wrong = |problem: String| Error::line(line, problem, "Give one bearing for each reading");
    let bearings = bearings(raw.theta, [raw.min_theta, raw.max_theta], raw.readings.len()).map_err(wrong)?;
    let is_valid = |beam: usize| {
        let listed = raw.valid.as_ref().and_then(|valid| valid.get(beam)).copied().flatten();
        listed.is_none_or(|valid| valid != 0.0) && bearings.of(beam).is_finite()
    };
    let least = raw.min_range.unwrap_or(0.0).max(0.0);
    let reading = |(beam, &reading): (usize, &Option<f64>)| {
        reading.filter(|&range| range >= least && is_valid(beam)).map_or(f32::NAN, |range| range as f32)
    };
    let ranges = raw.readings.iter().enumerate().map(reading).collect();
    let known = |values: Option<[Option<f64>; 3]>| {
        let [x, y, theta] = values?;
        pose(x?, y?, theta?)
    };
    let odometry = known(raw.odometry);
    Ok(LaserScan {
        number,
        line,
        bearings,
        ranges,
        max_range: raw.max_range.filter(|&range| range > 0.0).unwrap_or(f64::INFINITY),
        time: raw.timestamp.map(Timestamp::seconds),
        reference: known(raw.true_pose).or_else(|| known(raw.estimate)).or(odometry),
        odometry,
    })
}

/// The bearings of `count` readings: one each, or the first and the last one. The error is the problem.
fn bearings(
    theta: Option<Vec<Option<f64>>>,
    ends: [Option<f64>; 2],
    count: usize,
) -> std::result::Result<Bearings, String> {
    if count > MAX_BEAMS {
        return Err(format!("{count} readings are not a planar scan"));
    }
    match (theta, ends) {
        (Some(theta), _) if theta.len() != count => {
            Err(format!("There are {} bearings (theta) for {count} readings", theta.len()))
        }
        (Some(theta), _) => Ok(Bearings::Listed(theta.into_iter().map(|angle| angle.unwrap_or(f64::NAN)).collect())),
        (None, [Some(start), Some(end)]) => {
            Ok(Bearings::Even { start, step: (end - start) / (count.max(2) - 1) as f64 })
        }
        _ => Err("The scan has neither theta nor min_theta and max_theta".to_owned()),
    }
}
