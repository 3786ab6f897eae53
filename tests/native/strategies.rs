//! Strategies side by side, on the made-up flat and on recorded frames: what each one stores, and that each finds its way.

use std::fs;
use std::path::Path;

use crate::common::shared_data;
use glam::Vec3;
use nalgebra::{Isometry3, Point3, Vector3};
use scanstitch::geometry::PointCloud;
use scanstitch::io::trajectory;
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::voxel::{
    AddedPoints, KeptPoint, MapKind, Stages, ThresholdKind, VoxelOdometry, VoxelOdometryMetric, VoxelOdometryMotion,
    VoxelOdometrySettings,
};
use scanstitch::pipeline::prepared_frame::{FrameLabel, PreparedFrame};
use scanstitch::pipeline::spatial_settings::SpatialSettings;
use scanstitch::pipeline::strategies::{StrategyComparison, StrategyResult, strategy_presets};
use scanstitch_scene::random::Random;

const SAMPLE: &str = "www/samples/apartment";

/// Runs strategies over frames of a recording, counted from 1, and compares them with its truth.
fn run(
    folder: &Path,
    frames: std::ops::RangeInclusive<usize>,
    strategies: &[VoxelOdometrySettings],
) -> Vec<StrategyResult> {
    let mut comparison = StrategyComparison::new(strategies.to_vec(), SpatialSettings::default()).unwrap();
    let num_recorded = fs::read_dir(folder.join("depth")).unwrap().count();
    let truth = fs::read(folder.join("GT_pose.npy")).unwrap();
    let contents = trajectory::read_lenient(&truth, None).unwrap();
    comparison.set_reference("GT_pose.npy", contents, num_recorded);
    for number in frames {
        let name = format!("{number}.png");
        let depth = fs::read(folder.join("depth").join(&name)).unwrap();
        let decode_config = comparison.begin(&name, &depth).unwrap().clone();
        let label = FrameLabel { name, index: number - 1, time: None };
        comparison.offer(PreparedFrame::from_depth(&decode_config, label, &depth, None).unwrap()).unwrap();
        for strategy in 0..strategies.len() {
            assert!(comparison.step(strategy).is_some());
            assert!(comparison.step(strategy).is_none(), "a frame is placed once");
        }
    }
    (0..strategies.len()).map(|strategy| comparison.result(strategy, &[]).unwrap()).collect()
}

#[test]
fn every_preset_finds_its_way_through_the_flat_and_voxels_store_a_tenth() {
    let presets = strategy_presets();
    let settings: Vec<VoxelOdometrySettings> = presets.iter().map(|preset| preset.settings.clone()).collect();
    let results = run(Path::new(SAMPLE), 1..=12, &settings);
    for (preset, result) in presets.iter().zip(&results) {
        let name = preset.name;
        assert_eq!((result.frames.len(), result.num_lost), (12, 0), "{name}");
        let errors = result.comparison.as_ref().unwrap();
        assert!(errors.ape_mean < 0.04 && errors.num_matched == 12, "{name}: {}", errors.ape_mean);
        assert!(errors.rpe_mean.unwrap() < 0.04 && errors.rpe_rotation_mean.unwrap() < 0.01, "{name}");
        assert!(result.sharpness.is_some() && result.growth.is_some() && result.timing.is_none(), "{name}");
        assert!(result.frames.windows(2).all(|pair| pair[0].map_points <= pair[1].map_points), "{name}");
        assert_eq!(result.map_bytes, 24 * result.map_points);
    }
    let bytes = |name: &str| {
        let at = presets.iter().position(|preset| preset.name == name).unwrap();
        results[at].map_bytes
    };
    assert!(10 * bytes("voxels_0.1") < bytes("plain"));
    assert!(3 * bytes("voxels_0.3") < bytes("voxels_0.1"));
    assert!(bytes("golden_data") < bytes("voxels_0.1"));
    // A level camera on a floor: nothing but x and z, to the bit.
    let planar = &results[presets.iter().position(|preset| preset.name == "planar").unwrap()];
    assert!(planar.frames.iter().all(|frame| frame.T_world_sensor.y == 0.0 && frame.T_world_sensor.qx == 0.0));
}

#[test]
fn every_other_choice_works_as_well() {
    let voxels = VoxelOdometrySettings::default();
    let strategies = [
        VoxelOdometrySettings { points_per_voxel: 5, kept: KeptPoint::Newest, ..voxels.clone() },
        VoxelOdometrySettings { kept: KeptPoint::Mean, crop_distance: 4.0, ..voxels.clone() },
        VoxelOdometrySettings { map: MapKind::Whole, added: AddedPoints::Unmatched, ..voxels.clone() },
        VoxelOdometrySettings { threshold: ThresholdKind::Adaptive, stages: Stages::One, ..voxels },
    ];
    for result in run(Path::new(SAMPLE), 1..=8, &strategies) {
        let error = result.comparison.as_ref().unwrap().ape_mean;
        assert!(result.num_lost == 0 && error < 0.06, "{error} {:?}", result.settings);
    }
}

/// The same points seen from another place are found again to a tenth of a millimetre, by either metric and either map, in
/// the plane that the motion is held to.
#[test]
fn the_same_points_moved_are_found_again() {
    let mut random = Random::new(5);
    let mut uniform = |low: f64, high: f64| random.uniform(low, high);
    // The floor and two walls of a corner, none of it level with the other.
    let corner: Vec<Vector3<f64>> = (0..6000)
        .map(|i| match i % 3 {
            0 => Vector3::new(uniform(-2.0, 2.0), 1.0, uniform(1.0, 5.0)),
            1 => Vector3::new(uniform(-2.0, 2.0), uniform(-1.0, 1.0), 5.0),
            _ => Vector3::new(2.0, uniform(-1.0, 1.0), uniform(1.0, 5.0)),
        })
        .collect();
    let normals: Vec<Vec3> = (0..6000).map(|i| [Vec3::NEG_Y, Vec3::NEG_Z, Vec3::NEG_X][i % 3]).collect();
    let T_world_second = Isometry3::new(Vector3::new(0.03, 0.0, 0.05), Vector3::new(0.0, 0.02, 0.0));
    let seen_from = |T: &Isometry3<f64>| PointCloud {
        positions: corner
            .iter()
            .map(|p| T.inverse_transform_point(&Point3::from(*p)))
            .map(|p| Vec3::new(p.x as f32, p.y as f32, p.z as f32))
            .collect(),
        normals: Some(
            normals
                .iter()
                .map(|n| {
                    T.inverse_transform_vector(&Vector3::new(f64::from(n.x), f64::from(n.y), f64::from(n.z)))
                        .cast::<f32>()
                })
                .map(|n| Vec3::new(n.x, n.y, n.z))
                .collect(),
        ),
        ..PointCloud::default()
    };
    let fine =
        VoxelOdometrySettings { map_voxel_size: 0.01, source_voxel_size: 0.0, ..VoxelOdometrySettings::default() };
    for metric in [VoxelOdometryMetric::PointToPoint, VoxelOdometryMetric::PointToPlane] {
        for map in [MapKind::Whole, MapKind::Voxels] {
            for motion in [VoxelOdometryMotion::Free, VoxelOdometryMotion::Planar] {
                let settings = VoxelOdometrySettings { metric, map, motion, max_iterations: 200, ..fine.clone() };
                let mut odometry = VoxelOdometry::new(settings);
                odometry.register_frame(&seen_from(&Isometry3::identity()));
                let estimate = odometry.register_frame(&seen_from(&T_world_second));
                let off = T_world_second.inverse() * estimate.T_world_sensor;
                assert_eq!(estimate.status, Status::Good, "{metric:?} {map:?} {motion:?}: {}", estimate.reason);
                assert!(off.translation.vector.norm() < 1e-4, "{metric:?} {map:?} {motion:?}: {off}");
                assert!(off.rotation.angle() < 1e-4, "{metric:?} {map:?} {motion:?}: {off}");
            }
        }
    }
}

#[test]
fn many_frames_do_not_wear_the_poses_out() {
    let Some(second_floor) = shared_data("rgbd/apartment_second_floor") else { return };
    // Each prediction multiplies three poses: rounding that is let grow bends the path from about the 40th frame on.
    let free =
        VoxelOdometrySettings { map_voxel_size: 0.3, source_voxel_size: 0.3, ..VoxelOdometrySettings::default() };
    let [result] = &run(&second_floor, 1..=123, &[free])[..] else { panic!("one strategy") };
    for frame in &result.frames {
        let T = frame.T_world_sensor;
        let norm = (T.qx * T.qx + T.qy * T.qy + T.qz * T.qz + T.qw * T.qw).sqrt();
        assert!((norm - 1.0).abs() < 1e-12, "{}: {norm}", frame.name);
        assert_eq!(frame.status, Status::Good, "{}: {}", frame.name, frame.reason);
    }
    let errors = result.comparison.as_ref().unwrap();
    assert!(errors.ape_mean < 0.2, "{}", errors.ape_mean);
}

#[test]
fn what_cannot_be_is_refused_and_a_lost_frame_is_no_part_of_the_map() {
    let bad = VoxelOdometrySettings { map_voxel_size: -1.0, ..VoxelOdometrySettings::default() };
    let refused = StrategyComparison::new(vec![bad], SpatialSettings::default()).err().unwrap().to_string();
    assert!(refused.contains("map_voxel_size = -1"), "{refused}");

    let strategy = VoxelOdometrySettings { motion: VoxelOdometryMotion::PlanarXy, ..VoxelOdometrySettings::default() };
    let mut comparison = StrategyComparison::new(vec![strategy], SpatialSettings::default()).unwrap();
    assert!(comparison.step(0).is_none() && comparison.result(7, &[]).is_none());
    let first = fs::read(format!("{SAMPLE}/depth/1.png")).unwrap();
    let decode_config = comparison.begin("1.png", &first).unwrap().clone();
    let offer = |index, bytes: &[u8]| {
        let label = FrameLabel { name: format!("{index}.png"), index, time: None };
        PreparedFrame::from_depth(&decode_config, label, bytes, None).unwrap()
    };
    comparison.offer(offer(3, &first)).unwrap();
    comparison.step(0).unwrap();
    let error = comparison.offer(offer(3, &first)).unwrap_err().to_string();
    assert!(error.contains("in the order of the recording"), "{error}");
    // A wall right before the camera, where there was a room.
    let wall = scanstitch::camera::DepthImage { width: 512, height: 512, bits: 8, values: vec![4; 512 * 512] };
    let mut encoded = Vec::new();
    encode(&wall, &mut encoded);
    comparison.offer(offer(4, &encoded)).unwrap();
    let before = comparison.result(0, &[]).unwrap().map_points;
    let frame = comparison.step(0).unwrap().clone();
    assert!(frame.status == Status::Lost && frame.reason.contains("found"), "{frame:?}");
    assert_eq!((frame.map_points, frame.num_added), (before, 0));
}

/// A PGM file.
fn encode(image: &scanstitch::camera::DepthImage, out: &mut Vec<u8>) {
    out.extend(format!("P5 {} {} 255\n", image.width, image.height).bytes());
    out.extend(image.values.iter().map(|&value| value as u8));
}
