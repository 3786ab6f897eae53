//! The levels of a depth image: which raw values occur, and whether their inverses are evenly spaced, as a triangulating camera leaves
//! them.

use super::depth_image::DepthImage;
use crate::geometry::quantile::quantile;

/// This many levels or fewer do not show how they are spaced.
const MIN_LEVELS: usize = 20;
/// Levels closer than this (raw steps, median) show rounding, not disparity.
const MIN_LEVEL_GAP: f64 = 4.0;
/// The inverse values of all pixels are multiples of a camera's step: the length of the mean of their phases is 0.92 to 1 on six
/// recordings of three cameras, 0.82 at most on the rendered ones.
const MIN_PHASE_CONCENTRATION: f64 = 0.9;
/// The step is known to this share from the levels, and is looked for in steps of a share that are fine enough for a thousand
/// levels.
const STEP_ERROR: f64 = 0.02;
const STEP_TRIAL: f64 = 5e-4;

/// The even spacing of the inverse raw values (1 / raw) that a triangulating camera leaves; none without.
pub(crate) fn disparity_step(image: &DepthImage) -> Option<f64> {
    if image.bits <= 8 || image.bits == DepthImage::METRES { None } else { Levels::new(image).disparity_step() }
}

/// The raw values that occur from the median to the 95th percentile of an image, ascending.
pub(super) struct Levels {
    /// Each with the number of its pixels.
    values: Vec<(f64, f64)>,
    /// Median of the pixels.
    pub median: f64,
    /// The 95th percentile.
    pub far: f64,
    /// Share of pixels without depth.
    pub holes: f64,
    /// Number of pixels of each raw value.
    counts: Vec<usize>,
}

impl Levels {
    pub fn new(image: &DepthImage) -> Self {
        let mut counts = vec![0usize; usize::from(u16::MAX) + 1];
        for &value in &image.values {
            counts[usize::from(value)] += 1;
        }
        // The largest value of all means no return where a file has no zeros for it.
        let measured: usize = counts[1..usize::from(u16::MAX)].iter().sum();
        let percentile = |share: f64| {
            let mut below = 0;
            let rank = (share * measured as f64) as usize;
            (1..usize::from(u16::MAX)).find(|&value| {
                below += counts[value];
                below > rank
            })
        };
        let (low, high) = (percentile(0.5).unwrap_or(0), percentile(0.95).unwrap_or(0));
        let is_there = |&value: &usize| value > 0 && counts[value] > 0;
        let values: Vec<(f64, f64)> =
            (low..=high).filter(is_there).map(|value| (value as f64, counts[value] as f64)).collect();
        let holes = 1.0 - measured as f64 / image.values.len().max(1) as f64;
        Self { values, median: low as f64, far: high as f64, holes, counts }
    }

    /// The largest number that all values that occur are multiples of, the largest of all aside; 1 where they are too few to tell.
    pub fn common_divisor(&self) -> u16 {
        if self.values.len() <= MIN_LEVELS {
            return 1;
        }
        let divisor_of = |mut a: usize, mut b: usize| {
            while b != 0 {
                (a, b) = (b, a % b);
            }
            a
        };
        let occurring = (1..self.counts.len() - 1).filter(|&value| self.counts[value] > 0);
        u16::try_from(occurring.fold(0, divisor_of).max(1)).unwrap_or(1)
    }

    /// The even spacing of 1 / value, in 1 / raw; none where the levels are not spaced so.
    pub fn disparity_step(&self) -> Option<f64> {
        let pairs = || self.values.windows(2).map(|pair| (pair[0].0, pair[1].0));
        if self.values.len() <= MIN_LEVELS || median(pairs().map(|(a, b)| b - a).collect()) < MIN_LEVEL_GAP {
            return None;
        }
        let step = median(pairs().map(|(a, b)| 1.0 / a - 1.0 / b).collect());
        let num_trials = (STEP_ERROR / STEP_TRIAL) as i32;
        let is_step =
            |trial: i32| self.concentration(step * (1.0 + STEP_TRIAL * f64::from(trial))) > MIN_PHASE_CONCENTRATION;
        // The likeliest first.
        (0..=num_trials).any(|trial| is_step(trial) || is_step(-trial)).then_some(step)
    }

    /// Length of the mean of the phases of 1 / value in this step: 1 where all are multiples of it but for an offset.
    fn concentration(&self, step: f64) -> f64 {
        let (mut cosines, mut sines, mut all) = (0.0, 0.0, 0.0);
        for &(value, count) in &self.values {
            let (sin, cos) = (std::f64::consts::TAU / (value * step)).sin_cos();
            (cosines, sines, all) = (cosines + count * cos, sines + count * sin, all + count);
        }
        f64::hypot(cosines, sines) / all
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    quantile(&mut values, 0.5).unwrap_or(f64::NAN)
}
