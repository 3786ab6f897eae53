//! Depth images at known poses to a surface: where it lies, which way it faces, how sure it is, what is left out, its files.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use scanstitch::camera::{DepthImage, Pinhole};
use scanstitch::geometry::{Pose3, TriangleMesh};
use scanstitch::io::mesh::{self, MeshFormat};
use scanstitch::io::ply;
use scanstitch::map::surface::SurfaceOptions;
use scanstitch::pipeline::prepared_frame::DecodeConfig;
use scanstitch::pipeline::spatial_settings::SpatialSettings;
use scanstitch::pipeline::surface::{SurfaceFrame, SurfaceImage, SurfaceReconstruction};
use scanstitch_scene::random::Random;
use scanstitch_scene::space::DepthSensor;

const SIDE: usize = 160;
const CENTER: Vector3<f64> = Vector3::new(0.1, 0.0, 2.0);
const RADIUS: f64 = 0.5;
/// The wall behind the ball (m).
const WALL: f64 = 3.0;

fn camera() -> Pinhole {
    Pinhole::from_field_of_view(SIDE, SIDE, 1.2).unwrap()
}

/// Depth of a wall with or without a ball in front of it.
fn depth(T_world_camera: &Pose3, has_ball: bool) -> Vec<f64> {
    let (camera, origin) = (camera(), T_world_camera.translation.vector);
    let pixel = |index: usize| {
        let ray = T_world_camera.rotation * camera.ray((index % SIDE) as f64, (index / SIDE) as f64);
        let to_center = CENTER - origin;
        let (a, half_b) = (ray.norm_squared(), ray.dot(&to_center));
        let root = half_b * half_b - a * (to_center.norm_squared() - RADIUS * RADIUS);
        if has_ball && root > 0.0 { (half_b - root.sqrt()) / a } else { (WALL - origin.z) / ray.z }
    };
    (0..SIDE * SIDE).map(pixel).collect()
}

fn pgm(image: &DepthImage) -> Vec<u8> {
    let mut bytes = format!("P5 {} {} 65535\n", image.width, image.height).into_bytes();
    bytes.extend(image.values.iter().flat_map(|value| value.to_be_bytes()));
    bytes
}

/// Views from a few steps aside, turned to the ball, and each turned by 0.2 rad against the one before: all are keyframes.
fn poses(count: usize) -> Vec<Pose3> {
    let pose = |index: usize| {
        let aside = 0.5 * (index as f64 * 1.3).sin();
        let turn = UnitQuaternion::from_euler_angles(0.05 * (index as f64).cos(), -aside / 2.0, 0.2 * index as f64);
        Isometry3::from_parts(Translation3::new(aside, 0.1 * (index as f64).cos(), 0.0), turn)
    };
    (0..count).map(pose).collect()
}

fn empty_surface(
    options: SurfaceOptions,
    noise: f64,
    views: &[(Pose3, bool)],
) -> (SurfaceReconstruction, Vec<SurfaceImage>) {
    let sensor = DepthSensor::Millimetres { square_noise: noise };
    let image = |(index, (pose, has_ball)): (usize, &(Pose3, bool))| {
        pgm(&sensor.measure(&depth(pose, *has_ball), SIDE, &mut Random::new(index as u64)))
    };
    let images: Vec<Vec<u8>> = views.iter().enumerate().map(image).collect();
    let settings = SpatialSettings { field_of_view: 1.2, depth_scale: 1000.0, ..SpatialSettings::default() };
    let surface = SurfaceReconstruction::new(DecodeConfig::new(&settings, "0", &images[0]).unwrap(), options).unwrap();
    let images = images.iter().map(|image| surface.read("view", image, None).unwrap()).collect();
    (surface, images)
}

fn surface(options: SurfaceOptions, noise: f64, views: &[(Pose3, bool)]) -> SurfaceReconstruction {
    let (mut surface, images) = empty_surface(options, noise, views);
    images.iter().zip(views).for_each(|(image, (pose, _))| surface.add(image, pose));
    surface
}

/// The vertices in an order that does not depend on that of the blocks.
fn sorted_positions(mesh: &TriangleMesh) -> Vec<[u32; 3]> {
    let mut positions: Vec<_> = mesh.positions.iter().map(|point| point.to_array().map(f32::to_bits)).collect();
    positions.sort_unstable();
    positions
}

fn views(count: usize, has_ball: bool) -> Vec<(Pose3, bool)> {
    poses(count).into_iter().map(|pose| (pose, has_ball)).collect()
}

/// Distance of a vertex from the ball or the wall, whichever is nearer (m).
fn error(point: &glam::Vec3) -> f64 {
    let point = Vector3::new(f64::from(point.x), f64::from(point.y), f64::from(point.z));
    ((point - CENTER).norm() - RADIUS).abs().min((point.z - WALL).abs())
}

fn mean_error(mesh: &TriangleMesh) -> f64 {
    mesh.positions.iter().map(error).sum::<f64>() / mesh.positions.len() as f64
}

#[test]
fn the_surface_lies_where_the_depth_says_and_faces_the_camera() {
    let mesh = surface(SurfaceOptions::default(), 0.0, &views(6, true)).mesh();
    assert!(mesh.triangles.len() > 10_000, "{}", mesh.triangles.len());
    assert!(mean_error(&mesh) < 1e-3, "{}", mean_error(&mesh));
    let facing = mesh.positions.iter().zip(&mesh.normals).filter(|(point, normal)| normal.dot(**point) < 0.0).count();
    assert!(facing * 100 >= mesh.positions.len() * 99, "{facing} of {}", mesh.positions.len());
    // Away from the outline a normal is that of the ball.
    for (point, normal) in mesh.positions.iter().zip(&mesh.normals) {
        let from_center = (*point - glam::Vec3::new(0.1, 0.0, 2.0)).normalize();
        if point.z < 1.6 {
            assert!(normal.dot(from_center) > 0.97, "{point}: {normal}");
        }
    }
}

#[test]
fn deviations_are_honest_and_shrink_with_the_views() {
    let noise = 3e-3;
    let few = surface(SurfaceOptions::default(), noise, &views(3, true)).mesh();
    let many = surface(SurfaceOptions::default(), noise, &views(24, true)).mesh();
    // Of the middle, which all of them see: what one alone sees at the rims of the many is in their surface as well, and says so.
    let middle = |mesh: &TriangleMesh| {
        let is_middle = |point: &glam::Vec3| (f64::from(point.x) - CENTER.x).abs() < 0.7 && point.y.abs() < 0.7;
        let all = mesh.positions.iter().zip(&mesh.deviations).filter(|(point, _)| is_middle(point));
        all.map(|(point, deviation)| (error(point), *deviation)).collect::<Vec<_>>()
    };
    let mean = |vertices: &[(f64, f32)]| vertices.iter().map(|(error, _)| error).sum::<f64>() / vertices.len() as f64;
    let means = [&few, &many].map(|mesh| mean(&middle(mesh)));
    assert!(means[1] < 0.7 * means[0], "{means:?}");
    // Independent errors of eight times as many views would be 0.35 times as large; half of the noise may be the same in all of them.
    let typical = |mesh: &TriangleMesh| {
        let mut deviations: Vec<f32> = middle(mesh).into_iter().map(|(_, deviation)| deviation).collect();
        deviations.sort_by(f32::total_cmp);
        deviations[deviations.len() / 2]
    };
    let shrunk = typical(&many) / typical(&few);
    assert!(shrunk > 0.5 && shrunk < 0.9, "{shrunk}");
    for mesh in [few, many] {
        let within = |(point, deviation): (&glam::Vec3, &f32)| error(point) <= 1.96 * f64::from(*deviation);
        let share = mesh.positions.iter().zip(&mesh.deviations).filter(|pair| within(*pair)).count() as f64
            / mesh.positions.len() as f64;
        assert!(share > 0.95, "{share}");
    }
}

#[test]
fn what_later_views_see_through_is_carved_out() {
    // The ball is there in one view and gone in eleven.
    let mut all = views(12, false);
    all[0].1 = true;
    let num_on_ball = |views: &[(Pose3, bool)]| {
        let mesh = surface(SurfaceOptions::default(), 0.0, views).mesh();
        mesh.positions.iter().filter(|point| point.z < 2.5).count()
    };
    let (left, kept) = (num_on_ball(&all), num_on_ball(&views(12, true)));
    // Half of the ball, a vertex for each square of 2 cm, but for its outline.
    let half = std::f64::consts::TAU * RADIUS * RADIUS / (0.02 * 0.02);
    assert!(kept as f64 > 0.6 * half && left * 20 < kept, "{left} left, {kept} kept of {half}");
}

#[test]
fn while_the_run_goes_on_keyframes_are_put_and_the_whole_surface_does_not_depend_on_that() {
    // Each view three times, from places a centimetre apart. All depths of a view are off by up to 6 cm, which is more than the noise
    // within an image: views differ by it, and images of the same view do not.
    let near = |(pose, has_ball): (Pose3, bool)| {
        (0..3).map(move |step| (Translation3::new(0.01 * f64::from(step), 0.0, 0.0) * pose, has_ball))
    };
    let views: Vec<_> = views(5, true).into_iter().flat_map(near).collect();
    let measured = views.iter().enumerate().map(|(frame, (pose, has_ball))| {
        let error = 0.06 * ((frame / 3) as f64).cos();
        (pose * Translation3::new(0.0, 0.0, error), *has_ball)
    });
    let measured: Vec<_> = measured.collect();
    let (mut at_once, images) = empty_surface(SurfaceOptions::default(), 3e-4, &measured);
    let frames = || views.iter().map(|(pose, _)| *pose).enumerate();
    let put = |surface: &mut SurfaceReconstruction, count: usize, is_final: bool| {
        let wanted = surface.follow(frames().take(count), is_final);
        for &frame in &wanted {
            surface.put(frame, &SurfaceFrame::Image(images[frame].clone()));
        }
        wanted
    };
    let (mut followed, mut in_order) = (at_once.clone(), at_once.clone());
    let keyframes: Vec<usize> = (1..=views.len()).flat_map(|count| put(&mut followed, count, false)).collect();
    assert_eq!(keyframes, [0, 3, 6, 9, 12]);
    let others = [1, 2, 4, 5, 7, 8, 10, 11, 13, 14];
    assert_eq!(put(&mut followed, views.len(), true), others);
    assert_eq!(put(&mut at_once, views.len(), true), [keyframes, others.to_vec()].concat());
    assert_eq!(sorted_positions(&followed.mesh()), sorted_positions(&at_once.mesh()), "to the last bit");
    images.iter().zip(&views).for_each(|(image, (pose, _))| in_order.add(image, pose));
    assert!(sorted_positions(&in_order.mesh()) != sorted_positions(&at_once.mesh()), "the first images tell the noise");
}

#[test]
fn after_poses_have_changed_the_surface_is_that_of_a_run_with_the_final_poses() {
    let (views, noise) = (views(10, true), 3e-4);
    let options = SurfaceOptions { voxel_size: 0.04, ..SurfaceOptions::default() };
    let (mut surface, images) = empty_surface(options, noise, &views);
    let drifted = |frame: usize, share: f64| {
        let drift = Isometry3::new(Vector3::new(0.02, 0.0, -0.01) * share, Vector3::new(0.0, 0.01, 0.0) * share);
        (frame, drift * views[frame].0)
    };
    let follow = |surface: &mut SurfaceReconstruction, frames: &[(usize, Pose3)], is_final: bool| {
        let wanted = surface.follow(frames.iter().copied(), is_final);
        for &frame in &wanted {
            surface.put(frame, &SurfaceFrame::Image(images[frame].clone()));
        }
        wanted
    };
    // Frame by frame; the poses of the last three change, and a frame is no longer good.
    for count in 1..=8 {
        let frames: Vec<_> =
            (0..count).map(|frame| drifted(frame, if frame + 3 < count { 1.0 } else { 1.5 })).collect();
        let wanted = follow(&mut surface, &frames, false);
        assert!(wanted.len() <= 2 && wanted.contains(&(count - 1)), "{wanted:?}");
    }
    let settled: Vec<_> = (0..8).filter(|frame| *frame != 2).map(|frame| drifted(frame, 1.0)).collect();
    assert_eq!(follow(&mut surface, &settled, true), [5, 6, 7, 2]);
    let of = |frames: &[(usize, Pose3)]| {
        let (mut fresh, _) = empty_surface(options, noise, &views);
        for (frame, pose) in frames {
            fresh.add(&images[*frame], pose);
        }
        fresh.mesh()
    };
    let (followed, fresh) = (surface.mesh(), of(&settled));
    assert_eq!(sorted_positions(&followed), sorted_positions(&fresh), "to the last bit");
    assert!(mean_error(&followed) > 5e-3, "the drift shows: {}", mean_error(&followed));
    // A loop moves all of them: it begins anew. Less than half a millimetre is nothing.
    let closed: Vec<_> = (0..10).map(|frame| drifted(frame, 0.0)).collect();
    assert_eq!(follow(&mut surface, &closed, true).len(), 10);
    assert_eq!(surface.mesh(), of(&closed));
    assert!(follow(&mut surface, &(0..10).map(|frame| drifted(frame, 0.005)).collect::<Vec<_>>(), true).is_empty());
    assert!(mean_error(&surface.mesh()) < 2e-3, "{}", mean_error(&surface.mesh()));
}

#[test]
fn the_memory_is_bounded_by_coarser_voxels() {
    let fine = SurfaceOptions { voxel_size: 0.004, max_megabytes: 20.0, ..SurfaceOptions::default() };
    let mut surface = surface(fine, 0.0, &views(4, true));
    assert!(surface.num_bytes() <= 20_000_000 && surface.voxel_size() > 0.004);
    assert!(mean_error(&surface.mesh()) < 2e-3, "{}", mean_error(&surface.mesh()));
}

#[test]
fn poses_that_are_none_and_images_of_another_size_change_nothing() {
    let mut all = views(3, true);
    let expected = surface(SurfaceOptions::default(), 0.0, &all).mesh();
    all.push((Isometry3::from_parts(Translation3::new(f64::NAN, 0.0, 0.0), UnitQuaternion::identity()), true));
    let mut surface = surface(SurfaceOptions::default(), 0.0, &all[..3]);
    let even = DepthImage { width: SIDE, height: SIDE, bits: 16, values: vec![900; SIDE * SIDE] };
    let even = surface.read("view", &pgm(&even), None).unwrap();
    surface.add(&even, &all[3].0);
    let small = pgm(&DepthImage { width: 8, height: 8, bits: 16, values: vec![1000; 64] });
    let error = surface.read("small.pgm", &small, None).unwrap_err();
    assert!(error.to_string().contains("small.pgm"), "{error}");
    assert_eq!(surface.mesh(), expected);
    for (name, options) in [
        ("voxel_size", SurfaceOptions { voxel_size: 0.0, ..SurfaceOptions::default() }),
        ("max_megabytes", SurfaceOptions { max_megabytes: f64::NAN, ..SurfaceOptions::default() }),
    ] {
        assert!(options.check().unwrap_err().to_string().contains(name));
    }
}

#[test]
fn files_hold_the_mesh() {
    let mesh = surface(SurfaceOptions { voxel_size: 0.05, ..SurfaceOptions::default() }, 0.0, &views(2, true)).mesh();
    let cloud = ply::read(&mesh::write(&mesh, MeshFormat::Ply)).unwrap();
    assert_eq!((cloud.positions, cloud.normals.unwrap().len()), (mesh.positions.clone(), mesh.normals.len()));
    let stl = mesh::write(&mesh, MeshFormat::Stl);
    assert_eq!(stl.len(), 84 + 50 * mesh.triangles.len());
    let x = f32::from_le_bytes(stl[96..100].try_into().unwrap());
    let first = mesh.positions[mesh.triangles[0][0] as usize].x;
    assert!((x - 1000.0 * first).abs() < 1e-3, "millimetres: {x}, {first} m");
    let obj = String::from_utf8(mesh::write(&mesh, MeshFormat::Obj)).unwrap();
    let lines = |word: &str| obj.lines().filter(|line| line.split(' ').next() == Some(word)).count();
    assert_eq!((lines("v"), lines("vn"), lines("f")), (mesh.positions.len(), mesh.normals.len(), mesh.triangles.len()));
    assert!(MeshFormat::named("fbx").unwrap_err().to_string().contains("Give ply, obj or stl"));
}
