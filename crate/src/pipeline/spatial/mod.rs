//! The whole run in space: prepared frames in, trajectory and map out, one frame after the other.

mod azimuth_times;
mod continuity;
mod flattened;
mod focal_length;
mod hypotheses;
mod map;
mod moved;
mod pose_history;
mod result;
mod stitched_map;
mod stored_frames;
mod value_evidence;

use std::collections::VecDeque;

use glam::DVec3;

pub use self::flattened::Floor;
use self::hypotheses::{Hypotheses, QuantisationHypothesis};
use self::moved::Moved;
use self::pose_history::PoseHistory;
use self::stitched_map::StitchedMap;
use self::stored_frames::{Frame, StoredFrames};
use self::value_evidence::{Objection, ValueEvidence};
use crate::error::{Error, Result};
use crate::geometry::{PointCloud, Pose3};
use crate::graph::loops::spatial::LoopReport;
use crate::io::intrinsics::Intrinsics;
use crate::io::trajectory::Contents;
use crate::odometry::assessment::{Assessment, Status};
use crate::odometry::depth::{SpatialEstimate, UnresolvedFrames};
use crate::pipeline::prepared_frame::{
    DecodeConfig, DepthDecodeConfig, FrameNote, PreparedFrame, Surfaces, set_intrinsics,
};
use crate::pipeline::reference::Reference;
use crate::pipeline::report::{Progress, Stage};
use crate::pipeline::spatial_report::{SpatialResult, with_origin};
use crate::pipeline::spatial_settings::{Method, Quantisation, SpatialSettings};
use crate::pipeline::suggestion::Suggestion;

/// A reconstruction in space.
///
/// [`begin`](Self::begin) reads the first frame and returns the configuration for the preparation of frames; prepared frames are
/// [added](Self::add) in their order, and [`step`](Self::step) registers one after the other. After the last one,
/// call [`finish`](Self::finish) and step until done: frames that were not found are tried again, and the last loop is closed. What is known so far may be asked for at any time, and
/// more frames may be added to a finished run.
pub struct SpatialReconstruction {
    settings: SpatialSettings,
    decode_config: Option<DecodeConfig>,
    waiting: VecDeque<PreparedFrame>,
    frames: StoredFrames,
    hypotheses: Hypotheses,
    history: PoseHistory,
    reference: Option<Reference>,
    notes: Vec<FrameNote>,
    value_evidence: ValueEvidence,
    stitched: Option<StitchedMap>,
    moved: Moved,
    /// Whether it has been said that no frame will follow.
    is_complete: bool,
    /// Whether what comes after the last frame has been done.
    is_finished: bool,
}

impl SpatialReconstruction {
    /// A reconstruction without frames.
    ///
    /// # Errors
    /// When a setting is out of its limits.
    pub fn new(settings: SpatialSettings) -> Result<Self> {
        settings.validate()?;
        Ok(Self {
            settings,
            decode_config: None,
            waiting: VecDeque::new(),
            frames: StoredFrames::default(),
            hypotheses: Hypotheses::default(),
            history: PoseHistory::default(),
            reference: None,
            notes: Vec::new(),
            value_evidence: ValueEvidence::default(),
            stitched: None,
            moved: Moved::default(),
            is_complete: false,
            is_finished: false,
        })
    }

    /// Sets the camera and the depth scale of a file beside the images, as far as the settings have none.
    ///
    /// # Errors
    /// After [`begin`](Self::begin): frames have been prepared with another camera.
    pub fn set_intrinsics(&mut self, intrinsics: Intrinsics) -> Result<()> {
        set_intrinsics(&mut self.settings, self.decode_config.as_ref(), intrinsics)
    }

    /// Reads the first file, a depth image or a cloud, given as its bytes, and returns the configuration for the preparation of
    /// frames. Only the first call has an effect.
    ///
    /// # Errors
    /// When it is neither, holds nothing, or the settings make no camera.
    pub fn begin(&mut self, name: &str, first: &[u8]) -> Result<&DecodeConfig> {
        if self.decode_config.is_none() {
            let decode_config = DecodeConfig::new(&self.settings, name, first)?;
            self.hypotheses = Hypotheses::new(&decode_config)?;
            self.decode_config = Some(decode_config);
        }
        self.decode_config.as_ref().ok_or_else(not_begun)
    }

    /// The configuration for preparing frames, after [`begin`](Self::begin). It asks for less work once the data have decided how
    /// depth was quantised, or that the colours do not belong to its pixels; frames prepared with an earlier one stay valid.
    pub fn decode_config(&self) -> Option<&DecodeConfig> {
        self.decode_config.as_ref()
    }

    /// Adds the next frame to those that wait to be registered.
    ///
    /// # Errors
    /// Before [`begin`](Self::begin), and when the frame comes before the last one in the recording.
    pub fn add(&mut self, frame: PreparedFrame) -> Result<()> {
        let config = self.decode_config.as_ref().ok_or_else(not_begun)?;
        if matches!(frame.surfaces, Surfaces::Surfels(_)) != (config.settings.method == Method::SurfelMap) {
            let problem = "The frame was prepared for another method";
            return Err(Error::whole(problem, "Prepare it with what `begin` returned").in_file(&frame.label.name));
        }
        let last = self.waiting.back().map(|frame| frame.label.index);
        let last = last.or_else(|| self.frames.last().map(|frame| frame.label.index));
        frame.label.check_order(last)?;
        self.notes.extend(frame.notes.iter().cloned());
        self.waiting.push_back(frame);
        (self.is_complete, self.is_finished) = (false, false);
        self.moved.stop();
        Ok(())
    }

    /// Says that no frame will follow: [`step`](Self::step) then closes a loop that has been seen but once, too. Should one
    /// follow nevertheless, it goes on from there.
    pub fn finish(&mut self) {
        self.is_complete = true;
    }

    /// Does one bounded piece of work: registers a frame, relocalizes one that was not found, or closes a loop.
    pub fn step(&mut self) -> Progress {
        if let Some(frame) = self.waiting.pop_front() {
            let decided = self.hypotheses.register(&frame);
            return self.store(frame, decided);
        }
        if self.is_complete && !self.is_finished && self.hypotheses.relocalize_next() {
            let total = self.frames.len();
            return Progress { stage: Stage::Retry, done: total, total, frame: None };
        }
        if self.is_complete && !self.is_finished {
            if !self.moved.is_searching() {
                self.hypotheses.finish();
            }
            self.is_finished = !self.look_for_moved();
            let total = self.frames.len();
            return Progress { stage: Stage::Loops, done: total, total, frame: None };
        }
        let total = self.frames.len();
        Progress { stage: Stage::Done, done: total, total, frame: None }
    }

    /// Stores a registered frame, after which a reading of the depth may have been `decided`.
    fn store(&mut self, frame: PreparedFrame, decided: Option<Quantisation>) -> Progress {
        self.history.record(&self.poses());
        self.value_evidence.record(&frame.values);
        // What is prepared from now on need not keep another reading open, nor colours that are left out.
        if let Some(config) = &mut self.decode_config {
            config.registers_colors &= !self.hypotheses.have_misaligned_colors();
            if let Some(depth) = &mut config.depth {
                depth.decided = depth.decided.or(decided);
            }
        }
        let mut is_map_stale = self.frames.push(Frame::new(frame.label, frame.map_points));
        for (number, velocity) in self.hypotheses.take_velocities() {
            if let Some(clock) = self.hypotheses.azimuth_clock() {
                self.frames.set_times(number, &clock);
            }
            self.frames.straighten(number, &velocity);
            // That of a frame before this one may be in the map already.
            is_map_stale |= number + 1 < self.frames.len();
        }
        if is_map_stale {
            // The map is one of the frames as they are kept, whenever it is asked for.
            self.stitched = None;
        }
        let done = self.frames.len();
        Progress { stage: Stage::Register, done, total: done + self.waiting.len(), frame: Some(done - 1) }
    }

    /// Sets what to compare with; it is used for nothing else. `num_recorded` is the number of frames of the recording,
    /// whether they could be used or not.
    pub fn set_reference(&mut self, name: &str, contents: Contents, num_recorded: usize) {
        self.reference = Some(Reference { name: name.to_owned(), contents, num_recorded });
    }

    /// Forgets the reference.
    pub fn clear_reference(&mut self) {
        self.reference = None;
    }

    /// What was found of each frame when it was registered.
    pub fn estimates(&self) -> &[SpatialEstimate] {
        self.hypotheses.best().map_or(&[], |hypothesis| &hypothesis.estimates)
    }

    /// How far the pose of each frame is to be trusted, as far as is known now.
    pub fn assessments(&self) -> Vec<Assessment> {
        let mut assessments = continuity::assessments(self.estimates(), self.hypotheses.surfaces_repeat());
        self.hypotheses.outside_majority().iter().for_each(|&frame| assessments[frame].mark_outside_majority());
        if let Some(objection) = self.objection() {
            objection.doubt(&mut assessments);
        }
        if let Some(focal_length) = self.hypotheses.focal_length() {
            focal_length.doubt(&mut assessments);
        }
        assessments
    }

    /// What the values of the depth images say against how they are read.
    fn objection(&self) -> Option<Objection> {
        self.value_evidence.objection(self.decode_config.as_ref()?, &self.poses())
    }

    /// Another focal length than the one that was assumed, if the frames fit each other better with it.
    fn suggested_focal_length(&self) -> Option<Suggestion> {
        self.hypotheses.focal_length()?.suggestion()
    }

    /// Poses `T_world_sensor` of the frames so far; the world is the frame of the first one.
    pub fn poses(&self) -> Vec<Pose3> {
        self.estimates().iter().map(|estimate| estimate.T_world_sensor).collect()
    }

    /// For each frame before this one, the motion of what it gave to the map: from where that lies now, in the world, to where
    /// it lay when this frame was registered, in the frame of the sensor before it.
    pub fn map_before(&self, frame: usize) -> Vec<Pose3> {
        let then = self.history.poses_of_first(frame);
        let Some(T_sensor_then) = then.last().map(Pose3::inverse) else { return Vec::new() };
        let now = self.poses();
        then.iter().zip(&now).map(|(then, now)| T_sensor_then * then * now.inverse()).collect()
    }

    /// The places that were recognised, and what came of it.
    pub fn loop_report(&self) -> LoopReport {
        self.hypotheses.best().map_or_else(LoopReport::default, QuantisationHypothesis::loop_report)
    }

    /// How depth was quantised, as set or as found so far; `None` for clouds.
    pub fn quantisation(&self) -> Option<Quantisation> {
        self.depth()?;
        self.hypotheses.best().map(|hypothesis| hypothesis.quantisation)
    }

    fn depth(&self) -> Option<&DepthDecodeConfig> {
        self.decode_config.as_ref()?.depth.as_ref()
    }

    /// When the frames were taken (s), if that is known of all of them.
    pub fn times(&self) -> Option<Vec<f64>> {
        self.frames.iter().map(|frame| frame.label.time).collect()
    }

    /// What is taken off the coordinates of clouds (m): zero where these begin at the sensor.
    fn origin(&self) -> DVec3 {
        self.decode_config.as_ref().map_or(DVec3::ZERO, DecodeConfig::origin)
    }

    /// The [poses](Self::poses) in the coordinates of the files.
    pub fn file_poses(&self) -> Vec<Pose3> {
        self.poses().iter().map(|pose| with_origin(pose, self.origin())).collect()
    }

    /// The [result](Self::result) in the coordinates of the files.
    pub fn file_result(&self) -> SpatialResult {
        self.result().moved(self.origin())
    }

    /// The [map](Self::map) as a cloud in the coordinates of the files.
    pub fn file_map(&mut self) -> PointCloud {
        let origin = self.origin();
        PointCloud { origin, ..self.map().cloud() }
    }

    /// The frames with uncertain positions, which neither a later frame nor a loop has settled.
    pub fn unresolved(&self) -> Option<UnresolvedFrames> {
        self.hypotheses.unresolved().filter(|_| self.loop_report().num_closed == 0)
    }

    /// Poses of the frames that are at most so doubtful, `None` for the others.
    fn poses_up_to(&self, worst: Status) -> Vec<Option<Pose3>> {
        let believed = |assessment: &Assessment| assessment.status as u8 <= worst as u8;
        self.assessments()
            .iter()
            .zip(self.poses())
            .map(|(assessment, pose)| believed(assessment).then_some(pose))
            .collect()
    }
}

fn not_begun() -> Error {
    Error::whole("A frame is added before the reconstruction has begun", "Call begin first")
}
