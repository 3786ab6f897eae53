//! Scenes that cannot be: each has its own message.

use std::f64::consts::PI;

use scanstitch::camera::bev::axes::EULER_ORDERS;
use scanstitch::camera::bev::presets::homework_views;
use scanstitch::camera::bev::{BevIntrinsics, BevPlane, BevPose, BevScene, BevSide};

#[test]
fn every_degenerate_input_has_its_own_message() {
    let with = |change: &dyn Fn(&mut BevScene)| {
        let mut scene = homework_views();
        change(&mut scene);
        scene.front_from_top().expect_err("refused").to_string()
    };
    let matrix = |rows: [[f64; 4]; 3]| {
        let T_world_camera = [rows[0], rows[1], rows[2], [0.0, 0.0, 0.0, 1.0]];
        BevPose::Matrix { T_world_camera }
    };
    let level = |height| BevPlane::Level { height };
    let angle = |field_of_view| BevIntrinsics::FieldOfView { field_of_view, side: BevSide::Horizontal };
    let messages = [
        (with(&|scene| scene.front.intrinsics = angle(PI)), "front camera's field of view is 180 degrees"),
        (with(&|scene| scene.top.intrinsics = angle(0.0)), "top camera's field of view is 0 degrees"),
        (with(&|scene| scene.top.intrinsics = angle(f64::NAN)), "field of view is NaN degrees"),
        (
            with(&|scene| scene.top.intrinsics = BevIntrinsics::Focal { fx: 0.0, fy: 1.0, cx: 0.0, cy: 0.0 }),
            "The top camera: fx = 0",
        ),
        (with(&|scene| scene.front.width = 0), "front camera has 0 x 512 pixels"),
        (
            with(&|scene| {
                scene.front.pose = matrix([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 1.0], [2.0, 0.0, 0.0, 0.0]]);
            }),
            "front camera is singular (determinant 0)",
        ),
        (
            with(&|scene| {
                scene.front.pose = matrix([[-1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]]);
            }),
            "mirrors (determinant -1)",
        ),
        (
            with(&|scene| {
                scene.top.pose = matrix([[2.0, 0.0, 0.0, 0.0], [0.0, 2.0, 0.0, 1.0], [0.0, 0.0, 2.0, 0.0]]);
            }),
            "is not a rotation: its entries are off by up to 1.000",
        ),
        (
            with(&|scene| {
                let mut T_world_camera = [[0.0; 4]; 4];
                (0..4).for_each(|i| T_world_camera[i][i] = 1.0);
                T_world_camera[3][1] = 2.5;
                scene.top.pose = BevPose::Matrix { T_world_camera };
            }),
            "ends in the row [0.0, 2.5, 0.0, 1.0]",
        ),
        (
            with(&|scene| {
                let position = [0.0, 1.0, 0.0];
                scene.front.pose = BevPose::Quaternion { position, qx: 0.0, qy: 0.0, qz: 0.0, qw: 0.0 };
            }),
            "front camera's quaternion is zero",
        ),
        (
            with(&|scene| {
                scene.front.pose =
                    BevPose::Euler { position: [f64::INFINITY; 3], order: EULER_ORDERS[0], angles: [0.0; 3] };
            }),
            "front camera's position or orientation has a number that is not finite",
        ),
        (with(&|scene| scene.plane = level(1.0)), "The ground passes through the front camera"),
        (with(&|scene| scene.plane = level(2.5)), "The ground passes through the top camera"),
        (with(&|scene| scene.plane = BevPlane::Tilted { normal: [0.0; 3], offset: 0.0 }), "normal is zero"),
        (with(&|scene| scene.plane = level(f64::NAN)), "The ground has a number that is not finite"),
    ];
    for (message, expected) in &messages {
        assert!(message.contains(expected), "{message} should say: {expected}");
        assert!(message.matches('.').count() >= 2, "{message} should say what to do");
    }
    let distinct: std::collections::BTreeSet<&String> = messages.iter().map(|(message, _)| message).collect();
    assert_eq!(distinct.len(), messages.len());

    let size = homework_views().top.check_image("top", 640, 480).unwrap_err().to_string();
    assert!(size.contains("640 x 480") && size.contains("512 x 512"), "{size}");
    assert!(homework_views().top.check_image("top", 512, 512).is_ok());
}
