//! Runs the depth engine on the images of a real camera and writes a line a frame: its status, processor time, evidence and pose.
//!
//! `cargo run --release --example depth_camera -- d435_robot [--depth-only] [--every 2]`, or a folder with `depth` and `rgb`
//! and `--camera fx,fy,cx,cy --depth-scale 1000`.

#[path = "depth/processor_time.rs"]
mod processor_time;
#[path = "depth/recordings.rs"]
mod recordings;
#[allow(dead_code)]
#[path = "depth/scores.rs"]
mod scores;

use recordings::Choice;
use scanstitch::odometry::depth::ColorUse;
use scanstitch::pipeline::spatial_settings::SpatialSettings;

fn main() {
    let argument = |name: &str| std::env::args().skip_while(|argument| argument != name).nth(1);
    let Some(name) = std::env::args().nth(1).filter(|_| recordings::are_there()) else { return };
    let every = argument("--every").and_then(|number| number.parse().ok()).unwrap_or(1);
    let frames = argument("--first").and_then(|number| number.parse().ok()).unwrap_or(usize::MAX);
    let recording = Choice::Every(every).apply(&recordings::camera(&name)).first(frames);
    let is_depth_only = std::env::args().any(|argument| argument == "--depth-only");
    let color = if is_depth_only { ColorUse::NotUsed } else { ColorUse::Used };
    let depth_scale = recording.depth_scale.unwrap_or_default();
    let settings = SpatialSettings { color, depth_scale, ..SpatialSettings::default() };
    let (reconstruction, seconds) = scores::reconstruct(&recording, &settings);
    let mut counts = [0; 3];
    for (index, estimate) in reconstruction.estimates().iter().enumerate() {
        let status = estimate.assessment.status;
        counts[status as usize] += 1;
        let rmse = estimate.registration.as_ref().map_or(0.0, |registration| registration.last.inlier_rmse);
        println!(
            "{index} {status:?} {:.1} {:.3} {:.2} {rmse:.4} {} | {}",
            1000.0 * seconds[index],
            estimate.assessment.agreement,
            estimate.overlap,
            estimate
                .T_world_sensor
                .to_homogeneous()
                .transpose()
                .iter()
                .map(|x| format!("{x:.6}"))
                .collect::<Vec<_>>()
                .join(" "),
            estimate.assessment.reason
        );
    }
    let worst = seconds.iter().copied().fold(0.0, f64::max);
    eprintln!(
        "{name}: {} frames, good, doubtful, lost {counts:?}; register {:.0} ms a frame, at most {:.0}; loops {}",
        seconds.len(),
        1000.0 * seconds.iter().sum::<f64>() / seconds.len() as f64,
        1000.0 * worst,
        reconstruction.loop_report().num_closed
    );
}
