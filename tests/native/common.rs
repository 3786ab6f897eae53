//! What several files of tests have in common.

use std::io::Write;
use std::path::{Path, PathBuf};

use glam::Vec3;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use scanstitch::geometry::{PointCloud, Pose3, RigidMotion};
use scanstitch::io::{depth_image, ply, trajectory};

/// A file or folder of the recordings in `../shared/data`. Where it is absent, the test that asks for it is to return:
/// it has been skipped, as a line on the standard error output says, which `npm test` counts.
pub fn shared_data(path: &str) -> Option<PathBuf> {
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(path);
    if found.exists() {
        return Some(found);
    }
    // Written directly: what a test prints with a macro is shown only where the test fails.
    let line = format!("skipped: ../shared/data/{path} is absent\n");
    std::io::stderr().write_all(line.as_bytes()).expect("the standard error output can be written");
    None
}

/// The numbers of a text.
pub fn numbers(path: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(path).unwrap();
    text.split_whitespace().map(|token| token.parse().unwrap()).collect()
}

/// The pose of a matrix, given row by row.
pub fn pose_of(rows: &[f64]) -> Pose3 {
    let rotation = Rotation3::from_matrix(&Matrix3::from_fn(|row, column| rows[4 * row + column]));
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Isometry3::from_parts(Translation3::new(rows[3], rows[7], rows[11]), rotation)
}

/// Metres and degrees from the truth.
pub fn error_of(truth: &Pose3, found: &Pose3) -> (f64, f64) {
    let error = truth.inverse() * found;
    (error.translation_norm(), error.rotation_angle().to_degrees())
}

/// The source and the target of KITTI's pair, and `T_target_source`.
pub fn kitti_pair(folder: &Path) -> ([PointCloud; 2], Pose3) {
    let clouds = ["source.ply", "target.ply"].map(|name| {
        PointCloud::from_positions(ply::read(&std::fs::read(folder.join(name)).unwrap()).unwrap().positions)
    });
    (clouds, pose_of(&numbers(&folder.join("T_target_source.txt"))))
}

/// `T_world_camera` of rendered rooms; the file's camera looks along -z with y up.
pub fn apartment_truth(folder: &Path) -> Vec<Pose3> {
    let truth = trajectory::read(&std::fs::read(folder.join("GT_pose.npy")).unwrap()).unwrap();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    truth.poses().unwrap().iter().map(|pose| pose * turn).collect()
}

/// A frame of rendered rooms, every pixel a point.
pub fn apartment_cloud(folder: &Path, frame: usize) -> PointCloud {
    let image = depth_image::read(&std::fs::read(folder.join(format!("depth/{frame}.png"))).unwrap()).unwrap();
    let pixels = image.values.iter().enumerate().filter(|(_, value)| **value > 0);
    let points = pixels.map(|(pixel, &value)| {
        let z = f32::from(value) * 10.0 / 255.0;
        let (u, v) = ((pixel % image.width) as f32, (pixel / image.width) as f32);
        Vec3::new((u - 256.0) / 256.0 * z, (v - 256.0) / 256.0 * z, z)
    });
    PointCloud::from_positions(points.collect())
}
