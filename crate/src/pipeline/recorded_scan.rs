//! A recorded scan, and the motion to it that the recording gives.

use std::collections::HashMap;
use std::rc::Rc;

use glam::Vec3;
use nalgebra::{Rotation3, Vector2};

use crate::geometry::quantile::quantile;
use crate::geometry::{PointCloud, Pose2, Pose3, RigidMotion};
use crate::io::laser_log::{LaserLog, LaserScan, OdometryOrigin};
use crate::io::length_unit::LONGEST_LASER_RANGE;
use crate::io::trajectory::Trajectory;
use crate::pipeline::settings::{OdometrySource, Settings};
use crate::preprocess::clean::{CleaningReport, RangeLimits, clean, refuse_map_coordinates};
use crate::preprocess::planar_scan::PlanarScan;
use crate::search::order::ascending;
use crate::{Error, Result};

/// Most time (s) between two files of one recording.
const LONGEST_PAUSE: f64 = 10.0;

/// One scan with all that was recorded along with it.
#[derive(Debug, Clone)]
pub struct RecordedScan {
    /// Returns in the laser's frame (m).
    pub cloud: PointCloud,
    /// Ranges at or beyond this value mean no return (m); infinite where that is not known.
    pub max_range: f64,
    /// Where the laser sits on the robot whose poses `reference` and `odometry` are.
    pub T_robot_laser: Pose2,
    /// Number of the scan in its log.
    pub index: usize,
    /// Time (s).
    pub time: Option<f64>,
    /// Pose of the robot by whoever corrected or measured it: to compare with, and for nothing else.
    pub reference: Option<Pose2>,
    /// Pose of the robot by its wheels, or what the log gives for it.
    pub odometry: Option<Pose2>,
    /// Whose `odometry` is.
    pub odometry_origin: OdometryOrigin,
    /// Whether nothing tells which way the laser turns.
    pub may_be_mirrored: bool,
    /// Whether its file holds no other.
    pub is_alone: bool,
    /// Whether another recording begins with it: nothing tells the way from the scan before.
    pub begins_recording: bool,
}

impl RecordedScan {
    /// A scan from a file of its own.
    pub fn of_cloud(cloud: PointCloud) -> Self {
        Self {
            cloud,
            max_range: f64::INFINITY,
            T_robot_laser: Pose2::identity(),
            index: 0,
            time: None,
            reference: None,
            odometry: None,
            odometry_origin: OdometryOrigin::Unknown,
            may_be_mirrored: false,
            is_alone: true,
            begins_recording: false,
        }
    }

    /// Whether it goes on with the recording that this one, read before it from another file, belongs to: a split log does, within seconds,
    /// and so do files of one scan each.
    pub(crate) fn continues(&self, before: &Self) -> bool {
        (self.is_alone && before.is_alone)
            || self.time.zip(before.time).is_some_and(|(time, before)| time > before && time - before < LONGEST_PAUSE)
    }

    /// Turns the readings the other way round: y to the other side.
    pub(crate) fn mirror(&mut self) {
        self.cloud.positions.iter_mut().for_each(|position| position.y = -position.y);
        self.may_be_mirrored = false;
    }

    /// All scans of a log.
    pub fn of_log(log: &LaserLog) -> impl Iterator<Item = Self> + '_ {
        log.scans.iter().map(|scan| Self {
            T_robot_laser: log.T_robot_laser,
            odometry_origin: log.odometry_origin,
            may_be_mirrored: log.may_be_mirrored,
            is_alone: log.scans.len() == 1,
            ..Self::of_scan(scan)
        })
    }

    /// One scan of a log.
    pub(crate) fn of_scan(scan: &LaserScan) -> Self {
        let positions = scan.points().into_iter().map(|[x, y]| Vec3::new(x, y, 0.0)).collect();
        Self {
            max_range: scan.max_range,
            index: scan.number,
            time: scan.time,
            reference: scan.reference,
            odometry: scan.odometry,
            ..Self::of_cloud(PointCloud::from_positions(positions))
        }
    }

    /// Its returns without what is no measurement, and what that left out; ranges from `limit` (m) on are none.
    pub(crate) fn cleaned(&self, limit: f64, settings: &Settings) -> (PlanarScan, CleaningReport) {
        let limits = settings.range_limits();
        let max_range = limit.min(limits.max_range).min(self.max_range);
        let cleaned = clean(&self.cloud.positions, &RangeLimits { max_range, ..limits });
        let points = cleaned.positions.iter().map(|p| Vector2::new(f64::from(p.x), f64::from(p.y))).collect();
        (PlanarScan::new(points), cleaned.report)
    }
}

/// The scans of a run.
#[derive(Clone, Copy)]
pub struct RecordedScans<'a> {
    /// As they were read.
    pub all: &'a [RecordedScan],
    /// The sensor's range limit (m); infinite where none was detected.
    pub limit: f64,
    /// How they are cleaned and registered.
    pub settings: &'a Settings,
}

impl RecordedScans<'_> {
    /// A scan as it is registered.
    pub(crate) fn cleaned(&self, frame: usize) -> Rc<PlanarScan> {
        Rc::new(self.all[frame].cleaned(self.limit, self.settings).0)
    }
}

/// Whether all scans come from one log, whose numbers ascend; scans that were left out have numbers, too.
pub(crate) fn is_one_log(recorded: &[RecordedScan]) -> bool {
    recorded.windows(2).all(|pair| pair[0].index < pair[1].index)
}

/// A planar scan that was saved with the height of its laser, with z = 0.
pub(crate) fn at_height_of_laser(mut cloud: PointCloud) -> PointCloud {
    let height = cloud.positions.iter().find(|p| p.is_finite()).map_or(0.0, |p| p.z);
    if cloud.positions.iter().all(|p| !p.is_finite() || p.z == height) {
        cloud.positions.iter_mut().for_each(|p| p.z = 0.0);
    }
    cloud
}

/// Whether the points of a planar scan can be those of a laser at zero, in metres.
///
/// # Errors
/// Coordinates of a map; a median distance that no laser reaches.
pub fn in_sensor_frame(cloud: &PointCloud) -> Result<()> {
    refuse_map_coordinates(cloud)?;
    let ranges = cloud.positions.iter().map(|p| f64::from(p.length()));
    let median = quantile(&mut ranges.filter(|range| range.is_finite()).collect::<Vec<_>>(), 0.5);
    if median.is_none_or(|median| median <= LONGEST_LASER_RANGE) {
        return refuse_other_place(cloud);
    }
    let problem = format!("Half of its points lie over {LONGEST_LASER_RANGE} m away, as on a map");
    Err(Error::whole(problem, "Give them in the frame of the laser, or set scan_unit (m)"))
}

/// Points that a laser sees from outside their own extent are no nearer than this many times its diagonal: within a fan of 37 degrees.
const MOST_DIAGONALS_AWAY: f32 = 1.5;

/// Refuses the points of a scan whose laser cannot have been at the origin: they lie all in one direction, in a narrow angle.
fn refuse_other_place(cloud: &PointCloud) -> Result<()> {
    let finite = || cloud.positions.iter().filter(|p| p.is_finite());
    let (low, high) = finite().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
    let distance = Vec3::ZERO.clamp(low, high).length();
    if finite().next().is_none() || distance <= MOST_DIAGONALS_AWAY * (high - low).length() {
        return Ok(());
    }
    if low == high {
        let remedy = "Give scans or clouds of many points";
        return Err(Error::whole("All of its points are one and the same", remedy));
    }
    let problem = format!(
        "Its points lie {:.0} times as far from the origin of their coordinates as they reach across, as on a map",
        distance / (high - low).length()
    );
    Err(Error::whole(problem, "Give each scan in the frame of its laser: the laser at (0, 0), x ahead, y to the left"))
}

/// The pose of the laser at each scan, where odometry gives one. `given` has the pose of the robot
/// at each scan, from a file of its own.
pub(crate) fn poses_of_laser(
    source: OdometrySource,
    scans: &[RecordedScan],
    given: Option<&[Option<Pose2>]>,
) -> Vec<Option<Pose2>> {
    let poses: Vec<Option<Pose2>> = match (source, given) {
        (OdometrySource::None, _) | (OdometrySource::Auto | OdometrySource::File, None) => vec![None; scans.len()],
        (OdometrySource::Log, None) => scans.iter().map(|scan| scan.odometry).collect(),
        (_, Some(given)) => given.to_vec(),
    };
    poses.iter().zip(scans).map(|(pose, scan)| Some((*pose)? * scan.T_robot_laser)).collect()
}

/// The motion from the pose before to each pose, where both are known and of one recording.
pub(crate) fn motions_between(poses: &[Option<Pose2>], scans: &[RecordedScan]) -> Vec<Option<Pose2>> {
    let motion = |frame: usize| {
        let before = frame.checked_sub(1).filter(|_| !scans[frame].begins_recording)?;
        Some(poses[before]?.inverse() * poses[frame]?)
    };
    (0..poses.len()).map(motion).collect()
}

/// Further than this (s) from a scan, odometry says nothing of it.
const MAX_ODOMETRY_GAP: f64 = 1.0;

/// How poses of odometry were found for scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Matching {
    /// By time.
    Time,
    /// As many poses as scans, in their order.
    Order,
    /// By the number of the scan.
    Number,
}

/// The pose that a trajectory has for each scan: by time where both have times and those meet; as many poses as scans in
/// their order; otherwise by the number of the scan.
pub(crate) fn match_odometry(scans: &[RecordedScan], given: &Trajectory) -> (Vec<Option<Pose2>>, Matching) {
    let poses = planar_poses(given);
    if let Some(timed) = TimedPoses::new(given, &poses) {
        let by_time: Vec<Option<Pose2>> = scans.iter().map(|scan| timed.at(scan.time?)).collect();
        if 2 * by_time.iter().flatten().count() > scans.len() {
            return (by_time, Matching::Time);
        }
    }
    if poses.len() == scans.len() {
        return (poses.into_iter().map(Some).collect(), Matching::Order);
    }
    let numbers = given.numbers.as_ref().or(given.stamps.as_ref());
    let pose_of: HashMap<i64, Pose2> = match numbers {
        Some(numbers) => numbers.iter().map(|number| (1e6 * number).round() as i64).zip(poses).collect(),
        None => (0..).map(|row| 1_000_000 * row).zip(poses).collect(),
    };
    let of_number = |scan: &RecordedScan| pose_of.get(&(1_000_000 * i64::try_from(scan.index).ok()?)).copied();
    (scans.iter().map(of_number).collect(), Matching::Number)
}

/// The poses of odometry in the plane; none without headings.
pub(crate) fn planar_poses(given: &Trajectory) -> Vec<Pose2> {
    let planar = |pose: &Pose3| {
        let (_, _, heading) = Rotation3::from(pose.rotation).euler_angles();
        Pose2::new(pose.translation.vector.xy(), heading)
    };
    given.poses().iter().flatten().map(planar).collect()
}

/// Poses by their times.
pub(crate) struct TimedPoses<'a> {
    stamps: &'a [f64],
    poses: &'a [Pose2],
    /// Indices of the poses in the order of their times.
    order: Vec<usize>,
}

impl<'a> TimedPoses<'a> {
    /// Of odometry that has times and these poses.
    pub(crate) fn new(given: &'a Trajectory, poses: &'a [Pose2]) -> Option<Self> {
        let stamps = given.stamps.as_deref().filter(|stamps| stamps.len() == poses.len())?;
        Some(Self { stamps, poses, order: ascending(stamps.iter().copied()) })
    }

    /// Between the two poses before and after a time (s), in proportion.
    pub(crate) fn at(&self, time: f64) -> Option<Pose2> {
        let Self { stamps, poses, order } = self;
        let after = order.partition_point(|&index| stamps[index] < time);
        let later = order.get(after).copied();
        if let Some(later) = later.filter(|&later| stamps[later] == time) {
            return Some(poses[later]);
        }
        let (earlier, later) = (*order.get(after.checked_sub(1)?)?, later?);
        let gap = stamps[later] - stamps[earlier];
        if time - stamps[earlier] > MAX_ODOMETRY_GAP || stamps[later] - time > MAX_ODOMETRY_GAP || gap <= 0.0 {
            return None;
        }
        let motion = (poses[earlier].inverse() * poses[later]).log();
        Some(poses[earlier] * Pose2::exp(&(motion * ((time - stamps[earlier]) / gap))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_of_a_map_are_refused() {
        let cloud = |scale: f32, origin: f64| PointCloud {
            positions: (0..180).map(|beam| scale * Vec3::new((beam as f32 / 57.3).cos(), 2.0, 0.0)).collect(),
            origin: glam::DVec3::new(origin, 0.0, 0.0),
            ..PointCloud::default()
        };
        assert!(in_sensor_frame(&cloud(1.0, 0.0)).is_ok());
        let map = in_sensor_frame(&cloud(1.0, 1e6)).unwrap_err();
        assert!(map.problem.contains("those of a map") && map.remedy.contains("frame of the sensor"));
        let far = in_sensor_frame(&cloud(1000.0, 0.0)).unwrap_err();
        assert!(far.problem.contains("over 200 m away") && far.remedy.contains("scan_unit"));
    }
}
