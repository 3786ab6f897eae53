//! What pairs of scans say of the odometry: how much of what they saw agrees by it, and by another reading of it.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector2;

use super::super::planar::pairs::spread_pairs;
use super::super::recorded_scan::{Matching, RecordedScan, TimedPoses, match_odometry, planar_poses};
use crate::geometry::quantile::{MIN_SAMPLE, quantile};
use crate::geometry::{Pose2, RigidMotion};
use crate::io::trajectory::Trajectory;
use crate::odometry::planar::assess::{MIN_OVERLAP, MOST, PLAUSIBLE_AGREEMENT};
use crate::odometry::planar::hypothesis::{NUM_SEARCHED_POINTS, agrees_as_well, thinned};
use crate::registration::free_space::FreeSpaceTest;
use crate::registration::free_space::beams::RangeProfile;

/// Smallest gain in the share of agreeing returns that counts: what may disagree where a pose is right all the same (people, doors).
/// Another reading has to gain this over the odometry as it is; odometry, over no motion at all.
fn min_gain() -> f64 {
    1.0 - PLAUSIBLE_AGREEMENT
}

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
/// ... and the step between two of them: a robot's turn lasts longer. One step is the delay of a message, not another clock.
const CLOCK_STEP: f64 = 0.25;

/// A pair of scans that look different.
struct ScanPair {
    first: usize,
    second: usize,
    /// Returns of the second (m).
    returns: Vec<Vector2<f64>>,
    /// What the first saw.
    profile: RangeProfile,
}

/// What pairs of scans say of motion.
pub(super) struct Evidence {
    pairs: Vec<ScanPair>,
}

impl Evidence {
    /// Pairs all over the log, of scans that are as close in it as they may be and still look different: by what they saw, or, where
    /// hardly anything moved, by the odometry.
    pub(super) fn new(scans: &[RecordedScan], poses: &[Option<Pose2>], limit: f64) -> Self {
        let known: Vec<usize> = (0..scans.len()).filter(|&scan| poses[scan].is_some()).collect();
        let pairs = |tells: &dyn Fn(&ScanPair, f64) -> bool| {
            spread_pairs(&known, |first, second| {
                let returns = thinned(&returns_of(&scans[second], limit), NUM_SEARCHED_POINTS);
                let profile = RangeProfile::new(&returns_of(&scans[first], limit));
                let pair = ScanPair { first, second, returns, profile };
                tells(&pair, pair.agreement(&Pose2::identity())).then_some(pair)
            })
        };
        let moved = pairs(&|_, still| still < MOST);
        if moved.len() >= MIN_SAMPLE {
            return Self { pairs: moved };
        }
        let differs =
            |pair: &ScanPair, still: f64| (still - pair.agreement_by(scans, |scan| poses[scan])).abs() > min_gain();
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
        if self.pairs.len() < MIN_SAMPLE {
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
        (as_given + min_gain()).max(self.still() + min_gain()).max(MOST)
    }

    /// Whether what the scans saw agrees with the odometry, and better than without any motion.
    pub(super) fn confirms(&self, scans: &[RecordedScan], poses: &[Option<Pose2>]) -> bool {
        let as_given = self.agreement(scans, |scan| poses[scan]);
        self.pairs.len() >= MIN_SAMPLE && as_given >= MOST && as_given >= self.still() + min_gain()
    }

    /// What speaks against the odometry as it is, and what would mend it.
    pub(super) fn contradiction(
        &self,
        scans: &[RecordedScan],
        given: &Trajectory,
        poses: &[Option<Pose2>],
        matching: Matching,
    ) -> Option<(String, String)> {
        if self.pairs.len() < MIN_SAMPLE {
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
            |best: Reading, next: Reading| if agrees_as_well(best.agreement, next.agreement) { best } else { next };
        let best = readings.into_iter().reduce(better);
        let (still, least) = (self.still(), self.least(as_given));
        let is_better = |best: &Reading| best.agreement >= least;
        if let Some(Reading { agreement, problem, remedy }) = best.filter(is_better) {
            let figures = format!("{} % of what the scans saw agrees then", percent(agreement));
            return Some((format!("{problem}: {figures}, and {} % as it is", percent(as_given)), remedy));
        }
        (as_given < still + min_gain()).then(|| {
            let (with, without) = (percent(as_given), percent(still));
            let problem = format!(
                "It is not what the scans saw: with its motion ({:.2} m from scan to scan, median) {with} % of that agrees, \
                 without any motion {without} %",
                median_step(poses)
            );
            (problem, "Give the odometry of this log, in metres and radians, x ahead and y to the left".to_owned())
        })
    }

    /// The quarter turn of the robot's axes by which these poses are what the scans saw, and that in words, to follow "it"; `None` where
    /// none is, or where they are it as they stand. A laser that looks backwards, or headings that count from another axis, are such.
    pub(super) fn turn(&self, scans: &[RecordedScan], poses: &[Option<Pose2>]) -> Option<(f64, String)> {
        if self.pairs.len() < MIN_SAMPLE {
            return None;
        }
        let turned = |turn: f64| self.agreement(scans, |scan| Some(poses[scan]? * turn_of(turn)));
        let quarters = [1.0, 2.0, -1.0].map(|quarter| quarter * FRAC_PI_2);
        let best = quarters.map(|turn| (turned(turn), turn)).into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        let as_given = turned(0.0);
        let (agreement, turn) = best.filter(|(agreement, _)| *agreement >= self.least(as_given))?;
        let [then, percent] = [agreement, as_given].map(|share| (100.0 * share).round());
        let degrees = turn.to_degrees().round();
        Some((
            turn,
            format!(
                "{then} % of what the scans saw agrees with its motion turned by {degrees} degrees, and {percent} % as it is"
            ),
        ))
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
        (offset.abs() > CLOCK_STEP).then(|| Reading {
            agreement,
            problem: format!("Its clock is {} s {}", offset.abs(), if offset > 0.0 { "behind" } else { "ahead" }),
            remedy: format!("Add {offset} s to its times"),
        })
    }
}

/// The robot turned in place (rad).
pub(super) fn turn_of(angle: f64) -> Pose2 {
    Pose2::new(Vector2::zeros(), angle)
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

    /// Share of the second scan's returns that lie where the first has a surface, moved by this pose of the second.
    fn agreement(&self, T_first_second: &Pose2) -> f64 {
        let (mut num_seen, mut num_agreeing) = (0, 0);
        for point in &self.returns {
            let test = self.profile.classify(&T_first_second.act(point));
            num_seen += usize::from(test != FreeSpaceTest::Unknown);
            num_agreeing += usize::from(test == FreeSpaceTest::Agreeing(()));
        }
        let is_seen = num_seen as f64 > MIN_OVERLAP * self.returns.len() as f64;
        if is_seen { num_agreeing as f64 / num_seen as f64 } else { 0.0 }
    }
}

/// Median distance of the robot from scan to scan (m).
fn median_step(poses: &[Option<Pose2>]) -> f64 {
    let step = |pair: &[Option<Pose2>]| Some((pair[1]?.translation.vector - pair[0]?.translation.vector).norm());
    let mut steps: Vec<f64> = poses.windows(2).filter_map(step).collect();
    quantile(&mut steps, 0.5).unwrap_or(0.0)
}

/// What a scan saw (m).
fn returns_of(scan: &RecordedScan, limit: f64) -> Vec<Vector2<f64>> {
    let max_range = scan.max_range.min(limit);
    let points = scan.cloud.positions.iter().map(|p| Vector2::new(f64::from(p.x), f64::from(p.y)));
    points.filter(|point| (f64::MIN_POSITIVE..max_range).contains(&point.norm())).collect()
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
