//! Arrays in NumPy's format, and the trajectories stored in it.
//!
//! Source: the format's specification, NEP 1. Read are floats of 32 and 64 bits in little endian and C order.
//! Poses are (N, 7) or (N, 8) for a position and a quaternion, the latter after a time, or (N, 4, 4) and (N, 3, 4)
//! for matrices.

use nalgebra::{DMatrix, Matrix3};

use super::text::{leading_number, quote};
use crate::{Error, Result};

/// An array of numbers with its shape; the last axis changes fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// As many as the product of `shape`.
    pub values: Vec<f64>,
}

const MAGIC: &[u8] = b"\x93NUMPY";

/// Reads an array, given as the bytes of its file.
///
/// # Errors
/// No .npy file; another type of number than float32 or float64, in little endian; Fortran order; a file that ends early.
pub fn read(bytes: &[u8]) -> Result<Array> {
    if !bytes.starts_with(MAGIC) {
        return Err(Error::byte(0, "This is no .npy file: it does not begin with \\x93NUMPY", "Save it by numpy.save"));
    }
    let cut_off = || Error::byte(bytes.len(), "The file is cut off within its header", "Copy or save it again");
    let (start, length) = match bytes.get(6).ok_or_else(cut_off)? {
        1 => (10, bytes.get(8..10).map(|b| usize::from(u16::from_le_bytes([b[0], b[1]])))),
        2 | 3 => (12, bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)),
        version => {
            let problem = format!("Version {version} of the .npy format is not known");
            return Err(Error::byte(6, problem, "Save it again by numpy.save"));
        }
    };
    let length = length.ok_or_else(cut_off)?;
    let header = bytes.get(start..).and_then(|rest| rest.get(..length)).ok_or_else(cut_off)?;
    let data = &bytes[start + length..];

    let descr = field(header, b"'descr'").ok_or_else(|| no_entry("descr"))?;
    let size = if descr.starts_with(b"'<f8'") {
        8
    } else if descr.starts_with(b"'<f4'") {
        4
    } else {
        let problem = format!("The numbers are of type {}", quote(&descr[..descr.len().min(8)]));
        return Err(Error::whole(problem, "Save the array as float64: numpy.save(path, array.astype('<f8'))"));
    };
    let order = field(header, b"'fortran_order'").ok_or_else(|| no_entry("fortran_order"))?;
    let shape = shape(field(header, b"'shape'").ok_or_else(|| no_entry("shape"))?)?;
    if order.starts_with(b"True") && shape.len() > 1 {
        let remedy = "Save it by numpy.save(path, numpy.ascontiguousarray(array))";
        return Err(Error::whole("The array is stored column by column (Fortran order)", remedy));
    }
    let count = shape.iter().try_fold(1usize, |product, &length| product.checked_mul(length));
    let fits = data.len() / size;
    let Some(count) = count.filter(|&count| count <= fits) else {
        let problem =
            format!("The file is cut off: an array of shape {shape:?} is announced, {fits} numbers are there");
        return Err(Error::byte(bytes.len(), problem, "Copy or save it again"));
    };
    let data = &data[..count * size];
    let values = if size == 8 {
        data.as_chunks::<8>().0.iter().map(|&b| f64::from_le_bytes(b)).collect()
    } else {
        data.as_chunks::<4>().0.iter().map(|&b| f64::from(f32::from_le_bytes(b))).collect()
    };
    Ok(Array { shape, values })
}

fn no_entry(name: &str) -> Error {
    Error::whole(format!("The header has no entry '{name}'"), "Save the array again by numpy.save")
}

/// What follows a key of the header, a Python dictionary, and its colon.
fn field<'a>(header: &'a [u8], key: &[u8]) -> Option<&'a [u8]> {
    let start = header.windows(key.len()).position(|window| window == key)? + key.len();
    let rest = header[start..].trim_ascii_start().strip_prefix(b":")?;
    Some(rest.trim_ascii_start())
}

/// A tuple of whole numbers: `(80, 7)`, `(5,)`, `()`.
fn shape(text: &[u8]) -> Result<Vec<usize>> {
    let fault = || {
        let shown = quote(&text[..text.len().min(40)]);
        Error::whole(format!("The shape {shown} is none"), "Save the array again by numpy.save")
    };
    let end = text.iter().position(|&byte| byte == b')').ok_or_else(fault)?;
    let inside = text[..end].strip_prefix(b"(").ok_or_else(fault)?;
    let axes = inside.split(|&byte| byte == b',').map(<[u8]>::trim_ascii).filter(|axis| !axis.is_empty());
    let axis = |axis: &[u8]| {
        let whole = axis.iter().all(u8::is_ascii_digit) && axis.len() < 16;
        leading_number(axis).filter(|_| whole).map(|(value, _)| value as usize).ok_or_else(fault)
    };
    axes.map(axis).collect()
}

/// The rows of an array of poses: 7 or 8 numbers a pose, or matrices, given as rows of 12 numbers (3 x 4, row by row).
#[derive(Debug, Clone, PartialEq)]
pub enum PoseRows {
    /// x y z and a quaternion in an order that the file does not tell.
    Quaternions(Vec<[f64; 7]>),
    /// Rotation and translation, 3 x 4, row by row.
    Matrices(Vec<[f64; 12]>),
}

/// Poses of an array: (N, 7); (N, 8), of which the first is the time and dropped; (N, 4, 4); (N, 3, 4).
///
/// # Errors
/// Another shape; a value that is not finite; a quaternion that is none of unit length; a matrix that is no motion.
pub fn pose_rows(array: &Array) -> Result<PoseRows> {
    if let Some(index) = array.values.iter().position(|value| !value.is_finite()) {
        let row = index / (array.values.len() / array.shape.first().copied().unwrap_or(1).max(1)).max(1);
        let problem = format!("Pose {} holds {}, not a finite number", row + 1, array.values[index]);
        return Err(Error::whole(problem, "Leave the pose out along with its frame"));
    }
    match array.shape[..] {
        [_, columns @ (7 | 8)] => {
            let rows = array.values.chunks_exact(columns).map(|row| std::array::from_fn(|i| row[i + columns - 7]));
            Ok(PoseRows::Quaternions(rows.enumerate().map(unit_length).collect::<Result<_>>()?))
        }
        [_, rows @ (3 | 4), 4] => {
            let matrices = array.values.chunks_exact(4 * rows).map(|matrix| std::array::from_fn(|i| matrix[i]));
            Ok(PoseRows::Matrices(matrices.enumerate().map(rigid).collect::<Result<_>>()?))
        }
        _ => {
            let problem = format!("An array of shape {:?} is no list of poses", array.shape);
            Err(Error::whole(problem, "Poses are (N, 7): x y z and a quaternion, or (N, 4, 4): matrices"))
        }
    }
}

fn unit_length((index, row): (usize, [f64; 7])) -> Result<[f64; 7]> {
    let length = row[3..].iter().map(|value| value * value).sum::<f64>().sqrt();
    if (length - 1.0).abs() <= 1e-2 {
        return Ok(row);
    }
    let problem = format!("Pose {} has a quaternion of length {length} in its last four columns", index + 1);
    Err(Error::whole(problem, "The columns are x y z and a quaternion of length 1"))
}

fn rigid((index, row): (usize, [f64; 12])) -> Result<[f64; 12]> {
    let matrix = DMatrix::from_row_slice(3, 4, &row);
    let R: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    if (R * R.transpose() - Matrix3::identity()).norm() <= 1e-2 && R.determinant() > 0.0 {
        return Ok(row);
    }
    Err(Error::whole(format!("Matrix {} is no rigid motion", index + 1), "Give rotations without scale or mirroring"))
}
