//! Lines of columns: what all text forms of a trajectory share.

use crate::io::text::{lines, number, quote, without_byte_order_mark};
use crate::{Error, Result};

/// The lines that hold something, but for a first one of names.
pub(super) fn rows(bytes: &[u8]) -> impl Iterator<Item = Row<'_>> {
    let mut rows = all_rows(bytes).filter(|row| row.columns().next().is_some()).peekable();
    rows.next_if(Row::is_of_names);
    rows
}

/// The names of the columns: the first line that holds something where it is of names, or else the last comment before
/// it. In lower case, without units.
pub(super) fn column_names(bytes: &[u8]) -> Option<Vec<String>> {
    let mut comment = None;
    for row in all_rows(bytes) {
        if row.columns().next().is_some() {
            return if row.is_of_names() { Some(names(row.text)) } else { comment.map(names) };
        }
        if let Some(start) = row.text.iter().position(|&byte| byte == b'#') {
            comment = Some(&row.text[start + 1..]);
        }
    }
    None
}

/// Names, separated by commas or semicolons where there are any, by blanks otherwise; `timestamp [ns]` is kept as `timestamp_ns`.
fn names(text: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(&text[..text.len().min(2000)]).trim_start_matches('#').to_ascii_lowercase();
    let text = text.replace(" [ns]", "_ns").replace("[ns]", "_ns").replace(" (ns)", "_ns").replace("(ns)", "_ns");
    let split: Vec<&str> =
        if text.contains([',', ';']) { text.split([',', ';']).collect() } else { text.split_whitespace().collect() };
    let name = |name: &str| {
        let name = name.split(['[', '(']).next().unwrap_or_default().replace(' ', "");
        name.trim_matches(|c: char| c == '"' || c.is_whitespace()).to_owned()
    };
    split.into_iter().map(name).collect()
}

/// Whether the first column ascends from line to line, over more lines than two matrices have: theirs comes back to 0.
pub(super) fn has_ascending_times(bytes: &[u8]) -> bool {
    let first: Option<Vec<f64>> = rows(bytes).map(|row| row.columns().next().and_then(number)).collect();
    first.is_some_and(|times| times.len() > 8 && times.windows(2).all(|pair| pair[0] < pair[1]))
}

/// All lines, those that hold nothing among them.
fn all_rows(bytes: &[u8]) -> impl Iterator<Item = Row<'_>> {
    lines(without_byte_order_mark(bytes)).map(|(line, text)| Row { line, text })
}

/// A line of columns.
#[derive(Clone)]
pub(super) struct Row<'a> {
    /// Its number, from 1.
    pub line: usize,
    text: &'a [u8],
}

impl<'a> Row<'a> {
    /// What stands between the separators, before any comment.
    pub(super) fn columns(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let values = self.text.split(|&byte| byte == b'#').next().unwrap_or_default();
        values.split(|&byte| matches!(byte, b' ' | b'\t' | b',' | b';')).filter(|column| !column.is_empty())
    }

    /// What stands between the separators, with what is empty between two of them where these are commas or semicolons.
    pub(super) fn fields(&self) -> Vec<&'a [u8]> {
        let text = self.text.trim_ascii_end();
        let is_separator = |byte: &u8| matches!(byte, b',' | b';');
        if text.iter().any(is_separator) {
            text.split(is_separator).map(<[u8]>::trim_ascii).collect()
        } else {
            self.columns().collect()
        }
    }

    /// The numbers of a row of named columns, 0 where one that is not used holds none.
    pub(super) fn named(
        &self,
        num_columns: usize,
        is_used: impl Fn(usize) -> bool,
        numbers: &mut Vec<f64>,
    ) -> Result<()> {
        let fields = self.fields();
        let is_cut = (fields.len()..num_columns).any(&is_used);
        if is_cut || fields.len() > num_columns {
            return Err(self.wrong_columns(fields.len(), num_columns));
        }
        numbers.clear();
        for (column, field) in fields.into_iter().enumerate() {
            match number(field) {
                None if is_used(column) => {
                    let problem = format!("Column {} is {}, not a finite number", column + 1, quote(field));
                    return Err(self.fault(problem, "Write decimal numbers, or remove the line"));
                }
                value => numbers.push(value.filter(|value| is_used(column) || value.is_finite()).unwrap_or(0.0)),
            }
        }
        Ok(())
    }

    /// Whether commas stand between the columns.
    pub(super) fn has_commas(&self) -> bool {
        self.text.contains(&b',')
    }

    /// Whether the first column is a whole number from 0.
    pub(super) fn begins_with_count(&self) -> bool {
        self.columns().next().and_then(number).is_some_and(|value| value >= 0.0 && value.fract() == 0.0)
    }

    fn is_of_names(&self) -> bool {
        self.columns().all(|column| number(column).is_none())
    }

    /// The numbers of the row, which must have `num_columns` of them; they need not be finite.
    pub(super) fn exactly(&self, num_columns: usize, numbers: &mut Vec<f64>) -> Result<()> {
        if self.take(num_columns, true, numbers)?.next().is_some() {
            return Err(self.wrong_columns(self.columns().count(), num_columns));
        }
        Ok(())
    }

    /// The first `num_columns` numbers of the row, which must be there; what follows is not read.
    pub(super) fn at_least(&self, num_columns: usize, numbers: &mut Vec<f64>) -> Result<()> {
        self.take(num_columns, false, numbers).map(drop)
    }

    /// Reads `num_columns` numbers and gives the columns that are left. A wrong number of columns (with `exact`, too many of
    /// them as well) is reported before a word in the place of a number, since it explains more.
    fn take(
        &self,
        num_columns: usize,
        exact: bool,
        numbers: &mut Vec<f64>,
    ) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>> {
        numbers.clear();
        let mut columns = self.columns();
        for index in 0..num_columns {
            let value = columns.next().map(|column| (column, number(column)));
            match value {
                Some((_, Some(value))) => numbers.push(value),
                None => return Err(self.wrong_columns(index, num_columns)),
                Some((column, None)) => {
                    let found = self.columns().count();
                    if found < num_columns || (exact && found > num_columns) {
                        return Err(self.wrong_columns(found, num_columns));
                    }
                    let problem = format!("Column {} is {}, not a finite number", index + 1, quote(column));
                    return Err(self.fault(problem, "Write decimal numbers, or remove the line"));
                }
            }
        }
        Ok(columns)
    }

    fn wrong_columns(&self, found: usize, expected: usize) -> Error {
        let problem = format!("The line has {found} columns in place of {expected}");
        self.fault(problem, "Every line needs the same columns: correct or remove this one")
    }

    pub(super) fn fault(&self, problem: String, remedy: &str) -> Error {
        Error::line(self.line, problem, remedy)
    }
}
