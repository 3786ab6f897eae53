//! The pose convention of a reference: files seldom state the order of the quaternion, the directions of the camera's axes and
//! whether a pose maps camera to world or world to camera.
//!
//! Under the right convention the motions between consecutive frames of the reference equal the estimated ones. The
//! convention with the smallest difference is chosen, after the estimation and without any effect on the estimate.

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};

use crate::geometry::Pose3;
use crate::geometry::pose_distance::pose_distance;
use crate::geometry::quantile::quantile;
pub use crate::io::trajectory::QuaternionOrder;
use crate::io::trajectory::{Trajectory, TrajectoryFormat};

/// Directions of a sensor's axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum SensorAxes {
    /// x right, y down, z forward: OpenCV, ROS optical frames, this engine.
    Opencv,
    /// x right, y up, z backward: OpenGL, three.js, Habitat.
    Opengl,
    /// x forward, y left, z up: ROS body frames.
    Robotics,
}

impl SensorAxes {
    /// Rotates coordinates along this engine's camera axes into coordinates along these axes.
    fn R_axes_opencv(self) -> UnitQuaternion<f64> {
        let rows = match self {
            Self::Opencv => return UnitQuaternion::identity(),
            Self::Opengl => Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0),
            Self::Robotics => Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0),
        };
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows))
    }
}

/// The frames that a pose maps between.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum PoseDirection {
    /// `T_world_sensor`.
    SensorToWorld,
    /// `T_sensor_world`.
    WorldToSensor,
}

/// How the numbers of a file are read as poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify), tsify(missing_as_null))]
pub struct PoseConvention {
    /// Order of the quaternions; `None` where the file has matrices.
    pub quaternion_order: Option<QuaternionOrder>,
    /// Axes of the sensor.
    pub sensor_axes: SensorAxes,
    /// The frames that a pose maps between.
    pub direction: PoseDirection,
    /// Whether world and sensor are left-handed, as renderers may have them.
    pub is_left_handed: bool,
}

/// The parts of the convention that are given; the others are found from the motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct KnownConvention {
    /// Order of the quaternions.
    pub quaternion_order: Option<QuaternionOrder>,
    /// Axes of the sensor.
    pub sensor_axes: Option<SensorAxes>,
    /// The frames that a pose maps between.
    pub direction: Option<PoseDirection>,
}

impl PoseConvention {
    /// The convention in words, for notes.
    pub fn words(self) -> String {
        let order = match self.quaternion_order {
            Some(QuaternionOrder::RealPartLast) => "quaternions qx qy qz qw, ",
            Some(QuaternionOrder::RealPartFirst) => "quaternions qw qx qy qz, ",
            None => "",
        };
        let axes = match self.sensor_axes {
            SensorAxes::Opencv => "x right, y down, z forward",
            SensorAxes::Opengl => "x right, y up, looking along -z",
            SensorAxes::Robotics => "x forward, y left, z up",
        };
        let direction = match self.direction {
            PoseDirection::SensorToWorld => "camera to world",
            PoseDirection::WorldToSensor => "world to camera",
        };
        let hand = if self.is_left_handed { ", left-handed: y was mirrored" } else { "" };
        format!("{order}camera axes {axes}, poses from {direction}{hand}")
    }

    /// A pose of the file as `T_world_sensor` with this engine's sensor axes, in the file's world frame. `read_order` is the
    /// quaternion order that the reader has assumed.
    fn apply(self, pose: &Pose3, read_order: QuaternionOrder) -> Pose3 {
        let rotation = match self.quaternion_order {
            Some(order) if order != read_order => reordered(&pose.rotation, read_order),
            _ => pose.rotation,
        };
        let pose = Isometry3::from_parts(pose.translation, rotation);
        let pose = if self.is_left_handed { mirrored(&pose) } else { pose };
        let T_world_sensor = if self.direction == PoseDirection::WorldToSensor { pose.inverse() } else { pose };
        T_world_sensor * self.sensor_axes.R_axes_opencv()
    }
}

/// The pose where y points the other way in both frames.
fn mirrored(pose: &Pose3) -> Pose3 {
    let (t, q) = (pose.translation, pose.rotation);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q.w, -q.i, q.j, -q.k));
    Isometry3::from_parts(Translation3::new(t.x, -t.y, t.z), rotation)
}

/// The same four numbers of a file, read in the other order.
pub(super) fn reordered(q: &UnitQuaternion<f64>, read_order: QuaternionOrder) -> UnitQuaternion<f64> {
    let other = match read_order {
        QuaternionOrder::RealPartFirst => Quaternion::new(q.k, q.w, q.i, q.j),
        QuaternionOrder::RealPartLast => Quaternion::new(q.i, q.j, q.k, q.w),
    };
    UnitQuaternion::from_quaternion(other)
}

/// Largest ratio of misfits for which a less usual convention replaces the best one before it in the list.
pub(super) const MAX_MISFIT_RATIO: f64 = 0.8;
/// The same of a left-handed one: hardly any file has it.
const MAX_LEFT_HANDED_RATIO: f64 = 0.5;
/// Misfits (m) below this one are rounding errors of files.
pub(super) const MISFIT_ROUNDING: f64 = 1e-6;

/// The poses of a reference as `T_world_sensor` with this engine's axes, and the convention found.
///
/// `partners` are pairs of an estimated pose and the index of its pose in the reference, in the order of the recording.
/// `None` where the reference has no orientations.
pub fn interpret(
    reference: &Trajectory,
    format: TrajectoryFormat,
    partners: &[(Pose3, usize)],
    known: KnownConvention,
) -> Option<(Vec<Pose3>, PoseConvention)> {
    let mut best: Option<(f64, (PoseConvention, Vec<Pose3>))> = None;
    let right_handed = readings(reference, format, known, false)?;
    for reading in right_handed.into_iter().chain(readings(reference, format, known, true)?) {
        let misfit = misfit(&reading.1, partners);
        let ratio = if reading.0.is_left_handed { MAX_LEFT_HANDED_RATIO } else { MAX_MISFIT_RATIO };
        let is_better = best.as_ref().is_none_or(|(least, _)| misfit + MISFIT_ROUNDING < ratio * least);
        if is_better {
            best = Some((misfit, reading));
        }
    }
    best.map(|(_, (convention, poses))| (poses, convention))
}

/// The poses of a trajectory as `T_world_sensor` with this engine's axes, under every convention that agrees with `known`,
/// the usual ones first; `None` where the trajectory has no orientations.
pub(crate) fn readings(
    trajectory: &Trajectory,
    format: TrajectoryFormat,
    known: KnownConvention,
    is_left_handed: bool,
) -> Option<Vec<(PoseConvention, Vec<Pose3>)>> {
    let poses = trajectory.poses()?;
    let read_order = match format {
        TrajectoryFormat::Tum => QuaternionOrder::RealPartLast,
        _ => QuaternionOrder::RealPartFirst,
    };
    let has_quaternions = trajectory.rotation_matrices.is_none();
    let read = |convention: PoseConvention| {
        let convention = PoseConvention { is_left_handed, ..convention };
        (convention, poses.iter().map(|pose| convention.apply(pose, read_order)).collect())
    };
    Some(candidates(read_order, has_quaternions, known).map(read).collect())
}

/// Every convention that agrees with `known`, the usual ones first.
fn candidates(
    read_order: QuaternionOrder,
    has_quaternions: bool,
    known: KnownConvention,
) -> impl Iterator<Item = PoseConvention> {
    let orders = match known.quaternion_order {
        _ if !has_quaternions => vec![None],
        Some(order) => vec![Some(order)],
        None => vec![Some(read_order), Some(read_order.other())],
    };
    let directions = known
        .direction
        .map_or_else(|| vec![PoseDirection::SensorToWorld, PoseDirection::WorldToSensor], |direction| vec![direction]);
    let axes = known
        .sensor_axes
        .map_or_else(|| vec![SensorAxes::Opencv, SensorAxes::Opengl, SensorAxes::Robotics], |axes| vec![axes]);
    orders.into_iter().flat_map(move |quaternion_order| {
        let axes = axes.clone();
        directions.clone().into_iter().flat_map(move |direction| {
            axes.clone().into_iter().map(move |sensor_axes| PoseConvention {
                quaternion_order,
                sensor_axes,
                direction,
                is_left_handed: false,
            })
        })
    })
}

/// Median difference (m) between the motions of consecutive frames in the estimate and in the reference.
fn misfit(poses: &[Pose3], partners: &[(Pose3, usize)]) -> f64 {
    let mut misfits: Vec<f64> = partners
        .windows(2)
        .filter_map(|pair| {
            let (from, to) = (poses.get(pair[0].1)?, poses.get(pair[1].1)?);
            let estimated = pair[0].0.inverse() * pair[1].0;
            Some(pose_distance(&(from.inverse() * to), &estimated))
        })
        .collect();
    quantile(&mut misfits, 0.5).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::RigidMotion;
    use nalgebra::Vector6;

    /// A walk with rotations about several axes.
    fn walk() -> Vec<Pose3> {
        let step = |i: u32| {
            let i = f64::from(i);
            Vector6::new(0.02 * i.sin(), 0.15, 0.03 * i.cos(), 0.1, 0.02, 0.25)
        };
        (0..20).fold(vec![Pose3::identity()], |mut poses, i| {
            let last = poses[poses.len() - 1];
            poses.push(last * <Pose3 as RigidMotion>::exp(&step(i)));
            poses
        })
    }

    #[test]
    fn every_convention_is_found_from_the_motions() {
        let truth = walk();
        let partners: Vec<(Pose3, usize)> = truth.iter().copied().zip(0..).collect();
        let world = Isometry3::rotation(nalgebra::Vector3::new(0.3, -0.8, 1.1));
        for sensor_axes in [SensorAxes::Opencv, SensorAxes::Opengl, SensorAxes::Robotics] {
            for direction in [PoseDirection::SensorToWorld, PoseDirection::WorldToSensor] {
                for (order, format, is_left_handed) in [
                    (QuaternionOrder::RealPartFirst, TrajectoryFormat::Npy, false),
                    (QuaternionOrder::RealPartLast, TrajectoryFormat::Npy, false),
                    (QuaternionOrder::RealPartLast, TrajectoryFormat::Tum, false),
                    (QuaternionOrder::RealPartLast, TrajectoryFormat::Tum, true),
                ] {
                    let written = truth.iter().map(|pose| {
                        let pose = world * pose * sensor_axes.R_axes_opencv().inverse();
                        let pose = if direction == PoseDirection::WorldToSensor { pose.inverse() } else { pose };
                        let pose = if is_left_handed { mirrored(&pose) } else { pose };
                        let is_swapped = order == QuaternionOrder::RealPartLast && format == TrajectoryFormat::Npy;
                        // The reader of this form takes the first number for the real part.
                        let q = pose.rotation;
                        let as_read = if is_swapped { Quaternion::new(q.i, q.j, q.k, q.w) } else { *q.quaternion() };
                        Isometry3::from_parts(pose.translation, UnitQuaternion::from_quaternion(as_read))
                    });
                    let file = Trajectory::from_poses(&written.collect::<Vec<_>>());
                    let (poses, found) = interpret(&file, format, &partners, KnownConvention::default()).unwrap();
                    let quaternion_order = Some(order);
                    let expected = PoseConvention { quaternion_order, sensor_axes, direction, is_left_handed };
                    assert_eq!(found, expected);
                    for (pose, expected) in poses.iter().zip(&truth) {
                        let off = (poses[0].inverse() * pose).inverse() * expected;
                        assert!(off.translation.vector.norm() + off.rotation.angle() < 1e-9);
                    }
                }
            }
        }
    }

    #[test]
    fn known_parts_are_kept_and_a_camera_at_rest_leaves_the_usual_convention() {
        let still: Vec<(Pose3, usize)> = (0..5).map(|index| (Pose3::identity(), index)).collect();
        let file = Trajectory::from_poses(&[Pose3::identity(); 5]);
        let known = KnownConvention { sensor_axes: Some(SensorAxes::Robotics), ..KnownConvention::default() };
        let (_, found) = interpret(&file, TrajectoryFormat::Tum, &still, known).unwrap();
        assert_eq!(found.sensor_axes, SensorAxes::Robotics);
        assert_eq!(found.direction, PoseDirection::SensorToWorld);
        let (_, found) = interpret(&file, TrajectoryFormat::Tum, &still, KnownConvention::default()).unwrap();
        assert_eq!(
            (found.sensor_axes, found.quaternion_order),
            (SensorAxes::Opencv, Some(QuaternionOrder::RealPartLast))
        );
        assert!(found.words().contains("qx qy qz qw") && found.words().contains("camera to world"));
        assert_eq!(interpret(&Trajectory::default(), TrajectoryFormat::Tum, &still, known), None);
    }
}
