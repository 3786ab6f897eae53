//! Two depth frames of a generated flat, registered to each other without a guess.

use scanstitch::camera::Pinhole;
use scanstitch::geometry::Pose3;
use scanstitch::odometry::assessment::Status;
use scanstitch::odometry::depth::{DepthOptions, PairRegistration, Search};
use scanstitch::preprocess::depth_surfels::{DepthModel, depth_surfels};
use scanstitch::preprocess::wrap_around::usable_pixels;
use scanstitch::registration::prepared_surfels::PreparedSurfels;
use scanstitch_scene::apartment::{Apartment, WalkOptions};
use scanstitch_scene::random::Random;
use scanstitch_scene::space::DepthSensor;

/// Frames of a flat at poses of its walk, and those poses.
fn frames(seed: u64, chosen: &[usize]) -> Vec<(PreparedSurfels, Pose3)> {
    let camera = Pinhole::from_field_of_view(320, 320, std::f64::consts::FRAC_PI_2).unwrap();
    let flat = Apartment::generate(seed);
    let walk = flat.walk(&WalkOptions { num_frames: Some(1 + chosen.iter().max().unwrap()), ..WalkOptions::default() });
    let model = DepthModel { step: 1e-3, offset: 0.0, square_noise: 2e-3, min_range: 0.2, max_range: 10.0 };
    let frame = |&index: &usize| {
        let sensor = DepthSensor::Millimetres { square_noise: 0.0 };
        let depth = sensor.measure(&flat.space.depth(&walk[index], &camera), camera.width, &mut Random::new(seed));
        let surfels = depth_surfels(&depth, &usable_pixels(&depth), &camera, &model);
        (DepthOptions::default().prepared(surfels), walk[index])
    };
    chosen.iter().map(frame).collect()
}

#[test]
fn a_frame_is_found_in_another_from_no_guess_and_from_a_poor_one() {
    let frames = frames(5, &[0, 4]);
    let [(target, T_world_target), (source, T_world_source)] = &frames[..] else { panic!("two frames") };
    let truth = T_world_target.inverse() * T_world_source;
    let apart = truth.translation.vector.norm() + truth.rotation.angle();
    assert!(apart > 0.3, "they are {apart} m and rad apart: no frame to find");
    let lone = PairRegistration::new(target);
    let poor = truth * Pose3::new(nalgebra::Vector3::new(0.1, 0.0, -0.1), nalgebra::Vector3::new(0.0, 0.1, 0.0));
    for search in [Search::Anywhere, Search::AllAround, Search::From(poor)] {
        let found = lone.register(source, search, DepthOptions::default());
        let off = truth.inverse() * found.T_world_sensor;
        let (moved, turned) = (off.translation.vector.norm(), off.rotation.angle().to_degrees());
        assert!(moved < 0.02 && turned < 0.5, "{search:?}: {moved} m, {turned} deg");
        assert_eq!(found.assessment.status, Status::Good, "{search:?}: {}", found.assessment.reason);
    }
}

#[test]
fn a_frame_without_surfaces_is_lost() {
    let target = &frames(5, &[0])[0].0;
    let mut image = target.image.clone();
    std::sync::Arc::make_mut(&mut image.cells).fill(None);
    let empty = DepthOptions::default().prepared(image);
    for search in [Search::Anywhere, Search::AllAround, Search::From(Pose3::identity())] {
        let found = PairRegistration::new(target).register(&empty, search, DepthOptions::default());
        assert_eq!((found.assessment.status, found.overlap), (Status::Lost, 0.0), "{search:?}");
    }
}

#[test]
fn a_frame_of_another_flat_is_not_accepted() {
    let (here, elsewhere) = (frames(5, &[0]), frames(6, &[3]));
    let found = PairRegistration::new(&here[0].0).register(&elsewhere[0].0, Search::Anywhere, DepthOptions::default());
    assert_ne!(found.assessment.status, Status::Good, "agreement {}", found.assessment.agreement);
}
