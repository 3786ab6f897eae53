//! The recording of a drive, with the exact reference poses.

use nalgebra::Vector2;

use super::laser::Laser;
use super::random::Random;
use super::world::World;
use scanstitch::geometry::Pose2;

/// A drive with its ground truth.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanarRecording {
    /// The obstacles, in the frame of the first pose.
    pub world: World,
    /// Returns of each scan in the sensor's frame (m).
    pub scans: Vec<Vec<Vector2<f64>>>,
    /// Pose of the sensor at each scan, in the frame of the first.
    pub T_world_sensor: Vec<Pose2>,
}

impl PlanarRecording {
    /// Drives the laser along a path through a building; both are given in the building's frame.
    pub(super) fn new(building: &World, path: &[Pose2], laser: &Laser, random: &mut Random) -> Self {
        let T_world_building = path.first().map(Pose2::inverse).unwrap_or_default();
        let world = building.moved(&T_world_building);
        let T_world_sensor: Vec<Pose2> = path.iter().map(|pose| T_world_building * pose).collect();
        let scans = T_world_sensor.iter().map(|pose| laser.scan(&world, pose, random)).collect();
        Self { world, scans, T_world_sensor }
    }
}
