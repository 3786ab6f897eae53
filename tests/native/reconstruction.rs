//! Whole runs: real scans, generated scans, and input that is not what it should be.

use std::fs;

use crate::common::shared_data;
use glam::Vec3;
use nalgebra::Vector2;
use scanstitch::geometry::{PointCloud, Pose2, RigidMotion};
use scanstitch::io::{ply, trajectory};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::report::{FrameResult, PlanarPose, ReconstructionResult, Stage};
use scanstitch::pipeline::settings::{Settings, Strategy, presets};
use scanstitch::preprocess::clean::CleaningReport;
use scanstitch_scene::corridor::{CorridorOptions, generate};
use scanstitch_scene::office;

/// Positions that MATLAB's `pcregistericp` gives for the ten real scans (m).
const MATLAB: [[f64; 2]; 10] = [
    [0.0, 0.0],
    [0.0459, 1.1082],
    [0.1924, 2.2068],
    [0.3375, 3.3133],
    [0.3970, 4.0100],
    [0.3145, 5.0264],
    [0.2742, 5.9423],
    [0.1316, 6.8498],
    [0.1663, 8.1005],
    [0.1687, 9.0731],
];

fn cloud(points: &[Vector2<f64>]) -> PointCloud {
    PointCloud::from_positions(points.iter().map(|p| Vec3::new(p.x as f32, p.y as f32, 0.0)).collect())
}

fn reconstruction_of(scans: impl IntoIterator<Item = PointCloud>, settings: Settings) -> Reconstruction {
    let mut reconstruction = Reconstruction::new(settings).unwrap();
    for (index, scan) in scans.into_iter().enumerate() {
        reconstruction.add_scan(&format!("{index}.ply"), scan).unwrap();
    }
    reconstruction
}

fn run(reconstruction: &mut Reconstruction) -> ReconstructionResult {
    while reconstruction.step().stage != Stage::Done {}
    reconstruction.result()
}

fn distances(result: &ReconstructionResult, reference: impl Iterator<Item = Vector2<f64>>) -> Vec<f64> {
    let position = |pose: &PlanarPose| Vector2::new(pose.x, pose.y);
    result.frames.iter().zip(reference).map(|(frame, truth)| (position(&frame.T_world_sensor) - truth).norm()).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn zju10() -> Option<Vec<PointCloud>> {
    let folder = shared_data("laser/zju10")?;
    Some((0..10).map(|i| ply::read(&fs::read(folder.join(format!("{i}.ply"))).unwrap()).unwrap()).collect())
}

#[test]
fn the_ten_real_scans_make_a_crisp_map_with_no_setting_touched() {
    let Some(scans) = zju10() else { return };
    let result = run(&mut reconstruction_of(scans, Settings::default()));
    let sharpness = result.sharpness.unwrap();
    let to_matlab = distances(&result, MATLAB.into_iter().map(Vector2::from));
    assert!(sharpness.mean_residual < 0.017, "{sharpness:?}");
    assert!(sharpness.num_pairs > 1200, "{sharpness:?}");
    assert!(mean(&to_matlab) < 0.121 && largest(&to_matlab) < 0.3, "{to_matlab:?}");
    assert!(result.frames.iter().all(|frame| frame.status == Status::Good));
    let at_limit: usize = result.frames.iter().map(|frame| frame.cleaning.at_range_limit).sum();
    assert_eq!(at_limit, 4);
}

#[test]
fn what_every_preset_makes_of_the_real_scans() {
    let Some(scans) = zju10() else { return };
    let residual = |settings| run(&mut reconstruction_of(scans.clone(), settings)).sharpness.unwrap().mean_residual;
    let [sharpest, scan_to_map, homework] = [0, 1, 2].map(|preset| residual(presets()[preset].settings.clone()));
    assert!(sharpest < 0.017 && scan_to_map < 0.02 && homework > sharpest, "{sharpest} {scan_to_map} {homework}");
}

#[test]
fn generated_scans_are_placed_within_millimetres_for_every_seed() {
    let mut means = Vec::new();
    for seed in 0..21 {
        let recording = generate(&CorridorOptions { seed, ..CorridorOptions::default() });
        let result = run(&mut reconstruction_of(recording.scans.iter().map(|s| cloud(s)), Settings::default()));
        let errors = distances(&result, recording.T_world_sensor.iter().map(|T| T.translation.vector));
        let turned = |(frame, T): (&FrameResult<PlanarPose, CleaningReport>, &Pose2)| {
            (Pose2::rotation(frame.T_world_sensor.theta).inverse() * T).rotation_angle()
        };
        let heading = result.frames.iter().zip(&recording.T_world_sensor).map(turned).fold(0.0, f64::max);
        assert!(largest(&errors) < 0.1, "seed {seed}: {errors:?}");
        if seed == CorridorOptions::default().seed {
            assert!(mean(&errors) < 0.015 && heading < 0.2f64.to_radians(), "the sample: {errors:?} {heading}");
        }
        means.push(mean(&errors));
    }
    means.sort_by(f64::total_cmp);
    assert!(means[10] < 0.01, "median of the means: {}", means[10]);
}

#[test]
fn poses_solved_together_are_nearer_the_truth_than_the_chain() {
    let error = |seed, strategy| {
        let recording = generate(&CorridorOptions { seed, num_scans: 20, ..CorridorOptions::default() });
        let settings = Settings { strategy, ..Settings::default() };
        let result = run(&mut reconstruction_of(recording.scans.iter().map(|s| cloud(s)), settings));
        mean(&distances(&result, recording.T_world_sensor.iter().map(|T| T.translation.vector)))
    };
    let sum = |strategy| (0..6).map(|seed| error(seed, strategy)).sum::<f64>();
    let (joint, to_map, to_scan) = (sum(Strategy::Joint), sum(Strategy::ScanToMap), sum(Strategy::ScanToScan));
    assert!(joint < 0.75 * to_map && joint < 0.75 * to_scan, "joint {joint}, to map {to_map}, to scan {to_scan}");
}

#[test]
fn a_loop_through_an_office_closes() {
    for seed in [1, 4] {
        let recording = office::generate(&office::OfficeOptions { seed, ..Default::default() });
        let run_with = |strategy| {
            let settings = Settings { strategy, ..Settings::default() };
            let result = run(&mut reconstruction_of(recording.scans.iter().map(|s| cloud(s)), settings));
            assert!(result.frames.iter().all(|frame| frame.status != Status::Lost), "seed {seed}");
            distances(&result, recording.T_world_sensor.iter().map(|T| T.translation.vector))
        };
        let (joint, chain) = (run_with(Strategy::Joint), run_with(Strategy::ScanToMap));
        println!("seed {seed}: joint {} {} chain {} {}", mean(&joint), largest(&joint), mean(&chain), largest(&chain));
        assert!(largest(&joint) < 0.15 && mean(&joint) < 0.6 * mean(&chain), "seed {seed}");
    }
}

#[test]
fn the_reference_never_reaches_the_estimate() {
    let recording = generate(&CorridorOptions::default());
    let scans = || recording.scans.iter().map(|s| cloud(s));
    let without = run(&mut reconstruction_of(scans(), Settings::default()));
    let mut with_reference = reconstruction_of(scans(), Settings::default());
    with_reference.set_reference("wrong.txt", trajectory::read_lenient("0 0 0\n".repeat(10).as_bytes(), None).unwrap());
    let with = run(&mut with_reference);
    assert_eq!(without.frames, with.frames);
    assert!(without.comparison.is_none());
    assert!(with.comparison.unwrap().max > 5.0);
}

#[test]
fn the_comparison_starts_from_equal_first_poses() {
    let recording = generate(&CorridorOptions::default());
    let mut reconstruction = reconstruction_of(recording.scans.iter().map(|s| cloud(s)), Settings::default());
    // The truth as somebody else's world has it: moved and turned as a whole.
    let elsewhere = Pose2::new(Vector2::new(20.0, -7.0), 2.0);
    let poses: Vec<_> = recording.T_world_sensor.iter().map(|T| trajectory::in_space(&(elsewhere * T))).collect();
    let read = |text: &str| trajectory::read_lenient(text.as_bytes(), None).unwrap();
    let truth = trajectory::tum_text(None, &poses);
    reconstruction.set_reference("truth.tum", read(&truth));
    let comparison = run(&mut reconstruction).comparison.unwrap();
    assert_eq!((comparison.num_matched, comparison.errors[0]), (10, Some(0.0)));
    assert!(comparison.max < 0.05 && comparison.mean <= comparison.rmse && comparison.rmse <= comparison.max);

    // A tracker that lost one pose costs that pose alone.
    let mut lines: Vec<&str> = truth.lines().collect();
    lines[4] = "3 nan nan nan nan nan nan nan";
    reconstruction.set_reference("gap.tum", read(&lines.join("\n")));
    let result = reconstruction.result();
    let with_gap = result.comparison.unwrap();
    assert_eq!(with_gap.num_matched, 9);
    for (row, error) in with_gap.errors.iter().enumerate() {
        assert_eq!(*error, comparison.errors[row].filter(|_| row != 3));
    }
    assert!(result.notes.iter().any(|note| note.starts_with("gap.tum: 1 of its 10 poses")), "{:?}", result.notes);

    reconstruction.set_reference("short.txt", read(&"0 0 0\n".repeat(7)));
    let result = reconstruction.result();
    assert!(result.comparison.is_none());
    assert!(
        result.notes.iter().any(|note| note.contains("short.txt") && note.contains("7 poses")),
        "{:?}",
        result.notes
    );
}

#[test]
fn scans_of_different_places_are_lost_and_said_so_and_the_rest_is_placed() {
    let here = generate(&CorridorOptions { seed: 5, ..CorridorOptions::default() });
    let elsewhere = generate(&CorridorOptions { seed: 9, num_scans: 30, ..CorridorOptions::default() });
    let mut scans: Vec<PointCloud> = here.scans.iter().map(|s| cloud(s)).collect();
    let turned: Vec<_> = elsewhere.scans[25].iter().map(|p| Pose2::rotation(2.1).act(p) * 0.4).collect();
    scans.insert(4, cloud(&turned));
    let result = run(&mut reconstruction_of(scans, Settings::default()));
    assert_eq!(result.frames[4].status, Status::Lost, "{:?}", result.frames[4]);
    assert!(result.frames[4].reason.contains("seen as free") || result.frames[4].reason.contains("overlap"));
    let placed: Vec<Vector2<f64>> = (0..11)
        .filter(|&frame| frame != 4)
        .map(|frame| Vector2::new(result.frames[frame].T_world_sensor.x, result.frames[frame].T_world_sensor.y))
        .collect();
    for (found, truth) in placed.iter().zip(&here.T_world_sensor) {
        assert!((found - truth.translation.vector).norm() < 0.1, "{found} {truth}");
    }
}

#[test]
fn one_scan_makes_a_map_but_no_motion() {
    let recording = generate(&CorridorOptions { num_scans: 1, ..CorridorOptions::default() });
    let mut reconstruction = reconstruction_of([cloud(&recording.scans[0])], Settings::default());
    let result = run(&mut reconstruction);
    assert_eq!((result.frames.len(), result.frames[0].status), (1, Status::Good));
    assert!(result.sharpness.is_none());
    assert!(result.notes[0].contains("0.ply is the only scan"), "{:?}", result.notes);
    assert!(reconstruction.map().points.len() > 100);
}

#[test]
fn what_is_no_planar_scan_is_refused_by_name_and_the_others_stay() {
    let recording = generate(&CorridorOptions::default());
    let mut reconstruction = reconstruction_of(recording.scans.iter().map(|s| cloud(s)), Settings::default());
    let mut refused = |name: &str, cloud: PointCloud| reconstruction.add_scan(name, cloud).unwrap_err().to_string();
    assert!(refused("empty.ply", PointCloud::default()).starts_with("empty.ply: The cloud has no points."));
    let nan = PointCloud::from_positions(vec![Vec3::NAN; 3]);
    assert!(refused("nan.ply", nan).contains("None of its 3 points has finite coordinates"));
    let solid = PointCloud::from_positions(vec![Vec3::X, Vec3::new(1.0, 2.0, 0.5)]);
    assert!(refused("solid.ply", solid).contains("point 2 has z = 0.5"));
    assert_eq!(run(&mut reconstruction).frames.len(), 10);
}

#[test]
fn nothing_to_do_is_done_at_once() {
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    assert_eq!(reconstruction.step().stage, Stage::Done);
    assert!(reconstruction.result().frames.is_empty());
    // A scan of a handful of points has nothing to hold on to.
    let few = PointCloud::from_positions(vec![Vec3::X, Vec3::Y]);
    let result = run(&mut reconstruction_of([few.clone(), few], Settings::default()));
    assert!(result.frames.iter().all(|frame| frame.status == Status::Lost && frame.reason.contains("too few")));
}

#[test]
fn what_is_known_so_far_can_be_asked_for_at_any_time() {
    let recording = generate(&CorridorOptions::default());
    let mut reconstruction = reconstruction_of(recording.scans.iter().map(|s| cloud(s)), Settings::default());
    assert!(reconstruction.result().frames.is_empty());
    for expected in 1..=10 {
        let progress = reconstruction.step();
        assert_eq!(progress.frame, Some(expected - 1));
        assert_eq!(reconstruction.result().frames.len(), expected);
        assert_eq!(reconstruction.map().frames.iter().max(), Some(&(expected as u32 - 1)));
    }
    assert!(reconstruction.correspondences(0).is_empty());
    let pairs = reconstruction.correspondences(9);
    assert!(pairs.len() > 80 && pairs.iter().all(|[a, b]| (a - b).norm() <= 0.5));
    assert!(reconstruction.correspondences(10).is_empty());
}
