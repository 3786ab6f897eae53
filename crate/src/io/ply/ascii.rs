//! Vertices as text: one to a line, values separated by blanks.

use super::header::{Element, Kind, Scalar};
use super::layout::{Layout, Row, Rows, collect};
use crate::geometry::PointCloud;
use crate::io::text::{leading_number, leading_single, line_number, number, quote, shorten};
use crate::{Error, Result};

/// Reads the vertices of a text file whose header ends at `start`.
pub(super) fn read(
    bytes: &[u8],
    start: usize,
    before: &[Element],
    vertex: &Element,
    layout: &Layout,
) -> Result<PointCloud> {
    let mut position = start;
    for element in before {
        position = skip_element(bytes, position, element)?;
    }
    // A value takes a character and a blank at the least.
    let most = (bytes.len() - position) / (2 * vertex.properties.len()) + 1;
    let slots = layout.slots(vertex.properties.len());
    let rows = TextRows { bytes, position, vertex, slots: &slots, index: 0 };
    collect(rows, vertex.count, most, layout)
}

/// The position after the lines of `element`.
fn skip_element(bytes: &[u8], mut position: usize, element: &Element) -> Result<usize> {
    if element.properties.is_empty() {
        return Ok(position);
    }
    for index in 0..element.count {
        position = line_start(bytes, position);
        if position == bytes.len() {
            return Err(cut_off(bytes, element, index));
        }
        position += bytes[position..].iter().position(|&byte| is_line_end(byte)).unwrap_or(bytes.len() - position);
    }
    Ok(position)
}

fn is_line_end(byte: u8) -> bool {
    byte == b'\n' || byte == b'\r'
}

fn is_blank(byte: u8) -> bool {
    byte == b' ' || byte == b'\t'
}

/// Whether a value is one of its type: whole and in range where the type is an integer.
fn fits(value: f64, scalar: Scalar) -> bool {
    scalar
        .integer_range()
        .is_none_or(|(smallest, largest)| value >= smallest && value <= largest && value.fract() == 0.0)
}

/// The position of the next character that is neither blank nor line end.
fn line_start(bytes: &[u8], mut position: usize) -> usize {
    while bytes.get(position).is_some_and(|&byte| is_blank(byte) || is_line_end(byte)) {
        position += 1;
    }
    position
}

fn cut_off(bytes: &[u8], element: &Element, index: u64) -> Error {
    let (name, count) = (element.shown_name(), element.count);
    let problem = format!("The file is cut off: it ends before {name} {} of the {count} announced", index + 1);
    Error::line(line_number(bytes, bytes.len()), problem, "Copy or export it again")
}

/// The lines of the vertices.
#[derive(Clone)]
struct TextRows<'a> {
    bytes: &'a [u8],
    position: usize,
    vertex: &'a Element<'a>,
    /// For each property its place in a row.
    slots: &'a [Option<usize>],
    /// How many vertices came before.
    index: u64,
}

impl Rows for TextRows<'_> {
    fn next_row(&mut self) -> Result<Row> {
        self.position = line_start(self.bytes, self.position);
        if self.position == self.bytes.len() {
            return Err(cut_off(self.bytes, self.vertex, self.index));
        }
        let mut row = [0.0; 9];
        for (property, slot) in self.slots.iter().enumerate() {
            match (self.vertex.properties[property].kind, *slot) {
                (Kind::Scalar(scalar), Some(slot)) => row[slot] = self.value(property, scalar)?,
                (Kind::Scalar(_), None) => {
                    self.token(property)?;
                }
                (Kind::List { count, .. }, _) => {
                    let length = self.value(property, count)?;
                    if length < 0.0 {
                        let problem = format!("the list {} has a length of {length}", self.name(property));
                        return Err(self.fault(&problem, "Lengths are whole numbers from 0 on"));
                    }
                    for _ in 0..length as u64 {
                        self.token(property)?;
                    }
                }
            }
        }
        self.skip_blanks();
        if self.bytes.get(self.position).is_some_and(|&byte| !is_line_end(byte)) {
            let problem = format!("the line has more values than announced: {}", self.vertex.property_names());
            return Err(self.fault(&problem, "Write one vertex a line"));
        }
        self.index += 1;
        Ok(row)
    }
}

impl<'a> TextRows<'a> {
    fn skip_blanks(&mut self) {
        while self.bytes.get(self.position).is_some_and(|&byte| is_blank(byte)) {
            self.position += 1;
        }
    }

    /// The next value of the line as it is written. There is one, or it is an error.
    fn token(&mut self, property: usize) -> Result<&'a [u8]> {
        self.skip_blanks();
        let start = self.position;
        while self.bytes.get(self.position).is_some_and(|&byte| !is_blank(byte) && !is_line_end(byte)) {
            self.position += 1;
        }
        if self.position == start {
            return Err(self.missing_value(property));
        }
        Ok(&self.bytes[start..self.position])
    }

    /// The next value of the line as a number of its type.
    #[inline]
    fn value(&mut self, property: usize, scalar: Scalar) -> Result<f64> {
        self.skip_blanks();
        let rest = &self.bytes[self.position..];
        // Straight to single precision where that is the type: by way of double it would be rounded twice.
        let leading = if scalar == Scalar::Float32 { leading_single(rest) } else { leading_number(rest) };
        if let Some((value, length)) = leading
            && rest.get(length).is_none_or(|&byte| is_blank(byte) || is_line_end(byte))
            && fits(value, scalar)
        {
            self.position += length;
            return Ok(value);
        }
        self.odd_value(property, scalar)
    }

    /// The same for what is not written as a plain number that fits its type.
    #[cold]
    fn odd_value(&mut self, property: usize, scalar: Scalar) -> Result<f64> {
        let token = self.token(property)?;
        let value = number(token).ok_or_else(|| {
            let has_comma = token.contains(&b',');
            let remedy =
                if has_comma { "Write decimal points, and blanks between values" } else { "Write decimal numbers" };
            self.fault(&format!("{} is {}, not a number", self.name(property), quote(token)), remedy)
        })?;
        if fits(value, scalar) {
            return Ok(value);
        }
        let problem = format!("{} is {}, which is no {}", self.name(property), quote(token), scalar.name());
        Err(self.fault(&problem, "Announce the property as double, or write whole numbers that fit"))
    }

    /// The error of a line that ends before this property: it lacks a value, or the file is cut off.
    #[cold]
    fn missing_value(&self, property: usize) -> Error {
        let name = self.name(property);
        if self.position == self.bytes.len() {
            self.fault(&format!("the file is cut off before {name}"), "Copy or export it again")
        } else {
            self.fault(&format!("the line ends before {name}"), "Write one vertex a line")
        }
    }

    fn name(&self, property: usize) -> String {
        shorten(self.vertex.properties[property].name.as_bytes())
    }

    /// An error in the line that is being read.
    fn fault(&self, problem: &str, remedy: &str) -> Error {
        let problem = format!("In vertex {} of {} {problem}", self.index + 1, self.vertex.count);
        Error::line(line_number(self.bytes, self.position), problem, remedy)
    }
}
