//! A symmetric matrix of blocks that is summed up measurement by measurement.

use nalgebra::SMatrix;

/// A symmetric matrix of `B` x `B` blocks, one block row per variable, of which only some blocks are not zero.
///
/// The blocks present are its pattern. It grows with [`add`](Self::add) and outlives [`clear`](Self::clear), so that a
/// [`BlockCholesky`](super::BlockCholesky) prepares a pattern once for all iterations.
#[derive(Debug, Clone)]
pub struct BlockMatrix<const B: usize> {
    diagonal: Vec<SMatrix<f64, B, B>>,
    /// Above the diagonal, in the order in which they were first added to.
    blocks: Vec<SMatrix<f64, B, B>>,
    /// Row and column of each of `blocks`, row < column.
    places: Vec<(u32, u32)>,
    /// For each column its rows, ascending, each with the index of its block.
    columns: Vec<Vec<(u32, u32)>>,
}

impl<const B: usize> BlockMatrix<B> {
    /// The zero matrix for this many variables, less than 2^32.
    pub fn new(num_variables: usize) -> Self {
        Self {
            diagonal: vec![SMatrix::zeros(); num_variables],
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
    pub fn add(&mut self, i: usize, j: usize, block: &SMatrix<f64, B, B>) {
        if i == j {
            self.diagonal[i] += block;
            return;
        }
        let (row, column) = (i.min(j), i.max(j));
        let rows = &mut self.columns[column];
        let index = match rows.binary_search_by_key(&(row as u32), |&(row, _)| row) {
            Ok(place) => rows[place].1 as usize,
            Err(place) => {
                let index = self.blocks.len();
                rows.insert(place, (row as u32, index as u32));
                self.places.push((row as u32, column as u32));
                self.blocks.push(SMatrix::zeros());
                index
            }
        };
        if i < j {
            self.blocks[index] += block;
        } else {
            self.blocks[index] += block.transpose();
        }
    }

    /// The block at block row `i` and block column `j`, zero where nothing was added.
    ///
    /// # Panics
    /// Where `i` or `j` is not a variable of the matrix.
    pub fn block(&self, i: usize, j: usize) -> SMatrix<f64, B, B> {
        if i == j {
            return self.diagonal[i];
        }
        let (row, column) = (i.min(j), i.max(j));
        let rows = &self.columns[column];
        match rows.binary_search_by_key(&(row as u32), |&(row, _)| row) {
            Ok(place) if i < j => self.blocks[rows[place].1 as usize],
            Ok(place) => self.blocks[rows[place].1 as usize].transpose(),
            Err(_) => SMatrix::zeros(),
        }
    }

    /// Sets all blocks to zero and keeps the pattern.
    pub fn clear(&mut self) {
        self.diagonal.fill(SMatrix::zeros());
        self.blocks.fill(SMatrix::zeros());
    }

    pub(super) fn diagonal(&self) -> &[SMatrix<f64, B, B>] {
        &self.diagonal
    }

    pub(super) fn blocks(&self) -> &[SMatrix<f64, B, B>] {
        &self.blocks
    }

    pub(super) fn places(&self) -> &[(u32, u32)] {
        &self.places
    }
}
