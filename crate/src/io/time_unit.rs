//! The unit of times that do not say it.

/// Nanoseconds (s).
pub(super) const NANOSECOND: f64 = 1e-9;
/// Milliseconds (s).
pub(super) const MILLISECOND: f64 = 1e-3;

/// Days (s).
pub(super) const DAY: f64 = 86_400.0;
/// Least numbers of days as programs count them: Excel's since 1900 and MATLAB's since 0 have five and six digits, Julian days seven.
const LEAST_DAYS: f64 = 2e4;
/// Scans are further apart than this, in seconds; in days, less than this.
const LEAST_STEP: f64 = 1e-3;

/// Whether a time is one in days, by the step to the next: seconds would be less than a millisecond apart, as no laser measures scans.
pub(super) fn is_in_days(time: f64, step: f64) -> bool {
    time >= LEAST_DAYS && step > 0.0 && step < LEAST_STEP
}

/// Units (s) with the least time since 1970 in each: seconds since then have nine digits from 1973 and twelve from 5138 on.
const LEAST_SINCE_1970: [(f64, f64); 4] = [(1e17, NANOSECOND), (1e14, 1e-6), (1e11, MILLISECOND), (1e8, 1.0)];

/// The unit (s) of a time since 1970; `None` where it is too small for one, as the time since a robot was switched on.
pub(super) fn unit_since_1970(time: f64) -> Option<f64> {
    LEAST_SINCE_1970.iter().find(|(least, _)| time >= *least).map(|(_, unit)| *unit)
}
