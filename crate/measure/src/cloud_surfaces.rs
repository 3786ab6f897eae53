//! Surfaces of rendered sweeps of lidars at their true poses against the exact ones: `cargo measure cloud_surfaces [--voxel METRES]
//! [--sweeps N] [--worlds N] [--write DIR]`. For each world and lidar: the side of the voxels, the distance of the mesh's vertices from the
//! true surface (mean, 95 %), the share of the true surface, where some sweep has a point, that has the mesh within a voxel, the share of
//! vertices within twice their standard deviation, and the time. `--write` leaves the points in the world frame (`points.bin`, x y z nx ny nz as
//! 64-bit floats, the latter towards the sensor) for other programs, and `--score FILE.ply` scores a mesh that one of them made of the last.

use std::error::Error;
use std::fs;
use std::path::PathBuf;
use std::time::Instant;

use glam::Vec3;
use nalgebra::Vector3;
use scanstitch::geometry::{PointCloud, Pose3, RigidMotion};
use scanstitch::io::point_cloud;
use scanstitch::map::surface::{CloudFusion, SurfaceOptions};
use scanstitch_scene::moving_lidar::MovingLidar;
use scanstitch_scene::plaza::{around_the_plaza, plaza};
use scanstitch_scene::space::Space;

use crate::arguments::argument;
use crate::surface_scores::Score;

/// Points of the truth that are compared.
const NUM_COMPARED: usize = 20_000;
/// The drive: m/s and rad/s.
const DRIVE: [f64; 2] = [5.0, 0.4];
/// Noise of a range with which the truth is taken (m).
const NO_NOISE: f64 = 0.0;

pub fn main() -> Result<(), Box<dyn Error>> {
    let number = |name, default: f64| argument(name).map_or(Ok(default), |value| value.parse());
    let (voxel_size, num_sweeps) = (number("--voxel", 0.02)?, number("--sweeps", 40.0)? as usize);
    let num_worlds = number("--worlds", 2.0)? as u64;
    let (write, score) = (argument("--write").map(PathBuf::from), argument("--score"));
    println!(
        "{:24}{:>8}{:>9}{:>10}{:>10}{:>10}{:>12}{:>9}",
        "", "voxel", "mean", "95 %", "covered", "within 2", "triangles", "time"
    );
    let lidars = [
        ("16 rings", MovingLidar::rings(16, 1800)),
        ("64 rings", MovingLidar::rings(64, 900)),
        ("rosette", MovingLidar::rosette()),
    ];
    for world in 1..=num_worlds {
        let space = plaza(world);
        for (name, lidar) in lidars {
            let truth = points_of(&sweeps(&space, MovingLidar { noise: NO_NOISE, ..lidar }, num_sweeps, world));
            let truth: Vec<_> = truth.iter().step_by(truth.len().div_ceil(NUM_COMPARED)).copied().collect();
            let sweeps = sweeps(&space, lidar, num_sweeps, world);
            if let Some(path) = score.as_ref().filter(|_| world == num_worlds) {
                let points: Vec<_> = point_cloud::read(&fs::read(path)?)?.positions.iter().map(double).collect();
                report(name, voxel_size, &Score::of(&space, &points, &[], &truth, voxel_size), 0, 0.0);
                continue;
            }
            if let Some(folder) = &write {
                write_points(&folder.join(format!("{world}-{}", name.replace(' ', ""))), &sweeps)?;
            }
            let options = SurfaceOptions { voxel_size, ..SurfaceOptions::default() };
            let start = Instant::now();
            let mut surface = CloudFusion::new(options, Vec3::ZERO, 0.0)?;
            for (number, (cloud, pose)) in sweeps.into_iter().enumerate() {
                surface.put(number, cloud, pose);
            }
            let mesh = surface.mesh();
            let seconds = start.elapsed().as_secs_f64();
            let points: Vec<_> = mesh.positions.iter().map(double).collect();
            let score = Score::of(&space, &points, &mesh.deviations, &truth, surface.voxel_size());
            report(&format!("{world}, {name}"), surface.voxel_size(), &score, mesh.triangles.len(), seconds);
        }
    }
    Ok(())
}

/// The sweeps of a drive that stands still while a sweep is taken, each with its pose.
fn sweeps(space: &Space, lidar: MovingLidar, num_sweeps: usize, seed: u64) -> Vec<(PointCloud, Pose3)> {
    let sweep = |number: usize| {
        let start = lidar.period * number as f64;
        let pose = around_the_plaza(DRIVE[0], DRIVE[1], start);
        (lidar.sweep(space, |_| pose, start, 1000 * seed + number as u64), pose)
    };
    (0..num_sweeps).map(sweep).collect()
}

fn points_of(sweeps: &[(PointCloud, Pose3)]) -> Vec<Vector3<f64>> {
    sweeps.iter().flat_map(|(cloud, pose)| cloud.positions.iter().map(|point| pose.act(&double(point)))).collect()
}

fn double(point: &Vec3) -> Vector3<f64> {
    Vector3::new(f64::from(point.x), f64::from(point.y), f64::from(point.z))
}

fn write_points(folder: &PathBuf, sweeps: &[(PointCloud, Pose3)]) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    let rows = sweeps.iter().flat_map(|(cloud, pose)| {
        cloud.positions.iter().flat_map(|point| {
            let place = pose.act(&double(point));
            let towards = (pose.translation.vector - place).normalize();
            [place.x, place.y, place.z, towards.x, towards.y, towards.z]
        })
    });
    fs::write(folder.join("points.bin"), rows.flat_map(f64::to_le_bytes).collect::<Vec<u8>>())?;
    Ok(())
}

fn report(name: &str, voxel_size: f64, score: &Score, num_triangles: usize, seconds: f64) {
    println!(
        "{name:24}{voxel_size:>6.3} m{:>6.1} mm{:>7.1} mm{:>8.1} %{:>8.1} %{num_triangles:>12}{seconds:>7.2} s",
        score.mean * 1000.0,
        score.quantile_95 * 1000.0,
        score.covered * 100.0,
        score.within * 100.0
    );
}
