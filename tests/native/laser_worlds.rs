//! Worlds that look the same from several places: from scans alone nothing wrong is called good; exact odometry places all.
//! Wheels that stop telling, come late and miss poses take no frame and deceive nobody.

use glam::Vec3;
use scanstitch::geometry::{PointCloud, Pose2, Pose3, RigidMotion};
use scanstitch::io::trajectory::{Trajectory, in_space};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::settings::Settings;
use scanstitch_scene::ambiguous::{ALL, Ambiguity, generate};
use scanstitch_scene::office::{self, OfficeOptions};
use scanstitch_scene::random::Random;
use scanstitch_scene::recording::PlanarRecording;

const NUM_SEEDS: u64 = 20;
const NUM_SCANS: usize = 12;

fn run(recording: &PlanarRecording, odometry: Option<&[Pose2]>) -> Reconstruction {
    let poses = odometry.map(|poses| poses.iter().copied().map(Some).collect::<Vec<_>>());
    run_with(recording, poses.as_deref())
}

/// With odometry that may lack poses.
fn run_with(recording: &PlanarRecording, odometry: Option<&[Option<Pose2>]>) -> Reconstruction {
    let mut reconstruction = Reconstruction::new(Settings::default()).unwrap();
    for (index, scan) in recording.scans.iter().enumerate() {
        let positions = scan.iter().map(|p| Vec3::new(p.x as f32, p.y as f32, 0.0)).collect();
        reconstruction.add_scan(&format!("{index}.ply"), PointCloud::from_positions(positions)).unwrap();
    }
    if let Some(odometry) = odometry {
        let known = || odometry.iter().enumerate().filter_map(|(scan, pose)| Some((scan, pose.as_ref()?)));
        let poses: Vec<Pose3> = known().map(|(_, pose)| in_space(pose)).collect();
        let numbers = Some(known().map(|(scan, _)| scan as f64).collect());
        let trajectory = Trajectory { numbers, ..Trajectory::from_poses(&poses) };
        reconstruction.set_odometry("odometry.txt", trajectory).unwrap();
    }
    while reconstruction.step().stage != Stage::Done {}
    reconstruction
}

/// What a run made of a recording.
#[derive(Debug, Default, Clone, Copy)]
struct Outcome {
    /// Frames that are called good.
    good: usize,
    /// Good, and off from the piece it belongs to.
    falsely_good: usize,
    /// Off from the first frame, whatever it is called.
    wrong: usize,
}

/// Off by more than 0.5 m or 5 degrees.
fn is_wrong(estimated: &Pose2, truth: &Pose2) -> bool {
    let off = truth.inverse() * estimated;
    off.translation_norm() > 0.5 || off.rotation_angle() > 5f64.to_radians()
}

fn outcome(recording: &PlanarRecording, reconstruction: &Reconstruction) -> Outcome {
    let (poses, truth) = (reconstruction.poses(), &recording.T_world_sensor);
    let frames = reconstruction.result().frames;
    let good_of = |piece: usize| {
        let of_piece = frames.iter().filter(move |frame| frame.status == Status::Good && frame.piece == piece);
        of_piece.map(|frame| frame.index).collect::<Vec<_>>()
    };
    let are_apart = |a: usize, b: usize| is_wrong(&(poses[a].inverse() * poses[b]), &(truth[a].inverse() * truth[b]));
    let falsely = |piece: usize| {
        let good = good_of(piece);
        let off_from = |anchor: &usize| good.iter().filter(|frame| are_apart(*anchor, **frame)).count();
        good.iter().map(off_from).min().unwrap_or(0)
    };
    Outcome {
        good: frames.iter().filter(|frame| frame.status == Status::Good).count(),
        falsely_good: (0..frames.len()).map(falsely).sum(),
        wrong: (0..poses.len()).filter(|&frame| are_apart(0, frame)).count(),
    }
}

/// The sum over all seeds; `with_odometry` hands in the exact motion.
fn outcomes(kind: Ambiguity, with_odometry: bool) -> Outcome {
    let mut sum = Outcome::default();
    for seed in 0..NUM_SEEDS {
        let recording = generate(kind, seed, NUM_SCANS);
        let reconstruction = run(&recording, with_odometry.then_some(recording.T_world_sensor.as_slice()));
        let of_seed = outcome(&recording, &reconstruction);
        if with_odometry && of_seed.wrong > 0 {
            println!("  seed {seed}: {of_seed:?} {:?}", reconstruction.result().notes);
        }
        sum.good += of_seed.good;
        sum.falsely_good += of_seed.falsely_good;
        sum.wrong += of_seed.wrong;
    }
    let mode = if with_odometry { "exact odometry" } else { "scans alone" };
    println!("{kind:?}, {mode}, of {} scans: {sum:?}", NUM_SEEDS * NUM_SCANS as u64);
    sum
}

/// Half of the scans that were found to be good: from scans alone, and with exact odometry. Where a world looks the same all over, the
/// first scan of a drive is the only good one from scans alone.
fn least_good(kind: Ambiguity) -> [usize; 2] {
    match kind {
        Ambiguity::RepeatedCorridor => [10, 75],
        Ambiguity::SquareRoom => [10, 120],
        Ambiguity::PillarLattice => [10, 27],
        Ambiguity::TwoBuildings => [59, 104],
        Ambiguity::MirroredHalf => [109, 120],
    }
}

#[test]
fn from_scans_alone_nothing_wrong_is_called_good() {
    for kind in ALL {
        let sum = outcomes(kind, false);
        assert_eq!(sum.falsely_good, 0, "{kind:?}");
        assert!(sum.good >= least_good(kind)[0], "{kind:?}: {sum:?}");
    }
}

#[test]
fn exact_odometry_places_all() {
    for kind in ALL {
        let sum = outcomes(kind, true);
        assert_eq!((sum.falsely_good, sum.wrong), (0, 0), "{kind:?}");
        assert!(sum.good >= least_good(kind)[1], "{kind:?}: {sum:?}");
    }
}

/// Wheels that are right to a hundredth.
fn wheels(truth: &[Pose2], seed: u64) -> Vec<Pose2> {
    let mut random = Random::new(seed);
    let noisy = |pair: &[Pose2]| {
        let log = (pair[0].inverse() * pair[1]).log();
        Pose2::exp(&log.map(|value| value * (1.0 + 0.01 * random.normal())))
    };
    truth.windows(2).map(noisy).collect()
}

/// Their path with every 25th step not told until the next, ten late by 0.3 of a step, one in twenty another one of the drive, and one
/// pose in fifty missing.
fn stopping(steps: &[Pose2], seed: u64) -> Vec<Option<Pose2>> {
    let mut random = Random::new(seed);
    let share = |step: &Pose2, share: f64| Pose2::exp(&(step.log() * share));
    let mut told = Vec::new();
    for (index, step) in steps.iter().enumerate() {
        let before = &steps[index.saturating_sub(1)];
        told.push(match index % 25 {
            5 => Pose2::identity(),
            6 => *before * step,
            10 => share(step, 0.7),
            11..20 => share(before, 0.3) * share(step, 0.7),
            20 => share(before, 0.3) * step,
            _ => *step,
        });
    }
    let foreign = told.clone();
    for step in &mut told {
        let other = foreign[random.uniform(0.0, foreign.len() as f64) as usize];
        *step = if random.happens(0.05) { other } else { *step };
    }
    let path = told.iter().scan(Pose2::identity(), |pose, step| {
        *pose *= step;
        Some(*pose)
    });
    std::iter::once(Some(Pose2::identity()))
        .chain(path.map(Some).map(|pose| pose.filter(|_| !random.happens(0.02))))
        .collect()
}

#[test]
fn wheels_that_stop_come_late_and_miss_poses_take_no_frame_and_deceive_nobody() {
    let mut good = [0, 0];
    for seed in 1..6 {
        let recording = office::generate(&OfficeOptions { seed, ..OfficeOptions::default() });
        let steps = wheels(&recording.T_world_sensor, seed);
        let right = steps.iter().scan(Pose2::identity(), |pose, step| {
            *pose *= step;
            Some(*pose)
        });
        let right: Vec<Pose2> = std::iter::once(Pose2::identity()).chain(right).collect();
        let undamaged = outcome(&recording, &run(&recording, Some(&right)));
        let damaged = outcome(&recording, &run_with(&recording, Some(&stopping(&steps, seed))));
        println!("seed {seed}: {undamaged:?}, damaged {damaged:?}");
        assert_eq!((undamaged.falsely_good, damaged.falsely_good), (0, 0), "seed {seed}");
        good = [good[0] + undamaged.good, good[1] + damaged.good];
    }
    assert!(100 * good[1] >= 95 * good[0], "undamaged and damaged {good:?}");
}
