//! The odometry of a run: which source it is taken from, how well it is known, and what is said of it.

use std::rc::Rc;

use super::measured_motion;
use crate::io::trajectory::Trajectory;
use crate::odometry::planar::{MeasuredMotion, PlanarOptions};
use crate::pipeline::odometry_check::{CheckedOdometry, check_odometry, mirror_of_log};
use crate::pipeline::recorded_scan::{RecordedScan, match_odometry, motions_between_scans};
use crate::pipeline::settings::OdometrySource;
use crate::preprocess::planar_scan::PlanarScan;

const MIRRORED_BY_ODOMETRY: &str = "the map may be mirrored: the odometry tells the mirror image of its motion";
const DIRECTION_OPEN: &str = "the map may be mirrored: the file does not tell which way the laser turns";

/// The odometry that a run uses; without any, no motion is measured.
pub struct ChosenOdometry {
    /// The motion of the laser from the scan before to each, where it is measured.
    pub motions: Vec<Option<MeasuredMotion>>,
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

/// The scans of a run as they were read, and as they are registered.
pub struct ScansToCheck<'a> {
    /// As they were read.
    pub recorded: &'a [RecordedScan],
    /// The scan of a number, cleaned.
    pub cleaned: &'a dyn Fn(usize) -> Rc<PlanarScan>,
    /// The sensor's range limit (m); infinite where none was detected.
    pub limit: f64,
    /// How they are registered.
    pub options: &'a PlanarOptions,
}

impl ChosenOdometry {
    /// Chooses between a file of odometry, which has a name, and the poses in the log.
    pub fn new(wanted: OdometrySource, file: Option<&(String, Trajectory)>, scans: &ScansToCheck) -> Self {
        let ScansToCheck { recorded, cleaned, limit, options } = *scans;
        let file = file.filter(|_| wanted != OdometrySource::None);
        let checked = file.map(|(name, given)| scans.check(name, given));
        let may_check_log = file.is_none() && wanted != OdometrySource::None;
        let mirrored_in_log = if may_check_log { mirror_of_log(recorded, limit) } else { None };
        let (source, log_note) = scans.source(wanted, file.is_some());
        let poses = checked.as_ref().map(|checked| checked.poses.as_slice());
        let motions = motions_between_scans(source, recorded, poses);
        let (motions, noise_note) = measured_motion::judged(&motions, cleaned, options);
        let is_mirrored = checked.as_ref().is_some_and(|checked| checked.mirrored.is_some());
        Self {
            motions,
            uses_poses_in_log: source == OdometrySource::Log,
            mirror_doubt: if is_mirrored || mirrored_in_log.is_some() {
                Some(MIRRORED_BY_ODOMETRY)
            } else {
                (checked.is_none() && scans.may_be_mirrored()).then_some(DIRECTION_OPEN)
            },
            checked,
            notes: log_note.into_iter().chain(mirrored_in_log.clone()).chain(noise_note).collect(),
            mirrored_in_log,
        }
    }
}

impl ScansToCheck<'_> {
    /// Judges the odometry of a file.
    fn check(&self, name: &str, given: &Trajectory) -> CheckedOdometry {
        let checked = check_odometry(name, self.recorded, given, self.limit);
        if checked.refusal.is_none() {
            return checked;
        }
        // A place that repeats itself looks as if there were no motion, or another one: registrations tell more.
        let as_given = match_odometry(self.recorded, given).0;
        let motions = motions_between_scans(OdometrySource::File, self.recorded, Some(&as_given));
        if measured_motion::fits_scans(&motions, self.cleaned, self.options) {
            CheckedOdometry { poses: as_given, ..CheckedOdometry::default() }
        } else {
            checked
        }
    }

    /// Where the motion is taken from, and a note where the poses in the log were looked at.
    fn source(&self, wanted: OdometrySource, has_file: bool) -> (OdometrySource, Option<String>) {
        if wanted != OdometrySource::Auto || has_file {
            return (wanted, None);
        }
        let (are_wheels, note) = measured_motion::log_holds_wheels(self.recorded, self.cleaned, self.options);
        (if are_wheels { OdometrySource::Log } else { OdometrySource::Auto }, note)
    }

    /// Whether nothing tells which way the laser turns.
    fn may_be_mirrored(&self) -> bool {
        self.recorded.iter().any(|scan| scan.may_be_mirrored && scan.odometry.is_none())
    }
}
