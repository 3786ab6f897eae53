//! Scans of one laser: logs of robots with several hold the others' scans between them.

use super::fields::are_exceptions;
use super::{LaserScan, SAME_OFFSET};
use crate::geometry::{Pose2, RigidMotion};

/// Scans of several lasers alternate: a laser that was set up anew changes once or twice.
const MIN_CHANGES: usize = 5;
/// Scans of one laser may differ by this share of their beams, or by two of them: 180 and 181 are one laser's.
const SAME_BEAMS: f64 = 0.1;
/// Scans of one laser begin at the same angle within this number of their steps.
const SAME_START: f64 = 3.0;
/// More kinds of scans than these are one laser that varies.
const MOST_LASERS: usize = 4;

/// Which scans are those of one laser, where the log mixes several, and what to say of the others.
#[inline(never)]
pub(super) fn one_laser(scans: &[LaserScan], T_robot_laser: &[Option<Pose2>]) -> Option<(Vec<bool>, String)> {
    let layouts = groups(scans.len(), |a, b| has_same_layout(&scans[a], &scans[b]));
    if is_mixed(&layouts) {
        let count = |group: usize| layouts.iter().filter(|&&other| other == group).count();
        // Of as many scans, the laser that the log begins with.
        let kept = (0..=layouts.iter().copied().max()?).max_by_key(|&group| (count(group), usize::MAX - group))?;
        let num_beams = layouts.iter().position(|&group| group == kept).map_or(0, |scan| scans[scan].ranges.len());
        return Some(keep(&layouts, kept, &format!("those with about {num_beams} readings")));
    }
    // The robot's and the laser's poses tell where each laser sits, if nobody corrected one of the two.
    let offsets: Vec<Pose2> = T_robot_laser.iter().copied().collect::<Option<_>>()?;
    let mounts = groups(offsets.len(), |a, b| is_same_offset(&offsets[a], &offsets[b]));
    let front = |a: &&Pose2, b: &&Pose2| {
        let key = |offset: &Pose2| (offset.rotation_angle() / SAME_OFFSET).round();
        key(a).total_cmp(&key(b)).then(b.translation.x.total_cmp(&a.translation.x))
    };
    let first = offsets.iter().min_by(front)?;
    let kept = mounts[offsets.iter().position(|offset| offset == first)?];
    is_mixed(&mounts).then(|| keep(&mounts, kept, "the front one's"))
}

/// Whether two poses of a laser on its robot are the same but for the digits that were written.
pub(super) fn is_same_offset(a: &Pose2, b: &Pose2) -> bool {
    let difference = a.inverse() * b;
    difference.translation_norm() < SAME_OFFSET && difference.rotation_angle() < SAME_OFFSET
}

fn keep(groups: &[usize], kept: usize, which: &str) -> (Vec<bool>, String) {
    let is_kept: Vec<bool> = groups.iter().map(|&group| group == kept).collect();
    let others = is_kept.iter().filter(|&&is_kept| !is_kept).count();
    let note = format!(
        "The log mixes the scans of several lasers: {others} of {} were left out and {which} were kept. To use the others, \
         give each laser a log of its own.",
        groups.len()
    );
    (is_kept, note)
}

/// The group of each of `count` things: that of the first thing before it that is alike.
fn groups(count: usize, is_alike: impl Fn(usize, usize) -> bool) -> Vec<usize> {
    let mut first_of: Vec<usize> = Vec::new();
    let group = |thing: usize| {
        let found = first_of.iter().position(|&first| is_alike(first, thing));
        found.unwrap_or_else(|| {
            // Beyond what can be lasers, all are of one last group.
            if first_of.len() <= MOST_LASERS {
                first_of.push(thing);
            }
            first_of.len() - 1
        })
    };
    (0..count).map(group).collect()
}

fn is_mixed(groups: &[usize]) -> bool {
    let num_groups = groups.iter().copied().max().map_or(0, |last| last + 1);
    // Few scans are odd ones of another laser.
    let is_odd = |group: usize| are_exceptions(groups.iter().filter(|&&other| other == group).count(), groups.len());
    let changes = groups.windows(2).filter(|pair| pair[0] != pair[1]).count();
    (2..=MOST_LASERS).contains(&num_groups) && changes >= MIN_CHANGES && !(0..num_groups).any(is_odd)
}

fn has_same_layout(a: &LaserScan, b: &LaserScan) -> bool {
    let (beams, others) = (a.ranges.len() as f64, b.ranges.len() as f64);
    let step = (a.bearings.of(1) - a.bearings.of(0)).abs();
    let starts_apart = (a.bearings.of(0) - b.bearings.of(0)).abs();
    // Without angles (NaN) the number of beams decides.
    let starts_elsewhere = starts_apart > SAME_START * step;
    (beams - others).abs() <= (SAME_BEAMS * beams.max(others)).max(2.0) && !starts_elsewhere
}
