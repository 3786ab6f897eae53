//! How far the residuals of a fit are off when neighbours are off together.
//!
//! Residuals of one wall share the wall's error, so that a thousand of them say no more than a few. The covariance of an
//! estimate from such clusters is H^-1 B H^-1 with B = sum s s^T over the clusters' gradients s (Liang and Zeger,
//! "Longitudinal data analysis using generalized linear models", Biometrika 73 (1986)); independent residuals of variance
//! v give B = v H. One number for all directions is the mean of H^-1 B over them.

use nalgebra::{Matrix6, Vector6};

use super::factors::RELATIVE_DAMPING;

/// Unknowns of the fit.
const UNKNOWNS: f64 = 6.0;

/// The variance that independent residuals would have to be as uncertain as these: H is the sum of w J^T J, and `clusters`
/// are sums of w J^T r, empty ones being zero. 0 without clusters.
pub fn unit_variance(H: &Matrix6<f64>, clusters: &[Vector6<f64>]) -> f64 {
    let damping = Matrix6::identity() * (RELATIVE_DAMPING * H.trace()).max(f64::MIN_POSITIVE);
    let Some(factor) = (H + damping).cholesky() else { return 0.0 };
    let filled = clusters.iter().filter(|cluster| cluster.iter().any(|entry| *entry != 0.0));
    let (mut sum, mut count) = (0.0, 0.0);
    for cluster in filled {
        sum += cluster.dot(&factor.solve(cluster));
        count += 1.0;
    }
    // The fit has used up as much of the clusters as it has unknowns.
    let left = (count - UNKNOWNS).max(1.0) / f64::max(count, 1.0);
    sum / (UNKNOWNS * left)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of some fit, and residuals of variance about 4 that do not hang together.
    fn fit() -> Vec<(Vector6<f64>, f64)> {
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..4000).map(|_| (Vector6::from_fn(|_, _| random()), random() * 48f64.sqrt())).collect()
    }

    fn variance(rows: &[(Vector6<f64>, f64)], clusters: usize) -> f64 {
        let H = rows.iter().map(|(row, _)| row * row.transpose()).sum();
        let mut sums = vec![Vector6::zeros(); clusters];
        rows.iter().enumerate().for_each(|(index, (row, residual))| sums[index % clusters] += row * *residual);
        unit_variance(&H, &sums)
    }

    #[test]
    fn independent_residuals_have_their_own_variance_and_repeated_ones_that_of_one() {
        let rows = fit();
        for clusters in [4000, 200] {
            let found = variance(&rows, clusters);
            assert!((found - 4.0).abs() < 0.6, "{clusters} clusters: {found}");
        }
        // Nine copies of everything: nine times H, and no more is known.
        let copies: Vec<_> = (0..9).flat_map(|_| rows.clone()).collect();
        let found = variance(&copies, 4000);
        assert!((found - 9.0 * variance(&rows, 4000)).abs() < 1e-6 * found, "{found}");
    }

    #[test]
    fn nothing_measured_is_no_division_by_zero() {
        assert_eq!(unit_variance(&Matrix6::zeros(), &[]), 0.0);
        assert_eq!(unit_variance(&Matrix6::zeros(), &[Vector6::zeros(); 5]), 0.0);
    }
}
