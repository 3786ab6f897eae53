//! What pairs of scans say of the odometry: how much of what they saw agrees by it, and by another reading of it.

use super::super::recorded_scan::{Matching, RecordedScan, TimedPoses, match_odometry, planar_poses};
use crate::geometry::Pose2;
use crate::geometry::quantile::quantile;
use crate::io::trajectory::Trajectory;
use crate::registration::free_space::beams::RELATIVE_TOLERANCE;

/// About this many pairs of scans are compared, and always fewer than twice as many.
const MAX_PAIRS: usize = 60;
/// Fewer pairs that tell anything decide nothing.
const MIN_PAIRS: usize = 5;
/// Largest number of scans between the two of a pair: the motion is then small enough for both to see the same.
const MAX_APART: usize = 64;
/// A pair of scans is informative about motion where its agreement without any motion is below this.
const MAX_STILL: f64 = 0.6;
/// Where too few pairs have moved: smallest change of the agreement by the odometry for which a pair is used.
const MIN_DIFFERENCE: f64 = 0.25;
/// Returns of a scan that are moved into the other.
const MAX_RETURNS: usize = 60;
/// Bearings to a full turn: what a scan saw there is its nearest return.
const NUM_BEARINGS: usize = 360;
/// Of the returns, at least this share has to lie in the other's view.
const MIN_IN_VIEW: f64 = 0.2;
/// A return agrees with a range that differs by at most this (m), beside the share of it by which ranges differ anyway.
const RANGE_TOLERANCE: f64 = 0.1;
/// Another reading has to make this much more agree than the odometry as it is, ...
const MIN_GAIN: f64 = 0.2;
/// ... and this much in all.
const MIN_AGREEMENT: f64 = 0.5;
/// Readings whose agreement differs by less are as good.
const MIN_STEP: f64 = 0.02;
/// Odometry has to make this much more agree than no motion at all: that of another log gains 0.06 at the most on six logs
/// of buildings, their own 0.4 and more.
const MIN_MOTION_GAIN: f64 = 0.1;
/// What other positions are tried: metres to one of their units, and what to call them.
const POSITION_UNITS: [(f64, &str); 8] = [
    (0.01, "centimetres"),
    (0.001, "millimetres"),
    (1000.0, "kilometres"),
    (0.1, "about ten times too large"),
    (10.0, "about ten times too small"),
    (100.0, "about a hundred times too small"),
    (0.5, "about twice too large"),
    (2.0, "about half as large as they should be"),
];
/// Largest offset of the clock that is tried (s), ...
const MAX_CLOCK_OFFSET: f64 = 30.0;
/// ... and the step between two of them: a robot's turn lasts longer.
const CLOCK_STEP: f64 = 0.25;
/// Offsets below this (s) are the delay of a message, not another clock.
const MIN_CLOCK_OFFSET: f64 = 0.5;

/// A pair of scans that look different.
struct ScanPair {
    first: usize,
    second: usize,
    /// Returns of the second (m).
    returns: Vec<[f64; 2]>,
    /// Nearest range of the first at each bearing (m); NaN for none.
    ranges: Vec<f64>,
}

/// What pairs of scans say of motion.
pub(super) struct Evidence {
    pairs: Vec<ScanPair>,
}

impl Evidence {
    /// Pairs all over the log, of scans that are as close in it as they may be and still look different.
    pub(super) fn new(scans: &[RecordedScan], poses: &[Option<Pose2>], limit: f64) -> Self {
        let known: Vec<usize> = (0..scans.len()).filter(|&scan| poses[scan].is_some()).collect();
        let stride = (known.len() / MAX_PAIRS).max(1);
        let pair = |first: usize, tells: &dyn Fn(&ScanPair, f64) -> bool| {
            let ranges = profile(&scans[first], limit);
            let apart = std::iter::successors(Some(1), |apart| Some(2 * apart)).take_while(|&apart| apart <= MAX_APART);
            let later = apart.map(|apart| first + apart).take_while(|&second| second < scans.len());
            let mut pairs = later.filter(|&second| poses[second].is_some()).map(|second| {
                let returns = returns_of(&scans[second], limit);
                ScanPair { first, second, returns, ranges: ranges.clone() }
            });
            pairs.find(|pair| tells(pair, pair.agreement(&Pose2::identity())))
        };
        let pairs = |tells: &dyn Fn(&ScanPair, f64) -> bool| -> Vec<ScanPair> {
            known.iter().step_by(stride).filter_map(|&first| pair(first, tells)).collect()
        };
        let moved = pairs(&|_, still| still < MAX_STILL);
        if moved.len() >= MIN_PAIRS {
            return Self { pairs: moved };
        }
        // Hardly anything moved, unless it is the odometry.
        let differs =
            |pair: &ScanPair, still: f64| (still - pair.agreement_by(scans, |scan| poses[scan])).abs() > MIN_DIFFERENCE;
        Self { pairs: pairs(&differs) }
    }

    /// Mean share of the returns that agree, by the poses that this gives the scans of a pair.
    fn agreement(&self, scans: &[RecordedScan], pose: impl Fn(usize) -> Option<Pose2>) -> f64 {
        let of = |pair: &ScanPair| pair.agreement_by(scans, &pose);
        self.pairs.iter().map(of).sum::<f64>() / self.pairs.len().max(1) as f64
    }

    /// How far these poses are the mirror image of the scans, to follow "is"; `None` where they are not. A laser that turns the other way than its
    /// readings were taken shows every motion mirrored at the axis that points ahead.
    pub(super) fn mirror(&self, scans: &[RecordedScan], pose: impl Fn(usize) -> Option<Pose2>) -> Option<String> {
        if self.pairs.len() < MIN_PAIRS {
            return None;
        }
        let mirrored_of = |pair: &ScanPair| {
            let motion = pair.motion(scans, &pose);
            let mirrored = motion.map(|m| Pose2::new([m.translation.x, -m.translation.y].into(), -m.rotation.angle()));
            mirrored.map_or(0.0, |motion| pair.agreement(&motion))
        };
        let mirrored = self.pairs.iter().map(mirrored_of).sum::<f64>() / self.pairs.len() as f64;
        let as_given = self.agreement(scans, &pose);
        let least = self.least(as_given);
        let [mirrored_percent, percent] = [mirrored, as_given].map(|share| (100.0 * share).round());
        (mirrored >= least).then(|| {
            format!(
                "the mirror image of what the scans saw: {mirrored_percent} % of that agrees with its motion mirrored, and \
                 {percent} % as it is"
            )
        })
    }

    /// Mean share of the returns that agree without any motion.
    fn still(&self) -> f64 {
        let identity = Pose2::identity();
        self.pairs.iter().map(|pair| pair.agreement(&identity)).sum::<f64>() / self.pairs.len().max(1) as f64
    }

    /// Smallest agreement of another reading that counts against the odometry as it is given. Positions a thousand times too small
    /// are no motion at all: a reading has to be better than that as well.
    fn least(&self, as_given: f64) -> f64 {
        (as_given + MIN_GAIN).max(self.still() + MIN_MOTION_GAIN).max(MIN_AGREEMENT)
    }

    /// Whether what the scans saw agrees with the odometry, and better than without any motion.
    pub(super) fn confirms(&self, scans: &[RecordedScan], poses: &[Option<Pose2>]) -> bool {
        let as_given = self.agreement(scans, |scan| poses[scan]);
        self.pairs.len() >= MIN_PAIRS && as_given >= MIN_AGREEMENT && as_given >= self.still() + MIN_GAIN
    }

    /// What speaks against the odometry as it is, and what would mend it.
    pub(super) fn contradiction(
        &self,
        scans: &[RecordedScan],
        given: &Trajectory,
        poses: &[Option<Pose2>],
        matching: Matching,
    ) -> Option<(String, String)> {
        if self.pairs.len() < MIN_PAIRS {
            return None;
        }
        let as_given = self.agreement(scans, |scan| poses[scan]);
        let percent = |share: f64| (100.0 * share).round();
        let mut readings = self.other_units(scans, given);
        if matching == Matching::Time {
            readings.extend(self.other_clock(scans, given));
        }
        // Of readings that are as good, the plainest, which comes first.
        let better =
            |best: Reading, next: Reading| if next.agreement > best.agreement + MIN_STEP { next } else { best };
        let best = readings.into_iter().reduce(better);
        let (still, least) = (self.still(), self.least(as_given));
        let is_better = |best: &Reading| best.agreement >= least;
        if let Some(Reading { agreement, problem, remedy }) = best.filter(is_better) {
            let figures = format!("{} % of what the scans saw agrees then", percent(agreement));
            return Some((format!("{problem}: {figures}, and {} % as it is", percent(as_given)), remedy));
        }
        (as_given < still + MIN_MOTION_GAIN).then(|| {
            let (with, without) = (percent(as_given), percent(still));
            let problem = format!(
                "It is not what the scans saw: with its motion ({:.2} m from scan to scan, median) {with} % of that agrees, \
                 without any motion {without} %",
                median_step(poses)
            );
            (problem, "Give the odometry of this log, in metres and radians, x ahead and y to the left".to_owned())
        })
    }

    fn other_units(&self, scans: &[RecordedScan], given: &Trajectory) -> Vec<Reading> {
        let reading = |in_degrees: bool, (scale, positions): (f64, &str)| {
            let (poses, _) = match_odometry(scans, &in_other_units(given, in_degrees, scale)?);
            let (problem, remedy) = match (in_degrees, scale == 1.0) {
                (true, true) => ("Its headings are degrees".to_owned(), "Give them in radians"),
                (true, false) => {
                    (format!("Its headings are degrees and its positions {positions}"), "Give radians and metres")
                }
                _ => (format!("Its positions are {positions}"), "Give them in metres"),
            };
            Some(Reading { agreement: self.agreement(scans, |scan| poses[scan]), problem, remedy: remedy.to_owned() })
        };
        let metres = reading(true, (1.0, "metres"));
        let readings = POSITION_UNITS.iter().flat_map(|&unit| [reading(false, unit), reading(true, unit)]);
        std::iter::once(metres).chain(readings).flatten().collect()
    }

    /// The offset of the clock that makes most agree, where it is one.
    fn other_clock(&self, scans: &[RecordedScan], given: &Trajectory) -> Option<Reading> {
        let poses = planar_poses(given);
        let timed = TimedPoses::new(given, &poses)?;
        let steps = (MAX_CLOCK_OFFSET / CLOCK_STEP) as i32;
        let agreement = |offset: f64| self.agreement(scans, |scan| timed.at(scans[scan].time? - offset));
        let tried = (-steps..=steps).map(|step| f64::from(step) * CLOCK_STEP).map(|offset| (agreement(offset), offset));
        let (agreement, offset) = tried.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.abs().total_cmp(&a.1.abs())))?;
        (offset.abs() >= MIN_CLOCK_OFFSET).then(|| Reading {
            agreement,
            problem: format!("Its clock is {} s {}", offset.abs(), if offset > 0.0 { "behind" } else { "ahead" }),
            remedy: format!("Add {offset} s to its times"),
        })
    }
}

/// Another reading of the odometry.
struct Reading {
    agreement: f64,
    problem: String,
    remedy: String,
}

impl ScanPair {
    /// The same, by the poses of the robot at the two scans; 0 where one is not known.
    fn agreement_by(&self, scans: &[RecordedScan], pose: impl Fn(usize) -> Option<Pose2>) -> f64 {
        self.motion(scans, pose).map_or(0.0, |motion| self.agreement(&motion))
    }

    /// Motion of the laser between the two scans, by the poses of the robot: `T_first_second`.
    fn motion(&self, scans: &[RecordedScan], pose: impl Fn(usize) -> Option<Pose2>) -> Option<Pose2> {
        let (first, second) = (&scans[self.first], &scans[self.second]);
        let T_world_first = pose(self.first)? * first.T_robot_laser;
        Some(T_world_first.inverse() * pose(self.second)? * second.T_robot_laser)
    }

    /// Share of the second scan's returns that lie where the first has a return, moved by this pose of the second.
    fn agreement(&self, T_first_second: &Pose2) -> f64 {
        let (mut in_view, mut agreed) = (0, 0);
        for &[x, y] in &self.returns {
            let p = T_first_second * nalgebra::Point2::new(x, y);
            let (range, bearing) = (p.coords.norm(), bearing_of(p.x, p.y));
            let nearby = [NUM_BEARINGS - 1, 0, 1].map(|off| self.ranges[(bearing + off) % NUM_BEARINGS] - range);
            let off = nearby.into_iter().map(f64::abs).filter(|off| off.is_finite()).fold(f64::NAN, f64::min);
            if off.is_finite() {
                in_view += 1;
                agreed += usize::from(off < RANGE_TOLERANCE + RELATIVE_TOLERANCE * range);
            }
        }
        let is_seen = f64::from(in_view) >= MIN_IN_VIEW * self.returns.len() as f64 && in_view > 0;
        if is_seen { agreed as f64 / f64::from(in_view) } else { 0.0 }
    }
}

/// Median distance of the robot from scan to scan (m).
fn median_step(poses: &[Option<Pose2>]) -> f64 {
    let step = |pair: &[Option<Pose2>]| Some((pair[1]?.translation.vector - pair[0]?.translation.vector).norm());
    let mut steps: Vec<f64> = poses.windows(2).filter_map(step).collect();
    quantile(&mut steps, 0.5).unwrap_or(0.0)
}

fn bearing_of(x: f64, y: f64) -> usize {
    let turns = y.atan2(x) / std::f64::consts::TAU;
    (turns.rem_euclid(1.0) * NUM_BEARINGS as f64) as usize % NUM_BEARINGS
}

/// x, y and range (m) of what a scan saw.
fn seen(scan: &RecordedScan, limit: f64) -> impl Iterator<Item = ([f64; 2], f64)> + '_ {
    let max_range = scan.max_range.min(limit);
    let points = scan.cloud.positions.iter().map(|p| [f64::from(p.x), f64::from(p.y)]);
    points.map(|[x, y]| ([x, y], x.hypot(y))).filter(move |&(_, range)| range > 0.0 && range < max_range)
}

fn profile(scan: &RecordedScan, limit: f64) -> Vec<f64> {
    let mut ranges = vec![f64::NAN; NUM_BEARINGS];
    for ([x, y], range) in seen(scan, limit) {
        let nearest = &mut ranges[bearing_of(x, y)];
        *nearest = nearest.min(range);
    }
    ranges
}

fn returns_of(scan: &RecordedScan, limit: f64) -> Vec<[f64; 2]> {
    let all: Vec<[f64; 2]> = seen(scan, limit).map(|(point, _)| point).collect();
    all.iter().copied().step_by(all.len().div_ceil(MAX_RETURNS).max(1)).collect()
}

/// The odometry with its headings taken for degrees, and its positions scaled; `None` where it has no such headings.
fn in_other_units(given: &Trajectory, in_degrees: bool, scale: f64) -> Option<Trajectory> {
    let mut other = given.clone();
    other.positions.iter_mut().for_each(|position| *position *= scale);
    if in_degrees {
        let rotation = |degrees: &f64| {
            nalgebra::UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), degrees.to_radians())
        };
        other.orientations = Some(given.headings.as_ref()?.iter().map(rotation).collect());
    }
    Some(other)
}
