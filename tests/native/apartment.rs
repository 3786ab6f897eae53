//! The synthetic flat: the committed samples are what it renders, every seed is a flat one can walk through, and what is
//! rendered is what geometry says.

#[path = "../../crate/measure/src/apartment/recording.rs"]
#[allow(dead_code)] // crate/measure uses the rest
mod recording;
#[path = "../../crate/measure/src/apartment/registering.rs"]
mod registering;

use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fs;

use nalgebra::{Point3, Vector2, Vector3};
use scanstitch::camera::Pinhole;
use scanstitch::camera::bev::BevScene;
use scanstitch::geometry::{Pose3, RigidMotion};
use scanstitch::io::{depth_image, trajectory};
use scanstitch::pipeline::spatial_settings::{Quantisation, SpatialSettings};
use scanstitch_scene::apartment::walk::{in_homework_axes, level_pose};
use scanstitch_scene::apartment::{Apartment, CLEARANCE, Tour, WalkOptions};
use scanstitch_scene::random::Random;
use scanstitch_scene::samples;
use scanstitch_scene::space::DepthSensor;

const APARTMENT: &str = "www/samples/apartment";
const BEV: &str = "www/samples/bev";
/// Frames of the sample that are rendered anew to the last byte; of all others the depth is.
const WHOLE_FRAMES: [usize; 1] = [20];

fn folder_size(folder: &str) -> u64 {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    entries
        .map(|entry| {
            let path = entry.path();
            if path.is_dir() { folder_size(path.to_str().unwrap()) } else { entry.metadata().unwrap().len() }
        })
        .sum()
}

#[test]
fn the_committed_recording_is_what_the_flat_renders() {
    let sample = samples::apartment().unwrap();
    let walk = &sample.T_world_camera;
    assert!((35..=50).contains(&walk.len()), "{}", walk.len());
    assert_eq!(fs::read(format!("{APARTMENT}/GT_pose.npy")).unwrap(), recording::poses_npy(walk).unwrap());
    for kind in ["rgb", "depth"] {
        assert_eq!(fs::read_dir(format!("{APARTMENT}/{kind}")).unwrap().count(), walk.len());
    }
    // Every eighth depth image, and one whole frame: all of them would take a minute.
    for index in (0..walk.len()).step_by(8) {
        let depth = sample.apartment.space.depth(&walk[index], &sample.camera);
        let image = DepthSensor::HOMEWORK.measure(&depth, 512, &mut Random::new(0));
        let bytes = fs::read(format!("{APARTMENT}/depth/{}.png", index + 1)).unwrap();
        assert!(bytes == recording::depth_png(&image).unwrap(), "depth/{}.png", index + 1);
        assert!(depth_image::read(&bytes).unwrap() == image);
    }
    for index in WHOLE_FRAMES {
        let frame = sample.apartment.space.render(&walk[index], &sample.camera);
        let bytes = fs::read(format!("{APARTMENT}/rgb/{}.jpg", index + 1)).unwrap();
        assert!(bytes == recording::jpeg(&frame).unwrap(), "rgb/{}.jpg", index + 1);
    }
}

#[test]
fn the_committed_views_have_the_cameras_of_their_scene() {
    let sample = samples::bev().unwrap();
    let [top, front] = [&sample.T_world_camera[0], &sample.T_world_camera[1]];
    let text = recording::bev_scene(&sample.camera, [top, front]);
    assert_eq!(fs::read_to_string(format!("{BEV}/scene.json")).unwrap(), text);
    let scene: serde_json::Value = serde_json::from_str(&text).unwrap();
    for (name, pose) in [("top", top), ("front", front)] {
        let matrix = pose.to_homogeneous();
        let written = &scene[name]["pose"]["T_world_camera"];
        for (row, column) in (0..4).flat_map(|row| (0..4).map(move |column| (row, column))) {
            assert!((written[row][column].as_f64().unwrap() - matrix[(row, column)]).abs() < 1e-11, "{name}");
        }
        assert!(fs::metadata(format!("{BEV}/{name}.jpg")).unwrap().len() > 50_000);
    }
    assert!(folder_size("www/samples") < 6_000_000, "{} bytes", folder_size("www/samples"));
}

#[test]
fn floor_pixels_of_one_view_land_in_the_other_where_the_renderer_sees_them() {
    let sample = samples::bev().unwrap();
    let (apartment, camera) = (&sample.apartment, &sample.camera);
    let [top, front] = [&sample.T_world_camera[0], &sample.T_world_camera[1]];
    let scene = BevScene::read(&fs::read(format!("{BEV}/scene.json")).unwrap()).unwrap();
    let directions = [(top, front, scene.front_from_top().unwrap()), (front, top, scene.top_from_front().unwrap())];
    for (from, to, transfer) in directions {
        let mut both = 0;
        for (u, v) in (0..128).flat_map(|v| (0..128).map(move |u| (f64::from(u) * 8.0, f64::from(v) * 8.0))) {
            let Some(floor) = apartment.floor_seen_at(from, camera, u, v) else { continue };
            assert!(floor.z.abs() < 1e-9);
            let Some(pixel) = camera.project(&(to.inverse() * Point3::from(floor)).coords) else { continue };
            let seen =
                apartment.floor_seen_at(to, camera, pixel.x, pixel.y).filter(|seen| (seen - floor).norm() < 1e-6);
            if seen.is_none() || pixel.min() < 0.0 || pixel.max() > 1023.0 {
                continue; // hidden, or out of the picture
            }
            both += 1;
            let [x, y] = transfer.point([u, v]).projected.unwrap();
            assert!((pixel - Vector2::new(x, y)).norm() < 1e-6, "({u}, {v}) lands on ({x}, {y}), not on {pixel}");
        }
        assert!(both > 600, "{both} of 16384 pixels see floor that the other view sees, too");
    }
}

#[test]
fn every_seed_is_a_flat_of_the_described_kind_and_another_one() {
    let mut plans = BTreeSet::new();
    for seed in 0..12 {
        let apartment = Apartment::generate(seed);
        let plan = &apartment.plan;
        let rooms = plan.rooms.len() - 2; // less the corridor's arms
        assert!((4..=6).contains(&rooms), "seed {seed}: {rooms} rooms");
        assert!((55.0..110.0).contains(&plan.area()), "seed {seed}: {} m2", plan.area());
        assert!(apartment.space.solids().len() > 800, "seed {seed}: {} solids", apartment.space.solids().len());
        let doors = plan.openings.iter().filter(|opening| opening.is_way());
        assert!(doors.clone().all(|door| plan.rooms_at(door).count() == 2), "seed {seed}");
        plans.insert((plan.size.x.to_bits(), plan.size.y.to_bits()));
        // From wherever one stands, there is something everywhere, and nothing farther than the flat is wide.
        let camera = Pinhole::new(32, 32, [16.0; 4]).unwrap();
        for room in &plan.rooms {
            let center = room.inner().center();
            for quarter in 0..4 {
                let pose = level_pose(Vector3::new(center.x, center.y, 2.3), f64::from(quarter) * FRAC_PI_2);
                let depth = apartment.space.depth(&pose, &camera);
                assert!(depth.iter().all(|z| *z < plan.size.norm()), "seed {seed}: {:?} is open", room.kind);
            }
        }
    }
    assert_eq!(plans.len(), 12);
}

/// Every walk goes by steps and turns of the given sizes, keeps clear of everything, and ends where it began.
fn check_walk(apartment: &Apartment, options: &WalkOptions, label: &str) -> usize {
    let walk = apartment.walk(options);
    assert!(walk.len() > 20, "{label}: {} frames", walk.len());
    for pair in walk.windows(2) {
        let motion = pair[0].inverse() * pair[1];
        let (moved, turned) = (motion.translation_norm(), motion.rotation_angle());
        let steps = (moved - options.step).abs() < 1e-9 && turned < 1e-9;
        let turns = moved < 1e-9 && (turned - options.turn).abs() < 1e-9;
        assert!(steps || turns, "{label}: {moved} m and {turned} rad");
        assert!((motion.translation.vector.z - moved).abs() < 1e-9, "{label}: steps go ahead");
    }
    for pose in &walk {
        let position = pose.translation.vector;
        assert_eq!(position.z, options.camera_height);
        // Level, and upright: down in the image is down in the world.
        assert!((pose.rotate(&Vector3::y()) + Vector3::z()).norm() < 1e-9, "{label}");
        for height in [0.3, 0.9, 1.25, 1.6] {
            for direction in 0..24 {
                let angle = TAU * f64::from(direction) / 24.0;
                let (from, along) =
                    (Vector3::new(position.x, position.y, height), Vector3::new(angle.cos(), angle.sin(), 0.0));
                let free = apartment.space.cast(&from, &along).map_or(f64::INFINITY, |hit| hit.distance);
                assert!(free > CLEARANCE - 0.04, "{label}: {free} m at {position:?}");
            }
        }
    }
    // Nothing stands between two places where one has stood.
    for pair in walk.windows(2) {
        let (from, way) = (pair[0].translation.vector, pair[1].translation.vector - pair[0].translation.vector);
        let met = |height: f64| apartment.space.cast(&Vector3::new(from.x, from.y, height), &way);
        assert!([0.1, 0.5, 1.25].iter().all(|&z| way.norm() < 1e-9 || met(z).is_none_or(|hit| hit.distance > 1.0)));
    }
    let back = walk[0].inverse() * walk[walk.len() - 1];
    assert!(back.translation_norm() < 0.6 * options.step && back.rotation_angle() < 1e-6, "{label}: ends at {back}");
    walk.len()
}

#[test]
fn walks_are_the_homeworks_and_pass_through_nothing() {
    for seed in 1..=2 {
        let apartment = Apartment::generate(seed);
        check_walk(&apartment, &WalkOptions { seed, ..WalkOptions::default() }, &format!("seed {seed}"));
        let wide = WalkOptions { step: 0.5, ..WalkOptions::default() };
        check_walk(&apartment, &wide, &format!("seed {seed}, steps of 0.5 m"));
    }
    for seed in 1..=4 {
        let round = WalkOptions { tour: Tour::Pier, step: 0.3, turn: PI / 12.0, ..WalkOptions::default() };
        let frames = check_walk(&Apartment::generate(seed), &round, &format!("seed {seed}, round the pier"));
        assert!(frames < 60, "seed {seed}: {frames}");
    }
    let apartment = Apartment::generate(1);
    let few = apartment.walk(&WalkOptions { num_frames: Some(7), ..WalkOptions::default() });
    assert_eq!(few.len(), 7);
    for (step, turn) in [(0.0, 0.2), (f64::NAN, 0.2), (0.25, 0.0), (0.25, f64::NAN), (5.0, 0.2)] {
        assert!(apartment.walk(&WalkOptions { step, turn, ..WalkOptions::default() }).is_empty());
    }
}

#[test]
fn poses_read_back_in_the_axes_of_the_homework() {
    let walk = Apartment::generate(2).walk(&WalkOptions { num_frames: Some(40), ..WalkOptions::default() });
    let read = trajectory::read(&recording::poses_npy(&walk).unwrap()).unwrap().poses().unwrap();
    assert_eq!(read.len(), walk.len());
    for (read, pose) in read.iter().zip(&walk) {
        assert!((in_homework_axes(pose).inverse() * read).log().norm() < 1e-9);
        let (ahead, up) = (pose.rotate(&Vector3::z()), read.rotate(&Vector3::y()));
        assert!((up - Vector3::y()).norm() < 1e-9, "y of the file's world points up");
        let back = read.rotate(&Vector3::z());
        assert!((Vector3::new(ahead.x, ahead.z, -ahead.y) + back).norm() < 1e-9, "the camera looks along -z");
    }
    // The motion from frame to frame is the same once the camera's axes are turned back.
    let flip = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI);
    for (file, pair) in read.windows(2).zip(walk.windows(2)) {
        let motion = (file[0] * flip).inverse() * (file[1] * flip);
        assert!(((pair[0].inverse() * pair[1]).inverse() * motion).log().norm() < 1e-9);
    }
}

#[test]
fn depth_is_exact_and_the_same_point_is_seen_from_two_places() {
    let apartment = Apartment::generate(4);
    let walk = apartment.walk(&WalkOptions::default());
    let camera = Pinhole::new(48, 48, [24.0; 4]).unwrap();
    let (mut again, mut floors) = (0, 0);
    for pose in walk.iter().step_by(10) {
        let depth = apartment.space.depth(pose, &camera);
        for (index, z) in depth.iter().enumerate() {
            let (u, v) = ((index % 48) as f64, (index / 48) as f64);
            let point = pose * Point3::from(camera.unproject(u, v, *z));
            let (_, seen) = apartment.space.seen_at(pose, &camera, u, v).unwrap();
            assert!((point.coords - seen).norm() < 1e-9);
            assert!((-1e-9..apartment.plan.height + 1e-9).contains(&point.z));
            floors +=
                usize::from(apartment.floor_seen_at(pose, &camera, u, v).is_some_and(|floor| floor.z.abs() < 1e-9));
        }
        // A neighbouring camera sees at the same place no farther than that point.
        let other = pose * Pose3::translation(0.05, 0.0, 0.0);
        for (index, z) in depth.iter().enumerate().step_by(7) {
            let point = pose * Point3::from(camera.unproject((index % 48) as f64, (index / 48) as f64, *z));
            let inside = (other.inverse() * point).coords;
            let Some(pixel) = camera.project(&inside) else { continue };
            let (_, seen) = apartment.space.seen_at(&other, &camera, pixel.x, pixel.y).unwrap();
            let nearer = (other.inverse() * Point3::from(seen)).z;
            assert!(nearer < inside.z + 1e-7);
            again += usize::from(nearer > inside.z - 1e-7);
        }
    }
    assert!(again > 2000 && floors > 2000, "{again} {floors}");
}

#[test]
fn the_same_seed_renders_the_same_bytes_and_another_one_others() {
    let camera = Pinhole::new(40, 30, [20.0, 20.0, 20.0, 15.0]).unwrap();
    let render = |seed: u64| {
        let apartment = Apartment::generate(seed);
        let center = apartment.plan.rooms[0].inner().center();
        apartment.space.render(&level_pose(Vector3::new(center.x, center.y, 1.9), 0.3), &camera)
    };
    let frame = render(6);
    assert_eq!((frame.width, frame.height, frame.rgb.len(), frame.depth.len()), (40, 30, 3600, 1200));
    assert!(frame == render(6));
    assert!(frame.rgb != render(7).rgb);
    // Neither dark nor washed out.
    let mean = frame.rgb.iter().map(|&value| f64::from(value)).sum::<f64>() / 3600.0;
    let bright = frame.rgb.iter().filter(|&&value| value > 250).count();
    assert!((70.0..225.0).contains(&mean) && bright < 900, "{mean} {bright}");
}

#[test]
fn rendered_depth_is_registered() {
    let apartment = Apartment::generate(5);
    let walk = apartment.walk(&WalkOptions { tour: Tour::Pier, num_frames: Some(12), ..WalkOptions::default() });
    let camera = Pinhole::from_field_of_view(512, 512, FRAC_PI_2).unwrap();
    let depths: Vec<_> = walk.iter().map(|pose| apartment.space.depth(pose, &camera)).collect();
    for sensor in [DepthSensor::HOMEWORK, DepthSensor::Millimetres { square_noise: 1.5e-3 }] {
        let measured = |(index, depth): (usize, &Vec<f64>)| sensor.measure(depth, 512, &mut Random::new(index as u64));
        let images: Vec<_> = depths.iter().enumerate().map(measured).collect();
        let reconstruction = registering::reconstruct(SpatialSettings::default(), &images).unwrap();
        let truth: Vec<Pose3> = walk.iter().map(|pose| walk[0].inverse() * pose).collect();
        let poses = reconstruction.poses();
        let errors = poses.iter().zip(&truth).map(|(a, b)| (a.translation.vector - b.translation.vector).norm());
        let mean = errors.sum::<f64>() / walk.len() as f64;
        assert!(mean < 0.03, "{sensor:?}: {mean} m");
        if sensor == DepthSensor::HOMEWORK {
            assert_eq!(reconstruction.quantisation(), Some(Quantisation::Truncated));
        }
    }
    let ends: Vec<Vector2<f64>> = walk.iter().map(|pose| pose.translation.vector.xy()).collect();
    assert!((ends[0] - ends[11]).norm() > 0.2, "the twelve frames move");
}
