//! A scan as it was recorded, and what the recording tells of the way to it.

use glam::Vec3;
use nalgebra::Rotation3;

use crate::geometry::{PointCloud, Pose2, RigidMotion};
use crate::io::laser_log::LaserLog;
use crate::io::trajectory::Trajectory;
use crate::pipeline::settings::OdometrySource;

/// One scan with all that was recorded along with it.
#[derive(Debug, Clone)]
pub struct RecordedScan {
    /// Returns in the laser's frame (m).
    pub cloud: PointCloud,
    /// Readings from here on are none (m); infinite where that is not known.
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
        }
    }

    /// All scans of a log.
    pub fn of_log(log: &LaserLog) -> impl Iterator<Item = Self> + '_ {
        log.scans.iter().map(|scan| {
            let positions = scan.points().into_iter().map(|[x, y]| Vec3::new(x, y, 0.0)).collect();
            Self {
                cloud: PointCloud::from_positions(positions),
                max_range: scan.max_range,
                T_robot_laser: log.T_robot_laser,
                index: scan.number,
                time: scan.time,
                reference: scan.reference,
                odometry: scan.odometry,
            }
        })
    }
}

/// The motion of the laser from the scan before to each scan, where odometry gives one.
pub fn first_guesses(source: OdometrySource, scans: &[RecordedScan], given: Option<&Trajectory>) -> Vec<Option<Pose2>> {
    let poses: Vec<Option<Pose2>> = match (source, given) {
        (OdometrySource::None, _) | (OdometrySource::Auto | OdometrySource::File, None) => vec![None; scans.len()],
        (OdometrySource::Log, None) => scans.iter().map(|scan| scan.odometry).collect(),
        (_, Some(given)) => poses_of(scans, given),
    };
    let motion = |frame: usize| {
        let before = frame.checked_sub(1)?;
        let T_world_before = poses[before]? * scans[before].T_robot_laser;
        Some(T_world_before.inverse() * poses[frame]? * scans[frame].T_robot_laser)
    };
    (0..scans.len()).map(motion).collect()
}

/// Further than this (s) from a scan, odometry says nothing of it.
const MAX_GAP: f64 = 1.0;

/// The pose that a trajectory has for each scan: by time where both have times and those meet; as many poses as scans in
/// their order; otherwise by the number of the scan.
fn poses_of(scans: &[RecordedScan], given: &Trajectory) -> Vec<Option<Pose2>> {
    let Some(poses) = given.poses() else { return vec![None; scans.len()] };
    let planar = |pose: &crate::geometry::Pose3| {
        let (_, _, heading) = Rotation3::from(pose.rotation).euler_angles();
        Pose2::new(pose.translation.vector.xy(), heading)
    };
    let poses: Vec<Pose2> = poses.iter().map(planar).collect();
    if let Some(stamps) = &given.stamps {
        let by_time = by_time(scans, stamps, &poses);
        if 2 * by_time.iter().flatten().count() > scans.len() {
            return by_time;
        }
    }
    if poses.len() == scans.len() {
        return poses.into_iter().map(Some).collect();
    }
    let of_number = |number: usize| match &given.stamps {
        Some(stamps) => poses.get(stamps.iter().position(|&stamp| (stamp - number as f64).abs() < 1e-6)?).copied(),
        None => poses.get(number).copied(),
    };
    scans.iter().map(|scan| of_number(scan.index)).collect()
}

/// Between the two poses before and after a scan, in proportion.
fn by_time(scans: &[RecordedScan], stamps: &[f64], poses: &[Pose2]) -> Vec<Option<Pose2>> {
    let mut order: Vec<usize> = (0..stamps.len()).collect();
    order.sort_by(|&a, &b| stamps[a].total_cmp(&stamps[b]));
    let at = |scan: &RecordedScan| {
        let time = scan.time?;
        let after = order.partition_point(|&index| stamps[index] < time);
        let later = order.get(after).copied();
        if let Some(later) = later.filter(|&later| stamps[later] == time) {
            return Some(poses[later]);
        }
        let (earlier, later) = (*order.get(after.checked_sub(1)?)?, later?);
        let gap = stamps[later] - stamps[earlier];
        if time - stamps[earlier] > MAX_GAP || stamps[later] - time > MAX_GAP || gap <= 0.0 {
            return None;
        }
        let motion = (poses[earlier].inverse() * poses[later]).log();
        Some(poses[earlier] * Pose2::exp(&(motion * ((time - stamps[earlier]) / gap))))
    };
    scans.iter().map(at).collect()
}
