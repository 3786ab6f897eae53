//! Small dense vectors and matrices under one name for the plane and for space.
//!
//! nalgebra types carry their sizes as const parameters, and code for both SE(2) and SE(3) would have to name all of them.
//! With these traits it is generic over the [motion](super::RigidMotion) alone. Every operation is nalgebra's own.

use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, IndexMut, Mul, Neg, Sub, SubAssign};

use nalgebra::{SMatrix, SVector};

/// A vector of fixed length: a point, a direction or a tangent vector.
pub trait Vector:
    Copy
    + Debug
    + PartialEq
    + IndexMut<usize, Output = f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + DivAssign<f64>
    + Sum
    + 'static
{
    /// Number of entries.
    const LEN: usize;
    /// All entries zero.
    fn zeros() -> Self;
    /// Scalar product.
    fn dot(&self, other: &Self) -> f64;
    /// Euclidean length.
    fn norm(&self) -> f64;
    /// Squared Euclidean length.
    fn norm_squared(&self) -> f64;
    /// The entries.
    fn as_slice(&self) -> &[f64];
}

/// A square matrix of fixed size.
pub trait SquareMatrix:
    Copy
    + Debug
    + PartialEq
    + IndexMut<(usize, usize), Output = f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Neg<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + 'static
{
    /// The type of its columns.
    type Vector: Vector;
    /// All entries zero.
    fn zeros() -> Self;
    /// Ones on the diagonal, zeros elsewhere.
    fn identity() -> Self;
    /// The matrix with this diagonal and zeros elsewhere.
    fn from_diagonal(diagonal: &Self::Vector) -> Self;
    /// `a b^T`.
    fn outer(a: &Self::Vector, b: &Self::Vector) -> Self;
    /// `self += weight a a^T`, on and below the diagonal alone; [`symmetric`](Self::symmetric) fills the rest.
    fn add_square(&mut self, a: &Self::Vector, weight: f64);
    /// The symmetric matrix of what is on and below the diagonal.
    #[must_use]
    fn symmetric(self) -> Self;
    /// Sum of the diagonal.
    fn trace(&self) -> f64;
    /// The entries of the diagonal.
    fn diagonal(&self) -> Self::Vector;
    /// The column of this index.
    fn column(&self, index: usize) -> Self::Vector;
    /// The transposed matrix.
    #[must_use]
    fn transpose(&self) -> Self;
    /// Sum of the squared entries.
    fn norm_squared(&self) -> f64;
    /// The matrix times a vector.
    fn apply(&self, vector: &Self::Vector) -> Self::Vector;
    /// The transposed matrix times another.
    #[must_use]
    fn tr_mul(&self, other: &Self) -> Self;
    /// The transposed matrix times a vector.
    fn tr_apply(&self, vector: &Self::Vector) -> Self::Vector;
    /// `self -= a b^T`, column by column of `self`, which are contiguous.
    fn subtract_product(&mut self, a: &Self, b: &Self);
    /// Solves `self x = b` for `x` by Cholesky factorisation; `None` where the matrix is not positive definite.
    fn solve_cholesky(&self, b: &Self::Vector) -> Option<Self::Vector>;
    /// The entries, column by column.
    fn as_slice(&self) -> &[f64];
}

/// In single precision, as the indices of points hold them.
#[inline]
pub(crate) fn single<const N: usize>(vector: &SVector<f64, N>) -> [f32; N] {
    std::array::from_fn(|axis| vector[axis] as f32)
}

/// The derivative of a point with respect to a tangent vector.
pub trait Jacobian: Copy {
    /// The type of its columns.
    type Point: Vector;
    /// The type of its rows.
    type Tangent: Vector;
    /// The type of `J^T J`.
    type Matrix: SquareMatrix<Vector = Self::Tangent>;
    /// `J^T v`: the gradient of `v . point`.
    fn pull_back(&self, vector: &Self::Point) -> Self::Tangent;
    /// `J^T J`.
    fn gramian(&self) -> Self::Matrix;
}

impl<const N: usize> Vector for SVector<f64, N> {
    const LEN: usize = N;

    fn zeros() -> Self {
        SVector::zeros()
    }

    #[inline]
    fn dot(&self, other: &Self) -> f64 {
        SVector::dot(self, other)
    }

    #[inline]
    fn norm(&self) -> f64 {
        SVector::norm(self)
    }

    #[inline]
    fn norm_squared(&self) -> f64 {
        SVector::norm_squared(self)
    }

    fn as_slice(&self) -> &[f64] {
        self.data.as_slice()
    }
}

impl<const N: usize> SquareMatrix for SMatrix<f64, N, N> {
    type Vector = SVector<f64, N>;

    fn zeros() -> Self {
        SMatrix::zeros()
    }

    fn identity() -> Self {
        SMatrix::identity()
    }

    fn from_diagonal(diagonal: &Self::Vector) -> Self {
        SMatrix::from_diagonal(diagonal)
    }

    #[inline]
    fn outer(a: &Self::Vector, b: &Self::Vector) -> Self {
        a * b.transpose()
    }

    #[inline]
    fn add_square(&mut self, a: &Self::Vector, weight: f64) {
        let weighted = a * weight;
        for column in 0..N {
            for row in column..N {
                self.data.0[column][row] += weighted[row] * a[column];
            }
        }
    }

    fn symmetric(mut self) -> Self {
        self.fill_upper_triangle_with_lower_triangle();
        self
    }

    fn trace(&self) -> f64 {
        SMatrix::trace(self)
    }

    fn diagonal(&self) -> Self::Vector {
        SMatrix::diagonal(self)
    }

    fn column(&self, index: usize) -> Self::Vector {
        SMatrix::column(self, index).into_owned()
    }

    #[inline]
    fn transpose(&self) -> Self {
        SMatrix::transpose(self)
    }

    fn norm_squared(&self) -> f64 {
        SMatrix::norm_squared(self)
    }

    #[inline]
    fn apply(&self, vector: &Self::Vector) -> Self::Vector {
        self * vector
    }

    #[inline]
    fn tr_mul(&self, other: &Self) -> Self {
        SMatrix::tr_mul(self, other)
    }

    #[inline]
    fn tr_apply(&self, vector: &Self::Vector) -> Self::Vector {
        SMatrix::tr_mul(self, vector)
    }

    #[inline]
    fn subtract_product(&mut self, a: &Self, b: &Self) {
        for (column, own_column) in self.data.0.iter_mut().enumerate() {
            for (a_column, b_column) in a.data.0.iter().zip(&b.data.0) {
                let factor = b_column[column];
                for (own, a) in own_column.iter_mut().zip(a_column) {
                    *own -= a * factor;
                }
            }
        }
    }

    fn solve_cholesky(&self, b: &Self::Vector) -> Option<Self::Vector> {
        self.cholesky().map(|factor| factor.solve(b))
    }

    fn as_slice(&self) -> &[f64] {
        self.data.as_slice()
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Jacobian for SMatrix<f64, ROWS, COLUMNS> {
    type Point = SVector<f64, ROWS>;
    type Tangent = SVector<f64, COLUMNS>;
    type Matrix = SMatrix<f64, COLUMNS, COLUMNS>;

    #[inline]
    fn pull_back(&self, vector: &Self::Point) -> Self::Tangent {
        self.tr_mul(vector)
    }

    #[inline]
    fn gramian(&self) -> Self::Matrix {
        self.tr_mul(self)
    }
}
