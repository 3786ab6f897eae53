//! The synthetic world: the committed samples are what it renders, and it renders what it says.

use std::fs;

use nalgebra::Vector2;
use scanstitch::geometry::RigidMotion;
use scanstitch::io::{ply, trajectory};
use scanstitch_scene::corridor::{CorridorOptions, MAX_TURN, MIN_CLEARANCE, STEP, generate};
use scanstitch_scene::laser::Laser;
use scanstitch_scene::office::{self, OfficeOptions};
use scanstitch_scene::random::Random;
use scanstitch_scene::recording::PlanarRecording;

const SAMPLES: &str = "www/samples/corridor";

#[test]
fn the_committed_samples_are_what_the_world_renders() {
    let recording = generate(&CorridorOptions::default());
    for (index, scan) in recording.scans.iter().enumerate() {
        let text = fs::read_to_string(format!("{SAMPLES}/{index}.ply")).unwrap();
        let body = text.split_once("end_header\n").unwrap().1;
        let rendered: Vec<String> = scan.iter().map(|p| format!("{:.4} {:.4} {:.4}", p.x, p.y, 0.0)).collect();
        assert!(body.lines().eq(rendered), "{index}.ply");
        assert_eq!(ply::read(text.as_bytes()).unwrap().len(), 180);
    }
    let truth = trajectory::read(&fs::read(format!("{SAMPLES}/truth.tum")).unwrap()).unwrap().poses().unwrap();
    assert_eq!(truth.len(), recording.T_world_sensor.len());
    for (read, exact) in truth.iter().zip(&recording.T_world_sensor) {
        assert!((read.inverse() * trajectory::in_space(exact)).log().norm() < 1e-12);
    }
}

/// Least distance between the robot's way and anything (m).
fn clearance(recording: &PlanarRecording) -> f64 {
    let shares = (0..=20).map(|i| f64::from(i) / 20.0);
    let ways = recording.T_world_sensor.windows(2);
    let places = ways.flat_map(|pair| {
        shares.clone().map(|share| pair[0].translation.vector.lerp(&pair[1].translation.vector, share))
    });
    places.map(|place| recording.world.clearance(&place)).fold(f64::INFINITY, f64::min)
}

#[test]
fn every_seed_is_a_drive_of_the_described_kind_and_another_one() {
    let mut firsts = Vec::new();
    for seed in 0..40 {
        let options = CorridorOptions { seed, ..CorridorOptions::default() };
        let recording = generate(&options);
        let path = &recording.T_world_sensor;
        assert_eq!((path.len(), recording.scans.len()), (10, 10));
        for pair in path.windows(2) {
            let motion = pair[0].inverse() * pair[1];
            assert!((STEP.0 - 1e-9..=STEP.1 + 1e-9).contains(&motion.translation_norm()), "seed {seed}");
            assert!(motion.rotation_angle() <= MAX_TURN + 1e-9, "seed {seed}");
        }
        assert!(clearance(&recording) >= MIN_CLEARANCE, "seed {seed}: {}", clearance(&recording));
        let ranges: Vec<f64> = recording.scans.iter().flatten().map(Vector2::norm).collect();
        let share = |least: f64, most: f64| {
            ranges.iter().filter(|range| (least..most).contains(*range)).count() as f64 / ranges.len() as f64
        };
        assert!(share(49.999, 51.0) < 0.1, "seed {seed}: {} at the limit", share(49.999, 51.0));
        assert!(share(0.2, 10.0) > 0.7, "seed {seed}: {} within 10 m", share(0.2, 10.0));
        firsts.push(ranges[0].to_bits());
    }
    firsts.sort_unstable();
    firsts.dedup();
    assert_eq!(firsts.len(), 40);
}

#[test]
fn the_noise_is_that_of_the_sensor() {
    let noisy = Laser { num_beams: 2000, noise_sigma: 0.02, ..Laser::default() };
    let render = |laser| generate(&CorridorOptions { laser, ..CorridorOptions::default() }).scans;
    let (measured, exact) = (render(noisy), render(Laser { noise_sigma: 0.0, ..noisy }));
    let errors: Vec<f64> = measured
        .iter()
        .flatten()
        .zip(exact.iter().flatten())
        .filter(|(_, exact)| exact.norm() < 49.0)
        .map(|(measured, exact)| measured.norm() - exact.norm())
        .collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let sigma = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / errors.len() as f64).sqrt();
    assert!(errors.len() > 15_000 && mean.abs() < 1e-3 && (sigma - 0.02).abs() < 1e-3, "{mean} {sigma}");
}

#[test]
fn an_office_is_driven_round_until_its_start_is_seen_again() {
    for seed in 0..20 {
        let recording = office::generate(&OfficeOptions { seed, ..OfficeOptions::default() });
        let path = &recording.T_world_sensor;
        assert_eq!((path.len(), recording.scans.len()), (150, 150));
        let motions: Vec<_> = path.windows(2).map(|pair| pair[0].inverse() * pair[1]).collect();
        for motion in &motions {
            assert!((0.1..1.2).contains(&motion.translation_norm()), "seed {seed}: {motion}");
            assert!(motion.rotation_angle() <= office::MAX_TURN + 1e-9, "seed {seed}: {motion}");
        }
        assert!(clearance(&recording) >= MIN_CLEARANCE, "seed {seed}: {}", clearance(&recording));
        let way: f64 = motions[..70].iter().map(RigidMotion::translation_norm).sum();
        let back = path[70..].iter().find(|T| T.translation_norm() < 1.2 && T.rotation_angle() < 0.6);
        assert!(way > 40.0 && back.is_some(), "seed {seed}: {way} m");
        // Walls and rooms are closed, and the building is smaller than the laser's reach.
        assert!(recording.scans.iter().flatten().all(|p| p.norm() < 45.0), "seed {seed}");
    }
}

#[test]
fn what_lies_out_of_reach_makes_no_difference() {
    let world = generate(&CorridorOptions::default()).world;
    let mut random = Random::new(3);
    let mut met = 0;
    for _ in 0..2000 {
        let origin = Vector2::new(random.uniform(-1.0, 1.0), random.uniform(-3.0, 30.0));
        let angle = random.uniform(-3.2, 3.2);
        let direction = Vector2::new(angle.cos(), angle.sin());
        let range = random.uniform(0.5, 20.0);
        let near = world.within(&origin, range).cast(&origin, &direction).filter(|r| *r < range);
        assert_eq!(near, world.cast(&origin, &direction).filter(|r| *r < range));
        met += usize::from(near.is_some());
    }
    assert!(met > 1000, "{met}");
}
