//! Straightens a sweep that was measured by a moving sensor.

use glam::Vec3;
use nalgebra::{Vector3, Vector6};

use crate::geometry::{PointCloud, Pose3, RigidMotion};

/// The points of a sweep in the frame of the sensor at `time` (s, as the points' times), where it moves with a constant velocity: the
/// tangent of its motion in its own frame in a second (rotation first). A cloud without times stays as it is.
///
/// `T_world_sensor(t) = T_world_sensor(time) * exp((t - time) * velocity)`, as in Vizzo et al., "KISS-ICP", RA-L 8 (2023), section
/// III-A.
pub fn deskew(cloud: PointCloud, velocity: &Vector6<f64>, time: f64) -> PointCloud {
    let Some(times) = &cloud.times else { return cloud };
    let moved = |(position, offset): (&Vec3, &f32)| {
        let T = <Pose3 as RigidMotion>::exp(&(velocity * (times.origin + f64::from(*offset) - time)));
        let point = T.rotation * Vector3::from(position.as_dvec3().to_array()) + T.translation.vector;
        Vec3::new(point.x as f32, point.y as f32, point.z as f32)
    };
    let positions = cloud.positions.iter().zip(&times.offsets).map(moved).collect();
    PointCloud { positions, times: None, ..cloud }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PointTimes;

    #[test]
    fn a_point_that_stands_still_is_one_point_again() {
        let velocity = Vector6::new(0.1, -0.3, 1.5, 4.0, 1.0, -0.5);
        let world = Vector3::new(5.0, -3.0, 1.0);
        let offsets: Vec<f32> = (0..11).map(|step| 0.01 * step as f32).collect();
        let seen = |offset: &f32| {
            let T_stamp_sensor = <Pose3 as RigidMotion>::exp(&(velocity * f64::from(*offset)));
            let point = T_stamp_sensor.inverse() * nalgebra::Point3::from(world);
            Vec3::new(point.x as f32, point.y as f32, point.z as f32)
        };
        let positions: Vec<Vec3> = offsets.iter().map(seen).collect();
        assert!(positions[0].distance(positions[10]) > 0.5);
        let times = Some(PointTimes { origin: 0.0, offsets });
        let sweep = PointCloud { times, ..PointCloud::from_positions(positions.clone()) };
        for (time, expected) in [(0.0, positions[0]), (0.05, positions[5]), (0.1, positions[10])] {
            let straight = deskew(sweep.clone(), &velocity, time);
            assert!(straight.positions.iter().all(|point| point.distance(expected) < 1e-5), "{time}");
            assert_eq!(straight.times, None);
        }
        let still = PointCloud::from_positions(positions);
        assert_eq!(deskew(still.clone(), &velocity, 0.0), still);
    }
}
