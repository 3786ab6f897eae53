//! The header: what the file says it holds, and where that begins.

use crate::io::text::{line_number, quote, shorten, without_byte_order_mark};
use crate::{Error, Result};

/// How the values after the header are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The eight scalar types.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    Int8,
    Uint8,
    Int16,
    Uint16,
    Int32,
    Uint32,
    Float32,
    Float64,
}

impl Scalar {
    /// The type of this name, Turk's or the later one.
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::Int8,
            "uchar" | "uint8" => Self::Uint8,
            "short" | "int16" => Self::Int16,
            "ushort" | "uint16" => Self::Uint16,
            "int" | "int32" => Self::Int32,
            "uint" | "uint32" => Self::Uint32,
            "float" | "float32" => Self::Float32,
            "double" | "float64" => Self::Float64,
            _ => return None,
        })
    }

    /// Its name in error messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Int8 => "char",
            Self::Uint8 => "uchar",
            Self::Int16 => "short",
            Self::Uint16 => "ushort",
            Self::Int32 => "int",
            Self::Uint32 => "uint",
            Self::Float32 => "float",
            Self::Float64 => "double",
        }
    }

    /// Bytes of one value in a binary file.
    pub(super) fn size(self) -> usize {
        match self {
            Self::Int8 | Self::Uint8 => 1,
            Self::Int16 | Self::Uint16 => 2,
            Self::Int32 | Self::Uint32 | Self::Float32 => 4,
            Self::Float64 => 8,
        }
    }

    /// The smallest and the largest value of an integer type.
    pub(super) fn integer_range(self) -> Option<(f64, f64)> {
        Some(match self {
            Self::Int8 => (-128.0, 127.0),
            Self::Uint8 => (0.0, 255.0),
            Self::Int16 => (-32_768.0, 32_767.0),
            Self::Uint16 => (0.0, 65_535.0),
            Self::Int32 => (-2_147_483_648.0, 2_147_483_647.0),
            Self::Uint32 => (0.0, 4_294_967_295.0),
            Self::Float32 | Self::Float64 => return None,
        })
    }
}

/// What a property holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    /// As many items as the count before them says.
    List {
        count: Scalar,
        item: Scalar,
    },
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Property<'a> {
    pub(super) name: &'a str,
    pub(super) kind: Kind,
    /// The header's line that announces it, from 1.
    pub(super) line: usize,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Element<'a> {
    pub(super) name: &'a str,
    /// How many instances the file claims to hold: not to be trusted.
    pub(super) count: u64,
    pub(super) properties: Vec<Property<'a>>,
    /// The header's line that announces it, from 1.
    pub(super) line: usize,
}

impl Element<'_> {
    /// Bytes of one instance in a binary file, unless a list makes them differ.
    pub(super) fn stride(&self) -> Option<usize> {
        self.properties.iter().try_fold(0, |sum, property| match property.kind {
            Kind::Scalar(scalar) => Some(sum + scalar.size()),
            Kind::List { .. } => None,
        })
    }

    /// Its name, as a message gives it.
    pub(super) fn shown_name(&self) -> String {
        shorten(self.name.as_bytes())
    }

    /// The names of its properties, as a message lists them.
    pub(super) fn property_names(&self) -> String {
        /// Their first letters fill the message.
        const SHOWN: usize = 12;
        let names: Vec<&str> = self.properties.iter().take(SHOWN).map(|property| property.name).collect();
        shorten(names.join(", ").as_bytes())
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header<'a> {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element<'a>>,
    /// Offset of the first byte after the header.
    pub(super) end: usize,
}

const EXPORT_AGAIN: &str = "Export the file again as PLY";

/// Reads the header at the start of `bytes`.
///
/// # Errors
/// No PLY file, a header without end, a line that is none of the format's, two elements called `vertex`.
pub(super) fn parse(bytes: &[u8]) -> Result<Header<'_>> {
    let mut lines = Lines::new(bytes)?;
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        let (text, line) = lines.next_line()?;
        let mut rest = text;
        match next_word(&mut rest) {
            "" | "comment" | "obj_info" => {}
            "format" if encoding.is_some() => {
                return Err(Error::line(line, "This is a second format line", EXPORT_AGAIN));
            }
            "format" => encoding = Some(format(rest, line)?),
            "element" => {
                let element = element(rest, line)?;
                if element.name == "vertex" && elements.iter().any(|earlier| earlier.name == "vertex") {
                    return Err(Error::line(line, "This is a second element called vertex", "Merge the two"));
                }
                elements.push(element);
            }
            "property" => match elements.last_mut() {
                Some(element) => element.properties.push(property(rest, line)?),
                None => return Err(Error::line(line, "This property comes before any element", EXPORT_AGAIN)),
            },
            "end_header" => break,
            word => {
                let problem = format!("{} begins no line of a PLY header", quote(word.as_bytes()));
                return Err(Error::line(
                    line,
                    problem,
                    "A header has format, comment, element, property and end_header",
                ));
            }
        }
    }
    let encoding = encoding.ok_or_else(|| {
        Error::whole("The header has no format line", "Add one, like \"format ascii 1.0\", after the first line")
    })?;
    Ok(Header { encoding, elements, end: lines.position })
}

/// `ascii 1.0` of the line `format ascii 1.0`.
fn format(mut rest: &str, line: usize) -> Result<Encoding> {
    let encoding = match next_word(&mut rest) {
        "ascii" => Encoding::Ascii,
        "binary_little_endian" => Encoding::LittleEndian,
        "binary_big_endian" => Encoding::BigEndian,
        other => {
            let problem = format!("{} is not a PLY format", quote(other.as_bytes()));
            return Err(Error::line(line, problem, "Allowed are ascii, binary_little_endian and binary_big_endian"));
        }
    };
    if rest != "1.0" {
        let problem = format!("The version of the format is {}", quote(rest.as_bytes()));
        return Err(Error::line(line, problem, "Export the file as PLY 1.0, the only version there is"));
    }
    Ok(encoding)
}

/// `vertex 180` of the line `element vertex 180`.
fn element(mut rest: &str, line: usize) -> Result<Element<'_>> {
    let name = next_word(&mut rest);
    if name.is_empty() {
        return Err(Error::line(line, "An element without a name", "Write it like \"element vertex 180\""));
    }
    let count = rest.parse().map_err(|_| {
        let problem = format!("{} is not a count of {}", quote(rest.as_bytes()), shorten(name.as_bytes()));
        Error::line(line, problem, "Write a whole number from 0 on, like \"element vertex 180\"")
    })?;
    Ok(Element { name, count, properties: Vec::new(), line })
}

/// `float x` of the line `property float x`, or `list uchar int vertex_indices` of a list.
fn property(mut rest: &str, line: usize) -> Result<Property<'_>> {
    let kind = match next_word(&mut rest) {
        "list" => {
            let count = scalar(next_word(&mut rest), line)?;
            let item = scalar(next_word(&mut rest), line)?;
            if count.integer_range().is_none() {
                let problem = format!("The length of a list is of the type {}", count.name());
                return Err(Error::line(line, problem, "Give it an integer type, like uchar"));
            }
            Kind::List { count, item }
        }
        name => Kind::Scalar(scalar(name, line)?),
    };
    if rest.is_empty() {
        return Err(Error::line(line, "A property without a name", "Write it like \"property float x\""));
    }
    Ok(Property { name: rest, kind, line })
}

fn scalar(name: &str, line: usize) -> Result<Scalar> {
    Scalar::named(name).ok_or_else(|| {
        let problem = format!("{} is not a type of a PLY property", quote(name.as_bytes()));
        Error::line(
            line,
            problem,
            "Allowed are char, uchar, short, ushort, int, uint, float, double (int8 ... float64)",
        )
    })
}

/// Takes the first word off `rest`; empty when there is none.
fn next_word<'a>(rest: &mut &'a str) -> &'a str {
    let (word, after) = rest.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((rest, ""));
    *rest = after.trim_ascii_start();
    word
}

/// The lines of a header, without the blanks around them.
struct Lines<'a> {
    bytes: &'a [u8],
    position: usize,
    number: usize,
    /// The byte that ends a line: CR where the first line ends with one alone, otherwise LF. What follows the header
    /// may be binary and begin with either, so the two cannot be taken as equal.
    terminator: u8,
}

impl<'a> Lines<'a> {
    /// Checks the first line and stands before the second.
    fn new(bytes: &'a [u8]) -> Result<Self> {
        let start = bytes.len() - without_byte_order_mark(bytes).len();
        let text = &bytes[start..];
        if text.is_empty() {
            return Err(Error::whole("The file is empty", "Export it again, or drop another one"));
        }
        let length = text.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(text.len());
        let first = text[..length].trim_ascii();
        if first != b"ply" {
            let problem = format!("This is not a PLY file: it begins with {}", quote(first));
            return Err(Error::line(1, problem, "A PLY file begins with the line \"ply\""));
        }
        let lone_return = text.get(length) == Some(&b'\r') && text.get(length + 1) != Some(&b'\n');
        let terminator = if lone_return { b'\r' } else { b'\n' };
        let mut lines = Self { bytes, position: start, number: 0, terminator };
        lines.next_line()?;
        Ok(lines)
    }

    /// The next line and its number. Comments come without their text, which may be in any encoding.
    fn next_line(&mut self) -> Result<(&'a str, usize)> {
        let rest = &self.bytes[self.position..];
        let Some(length) = rest.iter().position(|&byte| byte == self.terminator) else {
            let problem = "The header is cut off: the file ends before the line \"end_header\"";
            return Err(Error::line(line_number(self.bytes, self.bytes.len()), problem, EXPORT_AGAIN));
        };
        self.position += length + 1;
        self.number += 1;
        let line = rest[..length].trim_ascii();
        if line.starts_with(b"comment") {
            return Ok(("comment", self.number));
        }
        if line.starts_with(b"obj_info") {
            return Ok(("obj_info", self.number));
        }
        let text = std::str::from_utf8(line).map_err(|_| {
            let problem = format!("{} is not a line of a PLY header", quote(line));
            Error::line(self.number, problem, EXPORT_AGAIN)
        })?;
        Ok((text, self.number))
    }
}
