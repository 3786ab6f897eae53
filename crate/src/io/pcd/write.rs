//! From a point cloud to the bytes of a PCD file.

use std::fmt::Write as _;

use crate::geometry::PointCloud;

use super::lzf;

/// How the values of a file are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Decimal numbers, one point a line, each in the fewest digits that read back as the same number.
    Ascii,
    /// Binary, least significant byte first, point by point.
    Binary,
    /// Binary, field by field, compressed with LZF.
    BinaryCompressed,
}

/// Writes a cloud as a PCD file, version 0.7: positions (m), then normals and colours where the cloud has them.
///
/// Positions are of four bytes; of eight where the cloud was read from doubles or has an origin, which they include.
pub fn write(cloud: &PointCloud, format: Format) -> Vec<u8> {
    let fields = fields_of(cloud);
    let mut bytes = header(&fields, cloud.len(), format).into_bytes();
    match format {
        Format::Ascii => bytes.extend(rows(&fields, cloud).into_bytes()),
        Format::Binary => {
            for point in 0..cloud.len() {
                for field in &fields {
                    (field.value)(cloud, point).push_bytes(&mut bytes);
                }
            }
        }
        Format::BinaryCompressed => {
            let mut raw = Vec::new();
            for field in &fields {
                for point in 0..cloud.len() {
                    (field.value)(cloud, point).push_bytes(&mut raw);
                }
            }
            let packed = lzf::compress(&raw);
            bytes.extend((packed.len() as u32).to_le_bytes());
            bytes.extend((raw.len() as u32).to_le_bytes());
            bytes.extend(packed);
        }
    }
    bytes
}

fn header(fields: &[Field], num_points: usize, format: Format) -> String {
    let words = |word: fn(&Field) -> &'static str| fields.iter().map(word).collect::<Vec<_>>().join(" ");
    let data = match format {
        Format::Ascii => "ascii",
        Format::Binary => "binary",
        Format::BinaryCompressed => "binary_compressed",
    };
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\nWIDTH {num_points}\n\
         HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {num_points}\nDATA {data}\n",
        words(|field| field.name),
        words(|field| field.size),
        words(|field| field.kind),
        words(|_| "1")
    )
}

/// The points as text, one a line.
fn rows(fields: &[Field], cloud: &PointCloud) -> String {
    let mut text = String::new();
    for point in 0..cloud.len() {
        for (index, field) in fields.iter().enumerate() {
            if index > 0 {
                text.push(' ');
            }
            (field.value)(cloud, point).push_text(&mut text);
        }
        text.push('\n');
    }
    text
}

/// A number of a point as the file holds it.
enum Value {
    Single(f32),
    Double(f64),
    Color(u32),
}

impl Value {
    fn push_bytes(self, bytes: &mut Vec<u8>) {
        match self {
            Self::Single(value) => bytes.extend(value.to_le_bytes()),
            Self::Double(value) => bytes.extend(value.to_le_bytes()),
            Self::Color(value) => bytes.extend(value.to_le_bytes()),
        }
    }

    fn push_text(self, text: &mut String) {
        // Writing to a string cannot fail.
        let _ = match self {
            Self::Single(value) => write!(text, "{value:?}"),
            Self::Double(value) => write!(text, "{value:?}"),
            Self::Color(value) => write!(text, "{value}"),
        };
    }
}

/// A number of every point.
struct Field {
    name: &'static str,
    /// Bytes of a value.
    size: &'static str,
    /// Type of a value, as the header names it.
    kind: &'static str,
    value: fn(&PointCloud, usize) -> Value,
}

fn single(name: &'static str, value: fn(&PointCloud, usize) -> Value) -> Field {
    Field { name, size: "4", kind: "F", value }
}

fn double(name: &'static str, value: fn(&PointCloud, usize) -> Value) -> Field {
    Field { name, size: "8", kind: "F", value }
}

fn fields_of(cloud: &PointCloud) -> Vec<Field> {
    let mut fields = if cloud.needs_doubles() {
        vec![
            double("x", |cloud, point| Value::Double(cloud.absolute_point(point).x)),
            double("y", |cloud, point| Value::Double(cloud.absolute_point(point).y)),
            double("z", |cloud, point| Value::Double(cloud.absolute_point(point).z)),
        ]
    } else {
        vec![
            single("x", |cloud, point| Value::Single(cloud.absolute_point(point).x as f32)),
            single("y", |cloud, point| Value::Single(cloud.absolute_point(point).y as f32)),
            single("z", |cloud, point| Value::Single(cloud.absolute_point(point).z as f32)),
        ]
    };
    if cloud.normals.as_ref().is_some_and(|normals| normals.len() == cloud.len()) {
        fields.push(single("normal_x", |cloud, point| normal(cloud, point, 0)));
        fields.push(single("normal_y", |cloud, point| normal(cloud, point, 1)));
        fields.push(single("normal_z", |cloud, point| normal(cloud, point, 2)));
    }
    if cloud.colors.as_ref().is_some_and(|colors| colors.len() == cloud.len()) {
        let value = |cloud: &PointCloud, point: usize| {
            let [r, g, b] = cloud.colors.as_ref().map_or([0; 3], |colors| colors[point]);
            Value::Color(u32::from_be_bytes([0, r, g, b]))
        };
        fields.push(Field { name: "rgb", size: "4", kind: "U", value });
    }
    fields
}

fn normal(cloud: &PointCloud, point: usize, axis: usize) -> Value {
    Value::Single(cloud.normals.as_ref().map_or(0.0, |normals| normals[point][axis]))
}
