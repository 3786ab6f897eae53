//! From a point cloud to the bytes of a file.

use std::fmt::Write as _;

use glam::Vec3;

use crate::geometry::PointCloud;

/// How the values of a file are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Decimal numbers, one point a line, each in the fewest digits that read back as the same number.
    Ascii,
    /// Binary, least significant byte first.
    BinaryLittleEndian,
}

/// Writes a cloud as a PLY file: positions (m), then normals and colours where the cloud has them (as many as points).
///
/// Positions are of type float; of type double where the cloud was read from doubles or has an origin, which they include.
/// Reading the file gives the same cloud, to the bit where positions are floats.
pub fn write(cloud: &PointCloud, format: Format) -> Vec<u8> {
    let points = Points {
        cloud,
        normals: cloud.normals.as_deref().filter(|normals| normals.len() == cloud.len()),
        colors: cloud.colors.as_deref().filter(|colors| colors.len() == cloud.len()),
    };
    let header = points.header(format);
    match format {
        Format::Ascii => points.ascii(header),
        Format::BinaryLittleEndian => points.binary(header),
    }
}

struct Points<'a> {
    cloud: &'a PointCloud,
    normals: Option<&'a [Vec3]>,
    colors: Option<&'a [[u8; 3]]>,
}

impl Points<'_> {
    fn header(&self, format: Format) -> String {
        let format = match format {
            Format::Ascii => "ascii",
            Format::BinaryLittleEndian => "binary_little_endian",
        };
        let position = if self.cloud.needs_doubles() { "double" } else { "float" };
        let mut properties = vec![(position, ["x", "y", "z"])];
        if self.normals.is_some() {
            properties.push(("float", ["nx", "ny", "nz"]));
        }
        if self.colors.is_some() {
            properties.push(("uchar", ["red", "green", "blue"]));
        }
        let count = self.cloud.len();
        let mut header = format!("ply\nformat {format} 1.0\ncomment scanstitch, metres\nelement vertex {count}\n");
        for (scalar, names) in properties {
            for name in names {
                let _ = writeln!(header, "property {scalar} {name}");
            }
        }
        header + "end_header\n"
    }

    fn ascii(&self, header: String) -> Vec<u8> {
        let mut text = header;
        for (index, &position) in self.cloud.positions.iter().enumerate() {
            if self.cloud.needs_doubles() {
                push_numbers(&mut text, self.cloud.absolute_point(index).to_array());
            } else {
                push_numbers(&mut text, position.to_array());
            }
            if let Some(normals) = self.normals {
                push_numbers(&mut text, normals[index].to_array());
            }
            if let Some(colors) = self.colors {
                push_numbers(&mut text, colors[index]);
            }
            // The blank after the last number.
            text.pop();
            text.push('\n');
        }
        text.into_bytes()
    }

    fn binary(&self, header: String) -> Vec<u8> {
        let position = if self.cloud.needs_doubles() { 24 } else { 12 };
        let size = position + self.normals.map_or(0, |_| 12) + self.colors.map_or(0, |_| 3);
        let mut bytes = header.into_bytes();
        bytes.reserve_exact(size * self.cloud.len());
        for (index, &position) in self.cloud.positions.iter().enumerate() {
            if self.cloud.needs_doubles() {
                bytes.extend_from_slice(
                    self.cloud.absolute_point(index).to_array().map(f64::to_le_bytes).as_flattened(),
                );
            } else {
                bytes.extend_from_slice(position.to_array().map(f32::to_le_bytes).as_flattened());
            }
            if let Some(normals) = self.normals {
                bytes.extend_from_slice(normals[index].to_array().map(f32::to_le_bytes).as_flattened());
            }
            if let Some(colors) = self.colors {
                bytes.extend_from_slice(&colors[index]);
            }
        }
        bytes
    }
}

/// Appends three numbers, each in the fewest digits that read back as the same, with a blank after each.
fn push_numbers<T: std::fmt::Debug>(text: &mut String, numbers: [T; 3]) {
    for number in numbers {
        // Writing to a string cannot fail. Debug, unlike Display, writes 1e-30 and not thirty zeros.
        let _ = write!(text, "{number:?} ");
    }
}
