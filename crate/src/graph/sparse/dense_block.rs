//! Cholesky factorisation of single blocks.

use crate::geometry::{SquareMatrix, Vector};

/// Ratio of a pivot to its diagonal entry below which it is zero to within rounding, so that the variable is undetermined.
const MIN_PIVOT: f64 = 1e-14;

/// The inverse of the lower triangular L with `L L^T = pivot`, or `None` where that is not positive definite beyond the
/// rounding of what it was reduced from.
pub(super) fn inverse_of_factor<B: SquareMatrix>(pivot: &B, reduced_from: &B) -> Option<B> {
    let size = B::Vector::LEN;
    let mut L = B::zeros();
    for j in 0..size {
        for i in j..size {
            let sum = (0..j).fold(pivot[(i, j)], |sum, k| sum - L[(i, k)] * L[(j, k)]);
            if i > j {
                L[(i, j)] = sum / L[(j, j)];
            } else if sum > MIN_PIVOT * reduced_from[(j, j)] && sum.is_finite() {
                L[(j, j)] = sum.sqrt();
            } else {
                return None;
            }
        }
    }
    let mut inverse = B::zeros();
    for j in 0..size {
        inverse[(j, j)] = 1.0 / L[(j, j)];
        for i in j + 1..size {
            let sum = (j..i).fold(0.0, |sum, k| sum - L[(i, k)] * inverse[(k, j)]);
            inverse[(i, j)] = sum / L[(i, i)];
        }
    }
    Some(inverse)
}
