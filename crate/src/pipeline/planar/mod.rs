//! The whole run: scans in, trajectory and map out, one bounded piece of work after the other.

mod long;
mod measured_motion;

use std::rc::Rc;

use nalgebra::{Matrix3, Vector2};

use crate::error::{Error, Result};
use crate::evaluation::sharpness::{Sharpness, SharpnessMeter};
use crate::evaluation::trajectory_error::{PlanarPoint, TrajectoryError, planar_error};
use crate::geometry::{PointCloud, Pose2, Pose3};
use crate::graph::joint_scan_registration::{Node, PoseGraph, edges_between};
use crate::io::laser_log::LaserLog;
use crate::io::laser_log::stamps::{Stamps, stamps};
use crate::io::trajectory::{Trajectory, in_space, tum_text};
use crate::map::local::MetricName;
use crate::map::local::{LocalMap, StitchedMap};
use crate::map::occupancy_grid::OccupancyGrid;
use crate::odometry::assessment::Status;
use crate::odometry::planar::information::without_normals_noise;
use crate::odometry::planar::{FrameEstimate, MeasuredMotion, Odometry};
use crate::pipeline::odometry_check::{CheckedOdometry, check_odometry};
use crate::pipeline::prepared_frame::FrameLabel;
use crate::pipeline::recorded_scan::{RecordedScan, first_guesses, in_sensor_frame};
use crate::pipeline::report::{AddedLog, FrameResult, PlanarPose, Progress, ReconstructionResult, Stage};
use crate::pipeline::settings::{OdometrySource, Settings, Strategy};
use crate::preprocess::clean::{CleaningReport, RangeLimits, clean, range_limit};
use crate::preprocess::planar_scan::PlanarScan;
use crate::registration::factors::{PointToPlane, PointToPoint};
use crate::registration::icp::{IcpOptions, IterationRecord, Source};
use crate::registration::target::{OrientedTarget, PointTarget};
use long::{LONG_SEQUENCE, LongSequence};

/// Points that look for partners in one piece of work: a few milliseconds.
const POINTS_A_STEP: usize = 20_000;
/// The joint solution of a long sequence starts close to its end, and one iteration takes long.
const LONG_ITERATIONS: usize = 8;

/// A reconstruction of planar scans.
///
/// Add scans, call [`step`](Self::step) until it says [`Stage::Done`], ask for the [`result`](Self::result) at any time.
pub struct Reconstruction {
    settings: Settings,
    names: Vec<String>,
    recorded: Vec<RecordedScan>,
    reference: Option<(String, Trajectory)>,
    odometry: Option<(String, Trajectory)>,
    run: Option<Run>,
}

/// What a run has come to.
struct Run {
    num_scans: usize,
    /// Where the robot is, as seen from the laser of each scan.
    T_laser_robot: Vec<Pose2>,
    /// The motion of the laser from the scan before to each, where odometry gives it.
    motions: Vec<Option<MeasuredMotion>>,
    /// Whether the poses in the log are that motion: then they are nothing to compare with.
    uses_poses_in_log: bool,
    /// What was said of the odometry from a file of its own.
    checked_odometry: Option<CheckedOdometry>,
    /// What is worth knowing of the measured motion, in whole sentences.
    odometry_notes: Vec<String>,
    /// For each frame the certain piece of the map that it belongs to.
    pieces: Vec<usize>,
    /// The range that many returns share, taken for the sensor's limit (m).
    detected_limit: Option<f64>,
    /// The scans registered so far, cleaned, and what that left out.
    scans: Vec<Rc<PlanarScan>>,
    cleaning: Vec<CleaningReport>,
    odometry: Odometry,
    /// Without the pairs of points, which take more memory than the scans.
    estimates: Vec<FrameEstimate>,
    /// What each frame's registration tells of its pose; see [`without_normals_noise`].
    informations: Vec<Matrix3<f64>>,
    poses: Vec<Pose2>,
    /// Keyframes and loops, where there are many scans.
    long: Option<LongSequence>,
    joint: Option<Joint>,
    meter: Option<SharpnessMeter>,
    sharpness: Option<Sharpness>,
    stage: Stage,
}

/// The joint solution and the frames that are its nodes.
struct Joint {
    frames: Vec<usize>,
    targets: JointTargets,
    graph: PoseGraph<Pose2>,
}

enum JointTargets {
    Points(Vec<PointTarget<2>>),
    Oriented(Vec<OrientedTarget<2>>),
}

impl Reconstruction {
    /// A reconstruction without scans.
    ///
    /// # Errors
    /// When a setting is out of its limits.
    pub fn new(settings: Settings) -> Result<Self> {
        settings.validate()?;
        Ok(Self { settings, names: Vec::new(), recorded: Vec::new(), reference: None, odometry: None, run: None })
    }

    /// Keeps the scans and starts over with other settings.
    ///
    /// # Errors
    /// When a setting is out of its limits; the old ones stay.
    pub fn set_settings(&mut self, settings: Settings) -> Result<()> {
        settings.validate()?;
        self.settings = settings;
        self.run = None;
        Ok(())
    }

    /// Adds the next scan and starts over. Returns what cleaning with the present settings drops.
    ///
    /// # Errors
    /// When the cloud is empty or does not lie in the plane z = 0; the scans added before stay.
    pub fn add_scan(&mut self, name: &str, cloud: PointCloud) -> Result<CleaningReport> {
        if cloud.is_empty() {
            return Err(Error::whole("The cloud has no points", "Leave the file out or export it again").in_file(name));
        }
        let report = clean(&cloud.positions, &self.settings.range_limits()).report;
        if report.non_finite == report.num_read {
            let problem = format!("None of its {} points has finite coordinates", report.num_read);
            return Err(Error::whole(problem, "Export the scan again, with the returns that hit nothing left out")
                .in_file(name));
        }
        if !cloud.is_planar() {
            let off = cloud.positions.iter().position(|p| p.z != 0.0 && p.is_finite()).unwrap_or(0);
            let problem = format!(
                "This is a cloud in space, not a planar scan: point {} has z = {}",
                off + 1,
                f64::from(cloud.positions[off].z) + cloud.origin.z
            );
            return Err(Error::whole(problem, "Give planar laser scans, with z = 0 for every point").in_file(name));
        }
        in_sensor_frame(&cloud).map_err(|error| error.in_file(name))?;
        self.names.push(name.to_owned());
        self.recorded.push(RecordedScan::of_cloud(cloud));
        self.run = None;
        Ok(report)
    }

    /// Adds all scans of a log, under the name of the file and their number from 0, and starts over. The poses in the log
    /// are compared with where there is no other reference; see [`Settings::odometry`] for the only other use of them.
    pub fn add_log(&mut self, name: &str, log: &LaserLog) -> AddedLog {
        self.names.extend(log.scans.iter().map(|scan| format!("{name} #{}", scan.number)));
        self.recorded.extend(RecordedScan::of_log(log));
        self.run = None;
        let has_poses = log.scans.iter().all(|scan| scan.reference.is_some());
        AddedLog { num_scans: log.scans.len(), has_poses, losses: log.losses.clone(), notes: log.notes.clone() }
    }

    /// Number of scans.
    pub fn num_scans(&self) -> usize {
        self.recorded.len()
    }

    /// Sets the trajectory that the result is compared with. It is used for nothing else.
    pub fn set_reference(&mut self, name: &str, reference: Trajectory) {
        self.reference = Some((name.to_owned(), reference));
    }

    /// Sets the odometry that a scan's first guess comes from, as the settings ask for it, and starts over.
    ///
    /// # Errors
    /// When it has no headings; the one set before stays.
    pub fn set_odometry(&mut self, name: &str, odometry: Trajectory) -> Result<()> {
        if odometry.orientations.is_none() {
            let remedy = "Give rows of id x y theta, or TUM: t x y z qx qy qz qw";
            return Err(Error::whole("These positions have no headings, so they are no odometry", remedy).in_file(name));
        }
        self.odometry = Some((name.to_owned(), odometry));
        self.run = None;
        Ok(())
    }

    /// Forgets the odometry and starts over.
    pub fn clear_odometry(&mut self) {
        self.odometry = None;
        self.run = None;
    }

    /// Forgets the reference.
    pub fn clear_reference(&mut self) {
        self.reference = None;
    }

    /// Does one bounded piece of work: one frame, or a part of the joint solution.
    pub fn step(&mut self) -> Progress {
        let Self { settings, recorded, odometry, run, .. } = self;
        let run = run.get_or_insert_with(|| Run::new(settings, recorded, odometry.as_ref()));
        match run.stage {
            Stage::Register => run.register_next(&recorded[run.poses.len()], settings),
            Stage::Loops => run.advance_loops(settings),
            Stage::Joint => run.advance_joint(settings),
            Stage::Evaluate => run.evaluate(),
            // Frames are tried again in space alone.
            Stage::Retry | Stage::Done => run.progress(None),
        }
    }

    /// What is known so far.
    pub fn result(&self) -> ReconstructionResult {
        let mut notes = Vec::new();
        let comparison = self.comparison().unwrap_or_else(|error| {
            notes.push(error.to_string());
            None
        });
        if self.names.len() == 1 {
            notes.push(format!("{} is the only scan: it makes a map, but no motion.", self.names[0]));
        }
        if let Some(limit) = self.run.as_ref().and_then(|run| run.detected_limit) {
            notes.push(format!("Returns at {limit:.2} m were taken for the sensor's range limit and dropped."));
        }
        notes.extend(self.run.iter().flat_map(|run| run.odometry_notes.clone()));
        notes.extend(self.stamps().note);
        let checked = self.run.as_ref().and_then(|run| run.checked_odometry.as_ref());
        notes.extend(checked.iter().flat_map(|checked| checked.refusal.iter().chain(&checked.notes)).cloned());
        ReconstructionResult {
            version: env!("CARGO_PKG_VERSION"),
            settings: self.settings.clone(),
            frames: self.frames_from(0),
            joint_history: self.joint().map_or_else(Vec::new, |joint| joint.graph.history().to_vec()),
            sharpness: self.run.as_ref().and_then(|run| run.sharpness),
            comparison,
            odometry_refusal: checked.and_then(|checked| checked.refusal.clone()),
            notes,
        }
    }

    /// What is known of the frames from this one on, as far as the run has come.
    pub fn frames_from(&self, first: usize) -> Vec<FrameResult<PlanarPose, CleaningReport>> {
        self.run.iter().flat_map(|run| run.frame_results(self.labels(), first)).collect()
    }

    /// Iterations of a frame's registration; empty where there was none.
    pub fn history(&self, frame: usize) -> &[IterationRecord] {
        let estimate = self.run.as_ref().and_then(|run| run.estimates.get(frame));
        estimate.and_then(|estimate| estimate.registration.as_ref()).map_or(&[], |registration| &registration.history)
    }

    /// The map of all frames that are not lost, as far as the run has come.
    pub fn map(&self) -> StitchedMap {
        self.map_from(0)
    }

    /// The part of the map that the frames from this one on make.
    pub fn map_from(&self, first: usize) -> StitchedMap {
        let Some(run) = &self.run else { return StitchedMap::default() };
        let believed = run.believed().skip_while(|&frame| frame < first);
        StitchedMap::new(believed.map(|frame| (frame as u32, run.scans[frame].as_ref(), run.poses[frame])))
    }

    /// How many points each of the frames from this one on has in the map.
    pub fn map_sizes_from(&self, first: usize) -> Vec<u32> {
        let size = |run: &Run, frame| run.believed_pose(frame).map_or(0, |_| run.scans[frame].points.len() as u32);
        self.run.iter().flat_map(|run| (first..run.poses.len()).map(|frame| size(run, frame))).collect()
    }

    /// What is free and what is occupied, by all frames that are not lost, in cells of this side (m).
    pub fn occupancy_grid(&self, resolution: f64) -> OccupancyGrid {
        let placed: Vec<(&PlanarScan, Pose2)> = self.run.iter().flat_map(Run::placed).collect();
        OccupancyGrid::new(&placed, resolution)
    }

    /// `T_world_sensor` of every frame so far; a lost one's is a prediction. Where a log tells how the laser sits on its
    /// robot, it is the robot whose poses these are, and its first one is the world.
    pub fn poses(&self) -> Vec<Pose2> {
        let run = self.run.iter();
        run.flat_map(|run| (0..run.poses.len()).map(|frame| run.pose_of_robot(frame))).collect()
    }

    /// The same in space.
    pub fn poses_in_space(&self) -> Vec<Pose3> {
        self.poses().iter().map(in_space).collect()
    }

    /// The time of every scan (s), or its number in the log where there are no times and some numbers are missing.
    pub fn stamps(&self) -> Stamps {
        let times: Vec<Option<f64>> = self.recorded.iter().map(|scan| scan.time).collect();
        let found = stamps(&times);
        let has_gaps = self.is_one_log() && self.recorded.iter().enumerate().any(|(frame, scan)| scan.index != frame);
        let numbers = || has_gaps.then(|| self.recorded.iter().map(|scan| scan.index as f64).collect());
        Stamps { times: found.times.or_else(numbers), note: found.note }
    }

    /// The trajectory as TUM writes it: time or number of the frame, x y z qx qy qz qw, a line a frame.
    pub fn trajectory_tum(&self) -> String {
        tum_text(self.stamps().times.as_deref(), &self.poses_in_space())
    }

    /// Pairs of a frame's points and their partners in the scans it is registered to, under the present poses, in the
    /// world frame (m). Empty for the first frame and for lost ones.
    pub fn correspondences(&self, frame: usize) -> Vec<[Vector2<f64>; 2]> {
        self.run.as_ref().map_or_else(Vec::new, |run| run.correspondences(frame, &self.settings))
    }

    /// The poses that a log holds for its scans, if that one log is all there is.
    fn poses_in_logs(&self) -> Option<(String, Trajectory)> {
        let poses = self.recorded.iter().map(|scan| scan.reference.as_ref().map(in_space));
        let poses = poses.collect::<Option<Vec<Pose3>>>().filter(|poses| !poses.is_empty())?;
        self.is_one_log().then(|| ("the poses in the log".to_owned(), Trajectory::from_poses(&poses)))
    }

    /// Whether the scans are those of one log, whose numbers ascend.
    fn is_one_log(&self) -> bool {
        self.recorded.windows(2).all(|pair| pair[0].index < pair[1].index)
    }

    fn labels(&self) -> impl Iterator<Item = FrameLabel> {
        let named = self.names.iter().zip(&self.recorded).enumerate();
        named.map(|(index, (name, scan))| FrameLabel { name: name.clone(), index, time: scan.time })
    }

    fn joint(&self) -> Option<&Joint> {
        self.run.as_ref()?.joint.as_ref()
    }

    fn comparison(&self) -> Result<Option<TrajectoryError<PlanarPoint>>> {
        let Some(run) = &self.run else { return Ok(None) };
        let in_logs = self.poses_in_logs().filter(|_| !run.uses_poses_in_log);
        let Some((name, reference)) = self.reference.as_ref().or(in_logs.as_ref()) else { return Ok(None) };
        if run.poses.len() < self.names.len() {
            return Ok(None);
        }
        let estimate: Vec<Option<Pose2>> =
            (0..run.poses.len()).map(|frame| run.believed_pose(frame).map(|_| run.pose_of_robot(frame))).collect();
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        planar_error(&estimate, &names, self.stamps().times.as_deref(), name, reference).map(Some)
    }
}

impl Run {
    fn new(settings: &Settings, recorded: &[RecordedScan], odometry: Option<&(String, Trajectory)>) -> Self {
        let detected_limit = range_limit(recorded.iter().map(|scan| scan.cloud.positions.as_slice()));
        let limit = detected_limit.unwrap_or(f64::INFINITY);
        let is_asked_for = settings.odometry != OdometrySource::None;
        let checked =
            odometry.filter(|_| is_asked_for).map(|(name, given)| check_odometry(name, recorded, given, limit));
        let given = checked.as_ref().map(|checked| checked.poses.as_slice());
        let scan = |frame: usize| Rc::new(prepare(&recorded[frame], detected_limit, settings).0);
        let options = settings.odometry_options();
        let mut odometry_notes = Vec::new();
        let mut source = settings.odometry;
        if source == OdometrySource::Auto && odometry.is_none() {
            let (are_wheels, note) = measured_motion::log_holds_wheels(recorded, &scan, &options);
            odometry_notes.extend(note);
            source = if are_wheels { OdometrySource::Log } else { OdometrySource::Auto };
        }
        let motions = first_guesses(source, recorded, given);
        let (motions, note) = measured_motion::judged(&motions, &scan, &options);
        odometry_notes.extend(note);
        Self {
            num_scans: recorded.len(),
            T_laser_robot: recorded.iter().map(|scan| scan.T_robot_laser.inverse()).collect(),
            motions,
            uses_poses_in_log: source == OdometrySource::Log,
            checked_odometry: checked,
            odometry_notes,
            pieces: vec![0; recorded.len()],
            detected_limit,
            scans: Vec::new(),
            cleaning: Vec::new(),
            odometry: Odometry::new(
                settings.odometry_options(),
                recorded.first().map_or_else(Pose2::identity, |scan| scan.T_robot_laser),
            ),
            estimates: Vec::new(),
            informations: Vec::new(),
            poses: Vec::new(),
            long: None,
            joint: None,
            meter: None,
            sharpness: None,
            stage: if recorded.is_empty() { Stage::Done } else { Stage::Register },
        }
    }

    fn progress(&self, frame: Option<usize>) -> Progress {
        let (done, total) = match (self.stage, &self.joint) {
            (Stage::Loops, _) => self.long.as_ref().map_or((0, 1), |long| long.closure.progress()),
            (Stage::Register, _) => (self.poses.len(), self.num_scans),
            (Stage::Joint, Some(joint)) => joint.graph.progress(),
            (Stage::Evaluate, _) => self.meter.as_ref().map_or((0, 1), SharpnessMeter::progress),
            _ => (0, 1),
        };
        Progress { stage: self.stage, done, total, frame }
    }

    fn register_next(&mut self, recorded: &RecordedScan, settings: &Settings) -> Progress {
        let frame = self.poses.len();
        let (scan, report) = prepare(recorded, self.detected_limit, settings);
        let scan = Rc::new(scan);
        let mut estimate = self.odometry.register_frame(&scan, self.motions[frame].as_ref());
        self.informations.push(estimate.registration.as_ref().map_or_else(Matrix3::zeros, without_normals_noise));
        if let Some(registration) = &mut estimate.registration {
            registration.correspondences = Vec::new();
        }
        self.scans.push(scan);
        self.cleaning.push(report);
        self.poses.push(estimate.T_world_sensor);
        self.estimates.push(estimate);
        if self.poses.len() == self.num_scans {
            self.stage = match settings.strategy {
                Strategy::Joint if self.believed().count() >= LONG_SEQUENCE => Stage::Loops,
                Strategy::Joint => Stage::Joint,
                _ => Stage::Evaluate,
            };
        }
        self.progress(Some(frame))
    }

    fn advance_loops(&mut self, settings: &Settings) -> Progress {
        let Self { long, estimates, informations, scans, poses, motions, pieces, .. } = self;
        let long = long.get_or_insert_with(|| LongSequence::new(estimates, informations, scans, poses, motions));
        long.closure.advance(&settings.icp_options());
        if long.closure.is_done() {
            let solved = long.closure.solved_poses();
            long.place(&solved, poses);
            *pieces = long.pieces();
            for (estimate, &piece) in estimates.iter_mut().zip(pieces.iter()) {
                if piece != 0 {
                    estimate.assessment.hangs_on_a_doubt();
                }
            }
            self.stage = Stage::Joint;
        }
        self.progress(None)
    }

    fn advance_joint(&mut self, settings: &Settings) -> Progress {
        if self.joint.is_none() {
            let frames = self.long.as_ref().map_or_else(|| self.believed().collect(), |long| long.nodes.clone());
            self.joint = Some(Joint::new(frames, &self.scans, &self.poses, settings, self.long.as_ref()));
        }
        let Some(joint) = &mut self.joint else { return self.progress(None) };
        let mut options = settings.icp_options();
        if self.long.is_some() {
            options.criteria.max_iterations = options.criteria.max_iterations.min(LONG_ITERATIONS);
        }
        if !joint.graph.is_done(&options) {
            joint.advance(&self.scans, &options);
            match &self.long {
                Some(long) => long.place(joint.graph.poses(), &mut self.poses),
                None => {
                    for (&frame, pose) in joint.frames.iter().zip(joint.graph.poses()) {
                        self.poses[frame] = *pose;
                    }
                }
            }
        }
        if joint.graph.is_done(&options) {
            self.stage = Stage::Evaluate;
        }
        self.progress(None)
    }

    fn evaluate(&mut self) -> Progress {
        let mut meter = self.meter.take().unwrap_or_else(|| {
            let placed = self.believed().map(|frame| (Rc::clone(&self.scans[frame]), self.poses[frame]));
            SharpnessMeter::new(placed.collect())
        });
        meter.advance(POINTS_A_STEP);
        if meter.is_done() {
            self.sharpness = meter.sharpness();
            self.stage = Stage::Done;
        } else {
            self.meter = Some(meter);
        }
        self.progress(None)
    }

    /// Indices of the frames that are registered and not lost.
    fn believed(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.poses.len()).filter(|&frame| self.believed_pose(frame).is_some())
    }

    fn placed(&self) -> impl Iterator<Item = (&PlanarScan, Pose2)> + '_ {
        self.believed().map(|frame| (self.scans[frame].as_ref(), self.poses[frame]))
    }

    fn pose_of_robot(&self, frame: usize) -> Pose2 {
        self.poses[frame] * self.T_laser_robot[frame]
    }

    fn believed_pose(&self, frame: usize) -> Option<Pose2> {
        (self.estimates[frame].assessment.status != Status::Lost).then(|| self.poses[frame])
    }

    fn frame_results(
        &self,
        labels: impl Iterator<Item = FrameLabel>,
        first: usize,
    ) -> impl Iterator<Item = FrameResult<PlanarPose, CleaningReport>> {
        labels.zip(&self.cleaning).zip(&self.estimates).skip(first).map(|((label, cleaning), estimate)| {
            let pose = self.pose_of_robot(label.index);
            let piece = self.pieces[label.index];
            FrameResult { piece, ..FrameResult::of_scan(label, *cleaning, estimate, pose) }
        })
    }

    fn correspondences(&self, frame: usize, settings: &Settings) -> Vec<[Vector2<f64>; 2]> {
        let Some(pose) = (frame < self.poses.len()).then(|| self.believed_pose(frame)).flatten() else {
            return Vec::new();
        };
        let earlier: Vec<usize> = self.believed().take_while(|&earlier| earlier < frame).collect();
        let mut map = LocalMap::new(settings.map_capacity(), settings.metric);
        for &earlier in &earlier[earlier.len().saturating_sub(settings.map_capacity())..] {
            map.insert(Rc::clone(&self.scans[earlier]), self.poses[earlier]);
        }
        map.correspondences(&self.scans[frame], &pose, settings.max_correspondence_distance)
    }
}

impl Joint {
    fn new(
        frames: Vec<usize>,
        scans: &[Rc<PlanarScan>],
        poses: &[Pose2],
        settings: &Settings,
        long: Option<&LongSequence>,
    ) -> Self {
        let scans = frames.iter().map(|&frame| &scans[frame]);
        let targets = match settings.metric {
            MetricName::PointToPoint => {
                JointTargets::Points(scans.map(|scan| PointTarget::new(scan.points.clone())).collect())
            }
            MetricName::PointToLine => JointTargets::Oriented(
                scans.map(|scan| OrientedTarget::new(scan.points.clone(), scan.normals.clone())).collect(),
            ),
        };
        let poses: Vec<Pose2> = frames.iter().map(|&frame| poses[frame]).collect();
        let edges = if let Some(long) = long {
            long.edges(&poses)
        } else {
            let positions: Vec<Vector2<f64>> = poses.iter().map(|pose| pose.translation.vector).collect();
            edges_between(&positions, settings.matched_scans)
        };
        let known = long.map_or_else(Vec::new, |long| long.known_motions(&poses));
        Self { frames, targets, graph: PoseGraph::new(poses, edges).with_known_motions(known) }
    }

    fn advance(&mut self, scans: &[Rc<PlanarScan>], options: &IcpOptions) {
        let sources = self.frames.iter().map(|&frame| source(&scans[frame]));
        match &self.targets {
            JointTargets::Points(targets) => {
                let nodes: Vec<_> = sources.zip(targets).map(|(source, target)| Node { source, target }).collect();
                self.graph.advance(&PointToPoint, &nodes, options, POINTS_A_STEP);
            }
            JointTargets::Oriented(targets) => {
                let nodes: Vec<_> = sources.zip(targets).map(|(source, target)| Node { source, target }).collect();
                self.graph.advance(&PointToPlane, &nodes, options, POINTS_A_STEP);
            }
        }
    }
}

/// A scan without what is no measurement, and what that left out.
fn prepare(recorded: &RecordedScan, detected_limit: Option<f64>, settings: &Settings) -> (PlanarScan, CleaningReport) {
    let limits = settings.range_limits();
    let max_range = detected_limit.unwrap_or(f64::INFINITY).min(limits.max_range).min(recorded.max_range);
    let cleaned = clean(&recorded.cloud.positions, &RangeLimits { max_range, ..limits });
    let points = cleaned.positions.iter().map(|p| Vector2::new(f64::from(p.x), f64::from(p.y))).collect();
    (PlanarScan::new(points), cleaned.report)
}

fn source(scan: &PlanarScan) -> Source<'_, Vector2<f64>> {
    Source { points: &scan.points, normals: Some(&scan.normals), sigmas: None }
}
