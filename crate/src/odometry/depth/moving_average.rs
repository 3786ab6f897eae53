//! The moving average of what a chain's frames have in common.

use crate::geometry::quantile::MIN_SAMPLE;

/// Number of values from which the average is used. From the first one on, two frames of kinect_pioneer, one of 2 backwards, whose place is
/// known roughly are good and not doubtful (`spatial_reconstruction.rs`).
const MIN_COUNT: usize = 3;

/// The mean of the first values, then an average in which older ones fade: the last one counts as in the mean of
/// [`MIN_SAMPLE`].
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MovingAverage {
    mean: f64,
    /// Number of values, at most [`MIN_SAMPLE`].
    count: usize,
}

impl MovingAverage {
    /// Adds a value.
    pub(super) fn push(&mut self, value: f64) {
        self.count = MIN_SAMPLE.min(self.count + 1);
        self.mean += (value - self.mean) / self.count as f64;
    }

    /// The average; `None` of fewer than three values.
    pub(super) fn average(&self) -> Option<f64> {
        (self.count >= MIN_COUNT).then_some(self.mean)
    }
}

#[cfg(test)]
mod tests {
    use super::MovingAverage;

    #[test]
    fn the_first_values_count_alike_and_later_ones_fade() {
        let mut average = MovingAverage::default();
        assert_eq!(average.average(), None);
        for value in [1.0, 4.0] {
            average.push(value);
        }
        assert_eq!(average.average(), None);
        average.push(1.0);
        assert_eq!(average.average(), Some(2.0));
        for _ in 0..40 {
            average.push(5.0);
        }
        assert!((average.average().unwrap() - 5.0).abs() < 0.01, "{average:?}");
    }
}
