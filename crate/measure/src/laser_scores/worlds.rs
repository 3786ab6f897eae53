//! Worlds that look the same from several places, by scans alone and with exact odometry.

use glam::Vec3;
use scanstitch::geometry::{PointCloud, Pose2, Pose3, RigidMotion};
use scanstitch::io::trajectory::{Trajectory, in_space};
use scanstitch::odometry::assessment::Status;
use scanstitch::pipeline::planar::Reconstruction;
use scanstitch::pipeline::report::Stage;
use scanstitch_scene::ambiguous::{ALL, generate};
use scanstitch_scene::recording::PlanarRecording;

use crate::arguments::arguments;

pub fn print_table(settings: &serde_json::Value) {
    let arguments = arguments();
    let is_told = arguments.iter().any(|argument| argument == "--frames");
    let num_scans = arguments.iter().find_map(|a| a.strip_prefix("--scans=")?.parse().ok()).unwrap_or(12);
    for kind in ALL {
        for with_odometry in [false, true] {
            let (mut good, mut falsely, mut wrong, mut seeds) = (0, 0, 0, Vec::new());
            for seed in 0..20 {
                let recording = generate(kind, seed, num_scans);
                let reconstruction = run(settings, &recording, with_odometry);
                let frames = reconstruction.result().frames;
                let poses = reconstruction.poses();
                let truth = &recording.T_world_sensor;
                let apart = |a: usize, b: usize| {
                    let off = (truth[a].inverse() * truth[b]).inverse() * (poses[a].inverse() * poses[b]);
                    off.translation_norm() > 0.5 || off.rotation_angle() > 5f64.to_radians()
                };
                let mut falsely_here = 0;
                for piece in 0..frames.len() {
                    let of: Vec<usize> = (0..frames.len())
                        .filter(|&frame| frames[frame].piece == piece && frames[frame].status == Status::Good)
                        .collect();
                    falsely_here += of.iter().map(|&a| of.iter().filter(|&&b| apart(a, b)).count()).min().unwrap_or(0);
                }
                let wrong_here = (0..frames.len()).filter(|&frame| apart(0, frame)).count();
                good += frames.iter().filter(|frame| frame.status == Status::Good).count();
                falsely += falsely_here;
                wrong += wrong_here;
                if falsely_here > 0 || with_odometry && wrong_here > 0 {
                    seeds.push(seed);
                    if is_told {
                        println!("{kind:?} odometry {with_odometry} seed {seed}: {:?}", reconstruction.result().notes);
                        for (index, frame) in frames.iter().enumerate() {
                            println!(
                                "  {index} piece {} {:?} agreement {:.3} overlap {:.3} right {} {}",
                                frame.piece,
                                frame.status,
                                frame.agreement,
                                frame.overlap,
                                !apart(0, index),
                                frame.reason
                            );
                        }
                    }
                }
            }
            let mode = if with_odometry { "exact odometry" } else { "alone" };
            println!(
                "{kind:?} {mode}: of {}, good {good}, falsely good {falsely}, wrong {wrong} {seeds:?}",
                20 * num_scans
            );
        }
    }
}

fn run(settings: &serde_json::Value, recording: &PlanarRecording, with_odometry: bool) -> Reconstruction {
    let settings = serde_json::from_value(settings.clone()).expect("the settings are right");
    let mut reconstruction = Reconstruction::new(settings).expect("the settings are right");
    for (index, scan) in recording.scans.iter().enumerate() {
        let positions = scan.iter().map(|p| Vec3::new(p.x as f32, p.y as f32, 0.0)).collect();
        reconstruction.add_scan(&index.to_string(), PointCloud::from_positions(positions)).expect("it is a scan");
    }
    if with_odometry {
        let poses: Vec<Pose3> = recording.T_world_sensor.iter().map(|pose: &Pose2| in_space(pose)).collect();
        reconstruction.set_odometry("odometry", Trajectory::from_poses(&poses)).expect("it has headings");
    }
    while reconstruction.step().stage != Stage::Done {}
    reconstruction
}
