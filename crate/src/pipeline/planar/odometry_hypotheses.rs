//! What a recording says of its odometry is a claim: its units, its clock, its axes, and whose it is. Each other reading is a
//! hypothesis, and all are compared by one likelihood: of the motions that pairs of scans have by the scans alone. Odometry that only
//! another reading makes likely is not used, and the reading is named.

use super::pairs::ScanPair;
use nalgebra::Matrix3;

use crate::geometry::Pose2;
use crate::geometry::quantile::quantile;
use crate::io::trajectory::Trajectory;
use crate::odometry::planar::motion_noise::MotionNoise;
use crate::pipeline::recorded_scan::{Matching, RecordedScan, RecordedScans, TimedPoses, match_odometry, planar_poses};

/// Fewer pairs decide nothing.
const MIN_PAIRS: usize = 5;
/// Share of the steps that are wrong, whatever the reading.
const WRONG_SHARE: f64 = 0.1;
/// A reading is likely when it makes the motions of pairs ten times as likely, in the geometric mean, as wrong steps do. Another one is
/// likelier than the one at hand when that is so of the fewest pairs that decide, ...
const TEN_TIMES: f64 = std::f64::consts::LN_10;
/// ... and as many times more pairs likelier than less likely.
const BETTER_TO_WORSE: usize = 3;
/// Odometry whose likelihood (mean of the logarithm) is not above chance by more is another log's where it is wrong unusually often: twice the
/// standard error of some fifty pairs.
const BEYOND_CHANCE: f64 = 1.0;
/// Readings whose likelihood differs by less (mean of the logarithm) are as good: the plainest is taken.
const AS_GOOD: f64 = 0.1;
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

/// What to do about scans that are the mirror image of what odometry tells.
const MIRROR_REMEDY: &str = "If the laser turns clockwise, say so (--table with a negative step, or angle=COLUMN:-1deg); if the \
                             odometry counts y to the right, give y to the left and headings counter-clockwise";

/// Odometry as far as it can be used.
#[derive(Debug, Clone, Default)]
pub struct CheckedOdometry {
    /// Pose of the robot at each scan, where it is known; none at all where the odometry is not to be used.
    pub poses: Vec<Option<Pose2>>,
    /// Why it is not used; `None` where it is.
    pub refusal: Option<String>,
    /// Why the scans, or the odometry, are a mirror image; `None` where they are not.
    pub mirrored: Option<String>,
    /// What else is worth knowing, in whole sentences.
    pub notes: Vec<String>,
}

/// Finds each scan's odometry and compares the ways to read it.
#[inline(never)]
pub fn check_odometry(name: &str, scans: &RecordedScans, pairs: &[ScanPair], given: &Trajectory) -> CheckedOdometry {
    let (poses, matching) = match_odometry(scans.all, given);
    let refuse = |problem: String, remedy: &str| CheckedOdometry {
        poses: vec![None; scans.all.len()],
        refusal: Some(format!("{name}: {problem}. {remedy}. It was not used.")),
        ..CheckedOdometry::default()
    };
    let evidence = Evidence::new(scans, pairs, &poses);
    if let Some(mirror) = evidence.mirror(&poses) {
        let problem = format!("It is {mirror}");
        return CheckedOdometry { mirrored: Some(problem.clone()), ..refuse(problem, MIRROR_REMEDY) };
    }
    if let Some((problem, remedy)) = evidence.contradiction(given, &poses, matching) {
        let in_order = (matching == Matching::Time).then(|| poses_in_order(scans, pairs, given)).flatten();
        return in_order.map_or_else(
            || refuse(problem.clone(), &remedy),
            |poses| {
                let taken = "It was taken in the order of the scans, for it has a pose for each";
                let notes = vec![format!("{name}: {problem}. {taken}. {remedy}.")];
                CheckedOdometry { poses, notes, ..CheckedOdometry::default() }
            },
        );
    }
    let goes_on = matching == Matching::Number && !has_numbers_of(scans.all, given);
    if poses.iter().all(Option::is_none) || (goes_on && !evidence.confirms(&poses)) {
        let (problem, remedy) = no_scan(scans.all, given);
        return refuse(problem, &remedy);
    }
    let notes = notes_on(name, scans.all, given, &poses, matching, goes_on);
    CheckedOdometry { poses, notes, ..CheckedOdometry::default() }
}

/// What is worth knowing of odometry that is used: how it was matched with the scans, and its gaps.
fn notes_on(
    name: &str,
    scans: &[RecordedScan],
    given: &Trajectory,
    poses: &[Option<Pose2>],
    matching: Matching,
    goes_on: bool,
) -> Vec<String> {
    let mut notes = Vec::new();
    if matching == Matching::Order && given.stamps.is_some() && scans.iter().all(|scan| scan.time.is_some()) {
        let what = "are not those of the scans, so it was taken in their order, for it has a pose for each";
        notes.push(format!("The times of {name} {what}."));
    }
    if goes_on {
        let (num_poses, num_scans) = (given.len(), scans.len());
        notes.push(format!("{name} has {num_poses} poses, and there are {num_scans} scans: it goes on after them."));
    }
    if let Some(first) = poses.iter().position(Option::is_none) {
        let missing = poses.iter().filter(|pose| pose.is_none()).count();
        notes.push(format!(
            "{name} has gaps: {missing} of {} scans have no pose in it, scan {first} first; they are placed by what they saw \
             alone. If they are to have odometry, complete the file.",
            poses.len()
        ));
    }
    notes
}

/// Why the scans are the mirror image of what the poses in their log tell, or why these are not the odometry of the scans; `None`
/// each where that is not so.
#[inline(never)]
pub fn check_log(scans: &RecordedScans, pairs: &[ScanPair]) -> (Option<String>, Option<String>) {
    let poses: Vec<Option<Pose2>> = scans.all.iter().map(|scan| scan.odometry).collect();
    if poses.iter().all(Option::is_none) {
        return (None, None);
    }
    let evidence = Evidence::new(scans, pairs, &poses);
    let mirrored = evidence.mirror(&poses).map(|what| format!("The poses in the log are {what}. {MIRROR_REMEDY}."));
    let count = evidence.of_poses(&poses);
    let contradiction = evidence.refutes(&count).then(|| {
        format!(
            "The odometry contradicts the scans in {} of {} places compared and was left out. Check that it belongs to this log, is \
             in metres and radians, and has the log's clock.",
            evidence.pairs.len() - count.num_agreeing,
            evidence.pairs.len()
        )
    });
    (mirrored, contradiction)
}

/// The odometry as one pose for each scan in turn, where the scans confirm that.
fn poses_in_order(scans: &RecordedScans, pairs: &[ScanPair], given: &Trajectory) -> Option<Vec<Option<Pose2>>> {
    let poses: Vec<Option<Pose2>> = planar_poses(given).into_iter().map(Some).collect();
    let is_confirmed = poses.len() == scans.all.len() && Evidence::new(scans, pairs, &poses).confirms(&poses);
    is_confirmed.then_some(poses)
}

/// Whether the numbers of odometry can be those of the scans: it may lack some, but none is beyond the last.
fn has_numbers_of(scans: &[RecordedScan], given: &Trajectory) -> bool {
    let last = scans.iter().map(|scan| scan.index).max().unwrap_or(0);
    match given.numbers.as_ref().or(given.stamps.as_ref()) {
        Some(numbers) => numbers.iter().all(|&number| number <= last as f64),
        None => given.len() == last + 1,
    }
}

/// Why odometry names none of the scans, and the remedy.
fn no_scan(scans: &[RecordedScan], given: &Trajectory) -> (String, String) {
    let times: Vec<f64> = scans.iter().filter_map(|scan| scan.time).collect();
    let remedy =
        "Give the odometry of this log: rows of id x y theta that count its scans from 0, or TUM with its times";
    if let (Some(stamps), Some(&begin)) = (&given.stamps, times.first()) {
        let (first, last) = (stamps[0], stamps[stamps.len() - 1]);
        let end = times[times.len() - 1];
        let problem =
            format!("Its times ({first:.3} to {last:.3} s) are not those of the scans ({begin:.3} to {end:.3} s)");
        let alike = ((last - first) / (end - begin) - 1.0).abs() < 0.2;
        let offset = format!("If both began together, its clock is off: add {:.3} s to its times", begin - first);
        return (problem, if alike { offset } else { remedy.to_owned() });
    }
    let problem = format!("It has {} poses, and there are {} scans: this is another log's", given.len(), scans.len());
    (problem, remedy.to_owned())
}

/// How likely the scans are by one reading.
struct Support {
    /// For each pair the logarithm of the likelihood of its motion, by that of a wrong step.
    log_likelihoods: Vec<f64>,
    /// Pairs whose motion is likelier by this reading than as a wrong step.
    num_agreeing: usize,
}

impl Support {
    fn mean(&self) -> f64 {
        self.log_likelihoods.iter().sum::<f64>() / self.log_likelihoods.len().max(1) as f64
    }
}

/// Another reading of the odometry.
struct Reading {
    support: Support,
    problem: String,
    remedy: String,
}

/// A pair of scans and the motions between them by the scans alone.
struct Registered {
    first: usize,
    second: usize,
    /// The motion by the odometry as it is given.
    given: Pose2,
    motions: Vec<(Pose2, Matrix3<f64>)>,
}

impl Registered {
    /// The logarithm of the likelihood of the motion where this is measured, by that of a wrong step.
    fn log_ratio(&self, measured: Option<Pose2>) -> f64 {
        let noise = MotionNoise::default();
        let Some(measured) = measured else { return f64::NEG_INFINITY };
        let ratios = self.motions.iter().map(|known| noise.log_likelihood_ratio(&[measured], known));
        ratios.fold(f64::NEG_INFINITY, f64::max)
    }
}

/// The same for a step that may be wrong.
pub(super) fn log_likelihood(log_ratio: f64) -> f64 {
    (WRONG_SHARE + (1.0 - WRONG_SHARE) * log_ratio.exp()).ln()
}

/// What pairs of scans tell of their motions.
struct Evidence<'a> {
    scans: &'a [RecordedScan],
    pairs: Vec<Registered>,
}

impl<'a> Evidence<'a> {
    fn new(scans: &RecordedScans<'a>, pairs: &[ScanPair], poses: &[Option<Pose2>]) -> Self {
        let options = scans.settings.odometry_options();
        let registered = |pair: &ScanPair| {
            let (first, second) = (pair.first, pair.second);
            let given = motion(scans.all, first, second, |scan| poses[scan])?;
            let motions = pair.registrations(given, &options);
            (!motions.is_empty()).then_some(Registered { first, second, given, motions })
        };
        let pairs = pairs.iter().filter_map(registered).collect();
        Self { scans: scans.all, pairs }
    }

    /// How likely the motions of all pairs are by what a reading gives for them.
    fn support(&self, reading: impl Fn(&Registered) -> Option<Pose2>) -> Support {
        let ratios: Vec<f64> = self.pairs.iter().map(|pair| pair.log_ratio(reading(pair))).collect();
        Support {
            log_likelihoods: ratios.iter().copied().map(log_likelihood).collect(),
            num_agreeing: ratios.iter().filter(|&&ratio| ratio > 0.0).count(),
        }
    }

    /// The mean logarithm of the likelihood of the pairs' motions by those that the odometry gives for other pairs: what another
    /// log's odometry has.
    fn by_chance(&self) -> f64 {
        let count = self.pairs.len();
        let others = |pair: usize| (1..count).map(move |apart| (pair, (pair + apart) % count));
        let all = (0..count).flat_map(others);
        let of =
            |(pair, other): (usize, usize)| log_likelihood(self.pairs[pair].log_ratio(Some(self.pairs[other].given)));
        all.map(of).sum::<f64>() / (count * count.saturating_sub(1)).max(1) as f64
    }

    /// The same of poses of the robot.
    fn by(&self, pose: impl Fn(usize) -> Option<Pose2>) -> Support {
        self.support(|pair| motion(self.scans, pair.first, pair.second, &pose))
    }

    fn of_poses(&self, poses: &[Option<Pose2>]) -> Support {
        self.by(|scan| poses[scan])
    }

    /// Whether another reading is likely, and likelier than the one at hand: in all, and in most pairs that tell the two apart.
    fn prefers(&self, other: &Support, given: &Support) -> bool {
        let gains = other.log_likelihoods.iter().zip(&given.log_likelihoods).map(|(other, given)| other - given);
        let (mut in_all, mut num_better, mut num_worse) = (0.0, 0, 0);
        for gain in gains {
            in_all += gain;
            num_better += usize::from(gain > TEN_TIMES);
            num_worse += usize::from(gain < -TEN_TIMES);
        }
        let is_likely = self.pairs.len() >= MIN_PAIRS && other.mean() > TEN_TIMES;
        is_likely && in_all > MIN_PAIRS as f64 * TEN_TIMES && num_better >= BETTER_TO_WORSE * num_worse
    }

    /// Whether the scans tell another motion: it is unlikely, or hardly likelier than by chance while more is wrong than is usual.
    fn refutes(&self, given: &Support) -> bool {
        let is_usual = given.num_agreeing as f64 >= (1.0 - 2.0 * WRONG_SHARE) * self.pairs.len() as f64;
        let is_unlikely = || given.mean() < TEN_TIMES || (!is_usual && given.mean() < self.by_chance() + BEYOND_CHANCE);
        self.pairs.len() >= MIN_PAIRS && is_unlikely()
    }

    /// Whether the scans tell the motion that these poses give.
    fn confirms(&self, poses: &[Option<Pose2>]) -> bool {
        self.pairs.len() >= MIN_PAIRS && !self.refutes(&self.of_poses(poses))
    }

    /// How many motions agree with one reading and with another, in words.
    fn figures(&self, other: &Support, given: &Support) -> String {
        let (other, given, all) = (other.num_agreeing, given.num_agreeing, self.pairs.len());
        format!("{other} of {all} motions between scans agree with it then, and {given} as it is")
    }

    /// How far these poses are the mirror image of the scans, to follow "is"; `None` where they are not. A laser that turns the other
    /// way than its readings were taken shows every motion mirrored at the axis that points ahead.
    fn mirror(&self, poses: &[Option<Pose2>]) -> Option<String> {
        let mirrored = self.support(|pair| {
            let motion = motion(self.scans, pair.first, pair.second, |scan| poses[scan])?;
            Some(Pose2::new([motion.translation.x, -motion.translation.y].into(), -motion.rotation.angle()))
        });
        let given = self.of_poses(poses);
        self.prefers(&mirrored, &given)
            .then(|| format!("the mirror image of what the scans saw: mirrored, {}", self.figures(&mirrored, &given)))
    }

    /// What speaks against the odometry as it is, and what would mend it.
    fn contradiction(
        &self,
        given: &Trajectory,
        poses: &[Option<Pose2>],
        matching: Matching,
    ) -> Option<(String, String)> {
        let as_given = self.of_poses(poses);
        let mut readings = self.other_units(given);
        if matching == Matching::Time {
            readings.extend(self.other_clock(given));
        }
        // Of readings that are as good, the plainest, which comes first.
        let better = |best: Reading, next: Reading| {
            if next.support.mean() > best.support.mean() + AS_GOOD { next } else { best }
        };
        let best = readings.into_iter().reduce(better).filter(|best| self.prefers(&best.support, &as_given));
        if let Some(Reading { support, problem, remedy }) = best {
            return Some((format!("{problem}: {}", self.figures(&support, &as_given)), remedy));
        }
        self.refutes(&as_given).then(|| {
            let problem = format!(
                "It is not what the scans saw: its motion ({:.2} m from scan to scan, median) agrees with {} of {} motions between \
                 scans",
                median_step(poses),
                as_given.num_agreeing,
                self.pairs.len()
            );
            (problem, "Give the odometry of this log, in metres and radians, x ahead and y to the left".to_owned())
        })
    }

    fn other_units(&self, given: &Trajectory) -> Vec<Reading> {
        let reading = |in_degrees: bool, (scale, positions): (f64, &str)| {
            let (poses, _) = match_odometry(self.scans, &in_other_units(given, in_degrees, scale)?);
            let (problem, remedy) = match (in_degrees, scale == 1.0) {
                (true, true) => ("Its headings are degrees".to_owned(), "Give them in radians"),
                (true, false) => {
                    (format!("Its headings are degrees and its positions {positions}"), "Give radians and metres")
                }
                _ => (format!("Its positions are {positions}"), "Give them in metres"),
            };
            Some(Reading { support: self.of_poses(&poses), problem, remedy: remedy.to_owned() })
        };
        let metres = reading(true, (1.0, "metres"));
        let readings = POSITION_UNITS.iter().flat_map(|&unit| [reading(false, unit), reading(true, unit)]);
        std::iter::once(metres).chain(readings).flatten().collect()
    }

    /// The offset of the clock that makes the scans most likely, where it is one.
    fn other_clock(&self, given: &Trajectory) -> Option<Reading> {
        let poses = planar_poses(given);
        let timed = TimedPoses::new(given, &poses)?;
        let steps = (MAX_CLOCK_OFFSET / CLOCK_STEP) as i32;
        let tried = (-steps..=steps).map(|step| {
            let offset = f64::from(step) * CLOCK_STEP;
            (self.by(|scan| timed.at(self.scans[scan].time? - offset)), offset)
        });
        let (support, offset) =
            tried.max_by(|a, b| a.0.mean().total_cmp(&b.0.mean()).then(b.1.abs().total_cmp(&a.1.abs())))?;
        (offset.abs() >= MIN_CLOCK_OFFSET).then(|| Reading {
            support,
            problem: format!("Its clock is {} s {}", offset.abs(), if offset > 0.0 { "behind" } else { "ahead" }),
            remedy: format!("Add {offset} s to its times"),
        })
    }
}

/// Motion of the laser between two scans, by the poses of the robot.
fn motion(scans: &[RecordedScan], first: usize, second: usize, pose: impl Fn(usize) -> Option<Pose2>) -> Option<Pose2> {
    let T_world_first = pose(first)? * scans[first].T_robot_laser;
    Some(T_world_first.inverse() * pose(second)? * scans[second].T_robot_laser)
}

/// Median distance of the robot from scan to scan (m).
fn median_step(poses: &[Option<Pose2>]) -> f64 {
    let step = |pair: &[Option<Pose2>]| Some((pair[1]?.translation.vector - pair[0]?.translation.vector).norm());
    let mut steps: Vec<f64> = poses.windows(2).filter_map(step).collect();
    quantile(&mut steps, 0.5).unwrap_or(0.0)
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
