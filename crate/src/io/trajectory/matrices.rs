//! 4 x 4 matrices, a line a row, a pose after the other; before each, a line of counts may stand, as in Redwood's
//! `.log` files.

use super::columns::{Builder, POSITION_OF_MATRIX, not_finite};
use super::rows::{Row, rows};
use super::{MatrixPose, nothing};
use crate::Result;
use crate::geometry::Pose3;
use crate::io::text::number;

/// Columns of the line of counts before a matrix.
const COUNTS: usize = 3;

/// Whether a line of counts stands before the first matrix.
pub(super) fn has_counts(bytes: &[u8]) -> bool {
    rows(bytes).take(5).map(|row| row.columns().count()).eq([COUNTS, 4, 4, 4, 4])
}

/// Whether the fourth line is the last row of a pose's matrix.
pub(super) fn has_last_rows(bytes: &[u8]) -> bool {
    let mut rows = rows(bytes).map(|row| row.columns().map(number).collect::<Vec<_>>());
    let is_undefined = |row: &Vec<Option<f64>>| row.iter().flatten().any(|value| !value.is_finite());
    // Of poses that hold no numbers, as trackers write where they are lost, the last row tells nothing.
    let mut last = rows.nth(3);
    while last.as_ref().is_some_and(is_undefined) {
        last = rows.nth(3).or(Some(vec![Some(0.0), Some(0.0), Some(0.0), Some(1.0)]));
    }
    last.is_some_and(|last| last == [0.0, 0.0, 0.0, 1.0].map(Some))
}

pub(super) fn read<'a>(rows: impl Iterator<Item = Row<'a>>) -> Result<Builder> {
    let mut builder = Builder::new();
    let mut matrix = Vec::with_capacity(16);
    let mut numbers = Vec::new();
    let mut last: Option<Row> = None;
    let mut undefined = None;
    for row in rows {
        if matrix.is_empty() && row.columns().count() == COUNTS {
            row.exactly(COUNTS, &mut numbers)?;
            last = Some(row);
            continue;
        }
        row.exactly(4, &mut numbers)?;
        let fault = |problem: String, remedy: &str| row.fault(problem, remedy);
        if let Some(column) = numbers.iter().position(|value| !value.is_finite()) {
            undefined.get_or_insert_with(|| not_finite(column, numbers[column], &fault));
        }
        matrix.append(&mut numbers);
        if matrix.len() == 16 {
            match undefined.take() {
                Some(error) if POSITION_OF_MATRIX.iter().any(|&at| matrix[at].is_finite()) => return Err(error),
                Some(error) => builder.push_undefined(|| error),
                None => builder.push_matrix(&matrix, &fault)?,
            }
            matrix.clear();
        }
        last = Some(row);
    }
    match last {
        None => Err(nothing()),
        Some(row) if !matrix.is_empty() => {
            let problem = format!("The last matrix ends after {} of 4 rows", matrix.len() / 4);
            Err(row.fault(problem, "Was the file cut off? Write it again"))
        }
        Some(_) => Ok(builder),
    }
}

/// A pose as the 4 x 4 matrix of its homogeneous coordinates, one row a line.
pub fn matrix_text(pose: &Pose3) -> String {
    text(&[(pose.rotation.to_rotation_matrix().into_inner(), pose.translation.vector)])
}

pub(super) fn text(poses: &[MatrixPose]) -> String {
    let mut text = String::new();
    for (R, t) in poses {
        for row in 0..3 {
            // Adding zero turns -0 into 0.
            let numbers = [R[(row, 0)], R[(row, 1)], R[(row, 2)], t[row]].map(|number| format!("{:?}", number + 0.0));
            text += &(numbers.join(" ") + "\n");
        }
        text += "0.0 0.0 0.0 1.0\n";
    }
    text
}
