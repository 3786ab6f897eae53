//! The bearings of a scan's readings, by their number and by whether the two ends of a line meet.

use std::f64::consts::{PI, TAU};

use super::super::numbers::GUESS_LINES;
use super::Row;
use crate::geometry::quantile::quantile;

/// More readings than this of no known laser are taken for a full turn: lasers that turn are the common ones.
const MIN_FULL_TURN: usize = 200;

/// Of a full turn the last reading is a neighbour of the first, and differs from it by less than so many of the neighbours in its
/// line do, by the median of the lines: 0.3 to 0.5 measured with an RPLIDAR, 0.96 to 0.98 with 360 readings over a half turn
/// (Freiburg 079 and 101). Of lines that have nothing to do with each other 1 in 100,000 tables lies beyond.
const MAX_SEAM_RANK: f64 = 0.9;

/// Fields of view (rad) of lasers that are common, by the number of their readings.
pub(in super::super) fn field_of_view(num_readings: usize) -> Option<f64> {
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

/// Bearing of the first reading and the step between two (rad), for a laser that looks ahead; and what was assumed, where no
/// known laser has so many readings, or where its ends would have to meet and do not (`seam`: see [`seam_rank`]).
pub(super) fn view_of(num_readings: usize, seam: impl Fn() -> Option<f64>) -> (f64, f64, Option<String>) {
    let known = field_of_view(num_readings);
    let view = known.unwrap_or(if num_readings >= MIN_FULL_TURN { TAU } else { PI });
    let is_open = view == TAU && seam().is_none_or(|rank| rank > MAX_SEAM_RANK);
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

/// Where the two ends of a scan meet: the share of neighbours in its line that differ by less than the first and the last reading
/// do, median of lines spread over the table; `None` where no line has returns at both ends.
pub(super) fn seam_rank(rows: &[Row], first: usize, end: usize) -> Option<f64> {
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
    quantile(&mut ranks, 0.5)
}
