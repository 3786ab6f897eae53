//! Sharpness of maps without any truth, on real depth images: ground-truth poses make sharper maps than shaken ones.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::shared_data;
use nalgebra::{Isometry3, Matrix4, Translation3, UnitQuaternion, Vector3};
use scanstitch::camera::Pinhole;
use scanstitch::evaluation::frame_clouds::{FrameClouds, FrameResidual, FrameResidualOptions};
use scanstitch::evaluation::map_quality::{MapQuality, MapQualityOptions, map_quality};
use scanstitch::geometry::Pose3;
use scanstitch::io::{depth_image, trajectory};
use scanstitch::preprocess::depth_cloud::depth_cloud;
use scanstitch::preprocess::depth_surfels::DepthModel;
use scanstitch::preprocess::wrap_around::usable_pixels;
use scanstitch_scene::random::Random;

/// Standard deviation of the shaking along each axis (m).
const SHAKES: [f64; 4] = [0.0, 0.01, 0.02, 0.05];

/// A recording: how its depth images are to be read, and the true `T_world_camera` of each.
struct Recording {
    name: &'static str,
    images: Vec<PathBuf>,
    camera: Pinhole,
    model: DepthModel,
    poses: Vec<Pose3>,
}

/// Depth of 8 bits is truncated: the true one lies half a step further in the mean.
fn apartment(folder: &Path, name: &'static str) -> Recording {
    let truth = trajectory::read(&fs::read(folder.join(name).join("GT_pose.npy")).unwrap()).unwrap();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let poses: Vec<Pose3> = truth.poses().unwrap().iter().map(|pose| pose * turn).collect();
    let image = |number: usize| folder.join(name).join(format!("depth/{number}.png"));
    Recording {
        name,
        images: (1..=poses.len()).map(image).collect(),
        camera: Pinhole::new(512, 512, [256.0; 4]).unwrap(),
        model: DepthModel { step: 10.0 / 255.0, offset: 0.5, square_noise: 0.0, min_range: 0.3, max_range: 8.0 },
        poses,
    }
}

fn fusion_demo(folder: &Path) -> Recording {
    let folder = folder.join("fusion_demo50/rgbd-frames");
    let mut images: Vec<PathBuf> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    images.retain(|path| path.to_string_lossy().ends_with("depth.png"));
    images.sort();
    let pose_of = |path: &PathBuf| {
        let text = fs::read_to_string(path.to_string_lossy().replace("depth.png", "pose.txt")).unwrap();
        let numbers: Vec<f64> = text.split_whitespace().map(|word| word.parse().unwrap()).collect();
        let matrix = Matrix4::from_row_slice(&numbers);
        let rotation = UnitQuaternion::from_matrix(&matrix.fixed_view::<3, 3>(0, 0).into_owned());
        Isometry3::from_parts(Translation3::new(matrix[(0, 3)], matrix[(1, 3)], matrix[(2, 3)]), rotation)
    };
    Recording {
        name: "fusion_demo50",
        poses: images.iter().map(pose_of).collect(),
        images,
        camera: Pinhole::new(640, 480, [585.0, 585.0, 320.0, 240.0]).unwrap(),
        model: DepthModel { step: 0.001, offset: 0.0, square_noise: 0.0, min_range: 0.3, max_range: 4.0 },
    }
}

fn clouds(recording: &Recording) -> FrameClouds {
    let mut clouds = FrameClouds::new();
    for path in &recording.images {
        let image = depth_image::read(&fs::read(path).unwrap()).unwrap();
        let usable = usable_pixels(&image);
        clouds.push(&depth_cloud(&image, &usable, &recording.camera, &recording.model, None)).unwrap();
    }
    clouds
}

fn shaken(poses: &[Pose3], shake: f64) -> Vec<Pose3> {
    let mut random = Random::new(11);
    let mut off = || shake * random.normal();
    let moved = |pose: &Pose3| Translation3::new(off(), off(), off()) * pose;
    poses.iter().map(moved).collect()
}

fn judged(clouds: &FrameClouds, poses: &[Pose3]) -> (MapQuality, FrameResidual) {
    let map = clouds.map(poses).unwrap();
    // Where 50 frames see one wall, the nearest points around a point are a thin slice of the blur: the radius must reach
    // through all of it.
    let options = MapQualityOptions { radius: 0.2, max_points: 2000, ..MapQualityOptions::default() };
    let residual = clouds.residual(poses, &FrameResidualOptions { max_points: 2000, ..Default::default() });
    (map_quality(&map, &options).unwrap(), residual.unwrap())
}

#[test]
fn shaken_poses_of_real_depth_images_blur_the_map() {
    let Some(folder) = shared_data("rgbd") else { return };
    for recording in [apartment(&folder, "apartment_first_floor"), fusion_demo(&folder)] {
        let clouds = clouds(&recording);
        let found = SHAKES.map(|shake| judged(&clouds, &shaken(&recording.poses, shake)));
        for (shake, (map, residual)) in SHAKES.iter().zip(&found) {
            println!(
                "{}, {shake} m: entropy {:.4}, plane variance {:.1} mm^2, residual {:.2} mm over {} pairs of {} overlaps",
                recording.name,
                map.mean_map_entropy,
                1e6 * map.mean_plane_variance,
                1e3 * residual.mean_residual,
                residual.num_pairs,
                residual.num_overlaps,
            );
        }
        for pair in found.windows(2) {
            let [(map, residual), (blurred_map, blurred)] = pair else { unreachable!() };
            assert!(map.mean_map_entropy < blurred_map.mean_map_entropy, "{}: {pair:?}", recording.name);
            assert!(map.mean_plane_variance < blurred_map.mean_plane_variance, "{}: {pair:?}", recording.name);
            assert!(residual.mean_residual < blurred.mean_residual, "{}: {pair:?}", recording.name);
        }
    }
}
