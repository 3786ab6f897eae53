//! The whole run: scans in, trajectory and map out, one bounded piece of work after the other.

mod anchor;
mod changes;
mod chosen_odometry;
mod counterparts;
mod edit_faults;
mod edited_map;
mod edits;
mod fan;
mod grid_edits;
mod joining;
mod joint;
mod keyframe_graph;
mod localization;
mod map_edits;
mod mending;
pub(in crate::pipeline) mod pairs;
mod particles;
mod plan;
mod run;
mod scan_to_map;
mod scan_unit;
mod scans_at;

use nalgebra::Vector2;

use crate::error::{Error, Result};
use crate::evaluation::trajectory_error::{PlanarPoint, TrajectoryError, planar_error};
use crate::geometry::{PointCloud, Pose2, Pose3, RigidMotion};
use crate::graph::loops::planar::Uncertainty;
pub use crate::graph::loops::planar::{LoopTrial, LoopTrials, TrialOutcome};
use crate::io::laser_log::LaserLog;
use crate::io::laser_log::stamps::{Stamps, stamps};
use crate::io::trajectory::{Contents, Trajectory, in_space, tum_text};
use crate::map::local::StitchedMap;
use crate::map::occupancy_grid::OccupancyGrid;
use crate::pipeline::prepared_frame::FrameLabel;
use crate::pipeline::recorded_scan::{RecordedScan, at_height_of_laser, in_sensor_frame, is_one_log};
use crate::pipeline::report::{AddedLog, FrameResult, PlanarPose, Progress, ReconstructionResult};
use crate::pipeline::settings::{LaserDirection, Settings};
use crate::preprocess::clean::{CleaningReport, clean};
use crate::registration::icp::IterationRecord;
pub use anchor::KnownPlace;
pub use changes::RecordingChanges;
use chosen_odometry::{ChooseOdometry, ChosenOdometry};
pub use edits::{Consequence, Edit, GraphLoop, GraphLoops, RefusedEdit};
pub use grid_edits::edit_grid;
use joining::{BeginJoining, Joining};
pub use localization::{Localization, LocalizationResult, LocatedPose, LocatedScan};
pub use particles::ParticleRun;
pub use plan::{PlacedPlan, PlanPoint};
use run::{LaterRecording, Run};
pub use scan_to_map::ScanToMap;
use scan_unit::ScanUnit;
pub use scans_at::ScanAt;

/// A reconstruction of planar scans.
///
/// Add scans, call [`step`](Self::step) until it says [`Stage::Done`](crate::pipeline::report::Stage::Done), ask for the [`result`](Self::result) at any time.
pub struct Reconstruction {
    settings: Settings,
    names: Vec<String>,
    recorded: Vec<RecordedScan>,
    scan_unit: ScanUnit,
    reference: Option<(String, Contents)>,
    odometry: Option<(String, Trajectory)>,
    /// Set by what may hold odometry, so that an engine which takes clouds alone holds nothing that judges it.
    choose_odometry: Option<ChooseOdometry>,
    begin_joining: Option<BeginJoining>,
    run: Option<Run>,
}

impl Reconstruction {
    /// A reconstruction without scans.
    ///
    /// # Errors
    /// When a setting is out of its limits.
    pub fn new(settings: Settings) -> Result<Self> {
        Ok(Self { begin_joining: Some(Joining::begin), ..Self::without_joining(settings)? })
    }

    /// One that does not search for pieces of the map in each other: they are told of maps of a hundred scans and more alone, and the search
    /// takes room.
    ///
    /// # Errors
    /// When a setting is out of its limits.
    pub fn without_joining(settings: Settings) -> Result<Self> {
        settings.validate()?;
        Ok(Self {
            begin_joining: None,
            settings,
            names: Vec::new(),
            recorded: Vec::new(),
            scan_unit: ScanUnit::default(),
            reference: None,
            odometry: None,
            choose_odometry: None,
            run: None,
        })
    }

    /// Keeps the scans and starts over with other settings.
    ///
    /// # Errors
    /// When a setting is out of its limits; the old ones stay.
    pub fn set_settings(&mut self, settings: Settings) -> Result<()> {
        settings.validate()?;
        if settings.laser_direction != self.settings.laser_direction {
            self.recorded.iter_mut().for_each(RecordedScan::mirror);
        }
        if settings.scan_unit != self.settings.scan_unit {
            self.scan_unit.change(&mut self.recorded, settings.scan_unit);
        }
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
        let is_map = cloud.origin != glam::DVec3::ZERO;
        let cloud = at_height_of_laser(cloud);
        let cloud = if is_map { cloud } else { self.scan_unit.in_metres(cloud, self.settings.scan_unit) };
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
        self.record(std::iter::once(RecordedScan::of_cloud(cloud)));
        Ok(report)
    }

    /// Adds all scans of a log, under the name of the file and their number from 0, and starts over. The poses in the log
    /// are compared with where there is no other reference; see [`Settings::odometry`] for the only other use of them.
    pub fn add_log(&mut self, name: &str, log: &LaserLog) -> AddedLog {
        let corrected = fan::corrected(log, &self.settings);
        let (read, note) = corrected.map_or((None, None), |(log, note)| (Some(log), Some(note)));
        self.names.extend(log.scans.iter().map(|scan| format!("{name} #{}", scan.number)));
        let first = self.recorded.len();
        self.choose_odometry = Some(ChosenOdometry::new);
        self.record(RecordedScan::of_log(read.as_ref().unwrap_or(log)));
        if let [.., before] = &self.recorded[..first] {
            self.recorded[first].begins_recording = !self.recorded[first].continues(before);
        }
        let has_poses = log.scans.iter().all(|scan| scan.reference.is_some());
        let notes = log.notes.iter().cloned().chain(note).collect();
        AddedLog { num_scans: log.scans.len(), has_poses, losses: log.losses.clone(), notes }
    }

    /// Takes scans in, and starts over.
    fn record(&mut self, scans: impl Iterator<Item = RecordedScan>) {
        let first = self.recorded.len();
        self.recorded.extend(scans);
        if self.settings.laser_direction == LaserDirection::Mirrored {
            self.recorded[first..].iter_mut().for_each(RecordedScan::mirror);
        }
        self.run = None;
    }

    /// The settings of the run.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Number of scans.
    pub fn num_scans(&self) -> usize {
        self.recorded.len()
    }

    /// Sets the trajectory that the result is compared with. It is used for nothing else.
    pub fn set_reference(&mut self, name: &str, contents: Contents) {
        self.reference = Some((name.to_owned(), contents));
    }

    /// Sets the odometry that a scan's first guess comes from, as the settings ask for it, and starts over.
    ///
    /// # Errors
    /// When it has no headings; the one set before stays.
    pub fn set_odometry(&mut self, name: &str, odometry: Trajectory) -> Result<()> {
        if odometry.orientations.is_none() {
            let remedy = "Give rows of id x y theta, or TUM: t x y z qx qy qz qw";
            return Err(
                Error::whole("These positions have no headings, so they cannot be odometry", remedy).in_file(name)
            );
        }
        self.odometry = Some((name.to_owned(), odometry));
        self.choose_odometry = Some(ChosenOdometry::new);
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
        let Self { settings, recorded, odometry, choose_odometry, begin_joining, run, .. } = self;
        let odometry = (odometry.as_ref(), *choose_odometry);
        let run = run.get_or_insert_with(|| Run::new(settings, recorded, odometry, *begin_joining));
        run.advance(recorded, settings)
    }

    /// What is known so far.
    pub fn result(&self) -> ReconstructionResult {
        let mut notes = Vec::new();
        let comparison = self.comparison().unwrap_or_else(|error| {
            notes.push(error.to_string());
            None
        });
        notes.extend(comparison.iter().filter_map(|comparison| comparison.hint.clone()));
        if let Some((name, contents)) = &self.reference {
            notes.extend(contents.notes.iter().map(|note| format!("{name}: {note}")));
        }
        if self.names.len() == 1 {
            notes.push(format!("{} is the only scan: it makes a map, but no motion.", self.names[0]));
        }
        if let Some(limit) = self.run.as_ref().and_then(|run| run.detected_limit) {
            notes.push(format!("Returns at {limit:.2} m were taken for the sensor's range limit and dropped."));
        }
        notes.extend(self.run.iter().flat_map(|run| run.chosen_odometry.notes.clone()));
        notes.extend(self.scan_unit.note(self.settings.scan_unit));
        notes.extend(self.stamps().note);
        let checked = self.run.as_ref().and_then(|run| run.chosen_odometry.checked.as_ref());
        notes.extend(checked.iter().flat_map(|checked| checked.refusal.iter().chain(&checked.notes)).cloned());
        notes.extend(self.notes_on_recordings());
        notes.extend(self.run.iter().filter_map(Run::note_on_edits));
        let unconnected = self.unconnected();
        notes.extend(unconnected.clone());
        ReconstructionResult {
            version: env!("CARGO_PKG_VERSION"),
            settings: self.settings.clone(),
            frames: self.frames_from(0),
            joint_history: self.run.as_ref().map_or_else(Vec::new, Run::joint_history),
            sharpness: self.run.as_ref().and_then(|run| run.sharpness),
            comparison,
            odometry_refusal: checked
                .and_then(|checked| checked.refusal.clone())
                .or_else(|| self.run.as_ref().and_then(|run| run.chosen_odometry.mirrored_in_log.clone())),
            unconnected,
            notes,
        }
    }

    /// The file that a recording came from, by its first frame.
    fn name_of_recording(&self, first_frame: usize) -> &str {
        let name = &self.names[first_frame];
        name.rsplit_once(" #").map_or(name.as_str(), |(log, _)| log)
    }

    fn notes_on_recordings(&self) -> Vec<String> {
        let note = |recording: &LaterRecording| {
            let name = self.name_of_recording(recording.first_frame);
            match recording.joined {
                Some((size, piece)) => {
                    format!(
                        "{name} joins the map of the recordings before it: {size} of its scans are in piece {piece} with them."
                    )
                }
                None => format!(
                    "{name} is not joined: no place of the recordings before it was recognised for certain, so the pose of the one \
                     relative to the others is unknown. It may show another building, or too little of this one."
                ),
            }
        };
        self.run.as_ref().map_or_else(Vec::new, Run::later_recordings).iter().map(note).collect()
    }

    /// The certain pieces of the map and what is not known of them, in whole sentences, where there are several.
    fn unconnected(&self) -> Option<String> {
        let sizes = self.run.as_ref()?.sizes_of_pieces();
        let (main, others) = sizes.split_first().filter(|(_, others)| !others.is_empty())?;
        let all: usize = sizes.iter().map(|(_, size)| size).sum();
        let largest = others.iter().map(|(_, size)| size).max()?;
        Some(format!(
            "The map is in {} pieces that are not connected: {} of {all} placed scans are in the main piece, and at most \
             {largest} in another. Poses within a piece are certain; how the pieces lie relative to each other is not known. Each \
             piece of several scans has an occupancy grid of its own.",
            sizes.len(),
            main.1
        ))
    }

    /// Numbers of the certain pieces of the map that are more than one scan, the main one first, whatever it is.
    pub fn pieces(&self) -> Vec<usize> {
        let sizes = self.run.as_ref().map_or_else(Vec::new, Run::sizes_of_pieces);
        let others = sizes.iter().skip(1).filter(|(_, size)| *size > 1);
        sizes.first().into_iter().chain(others).map(|(piece, _)| *piece).collect()
    }

    /// The map of all frames that are not lost, as far as the run has come.
    pub fn map(&self) -> StitchedMap {
        let Some(run) = &self.run else { return StitchedMap::default() };
        StitchedMap::new(run.mapped().map(|frame| (frame as u32, run.scans[frame].as_ref(), run.pose_in_map(frame))))
    }

    /// The points of that part alone (m), world frame.
    pub fn map_points_from(&self, first: usize) -> Vec<[f32; 2]> {
        let Some(run) = &self.run else { return Vec::new() };
        let frames: Vec<usize> = run.mapped().skip_while(|&frame| frame < first).collect();
        let num_points = frames.iter().map(|&frame| run.scans[frame].points.len()).sum();
        let mut points = Vec::with_capacity(num_points);
        for frame in frames {
            let T_map_sensor = run.pose_in_map(frame);
            let moved = run.scans[frame].points.iter().map(|point| T_map_sensor.act(point));
            points.extend(moved.map(|point| [point.x as f32, point.y as f32]));
        }
        points
    }

    /// How many points each of the frames from this one on has in the map.
    pub fn map_sizes_from(&self, first: usize) -> Vec<u32> {
        let size = |run: &Run, frame| if run.is_mapped(frame) { run.scans[frame].points.len() as u32 } else { 0 };
        self.run.iter().flat_map(|run| (first..run.poses.len()).map(|frame| size(run, frame))).collect()
    }

    /// What is known of the frames from this one on, as far as the run has come.
    pub fn frames_from(&self, first: usize) -> Vec<FrameResult<PlanarPose, CleaningReport>> {
        self.run.iter().flat_map(|run| run.frame_results(self.labels(), first)).collect()
    }

    /// Iterations of a frame's registration; empty where there was none.
    pub fn history(&self, frame: usize) -> &[IterationRecord] {
        self.run.as_ref().map_or(&[], |run| run.history(frame))
    }

    /// A frame's registration as the run did it, before all poses were optimised together: for `register` and the ICP lab.
    /// `None` where there was none.
    pub fn scan_to_map(&self, frame: usize) -> Option<ScanToMap> {
        self.run.as_ref().and_then(|run| run.scan_to_map(frame, &self.settings))
    }

    /// What is free and what is occupied in the main piece of the map, by all its frames that are not lost, in cells of this side
    /// (m).
    pub fn occupancy_grid(&self, resolution: f64) -> OccupancyGrid {
        self.occupancy_grid_of(0, resolution)
    }

    /// The same of another piece, empty where there is none of this number: two pieces are not connected, so that they do not fit
    /// in one grid.
    pub fn occupancy_grid_of(&self, piece: usize, resolution: f64) -> OccupancyGrid {
        let run = self.run.as_ref();
        run.map_or_else(|| OccupancyGrid::new(&[], &[], resolution), |run| run.occupancy_grid(piece, resolution))
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
        let has_gaps =
            is_one_log(&self.recorded) && self.recorded.iter().enumerate().any(|(frame, scan)| scan.index != frame);
        let numbers = || has_gaps.then(|| self.recorded.iter().map(|scan| scan.index as f64).collect());
        Stamps { times: found.times.or_else(numbers), note: found.note }
    }

    /// The trajectory as TUM writes it: time or number of the frame, x y z qx qy qz qw, a line a frame.
    pub fn trajectory_tum(&self) -> String {
        tum_text(self.stamps().times.as_deref(), &self.poses_in_space())
    }

    /// How well the frames of a long sequence are known to each other, by the chain and its loops: of frames that are spread
    /// over the way the pairs that are near each other.
    pub fn uncertainties(&self) -> Vec<Uncertainty> {
        self.run.as_ref().map_or_else(Vec::new, Run::uncertainties)
    }

    /// What the search for loops compared, by the frames in the middle of submaps, and the loops that stayed.
    pub fn loop_trials(&self) -> LoopTrials {
        self.run.as_ref().map_or_else(LoopTrials::default, Run::loop_trials)
    }

    /// Pairs of a frame's points and their partners in the scans it is registered to, under the present poses, in the
    /// world frame (m). Empty for the first frame and for lost ones.
    pub fn correspondences(&self, frame: usize) -> Vec<[Vector2<f64>; 2]> {
        self.run.as_ref().map_or_else(Vec::new, |run| run.correspondences(frame, &self.settings))
    }

    /// The poses that logs hold for their scans, if they are one recording: the poses of each begin in a world of its own.
    fn poses_in_logs(&self) -> Option<(String, Trajectory)> {
        let poses = self.recorded.iter().map(|scan| scan.reference.as_ref().map(in_space));
        let poses = poses.collect::<Option<Vec<Pose3>>>().filter(|poses| !poses.is_empty())?;
        let is_one_recording = !self.recorded.iter().any(|scan| scan.begins_recording);
        is_one_recording.then(|| ("the poses in the log".to_owned(), Trajectory::from_poses(&poses)))
    }

    fn labels(&self) -> impl Iterator<Item = FrameLabel> {
        let named = self.names.iter().zip(&self.recorded).enumerate();
        named.map(|(index, (name, scan))| FrameLabel { name: name.clone(), index, time: scan.time })
    }

    fn comparison(&self) -> Result<Option<TrajectoryError<PlanarPoint>>> {
        let Some(run) = &self.run else { return Ok(None) };
        let in_logs = self.poses_in_logs().filter(|_| !run.chosen_odometry.uses_poses_in_log);
        let given = self.reference.as_ref().map(|(name, contents)| (name, &contents.trajectory));
        let in_logs = in_logs.as_ref().map(|(name, trajectory)| (name, trajectory));
        let Some((name, reference)) = given.or(in_logs) else { return Ok(None) };
        if run.poses.len() < self.names.len() {
            return Ok(None);
        }
        // Compared as the run found them: a turn of the map changes no error.
        let T_run_map = run.map_edits.T_map_run().inverse();
        let pose = |frame: usize| run.is_placed(frame).then(|| T_run_map * run.pose_of_robot(frame));
        let estimate: Vec<Option<Pose2>> = (0..run.poses.len()).map(pose).collect();
        let good: Vec<bool> = (0..run.poses.len()).map(|frame| run.is_good(frame)).collect();
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        let mut compared = planar_error(&estimate, &good, &names, self.stamps().times.as_deref(), name, reference)?;
        compared.reference.iter_mut().flatten().for_each(|point| *point = run.map_edits.point_in_map(point));
        Ok(Some(compared))
    }
}
