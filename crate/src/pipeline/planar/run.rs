//! One run over all scans: its state, and its pieces of work in their order.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::rc::Rc;

use nalgebra::Vector2;

use super::chosen_odometry::{ChooseOdometry, ChosenOdometry};
use super::edits::BeforeMending;
use super::joining::{BeginJoining, PieceSearch};
use super::joint::{Joint, POINTS_A_STEP};
use super::keyframe_graph::{KeyframeGraph, motion_between};
use super::map_edits::MapEdits;
use super::scan_to_map::ScanToMap;
use crate::evaluation::sharpness::{Sharpness, SharpnessMeter};
use crate::geometry::Pose2;
use crate::graph::loops::planar::{LoopTrials, Uncertainty};
use crate::io::trajectory::Trajectory;
use crate::map::local::LocalMap;
use crate::odometry::assessment::Status;
use crate::odometry::planar::belief::Finding;
use crate::odometry::planar::information::position_covariance;
use crate::odometry::planar::{BRIEF_ITERATIONS, FrameEstimate, Odometry};
use crate::pipeline::prepared_frame::FrameLabel;
use crate::pipeline::recorded_scan::{RecordedScan, RecordedScans};
use crate::pipeline::report::{FrameResult, PlanarPose, Progress, Stage};
use crate::pipeline::settings::{Settings, Strategy};
use crate::preprocess::clean::{CleaningReport, range_limit};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::icp::IterationRecord;

/// What became of a recording that is not the first one.
pub struct LaterRecording {
    pub first_frame: usize,
    /// How many of its scans lie in one piece with earlier recordings, and the number of that piece; `None` where no piece has both.
    pub joined: Option<(usize, usize)>,
}

/// The state of a run.
pub struct Run {
    num_scans: usize,
    /// Where the robot is, as seen from the laser of each scan.
    pub(super) T_laser_robot: Vec<Pose2>,
    /// The number of the recording of each scan.
    pub(super) recordings: Vec<usize>,
    /// The odometry that it uses.
    pub chosen_odometry: ChosenOdometry,
    /// For each frame the certain piece of the map that it belongs to.
    pieces: Vec<usize>,
    pub(super) before_mending: BeforeMending,
    pub map_edits: MapEdits,
    /// The range that many returns share, taken for the sensor's limit (m).
    pub detected_limit: Option<f64>,
    /// The scans registered so far, cleaned, and what that left out.
    pub scans: Vec<Rc<PlanarScan>>,
    cleaning: Vec<CleaningReport>,
    odometry: Odometry,
    /// Without the pairs of points, which take more memory than the scans, and of the poses on the way the first alone.
    pub(super) estimates: Vec<FrameEstimate>,
    pub poses: Vec<Pose2>,
    /// Keyframes with what connects them; `None` without the joint solution.
    pub(super) graph: Option<KeyframeGraph>,
    /// How pieces that nothing connects are searched for, if they are.
    begin_joining: Option<BeginJoining>,
    joining: Option<Box<dyn PieceSearch>>,
    pub(super) joint: Option<Joint>,
    pub(super) meter: Option<SharpnessMeter>,
    pub sharpness: Option<Sharpness>,
    pub(super) stage: Stage,
}

impl Run {
    /// Prepares a run; looks at the odometry, if there may be any: that of a file, and how it is chosen.
    pub fn new(
        settings: &Settings,
        recorded: &[RecordedScan],
        odometry: (Option<&(String, Trajectory)>, Option<ChooseOdometry>),
        begin_joining: Option<BeginJoining>,
    ) -> Self {
        let detected_limit = range_limit(recorded.iter().map(|scan| scan.cloud.positions.as_slice()));
        let options = settings.odometry_options();
        let limit = detected_limit.unwrap_or(f64::INFINITY);
        let (file, choose_odometry) = odometry;
        let chosen_odometry = choose_odometry.map_or_else(
            || ChosenOdometry::none(recorded.len()),
            |choose| choose(file, &RecordedScans { all: recorded, limit, settings }),
        );
        Self {
            num_scans: recorded.len(),
            recordings: numbers_of_recordings(recorded),
            T_laser_robot: recorded.iter().map(|scan| scan.T_robot_laser.inverse()).collect(),
            odometry: Odometry::new(options, recorded.first().map_or_else(Pose2::identity, |scan| scan.T_robot_laser))
                .with_motion_change(chosen_odometry.model.motion_change),
            chosen_odometry,
            pieces: vec![0; recorded.len()],
            before_mending: BeforeMending::default(),
            map_edits: MapEdits::default(),
            detected_limit,
            scans: Vec::new(),
            cleaning: Vec::new(),
            estimates: Vec::new(),
            poses: Vec::new(),
            graph: None,
            begin_joining,
            joining: None,
            joint: None,
            meter: None,
            sharpness: None,
            stage: if recorded.is_empty() { Stage::Done } else { Stage::Register },
        }
    }

    /// Does one bounded piece of work: one frame, or a part of the loops, of the joint solution or of its evaluation.
    pub fn advance(&mut self, recorded: &[RecordedScan], settings: &Settings) -> Progress {
        match self.stage {
            Stage::Register => return self.register_next(&recorded[self.poses.len()], settings),
            Stage::Loops => self.advance_loops(settings),
            Stage::Joint => self.advance_joint(settings),
            Stage::Evaluate => self.evaluate(),
            // Frames are tried again in space alone.
            Stage::Retry | Stage::Done => {}
        }
        self.progress(None)
    }

    fn progress(&self, frame: Option<usize>) -> Progress {
        let (done, total) = match (self.stage, &self.joint) {
            (Stage::Loops, _) => self.graph.as_ref().map_or((0, 1), |graph| graph.closure.progress()),
            (Stage::Register, _) => (self.poses.len(), self.num_scans),
            (Stage::Joint, Some(joint)) => joint.registration.progress(),
            (Stage::Evaluate, _) => self.meter.as_ref().map_or((0, 1), SharpnessMeter::progress),
            _ => (0, 1),
        };
        Progress { stage: self.stage, done, total, frame }
    }

    fn register_next(&mut self, recorded: &RecordedScan, settings: &Settings) -> Progress {
        let frame = self.poses.len();
        let (scan, report) = recorded.cleaned(self.detected_limit.unwrap_or(f64::INFINITY), settings);
        let scan = Rc::new(scan);
        if recorded.begins_recording {
            self.odometry.begin_recording();
        }
        let model = &self.chosen_odometry.model;
        let as_neighbors = model.as_neighbors(frame);
        let mut estimate = self.odometry.register_frame(&scan, model.steps[frame].as_ref(), as_neighbors.as_ref());
        if let Some(registration) = &mut estimate.registration {
            registration.correspondences = Vec::new();
            registration.trace = registration.trace[..1].to_vec();
            registration.history.shrink_to_fit();
        }
        self.scans.push(scan);
        self.cleaning.push(report);
        self.poses.push(estimate.T_world_sensor);
        self.estimates.push(estimate);
        if self.poses.len() == self.num_scans {
            self.begin_graph(settings);
        }
        self.progress(Some(frame))
    }

    /// Joins the frames to a graph.
    fn begin_graph(&mut self, settings: &Settings) {
        if settings.strategy != Strategy::Joint || self.placed().next().is_none() {
            for frame in (0..self.num_scans).filter(|&frame| self.recordings[frame] > 0) {
                self.estimates[frame].findings.push(Finding::OtherRecording);
            }
            self.doubt_mirrored();
            self.stage = Stage::Evaluate;
            return;
        }
        let of_graph = self.chosen_odometry.model.compare_with_chain(&mut self.estimates);
        self.graph = Some(KeyframeGraph::new(&self.estimates, &self.scans, &self.poses, &of_graph));
        self.stage = Stage::Loops;
    }

    fn advance_loops(&mut self, settings: &Settings) {
        let Some(graph) = &mut self.graph else { return };
        let options = settings.icp_options();
        if !graph.closure.is_done() {
            graph.closure.advance(&options);
            return;
        }
        let is_more = self.joining.as_mut().is_some_and(|joining| joining.advance(graph, &self.scans, &options));
        if is_more {
            return;
        }
        // Once, and again as long as the pieces become fewer: a larger one shows more places.
        let num_before = self.joining.as_ref().map_or(usize::MAX, |joining| joining.num_pieces());
        let next = self.begin_joining.and_then(|begin| begin(graph, &self.scans, &self.recordings));
        self.joining = next.filter(|joining| joining.num_pieces() < num_before);
        if self.joining.is_none() {
            self.end_loops();
        }
    }

    /// Places the frames by the graph and tells its certain pieces apart.
    pub(super) fn end_loops(&mut self) {
        let Some(graph) = &self.graph else { return };
        graph.place(&graph.closure.solved_poses(), &mut self.poses);
        self.pieces = graph.pieces();
        self.before_mending.num_findings = self.estimates.iter().map(|estimate| estimate.findings.len()).collect();
        for frame in graph.in_small_pieces(&self.pieces) {
            self.estimates[frame].findings.push(Finding::SmallPiece);
        }
        self.stage = Stage::Joint;
    }

    /// Doubts every frame of a map that may be a mirror image.
    fn doubt_mirrored(&mut self) {
        if let Some(reason) = self.chosen_odometry.mirror_doubt {
            self.estimates.iter_mut().for_each(|estimate| estimate.findings.push(Finding::Mirrored(reason)));
        }
    }

    fn advance_joint(&mut self, settings: &Settings) {
        let Some(graph) = &mut self.graph else { return };
        let joint = self.joint.get_or_insert_with(|| {
            let joint = Joint::new(graph, &self.scans, &self.poses, settings);
            graph.closure.forget_scans();
            joint
        });
        let mut options = settings.icp_options();
        if graph.is_long() {
            options.criteria.max_iterations = options.criteria.max_iterations.min(BRIEF_ITERATIONS);
        }
        if !joint.registration.is_done(&options) {
            joint.advance(&self.scans, &options);
            graph.place(joint.registration.poses(), &mut self.poses);
        }
        if joint.registration.is_done(&options) {
            joint.end();
            self.chosen_odometry.model.doubt_contradicted_stretches(&self.poses, &mut self.estimates);
            self.doubt_mirrored();
            self.stage = Stage::Evaluate;
        }
    }

    fn evaluate(&mut self) {
        let mut meter = self.meter.take().unwrap_or_else(|| {
            let placed = self.placed().map(|frame| (Rc::clone(&self.scans[frame]), self.poses[frame]));
            SharpnessMeter::new(placed.collect())
        });
        meter.advance(POINTS_A_STEP);
        if meter.is_done() {
            self.sharpness = meter.sharpness();
            self.lay_map();
            self.stage = Stage::Done;
        } else {
            self.meter = Some(meter);
        }
    }

    /// Whether a frame is registered and not lost.
    pub fn is_placed(&self, frame: usize) -> bool {
        self.estimates[frame].assessment().status != Status::Lost
    }

    /// Whether its pose is to be trusted.
    pub fn is_good(&self, frame: usize) -> bool {
        self.estimates[frame].assessment().status == Status::Good
    }

    /// Indices of the frames that are placed.
    pub fn placed(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.poses.len()).filter(|&frame| self.is_placed(frame))
    }

    /// The certain piece of the map that a frame belongs to.
    pub fn piece(&self, frame: usize) -> usize {
        self.pieces[frame]
    }

    /// The certain pieces of the map with the number of frames of each; the main one first.
    pub fn sizes_of_pieces(&self) -> Vec<(usize, usize)> {
        let mut sizes = vec![0; self.pieces.iter().max().map_or(0, |last| last + 1)];
        self.placed().for_each(|frame| sizes[self.pieces[frame]] += 1);
        sizes.into_iter().enumerate().filter(|(_, size)| *size > 0).collect()
    }

    /// What became of each recording after the first; nothing before the pieces are known.
    pub fn later_recordings(&self) -> Vec<LaterRecording> {
        let are_known = self.graph.is_some() && !matches!(self.stage, Stage::Register | Stage::Loops);
        let count = self.recordings.last().filter(|_| are_known).map_or(0, |last| last + 1);
        let mut sizes = vec![BTreeMap::<usize, usize>::new(); count];
        for frame in self.placed().filter(|_| are_known) {
            *sizes[self.recordings[frame]].entry(self.pieces[frame]).or_default() += 1;
        }
        let of = |number: usize| {
            let joined =
                sizes[number].iter().filter(|(piece, _)| sizes[..number].iter().any(|of| of.contains_key(piece)));
            LaterRecording {
                first_frame: self.recordings.partition_point(|&of| of < number),
                joined: joined.map(|(&piece, &size)| (size, piece)).max_by_key(|&(size, piece)| (size, Reverse(piece))),
            }
        };
        (1..count).map(of).collect()
    }

    /// How well frames are known to each other by the graph; nothing without the joint solution.
    pub fn uncertainties(&self) -> Vec<Uncertainty> {
        self.graph.as_ref().map_or_else(Vec::new, KeyframeGraph::uncertainties)
    }

    /// What the search for loops compared; nothing without the joint solution.
    pub fn loop_trials(&self) -> LoopTrials {
        self.graph.as_ref().map_or_else(LoopTrials::default, KeyframeGraph::loop_trials)
    }

    /// The iterations of the joint solution.
    pub fn joint_history(&self) -> Vec<IterationRecord> {
        self.joint.as_ref().map_or_else(Vec::new, |joint| joint.registration.history().to_vec())
    }

    /// Iterations of a frame's registration; empty where there was none.
    pub fn history(&self, frame: usize) -> &[IterationRecord] {
        let registration = self.estimates.get(frame).and_then(|estimate| estimate.registration.as_ref());
        registration.map_or(&[], |registration| &registration.history)
    }

    /// A frame's registration as it was done, to be looked into; `None` where there was none.
    pub fn scan_to_map(&self, frame: usize, settings: &Settings) -> Option<ScanToMap> {
        let estimate = self.estimates.get(frame)?;
        let guess = estimate.registration.as_ref()?.trace[0];
        let mut map = LocalMap::new(estimate.references.len(), settings.metric);
        for (scan, T_world_sensor) in &estimate.references {
            map.insert(Rc::clone(scan), *T_world_sensor);
        }
        Some(ScanToMap::new(&self.scans[frame], &map, &guess))
    }

    /// What is known of each frame so far, from the `first` on.
    pub fn frame_results(
        &self,
        labels: impl Iterator<Item = FrameLabel>,
        first: usize,
    ) -> impl Iterator<Item = FrameResult<PlanarPose, CleaningReport>> {
        labels.zip(&self.cleaning).zip(&self.estimates).skip(first).map(|((label, cleaning), estimate)| {
            let pose = self.pose_of_robot(label.index);
            let piece = self.pieces[label.index];
            let R_map_run = self.map_edits.R_map_run();
            let std = self.deviation(label.index);
            FrameResult { std, piece, ..FrameResult::of_scan(label, *cleaning, estimate, pose, &R_map_run) }
        })
    }

    /// Standard deviations of a frame's pose against the frame placed before it, along the axes of the map.
    fn deviation(&self, frame: usize) -> Option<PlanarPose> {
        let end = if self.is_placed(frame) { frame } else { 0 };
        let before = (0..end).rev().find(|&before| self.is_placed(before))?;
        let (T_before_laser, covariance) = motion_between(before, frame, &self.estimates, &self.chosen_odometry.model)?;
        let T_before_robot = T_before_laser * self.T_laser_robot[frame];
        let R_map_before = (self.map_edits.R_map_run() * self.poses[before]).rotation.to_rotation_matrix();
        let position = R_map_before * position_covariance(&T_before_robot, &covariance) * R_map_before.transpose();
        let [theta, x, y] =
            [covariance[(0, 0)], position[(0, 0)], position[(1, 1)]].map(|variance: f64| variance.max(0.0).sqrt());
        Some(PlanarPose { x, y, theta })
    }

    /// Pairs of a frame's points and their partners in the scans it is registered to, in the world frame (m).
    pub fn correspondences(&self, frame: usize, settings: &Settings) -> Vec<[Vector2<f64>; 2]> {
        if frame >= self.poses.len() || !self.is_placed(frame) {
            return Vec::new();
        }
        let earlier: Vec<usize> = self.placed().take_while(|&earlier| earlier < frame).collect();
        let mut map = LocalMap::new(settings.map_capacity(), settings.metric);
        for &earlier in &earlier[earlier.len().saturating_sub(settings.map_capacity())..] {
            map.insert(Rc::clone(&self.scans[earlier]), self.pose_in_map(earlier));
        }
        map.correspondences(&self.scans[frame], &self.pose_in_map(frame), settings.max_correspondence_distance)
    }
}

/// The number of the recording that each scan belongs to.
fn numbers_of_recordings(scans: &[RecordedScan]) -> Vec<usize> {
    let number = |last: &mut usize, scan: &RecordedScan| {
        *last += usize::from(scan.begins_recording);
        Some(*last)
    };
    scans.iter().scan(0, number).collect()
}
