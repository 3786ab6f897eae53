//! Made rooms: motions that are held to a floor, damping, walks and leaps.

use super::{chain, wave};
use crate::common::error_of;
use glam::{DVec3, Vec3};
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use scanstitch::geometry::{PointCloud, Pose3, RigidMotion};
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::cloud::{CloudMethod, CloudOdometry, CloudOptions, GlobalRegistrationUse, PreparedCloud};
use scanstitch::registration::align::{CloudMetric, RegistrationOptions, register_clouds};
use scanstitch::registration::icp::{Criteria, IcpOptions, Rejection, Weighting, register};
use scanstitch::registration::robust_kernel::RobustKernel;
use scanstitch::registration::solver::{Motion, Solver};
use scanstitch::registration::spatial::{SpatialMetric, register_in_space};
use scanstitch::registration::voxelized::{GaussianVoxels, PlaneToVoxel};
use scanstitch_scene::random::Random;

/// Points on the walls, the floor and some boxes of a room of 8 x 5 x 2.6 m, as seen from `T_world_sensor` (x right, y down,
/// z forward), with noise of 3 mm.
fn room(T_world_sensor: &Pose3, count: usize, seed: u64) -> PointCloud {
    let mut random = Random::new(seed);
    let boxes: [[f64; 6]; 5] = [
        [-4.0, -1.3, -2.5, 4.0, 1.3, 2.5],
        [-3.5, 0.3, 1.0, -1.5, 1.3, 2.0],
        [1.0, -0.2, -2.2, 2.2, 1.3, -1.2],
        [2.5, 0.6, 0.5, 3.2, 1.3, 2.2],
        [-1.0, -1.3, 2.0, -0.2, 0.4, 2.5],
    ];
    let points = (0..count).map(|index| {
        // Half of the points on the room itself.
        let [x0, y0, z0, x1, y1, z1] = boxes[if index % 2 == 0 { 0 } else { 1 + (index / 2) % 4 }];
        let mut point = [random.uniform(x0, x1), random.uniform(y0, y1), random.uniform(z0, z1)];
        let axis = (random.uniform(0.0, 3.0)) as usize;
        point[axis] = if random.happens(0.5) { [x0, y0, z0][axis] } else { [x1, y1, z1][axis] };
        let noise = Vector3::from_fn(|_, _| 0.003 * random.normal());
        let p = T_world_sensor.inverse().act(&(Vector3::from(point) + noise));
        DVec3::new(p.x, p.y, p.z).as_vec3()
    });
    PointCloud::from_positions(points.collect())
}

const ICP: IcpOptions = IcpOptions {
    rejection: Rejection { max_correspondence_distance: 0.3, max_normal_angle: 0.8, trim_fraction: 0.0 },
    weighting: Weighting { robust_kernel: RobustKernel::GemanMcclure, robust_kernel_width: 0.1 },
    criteria: Criteria { max_iterations: 60, rotation_eps: 1e-6, translation_eps: 1e-6 },
};

fn prepared(cloud: &PointCloud) -> PreparedCloud {
    PreparedCloud::new(cloud, &CloudOptions::new(0.1)).unwrap()
}

#[test]
fn both_metrics_find_a_motion_with_and_without_damping() {
    let T = Pose3::exp(&Vector6::new(0.03, -0.05, 0.02, 0.08, 0.02, -0.06));
    let (source, target) = (prepared(&room(&T, 40_000, 1)), prepared(&room(&Pose3::identity(), 40_000, 2)));
    let is_right = |found: &Pose3| {
        let (metres, degrees) = error_of(&T, found);
        metres < 0.004 && degrees < 0.11
    };
    for metric in [SpatialMetric::PointToPlane, SpatialMetric::Gicp] {
        for damping in [None, Some(0.0), Some(1e-3), Some(10.0)] {
            let solver = Solver { damping, ..Motion::Free.solver() };
            let guess = Pose3::identity();
            let found = register_in_space(metric, source.source(), target.target(), guess, (&ICP, &[]), &solver);
            assert!(is_right(&found.T_target_source), "{metric:?}, {damping:?}: {}", found.T_target_source);
        }
    }
    let voxels = GaussianVoxels::new(target.target().points(), target.target().normals(), 0.3);
    let found = register(source.source(), &voxels, Pose3::identity(), &PlaneToVoxel, &ICP);
    assert!(is_right(&found.T_target_source), "voxels: {}", found.T_target_source);
}

#[test]
fn a_robot_on_a_floor_stays_on_it() {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.08);
    let T = Pose3::from_parts(Vector3::new(0.1, 0.0, -0.07).into(), turn);
    // What is seen suggests a tilt and a rise, which a robot cannot do: its camera has slipped.
    let slipped = T * Pose3::exp(&Vector6::new(0.02, 0.0, -0.015, 0.0, 0.03, 0.0));
    let (source, target) = (prepared(&room(&slipped, 40_000, 1)), prepared(&room(&Pose3::identity(), 40_000, 2)));
    for metric in [SpatialMetric::PointToPlane, SpatialMetric::Gicp] {
        for damping in [None, Some(1e-4)] {
            let solver = Solver { damping, ..Motion::Planar.solver() };
            let guess = Pose3::identity();
            let found = register_in_space(metric, source.source(), target.target(), guess, (&ICP, &[]), &solver);
            let error = T.inverse() * found.T_target_source;
            let planar = Motion::Planar.nearest(&found.T_target_source);
            assert!((planar.inverse() * found.T_target_source).log().norm() < 1e-9, "{metric:?}: it left the floor");
            assert!(error.translation_norm() < 0.03 && error.rotation_angle() < 0.02, "{metric:?}: {error}");
            assert!(found.converged && !found.observability.is_undetermined());
        }
    }
    // The public way.
    let [source, target] = [source, target].map(|cloud| PointCloud { normals: None, ..cloud.cloud().clone() });
    for metric in [CloudMetric::PointToPoint, CloudMetric::PointToPlane, CloudMetric::Gicp, CloudMetric::Vgicp] {
        let options =
            RegistrationOptions { metric: Some(metric), motion: Motion::Planar, ..RegistrationOptions::default() };
        let found = register_clouds(&source, &target, &options).unwrap().T_target_source;
        assert!(found[7].abs() < 1e-12 && (found[5] - 1.0).abs() < 1e-12, "{metric:?}: it left the floor");
        assert!((found[3] - 0.1).abs() < 0.05 && (found[11] + 0.07).abs() < 0.05, "{metric:?}: {found:?}");
    }
}

#[test]
fn voxels_of_no_size_are_refused_and_tiny_ones_fix_nothing() {
    let [source, target] = [1, 2].map(|seed| room(&Pose3::identity(), 2000, seed));
    let with = |gaussian_voxel_size| {
        let metric = Some(CloudMetric::Vgicp);
        let options = RegistrationOptions { metric, gaussian_voxel_size, ..RegistrationOptions::default() };
        register_clouds(&source, &target, &options)
    };
    for size in [-0.1, f64::NAN, f64::INFINITY] {
        let error = with(size).unwrap_err().to_string();
        assert!(error.contains("is not positive and finite") && error.contains("gaussian_voxel_size"), "{error}");
    }
    let found = with(1e-12).unwrap();
    assert!(!found.converged && found.num_correspondences == 0);
}

#[test]
fn a_walk_through_a_room_is_followed_and_what_is_no_part_of_it_is_lost() {
    let pose = |index: usize| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.1 * index as f64);
        Pose3::from_parts(Vector3::new(0.06 * index as f64, 0.0, 0.03 * index as f64).into(), turn)
    };
    let mut clouds: Vec<PointCloud> = (0..6).map(|index| room(&pose(index), 30_000, index as u64)).collect();
    clouds.insert(3, PointCloud::from_positions(vec![Vec3::new(1.0, 0.0, 2.0); 40]));
    let ball = |i: usize| Vec3::new(wave(i, 1.3) as f32, wave(i, 2.1) as f32, wave(i, 3.7) as f32).normalize() * 0.4;
    clouds.insert(5, PointCloud::from_positions((0..8000).map(ball).collect()));
    for method in [CloudMethod::CloudMap, CloudMethod::CloudToCloud] {
        for metric in [SpatialMetric::PointToPlane, SpatialMetric::Gicp] {
            for motion in [Motion::Free, Motion::Planar] {
                let options = CloudOptions { method, metric, motion, ..CloudOptions::new(0.1) };
                let estimates = chain(options, &clouds);
                assert_eq!(estimates[3].assessment.status, Status::Lost);
                assert_eq!(estimates[5].assessment.status, Status::Lost, "{}", estimates[5].overlap);
                assert!(estimates[3].assessment.reason.contains("too few"), "{}", estimates[3].assessment.reason);
                let found = estimates.iter().enumerate().filter(|(index, _)| ![3, 5].contains(index));
                for (index, (_, estimate)) in found.enumerate() {
                    let (metres, degrees) = error_of(&pose(index), &estimate.T_world_sensor);
                    let case = format!("{method:?} {metric:?} {motion:?} {index}: {metres} m, {degrees} deg");
                    assert!(metres < 0.01 && degrees < 0.28, "{case}");
                    assert_eq!(estimate.assessment.status, Status::Good, "{}", estimate.assessment.reason);
                }
            }
        }
    }
}

#[test]
fn a_leap_is_registered_by_features_or_reported() {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 1.9);
    let leap = Pose3::from_parts(Vector3::new(0.9, 0.0, -0.6).into(), turn);
    let clouds = [room(&Pose3::identity(), 60_000, 1), room(&leap, 60_000, 2)];
    for method in [CloudMethod::CloudMap, CloudMethod::CloudToCloud] {
        let options = CloudOptions { method, ..CloudOptions::new(0.1) };
        for global_registration in [GlobalRegistrationUse::WhenDoubtful, GlobalRegistrationUse::Always] {
            let found = &chain(CloudOptions { global_registration, ..options }, &clouds)[1];
            let error = leap.inverse() * found.T_world_sensor;
            assert!(found.is_global && error.translation_norm() < 0.01, "{method:?}: {error}, {:?}", found.assessment);
            assert_eq!(found.assessment.status, Status::Good);
        }
        let never = CloudOptions { global_registration: GlobalRegistrationUse::Never, ..options };
        assert_ne!(chain(never, &clouds)[1].assessment.status, Status::Good);
    }
}

#[test]
fn a_prepared_cloud_travels_as_plain_points_and_normals() {
    let cloud = room(&Pose3::identity(), 20_000, 4);
    let options = CloudOptions::new(0.1);
    let here = PreparedCloud::new(&cloud, &options).unwrap();
    let there = PreparedCloud::from_cloud(here.cloud().clone());
    assert_eq!(here.target().points(), there.target().points());
    for (a, b) in here.target().normals().iter().zip(there.target().normals()) {
        assert!(a.zip(*b).is_none_or(|(a, b)| (a - b).norm() < 1e-6) && a.is_some() == b.is_some());
    }
}

#[test]
fn options_and_clouds_that_cannot_be_are_refused_with_the_reason() {
    let refused = |options: CloudOptions| CloudOdometry::new(options).err().unwrap().to_string();
    assert!(refused(CloudOptions { voxel_size: 0.0, ..CloudOptions::new(0.1) }).contains("voxel_size"));
    let distance = CloudOptions { max_correspondence_distance: f64::NAN, ..CloudOptions::new(0.1) };
    assert!(refused(distance).contains("max_correspondence_distance"));
    let nowhere = CloudOptions { viewpoint: DVec3::INFINITY, ..CloudOptions::new(0.1) };
    assert!(refused(nowhere).contains("viewpoint"));
    let far = PointCloud { origin: DVec3::new(5e5, 4e6, 0.0), ..room(&Pose3::identity(), 100, 1) };
    assert!(PreparedCloud::new(&far, &CloudOptions::new(0.1)).err().unwrap().to_string().contains("map"));
    let empty = chain(CloudOptions::new(0.1), &[PointCloud::default()]);
    assert_eq!(empty[0].assessment.status, Status::Lost);
}
