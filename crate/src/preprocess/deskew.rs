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
    let motion = |offset: &f32| <Pose3 as RigidMotion>::exp(&(velocity * (times.origin + f64::from(*offset) - time)));
    let motions: Vec<Pose3> = times.offsets.iter().map(motion).collect();
    let double = |v: &Vec3| Vector3::from(v.as_dvec3().to_array());
    let single = |v: Vector3<f64>| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
    let moved = |(point, T): (&Vec3, &Pose3)| single(T.rotation * double(point) + T.translation.vector);
    let turned = |(normal, T): (&Vec3, &Pose3)| single(T.rotation * double(normal));
    let positions = cloud.positions.iter().zip(&motions).map(moved).collect();
    let normals = cloud.normals.as_ref().map(|normals| normals.iter().zip(&motions).map(turned).collect());
    PointCloud { positions, normals, times: None, ..cloud }
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
        let faced = |offset: &f32| {
            let normal = <Pose3 as RigidMotion>::exp(&(-f64::from(*offset) * velocity)).rotation * Vector3::x();
            Vec3::new(normal.x as f32, normal.y as f32, normal.z as f32)
        };
        let normals: Vec<Vec3> = offsets.iter().map(faced).collect();
        assert!(positions[0].distance(positions[10]) > 0.5 && normals[0].distance(normals[10]) > 0.1);
        let times = Some(PointTimes { origin: 0.0, offsets });
        let sweep =
            PointCloud { times, normals: Some(normals.clone()), ..PointCloud::from_positions(positions.clone()) };
        for (time, at) in [(0.0, 0), (0.05, 5), (0.1, 10)] {
            let straight = deskew(sweep.clone(), &velocity, time);
            assert!(straight.positions.iter().all(|point| point.distance(positions[at]) < 1e-5), "{time}");
            assert!(straight.normals.iter().flatten().all(|normal| normal.distance(normals[at]) < 1e-6), "{time}");
            assert_eq!(straight.times, None);
        }
        let still = PointCloud::from_positions(positions);
        assert_eq!(deskew(still.clone(), &velocity, 0.0), still);
    }
}
