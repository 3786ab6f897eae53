//! The joint solution in space and in the plane.

use nalgebra::{Vector3, Vector6};
use scanstitch::geometry::{Pose3, RigidMotion};
use scanstitch::graph::joint_scan_registration::{JointScanRegistration, Node, edges_between};
use scanstitch::registration::factors::PointToPlane;
use scanstitch::registration::icp::{Criteria, IcpOptions, Rejection, Source, Weighting};
use scanstitch::registration::robust_kernel::RobustKernel;
use scanstitch::registration::target::OrientedTarget;

const OPTIONS: IcpOptions = IcpOptions {
    rejection: Rejection { max_correspondence_distance: 0.5, max_normal_angle: 0.8, trim_fraction: 0.0 },
    weighting: Weighting { robust_kernel: RobustKernel::Cauchy, robust_kernel_width: 0.1 },
    criteria: Criteria { max_iterations: 60, rotation_eps: 1e-7, translation_eps: 1e-7 },
};

/// The inside of three walls that meet in a corner, 10 cm between points, and their normals.
fn corner() -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let cells = || (1..20).flat_map(|i| (1..20).map(move |j| (0.1 * f64::from(i), 0.1 * f64::from(j))));
    let walls = cells().flat_map(|(a, b)| {
        [
            (Vector3::new(0.0, a, b), Vector3::x()),
            (Vector3::new(a, 0.0, b), Vector3::y()),
            (Vector3::new(a, b, 0.0), Vector3::z()),
        ]
    });
    walls.unzip()
}

#[test]
fn shaken_poses_in_space_come_back_to_where_they_were() {
    let (points, normals) = corner();
    let wave = |i: usize, k: f64| (k * i as f64).sin();
    let truth: Vec<Pose3> = (0..5)
        .map(|i| Pose3::exp(&Vector6::new(wave(i, 0.3), wave(i, 0.5), wave(i, 0.2), wave(i, 1.0), wave(i, 0.7), 0.0)))
        .collect();
    let scans: Vec<(Vec<_>, Vec<_>)> = truth
        .iter()
        .map(|T| {
            let T_sensor_world = T.inverse();
            let seen = points.iter().map(|p| T_sensor_world.act(p)).collect();
            (seen, normals.iter().map(|n| Some(T_sensor_world.rotation * n)).collect())
        })
        .collect();
    let targets: Vec<OrientedTarget<3>> =
        scans.iter().map(|(points, normals)| OrientedTarget::new(points.clone(), normals.clone())).collect();
    let nodes: Vec<_> = scans
        .iter()
        .zip(&targets)
        .map(|((points, normals), target)| Node {
            source: Source { points, normals: Some(normals), sigmas: None },
            target,
        })
        .collect();
    let shaken = truth.iter().enumerate().map(|(i, T)| {
        let size = if i == 0 { 0.0 } else { 0.02 };
        let shake = Vector6::from_fn(|row, _| size * wave(i, 2.0 + row as f64));
        *T * Pose3::exp(&shake)
    });
    let positions: Vec<Vector3<f64>> = truth.iter().map(|T| T.translation.vector).collect();
    let mut graph = JointScanRegistration::<Pose3>::new(shaken.collect(), edges_between(&positions, 0));
    while !graph.is_done(&OPTIONS) {
        graph.advance(&PointToPlane, &nodes, &OPTIONS, 1000);
    }
    assert!(graph.converged(), "{:?}", graph.history().last());
    assert_eq!(graph.poses()[0], truth[0]);
    for (solved, truth) in graph.poses().iter().zip(&truth) {
        assert!((truth.inverse() * solved).log().norm() < 1e-5);
    }
}

#[test]
fn nodes_that_share_nothing_end_the_solution_without_moving() {
    let (points, normals) = corner();
    let normals: Vec<_> = normals.into_iter().map(Some).collect();
    let target = OrientedTarget::new(points.clone(), normals.clone());
    let node = || Node { source: Source { points: &points, normals: Some(&normals), sigmas: None }, target: &target };
    let apart = vec![Pose3::identity(), Pose3::translation(100.0, 0.0, 0.0)];
    let mut graph =
        JointScanRegistration::<Pose3>::new(apart.clone(), edges_between(&[Vector3::zeros(), Vector3::x()], 1));
    while !graph.is_done(&OPTIONS) {
        graph.advance(&PointToPlane, &[node(), node()], &OPTIONS, usize::MAX);
    }
    assert!(!graph.converged());
    assert_eq!(graph.poses(), apart);
    assert!(JointScanRegistration::<Pose3>::new(Vec::new(), Vec::new()).is_done(&OPTIONS));
}

#[test]
fn every_node_is_matched_with_those_before_it_and_near_it_both_ways() {
    let along = |xs: &[f64]| xs.iter().map(|&x| Vector3::new(x, 0.0, 0.0)).collect::<Vec<_>>();
    let edges = |xs: &[f64], matched| -> Vec<(usize, usize)> {
        edges_between(&along(xs), matched).iter().map(|edge| (edge.source, edge.target)).collect()
    };
    let straight: Vec<f64> = (0..10).map(|i| 10.0 * f64::from(i)).collect();
    assert_eq!(edges(&straight[..3], 1), [(1, 0), (0, 1), (2, 1), (1, 2)]);
    assert_eq!(edges(&straight, 0).len(), 90);
    assert_eq!(edges(&straight, 100), edges(&straight, 0));
    assert_eq!(edges(&[0.0], 1), []);
    // Back again: the last is near the first two, nearest to the second.
    let there_and_back = [0.0, 2.0, 30.0, 60.0, 30.0, 1.5];
    assert_eq!(edges(&there_and_back, 1)[edges(&there_and_back, 1).len() - 4..], [(5, 1), (1, 5), (5, 4), (4, 5)]);
}
