//! A symmetric block matrix that is accumulated measurement by measurement.

use crate::geometry::SquareMatrix;

/// A symmetric matrix of blocks of one size, one block row per variable, of which only some blocks are not zero.
///
/// The stored blocks are its pattern. It grows with [`add`](Self::add) and is kept by [`clear`](Self::clear), so that a
/// [`BlockCholesky`](super::BlockCholesky) analyses a pattern once for all iterations.
#[derive(Debug, Clone)]
pub struct BlockMatrix<B> {
    diagonal: Vec<B>,
    /// Blocks above the diagonal, in the order of their creation.
    blocks: Vec<B>,
    /// Row and column of each of `blocks`, row < column.
    places: Vec<(u32, u32)>,
    /// For each column its rows, ascending, each with the index of its block.
    columns: Vec<Vec<(u32, u32)>>,
}

impl<B: SquareMatrix> BlockMatrix<B> {
    /// The zero matrix for this many variables, less than 2^32.
    pub fn new(num_variables: usize) -> Self {
        Self {
            diagonal: vec![B::zeros(); num_variables],
            blocks: Vec::new(),
            places: Vec::new(),
            columns: vec![Vec::new(); num_variables],
        }
    }

    /// Number of block rows.
    pub fn num_variables(&self) -> usize {
        self.diagonal.len()
    }

    /// Adds `block` at block row `i` and block column `j`, and its transpose at `j`, `i`. A block added on the diagonal
    /// must be symmetric.
    ///
    /// # Panics
    /// Where `i` or `j` is not a variable of the matrix.
    pub fn add(&mut self, i: usize, j: usize, block: &B) {
        if i == j {
            self.diagonal[i] += *block;
            return;
        }
        let (row, column) = (i.min(j) as u32, i.max(j) as u32);
        let rows = &mut self.columns[column as usize];
        let index = match rows.binary_search_by_key(&row, |&(row, _)| row) {
            Ok(place) => rows[place].1 as usize,
            Err(place) => {
                rows.insert(place, (row, self.blocks.len() as u32));
                self.places.push((row, column));
                self.blocks.push(B::zeros());
                self.blocks.len() - 1
            }
        };
        if i < j {
            self.blocks[index] += *block;
        } else {
            self.blocks[index] += block.transpose();
        }
    }

    /// Adds the block of a factor between two nodes of a graph whose node 0 is fixed, so that node `i` is variable `i - 1`: `block`
    /// on the diagonal at both nodes, and its negative at block row `from` and block column `to`.
    ///
    /// # Panics
    /// Where a node is beyond the matrix.
    pub fn add_between(&mut self, from: usize, to: usize, block: &B) {
        let variables = [from, to].map(|node| node.checked_sub(1));
        for variable in variables.into_iter().flatten() {
            self.add(variable, variable, block);
        }
        if let [Some(from), Some(to)] = variables {
            self.add(from, to, &-*block);
        }
    }

    /// The block at block row `i` and block column `j`, zero where nothing was added.
    ///
    /// # Panics
    /// Where `i` or `j` is not a variable of the matrix.
    pub fn block(&self, i: usize, j: usize) -> B {
        if i == j {
            return self.diagonal[i];
        }
        let (row, column) = (i.min(j), i.max(j));
        let rows = &self.columns[column];
        let Ok(place) = rows.binary_search_by_key(&(row as u32), |&(row, _)| row) else {
            return B::zeros();
        };
        let block = self.blocks[rows[place].1 as usize];
        if i < j { block } else { block.transpose() }
    }

    /// Sets all blocks to zero and keeps the pattern.
    pub fn clear(&mut self) {
        self.diagonal.fill(B::zeros());
        self.blocks.fill(B::zeros());
    }

    pub(super) fn diagonal(&self) -> &[B] {
        &self.diagonal
    }

    pub(super) fn blocks(&self) -> &[B] {
        &self.blocks
    }

    pub(super) fn places(&self) -> &[(u32, u32)] {
        &self.places
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    #[test]
    fn blocks_add_up_from_both_sides_and_the_pattern_stays() {
        let block = Matrix2::new(1.0, 2.0, 3.0, 4.0);
        let mut H = BlockMatrix::<Matrix2<f64>>::new(3);
        H.add(2, 0, &block);
        assert_eq!((H.block(2, 0), H.block(0, 2)), (block, block.transpose()));
        H.add(0, 2, &block);
        assert_eq!((H.block(2, 0), H.block(0, 2)), (block + block.transpose(), block + block.transpose()));
        H.add(1, 1, &Matrix2::identity());
        H.add(1, 1, &Matrix2::identity());
        assert_eq!(H.block(1, 1), Matrix2::identity() * 2.0);
        H.add(1, 2, &block);
        assert_eq!((H.block(0, 1), H.block(2, 1)), (Matrix2::zeros(), block.transpose()));
        H.clear();
        assert_eq!((H.block(0, 2), H.block(1, 1), H.num_variables()), (Matrix2::zeros(), Matrix2::zeros(), 3));
        assert_eq!(H.places(), [(0, 2), (1, 2)]);
    }

    #[test]
    fn a_factor_between_nodes_adds_to_both_but_not_to_the_fixed_one() {
        let block = Matrix2::new(2.0, 1.0, 1.0, 3.0);
        let mut H = BlockMatrix::<Matrix2<f64>>::new(2);
        H.add_between(2, 1, &block);
        assert_eq!((H.block(0, 0), H.block(1, 1), H.block(0, 1)), (block, block, -block));
        H.add_between(0, 2, &block);
        assert_eq!((H.block(0, 0), H.block(1, 1), H.block(0, 1)), (block, block * 2.0, -block));
    }
}
