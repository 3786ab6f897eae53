//! Colours in the estimate of depth images: they help where they fit, and do no harm where they do not.

use std::path::Path;

use crate::common::shared_data;
use nalgebra::{UnitQuaternion, Vector3};
use scanstitch::geometry::Pose3;
use scanstitch::io::{color_image, trajectory};
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::depth::DepthOdometry;
use scanstitch::pipeline::prepared_frame::{ColorFile, DecodeConfig, FrameLabel, PreparedFrame, Surfaces};
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::spatial::SpatialReconstruction;
use scanstitch::pipeline::spatial_settings::{ColorUse, SpatialSettings};

/// Depth images, colour images as pixmaps, and where they were taken.
struct Recording {
    depth: Vec<Vec<u8>>,
    color: Vec<Vec<u8>>,
    truth: Vec<Pose3>,
}

/// The first frames of the sample that is shipped.
fn sample(num_frames: usize) -> Recording {
    let folder = Path::new("www/samples/apartment");
    let read = |name: String| std::fs::read(folder.join(name)).unwrap();
    let truth = trajectory::read(&read("GT_pose.npy".into())).unwrap();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    Recording {
        depth: (1..=num_frames).map(|number| read(format!("depth/{number}.png"))).collect(),
        color: (1..=num_frames).map(|number| pixmap(&read(format!("rgb/{number}.jpg")), |value| value)).collect(),
        truth: truth.poses().unwrap().iter().take(num_frames).map(|pose| pose * turn).collect(),
    }
}

/// A colour image as a PPM, every channel changed.
fn pixmap(image: &[u8], change: impl Fn(f64) -> f64) -> Vec<u8> {
    let image = color_image::read(image).unwrap();
    let mut bytes = format!("P6 {} {} 255\n", image.width, image.height).into_bytes();
    bytes.extend(image.pixels.iter().flatten().map(|&channel| change(f64::from(channel)).round() as u8));
    bytes
}

fn run(recording: &Recording, color: ColorUse, image_of: impl Fn(usize) -> Option<Vec<u8>>) -> Vec<(Pose3, Status)> {
    let mut reconstruction =
        SpatialReconstruction::new(SpatialSettings { color, ..SpatialSettings::default() }).unwrap();
    for (index, bytes) in recording.depth.iter().enumerate() {
        let decode_config = reconstruction.begin("frame.png", bytes).unwrap();
        let label = FrameLabel { name: format!("{index}.png"), index, time: None };
        let color = image_of(index);
        let color = color.as_deref().map(|bytes| ColorFile { name: "frame.jpg", bytes: Ok(bytes) });
        let frame = PreparedFrame::from_depth(decode_config, label, bytes, color).unwrap();
        reconstruction.add(frame).unwrap();
        while reconstruction.step().stage != Stage::Done {}
    }
    let assessments = reconstruction.assessments();
    let status = assessments.iter().map(|assessment| assessment.status);
    reconstruction.poses().into_iter().zip(status).collect()
}

/// Mean distance from the truth (m), first poses made equal.
fn error(found: &[(Pose3, Status)], truth: &[Pose3]) -> f64 {
    let off = |(pose, truth_pose): (&Pose3, &Pose3)| {
        (pose.translation.vector - (truth[0].inverse() * truth_pose).translation.vector).norm()
    };
    found.iter().map(|(pose, _)| pose).zip(truth).map(off).sum::<f64>() / truth.len() as f64
}

fn num_good(found: &[(Pose3, Status)]) -> usize {
    found.iter().filter(|(_, status)| *status == Status::Good).count()
}

#[test]
fn light_that_changes_and_frames_without_colours_do_no_harm() {
    let recording = sample(16);
    let without = run(&recording, ColorUse::Used, |_| None);
    let apart = error(&without, &recording.truth);
    // Not used, they are not looked at: the same to the last bit.
    assert_eq!(run(&recording, ColorUse::NotUsed, |index| Some(recording.color[index].clone())), without);

    let with_light = |gain: &dyn Fn(usize) -> f64| {
        run(&recording, ColorUse::Used, |index| {
            Some(pixmap(&recording.color[index], |value| (gain(index) * value).min(255.0)))
        })
    };
    let used = with_light(&|_| 1.0);
    assert_ne!(used, without, "colours are used");
    let flicker = [1.0, 0.7, 0.9, 0.55, 1.1, 0.8, 0.6];
    let cases = [
        ("as recorded", used),
        ("darker from the middle on", with_light(&|index| if index < 8 { 1.0 } else { 0.6 })),
        ("flickering", with_light(&|index| flicker[index % flicker.len()])),
        (
            "every third without colours",
            run(&recording, ColorUse::Used, |index| (index % 3 != 1).then(|| recording.color[index].clone())),
        ),
    ];
    for (name, found) in cases {
        let error = error(&found, &recording.truth);
        eprintln!("{name}: {:.1} mm, {:.1} mm without colours", 1000.0 * error, 1000.0 * apart);
        assert!(error < 1.1 * apart + 0.5e-3, "{name}: {error} m, {apart} m without colours");
        assert!(num_good(&found) >= num_good(&without), "{name}");
    }
}

#[test]
fn images_that_say_nothing_or_something_else_change_nothing_for_the_worse() {
    let recording = sample(10);
    let without = run(&recording, ColorUse::Used, |_| None);
    let grey = |index: usize| Some(pixmap(&recording.color[index], |_| 127.0));
    assert_eq!(run(&recording, ColorUse::Used, grey), without, "grey images are no images");
    // Those of another part of the walk, backwards.
    let foreign = run(&recording, ColorUse::Used, |index| Some(recording.color[9 - index].clone()));
    let (error, apart) = (error(&foreign, &recording.truth), error(&without, &recording.truth));
    assert!(error < apart + 2e-3, "{error} m, {apart} m without colours");
    assert_eq!(num_good(&foreign), num_good(&without));
}

#[test]
fn brightness_travels_with_the_frame() {
    let recording = sample(1);
    let settings = SpatialSettings::default();
    let decode_config = DecodeConfig::new(&settings, "0.png", &recording.depth[0]).unwrap();
    let frame = |color: Option<&[u8]>| {
        let label = FrameLabel { name: "0.png".into(), index: 0, time: None };
        PreparedFrame::from_depth(
            &decode_config,
            label,
            &recording.depth[0],
            color.map(|bytes| ColorFile { name: "0.jpg", bytes: Ok(bytes) }),
        )
        .unwrap()
    };
    let colored = frame(Some(&recording.color[0]));
    let Surfaces::Surfels(images) = &colored.surfaces else { panic!("a depth image") };
    assert!(images.iter().all(|(_, surfels)| surfels.image.brightness.is_some()));
    let bytes = colored.to_bytes();
    assert_eq!(PreparedFrame::from_bytes(&bytes).unwrap(), colored);
    for cut in (0..bytes.len()).step_by(bytes.len() / 50) {
        assert!(PreparedFrame::from_bytes(&bytes[..cut]).is_err(), "{cut}");
    }
    let Surfaces::Surfels(images) = frame(None).surfaces else { panic!("a depth image") };
    assert!(images.iter().all(|(_, surfels)| surfels.image.brightness.is_none()));
    // One frame alone is the beginning, whatever its colours.
    let mut odometry = DepthOdometry::new(settings.depth_options());
    assert_eq!(odometry.register_frame(&images[0].1).T_world_sensor, Pose3::identity());
}

/// Depth alone reaches 11.9 mm, colours with it 4.7 mm.
#[test]
fn a_real_recording_is_nearer_to_the_truth_with_colours() {
    let Some(folder) = shared_data("rgbd/apartment_second_floor") else { return };
    let truth = trajectory::read(&std::fs::read(folder.join("GT_pose.npy")).unwrap()).unwrap();
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let truth: Vec<Pose3> = truth.poses().unwrap().iter().map(|pose| pose * turn).collect();
    let read = |kind: &str, index: usize| std::fs::read(folder.join(format!("{kind}/{}.png", index + 1))).unwrap();
    let depth = (0..truth.len()).map(|index| read("depth", index)).collect();
    let recording = Recording { depth, color: Vec::new(), truth };
    let found = run(&recording, ColorUse::Used, |index| Some(read("rgb", index)));
    let error = error(&found, &recording.truth);
    assert!(error < 0.008, "{error} m");
    assert_eq!(num_good(&found), recording.truth.len());
}
