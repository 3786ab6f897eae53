//! Whether odometry is that of the scans, in metres and radians and by their clock: told before anything is placed.
//!
//! Two scans and the motion between them agree as far as the returns of one, moved, lie at the ranges of the other. Pairs
//! of scans that do not agree without any motion tell which reading of the odometry is right: as it is, or with another
//! unit or another clock. Odometry that only another reading makes agree is not used, and the reading is named.

mod evidence;

use self::evidence::{Evidence, turn_of};
use super::recorded_scan::{Matching, RecordedScan, match_odometry, planar_poses};
use crate::geometry::Pose2;
use crate::io::trajectory::Trajectory;

/// What to do about scans that are the mirror image of what odometry tells.
const MIRROR_REMEDY: &str = "If the laser turns clockwise or hangs upside down, set laser_direction=mirrored; if the odometry counts \
                             y to the right, give y to the left and headings counter-clockwise";

/// What odometry that is turned against the scans means, and how to have it otherwise.
const TURN_REMEDY: &str = "The laser does not look along the robot's x axis, or the odometry's headings count from another axis; if \
                           neither is so, it is of another log: do without it";

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

/// Finds each scan's odometry and judges it. Ranges from `limit` (m) on count as no return.
#[inline(never)]
pub fn check_odometry(name: &str, scans: &[RecordedScan], given: &Trajectory, limit: f64) -> CheckedOdometry {
    let (poses, matching) = match_odometry(scans, given);
    let found = poses.iter().flatten().count();
    let refuse = |problem: String, remedy: &str| CheckedOdometry {
        poses: vec![None; scans.len()],
        refusal: Some(format!("{name}: {problem}. {remedy}. It was not used.")),
        ..CheckedOdometry::default()
    };
    let evidence = Evidence::new(scans, &poses, limit);
    if let Some(mirror) = evidence.mirror(scans, |scan| poses[scan]) {
        let problem = format!("It is {mirror}");
        return CheckedOdometry { mirrored: Some(problem.clone()), ..refuse(problem, MIRROR_REMEDY) };
    }
    if let Some((turn, figures)) = evidence.turn(scans, &poses) {
        let poses: Vec<Option<Pose2>> = poses.iter().map(|pose| Some((*pose)? * turn_of(turn))).collect();
        let mut notes = notes_on(name, scans, given, &poses, matching, false);
        notes.push(format!("{name}: {figures}. It was used turned so. {TURN_REMEDY}."));
        return CheckedOdometry { poses, notes, ..CheckedOdometry::default() };
    }
    if let Some((problem, remedy)) = evidence.contradiction(scans, given, &poses, matching) {
        let in_order = (matching == Matching::Time).then(|| poses_in_order(scans, given, limit)).flatten();
        return in_order.map_or_else(
            || refuse(problem.clone(), &remedy),
            |poses| {
                let taken = "It was taken in the order of the scans, for it has a pose for each";
                let notes = vec![format!("{name}: {problem}. {taken}. {remedy}.")];
                CheckedOdometry { poses, notes, ..CheckedOdometry::default() }
            },
        );
    }
    let is_doubted = matching == Matching::Number && !has_numbers_of(scans, given);
    if found == 0 || (is_doubted && !evidence.confirms(scans, &poses)) {
        let (problem, remedy) = no_scan(scans, given);
        return refuse(problem, &remedy);
    }
    let notes = notes_on(name, scans, given, &poses, matching, is_doubted);
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
        notes.push(format!(
            "{name} has {} poses, and there are {} scans: it goes on after them.",
            given.len(),
            scans.len()
        ));
    }
    if let Some(first) = poses.iter().position(Option::is_none) {
        let missing = poses.iter().filter(|pose| pose.is_none()).count();
        notes.push(format!(
            "{name} has gaps: {missing} of {} scans have no pose in it, scan {first} first; they are placed by what they saw, \
             and in a short gap by a share of the motion across it. If they are to have odometry of their own, complete the file.",
            poses.len()
        ));
    }
    notes
}

/// Why the scans are the mirror image of what the poses in their log tell; `None` where they are not, or where that is not known.
/// Ranges from `limit` (m) on count as no return.
pub fn mirror_of_log(scans: &[RecordedScan], limit: f64) -> Option<String> {
    let poses: Vec<Option<Pose2>> = scans.iter().map(|scan| scan.odometry).collect();
    let evidence = Evidence::new(scans, &poses, limit);
    let mirror = evidence.mirror(scans, |scan| poses[scan])?;
    Some(format!("The poses in the log are {mirror}. {MIRROR_REMEDY}."))
}

/// The odometry as one pose for each scan in turn, where the scans confirm that.
fn poses_in_order(scans: &[RecordedScan], given: &Trajectory, limit: f64) -> Option<Vec<Option<Pose2>>> {
    let poses: Vec<Option<Pose2>> = planar_poses(given).into_iter().map(Some).collect();
    let is_confirmed = poses.len() == scans.len() && Evidence::new(scans, &poses, limit).confirms(scans, &poses);
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
