//! Preset scenes.

use std::f64::consts::FRAC_PI_2;

use serde::Serialize;

use super::axes::{BevAxes, EulerOrder};
use super::scene::{BevCamera, BevIntrinsics, BevPlane, BevPose, BevScene, BevSide};

/// A scene with a name.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct BevPreset {
    /// For links and the command line.
    pub name: String,
    /// For buttons.
    pub label: String,
    /// One line.
    pub explanation: String,
    /// The cameras.
    pub scene: BevScene,
}

/// The homework's own views.
impl Default for BevScene {
    fn default() -> Self {
        homework_views()
    }
}

/// The homework's two layouts.
pub fn presets() -> Vec<BevPreset> {
    let preset = |name: &str, label: &str, explanation: &str, scene| BevPreset {
        name: name.into(),
        label: label.into(),
        explanation: explanation.into(),
        scene,
    };
    vec![
        preset(
            "homework_views",
            "Homework: the two views",
            "512 x 512, 90 degrees; front camera 1.0 m and top camera 2.5 m above the floor, at the same place",
            homework_views(),
        ),
        preset(
            "homework_numbers",
            "Homework: the worked numbers",
            "512 x 512, 90 degrees; both cameras 1.0 m above the floor, the top camera 1.5 m ahead",
            homework_numbers(),
        ),
    ]
}

/// Front camera at 1.0 m, looking ahead; top camera at 2.5 m over the same place, looking straight down.
pub fn homework_views() -> BevScene {
    homework([0.0, 2.5, 0.0])
}

/// Both cameras 1.0 m above the floor, the top one 1.5 m ahead.
pub fn homework_numbers() -> BevScene {
    homework([0.0, 1.0, -1.5])
}

fn homework(top_position: [f64; 3]) -> BevScene {
    let camera = |position, pitch| BevCamera {
        image: None,
        width: 512,
        height: 512,
        intrinsics: BevIntrinsics::FieldOfView { field_of_view: FRAC_PI_2, side: BevSide::Horizontal },
        pose: BevPose::Euler { position, order: EulerOrder::XYZ, angles: [pitch, 0.0, 0.0] },
    };
    BevScene {
        axes: BevAxes::ThreeJs,
        plane: BevPlane::Level { height: 0.0 },
        top: camera(top_position, -FRAC_PI_2),
        front: camera([0.0, 1.0, 0.0], 0.0),
    }
}
