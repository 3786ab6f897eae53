//! Whether a log can be in metres and radians, by what no planar laser does.

use std::f64::consts::TAU;

use super::{Bearings, LaserScan};
use crate::{Error, Result};

/// Smallest share of the readings of a log in metres that are nearer than `MAX_INDOOR_RANGE`; the others may mean no return.
const LEAST_SHARE: f64 = 0.05;
/// Ranges in rooms and halls are below this (m).
const MAX_INDOOR_RANGE: f32 = 60.0;
/// Largest range limit of a planar laser (m). Outdoors nearly all readings may be at the limit, which means no return.
const MAX_LIMIT: f32 = 200.0;
/// Readings cover a turn at most; steps that were rounded may add up to a little more (rad).
const MAX_COVERAGE: f64 = 1.1 * TAU;

/// Refuses a log whose ranges cannot be metres, or whose angles cannot be radians.
#[inline(never)]
pub(super) fn refuse_other_units(scans: &[LaserScan]) -> Result<()> {
    let is_return = |range: &f32| *range > 0.0 && range.is_finite();
    let mut ranges: Vec<f32> = scans.iter().flat_map(|scan| &scan.ranges).copied().filter(is_return).collect();
    if !ranges.is_empty() {
        let ranks = [(LEAST_SHARE * ranges.len() as f64) as usize, ranges.len() / 2];
        let [least, median] = ranks.map(|rank| *ranges.select_nth_unstable_by(rank, f32::total_cmp).1);
        if least > MAX_INDOOR_RANGE && median > MAX_LIMIT {
            let problem = format!("Half of its ranges are {median:.0} or more, as in millimetres");
            return Err(Error::whole(problem, "Give them in metres"));
        }
    }
    let Some(scan) = scans.iter().find(|scan| coverage(scan) > MAX_COVERAGE) else { return Ok(()) };
    let problem = format!("The readings of a scan cover an angle of {:.0} rad", coverage(scan));
    Err(Error::line(scan.line, problem, "Give the angles in radians: a turn has 6.28 of them"))
}

/// Between the outermost beams (rad).
fn coverage(scan: &LaserScan) -> f64 {
    match &scan.bearings {
        Bearings::Even { step, .. } => step.abs() * scan.ranges.len().saturating_sub(1) as f64,
        Bearings::Listed(bearings) => {
            let finite = || bearings.iter().copied().filter(|bearing| bearing.is_finite());
            finite().fold(f64::NEG_INFINITY, f64::max) - finite().fold(f64::INFINITY, f64::min)
        }
    }
}
