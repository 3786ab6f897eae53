//! One factor between measured and predicted values of which some are outliers.

use super::quantile::{MEDIAN_TO_SIGMA, MIN_SAMPLE, THREE_SIGMA, quantile};

/// Values have to tell as much as so many that tell alike: one that outweighs all others is no evidence. (Of 724 depth images one is
/// taken for another kind of values where one may.)
const MIN_ALIKE: f64 = 3.0;
/// Width of Tukey's kernel in standard deviations at which an estimate from a normal distribution keeps 95 % of its precision (Zhang
/// 1997, table 1).
const TUKEY_WIDTH: f64 = 4.685;
/// Weights settle within so many rounds.
const ROUNDS: usize = 10;

/// How often a prediction fits into what is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RobustRatio {
    pub(crate) value: f64,
    /// One standard deviation.
    error: f64,
}

impl RobustRatio {
    /// Of measured values, predicted ones and the standard deviations of the measured, by robust least squares from the weighted median
    /// on; its error is that of the scatter (White, Econometrica 48, 1980).
    pub(crate) fn of(values: &[[f64; 3]]) -> Option<Self> {
        let mut value = weighted_median(values)?;
        let mut error = 0.0;
        for _ in 0..ROUNDS {
            let residual = |&[measured, predicted, deviation]: &[f64; 3]| (measured - value * predicted) / deviation;
            let mut sizes: Vec<f64> = values.iter().map(|value| residual(value).abs()).collect();
            let scale = (MEDIAN_TO_SIGMA * quantile(&mut sizes, 0.5)?).max(1.0);
            let (mut sum, mut information, mut squares, mut scatter) = (0.0, 0.0, 0.0, 0.0_f64);
            for piece in values {
                let [measured, predicted, deviation] = *piece;
                let weight = (1.0 - (residual(piece) / (TUKEY_WIDTH * scale)).powi(2)).max(0.0).powi(2)
                    / (deviation * deviation);
                let tells = weight * predicted * predicted;
                sum += weight * predicted * measured;
                information += tells;
                squares += tells * tells;
                scatter += tells * weight * (measured - value * predicted).powi(2);
            }
            if squares == 0.0 || information * information < MIN_ALIKE * squares {
                return None;
            }
            (value, error) = (sum / information, scatter.sqrt() / information);
        }
        Some(Self { value, error })
    }

    /// Whether it is this and not what lies half beside it.
    pub(crate) fn is(self, value: f64, deviations: f64) -> bool {
        (self.value - value).abs() + deviations * self.error < 0.5
    }

    /// Whether it is larger than this, by three standard deviations.
    pub(crate) fn is_over(self, value: f64) -> bool {
        self.value - THREE_SIGMA * self.error > value
    }

    /// How many standard deviations it is away from this.
    pub(crate) fn deviations_from(self, value: f64) -> f64 {
        (self.value - value).abs() / self.error
    }
}

/// The median of the ratios of measured to predicted values, each weighted by what it tells.
fn weighted_median(values: &[[f64; 3]]) -> Option<f64> {
    let mut ratios: Vec<_> = values
        .iter()
        .filter(|[_, predicted, _]| *predicted != 0.0)
        .map(|[measured, predicted, deviation]| (measured / predicted, predicted.abs() / deviation))
        .collect();
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = ratios.iter().map(|ratio| ratio.1).sum::<f64>() / 2.0;
    let mut before = 0.0;
    let reaches_half = |ratio: &&(f64, f64)| {
        before += ratio.1;
        before >= half
    };
    let median = ratios.iter().find(reaches_half)?.0;
    (ratios.len() >= MIN_SAMPLE).then_some(median)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outliers_and_a_single_value_that_outweighs_the_others_do_not_tell() {
        let noise = |index: usize| 0.1 * (index as f64 * 12.9898).sin();
        let mut values: Vec<[f64; 3]> =
            (0..40).map(|index| [0.7 * (index % 9) as f64 + noise(index), (index % 9) as f64, 0.1]).collect();
        for value in values.iter_mut().step_by(4) {
            value[0] -= 30.0;
        }
        let ratio = RobustRatio::of(&values).unwrap();
        assert!((ratio.value - 0.7).abs() < 3.0 * ratio.error && ratio.error < 0.01, "{ratio:?}");
        assert!(ratio.is(0.9, THREE_SIGMA) && !ratio.is(0.1, 1.0) && ratio.is_over(0.6) && !ratio.is_over(0.7));
        values.push([1e4, 1e4, 0.1]);
        assert_eq!(RobustRatio::of(&values), None);
        assert_eq!(RobustRatio::of(&values[..MIN_SAMPLE - 1]), None);
    }
}
