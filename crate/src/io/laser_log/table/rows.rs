//! The numbers of a table, whatever stands between them: spaces, tabs, commas, semicolons or bars, brackets of lists; decimal
//! points or decimal commas.

use std::borrow::Cow;

use super::super::fields::is_comment;
use super::clock::clock;
use super::names::{MIN_SCAN_NUMBERS, are_scans, between_ranges, is_pose, series};
use super::quoted_commas::QuotedCommas;
use crate::io::laser_log::units::MAX_RADIANS;
use crate::io::length_unit::UNITS;
use crate::io::text::{lines, number};

/// A comment that begins so says what the columns are.
const FORMAT_COMMENT: &[u8] = b"table:";
/// A comment of a table whose bearings were told by their numbers alone.
const DIRECTION_COMMENT: &[u8] = b"direction: unknown";
/// Lines that the separators are told from.
const LOOKED_INTO: usize = 50;
/// Words of a scan's line that are no numbers, at most: names of frames, dates.
const MAX_OTHER_WORDS: usize = 8;

/// A line of numbers.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// Number of its line, from 1.
    pub line: usize,
    /// NaN where a cell is empty or holds a word; seconds where that is a clock's.
    pub values: Vec<f64>,
    /// Columns that hold a word, which is not a number.
    pub words: Vec<usize>,
    /// Whether the line ends with a separator: an empty cell may follow.
    pub is_open: bool,
}

/// The rows of a table, and what stands above them.
#[derive(Debug, Default)]
pub(super) struct Table {
    pub rows: Vec<Row>,
    /// The words of the line above the first row, one a column; empty where there is none.
    pub names: Vec<String>,
    /// What a comment says the columns are.
    pub format: Option<String>,
    /// Metres of the unit that a comment names.
    pub unit: Option<f64>,
    /// Whether a comment says that it is not known which way the laser turns.
    pub has_unknown_direction: bool,
    /// The first name of columns between those of the ranges, which are left out of the rows and not counted.
    pub between: Option<String>,
    /// Lines below the first row that are none.
    pub strays: Vec<usize>,
}

impl Table {
    /// The first rows of a text, at most so many.
    pub fn read(text: &[u8], most: usize) -> Self {
        let quoted = QuotedCommas::of(lines(text).map(|(_, line)| line).take(LOOKED_INTO));
        let text = &quoted.rewritten(text);
        let separators = Separators::of(text);
        let mut table = Self::default();
        let (mut first_words, mut commented) = (Vec::new(), Vec::new());
        for (line, text) in lines(text) {
            if is_comment(text) || text.starts_with(b"%") || text.starts_with(b"//") {
                if let Some(words) = table.comment(text) {
                    commented = separators.names(words);
                }
                continue;
            }
            match separators.row(text, line) {
                Some(row) => {
                    if table.rows.is_empty() {
                        first_words = separators.names(text);
                        table.names = separators.names_of_lists(table.names, text);
                    }
                    table.push(row, separators.labels(text));
                }
                None if table.rows.is_empty() => table.names = separators.names(text),
                None => table.strays.push(line),
            }
            if table.rows.len() >= most {
                break;
            }
        }
        // As numpy.savetxt and the SDK of RPLIDARs write them.
        if table.names.is_empty() && commented.len() == table.width() {
            table.names = commented;
        }
        table.take_counted_names(first_words);
        table.close_rows();
        table.leave_out_between_ranges();
        if are_scans(&table.names) && table.rows.len() >= MIN_SCAN_NUMBERS {
            table.turn();
        }
        table
    }

    fn leave_out_between_ranges(&mut self) {
        let mut is_left_out = vec![false; self.names.len()];
        for column in between_ranges(&self.names) {
            is_left_out[column] = true;
        }
        let Some(first) = is_left_out.iter().position(|&out| out) else { return };
        self.between = Some(self.names[first].clone());
        let is_kept = |column: usize| !is_left_out.get(column).is_some_and(|&out| out);
        let place = |column: usize| (0..column).filter(|&before| is_kept(before)).count();
        for row in &mut self.rows {
            row.words = row.words.iter().filter(|&&column| is_kept(column)).map(|&column| place(column)).collect();
            let mut column = 0..;
            row.values.retain(|_| column.next().is_some_and(is_kept));
        }
        let mut column = 0..;
        self.names.retain(|_| column.next().is_some_and(is_kept));
    }

    /// Makes a row of each column behind the first one, whose numbers name the new columns: a scan a line, under its bearings.
    fn turn(&mut self) {
        let column = |column: usize| -> Vec<f64> {
            self.rows.iter().map(|row| row.values.get(column).copied().unwrap_or(f64::NAN)).collect()
        };
        let bearings = column(0);
        let unit = if bearings.iter().any(|angle| angle.abs() > MAX_RADIANS) { "deg" } else { "rad" };
        let line = self.rows[0].line;
        let row = |at| Row { line, values: column(at), words: Vec::new(), is_open: false };
        let rows = (1..self.names.len()).map(row).collect();
        self.names = bearings.iter().map(|angle| format!("{angle} {unit}")).collect();
        self.rows = rows;
    }

    /// Takes the empty cell at the end of a line for one, where other lines have a number there.
    fn close_rows(&mut self) {
        let width = self.rows.iter().map(|row| row.values.len()).max().unwrap_or(0);
        for row in self.rows.iter_mut().filter(|row| row.is_open && row.values.len() + 1 == width) {
            row.values.push(f64::NAN);
        }
    }

    /// Takes what a comment says of the table; the words of one above the rows that says nothing of that kind, which may be the
    /// names of the columns.
    fn comment<'a>(&mut self, text: &'a [u8]) -> Option<&'a [u8]> {
        let words = text.trim_ascii_start().strip_prefix(b"#").unwrap_or_default().trim_ascii();
        if let Some(format) = words.strip_prefix(FORMAT_COMMENT) {
            self.format = Some(String::from_utf8_lossy(format.trim_ascii()).into_owned());
        } else if let Some(unit) = unit_said(words) {
            self.unit = Some(unit);
        } else if words == DIRECTION_COMMENT {
            self.has_unknown_direction = true;
        } else if self.rows.is_empty() {
            return Some(words);
        }
        None
    }

    /// Adds a row, with the labels before its numbers, if there are any.
    fn push(&mut self, row: Row, labels: Vec<String>) {
        if !labels.is_empty() && (self.rows.is_empty() || self.names.is_empty()) {
            self.names = labels;
            self.rows.clear(); // rows above numbers with labels are not of this table
        }
        self.rows.push(row);
    }

    /// Numbers at equal steps above rows that have none are the names of the beams: their angles, or how they are counted.
    fn take_counted_names(&mut self, first_words: Vec<String>) {
        let [_, second, ..] = &self.rows[..] else { return };
        let values: Vec<String> = second.values.iter().map(ToString::to_string).collect();
        if self.names.is_empty() && series(&first_words).is_some() && series(&values).is_none() {
            // Above the columns before the ranges there may be nothing, not even a separator.
            let missing = second.values.len().saturating_sub(first_words.len());
            self.names = vec![String::new(); missing].into_iter().chain(first_words).collect();
            self.rows.remove(0);
        }
    }

    /// Columns of the first row.
    pub fn width(&self) -> usize {
        self.rows.first().map_or(0, |row| row.values.len())
    }
}

/// What stands between numbers, and within them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Separators {
    /// Beside spaces; two of them with nothing between leave a cell empty.
    gap: Option<u8>,
    /// Whether a comma is the decimal point.
    has_decimal_commas: bool,
}

impl Separators {
    fn of(text: &[u8]) -> Self {
        // Cut behind its decimal comma, the last number would be none.
        let text = text.strip_suffix(b",").unwrap_or(text);
        let mut head: Vec<&[u8]> =
            lines(text).map(|(_, line)| line).filter(|line| !is_comment(line)).take(LOOKED_INTO).collect();
        // A line that is cut off may end with a separator or within a number.
        if head.len() > 2 && !text.ends_with(b"\n") {
            head.pop();
        }
        let has = |byte: u8| head.iter().any(|line| line.contains(&byte));
        let outer = [b';', b'|', b'\t'].into_iter().find(|&byte| has(byte));
        // "1,25" between spaces, tabs, bars or semicolons, and no number with a point.
        let is_gap = |byte: &u8| byte.is_ascii_whitespace() || Some(*byte) == outer;
        let mut words = head
            .iter()
            .flat_map(|line| line.split(is_gap))
            .filter(|word| word.contains(&b',') && clock(word).is_none());
        let is_decimal = |word: &[u8]| {
            let word = word.trim_ascii();
            let word = word.strip_prefix(b"\"").and_then(|word| word.strip_suffix(b"\"")).unwrap_or(word);
            let mut parts = word.split(|&byte| byte == b',');
            let is_digits = |part: &[u8]| part.iter().all(|byte| byte.is_ascii_digit() || b"+-eE".contains(byte));
            let (Some(whole), Some(fraction), None) = (parts.next(), parts.next(), parts.next()) else { return false };
            !fraction.is_empty() && is_digits(whole) && is_digits(fraction)
        };
        let is_spaced = outer.is_some() || head.iter().any(|line| line.trim_ascii().contains(&b' '));
        let has_decimal_commas = has(b',') && is_spaced && words.all(is_decimal) && !head.iter().any(|l| has_point(l));
        let gap = outer.or_else(|| (has(b',') && !has_decimal_commas).then_some(b','));
        Self { gap, has_decimal_commas }
    }

    /// The numbers of a line; `None` where it is none.
    fn row(self, text: &[u8], line: usize) -> Option<Row> {
        let is_open = self.gap.is_some_and(|gap| text.trim_ascii().last() == Some(&gap));
        let mut row = Row { line, values: Vec::new(), words: Vec::new(), is_open };
        // "theta: 0.5 dist: 1200": beside labels, words stand for no column; many of them are no such line, but a program's text.
        let num_others = self.cells(text).filter(|word| !is_label(word) && number(word).is_none()).count();
        let has_labels = num_others <= MAX_OTHER_WORDS && self.cells(text).any(is_label);
        for word in self.cells(text).filter(|word| !has_labels || number(word).is_some()) {
            let value = number(&self.point(word));
            if value.is_none() && !word.is_empty() && !is_no_value(word) {
                row.words.push(row.values.len());
            }
            row.values.push(value.or_else(|| clock(word)).unwrap_or(f64::NAN));
        }
        let num_words = row.words.len();
        // Mostly zeros beside words are the covariances of a pose.
        let num_ranges = row.values.iter().filter(|&&value| value > 0.0).count();
        let is_row = num_words == 0 || (num_words <= MAX_OTHER_WORDS && 3 * num_ranges > row.values.len());
        (is_row && row.values.iter().any(|value| !value.is_nan())).then_some(row)
    }

    /// A word with a decimal point.
    fn point(self, word: &[u8]) -> Cow<'_, [u8]> {
        if self.has_decimal_commas { with_point(word) } else { Cow::Borrowed(word) }
    }

    /// The cells of a line; an empty one where nothing stands between two separators, but not behind the last one.
    fn cells(self, text: &[u8]) -> impl Iterator<Item = &[u8]> {
        let is_space = move |byte: &u8| byte.is_ascii_whitespace() || b"[](){}\"'".contains(byte);
        let text = text.trim_ascii();
        let text = self.gap.and_then(|gap| text.strip_suffix(&[gap])).unwrap_or(text);
        let is_other = move |word: &[u8]| !word.is_empty() && number(&self.point(word)).is_none() && !is_label(word);
        text.split(move |byte| Some(*byte) == self.gap).flat_map(move |cell| {
            // "2024-03-01 10:00:00" between two separators is one cell; "[1, 2.5" is not.
            let is_text =
                self.gap.is_some() && cell.split(is_space).any(is_other) && !cell.split(is_space).any(is_label);
            let whole = is_text.then(|| cell.trim_ascii());
            let mut words = cell.split(is_space).filter(move |word| !is_text && !word.is_empty()).peekable();
            let empty = (whole.is_none() && words.peek().is_none() && self.gap.is_some()).then_some(&b""[..]);
            words.chain(empty).chain(whole)
        })
    }

    /// The words of a line; those between two separators are one name.
    fn names(self, text: &[u8]) -> Vec<String> {
        match self.gap {
            None => self.cells(text).map(name_of).collect(),
            Some(gap) => text.trim_ascii().split(|&byte| byte == gap).map(name_of).collect(),
        }
    }

    /// Names of single numbers, where columns hold lists: `ranges` is `ranges[0]`, `ranges[1]`, ..., and three numbers of a
    /// pose are its x, y and heading.
    fn names_of_lists(self, names: Vec<String>, row: &[u8]) -> Vec<String> {
        let (mut depth, mut is_quoted) = (0, false);
        let fields = row.split(|&byte| {
            match byte {
                b'"' => is_quoted = !is_quoted,
                b'[' | b'(' | b'{' => depth += 1,
                b']' | b')' | b'}' => depth -= 1,
                _ => {}
            }
            Some(byte) == self.gap && depth == 0 && !is_quoted
        });
        let counts: Vec<usize> = fields.map(|field| self.cells(field).count()).collect();
        if counts.len() != names.len() || counts.iter().all(|&count| count < 2) {
            return names;
        }
        let named = |(name, count): (String, usize)| -> Vec<String> {
            match count {
                0 | 1 => vec![name],
                3 if is_pose(&name) => ["x", "y", "theta"].map(|part| format!("pose {part}")).to_vec(),
                _ => (0..count).map(|at| format!("{name}[{at}]")).collect(),
            }
        };
        names.into_iter().zip(counts).flat_map(named).collect()
    }

    /// The labels before the numbers of a line.
    fn labels(self, text: &[u8]) -> Vec<String> {
        self.cells(text).filter(|word| is_label(word)).map(name_of).collect()
    }
}

/// What else a comment that names the unit may say that it is of.
const OF_RANGES: [&str; 5] = ["range", "ranges", "distance", "distances", "length"];

/// Metres of the unit that a comment names, and nothing else: `units: mm`, `range unit = cm`, `units are in feet`.
fn unit_said(comment: &[u8]) -> Option<f64> {
    let text = String::from_utf8_lossy(comment).to_ascii_lowercase();
    let words = text.split(|c: char| !c.is_ascii_alphabetic()).filter(|word| !word.is_empty());
    let words: Vec<&str> = words.filter(|word| !OF_RANGES.contains(word) && !["is", "are"].contains(word)).collect();
    let (["unit" | "units", name] | ["unit" | "units", "in", name]) = words[..] else { return None };
    UNITS.iter().find(|unit| unit.0 == name).map(|unit| unit.1)
}

/// What programs write where there is no number.
fn is_no_value(word: &[u8]) -> bool {
    [&b"none"[..], b"null", b"na", b"n/a", b"-", b"--", b"---"].iter().any(|none| word.eq_ignore_ascii_case(none))
}

fn is_label(word: &[u8]) -> bool {
    word.len() > 1 && word.ends_with(b":")
}

fn name_of(word: &[u8]) -> String {
    let text = String::from_utf8_lossy(word).to_ascii_lowercase();
    text.trim_matches(|c: char| c.is_whitespace() || "\"'#%:".contains(c)).to_owned()
}

/// Whether a line has a number with a decimal point, which `03.05.2024` is not.
fn has_point(line: &[u8]) -> bool {
    let mut runs = line.split(|byte| !byte.is_ascii_digit() && *byte != b'.');
    runs.any(|run| run.split(|&byte| byte == b'.').count() == 2 && run.last() != Some(&b'.'))
}

fn with_point(word: &[u8]) -> Cow<'_, [u8]> {
    Cow::Owned(word.iter().map(|&byte| if byte == b',' { b'.' } else { byte }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(text: &str) -> Vec<Vec<f64>> {
        Table::read(text.as_bytes(), usize::MAX).rows.into_iter().map(|row| row.values).collect()
    }

    #[test]
    fn separators_are_told_from_the_lines() {
        let expected = vec![vec![1.0, 2.5, 3.0], vec![4.0, 5.5, 6.0]];
        for text in [
            "1 2.5 3\n4 5.5 6\n",
            "1,2.5,3\r\n4,5.5,6\r\n",
            " 1 , 2.5 , 3,\n 4 , 5.5 , 6,\n",
            "1;2,5;3\n4;5,5;6",
            "1\t2,5\t3\n4\t5,5\t6",
            "1 2,5 3\n4 5,5 6",
            "a;b;c\n1;2.5;3;\n4;5.5;6;\n",
            "# 7, 8\n% 9\n\n[1, 2.5, 3],\n[4, 5.5, 6]\n",
            "\"(1.0, 2.5, 3.0)\"\n\"(4.0, 5.5, 6.0)\"\n",
            "      1    2.5      3\n      4    5.5      6\n",
        ] {
            assert_eq!(values(text), expected, "{text:?}");
        }
    }

    #[test]
    fn empty_cells_and_words_keep_their_columns() {
        let table = Table::read(b"stamp,frame,a,b\n1.5,laser,,2\n2.5,laser,1,nan\n", usize::MAX);
        assert_eq!(table.names, ["stamp", "frame", "a", "b"]);
        let [first, second] = &table.rows[..] else { panic!("{table:?}") };
        assert!(first.values[2].is_nan() && first.values[3] == 2.0 && first.words == [1]);
        assert!(second.values[2] == 1.0 && second.values[3].is_nan() && second.words == [1]);
    }

    #[test]
    fn labels_before_numbers_are_their_names() {
        let text = b"scan 1\n   theta: 03.36 Dist: 00234.00 Q: 47 \nS  theta: 04.10 Dist: 00235.00 Q: 46\n";
        let table = Table::read(text, usize::MAX);
        assert_eq!(table.names, ["theta", "dist", "q"]);
        assert_eq!(table.rows[1].values, [4.1, 235.0, 46.0]);
        let code = b"case 0: a = [1, 2, 3]; if (b) return [4, 5]; else c(d, e, 6); break; case 1: f(7, 8);\n";
        assert!(Table::read(code, usize::MAX).rows.is_empty());
        let table = Table::read(b"Angle (deg), Distance (mm)\n0.5, 1200\n", usize::MAX);
        assert_eq!(table.names, ["angle (deg)", "distance (mm)"]);
    }

    #[test]
    fn columns_that_are_scans_become_rows() {
        let row = |at: i32| format!("{},{}.5,{}\n", at - 15, at, 2 * at);
        let text = (0..30).fold("angle,scan 1,scan 2\n".to_owned(), |text, at| text + &row(at));
        let table = Table::read(text.as_bytes(), usize::MAX);
        assert_eq!((table.rows.len(), table.width(), table.names[0].as_str()), (2, 30, "-15 deg"));
        assert_eq!((table.rows[0].values[3], table.rows[1].values[29]), (3.5, 58.0));
    }

    #[test]
    fn a_comment_may_say_what_the_columns_are() {
        let table = Table::read(b"# table: ranges=1:2,start=0,step=1\n1 2\n", usize::MAX);
        assert_eq!(table.format.as_deref(), Some("ranges=1:2,start=0,step=1"));
    }

    #[test]
    fn comments_name_a_unit_where_they_name_nothing_else() {
        for (comment, unit) in [
            ("units: mm", Some(1e-3)),
            ("Range unit = cm", Some(0.01)),
            ("unit=in", Some(0.0254)),
            ("units are in feet", Some(0.3048)),
            ("IMU unit in use", None),
            ("speed unit m/s", None),
            ("units: mm, deg", None),
        ] {
            assert_eq!(unit_said(comment.as_bytes()), unit, "{comment}");
        }
    }
}
