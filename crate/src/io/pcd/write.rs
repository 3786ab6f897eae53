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

/// Writes a cloud as a PCD file, version 0.7: positions (m, single precision), then normals and colours where the cloud
/// has them. Coordinates include the origin.
pub fn write(cloud: &PointCloud, format: Format) -> Vec<u8> {
    let fields = fields_of(cloud);
    let words = |per_field: fn(usize) -> &'static str| -> String {
        (0..fields.len()).map(per_field).collect::<Vec<_>>().join(" ")
    };
    let names: Vec<&str> = fields.iter().map(|field| field.name).collect();
    let kinds: Vec<&str> = fields.iter().map(|field| if field.is_color { "U" } else { "F" }).collect();
    let data = match format {
        Format::Ascii => "ascii",
        Format::Binary => "binary",
        Format::BinaryCompressed => "binary_compressed",
    };
    let num_points = cloud.len();
    let mut bytes = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\nWIDTH {num_points}\n\
         HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {num_points}\nDATA {data}\n",
        names.join(" "),
        words(|_| "4"),
        kinds.join(" "),
        words(|_| "1")
    )
    .into_bytes();
    match format {
        Format::Ascii => {
            let mut text = String::new();
            for point in 0..num_points {
                for (index, field) in fields.iter().enumerate() {
                    let separator = if index == 0 { "" } else { " " };
                    let value = (field.value)(cloud, point);
                    let _ = if field.is_color {
                        write!(text, "{separator}{value}")
                    } else {
                        write!(text, "{separator}{:?}", f32::from_bits(value))
                    };
                }
                text.push('\n');
            }
            bytes.extend(text.into_bytes());
        }
        Format::Binary => {
            for point in 0..num_points {
                for field in &fields {
                    bytes.extend((field.value)(cloud, point).to_le_bytes());
                }
            }
        }
        Format::BinaryCompressed => {
            let values = fields.iter().flat_map(|field| (0..num_points).map(|point| (field.value)(cloud, point)));
            let raw: Vec<u8> = values.flat_map(u32::to_le_bytes).collect();
            let packed = lzf::compress(&raw);
            bytes.extend((packed.len() as u32).to_le_bytes());
            bytes.extend((raw.len() as u32).to_le_bytes());
            bytes.extend(packed);
        }
    }
    bytes
}

/// Four bytes of every point.
struct Field {
    name: &'static str,
    is_color: bool,
    value: fn(&PointCloud, usize) -> u32,
}

fn fields_of(cloud: &PointCloud) -> Vec<Field> {
    let number = |name, value| Field { name, is_color: false, value };
    let mut fields = vec![
        number("x", |cloud: &PointCloud, point: usize| coordinate(cloud, point, 0)),
        number("y", |cloud, point| coordinate(cloud, point, 1)),
        number("z", |cloud, point| coordinate(cloud, point, 2)),
    ];
    if cloud.normals.as_ref().is_some_and(|normals| normals.len() == cloud.len()) {
        fields.push(number("normal_x", |cloud, point| normal(cloud, point, 0)));
        fields.push(number("normal_y", |cloud, point| normal(cloud, point, 1)));
        fields.push(number("normal_z", |cloud, point| normal(cloud, point, 2)));
    }
    if cloud.colors.as_ref().is_some_and(|colors| colors.len() == cloud.len()) {
        let value = |cloud: &PointCloud, point: usize| {
            let [r, g, b] = cloud.colors.as_ref().map_or([0; 3], |colors| colors[point]);
            u32::from_be_bytes([0, r, g, b])
        };
        fields.push(Field { name: "rgb", is_color: true, value });
    }
    fields
}

fn coordinate(cloud: &PointCloud, point: usize, axis: usize) -> u32 {
    let value = f64::from(cloud.positions[point][axis]) + cloud.origin[axis];
    (value as f32).to_bits()
}

fn normal(cloud: &PointCloud, point: usize, axis: usize) -> u32 {
    cloud.normals.as_ref().map_or(0.0, |normals| normals[point][axis]).to_bits()
}
