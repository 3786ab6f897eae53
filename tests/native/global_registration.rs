//! Registration without a guess: clouds turned and shifted at random, and clouds that have nothing in common.

use std::path::Path;

use crate::common::{apartment_cloud, kitti_pair, pose_of, shared_data};
use glam::{DVec3, Vec3};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use scanstitch::geometry::{PointCloud, Pose3};
use scanstitch::odometry::cloud::{CloudOptions, PreparedCloud};
use scanstitch::registration::align::{
    CloudMetric, RegistrationInit, RegistrationOptions, StepMethod, register_clouds,
};
use scanstitch::registration::global::{DescribedCloud, GlobalMethod, GlobalRegistration, register_globally};
use scanstitch::search::Neighborhood;
use scanstitch_scene::random::Random;

const KITTI: &str = "lidar/kitti_pair";
const ROOMS: &str = "rgbd";

fn described(cloud: &PointCloud, voxel_size: f64, viewpoint: DVec3) -> (PreparedCloud, DescribedCloud) {
    let options = CloudOptions { viewpoint, ..CloudOptions::new(voxel_size) };
    let prepared = PreparedCloud::new(cloud, &options).unwrap();
    let target = prepared.target();
    let around = Neighborhood { max_neighbors: 100, radius: 5.0 * voxel_size };
    let described = DescribedCloud::new(&prepared.cloud().positions, target.normals(), target.tree(), around);
    (prepared, described)
}

/// The cloud as a sensor sees it that stands elsewhere, and that motion.
fn turned(cloud: &PointCloud, seed: u64) -> (PointCloud, Pose3) {
    let mut random = Random::new(seed);
    let axis = Vector3::new(random.normal(), random.normal(), random.normal()).normalize();
    let rotation = UnitQuaternion::from_scaled_axis(axis * random.uniform(0.0, std::f64::consts::PI));
    let shift = Vector3::from_fn(|_, _| random.uniform(-20.0, 20.0));
    let T_cloud_turned = Pose3::from_parts(shift.into(), rotation);
    let T_turned_cloud = T_cloud_turned.inverse();
    let points = cloud.positions.iter().map(|p| {
        let p = T_turned_cloud * Point3::from(p.as_dvec3().to_array());
        DVec3::new(p.x, p.y, p.z).as_vec3()
    });
    (PointCloud::from_positions(points.collect()), T_cloud_turned)
}

/// How many seeds of a street lead back to within half a metre and three degrees.
fn num_found(folder: &Path, method: GlobalMethod, seeds: std::ops::Range<u64>) -> usize {
    const VOXEL: f64 = 0.25;
    let ([source, target], truth) = kitti_pair(folder);
    let (target, described_target) = described(&target, VOXEL, DVec3::ZERO);
    let found = seeds.filter(|&seed| {
        let (source, T_source_turned) = turned(&source, seed);
        let sensor = T_source_turned.inverse().translation.vector;
        let (_, source) = described(&source, VOXEL, DVec3::from(<[f64; 3]>::from(sensor)));
        let tree = target.target().tree();
        let Ok(found) = register_globally(&source, &described_target, tree, method, 1.5 * VOXEL) else { return false };
        let off = (truth * T_source_turned).inverse() * found.consensus.T_target_source;
        let moved = off * Point3::from(sensor) - Point3::from(sensor);
        moved.norm() < 0.5 && off.rotation.angle().to_degrees() < 3.0
    });
    found.count()
}

#[test]
fn a_street_is_found_again_from_anywhere() {
    let Some(folder) = shared_data(KITTI) else { return };
    assert_eq!(num_found(&folder, GlobalMethod::Consistency, 0..12), 12);
    assert!(num_found(&folder, GlobalMethod::Ransac { seed: 1 }, 100..106) >= 5);
}

fn between(source: &PointCloud, target: &PointCloud, voxel_size: f64) -> scanstitch::Result<GlobalRegistration> {
    let (target, described_target) = described(target, voxel_size, DVec3::ZERO);
    let (_, source) = described(source, voxel_size, DVec3::ZERO);
    let method = GlobalMethod::Consistency;
    register_globally(&source, &described_target, target.target().tree(), method, 1.5 * voxel_size)
}

#[test]
fn rooms_without_overlap_are_rejected() {
    let Some(folder) = shared_data(ROOMS) else { return };
    let here = apartment_cloud(&folder.join("apartment_first_floor"), 4);
    for frame in [11, 51, 101] {
        let refused = between(&apartment_cloud(&folder.join("apartment_second_floor"), frame), &here, 0.1)
            .unwrap_err()
            .to_string();
        assert!(refused.contains("look alike") && refused.contains("overlap more"), "{refused}");
    }
    let neighbor = between(&apartment_cloud(&folder.join("apartment_first_floor"), 7), &here, 0.1).unwrap(); // a turn of 30 degrees
    assert!(neighbor.consensus.num_inliers > 100);
    assert!((neighbor.consensus.T_target_source.rotation.angle().to_degrees() - 30.0).abs() < 1.5);
    assert!(neighbor.consensus.T_target_source.translation.vector.norm() < 0.1);
}

#[test]
fn a_cloud_without_surfaces_is_refused() {
    let mut random = Random::new(3);
    let dust = |random: &mut Random| Vec3::from(std::array::from_fn(|_| random.uniform(-5.0, 5.0) as f32));
    let [source, target] =
        [0, 1].map(|_| PointCloud::from_positions((0..3000).map(|_| dust(&mut random)).collect::<Vec<Vec3>>()));
    assert!(between(&source, &target, 0.25).is_err());
    let points = PointCloud::from_positions(vec![Vec3::ONE; 500]);
    assert!(between(&points, &points, 0.25).unwrap_err().to_string().starts_with("0 points look alike"));
    let options = RegistrationOptions { init: RegistrationInit::Global, ..RegistrationOptions::default() };
    assert!(register_clouds(&points, &points, &options).unwrap_err().to_string().contains("All points"));
}

#[test]
fn options_that_do_not_fit_are_refused_before_the_search() {
    let points = PointCloud::from_positions(vec![Vec3::ONE; 500]); // the search fails with these
    let refused = |options: RegistrationOptions| {
        let options = RegistrationOptions { init: RegistrationInit::Global, ..options };
        register_clouds(&points, &points, &options).unwrap_err().to_string()
    };
    let with = |metric| RegistrationOptions { metric: Some(metric), ..RegistrationOptions::default() };
    assert!(refused(with(CloudMetric::PointToLine)).contains("point_to_line is for planar clouds"));
    let step = Some(StepMethod::ClosedForm);
    assert!(refused(RegistrationOptions { step, ..with(CloudMetric::Gicp) }).contains("step closed_form"));
    let gaussian_voxel_size = -0.1;
    let vgicp = RegistrationOptions { gaussian_voxel_size, ..with(CloudMetric::Vgicp) };
    assert!(refused(vgicp).contains("gaussian_voxel_size"));
}

/// The public way: no guess, no voxel size, no normals.
#[test]
fn two_clouds_alone_are_registered_without_a_guess() {
    let Some(folder) = shared_data(KITTI) else { return };
    let ([source, target], truth) = kitti_pair(&folder);
    let spin = Pose3::rotation(Vector3::new(0.0, 0.0, 2.5));
    let points = source.positions.into_iter().map(|p| {
        let p = spin.inverse() * Point3::from(p.as_dvec3().to_array());
        DVec3::new(p.x, p.y, p.z).as_vec3()
    });
    let source = PointCloud::from_positions(points.collect());
    let options = RegistrationOptions {
        metric: Some(CloudMetric::Gicp),
        init: RegistrationInit::Global,
        max_correspondence_distance: 1.0,
        robust_kernel_width: 0.1,
        voxel_size: 0.25,
        ..RegistrationOptions::default()
    };
    let error = |options: &RegistrationOptions| {
        let found = register_clouds(&source, &target, options).unwrap();
        let off = (truth * spin).inverse() * pose_of(&found.T_target_source);
        (off.translation.vector.norm(), off.rotation.angle().to_degrees())
    };
    let (metres, degrees) = error(&options);
    assert!(metres < 0.03 && degrees < 0.4, "{metres} m, {degrees} deg");
    let alone = RegistrationOptions { voxel_size: 0.0, max_iterations: 0, ..options };
    let (metres, degrees) = error(&alone);
    assert!(metres < 0.5 && degrees < 2.0, "{metres} m, {degrees} deg");
}
