//! What is left out of a map as it moved: of rendered streets with cars and people that move and without any, and of recordings, which are
//! given as folders of PLY and PCD files. Arguments: `--sweeps N` (60), `--seeds N` (5), folders.

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use scanstitch::geometry::{PointCloud, Pose3, RigidMotion};
use scanstitch::pipeline::{FrameLabel, PreparedFrame, SpatialReconstruction, SpatialSettings, Stage};
use scanstitch_scene::spinning_lidar::SpinningLidar;
use scanstitch_scene::streets::{drive, streets};
use scanstitch_scene::traffic::{is_of_traffic, with_traffic};

use crate::arguments::{argument, arguments};

/// Seconds from sweep to sweep.
const PERIOD: f64 = 0.1;
/// Points of the map further from a surface are not on it (m).
const TOLERANCE: f64 = 0.25;

fn pcd(cloud: &PointCloud) -> Vec<u8> {
    let points: Vec<u8> = cloud.positions.iter().flat_map(glam::Vec3::to_array).flat_map(f32::to_le_bytes).collect();
    let header = format!(
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT 1\nPOINTS {0}\nDATA binary\n",
        cloud.len()
    );
    [header.into_bytes(), points].concat()
}

/// A finished run, and the map and the frames of its points before what moved was looked for.
fn run(files: impl Iterator<Item = (String, Vec<u8>)>) -> (SpatialReconstruction, PointCloud, Vec<u32>) {
    let mut reconstruction = SpatialReconstruction::new(SpatialSettings::default()).unwrap();
    for (index, (name, bytes)) in files.enumerate() {
        let config = reconstruction.begin(&name, &bytes).unwrap().clone();
        let frame = PreparedFrame::from_cloud(&config, FrameLabel { name, index, time: None }, &bytes).unwrap();
        reconstruction.add(frame).unwrap();
        while reconstruction.step().stage != Stage::Done {}
    }
    let (before, frames) = (reconstruction.map().cloud(), reconstruction.map().frames());
    reconstruction.finish();
    while reconstruction.step().stage != Stage::Done {}
    (reconstruction, before, frames)
}

/// Points of the map of things that move, and of others.
fn counts(map: &PointCloud, frames: &[u32], T_world_first: &Pose3) -> [usize; 2] {
    let mut counts = [0; 2];
    for (point, frame) in map.positions.iter().zip(frames) {
        let point = T_world_first.act(&Vector3::from(point.as_dvec3().to_array()));
        counts[usize::from(!is_of_traffic(&point, PERIOD * f64::from(*frame), TOLERANCE))] += 1;
    }
    counts
}

/// A drive along a street, with traffic or without: a row of the table.
fn street(seed: u64, moves: bool, num_sweeps: usize) {
    let lidar = SpinningLidar { azimuth_step: 0.4f64.to_radians(), max_range: 60.0, ..SpinningLidar::default() };
    let (space, truth) = (streets(seed, false), drive(1.0));
    let files = truth.iter().take(num_sweeps).enumerate().map(|(index, pose)| {
        let space = if moves { with_traffic(&space, PERIOD * index as f64) } else { space.clone() };
        (format!("{index}.pcd"), pcd(&lidar.scan(&space, pose, 1000 * seed + index as u64)))
    });
    let (mut reconstruction, before, frames) = run(files);
    let (after, frames_after) = (reconstruction.map().cloud(), reconstruction.map().frames());
    let left = |before: usize, after: usize| {
        format!("{before} | {:.2} %", 100.0 * (before as f64 - after as f64) / before.max(1) as f64)
    };
    let [a, b] = [(&before, &frames), (&after, &frames_after)].map(|(map, frames)| counts(map, frames, &truth[0]));
    println!("| {seed}{} | {} | {} |", if moves { ", traffic" } else { "" }, left(a[0], b[0]), left(a[1], b[1]));
}

pub fn main() {
    let number = |name, default| argument(name).and_then(|count| count.parse().ok()).unwrap_or(default);
    let (num_sweeps, num_seeds) = (number("--sweeps", 60), number("--seeds", 5) as u64);
    println!("| street | points of what moves | left out | points at rest | left out |\n|---|---|---|---|---|");
    for seed in 1..=num_seeds {
        street(seed, true, num_sweeps);
        street(seed, false, num_sweeps);
    }
    for folder in arguments().iter().filter(|argument| Path::new(argument).is_dir()) {
        let mut paths: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        paths.retain(|path| path.extension().is_some_and(|ending| ending == "pcd" || ending == "ply"));
        paths.sort();
        let file = |path: PathBuf| (path.to_string_lossy().into_owned(), std::fs::read(&path).unwrap());
        let (mut reconstruction, before, _) = run(paths.into_iter().map(file));
        println!("{folder}: {} points, {} left", before.len(), reconstruction.map().len());
    }
}
