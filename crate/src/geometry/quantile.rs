//! Quantiles of numbers.

/// Ratio of the standard deviation of a normal distribution to its median absolute value.
pub(crate) const MEDIAN_TO_SIGMA: f64 = 1.4826;

/// Standard deviations beyond which a tenth of the absolute values of a normal distribution lies.
pub(crate) const TENTH_BEYOND: f64 = 1.645;

/// Standard deviations beyond which a number is not one of a normal distribution: of those that are, 0.3 % lie beyond.
pub(crate) const THREE_SIGMA: f64 = 3.0;

/// Fewest numbers whose median and spread tell anything: of five, one in 16 times all lie to one side of the true median.
pub(crate) const MIN_SAMPLE: usize = 5;

/// Share of numbers at either end that may be outliers, and tell nothing of the extent of the others.
pub(crate) const OUTLIER_SHARE: f64 = 0.005;

/// Share of the largest number that a sensor reports from which on its numbers may mean that nothing came back: a limit that jitters
/// does so by a percent.
pub(crate) const RANGE_END: f64 = 0.95;

/// Standard error of the median of so many numbers that deviate from it by this median absolute deviation: that of a mean times
/// sqrt(pi / 2), for a normal distribution.
pub(crate) fn error_of_median(deviation: f64, count: usize) -> f64 {
    (std::f64::consts::FRAC_PI_2 / count as f64).sqrt() * MEDIAN_TO_SIGMA * deviation
}

/// The value below which this share of the numbers lies, at 0.5 the median: the number at that place, the higher one of two.
/// `None` without numbers.
pub(crate) fn quantile(numbers: &mut [f64], share: f64) -> Option<f64> {
    let place = (numbers.len().saturating_sub(1) as f64 * share).round() as usize;
    (!numbers.is_empty()).then(|| *numbers.select_nth_unstable_by(place, f64::total_cmp).1)
}
