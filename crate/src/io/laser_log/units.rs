//! In which units a log is that does not say so: metres and radians by the formats, others by what no planar laser does.

use std::f64::consts::TAU;

use super::{Bearings, LaserLog, LaserScan};
use crate::geometry::Pose2;
use crate::geometry::quantile::{RANGE_END, quantile};
use crate::io::length_unit::{Expected, LASER_RANGES, LONGEST_LASER_RANGE, METRE, judge_unit};
use crate::{Error, Result};

/// Ranges of a log whose format has metres: others are mistakes of who wrote it.
const RANGES_IN_METRES: Expected = Expected { priors: [0.997, 0.001, 0.001_8, 0.000_2], ..LASER_RANGES };
/// Readings cover a turn at most; steps that were rounded may add up to a little more. Angles above this are not in radians.
pub(super) const MAX_RADIANS: f64 = 1.1 * TAU;
/// Robots drive less from scan to scan (m; sparse logs have 1): poses that are further apart are in the unit of the ranges.
const MAX_STEP: f64 = 2.0;

/// Brings scans that cannot be in metres and radians into these, and says so. Who did not keep to these may not have kept to
/// counter-clockwise angles either, where bearings fall from reading to reading.
///
/// # Errors
/// When their angles are of no unit.
#[inline(never)]
pub(super) fn in_metres_and_radians(log: &mut LaserLog) -> Result<()> {
    let mut notes = Vec::new();
    notes.extend(in_metres(&mut log.scans));
    notes.extend(in_radians(&mut log.scans)?);
    let falls = |scan: &LaserScan| scan.bearings.of(0) > scan.bearings.of(scan.ranges.len().saturating_sub(1));
    log.may_be_mirrored |= !notes.is_empty() && log.scans.iter().any(falls);
    log.notes.extend(notes);
    Ok(())
}

fn in_metres(scans: &mut [LaserScan]) -> Option<String> {
    let is_return = |range: &f32| *range > 0.0 && range.is_finite();
    let all: Vec<f64> =
        scans.iter().flat_map(|scan| &scan.ranges).filter(|range| is_return(range)).map(|&r| f64::from(r)).collect();
    let largest = all.iter().copied().fold(0.0, f64::max);
    let measured: Vec<f64> = all.iter().copied().filter(|range| *range < RANGE_END * largest).collect();
    let judged = judge_unit(if measured.is_empty() { all } else { measured }, 0.0, &RANGES_IN_METRES);
    if judged.unit == METRE {
        return None;
    }
    let metres = judged.unit.metres;
    let has_such_poses = step_of_robot(scans) > MAX_STEP;
    for scan in &mut *scans {
        scan.ranges.iter_mut().for_each(|range| *range = (f64::from(*range) * metres) as f32);
        // Beyond what lasers see, a stated limit is in the unit of the ranges.
        if scan.max_range > LONGEST_LASER_RANGE {
            scan.max_range *= metres;
        }
        for pose in [&mut scan.reference, &mut scan.odometry].into_iter().flatten().filter(|_| has_such_poses) {
            *pose = Pose2::from_parts((pose.translation.vector * metres).into(), pose.rotation);
        }
    }
    let poses = if has_such_poses { ", and so are its poses" } else { "" };
    Some(format!(
        "Its ranges (median {:.4}) cannot be metres and are read as {}{poses}.",
        judged.median, judged.unit.name
    ))
}

/// The median distance from a pose of the log to the next, in its unit; 0 without poses.
fn step_of_robot(scans: &[LaserScan]) -> f64 {
    let poses: Vec<Pose2> = scans.iter().filter_map(|scan| scan.odometry.or(scan.reference)).collect();
    let step = |pair: &[Pose2]| (pair[1].translation.vector - pair[0].translation.vector).norm();
    let mut steps: Vec<f64> = poses.windows(2).map(step).filter(|step| *step > 0.0).collect();
    quantile(&mut steps, 0.5).unwrap_or(0.0)
}

fn in_radians(scans: &mut [LaserScan]) -> Result<Option<String>> {
    let Some(widest) = scans.iter().find(|scan| coverage(scan) > MAX_RADIANS) else { return Ok(None) };
    if scans.iter().any(|scan| coverage(scan).to_radians() > MAX_RADIANS) {
        let problem = format!("The readings of a scan cover an angle of {:.0} rad", coverage(widest));
        return Err(Error::line(widest.line, problem, "Give the angles in radians: a turn has 6.28 of them"));
    }
    let note = format!(
        "Readings over an angle of {:.0} cannot be in radians: its angles are read as degrees.",
        coverage(widest)
    );
    for scan in &mut *scans {
        match &mut scan.bearings {
            Bearings::Even { start, step } => (*start, *step) = (start.to_radians(), step.to_radians()),
            Bearings::Listed(bearings) => bearings.iter_mut().for_each(|bearing| *bearing = bearing.to_radians()),
        }
    }
    Ok(Some(note))
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
