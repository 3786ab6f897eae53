//! The fan of a log's laser is a claim: radians may stand where degrees are expected, and 180 degrees where the laser looks all
//! round. The scans refute a wrong one. What two scans see from places apart fits together under the right fan alone, since a wrong
//! one bends every wall as seen from each place in another way; a turn on the spot fits under any.

use std::f64::consts::PI;
use std::rc::Rc;

use super::pairs::{known, register_alone};
use crate::io::laser_log::{Bearings, LaserLog, LaserScan};
use crate::odometry::planar::assess::MIN_POINTS;
use crate::odometry::planar::motion_noise::MotionNoise;
use crate::pipeline::recorded_scan::RecordedScan;
use crate::pipeline::settings::Settings;
use crate::registration::free_space::beams::{MIN_TOLERANCE, RELATIVE_TOLERANCE};

/// Pairs of scans that are compared.
const NUM_PAIRS: usize = 24;
/// Of the readings of a pair, this share differs by more than noise: one of the two scans was taken from elsewhere.
const MIN_DIFFERING: f64 = 0.5;
/// Largest number of scans between the two of a pair.
const MAX_APART: usize = 16;
/// The fans of lasers (degrees): what they are sold with.
const USUAL_FANS: [f64; 5] = [100.0, 180.0, 240.0, 270.0, 360.0];
/// Fans whose ratio differs from 1 by less are the same: a beam more or less, or a rounded step.
const SAME_FAN: f64 = 0.05;
/// No fan is narrower than this (degrees).
const NARROWEST: f64 = 20.0;
/// Another fan has to make this much more of the returns agree, in the mean, ...
const MIN_GAIN: f64 = 0.05;
/// ... or the poses in the log this much likelier (mean of the logarithm), ...
const MIN_MOTION_GAIN: f64 = 0.5;
/// ... where pairs of scans that differ by less fit as well, ...
const SAME_FIT: f64 = 0.01;
/// Share of the motions by these poses that is wrong, whatever the fan.
const WRONG_SHARE: f64 = 0.1;
/// ... and more of them in so many pairs that chance does it once in this many logs.
const CHANCE: f64 = 1e-4;

/// The log with the fan that its scans tell, and a sentence that says so; `None` where they do not refute the one stated.
pub(super) fn corrected(log: &LaserLog, settings: &Settings) -> Option<(LaserLog, String)> {
    let stated = fan(log.scans.first()?).filter(|_| !log.are_bearings_given)?;
    let pairs = pairs(&log.scans);
    let fits = |factor: f64| -> Vec<Fit> {
        let is_possible = factor * stated < 2.0 * PI * (1.0 + SAME_FAN);
        let fit = |&(first, second): &(usize, usize)| {
            if is_possible { Fit::new(log, first, second, factor, settings) } else { Fit::default() }
        };
        pairs.iter().map(fit).collect()
    };
    let as_stated = fits(1.0);
    if mean(&as_stated, |fit| fit.agreement) + MIN_GAIN > 1.0 {
        return None;
    }
    let others: Vec<(f64, Vec<Fit>)> = factors(stated).into_iter().map(|factor| (factor, fits(factor))).collect();
    let best = |of: fn(&Fit) -> f64| others.iter().max_by(|a, b| mean(&a.1, of).total_cmp(&mean(&b.1, of)));
    let gain = |found: &[Fit], of: fn(&Fit) -> f64| mean(found, of) - mean(&as_stated, of);
    let by_agreement = best(|fit| fit.agreement).filter(|(_, found)| {
        gain(found, |fit| fit.agreement) > MIN_GAIN && is_beyond_chance(&as_stated, found, |fit| fit.agreement)
    });
    // Odometry tells turns, and a turn is as many times too large as the fan.
    let by_motion = || {
        best(|fit| fit.motion).filter(|(_, found)| {
            gain(found, |fit| fit.motion) > MIN_MOTION_GAIN
                && gain(found, |fit| fit.agreement) > 0.0
                && is_beyond_chance(&as_stated, found, |fit| fit.motion)
        })
    };
    let (factor, found) = by_agreement.or_else(by_motion)?;
    let mut log = log.clone();
    for scan in &mut log.scans {
        scan.bearings = scaled(&scan.bearings, *factor);
    }
    let [before, after] = [stated, factor * stated].map(|fan| format!("{:.1} degrees", fan.to_degrees()));
    let [agreed, agrees] = [&as_stated, found].map(|fits| (100.0 * mean(fits, |fit| fit.agreement)).round());
    let note = format!(
        "The file gives its laser a fan of {before}, which its scans refute: {agreed} % of the returns of scans that were compared \
         agree with it, and {agrees} % with a fan of {after}. It was read as {after}. If that is wrong, correct the angles in the file."
    );
    Some((log, note))
}

/// How well two scans fit each other after their registration.
#[derive(Clone, Copy, Default)]
struct Fit {
    /// Share of the returns that lie where the other scan has a surface.
    agreement: f64,
    /// Logarithm of the likelihood of the motion by the poses in the log; 0 without.
    motion: f64,
}

impl Fit {
    /// Of two scans whose fan is this many times as wide.
    fn new(log: &LaserLog, first: usize, second: usize, factor: f64, settings: &Settings) -> Self {
        let [target, source] = [first, second].map(|scan| {
            let scan = &log.scans[scan];
            let scan = LaserScan { bearings: scaled(&scan.bearings, factor), ..scan.clone() };
            RecordedScan::of_scan(&scan).cleaned(f64::INFINITY, settings).0
        });
        if target.points.len() < MIN_POINTS || source.points.len() < MIN_POINTS {
            return Self::default();
        }
        let count = target.points.len() + source.points.len();
        let (found, seen) = register_alone(&Rc::new(target), &source, &settings.odometry_options());
        let pose = |scan: usize| Some(log.scans[scan].odometry? * log.T_robot_laser);
        let measured = pose(first).zip(pose(second)).map(|(first, second)| first.inverse() * second);
        let motion = measured.map_or(0.0, |measured| {
            let ratio = MotionNoise::default().log_likelihood_ratio(&[measured], &known(&found)).exp();
            (WRONG_SHARE + (1.0 - WRONG_SHARE) * ratio).ln()
        });
        Self { agreement: seen.agreeing as f64 / count as f64, motion }
    }
}

fn mean(fits: &[Fit], of: fn(&Fit) -> f64) -> f64 {
    fits.iter().map(of).sum::<f64>() / fits.len().max(1) as f64
}

/// The angle that a scan's beams look over (rad), where an even number of beams leaves the last one out; `None` where they are not at
/// equal steps.
fn fan(scan: &LaserScan) -> Option<f64> {
    let num_steps = scan.ranges.len() / 2 * 2;
    match scan.bearings {
        Bearings::Even { step, .. } => Some(step.abs() * num_steps as f64).filter(|&fan| fan > 0.0),
        Bearings::Listed(_) => None,
    }
}

/// By how much a stated fan (rad) may have to be multiplied: another unit, or the fan of another laser.
fn factors(stated: f64) -> Vec<f64> {
    let units = [180.0 / PI, PI / 180.0].map(|unit| unit * stated);
    let mut fans: Vec<f64> = Vec::new();
    for fan in units.into_iter().chain(USUAL_FANS.map(f64::to_radians)) {
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
    let differs =
        both.map(|(&a, &b)| f64::from((a - b).abs()) > MIN_TOLERANCE + RELATIVE_TOLERANCE * f64::from(a.min(b)));
    let (all, differing) =
        differs.fold((0, 0), |(all, differing), differs| (all + 1, differing + usize::from(differs)));
    differing as f64 > MIN_DIFFERING * f64::from(all)
}

/// Whether so many pairs fit better as chance brings once in many logs only (sign test).
fn is_beyond_chance(before: &[Fit], after: &[Fit], of: fn(&Fit) -> f64) -> bool {
    let gains = || before.iter().zip(after).map(|(before, after)| of(after) - of(before));
    let (num_better, num_worse) =
        (gains().filter(|&gain| gain > SAME_FIT).count(), gains().filter(|&gain| gain < -SAME_FIT).count());
    let num = num_better + num_worse;
    let mut ways = 1.0;
    let mut at_most_as_many_worse = 0.0;
    for worse in 0..=num_worse {
        at_most_as_many_worse += ways;
        ways *= (num - worse) as f64 / (worse + 1) as f64;
    }
    at_most_as_many_worse / 2f64.powi(i32::try_from(num).unwrap_or(i32::MAX)) < CHANCE
}
