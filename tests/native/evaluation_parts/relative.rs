//! Errors over a distance: pairs of poses, drift, relations between scans.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use scanstitch::evaluation::drift::drift;
use scanstitch::evaluation::pairs::{DeltaUnit, PairOptions, index_pairs};
use scanstitch::evaluation::path::Path;
use scanstitch::evaluation::relation_times::time_tolerance;
use scanstitch::evaluation::relations::relation_errors;
use scanstitch::io::relations;
use scanstitch::io::trajectory::{self, Trajectory};
use scanstitch_scene::random::Random;

use super::samples::winding;

#[test]
fn pairs_a_delta_apart_in_seconds() {
    let path = Path::of(&winding(30), 0..30);
    let options = PairOptions { delta: 0.5, delta_unit: DeltaUnit::Seconds, ..PairOptions::default() };
    assert_eq!(index_pairs(&path, &options).unwrap(), [(0, 5), (5, 10), (10, 15), (15, 20), (20, 25)]);
    let all = index_pairs(&path, &PairOptions { all_pairs: true, ..options }).unwrap();
    assert!(all.iter().map(|(i, j)| j - i).eq([5; 25]));
}

#[test]
fn pairs_by_progress_agree_with_a_search_through_all() {
    let mut random = Random::new(8);
    let mut at = Vector3::zeros();
    let positions: Vec<_> = (0..300)
        .map(|_| {
            // Every third pose stands still: distances are repeated.
            if random.happens(0.66) {
                at += Vector3::new(random.uniform(0.0, 0.2), 0.0, 0.0);
            }
            at
        })
        .collect();
    let path = Path { positions, rotations: None, stamps: None };
    let distances = path.distances();
    for delta in [0.0, 0.15, 1.0, 5.0] {
        let options = PairOptions { delta, delta_unit: DeltaUnit::Meters, all_pairs: true, ..PairOptions::default() };
        let mut expected = Vec::new();
        for i in 0..distances.len() - 1 {
            let off = |j: &usize| (distances[*j] - distances[i] - delta).abs();
            let j = (i + 1..distances.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
            if off(&j) <= delta * 0.1 {
                expected.push((i, j));
            }
        }
        assert_eq!(index_pairs(&path, &options).unwrap(), expected, "{delta}");
    }
}

#[test]
fn drift_of_a_known_scale_and_turn() {
    // 1000 m straight on, a pose a metre; the estimate is 2 % long and turns by 0.01 deg/m.
    let straight = |scale: f64, turn: f64| {
        let mut pose = Isometry3::identity();
        let step = Isometry3::from_parts(
            Translation3::new(scale, 0.0, 0.0),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn.to_radians()),
        );
        let poses: Vec<_> = (0..1001)
            .map(|_| {
                let now = pose;
                pose *= step;
                now
            })
            .collect();
        Path::of(&Trajectory::from_poses(&poses), 0..1001)
    };
    let truth = straight(1.0, 0.0);
    let scaled = drift(&truth, &straight(1.02, 0.0)).unwrap();
    assert!(scaled.is_kitti && scaled.by_length.len() == 8 && scaled.rotation < 1e-9);
    // A stretch ends at the first pose further along than its length: of 100 m it has 101 steps.
    assert!((scaled.by_length[0].translation - 2.0 * 1.01).abs() < 1e-9, "{scaled:?}");
    assert_eq!(scaled.by_length[0].num_stretches, 90);
    let turned = drift(&truth, &straight(1.0, 0.01)).unwrap();
    assert!((turned.by_length[7].rotation - 0.01 * 801.0 / 800.0).abs() < 1e-9, "{turned:?}");
    let none = drift(&truth, &truth).unwrap();
    assert!(none.translation < 1e-12 && none.rotation < 1e-12);

    // Ten metres are measured over 1, 2, ... 8 m.
    let short = Path { positions: truth.positions.iter().map(|p| p * 0.01).collect(), ..truth.clone() };
    let scaled = drift(&short, &short).unwrap();
    assert!(!scaled.is_kitti);
    assert_eq!(
        scaled.by_length.iter().map(|of| of.length).collect::<Vec<_>>(),
        [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    );
    let still = Path { positions: vec![Vector3::zeros(); 1001], ..truth };
    assert!(drift(&still, &still).unwrap_err().to_string().contains("too short for drift"));
}

#[test]
fn relations_of_every_form() {
    let poses = winding(40);
    let path = Path::of(&poses, 0..40);
    let exact = poses.poses().unwrap();
    let line = |i: usize, j: usize, off: f64| {
        let motion = exact[i].inverse() * exact[j];
        let (t, (roll, pitch, yaw)) = (motion.translation.vector, motion.rotation.euler_angles());
        let q = motion.rotation.coords;
        [
            format!("EDGE3 {i} {j} {} {} {} {roll} {pitch} {yaw} 1 0 0\n", t.x + off, t.y, t.z),
            format!("EDGE_SE3:QUAT {i} {j} {} {} {} {} {} {} {} 1\n", t.x, t.y + off, t.z, q.x, q.y, q.z, q.w),
            format!(
                "{} {} {} {} {} {roll} {pitch} {yaw}\r\n",
                100.0 + 0.1 * i as f64,
                100.0 + 0.1 * j as f64,
                t.x,
                t.y,
                t.z + off
            ),
        ]
    };
    for form in 0..3 {
        let text = format!("# relations\nVERTEX2 0 0 0 0\n{}{}", line(3, 30, 0.0)[form], line(5, 6, 0.5)[form]);
        let read = relations::read(text.as_bytes()).unwrap();
        assert_eq!(read.iter().map(relations::Relation::is_step).collect::<Vec<_>>(), [false, form < 2]);
        let errors = relation_errors(&read, &path, 0.01).unwrap();
        assert!((errors.translation.max - 0.5).abs() < 1e-9 && errors.translation.min < 1e-9, "{errors:?}");
        assert!(errors.rotation.max < 1e-9);
        assert!((errors.mean_squared_translation - 0.125).abs() < 1e-9);
    }
    for (text, told) in [
        ("", "The file has no relation."),
        ("EDGE2 0 1 0.5\n", "line 1: The line has 3 of 5 numbers"),
        ("EDGE3 0 1 1.0 0.0 0.5\n", "line 1: The line has 5 of 8 numbers"),
        ("EDGE_SE3:QUAT 0 1 1 0 0 0 0 0.7071\n", "line 1: The line has 8 of 9 numbers"),
        (
            "EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 0\n",
            "line 1: The pose indices are not whole numbers from 0, or the quaternion",
        ),
        ("# a\r\nEDGE2 0 1 0.5 nan 1\r\n", "line 2: \"nan\" is not a finite number"),
        ("EDGE2 0 1.5 0 0 0\n", "line 1: The pose indices are not whole numbers from 0"),
    ] {
        let error = relations::read(text.as_bytes()).unwrap_err().to_string();
        assert!(error.starts_with(told), "{error}");
    }
    let far = relations::read(b"EDGE2 100 200 0 0 0\n").unwrap();
    assert!(relation_errors(&far, &path, 0.01).unwrap_err().to_string().contains("none of the 1 relations"));
}

/// A square of one metre, driven at one pose a second from 70.25 s on, and relations that are off by known amounts.
#[test]
fn figures_of_relations_by_time_on_poses_made_by_hand() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let text =
        format!("70.25 0 0 0 0 0 0 1\n71.25 1 0 0 0 0 {s} {s}\n72.25 1 1 0 0 0 1 0\n", s = (quarter / 2.0).sin());
    let estimate = trajectory::read(text.as_bytes()).unwrap();
    let path = Path::of(&estimate, 0..3);
    assert_eq!(time_tolerance(path.stamps.as_ref().unwrap()), 0.1);
    let read = |text: &str| relations::read(text.as_bytes()).unwrap();
    let degree = 1f64.to_radians();
    // Between the first two poses.
    let turned = 0.04 * quarter;
    let (x, y) = (0.96 * turned.cos() + turned.sin(), turned.cos() - 0.96 * turned.sin());
    let list = format!(
        "70.250000 71.250000 1.03 0.04 0 0 0 {}\n71.25 72.25 1 -0.6 0 0 0 {quarter}\n70.29 72.25 {x} {y} 0 0 0 {}\n\
         70.25 73.25 0 0 0 0 0 0\n",
        quarter - 2.0 * degree,
        2.0 * quarter - turned + 6.0 * degree
    );
    let errors = relation_errors(&read(&list), &path, 0.1).unwrap();
    assert_eq!((errors.num_relations, errors.num_compared, errors.num_left_out), (4, 3, 1));
    // inv(delta*) delta: the error's length does not depend on how delta* is turned.
    for (found, expected) in errors.translation_errors.iter().zip([0.05, 0.6, 0.0]) {
        assert!((found - expected).abs() < 1e-12, "{errors:?}");
    }
    for (found, expected) in errors.rotation_errors.iter().zip([2.0, 0.0, 6.0]) {
        assert!((found.to_degrees() - expected).abs() < 1e-6, "{errors:?}");
    }
    let (t, r) = (errors.translation, errors.rotation);
    assert!((t.mean - 0.65 / 3.0).abs() < 1e-12 && (t.median - 0.05).abs() < 1e-12 && (t.max - 0.6).abs() < 1e-12);
    assert!((r.mean.to_degrees() - 8.0 / 3.0).abs() < 1e-6 && (r.median.to_degrees() - 2.0).abs() < 1e-6);
    let deviation = ((0.05f64.powi(2) + 0.36) / 3.0 - t.mean * t.mean).sqrt();
    assert!((t.std - deviation).abs() < 1e-12);
    // One is off by more than 0.5 m, one by more than 5 degrees.
    assert_eq!((errors.num_wrong, errors.share_wrong, errors.max_diff), (2, 2.0 / 3.0, Some(0.1)));
    assert!(errors.notes.is_empty());
}

#[test]
fn relations_whose_times_fit_no_pose_are_reported_with_the_remedy() {
    let mut random = Random::new(4);
    let mut time = 0.11;
    let stamps: Vec<f64> = (0..500)
        .map(|_| {
            time += random.uniform(0.08, 0.2);
            time
        })
        .collect();
    let estimate = winding(500).with_stamps(stamps.clone()).unwrap();
    let path = Path::of(&estimate, 0..500);
    let tolerance = time_tolerance(&stamps);
    assert!((0.06..0.08).contains(&tolerance), "{tolerance}");
    let list = |shift: f64| {
        let line = |i: usize| format!("{:.6} {:.6} 0.1 0 0 0 0 0\n", stamps[i] + shift, stamps[i + 7] + shift);
        relations::read((0..490).map(line).collect::<String>().as_bytes()).unwrap()
    };
    // Exact times; no other pose is taken.
    let fits = relation_errors(&list(0.0), &path, tolerance).unwrap();
    assert_eq!((fits.num_compared, fits.num_left_out, fits.notes.len()), (490, 0, 0));
    // Another clock: none fits, and the offset is found.
    let told = relation_errors(&list(700.179), &path, tolerance).unwrap_err().to_string();
    assert!(told.starts_with("The estimate has the poses of none of the 490 relations within 0.0"), "{told}");
    assert!(told.contains("an offset of 700.179 s would make them meet"), "{told}");
    // Of the same span, but of another recording: what is compared is chance, which is told.
    let others = |i: u32| format!("{} {} 0.1 0 0 0 0 0\n", 0.3 + 0.497 * f64::from(i), 500.0 + f64::from(i));
    let others = relations::read((0..100).map(others).collect::<String>().as_bytes()).unwrap();
    let told = relation_errors(&others, &path, tolerance).unwrap_err().to_string();
    assert!(told.contains("Give the relations of this recording"), "{told}");
    let mixed: Vec<_> = others.iter().copied().chain(list(0.0).into_iter().take(20)).collect();
    let partly = relation_errors(&mixed, &path, tolerance).unwrap();
    assert_eq!(partly.num_compared, 20);
    assert!(partly.notes[0].contains("both poses of 20 of the 120 relations"), "{:?}", partly.notes);
    // Poses that are counted have no times, though some lie near a relation's by chance.
    let counted = winding(500).with_stamps((0..500).map(f64::from).collect()).unwrap();
    let told = relation_errors(&list(0.0), &Path::of(&counted, 0..500), 0.1).unwrap_err().to_string();
    assert!(told.contains("the estimate counts its poses: 0, 1, 2. Reconstruct the log anew"), "{told}");
    let told = relation_errors(&list(0.0), &Path { stamps: None, ..path.clone() }, 0.1).unwrap_err().to_string();
    assert!(told.contains("and the estimate has none"), "{told}");
    // By index, of a longer log.
    let edges: Vec<String> = (400..900).map(|i| format!("EDGE2 {i} {} 1 0 0 1 0 1 1 0 0", i + 30)).collect();
    let longer = relation_errors(&relations::read(edges.join("\n").as_bytes()).unwrap(), &path, 0.1).unwrap();
    assert_eq!((longer.num_compared, longer.max_diff), (70, None));
    assert!(longer.notes[0].contains("they count poses up to 929, and the estimate has 500"), "{:?}", longer.notes);
}
