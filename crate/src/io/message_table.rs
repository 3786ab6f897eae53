//! Tables of ROS messages, one a row, with the names of their fields in the first line: what `rostopic echo -p` writes
//! (`%time,field.header.stamp,field.ranges0,...`), or exporters of bags (`Time,header.stamp.secs,ranges_0,...`).

use std::borrow::Cow;

use crate::io::text::{lines, number, quote, without_byte_order_mark};
use crate::io::time_unit::{NANOSECOND, unit_since_1970};
use crate::{Error, Result};

/// What to do about a line that is wrong.
pub(super) const REMEDY: &str = "The line may be cut off: complete it or remove it";

/// The names of a table's columns, as the message has them: `field.pose.pose.position.x` is `pose.pose.position.x`.
pub(super) struct MessageTable {
    pub names: Vec<String>,
    /// Seconds or nanoseconds.
    time: Option<usize>,
    /// Whether `time` is in nanoseconds, however small: as `rostopic echo -p` writes all times.
    is_in_nanoseconds: bool,
    /// Nanoseconds beside a time in whole seconds.
    nanoseconds: Option<usize>,
}

impl MessageTable {
    /// The table that begins with this line of names.
    pub fn from_head(bytes: &[u8]) -> Self {
        let (_, line) = lines(without_byte_order_mark(bytes)).next().unwrap_or_default();
        let is_of_rostopic = line.starts_with(b"%time");
        let names: Vec<String> = cells(line).map(name_of).collect();
        let find = |wanted: &str| names.iter().position(|name| name == wanted);
        let stamp = find("header.stamp");
        let seconds = find("header.stamp.secs").or_else(|| find("header.stamp.sec"));
        let nanoseconds = find("header.stamp.nsecs").or_else(|| find("header.stamp.nanosec"));
        let time = stamp.or(seconds).or_else(|| find("time")).or_else(|| find("__time"));
        Self {
            time,
            is_in_nanoseconds: is_of_rostopic && (stamp.is_some() || seconds.is_none()),
            nanoseconds: nanoseconds.filter(|_| stamp.is_none()),
            names,
        }
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }

    /// The first column whose name is `ending` or ends in `.ending`.
    pub fn column_ending(&self, ending: &str) -> Option<usize> {
        let ends = |name: &String| name.strip_suffix(ending).is_some_and(|rest| rest.is_empty() || rest.ends_with('.'));
        self.names.iter().position(ends)
    }

    /// The rows, whose lines are counted from 2. A last row that is cut off is left out if there are others, and the number of its
    /// line is returned as well.
    pub fn rows<'a>(&self, bytes: &'a [u8]) -> Result<(Vec<Row<'a>>, Option<usize>)> {
        let mut rows: Vec<Row<'_>> = lines(bytes)
            .skip(1)
            .filter(|(_, text)| !text.trim_ascii().is_empty())
            .map(|(line, text)| Row { line, cells: cells(text).collect() })
            .collect();
        let is_whole = |row: &Row| row.cells.len() == self.names.len();
        let cut = rows.last().filter(|row| !is_whole(row) && rows.len() > 1).map(|row| row.line);
        rows.truncate(rows.len() - usize::from(cut.is_some()));
        match rows.iter().find(|row| !is_whole(row)) {
            None => Ok((rows, cut)),
            Some(row) => {
                let problem = format!("{} columns where the first line names {}", row.cells.len(), self.names.len());
                Err(Error::line(row.line, problem, REMEDY))
            }
        }
    }

    /// When the message was made (s); `None` where no column tells.
    pub fn time(&self, row: &Row) -> Result<Option<f64>> {
        let Some(time) = self.time.map(|column| row.value(column)).transpose()? else { return Ok(None) };
        let nanoseconds = self.nanoseconds.map(|column| row.value(column)).transpose()?.unwrap_or(0.0);
        let unit = if self.is_in_nanoseconds { NANOSECOND } else { unit_since_1970(time).unwrap_or(1.0) };
        Ok(Some(unit * time + NANOSECOND * nanoseconds).filter(|time| time.is_finite()))
    }
}

/// A table some of whose cells hold lists, `"[1.5, inf]"` or `"(1.5, inf)"` as Python's programs write them, with a column for each
/// element (`ranges[0]`, `ranges[1]`, ...), empty behind the end of shorter lists; as it is where none does.
pub(super) fn with_a_cell_for_each_element(bytes: &[u8]) -> Cow<'_, [u8]> {
    let mut rows = lines(bytes).map(|(_, line)| line).filter(|line| !line.trim_ascii().is_empty()).map(split_lists);
    let Some(names) = rows.next() else { return Cow::Borrowed(bytes) };
    let rows: Vec<Vec<Vec<&[u8]>>> = rows.collect();
    let is_list = |column: usize| rows.iter().any(|row| row.get(column).is_some_and(|cell| cell.len() > 1));
    if !(0..names.len()).any(is_list) {
        return Cow::Borrowed(bytes);
    }
    let length = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(Vec::len).max().unwrap_or(1);
    let lengths: Vec<usize> = (0..names.len()).map(length).collect();
    let head = names.iter().zip(&lengths).flat_map(|(name, &length)| {
        let name = String::from_utf8_lossy(name[0]).into_owned();
        (0..length).map(move |at| if length > 1 { format!("{name}[{at}]") } else { name.clone() })
    });
    let mut text = head.collect::<Vec<_>>().join(",").into_bytes();
    for row in &rows {
        let cells = row
            .iter()
            .zip(&lengths)
            .flat_map(|(cell, &length)| (0..length).map(move |at| cell.get(at).copied().unwrap_or_default()));
        text.push(b'\n');
        text.extend(cells.collect::<Vec<_>>().join(&b','));
    }
    Cow::Owned(text)
}

/// The elements of each cell of a row.
fn split_lists(line: &[u8]) -> Vec<Vec<&[u8]>> {
    let (mut depth, mut is_quoted) = (0_usize, false);
    let cells = line.split(|&byte| {
        match byte {
            b'"' => is_quoted = !is_quoted,
            b'[' | b'(' => depth += 1,
            b']' | b')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        byte == b',' && depth == 0 && !is_quoted
    });
    let bare = |cell: &'_ [u8]| -> usize { cell.iter().take_while(|byte| b"\"[( ".contains(byte)).count() };
    cells
        .map(|cell| {
            let cell = cell.trim_ascii();
            if !cell.iter().any(|byte| b"[(".contains(byte)) {
                return vec![cell];
            }
            let inner = &cell[bare(cell)..];
            let end = inner.iter().rposition(|byte| !b"\"]) ,".contains(byte)).map_or(0, |last| last + 1);
            inner[..end].split(|&byte| byte == b',').map(<[u8]>::trim_ascii).collect()
        })
        .collect()
}

/// A message.
pub(super) struct Row<'a> {
    /// Number of its line, from 1.
    pub line: usize,
    cells: Vec<&'a [u8]>,
}

impl Row<'_> {
    /// The number in a column; NaN where it is empty, as exporters write what is not finite.
    pub fn value(&self, column: usize) -> Result<f64> {
        if self.cells[column].is_empty() {
            return Ok(f64::NAN);
        }
        number(self.cells[column]).ok_or_else(|| {
            let problem = format!("{} in column {} is not a number", quote(self.cells[column]), column + 1);
            Error::line(self.line, problem, "Correct the line or remove it")
        })
    }
}

/// The cells of a row, without the spaces around them.
fn cells(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|&byte| byte == b',').map(<[u8]>::trim_ascii)
}

fn name_of(cell: &[u8]) -> String {
    let text = String::from_utf8_lossy(cell).to_ascii_lowercase();
    let name = text.trim_matches(['%', '"']);
    // PlotJuggler writes `/scan/ranges[0]`, and `header/stamp` between slashes.
    let name = if name.starts_with('/') { name.rsplit('/').next().unwrap_or(name) } else { name };
    name.trim_start_matches("field.").to_owned()
}
