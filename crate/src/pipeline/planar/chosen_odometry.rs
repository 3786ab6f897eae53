//! The odometry of a run: which source it is taken from, how well it is known, and what is said of it.

use super::counterparts::{counterparts, fits_scans, wheels_in_logs};
use crate::geometry::Pose2;
use crate::geometry::quantile::MIN_SAMPLE;
use crate::io::trajectory::Trajectory;
use crate::odometry::planar::odometry_model::OdometryModel;
use crate::pipeline::odometry_check::{CheckedOdometry, check_odometry, mirror_of_log};
use crate::pipeline::recorded_scan::{RecordedScans, match_odometry, motions_between, poses_of_laser};
use crate::pipeline::settings::OdometrySource;

const MIRRORED_BY_ODOMETRY: &str = "the map may be mirrored: the odometry tells the mirror image of its motion";
const DIRECTION_OPEN: &str = "the map may be mirrored: the file does not tell which way the laser turns; if clockwise, set laser_direction=mirrored";

/// See [`ChosenOdometry::new`].
pub type ChooseOdometry = fn(Option<&(String, Trajectory)>, &RecordedScans) -> ChosenOdometry;

/// The odometry that a run uses; without any, no motion is measured.
#[derive(Default)]
pub struct ChosenOdometry {
    /// The motion of the laser from scan to scan, where it is measured.
    pub model: OdometryModel,
    /// Whether the poses in the log are that motion: then they are nothing to compare with.
    pub uses_poses_in_log: bool,
    /// What was said of the odometry from a file of its own.
    pub checked: Option<CheckedOdometry>,
    /// What is worth knowing of the measured motion, in whole sentences.
    pub notes: Vec<String>,
    /// Why the poses in the log are the mirror image of the scans; `None` where they are not.
    pub mirrored_in_log: Option<String>,
    /// Why the map may be a mirror image; `None` where nothing speaks for it.
    pub mirror_doubt: Option<&'static str>,
}

impl ChosenOdometry {
    /// Scans alone, of clouds: they tell no motion.
    pub fn none(num_scans: usize) -> Self {
        Self { model: OdometryModel::unmeasured(num_scans), ..Self::default() }
    }

    /// Chooses between a file of odometry, which has a name, and the poses in the log.
    pub fn new(file: Option<&(String, Trajectory)>, scans: &RecordedScans) -> Self {
        let wanted = scans.settings.odometry;
        let file = file.filter(|_| wanted != OdometrySource::None);
        let checked = file.map(|(name, given)| check(name, given, scans));
        let may_check_log = file.is_none() && wanted != OdometrySource::None;
        let mirrored_in_log = if may_check_log { mirror_of_log(scans.all, scans.limit) } else { None };
        let judged = (wanted == OdometrySource::Auto && file.is_none()).then(|| wheels_in_logs(scans));
        let (in_logs, log_notes) = judged.unzip();
        let uses_wheels = in_logs.iter().flatten().any(Option::is_some);
        let source = if uses_wheels { OdometrySource::Log } else { wanted };
        let poses = checked.as_ref().map(|checked| &checked.poses).or(in_logs.as_ref());
        let (model, noise_note) = compared(&poses_of_laser(source, scans.all, poses.map(Vec::as_slice)), scans);
        let is_mirrored = checked.as_ref().is_some_and(|checked| checked.mirrored.is_some());
        let may_be_mirrored = scans.all.iter().any(|scan| scan.may_be_mirrored && scan.odometry.is_none());
        Self {
            model,
            uses_poses_in_log: source == OdometrySource::Log,
            mirror_doubt: if is_mirrored || mirrored_in_log.is_some() {
                Some(MIRRORED_BY_ODOMETRY)
            } else {
                (checked.is_none() && may_be_mirrored).then_some(DIRECTION_OPEN)
            },
            checked,
            notes: log_notes.into_iter().flatten().chain(mirrored_in_log.clone()).chain(noise_note).collect(),
            mirrored_in_log,
        }
    }
}

/// Judges the odometry of a file.
fn check(name: &str, given: &Trajectory, scans: &RecordedScans) -> CheckedOdometry {
    let checked = check_odometry(name, scans.all, given, scans.limit);
    if checked.refusal.is_none() {
        return checked;
    }
    // A place that repeats itself looks as if there were no motion, or another one: registrations tell more.
    let as_given = match_odometry(scans.all, given).0;
    let motions = motions_between(&poses_of_laser(OdometrySource::File, scans.all, Some(&as_given)), scans.all);
    if fits_scans(&motions, scans) {
        CheckedOdometry { poses: as_given, ..CheckedOdometry::default() }
    } else {
        checked
    }
}

/// The model of these steps, and a note. Odometry of which most is wrong is left out.
fn compared(poses: &[Option<Pose2>], scans: &RecordedScans) -> (OdometryModel, Option<String>) {
    let motions = &motions_between(poses, scans.all);
    if motions.iter().all(Option::is_none) {
        return (OdometryModel::unmeasured(motions.len()), None);
    }
    let model = OdometryModel::new(motions, &counterparts(motions, scans));
    let (num_wrong, num_compared) = model.wrong;
    if num_compared >= MIN_SAMPLE && 2 * num_wrong > num_compared {
        let note = format!(
            "The odometry contradicts the scans in {num_wrong} of {num_compared} places compared and was left out. Check that it \
             belongs to this log, is in metres and radians, and has the log's clock."
        );
        return (OdometryModel::unmeasured(motions.len()), Some(note));
    }
    let model = model.bridged(poses, |frame| scans.all[frame].begins_recording);
    let is_missing = |frame: &usize| model.steps[*frame].is_none() && !scans.all[*frame].begins_recording;
    let num_missing = (1..scans.all.len()).filter(is_missing).count();
    let note = (num_missing > 0).then(|| {
        let count = motions.len();
        format!("The odometry tells nothing of the way to {num_missing} of {count} scans; these are placed from the scans alone.")
    });
    (model, note)
}
