//! Cholesky factorisation of a symmetric positive definite matrix of blocks.
//!
//! Left-looking, one column of blocks after the other; Davis, "Direct Methods for Sparse Linear Systems" (2006),
//! chapters 4 and 7.

use super::{BlockMatrix, ordering};
use nalgebra::{SMatrix, SVector};
use std::fmt;

/// A pivot below this share of its diagonal entry is what rounding leaves of zero: the variable is not determined.
const MIN_PIVOT: f64 = 1e-14;

/// The matrix is not positive definite, or an entry of it is not finite.
///
/// In a pose graph: nothing fixes the variable, or a measurement's information is not positive definite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotPositiveDefinite {
    /// The variable at which this showed: it, or one it is tied to, is not determined.
    pub variable: usize,
}

impl fmt::Display for NotPositiveDefinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the system of equations is not positive definite at variable {}", self.variable)
    }
}

impl std::error::Error for NotPositiveDefinite {}

/// Solver of block-sparse systems that prepares a pattern once and then only computes with numbers.
#[derive(Debug, Clone)]
pub struct BlockCholesky<const B: usize> {
    pattern: FactorPattern,
    /// Inverses of the diagonal blocks of L, lower triangular.
    inverse_diagonal: Vec<SMatrix<f64, B, B>>,
    /// Blocks of L below the diagonal, column by column.
    blocks: Vec<SMatrix<f64, B, B>>,
    /// Where a block row is in the column that is being computed.
    place_in_column: Vec<u32>,
}

impl<const B: usize> BlockCholesky<B> {
    /// Prepares for the pattern of `H`: the order of elimination and the blocks of the factor.
    pub fn new(H: &BlockMatrix<B>) -> Self {
        let pattern = FactorPattern::new(H.num_variables(), H.places());
        Self {
            inverse_diagonal: vec![SMatrix::zeros(); pattern.num_variables()],
            blocks: vec![SMatrix::zeros(); pattern.rows.len()],
            place_in_column: vec![0; pattern.num_variables()],
            pattern,
        }
    }

    /// Factors `P H P^T = L L^T`. `H` may have other numbers than the matrix this was made for; should its pattern
    /// be another one, that is prepared first.
    ///
    /// # Errors
    /// Where `H` is not positive definite.
    pub fn factor(&mut self, H: &BlockMatrix<B>) -> Result<Factor<'_, B>, NotPositiveDefinite> {
        if H.num_variables() != self.pattern.num_variables() || H.places() != self.pattern.places {
            *self = Self::new(H);
        }
        self.blocks.fill(SMatrix::zeros());
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
            subtract_product(&mut pivot, &L_jk, &L_jk);
            let below = entry as usize + 1..pattern.column(k as usize).end;
            for (&i, L_ik) in pattern.rows[below.clone()].iter().zip(&done[below]) {
                subtract_product(&mut current[self.place_in_column[i as usize] as usize], L_ik, &L_jk);
            }
        }
        let inverse = inverse_of_factor(&pivot, diagonal).ok_or(NotPositiveDefinite { variable })?;
        for block in current {
            let mut scaled = SMatrix::zeros();
            subtract_product(&mut scaled, block, &-inverse);
            *block = scaled;
        }
        self.inverse_diagonal[j] = inverse;
        Ok(())
    }
}

/// A factored matrix, ready to solve with.
#[derive(Debug, Clone, Copy)]
pub struct Factor<'a, const B: usize> {
    pattern: &'a FactorPattern,
    inverse_diagonal: &'a [SMatrix<f64, B, B>],
    blocks: &'a [SMatrix<f64, B, B>],
}

impl<const B: usize> Factor<'_, B> {
    /// Replaces `rhs` by the `x` of `H x = rhs`.
    ///
    /// # Panics
    /// Where `rhs` is not as long as the matrix has block rows.
    pub fn solve(&self, rhs: &mut [SVector<f64, B>]) {
        assert_eq!(rhs.len(), self.pattern.num_variables(), "one block of the right-hand side per variable");
        let mut x: Vec<_> = self.pattern.variables.iter().map(|&variable| rhs[variable as usize]).collect();
        for j in 0..x.len() {
            let x_j = self.inverse_diagonal[j] * x[j];
            x[j] = x_j;
            for (&i, L_ij) in self.column(j) {
                x[i as usize] -= L_ij * x_j;
            }
        }
        for j in (0..x.len()).rev() {
            let mut x_j = x[j];
            for (&i, L_ij) in self.column(j) {
                x_j -= L_ij.tr_mul(&x[i as usize]);
            }
            x[j] = self.inverse_diagonal[j].tr_mul(&x_j);
        }
        for (x, &variable) in x.into_iter().zip(&self.pattern.variables) {
            rhs[variable as usize] = x;
        }
    }

    /// The block of the inverse of `H` on the diagonal at `variable`: its covariance, where `H` is an information
    /// matrix.
    ///
    /// # Panics
    /// Where `variable` is not one of the matrix.
    pub fn covariance(&self, variable: usize) -> SMatrix<f64, B, B> {
        // With X = L^-1 E, where E is the variable's columns of the identity, the block is E^T H^-1 E = X^T X.
        // X begins at the variable's own position and goes on only at what its elimination has changed.
        let first = self.pattern.positions[variable] as usize;
        let mut X = vec![SMatrix::<f64, B, B>::zeros(); self.pattern.num_variables() - first];
        X[0] = SMatrix::identity();
        let mut covariance = SMatrix::zeros();
        let mut next = Some(first);
        while let Some(j) = next {
            let X_j = self.inverse_diagonal[j] * X[j - first];
            covariance += X_j.tr_mul(&X_j);
            for (&i, L_ij) in self.column(j) {
                X[i as usize - first] -= L_ij * X_j;
            }
            next = self.pattern.rows[self.pattern.column(j)].first().map(|&parent| parent as usize);
        }
        covariance
    }

    /// [`covariance`](Self::covariance) of every variable, all of them for about the price of two factorisations.
    ///
    /// Takahashi's equations: from `L^T H^-1 = L^-1` the inverse follows column by column from the last to the first,
    /// and to compute it at the blocks of `L` no other blocks of it are needed. Erisman and Tinney, "On computing
    /// certain elements of the inverse of a sparse matrix", Communications of the ACM 18 (1975).
    pub fn covariances(&self) -> Vec<SMatrix<f64, B, B>> {
        let pattern = self.pattern;
        let mut diagonal = vec![SMatrix::<f64, B, B>::zeros(); pattern.num_variables()];
        let mut blocks = vec![SMatrix::<f64, B, B>::zeros(); self.blocks.len()];
        let mut unit_column = Vec::new();
        for j in (0..pattern.num_variables()).rev() {
            let inverse = &self.inverse_diagonal[j];
            let column = pattern.column(j);
            let rows = &pattern.rows[column.clone()];
            // M_ij = L_ij L_jj^-1; the column of the inverse is S_ij = -(sum over k of S_ik M_kj).
            unit_column.clear();
            unit_column.extend(self.blocks[column.clone()].iter().map(|L_ij| L_ij * inverse));
            let (before, after) = blocks.split_at_mut(column.end);
            let current = &mut before[column.start..];
            for (place, &k) in rows.iter().enumerate() {
                let M_kj = &unit_column[place];
                current[place] -= diagonal[k as usize] * M_kj;
                // The rows of this column after k are all among those of column k.
                let mut later = place + 1;
                for entry in pattern.column(k as usize) {
                    if rows.get(later) == Some(&pattern.rows[entry]) {
                        let S_ik = &after[entry - column.end];
                        current[later] -= S_ik * M_kj;
                        current[place] -= S_ik.tr_mul(&unit_column[later]);
                        later += 1;
                    }
                }
            }
            let products = unit_column.iter().zip(current).map(|(M_kj, S_kj)| M_kj.tr_mul(S_kj));
            diagonal[j] = products.fold(inverse.tr_mul(inverse), |sum, product| sum - product);
        }
        pattern.positions.iter().map(|&position| diagonal[position as usize]).collect()
    }

    /// Rows and blocks of a column below the diagonal.
    fn column(&self, j: usize) -> impl Iterator<Item = (&u32, &SMatrix<f64, B, B>)> {
        let column = self.pattern.column(j);
        self.pattern.rows[column.clone()].iter().zip(&self.blocks[column])
    }
}

/// Which blocks the factor of a pattern has. Rows and columns are positions in the order of elimination.
#[derive(Debug, Clone)]
struct FactorPattern {
    /// The pattern of the matrix: the places of its blocks above the diagonal.
    places: Vec<(u32, u32)>,
    /// For each of `places` the entry of `rows` it goes to, and whether transposed.
    targets: Vec<(u32, bool)>,
    /// Variable at each position, and the inverse.
    variables: Vec<u32>,
    positions: Vec<u32>,
    /// Rows below the diagonal, ascending, column by column.
    rows: Vec<u32>,
    column_starts: Vec<usize>,
    /// Column and entry of `rows` of the blocks left of the diagonal, ascending, row by row.
    row_entries: Vec<(u32, u32)>,
    row_starts: Vec<usize>,
}

impl FactorPattern {
    fn new(num_variables: usize, places: &[(u32, u32)]) -> Self {
        let variables = ordering::minimum_degree(num_variables, places);
        let mut positions = vec![0; num_variables];
        for (position, &variable) in (0..).zip(&variables) {
            positions[variable as usize] = position;
        }
        let (rows, column_starts) = fill(&permuted_columns(&positions, places));
        let mut pattern = Self {
            places: places.to_vec(),
            targets: Vec::new(),
            variables,
            positions,
            rows,
            column_starts,
            row_entries: Vec::new(),
            row_starts: Vec::new(),
        };
        pattern.targets = places.iter().map(|&place| pattern.target(place)).collect();
        pattern.index_rows();
        pattern
    }

    fn num_variables(&self) -> usize {
        self.variables.len()
    }

    /// Entries of `rows` of a column.
    fn column(&self, j: usize) -> std::ops::Range<usize> {
        self.column_starts[j]..self.column_starts[j + 1]
    }

    fn row(&self, i: usize) -> &[(u32, u32)] {
        &self.row_entries[self.row_starts[i]..self.row_starts[i + 1]]
    }

    fn target(&self, (i, j): (u32, u32)) -> (u32, bool) {
        let (row, column) = (self.positions[i as usize], self.positions[j as usize]);
        let is_transposed = row < column;
        let (row, column) = (row.max(column), row.min(column));
        let entries = self.column(column as usize);
        let place = self.rows[entries.clone()].partition_point(|&other| other < row);
        ((entries.start + place) as u32, is_transposed)
    }

    fn index_rows(&mut self) {
        let n = self.num_variables();
        let mut starts = vec![0; n + 1];
        for &row in &self.rows {
            starts[row as usize + 1] += 1;
        }
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let mut ends = starts.clone();
        self.row_entries = vec![(0, 0); self.rows.len()];
        for j in 0..n {
            for entry in self.column(j) {
                let end = &mut ends[self.rows[entry] as usize];
                self.row_entries[*end] = (j as u32, entry as u32);
                *end += 1;
            }
        }
        self.row_starts = starts;
    }
}

/// Rows below the diagonal of each column of the permuted matrix.
fn permuted_columns(positions: &[u32], places: &[(u32, u32)]) -> Vec<Vec<u32>> {
    let mut columns = vec![Vec::new(); positions.len()];
    for &(i, j) in places {
        let (i, j) = (positions[i as usize], positions[j as usize]);
        columns[i.min(j) as usize].push(i.max(j));
    }
    columns
}

/// The rows of the factor's columns: those of the matrix and those of the columns whose first row this one is
/// (its children in the elimination tree).
fn fill(columns: &[Vec<u32>]) -> (Vec<u32>, Vec<usize>) {
    let n = columns.len();
    let mut rows = Vec::new();
    let mut starts = vec![0; n + 1];
    let mut children = vec![Vec::new(); n];
    // A row is in the current column when it is marked with it.
    let mut marks = vec![usize::MAX; n];
    for j in 0..n {
        let start = rows.len();
        let mut push = |rows: &mut Vec<u32>, row: u32| {
            if row as usize != j && std::mem::replace(&mut marks[row as usize], j) != j {
                rows.push(row);
            }
        };
        for &row in &columns[j] {
            push(&mut rows, row);
        }
        for &child in &children[j] {
            for entry in starts[child]..starts[child + 1] {
                let row = rows[entry];
                push(&mut rows, row);
            }
        }
        rows[start..].sort_unstable();
        starts[j + 1] = rows.len();
        if let Some(&parent) = rows.get(start) {
            children[parent as usize].push(j);
        }
    }
    (rows, starts)
}

/// `C -= A B^T`, column by column of `C`, which are contiguous.
#[inline]
fn subtract_product<const B: usize>(C: &mut SMatrix<f64, B, B>, A: &SMatrix<f64, B, B>, Bt: &SMatrix<f64, B, B>) {
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
fn inverse_of_factor<const B: usize>(
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    /// Uniform numbers in -1..1 from a constant seed (xorshift64*).
    struct Random(u64);

    impl Random {
        fn next(&mut self) -> u64 {
            self.0 ^= self.0 >> 12;
            self.0 ^= self.0 << 25;
            self.0 ^= self.0 >> 27;
            self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11
        }

        fn uniform(&mut self) -> f64 {
            self.next() as f64 / (1u64 << 52) as f64 - 1.0
        }

        fn block<const B: usize>(&mut self) -> SMatrix<f64, B, B> {
            SMatrix::from_fn(|_, _| self.uniform())
        }
    }

    /// A sum of `J^T J` over the edges, each given either way round, and over a prior of each variable, as estimation
    /// makes it.
    fn accumulate<const B: usize>(H: &mut BlockMatrix<B>, edges: &[(usize, usize)], random: &mut Random) {
        for i in 0..H.num_variables() {
            let J = random.block::<B>();
            H.add(i, i, &(J.tr_mul(&J) + SMatrix::identity() * 0.1));
        }
        for &(i, j) in edges {
            let (J_i, J_j) = (random.block::<B>(), random.block::<B>());
            H.add(i, i, &J_i.tr_mul(&J_i));
            H.add(j, j, &J_j.tr_mul(&J_j));
            H.add(i, j, &J_i.tr_mul(&J_j));
        }
    }

    fn dense<const B: usize>(H: &BlockMatrix<B>) -> DMatrix<f64> {
        let n = H.num_variables();
        DMatrix::from_fn(n * B, n * B, |row, column| H.block(row / B, column / B)[(row % B, column % B)])
    }

    fn check_against_dense<const B: usize>(name: &str, cholesky: &mut BlockCholesky<B>, H: &BlockMatrix<B>) {
        let n = H.num_variables();
        let factor = cholesky.factor(H).unwrap_or_else(|error| panic!("{name}, B = {B}: {error}"));
        let inverse = dense(H).cholesky().expect("positive definite by construction").inverse();
        let rhs: Vec<_> = (0..n).map(|i| SVector::<f64, B>::from_fn(|row, _| ((i * B + row) as f64).sin())).collect();
        let expected = &inverse * DMatrix::from_fn(n * B, 1, |row, _| rhs[row / B][row % B]);
        let mut x = rhs;
        factor.solve(&mut x);
        let covariances = factor.covariances();
        assert_eq!(covariances.len(), n);
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9 * inverse.amax();
        for i in 0..n {
            let covariance = factor.covariance(i);
            for row in 0..B {
                assert!(close(x[i][row], expected[i * B + row]), "{name}, B = {B}: x at {i}");
                for column in 0..B {
                    let expected = inverse[(i * B + row, i * B + column)];
                    assert!(close(covariance[(row, column)], expected), "{name}, B = {B}: covariance of {i}");
                    assert!(close(covariances[i][(row, column)], expected), "{name}, B = {B}: covariances at {i}");
                }
            }
        }
    }

    type Edges = Vec<(usize, usize)>;

    /// Name, number of variables and edges.
    fn patterns() -> Vec<(&'static str, usize, Edges)> {
        let mut random = Random(1);
        let mut pairs = |n: usize, count: usize| -> Edges {
            let pair = |random: &mut Random| (random.next() as usize % n, random.next() as usize % n);
            (0..count).map(|_| pair(&mut random)).filter(|(i, j)| i != j).collect()
        };
        let chain = |n: usize| (1..n).map(|j| (j - 1, j)).collect::<Edges>();
        let star = |n: usize, hub: usize| (0..n).filter(|&i| i != hub).map(|i| (hub, i)).collect::<Vec<_>>();
        let window = |n: usize, width: usize| {
            (0..n).flat_map(|j| (j.saturating_sub(width)..j).map(move |i| (j, i))).collect::<Vec<_>>()
        };
        let mut patterns = vec![
            ("nothing", 0, vec![]),
            ("single", 1, vec![]),
            ("pair", 2, vec![(1, 0)]),
            ("no edges", 7, vec![]),
            ("chain", 20, chain(20)),
            ("chain backwards", 20, (1..20).map(|j| (20 - j, 19 - j)).collect()),
            ("chain with loops", 32, [chain(32), pairs(32, 10)].concat()),
            ("the same edge again and either way round", 5, [chain(5), vec![(3, 2), (2, 3), (4, 0), (0, 4)]].concat()),
            ("star", 24, star(24, 0)),
            ("star about a middle variable", 24, star(24, 17)),
            ("full", 12, window(12, 12)),
            ("window of 4", 24, window(24, 4)),
            ("disconnected chains", 20, chain(20).into_iter().filter(|(i, _)| i % 7 != 3).collect()),
        ];
        patterns.extend((0..12).map(|i| ("random", 5 + 2 * i, pairs(5 + 2 * i, 3 + i * i / 2))));
        patterns
    }

    fn check<const B: usize>() {
        let mut random = Random(2);
        for (name, n, edges) in patterns() {
            let mut H = BlockMatrix::<B>::new(n);
            accumulate(&mut H, &edges, &mut random);
            let mut cholesky = BlockCholesky::new(&H);
            check_against_dense(name, &mut cholesky, &H);
            // The same pattern with new numbers.
            H.clear();
            assert_eq!(dense(&H).amax(), 0.0);
            accumulate(&mut H, &edges, &mut random);
            check_against_dense(name, &mut cholesky, &H);
            // Another pattern, and another size.
            if n > 2 {
                accumulate(&mut H, &[(0, n - 1), (n / 2, 0)], &mut random);
                check_against_dense(name, &mut cholesky, &H);
            }
            let mut larger = BlockMatrix::new(n + 1);
            accumulate(&mut larger, &[], &mut random);
            check_against_dense(name, &mut cholesky, &larger);
        }
    }

    #[test]
    fn agrees_with_dense_for_blocks_of_1() {
        check::<1>();
    }

    #[test]
    fn agrees_with_dense_for_blocks_of_3() {
        check::<3>();
    }

    #[test]
    fn agrees_with_dense_for_blocks_of_6() {
        check::<6>();
    }

    #[test]
    fn order_is_a_permutation_and_its_inverse() {
        for (name, n, edges) in patterns() {
            let places: Vec<_> = edges.iter().map(|&(i, j)| (i.min(j) as u32, i.max(j) as u32)).collect();
            let pattern = FactorPattern::new(n, &places);
            for (position, &variable) in pattern.variables.iter().enumerate() {
                assert_eq!(pattern.positions[variable as usize] as usize, position, "{name}");
            }
            assert_eq!(pattern.variables.len(), n, "{name}");
            assert!(pattern.rows.len() <= n * n.saturating_sub(1) / 2, "{name}");
        }
    }

    #[test]
    fn refuses_what_is_not_positive_definite_and_recovers() {
        let edges: Vec<_> = (1..6).map(|j| (j - 1, j)).collect();
        let mut good = BlockMatrix::<3>::new(6);
        accumulate(&mut good, &edges, &mut Random(3));
        let mut cholesky = BlockCholesky::new(&good);
        let strong: SMatrix<f64, 3, 3> = SMatrix::identity() * 1e3;
        let cases: [(&str, usize, usize, SMatrix<f64, 3, 3>); 6] = [
            ("a negative diagonal block", 4, 4, -strong),
            ("a coupling stronger than the diagonal", 2, 3, strong),
            ("NaN on the diagonal", 4, 4, SMatrix::repeat(f64::NAN)),
            ("NaN off the diagonal", 1, 2, SMatrix::repeat(f64::NAN)),
            ("infinity on the diagonal", 5, 5, SMatrix::repeat(f64::INFINITY)),
            ("infinity off the diagonal", 1, 0, SMatrix::repeat(f64::NEG_INFINITY)),
        ];
        for (name, i, j, block) in cases {
            let mut bad = good.clone();
            bad.add(i, j, &block);
            let error = cholesky.factor(&bad).map(|_| ()).expect_err(name);
            assert!(error.variable < 6, "{name}: {error}");
            if i == j && block[(0, 0)] < 0.0 {
                assert_eq!(error.variable, i, "{name}");
            }
            check_against_dense(name, &mut cholesky, &good);
        }
    }

    #[test]
    fn refuses_variables_that_nothing_determines() {
        // Differences alone leave a common offset free.
        let mut H = BlockMatrix::<1>::new(4);
        for j in 1..4 {
            H.add(j - 1, j - 1, &SMatrix::identity());
            H.add(j, j, &SMatrix::identity());
            H.add(j - 1, j, &-SMatrix::identity());
        }
        let error = BlockCholesky::new(&H).factor(&H).map(|_| ()).expect_err("singular");
        assert!(error.to_string().ends_with(&format!("at variable {}", error.variable)));
        H.add(2, 2, &SMatrix::identity());
        assert!(BlockCholesky::new(&H).factor(&H).is_ok());
        // One that no measurement names.
        let mut H = BlockMatrix::<3>::new(3);
        H.add(0, 0, &SMatrix::identity());
        H.add(2, 2, &SMatrix::identity());
        let error = BlockCholesky::new(&H).factor(&H).map(|_| ()).expect_err("zero block");
        assert_eq!(error, NotPositiveDefinite { variable: 1 });
    }
}
