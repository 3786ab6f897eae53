//! How the camera stood and where the ground lies, from pairs of pixels.

use scanstitch::camera::bev::axes::AXES;
use scanstitch::camera::bev::presets::homework_views;
use scanstitch::camera::bev::{
    BevAxes, BevPair, BevParameter, BevPlane, BevPose, BevRefinementOptions, BevRole, BevScene, refine,
};

use super::chance::Chance;
use super::plain::distance;

#[test]
fn refinement_finds_how_the_camera_stood() {
    let mut chance = Chance(5);
    let mut num_refined = 0;
    for case in 0..200 {
        let role = chance.one_of(&[BevRole::Front, BevRole::Top]);
        let axes = chance.one_of(&AXES);
        let truth = homework_views().in_axes(axes).unwrap();
        // Pairs that the true cameras show, measured to 0 px: what is recovered must be the truth itself.
        let exact = truth.front_from_top().unwrap();
        let pairs: Vec<BevPair> = std::iter::repeat_with(|| [chance.within(20.0, 490.0), chance.within(20.0, 140.0)])
            .filter_map(|top| exact.point(top).projected.map(|front| BevPair { top, front }))
            .take(6)
            .collect();
        // The user's guess: a camera that was moved and turned.
        let mut guess = truth.in_axes(BevAxes::ThreeJs).unwrap();
        let camera = if role == BevRole::Front { &mut guess.front } else { &mut guess.top };
        let BevPose::Euler { position, angles, .. } = &mut camera.pose else { unreachable!("angles stay angles") };
        let shifts = [chance.within(-0.3, 0.3), chance.within(-0.2, 0.2), chance.within(-0.15, 0.15)];
        let pitch = chance.within(-0.1, 0.1);
        position.iter_mut().zip(shifts).for_each(|(value, shift)| *value += shift);
        angles[0] += pitch;
        let guess = guess.in_axes(axes).unwrap();
        let options = BevRefinementOptions { camera: role, ..BevRefinementOptions::default() };
        let found = refine(&guess, &pairs, &options).unwrap();
        assert!(found.converged, "case {case}");
        assert!(found.rmse < 1e-6 && found.rmse_before > 0.1, "case {case}: {} from {}", found.rmse, found.rmse_before);
        assert!((found.height + shifts[1]).abs() < 1e-7 && (found.pitch + pitch).abs() < 1e-7, "case {case}");
        assert!((found.right + shifts[0]).abs() < 1e-7 && (found.ahead - shifts[2]).abs() < 1e-7, "case {case}");
        let again = found.scene.front_from_top().unwrap();
        for pair in &pairs {
            assert!(distance(again.point(pair.top).projected.unwrap(), pair.front) < 1e-6);
        }
        num_refined += 1;
    }
    assert_eq!(num_refined, 200);
}

#[test]
fn refinement_of_rough_marks_leaves_the_smallest_residuals() {
    let truth = homework_views().front_from_top().unwrap();
    let mut chance = Chance(6);
    let pairs: Vec<BevPair> = (0..8)
        .map(|_| [chance.within(60.0, 450.0), chance.within(20.0, 140.0)])
        .map(|top| (top, truth.point(top).projected.unwrap()))
        .map(|(top, [u, v])| BevPair { top, front: [u.round(), v.round()] })
        .collect();
    let found = refine(&homework_views(), &pairs, &BevRefinementOptions::default()).unwrap();
    assert!(found.converged && found.rmse <= found.rmse_before && found.rmse < 0.6, "{}", found.rmse);
    assert_eq!((found.residuals.len(), found.residuals_before.len()), (8, 8));
    // No small motion of the camera makes the sum smaller: it is a minimum, not just where the steps ended.
    for parameter in [BevParameter::Pitch, BevParameter::Height, BevParameter::Offset] {
        let options = BevRefinementOptions { camera: BevRole::Front, parameters: vec![parameter] };
        let again = refine(&found.scene, &pairs, &options).unwrap();
        assert!(again.rmse > found.rmse - 1e-9);
        assert!(again.pitch.abs().max(again.height.abs()).max(again.right.abs()).max(again.ahead.abs()) < 1e-4);
    }
}

#[test]
fn refinement_says_what_pairs_cannot_tell() {
    let scene = homework_views();
    let pair = |u: f64, v: f64, [du, dv]: [f64; 2]| {
        let [fu, fv] = scene.front_from_top().unwrap().point([u, v]).projected.unwrap();
        BevPair { top: [u, v], front: [fu + du, fv + dv] }
    };
    let all = BevRefinementOptions::default();
    let message =
        |pairs: &[BevPair], options: &BevRefinementOptions| refine(&scene, pairs, options).unwrap_err().to_string();
    assert!(message(&[pair(200.0, 50.0, [1.0, 1.0])], &all).contains("1 pairs give 2 numbers, but 4 are wanted"));
    let same = [pair(200.0, 50.0, [1.0, 1.0]); 4];
    assert!(message(&same, &all).contains("do not tell"));
    let behind = BevPair { top: [250.0, 400.0], front: [250.0, 400.0] };
    assert!(message(&[same[0], same[1], behind], &all).contains("pair 3"));
    let nothing = BevRefinementOptions { parameters: vec![], ..all };
    assert!(message(&same, &nothing).contains("Nothing"));
    // Both cameras stand over one place: only the ratio of their heights shows, so not the ground as well.
    let ratio = BevRefinementOptions { parameters: vec![BevParameter::Height, BevParameter::Ground], ..height_only() };
    let spread = [pair(100.0, 40.0, [0.0, 9.0]), pair(300.0, 90.0, [0.0, 7.0]), pair(400.0, 120.0, [0.0, 8.0])];
    assert!(message(&spread, &ratio).contains("do not tell"));
    // One pair is enough for one number.
    let found = refine(&scene, &[pair(256.0, 56.0, [0.0, 12.0])], &height_only()).unwrap();
    assert!(found.converged && found.rmse < 1e-9 && found.height > 0.05, "{found:?}");
}

fn height_only() -> BevRefinementOptions {
    BevRefinementOptions { parameters: vec![BevParameter::Height], camera: BevRole::Front }
}

#[test]
fn refinement_finds_the_ground() {
    for axes in AXES {
        let scene = homework_views().in_axes(axes).unwrap();
        let mut lower = scene.clone();
        lower.plane = BevPlane::Level { height: -0.1 };
        let shown = lower.front_from_top().unwrap();
        let pairs = [[100.0, 40.0], [300.0, 90.0], [400.0, 120.0]]
            .map(|top| BevPair { top, front: shown.point(top).projected.unwrap() });
        let options = BevRefinementOptions { parameters: vec![BevParameter::Ground], camera: BevRole::Front };
        let found = refine(&scene, &pairs, &options).unwrap();
        assert!(found.converged && (found.ground + 0.1).abs() < 1e-9, "{axes:?}: {}", found.ground);
        assert_eq!((&found.scene.top, &found.scene.front), (&scene.top, &scene.front));
        // The same ground given by its normal, which may point down and have any length.
        let normal = (axes.up() * -2.0).into();
        let tilted = BevScene { plane: BevPlane::Tilted { normal, offset: 0.0 }, ..scene.clone() };
        let found = refine(&tilted, &pairs, &options).unwrap();
        assert!((found.ground + 0.1).abs() < 1e-9);
        assert!(matches!(found.scene.plane, BevPlane::Tilted { offset, .. } if (offset - 0.2).abs() < 1e-9));
    }
}

/// Places of the floor in the homework's own two pairs of views, read off the enlarged pictures by eye, to 2 px.
#[test]
fn the_homeworks_views_show_a_floor_that_lies_a_little_lower() {
    let on_the_rug = [
        BevPair { top: [234.0, 46.0], front: [228.0, 387.0] }, // corner of the rug
        BevPair { top: [305.0, 120.0], front: [346.0, 454.0] }, // corner of the table's shadow
    ];
    let on_the_floor = [
        BevPair { top: [237.0, 66.0], front: [231.0, 404.0] }, // corners of the planks in the doorway
        BevPair { top: [307.0, 84.0], front: [332.0, 419.0] },
    ];
    let official = homework_views();
    let options = BevRefinementOptions { parameters: vec![BevParameter::Ground], camera: BevRole::Front };
    for (pairs, lowest, highest) in [(on_the_rug, -0.10, -0.04), (on_the_floor, -0.14, -0.11)] {
        let found = refine(&official, &pairs, &options).unwrap();
        for [across, down] in &found.residuals_before {
            assert!(across.abs() < 2.6 && (-11.0..-5.0).contains(down), "{across} {down}");
        }
        assert!((lowest..highest).contains(&found.ground), "{}", found.ground);
        assert!(found.rmse < 2.8, "{}", found.rmse);
    }
}
