//! How crisp a map is.

use std::fs;

use nalgebra::Vector3;
use scanstitch::evaluation::map_quality::{MapQuality, MapQualityOptions, map_quality};
use scanstitch::evaluation::path::Path;
use scanstitch::evaluation::relations::relation_errors;
use scanstitch::io::relations;
use scanstitch::io::trajectory::Trajectory;
use scanstitch_scene::random::Random;

use crate::common::shared_data;

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
    let Some(folder) = shared_data("laser/fr079") else { return };
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
    let Some(folder) = shared_data("lidar/kitti_pair") else { return };
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
