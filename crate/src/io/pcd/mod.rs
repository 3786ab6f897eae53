//! Point clouds in PCD files, the format of the Point Cloud Library.
//!
//! The format: the library's documentation, "The PCD (Point Cloud Data) file format", versions 0.5 to 0.7.
//! Read are ascii, binary and binary_compressed: positions, and normals, colours and times where present; other fields are
//! stepped over, and names may be in capitals.
//!
//! - `x y` without `z` is a scan in the plane, z = 0.
//! - Normals are `normal_x normal_y normal_z`. They are made unit length, as those of PLY files are.
//! - Colours are `rgb` or `rgba`: 0xAARRGGBB in 32 bits, which a file may announce as a float.
//! - Times are `t`, `time`, `timestamp` or `offset_time`, as drivers of lidars call them, in whichever unit.
//! - Points that are not finite are kept, as in organised clouds they hold a place.
//! - `VIEWPOINT` is not applied: the points are as the file has them.
//! - Numbers of ascii files are separated by blanks, commas or semicolons.
//! - Map coordinates (over 10 km from zero) are kept relative to an origin, as those of PLY files are.

mod header;
mod lzf;
mod write;

use glam::DVec3;

use self::header::{Encoding, Field, Header, Kind};
use super::cloud_parts::{origin_of, rounding_of, unit_normals, unless_zero};
use super::limits::most_unpacked;
use super::text::{line_number, number, quote, refuse_pointer_and_utf16};
use crate::geometry::{PointCloud, PointTimes};
use crate::{Error, Result};

pub use write::{Format, write};

/// Reads a PCD file, given as its bytes.
///
/// # Errors
/// No PCD file; a header that breaks the format's rules; points without x or y; a value that is not a number; a file that
/// ends early or whose compressed data are broken. The error names the line or the byte.
pub fn read(bytes: &[u8]) -> Result<PointCloud> {
    refuse_pointer_and_utf16(bytes)?;
    let header = header::parse(bytes)?;
    let columns = Columns::of(&header)?;
    match header.encoding {
        Encoding::Ascii => read_ascii(bytes, &header, &columns),
        Encoding::Binary => {
            let data = &bytes[header.end..];
            let fits = data.len().checked_div(header.stride).unwrap_or(0);
            if fits < header.num_points {
                return Err(cut_off(bytes, fits, &header));
            }
            Ok(columns.cloud(header.num_points, |column, point| {
                column.value(&data[point * header.stride + column.field.offset..])
            }))
        }
        Encoding::BinaryCompressed => {
            let data = decompressed(bytes, &header)?;
            // Field after field, each for all points.
            Ok(columns.cloud(header.num_points, |column, point| {
                let size = column.field.size * column.field.count;
                column.value(&data[column.field.offset * header.num_points + point * size..])
            }))
        }
    }
}

fn cut_off(bytes: &[u8], fits: usize, header: &Header) -> Error {
    let problem = format!(
        "The file is cut off: it ends in point {} of the {} announced, each of {} bytes",
        fits + 1,
        header.num_points,
        header.stride
    );
    Error::byte(bytes.len(), problem, "Copy or export it again")
}

/// Two sizes of 32 bits, compressed and not, then the data.
fn decompressed(bytes: &[u8], header: &Header) -> Result<Vec<u8>> {
    let data = &bytes[header.end..];
    let size = |at: usize| {
        let size =
            data.get(at..at + 4).and_then(|size| size.first_chunk()).map(|&size| u32::from_le_bytes(size) as usize);
        size.ok_or_else(|| {
            let problem = "The file is cut off: it ends before the sizes of its compressed data";
            Error::byte(bytes.len(), problem, "Copy or export it again")
        })
    };
    let (compressed, expected) = (size(0)?, size(4)?);
    let announced = header.num_points.checked_mul(header.stride);
    if announced != Some(expected) {
        let problem = format!(
            "The compressed data are {expected} bytes, but {} points of {} bytes are announced",
            header.num_points, header.stride
        );
        return Err(Error::byte(header.end + 4, problem, "Export the file again"));
    }
    let Some(packed) = data[8..].get(..compressed) else {
        let problem =
            format!("The file is cut off: {compressed} compressed bytes are announced, {} are there", data.len() - 8);
        return Err(Error::byte(bytes.len(), problem, "Copy or export it again"));
    };
    let most = most_unpacked(compressed);
    if expected as u64 > most {
        let problem = format!(
            "{compressed} compressed bytes claim to unpack to {expected}, and at most {most} are accepted of so few"
        );
        return Err(Error::byte(header.end + 4, problem, "Export the file as plain binary"));
    }
    lzf::decompress(packed, expected).map_err(|offset| {
        Error::byte(header.end + 8 + offset, "The compressed data are broken", "Copy or export the file again")
    })
}

fn read_ascii(bytes: &[u8], header: &Header, columns: &Columns) -> Result<PointCloud> {
    let num_values: usize = header.fields.iter().map(|field| field.count).sum();
    let text = &bytes[header.end..];
    let mut rows: Vec<Values> = Vec::new();
    let mut start = 0;
    while rows.len() < header.num_points {
        if start >= text.len() {
            let problem =
                format!("The file is cut off: it ends before point {} of {}", rows.len() + 1, header.num_points);
            return Err(Error::line(line_number(bytes, bytes.len()), problem, "Copy or export it again"));
        }
        let length =
            text[start..].iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(text.len() - start);
        let line = &text[start..start + length];
        let offset = header.end + start;
        start += length + 1;
        let is_separator = |byte: &u8| matches!(byte, b' ' | b'\t' | b',' | b';');
        let mut row = Values::default();
        let mut index = 0;
        for token in line.split(is_separator).filter(|token| !token.is_empty()) {
            if let Some(slot) = columns.slot_of_value(index) {
                row[slot] = number(token).ok_or_else(|| {
                    let problem =
                        format!("Value {} of point {} is {}, not a number", index + 1, rows.len() + 1, quote(token));
                    Error::line(line_number(bytes, offset), problem, "Write decimal numbers")
                })?;
            }
            index += 1;
        }
        if index == 0 {
            continue;
        }
        if index != num_values {
            let problem = format!("Point {} has {index} values in place of {num_values}", rows.len() + 1);
            return Err(Error::line(line_number(bytes, offset), problem, "Write all fields of one point on a line"));
        }
        rows.push(row);
    }
    Ok(columns.cloud(rows.len(), |column, point| column.text_value(rows[point][column.slot])))
}

/// Places of the fields of a point in a row of text; the positions are 0 to 2, the normals 3 to 5.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Slot {
    Position = 0,
    Normal = 3,
    Color = 6,
    Time = 7,
}

/// A row of text.
type Values = [f64; Slot::Time as usize + 1];

/// A field that means something to a point cloud.
#[derive(Clone, Copy)]
struct Column<'a> {
    field: &'a Field,
    /// Index of its value among the values of a point.
    value_index: usize,
    /// Its place in a row of text.
    slot: usize,
}

impl Column<'_> {
    /// The number at the start of `bytes`; a colour as its 32 bits.
    fn value(&self, bytes: &[u8]) -> f64 {
        if self.slot == Slot::Color as usize {
            return f64::from(bytes.first_chunk().map_or(0, |&bits| u32::from_le_bytes(bits)));
        }
        self.field.value(bytes)
    }

    /// A number from a text; a colour that is announced as a float has its bits in the float.
    fn text_value(&self, value: f64) -> f64 {
        if self.slot == Slot::Color as usize && self.field.kind == Kind::Float {
            f64::from((value as f32).to_bits())
        } else {
            value
        }
    }
}

/// What drivers call the time of a point: Ouster, Velodyne, Hesai and RoboSense, Livox.
const TIME_NAMES: [&str; 6] = ["t", "time", "timestamp", "offset_time", "timeoffset", "time_offset"];

struct Columns<'a> {
    position: [Option<Column<'a>>; 3],
    normal: Option<[Column<'a>; 3]>,
    color: Option<Column<'a>>,
    time: Option<Column<'a>>,
}

impl<'a> Columns<'a> {
    fn of(header: &'a Header) -> Result<Self> {
        let find_at = |slot: usize, names: &[&str]| {
            let index =
                header.fields.iter().position(|field| field.count > 0 && names.contains(&field.name.as_str()))?;
            let value_index = header.fields[..index].iter().map(|field| field.count).sum();
            Some(Column { field: &header.fields[index], value_index, slot })
        };
        let find = |slot: Slot, names: &[&str]| find_at(slot as usize, names);
        let coordinate = |axis: usize, name| {
            find_at(Slot::Position as usize + axis, &[name]).ok_or_else(|| {
                let names: Vec<&str> = header.fields.iter().map(|field| field.name.as_str()).take(20).collect();
                let problem = format!("The points have no field called {name}, only {}", names.join(", "));
                Error::line(header.fields_line, problem, "Points need x, y and z, or x and y for a scan in the plane")
            })
        };
        let position =
            [Some(coordinate(0, "x")?), Some(coordinate(1, "y")?), find_at(Slot::Position as usize + 2, &["z"])];
        let normals = [["normal_x", "nx"], ["normal_y", "ny"], ["normal_z", "nz"]];
        let normal = [0, 1, 2].map(|axis| find_at(Slot::Normal as usize + axis, &normals[axis]));
        let normal = if let [Some(x), Some(y), Some(z)] = normal { Some([x, y, z]) } else { None };
        let color = find(Slot::Color, &["rgb", "rgba"]).filter(|column| column.field.size == 4);
        let time = find(Slot::Time, &TIME_NAMES).filter(|column| column.field.count == 1);
        Ok(Self { position, normal, color, time })
    }

    fn all(&self) -> impl Iterator<Item = &Column<'a>> {
        self.position.iter().flatten().chain(self.normal.iter().flatten()).chain(&self.color).chain(&self.time)
    }

    /// Where the value with this index goes in a row, if anywhere.
    fn slot_of_value(&self, index: usize) -> Option<usize> {
        self.all().find(|column| column.value_index == index).map(|column| column.slot)
    }

    /// Whether a coordinate has more digits than single precision holds.
    fn holds_doubles(&self) -> bool {
        self.position.iter().flatten().any(|column| matches!(column.field.kind, Kind::Float) && column.field.size == 8)
    }

    /// The cloud of `num_points` points, from the value of each column of each point.
    fn cloud(&self, num_points: usize, value: impl Fn(&Column<'a>, usize) -> f64) -> PointCloud {
        let coordinate = |axis: usize, point| self.position[axis].as_ref().map_or(0.0, |column| value(column, point));
        let position = |point| DVec3::new(coordinate(0, point), coordinate(1, point), coordinate(2, point));
        let origin = origin_of((0..num_points).map(position));
        let rest = || (0..num_points).map(|point| rounding_of(position(point) - origin)).collect();
        let normal = |columns: &[Column<'a>; 3], point| {
            let [x, y, z] = columns.each_ref().map(|column| value(column, point));
            DVec3::new(x, y, z).as_vec3()
        };
        let color = |column: &Column<'a>, point| {
            let [_, red, green, blue] = (value(column, point) as u32).to_be_bytes();
            [red, green, blue]
        };
        let times = |column: &Column<'a>| {
            PointTimes::new(&(0..num_points).map(|point| value(column, point)).collect::<Vec<f64>>())
        };
        PointCloud {
            positions: (0..num_points).map(|point| (position(point) - origin).as_vec3()).collect(),
            normals: self
                .normal
                .as_ref()
                .and_then(|columns| unit_normals((0..num_points).map(|point| normal(columns, point)).collect())),
            colors: self.color.as_ref().map(|column| (0..num_points).map(|point| color(column, point)).collect()),
            origin,
            rounded_off: self.holds_doubles().then(rest).and_then(unless_zero),
            times: self.time.as_ref().and_then(times),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_follows_the_bytes_that_are_there() {
        let num_points = 3_000_000_u32;
        let packed = lzf::compress(&vec![0; 12 * num_points as usize]);
        assert!(packed.len() < 600_000);
        let header = format!(
            "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {num_points}\nHEIGHT 1\n\
             POINTS {num_points}\nDATA binary_compressed\n"
        );
        let sizes = [packed.len() as u32, 12 * num_points].map(u32::to_le_bytes).concat();
        let Err(error) = read(&[header.as_bytes(), &sizes, &packed].concat()) else { panic!("it is read") };
        assert!(error.problem.contains("claim to unpack to 36000000, and at most"), "{}", error.problem);
    }
}
