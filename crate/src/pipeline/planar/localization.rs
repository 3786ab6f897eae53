//! The scans of a recording in a map: a reconstruction's scans and odometry, located one after the other.

use std::rc::Rc;

use nalgebra::{Matrix3, Vector2};
use serde::Serialize;

use super::Reconstruction;
use super::chosen_odometry::ChosenOdometry;
use crate::error::Result;
use crate::geometry::{Pose2, Pose3, RigidMotion};
use crate::io::trajectory::{in_space, tum_text};
use crate::map::occupancy_grid::OccupancyGrid;
use crate::odometry::assessment::Status;
use crate::odometry::localization::{Localizer, Location, MapField, Place, Verdict};
use crate::odometry::planar::information::{seen_from, softened_covariance};
use crate::odometry::planar::odometry_model::UNREGISTERED;
use crate::odometry::planar::{FrameEstimate, Link, MeasuredMotion, Odometry, REGISTRATION_SIGMA};
use crate::pipeline::prepared_frame::FrameLabel;
use crate::pipeline::recorded_scan::RecordedScans;
use crate::pipeline::report::PlanarPose;
use crate::preprocess::clean::range_limit;
use crate::preprocess::planar_scan::PlanarScan;

/// A recording that is located in a map: call [`step`](Self::step) until it returns false, ask for the [`result`](Self::result) at any
/// time.
pub struct Localization {
    pub(super) localizer: Localizer,
    labels: Vec<FrameLabel>,
    pub(super) scans: Vec<Rc<PlanarScan>>,
    times: Option<Vec<f64>>,
    /// Where the robot is, as seen from the laser of each scan.
    pub(super) T_laser_robot: Vec<Pose2>,
    /// The motion by the wheels to each scan, where it is measured; else, once the scan is located, by registration where that tells it.
    pub(super) motions: Vec<Option<MeasuredMotion>>,
    has_odometry: bool,
    odometry: Odometry,
    /// Whether another recording begins with the scan.
    begins_recording: Vec<bool>,
    T_world_last: Pose2,
    notes: Vec<String>,
}

/// A pose with its probability.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct LocatedPose {
    /// Pose of the sensor, or of the robot where a log says where on it the laser sits, in the world of the map.
    pub T_world_sensor: PlanarPose,
    /// Covariance of x, y (m) and theta (rad), row by row.
    pub covariance: [f64; 9],
    /// 0..=1.
    pub probability: f64,
}

/// Where a scan was taken.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct LocatedScan {
    /// Name of the file or of the scan in its log.
    pub name: String,
    /// Index in the recording, from 0.
    pub index: usize,
    /// Time stamp (s), or null.
    pub time: Option<f64>,
    /// Good: its place is certain. Doubtful: it may be wrong. Lost: there is none, or it was taken elsewhere.
    pub status: Status,
    /// Reason for a status other than good; empty otherwise.
    pub reason: String,
    /// The most likely place; null where there is none.
    pub place: Option<LocatedPose>,
    /// Its rivals, the most likely one first.
    pub rivals: Vec<LocatedPose>,
    /// Probability that it was taken elsewhere.
    pub elsewhere: f64,
    /// Share of its beams that end on a wall of the map, 0..=1.
    pub agreement: f64,
    /// Whether this scan and those before it tell the place; else later scans do.
    pub is_known_at_once: bool,
}

/// The result of a localisation.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct LocalizationResult {
    /// Version of the engine.
    pub version: &'static str,
    /// Whether the scans were found in the map.
    pub verdict: Verdict,
    /// The verdict in plain words.
    pub summary: String,
    /// How many scans it took until a place was certain; null where none is.
    pub num_scans_to_find: Option<usize>,
    /// Where each scan was taken.
    pub scans: Vec<LocatedScan>,
    /// What else is worth knowing, in whole sentences.
    pub notes: Vec<String>,
}

impl Reconstruction {
    /// Prepares to locate the scans in a map: with their odometry, as the settings ask for it. A reconstruction is not needed for that.
    ///
    /// # Errors
    /// A map without walls or without free space.
    pub fn localization(&self, grid: &OccupancyGrid) -> Result<Localization> {
        let field = MapField::new(grid);
        field.check()?;
        let limit = range_limit(self.recorded.iter().map(|scan| scan.cloud.positions.as_slice()));
        let limit = limit.unwrap_or(f64::INFINITY);
        let recorded = RecordedScans { all: &self.recorded, limit, settings: &self.settings };
        let chosen = ChosenOdometry::new(self.odometry.as_ref(), &recorded);
        let checked = chosen.checked.iter().flat_map(|checked| checked.refusal.iter().chain(&checked.notes)).cloned();
        let options = self.settings.odometry_options();
        let has_odometry = chosen.model.steps.iter().any(Option::is_some);
        Ok(Localization {
            localizer: Localizer::new(Rc::new(field), has_odometry),
            has_odometry,
            labels: self.labels().collect(),
            scans: (0..self.recorded.len()).map(|frame| recorded.cleaned(frame)).collect(),
            times: self.stamps().times,
            T_laser_robot: self.recorded.iter().map(|scan| scan.T_robot_laser.inverse()).collect(),
            odometry: Odometry::new(options, Pose2::identity()).with_motion_change(chosen.model.motion_change),
            begins_recording: self.recorded.iter().map(|scan| scan.begins_recording).collect(),
            T_world_last: Pose2::identity(),
            notes: chosen.notes.iter().cloned().chain(checked).collect(),
            motions: chosen.model.steps,
        })
    }
}

impl Localization {
    /// Locates the next scan; whether there are more.
    pub fn step(&mut self) -> bool {
        let frame = self.localizer.locations().len();
        let Some(scan) = self.scans.get(frame).cloned() else { return false };
        if self.begins_recording[frame] {
            self.odometry.begin_recording();
        }
        let measured = self.motions[frame];
        let estimate = self.odometry.register_frame(&scan, measured.as_ref(), None);
        // Where the odometry has a gap, registration alone may mislead: the robot is searched for again.
        let is_gap = self.has_odometry && measured.is_none();
        let motion = motion(&estimate, &self.T_world_last, measured.as_ref()).filter(|_| !is_gap);
        self.motions[frame] = measured.or(motion);
        self.T_world_last = estimate.T_world_sensor;
        self.localizer.add_scan(&scan, motion.as_ref());
        frame + 1 < self.scans.len()
    }

    /// Where each scan so far was taken, as its laser.
    pub fn locations(&self) -> &[Location] {
        self.localizer.locations()
    }

    /// The scans, cleaned.
    pub fn scans(&self) -> &[Rc<PlanarScan>] {
        &self.scans
    }

    /// The scores of a return in each cell of the map, see [`MapField::picture`], and the number of cells of a row.
    pub fn likelihood_field(&self) -> (Vec<f32>, usize) {
        let field = self.localizer.field();
        (field.picture(), field.width())
    }

    /// What is known so far.
    pub fn result(&self) -> LocalizationResult {
        LocalizationResult {
            scans: (0..self.locations().len()).filter_map(|frame| self.scan(frame)).collect(),
            ..self.outcome()
        }
    }

    /// The same without the scans.
    pub fn outcome(&self) -> LocalizationResult {
        LocalizationResult {
            version: env!("CARGO_PKG_VERSION"),
            verdict: self.localizer.verdict(),
            summary: self.summary(),
            num_scans_to_find: self.num_scans_to_find(),
            scans: Vec::new(),
            notes: self.notes.clone(),
        }
    }

    /// Where a scan was taken; `None` where it has not been located yet.
    pub fn scan(&self, frame: usize) -> Option<LocatedScan> {
        let location = self.locations().get(frame)?;
        Some(located_scan(&self.labels[frame], location, &self.T_laser_robot[frame]))
    }

    /// How many scans it took until a place was certain.
    fn num_scans_to_find(&self) -> Option<usize> {
        let is_found = |location: &Location| location.status == Status::Good && location.is_known_at_once;
        self.locations().iter().position(is_found).map(|frame| frame + 1)
    }

    /// The verdict in plain words.
    fn summary(&self) -> String {
        let count = |status: Status| self.locations().iter().filter(|location| location.status == status).count();
        let (good, doubtful, all) = (count(Status::Good), count(Status::Doubtful), self.locations().len());
        match self.localizer.verdict() {
            Verdict::Found => {
                let rest = if good == all {
                    String::new()
                } else {
                    format!(", {doubtful} may be wrong and {} have none", all - good - doubtful)
                };
                let found = self.num_scans_to_find().map(|num| format!(" The place was certain after {num} scans."));
                format!(
                    "Found in the map: {good} of {all} scans have a certain place{rest}.{}",
                    found.unwrap_or_default()
                )
            }
            Verdict::NotInMap => {
                "Not in this map: the scans fit nowhere in it, or it has changed beyond recognition.".to_owned()
            }
            Verdict::Undecided => {
                let reason = self.locations().last().map_or("", |last| &last.reason);
                format!("Undecided: {all} scans do not tell one place of the map. Of the last scan: {reason}.")
            }
        }
    }

    /// `T_world_sensor` of every scan that has a place, or that of its robot.
    pub fn poses(&self) -> Vec<Option<Pose2>> {
        let locations = self.locations().iter().zip(&self.T_laser_robot);
        locations.map(|(location, T_laser_robot)| Some(location.place?.T_world_sensor * T_laser_robot)).collect()
    }

    /// The trajectory as TUM writes it, a line for every scan with a certain place.
    pub fn trajectory_tum(&self) -> String {
        let frames = (0..self.locations().len()).filter(|&frame| self.locations()[frame].status == Status::Good);
        let poses = self.poses();
        let time = |frame: usize| self.times.as_ref().map_or(frame as f64, |times| times[frame]);
        let (times, poses): (Vec<f64>, Vec<Pose3>) =
            frames.filter_map(|frame| Some((time(frame), in_space(poses[frame].as_ref()?)))).unzip();
        tum_text(Some(&times), &poses)
    }
}

/// The motion to a scan from the one before, by registration to the scans before and by the wheels; `None` where neither tells it.
fn motion(
    estimate: &FrameEstimate,
    T_world_before: &Pose2,
    measured: Option<&MeasuredMotion>,
) -> Option<MeasuredMotion> {
    match estimate.link {
        // Without wheels, a registration that something speaks against may be a place that looks alike.
        Link::Doubted if measured.is_none() => None,
        Link::Registered | Link::Doubted => {
            let registered = seen_from(&estimate.information, T_world_before);
            let of_wheels = estimate.instead_of_odometry.as_ref().or(measured);
            let of_wheels = of_wheels.and_then(|motion| motion.covariance.try_inverse()).unwrap_or_else(Matrix3::zeros);
            Some(MeasuredMotion {
                T_before_sensor: (T_world_before.inverse() * estimate.T_world_sensor).renormalized(),
                covariance: softened_covariance(&(registered + of_wheels), REGISTRATION_SIGMA, UNREGISTERED),
            })
        }
        Link::Carried => measured.copied(),
        Link::Start | Link::Implausible | Link::Lost => None,
    }
}

fn located_scan(label: &FrameLabel, location: &Location, T_laser_robot: &Pose2) -> LocatedScan {
    let pose = |place: &Place| located_pose(place, T_laser_robot);
    LocatedScan {
        name: label.name.clone(),
        index: label.index,
        time: label.time,
        status: location.status,
        reason: location.reason.clone(),
        place: location.place.as_ref().map(pose),
        rivals: location.rivals.iter().map(pose).collect(),
        elsewhere: location.elsewhere,
        agreement: location.agreement,
        is_known_at_once: location.is_known_at_once,
    }
}

/// Of the robot that carries the laser.
fn located_pose(place: &Place, T_laser_robot: &Pose2) -> LocatedPose {
    // A turn of the laser moves the robot's middle.
    let lever: Vector2<f64> = place.T_world_sensor.rotation * T_laser_robot.translation.vector;
    let jacobian = Matrix3::new(1.0, 0.0, -lever.y, 0.0, 1.0, lever.x, 0.0, 0.0, 1.0);
    let covariance = jacobian * place.covariance * jacobian.transpose();
    LocatedPose {
        T_world_sensor: (place.T_world_sensor * T_laser_robot).into(),
        covariance: std::array::from_fn(|i| covariance[(i / 3, i % 3)]),
        probability: place.probability,
    }
}
