//! Scores the depth engine on walks of a hand-held stereo camera through generated flats: the numbers of good, doubtful, lost and
//! wrongly good frames. `cargo measure hand_held [--seeds 3] [--frames 120] [--turn 8] [--wide | --kinect] [-v]`

use scanstitch::camera::Pinhole;
use scanstitch::pipeline::spatial_settings::SpatialSettings;
use scanstitch_scene::apartment::{Apartment, WalkOptions};
use scanstitch_scene::hand_held::hand_held;
use scanstitch_scene::space::stereo_camera::StereoCamera;

use crate::arguments::{argument, flag};
use crate::depth::recordings::{Recording, pgm};
use crate::depth::scores;

pub fn main() {
    let number = |name: &str, default: f64| argument(name).and_then(|text| text.parse().ok()).unwrap_or(default);
    let (turn, step) = (number("--turn", 4.0), number("--step", 0.04));
    let size = match (flag("--wide"), flag("--kinect")) {
        (true, _) => (848, 480, 425.0),
        (_, true) => (640, 480, 585.0),
        _ => (640, 480, 384.0),
    };
    let camera = Pinhole::new(size.0, size.1, [size.2, size.2, size.0 as f64 / 2.0, 240.0]).expect("a camera");
    let sensor = StereoCamera {
        patch_noise: number("--noise", StereoCamera::default().patch_noise),
        bias: number("--bias", StereoCamera::default().bias),
        exposure: number("--exposure", StereoCamera::default().exposure),
        ..StereoCamera::default()
    };
    let sensor = if flag("--kinect") {
        StereoCamera { baseline: 0.075, step: 0.125, pixel_noise: 0.05, fattening: 2.0, max_range: 5.0, ..sensor }
    } else {
        sensor
    };
    let first = number("--first", 1.0) as u64;
    for seed in first..first + number("--seeds", 3.0) as u64 {
        let apartment = Apartment::generate(seed);
        let mut poses = hand_held(&apartment.walk(&WalkOptions::default()), step, turn.to_radians(), seed);
        poses.truncate(number("--frames", 120.0) as usize);
        let depth: Vec<Vec<u8>> = (0..poses.len())
            .map(|index| {
                let last = &poses[index.saturating_sub(1)];
                pgm(&sensor.measure(&apartment.space, &poses[index], last, &camera, 1000 * seed + index as u64))
            })
            .collect();
        let recording = Recording {
            name: format!("hand-held, flat {seed}"),
            depth,
            color: Vec::new(),
            intrinsics: Some([camera.fx, camera.fy, camera.cx, camera.cy]),
            depth_scale: Some(1000.0),
            truth: poses,
            strangers: Vec::new(),
        };
        if let Some(folder) = argument("--save") {
            std::fs::create_dir_all(&folder).expect("a folder");
            for (index, bytes) in recording.depth.iter().enumerate() {
                std::fs::write(format!("{folder}/{seed}_{index:03}.pgm"), bytes).expect("room");
            }
        }
        let settings = SpatialSettings { depth_scale: 1000.0, ..SpatialSettings::default() };
        let (score, reconstruction) = scores::score(&recording, &settings, flag("-v"));
        let good = score.frames - score.doubtful - score.lost;
        if flag("-v") {
            reconstruction.result().notes.iter().for_each(|note| println!("  {note}"));
        }
        println!(
            "flat {seed}: {good} good, {} doubtful, {} lost, {} wrongly good; mean {:.0} mm, good ones {:.0} mm; right but not good {}; in their 95 % region, beyond twice, of: {:?}; {:.0} ms a frame",
            score.doubtful,
            score.lost,
            score.wrong,
            1000.0 * score.mean,
            1000.0 * score.believed_mean,
            score.flagged,
            score.bounded,
            score.milliseconds
        );
    }
}
