//! Measured motion and what the scans make of it: the counterparts that its noise follows from, and whether the poses in a recording
//! are the wheels' own.

use super::pairs::{COMPARED, known, register_alone, register_pair};
use crate::geometry::quantile::MIN_SAMPLE;
use crate::geometry::{Pose2, RigidMotion};
use crate::graph::loops::planar::MAX_COMPARED_RANGE;
use crate::io::laser_log::OdometryOrigin;
use crate::odometry::assessment::Status;
use crate::odometry::planar::assess::{GOOD_AGREEMENT, MIN_OVERLAP, MIN_POINTS};
use crate::odometry::planar::hypothesis::{Hypothesis, fits_as_well};
use crate::odometry::planar::information::CERTAIN_SIGMA;
use crate::odometry::planar::motion_noise::{Counterpart, EXPECTED_WRONG};
use crate::odometry::planar::{MIN_RIVAL_DISTANCE, PlanarOptions, is_other_place};
use crate::pipeline::recorded_scan::RecordedScans;

/// A stretch is as many steps as it takes to go this far (m) or to turn to another place. With 0.6 m the loops of fr079 stay open with
/// `wheels_stop`, and 11.7 % of its pairs are wrong.
const STRETCH: f64 = 0.5;
/// Motions near the border of the search, where a registration is pulled to its inside, are not compared where there are others: this share of
/// its half width is left. With all of it, 11.7 % of the pairs of fr079 with `wheels_stop` are wrong (none).
const INSIDE: f64 = 0.8;

/// Stretches spread over the way, each with what a registration from scans alone makes of it, where that is sure.
pub(super) fn counterparts(motions: &[Option<Pose2>], scans: &RecordedScans) -> Vec<Counterpart> {
    let options = scans.settings.odometry_options();
    let all = stretches(motions);
    // A search about no motion at all finds only small ones; where most are said to be large, that is what is in question.
    let is_inside = |(_, steps): &&(usize, Vec<Pose2>)| {
        let measured = sum(steps);
        measured.translation_norm() < INSIDE * options.search.translation
            && measured.rotation_angle() < INSIDE * options.search.rotation
    };
    let inside: Vec<_> = all.iter().filter(is_inside).cloned().collect();
    let stretches = if 4 * inside.len() > all.len() { inside } else { all };
    let stride = stretches.len().div_ceil(COMPARED).max(1);
    let stretches = stretches.into_iter().step_by(stride);
    stretches.filter_map(|(from, steps)| counterpart(from, steps, scans, &options)).collect()
}

/// A stretch from a frame on, and the motion between its ends where the scans tell it for sure. Where they fit about as well at the
/// measured motion, it is what they tell: a place that repeats itself contradicts nothing.
fn counterpart(from: usize, steps: Vec<Pose2>, scans: &RecordedScans, options: &PlanarOptions) -> Option<Counterpart> {
    let (target, source) = (scans.cleaned(from), scans.cleaned(from + steps.len()));
    let at_measured = register_pair(&target, &source, sum(&steps), options).0;
    let best = Some(register_alone(&target, &source, options).0).filter(|best| best.assessment.status == Status::Good);
    let best = best.filter(|best| !fits_as_well(&at_measured, best, MIN_OVERLAP)).unwrap_or(at_measured);
    (best.assessment.status == Status::Good).then(|| Counterpart { steps, registered: known(&best) })
}

fn sum(steps: &[Pose2]) -> Pose2 {
    steps.iter().fold(Pose2::identity(), |sum, step| sum * step)
}

/// Runs of steps without a gap that go some way: the frame each begins at, and its steps.
fn stretches(motions: &[Option<Pose2>]) -> Vec<(usize, Vec<Pose2>)> {
    let mut stretches = Vec::new();
    let (mut from, mut steps): (usize, Vec<Pose2>) = (0, Vec::new());
    let (mut way, mut turn) = (0.0, 0.0);
    for (frame, motion) in motions.iter().enumerate() {
        if let Some(motion) = motion {
            steps.push(*motion);
            way += motion.translation_norm();
            turn += motion.rotation_angle();
        }
        if motion.is_none() || way > STRETCH || turn > MIN_RIVAL_DISTANCE.rotation {
            if motion.is_some() {
                stretches.push((from, std::mem::take(&mut steps)));
            }
            steps.clear();
            (from, way, turn) = (frame, 0.0, 0.0);
        }
    }
    stretches
}

/// Whether a registration leaves a motion as it is certain to be.
fn is_kept(motion: &Pose2, registered: &Pose2) -> bool {
    let off = motion.inverse() * registered;
    off.rotation_angle() < CERTAIN_SIGMA.0 && off.translation_norm() < CERTAIN_SIGMA.1
}

/// Whether scans fit each other where measured motions put them, all over the way.
#[inline(never)]
pub(super) fn fits_scans(motions: &[Option<Pose2>], scans: &RecordedScans) -> bool {
    let options = scans.settings.odometry_options();
    let stretches = stretches(motions);
    let stride = stretches.len().div_ceil(COMPARED).max(1);
    let fits = |(from, steps): &(usize, Vec<Pose2>)| {
        let measured = sum(steps);
        let Hypothesis { registration, assessment } =
            register_pair(&scans.cleaned(*from), &scans.cleaned(from + steps.len()), measured, &options).0;
        assessment.agreement > GOOD_AGREEMENT && is_kept(&measured, &registration.T_target_source)
    };
    let compared: Vec<bool> = stretches.iter().step_by(stride).map(fits).collect();
    let num_fitting = compared.iter().filter(|&&fits| fits).count();
    compared.len() >= MIN_SAMPLE && num_fitting as f64 >= (1.0 - EXPECTED_WRONG) * compared.len() as f64
}

/// The poses of the robot in the recordings whose poses are the wheels' own, one for each scan, and what is said of each recording.
/// Recordings are judged one by one: one log may have been corrected by a program and another not.
pub(super) fn wheels_in_logs(scans: &RecordedScans) -> (Vec<Option<Pose2>>, Vec<String>) {
    let recordings: Vec<_> = scans.all.chunk_by(|_, next| !next.begins_recording).collect();
    let (mut wheels, mut notes) = (Vec::with_capacity(scans.all.len()), Vec::new());
    for (number, recording) in recordings.iter().enumerate() {
        let (are_wheels, note) = holds_wheels(&RecordedScans { all: recording, ..*scans });
        wheels.extend(recording.iter().map(|scan| scan.odometry.filter(|_| are_wheels)));
        let is_named = recordings.len() > 1;
        notes.extend(note.map(|note| if is_named { format!("Recording {}: {note}", number + 1) } else { note }));
    }
    (wheels, notes)
}

/// Whether the poses in a recording are the wheels' own, and a note where that can be told: wheels drift, so where their path
/// seems to come back to a place, the scans do not fit each other; where a program corrected the poses, they do. Of a path that
/// comes back to too few places, poses that repeat the log's lines of odometry are the wheels'.
#[inline(never)]
fn holds_wheels(scans: &RecordedScans) -> (bool, Option<String>) {
    let poses: Option<Vec<Pose2>> = scans.all.iter().map(|scan| Some(scan.odometry? * scan.T_robot_laser)).collect();
    let Some(poses) = poses else { return (false, None) };
    let are_all = |origin| scans.all.iter().all(|scan| scan.odometry_origin == origin);
    if are_all(OdometryOrigin::Wheels) {
        let note = "The wheels' odometry in the log is used; odometry=none leaves it out.";
        return (true, Some(note.to_owned()));
    }
    let (num_fitting, num_tried) = fitting_revisits(&poses, scans);
    let is_told = num_tried >= MIN_SAMPLE;
    if !is_told && !are_all(OdometryOrigin::RepeatsWheels) {
        let way: f64 = poses.windows(2).map(|pair| (pair[0].inverse() * pair[1]).translation_norm()).sum();
        let note = "The log has poses, and whether they are the wheels' own cannot be told: they come back to too few places. \
                    They are not used; odometry=log uses them.";
        return (false, (way > MAX_COMPARED_RANGE).then(|| note.to_owned()));
    }
    let seen = format!("they fit the scans in {num_fitting} of {num_tried} places where they come back");
    let reason = if is_told { seen } else { "they are those of its lines of odometry".to_owned() };
    let are_wheels = !is_told || 2 * num_fitting < num_tried;
    let note = if are_wheels {
        format!(
            "The poses in the log are the wheels' own ({reason}) and are used as odometry; odometry=none leaves them out."
        )
    } else {
        format!("The poses in the log were corrected by a program ({reason}) and are not used; odometry=log uses them.")
    };
    (are_wheels, Some(note))
}

/// In how many of the places that these poses come back to the scans fit each other, and how many were tried.
fn fitting_revisits(poses: &[Pose2], scans: &RecordedScans) -> (usize, usize) {
    let options = scans.settings.odometry_options();
    let revisits = revisits(poses);
    let stride = revisits.len().div_ceil(COMPARED / 2).max(1);
    let (mut num_fitting, mut num_tried) = (0, 0);
    for (earlier, later) in revisits.into_iter().step_by(stride) {
        let (target, source) = (scans.cleaned(earlier), scans.cleaned(later));
        if target.points.len() < MIN_POINTS || source.points.len() < MIN_POINTS {
            continue;
        }
        let guess = poses[earlier].inverse() * poses[later];
        let Hypothesis { registration, assessment } = register_pair(&target, &source, guess, &options).0;
        num_tried += 1;
        num_fitting += usize::from(assessment.status != Status::Lost && is_kept(&guess, &registration.T_target_source));
    }
    (num_fitting, num_tried)
}

/// Pairs of frames that these poses put at one place after a long way, at most one for every half metre of the path.
#[inline(never)]
fn revisits(poses: &[Pose2]) -> Vec<(usize, usize)> {
    let mut along = vec![0.0; poses.len()];
    for frame in 1..poses.len() {
        along[frame] = along[frame - 1] + (poses[frame - 1].inverse() * poses[frame]).translation_norm();
    }
    let mut chosen: Vec<usize> = Vec::new();
    for frame in 0..poses.len() {
        if chosen.last().is_none_or(|&last| along[frame] - along[last] > STRETCH) {
            chosen.push(frame);
        }
    }
    let near = |earlier: usize, later: usize| {
        let apart = poses[earlier].inverse() * poses[later];
        !is_other_place(&apart)
    };
    let earlier_of = |&later: &usize| {
        let is_revisited =
            |&&earlier: &&usize| along[later] - along[earlier] > MAX_COMPARED_RANGE && near(earlier, later);
        chosen.iter().find(is_revisited).map(|&earlier| (earlier, later))
    };
    chosen.iter().filter_map(earlier_of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PointCloud;
    use crate::pipeline::recorded_scan::RecordedScan;
    use crate::pipeline::settings::Settings;

    fn scan(index: usize, origin: OdometryOrigin) -> RecordedScan {
        RecordedScan {
            index,
            odometry: Some(Pose2::translation(index as f64, 0.0)),
            odometry_origin: origin,
            ..RecordedScan::of_cloud(PointCloud::default())
        }
    }

    /// Which scans have odometry, and the notes.
    fn wheels(all: &[RecordedScan]) -> (Vec<bool>, Vec<String>) {
        let settings = Settings::default();
        let (poses, notes) = wheels_in_logs(&RecordedScans { all, limit: f64::INFINITY, settings: &settings });
        (poses.iter().map(Option::is_some).collect(), notes)
    }

    #[test]
    fn wheels_in_a_log_are_used_where_a_scan_was_left_out_and_in_files_that_continue_each_other() {
        for indices in [[0, 1, 2], [0, 1, 3], [0, 1, 0], [0, 0, 0]] {
            let (are_used, notes) = wheels(&indices.map(|index| scan(index, OdometryOrigin::Wheels)));
            assert!(are_used == [true; 3] && notes.len() == 1, "{indices:?}: {notes:?}");
        }
    }

    #[test]
    fn each_recording_is_judged_by_itself() {
        let begins = |scan| RecordedScan { begins_recording: true, ..scan };
        let all = [
            scan(0, OdometryOrigin::Wheels),
            scan(1, OdometryOrigin::Wheels),
            begins(scan(0, OdometryOrigin::Unknown)),
            scan(40, OdometryOrigin::Unknown),
            begins(RecordedScan { odometry: None, ..scan(0, OdometryOrigin::Unknown) }),
            begins(scan(0, OdometryOrigin::RepeatsWheels)),
        ];
        let (are_used, notes) = wheels(&all);
        assert_eq!(are_used, [true, true, false, false, false, true]);
        let begin = ["Recording 1: The wheels' odometry", "Recording 2: The log has poses", "Recording 4: The poses"];
        assert!(notes.len() == 3 && begin.iter().zip(&notes).all(|(begin, note)| note.starts_with(begin)), "{notes:?}");
    }
}
