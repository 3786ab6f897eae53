//! The whole run in space: prepared frames in, trajectory and map out, one frame after the other.

mod continuity;
mod hypotheses;
mod pose_history;
mod range_use;
mod stitched_map;
mod stored_frames;

use std::collections::VecDeque;

use glam::DVec3;

use self::hypotheses::{Hypotheses, QuantisationHypothesis};
use self::pose_history::PoseHistory;
use self::range_use::RangeUse;
use self::stitched_map::StitchedMap;
use self::stored_frames::{Frame, StoredFrames};
use crate::error::{Error, Result};
use crate::evaluation::trajectory_error::{EstimatedFrame, TrajectoryError};
use crate::geometry::{PointCloud, Pose3};
use crate::graph::loops::spatial::LoopReport;
use crate::io::intrinsics::Intrinsics;
use crate::io::trajectory::Contents;
use crate::map::voxel::{VoxelCount, VoxelMap};
use crate::odometry::assessment::{Assessment, Status};
use crate::odometry::depth::{SpatialEstimate, UnresolvedFrames};
use crate::pipeline::assumptions::{Reading, ReadingSetting, confirmation, own_focal_length_of_kinect, suggestion};
use crate::pipeline::prepared_frame::{
    DecodeConfig, DepthDecodeConfig, FrameNote, MapPoints, PreparedFrame, Surfaces, merged, set_intrinsics,
};
use crate::pipeline::reference::Reference;
use crate::pipeline::report::{FrameResult, Progress, SpatialPose, Stage};
use crate::pipeline::spatial_report::{MapSize, SpatialResult, with_origin};
use crate::pipeline::spatial_settings::{Method, Quantisation, SpatialSettings};

/// What is said of colours that are left out of the estimate.
const MISALIGNED_COLORS: &str = "The colours are not registered to the depth images: the outlines of objects do not coincide. The \
                                 poses are estimated from depth alone, and the map shows the colours as they are";

/// What is said of clouds that lie on one another as they are.
const NO_MOTION: &str = "No motion: the clouds share one frame of coordinates, and the map shows them as they are";
/// The same where these may begin at the sensor.
const NO_MOTION_OF_SENSOR: &str = "No motion: the sensor stood still, or the clouds share one frame of coordinates";
/// Clouds rest where none of their points moves further than this (voxels): registrations are finer by a factor of ten.
const MAX_REST: f64 = 0.5;

/// Newest frames that are stitched only when the map is asked for.
const MAX_PENDING_FRAMES: usize = 6;

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
    range_use: RangeUse,
    stitched: Option<StitchedMap>,
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
            range_use: RangeUse::default(),
            stitched: None,
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
    /// depth was quantised; frames prepared with an earlier one stay valid.
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
            let decided = self.hypotheses.register(&frame.surfaces, frame.label.time);
            return self.store(frame, decided);
        }
        if self.is_complete && !self.is_finished && self.hypotheses.relocalize_next() {
            let total = self.frames.len();
            return Progress { stage: Stage::Retry, done: total, total, frame: None };
        }
        if self.is_complete && !self.is_finished {
            self.is_finished = true;
            self.hypotheses.finish();
            let total = self.frames.len();
            return Progress { stage: Stage::Loops, done: total, total, frame: None };
        }
        let total = self.frames.len();
        Progress { stage: Stage::Done, done: total, total, frame: None }
    }

    /// Stores a registered frame, after which a reading of the depth may have been `decided`.
    fn store(&mut self, frame: PreparedFrame, decided: Option<Quantisation>) -> Progress {
        self.history.record(&self.poses());
        self.range_use.record(frame.fills_range);
        // What is prepared from now on need not keep another reading open.
        if let Some(depth) = self.decode_config.as_mut().and_then(|config| config.depth.as_mut()) {
            depth.decided = depth.decided.or(decided);
        }
        let mut is_map_stale = self.frames.push(Frame::new(frame.label, frame.map_points));
        for (number, velocity) in self.hypotheses.take_velocities() {
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
        self.range_use.doubt(&mut assessments);
        assessments
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

    /// What is known so far. Of clouds whose coordinates do not begin at the sensor, poses are those behind the shift by
    /// [`origin`](SpatialResult::origin), as the map's.
    pub fn result(&self) -> SpatialResult {
        let mut notes = self.notes();
        let comparison = self.reference.as_ref().and_then(|reference| {
            notes.extend(reference.contents.notes.iter().map(|note| format!("{}: {note}", reference.name)));
            match self.compare(reference) {
                Ok(comparison) => comparison,
                Err(error) => {
                    notes.push(error.in_file(&reference.name).to_string());
                    None
                }
            }
        });
        notes.extend(comparison.iter().filter_map(|comparison| comparison.hint.clone()));
        let suggestion = comparison.as_ref().and_then(|comparison| {
            let reading = match (self.depth(), self.decode_config.as_ref()?.cloud.as_ref()) {
                (Some(depth), _) => Reading::Depth(1.0 / depth.depth_step, &depth.camera),
                (None, Some(cloud)) => Reading::Clouds(cloud.unit),
                (None, None) => return None,
            };
            // Doubtful frames may be off by more than the factor: they are asked where the good ones are too few.
            let of = |worst| suggestion(&self.poses_up_to(worst), comparison, &reading);
            of(Status::Good).or_else(|| of(Status::Doubtful))
        });
        let reference = comparison.as_ref().map(|comparison| confirmation(&self.poses_up_to(Status::Good), comparison));
        let by_reference = |setting| reference.as_ref().and_then(|confirmation| confirmation(setting));
        let assumptions = self.decode_config.iter().flat_map(DecodeConfig::assumptions);
        let is_scale_contradicted = self.depth().is_some_and(|depth| depth.is_scale_contradicted);
        let frames = self.frames.iter().zip(self.estimates()).zip(self.assessments());
        SpatialResult {
            version: env!("CARGO_PKG_VERSION"),
            settings: self.decode_config.as_ref().map_or(&self.settings, |config| &config.settings).clone(),
            camera: self.depth().map(|depth| depth.camera),
            depth_scale: self.depth().map(|depth| 1.0 / depth.depth_step),
            cloud_unit: self.decode_config.as_ref().and_then(|config| Some(config.cloud.as_ref()?.unit)),
            origin: self.origin().to_array(),
            quantisation: self.quantisation(),
            assumptions: assumptions.map(|one| one.clone().or_confirmed(by_reference)).collect(),
            is_scale_contradicted: is_scale_contradicted && by_reference(ReadingSetting::DepthScale).is_none(),
            frames: frames
                .map(|((Frame { label, .. }, estimate), assessment)| {
                    FrameResult::of_frame(label.clone(), estimate, &assessment)
                })
                .collect(),
            loops: self.loop_report(),
            comparison,
            suggestion,
            notes,
        }
    }

    /// Remarks on the frames, their depth and colours, and the loops, in whole sentences.
    fn notes(&self) -> Vec<String> {
        let mut notes = merged(&self.notes);
        notes.extend(self.decode_config.iter().flat_map(DecodeConfig::notes).cloned());
        notes.extend(self.frames.note());
        if self.hypotheses.have_misaligned_colors() {
            notes.push(MISALIGNED_COLORS.to_owned());
            let depth = self.depth();
            notes.extend(depth.and_then(|depth| own_focal_length_of_kinect(&depth.assumptions, depth.camera.width)));
        }
        notes.extend(self.note_on_rest());
        notes.extend(self.range_use.note());
        notes.extend(self.hypotheses.note_on_sweeps());
        notes.extend(self.loop_report().note());
        notes.extend(self.unresolved_note());
        notes
    }

    /// That clouds share one frame, as all lie on one another as they are.
    fn note_on_rest(&self) -> Option<String> {
        let config = self.decode_config.as_ref()?;
        let cloud = config.cloud.as_ref()?;
        let poses: Vec<Pose3> = self.poses_up_to(Status::Doubtful).into_iter().flatten().collect();
        let reach = config.settings.voxel_size * MAX_REST;
        // A voxel is a fortieth of the median range, unless it is set.
        let size = DVec3::from(cloud.viewpoint).length().max(40.0 * config.settings.voxel_size);
        let is_at_rest = |pose: &Pose3| pose.translation.vector.norm() + size * pose.rotation.angle() < reach;
        (poses.len() > 1 && poses.len() == self.frames.len() && poses.iter().all(is_at_rest))
            .then(|| if cloud.is_sensor_at_origin { NO_MOTION_OF_SENSOR } else { NO_MOTION }.to_owned())
    }

    /// The frames with uncertain positions, which neither a later frame nor a loop has settled.
    pub fn unresolved(&self) -> Option<UnresolvedFrames> {
        self.hypotheses.unresolved().filter(|_| self.loop_report().num_closed == 0)
    }

    /// What the good frames rest on that come after frames with uncertain positions, which neither a later frame nor a loop has
    /// settled.
    fn unresolved_note(&self) -> Option<String> {
        let open = self.unresolved()?;
        let first = open.frames.first()?.number as usize;
        continuity::unresolved_note(&open, &self.frames.get(first)?.label.name, &self.assessments())
    }

    /// None before there are frames.
    fn compare(&self, reference: &Reference) -> Result<Option<TrajectoryError<SpatialPose>>> {
        let estimated = |((frame, pose), good): ((&Frame, Option<Pose3>), Option<Pose3>)| EstimatedFrame {
            index: frame.label.index,
            time: frame.label.time,
            T_world_sensor: pose.map(|pose| with_origin(&pose, self.origin())),
            is_good: good.is_some(),
        };
        let [all, good] = [Status::Doubtful, Status::Good].map(|worst| self.poses_up_to(worst));
        let frames: Vec<EstimatedFrame> = self.frames.iter().zip(all).zip(good).map(estimated).collect();
        if frames.is_empty() {
            return Ok(None);
        }
        let error = reference.error(&frames, self.settings.known_convention())?;
        Ok(Some(error.map_reference(|pose| with_origin(&pose, -self.origin()).into())))
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

    /// The map so far: one point a voxel, coloured where the recording is, world frame. What has been added since it was
    /// last asked for is stitched to it.
    pub fn map(&mut self) -> &VoxelMap {
        let poses = self.poses_up_to(Status::Good);
        let stitched = self.stitch(&poses);
        &self.stitched.insert(stitched).map
    }

    /// Stitches one more of the frames that are registered, so that less is left to do when the [map](Self::map) is asked
    /// for: it becomes the same map. The newest frames have to wait, as their poses may still change.
    pub fn stitch_ahead(&mut self) {
        let poses = self.poses_up_to(Status::Good);
        let num_settled = poses.len().saturating_sub(MAX_PENDING_FRAMES);
        let num_stitched =
            self.stitched.as_ref().filter(|stitched| self.is_of(stitched, &poses)).map_or(0, StitchedMap::num_frames);
        if num_stitched < num_settled {
            self.stitched = Some(self.stitch(&poses[..=num_stitched]));
        }
    }

    /// The map of the first frames at these poses, made from what there is of it.
    fn stitch(&mut self, poses: &[Option<Pose3>]) -> StitchedMap {
        let kept = self.stitched.take().filter(|stitched| self.is_of(stitched, poses));
        let voxel_size = self.decode_config.as_ref().map_or(1.0, |config| config.settings.map_voxel_size);
        let mut stitched = kept.unwrap_or_else(|| StitchedMap::new(voxel_size, self.map_quantisation()));
        for (frame, pose) in self.frames.iter().zip(poses).skip(stitched.num_frames()) {
            stitched.insert(&frame.map_points, *pose, self.depth_step(), self.settings.max_height);
        }
        stitched
    }

    fn is_of(&self, stitched: &StitchedMap, poses: &[Option<Pose3>]) -> bool {
        stitched.is_of(poses, self.map_quantisation())
    }

    fn map_quantisation(&self) -> Quantisation {
        self.quantisation().unwrap_or(Quantisation::Rounded)
    }

    /// Depth of one unit of an image (m); 0 for clouds.
    fn depth_step(&self) -> f64 {
        self.depth().map_or(0.0, |depth| depth.depth_step)
    }

    /// What a frame gives to the map, in the sensor's frame.
    fn with_map_cloud(&self, index: usize, work: impl FnOnce(&PointCloud)) {
        match self.frames.get(index).map(|frame| &frame.map_points) {
            Some(MapPoints::Image(image, prepared_as)) => {
                work(&image.cloud(self.map_quantisation().shift_from(*prepared_as, self.depth_step())));
            }
            Some(MapPoints::Cloud(cloud)) => work(cloud),
            None => {}
        }
    }

    /// What the map would take in voxels of other sizes (m, positive).
    pub fn map_sizes(&self, voxel_sizes: &[f64]) -> Vec<MapSize> {
        let poses = self.poses_up_to(Status::Good);
        let finest = voxel_sizes.iter().copied().fold(f64::INFINITY, f64::min);
        let count = |voxel_size| {
            let mut count = VoxelCount::new(voxel_size);
            for (index, pose) in poses.iter().enumerate() {
                if let Some(pose) = pose {
                    self.with_map_cloud(index, |cloud| count.insert(cloud, pose, self.settings.max_height));
                }
            }
            count
        };
        let has_colors = self.frames.iter().any(|frame| match &frame.map_points {
            MapPoints::Image(image, _) => image.colors.is_some(),
            MapPoints::Cloud(cloud) => cloud.colors.is_some(),
        });
        // Position and normal in single precision, and three bytes of colour.
        let bytes_a_point = if has_colors { 27 } else { 24 };
        let finest_count = count(finest);
        let size = |&voxel_size: &f64| {
            let multiple = (voxel_size / finest).round();
            let is_multiple = (multiple * finest - voxel_size).abs() < 1e-9 * voxel_size;
            let num_points =
                if is_multiple { finest_count.len_of_multiple(multiple as i32) } else { count(voxel_size).len() };
            MapSize { voxel_size, num_points, num_bytes: num_points * bytes_a_point }
        };
        voxel_sizes.iter().map(size).collect()
    }
}

fn not_begun() -> Error {
    Error::whole("A frame is added before the reconstruction has begun", "Call begin first")
}
