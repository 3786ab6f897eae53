//! Scores the odometry of clouds on generated and recorded sequences: the numbers of good, doubtful, lost and wrongly good clouds,
//! and their errors. Arguments: the seeds of generated flats (1 to 4), and `-v` to print every cloud.

use std::path::Path;
use std::time::Instant;

use scanstitch::geometry::{PointCloud, Pose3, RigidMotion};
use scanstitch::io::point_cloud;
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::cloud::{CloudOdometry, PreparedCloud};
use scanstitch::pipeline::SpatialSettings;
use scanstitch::registration::degeneracy::DegenerateDirection;
use scanstitch_scene::apartment::{Apartment, WalkOptions};
use scanstitch_scene::space::{Shape, Solid, Space};
use scanstitch_scene::spinning_lidar::{SpinningLidar, level_sensor};

use crate::arguments::arguments;

/// Errors (m, degrees) above which a good cloud counts as wrongly good.
const WRONG: (f64, f64) = (0.2, 3.0);

fn score(name: &str, clouds: &[PointCloud], truth: &[Pose3], verbose: bool) {
    let mut ranges: Vec<f32> = clouds[0].positions.iter().filter(|p| p.is_finite()).map(|p| p.length()).collect();
    ranges.sort_by(f32::total_cmp);
    let settings = SpatialSettings::default().for_clouds(f64::from(ranges[ranges.len() / 2]));
    let options = settings.cloud_options();
    let mut odometry = CloudOdometry::new(options).unwrap();
    let (mut counts, mut wrong, mut worst, mut slowest) = ([0; 3], 0, 0.0f64, 0.0f64);
    let start = Instant::now();
    for (index, cloud) in clouds.iter().enumerate() {
        let begin = Instant::now();
        let estimate = odometry.register_frame(PreparedCloud::new(cloud, &options).unwrap());
        slowest = slowest.max(begin.elapsed().as_secs_f64() * 1e3);
        let status = estimate.assessment.status;
        counts[status as usize] += 1;
        let error = truth.get(index).map(|pose| (truth[0].inverse() * pose).inverse() * estimate.T_world_sensor);
        let (metres, degrees) =
            error.map_or((f64::NAN, f64::NAN), |error| (error.translation_norm(), error.rotation_angle().to_degrees()));
        if status != Status::Lost {
            worst = worst.max(metres);
        }
        wrong += usize::from(status == Status::Good && (metres > WRONG.0 || degrees > WRONG.1));
        if verbose {
            let t = estimate.T_world_sensor.translation.vector;
            println!(
                "  {index:3} {status:?}{} ({:.3} {:.3} {:.3}) {:.2} deg, off {metres:.3} m {degrees:.2} deg, overlap {:.2}, agreement {:.3}, facing {:.3}, {:.0} ms: {}",
                if estimate.is_global { " global" } else { "" },
                t.x,
                t.y,
                t.z,
                estimate.T_world_sensor.rotation_angle().to_degrees(),
                estimate.overlap,
                estimate.assessment.agreement,
                estimate.registration.as_ref().map_or(1.0, |r| {
                    DegenerateDirection::by_moved_surfaces(&r.correspondences, 3.0 * options.voxel_size).share
                }),
                begin.elapsed().as_secs_f64() * 1e3,
                estimate.assessment.reason
            );
        }
    }
    let [good, doubtful, lost] = counts;
    println!(
        "{name}: voxel {:.3} m, {good} good, {doubtful} doubtful, {lost} lost, {wrong} wrongly good, at most {worst:.3} m off, {:.0} ms a cloud, at most {slowest:.0}",
        options.voxel_size,
        start.elapsed().as_secs_f64() * 1e3 / clouds.len() as f64
    );
}

fn recorded(name: &str) -> Option<PointCloud> {
    let path = Path::new("../shared/data/lidar").join(name);
    let mut cloud = point_cloud::read(&std::fs::read(path).ok()?).ok()?;
    cloud.positions.retain(|p| p.is_finite());
    Some(PointCloud::from_positions(cloud.positions))
}

fn flat(seed: u64, num: usize) -> (Vec<PointCloud>, Vec<Pose3>) {
    let apartment = Apartment::generate(seed);
    let options = WalkOptions { step: 0.8, turn: 15f64.to_radians(), camera_height: 1.0, ..WalkOptions::default() };
    let walk = apartment.walk(&WalkOptions { step: 0.4, ..options });
    // A step is 0.8 m and up to 15 degrees: poses nearer to the last one are left out.
    let mut poses: Vec<Pose3> = Vec::new();
    for pose in walk.iter().map(level_sensor) {
        let is_far = poses.last().is_none_or(|last| {
            let motion = last.inverse() * pose;
            motion.translation_norm() >= 0.79 || motion.rotation_angle() > 14f64.to_radians()
        });
        if is_far {
            poses.push(pose);
        }
    }
    poses.truncate(num);
    let lidar = SpinningLidar::default();
    let clouds = poses.iter().zip(0..).map(|(pose, scan)| lidar.scan(&apartment.space, pose, 100 * seed + scan));
    (clouds.collect(), poses)
}

pub fn main() {
    let arguments = arguments();
    let verbose = arguments.iter().any(|argument| argument == "-v");
    let seeds: Vec<u64> = arguments.iter().filter_map(|argument| argument.parse().ok()).collect();
    let lidar = SpinningLidar::default();
    let near = SpinningLidar { max_range: 10.0, ..lidar };
    let cuboid = |half: [f64; 3], center: [f64; 3]| Solid {
        shape: Shape::Cuboid { half: half.into() },
        R_world_solid: nalgebra::Matrix3::identity(),
        center: center.into(),
        material: 0,
    };
    let walls = [
        ([60.0, 0.1, 2.0], [0.0, 1.2, 0.0]),
        ([60.0, 0.1, 2.0], [0.0, -1.2, 0.0]),
        ([60.0, 2.0, 0.1], [0.0, 0.0, -1.1]),
        ([60.0, 2.0, 0.1], [0.0, 0.0, 1.6]),
    ];
    let corridor = Space::new(walls.map(|(half, center)| cuboid(half, center)).to_vec(), Vec::new(), Vec::new(), None);
    let along: Vec<Pose3> = (0..8).map(|step| Pose3::translation(0.8 * f64::from(step), 0.0, 0.0)).collect();
    let clouds: Vec<PointCloud> = along.iter().zip(0..).map(|(pose, seed)| near.scan(&corridor, pose, seed)).collect();
    score("bare corridor", &clouds, &along, true);
    for (name, files) in [
        ("pcl_room", &["pcl_room/room_scan1.pcd", "pcl_room/room_scan2.pcd"][..]),
        ("pcl_room, reversed", &["pcl_room/room_scan2.pcd", "pcl_room/room_scan1.pcd"]),
        ("kitti_pair", &["kitti_pair/target.ply", "kitti_pair/source.ply"]),
        (
            "pcl_pairwise",
            &[
                "pcl_pairwise/capture0001.pcd",
                "pcl_pairwise/capture0002.pcd",
                "pcl_pairwise/capture0003.pcd",
                "pcl_pairwise/capture0004.pcd",
                "pcl_pairwise/capture0005.pcd",
            ],
        ),
        ("two places: room, street", &["pcl_room/room_scan1.pcd", "kitti_pair/source.ply"]),
        ("two places: street, room", &["kitti_pair/source.ply", "pcl_room/room_scan2.pcd"]),
        ("two places: room, desk", &["pcl_room/room_scan1.pcd", "pcl_pairwise/capture0001.pcd"]),
        ("two places: desk, room", &["pcl_pairwise/capture0005.pcd", "pcl_room/room_scan2.pcd"]),
        ("two places: desk, street", &["pcl_pairwise/capture0002.pcd", "kitti_pair/target.ply"]),
    ] {
        let clouds: Vec<PointCloud> = files.iter().filter_map(|file| recorded(file)).collect();
        if clouds.len() == files.len() {
            score(name, &clouds, &[], true);
        }
    }
    let flats: Vec<(Vec<PointCloud>, Vec<Pose3>)> = (11..14).map(|seed| flat(seed, 12)).collect();
    for (a, first) in flats.iter().enumerate() {
        for (b, second) in flats.iter().enumerate().filter(|(b, _)| *b != a) {
            // No registration is right here: the ground truth of the second cloud is 1 km away.
            let far = Pose3::translation(1000.0, 0.0, 0.0);
            let clouds = [first.0[b].clone(), second.0[2 * a].clone(), second.0[11].clone()];
            score(&format!("flat {a}, then flat {b}"), &clouds, &[Pose3::identity(), far, far], verbose);
        }
    }
    for seed in if seeds.is_empty() { vec![1, 2, 3, 4] } else { seeds } {
        let (clouds, poses) = flat(seed, 30);
        score(&format!("flat {seed}"), &clouds, &poses, verbose);
    }
}
