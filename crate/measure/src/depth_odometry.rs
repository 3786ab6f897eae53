//! Runs the depth engine on the recordings of ../shared/data/rgbd. Prints its error against their ground truth, with the first
//! poses made equal and no other alignment, and the time of each stage. The ground truth is read after the estimate.

use scanstitch::geometry::Pose3;
use scanstitch::odometry::depth::Effort;
use scanstitch::pipeline::prepared_frame::{FrameLabel, PreparedFrame};
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::spatial::SpatialReconstruction;
use scanstitch::pipeline::spatial_settings::SpatialSettings;

use crate::arguments::{argument, flag};
use crate::depth::processor_time::seconds_used;
use crate::depth::recordings::{self, Choice, Recording};

pub fn main() {
    if !recordings::are_there() {
        return;
    }
    let verbose = flag("--frames");
    let effort = if flag("--quick") { Effort::Quick } else { Effort::Thorough };
    let every = argument("--every").and_then(|number| number.parse().ok()).unwrap_or(1);
    let seed = argument("--two-thirds").and_then(|number| number.parse().ok());
    let times = argument("--to-and-fro").and_then(|number| number.parse().ok());
    let choice = times.map(Choice::ToAndFro).or(seed.map(Choice::TwoThirds)).unwrap_or(Choice::Every(every));
    let all =
        [recordings::floor("first"), recordings::floor("second"), recordings::fusion_demo(), recordings::redwood()];
    for recording in all {
        run(&choice.apply(&recording), effort, verbose);
    }
}

/// Error of the estimate of a recording against the ground truth.
fn run(recording: &Recording, effort: Effort, verbose: bool) {
    let [fx, fy, cx, cy] = recording.intrinsics.unwrap_or_default();
    let settings = SpatialSettings { effort, fx, fy, cx, cy, ..SpatialSettings::default() };
    let mut reconstruction = SpatialReconstruction::new(settings).expect("sound settings");
    let start = seconds_used();
    let (mut preparing, mut registering) = (0.0, 0.0);
    for (index, bytes) in recording.depth.iter().enumerate() {
        let start = seconds_used();
        let decode_config = reconstruction.begin("frame", bytes).expect("a depth image");
        let label = FrameLabel { name: index.to_string(), index, time: None };
        let frame = PreparedFrame::from_depth(decode_config, label, bytes, None).expect("a depth image");
        let prepared = seconds_used();
        reconstruction.add(frame).expect("in order");
        while reconstruction.step().stage != Stage::Done {}
        preparing += prepared - start;
        registering += seconds_used() - prepared;
    }
    reconstruction.finish();
    while reconstruction.step().stage != Stage::Done {}
    let registered = seconds_used();
    let num_points = reconstruction.map().len();
    let stitching = seconds_used() - registered;

    let truth: Vec<Pose3> = recording.truth.iter().map(|pose| recording.truth[0].inverse() * pose).collect();
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
        counts[estimate.assessment.status as usize] += 1;
        if verbose {
            let last = estimate.registration.as_ref().map(|r| (r.last.inlier_rmse, r.history.len(), r.fitness));
            println!(
                "{index:3} error {:.4} m, step off {moved:.4} m {turned:.3} deg; {:?}, agreement {:.3}, overlap {:.3}, \
                 {last:.4?} {}",
                error(index),
                estimate.assessment.status,
                estimate.assessment.agreement,
                estimate.overlap,
                estimate.assessment.reason
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
