//! How far an estimate is from the truth, and how honest it is about it.

use nalgebra::{Isometry3, Matrix3, Matrix6};
use scanstitch::geometry::{Pose3, RigidMotion};
use scanstitch::odometry::assessment::{Assessment, Status};
use scanstitch::odometry::depth::SpatialEstimate;
use scanstitch::pipeline::prepared_frame::{ColorFile, FrameLabel, PreparedFrame};
use scanstitch::pipeline::report::Stage;
use scanstitch::pipeline::spatial::SpatialReconstruction;
use scanstitch::pipeline::spatial_settings::SpatialSettings;

use super::processor_time::seconds_used;
use super::recordings::Recording;
use crate::arguments::flag;

/// What is said of one recording, first poses made equal and no other alignment.
#[derive(Debug, Clone, Default)]
pub struct Score {
    pub frames: usize,
    /// Mean error of all frames that belong to the recording (m).
    pub mean: f64,
    /// Mean error of the good ones (m).
    pub believed_mean: f64,
    /// Error of the last frame (m).
    pub last: f64,
    /// Steps from a good frame to the next good one that are off by more than 0.2 m or 10 degrees, and good frames that
    /// belong nowhere.
    pub wrong: usize,
    /// Frames that are not good though within 5 cm and 3 degrees of where they should be, by the last good frame.
    pub flagged: usize,
    pub doubtful: usize,
    pub lost: usize,
    /// Of the good frames with a covariance, those whose positions lie within its 95 % region, those beyond twice that, and all.
    pub bounded: [usize; 3],
    /// Error of the distance between the first and the last frame (m).
    pub gap: f64,
    /// Number of closed loops.
    pub closed: usize,
    /// Processor time a frame (ms), decoding and preparing included.
    pub milliseconds: f64,
    /// Mean processor time of registering one of frames 20 to 40, and of frames 100 to 120 (ms).
    pub early_and_late: [f64; 2],
}

/// Runs a recording with these settings, but for its camera.
///
/// Also gives the processor time of registering each frame (s).
pub fn reconstruct(recording: &Recording, settings: &SpatialSettings) -> (SpatialReconstruction, Vec<f64>) {
    let [fx, fy, cx, cy] = recording.intrinsics.unwrap_or_default();
    let settings = SpatialSettings { fx, fy, cx, cy, ..settings.clone() };
    let mut reconstruction = SpatialReconstruction::new(settings).expect("sound settings");
    let (mut seconds, mut uncertain) = (Vec::new(), UncertainErrors::default());
    for (index, bytes) in recording.depth.iter().enumerate() {
        let name = format!("{index}.png");
        let decode_config = reconstruction.begin(&name, bytes).expect("a depth image");
        let color = recording.color.get(index).filter(|color| !color.is_empty());
        let color = color.map(|bytes| ColorFile { name: &name, bytes: Ok(bytes) });
        let label = FrameLabel { name: name.clone(), index, time: None };
        let frame = PreparedFrame::from_depth(decode_config, label, bytes, color);
        reconstruction.add(frame.expect("a depth image")).expect("in order");
        let start = seconds_used();
        while reconstruction.step().stage != Stage::Done {}
        seconds.push(seconds_used() - start);
        uncertain.record(&reconstruction, &recording.truth);
    }
    if flag("--uncertain") {
        uncertain
            .errors
            .iter()
            .for_each(|[sigma, error]| println!("{}: uncertain by {sigma:.4} m, off by {error:.4} m", recording.name));
    }
    reconstruction.finish();
    while reconstruction.step().stage != Stage::Done {}
    (reconstruction, seconds)
}

/// The standard deviation (m) that uncertain frames leave to a good one after them, and its actual error (m) from the last frame
/// before them: the first good frame counts whenever others are uncertain.
#[derive(Default)]
struct UncertainErrors {
    errors: Vec<[f64; 2]>,
    frames: Vec<u32>,
}

impl UncertainErrors {
    fn record(&mut self, reconstruction: &SpatialReconstruction, truth: &[Pose3]) {
        let frames = reconstruction.unresolved().map_or_else(Vec::new, |open| open.frames);
        let numbers: Vec<u32> = frames.iter().map(|frame| frame.number).collect();
        let (poses, assessments) = (reconstruction.poses(), reconstruction.assessments());
        let is_good = assessments.last().is_some_and(|assessment| assessment.status == Status::Good);
        let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return };
        if !is_good || numbers == self.frames || truth.len() < poses.len() {
            return;
        }
        self.frames = numbers;
        let (before, now) = (first.number.saturating_sub(1) as usize, poses.len() - 1);
        let moved = |poses: &[Pose3]| poses[before].inverse() * poses[now];
        let error = moved(truth).inverse() * moved(&poses);
        self.errors.extend(last.sigma.map(|sigma| [sigma, error.translation.vector.norm()]));
    }
}

/// One line per frame, with all digits of its pose and assessment, to compare runs before and after a change.
pub fn lines(reconstruction: &SpatialReconstruction) -> String {
    let estimates = reconstruction.estimates().iter().zip(reconstruction.assessments());
    let line = |(estimate, assessment): (&SpatialEstimate, Assessment)| {
        let Isometry3 { rotation, translation } = estimate.T_world_sensor;
        let (coords, in_map) = (rotation.coords.as_slice(), estimate.is_in_map);
        format!("{coords:?} {:?} {:?} {in_map} {assessment:?}\n", translation.vector.as_slice(), estimate.overlap)
    };
    estimates.map(line).collect()
}

/// The mean of some of the frames' times (ms): the system's clock of used time is too coarse for one frame.
fn mean(seconds: &[f64], frames: std::ops::Range<usize>) -> f64 {
    let chosen = seconds.get(frames).unwrap_or_default();
    1000.0 * chosen.iter().sum::<f64>() / chosen.len() as f64
}

/// Runs a recording and compares the estimate with the ground truth; `each` prints one line per frame. Returns the run as well.
pub fn score(recording: &Recording, settings: &SpatialSettings, each: bool) -> (Score, SpatialReconstruction) {
    let start = seconds_used();
    let (reconstruction, times) = reconstruct(recording, settings);
    let seconds = seconds_used() - start;
    let (poses, estimates) = (reconstruction.poses(), reconstruction.estimates());
    let assessments = reconstruction.assessments();
    let frames = poses.len();
    let is_good = |index: &usize| assessments[*index].status == Status::Good;
    let belongs = |index: &usize| !recording.strangers.contains(index);
    let first = (0..frames).filter(belongs).find(is_good).unwrap_or(0);
    let truth: Vec<Pose3> = recording.truth.iter().map(|pose| recording.truth[first].inverse() * pose).collect();
    let poses: Vec<Pose3> = poses.iter().map(|pose| poses[first].inverse() * pose).collect();
    let error = |index: usize| (poses[index].translation.vector - truth[index].translation.vector).norm();
    let mean_error = |which: &[usize]| which.iter().map(|&i| error(i)).sum::<f64>() / which.len().max(1) as f64;
    let belonging: Vec<usize> = (0..frames).filter(belongs).collect();
    let believed: Vec<usize> = belonging.iter().copied().filter(is_good).collect();
    let mut score = Score {
        frames,
        early_and_late: [mean(&times, 20..40), mean(&times, 100..120)],
        closed: reconstruction.loop_report().num_closed,
        mean: mean_error(&belonging),
        believed_mean: mean_error(&believed),
        last: error(frames - 1),
        gap: (poses[0].inverse() * poses[frames - 1]).translation.vector.norm()
            - (truth[0].inverse() * truth[frames - 1]).translation.vector.norm(),
        milliseconds: 1000.0 * seconds / frames.max(1) as f64,
        ..Score::default()
    };
    let mut last_good = first;
    for index in 0..frames {
        let step = poses[last_good].inverse() * poses[index];
        let off = (truth[last_good].inverse() * truth[index]).inverse() * step;
        let (moved, turned) = (off.translation.vector.norm(), off.rotation.angle().to_degrees());
        let status = assessments[index].status;
        if each {
            println!(
                "  {index:3} error {:.3} m, step off {moved:.3} m {turned:.2} deg; {status:?} agreement {:.3} overlap \
                 {:.2}{} {}",
                error(index),
                assessments[index].agreement,
                estimates[index].overlap,
                if belongs(&index) { "" } else { " STRANGER" },
                assessments[index].reason
            );
        }
        match status {
            Status::Good if !belongs(&index) => score.wrong += 1,
            Status::Good => {
                score.wrong += usize::from(moved > 0.2 || turned > 10.0);
                last_good = index;
            }
            Status::Doubtful => score.doubtful += 1,
            Status::Lost => score.lost += 1,
        }
        if let (Status::Good, true, Some(covariance)) = (status, index > 0, estimates[index].covariance) {
            let of_first = |poses: &[Pose3]| poses[0].inverse() * poses[index];
            let squared = squared_distance(&covariance, &of_first(&poses), &of_first(&recording.truth));
            score.bounded[0] += usize::from(squared < CHI_SQUARED_95);
            score.bounded[1] += usize::from(squared > 4.0 * CHI_SQUARED_95);
            score.bounded[2] += 1;
        }
        score.flagged += usize::from(status != Status::Good && belongs(&index) && moved < 0.05 && turned < 3.0);
    }
    (score, reconstruction)
}

/// What 95 of 100 squared Mahalanobis distances of a position stay below.
const CHI_SQUARED_95: f64 = 7.815;

/// The squared Mahalanobis distance of a position from the true one.
fn squared_distance(covariance: &Matrix6<f64>, pose: &Pose3, truth: &Pose3) -> f64 {
    let adjoint = Pose3::from(pose.translation).inverse().adjoint();
    let covariance = (adjoint * covariance * adjoint.transpose()).fixed_view::<3, 3>(3, 3).into_owned();
    let error = truth.translation.vector - pose.translation.vector;
    // Without the least noise the first frames' covariance has no inverse.
    (covariance + Matrix3::identity() * 1e-12)
        .cholesky()
        .map_or(f64::INFINITY, |factor| error.dot(&factor.solve(&error)))
}
