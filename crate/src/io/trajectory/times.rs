//! Times as files have them, in seconds.

use super::rows::{Row, rows};
use crate::geometry::quantile::quantile;
use crate::io::time_unit::{MILLISECOND, NANOSECOND, unit_since_1970};

/// Smallest usual interval (s): poses at 1 kHz. By it times without a unit are seconds, microseconds or nanoseconds: recorders
/// have intervals between it and a second, so that the three ranges do not overlap.
const MIN_INTERVAL: f64 = 1e-3;
/// Times of microseconds since 1970, from 2001 to 2096, whatever their interval; as nanoseconds they would be an uptime of two to
/// six weeks.
const MICROSECONDS_SINCE_1970: std::ops::Range<f64> = 1e15..4e15;

/// Converts times to seconds, which is what a file without a unit means where intervals do not show otherwise, and says so.
pub(super) fn in_seconds(stamps: &mut [f64]) -> Option<String> {
    let mut intervals: Vec<f64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    let interval = quantile(&mut intervals, 0.5).unwrap_or(0.0);
    let last = stamps.iter().copied().fold(0.0, f64::max);
    let (divisor, unit) = if unit_since_1970(last) == Some(NANOSECOND) {
        (1e9, "nanoseconds")
    } else if MICROSECONDS_SINCE_1970.contains(&last)
        || (interval / 1e6 >= MIN_INTERVAL && interval / 1e9 < MIN_INTERVAL)
    {
        (1e6, "microseconds")
    } else if interval / 1e9 >= MIN_INTERVAL {
        (1e9, "nanoseconds")
    } else if unit_since_1970(last) == Some(MILLISECOND) {
        (1e3, "milliseconds")
    } else {
        return None;
    };
    for stamp in stamps {
        *stamp /= divisor;
    }
    Some(format!("The times were read as {unit}, since the poses would be {interval:.0} s apart otherwise."))
}

/// The times of a column, each fraction as a count of the smallest part that the longest one has digits for; `None` where a time is
/// not digits, a point and digits.
pub(super) fn with_padded_fractions(bytes: &[u8], column: usize) -> Option<Vec<f64>> {
    let split = |row: Row| {
        let text = std::str::from_utf8(row.columns().nth(column)?).ok()?;
        let (whole, fraction) = text.split_once('.')?;
        Some((whole.parse::<u64>().ok()?, fraction.parse::<u64>().ok()?, u32::try_from(fraction.len()).ok()?))
    };
    let parts: Vec<(u64, u64, u32)> = rows(bytes).map(split).collect::<Option<_>>()?;
    let digits = parts.iter().map(|part| part.2).max()?;
    let is_counted = parts.iter().all(|&(_, fraction, length)| fraction == 0 || !is_padded(fraction, length));
    let seconds =
        |(whole, fraction, _): (u64, u64, u32)| whole as f64 + fraction as f64 / 10f64.powf(f64::from(digits));
    is_counted.then(|| parts.into_iter().map(seconds).collect())
}

/// Whether so many digits of a number begin with 0.
fn is_padded(number: u64, digits: u32) -> bool {
    number.checked_ilog10().is_none_or(|most| most + 1 < digits)
}
