//! Clouds in space: the equations of their metrics, made rooms, recordings, and spinning lasers.

mod equations;
mod recorded;
mod rooms;

use crate::common::error_of;
use glam::DVec3;
use nalgebra::Matrix3;
use scanstitch::geometry::{PointCloud, Pose3};
use scanstitch::io::point_cloud;
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::cloud::{CloudEstimate, CloudOdometry, CloudOptions, PreparedCloud};
use scanstitch::pipeline::SpatialSettings;
use scanstitch_scene::apartment::{Apartment, WalkOptions};
use scanstitch_scene::space::{Shape, Solid, Space};
use scanstitch_scene::spinning_lidar::{SpinningLidar, level_sensor};

fn wave(i: usize, k: f64) -> f64 {
    ((i as f64) * k + 0.5).sin()
}

fn chain(options: CloudOptions, clouds: &[PointCloud]) -> Vec<CloudEstimate> {
    let mut odometry = CloudOdometry::new(options).unwrap();
    clouds.iter().map(|cloud| odometry.register_frame(PreparedCloud::new(cloud, &options).unwrap())).collect()
}

fn chain_as_dropped(clouds: &[PointCloud]) -> Vec<CloudEstimate> {
    let mut ranges: Vec<f32> = clouds[0].positions.iter().map(|p| p.length()).collect();
    ranges.sort_by(f32::total_cmp);
    let settings = SpatialSettings::default().for_clouds(f64::from(ranges[ranges.len() / 2]));
    chain(settings.cloud_options(), clouds)
}

/// Every so many poses of a walk, 0.8 m apart or 15 degrees, seen by a laser of 16 rings.
fn walk_of_a_spinning_laser(seed: u64, count: usize) -> (Vec<PointCloud>, Vec<Pose3>) {
    let apartment = Apartment::generate(seed);
    let options = WalkOptions { step: 0.4, turn: 15f64.to_radians(), camera_height: 1.0, ..WalkOptions::default() };
    let mut poses: Vec<Pose3> = Vec::new();
    for pose in apartment.walk(&options).iter().map(level_sensor) {
        let is_far = poses.last().is_none_or(|last| error_of(last, &pose).0 > 0.79 || error_of(last, &pose).1 > 14.0);
        if is_far {
            poses.push(pose);
        }
    }
    poses.truncate(count);
    let scan = |(pose, seed): (&Pose3, u64)| SpinningLidar::default().scan(&apartment.space, pose, seed);
    (poses.iter().zip(1..).map(scan).collect(), poses)
}

#[test]
fn a_spinning_laser_is_followed_through_a_flat_in_long_steps() {
    let (clouds, poses) = walk_of_a_spinning_laser(2, 15);
    let estimates = chain_as_dropped(&clouds);
    let mut num_good = 0;
    for (pose, estimate) in poses.iter().zip(&estimates) {
        let (metres, degrees) = error_of(&(poses[0].inverse() * pose), &estimate.T_world_sensor);
        assert_ne!(estimate.assessment.status, Status::Lost, "{}", estimate.assessment.reason);
        assert!(metres < 0.05 && degrees < 1.0, "{metres} m, {degrees} deg");
        num_good += usize::from(estimate.assessment.status == Status::Good);
    }
    assert!(num_good >= 14, "{num_good} of {} are good", poses.len());
    let (elsewhere, _) = walk_of_a_spinning_laser(11, 6);
    for other in [1, 5] {
        let found = &chain_as_dropped(&[clouds[other].clone(), elsewhere[other].clone()])[1];
        assert_eq!(found.assessment.status, Status::Lost, "{other}: {}", found.assessment.reason);
    }
}

/// Nothing tells how far a laser has moved along it, but the rings stay with the laser and seem to.
#[test]
fn in_a_bare_corridor_no_step_is_good() {
    let wall = |half: [f64; 3], center: [f64; 3]| Solid {
        shape: Shape::Cuboid { half: half.into() },
        R_world_solid: Matrix3::identity(),
        center: center.into(),
        material: 0,
    };
    let walls = vec![
        wall([60.0, 0.1, 2.0], [0.0, 1.2, 0.0]),
        wall([60.0, 0.1, 2.0], [0.0, -1.2, 0.0]),
        wall([60.0, 2.0, 0.1], [0.0, 0.0, -1.1]),
        wall([60.0, 2.0, 0.1], [0.0, 0.0, 1.6]),
    ];
    let corridor = Space::new(walls, Vec::new(), Vec::new(), None);
    let laser = SpinningLidar { max_range: 10.0, ..SpinningLidar::default() };
    let clouds: Vec<PointCloud> = [(0.0, 1), (0.8, 2), (1.6, 3)]
        .map(|(x, seed)| laser.scan(&corridor, &Pose3::translation(x, 0.0, 0.0), seed))
        .to_vec();
    for estimate in &chain_as_dropped(&clouds)[1..] {
        assert_eq!(estimate.assessment.status, Status::Doubtful, "{}", estimate.assessment.reason);
        assert!(estimate.assessment.reason.contains("degenerate"), "{}", estimate.assessment.reason);
    }
}

/// Doubles of a file are kept as they are, in whichever encoding; floats lose nothing.
#[test]
fn points_keep_the_precision_that_their_file_declares() {
    let points: Vec<[f64; 3]> =
        (0..50).map(|i| [wave(i, 1.7) * 9.0, wave(i, 0.3) + 1.0 / 3.0, 0.1 * i as f64]).collect();
    let rows = |sep: &str| points.iter().map(|p| p.map(|x| x.to_string()).join(sep) + "\n").collect::<String>();
    let bytes: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let ply = |format: &str, scalar: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex 50\nproperty {scalar} x\nproperty {scalar} y\nproperty {scalar} z\n\
             end_header\n"
        )
    };
    let pcd = |data: &str| {
        format!(
            "VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 50\nHEIGHT 1\nPOINTS 50\nDATA {data}\n"
        )
    };
    let files = [
        [ply("ascii", "double").as_bytes(), rows(" ").as_bytes()].concat(),
        [ply("binary_little_endian", "double").as_bytes(), &bytes].concat(),
        [pcd("ascii").as_bytes(), rows(" ").as_bytes()].concat(),
        [pcd("binary").as_bytes(), &bytes].concat(),
    ];
    for (nth, file) in files.iter().enumerate() {
        let cloud = point_cloud::read(file).unwrap();
        let worst = cloud.finite_points().map(|(i, p)| (p - DVec3::from(points[i])).abs().max_element());
        let worst = worst.fold(0.0, f64::max);
        assert!(worst < 1e-13, "file {nth}: {worst}");
    }
    let single = [ply("ascii", "float").as_bytes(), rows(" ").as_bytes()].concat();
    assert_eq!(point_cloud::read(&single).unwrap().rounded_off, None);
    let halves: Vec<u8> = (0..150).flat_map(|i| (f64::from(i) / 2.0).to_le_bytes()).collect();
    let exact = [ply("binary_little_endian", "double").as_bytes(), &halves].concat();
    assert_eq!(point_cloud::read(&exact).unwrap().rounded_off, None);
}
