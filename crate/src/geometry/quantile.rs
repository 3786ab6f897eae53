//! Quantiles of numbers.

/// Ratio of the standard deviation of a normal distribution to its median absolute value.
pub(crate) const MEDIAN_TO_SIGMA: f64 = 1.4826;

/// The value below which this share of the numbers lies, at 0.5 the median: the number at that place, the higher one of two.
/// `None` without numbers.
pub(crate) fn quantile(numbers: &mut [f64], share: f64) -> Option<f64> {
    let place = (numbers.len().saturating_sub(1) as f64 * share).round() as usize;
    (!numbers.is_empty()).then(|| *numbers.select_nth_unstable_by(place, f64::total_cmp).1)
}
