//! What is computed with single blocks.

use nalgebra::SMatrix;

/// A pivot below this share of its diagonal entry is what rounding leaves of zero: the variable is not determined.
const MIN_PIVOT: f64 = 1e-14;

/// `C -= A B^T`, column by column of `C`, which are contiguous.
#[inline]
pub(super) fn subtract_product<const B: usize>(
    C: &mut SMatrix<f64, B, B>,
    A: &SMatrix<f64, B, B>,
    Bt: &SMatrix<f64, B, B>,
) {
    for (column, C_column) in C.data.0.iter_mut().enumerate() {
        for (A_column, B_column) in A.data.0.iter().zip(&Bt.data.0) {
            let factor = B_column[column];
            for (c, a) in C_column.iter_mut().zip(A_column) {
                *c -= a * factor;
            }
        }
    }
}

/// The inverse of the lower triangular L with `L L^T = pivot`, or `None` where that is not positive definite beyond the
/// rounding of what it was reduced from.
pub(super) fn inverse_of_factor<const B: usize>(
    pivot: &SMatrix<f64, B, B>,
    reduced_from: &SMatrix<f64, B, B>,
) -> Option<SMatrix<f64, B, B>> {
    let mut L = SMatrix::<f64, B, B>::zeros();
    for j in 0..B {
        for i in j..B {
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
    let mut inverse = SMatrix::<f64, B, B>::zeros();
    for j in 0..B {
        inverse[(j, j)] = 1.0 / L[(j, j)];
        for i in j + 1..B {
            let sum = (j..i).fold(0.0, |sum, k| sum - L[(i, k)] * inverse[(k, j)]);
            inverse[(i, j)] = sum / L[(i, i)];
        }
    }
    Some(inverse)
}
