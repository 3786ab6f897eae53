//! Scores localisation in a map: `cargo measure localize wean|halves|others|merged|worlds [ARGUMENT]...`
//!
//! - `wean --map FILE`: CMU's map (unpacked) and log: from `--starts N` places of the log, where and after how many scans the robot is
//!   found, and whether all runs agree with the one from the first scan; `--out FILE` writes that one's trajectory;
//!   `--particles N,N` beside it particle filters from the same places, with `--seeds N`; `--along` alone: what the scans score at
//!   their places and at places moved along the corridor;
//! - `halves`: each half of a log in the grid of the other half, by the poses in the log: every other scan, and with `--time` the first half
//!   and the second; `--only NAME`, `--alone` without odometry, `--starts N`, `--scans N` from each, `--particles N,N` as above;
//! - `others`: each log in the grids of the other buildings, 30 pairs, or all in CMU's map with `--map FILE`; `--scans N` of each log;
//! - `merged`: two recordings in one reconstruction: halves of a log as in `halves`, and each log with that of another building; `--alone`
//!   without odometry; the pieces of 20 scans and more, and whether pairs of scans across are right;
//! - `worlds`: generated buildings with known poses: the share of poses in their 95 % region.
//!
//! A place is wrong when it is off by more than 0.5 m or 5 degrees.

mod building;
mod logs;
mod merged;
mod particles;
mod wean;
mod worlds;

use std::time::Instant;

use nalgebra::{Matrix3, Vector3};
use scanstitch::geometry::Pose2;
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::localization::Verdict;
use scanstitch::pipeline::planar::{Localization, LocatedPose};

use crate::arguments::{argument, arguments};

pub fn main() {
    match arguments().first().map_or("", String::as_str) {
        "wean" => wean::main(),
        "halves" => logs::halves(),
        "others" => logs::others(),
        "merged" => merged::main(),
        "worlds" => worlds::main(),
        other => println!("there is no part {other:?}: wean, halves, others, merged, worlds"),
    }
}

/// The number after this word.
fn number(name: &str, default: usize) -> usize {
    argument(name).map_or(default, |text| text.parse().expect("a number"))
}

/// How many runs found the robot, after how many scans, and how many were certain of a wrong place.
#[derive(Default)]
struct Table {
    num_runs: usize,
    after: Vec<usize>,
    num_wrong: usize,
}

impl Table {
    const HEADER: &str = "| | found | after scans (median) | runs with a certain wrong place |\n|---|---|---|---|";

    fn add(&mut self, after: Option<usize>, num_wrong: usize) {
        self.num_runs += 1;
        self.after.extend(after);
        self.num_wrong += usize::from(num_wrong > 0);
    }

    fn row(mut self, name: &str) -> String {
        self.after.sort_unstable();
        let median = self.after.get(self.after.len() / 2).map_or("-".to_owned(), usize::to_string);
        let Self { num_runs, after, num_wrong } = self;
        format!("| {name} | {} of {num_runs} | {median} | {num_wrong} |", after.len())
    }
}

/// What a run came to.
#[derive(Default)]
struct Score {
    num: usize,
    good: usize,
    /// Good ones that are wrong, ...
    wrong: usize,
    /// ... by as much (m), ...
    worst: f64,
    /// ... of which so many are not in their 99.9 % region, ...
    unexpected: usize,
    /// ... and good ones in their 95 % region.
    inside: usize,
    found: Option<usize>,
    verdict: Option<Verdict>,
    /// Milliseconds up to the first certain place, in the mean a scan after it, and the longest of those.
    times: [f64; 3],
}

impl Score {
    fn print(&self, name: &str) {
        let Self { num, good, wrong, worst, unexpected, inside, found, verdict, times: [start, mean, longest] } = self;
        let verdict = verdict.map_or_else(String::new, |verdict| format!("{verdict:?}, "));
        let share = 100.0 * *inside as f64 / (*good).max(1) as f64;
        println!(
            "{name}: {verdict}{good} of {num} good, {wrong} wrong (by {worst:.2} m, {unexpected} not in 99.9 %), {share:.1} % in \
             95 %; found after {found:?}; start \
             {start:.0} ms, then {mean:.2} ms a scan, longest {longest:.0} ms"
        );
    }

    fn add(&mut self, other: &Self) {
        self.num += other.num;
        self.good += other.good;
        self.wrong += other.wrong;
        self.worst = self.worst.max(other.worst);
        self.unexpected += other.unexpected;
        self.inside += other.inside;
    }
}

/// Locates all scans; their places against the true one of each frame, where that is known.
fn run(localization: &mut Localization, truth: impl Fn(usize) -> Option<Pose2>) -> Score {
    let mut score = Score::default();
    let mut num_after = 0;
    let mut more = true;
    while more {
        let started = Instant::now();
        more = localization.step();
        let time = 1e3 * started.elapsed().as_secs_f64();
        if score.found.is_some() {
            num_after += 1;
            score.times = [score.times[0], score.times[1] + time, score.times[2].max(time)];
        } else {
            score.times[0] += time;
            let is_good = localization.locations().last().is_some_and(|location| location.status == Status::Good);
            score.found = is_good.then(|| localization.locations().len());
        }
    }
    score.times[1] /= f64::from(num_after.max(1));
    let result = localization.result();
    score.verdict = Some(result.verdict);
    score.num = result.scans.len();
    for (frame, scan) in result.scans.iter().enumerate().filter(|(_, scan)| scan.status == Status::Good) {
        score.good += 1;
        let Some((place, truth)) = scan.place.zip(truth(frame)) else { continue };
        let off = offset(&place, &truth);
        if is_wrong(&off) {
            score.wrong += 1;
            score.worst = score.worst.max(off.xy().norm());
            score.unexpected += usize::from(!is_inside(&place, &off, 16.266));
        }
        score.inside += usize::from(is_inside(&place, &off, 7.815));
    }
    score
}

/// x, y and heading of a place from the true ones.
fn offset(place: &LocatedPose, truth: &Pose2) -> Vector3<f64> {
    let pose = place.T_world_sensor;
    let turn = (truth.rotation.inverse() * nalgebra::UnitComplex::new(pose.theta)).angle();
    Vector3::new(pose.x - truth.translation.x, pose.y - truth.translation.y, turn)
}

fn is_wrong(off: &Vector3<f64>) -> bool {
    off.xy().norm() > 0.5 || off.z.abs() > 5.0_f64.to_radians()
}

/// Whether a place is in a region, by the quantile of chi squared of three degrees of freedom: 7.815 for 95 %, 16.266 for 99.9 %.
fn is_inside(place: &LocatedPose, off: &Vector3<f64>, quantile: f64) -> bool {
    let covariance = Matrix3::from_row_slice(&place.covariance);
    covariance.try_inverse().is_some_and(|information| off.dot(&(information * off)) < quantile)
}
