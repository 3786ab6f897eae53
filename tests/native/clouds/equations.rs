//! The equations of plane to plane and of voxels, against numeric ones.

use super::wave;
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};
use scanstitch::geometry::{Pose3, RigidMotion};
use scanstitch::registration::factors::{Correspondence, Factor, NormalEquations, PLANE_THICKNESS, PlaneToPlane};
use scanstitch::registration::target::{LastSearch, OrientedTarget, Target};
use scanstitch::registration::voxelized::{GaussianVoxels, PlaneToVoxel};

/// The covariance of a surface, of eigenvalues e, 1, 1.
fn covariance(normal: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::identity() - normal * normal.transpose() * (1.0 - PLANE_THICKNESS)
}

/// 2e (C_target + C_source)^-1 by a numeric inverse.
fn precision(target: &Matrix3<f64>, source: &Matrix3<f64>) -> Matrix3<f64> {
    (target + source).try_inverse().unwrap() * (2.0 * PLANE_THICKNESS)
}

/// How a point moves with each of the six perturbations on the left, by differences.
fn numeric_jacobian(point: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
    SMatrix::from_columns(&std::array::from_fn::<_, 6, _>(|axis| {
        let step = Vector6::from_fn(|row, _| if row == axis { 1e-6 } else { 0.0 });
        (Pose3::exp(&step).act(point) - Pose3::exp(&-step).act(point)) / 2e-6
    }))
}

#[test]
fn plane_to_plane_agrees_with_explicit_covariances_and_numeric_jacobians() {
    let unit = |i: usize| Vector3::new(wave(i, 0.7), wave(i, 1.9), wave(i, 5.1)).normalize();
    let points: Vec<Vector3<f64>> =
        (0..60).map(|i| Vector3::new(wave(i, 1.1), wave(i, 2.3), wave(i, 3.7)) * 2.0).collect();
    let target = OrientedTarget::new(points.clone(), (0..60).map(|i| Some(unit(i))).collect());
    let pairs: Vec<Correspondence<Vector3<f64>>> = (0..60)
        .map(|i| {
            let moved = points[i] + Vector3::new(wave(i, 9.1), wave(i, 8.3), wave(i, 7.7)) * 0.1;
            // Every way to face: the same, the opposite, across, unknown.
            let normal = match i % 4 {
                0 => Some(unit(i)),
                1 => Some(-unit(i)),
                2 => Some(unit(7 * i + 3)),
                _ => None,
            };
            let residual =
                Factor::<Pose3, _>::residual(&PlaneToPlane, &target, i as u32, &moved, normal.as_ref()).unwrap();
            Correspondence {
                source: i as u32,
                target: i as u32,
                moved,
                normal,
                residual,
                weight: 0.3 + 0.2 * wave(i, 0.3),
            }
        })
        .collect();
    let (mut H, mut b) = (Matrix6::zeros(), Vector6::zeros());
    for c in &pairs {
        let i = c.source as usize;
        let M = precision(&covariance(&unit(i)), &covariance(&c.normal.unwrap_or(unit(i))));
        let d = c.moved - points[i];
        assert!((c.residual.powi(2) - (d.transpose() * M * d).x).abs() < 1e-12);
        // Where both face the same way the residual is the distance along the normal, but for the thickness.
        if i % 4 != 2 {
            assert!((c.residual.powi(2) - unit(i).dot(&d).powi(2)).abs() < 2.0 * PLANE_THICKNESS * d.norm_squared());
        }
        let J = numeric_jacobian(&c.moved);
        H += J.transpose() * M * J * c.weight;
        b += J.transpose() * M * d * c.weight;
    }
    let found: NormalEquations<Pose3> = PlaneToPlane.normal_equations(&target, &pairs);
    assert!((found.H - H).norm() < 1e-7 * H.norm() && (found.b - b).norm() < 1e-7 * b.norm());
}

#[test]
fn voxels_are_the_means_of_their_points_and_agree_with_numeric_jacobians() {
    let unit = |i: usize| Vector3::new(wave(i, 0.7), wave(i, 1.9), wave(i, 5.1)).normalize();
    let point = |i: usize| Vector3::new(wave(i, 1.1), wave(i, 2.3), wave(i, 3.7)) * 1.5;
    let voxel = |p: &Vector3<f64>| p.map(|x| (x / 0.7).floor());
    let points: Vec<Vector3<f64>> = (0..300).map(point).collect();
    // One in nine says nothing of its surface.
    let normals: Vec<Option<Vector3<f64>>> = (0..300).map(|i| (i % 9 != 4).then(|| unit(i))).collect();
    let grid = GaussianVoxels::new(&points, &normals, 0.7);
    let (mut H, mut b, mut pairs, mut num_alone) = (Matrix6::zeros(), Vector6::zeros(), Vec::new(), 0);
    let mut last = LastSearch::None;
    for i in 300..500 {
        let moved = point(i);
        let inside: Vec<usize> =
            (0..300).filter(|&k| normals[k].is_some() && voxel(&points[k]) == voxel(&moved)).collect();
        let found = grid.nearest(&moved, 0.6);
        assert_eq!(grid.nearest_again(&moved, 0.6, &mut last), found);
        let share = 1.0 / inside.len().max(1) as f64;
        let mean: Vector3<f64> = inside.iter().map(|&k| points[k]).sum::<Vector3<f64>>() * share;
        let C: Matrix3<f64> = inside.iter().map(|&k| covariance(&unit(k))).sum::<Matrix3<f64>>() * share;
        let d = moved - mean;
        let Some(found) = found else {
            assert!(inside.is_empty() || d.norm() > 0.6);
            num_alone += 1;
            continue;
        };
        assert!((grid.point(found.index) - mean).norm() < 1e-12 && (grid.covariance(found.index) - C).norm() < 1e-12);
        assert!((f64::from(found.sq_distance) - d.norm_squared()).abs() < 1e-6);
        let normal = (i % 4 != 0).then(|| unit(i));
        let M = precision(&C, &normal.map_or(C, |normal| covariance(&normal)));
        let residual = PlaneToVoxel.residual(&grid, found.index, &moved, normal.as_ref()).unwrap();
        assert!((residual.powi(2) - (d.transpose() * M * d).x).abs() < 1e-12);
        let (J, weight) = (numeric_jacobian(&moved), 0.3 + 0.2 * wave(i, 0.3));
        H += J.transpose() * M * J * weight;
        b += J.transpose() * M * d * weight;
        pairs.push(Correspondence { source: i as u32, target: found.index, moved, normal, residual, weight });
    }
    assert!(pairs.len() > 100 && num_alone > 10, "{} {num_alone}", pairs.len());
    let found = PlaneToVoxel.normal_equations(&grid, &pairs);
    assert!((found.H - H).norm() < 1e-7 * H.norm() && (found.b - b).norm() < 1e-7 * b.norm());
    for stray in [f64::NAN, f64::INFINITY, 1e200, 5.0] {
        assert_eq!(grid.nearest(&Vector3::new(stray, 0.0, 0.0), f64::INFINITY), None);
    }
}
