//! NumPy's `.npy` files: format versions 1 to 3, floats and integers of 4 and 8 bytes in either byte order, C order.
//!
//! Rows are `x y z qw qx qy qz` (N, 7), TUM's columns (N, 8), positions (N, 2) and (N, 3), or matrices (N, 12), (N, 16),
//! (N, 3, 4), (N, 4, 4) and (4, 4).

use super::columns::{Builder, Layout, Table, pose_table};
use super::tum;
use crate::geometry::Pose3;
use crate::{Error, Result};

/// The first bytes of every file.
const MAGIC: &[u8] = b"\x93NUMPY";
const SAVE: &str = "Save the poses with numpy.save, as an array (N, 7) of x y z qw qx qy qz or (N, 4, 4) of matrices";

pub(super) fn is_npy(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

pub(super) fn read(bytes: &[u8]) -> Result<Builder> {
    let array = Array::read(bytes)?;
    let (layout, width) = match array.shape[..] {
        [_, columns @ (2 | 3)] => (Layout::Table(Table::positions(columns)), columns),
        [_, 7] => (Layout::Table(pose_table()), 7),
        [_, 8] => (Layout::Table(tum::table()), 8),
        [_, num_columns @ (12 | 13 | 16 | 17)] => (Layout::MatrixRow { num_columns }, num_columns),
        [_, 3, 4] => (Layout::MatrixRow { num_columns: 12 }, 12),
        [_, 4, 4] | [4, 4] => (Layout::MatrixRow { num_columns: 16 }, 16),
        _ => return Err(Error::whole(format!("The array has the shape {:?}", array.shape), SAVE)),
    };
    let mut builder = Builder::new();
    let mut numbers = Vec::with_capacity(width);
    for (index, row) in array.data.chunks_exact(width * array.item.size).enumerate() {
        let offset = array.start + index * width * array.item.size;
        let fault = |problem: String, remedy: &str| Error::byte(offset, format!("Row {index}: {problem}"), remedy);
        numbers.clear();
        numbers.extend(row.chunks_exact(array.item.size).map(|item| array.item.number(item)));
        match &layout {
            Layout::Table(table) => builder.push_table(table, &numbers, &fault)?,
            _ => builder.push_matrix_row(&numbers, &fault)?,
        }
    }
    if array.data.is_empty() {
        return Err(Error::whole("The array has no row", SAVE));
    }
    Ok(builder)
}

/// Poses as an array (N, 7) of `x y z qw qx qy qz` in double precision.
pub(super) fn write(poses: &[Pose3]) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, 7), }}", poses.len());
    // The data begins at a multiple of 64 bytes, and the header ends with a line feed.
    let length = (MAGIC.len() + 4 + header.len() + 1).next_multiple_of(64) - MAGIC.len() - 4;
    let mut bytes = [MAGIC, &[1, 0], &(length as u16).to_le_bytes()].concat();
    bytes.extend(format!("{header:<width$}\n", width = length - 1).bytes());
    for pose in poses {
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        for value in [t.x, t.y, t.z, q.w, q.x, q.y, q.z] {
            bytes.extend(value.to_le_bytes());
        }
    }
    bytes
}

/// The numbers of a file.
struct Array<'a> {
    shape: Vec<usize>,
    item: Item,
    data: &'a [u8],
    /// Where the data begins in the file.
    start: usize,
}

/// How one number is held.
struct Item {
    kind: u8,
    size: usize,
    big_endian: bool,
}

impl Item {
    fn parse(descr: &str) -> Option<Self> {
        let (&order, rest) = descr.as_bytes().split_first()?;
        let (&kind, size) = rest.split_first()?;
        let size = match size {
            b"4" => 4,
            b"8" => 8,
            _ => return None,
        };
        (matches!(order, b'<' | b'>' | b'=' | b'|') && matches!(kind, b'f' | b'i' | b'u')).then_some(Self {
            kind,
            size,
            big_endian: order == b'>',
        })
    }

    fn number(&self, item: &[u8]) -> f64 {
        let mut bytes = [0; 8];
        for (place, slot) in bytes[..self.size].iter_mut().enumerate() {
            let from = if self.big_endian { self.size - 1 - place } else { place };
            *slot = item.get(from).copied().unwrap_or_default();
        }
        let low = [bytes[0], bytes[1], bytes[2], bytes[3]];
        match (self.kind, self.size) {
            (b'f', 4) => f64::from(f32::from_le_bytes(low)),
            (b'f', _) => f64::from_le_bytes(bytes),
            (b'i', 4) => f64::from(i32::from_le_bytes(low)),
            (b'i', _) => i64::from_le_bytes(bytes) as f64,
            _ => u64::from_le_bytes(bytes) as f64,
        }
    }
}

impl<'a> Array<'a> {
    fn read(bytes: &'a [u8]) -> Result<Self> {
        let cut_off = || Error::whole("The file ends within its header", "Was it cut off? Save it again");
        let rest = bytes.strip_prefix(MAGIC).ok_or_else(|| Error::whole("The file is no NumPy array", SAVE))?;
        let (length, after) = match *rest {
            [1, _, low, high, ..] => (usize::from(u16::from_le_bytes([low, high])), 4),
            [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([a, b, c, d]) as usize, 6),
            [version, ..] if version > 3 => {
                return Err(Error::byte(6, format!("The file has version {version} of NumPy's format"), SAVE));
            }
            _ => return Err(cut_off()),
        };
        let header = rest.get(after..).and_then(|rest| rest.get(..length)).ok_or_else(cut_off)?;
        let start = MAGIC.len() + after + length;
        let header = String::from_utf8_lossy(header);
        let unknown = |what: &str| Error::byte(10, format!("The header describes {what}: {}", header.trim()), SAVE);

        let descr = value_of(&header, "descr").and_then(|value| value.split(['\'', '"']).nth(1));
        let item = descr.and_then(Item::parse).ok_or_else(|| unknown("no numbers of 4 or 8 bytes"))?;
        let order = value_of(&header, "fortran_order").ok_or_else(|| unknown("no order"))?;
        if order.trim_start().starts_with("True") {
            let problem = "The array is kept column by column (fortran_order)";
            return Err(Error::byte(10, problem, "Save numpy.ascontiguousarray(poses)"));
        }
        let shape = value_of(&header, "shape").and_then(|value| value.split(['(', ')']).nth(1));
        let shape: Option<Vec<usize>> = shape.and_then(|shape| {
            shape.split(',').map(str::trim).filter(|size| !size.is_empty()).map(|size| size.parse().ok()).collect()
        });
        let shape = shape.ok_or_else(|| unknown("no shape"))?;
        let expected = shape.iter().try_fold(item.size, |bytes, &size| bytes.checked_mul(size));
        let data = bytes.get(start..).unwrap_or_default();
        let Some(data) = expected.and_then(|expected| data.get(..expected)) else {
            let problem = format!("The array of shape {shape:?} ends after {} bytes", data.len());
            return Err(Error::byte(bytes.len(), problem, "Was the file cut off? Save it again"));
        };
        Ok(Self { shape, item, data, start })
    }
}

/// What follows a key of the header, which is a Python dictionary.
fn value_of<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let after = ["'", "\""].into_iter().find_map(|quote| header.split_once(&format!("{quote}{key}{quote}")))?.1;
    after.split_once(':').map(|(_, value)| value)
}
