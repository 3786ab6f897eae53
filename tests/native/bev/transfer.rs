//! From a pixel of one view to its pixel in the other.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;
use scanstitch::camera::bev::axes::{AXES, EULER_ORDERS};
use scanstitch::camera::bev::presets::{homework_numbers, homework_views};
use scanstitch::camera::bev::scene::other_field_of_view;
use scanstitch::camera::bev::{BevIntrinsics, BevPoseKind, BevSide, BevStatus, WholePixels};

use super::chance::Chance;
use super::plain::{NUM_CASES, Plain, distance};

#[test]
fn both_published_sets_land_on_exactly_their_integers() {
    type Pixels<'a> = &'a [[f64; 2]];
    let sets: [(Pixels, Pixels); 2] = [
        (
            &[[239.0, 141.0], [258.0, 314.0], [368.0, 211.0], [360.0, 123.0]],
            &[[247.0, 387.0], [257.0, 457.0], [322.0, 408.0], [307.0, 382.0]],
        ),
        (
            &[[145.0, 87.0], [215.0, 301.0], [356.0, 372.0], [424.0, 211.0], [295.0, 70.0]],
            &[[204.0, 374.0], [225.0, 449.0], [351.0, 500.0], [356.0, 408.0], [273.0, 370.0]],
        ),
    ];
    for axes in AXES {
        let scene = homework_numbers().in_axes(axes).unwrap();
        let (there, back) = (scene.front_from_top().unwrap(), scene.top_from_front().unwrap());
        for (marked, expected) in sets {
            for (&marked, &expected) in marked.iter().zip(expected) {
                let point = there.point(marked);
                assert_eq!(point.status, BevStatus::Visible);
                assert_eq!(point.in_whole_pixels(WholePixels::Truncated).projected, Some(expected), "{axes:?}");
                let again = back.point(point.projected.unwrap()).projected.unwrap();
                assert!(distance(again, marked) < 1e-9, "{again:?} in place of {marked:?}");
            }
        }
    }
    // By hand: the floor 1 m below and 2 m ahead is half as far down as it is far.
    let ahead = homework_numbers().front_from_top().unwrap().point([256.0, 128.0]);
    let [x, y, z] = ahead.ground.unwrap();
    assert!(x.abs() < 1e-12 && y.abs() < 1e-12 && (z + 2.0).abs() < 1e-12);
    assert!(distance(ahead.projected.unwrap(), [256.0, 384.0]) < 1e-9);
}

#[test]
fn whole_pixels_are_cut_or_rounded() {
    let cases = [(387.3, 387.0, 387.0), (387.5, 387.0, 388.0), (-0.7, 0.0, -1.0), (-0.4, 0.0, 0.0), (5.0, 5.0, 5.0)];
    for (given, truncated, rounded) in cases {
        for (whole, expected) in
            [(WholePixels::Exact, given), (WholePixels::Truncated, truncated), (WholePixels::Rounded, rounded)]
        {
            let found = whole.apply(given);
            assert_eq!((found, found.is_sign_negative()), (expected, expected < 0.0), "{whole:?} of {given}");
        }
    }
    // What is a whole number but for rounding errors stays that number.
    assert_eq!(WholePixels::Truncated.apply(386.999_999_999_999_9), 387.0);
    assert_eq!(WholePixels::Truncated.apply(386.999_9), 386.0);
}

#[test]
fn random_scenes_agree_with_the_plain_matrices_both_ways() {
    let mut chance = Chance(1);
    let mut counts = [0; 4];
    for case in 0..NUM_CASES {
        let scene = chance.scene();
        let plain = Plain::of(&scene);
        let (there, back) = (scene.front_from_top().unwrap(), scene.top_from_front().unwrap());
        let homography = there.homography();
        for _ in 0..20 {
            let marked = chance.pixel(&scene.top);
            let (point, seen) = (there.point(marked), plain.front(marked));
            counts[point.status as usize] += 1;
            assert_eq!(point.ground.is_some(), seen.depth > 0.0, "case {case}");
            let Some(ground) = point.ground else { continue };
            assert_eq!(point.projected.is_some(), seen.depth_there > 0.0, "case {case}");
            let allowed = 1e-9 * seen.ground.norm().max(1.0).powi(2);
            assert!((Vector3::from(ground) - seen.ground).norm() < allowed, "case {case}: {ground:?}");
            if point.status != BevStatus::Visible {
                continue;
            }
            let pixel = point.projected.unwrap();
            assert!(distance(pixel, seen.pixel) < 1e-9, "case {case}: {pixel:?}, {:?}", seen.pixel);
            let p = homography * Vector3::new(marked[0], marked[1], 1.0);
            assert!(distance([p.x / p.z, p.y / p.z], pixel) < 1e-9, "case {case}: the homography");

            // And back: as exactly as the way back is steep.
            let (again, seen) = (back.point(pixel), plain.top(pixel));
            let step = distance(plain.top([pixel[0] + 1e-6, pixel[1] + 1e-6]).pixel, seen.pixel) / 1e-6;
            let allowed = 1e-9 * step.max(1.0);
            assert!(distance(again.projected.unwrap(), marked) < allowed, "case {case}: back");
            assert!(distance(again.projected.unwrap(), seen.pixel) < allowed, "case {case}: back, plainly");
        }
    }
    assert!(counts.iter().all(|&count| count > 500), "each status is met often: {counts:?}");
}

#[test]
fn changing_the_axes_and_the_kind_of_pose_changes_no_pixel() {
    let mut chance = Chance(2);
    for _ in 0..NUM_CASES {
        let scene = chance.scene();
        let kinds = [BevPoseKind::Euler, BevPoseKind::Quaternion, BevPoseKind::Matrix];
        let other = scene.with_poses(chance.one_of(&kinds), chance.one_of(&EULER_ORDERS)).unwrap();
        let other = other.in_axes(chance.one_of(&AXES)).unwrap();
        let (before, after) = (scene.front_from_top().unwrap(), other.front_from_top().unwrap());
        for _ in 0..5 {
            let marked = chance.pixel(&scene.top);
            let (a, b) = (before.point(marked), after.point(marked));
            // A pixel right at a border may fall on either side of it.
            if let (BevStatus::Visible, BevStatus::Visible) = (a.status, b.status) {
                assert!(distance(a.projected.unwrap(), b.projected.unwrap()) < 1e-9);
            } else {
                let [u, v] = a.projected.or(b.projected).unwrap_or([-9.0, -9.0]);
                let inside = before.projected.sees(u, v);
                assert!(a.status == b.status || !inside, "{a:?} {b:?}");
            }
        }
    }
}

#[test]
fn the_vertical_field_of_view_follows_through_the_tangent() {
    // 640 x 480 at 90 degrees: f = 320, so the vertical one is 2 atan(240 / 320) = 73.74 degrees, eq. (2).
    let vertical = other_field_of_view(FRAC_PI_2, 640, 480);
    assert!((vertical.to_degrees() - 73.739_795_291_688_04).abs() < 1e-9);
    assert!((other_field_of_view(vertical, 480, 640) - FRAC_PI_2).abs() < 1e-15);
    let mut scene = homework_views();
    for camera in [&mut scene.top, &mut scene.front] {
        (camera.width, camera.height) = (640, 480);
    }
    let right = scene.front_from_top().unwrap();
    assert!((right.projected.fields_of_view()[1] - vertical).abs() < 1e-12);
    // Given by its vertical field of view it is the same camera.
    scene.front.intrinsics = BevIntrinsics::FieldOfView { field_of_view: vertical, side: BevSide::Vertical };
    let marked = [400.0, 60.0];
    let expected = right.point(marked).projected.unwrap();
    assert!(distance(scene.front_from_top().unwrap().point(marked).projected.unwrap(), expected) < 1e-9);

    // A published solution scales the angle: 90 x 480 / 640 = 67.5 degrees, so fy = 240 / tan(33.75 deg) = 359.2.
    let wrong_angle: f64 = FRAC_PI_2 * 480.0 / 640.0;
    let wrong_fy = 240.0 / (wrong_angle / 2.0).tan();
    assert!((wrong_fy - 359.19).abs() < 0.01);
    for camera in [&mut scene.top, &mut scene.front] {
        camera.intrinsics = BevIntrinsics::Focal { fx: 320.0, fy: wrong_fy, cx: 320.0, cy: 240.0 };
    }
    let wrong = scene.front_from_top().unwrap().point(marked).projected.unwrap();
    assert!(distance(wrong, expected) > 50.0, "{wrong:?} and {expected:?}");
    // In square images both agree, which is why it went unseen.
    assert!((other_field_of_view(FRAC_PI_2, 512, 512) - FRAC_PI_2).abs() < 1e-15);
}
