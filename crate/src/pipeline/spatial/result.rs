//! What is known of a run, and what is to be said of it.

use glam::DVec3;

use super::SpatialReconstruction;
use super::continuity;
use super::stored_frames::Frame;
use crate::error::Result;
use crate::evaluation::trajectory_error::{EstimatedFrame, TrajectoryError, number_in_name};
use crate::geometry::Pose3;
use crate::odometry::assessment::Status;
use crate::pipeline::assumptions::{ReadingSetting, own_focal_length_of_kinect};
use crate::pipeline::prepared_frame::{DecodeConfig, merged};
use crate::pipeline::reference::Reference;
use crate::pipeline::report::{FrameResult, SpatialPose};
use crate::pipeline::spatial_report::{SpatialResult, with_origin};
use crate::pipeline::suggestion::{Reading, confirmation, suggestion};

/// What is said of colours that are left out of the estimate.
const MISALIGNED_COLORS: &str = "The colours are not registered to the depth images: the outlines of objects do not coincide. The \
                                 poses are estimated from depth alone, and the map shows the colours as they are";

/// What is said of clouds that lie on one another as they are.
const NO_MOTION: &str = "No motion: the clouds share one frame of coordinates, and the map shows them as they are";
/// The same where these may begin at the sensor.
const NO_MOTION_OF_SENSOR: &str = "No motion: the sensor stood still, or the clouds share one frame of coordinates";
/// Clouds rest where none of their points moves further than this (voxels): registrations are finer by a factor of ten.
const MAX_REST: f64 = 0.5;

impl SpatialReconstruction {
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
            num_moved_points: self.moved.num_points,
            comparison,
            suggestion: self
                .objection()
                .map(|objection| objection.suggestion)
                .or_else(|| self.suggested_focal_length())
                .or(suggestion),
            notes,
        }
    }

    /// Remarks on the frames, their depth and colours, and the loops, in whole sentences.
    fn notes(&self) -> Vec<String> {
        let mut notes = merged(&self.notes);
        notes.extend(self.decode_config.iter().flat_map(DecodeConfig::notes).cloned());
        notes.extend(self.frames.note());
        notes.extend(self.moved.note(self.frames.num_points()));
        if self.hypotheses.have_misaligned_colors() {
            notes.push(MISALIGNED_COLORS.to_owned());
            let depth = self.depth();
            notes.extend(depth.and_then(|depth| own_focal_length_of_kinect(&depth.assumptions, depth.camera.width)));
        }
        notes.extend(self.note_on_rest());
        notes.extend(self.objection().map(|objection| objection.suggestion.text));
        notes.extend(self.suggested_focal_length().map(|suggestion| suggestion.text));
        notes.extend(self.hypotheses.notes_on_sweeps());
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
            number: number_in_name(&frame.label.name),
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
}
