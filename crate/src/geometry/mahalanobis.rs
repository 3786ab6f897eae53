//! Squared Mahalanobis distances of poses in the plane: quantiles of chi squared of three degrees of freedom, named by the share of
//! right poses that lies beyond.

use nalgebra::{Matrix3, Vector3};

pub(crate) const ONE_IN_TEN: f64 = 6.25;
pub(crate) const ONE_IN_TWENTY: f64 = 7.8;
pub(crate) const ONE_IN_HUNDRED: f64 = 11.3;
pub(crate) const ONE_IN_THOUSAND: f64 = 16.3;
pub(crate) const ONE_IN_TEN_THOUSAND: f64 = 21.1;
pub(crate) const ONE_IN_HUNDRED_THOUSAND: f64 = 25.9;

/// A squared distance of so many degrees of freedom beyond which one right one in 1,000 lies at most (Laurent and Massart, "Adaptive
/// estimation of a quadratic functional by model selection", Annals of Statistics 28 (2000), lemma 1).
pub(crate) fn one_in_thousand_of(num_degrees: usize) -> f64 {
    let (k, t) = (num_degrees as f64, 1e3_f64.ln());
    k + 2.0 * (k * t).sqrt() + 2.0 * t
}

/// The squared Mahalanobis distance of a perturbation; 0 where the covariance is singular.
pub(crate) fn squared(off: &Vector3<f64>, covariance: &Matrix3<f64>) -> f64 {
    covariance.try_inverse().map_or(0.0, |information| off.dot(&(information * off)))
}

/// The weight (0..=1) of a measurement that may be an outlier, by its squared Mahalanobis distance: 1 up to `width`, and less the
/// further beyond (Agarwal et al., "Robust map optimization using dynamic covariance scaling", ICRA 2013, eq. 15).
pub(crate) fn dynamic_covariance_scaling(sq_distance: f64, width: f64) -> f64 {
    (2.0 * width / (width + sq_distance)).min(1.0).powi(2)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn beyond_each_lies_the_share_that_its_name_says() {
        let density = |x: f64| (x / TAU).sqrt() * (-x / 2.0).exp();
        let beyond = |x: f64| (0..60_000).map(|i| 1e-3 * density(x + 1e-3 * (f64::from(i) + 0.5))).sum::<f64>();
        let shares = [
            (ONE_IN_TEN, 0.1),
            (ONE_IN_TWENTY, 0.05),
            (ONE_IN_HUNDRED, 0.01),
            (ONE_IN_THOUSAND, 1e-3),
            (ONE_IN_TEN_THOUSAND, 1e-4),
            (ONE_IN_HUNDRED_THOUSAND, 1e-5),
        ];
        for (distance, share) in shares {
            assert!((beyond(distance) / share - 1.0).abs() < 0.03, "{distance}: {}", beyond(distance));
        }
    }
}
