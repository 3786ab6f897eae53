//! Measured motion, held against what the scans say: how well it is known.

use std::rc::Rc;

use crate::geometry::{Pose2, RigidMotion};
use crate::io::laser_log::OdometryOrigin;
use crate::map::local::{LocalMap, QueryScan};
use crate::odometry::assessment::Status;
use crate::odometry::planar::assess::{MIN_POINTS, assess};
use crate::odometry::planar::hypothesis::{Hypothesis, NUM_SEARCHED_POINTS, fits_as_well, thinned};
use crate::odometry::planar::motion_noise::{Comparison, MotionNoise};
use crate::odometry::planar::{MeasuredMotion, PlanarOptions, RIVAL_SHARE_UNKNOWN_MOTION};
use crate::pipeline::recorded_scan::{RecordedScan, is_one_log};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::correlative::LikelihoodGrid;

/// So many stretches of the way are compared.
const COMPARED: usize = 48;
/// A stretch is as many steps as it takes to go this far (m) ...
const STRETCH: f64 = 0.5;
/// ... or to turn this much (rad).
const STRETCH_TURN: f64 = 0.25;
/// Motions near the border of the search are not compared where there are others: this share of its half width is left.
const INSIDE: f64 = 0.8;

/// A measured stretch contradicts a sure registration when it is off by this (m) and this share of its way, ...
const CONTRADICTING: (f64, f64) = (0.3, 0.2);
/// ... or by this turn (rad).
const CONTRADICTING_TURN: f64 = 0.35;
/// Fewer comparisons than this say nothing of whose the motion is.
const MIN_COMPARED: usize = 8;

/// The motions with the covariances that the log's own noise gives them. Motion that contradicts the scans is left out, and
/// the note says so.
#[inline(never)]
pub fn judged(
    motions: &[Option<Pose2>],
    scan: &dyn Fn(usize) -> Rc<PlanarScan>,
    options: &PlanarOptions,
) -> (Vec<Option<MeasuredMotion>>, Option<String>) {
    if motions.iter().all(Option::is_none) {
        return (vec![None; motions.len()], None);
    }
    let comparisons = comparisons(motions, scan, options);
    let num_contradicting = comparisons.iter().filter(|comparison| contradicts(comparison)).count();
    if comparisons.len() >= MIN_COMPARED && 2 * num_contradicting > comparisons.len() {
        let note = format!(
            "The odometry contradicts the scans in {num_contradicting} of {} places compared and was left out. Check that it \
             belongs to this log, is in metres and radians, and has the log's clock.",
            comparisons.len()
        );
        return (vec![None; motions.len()], Some(note));
    }
    let noise = MotionNoise::fitted(&comparisons);
    let measured = |motion: &Pose2| MeasuredMotion { T_before_sensor: *motion, covariance: noise.covariance(motion) };
    let num_missing = motions.iter().skip(1).filter(|motion| motion.is_none()).count();
    let note = (num_missing > 0).then(|| {
        format!("The odometry tells nothing of the way to {num_missing} of {} scans; these are placed from the scans alone.", motions.len())
    });
    (motions.iter().map(|motion| motion.as_ref().map(measured)).collect(), note)
}

/// Scans fit measured stretches when a registration moves them by less than this (m) and this share of their way,
const FITTING: (f64, f64) = (0.1, 0.1);
/// ... by less than this turn (rad) ...
const FITTING_TURN: f64 = 0.1;
/// ... and this share of the returns agrees, ...
const FITTING_AGREEMENT: f64 = 0.9;
/// ... in this share of the places compared.
const FITTING_SHARE: f64 = 0.95;

/// Whether scans fit each other where measured motions put them, all over the way.
#[inline(never)]
pub fn fits_scans(motions: &[Option<Pose2>], scan: &dyn Fn(usize) -> Rc<PlanarScan>, options: &PlanarOptions) -> bool {
    let stretches = stretches(motions);
    let stride = stretches.len().div_ceil(COMPARED).max(1);
    let fits = |(from, steps): &(usize, Vec<Pose2>)| {
        let measured = sum(steps);
        let Hypothesis { registration, assessment } =
            register_pair(&scan(*from), &scan(from + steps.len()), measured, options);
        let off = measured.inverse() * registration.T_target_source;
        assessment.agreement > FITTING_AGREEMENT
            && off.translation_norm() < FITTING.0 + FITTING.1 * measured.translation_norm()
            && off.rotation_angle() < FITTING_TURN
    };
    let compared: Vec<bool> = stretches.iter().step_by(stride).map(fits).collect();
    let num_fitting = compared.iter().filter(|&&fits| fits).count();
    compared.len() >= MIN_COMPARED && num_fitting as f64 >= FITTING_SHARE * compared.len() as f64
}

/// One scan registered to another one from a guess.
fn register_pair(target: &Rc<PlanarScan>, source: &PlanarScan, guess: Pose2, options: &PlanarOptions) -> Hypothesis {
    let (mut map, source) = (LocalMap::new(1, options.metric), &QueryScan::new(source));
    map.insert(Rc::clone(target), Pose2::identity());
    let registration = map.register(source, guess, &options.icp);
    let assessment = assess(&registration, map.free_space(source, &registration.T_target_source));
    Hypothesis { registration, assessment }
}

fn sum(steps: &[Pose2]) -> Pose2 {
    steps.iter().fold(Pose2::identity(), |sum, step| sum * step)
}

fn contradicts(comparison: &Comparison) -> bool {
    let off = sum(&comparison.steps).inverse() * comparison.registered;
    let most = CONTRADICTING.0 + CONTRADICTING.1 * comparison.registered.translation_norm();
    off.translation_norm() > most || off.rotation_angle() > CONTRADICTING_TURN
}

/// Shortest path between two visits that counts as a revisit (m).
const MIN_REVISIT_PATH: f64 = 15.0;
/// Largest distance between the poses of two visits (m, rad).
const MAX_REVISIT_DISTANCE: (f64, f64) = (1.0, 0.35);
/// Distance along the path between two frames that are looked at for revisits (m).
const REVISIT_SPACING: f64 = 0.5;
/// Most revisits that are checked.
const MAX_REVISITS: usize = 24;
/// Fewer revisits do not decide whose the poses are.
const MIN_REVISITS: usize = 4;
/// Largest deviation of a registration from corrected poses at a revisit (m, rad).
const CORRECTED: (f64, f64) = (0.25, 0.07);

/// Whether the poses in a log are the wheels' own, and a note where that can be told: wheels drift, so where their path
/// seems to come back to a place, the scans do not fit each other; where a program corrected the poses, they do. Of a path that
/// comes back to too few places, poses that repeat the log's lines of odometry are the wheels'.
#[inline(never)]
pub fn log_holds_wheels(
    recorded: &[RecordedScan],
    scan: &dyn Fn(usize) -> Rc<PlanarScan>,
    options: &PlanarOptions,
) -> (bool, Option<String>) {
    let poses: Option<Vec<Pose2>> = recorded.iter().map(|scan| Some(scan.odometry? * scan.T_robot_laser)).collect();
    let Some(poses) = poses.filter(|_| is_one_log(recorded)) else { return (false, None) };
    let are_all = |origin| recorded.iter().all(|scan| scan.odometry_origin == origin);
    if are_all(OdometryOrigin::Wheels) {
        let note = "The wheels' odometry in the log is used; odometry=none leaves it out.";
        return (true, Some(note.to_owned()));
    }
    let (num_fitting, num_tried) = fitting_revisits(&poses, scan, options);
    let is_told = num_tried >= MIN_REVISITS;
    if !is_told && !are_all(OdometryOrigin::RepeatsWheels) {
        let way: f64 = poses.windows(2).map(|pair| (pair[0].inverse() * pair[1]).translation_norm()).sum();
        let note = "The log has poses, and whether they are the wheels' own cannot be told: they come back to too few places. \
                    They are not used; odometry=log uses them.";
        return (false, (way > MIN_REVISIT_PATH).then(|| note.to_owned()));
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
fn fitting_revisits(
    poses: &[Pose2],
    scan: &dyn Fn(usize) -> Rc<PlanarScan>,
    options: &PlanarOptions,
) -> (usize, usize) {
    let revisits = revisits(poses);
    let stride = revisits.len().div_ceil(MAX_REVISITS).max(1);
    let (mut num_fitting, mut num_tried) = (0, 0);
    for (earlier, later) in revisits.into_iter().step_by(stride) {
        let (target, source) = (scan(earlier), scan(later));
        if target.points.len() < MIN_POINTS || source.points.len() < MIN_POINTS {
            continue;
        }
        let guess = poses[earlier].inverse() * poses[later];
        let Hypothesis { registration, assessment } = register_pair(&target, &source, guess, options);
        let off = guess.inverse() * registration.T_target_source;
        num_tried += 1;
        num_fitting += usize::from(
            assessment.status != Status::Lost
                && off.translation_norm() < CORRECTED.0
                && off.rotation_angle() < CORRECTED.1,
        );
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
        if chosen.last().is_none_or(|&last| along[frame] - along[last] > REVISIT_SPACING) {
            chosen.push(frame);
        }
    }
    let near = |earlier: usize, later: usize| {
        let apart = poses[earlier].inverse() * poses[later];
        apart.translation_norm() < MAX_REVISIT_DISTANCE.0 && apart.rotation_angle() < MAX_REVISIT_DISTANCE.1
    };
    let earlier_of = |&later: &usize| {
        let is_revisited =
            |&&earlier: &&usize| along[later] - along[earlier] > MIN_REVISIT_PATH && near(earlier, later);
        chosen.iter().find(is_revisited).map(|&earlier| (earlier, later))
    };
    chosen.iter().filter_map(earlier_of).collect()
}

/// Stretches spread over the way, each with what a registration from scans alone makes of it, where that is sure.
fn comparisons(
    motions: &[Option<Pose2>],
    scan: &dyn Fn(usize) -> Rc<PlanarScan>,
    options: &PlanarOptions,
) -> Vec<Comparison> {
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
    stretches
        .filter_map(|(from, steps)| {
            let (target, source) = (scan(from), scan(from + steps.len()));
            let registered = register_without_motion(&target, &source, &sum(&steps), options)?;
            Some(Comparison { steps, registered })
        })
        .collect()
}

/// The motion between two scans, where they tell it for sure. Where they fit about as well at the measured motion, it is
/// what they tell: a place that repeats itself contradicts nothing.
fn register_without_motion(
    target: &Rc<PlanarScan>,
    source: &PlanarScan,
    measured: &Pose2,
    options: &PlanarOptions,
) -> Option<Pose2> {
    let register_from = |guess: Pose2| register_pair(target, source, guess, options);
    let at_measured = register_from(*measured);
    let found = LikelihoodGrid::new(&target.points).search(
        &thinned(&source.points, NUM_SEARCHED_POINTS),
        &Pose2::identity(),
        options.search,
    );
    let best =
        found.map(|found| register_from(found.T_target_source)).filter(|best| best.assessment.status == Status::Good);
    match best {
        Some(best) if !fits_as_well(&at_measured, &best, RIVAL_SHARE_UNKNOWN_MOTION) => {
            Some(best.registration.T_target_source)
        }
        _ => (at_measured.assessment.status == Status::Good).then_some(at_measured.registration.T_target_source),
    }
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
        if motion.is_none() || way > STRETCH || turn > STRETCH_TURN {
            if motion.is_some() {
                stretches.push((from, std::mem::take(&mut steps)));
            }
            steps.clear();
            (from, way, turn) = (frame, 0.0, 0.0);
        }
    }
    stretches
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PointCloud;
    use crate::pipeline::settings::Settings;

    #[test]
    fn wheels_in_a_log_are_used_where_a_scan_was_left_out() {
        let recorded = |index| RecordedScan {
            index,
            odometry: Some(Pose2::translation(index as f64, 0.0)),
            odometry_origin: OdometryOrigin::Wheels,
            ..RecordedScan::of_cloud(PointCloud::default())
        };
        let scan = |_: usize| unreachable!("their origin is known");
        let options = Settings::default().odometry_options();
        let are_wheels = |indices: [usize; 3]| log_holds_wheels(&indices.map(recorded), &scan, &options).0;
        assert!(are_wheels([0, 1, 2]) && are_wheels([0, 1, 3]));
        assert!(!are_wheels([0, 0, 0]), "scans of files of their own");
    }
}
