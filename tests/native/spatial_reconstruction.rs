//! Depth images to a trajectory: real recordings against their truth, and frames that are not what they should be.

use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};

use crate::common::{apartment_truth, numbers, pose_of, shared_data};
use scanstitch::camera::Pinhole;
use scanstitch::geometry::Pose3;
use scanstitch::io::trajectory::Trajectory;
use scanstitch::io::{depth_image, intrinsics, trajectory};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::prepared_frame::{ColorFile, DecodeConfig, FrameLabel, MapPoints, PreparedFrame, Surfaces};
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::spatial::SpatialReconstruction;
use scanstitch::pipeline::spatial_settings::{ColorUse, Method, Quantisation, ReferenceAxes, SpatialSettings};
use scanstitch_scene::apartment::{Apartment, WalkOptions};
use scanstitch_scene::random::Random;
use scanstitch_scene::space::DepthSensor;

const FUSION_DEMO: [f64; 4] = [585.0, 585.0, 320.0, 240.0];
const REDWOOD: [f64; 4] = [525.0, 525.0, 319.5, 239.5];

/// Files of a folder whose names end so, by the number in their names.
fn numbered(folder: &Path, suffix: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = entries.filter(|path| path.to_str().unwrap().ends_with(suffix)).collect();
    files.sort_by_key(|path| {
        let name = path.file_name().unwrap().to_str().unwrap();
        name.chars().filter(char::is_ascii_digit).collect::<String>().parse::<u64>().unwrap()
    });
    files
}

fn files(folder: &Path, suffix: &str) -> Vec<Vec<u8>> {
    numbered(folder, suffix).iter().map(|path| std::fs::read(path).unwrap()).collect()
}

fn with_camera(intrinsics: Option<[f64; 4]>) -> SpatialSettings {
    let [fx, fy, cx, cy] = intrinsics.unwrap_or_default();
    SpatialSettings { fx, fy, cx, cy, ..SpatialSettings::default() }
}

fn run(files: &[Vec<u8>], intrinsics: Option<[f64; 4]>) -> SpatialReconstruction {
    run_with(with_camera(intrinsics), files)
}

fn run_with(settings: SpatialSettings, files: &[Vec<u8>]) -> SpatialReconstruction {
    let mut reconstruction = SpatialReconstruction::new(settings).unwrap();
    add(&mut reconstruction, 0, files);
    reconstruction.finish();
    while reconstruction.step().stage != Stage::Done {}
    reconstruction
}

/// Adds depth images, the first of which is the `first` of the recording, and registers them.
fn add(reconstruction: &mut SpatialReconstruction, first: usize, files: &[Vec<u8>]) {
    for (index, bytes) in (first..).zip(files) {
        let name = format!("{index}.png");
        let decode_config = reconstruction.begin(&name, bytes).unwrap();
        let frame = PreparedFrame::from_depth(decode_config, FrameLabel { name, index, time: None }, bytes, None);
        reconstruction.add(frame.unwrap()).unwrap();
        while reconstruction.step().stage != Stage::Done {}
    }
}

/// Mean distance (m), first poses made equal; and the largest step that is off, in m and rad.
fn errors(poses: &[Pose3], truth: &[Pose3]) -> (f64, f64, f64) {
    assert_eq!(poses.len(), truth.len());
    let moved = |index: usize| truth[0].inverse() * truth[index];
    let distance = |index: usize| (poses[index].translation.vector - moved(index).translation.vector).norm();
    let mean = (0..poses.len()).map(distance).sum::<f64>() / poses.len() as f64;
    let (mut translation, mut rotation) = (0.0f64, 0.0f64);
    for (pose, true_pose) in poses.windows(2).zip(truth.windows(2)) {
        let off = (true_pose[0].inverse() * true_pose[1]).inverse() * (pose[0].inverse() * pose[1]);
        translation = translation.max(off.translation.vector.norm());
        rotation = rotation.max(off.rotation.angle());
    }
    (mean, translation, rotation)
}

fn every<T: Clone>(stride: usize, all: &[T]) -> Vec<T> {
    all.iter().step_by(stride).cloned().collect()
}

/// The project asks for 0.06 and 0.08 m; what is reached is 0.0067 and 0.0119 m, and must not get lost again.
#[test]
fn both_floors_are_within_two_centimetres_of_the_truth() {
    let Some(folder) = shared_data("rgbd") else { return };
    for (name, bar) in [("apartment_first_floor", 0.012), ("apartment_second_floor", 0.016)] {
        let folder = folder.join(name);
        let run = run(&files(&folder.join("depth"), ".png"), None);
        let (mean, translation, rotation) = errors(&run.poses(), &apartment_truth(&folder));
        assert!(mean < bar, "{name}: {mean}");
        assert!(translation < 0.02 && rotation.to_degrees() < 0.5, "{name}: {translation} m, {rotation} rad");
        assert_eq!(run.quantisation(), Some(Quantisation::Truncated), "{name}");
        assert!(run.assessments().iter().all(|assessment| assessment.status == Status::Good), "{name}");
    }
}

/// Half-metre steps and 20 degree turns, then three quarters and 30, then a metre and 40.
#[test]
fn left_out_frames_are_bridged() {
    let Some(folder) = shared_data("rgbd") else { return };
    for name in ["apartment_first_floor", "apartment_second_floor"] {
        let folder = folder.join(name);
        let (all, truth) = (files(&folder.join("depth"), ".png"), apartment_truth(&folder));
        for stride in [2, 3, 4] {
            let run = run(&every(stride, &all), None);
            let (mean, translation, _) = errors(&run.poses(), &every(stride, &truth));
            assert!(mean < 0.04 && translation < 0.05, "{name}, every {stride}: {mean}, {translation}");
        }
    }
}

#[test]
fn hand_held_recordings_are_within_a_centimetre() {
    let Some(folder) = shared_data("rgbd") else { return };
    let frames = folder.join("fusion_demo50/rgbd-frames");
    let truth: Vec<Pose3> = numbered(&frames, ".pose.txt").iter().map(|path| pose_of(&numbers(path))).collect();
    let (mean, ..) = errors(&run(&files(&frames, ".depth.png"), Some(FUSION_DEMO)).poses(), &truth);
    assert!(mean < 0.012, "fusion_demo50: {mean}");

    let folder = folder.join("redwood5");
    let truth: Vec<Pose3> =
        numbers(&folder.join("odometry.log")).chunks_exact(19).map(|pose| pose_of(&pose[3..])).collect();
    let (mean, ..) = errors(&run(&files(&folder.join("depth"), ".png"), Some(REDWOOD)).poses(), &truth);
    assert!(mean < 0.006, "redwood5: {mean}");
}

/// The last half of a noisy stereo camera's drive, and every fourth frame of all of it, forwards and backwards. No more than 0.55 to
/// 0.9 of this camera's surface faces as the map's does, wherever it stands.
#[test]
fn a_noisy_stereo_camera_is_tracked_and_good() {
    let Some(folder) = shared_data("rgbd/d435_robot") else { return };
    let camera = Some([384.0, 384.0, 320.0, 237.0]);
    let all = files(&folder.join("depth"), ".png");
    let count = |files: &[Vec<u8>], status: Status| {
        run(files, camera).assessments().iter().filter(|assessment| assessment.status == status).count()
    };
    let last_half = &all[60..];
    assert!(count(last_half, Status::Good) >= 57, "a right frame is doubted for the errors of the map's surfaces");
    assert_eq!(count(&every(4, &all), Status::Lost), 0, "turning faster after a doubtful frame");
    let backwards: Vec<Vec<u8>> = every(4, &all).into_iter().rev().collect();
    assert!(count(&backwards, Status::Good) >= 29, "a small overlap is much of what this camera's frames can have");
}

/// Every second frame of a Kinect's drive backwards: the third is rejected, though it lies near the second, and begins a chain that
/// becomes the longer one. The first two keep their rough places, within a decimetre of where the whole drive has them.
#[test]
fn frames_of_a_replaced_chain_are_doubtful_where_its_successor_began_near_them() {
    let Some(folder) = shared_data("rgbd/kinect_pioneer") else { return };
    let run = |files: &[Vec<u8>]| {
        let camera = with_camera(Some([521.0, 521.0, 325.0, 249.0]));
        run_with(SpatialSettings { depth_scale: 5000.0, ..camera }, files)
    };
    let all = files(&folder.join("depth"), ".png");
    let backwards: Vec<Vec<u8>> = every(2, &all).into_iter().rev().take(10).collect();
    let result = run(&backwards);
    let statuses: Vec<Status> = result.assessments().iter().map(|assessment| assessment.status).collect();
    assert_eq!(statuses[..2], [Status::Doubtful; 2], "{statuses:?}");
    assert_eq!(statuses[2..], [Status::Good; 8], "{statuses:?}");
    // Frames 48 - 2 n of 50; the whole run begins with frame 34.
    let whole = run(&all[34..]);
    let (poses, whole) = (result.poses(), whole.poses());
    for index in 0..2 {
        let error = (poses[2].inverse() * poses[index]).inverse() * (whole[10].inverse() * whole[14 - 2 * index]);
        assert!(error.translation.vector.norm() < 0.1, "{index}: {error}");
    }
}

/// Every fifth frame of a noisy stereo camera's drive backwards: in steps of half a metre it is followed, to a decimetre of what the
/// whole drive says of each.
#[test]
fn a_noisy_stereo_camera_is_followed_in_steps_of_half_a_metre() {
    let Some(folder) = shared_data("rgbd/d435_robot") else { return };
    let camera = Some([384.0, 384.0, 320.0, 237.0]);
    let all = files(&folder.join("depth"), ".png");
    let backwards: Vec<Vec<u8>> = every(5, &all).into_iter().rev().take(14).collect();
    let result = run(&backwards, camera);
    let assessments = result.assessments();
    assert!(assessments.iter().all(|assessment| assessment.status == Status::Good), "{assessments:?}");
    let whole = run(&all[50..], camera);
    let (poses, whole) = (result.poses(), whole.poses());
    for index in 0..13 {
        // Frames 115 - 5 n of 120; the whole run begins with frame 50.
        let frame = 65 - 5 * index;
        let step = poses[index + 1].inverse() * poses[index];
        let error = step.inverse() * (whole[frame - 5].inverse() * whole[frame]);
        assert!(error.translation.vector.norm() < 0.1, "{index}: {error}");
    }
}

/// Steps of 39 mm made steps of 78 mm in both ways: which one it was is told from the frames alone.
#[test]
fn truncated_and_rounded_depth_are_distinguished() {
    let Some(folder) = shared_data("rgbd") else { return };
    let mut frames = files(&folder.join("apartment_first_floor/depth"), ".png");
    frames.truncate(16);
    for (quantisation, halved) in [
        (Quantisation::Truncated, (|value| value / 2) as fn(u16) -> u16),
        (Quantisation::Rounded, |value| value.div_ceil(2)), // of value + 0.5
    ] {
        let settings = SpatialSettings { depth_scale: 255.0 / 10.0 / 2.0, ..SpatialSettings::default() };
        let frames: Vec<Vec<u8>> = frames.iter().map(|bytes| coarser(bytes, halved)).collect();
        assert_eq!(run_with(settings, &frames).quantisation(), Some(quantisation));
    }
}

fn coarser(bytes: &[u8], halved: impl Fn(u16) -> u16) -> Vec<u8> {
    let image = depth_image::read(bytes).unwrap();
    let mut bytes = format!("P5 {} {} 255\n", image.width, image.height).into_bytes();
    bytes.extend(image.values.iter().map(|&value| halved(value) as u8));
    bytes
}

/// A frame of the other floor, a blank wall and a repeated frame among good ones: the bad are called so, the rest holds.
#[test]
fn frames_that_do_not_belong_are_lost_and_the_rest_holds() {
    let Some(folder) = shared_data("rgbd") else { return };
    let (first, second) = (folder.join("apartment_first_floor"), folder.join("apartment_second_floor"));
    let (mut frames, mut truth) = (files(&first.join("depth"), ".png"), apartment_truth(&first));
    frames.truncate(24);
    truth.truncate(24);
    frames[5] = std::fs::read(second.join("depth/60.png")).unwrap();
    frames[11] = [b"P5 512 512 255\n".as_slice(), &vec![0u8; 512 * 512 - 1], &[9]].concat();
    frames[17] = frames[16].clone();
    truth[17] = truth[16];
    let run = run(&frames, None);
    let status: Vec<Status> = run.assessments().iter().map(|assessment| assessment.status).collect();
    for (index, status) in status.iter().enumerate() {
        let belongs = index != 5 && index != 11;
        assert_eq!(*status == Status::Good, belongs, "{index}: {status:?}");
    }
    assert!(!run.assessments()[11].reason.is_empty());
    let keep = |index: &usize| ![5, 11].contains(index);
    assert_eq!(run.quantisation(), Some(Quantisation::Truncated));
    let poses = run.poses();
    let poses: Vec<Pose3> = (0..24).filter(keep).map(|index| poses[index]).collect();
    let truth: Vec<Pose3> = (0..24).filter(keep).map(|index| truth[index]).collect();
    let (mean, ..) = errors(&poses, &truth);
    assert!(mean < 0.02, "{mean}");
}

/// A walk whose parts are in another order: every good frame is right, and most frames are good.
#[test]
fn frames_in_a_wrong_order_are_found_again() {
    let Some(folder) = shared_data("rgbd") else { return };
    let folder = folder.join("apartment_first_floor");
    let (all, truth) = (files(&folder.join("depth"), ".png"), apartment_truth(&folder));
    let order: Vec<usize> = (0..24).chain([3, 17, 8]).chain((0..6).rev()).collect();
    let frames: Vec<Vec<u8>> = order.iter().map(|&index| all[index].clone()).collect();
    let truth: Vec<Pose3> = order.iter().map(|&index| truth[index]).collect();
    good_frames_are_right("a wrong order", &run(&frames, None), &truth, &[]);
}

/// Every second frame, so half-metre steps, of which twelve come backwards: the way from the last frame before them to their first
/// one shows nothing of what was seen, but the way back does.
#[test]
fn a_block_in_reverse_order_is_found_from_its_end() {
    let Some(folder) = shared_data("rgbd") else { return };
    let folder = folder.join("apartment_first_floor");
    let (all, truth) = (every(2, &files(&folder.join("depth"), ".png")), every(2, &apartment_truth(&folder)));
    let order: Vec<usize> = (0..20).chain((20..32).rev()).chain(32..36).collect();
    let frames: Vec<Vec<u8>> = order.iter().map(|&index| all[index].clone()).collect();
    let truth: Vec<Pose3> = order.iter().map(|&index| truth[index]).collect();
    good_frames_are_right("a block reversed", &run(&frames, None), &truth, &[]);
}

/// Steps of more than a metre, rotations of 50 degrees: good frames are right, and most are good.
#[test]
fn every_fifth_frame_is_enough() {
    let Some(folder) = shared_data("rgbd") else { return };
    for name in ["apartment_first_floor", "apartment_second_floor"] {
        let folder = folder.join(name);
        let run = run(&every(5, &files(&folder.join("depth"), ".png")), None);
        good_frames_are_right(name, &run, &every(5, &apartment_truth(&folder)), &[]);
    }
}

/// A recording that begins with frames of the other floor, or has some in between, is that of the floor that most are of.
#[test]
fn frames_swapped_between_the_floors_are_not_good() {
    let Some(folder) = shared_data("rgbd") else { return };
    let first = folder.join("apartment_first_floor");
    let (all, truth) = (files(&first.join("depth"), ".png"), apartment_truth(&first));
    let others = files(&folder.join("apartment_second_floor").join("depth"), ".png");
    for strangers in [&[0][..], &[0, 1, 2], &[6, 13, 20]] {
        let (mut frames, truth) = (all[..24].to_vec(), &truth[..24]);
        for &index in strangers {
            frames[index] = others[index + 30].clone();
        }
        good_frames_are_right("the first floor", &run(&frames, None), truth, strangers);
    }
}

/// The depth of a walk's frames in a generated flat, 256 pixels wide, and where they were taken.
fn generated_walk(seed: u64) -> (Vec<Vec<u8>>, Vec<Pose3>) {
    let camera = Pinhole::from_field_of_view(256, 256, FRAC_PI_2).unwrap();
    let apartment = Apartment::generate(seed);
    let walk = apartment.walk(&WalkOptions { num_frames: Some(24), ..WalkOptions::default() });
    let frame = |pose: &Pose3| {
        let depth = apartment.space.depth(pose, &camera);
        let image = DepthSensor::HOMEWORK.measure(&depth, camera.width, &mut Random::new(seed));
        let mut bytes = b"P5 256 256 255\n".to_vec();
        bytes.extend(image.values.iter().map(|&value| value as u8));
        bytes
    };
    (walk.iter().map(frame).collect(), walk)
}

/// The frames in 16 bits, each depth made by `value` of its own and the largest of its image.
fn in_16_bits(frames: &[Vec<u8>], value: impl Fn(u16, u16) -> u16) -> Vec<Vec<u8>> {
    let frame = |bytes: &Vec<u8>| {
        let values = &bytes[b"P5 256 256 255\n".len()..];
        let largest = values.iter().copied().max().map_or(1, u16::from);
        let values = values.iter().flat_map(|&depth| value(u16::from(depth), largest).to_be_bytes());
        b"P5 256 256 65535\n".iter().copied().chain(values).collect()
    };
    frames.iter().map(frame).collect()
}

#[test]
fn bytes_in_the_wrong_order_are_read_rightly_and_that_is_said() {
    let frames = generated_walk(4).0[..3].to_vec();
    let millimetres = |depth: u16| (f64::from(depth) * 10_000.0 / 255.0) as u16;
    let right = run(&in_16_bits(&frames, |depth, _| millimetres(depth)), None);
    let swapped = run(&in_16_bits(&frames, |depth, _| millimetres(depth).swap_bytes()), None);
    assert_eq!(swapped.poses(), right.poses());
    let is_said = |run: &SpatialReconstruction| run.result().notes.iter().any(|note| note.contains("wrong order"));
    assert!(is_said(&swapped) && !is_said(&right));
}

#[test]
fn images_that_are_each_stretched_to_the_full_range_are_not_good() {
    let frames = generated_walk(4).0[..4].to_vec();
    let num_good = |run: &SpatialReconstruction| {
        run.assessments().iter().filter(|assessment| assessment.status == Status::Good).count()
    };
    let stretch = |depth: u16, largest: u16| (u32::from(depth) * 65_535 / u32::from(largest)) as u16;
    let stretched = run(&in_16_bits(&frames, stretch), None);
    assert!(num_good(&stretched) <= 1, "{}", num_good(&stretched));
    assert!(stretched.result().notes.iter().any(|note| note.contains("stretched")), "{:?}", stretched.result().notes);
    let right = run(&frames, None);
    assert!(num_good(&right) > 1, "{}", num_good(&right));
    assert!(!right.result().notes.iter().any(|note| note.contains("stretched")), "{:?}", right.result().notes);
}

/// Of a real camera, where single images do not tell.
#[test]
fn images_of_lengths_of_rays_or_cut_off_depth_are_not_good() {
    let Some(folder) = shared_data("rgbd") else { return };
    let all = files(&folder.join("fusion_demo50/rgbd-frames"), ".depth.png");
    let [fx, fy, cx, cy] = FUSION_DEMO;
    let run_of = |value: &dyn Fn(f64, f64) -> f64, max_range: f64, step: usize| {
        let frame = |bytes: &Vec<u8>| {
            let image = depth_image::read(bytes).unwrap();
            let of_pixel = |(pixel, &depth): (usize, &u16)| {
                let (x, y) = (((pixel % 640) as f64 - cx) / fx, ((pixel / 640) as f64 - cy) / fy);
                (value(f64::from(depth), (1.0 + x * x + y * y).sqrt()) as u16).to_be_bytes()
            };
            let values = image.values.iter().enumerate().flat_map(of_pixel);
            b"P5 640 480 65535\n".iter().copied().chain(values).collect()
        };
        let frames: Vec<Vec<u8>> = every(step, &all).iter().map(frame).collect();
        let run = run_with(SpatialSettings { max_range, ..with_camera(Some(FUSION_DEMO)) }, &frames);
        let num_good = run.assessments().iter().filter(|assessment| assessment.status == Status::Good).count();
        (num_good, run.result().notes.join(" "))
    };
    let (right, notes) = run_of(&|depth, _| depth, 0.0, 4);
    assert!(
        right > 10 && !notes.contains("values of the depth images") && !notes.contains("cut off"),
        "{right}, {notes}"
    );
    let (of_rays, notes) = run_of(&|depth, length| (depth * length).round(), 0.0, 4);
    assert!(of_rays <= 1 && notes.contains("lengths of rays"), "{of_rays}, {notes}");
    // A false wall holds the camera still where it has hardly moved.
    for step in [1, 4] {
        let (cut_off, notes) = run_of(&|depth, _| depth.min(2000.0), 0.0, step);
        assert!(cut_off <= 1 && notes.contains("max_range=1.999"), "{cut_off}, {notes}");
    }
    let (used, notes) = run_of(&|depth, _| depth.min(2000.0), 1.999, 4);
    assert!(used > 1 && !notes.contains("cut off"), "the remedy: {used}, {notes}");
}

/// A frame of another flat, a blank and a repeated one.
#[test]
fn frames_of_another_flat_are_not_good() {
    let (others, _) = generated_walk(9);
    for (seed, strangers) in [(4, &[6][..])] {
        let (mut frames, mut truth) = generated_walk(seed);
        for &index in strangers {
            frames[index] = others[index + 6].clone();
        }
        frames[15] = [b"P5 256 256 255\n".as_slice(), &vec![0u8; 256 * 256 - 1], &[9]].concat();
        frames[19] = frames[18].clone();
        truth[19] = truth[18];
        let strangers = [strangers, &[15]].concat();
        let num_good = count_good_frames(&format!("flat {seed}"), &run(&frames, None), &truth, &strangers);
        assert!(2 * num_good >= truth.len(), "flat {seed}: {num_good} of {}", truth.len());
    }
}

/// All good frames are right, no stranger is good, and at least four in five of the other frames are good.
fn good_frames_are_right(name: &str, run: &SpatialReconstruction, truth: &[Pose3], strangers: &[usize]) {
    let num_good = count_good_frames(name, run, truth, strangers);
    let num_belonging = truth.len() - strangers.len();
    assert!(5 * num_good >= 4 * num_belonging, "{name}: {num_good} of {num_belonging}");
}

/// All good frames are right, no stranger is good, and all other frames have a reason. Returns the number of good frames.
fn count_good_frames(name: &str, run: &SpatialReconstruction, truth: &[Pose3], strangers: &[usize]) -> usize {
    let (poses, assessments) = (run.poses(), run.assessments());
    let good: Vec<usize> = (0..poses.len()).filter(|&index| assessments[index].status == Status::Good).collect();
    for &index in &good {
        assert!(!strangers.contains(&index), "{name}: {index} belongs elsewhere");
        let moved = poses[good[0]].inverse() * poses[index];
        let off = (truth[good[0]].inverse() * truth[index]).inverse() * moved;
        let (moved, turned) = (off.translation.vector.norm(), off.rotation.angle().to_degrees());
        assert!(moved < 0.06 && turned < 1.0, "{name}, {index}: {moved} m, {turned} degrees");
    }
    for (index, assessment) in assessments.iter().enumerate() {
        assert_eq!(assessment.reason.is_empty(), good.contains(&index), "{name}, {index}");
    }
    good.len()
}

#[test]
fn frames_can_be_added_to_a_finished_run_and_travel_as_bytes() {
    let Some(folder) = shared_data("rgbd") else { return };
    let frames = files(&folder.join("redwood5/depth"), ".png");
    // Colours colour the map, here, and nothing else: the first frames have none.
    let settings = SpatialSettings { color: ColorUse::NotUsed, ..with_camera(Some(REDWOOD)) };
    let mut whole = run_with(settings.clone(), &frames);
    let mut parts = run_with(settings, &frames[..3]);
    assert!(!parts.map().is_empty());
    for (index, bytes) in frames.iter().enumerate().skip(3) {
        let decode_config = parts.begin("later.png", bytes).unwrap();
        let label = FrameLabel { name: "later.png".into(), index, time: Some(0.5) };
        let colors = std::fs::read(folder.join(format!("redwood5/color/{index:05}.jpg"))).unwrap();
        let frame = PreparedFrame::from_depth(
            decode_config,
            label,
            bytes,
            Some(ColorFile { name: "later.jpg", bytes: Ok(&colors) }),
        )
        .unwrap();
        assert_eq!(frame.notes, []);
        let as_bytes = frame.to_bytes();
        let back = PreparedFrame::from_bytes(&as_bytes).unwrap();
        assert_eq!(back, frame);
        for cut in [0, 7, 8, 100, as_bytes.len() / 2, as_bytes.len() - 1] {
            assert!(PreparedFrame::from_bytes(&as_bytes[..cut]).is_err(), "{cut}");
        }
        parts.add(back).unwrap();
        assert!(parts.add(frame).unwrap_err().to_string().contains("later.png"), "the same again");
    }
    parts.finish();
    while parts.step().stage != Stage::Done {}
    parts.finish();
    assert_eq!(parts.step().stage, Stage::Done, "said once more, nothing is left to do");
    assert_eq!(parts.poses(), whole.poses());
    assert_eq!(parts.result().frames[4].name, "later.png");
    let (stitched_in_parts, stitched) = (parts.map().cloud(), whole.map().cloud());
    assert_eq!(stitched_in_parts.positions, stitched.positions);
    assert!(stitched_in_parts.colors.is_some() && stitched.colors.is_none() && stitched.len() > 20_000);
    let sizes = whole.map_sizes(&[0.01, 0.02, 0.05, 0.1]);
    assert!(sizes.is_sorted_by(|finer, coarser| finer.num_points > 2 * coarser.num_points), "{sizes:?}");
    assert_eq!(sizes[1].num_points, stitched.len());
}

/// What is seen again and again must not be dragged along by those who see it.
/// Asked for early or late, stitched ahead or not: the map is that of the last poses.
#[test]
fn a_map_that_was_stitched_ahead_is_the_same() {
    let (files, _) = generated_walk(3);
    let files = &files[..24];
    let mut at_the_end = run(files, None);
    let mut ahead = SpatialReconstruction::new(SpatialSettings::default()).unwrap();
    for (index, file) in files.iter().enumerate() {
        add(&mut ahead, index, std::slice::from_ref(file));
        ahead.stitch_ahead();
        if index == 9 {
            assert!(!ahead.map().is_empty());
        }
    }
    ahead.finish();
    while ahead.step().stage != Stage::Done {}
    assert_eq!(ahead.poses(), at_the_end.poses());
    assert_eq!(ahead.map().frames(), at_the_end.map().frames());
    assert_eq!(ahead.map().cloud(), at_the_end.map().cloud());
}

#[test]
fn a_walk_to_and_fro_stays_in_its_map() {
    let Some(folder) = shared_data("rgbd") else { return };
    let folder = folder.join("apartment_first_floor");
    let (mut frames, mut truth) = (files(&folder.join("depth"), ".png"), apartment_truth(&folder));
    frames.extend(frames.clone().into_iter().rev());
    truth.extend(truth.clone().into_iter().rev());
    let (mean, translation, _) = errors(&run(&frames, None).poses(), &truth);
    assert!(mean < 0.02 && translation < 0.03, "{mean} {translation}");
}

/// The reference's conventions are told, and it changes nothing.
#[test]
fn the_reference_is_compared_under_any_convention_and_does_not_affect_the_estimate() {
    let Some(folder) = shared_data("rgbd") else { return };
    let folder = folder.join("apartment_first_floor");
    let mut frames = files(&folder.join("depth"), ".png");
    frames.truncate(20);
    let without = run(&frames, None);
    let mut with = SpatialReconstruction::new(SpatialSettings::default()).unwrap();
    let truth = trajectory::read_lenient(&std::fs::read(folder.join("GT_pose.npy")).unwrap(), None).unwrap();
    let mut twenty = truth.clone();
    twenty.trajectory = Trajectory::from_poses(&truth.trajectory.poses().unwrap()[..20]);
    let first_twenty = twenty.clone();
    with.set_reference("GT_pose.npy", twenty, 20);
    add(&mut with, 0, &frames);
    assert_eq!(with.poses(), without.poses());
    let comparison = with.result().comparison.unwrap();
    let (mean, ..) = errors(&with.poses(), &apartment_truth(&folder)[..20]);
    assert!((comparison.mean - mean).abs() < 1e-12 && comparison.num_matched == 20);
    assert!(comparison.convention.contains("qw qx qy qz") && comparison.convention.contains("looking along -z"));
    // Set by hand it is read so, for better or worse.
    let settings = SpatialSettings { reference_axes: ReferenceAxes::Opencv, ..SpatialSettings::default() };
    let mut set = SpatialReconstruction::new(settings).unwrap();
    set.set_reference("GT_pose.npy", first_twenty, 20);
    add(&mut set, 0, &frames);
    let read_so = set.result().comparison.unwrap();
    assert!(read_so.convention.contains("z forward") && read_so.mean > comparison.mean, "{}", read_so.convention);
    assert_eq!(set.poses(), without.poses());
    // That of the whole recording is compared by the numbers of the frames, ...
    let mut ten = truth.clone();
    ten.trajectory = Trajectory::from_poses(&truth.trajectory.poses().unwrap()[..10]);
    with.set_reference("GT_pose.npy", truth, 20);
    let whole = with.result().comparison.unwrap();
    assert!((whole.mean - mean).abs() < 1e-12 && whole.convention.ends_with("from 0"), "{}", whole.convention);
    // ... and one of fewer frames is refused.
    with.set_reference("GT_pose.npy", ten, 20);
    let result = with.result();
    assert_eq!(result.comparison, None);
    assert!(result.notes[0].starts_with("GT_pose.npy: The reference has 10 poses"), "{:?}", result.notes);
}

fn pgm(width: usize, height: usize, value: u8) -> Vec<u8> {
    [format!("P5 {width} {height} 255\n").as_bytes(), &vec![value; width * height]].concat()
}

#[test]
fn only_readings_that_are_open_are_prepared_and_the_map_is_given_the_same_points() {
    let settings = SpatialSettings::default();
    // A plane.
    let depths = (0..64 * 48).map(|i| (6000 / (120 - i % 64)) as u8).collect::<Vec<_>>();
    let image = [b"P5 64 48 255\n".as_slice(), &depths].concat();
    let mut decode_config = DecodeConfig::new(&settings, "0.pgm", &image).unwrap();
    let mut prepared = |decided| {
        decode_config.depth.as_mut().unwrap().decided = decided;
        let label = FrameLabel { name: "0.pgm".into(), index: 0, time: None };
        PreparedFrame::from_depth(&decode_config, label, &image, None).unwrap()
    };
    let quantisations = |frame: &PreparedFrame| match &frame.surfaces {
        Surfaces::Surfels(images) => images.iter().map(|&(quantisation, _)| quantisation).collect(),
        Surfaces::Cloud(_) => Vec::new(),
    };
    let (truncated, rounded) = (Quantisation::Truncated, Quantisation::Rounded);
    let open = prepared(None);
    assert_eq!(quantisations(&open), [truncated, rounded]);
    let decided = prepared(Some(truncated));
    assert_eq!(quantisations(&decided), [truncated]);
    assert_eq!(decided.map_points, open.map_points);
    // The points of the map are of the likeliest reading, whatever is decided.
    assert_eq!(prepared(Some(rounded)), open);
}

#[test]
fn bad_frames_and_settings_are_refused_with_the_reason() {
    let mut reconstruction = SpatialReconstruction::new(SpatialSettings::default()).unwrap();
    assert!(
        reconstruction.begin("0.png", &pgm(64, 48, 0)).unwrap_err().to_string().contains("0.png: All depths are zero")
    );
    let decode_config = reconstruction.begin("1.png", &pgm(64, 48, 50)).unwrap().clone();
    let prepare = |name: &str, bytes: &[u8], color: Option<&[u8]>| {
        let label = FrameLabel { name: name.into(), index: 0, time: None };
        let color = color.map(|bytes| ColorFile { name: "5.jpg", bytes: Ok(bytes) });
        PreparedFrame::from_depth(&decode_config, label, bytes, color)
    };
    let refused = |name, bytes: &[u8]| prepare(name, bytes, None).unwrap_err().to_string();
    assert!(refused("2.png", &pgm(48, 64, 50)).contains("2.png: The depth image has 48 x 64 pixels"));
    assert!(refused("3.png", &pgm(64, 48, 0)).contains("All depths are zero"));
    assert!(refused("4.png", b"nonsense").contains("4.png, byte 0"));
    let uncoloured = prepare("5.png", &pgm(64, 48, 50), Some(b"\xFF\xD8\xFFcut")).unwrap();
    assert!(
        uncoloured.notes[0].to_string().starts_with("5.png: its colours are left out: 5.jpg: The JPEG is broken"),
        "{:?}",
        uncoloured.notes
    );
    assert!(matches!(&uncoloured.map_points, MapPoints::Image(image, _) if image.colors.is_none()));
    let unread = ColorFile { name: "6.jpg", bytes: Err("6.jpg: permission denied") };
    let label = FrameLabel { name: "6.png".into(), index: 0, time: None };
    let uncoloured_too = PreparedFrame::from_depth(&decode_config, label, &pgm(64, 48, 50), Some(unread)).unwrap();
    assert_eq!(uncoloured_too.notes.len(), 1);
    assert_eq!(uncoloured_too.notes[0].to_string(), "6.png: its colours are left out: 6.jpg: permission denied");

    let settings = SpatialSettings { method: Method::CloudMap, ..SpatialSettings::default() };
    let mut by_clouds = SpatialReconstruction::new(settings).unwrap();
    by_clouds.begin("1.png", &pgm(64, 48, 50)).unwrap();
    let error = by_clouds.add(uncoloured_too.clone()).unwrap_err().to_string();
    assert!(error.starts_with("6.png: The frame was prepared for another method"), "{error}");
    assert_eq!(uncoloured_too.map_points, uncoloured.map_points);
    reconstruction.add(uncoloured).unwrap();
    assert_eq!(reconstruction.step().stage, Stage::Register);
    assert_eq!(reconstruction.step().stage, Stage::Done);
    assert!(reconstruction.set_intrinsics(intrinsics::read(b"525 525 319.5 239.5").unwrap()).is_err());

    let refused = |settings| SpatialReconstruction::new(settings).err().unwrap().to_string();
    assert!(
        refused(SpatialSettings { min_range: 5.0, max_range: 1.0, ..SpatialSettings::default() })
            .contains("min_range = 5")
    );
    assert!(refused(SpatialSettings { depth_scale: -1.0, ..SpatialSettings::default() }).contains("depth_scale"));
    assert!(refused(SpatialSettings { field_of_view: 3.2, ..SpatialSettings::default() }).contains("field_of_view"));
}
