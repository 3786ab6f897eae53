//! Two recordings in one: halves of a log, which join, and logs of two buildings, which do not.

use scanstitch::geometry::{Pose2, Pose3, RigidMotion};
use scanstitch::io::trajectory::{Trajectory, in_space};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::{Settings, Stage};

use super::building::Building;
use super::logs::buildings;
use crate::arguments::flag;

/// Scans at one place are at most so far apart (m), as in the relations `NAME.places.txt`.
const AT_ONE_PLACE: f64 = 2.0;
/// Scans further apart than this (m) are not compared.
const NEAR: f64 = 20.0;
/// A pair is wrong when it is off by more than this (m, rad).
const WRONG: (f64, f64) = (0.5, 0.087);

pub fn main() {
    let all = buildings();
    for building in &all {
        let num = building.log.scans.len();
        let halves = [building.part(0..num / 2), building.part(num / 2..num)];
        let every_other = [building.part((0..num).step_by(2)), building.part((1..num).step_by(2))];
        for (how, [first, second]) in [("first and second half", &halves), ("every other scan", &every_other)] {
            report(&format!("{}, {how}", building.name), first, second, true);
        }
    }
    for (index, first) in all.iter().enumerate() {
        let second = &all[(index + 1) % all.len()];
        report(&format!("{} and {}", first.name, second.name), first, second, false);
    }
}

fn report(name: &str, first: &Building, second: &Building, is_one_building: bool) {
    let (frames, changes) = reconstructed([first, second]);
    let count = frames.iter().map(|frame| frame.piece).max().map_or(0, |last| last + 1);
    let mut of_both = vec![[0; 2]; count];
    for (number, frame) in frames.iter().enumerate() {
        of_both[frame.piece][usize::from(number >= first.log.scans.len())] += 1;
    }
    let sizes: Vec<String> =
        of_both.iter().filter(|of| of[0] + of[1] >= 20).map(|of| format!("{} + {}", of[0], of[1])).collect();
    let (of_first, of_second) = frames.split_at(first.log.scans.len());
    let across = pairs((of_first, first), (of_second, second));
    let told = if is_one_building {
        let mut within = pairs((of_first, first), (of_first, first));
        within.extend(pairs((of_second, second), (of_second, second)));
        let [places, near] = [AT_ONE_PLACE, NEAR].map(|limit| {
            format!("up to {limit} m apart {} across, {} within one", share(&across, limit), share(&within, limit))
        });
        format!("pairs that are wrong: {places}; {near}")
    } else {
        format!("{} pairs across", across.len())
    };
    println!("{name}: pieces {}; {told}; {changes} changes", sizes.join(", "));
}

struct Pair {
    /// How far apart the scans were taken (m).
    distance: f64,
    is_wrong: bool,
}

/// How many of the pairs at most so far apart (m) are wrong.
fn share(pairs: &[Pair], limit: f64) -> String {
    let num = pairs.iter().filter(|pair| pair.distance < limit).count();
    let num_wrong = pairs.iter().filter(|pair| pair.distance < limit && pair.is_wrong).count();
    format!("{num_wrong} of {num} ({:.1} %)", 100.0 * num_wrong as f64 / num.max(1) as f64)
}

struct Frame {
    pose: Pose2,
    piece: usize,
    is_good: bool,
}

/// The frames, and how many things are new or gone in the second recording.
fn reconstructed(both: [&Building; 2]) -> (Vec<Frame>, usize) {
    let odometry = if flag("--alone") { "none" } else { "auto" };
    let settings: Settings = serde_json::from_value(serde_json::json!({ "odometry": odometry })).expect("settings");
    let mut reconstruction = Reconstruction::new(settings).expect("the settings are right");
    for building in both {
        // Without times nothing says that one goes on with the other.
        let mut log = building.log.clone();
        log.scans.iter_mut().for_each(|scan| scan.time = None);
        reconstruction.add_log(building.name, &log);
    }
    if !flag("--alone") {
        // Each recording has its own world.
        let poses: Vec<Pose3> = both
            .iter()
            .flat_map(|building| {
                building.odometry.iter().map(|pose| in_space(&(building.odometry[0].inverse() * pose)))
            })
            .collect();
        reconstruction.set_odometry("odometry", Trajectory::from_poses(&poses)).expect("it has headings");
    }
    while reconstruction.step().stage != Stage::Done {}
    let frames = reconstruction.result().frames.into_iter().zip(reconstruction.poses());
    let num_changes = reconstruction.changes().iter().map(|recording| recording.changes.len()).sum();
    let frames = frames.map(|(frame, pose)| Frame { pose, piece: frame.piece, is_good: frame.status == Status::Good });
    (frames.collect(), num_changes)
}

/// The pairs of good frames of two recordings (or of one) in one piece that are near each other in truth.
fn pairs((from, first): (&[Frame], &Building), (to, second): (&[Frame], &Building)) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (from, T_truth_from) in from.iter().zip(&first.reference).filter(|(frame, _)| frame.is_good) {
        let is_known = |frame: &Frame| frame.is_good && frame.piece == from.piece;
        for (to, T_truth_to) in to.iter().zip(&second.reference).filter(|(frame, _)| is_known(frame)) {
            let truth = T_truth_from.inverse() * T_truth_to;
            let distance = truth.translation_norm();
            if distance < NEAR || first.name != second.name {
                let off = truth.inverse() * (from.pose.inverse() * to.pose);
                let is_wrong = off.translation_norm() > WRONG.0 || off.rotation_angle() > WRONG.1;
                pairs.push(Pair { distance, is_wrong });
            }
        }
    }
    pairs
}
