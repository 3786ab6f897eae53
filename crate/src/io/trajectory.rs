//! Stand-in until the real reader lands.
#![allow(missing_docs, clippy::all, clippy::pedantic)]
use crate::geometry::{Pose2, Pose3};
use nalgebra::{UnitQuaternion, Vector3};
pub struct Trajectory {
    pub stamps: Option<Vec<f64>>,
    pub positions: Vec<Vector3<f64>>,
    pub orientations: Option<Vec<UnitQuaternion<f64>>>,
}
impl Trajectory {
    pub fn from_poses(poses: impl Iterator<Item = Pose3>) -> Self {
        let p: Vec<Pose3> = poses.collect();
        Self {
            stamps: Some((0..p.len()).map(|i| i as f64).collect()),
            positions: p.iter().map(|p| p.translation.vector).collect(),
            orientations: Some(p.iter().map(|p| p.rotation).collect()),
        }
    }
}
pub fn lift(pose: &Pose2) -> Pose3 {
    Pose3::from_parts(
        nalgebra::Translation3::new(pose.translation.x, pose.translation.y, 0.0),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.rotation.angle()),
    )
}
pub fn read(bytes: &[u8]) -> crate::Result<Trajectory> {
    let t = String::from_utf8_lossy(bytes);
    let rows: Vec<Vec<f64>> = t
        .lines()
        .filter(|l| !l.starts_with('#') && !l.trim().is_empty())
        .map(|l| l.split_whitespace().filter_map(|w| w.parse().ok()).collect())
        .collect();
    let tum = rows.first().is_some_and(|r| r.len() == 8);
    Ok(Trajectory {
        stamps: None,
        positions: rows
            .iter()
            .map(
                |r| {
                    if tum {
                        Vector3::new(r[1], r[2], r[3])
                    } else {
                        Vector3::new(r[0], r[1], *r.get(2).unwrap_or(&0.0))
                    }
                },
            )
            .collect(),
        orientations: tum.then(|| {
            rows.iter()
                .map(|r| UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(r[7], r[4], r[5], r[6])))
                .collect()
        }),
    })
}
pub fn write_tum(t: &Trajectory) -> String {
    t.positions
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let q = t.orientations.as_ref().unwrap()[i];
            format!("{i} {} {} {} {} {} {} {}\n", p.x, p.y, p.z, q.i, q.j, q.k, q.w)
        })
        .collect()
}
pub fn matrix_text(p: &Pose3) -> String {
    format!("{}", p.to_homogeneous())
}
