//! Clouds at known poses to a surface: where it lies, which way it faces, how sure it is, and what a change of poses does.

use glam::Vec3;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use scanstitch::geometry::{PointCloud, Pose3, RigidMotion, TriangleMesh};
use scanstitch::io::ply;
use scanstitch::map::surface::{CloudFusion, SurfaceOptions};
use scanstitch::pipeline::prepared_frame::{DecodeConfig, FrameLabel, PreparedFrame};
use scanstitch::pipeline::spatial_settings::SpatialSettings;
use scanstitch::pipeline::surface::SurfaceReconstruction;
use scanstitch_scene::random::Random;

/// Half of the room's sides (m).
const HALF: Vector3<f64> = Vector3::new(4.0, 3.0, 1.5);
const NOISE: f64 = 0.02;

/// Where a ray from within the room meets its walls (m along it).
fn range(origin: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
    let along = |axis: usize| (HALF[axis].copysign(direction[axis]) - origin[axis]) / direction[axis];
    (0..3).map(along).fold(f64::INFINITY, f64::min)
}

fn poses(count: usize) -> Vec<Pose3> {
    let pose = |index: usize| {
        let turn = UnitQuaternion::from_euler_angles(0.02, 0.01, 0.7 * index as f64);
        Isometry3::from_parts(Translation3::new(0.3 * index as f64 - 1.0, 0.2 * index as f64 - 0.5, 0.1), turn)
    };
    (0..count).map(pose).collect()
}

/// What sensors there see of the room, in directions at random.
fn sweeps(count: usize, num_points: usize, noise: f64) -> Vec<(PointCloud, Pose3)> {
    let sweep = |(index, pose): (usize, Pose3)| {
        let mut random = Random::new(index as u64 + 1);
        let point = |_| {
            let direction = Vector3::from_fn(|_, _| random.normal()).normalize();
            let range = range(&pose.translation.vector, &pose.rotate(&direction)) + noise * random.normal();
            let [x, y, z] = (direction * range).map(|x| x as f32).into();
            Vec3::new(x, y, z)
        };
        (PointCloud::from_positions((0..num_points).map(point).collect()), pose)
    };
    poses(count).into_iter().enumerate().map(sweep).collect()
}

fn surface(options: SurfaceOptions, sweeps: &[(PointCloud, Pose3)]) -> CloudFusion {
    let mut surface = CloudFusion::new(options, Vec3::ZERO, 0.0).unwrap();
    for (number, (cloud, pose)) in sweeps.iter().enumerate() {
        surface.put(number, cloud.clone(), *pose);
    }
    surface
}

/// Distance of a vertex from the nearest wall (m).
fn error(point: &Vec3) -> f64 {
    let off = |axis: usize| (f64::from(point[axis]).abs() - HALF[axis]).abs();
    (0..3).map(off).fold(f64::INFINITY, f64::min)
}

fn mean_error(mesh: &TriangleMesh) -> f64 {
    mesh.positions.iter().map(error).sum::<f64>() / mesh.positions.len() as f64
}

fn area(mesh: &TriangleMesh) -> f32 {
    mesh.triangles.iter().map(|triangle| mesh.area(*triangle)).sum()
}

#[test]
fn the_surface_of_clouds_covers_the_walls_and_faces_the_sensors() {
    let mut surface = surface(SurfaceOptions::default(), &sweeps(6, 8000, NOISE));
    let mesh = surface.mesh();
    assert!(mean_error(&mesh) < 0.3 * NOISE, "{}", mean_error(&mesh));
    let [x, y, z] = (2.0 * HALF).map(|side| side as f32).into();
    let walls = 2.0 * (x * y + y * z + z * x);
    assert!((0.85..1.02).contains(&(area(&mesh) / walls)), "{} of {walls} m^2", area(&mesh));
    let facing = mesh.positions.iter().zip(&mesh.normals).filter(|(point, normal)| normal.dot(**point) < 0.0).count();
    assert!(facing * 1000 >= mesh.positions.len() * 995, "{facing} of {}", mesh.positions.len());
    let is_within = |(point, deviation): (&Vec3, &f32)| error(point) <= 1.96 * f64::from(*deviation);
    let share = mesh.positions.iter().zip(&mesh.deviations).filter(|pair| is_within(*pair)).count() as f64
        / mesh.positions.len() as f64;
    assert!(share > 0.95, "{share}");
}

#[test]
fn voxels_are_as_large_as_the_points_and_the_memory_ask() {
    let side = |num_points: usize, options: SurfaceOptions| {
        let mut surface = surface(options, &sweeps(4, num_points, 0.0));
        let mesh = surface.mesh();
        // Edges are rounded off by the voxels.
        assert!(mean_error(&mesh) < 0.15 * surface.voxel_size(), "{num_points}: {}", mean_error(&mesh));
        surface.voxel_size()
    };
    let (many, few) = (side(20_000, SurfaceOptions::default()), side(1250, SurfaceOptions::default()));
    // A sixteenth of the points are four times as far apart.
    assert!((3.0..5.4).contains(&(few / many)), "{few} {many}");
    assert_eq!(side(20_000, SurfaceOptions { voxel_size: 0.5, ..SurfaceOptions::default() }), 0.5);
    let little = SurfaceOptions { max_megabytes: 10.0, ..SurfaceOptions::default() };
    let (fine, coarse) = (side(160_000, SurfaceOptions::default()), side(160_000, little));
    assert!(coarse > 1.1 * fine, "{coarse} {fine}");
}

#[test]
fn clouds_are_replaced_and_taken_out() {
    let all = sweeps(5, 6000, NOISE);
    let expected = surface(SurfaceOptions::default(), &all[..4]).mesh();
    let mut changed = surface(SurfaceOptions::default(), &all);
    changed.put(2, all[2].0.clone(), Isometry3::translation(0.5, 0.0, 0.0) * all[2].1);
    assert_ne!(changed.mesh(), expected);
    changed.put(2, all[2].0.clone(), all[2].1);
    changed.take_out(4);
    assert_eq!((changed.mesh(), changed.num_frames()), (expected, 4));
    // A pose that is none changes nothing.
    changed.put(9, all[4].0.clone(), Isometry3::translation(f64::NAN, 0.0, 0.0));
    assert_eq!(changed.num_frames(), 4);
}

#[test]
fn clouds_of_a_run_are_put_anew_once_when_it_has_ended() {
    let all = sweeps(3, 6000, NOISE);
    let file = |cloud: &PointCloud| ply::write(cloud, ply::Format::BinaryLittleEndian);
    let config = DecodeConfig::new(&SpatialSettings::default(), "0.ply", &file(&all[0].0)).unwrap();
    let kept = |index: usize| {
        let label = FrameLabel { name: format!("{index}.ply"), index, time: None };
        PreparedFrame::from_cloud(&config, label, &file(&all[index].0)).unwrap().to_bytes()
    };
    let mut surface = SurfaceReconstruction::new(config.clone(), SurfaceOptions::default()).unwrap();
    let follow = |surface: &mut SurfaceReconstruction, count: usize, is_final: bool| {
        let wanted = surface.follow((0..count).map(|index| (index, all[index].1)), is_final);
        for &index in &wanted {
            let points = surface.read_kept(&kept(index)).unwrap();
            surface.put(index, &points);
        }
        wanted
    };
    assert_eq!(follow(&mut surface, 2, false), [0, 1]);
    assert_eq!(follow(&mut surface, 3, false), [2]);
    assert_eq!(follow(&mut surface, 3, true), [0, 1, 2]);
    assert!(follow(&mut surface, 3, true).is_empty());
    assert_eq!(follow(&mut surface, 2, true), [0, 1], "a frame less");
    assert!(surface.mesh().triangles.len() > 1000 && surface.num_frames() == 2);
}

#[test]
fn clouds_without_a_surface_have_none() {
    for positions in [vec![], vec![Vec3::ONE], vec![Vec3::ONE; 100], vec![Vec3::new(1.0, 2.0, f32::NAN); 100]] {
        let cloud = PointCloud::from_positions(positions);
        let mesh = surface(SurfaceOptions::default(), &[(cloud, Pose3::identity())]).mesh();
        assert!(mesh.triangles.is_empty());
    }
    // Too few points on both sides of the origin, which is a corner of cells of any size.
    let few = (0..10).map(|at| Vec3::splat(if at % 2 == 0 { 1.0 } else { -1.0 }) + Vec3::X * at as f32).collect();
    let mesh = surface(SurfaceOptions::default(), &[(PointCloud::from_positions(few), Pose3::identity())]).mesh();
    assert!(mesh.triangles.is_empty());
    // A ring tells nothing of the surface around it.
    let ring = (0..2000).map(|at| Vec3::new((0.003 * at as f32).cos(), (0.003 * at as f32).sin(), 0.0)).collect();
    let mesh = surface(SurfaceOptions::default(), &[(PointCloud::from_positions(ring), Pose3::identity())]).mesh();
    assert!(mesh.triangles.is_empty(), "{}", mesh.triangles.len());
}
