//! Depth images that were each stretched to the range of their values: no depth scale is right for all of them.

use crate::odometry::assessment::Assessment;

/// Images are taken for stretched from this many on that fill their range, if they are half of all. Of 1,160 images as cameras
/// and renderers gave them 0 to 5 % of a recording do, and 82 to 100 % of the same ones stretched (of a D435, whose strays lie
/// far behind all else, none).
const MIN_STRETCHED_FRAMES: usize = 3;

/// What is said of the recording ...
const NOTE: &str = "The depth images fill the range of their values, each on its own, as if each had been stretched to it: one \
                    surface then has another value in every image, and no scale is right. Export the raw depth, all images by \
                    one scale";
/// ... and of a frame.
const REASON: &str = "the depth images seem to be stretched to the range of their values, each on its own";

/// How many of the registered depth images fill the range of their values.
#[derive(Default)]
pub(super) struct RangeUse {
    num_frames: usize,
    num_filling: usize,
}

impl RangeUse {
    pub(super) fn record(&mut self, fills_range: bool) {
        self.num_frames += 1;
        self.num_filling += usize::from(fills_range);
    }

    pub(super) fn note(&self) -> Option<String> {
        self.is_stretched().then(|| NOTE.to_owned())
    }

    /// Makes all frames but the first doubtful where the images are stretched.
    pub(super) fn doubt(&self, assessments: &mut [Assessment]) {
        if self.is_stretched() {
            assessments.iter_mut().skip(1).for_each(|assessment| assessment.doubt(REASON));
        }
    }

    fn is_stretched(&self) -> bool {
        self.num_filling >= MIN_STRETCHED_FRAMES && 2 * self.num_filling >= self.num_frames
    }
}
