//! What a column's numbers tell: times, counters, and units of length and time.

use super::names::SAME_STEP;
use super::rows::Row;
use crate::geometry::quantile::quantile;
use crate::io::length_unit::{JudgedUnit, LASER_RANGES, judge_unit, step_of};
use crate::io::time_unit::{DAY, is_in_days, unit_since_1970};

/// Lines that a guess is made from.
pub(super) const GUESS_LINES: usize = 20;
/// Of fewer lines, numbers that grow from line to line, or stay the same, may be ranges.
pub(super) const MIN_GROWING_LINES: usize = 3;
/// The ranges of neighbouring beams differ by less than this share of their size in at least one line.
const UNLIKE: f64 = 0.1;

/// Times stand among the outermost columns.
const MAX_TIME_COLUMN: usize = 3;

/// Positions beside ranges are not in metres beyond this.
pub(super) const MAX_METRES: f64 = 60.0;

/// Units of time (s), by the least step between scans in them: five milliseconds.
const STEP_UNITS: [(f64, f64); 4] = [(5e6, 1e-9), (5e3, 1e-6), (5.0, 1e-3), (0.0, 1.0)];

/// Whether the numbers of one of the outermost columns grow from line to line, and are not those of the next beam.
pub(super) fn is_time(rows: &[Row], column: usize) -> bool {
    let width = rows[0].values.len();
    let inner = if column < MAX_TIME_COLUMN { column + 1 } else { column - 1 };
    let is_unlike = |row: &Row| {
        let [Some(value), Some(next)] = [row.values.get(column), row.values.get(inner)] else { return false };
        // Where the next beam has no number, the line does not tell.
        next.is_nan() || (value - next).abs() > UNLIKE * value.abs().max(next.abs())
    };
    let is_outer = column < MAX_TIME_COLUMN || column + MAX_TIME_COLUMN >= width;
    is_outer && rows.len() >= MIN_GROWING_LINES && is_growing(rows, column) && rows.iter().all(is_unlike)
}

/// Whether a column's values grow from line to line.
pub(super) fn is_growing(rows: &[Row], column: usize) -> bool {
    let values: Vec<f64> = rows.iter().filter_map(|row| row.values.get(column).copied()).collect();
    values.len() > 1 && values.len() == rows.len() && values.windows(2).all(|pair| pair[0] < pair[1])
}

/// Whether a column's values grow by the same step from line to line; of fewer lines a wall may come nearer so.
pub(super) fn is_even_growth(rows: &[Row], column: usize) -> bool {
    let value = |row: &Row| row.values.get(column).copied().unwrap_or(f64::NAN);
    let steps: Vec<f64> = rows.windows(2).map(|pair| value(&pair[1]) - value(&pair[0])).collect();
    let mean = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
    rows.len() >= GUESS_LINES && mean > 0.0 && steps.iter().all(|step| (step / mean - 1.0).abs() < SAME_STEP)
}

/// Whether a column counts the lines.
pub(super) fn is_counter(rows: &[Row], column: usize) -> bool {
    let values = || rows.iter().map(|row| row.values[column]);
    let begin = rows[0].values[column];
    (begin == 0.0 || begin == 1.0) && values().enumerate().all(|(index, value)| value == begin + index as f64)
}

/// Seconds of the unit of times.
pub(super) fn time_unit(rows: &[Row], column: usize) -> f64 {
    let times: Vec<f64> = rows.iter().filter_map(|row| row.values.get(column).copied()).collect();
    let first = times.first().copied().unwrap_or(0.0);
    let mut steps: Vec<f64> = times.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let step = quantile(&mut steps, 0.5).unwrap_or(0.0);
    let by_step = || STEP_UNITS.iter().find(|(least, _)| step >= *least).map(|(_, unit)| *unit);
    if is_in_days(first, step) {
        return DAY;
    }
    unit_since_1970(first).or_else(by_step).unwrap_or(1.0)
}

/// So many readings of the largest value stand for no return.
const MIN_LIMIT_READINGS: usize = 3;

/// The unit of these readings.
pub(super) fn unit_of(mut readings: Vec<f64>) -> JudgedUnit {
    // 0 and 1 mean no return.
    readings.retain(|&reading| reading > 1.0 || reading.fract() != 0.0 && reading > 0.0);
    // So does the largest one, where it comes again and again and is not the only one.
    let largest = readings.iter().copied().fold(0.0, f64::max);
    let num_below = readings.iter().filter(|&&reading| reading < largest).count();
    if num_below > 0 && readings.len() - num_below >= MIN_LIMIT_READINGS {
        readings.retain(|&reading| reading < largest);
    }
    let step = step_of(readings.iter().copied());
    judge_unit(readings, step, &LASER_RANGES)
}
