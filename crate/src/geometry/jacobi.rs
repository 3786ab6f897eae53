//! Eigenvalues of small symmetric matrices.

use super::{SquareMatrix, Vector};

/// Limit of iterations that square the error each time, as Jacobi's sweeps and Newton's steps do: fewer than ten suffice.
pub(crate) const MAX_SWEEPS: usize = 50;

/// The eigenvalues of a symmetric matrix, the smallest first, and their unit eigenvectors, by Jacobi rotations (Golub and Van
/// Loan, "Matrix Computations", section on Jacobi methods), which need little code and no heap memory for small matrices.
pub(crate) fn eigenpairs<S: SquareMatrix>(mut A: S) -> Vec<(f64, S::Vector)> {
    let n = S::Vector::LEN;
    let mut V = S::identity();
    for _ in 0..MAX_SWEEPS {
        let off = (0..n).flat_map(|p| (p + 1..n).map(move |q| (p, q))).map(|at| A[at] * A[at]).sum::<f64>();
        if off <= f64::EPSILON * f64::EPSILON * A.norm_squared() {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                rotate(&mut A, &mut V, p, q);
            }
        }
    }
    let mut pairs: Vec<_> = (0..n).map(|i| (A[(i, i)], V.column(i))).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs
}

/// Makes the entry (p, q) zero by a rotation of rows and columns p and q, which is collected in `V`.
fn rotate<S: SquareMatrix>(A: &mut S, V: &mut S, p: usize, q: usize) {
    if A[(p, q)] == 0.0 {
        return;
    }
    let tau = (A[(q, q)] - A[(p, p)]) / (2.0 * A[(p, q)]);
    let tan = tau.signum() / (tau.abs() + (1.0 + tau * tau).sqrt());
    let cos = 1.0 / (1.0 + tan * tan).sqrt();
    let sin = tan * cos;
    for k in 0..S::Vector::LEN {
        let (a, b) = (A[(k, p)], A[(k, q)]);
        (A[(k, p)], A[(k, q)]) = (cos * a - sin * b, sin * a + cos * b);
    }
    for k in 0..S::Vector::LEN {
        let (a, b) = (A[(p, k)], A[(q, k)]);
        (A[(p, k)], A[(q, k)]) = (cos * a - sin * b, sin * a + cos * b);
    }
    for k in 0..S::Vector::LEN {
        let (a, b) = (V[(k, p)], V[(k, q)]);
        (V[(k, p)], V[(k, q)]) = (cos * a - sin * b, sin * a + cos * b);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix6;

    use super::*;

    #[test]
    fn the_eigenpairs_are_those_of_a_general_solver() {
        let mut state = 7_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24) - 0.5
        };
        for rank in [6, 6, 6, 5, 3, 1] {
            let A: Matrix6<f64> =
                (0..rank).map(|_| nalgebra::Vector6::from_fn(|_, _| random())).map(|v| v * v.transpose()).sum();
            let mut expected: Vec<f64> = A.symmetric_eigenvalues().iter().copied().collect();
            expected.sort_by(f64::total_cmp);
            for ((value, vector), expected) in eigenpairs(A).into_iter().zip(expected) {
                assert!((value - expected).abs() < 1e-14, "{value} {expected}");
                assert!((A * vector - vector * value).norm() < 1e-14 && (vector.norm() - 1.0).abs() < 1e-14);
            }
        }
        let diagonal = Matrix6::from_diagonal(&[3.0, 1.0, 2.0, 0.25, 5.0, 4.0].into());
        assert_eq!(eigenpairs(diagonal)[0], (0.25, nalgebra::Vector6::ith(3, 1.0)));
        assert_eq!(eigenpairs(Matrix6::zeros())[0].0, 0.0);
    }
}
