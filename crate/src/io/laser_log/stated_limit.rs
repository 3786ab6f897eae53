//! Whether a range limit that a log states is the laser's.

use super::LaserScan;
use crate::geometry::quantile::RANGE_END;

/// Readings beyond the stated limit are measurements if at least this share of all readings lies between the limit and
/// [`RANGE_END`] times the largest reading.
const MEASURED_SHARE: f64 = 0.01;

/// Drops a limit that is not the laser's, and says so. A robot's software may use short ranges only and still record all: its
/// parameter is no limit where many readings beyond it differ, for a laser reports the same where nothing came back.
#[inline(never)]
pub(super) fn drop_false_limit(scans: &mut [LaserScan]) -> Option<String> {
    let limit = scans.iter().map(|scan| scan.max_range).fold(0.0, f64::max);
    if !limit.is_finite() {
        return None;
    }
    let readings =
        || scans.iter().flat_map(|scan| &scan.ranges).filter(|range| range.is_finite()).map(|&r| f64::from(r));
    let largest = readings().fold(0.0, f64::max);
    let num_measured = readings().filter(|&range| range > limit && range < RANGE_END * largest).count();
    let share = num_measured as f64 / readings().count().max(1) as f64;
    if share < MEASURED_SHARE {
        return None;
    }
    for scan in scans {
        scan.max_range = f64::INFINITY;
    }
    Some(format!(
        "The log states a largest range of {limit} m, but {:.0} % of its readings are measurements beyond that: they are used. \
         To leave them out, set max_range={limit}.",
        100.0 * share
    ))
}
