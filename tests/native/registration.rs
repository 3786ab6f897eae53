//! Registration against known motions, in the plane and in space, and where the scene leaves a motion open.

use std::fs;

use crate::common::{pose_of, shared_data};
use nalgebra::{Vector2, Vector3, Vector6};
use scanstitch::geometry::{PointCloud, Pose2, Pose3, RigidMotion, SquareMatrix, Vector};
use scanstitch::preprocess::planar_scan::PlanarScan;
use scanstitch::registration::align::{CloudMetric, RegistrationOptions, register_clouds};
use scanstitch::registration::factors::{Correspondence, Factor, PointToPlane, PointToPoint, best_rigid_motion};
use scanstitch::registration::icp::{Criteria, IcpOptions, Rejection, Source, Weighting, register};
use scanstitch::registration::robust_kernel::RobustKernel;
use scanstitch::registration::target::{OrientedTarget, PointTarget, Target};

const OPTIONS: IcpOptions = IcpOptions {
    rejection: Rejection { max_correspondence_distance: 0.5, max_normal_angle: 0.8, trim_fraction: 0.0 },
    weighting: Weighting { robust_kernel: RobustKernel::Cauchy, robust_kernel_width: 0.05 },
    criteria: Criteria { max_iterations: 100, rotation_eps: 1e-9, translation_eps: 1e-9 },
};

/// Returns of 361 beams over 360 degrees from the inside of a polygon with the sensor at the origin.
fn scan_inside(corners: &[[f64; 2]]) -> Vec<Vector2<f64>> {
    let walls: Vec<(Vector2<f64>, Vector2<f64>)> = (0..corners.len())
        .map(|i| (Vector2::from(corners[i]), Vector2::from(corners[(i + 1) % corners.len()])))
        .collect();
    let beam = |i: u32| {
        let bearing = f64::from(i).to_radians();
        let direction = Vector2::new(bearing.cos(), bearing.sin());
        let ranges = walls.iter().filter_map(|(a, b)| {
            let along = b - a;
            let determinant = direction.perp(&along);
            let (range, share) = (a.perp(&along) / determinant, a.perp(&direction) / determinant);
            (range > 0.0 && (0.0..=1.0).contains(&share)).then_some(range)
        });
        direction * ranges.fold(f64::INFINITY, f64::min)
    };
    (0..360).map(beam).filter(|p| p.norm().is_finite()).collect()
}

const ROOM: [[f64; 2]; 6] = [[-3.0, -2.0], [4.0, -2.0], [4.0, 1.5], [1.0, 1.5], [1.0, 3.0], [-3.0, 3.0]];

fn moved(points: &[Vector2<f64>], T: &Pose2) -> Vec<Vector2<f64>> {
    points.iter().map(|p| T.act(p)).collect()
}

#[test]
fn point_to_line_finds_a_known_motion_from_a_different_sampling() {
    let target = PlanarScan::new(scan_inside(&ROOM));
    let T = Pose2::exp(&Vector3::new(0.08, 0.25, -0.15));
    // The same room from another place: other points on the same walls.
    let corners = ROOM.map(|c| <[f64; 2]>::from(T.inverse().act(&Vector2::from(c))));
    let source = PlanarScan::new(scan_inside(&corners));
    let oriented = OrientedTarget::new(target.points.clone(), target.normals.clone());
    let source = Source { points: &source.points, normals: Some(&source.normals), sigmas: None };
    let result = register(source, &oriented, Pose2::identity(), &PointToPlane, &OPTIONS);
    let error = T.inverse() * result.T_target_source;
    assert!(result.converged && error.translation_norm() < 1e-3 && error.rotation_angle() < 1e-3, "{error}");
    assert!(!result.observability.is_undetermined());
    assert_eq!(result.last, *result.history.last().unwrap());

    let points = PointTarget::new(target.points);
    let result = register(source, &points, Pose2::identity(), &PointToPoint, &OPTIONS);
    let error = T.inverse() * result.T_target_source;
    assert!(error.translation_norm() < 0.05 && error.rotation_angle() < 0.02, "{error}");
}

#[test]
fn a_bare_corridor_leaves_the_motion_along_it_open_and_a_round_room_the_turn() {
    let register_to_itself = |scan: Vec<Vector2<f64>>| {
        let scan = PlanarScan::new(scan);
        let target = OrientedTarget::new(scan.points.clone(), scan.normals.clone());
        let source = Source { points: &scan.points, normals: Some(&scan.normals), sigmas: None };
        register(source, &target, Pose2::identity(), &PointToPlane, &OPTIONS)
    };
    let walls = [[-1e4, -1.0], [1e4, -1.0], [1e4, 1.0], [-1e4, 1.0]];
    let corridor = scan_inside(&walls).into_iter().filter(|p| p.norm() < 20.0).collect();
    let corridor = register_to_itself(corridor).observability;
    assert!(corridor.is_undetermined());
    assert!(corridor.weakest_direction[1].abs() > 0.999, "along x: {}", corridor.weakest_direction);

    let circle: Vec<[f64; 2]> =
        (0..720).map(|i| f64::from(i).to_radians() / 2.0).map(|a| [3.0 * a.cos(), 3.0 * a.sin()]).collect();
    let round = register_to_itself(scan_inside(&circle)).observability;
    assert!(round.is_undetermined());
    assert!(round.weakest_direction[0].abs() > 0.999, "the turn: {}", round.weakest_direction);

    assert!(!register_to_itself(scan_inside(&ROOM)).observability.is_undetermined());
}

#[test]
fn trimming_and_robust_kernels_withstand_outliers_that_least_squares_does_not() {
    let target = PlanarScan::new(scan_inside(&ROOM));
    let T = Pose2::exp(&Vector3::new(0.03, 0.05, 0.08));
    let mut source = moved(&target.points, &T.inverse());
    // A person stands by the wall: one beam in nine is 0.3 m short.
    for point in source.iter_mut().step_by(9) {
        *point *= (point.norm() - 0.3) / point.norm();
    }
    let error_with = |robust_kernel, trim_fraction| {
        let options = IcpOptions {
            rejection: Rejection { trim_fraction, ..OPTIONS.rejection },
            weighting: Weighting { robust_kernel, robust_kernel_width: 0.03 },
            ..OPTIONS
        };
        let oriented = OrientedTarget::new(target.points.clone(), target.normals.clone());
        let source = Source { points: &source, normals: None, sigmas: None };
        let result = register(source, &oriented, Pose2::identity(), &PointToPlane, &options);
        (T.inverse() * result.T_target_source).translation_norm()
    };
    let plain = error_with(RobustKernel::None, 0.0);
    for kernel in [RobustKernel::Huber, RobustKernel::Cauchy, RobustKernel::GemanMcclure, RobustKernel::Tukey] {
        let robust = error_with(kernel, 0.0);
        assert!(robust < 0.5 * plain, "{kernel:?}: {robust} against {plain}");
    }
    let trimmed = error_with(RobustKernel::None, 0.15);
    assert!(trimmed < 0.2 * plain, "{trimmed} against {plain}");
}

#[test]
fn nothing_to_match_is_no_convergence_and_no_panic() {
    let far = PointTarget::new(vec![Vector2::new(100.0, 100.0)]);
    let here = [Vector2::new(1.0, 0.0), Vector2::new(0.0, 1.0)];
    let guess = Pose2::translation(0.5, 0.25);
    for points in [&here[..], &[]] {
        let source = Source { points, normals: None, sigmas: None };
        let result = register(source, &far, guess, &PointToPoint, &OPTIONS);
        assert!(!result.converged);
        assert_eq!(result.T_target_source, guess);
        assert_eq!((result.last.num_correspondences, result.fitness), (0, 0.0));
    }
}

/// Residual vectors' squared sum, as a function of a perturbation on the left.
fn check_normal_equations<M: RigidMotion, T: Target<Point = M::Point>>(
    factor: &impl Factor<M, T>,
    target: &T,
    correspondences: &[Correspondence<M::Point>],
    residuals: impl Fn(&M) -> Vec<f64>,
) {
    let h = 1e-6;
    let unit = |axis: usize, size: f64| {
        let mut unit = M::Tangent::zeros();
        unit[axis] = size;
        unit
    };
    let columns: Vec<Vec<f64>> = (0..M::Tangent::LEN)
        .map(|axis| {
            let (ahead, behind) = (residuals(&M::exp(&unit(axis, h))), residuals(&M::exp(&unit(axis, -h))));
            ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * h)).collect()
        })
        .collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let r = residuals(&M::identity());
    let equations = factor.normal_equations(target, correspondences);
    for row in 0..M::Tangent::LEN {
        assert!((equations.b[row] - dot(&columns[row], &r)).abs() < 1e-6 * (1.0 + equations.b.norm()));
        for column in 0..M::Tangent::LEN {
            let numeric = dot(&columns[row], &columns[column]);
            assert!(
                (equations.H[(row, column)] - numeric).abs() < 1e-6 * (1.0 + equations.H.norm_squared().sqrt()),
                "{row} {column}"
            );
        }
    }
}

#[test]
fn normal_equations_agree_with_numeric_jacobians_in_space() {
    let wave = |i: usize, k: f64| ((i as f64) * k).sin();
    let points: Vec<Vector3<f64>> =
        (0..40).map(|i| Vector3::new(3.0 * wave(i, 1.1), 2.0 * wave(i, 2.3), wave(i, 3.7))).collect();
    let normals: Vec<Vector3<f64>> =
        (0..40).map(|i| Vector3::new(wave(i, 0.7), wave(i, 1.9), 1.3 + wave(i, 5.1)).normalize()).collect();
    let oriented = OrientedTarget::new(points.clone(), normals.iter().copied().map(Some).collect());
    let partners: Vec<Vector3<f64>> = points
        .iter()
        .enumerate()
        .map(|(i, p)| p + Vector3::new(wave(i, 9.1), wave(i, 8.3), wave(i, 7.7)) * 0.1)
        .collect();
    let weight = |i: usize| 0.2 + 0.7 * wave(i, 0.3).abs();
    let pairs: Vec<Correspondence<Vector3<f64>>> = (0..40)
        .map(|i| Correspondence {
            source: i as u32,
            target: i as u32,
            moved: partners[i],
            normal: None,
            residual: normals[i].dot(&(partners[i] - points[i])),
            weight: weight(i),
        })
        .collect();
    check_normal_equations(&PointToPlane, &oriented, &pairs, |T: &Pose3| {
        (0..40).map(|i| weight(i).sqrt() * normals[i].dot(&(T.act(&partners[i]) - points[i]))).collect()
    });
    let plain = PointTarget::new(points.clone());
    check_normal_equations(&PointToPoint, &plain, &pairs, |T: &Pose3| {
        (0..40).flat_map(|i| ((T.act(&partners[i]) - points[i]) * weight(i).sqrt()).as_slice().to_vec()).collect()
    });
}

#[test]
fn normal_equations_agree_with_numeric_jacobians_in_the_plane() {
    let target = PlanarScan::new(scan_inside(&ROOM));
    let oriented = OrientedTarget::new(target.points.clone(), target.normals.clone());
    let T = Pose2::exp(&Vector3::new(0.05, 0.1, -0.1));
    let pairs: Vec<Correspondence<Vector2<f64>>> = moved(&target.points, &T)
        .into_iter()
        .enumerate()
        .filter_map(|(i, moved)| {
            let partner = oriented.nearest(&moved, 0.5)?.index;
            let normal = oriented.normal(partner)?;
            let residual = normal.dot(&(moved - oriented.point(partner)));
            Some(Correspondence { source: i as u32, target: partner, moved, normal: None, residual, weight: 0.5 })
        })
        .collect();
    assert!(pairs.len() > 300);
    check_normal_equations(&PointToPlane, &oriented, &pairs, |T: &Pose2| {
        let residual = |c: &Correspondence<Vector2<f64>>| {
            0.5f64.sqrt() * oriented.normal(c.target).unwrap().dot(&(T.act(&c.moved) - oriented.point(c.target)))
        };
        pairs.iter().map(residual).collect()
    });
}

#[test]
fn the_best_rigid_motion_is_exact_and_never_a_reflection() {
    let T = Pose3::exp(&Vector6::new(0.5, -1.1, 0.4, 1.0, 2.0, -3.0));
    let source: Vec<Vector3<f64>> = (0..20)
        .map(|i| Vector3::new(f64::from(i).sin(), (2.0 * f64::from(i)).cos(), (0.3 * f64::from(i)).sin()))
        .collect();
    let found: Pose3 = best_rigid_motion(source.iter().map(|p| (*p, T.act(p), 1.0))).unwrap();
    assert!((T.inverse() * found).log().norm() < 1e-12);

    // A mirror image has no exact motion; the answer is still a rotation.
    let mirrored = source.iter().map(|p| (*p, Vector3::new(-p.x, p.y, p.z), 1.0));
    let found: Pose3 = best_rigid_motion(mirrored).unwrap();
    assert!((found.rotation.to_rotation_matrix().matrix().determinant() - 1.0).abs() < 1e-12);

    // Collinear and single points leave the rotation open, but not the fit.
    for count in [1, 2, 5] {
        let line = (0..count).map(|i| Vector3::new(f64::from(i), 0.0, 0.0));
        let pairs: Vec<_> = line.map(|p| (p, T.act(&p), 2.0)).collect();
        let found: Pose3 = best_rigid_motion(pairs.iter().copied()).unwrap();
        assert!(pairs.iter().all(|(p, q, _)| (found.act(p) - q).norm() < 1e-9), "{count} points");
    }
    assert!(best_rigid_motion::<Pose3>(std::iter::empty()).is_none());
    let nan = (Vector3::repeat(f64::NAN), Vector3::zeros(), 1.0);
    assert!(best_rigid_motion::<Pose3>(std::iter::once(nan)).is_none());
}

#[test]
fn clouds_in_map_coordinates_register_as_well_as_near_zero() {
    let points: Vec<glam::Vec3> =
        scan_inside(&ROOM).iter().map(|p| glam::Vec3::new(p.x as f32, p.y as f32, 0.0)).collect();
    let target = PointCloud { origin: glam::DVec3::new(5e5, 4e6, 0.0), ..PointCloud::from_positions(points.clone()) };
    let source =
        PointCloud { origin: glam::DVec3::new(5e5 + 0.1, 4e6 - 0.05, 0.0), ..PointCloud::from_positions(points) };
    let result = register_clouds(&source, &target, &RegistrationOptions::default()).unwrap();
    let T = pose_of(&result.T_target_source);
    let moved = T.act(&Vector3::new(5e5 + 0.1, 4e6 - 0.05, 0.0)) - Vector3::new(5e5, 4e6, 0.0);
    assert!(result.converged && moved.norm() < 1e-3, "{moved}");
}

#[test]
fn options_that_do_not_fit_the_clouds_are_refused_with_a_remedy() {
    let flat = PointCloud::from_positions(vec![glam::Vec3::new(1.0, 2.0, 0.0); 3]);
    let solid = PointCloud::from_positions(vec![glam::Vec3::new(1.0, 2.0, 3.0); 3]);
    let refused = |source: &PointCloud, target: &PointCloud, options: RegistrationOptions| {
        register_clouds(source, target, &options).unwrap_err().to_string()
    };
    let metric = |metric| RegistrationOptions { metric: Some(metric), ..RegistrationOptions::default() };
    assert!(refused(&flat, &solid, RegistrationOptions::default()).contains("source is planar"));
    assert!(refused(&flat, &flat, metric(CloudMetric::PointToPlane)).contains("Use point_to_line"));
    assert!(refused(&solid, &solid, metric(CloudMetric::PointToPlane)).contains("the target has none"));
    assert!(refused(&solid, &solid, metric(CloudMetric::PointToLine)).contains("clouds in space"));
    assert!(refused(&PointCloud::default(), &flat, RegistrationOptions::default()).contains("no finite point"));
    let skewed = RegistrationOptions { init_T_target_source: Some([1.0; 16]), ..RegistrationOptions::default() };
    assert!(refused(&solid, &solid, skewed).contains("init_T_target_source is not a rigid motion"));
}

#[test]
fn search_windows_that_are_negative_or_too_large_are_refused() {
    let room = PointCloud::from_positions(vec![glam::Vec3::new(1.0, 2.0, 0.0); 3]);
    for (search_translation, search_rotation) in [(1e9, 0.0), (0.5, f64::INFINITY), (-1.0, 0.5), (f64::NAN, 0.0)] {
        let options = RegistrationOptions { search_translation, search_rotation, ..RegistrationOptions::default() };
        let error = register_clouds(&room, &room, &options).unwrap_err().to_string();
        assert!(error.contains("search window") && error.contains("negative or too large"), "{error}");
    }
}

#[test]
fn robust_kernels_without_a_width_are_refused() {
    let flat: Vec<glam::Vec3> =
        scan_inside(&ROOM).iter().map(|p| glam::Vec3::new(p.x as f32, p.y as f32, 0.0)).collect();
    let solid = PointCloud::from_positions(flat.iter().map(|p| p.with_z(p.x * p.y)).collect());
    for cloud in [PointCloud::from_positions(flat), solid] {
        let with = |robust_kernel, robust_kernel_width| {
            let options = RegistrationOptions { robust_kernel, robust_kernel_width, ..RegistrationOptions::default() };
            register_clouds(&cloud, &cloud, &options)
        };
        for width in [0.0, -0.1, f64::NAN] {
            let error = with(RobustKernel::Cauchy, width).unwrap_err().to_string();
            assert!(error.contains("robust_kernel_width") && error.contains("is not positive"), "{error}");
        }
        // Without a kernel there is no width to check.
        assert!(with(RobustKernel::None, 0.0).unwrap().converged);
    }
}

/// A pair with normals and a known motion between.
#[test]
fn car_cloud_in_space_by_point_to_plane() {
    let Some(folder) = shared_data("lidar/car_cloud") else { return };
    let list = fs::read_to_string(folder.join("carCloudList.csv")).unwrap();
    let numbers = |line: &str| -> Vec<f64> {
        let words = line.split([',', ' ']).filter(|word| !word.is_empty());
        words.filter_map(|word| word.parse().ok()).collect()
    };
    let T_target_source = pose_of(&numbers(list.lines().nth(2).unwrap()));
    let rows = |name: &str, columns: usize| -> Vec<Vec<f64>> {
        let text = fs::read_to_string(folder.join(format!("{name}.csv"))).unwrap();
        text.lines().map(numbers).filter(|row| row.len() == columns).collect()
    };
    let vectors = |rows: &[Vec<f64>], from: usize| -> Vec<glam::Vec3> {
        rows.iter().map(|row| glam::DVec3::from_slice(&row[from..]).as_vec3()).collect()
    };
    let (target, source) = (rows("car_cloud400", 6), rows("car_cloud401", 3));
    assert!(target.len() > 20_000 && source.len() > 20_000);
    let normals = Some(vectors(&target, 3));
    let target = PointCloud { normals, ..PointCloud::from_positions(vectors(&target, 0)) };
    let source = PointCloud::from_positions(vectors(&source, 0));
    let options =
        RegistrationOptions { max_correspondence_distance: 1.0, max_iterations: 200, ..RegistrationOptions::default() };
    let result = register_clouds(&source, &target, &options).unwrap();
    let error = T_target_source.inverse() * pose_of(&result.T_target_source);
    println!("{} iterations, {:?}, {error}", result.iterations, result.inlier_rmse);
    assert!(error.translation_norm() < 0.05 && error.rotation_angle() < 0.5f64.to_radians(), "{error}");
}
