//! Cholesky factorisation of a symmetric positive definite matrix of blocks.
//!
//! Left-looking, one column of blocks after the other; Davis, "Direct Methods for Sparse Linear Systems" (2006),
//! chapters 4 and 7.

use super::BlockMatrix;
use super::dense_block::inverse_of_factor;
use super::factor_pattern::FactorPattern;
use crate::geometry::SquareMatrix;
use std::fmt;

#[cfg(test)]
mod tests;

/// The matrix is not positive definite, or an entry of it is not finite.
///
/// In a pose graph: no factor determines the variable, or an information matrix is not positive definite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotPositiveDefinite {
    /// The variable at which the factorisation failed: it, or one connected to it, is undetermined.
    pub variable: usize,
}

impl fmt::Display for NotPositiveDefinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the system of equations is not positive definite at variable {}", self.variable)
    }
}

impl std::error::Error for NotPositiveDefinite {}

/// Solver of block-sparse systems: the symbolic factorisation is done once per pattern.
#[derive(Debug, Clone)]
pub struct BlockCholesky<B> {
    pattern: FactorPattern,
    /// Inverses of the diagonal blocks of L, lower triangular.
    inverse_diagonal: Vec<B>,
    /// Blocks of L below the diagonal, column by column.
    blocks: Vec<B>,
    /// Where a block row is in the column that is being computed.
    place_in_column: Vec<u32>,
}

impl<B: SquareMatrix> BlockCholesky<B> {
    /// The symbolic factorisation of the pattern of `H`: the order of elimination and the blocks of the factor.
    pub fn new(H: &BlockMatrix<B>) -> Self {
        let pattern = FactorPattern::new(H.num_variables(), H.places());
        Self {
            inverse_diagonal: vec![B::zeros(); pattern.num_variables()],
            blocks: vec![B::zeros(); pattern.rows.len()],
            place_in_column: vec![0; pattern.num_variables()],
            pattern,
        }
    }

    /// Factors `P H P^T = L L^T`. If the pattern of `H` has changed, the symbolic factorisation is repeated first.
    ///
    /// # Errors
    /// Where `H` is not positive definite.
    pub fn factor(&mut self, H: &BlockMatrix<B>) -> Result<Factor<'_, B>, NotPositiveDefinite> {
        if H.num_variables() != self.pattern.num_variables() || H.places() != self.pattern.places {
            *self = Self::new(H);
        }
        self.blocks.fill(B::zeros());
        for (block, &(entry, is_transposed)) in H.blocks().iter().zip(&self.pattern.targets) {
            self.blocks[entry as usize] = if is_transposed { block.transpose() } else { *block };
        }
        for column in 0..self.pattern.num_variables() {
            self.factor_column(column, H)?;
        }
        Ok(Factor { pattern: &self.pattern, inverse_diagonal: &self.inverse_diagonal, blocks: &self.blocks })
    }

    /// `L_ij = (H_ij - sum over k < j of L_ik L_jk^T) L_jj^-T`, and `L_jj L_jj^T` the same without the last factor.
    fn factor_column(&mut self, j: usize, H: &BlockMatrix<B>) -> Result<(), NotPositiveDefinite> {
        let pattern = &self.pattern;
        let column = pattern.column(j);
        let (done, rest) = self.blocks.split_at_mut(column.start);
        let current = &mut rest[..column.len()];
        for (place, &row) in pattern.rows[column].iter().enumerate() {
            self.place_in_column[row as usize] = place as u32;
        }
        let variable = pattern.variables[j] as usize;
        let diagonal = &H.diagonal()[variable];
        let mut pivot = *diagonal;
        for &(k, entry) in pattern.row(j) {
            let L_jk = done[entry as usize];
            pivot.subtract_product(&L_jk, &L_jk);
            let below = entry as usize + 1..pattern.column(k as usize).end;
            for (&i, L_ik) in pattern.rows[below.clone()].iter().zip(&done[below]) {
                current[self.place_in_column[i as usize] as usize].subtract_product(L_ik, &L_jk);
            }
        }
        let inverse = inverse_of_factor(&pivot, diagonal).ok_or(NotPositiveDefinite { variable })?;
        for block in current {
            let mut scaled = B::zeros();
            scaled.subtract_product(block, &-inverse);
            *block = scaled;
        }
        self.inverse_diagonal[j] = inverse;
        Ok(())
    }
}

/// A factored matrix, ready to solve with.
#[derive(Debug, Clone, Copy)]
pub struct Factor<'a, B> {
    pattern: &'a FactorPattern,
    inverse_diagonal: &'a [B],
    blocks: &'a [B],
}

impl<B: SquareMatrix> Factor<'_, B> {
    /// Replaces `rhs` by the `x` of `H x = rhs`.
    ///
    /// # Panics
    /// Where `rhs` is not as long as the matrix has block rows.
    pub fn solve(&self, rhs: &mut [B::Vector]) {
        assert_eq!(rhs.len(), self.pattern.num_variables(), "one block of the right-hand side per variable");
        let mut x: Vec<_> = self.pattern.variables.iter().map(|&variable| rhs[variable as usize]).collect();
        for j in 0..x.len() {
            let x_j = self.inverse_diagonal[j].apply(&x[j]);
            x[j] = x_j;
            for (&i, L_ij) in self.column(j) {
                x[i as usize] -= L_ij.apply(&x_j);
            }
        }
        for j in (0..x.len()).rev() {
            let mut x_j = x[j];
            for (&i, L_ij) in self.column(j) {
                x_j -= L_ij.tr_apply(&x[i as usize]);
            }
            x[j] = self.inverse_diagonal[j].tr_apply(&x_j);
        }
        for (x, &variable) in x.into_iter().zip(&self.pattern.variables) {
            rhs[variable as usize] = x;
        }
    }

    /// The columns of the inverse of `H` that belong to `variable`, as one block a variable: what [`solve`](Self::solve) makes
    /// of the same columns of the identity, with the factor read once for all of them.
    ///
    /// # Panics
    /// Where `variable` is not one of the matrix.
    pub fn inverse_columns(&self, variable: usize) -> Vec<B> {
        let pattern = self.pattern;
        let mut X = vec![B::zeros(); pattern.num_variables()];
        let first = pattern.positions[variable] as usize;
        X[first] = B::identity();
        // L^-1 of a unit column is zero but at its own position and at what the elimination from there on has changed.
        let mut next = Some(first);
        while let Some(j) = next {
            let X_j = self.inverse_diagonal[j] * X[j];
            X[j] = X_j;
            for (&i, L_ij) in self.column(j) {
                X[i as usize] -= *L_ij * X_j;
            }
            next = pattern.rows[pattern.column(j)].first().map(|&parent| parent as usize);
        }
        for j in (0..X.len()).rev() {
            let mut X_j = X[j];
            for (&i, L_ij) in self.column(j) {
                X_j -= L_ij.tr_mul(&X[i as usize]);
            }
            X[j] = self.inverse_diagonal[j].tr_mul(&X_j);
        }
        pattern.positions.iter().map(|&position| X[position as usize]).collect()
    }

    /// Rows and blocks of a column below the diagonal.
    fn column(&self, j: usize) -> impl Iterator<Item = (&u32, &B)> {
        let column = self.pattern.column(j);
        self.pattern.rows[column.clone()].iter().zip(&self.blocks[column])
    }
}
