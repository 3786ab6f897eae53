//! The unit of times that do not say it.

/// Nanoseconds (s).
pub(super) const NANOSECOND: f64 = 1e-9;
/// Milliseconds (s).
pub(super) const MILLISECOND: f64 = 1e-3;

/// Units (s) with the least time since 1970 in each: seconds since then have nine digits from 1973 and twelve from 5138 on.
const LEAST_SINCE_1970: [(f64, f64); 4] = [(1e17, NANOSECOND), (1e14, 1e-6), (1e11, MILLISECOND), (1e8, 1.0)];

/// The unit (s) of a time since 1970; `None` where it is too small for one, as the time since a robot was switched on.
pub(super) fn unit_since_1970(time: f64) -> Option<f64> {
    LEAST_SINCE_1970.iter().find(|(least, _)| time >= *least).map(|(_, unit)| *unit)
}
