//! Statistics of errors, with the names and definitions of evo.

use serde::{Deserialize, Serialize};

/// Statistics of n errors e. `std` is that of the population: divided by n, not by n - 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub struct Statistics {
    /// sqrt(mean(e^2)).
    pub rmse: f64,
    /// sum(e) / n.
    pub mean: f64,
    /// The middle error; of an even number, the mean of the two in the middle.
    pub median: f64,
    /// sqrt(mean((e - mean)^2)).
    pub std: f64,
    /// The smallest error.
    pub min: f64,
    /// The largest error.
    pub max: f64,
    /// sum(e^2).
    pub sse: f64,
}

impl Statistics {
    /// The statistics of errors; `None` where there are none.
    pub fn of(errors: &[f64]) -> Option<Self> {
        if errors.is_empty() {
            return None;
        }
        let n = errors.len() as f64;
        let sse = sum(errors, |e| e * e);
        let mean = sum(errors, |e| e) / n;
        Some(Self {
            rmse: (sse / n).sqrt(),
            mean,
            median: median(errors),
            std: (sum(errors, |e| (e - mean).powi(2)) / n).sqrt(),
            min: errors.iter().copied().fold(f64::INFINITY, f64::min),
            max: errors.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            sse,
        })
    }
}

/// Pairwise summation, whose rounding error grows with the logarithm of the count only: Higham, "The accuracy of floating
/// point summation", SIAM J. Sci. Comput. 14 (1993).
fn sum(errors: &[f64], term: impl Fn(f64) -> f64 + Copy) -> f64 {
    /// As many are summed one by one, as in NumPy, with whose sums evo's are made.
    const BLOCK: usize = 128;
    if errors.len() <= BLOCK {
        return errors.iter().map(|&e| term(e)).sum();
    }
    let (first, second) = errors.split_at(errors.len() / 2);
    sum(first, term) + sum(second, term)
}

fn median(errors: &[f64]) -> f64 {
    let mut sorted = errors.to_vec();
    let middle = sorted.len() / 2;
    let (below, &mut upper, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
    if errors.len() % 2 == 1 {
        return upper;
    }
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    f64::midpoint(lower, upper)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_few_numbers() {
        let odd = Statistics::of(&[3.0, 1.0, 2.0]).unwrap();
        assert_eq!((odd.mean, odd.median, odd.min, odd.max, odd.sse), (2.0, 2.0, 1.0, 3.0, 14.0));
        assert_eq!((odd.rmse, odd.std), ((14.0_f64 / 3.0).sqrt(), (2.0_f64 / 3.0).sqrt()));
        assert_eq!(Statistics::of(&[4.0, 1.0, 2.0, 8.0]).unwrap().median, 3.0);
        let one = Statistics::of(&[0.5]).unwrap();
        assert_eq!((one.rmse, one.median, one.std), (0.5, 0.5, 0.0));
        assert_eq!(Statistics::of(&[]), None);
    }
}
