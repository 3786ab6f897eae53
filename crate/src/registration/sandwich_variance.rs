//! The variance of correlated residuals, by the sandwich estimator.
//!
//! The residuals of one wall share an error, so a thousand of them carry little more information than a few. The covariance
//! of an estimate from such clusters is H^-1 B H^-1 with B = sum s s^T over the clusters' gradients s (Liang and Zeger,
//! "Longitudinal data analysis using generalized linear models", Biometrika 73 (1986)); independent residuals of variance
//! v give B = v H. The scalar used for all directions is v = trace(H^-1 B) / 6.

use nalgebra::{Matrix6, Vector6};

use super::factors::RELATIVE_DAMPING;

/// The variance v of independent residuals that would give the same uncertainty. `H` is the sum of w J^T J, and each of
/// `clusters` the sum of w J^T r over its residuals; zero vectors are empty clusters. 0 without clusters.
pub(crate) fn unit_variance(H: &Matrix6<f64>, clusters: &[Vector6<f64>]) -> f64 {
    let damping = Matrix6::identity() * (RELATIVE_DAMPING * H.trace()).max(f64::MIN_POSITIVE);
    let Some(factor) = (H + damping).cholesky() else { return 0.0 };
    let filled = clusters.iter().filter(|cluster| cluster.iter().any(|entry| *entry != 0.0));
    let (mut sum, mut count) = (0.0, 0.0);
    for cluster in filled {
        sum += cluster.dot(&factor.solve(cluster));
        count += 1.0;
    }
    // Correction for the degrees of freedom of the fit.
    let unknowns = H.nrows() as f64;
    let left = (count - unknowns).max(1.0) / f64::max(count, 1.0);
    sum / (unknowns * left)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a random fit, with independent residuals of variance 4.
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
    fn the_variance_of_independent_residuals_is_found_and_copies_add_no_information() {
        let rows = fit();
        for clusters in [4000, 200] {
            let found = variance(&rows, clusters);
            assert!((found - 4.0).abs() < 0.6, "{clusters} clusters: {found}");
        }
        // Nine copies of every residual: H is nine times larger, the information is the same.
        let copies: Vec<_> = (0..9).flat_map(|_| rows.clone()).collect();
        let found = variance(&copies, 4000);
        assert!((found - 9.0 * variance(&rows, 4000)).abs() < 1e-6 * found, "{found}");
    }

    #[test]
    fn without_residuals_the_variance_is_zero() {
        assert_eq!(unit_variance(&Matrix6::zeros(), &[]), 0.0);
        assert_eq!(unit_variance(&Matrix6::zeros(), &[Vector6::zeros(); 5]), 0.0);
    }
}
