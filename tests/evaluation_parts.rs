//! The parts of an evaluation one by one: association, alignment, drift, relations, map quality, and what they say of
//! input that makes no sense.
#![cfg(not(target_arch = "wasm32"))] // it reads files
#![allow(non_snake_case)]

use std::fs;
use std::path::{Path as FilePath, PathBuf};

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};
use scanstitch::evaluation::alignment::Alignment;
use scanstitch::evaluation::associate::{Pair, by_index, by_time, oddities};
use scanstitch::evaluation::drift::drift;
use scanstitch::evaluation::evaluate::{Association, ErrorMetric, EvaluationOptions, evaluate};
use scanstitch::evaluation::map_quality::{MapQuality, MapQualityOptions, map_quality};
use scanstitch::evaluation::metrics::PoseRelation;
use scanstitch::evaluation::pairs::{DeltaUnit, PairOptions, index_pairs};
use scanstitch::evaluation::path::Path;
use scanstitch::evaluation::relations::relation_errors;
use scanstitch::evaluation::umeyama::umeyama;
use scanstitch::io::relations;
use scanstitch::io::trajectory::Trajectory;
use scanstitch::scene::random::Random;

fn shared(folder: &str) -> Option<PathBuf> {
    let path = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(folder);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: ../shared/data is absent");
    None
}

fn pairs(found: &[Pair]) -> Vec<(usize, usize)> {
    found.iter().map(|pair| (pair.reference, pair.estimate)).collect()
}

/// A winding path in space.
fn winding(n: usize) -> Trajectory {
    let pose = |i: usize| {
        let s = i as f64 / 20.0;
        let rotation = UnitQuaternion::from_euler_angles(0.3 * s.sin(), 0.2 * (2.0 * s).cos(), s);
        Isometry3::from_parts(Translation3::new(3.0 * s.sin(), 2.0 * (0.7 * s).cos(), 0.1 * s), rotation)
    };
    let stamps = (0..n).map(|i| 100.0 + 0.1 * i as f64).collect();
    Trajectory::from_poses(&(0..n).map(pose).collect::<Vec<_>>()).with_stamps(stamps).unwrap()
}

#[test]
fn nearest_times_as_evo_takes_them() {
    // The shorter one asks; the estimate, when they are as long.
    assert_eq!(pairs(&by_time(&[0.0, 1.0, 2.0, 3.0], &[0.9, 2.2], 0.3, 0.0).unwrap()), [(1, 0), (2, 1)]);
    assert_eq!(pairs(&by_time(&[0.9, 2.2], &[0.0, 1.0, 2.0, 3.0], 0.3, 0.0).unwrap()), [(0, 1), (1, 2)]);
    // Poses of the longer one may be taken twice.
    assert_eq!(pairs(&by_time(&[1.0, 9.0, 10.0], &[0.9, 1.1], 0.2, 0.0).unwrap()), [(0, 0), (0, 1)]);
    // The offset is added to the estimate's times, whoever asks.
    assert_eq!(pairs(&by_time(&[0.0, 1.0, 2.0], &[5.0, 6.0], 0.01, -5.0).unwrap()), [(0, 0), (1, 1)]);
    assert_eq!(pairs(&by_time(&[0.0, 1.0], &[5.0, 6.0, 7.0], 0.01, -5.0).unwrap()), [(0, 0), (1, 1)]);
    // Of two equally near, the earlier.
    assert_eq!(pairs(&by_time(&[0.0, 1.0, 4.0], &[0.5], 1.0, 0.0).unwrap()), [(0, 0)]);
    // At the tolerance exactly.
    assert_eq!(pairs(&by_time(&[0.0, 1.0, 4.0], &[1.5], 0.5, 0.0).unwrap()), [(1, 0)]);
    // Repeated times: before the end the last of them, at the very end the last but one.
    assert_eq!(pairs(&by_time(&[0.0, 1.0, 1.0, 2.0], &[1.0], 0.1, 0.0).unwrap()), [(2, 0)]);
    assert_eq!(pairs(&by_time(&[0.0, 1.0, 1.0, 1.0], &[1.0], 0.1, 0.0).unwrap()), [(2, 0)]);
    // Times that go back: the first of the nearest.
    assert_eq!(pairs(&by_time(&[2.0, 0.0, 1.0, 0.0], &[1.1, 0.0], 0.2, 0.0).unwrap()), [(2, 0), (1, 1)]);
    assert_eq!(pairs(&by_time(&[3.0, 1.0, 2.0], &[1.5], 0.5, 0.0).unwrap()), [(1, 0)]);

    assert_eq!(pairs(&by_index(2, 2).unwrap()), [(0, 0), (1, 1)]);
    assert!(by_index(3, 2).unwrap_err().to_string().contains("The reference has 3 poses and the estimate 2"));
    assert_eq!(oddities(&[0.0, 1.0, 2.0]), None);
    assert_eq!(
        oddities(&[0.0, 2.0, 1.0, 2.0]).unwrap(),
        "its times go back once, first at pose 3; 1 of its times are repeated"
    );
}

#[test]
fn unsorted_times_agree_with_a_search_through_all() {
    let mut random = Random::new(3);
    for _ in 0..50 {
        let mut stamps = || (0..40).map(|_| (random.uniform(0.0, 20.0) * 4.0).round() / 4.0).collect::<Vec<f64>>();
        let (long, short) = (stamps(), stamps()[..25].to_vec());
        let nearest = |query: f64| {
            let best = (0..long.len()).min_by(|&a, &b| (long[a] - query).abs().total_cmp(&(long[b] - query).abs()));
            best.filter(|&index| (long[index] - query).abs() <= 0.3)
        };
        let expected: Vec<(usize, usize)> =
            short.iter().enumerate().filter_map(|(index, &query)| Some((nearest(query)?, index))).collect();
        assert_eq!(pairs(&by_time(&long, &short, 0.3, 0.0).unwrap()), expected);
    }
}

#[test]
fn no_overlap_in_time_tells_both_spans_and_guesses() {
    let reference: Vec<f64> = (0..50).map(|i| 1000.0 + f64::from(i)).collect();
    let told = |estimate: &[f64]| by_time(&reference, estimate, 0.01, 0.0).unwrap_err().to_string();
    let shifted = told(&[0.0, 10.0, 49.0]);
    assert!(
        shifted.contains("the reference spans 1000.000 to 1049.000 s, the estimate 0.000 to 49.000 s"),
        "{shifted}"
    );
    assert!(shifted.contains("an offset of 1000.000 s would make them meet"), "{shifted}");
    for (factor, unit) in [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")] {
        let scaled: Vec<f64> = reference.iter().map(|stamp| (stamp + 0.5) * factor).collect();
        assert!(told(&scaled).contains(&format!("look like {unit}: divide them by 1e")), "{}", told(&scaled));
    }
    let milliseconds_from_zero: Vec<f64> = (0..50).map(|i| 1e7 + 1000.0 * f64::from(i)).collect();
    assert!(told(&milliseconds_from_zero).contains("The estimate's times look like milliseconds"));
    let seconds: Vec<f64> = (0..50).map(f64::from).collect();
    let in_nanoseconds: Vec<f64> = seconds.iter().map(|stamp| 1.7e18 + stamp * 1e9).collect();
    let told_of_reference = by_time(&in_nanoseconds, &seconds, 0.01, 0.0).unwrap_err().to_string();
    assert!(told_of_reference.contains("The reference's times look like nanoseconds"), "{told_of_reference}");
    assert!(told(&[1000.5, 1001.5]).contains("The spans overlap"));
}

#[test]
fn umeyama_finds_a_similarity_and_refuses_what_fixes_none() {
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

#[test]
fn what_cannot_be_evaluated_is_refused_with_a_reason() {
    let full = winding(30);
    let positions = Trajectory { orientations: None, ..full.clone() };
    let one = Trajectory { stamps: Some(vec![100.0]), ..Trajectory::from_poses(&full.poses().unwrap()[..1]) };
    let untimed = Trajectory { stamps: None, ..full.clone() };
    let base = EvaluationOptions::default();
    let told = |reference: &Trajectory, estimate: &Trajectory, options: EvaluationOptions| {
        evaluate(reference, estimate, &options).map(|found| found.summary).unwrap_err().to_string()
    };
    let rotation = EvaluationOptions { relation: PoseRelation::RotationAngleDeg, ..base };
    let rpe = EvaluationOptions { metric: ErrorMetric::Rpe, ..base };
    for (message, expected) in [
        (told(&full, &positions, rotation), "The estimate has positions alone"),
        (
            told(&positions, &full, EvaluationOptions { alignment: Alignment::Origin, ..base }),
            "The reference has positions",
        ),
        (
            told(&full, &untimed, EvaluationOptions { association: Association::Time, ..base }),
            "The estimate has no times",
        ),
        (told(&full, &one, EvaluationOptions { alignment: Alignment::Se3, ..base }), "stays in one place"),
        (told(&full, &one, rpe), "No two of the 1 poses are 1 frames apart"),
        (
            told(&full, &full, EvaluationOptions { alignment: Alignment::Se3, align_first: 2, ..base }),
            "2 pairs of positions",
        ),
        (told(&full, &full, EvaluationOptions { delta: 1.5, ..rpe }), "delta is 1.5 frames"),
        (told(&full, &full, EvaluationOptions { delta: -1.0, ..rpe }), "delta is -1"),
        (
            told(&full, &full, EvaluationOptions { delta: 200.0, delta_unit: DeltaUnit::Degrees, ..rpe }),
            "180 deg at the most",
        ),
        (told(&full, &full, EvaluationOptions { delta: 1e4, delta_unit: DeltaUnit::Meters, ..rpe }), "10000 m apart"),
        (
            told(&untimed, &untimed, EvaluationOptions { delta_unit: DeltaUnit::Seconds, ..rpe }),
            "the poses have no times",
        ),
        (told(&full, &full, EvaluationOptions { max_diff: f64::NAN, ..base }), "max_diff is NaN"),
        (
            told(&full, &full, EvaluationOptions { relation: PoseRelation::PointDistanceErrorRatio, ..base }),
            "is a relative error",
        ),
    ] {
        assert!(message.contains(expected), "{message}");
    }
    // One pose alone has an error without alignment.
    let single = evaluate(&full, &one, &base).unwrap().summary;
    assert_eq!((single.num_matched, single.statistics.max), (1, 0.0));
    assert!(single.drift.is_none());
    // Unsorted and repeated times are compared, and a note tells.
    let mut stamps = full.stamps.clone().unwrap();
    stamps.swap(3, 4);
    stamps[9] = stamps[8];
    let unsorted = full.clone().with_stamps(stamps).unwrap();
    let summary = evaluate(&full, &unsorted, &base).unwrap().summary;
    assert_eq!(
        summary.notes[0],
        "Of the estimate, its times go back once, first at pose 5; 1 of its times are repeated."
    );
}

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
        ("EDGE2 0 1 0.5\n", "line 1: The line is no relation: 3 numbers"),
        ("# a\r\nEDGE2 0 1 0.5 nan 1\r\n", "line 2: \"nan\" is not a finite number"),
        ("EDGE2 0 1.5 0 0 0\n", "line 1: The line is no relation"),
    ] {
        let error = relations::read(text.as_bytes()).unwrap_err().to_string();
        assert!(error.starts_with(told), "{error}");
    }
    let far = relations::read(b"EDGE2 100 200 0 0 0\n").unwrap();
    assert!(relation_errors(&far, &path, 0.01).unwrap_err().to_string().contains("none of the 1 relations"));
}

/// The scans of the log: beams from -90 to +90 deg, half a degree apart, in the laser's frame.
fn fr079_scans(text: &str) -> Vec<Vec<[f64; 2]>> {
    let mut scans = Vec::new();
    for line in text.lines().filter(|line| line.starts_with("ROBOTLASER1")) {
        let words: Vec<f64> = line.split_whitespace().skip(1).map(|word| word.parse().unwrap_or(f64::NAN)).collect();
        let (start, step, num_beams) = (words[1], words[3], words[7] as usize);
        let beam = |(index, &range): (usize, &f64)| {
            let angle = start + step * index as f64;
            (range < 20.0).then(|| [range * angle.cos(), range * angle.sin()])
        };
        scans.push(words[8..8 + num_beams].iter().enumerate().filter_map(beam).collect());
    }
    scans
}

#[test]
fn real_loops_fit_the_reference_and_its_map_is_the_crispest() {
    let Some(folder) = shared("laser/fr079") else { return };
    let log = fs::read_to_string(folder.join("fr079.log")).unwrap();
    let reference = fs::read(folder.join("fr079.reference_posegraph.txt")).unwrap();
    let reference = scanstitch::io::trajectory::read(&reference).unwrap();
    let odometry = fs::read(folder.join("fr079.odometry.txt")).unwrap();
    let odometry = scanstitch::io::trajectory::read(&odometry).unwrap();
    assert_eq!((reference.len(), odometry.len()), (1464, 1464));

    let mut loops = relations::read(log.as_bytes()).unwrap();
    loops.retain(|relation| !relation.is_step());
    let of = |poses: &Trajectory| relation_errors(&loops, &Path::of(poses, 0..poses.len()), 0.01).unwrap();
    let (exact, drifted) = (of(&reference), of(&odometry));
    println!("{} loops: median {} m, odometry {} m", loops.len(), exact.translation.median, drifted.translation.median);
    assert!((0.005..0.02).contains(&exact.translation.median), "{:?}", exact.translation);
    assert!(drifted.translation.median > 10.0 * exact.translation.median);

    let scans = fr079_scans(&log);
    assert_eq!(scans.len(), 1464);
    let poses = reference.poses().unwrap();
    let quality = |shake: f64| {
        let mut random = Random::new(1);
        let mut points = Vec::new();
        for (scan, pose) in scans.iter().zip(&poses).take(300) {
            let off = Vector3::new(shake * random.normal(), shake * random.normal(), 0.0);
            points.extend(scan.iter().map(|&[x, y]| {
                let point = pose * nalgebra::Point3::new(x, y, 0.0) + off;
                [point.x as f32, point.y as f32]
            }));
        }
        map_quality(&points, &MapQualityOptions { max_points: 5000, ..MapQualityOptions::default() }).unwrap()
    };
    ranked("fr079", &[0.0, 0.01, 0.02, 0.05], &[0.0, 0.01, 0.02, 0.05].map(quality));
}

/// Both figures rise from each map to the next.
fn ranked(what: &str, shakes: &[f64], qualities: &[MapQuality]) {
    for (shake, quality) in shakes.iter().zip(qualities) {
        println!(
            "{what}, {shake} m: entropy {:.4}, plane variance {:.3e} m^2 of {} points",
            quality.mean_map_entropy, quality.mean_plane_variance, quality.num_points
        );
    }
    for pair in qualities.windows(2) {
        assert!(pair[0].mean_map_entropy < pair[1].mean_map_entropy, "{what}: {pair:?}");
        assert!(pair[0].mean_plane_variance < pair[1].mean_plane_variance, "{what}: {pair:?}");
    }
}

#[test]
fn a_real_pair_in_space_is_crispest_where_it_fits() {
    let Some(folder) = shared("lidar/kitti_pair") else { return };
    let cloud = |name: &str| scanstitch::io::ply::read(&fs::read(folder.join(name)).unwrap()).unwrap().positions;
    let (source, target) = (cloud("source.ply"), cloud("target.ply"));
    let text = fs::read_to_string(folder.join("T_target_source.txt")).unwrap();
    let numbers: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let T = nalgebra::Matrix4::from_row_slice(&numbers[numbers.len() - 16..]);
    let quality = |shake: f64| {
        let mut points: Vec<[f32; 3]> = target.iter().map(glam::Vec3::to_array).collect();
        points.extend(source.iter().map(|p| {
            let q = T * nalgebra::Vector4::new(f64::from(p.x), f64::from(p.y), f64::from(p.z), 1.0);
            [(q.x + shake) as f32, (q.y + shake) as f32, (q.z + shake) as f32]
        }));
        map_quality(&points, &MapQualityOptions { radius: 0.5, max_points: 5000, ..Default::default() }).unwrap()
    };
    ranked("kitti_pair", &[0.0, 0.05, 0.1], &[0.0, 0.05, 0.1].map(quality));
}

#[test]
fn synthetic_maps_of_known_blur() {
    // A floor and a wall, blurred across by a normal distribution.
    let sigmas = [0.005, 0.01, 0.02, 0.05];
    let in_space = sigmas.map(|sigma| {
        let mut random = Random::new(5);
        let mut points = Vec::new();
        for _ in 0..40_000 {
            let (u, v) = (random.uniform(0.0, 4.0) as f32, random.uniform(0.5, 4.0) as f32);
            let off = (sigma * random.normal()) as f32;
            points.push(if random.happens(0.5) { [u, v, off] } else { [u, off - 2.0, v] });
        }
        map_quality(&points, &MapQualityOptions { max_points: 4000, ..MapQualityOptions::default() }).unwrap()
    });
    ranked("a floor and a wall", &sigmas, &in_space);
    let in_plane = sigmas.map(|sigma| {
        let mut random = Random::new(6);
        let points: Vec<[f32; 2]> =
            (0..20_000).map(|_| [random.uniform(0.0, 20.0) as f32, (sigma * random.normal()) as f32]).collect();
        map_quality(&points, &MapQualityOptions { max_points: 0, ..MapQualityOptions::default() }).unwrap()
    });
    ranked("a line", &sigmas, &in_plane);
    for (sigma, (space, plane)) in sigmas.iter().zip(in_space.iter().zip(&in_plane)) {
        // Across a plane, the smallest variance is the blur's.
        for variance in [space.mean_plane_variance, plane.mean_plane_variance] {
            assert!((variance / (sigma * sigma) - 1.0).abs() < 0.07, "{sigma}: {variance}");
        }
        // Along a line, points within r spread as a uniform distribution: the entropy is 1/2 ln((2 pi e)^2 r^2/3 s^2).
        let expected = 0.5 * ((std::f64::consts::TAU * std::f64::consts::E).powi(2) * 0.03 * sigma * sigma).ln();
        assert!((plane.mean_map_entropy - expected).abs() < 0.1, "{sigma}: {} {expected}", plane.mean_map_entropy);
    }
}

#[test]
fn maps_that_say_nothing_are_refused() {
    let told = |points: &[[f32; 3]], radius: f64| {
        map_quality(points, &MapQualityOptions { radius, ..MapQualityOptions::default() }).unwrap_err().to_string()
    };
    assert!(told(&[], 0.3).contains("No point has 5 points within 0.3 m"));
    assert!(told(&[[0.0; 3], [f32::NAN; 3], [9.0; 3]], 0.3).contains("No point has 5 points"));
    assert!(told(&[[0.0; 3]; 9], -1.0).contains("radius is -1 m"));
    // Points of one plane have no volume, and their plane variance is zero.
    let grid: Vec<[f32; 3]> = (0..100_u8).map(|i| [f32::from(i % 10) * 0.1, f32::from(i / 10) * 0.1, 0.0]).collect();
    let flat = map_quality(&grid, &MapQualityOptions::default()).unwrap();
    assert_eq!((flat.mean_plane_variance, flat.num_with_volume, flat.num_points), (0.0, 0, 100));
}
