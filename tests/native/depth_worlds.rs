//! Rooms that look the same from several places: no frame of a depth camera that is called good is at a wrong one.

use scanstitch::camera::{DepthImage, Pinhole};
use scanstitch::geometry::{Pose3, RigidMotion};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::prepared_frame::{ColorFile, DecodeConfig, FrameLabel, PreparedFrame};
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::spatial::SpatialReconstruction;
use scanstitch::pipeline::spatial_settings::SpatialSettings;
use scanstitch_scene::apartment::{Apartment, WalkOptions};
use scanstitch_scene::hand_held::hand_held;
use scanstitch_scene::random::Random;
use scanstitch_scene::repetitive::{Repetition, generate};
use scanstitch_scene::space::stereo_camera::StereoCamera;
use scanstitch_scene::space::{DepthSensor, Space};

/// Pixels across the image; a quarter fewer from top to bottom.
const WIDTH: usize = 320;
/// Range of the camera (m).
const MAX_DEPTH: f64 = 7.0;
/// Depth values per metre of most cameras, and of 8-bit images over 10 m.
const MILLIMETRES: f64 = 1000.0;
const HOMEWORK: f64 = 25.5;
/// Noise of the camera over the square of the depth (1/m).
const SQUARE_NOISE: f64 = 1.5e-3;
/// A good frame further off than this (m) is falsely good.
const MAX_ERROR: f64 = 0.2;
/// The same before a bare wall, after a few steps (m).
const MAX_GOOD_ERROR_AT_WALL: f64 = 0.03;
/// The same for its rotation (rad).
const MAX_ROTATION_ERROR: f64 = 0.17;

fn pgm(image: &DepthImage) -> Vec<u8> {
    let max_value = if image.bits == 8 { 255 } else { 65_535 };
    let mut bytes = format!("P5 {} {} {max_value}\n", image.width, image.height).into_bytes();
    let skipped = usize::from(image.bits == 8);
    bytes.extend(image.values.iter().flat_map(|value| value.to_be_bytes().into_iter().skip(skipped)));
    bytes
}

/// The surfaces' own colours, without light.
fn ppm(space: &Space, pose: &Pose3, camera: &Pinhole) -> Vec<u8> {
    let mut bytes = format!("P6 {} {} 255\n", camera.width, camera.height).into_bytes();
    for pixel in 0..camera.width * camera.height {
        let (u, v) = (pixel % camera.width, pixel / camera.width);
        let color = space.seen_at(pose, camera, u as f64, v as f64).map(|(index, point)| {
            let solid = &space.solids()[index];
            let local = solid.to_own_frame(&point);
            space.material(solid).albedo(&local, &solid.normal(&point))
        });
        bytes.extend(color.unwrap_or_default().iter().map(|channel| (255.0 * channel.powf(1.0 / 2.2)) as u8));
    }
    bytes
}

/// Status and error (m, rad) of each frame, relative to the first.
fn run(repetition: Repetition, step: f64, num_frames: usize, with_colors: bool) -> Vec<(Status, f64, f64)> {
    let (space, truth) = generate(repetition, step, num_frames, 1);
    let camera = Pinhole::from_field_of_view(WIDTH, WIDTH * 3 / 4, 1.2).unwrap();
    let frame = |index: usize, pose: &Pose3| {
        let mut depth = space.depth(pose, &camera);
        depth.iter_mut().filter(|z| **z > MAX_DEPTH).for_each(|z| *z = f64::INFINITY);
        let sensor = DepthSensor::Millimetres { square_noise: SQUARE_NOISE };
        let bytes = pgm(&sensor.measure(&depth, camera.width, &mut Random::new(index as u64)));
        (bytes, with_colors.then(|| ppm(&space, pose, &camera)))
    };
    reconstruct(&camera, &truth, frame)
}

/// The same of frames of depth (mm) and perhaps colours.
fn reconstruct(
    camera: &Pinhole,
    truth: &[Pose3],
    frame: impl Fn(usize, &Pose3) -> (Vec<u8>, Option<Vec<u8>>),
) -> Vec<(Status, f64, f64)> {
    let reconstruction = finished_run(camera, MILLIMETRES, truth, frame);
    errors(&reconstruction, truth)
}

/// Status and error (m, rad) of each frame, relative to the first.
fn errors(reconstruction: &SpatialReconstruction, truth: &[Pose3]) -> Vec<(Status, f64, f64)> {
    let estimates = reconstruction.poses().into_iter().zip(reconstruction.assessments()).zip(truth);
    estimates
        .map(|((estimate, assessment), pose)| {
            let error = (truth[0].inverse() * pose).inverse() * estimate;
            (assessment.status, error.translation_norm(), error.rotation_angle())
        })
        .collect()
}

/// The finished run on such frames, with so many depth values per metre.
fn finished_run(
    camera: &Pinhole,
    depth_scale: f64,
    truth: &[Pose3],
    frame: impl Fn(usize, &Pose3) -> (Vec<u8>, Option<Vec<u8>>),
) -> SpatialReconstruction {
    let settings = SpatialSettings {
        fx: camera.fx,
        fy: camera.fy,
        cx: camera.cx,
        cy: camera.cy,
        depth_scale,
        ..SpatialSettings::default()
    };
    let mut reconstruction = SpatialReconstruction::new(settings).unwrap();
    let mut config: Option<DecodeConfig> = None;
    for (index, pose) in truth.iter().enumerate() {
        let (bytes, colors) = frame(index, pose);
        let label = FrameLabel { name: format!("{index}.pgm"), index, time: None };
        if config.is_none() {
            config = Some(reconstruction.begin(&label.name, &bytes).unwrap().clone());
        }
        let color = colors.as_deref().map(|colors| ColorFile { name: "color.ppm", bytes: Ok(colors) });
        let frame = PreparedFrame::from_depth(config.as_ref().unwrap(), label, &bytes, color).unwrap();
        reconstruction.add(frame).unwrap();
    }
    reconstruction.finish();
    while reconstruction.step().stage != Stage::Done {}
    reconstruction
}

/// Checks that no good frame is off, and returns how many are good. With a path so short, how far the sensor moves is known from
/// these frames alone.
fn check_good_frames(repetition: Repetition, step: f64, num_frames: usize, with_colors: bool) -> usize {
    let frames = run(repetition, step, num_frames, with_colors);
    assert_eq!(frames[0].0, Status::Good);
    let is_off = |frame: &&(Status, f64, f64)| frame.1 > MAX_ERROR || frame.2 > MAX_ROTATION_ERROR;
    let wrong = frames.iter().filter(|frame| frame.0 == Status::Good && is_off(frame)).count();
    assert_eq!(wrong, 0, "{repetition:?}, {step} m: {frames:?}");
    frames.iter().filter(|frame| frame.0 == Status::Good).count()
}

#[test]
fn between_pillars_no_frame_is_falsely_good() {
    for (period, step) in [(2.0, 0.7), (2.0, 1.7), (2.0, 2.3), (3.0, 1.2), (3.0, 1.7), (3.0, 2.4)] {
        check_good_frames(Repetition::Pillars(period), step, 8, false);
    }
    // Of long steps none but the first frame is good. Of short ones others are: half of those that were found.
    let num_good = check_good_frames(Repetition::Pillars(3.0), 0.1, 8, false);
    assert!(num_good >= 2, "{num_good} good");
}

#[test]
fn in_a_turning_view_of_a_cube_no_frame_is_falsely_good() {
    check_good_frames(Repetition::Cube, 0.0, 12, false);
}

#[test]
fn along_tiles_no_frame_is_falsely_good() {
    for step in [0.4, 1.3, 2.0] {
        check_good_frames(Repetition::Tiles, step, 10, true);
    }
    // As between pillars.
    let num_good = check_good_frames(Repetition::Tiles, 0.05, 10, true);
    assert!(num_good >= 2, "{num_good} good");
}

/// The first frames of a stereo camera that is carried through an apartment: the camera, its poses and its depth images.
fn hand_held_stereo(seed: u64, count: usize) -> (Pinhole, Vec<Pose3>, Vec<Vec<u8>>) {
    let apartment = Apartment::generate(seed);
    let mut truth = hand_held(&apartment.walk(&WalkOptions::default()), 0.04, 4f64.to_radians(), seed);
    truth.truncate(count);
    let camera = Pinhole::new(640, 480, [384.0, 384.0, 320.0, 240.0]).unwrap();
    let image = |(index, pose): (usize, &Pose3)| {
        let (last, seed) = (&truth[index.saturating_sub(1)], 1000 * seed + index as u64);
        pgm(&StereoCamera::default().measure(&apartment.space, pose, last, &camera, seed))
    };
    let images = truth.iter().enumerate().map(image).collect();
    (camera, truth, images)
}

/// Before a near wall that fills the picture, the pieces that a stereo camera makes of it face anywhere: they constrain no position.
#[test]
fn before_a_bare_wall_the_noise_of_a_stereo_camera_is_no_evidence() {
    let (camera, truth, images) = hand_held_stereo(2, 6);
    let frame = |index: usize, _: &Pose3| (images[index].clone(), None);
    let frames = reconstruct(&camera, &truth, frame);
    let is_off = |frame: &&(Status, f64, f64)| frame.1 > MAX_GOOD_ERROR_AT_WALL;
    let wrong = frames.iter().filter(|frame| frame.0 == Status::Good).filter(is_off).count();
    assert_eq!(wrong, 0, "{frames:?}");
    assert!(frames.iter().all(|frame| frame.0 != Status::Lost && frame.1 < MAX_ERROR), "{frames:?}");
}

/// Before a near wall the residuals are small, and the slight noise of thousands of normals adds up: it constrains no position.
#[test]
fn a_near_wall_holds_no_camera_by_the_noise_of_its_normals() {
    let apartment = Apartment::generate(1);
    let mut truth = hand_held(&apartment.walk(&WalkOptions::default()), 0.01, 0.6f64.to_radians(), 1);
    truth.truncate(4);
    let camera = Pinhole::new(640, 480, [585.0, 585.0, 320.0, 240.0]).unwrap();
    // Disparities in eighths of a pixel, as a Kinect's.
    let sensor = StereoCamera {
        baseline: 0.075,
        step: 0.125,
        patch_noise: 0.05,
        pixel_noise: 0.05,
        bias: 0.1,
        fattening: 2.0,
        exposure: 0.0,
        ..StereoCamera::default()
    };
    let frame = |index: usize, pose: &Pose3| {
        let last = &truth[index.saturating_sub(1)];
        (pgm(&sensor.measure(&apartment.space, pose, last, &camera, 1000 + index as u64)), None)
    };
    let frames = reconstruct(&camera, &truth, frame);
    let is_off = |frame: &&(Status, f64, f64)| frame.1 > MAX_GOOD_ERROR_AT_WALL;
    assert!(frames.iter().filter(is_off).all(|frame| frame.0 == Status::Doubtful), "{frames:?}");
    assert!(frames.iter().any(|frame| is_off(&frame)), "the wall does not tell where the camera is: {frames:?}");
}

/// The second frame sees a bare wall and leaves its position open. Those after it fit it and share its error: they are good once they are
/// most of all, and the first is not.
#[test]
fn good_frames_after_an_uncertain_one_say_what_they_rest_on() {
    let (camera, truth, images) = hand_held_stereo(1, 5);
    let frame = |index: usize, _: &Pose3| (images[index].clone(), None);
    let run = |count: usize| finished_run(&camera, MILLIMETRES, &truth[..count], frame);
    let statuses_of = |run: &SpatialReconstruction| run.assessments().iter().map(|one| one.status).collect::<Vec<_>>();
    assert_eq!(statuses_of(&run(4)), [Status::Good, Status::Doubtful, Status::Doubtful, Status::Doubtful]);
    let whole = run(5);
    assert_eq!(statuses_of(&whole), [Status::Doubtful, Status::Doubtful, Status::Good, Status::Good, Status::Good]);
    let result = whole.result();
    let note = result.notes.iter().find(|note| note.starts_with("The position of 1.pgm is uncertain"));
    assert!(note.is_some_and(|note| note.contains("the 3 good frames after it")), "{:?}", result.notes);
    let certain = run(1).result();
    assert!(certain.notes.iter().all(|note| !note.contains("is uncertain")), "{:?}", certain.notes);
}

/// Upside down, a bare room looks much the same from where it is seen next: the frame before a lost one does not keep it there.
#[test]
fn a_turn_before_bare_walls_is_not_tracked_upside_down() {
    let apartment = Apartment::generate(2);
    let options = WalkOptions { step: 0.5, turn: 20f64.to_radians(), num_frames: Some(100), ..WalkOptions::default() };
    let truth = apartment.walk(&options);
    let camera = Pinhole::from_field_of_view(512, 512, std::f64::consts::FRAC_PI_2).unwrap();
    let frame = |index: usize, pose: &Pose3| {
        let depth = apartment.space.depth(pose, &camera);
        let sensor = DepthSensor::Millimetres { square_noise: 0.0 };
        (pgm(&sensor.measure(&depth, camera.width, &mut Random::new(index as u64))), None)
    };
    let frames = reconstruct(&camera, &truth, frame);
    let last = &frames[frames.len() - 6..];
    assert!(
        last.iter().all(|frame| frame.0 == Status::Good && frame.1 < MAX_ERROR && frame.2 < MAX_ROTATION_ERROR),
        "{frames:?}"
    );
}

/// Close to the corner of a bare room, a pose turned by a right angle fits about as well as the right one: both are registered finely.
#[test]
fn at_the_corner_of_a_bare_room_other_poses_near_the_prediction_are_compared() {
    let apartment = Apartment::generate(9);
    let options = WalkOptions { step: 0.5, turn: 20f64.to_radians(), num_frames: Some(100), ..WalkOptions::default() };
    let truth = &apartment.walk(&options)[62..90];
    let camera = Pinhole::from_field_of_view(512, 512, std::f64::consts::FRAC_PI_2).unwrap();
    let frame = |index: usize, pose: &Pose3| {
        let depth = apartment.space.depth(pose, &camera);
        (pgm(&DepthSensor::HOMEWORK.measure(&depth, camera.width, &mut Random::new(index as u64))), None)
    };
    let frames = errors(&finished_run(&camera, HOMEWORK, truth, frame), truth);
    assert!(frames.iter().all(|frame| frame.1 < MAX_ERROR && frame.2 < MAX_ROTATION_ERROR), "{frames:?}");
}

/// Before a bare wall whose brightness hardly changes, where the camera was going tells more than its colours do.
#[test]
fn colours_of_a_bare_wall_do_not_place_a_frame() {
    let apartment = Apartment::generate(3);
    let options = WalkOptions { num_frames: Some(22), ..WalkOptions::default() };
    let truth = apartment.walk(&options);
    let camera = Pinhole::from_field_of_view(512, 512, std::f64::consts::FRAC_PI_2).unwrap();
    let frame = |index: usize, pose: &Pose3| {
        let depth = apartment.space.depth(pose, &camera);
        let depth = DepthSensor::HOMEWORK.measure(&depth, camera.width, &mut Random::new(index as u64));
        (pgm(&depth), Some(ppm(&apartment.space, pose, &camera)))
    };
    let frames = errors(&finished_run(&camera, HOMEWORK, &truth, frame), &truth);
    let is_right = |frame: &(Status, f64, f64)| frame.1 < MAX_GOOD_ERROR_AT_WALL && frame.2 < MAX_ROTATION_ERROR;
    assert!(frames.iter().all(is_right), "{frames:?}");
    // Before the wall all are good. How far the camera came along it is not known well enough.
    assert!(frames[..15].iter().all(|frame| frame.0 == Status::Good), "{frames:?}");
    assert!(frames.iter().all(|frame| frame.0 != Status::Lost), "{frames:?}");
}

/// Patches of noise, ragged outlines, holes, flying pixels and errors that are the same in every image: none of them loses a frame
/// of a camera that is carried through a flat in a hand.
#[test]
fn a_stereo_camera_in_a_hand_is_followed() {
    let frames = frames_of_stereo_camera_in_hand(3, (0.06, 6.0), 24);
    assert!(frames.iter().all(|frame| frame.0 != Status::Lost), "{frames:?}");
    assert!(frames.iter().all(|frame| frame.1 < MAX_ERROR && frame.2 < MAX_ROTATION_ERROR), "{frames:?}");
    let num_good = frames.iter().filter(|frame| frame.0 == Status::Good).count();
    assert!(num_good >= 16, "{num_good} good: {frames:?}");
}

/// Where it is carried fast, noise makes frames doubtful. Those after them are not, for the camera cannot have come far.
#[test]
fn doubtful_frames_of_a_stereo_camera_that_is_carried_fast_leave_most_others_good() {
    let frames = frames_of_stereo_camera_in_hand(2, (0.08, 8.0), 90);
    let count = |status: Status| frames.iter().filter(|frame| frame.0 == status).count();
    assert_eq!(count(Status::Lost), 0, "{frames:?}");
    assert!(frames.iter().all(|frame| frame.0 != Status::Good || frame.1 < MAX_ERROR), "{frames:?}");
    assert!(count(Status::Good) >= 65, "{} good: {frames:?}", count(Status::Good));
}

/// The first frames of a stereo camera of 424 x 240 pixels that is carried through a flat by at most a step (m) and a turn
/// (degrees) from frame to frame.
fn frames_of_stereo_camera_in_hand(seed: u64, (step, turn): (f64, f64), num_frames: usize) -> Vec<(Status, f64, f64)> {
    let apartment = Apartment::generate(seed);
    let mut truth = hand_held(&apartment.walk(&WalkOptions::default()), step, turn.to_radians(), seed);
    truth.truncate(num_frames);
    let camera = Pinhole::new(424, 240, [212.0, 212.0, 212.0, 120.0]).unwrap();
    // Disparities in pixels of half the size.
    let whole = StereoCamera::default();
    let sensor = StereoCamera {
        step: whole.step / 2.0,
        patch_noise: whole.patch_noise / 2.0,
        pixel_noise: whole.pixel_noise / 2.0,
        bias: whole.bias / 2.0,
        ..whole
    };
    let frame = |index: usize, pose: &Pose3| {
        let last = &truth[index.saturating_sub(1)];
        (pgm(&sensor.measure(&apartment.space, pose, last, &camera, index as u64)), None)
    };
    reconstruct(&camera, &truth, frame)
}
