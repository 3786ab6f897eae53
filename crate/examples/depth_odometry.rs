//! Runs the depth engine on the recordings of ../shared/data/rgbd and prints how far it is from their ground truth, with
//! the first poses made equal and no other alignment. The truth is read after the estimate.

use std::path::{Path, PathBuf};
use std::time::Instant;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use scanstitch::depth_odometry::Effort;
use scanstitch::geometry::Pose3;
use scanstitch::io::trajectory;
use scanstitch::prepared_frame::{FrameLabel, PreparedFrame};
use scanstitch::report::Stage;
use scanstitch::spatial_reconstruction::SpatialReconstruction;
use scanstitch::spatial_settings::SpatialSettings;

struct Recording {
    name: &'static str,
    depth: Vec<PathBuf>,
    intrinsics: Option<[f64; 4]>,
    truth: Vec<Pose3>,
}

/// Processor time of this thread where the system tells (s): other programs do not count.
fn seconds_used(start: Instant) -> f64 {
    let nanoseconds = std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |nanoseconds| nanoseconds * 1e-9)
}

fn numbered(folder: &Path, suffix: &str) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .map(|entries| entries.filter_map(|entry| Some(entry.ok()?.path())).collect())
        .unwrap_or_default();
    files.retain(|path| path.to_string_lossy().ends_with(suffix));
    let number = |path: &PathBuf| -> u64 {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.chars().filter(char::is_ascii_digit).collect::<String>().parse().unwrap_or(0)
    };
    files.sort_by_key(number);
    files
}

fn matrix_pose(rows: &[f64]) -> Pose3 {
    let matrix = Matrix3::from_fn(|row, column| rows[4 * row + column]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
    Isometry3::from_parts(Translation3::new(rows[3], rows[7], rows[11]), rotation)
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().filter_map(|token| token.parse().ok()).collect()
}

fn apartment(root: &Path, name: &'static str) -> Recording {
    let folder = root.join(name);
    let truth = trajectory::read(&std::fs::read(folder.join("GT_pose.npy")).unwrap()).unwrap();
    let flip = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let truth = truth.poses().unwrap().iter().map(|pose| pose * flip).collect();
    Recording { name, depth: numbered(&folder.join("depth"), ".png"), intrinsics: None, truth }
}

fn fusion_demo(root: &Path) -> Recording {
    let folder = root.join("fusion_demo50/rgbd-frames");
    let depth = numbered(&folder, ".depth.png");
    let truth = numbered(&folder, ".pose.txt")
        .iter()
        .map(|path| matrix_pose(&numbers(&std::fs::read_to_string(path).unwrap())))
        .collect();
    Recording { name: "fusion_demo50", depth, intrinsics: Some([585.0, 585.0, 320.0, 240.0]), truth }
}

fn redwood(root: &Path) -> Recording {
    let folder = root.join("redwood5");
    let log = numbers(&std::fs::read_to_string(folder.join("odometry.log")).unwrap());
    let truth = log.chunks_exact(19).map(|pose| matrix_pose(&pose[3..])).collect();
    let depth = numbered(&folder.join("depth"), ".png");
    Recording { name: "redwood5", depth, intrinsics: Some([525.0, 525.0, 319.5, 239.5]), truth }
}

/// Which frames of a recording are run.
#[derive(Clone, Copy)]
enum Choice {
    Every(usize),
    TwoThirds(u64),
    /// All, walked to and fro so many times.
    ToAndFro(usize),
}

impl Choice {
    fn keeps(self, index: usize) -> bool {
        match self {
            Self::Every(stride) => index.is_multiple_of(stride),
            Self::ToAndFro(_) => true,
            Self::TwoThirds(seed) => {
                let mixed = (index as u64 + 1000 * seed + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                index == 0 || (mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 33 & 0xFFFF < 43_690
            }
        }
    }

    fn of<T: Clone>(self, all: &[T]) -> Vec<T> {
        let kept = all.iter().enumerate().filter(|(index, _)| self.keeps(*index)).map(|(_, item)| item.clone());
        let mut kept: Vec<T> = kept.collect();
        if let Self::ToAndFro(times) = self {
            let there = kept.clone();
            for time in 1..times {
                let way: Vec<T> = if time % 2 == 1 { there.iter().rev().cloned().collect() } else { there.clone() };
                kept.extend(way);
            }
        }
        kept
    }
}

fn main() {
    let root = PathBuf::from("../shared/data/rgbd");
    if !root.is_dir() {
        eprintln!("skipped: ../shared/data is absent");
        return;
    }
    let argument = |name: &str| std::env::args().skip_while(|argument| argument != name).nth(1);
    let verbose = std::env::args().any(|argument| argument == "--frames");
    let effort = if std::env::args().any(|argument| argument == "--quick") { Effort::Quick } else { Effort::Thorough };
    let every = argument("--every").and_then(|number| number.parse().ok()).unwrap_or(1);
    let seed = argument("--two-thirds").and_then(|number| number.parse().ok());
    let times = argument("--to-and-fro").and_then(|number| number.parse().ok());
    let choice = times.map(Choice::ToAndFro).or(seed.map(Choice::TwoThirds)).unwrap_or(Choice::Every(every));
    let recordings = [
        apartment(&root, "apartment_first_floor"),
        apartment(&root, "apartment_second_floor"),
        fusion_demo(&root),
        redwood(&root),
    ];
    for recording in recordings {
        run(&recording, effort, choice, verbose);
    }
}

/// Every so many frames of a recording, and how far the estimate is from the truth.
fn run(recording: &Recording, effort: Effort, choice: Choice, verbose: bool) {
    let files: Vec<Vec<u8>> =
        choice.of(&recording.depth).iter().map(|path| std::fs::read(path).expect("readable")).collect();
    let [fx, fy, cx, cy] = recording.intrinsics.unwrap_or_default();
    let settings = SpatialSettings { effort, fx, fy, cx, cy, ..SpatialSettings::default() };
    let mut reconstruction = SpatialReconstruction::new(settings).expect("sound settings");
    let began = Instant::now();
    let start = seconds_used(began);
    let (mut preparing, mut registering) = (0.0, 0.0);
    for (index, bytes) in files.iter().enumerate() {
        let start = seconds_used(began);
        let preparation = reconstruction.begin("frame", bytes).expect("a depth image");
        let label = FrameLabel { name: index.to_string(), index, time: None };
        let frame = PreparedFrame::from_depth(preparation, label, bytes, None).expect("a depth image");
        let prepared = seconds_used(began);
        reconstruction.add(frame).expect("in order");
        while reconstruction.step().stage != Stage::Done {}
        preparing += prepared - start;
        registering += seconds_used(began) - prepared;
    }
    reconstruction.finish();
    while reconstruction.step().stage != Stage::Done {}
    let registered = seconds_used(began);
    let num_points = reconstruction.map().len();
    let stitching = seconds_used(began) - registered;

    let truth: Vec<Pose3> = choice.of(&recording.truth);
    let truth: Vec<Pose3> = truth.iter().map(|pose| truth[0].inverse() * pose).collect();
    let poses = reconstruction.poses();
    let error = |index: usize| (poses[index].translation.vector - truth[index].translation.vector).norm();
    let mut worst = ((0.0f64, 0), (0.0f64, 0));
    let mut counts = [0; 3];
    for index in 0..poses.len() {
        let previous = index.saturating_sub(1);
        let (step, true_step) = (poses[previous].inverse() * poses[index], truth[previous].inverse() * truth[index]);
        let off = true_step.inverse() * step;
        let (moved, turned) = (off.translation.vector.norm(), off.rotation.angle().to_degrees());
        if moved > worst.0.0 {
            worst.0 = (moved, index);
        }
        if turned > worst.1.0 {
            worst.1 = (turned, index);
        }
        let estimate = &reconstruction.estimates()[index];
        counts[estimate.verdict.status as usize] += 1;
        if verbose {
            let last = estimate.registration.as_ref().map(|r| (r.last.inlier_rmse, r.history.len(), r.fitness));
            println!(
                "{index:3} error {:.4} m, step off {moved:.4} m {turned:.3} deg; {:?}, agreement {:.3}, overlap {:.3}, \
                 {last:.4?} {}",
                error(index),
                estimate.verdict.status,
                estimate.verdict.agreement,
                estimate.overlap,
                estimate.verdict.reason
            );
        }
    }
    let count = poses.len() as f64;
    println!(
        "{}, {} frames, {:?}: mean L2 {:.4} m, last {:.4} m, worst step {:.3} m (frame {}) and {:.2} deg (frame {}); \
         good, doubtful, lost {counts:?}; ms a frame: prepare {:.1}, register {:.1}, stitch {:.1}, all {:.1}; map of {} points",
        recording.name,
        poses.len(),
        reconstruction.quantisation(),
        (0..poses.len()).map(error).sum::<f64>() / count,
        error(poses.len() - 1),
        worst.0.0,
        worst.0.1,
        worst.1.0,
        worst.1.1,
        1000.0 * preparing / count,
        1000.0 * registering / count,
        1000.0 * stitching / count,
        1000.0 * (registered + stitching - start) / count,
        num_points
    );
}
