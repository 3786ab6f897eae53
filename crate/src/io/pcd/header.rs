//! The header: a keyword and its values a line, up to `DATA`.

use crate::io::text::{quote, shorten};
use crate::{Error, Result};

/// How the points are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Binary,
    BinaryCompressed,
}

/// What the bytes of a number mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Signed,
    Unsigned,
    Float,
}

/// One or more numbers of every point.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Field {
    /// In small letters.
    pub(super) name: String,
    /// Bytes of a number.
    pub(super) size: usize,
    pub(super) kind: Kind,
    /// Numbers a point.
    pub(super) count: usize,
    /// Bytes before it in a binary point.
    pub(super) offset: usize,
}

impl Field {
    /// The number at the start of `bytes`.
    pub(super) fn value(&self, bytes: &[u8]) -> f64 {
        macro_rules! number {
            ($type:ty) => {
                bytes.first_chunk().map_or(f64::NAN, |&bytes| <$type>::from_le_bytes(bytes) as f64)
            };
        }
        match (self.kind, self.size) {
            (Kind::Signed, 1) => number!(i8),
            (Kind::Signed, 2) => number!(i16),
            (Kind::Signed, 4) => number!(i32),
            (Kind::Signed, _) => number!(i64),
            (Kind::Unsigned, 1) => number!(u8),
            (Kind::Unsigned, 2) => number!(u16),
            (Kind::Unsigned, 4) => number!(u32),
            (Kind::Unsigned, _) => number!(u64),
            (Kind::Float, 4) => number!(f32),
            (Kind::Float, _) => number!(f64),
        }
    }
}

#[derive(Debug)]
pub(super) struct Header {
    pub(super) fields: Vec<Field>,
    /// The line with their names.
    pub(super) fields_line: usize,
    pub(super) num_points: usize,
    pub(super) encoding: Encoding,
    /// Bytes of a binary point.
    pub(super) stride: usize,
    /// Where the points begin.
    pub(super) end: usize,
}

/// A line of the header: its number, and its values.
type Entry<'a> = (usize, Vec<&'a [u8]>);

#[derive(Default)]
struct Entries<'a> {
    fields: Option<Entry<'a>>,
    sizes: Option<Entry<'a>>,
    types: Option<Entry<'a>>,
    counts: Option<Entry<'a>>,
    width: Option<Entry<'a>>,
    height: Option<Entry<'a>>,
    points: Option<Entry<'a>>,
}

pub(super) fn parse(bytes: &[u8]) -> Result<Header> {
    let mut entries = Entries::default();
    let (mut position, mut line) = (0, 0);
    while position < bytes.len() {
        let rest = &bytes[position..];
        let length = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
        position += (length + 1).min(rest.len());
        line += 1;
        let text = rest[..length].split(|&byte| byte == b'#').next().unwrap_or_default();
        let mut words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let Some(keyword) = words.next() else { continue };
        let entry = (line, words.collect::<Vec<_>>());
        match keyword.to_ascii_uppercase().as_slice() {
            b"VERSION" | b"VIEWPOINT" => {}
            b"FIELDS" | b"COLUMNS" => entries.fields = Some(entry),
            b"SIZE" => entries.sizes = Some(entry),
            b"TYPE" => entries.types = Some(entry),
            b"COUNT" => entries.counts = Some(entry),
            b"WIDTH" => entries.width = Some(entry),
            b"HEIGHT" => entries.height = Some(entry),
            b"POINTS" => entries.points = Some(entry),
            b"DATA" => return entries.header(&entry, position),
            _ if line == 1 || entries.fields.is_none() => {
                let problem = format!("This is not a PCD file: line {line} begins with {}", quote(keyword));
                return Err(Error::line(line, problem, "A PCD file begins with VERSION and FIELDS"));
            }
            _ => {
                let problem = format!("The header has an unknown entry {}", quote(keyword));
                return Err(Error::line(line, problem, "Remove the line, or export the file again"));
            }
        }
    }
    Err(Error::line(line, "The file ends before the header does: there is no line DATA", "Export the file again"))
}

impl Entries<'_> {
    /// The header whose last line is `data` and ends before byte `end`.
    fn header(&self, data: &Entry, end: usize) -> Result<Header> {
        let encoding = encoding_of(data)?;
        let (fields_line, names) = needed(self.fields.as_ref(), "FIELDS", data.0)?;
        let mut stride = 0usize;
        let mut fields = Vec::with_capacity(names.len());
        for (index, name) in names.iter().enumerate() {
            let field = self.field(index, name, stride, data.0)?;
            let next = field.size.checked_mul(field.count).and_then(|bytes| stride.checked_add(bytes));
            stride = next.ok_or_else(|| Error::line(data.0, "A point is larger than any memory", "Export it again"))?;
            fields.push(field);
        }
        Ok(Header { fields, fields_line, num_points: self.num_points(data.0)?, encoding, stride, end })
    }

    /// The field with this index; `line` is told where the header lacks one.
    fn field(&self, index: usize, name: &[u8], offset: usize, line: usize) -> Result<Field> {
        let size = whole(self.sizes.as_ref(), "SIZE", index, line)?;
        let count = if self.counts.is_some() { whole(self.counts.as_ref(), "COUNT", index, line)? } else { 1 };
        let (line, types) = needed(self.types.as_ref(), "TYPE", line)?;
        let kind = match (types.get(index).copied().unwrap_or_default(), size) {
            (b"I" | b"i", 1 | 2 | 4 | 8) => Kind::Signed,
            (b"U" | b"u", 1 | 2 | 4 | 8) => Kind::Unsigned,
            (b"F" | b"f", 4 | 8) => Kind::Float,
            (other, size) => {
                let name = shorten(name);
                let problem = format!("Field {name} is of type {} with {size} bytes", quote(other));
                return Err(Error::line(line, problem, "Types are I or U of 1, 2, 4 or 8 bytes and F of 4 or 8"));
            }
        };
        Ok(Field { name: String::from_utf8_lossy(name).to_ascii_lowercase(), size, kind, count, offset })
    }

    fn num_points(&self, line: usize) -> Result<usize> {
        if self.points.is_some() {
            return whole(self.points.as_ref(), "POINTS", 0, line);
        }
        let (width, height) =
            (whole(self.width.as_ref(), "WIDTH", 0, line)?, whole(self.height.as_ref(), "HEIGHT", 0, line)?);
        Ok(width.saturating_mul(height))
    }
}

fn encoding_of(data: &Entry) -> Result<Encoding> {
    match data.1.first().map(|word| word.to_ascii_lowercase()).as_deref() {
        Some(b"ascii") => Ok(Encoding::Ascii),
        Some(b"binary") => Ok(Encoding::Binary),
        Some(b"binary_compressed") => Ok(Encoding::BinaryCompressed),
        other => {
            let problem = format!("DATA is {}", quote(other.unwrap_or_default()));
            Err(Error::line(data.0, problem, "It must be ascii, binary or binary_compressed"))
        }
    }
}

fn needed<'a, 'b>(entry: Option<&'a Entry<'b>>, name: &str, line: usize) -> Result<(usize, &'a [&'b [u8]])> {
    let (line, words) =
        entry.ok_or_else(|| Error::line(line, format!("The header has no line {name}"), "Export the file again"))?;
    Ok((*line, words))
}

/// One of the whole numbers of a line.
fn whole(entry: Option<&Entry>, name: &str, index: usize, line: usize) -> Result<usize> {
    let (line, words) = needed(entry, name, line)?;
    let word = words.get(index).copied().unwrap_or_default();
    let digits = std::str::from_utf8(word).ok().filter(|word| word.bytes().all(|byte| byte.is_ascii_digit()));
    digits.and_then(|digits| digits.parse().ok()).ok_or_else(|| {
        let is_per_field = matches!(name, "SIZE" | "COUNT");
        let remedy = if is_per_field { "Give a whole number for each field" } else { "Give one whole number" };
        let problem = format!("Value {} of {name} is {}, not a whole number", index + 1, quote(word));
        Error::line(line, problem, remedy)
    })
}
