//! The fan of a log's laser is a claim: radians may stand where degrees are expected, and 180 degrees where the laser looks all
//! round. The scans refute a wrong one. What two scans see from places apart fits together under the right fan alone, since a wrong
//! one bends every wall as seen from each place in another way; a turn on the spot fits under any.

use std::f64::consts::PI;
use std::rc::Rc;

use super::pairs::{known, register_alone, spread_pairs};
use crate::geometry::quantile::THREE_SIGMA;
use crate::io::laser_log::{Bearings, LaserLog, LaserScan};
use crate::odometry::planar::assess::{MIN_POINTS, MOST};
use crate::odometry::planar::hypothesis::agrees_as_well;
use crate::odometry::planar::motion_noise::{EXPECTED_WRONG, MotionNoise};
use crate::pipeline::recorded_scan::RecordedScan;
use crate::pipeline::settings::Settings;
use crate::registration::free_space::beams::tolerance;

/// The fans of lasers (degrees): what they are sold with.
const USUAL_FANS: [f64; 5] = [100.0, 180.0, 240.0, 270.0, 360.0];

/// The log with the fan that its scans tell, and a sentence that says so; `None` where they do not refute the one stated.
pub(super) fn corrected(log: &LaserLog, settings: &Settings) -> Option<(LaserLog, String)> {
    let (stated, num_steps) = fan(log.scans.first()?).filter(|_| !log.are_bearings_given)?;
    let all: Vec<usize> = (0..log.scans.len()).collect();
    let pairs =
        spread_pairs(&all, |first, second| differ(&log.scans[first], &log.scans[second]).then_some((first, second)));
    let fits = |factor: f64| -> Vec<Fit> {
        pairs.iter().map(|&(first, second)| Fit::new(log, first, second, factor, settings)).collect()
    };
    let as_stated = fits(1.0);
    let agreement = mean(&as_stated, |fit| fit.agreement);
    if agrees_as_well(agreement, 1.0) {
        return None;
    }
    let others: Vec<(f64, Vec<Fit>)> =
        factors(stated, num_steps).into_iter().map(|factor| (factor, fits(factor))).collect();
    let best = |of: fn(&Fit) -> f64| others.iter().max_by(|a, b| mean(&a.1, of).total_cmp(&mean(&b.1, of)));
    let by_agreement = best(|fit| fit.agreement).filter(|(_, found)| {
        !agrees_as_well(agreement, mean(found, |fit| fit.agreement))
            && is_beyond_chance(&as_stated, found, |fit| fit.agreement)
    });
    // Odometry tells turns, and a turn is as many times too large as the fan.
    let by_motion = || {
        best(|fit| fit.motion).filter(|(_, found)| {
            mean(found, |fit| fit.agreement) > agreement && is_beyond_chance(&as_stated, found, |fit| fit.motion)
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
            (EXPECTED_WRONG + (1.0 - EXPECTED_WRONG) * ratio).ln()
        });
        Self { agreement: seen.agreeing as f64 / count as f64, motion }
    }
}

fn mean(fits: &[Fit], of: fn(&Fit) -> f64) -> f64 {
    fits.iter().map(of).sum::<f64>() / fits.len().max(1) as f64
}

/// The angle that a scan's beams look over (rad), where an even number of beams leaves the last one out, and the number of steps between
/// them; `None` where they are not at equal steps.
fn fan(scan: &LaserScan) -> Option<(f64, f64)> {
    let num_steps = (scan.ranges.len() / 2 * 2) as f64;
    match scan.bearings {
        Bearings::Even { step, .. } => Some((step.abs() * num_steps, num_steps)).filter(|&(fan, _)| fan > 0.0),
        Bearings::Listed(_) => None,
    }
}

/// By how much a stated fan (rad) of so many steps may have to be multiplied: another unit, or the fan of another laser. Fans that
/// differ by no more than a step are the same.
fn factors(stated: f64, num_steps: f64) -> Vec<f64> {
    let units = [180.0 / PI, PI / 180.0].map(|unit| unit * stated);
    let mut fans: Vec<f64> = Vec::new();
    for fan in units.into_iter().chain(USUAL_FANS.map(f64::to_radians)) {
        let step = fan / num_steps;
        let is_new = |known: &f64| (fan - known).abs() > step;
        if fan < 2.0 * PI + step && is_new(&stated) && fans.iter().all(is_new) {
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

/// Whether most readings of two scans differ, beam by beam: one of the two was taken from elsewhere.
fn differ(first: &LaserScan, second: &LaserScan) -> bool {
    let both = first.ranges.iter().zip(&second.ranges).filter(|(a, b)| a.is_finite() && b.is_finite());
    let differs = both.map(|(&a, &b)| f64::from((a - b).abs()) > tolerance(f64::from(a.min(b))));
    let (all, differing) =
        differs.fold((0, 0), |(all, differing), differs| (all + 1, differing + usize::from(differs)));
    differing as f64 > MOST * f64::from(all)
}

/// Whether more pairs fit better than chance makes of as many (sign test).
fn is_beyond_chance(before: &[Fit], after: &[Fit], of: fn(&Fit) -> f64) -> bool {
    let gains = before.iter().zip(after).map(|(before, after)| of(after) - of(before)).filter(|&gain| gain != 0.0);
    let (sum, num) = gains.fold((0.0, 0.0), |(sum, num), gain| (sum + gain.signum(), num + 1.0));
    sum > THREE_SIGMA * f64::sqrt(num)
}
