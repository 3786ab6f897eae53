//! The fan of a log's laser is a claim: radians may stand where degrees are expected, and 180 degrees where the laser looks all
//! round. The scans refute a wrong one. What two scans see from places apart fits together under the right fan alone, since a wrong
//! one bends every wall as seen from each place in another way; a turn on the spot fits under any.

use std::f64::consts::PI;
use std::rc::Rc;

use super::pairs::register_alone;
use crate::io::laser_log::{Bearings, LaserLog, LaserScan};
use crate::odometry::planar::assess::MIN_POINTS;
use crate::pipeline::recorded_scan::RecordedScan;
use crate::pipeline::settings::Settings;

/// Pairs of scans that are compared.
const NUM_PAIRS: usize = 24;
/// Of the readings of a pair, this share differs by more than noise: one of the two scans was taken from elsewhere.
const MIN_DIFFERING: f64 = 0.3;
/// Ranges differ beyond this (m) and this share of the range.
const SAME_RANGE: (f32, f32) = (0.15, 0.03);
/// Largest number of scans between the two of a pair.
const MAX_APART: usize = 16;
/// The fans of lasers (degrees): what they are sold with.
const USUAL_FANS: [f64; 5] = [100.0, 180.0, 240.0, 270.0, 360.0];
/// Fans whose ratio differs from 1 by less are the same: a beam more or less, or a rounded step.
const SAME_FAN: f64 = 0.05;
/// No fan is narrower than this (degrees).
const NARROWEST: f64 = 20.0;
/// Another fan has to make this much more of the returns agree, in the mean, ...
const MIN_GAIN: f64 = 0.15;
/// ... and more of them in so many pairs that chance does it once in this many logs.
const CHANCE: f64 = 1e-4;

/// The log with the fan that its scans tell, and a sentence that says so; `None` where they do not refute the one stated.
pub(super) fn corrected(log: &LaserLog, settings: &Settings) -> Option<(LaserLog, String)> {
    let stated = fan(&log.scans[0])?;
    let pairs = pairs(&log.scans);
    let agreements = |factor: f64| -> Vec<f64> {
        pairs.iter().map(|&(first, second)| agreement(&log.scans[first], &log.scans[second], factor, settings)).collect()
    };
    let mean = |agreements: &[f64]| agreements.iter().sum::<f64>() / agreements.len().max(1) as f64;
    let as_stated = if stated > 2.0 * PI * (1.0 + SAME_FAN) { vec![0.0; pairs.len()] } else { agreements(1.0) };
    if mean(&as_stated) + MIN_GAIN > 1.0 {
        return None;
    }
    let others = factors(stated).into_iter().map(|factor| (factor, agreements(factor)));
    let (factor, found) = others.max_by(|a, b| mean(&a.1).total_cmp(&mean(&b.1)))?;
    let is_told = mean(&found) > mean(&as_stated) + MIN_GAIN && is_beyond_chance(&as_stated, &found);
    is_told.then(|| {
        let mut log = log.clone();
        for scan in &mut log.scans {
            scan.bearings = scaled(&scan.bearings, factor);
        }
        let degrees = |fan: f64| format!("{:.0} degrees", fan.to_degrees());
        let percent = |agreements: &[f64]| (100.0 * mean(agreements)).round();
        let note = format!(
            "The log gives its laser a fan of {}, and its scans refute that: of the returns of two scans {} % lie where the other \
             scan has a surface, and with a fan of {} {} %. It was read as {}; correct the log (in CARMEN's laser_front_laser_fov, in \
             degrees) if it is another one.",
            if stated < NARROWEST.to_radians() || stated > 2.5 * PI { format!("{:.3} degrees", stated.to_degrees()) } else { degrees(stated) },
            percent(&as_stated),
            degrees(factor * stated),
            percent(&found),
            degrees(factor * stated)
        );
        (log, note)
    })
}

/// The angle from a scan's first beam to its last (rad); `None` where the beams are not at equal steps.
fn fan(scan: &LaserScan) -> Option<f64> {
    match scan.bearings {
        Bearings::Even { step, .. } => Some(step.abs() * scan.ranges.len().saturating_sub(1) as f64).filter(|&fan| fan > 0.0),
        Bearings::Listed(_) => None,
    }
}

/// By how much a stated fan (rad) may have to be multiplied: another unit, or the fan of another laser.
fn factors(stated: f64) -> Vec<f64> {
    let units = [180.0 / PI, PI / 180.0].map(|unit| unit * stated);
    let mut fans: Vec<f64> = Vec::new();
    for fan in USUAL_FANS.map(f64::to_radians).into_iter().chain(units) {
        let is_fan = (NARROWEST.to_radians()..2.0 * PI * (1.0 + SAME_FAN)).contains(&fan);
        let is_new = |known: &f64| (fan / known - 1.0).abs() > SAME_FAN;
        if is_fan && is_new(&stated) && fans.iter().all(is_new) {
            fans.push(fan);
        }
    }
    fans.into_iter().map(|fan| fan / stated).collect()
}

fn scaled(bearings: &Bearings, factor: f64) -> Bearings {
    match bearings {
        Bearings::Even { start, step } => Bearings::Even { start: factor * start, step: factor * step },
        Bearings::Listed(listed) => Bearings::Listed(listed.clone()),
    }
}

/// Pairs of scans all over the log, as close in it as they may be and still look different.
fn pairs(scans: &[LaserScan]) -> Vec<(usize, usize)> {
    let stride = (scans.len() / NUM_PAIRS).max(1);
    let pair = |first: usize| {
        let apart = std::iter::successors(Some(1), |apart| Some(2 * apart)).take_while(|&apart| apart <= MAX_APART);
        let later = apart.map(|apart| first + apart).take_while(|&second| second < scans.len());
        later.map(|second| (first, second)).find(|&(first, second)| differ(&scans[first], &scans[second]))
    };
    (0..scans.len()).step_by(stride).filter_map(pair).collect()
}

/// Whether two scans have readings that differ, beam by beam.
fn differ(first: &LaserScan, second: &LaserScan) -> bool {
    let both = first.ranges.iter().zip(&second.ranges).filter(|(a, b)| a.is_finite() && b.is_finite());
    let differs = both.map(|(a, b)| (a - b).abs() > SAME_RANGE.0 + SAME_RANGE.1 * a.min(*b));
    let (all, differing) = differs.fold((0, 0), |(all, differing), differs| (all + 1, differing + usize::from(differs)));
    differing as f64 > MIN_DIFFERING * f64::from(all)
}

/// Share of the returns of two scans that lie where the other one has a surface, after their registration, where the fan is this
/// many times as wide.
fn agreement(first: &LaserScan, second: &LaserScan, factor: f64, settings: &Settings) -> f64 {
    let [target, source] = [first, second].map(|scan| {
        let scan = LaserScan { bearings: scaled(&scan.bearings, factor), ..scan.clone() };
        RecordedScan::of_scan(&scan).cleaned(f64::INFINITY, settings).0
    });
    if target.points.len() < MIN_POINTS || source.points.len() < MIN_POINTS {
        return 0.0;
    }
    let count = target.points.len() + source.points.len();
    let (_, seen) = register_alone(&Rc::new(target), &source, &settings.odometry_options());
    seen.agreeing as f64 / count as f64
}

/// Whether more agrees in so many pairs as chance brings once in many logs only (sign test).
fn is_beyond_chance(before: &[f64], after: &[f64]) -> bool {
    let (num_better, num_worse) = before.iter().zip(after).fold((0, 0), |(better, worse), (before, after)| {
        (better + usize::from(after > before), worse + usize::from(after < before))
    });
    let num = num_better + num_worse;
    let mut ways = 1.0;
    let mut at_most_as_many_worse = 0.0;
    for worse in 0..=num_worse {
        at_most_as_many_worse += ways;
        ways *= (num - worse) as f64 / (worse + 1) as f64;
    }
    at_most_as_many_worse / 2f64.powi(i32::try_from(num).unwrap_or(i32::MAX)) < CHANCE
}
