//! What the values of all depth images together say against how they are read: each stretched to its range, cut off, or no depth.

use crate::camera::raw_depth::ToldValues;
use crate::camera::{Curvatures, DepthValues};
use crate::geometry::Pose3;
use crate::odometry::assessment::Assessment;
use crate::pipeline::prepared_frame::{DecodeConfig, ValuesSeen};
use crate::pipeline::suggestion::{SuggestedSetting, Suggestion};

/// Images are taken for stretched from this many on that fill their range, if they are half of all. Of 1,160 images as cameras
/// and renderers gave them 0 to 5 % of a recording do, and 82 to 100 % of the same ones stretched (of a D435, whose strays lie
/// far behind all else, none). They are taken for cut off likewise.
const MIN_FRAMES: usize = 3;
/// The depth of a wall that is seen square on changes by more than this share of it where the view turns by so much (rad) or comes so
/// much nearer: then, not all of its pixels stay at one value.
const MIN_CHANGE: f64 = 0.01;

/// What is said of the recording where images are stretched ...
const STRETCHED: &str = "The depth images fill the range of their values, each on its own, as if each had been stretched to it: one \
                         surface then has another value in every image, and no scale is right. Export the raw depth, all images by \
                         one scale";
/// ... and of a frame.
const STRETCHED_REASON: &str = "the depth images seem to be stretched to the range of their values, each on its own";

/// What the values say against how they are read.
pub(super) struct Objection {
    /// Of the recording, with a remedy.
    pub suggestion: Suggestion,
    /// Of a frame.
    reason: String,
}

impl Objection {
    fn new(setting: SuggestedSetting, value: Option<f64>, text: String, reason: String) -> Self {
        Self { suggestion: Suggestion { text, setting, value }, reason }
    }

    /// Makes all frames but the first doubtful.
    pub(super) fn doubt(&self, assessments: &mut [Assessment]) {
        assessments.iter_mut().skip(1).for_each(|assessment| assessment.doubt(&self.reason));
    }
}

/// What the registered depth images show.
#[derive(Default)]
pub(super) struct ValueEvidence {
    num_filling: usize,
    /// Of each frame, the value at which it seems to be cut off.
    cut_offs: Vec<Option<u16>>,
    curvatures: Curvatures,
    told: Option<ToldValues>,
}

impl ValueEvidence {
    pub(super) fn record(&mut self, seen: &ValuesSeen) {
        self.num_filling += usize::from(seen.fills_range);
        self.cut_offs.push(seen.cut_off);
        if let Some(curvatures) = &seen.curvatures {
            self.curvatures.extend(curvatures);
            self.told = Some(self.curvatures.told());
        }
    }

    /// What is to be said of images that are read so, taken at these poses.
    pub(super) fn objection(&self, config: &DecodeConfig, poses: &[Pose3]) -> Option<Objection> {
        self.stretched().or_else(|| self.no_depth(config)).or_else(|| self.cut_off(config, poses))
    }

    fn stretched(&self) -> Option<Objection> {
        let is_stretched = self.num_filling >= MIN_FRAMES && 2 * self.num_filling >= self.cut_offs.len();
        is_stretched.then(|| {
            Objection::new(SuggestedSetting::DepthValues, None, STRETCHED.to_owned(), STRETCHED_REASON.to_owned())
        })
    }

    fn no_depth(&self, config: &DecodeConfig) -> Option<Objection> {
        let told = self.told.filter(|_| config.settings.depth_values == DepthValues::ToldFromData)?;
        let (are, remedy) = told.no_depth()?.in_words();
        let reason = format!("the values of the depth images are {are}: planes are plane that way alone");
        let note = format!(
            "The values of the depth images are {are}: planes in several of them are plane that way alone. {remedy}; \
                            if that is wrong, set depth_values=depth"
        );
        Some(Objection::new(SuggestedSetting::DepthValues, None, note, reason))
    }

    fn cut_off(&self, config: &DecodeConfig, poses: &[Pose3]) -> Option<Objection> {
        let depth = config.depth.as_ref()?;
        let limit = self.cut_offs.iter().flatten().max()?;
        let is_there = |cut_off: &Option<u16>| cut_off.as_ref() == Some(limit);
        let there: Vec<&Pose3> =
            poses.iter().zip(&self.cut_offs).filter(|(_, cut_off)| is_there(cut_off)).map(|(pose, _)| pose).collect();
        let metres = f64::from(*limit) * depth.depth_step;
        let (first, is_used) = (there.first()?, metres <= config.settings.max_range);
        let moves = |pose: &&Pose3| {
            let motion = first.inverse() * **pose;
            let ahead = motion.rotation * nalgebra::Vector3::z();
            ahead.xy().norm() > MIN_CHANGE || motion.translation.z.abs() > MIN_CHANGE * metres
        };
        // What a sensor measures of a wall scatters; of a rendered one it is the motion that tells, which a false wall hinders.
        let is_no_wall = self.told.is_some_and(|told| told.are_noisy()) || there.iter().any(moves);
        if !is_used || there.len() < MIN_FRAMES || 2 * there.len() < self.cut_offs.len() || !is_no_wall {
            return None;
        }
        let max_range = f64::from(limit - 1) * depth.depth_step;
        let note = format!(
            "The depth images are cut off at {metres:.2} m: many pixels have just this depth, whatever the view, and none has more. They are \
             taken for a wall. Save 0 where nothing was measured, or set max_range={max_range:.3}"
        );
        let reason = format!("depth seems to be cut off at {metres:.2} m, which is taken for a wall");
        let max_range = (1000.0 * max_range).round() / 1000.0;
        Some(Objection::new(SuggestedSetting::MaxRange, Some(max_range), note, reason))
    }
}
