//! The odometry of a run: which source it is taken from, how well it is known, and what is said of it.

use super::counterparts::{counterparts, log_holds_wheels};
use super::odometry_hypotheses::{CheckedOdometry, check_log, check_odometry};
use super::pairs::registered_pairs;
use crate::io::trajectory::Trajectory;
use crate::odometry::planar::odometry_model::OdometryModel;
use crate::pipeline::recorded_scan::{RecordedScans, motions_between_scans};
use crate::pipeline::settings::OdometrySource;

const MIRRORED_BY_ODOMETRY: &str = "the map may be mirrored: the odometry tells the mirror image of its motion";
const DIRECTION_OPEN: &str = "the map may be mirrored: the file does not tell which way the laser turns";

/// The odometry that a run uses; without any, no motion is measured.
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
    /// Chooses between a file of odometry, which has a name, and the poses in the log.
    pub fn new(file: Option<&(String, Trajectory)>, scans: &RecordedScans) -> Self {
        let wanted = scans.settings.odometry;
        let file = file.filter(|_| wanted != OdometrySource::None);
        let is_told =
            file.is_some() || (wanted != OdometrySource::None && scans.all.iter().any(|scan| scan.odometry.is_some()));
        let pairs = if is_told { registered_pairs(scans) } else { Vec::new() };
        let checked = file.map(|(name, given)| check_odometry(name, scans, &pairs, given));
        let (mirrored_in_log, contradiction) = if checked.is_none() { check_log(scans, &pairs) } else { (None, None) };
        let (source, log_note) = if wanted == OdometrySource::Auto && file.is_none() {
            let (are_wheels, note) = log_holds_wheels(scans);
            (if are_wheels { OdometrySource::Log } else { OdometrySource::Auto }, note)
        } else {
            (wanted, None)
        };
        let contradiction = contradiction.filter(|_| source == OdometrySource::Log);
        let poses = checked.as_ref().map(|checked| checked.poses.as_slice());
        let is_used = contradiction.is_none();
        let motions = motions_between_scans(if is_used { source } else { OdometrySource::None }, scans.all, poses);
        let missing = motions.iter().skip(1).filter(|motion| motion.is_none()).count();
        let gaps = (missing > 0 && missing + 1 < motions.len()).then(|| {
            format!(
                "The odometry tells nothing of the way to {missing} of {} scans; these are placed from the scans alone.",
                motions.len()
            )
        });
        let is_mirrored = checked.as_ref().is_some_and(|checked| checked.mirrored.is_some());
        let may_be_mirrored = scans.all.iter().any(|scan| scan.may_be_mirrored && scan.odometry.is_none());
        Self {
            model: OdometryModel::new(&motions, &counterparts(&motions, scans)),
            uses_poses_in_log: source == OdometrySource::Log,
            mirror_doubt: if is_mirrored || mirrored_in_log.is_some() {
                Some(MIRRORED_BY_ODOMETRY)
            } else {
                (checked.is_none() && may_be_mirrored).then_some(DIRECTION_OPEN)
            },
            checked,
            notes: [log_note, mirrored_in_log.clone(), contradiction, gaps].into_iter().flatten().collect(),
            mirrored_in_log,
        }
    }
}
