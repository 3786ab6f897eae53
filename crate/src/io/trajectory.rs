//! Trajectories in text files, read and written.
//!
//! - TUM: `timestamp tx ty tz qx qy qz qw` a line (s, m), the quaternion with its real part last.
//! - Positions alone: `x y` or `x y z` a line (m).
//!
//! Values are apart by blanks, tabs, commas or semicolons. `#` begins a comment, empty lines do not count, LF, CRLF and
//! lone CR end a line, a byte order mark is stepped over, and so is a first line of column names.

use std::fmt::Write as _;

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::text::{number, quote, without_byte_order_mark};
use crate::geometry::{Pose2, Pose3};
use crate::{Error, Result};

/// Positions over time, or over the frames of a recording, with what the file gave along with them.
///
/// `stamps` and `orientations` are either absent or as long as `positions`. Everything is finite. The order is the
/// file's: stamps may go back, and whoever associates by time has to sort.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// Times (s), from whatever zero the recorder had.
    pub stamps: Option<Vec<f64>>,
    /// Positions of the sensor in the world (m); z is 0 where the file has x and y alone.
    pub positions: Vec<Vector3<f64>>,
    /// Orientations of the sensor in the world.
    pub orientations: Option<Vec<UnitQuaternion<f64>>>,
}

impl Trajectory {
    /// The trajectory of these poses, `T_world_sensor`, without times.
    pub fn from_poses(poses: &[Pose3]) -> Self {
        Self {
            stamps: None,
            positions: poses.iter().map(|pose| pose.translation.vector).collect(),
            orientations: Some(poses.iter().map(|pose| pose.rotation).collect()),
        }
    }

    /// Number of positions.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no position.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The poses `T_world_sensor`, if the orientations are known.
    pub fn poses(&self) -> Option<Vec<Pose3>> {
        let pose = |(&position, &orientation)| Isometry3::from_parts(Translation3::from(position), orientation);
        Some(self.positions.iter().zip(self.orientations.as_ref()?).map(pose).collect())
    }
}

/// Reads a trajectory of any form that the [module's documentation](self) lists; the number of columns tells which.
///
/// # Errors
/// Another number of columns; no line at all; a line that differs from the first in its columns; a value that is no
/// finite number; a quaternion that is none of unit length. The error names line and column.
pub fn read(bytes: &[u8]) -> Result<Trajectory> {
    let mut rows = rows(bytes).peekable();
    let first = rows.peek().ok_or_else(nothing)?;
    match first.columns().count() {
        8 => tum(rows),
        2 => positions::<2>(rows),
        3 => positions::<3>(rows),
        columns => {
            let problem = format!("The line has {columns} columns");
            Err(first.fault(problem, "A trajectory has 8 (t x y z qx qy qz qw), 3 (x y z) or 2 (x y) on every line"))
        }
    }
}

/// Reads a trajectory in TUM format.
///
/// # Errors
/// As [`read`].
pub fn read_tum(bytes: &[u8]) -> Result<Trajectory> {
    tum(rows(bytes))
}

fn tum<'a>(rows: impl Iterator<Item = Row<'a>>) -> Result<Trajectory> {
    let (mut stamps, mut positions, mut orientations) = (Vec::new(), Vec::new(), Vec::new());
    for row in rows {
        let [stamp, x, y, z, qx, qy, qz, qw] = row.numbers()?;
        stamps.push(stamp);
        positions.push(Vector3::new(x, y, z));
        orientations.push(row.unit_quaternion(Quaternion::new(qw, qx, qy, qz))?);
    }
    if positions.is_empty() {
        return Err(nothing());
    }
    Ok(Trajectory { stamps: Some(stamps), positions, orientations: Some(orientations) })
}

fn positions<'a, const N: usize>(rows: impl Iterator<Item = Row<'a>>) -> Result<Trajectory> {
    let position = |row: Row| {
        let numbers = row.numbers::<N>()?;
        Ok(Vector3::from_fn(|axis, _| numbers.get(axis).copied().unwrap_or(0.0)))
    };
    Ok(Trajectory { stamps: None, positions: rows.map(position).collect::<Result<_>>()?, orientations: None })
}

fn nothing() -> Error {
    Error::whole("The file has no line with numbers", "A trajectory has one pose or position a line")
}

/// The lines that hold something, but for a first one of names.
fn rows(bytes: &[u8]) -> impl Iterator<Item = Row<'_>> {
    let mut rows = without_byte_order_mark(bytes)
        .split(|&byte| byte == b'\n')
        .flat_map(|line| line.strip_suffix(b"\r").unwrap_or(line).split(|&byte| byte == b'\r'))
        .enumerate()
        .map(|(index, text)| Row { line: index + 1, text })
        .filter(|row| row.columns().next().is_some())
        .peekable();
    rows.next_if(|row| row.columns().all(|column| number(column).is_none()));
    rows
}

/// A line of columns.
struct Row<'a> {
    /// Its number, from 1.
    line: usize,
    text: &'a [u8],
}

impl<'a> Row<'a> {
    /// What stands between the separators, before any comment.
    fn columns(&self) -> impl Iterator<Item = &'a [u8]> {
        let values = self.text.split(|&byte| byte == b'#').next().unwrap_or_default();
        values.split(|&byte| matches!(byte, b' ' | b'\t' | b',' | b';')).filter(|column| !column.is_empty())
    }

    fn numbers<const N: usize>(&self) -> Result<[f64; N]> {
        let num_columns = self.columns().count();
        if num_columns != N {
            let problem = format!("The line has {num_columns} columns in place of {N}");
            return Err(self.fault(problem, "Every line needs the same columns: correct or remove this one"));
        }
        let mut numbers = [0.0; N];
        for (index, (slot, column)) in numbers.iter_mut().zip(self.columns()).enumerate() {
            *slot = number(column).filter(|value| value.is_finite()).ok_or_else(|| {
                let problem = format!("Column {} is {}, not a finite number", index + 1, quote(column));
                self.fault(problem, "Write decimal numbers, or remove the line")
            })?;
        }
        Ok(numbers)
    }

    /// The rotation of a quaternion whose length is off by a hundredth at the most: files round to four decimals.
    fn unit_quaternion(&self, quaternion: Quaternion<f64>) -> Result<UnitQuaternion<f64>> {
        let length = quaternion.norm();
        if (length - 1.0).abs() <= 1e-2 {
            return Ok(UnitQuaternion::new_normalize(quaternion));
        }
        let problem = format!("Columns 5 to 8 are no rotation: a quaternion has length 1, and theirs is {length}");
        Err(self.fault(problem, "The columns are t x y z qx qy qz qw"))
    }

    fn fault(&self, problem: String, remedy: &str) -> Error {
        Error::line(self.line, problem, remedy)
    }
}

/// Writes poses `T_world_sensor` in TUM format with these times (s), or the numbers of the poses from 0 where there are
/// none. Every number has the fewest digits that read back as the same.
pub fn tum_text(stamps: Option<&[f64]>, poses: &[Pose3]) -> String {
    let mut text = String::from("# timestamp tx ty tz qx qy qz qw\n");
    for (index, pose) in poses.iter().enumerate() {
        let stamp = stamps.and_then(|stamps| stamps.get(index).copied()).unwrap_or(index as f64);
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        // nalgebra keeps a quaternion's coordinates as TUM writes them, the real part last.
        let _ = writeln!(text, "{stamp:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?}", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
    }
    text
}

/// A pose as the 4 x 4 matrix of its homogeneous coordinates, one row a line.
pub fn matrix_text(pose: &Pose3) -> String {
    let matrix = pose.to_homogeneous();
    // Adding zero turns -0 into 0.
    let row = |row: usize| [0, 1, 2, 3].map(|column| format!("{:?}", matrix[(row, column)] + 0.0)).join(" ") + "\n";
    (0..4).map(row).collect()
}

/// A pose of the plane as one of space: z = 0, turned about the z axis.
pub fn in_space(pose: &Pose2) -> Pose3 {
    let t = pose.translation.vector;
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.rotation.angle());
    Isometry3::from_parts(Translation3::new(t.x, t.y, 0.0), rotation)
}
