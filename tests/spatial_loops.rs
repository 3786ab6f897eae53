//! A way round a block, seen by a camera that is told a wrong focal length: what that adds up to is found where the way
//! closes, and spread over it.
#![cfg(not(target_arch = "wasm32"))] // a minute in a browser

use scanstitch::camera::{DepthImage, Pinhole};
use scanstitch::geometry::{Pose3, RigidMotion};
use scanstitch::prepared_frame::{FrameLabel, PreparedFrame};
use scanstitch::report::Stage;
use scanstitch::scene::random::Random;
use scanstitch::scene::ring::Ring;
use scanstitch::scene::space::DepthSensor;
use scanstitch::spatial_reconstruction::SpatialReconstruction;
use scanstitch::spatial_settings::{LoopClosing, SpatialSettings};

const SIDE: usize = 256;
/// The focal length that is told over the true one.
const WRONG: f64 = 1.05;

fn pgm(image: &DepthImage) -> Vec<u8> {
    let mut bytes = format!("P5 {} {} 65535\n", image.width, image.height).into_bytes();
    bytes.extend(image.values.iter().flat_map(|value| value.to_be_bytes()));
    bytes
}

fn recording() -> (Vec<Pose3>, Vec<Vec<u8>>) {
    let ring = Ring::generate(1);
    let camera = Pinhole::from_field_of_view(SIDE, SIDE, std::f64::consts::FRAC_PI_2).unwrap();
    let walk = ring.walk(0.34, 12f64.to_radians(), 4.0);
    let sensor = DepthSensor::Millimetres { square_noise: 1e-3 };
    let image = |(index, pose): (u64, &Pose3)| {
        pgm(&sensor.measure(&ring.space.depth(pose, &camera), SIDE, &mut Random::new(index)))
    };
    let images = (0..).zip(&walk).map(image).collect();
    (walk, images)
}

fn reconstruct(images: &[Vec<u8>], loop_closing: LoopClosing) -> SpatialReconstruction {
    let f = WRONG * SIDE as f64 / 2.0;
    let c = SIDE as f64 / 2.0;
    let settings = SpatialSettings { fx: f, cx: c, cy: c, loop_closing, ..SpatialSettings::default() };
    let mut reconstruction = SpatialReconstruction::new(settings).unwrap();
    for (index, bytes) in images.iter().enumerate() {
        let label = FrameLabel { name: format!("{index}.pgm"), index, time: None };
        let preparation = reconstruction.begin(&label.name, bytes).unwrap();
        let frame = PreparedFrame::from_depth(preparation, label, bytes, None).unwrap();
        reconstruction.add(frame).unwrap();
        while reconstruction.step().stage != Stage::Done {}
    }
    reconstruction.finish();
    while reconstruction.step().stage != Stage::Done {}
    reconstruction
}

/// The mean distance from the truth, and the largest error of a step (m), first poses made equal.
fn errors(poses: &[Pose3], truth: &[Pose3]) -> (f64, f64) {
    let off = |(pose, true_pose): (&Pose3, &Pose3)| {
        (pose.translation.vector - (truth[0].inverse() * true_pose).translation.vector).norm()
    };
    let steps = (1..poses.len()).map(|index| {
        let step = poses[index - 1].inverse() * poses[index];
        ((truth[index - 1].inverse() * truth[index]).inverse() * step).translation_norm()
    });
    (poses.iter().zip(truth).map(off).sum::<f64>() / poses.len() as f64, steps.fold(0.0, f64::max))
}

#[test]
fn what_a_way_round_adds_up_is_spread_over_it_and_told() {
    let (truth, images) = recording();
    let [open, closed] = [LoopClosing::Off, LoopClosing::On].map(|closing| reconstruct(&images, closing));
    let [before, after] = [&open, &closed].map(|run| errors(&run.poses(), &truth));
    assert!(after.0 < 0.8 * before.0, "mean error {} m, {} m before", after.0, before.0);
    assert!(after.1 < 0.7 * before.1, "largest step off {} m, {} m before", after.1, before.1);
    assert_eq!((open.loop_report().num_closed, open.loop_report().note()), (0, None));
    let result = closed.result();
    assert!(result.loops.num_closed >= 1 && result.loops.farthest_move > 0.05, "{:?}", result.loops);
    let told = |note: &String| note.contains("spread over the way round");
    assert!(result.notes.iter().any(told) && !open.result().notes.iter().any(told));
}
