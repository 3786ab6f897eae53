//! The pattern of the factor of a block-sparse matrix: the symbolic part of the factorisation.
//!
//! Davis, "Direct Methods for Sparse Linear Systems" (2006), chapter 4.

use super::ordering;

/// The blocks of the factor. Rows and columns are positions in the order of elimination.
#[derive(Debug, Clone)]
pub(super) struct FactorPattern {
    /// The pattern of the matrix: the places of its blocks above the diagonal.
    pub(super) places: Vec<(u32, u32)>,
    /// For each of `places` the entry of `rows` it goes to, and whether transposed.
    pub(super) targets: Vec<(u32, bool)>,
    /// Variable at each position, and the inverse.
    pub(super) variables: Vec<u32>,
    pub(super) positions: Vec<u32>,
    /// Rows below the diagonal, ascending, column by column.
    pub(super) rows: Vec<u32>,
    column_starts: Vec<usize>,
    /// Column and entry of `rows` of the blocks left of the diagonal, ascending, row by row.
    row_entries: Vec<(u32, u32)>,
    row_starts: Vec<usize>,
}

impl FactorPattern {
    pub(super) fn new(num_variables: usize, places: &[(u32, u32)]) -> Self {
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

    pub(super) fn num_variables(&self) -> usize {
        self.variables.len()
    }

    /// Entries of `rows` of a column.
    pub(super) fn column(&self, j: usize) -> std::ops::Range<usize> {
        self.column_starts[j]..self.column_starts[j + 1]
    }

    pub(super) fn row(&self, i: usize) -> &[(u32, u32)] {
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
