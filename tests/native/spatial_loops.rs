//! A way round a block that has added up errors: they are found where it closes, and spread over it.

use nalgebra::{Vector3, Vector6};
use scanstitch::camera::{DepthImage, Pinhole};
use scanstitch::geometry::{Pose3, RigidMotion};
use scanstitch::graph::loops::spatial::SpatialLoops;
use scanstitch::odometry::assessment::Assessment;
use scanstitch::odometry::depth::SpatialEstimate;
use scanstitch::pipeline::prepared_frame::{DecodeConfig, FrameLabel, PreparedFrame, Surfaces};
use scanstitch::pipeline::spatial_settings::SpatialSettings;
use scanstitch::registration::prepared_surfels::PreparedSurfels;
use scanstitch::registration::solver::Motion;
use scanstitch_scene::random::Random;
use scanstitch_scene::ring::Ring;
use scanstitch_scene::space::DepthSensor;

const SIDE: usize = 192;

fn pgm(image: &DepthImage) -> Vec<u8> {
    let mut bytes = format!("P5 {} {} 65535\n", image.width, image.height).into_bytes();
    bytes.extend(image.values.iter().flat_map(|value| value.to_be_bytes()));
    bytes
}

/// A walk round the corridor and four metres further, in the frame of its first pose, and what a camera saw.
fn recording() -> (Vec<Pose3>, Vec<PreparedSurfels>) {
    let ring = Ring::generate(1);
    let camera = Pinhole::from_field_of_view(SIDE, SIDE, std::f64::consts::FRAC_PI_2).unwrap();
    let walk = ring.walk(0.5, 15f64.to_radians(), 4.0);
    let sensor = DepthSensor::Millimetres { square_noise: 1e-3 };
    let mut decode_config: Option<DecodeConfig> = None;
    let surfels = |(index, pose): (usize, &Pose3)| {
        let bytes = pgm(&sensor.measure(&ring.space.depth(pose, &camera), SIDE, &mut Random::new(index as u64)));
        let name = format!("{index}.pgm");
        let decode_config = decode_config.get_or_insert_with(|| {
            DecodeConfig::new(&SpatialSettings::default(), &name, &bytes).expect("a depth image")
        });
        let label = FrameLabel { name, index, time: None };
        let frame = PreparedFrame::from_depth(decode_config, label, &bytes, None).expect("a depth image");
        let Surfaces::Surfels(mut surfels) = frame.surfaces else { panic!("no surfaces") };
        surfels.remove(0).1
    };
    let images = walk.iter().enumerate().map(surfels).collect();
    (walk.iter().map(|pose| walk[0].inverse() * pose).collect(), images)
}

/// What a chain makes of the walk: each step is a little off by `drift`, until old surfaces draw the camera back.
fn drifting(truth: &[Pose3], drift: &Vector6<f64>, num_round: usize) -> Vec<Pose3> {
    let mut poses = vec![truth[0]];
    for index in 1..truth.len() {
        let step = truth[index - 1].inverse() * truth[index] * Pose3::exp(drift);
        poses.push(if index < num_round { poses[index - 1] * step } else { truth[index] });
    }
    poses
}

fn mean_error(poses: &[Pose3], truth: &[Pose3]) -> f64 {
    let off = |(pose, truth): (&Pose3, &Pose3)| (pose.translation.vector - truth.translation.vector).norm();
    poses.iter().zip(truth).map(off).sum::<f64>() / poses.len() as f64
}

/// The poses when all frames have been taken in and what was open is closed, and how often something was.
fn closed(poses: &[Pose3], images: &[PreparedSurfels], motion: Motion) -> (Vec<Pose3>, SpatialLoops) {
    let mut loops = SpatialLoops::new(motion);
    let mut poses = poses.to_vec();
    for (index, image) in images.iter().enumerate() {
        let estimate = SpatialEstimate {
            T_world_sensor: poses[index],
            registration: None,
            overlap: 1.0,
            covariance: None,
            is_in_map: true,
            assessment: Assessment::first(),
        };
        loops.add(index as u32, image, &estimate);
        for (frame, motion) in loops.close().unwrap_or_default() {
            poses[frame as usize] = motion * poses[frame as usize];
        }
    }
    (poses, loops)
}

#[test]
fn the_drift_around_a_loop_is_distributed_over_it_and_reported() {
    let (truth, images) = recording();
    let num_round = truth.len() - 8;
    assert!((truth[num_round].translation.vector).norm() < 1e-9, "the walk is back at its start");
    let drift = Vector6::new(0.0, 1.5e-4, 0.0, 4e-4, 0.0, 6e-4);
    let before = drifting(&truth, &drift, num_round);
    let (after, loops) = closed(&before, &images, Motion::Free);
    let (error, error_before) = (mean_error(&after, &truth), mean_error(&before, &truth));
    assert!(error_before > 0.02 && error < 0.4 * error_before, "mean error {error} m, {error_before} m before");
    let report = loops.report();
    assert!(report.num_closed >= 1 && report.farthest_move > 0.03, "{report:?}");
    assert!(report.note().is_some_and(|note| note.contains("distributed over the path")));

    let (untouched, loops) = closed(&truth, &images, Motion::Free);
    let moved = mean_error(&untouched, &truth);
    assert!(untouched == truth && loops.report().note().is_none(), "{moved} {:?}", loops.report());
}

#[test]
fn a_robot_on_a_floor_stays_on_it_when_a_loop_is_closed() {
    let (truth, images) = recording();
    let drift = Vector6::new(0.0, 1.5e-4, 0.0, 4e-4, 0.0, 6e-4);
    let before = drifting(&truth, &drift, truth.len() - 8);
    let (after, loops) = closed(&before, &images, Motion::Planar);
    assert!(loops.report().num_closed >= 1);
    let up = truth[0].rotation * Vector3::y();
    for pose in &after {
        let height = (pose.translation.vector - after[0].translation.vector).dot(&up);
        let tilt = (pose.rotation * Vector3::y()).angle(&up);
        assert!(height.abs() < 1e-9 && tilt < 1e-6, "{height} {tilt}");
    }
    assert!(mean_error(&after, &truth) < 0.4 * mean_error(&before, &truth));
}
