//! The synthetic world: the committed samples are what it renders, and it renders what it says.
#![allow(non_snake_case)]

use std::fs;

use nalgebra::Vector2;
use scanstitch::geometry::RigidMotion;
use scanstitch::io::{ply, trajectory};
use scanstitch::scene::corridor::{CorridorOptions, MAX_TURN, MIN_CLEARANCE, STEP, generate};
use scanstitch::scene::laser::Laser;

const SAMPLES: &str = "www/samples/corridor";

#[test]
fn the_committed_samples_are_what_the_world_renders() {
    let recording = generate(&CorridorOptions::default());
    for (index, scan) in recording.scans.iter().enumerate() {
        let text = fs::read_to_string(format!("{SAMPLES}/{index}.ply")).unwrap();
        let body = text.split_once("end_header\n").unwrap().1;
        let rendered: Vec<String> = scan.iter().map(|p| format!("{:.15} {:.15} {:.15}", p.x, p.y, 0.0)).collect();
        assert!(body.lines().eq(rendered), "{index}.ply");
        assert_eq!(ply::read(text.as_bytes()).unwrap().len(), 180);
    }
    let truth = trajectory::read(&fs::read(format!("{SAMPLES}/truth.tum")).unwrap()).unwrap().poses().unwrap();
    assert_eq!(truth.len(), recording.T_world_sensor.len());
    for (read, exact) in truth.iter().zip(&recording.T_world_sensor) {
        assert!((read.inverse() * trajectory::in_space(exact)).log().norm() < 1e-12);
    }
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
            // Drawn back from a wall, a step may come out shorter.
            assert!((0.8 * STEP.0..=STEP.1 + 1e-9).contains(&motion.translation_norm()), "seed {seed}");
            assert!(motion.rotation_angle() <= MAX_TURN + 1e-9, "seed {seed}");
            for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                let between = pair[0].translation.vector.lerp(&pair[1].translation.vector, share);
                assert!(recording.world.clearance(&between) >= MIN_CLEARANCE - 0.05, "seed {seed}");
            }
        }
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
