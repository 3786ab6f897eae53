//! Writes the log of a drive through a generated building, with the ground truth and the wheel odometry beside it.
//!
//! `cargo measure render_laser_log FOLDER [seed=1] [scans=250] [building=office] [back=false]
//! [step=0.3] [beams=180] [max_range=80] [fov=180]`

use std::fmt::Write as _;

use scanstitch::geometry::Pose2;
use scanstitch_scene::corridor::{self, CorridorOptions};
use scanstitch_scene::drive::{Drive, DriveOptions};
use scanstitch_scene::laser::Laser;
use scanstitch_scene::office::{self, OfficeOptions};

use crate::arguments::arguments;

pub fn main() -> std::io::Result<()> {
    let arguments = arguments();
    let option = |name: &str, default: f64| {
        let value = arguments.iter().find_map(|argument| argument.strip_prefix(&format!("{name}=")));
        value.and_then(|value| value.parse().ok()).unwrap_or(default)
    };
    let laser = Laser {
        num_beams: option("beams", 180.0) as usize,
        max_range: option("max_range", 80.0),
        field_of_view: std::f64::consts::PI * 179.0 / 180.0,
        ..Laser::default()
    };
    let (seed, num_scans) = (option("seed", 1.0) as u64, option("scans", 250.0) as usize);
    let recording = if option("corridor", 0.0) > 0.0 {
        corridor::generate(&CorridorOptions { seed, num_scans, ..CorridorOptions::default() })
    } else {
        office::generate(&OfficeOptions { seed, num_scans, ..OfficeOptions::default() })
    };
    let defaults = DriveOptions::default();
    let drive = Drive::new(
        &recording,
        &DriveOptions {
            seed,
            laser,
            step: option("step", defaults.step),
            is_returning: option("back", 0.0) > 0.0,
            ..defaults
        },
    );
    let folder = &arguments[0];
    std::fs::create_dir_all(folder)?;
    std::fs::write(format!("{folder}/drive.log"), drive.carmen())?;
    std::fs::write(format!("{folder}/drive.odometry.txt"), rows(&drive.odometry))?;
    std::fs::write(format!("{folder}/drive.truth.txt"), rows(&drive.T_world_robot))
}

/// Rows of number, x, y and heading.
fn rows(poses: &[Pose2]) -> String {
    let mut text = String::new();
    for (index, pose) in poses.iter().enumerate() {
        let _ =
            writeln!(text, "{index} {:.6} {:.6} {:.8}", pose.translation.x, pose.translation.y, pose.rotation.angle());
    }
    text
}
