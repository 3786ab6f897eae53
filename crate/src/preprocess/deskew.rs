//! Straightens a sweep that was measured by a moving sensor.

use glam::Vec3;
use nalgebra::{Vector3, Vector6};

use crate::geometry::{PointCloud, PointTimes, Pose3, RigidMotion};

/// Times during a sweep at which its motion is computed. Between them it is linear: half a step of a sweep that turns by 1.7 rad is 8e-4 rad, and what is
/// of second order 3e-7 of the range.
const NUM_KNOTS: usize = 1024;

/// The points of a sweep in the frame of the sensor at `time` (s, as the points' times), where it moves with a constant velocity: the
/// tangent of its motion in its own frame in a second (rotation first). A cloud without times stays as it is.
///
/// `T_world_sensor(t) = T_world_sensor(time) * exp((t - time) * velocity)`, as in Vizzo et al., "KISS-ICP", RA-L 8 (2023), section
/// III-A.
pub fn deskew(cloud: PointCloud, velocity: &Vector6<f64>, time: f64) -> PointCloud {
    let Some(times) = cloud.times.as_ref().filter(|_| *velocity != Vector6::zeros()) else {
        return PointCloud { times: None, ..cloud };
    };
    let motion = SweepMotion::new(times, velocity, time);
    let positions =
        cloud.positions.iter().zip(&times.offsets).map(|(point, &offset)| motion.point(point, offset)).collect();
    let normals = cloud.normals.as_ref().map(|normals| motion.turned(normals, times));
    PointCloud { positions, normals, times: None, ..cloud }
}

/// The motion of the sensor during a sweep, from a time of it.
pub(crate) struct SweepMotion {
    knots: Vec<Pose3>,
    /// Time between two knots (s).
    step: f64,
    turn: Vector3<f64>,
    shift: Vector3<f64>,
}

impl SweepMotion {
    /// With this velocity, from `time` (s, as the points' times); see [`deskew`].
    pub fn new(times: &PointTimes, velocity: &Vector6<f64>, time: f64) -> Self {
        let (step, start) = (times.span() / NUM_KNOTS as f64, times.origin - time);
        let knot = |knot: usize| <Pose3 as RigidMotion>::exp(&(velocity * (start + step * knot as f64)));
        let [turn, shift] = [0, 3].map(|first| velocity.fixed_rows::<3>(first).into_owned());
        Self { knots: (0..=NUM_KNOTS).map(knot).collect(), step, turn, shift }
    }

    /// Directions of points at these times, in the frame of the sensor at the time of the motion; zero stays zero.
    pub fn turned(&self, directions: &[Vec3], times: &PointTimes) -> Vec<Vec3> {
        let each = directions.iter().zip(&times.offsets);
        each.map(|(direction, &offset)| self.direction(direction, offset)).collect()
    }

    /// The knot that is nearest to a time after the first one, and the time from there (s).
    fn near(&self, offset: f32) -> (&Pose3, f64) {
        let place = if self.step > 0.0 { (f64::from(offset) / self.step + 0.5) as usize } else { 0 };
        (&self.knots[place], f64::from(offset) - self.step * place as f64)
    }

    fn point(&self, point: &Vec3, offset: f32) -> Vec3 {
        let ((T, since), point) = (self.near(offset), double(point));
        single(T.rotation * (point + (self.turn.cross(&point) + self.shift) * since) + T.translation.vector)
    }

    fn direction(&self, direction: &Vec3, offset: f32) -> Vec3 {
        if *direction == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let ((T, since), direction) = (self.near(offset), double(direction));
        single(T.rotation * (direction + self.turn.cross(&direction) * since))
    }
}

fn double(v: &Vec3) -> Vector3<f64> {
    Vector3::from(v.as_dvec3().to_array())
}

fn single(v: Vector3<f64>) -> Vec3 {
    Vec3::new(v.x as f32, v.y as f32, v.z as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_the_knots_the_motion_is_that_at_the_point() {
        let (velocity, time) = (Vector6::new(1.0, -3.0, 17.0, 30.0, 1.0, -5.0), 0.02);
        let offsets: Vec<f32> = (0..5000).map(|step| 0.1 * step as f32 / 4999.0).collect();
        let positions: Vec<Vec3> = (0..5000).map(|step| Vec3::new(20.0, (step % 41) as f32 - 20.0, 3.0)).collect();
        let times = Some(PointTimes { origin: -0.01, offsets: offsets.clone() });
        let sweep =
            PointCloud { times, normals: Some(vec![Vec3::X; 5000]), ..PointCloud::from_positions(positions.clone()) };
        let straight = deskew(sweep, &velocity, time);
        for (step, offset) in offsets.iter().enumerate() {
            let T = <Pose3 as RigidMotion>::exp(&(velocity * (f64::from(*offset) - 0.01 - time)));
            let expected = T.rotation * Vector3::from(positions[step].as_dvec3().to_array()) + T.translation.vector;
            let found = Vector3::from(straight.positions[step].as_dvec3().to_array());
            assert!((found - expected).norm() < 2e-5, "{step}: {found} {expected}");
            let normal = Vector3::from(straight.normals.as_ref().unwrap()[step].as_dvec3().to_array());
            assert!((normal - T.rotation * Vector3::x()).norm() < 1e-6, "{step}");
        }
    }

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
