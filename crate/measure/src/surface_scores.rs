//! Surfaces of rendered flats against the exact ones: `cargo measure surface_scores [--voxel METRES] [--frames N] [--from N] [--flats N]
//! [--sensor NAME] [--kept] [--step METRES] [--write DIR]`. For each flat, from the first or from `--from` on, and each sensor: the distance
//! of the mesh's points from the true surface (mean, 95 %), the share of the true surface that has the mesh within 2 cm, the share of points within twice their standard deviation, and the processor times: the mean
//! over the frames of reading one and of adding it to the field, and of extracting the mesh. The line before it is that of the keyframes,
//! which are put in while a run goes on. `--kept` takes of each image what a run keeps, as the page does: every second pixel of every second row. `--step`: a hand-held camera, at most this far and 2
//! degrees a frame besides its sway.
//! `--write` leaves the depth images (mm), `poses.txt` (4 x 4, camera to world, row by row) and `camera.txt` for other programs,
//! with our mesh and the points of the truth with their normals (`truth.txt`: x y z nx ny nz, m), and
//! `--score FILE.ply --flats N` scores a mesh that one of them made of the last.

use std::error::Error;
use std::fs;
use std::path::PathBuf;

use nalgebra::Vector3;
use scanstitch::camera::Pinhole;
use scanstitch::geometry::{Pose3, RigidMotion, TriangleMesh};
use scanstitch::io::mesh::{MeshFormat, write as write_mesh};
use scanstitch::io::point_cloud;
use scanstitch::map::surface::SurfaceOptions;
use scanstitch::pipeline::prepared_frame::{DecodeConfig, FrameLabel, PreparedFrame};
use scanstitch::pipeline::spatial_settings::SpatialSettings;
use scanstitch::pipeline::surface::{SurfaceFrame, SurfaceReconstruction};
use scanstitch_scene::apartment::{Apartment, WalkOptions};
use scanstitch_scene::hand_held::hand_held;
use scanstitch_scene::random::Random;
use scanstitch_scene::space::stereo_camera::StereoCamera;
use scanstitch_scene::space::{DepthSensor, Space};

use crate::apartment::recording::depth_png;
use crate::arguments::arguments;
use crate::depth::processor_time::timed;

/// Points of the mesh and of the truth that are compared.
const NUM_COMPARED: usize = 20_000;
/// The true surface counts as covered within this (m).
const COVERED: f64 = 0.02;
/// Truth is looked for on both sides of a point up to this (m).
const REACH: f64 = 0.3;

/// The sensors, by name.
#[derive(Clone, Copy)]
enum Sensor {
    Depth(DepthSensor),
    Stereo(StereoCamera),
}

fn sensors() -> [(&'static str, Sensor); 4] {
    let millimetres = |square_noise| Sensor::Depth(DepthSensor::Millimetres { square_noise });
    [
        ("exact, mm", millimetres(0.0)),
        ("Kinect", millimetres(1.6e-3)),
        ("D435", Sensor::Stereo(StereoCamera::default())),
        ("8 bits", Sensor::Depth(DepthSensor::HOMEWORK)),
    ]
}

pub fn main() -> Result<(), Box<dyn Error>> {
    let (mut voxel_size, mut num_frames, mut first_flat, mut num_flats) = (0.01, 60, 1, 2u64);
    let (mut write, mut score): (Option<PathBuf>, Option<PathBuf>) = (None, None);
    let (mut wanted_sensor, mut is_kept, mut step) = (None, false, None);
    let mut arguments = arguments().into_iter();
    while let Some(name) = arguments.next() {
        if name == "--kept" {
            is_kept = true;
            continue;
        }
        let value = arguments.next().ok_or_else(|| format!("{name} needs a value"))?;
        match name.as_str() {
            "--voxel" => voxel_size = value.parse()?,
            "--frames" => num_frames = value.parse()?,
            "--flats" => num_flats = value.parse()?,
            "--from" => first_flat = value.parse()?,
            "--step" => step = Some(value.parse()?),
            "--write" => write = Some(value.into()),
            "--sensor" => wanted_sensor = Some(value),
            "--score" => score = Some(value.into()),
            _ => return Err(format!("{name} is no option").into()),
        }
    }
    println!(
        "{:28}{:>8}{:>9}{:>10}{:>10}{:>12}{:>11}{:>11}{:>11}",
        "", "mean", "95 %", "covered", "within 2", "triangles", "reading", "fusing", "extracting"
    );
    let camera = Pinhole::from_field_of_view(512, 512, std::f64::consts::FRAC_PI_2)?;
    for seed in first_flat..=num_flats {
        let apartment = Apartment::generate(seed);
        let walk = walk_of(&apartment, num_frames, step, seed);
        let (truth, normals) = seen_points(&apartment.space, &walk, &camera);
        if let Some(path) = score.as_ref().filter(|_| seed == num_flats) {
            let cloud = point_cloud::read(&fs::read(path)?)?;
            let points: Vec<Vector3<f64>> = cloud.positions.iter().map(double).collect();
            report(
                &path.display().to_string(),
                &Score::of(&apartment.space, &points, &[], &truth, COVERED),
                0,
                [0.0; 3],
            );
            return Ok(());
        }
        for (name, sensor) in sensors() {
            if wanted_sensor.as_ref().is_some_and(|wanted| wanted != name) {
                continue;
            }
            let images = measured(&apartment.space, &walk, &camera, sensor, seed)?;
            if let Some(folder) = &write {
                write_recording(&folder.join(folder_name(seed, name)), &images, &walk, &camera)?;
            }
            let settings =
                SpatialSettings { fx: camera.fx, fy: camera.fy, cx: camera.cx, cy: camera.cy, ..settings_of(sensor) };
            let decode_config = DecodeConfig::new(&settings, "0.png", &images[0])?;
            let options = SurfaceOptions { voxel_size, max_megabytes: 1500.0, ..SurfaceOptions::default() };
            let surface = SurfaceReconstruction::new(decode_config.clone(), options)?;
            let frames = if is_kept { kept(&decode_config, &images)? } else { images };
            let mut run = Run { surface, frames, is_kept, reading: 0.0, fusing: 0.0 };
            let score_of = |mesh: &TriangleMesh| {
                let points: Vec<Vector3<f64>> = mesh.positions.iter().map(double).collect();
                Score::of(&apartment.space, &points, &mesh.deviations, &truth, COVERED)
            };
            let mut num_keyframes = 0;
            for count in 1..=walk.len() {
                num_keyframes += run.follow(&walk[..count], false)?;
            }
            if num_keyframes < walk.len() {
                let (mesh, times) = run.mesh();
                report(&format!("  {num_keyframes} keyframes"), &score_of(&mesh), mesh.triangles.len(), times);
            }
            run.follow(&walk, true)?;
            let (mesh, times) = run.mesh();
            report(&format!("flat {seed}, {name}"), &score_of(&mesh), mesh.triangles.len(), times);
            if let Some(folder) = &write {
                let folder = folder.join(folder_name(seed, name));
                fs::write(folder.join(format!("ours-{voxel_size}.ply")), write_mesh(&mesh, MeshFormat::Ply))?;
                fs::write(folder.join("truth.txt"), rows_of(&truth, &normals))?;
            }
        }
    }
    Ok(())
}

/// The surface of a run, as it grows.
struct Run {
    surface: SurfaceReconstruction,
    frames: Vec<Vec<u8>>,
    is_kept: bool,
    /// Processor times of all frames together (s).
    reading: f64,
    fusing: f64,
}

impl Run {
    /// Puts in what these poses of the first frames ask for: number of frames.
    fn follow(&mut self, poses: &[Pose3], is_final: bool) -> Result<usize, Box<dyn Error>> {
        let wanted = self.surface.follow(poses.iter().copied().enumerate(), is_final);
        for &index in &wanted {
            let bytes = &self.frames[index];
            let (seconds, frame) = timed(|| {
                if self.is_kept {
                    self.surface.read_kept(bytes)
                } else {
                    self.surface.read(&index.to_string(), bytes, None).map(SurfaceFrame::Image)
                }
            });
            let frame = frame?;
            self.reading += seconds;
            self.fusing += timed(|| self.surface.put(index, &frame)).0;
        }
        Ok(wanted.len())
    }

    /// The mesh, and the times of reading and of fusing, each over the number of frames, and of extracting it (ms).
    fn mesh(&mut self) -> (TriangleMesh, [f64; 3]) {
        let (extracting, mesh) = timed(|| self.surface.mesh());
        let of_frames = 1000.0 / self.frames.len() as f64;
        (mesh, [self.reading * of_frames, self.fusing * of_frames, 1000.0 * extracting])
    }
}

/// Poses of a walk: in steps of 0.25 m or 10 degrees, or, where `step` (m) is given, of a hand-held camera that
/// moves at most so far and 2 degrees a frame besides its sway.
fn walk_of(apartment: &Apartment, num_frames: usize, step: Option<f64>, seed: u64) -> Vec<Pose3> {
    let Some(step) = step else {
        return apartment.walk(&WalkOptions { num_frames: Some(num_frames), ..WalkOptions::default() });
    };
    let mut poses = hand_held(&apartment.walk(&WalkOptions::default()), step, 2f64.to_radians(), seed);
    poses.truncate(num_frames);
    poses
}

fn folder_name(seed: u64, sensor: &str) -> String {
    format!("{seed}-{}", sensor.replace([' ', ','], ""))
}

/// Points with their normals as text: x y z (m) nx ny nz, a line each.
fn rows_of(points: &[Vector3<f64>], normals: &[Vector3<f64>]) -> String {
    let row = |(p, n): (&Vector3<f64>, &Vector3<f64>)| format!("{} {} {} {} {} {}\n", p.x, p.y, p.z, n.x, n.y, n.z);
    points.iter().zip(normals).map(row).collect()
}

/// What a run keeps of depth images, as bytes.
fn kept(decode_config: &DecodeConfig, images: &[Vec<u8>]) -> Result<Vec<Vec<u8>>, Box<dyn Error>> {
    let kept_of = |(index, image): (usize, &Vec<u8>)| {
        let label = FrameLabel { name: index.to_string(), index, time: None };
        Ok(PreparedFrame::from_depth(decode_config, label, image, None)?.to_bytes())
    };
    images.iter().enumerate().map(kept_of).collect()
}

fn double(point: &glam::Vec3) -> Vector3<f64> {
    Vector3::new(f64::from(point.x), f64::from(point.y), f64::from(point.z))
}

fn settings_of(sensor: Sensor) -> SpatialSettings {
    let depth_scale = if matches!(sensor, Sensor::Depth(DepthSensor::EightBits { .. })) { 25.5 } else { 1000.0 };
    SpatialSettings { depth_scale, ..SpatialSettings::default() }
}

fn measured(
    space: &Space,
    walk: &[Pose3],
    camera: &Pinhole,
    sensor: Sensor,
    seed: u64,
) -> Result<Vec<Vec<u8>>, Box<dyn Error>> {
    let image = |(index, pose): (usize, &Pose3)| {
        let seed = seed * 1000 + index as u64;
        depth_png(&match sensor {
            Sensor::Depth(sensor) => sensor.measure(&space.depth(pose, camera), camera.width, &mut Random::new(seed)),
            Sensor::Stereo(stereo) => stereo.measure(space, pose, &walk[index.saturating_sub(1)], camera, seed),
        })
    };
    walk.iter().enumerate().map(image).collect()
}

/// Points of the true surface that the cameras see, within the range in which all sensors measure (5 m), and their normals.
fn seen_points(space: &Space, walk: &[Pose3], camera: &Pinhole) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let mut random = Random::new(7);
    let one = |_| {
        let pose = &walk[(random.uniform(0.0, walk.len() as f64)) as usize];
        let (u, v) = (random.uniform(0.0, camera.width as f64 - 1.0), random.uniform(0.0, camera.height as f64 - 1.0));
        let (ray, origin) = (camera.ray(u, v), pose.translation.vector);
        let hit = space.cast(&origin, &pose.rotate(&ray))?;
        let point = origin + pose.rotate(&ray) * hit.distance;
        (hit.distance < 5.0).then(|| (point, space.solids()[hit.solid].normal(&point)))
    };
    (0..NUM_COMPARED).filter_map(one).unzip()
}

/// How far a surface is from the true one (m), which share of that it covers, and which share of it is within twice its deviation.
pub struct Score {
    pub mean: f64,
    pub quantile_95: f64,
    pub covered: f64,
    pub within: f64,
}

impl Score {
    /// `covered`: how near the surface is where a point of the truth counts as covered (m).
    pub fn of(
        space: &Space,
        points: &[Vector3<f64>],
        deviations: &[f32],
        truth: &[Vector3<f64>],
        covered: f64,
    ) -> Self {
        let stride = points.len().div_ceil(NUM_COMPARED).max(1);
        let compared = (0..points.len()).step_by(stride).map(|index| (index, distance_to_truth(space, &points[index])));
        let compared: Vec<(usize, f64)> = compared.collect();
        let mut distances: Vec<f64> = compared.iter().map(|&(_, distance)| distance).collect();
        distances.sort_by(f64::total_cmp);
        let is_within = |&&(index, distance): &&(usize, f64)| {
            deviations.get(index).is_some_and(|deviation| distance <= 1.96 * f64::from(*deviation))
        };
        let num_within = compared.iter().filter(is_within).count();
        let near = Near::new(points, covered);
        let num_covered = truth.iter().filter(|point| near.has(point)).count();
        let share = |part: usize, whole: usize| part as f64 / whole.max(1) as f64;
        Self {
            mean: distances.iter().sum::<f64>() / distances.len().max(1) as f64,
            quantile_95: distances.get(distances.len() * 95 / 100).copied().unwrap_or(f64::NAN),
            covered: share(num_covered, truth.len()),
            within: share(num_within, compared.len()),
        }
    }
}

/// The distance of a point from the true surface: the least along 26 directions, on both sides of each.
fn distance_to_truth(space: &Space, point: &Vector3<f64>) -> f64 {
    let steps = [-1.0, 0.0, 1.0];
    let directions = steps.iter().flat_map(|&x| steps.iter().flat_map(move |&y| steps.map(|z| Vector3::new(x, y, z))));
    let mut least = REACH;
    for direction in directions.filter_map(|direction| direction.try_normalize(1e-9)) {
        // From outside: a point within a solid meets its surface from behind.
        let origin = point - direction * REACH;
        let mut travelled = 0.0;
        while let Some(hit) = space.cast(&(origin + direction * travelled), &direction) {
            travelled += hit.distance;
            least = least.min((travelled - REACH).abs());
            if travelled > 2.0 * REACH {
                break;
            }
            travelled += 1e-6;
        }
    }
    least
}

/// The vertices in cells of the distance that counts as covered.
struct Near {
    cells: std::collections::HashMap<[i64; 3], Vec<Vector3<f64>>>,
    distance: f64,
}

impl Near {
    fn new(points: &[Vector3<f64>], distance: f64) -> Self {
        let mut cells: std::collections::HashMap<[i64; 3], Vec<Vector3<f64>>> = std::collections::HashMap::new();
        for point in points {
            cells.entry(cell(point, distance)).or_default().push(*point);
        }
        Self { cells, distance }
    }

    fn has(&self, point: &Vector3<f64>) -> bool {
        let [x, y, z] = cell(point, self.distance);
        let around =
            (-1..=1).flat_map(|dx| (-1..=1).flat_map(move |dy| (-1..=1).map(move |dz| [x + dx, y + dy, z + dz])));
        around.filter_map(|cell| self.cells.get(&cell)).flatten().any(|other| (other - point).norm() < self.distance)
    }
}

fn cell(point: &Vector3<f64>, side: f64) -> [i64; 3] {
    (point / side).map(|at| at.floor() as i64).into()
}

fn report(name: &str, score: &Score, num_triangles: usize, [reading, fusing, extracting]: [f64; 3]) {
    println!(
        "{name:28}{:>5.2} mm{:>6.2} mm{:>8.2} %{:>8.2} %{num_triangles:>12}{reading:>8.1} ms{fusing:>8.1} ms{extracting:>8.0} ms",
        score.mean * 1000.0,
        score.quantile_95 * 1000.0,
        score.covered * 100.0,
        score.within * 100.0
    );
}

fn write_recording(
    folder: &PathBuf,
    images: &[Vec<u8>],
    walk: &[Pose3],
    camera: &Pinhole,
) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    for (index, image) in images.iter().enumerate() {
        fs::write(folder.join(format!("{index}.png")), image)?;
    }
    let rows = walk.iter().flat_map(|pose| {
        let matrix = pose.to_homogeneous();
        (0..4).map(move |row| matrix.row(row).iter().map(f64::to_string).collect::<Vec<_>>().join(" "))
    });
    fs::write(folder.join("poses.txt"), rows.collect::<Vec<_>>().join("\n"))?;
    fs::write(folder.join("camera.txt"), format!("{} {} {} {}\n", camera.fx, camera.fy, camera.cx, camera.cy))?;
    Ok(())
}
