//! Registers the pairs of ../shared/data/lidar and prints times and errors: from the identity with both metrics, and without an
//! initial guess after random motions. Arguments: the number of seeds (100) and the voxel size (0.25 m).

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use glam::{DVec3, Vec3};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use scanstitch::geometry::{PointCloud, Pose3};
use scanstitch::io::ply;
use scanstitch::odometry::cloud::{CloudOptions, PreparedCloud};
use scanstitch::preprocess::estimate_normals::estimate_normals;
use scanstitch::preprocess::voxel_downsample::voxel_downsample;
use scanstitch::registration::global::fpfh::fpfh;
use scanstitch::registration::global::matching::{FeatureIndex, mutual_matches};
use scanstitch::registration::global::{DescribedCloud, GlobalMethod, register_globally};
use scanstitch::registration::icp::{Criteria, IcpOptions, Rejection, Weighting};
use scanstitch::registration::robust_kernel::RobustKernel;
use scanstitch::registration::solver::Motion;
use scanstitch::registration::spatial::{SpatialMetric, register_in_space};
use scanstitch::search::{KdTree, Neighborhood};
use scanstitch_scene::random::Random;

use crate::arguments::arguments;

/// Median time of several runs (ms), and the result of the last one.
fn timed<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let mut last = black_box(run());
    let mut times: Vec<f64> = (0..15)
        .map(|_| {
            let start = Instant::now();
            last = black_box(run());
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    (times[times.len() / 2], last)
}

fn numbers(path: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(path).expect("readable");
    text.split(|c: char| c.is_whitespace() || c == ',').filter_map(|token| token.parse().ok()).collect()
}

fn pose_of(rows: &[f64]) -> Pose3 {
    let rotation = Rotation3::from_matrix(&Matrix3::from_fn(|row, column| rows[4 * row + column]));
    let rotation = UnitQuaternion::from_rotation_matrix(&rotation);
    Isometry3::from_parts(Translation3::new(rows[3], rows[7], rows[11]), rotation)
}

struct Pair {
    name: &'static str,
    voxel_size: f64,
    source: PointCloud,
    target: PointCloud,
    T_target_source: Pose3,
}

fn kitti(root: &Path, voxel_size: f64) -> Pair {
    let folder = root.join("kitti_pair");
    let read = |name: &str| {
        let cloud = ply::read(&std::fs::read(folder.join(name)).expect("readable")).expect("a PLY file");
        PointCloud::from_positions(cloud.positions)
    };
    let T_target_source = pose_of(&numbers(&folder.join("T_target_source.txt")));
    Pair { name: "kitti_pair", voxel_size, source: read("source.ply"), target: read("target.ply"), T_target_source }
}

fn car(root: &Path) -> Pair {
    let folder = root.join("car_cloud");
    let list = std::fs::read_to_string(folder.join("carCloudList.csv")).expect("readable");
    let rows: Vec<f64> =
        list.lines().nth(2).expect("two clouds").split(',').skip(1).map(|x| x.trim().parse().unwrap()).collect();
    let read = |name: &str| {
        let text = std::fs::read_to_string(folder.join(name)).expect("readable");
        let row = |line: &str| -> Option<Vec3> {
            let numbers: Vec<f32> = line.split([',', ' ']).filter_map(|word| word.parse().ok()).collect();
            (numbers.len() >= 3).then(|| Vec3::from_slice(&numbers))
        };
        PointCloud::from_positions(text.lines().filter_map(row).collect())
    };
    let (source, target) = (read("car_cloud401.csv"), read("car_cloud400.csv"));
    Pair { name: "car_cloud", voxel_size: 0.1, source, target, T_target_source: pose_of(&rows) }
}

/// Difference of two motions (m, degrees).
fn error(found: &Pose3, expected: &Pose3) -> (f64, f64) {
    let off = expected.inverse() * found;
    (off.translation.vector.norm(), off.rotation.angle().to_degrees())
}

fn plain_icp(max_correspondence_distance: f64) -> IcpOptions {
    IcpOptions {
        rejection: Rejection {
            max_correspondence_distance,
            max_normal_angle: std::f64::consts::PI,
            trim_fraction: 0.0,
        },
        weighting: Weighting { robust_kernel: RobustKernel::None, robust_kernel_width: 1.0 },
        criteria: Criteria { max_iterations: 20, rotation_eps: 0.1f64.to_radians(), translation_eps: 1e-3 },
    }
}

fn align(pair: &Pair) {
    let (voxel_size, name) = (pair.voxel_size, pair.name);
    let ten = Neighborhood { max_neighbors: 10, radius: f64::INFINITY };
    let (voxels_ms, cloud) = timed(|| voxel_downsample(&pair.target, voxel_size).expect("a voxel"));
    let points: &[[f32; 3]] = bytemuck::cast_slice(&cloud.positions);
    let (tree_ms, tree) = timed(|| KdTree::build(points));
    let (normals_ms, normals) = timed(|| estimate_normals(&cloud.positions, &tree, ten, DVec3::ZERO));
    println!(
        "{name}: {} points, {} at {voxel_size} m: voxels {voxels_ms:.2} ms, index {tree_ms:.2}, normals of 10 {normals_ms:.2}",
        pair.target.len(),
        cloud.len()
    );
    let options = CloudOptions { normals: ten, ..CloudOptions::new(voxel_size) };
    let [source, target] =
        [&pair.source, &pair.target].map(|cloud| PreparedCloud::new(cloud, &options).expect("sound options"));
    let icp = plain_icp(4.0 * voxel_size);
    for metric in [SpatialMetric::PointToPlane, SpatialMetric::Gicp] {
        let free = Motion::Free.solver();
        for (label, solver) in
            [("plain", free), ("damped", scanstitch::registration::solver::Solver { damping: Some(1e-6), ..free })]
        {
            let (ms, found) = timed(|| {
                let identity = Pose3::identity();
                register_in_space(metric, source.source(), target.target(), identity, (&icp, &[]), &solver)
            });
            let (metres, degrees) = error(&found.T_target_source, &pair.T_target_source);
            println!(
                "  {metric:?} {label}: {ms:.2} ms, {} iterations, {} inliers, {metres:.4} m, {degrees:.3} deg, converged {}",
                found.history.len(),
                found.last.num_inliers,
                found.converged
            );
        }
    }
    let around = Neighborhood { max_neighbors: 100, radius: 5.0 * voxel_size };
    let (feature_ms, features) = timed(|| fpfh(&cloud.positions, &normals, &tree, around));
    let (build_ms, index) = timed(|| FeatureIndex::new(features.clone()));
    let others = voxel_downsample(&pair.source, voxel_size).expect("a voxel");
    let other_tree = KdTree::build(bytemuck::cast_slice(&others.positions));
    let other_normals = estimate_normals(&others.positions, &other_tree, ten, DVec3::ZERO);
    let other = FeatureIndex::new(fpfh(&others.positions, &other_normals, &other_tree, around));
    let (match_ms, matches) = timed(|| mutual_matches(&other, &index, usize::MAX));
    println!(
        "  features {feature_ms:.2} ms, their index {build_ms:.2}, matching {match_ms:.2}: {} matches",
        matches.len()
    );
}

/// Random rotations, and translations of up to ten metres.
fn without_a_guess(pair: &Pair, num_seeds: u64) {
    let options = CloudOptions::new(pair.voxel_size);
    let prepare = |cloud: &PointCloud| PreparedCloud::new(cloud, &options).expect("sound options");
    let around = Neighborhood { max_neighbors: 100, radius: 5.0 * pair.voxel_size };
    let describe = |cloud: &PreparedCloud| {
        let target = cloud.target();
        DescribedCloud::new(&cloud.cloud().positions, target.normals(), target.tree(), around)
    };
    let prepared_target = prepare(&pair.target);
    let target = describe(&prepared_target);
    for method in [GlobalMethod::Ransac { seed: 1 }, GlobalMethod::Consistency] {
        let (mut successes, mut times, mut worst) = (0, Vec::new(), (0.0f64, 0.0f64));
        let mut inliers = Vec::new();
        for seed in 0..num_seeds {
            let mut random = Random::new(seed);
            let axis = Vector3::new(random.normal(), random.normal(), random.normal()).normalize();
            let rotation = UnitQuaternion::from_scaled_axis(axis * random.uniform(0.0, std::f64::consts::PI));
            let shift = Vector3::from_fn(|_, _| random.uniform(-20.0, 20.0));
            let T_source_turned = Pose3::from_parts(shift.into(), rotation);
            let turned = pair.source.positions.iter().map(|p| {
                let p = T_source_turned.inverse() * nalgebra::Point3::from(p.as_dvec3().to_array());
                DVec3::new(p.x, p.y, p.z).as_vec3()
            });
            let turned = PointCloud::from_positions(turned.collect());
            let viewpoint = T_source_turned.inverse().translation.vector;
            let options = CloudOptions { viewpoint: DVec3::from(<[f64; 3]>::from(viewpoint)), ..options };
            let source = PreparedCloud::new(&turned, &options).expect("sound options");
            let start = Instant::now();
            let source = describe(&source);
            let found =
                register_globally(&source, &target, prepared_target.target().tree(), method, 1.5 * pair.voxel_size);
            times.push(start.elapsed().as_secs_f64() * 1e3);
            match found {
                Ok(found) => {
                    let T = found.consensus.T_target_source;
                    let (metres, degrees) = error(&T, &(pair.T_target_source * T_source_turned));
                    let at_sensor =
                        (T * nalgebra::Point3::from(viewpoint) - pair.T_target_source.translation.vector).coords.norm();
                    let good = at_sensor < 0.6 && degrees < 3.0;
                    successes += usize::from(good);
                    if good {
                        worst = (worst.0.max(at_sensor), worst.1.max(degrees));
                    } else {
                        println!(
                            "  seed {seed}: {metres:.2} m, {at_sensor:.2} m, {degrees:.2} deg, {} of {}",
                            found.consensus.num_inliers, found.num_matches
                        );
                    }
                    inliers.push((found.consensus.num_inliers, found.num_matches));
                }
                Err(error) => println!("  seed {seed}: {error}"),
            }
        }
        times.sort_by(f64::total_cmp);
        inliers.sort_unstable();
        println!(
            "{} without a guess, {method:?}: {successes} of {num_seeds}, median {:.1} ms, most {:.1}; worst good {worst:.2?}; inliers {:?} to {:?}",
            pair.name,
            times[times.len() / 2],
            times[times.len() - 1],
            inliers.first(),
            inliers.last()
        );
    }
}

pub fn main() {
    let root = Path::new("../shared/data/lidar");
    if !root.is_dir() {
        eprintln!("skipped: ../shared/data is absent");
        return;
    }
    let mut arguments = arguments().into_iter();
    let num_seeds = arguments.next().and_then(|number| number.parse().ok()).unwrap_or(100);
    let voxel_size = arguments.next().and_then(|number| number.parse().ok()).unwrap_or(0.25);
    for pair in [kitti(root, voxel_size), car(root)] {
        align(&pair);
        if num_seeds > 0 {
            without_a_guess(&pair, num_seeds);
        }
    }
}
