//! The similarity that lays one path on the other.

use nalgebra::{Rotation3, Vector3};
use scanstitch::evaluation::alignment::Alignment;
use scanstitch::evaluation::umeyama::umeyama;

use scanstitch::evaluation::{EvaluationOptions, evaluate};
use scanstitch::geometry::Pose3;
use scanstitch::io::trajectory::{read, tum_text};

use super::samples::winding;

#[test]
fn a_rotated_first_pose_of_the_reference_is_reported_with_the_aligned_error() {
    let pose = |i: u32| Pose3::new(Vector3::new(0.3 * f64::from(i), f64::from(i % 5) * 0.2, 0.0), Vector3::zeros());
    let poses: Vec<Pose3> = (0..20).map(pose).collect();
    let mut turned = poses.clone();
    turned[0] *= Pose3::rotation(Vector3::z() * 0.05);
    let trajectory = |poses: &[Pose3]| read(tum_text(None, poses).as_bytes()).unwrap();
    let compare = |reference: &[Pose3], alignment| {
        let options = EvaluationOptions { alignment, ..Default::default() };
        evaluate(&trajectory(reference), &trajectory(&poses), &options).unwrap().summary
    };
    let off = compare(&turned, Alignment::Origin);
    assert!(off.mean_l2 > 0.1 && off.aligned.unwrap().mean < 1e-9, "{} m", off.mean_l2);
    assert!(off.notes.iter().any(|note| note.contains("its first row explains most of the error")), "{:?}", off.notes);
    assert!(compare(&poses, Alignment::Origin).notes.is_empty());
    assert!(compare(&turned, Alignment::Se3).notes.is_empty());
}

#[test]
fn poses_that_are_the_identity_on_the_way_and_times_without_digits_are_told() {
    let pose = |i: u32| Pose3::new(Vector3::new(0.3 * f64::from(i), f64::from(i % 5) * 0.2, 0.0), Vector3::zeros());
    let poses: Vec<Pose3> = (0..20).map(pose).collect();
    let mut lost = poses.clone();
    lost[7..10].fill(Pose3::identity());
    let stamps: Vec<f64> = (0..20).map(|i| f64::from(i) + 0.25).collect();
    let trajectory = |poses: &[Pose3], stamps: &[f64]| read(tum_text(Some(stamps), poses).as_bytes()).unwrap();
    let compare = |estimate: &[Pose3], times: &[f64]| {
        let (reference, estimate) = (trajectory(&poses, &stamps), trajectory(estimate, times));
        evaluate(&reference, &estimate, &EvaluationOptions::default()).map(|found| found.summary.notes)
    };
    let told = compare(&lost, &stamps).unwrap().concat();
    assert!(told.contains("3 poses of the estimate, pose 7 first (counted from 0), are the identity"), "{told}");
    // One that begins there and stands still is no such path.
    let still: Vec<Pose3> = [&poses[..1], &poses[..1], &poses[..18]].concat();
    assert!(!compare(&still, &stamps).unwrap().concat().contains("identity"));
    let refused = compare(&poses, &[1305.0; 20]).unwrap_err().to_string();
    assert!(refused.contains("All times of one of them are the same"), "{refused}");
}

#[test]
fn umeyama_finds_a_similarity_and_refuses_degenerate_points() {
    let points = winding(50).positions;
    let rotation = Rotation3::from_euler_angles(0.4, -1.0, 2.5);
    let (translation, scale) = (Vector3::new(10.0, -4.0, 0.3), 2.5);
    let moved: Vec<_> = points.iter().map(|p| scale * (rotation * p) + translation).collect();
    let found = umeyama(&points, &moved, true).unwrap().similarity;
    assert!((found.rotation - rotation.matrix()).amax() < 1e-14 && (found.scale - scale).abs() < 1e-14);
    assert!((found.translation - translation).amax() < 1e-13);

    // Points in a plane fix it as well.
    let flat: Vec<_> = points.iter().map(|p| Vector3::new(p.x, p.y, 0.0)).collect();
    let moved: Vec<_> = flat.iter().map(|p| rotation * p + translation).collect();
    assert!((umeyama(&flat, &moved, false).unwrap().similarity.rotation - rotation.matrix()).amax() < 1e-14);

    // Mirrored points: the best rotation, not the reflection.
    let mirrored: Vec<_> = points.iter().map(|p| Vector3::new(p.x, p.y, -p.z)).collect();
    let found = umeyama(&points, &mirrored, true).unwrap().similarity;
    assert!((found.rotation.determinant() - 1.0).abs() < 1e-14);
    let sse = |R: &nalgebra::Matrix3<f64>| -> f64 {
        let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let (from, to) = (mean(&points), mean(&mirrored));
        points.iter().zip(&mirrored).map(|(p, q)| (R * (p - from) - (q - to)).norm_squared()).sum()
    };
    let rigid = umeyama(&points, &mirrored, false).unwrap().similarity.rotation;
    for turn in [Vector3::x(), Vector3::y(), Vector3::z()] {
        for angle in [-1e-2, 1e-2] {
            assert!(sse(&(Rotation3::new(turn * angle) * rigid)) > sse(&rigid));
        }
    }

    let along = |direction: Vector3<f64>, n: usize| -> Vec<_> { (0..n).map(|i| direction * i as f64).collect() };
    let line = |n: usize| along(Vector3::new(0.0, 0.2, 0.0), n);
    for (source, target, why) in [
        (line(30), points[..30].to_vec(), "straight line"),
        (points[..30].to_vec(), line(30), "straight line"),
        (points[..2].to_vec(), points[..2].to_vec(), "straight line"),
        (vec![points[0]; 5], points[..5].to_vec(), "stays in one place"),
        (points[..1].to_vec(), points[..1].to_vec(), "stays in one place"),
        (vec![], vec![], "there are none"),
        (points[..9].iter().map(|p| p * 1e200).collect(), points[..9].to_vec(), "too large"),
    ] {
        let n = source.len();
        let told = umeyama(&source, &target, true).map(|fit| fit.similarity.scale).map_err(|error| error.to_string());
        let told = told.expect_err(why);
        assert!(told.contains(why) && told.starts_with(&format!("{n} pairs of positions")), "{told}");
    }

    // A line that is none but for its file's nine decimals: aligned, as evo does, and what is chance is told.
    let rounded: Vec<_> =
        along(Vector3::new(0.1, 0.2, 0.7), 30).iter().map(|p| p.map(|x| (x * 1e9).sin() * 1e-9 + x)).collect();
    let fit = umeyama(&points[..30], &rounded, false).unwrap();
    assert!(fit.is_about_a_line && !umeyama(&points, &points, false).unwrap().is_about_a_line);
    let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let distances = |R: nalgebra::Matrix3<f64>| -> Vec<f64> {
        let t = mean(&rounded) - R * mean(&points[..30]);
        points.iter().zip(&rounded).map(|(p, q)| (R * p + t - q).norm()).collect()
    };
    let turn = Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(Vector3::new(0.1, 0.2, 0.7)), 1.0);
    for (one, other) in distances(fit.similarity.rotation).iter().zip(distances(turn * fit.similarity.rotation)) {
        assert!((one - other).abs() < 1e-7, "{one} {other}");
    }
}
