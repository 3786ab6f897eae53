//! What is shown: the warped view, and where cameras and ground lie.

use std::f64::consts::FRAC_PI_2;

use nalgebra::Vector3;
use scanstitch::camera::bev::presets::homework_views;
use scanstitch::camera::bev::warp::warp_rows;
use scanstitch::camera::bev::{BevLayout, BevStatus};

#[test]
fn the_warped_view_has_the_colours_of_the_places_it_shows() {
    let mut scene = homework_views();
    for camera in [&mut scene.top, &mut scene.front] {
        (camera.width, camera.height) = (96, 64);
    }
    let transfer = scene.top_from_front().unwrap();
    // Red grows to the right and green downwards, so a colour tells the place.
    let image: Vec<u8> = (0..64).flat_map(|v| (0..96).flat_map(move |u| [2 * u as u8, 3 * v as u8, 7, 255])).collect();
    let warped = warp_rows(&transfer, &image, 0, 64).unwrap();
    let mut num_shown = 0;
    for v in 0..64 {
        for u in 0..96 {
            let pixel = &warped[(v * 96 + u) * 4..][..4];
            let point = transfer.point([u as f64, v as f64]);
            assert_eq!(pixel[3] == 255, point.status == BevStatus::Visible, "{u} {v}: {point:?}");
            if point.status == BevStatus::Visible {
                num_shown += 1;
                let [x, y] = point.projected.unwrap();
                let [x, y] = [x.clamp(0.0, 95.0), y.clamp(0.0, 63.0)];
                assert!((f64::from(pixel[0]) - 2.0 * x).abs() <= 0.51 && (f64::from(pixel[1]) - 3.0 * y).abs() <= 0.51);
                assert_eq!(pixel[2], 7);
            }
        }
    }
    assert!(num_shown > 250, "{num_shown}");
    // Strips are parts of the whole; what lies beyond is empty.
    assert_eq!(warp_rows(&transfer, &image, 40, 8).unwrap(), warped[40 * 96 * 4..48 * 96 * 4]);
    assert_eq!(warp_rows(&transfer, &image, 64, 8).unwrap(), [0; 0]);
    assert!(warp_rows(&transfer, &image[4..], 0, 8).is_err());
}

#[test]
fn the_layout_is_what_the_scene_says() {
    let layout = BevLayout::new(&homework_views().front_from_top().unwrap(), 20.0);
    let close = |a: [f64; 3], b: [f64; 3]| assert!((Vector3::from(a) - Vector3::from(b)).norm() < 1e-9, "{a:?} {b:?}");
    close(layout.up, [0.0, 1.0, 0.0]);
    close(layout.front.forward, [0.0, 0.0, -1.0]);
    close(layout.top.forward, [0.0, -1.0, 0.0]);
    close(layout.top.down, [0.0, 0.0, 1.0]);
    assert!((layout.top.height - 2.5).abs() < 1e-12 && (layout.front.height - 1.0).abs() < 1e-12);
    assert!((layout.front.vertical_field_of_view - FRAC_PI_2).abs() < 1e-12);
    // The top camera sees a square of 5 m; the front camera sees the floor from 1 m ahead up to the depth asked for.
    assert_eq!(layout.top.footprint.len(), 4);
    for corner in &layout.top.footprint {
        assert!((corner[0].abs() - 2.5).abs() < 0.01 && (corner[2].abs() - 2.5).abs() < 0.01 && corner[1].abs() < 1e-9);
    }
    let depths: Vec<f64> = layout.front.footprint.iter().map(|corner| -corner[2]).collect();
    assert!(depths.iter().all(|depth| (0.99..20.01).contains(depth)), "{depths:?}");
    assert!(depths.iter().any(|depth| *depth > 19.9));
}
