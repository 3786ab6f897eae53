//! Trajectories in files, read, written and converted.
//!
//! | format | a pose |
//! |---|---|
//! | TUM | a line `timestamp tx ty tz qx qy qz qw` (s, m), the quaternion with its real part last |
//! | KITTI | a line of the upper three rows of its matrix, after its number or time where there is one; times (s) in a file of their own |
//! | EuRoC | a line `timestamp, x, y, z, qw, qx, qy, qz` (ns, m); further columns are not read |
//! | [pose table](TrajectoryFormat::PoseTable) | a line of columns that a first line names, or of `x y z qw qx qy qz` |
//! | matrices | four lines of four numbers, with or without a line of counts before (Redwood's `.log`) |
//! | NumPy | a row of an array (N, 7) `x y z qw qx qy qz`, (N, 8) as TUM, (N, 2) or (N, 3) of positions, (N, 12), (N, 16), (N, 3, 4) or (N, 4, 4) of matrices; (4, 4) is one pose |
//! | positions | a line `x y` or `x y z` (m), without orientation |
//! | planar poses | a line `number x y theta` or `time x y theta` (s, m, rad) |
//!
//! Times are seconds, unless they are said to be nanoseconds or their intervals show nanoseconds or microseconds.
//!
//! Values of text are separated by blanks, tabs, commas or semicolons. `#` begins a comment, and empty lines do not count. LF,
//! CRLF and lone CR end a line. A byte order mark is skipped, and so is a first line of column names.
//!
//! Tables of ROS messages with poses, as `rostopic echo -p` writes them, are read as TUM.

use std::fmt::Write as _;

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use crate::geometry::{Embedding, Pose2, Pose3};
use crate::io::text::refuse_pointer_and_utf16;
use crate::{Error, Result};

mod columns;
pub(crate) mod euroc;
pub(crate) mod kitti;
pub(crate) mod matrices;
mod messages;
pub(crate) mod npy;
mod rows;
mod times;
pub(crate) mod tum;

use columns::{Builder, Layout, Table, left_out, not_finite};
use rows::{Row, rows};

pub use matrices::matrix_text;
pub use tum::{read_tum, tum_text};

/// Order of a quaternion's numbers in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
pub enum QuaternionOrder {
    /// qx qy qz qw, as TUM writes it.
    RealPartLast,
    /// qw qx qy qz, as EuRoC and Habitat write it.
    RealPartFirst,
}

impl QuaternionOrder {
    /// The other one.
    pub(crate) fn other(self) -> Self {
        match self {
            Self::RealPartLast => Self::RealPartFirst,
            Self::RealPartFirst => Self::RealPartLast,
        }
    }
}

/// How the quaternions of a file were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QuaternionColumns {
    /// Their order.
    pub order: QuaternionOrder,
    /// Whether the file names its columns.
    pub is_named: bool,
}

/// Positions over time, or over the frames of a recording, with what the file gave along with them.
///
/// `stamps`, `orientations` and `rotation_matrices` are either absent or as long as `positions`. Everything is finite.
/// The order is the file's: stamps may go back, and whoever associates by time has to sort.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// Times (s), from whatever zero the recorder had.
    pub stamps: Option<Vec<f64>>,
    /// Positions of the sensor in the world (m); z is 0 where the file has x and y alone.
    pub positions: Vec<Vector3<f64>>,
    /// Orientations of the sensor in the world.
    pub orientations: Option<Vec<UnitQuaternion<f64>>>,
    /// How the file's quaternions were read, where it has such.
    pub quaternion_columns: Option<QuaternionColumns>,
    /// The orientations as the file wrote them, where it holds matrices. Rounded to seven digits they are not quite
    /// rotations; errors that are to agree with other programs' to the last digit are computed from them as they are.
    pub rotation_matrices: Option<Vec<Matrix3<f64>>>,
    /// Numbers of the poses as the file wrote them, where it has such in place of times.
    pub numbers: Option<Vec<f64>>,
    /// Headings as the file wrote them, where it has such: radians, if whoever wrote them kept to that.
    pub headings: Option<Vec<f64>>,
    /// Rows of the file that hold no pose, ascending and counted from 0 over all rows: trackers write `nan` or `-inf` in every
    /// frame that they lost. The other fields leave them out.
    pub undefined: Vec<usize>,
}

impl Trajectory {
    /// The trajectory of these poses, `T_world_sensor`, without times.
    pub fn from_poses(poses: &[Pose3]) -> Self {
        Self {
            positions: poses.iter().map(|pose| pose.translation.vector).collect(),
            orientations: Some(poses.iter().map(|pose| pose.rotation).collect()),
            ..Self::default()
        }
    }

    /// Number of positions.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Number of rows of the file: positions, and rows without a pose.
    pub fn num_rows(&self) -> usize {
        self.len() + self.undefined.len()
    }

    /// Index of the position that a row of the file holds, for rows counted from 0; `None` where it holds none.
    pub fn index_of_row(&self, row: usize) -> Option<usize> {
        let before = self.undefined.binary_search(&row).err()?;
        Some(row - before).filter(|&index| index < self.len())
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

    /// The rotations as matrices, as the file wrote them if it holds matrices; `None` without orientations.
    pub fn matrices(&self) -> Option<Vec<Matrix3<f64>>> {
        let of_quaternions = || {
            let matrix = |q: &UnitQuaternion<f64>| q.to_rotation_matrix().into_inner();
            Some(self.orientations.as_ref()?.iter().map(matrix).collect())
        };
        self.rotation_matrices.clone().or_else(of_quaternions)
    }

    /// The same trajectory with these times (s).
    ///
    /// # Errors
    /// When there are not as many times as poses, or as rows of the file.
    pub fn with_stamps(mut self, stamps: Vec<f64>) -> Result<Self> {
        let stamps = if self.undefined.is_empty() || stamps.len() != self.num_rows() {
            stamps
        } else {
            (0..).zip(stamps).filter(|(row, _)| self.index_of_row(*row).is_some()).map(|(_, stamp)| stamp).collect()
        };
        if stamps.len() != self.len() {
            let problem = format!("There are {} times for {} poses", stamps.len(), self.len());
            return Err(Error::whole(problem, "Give one time for each pose"));
        }
        self.stamps = Some(stamps);
        Ok(self)
    }
}

/// How a file holds a trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(target_arch = "wasm32", derive(tsify::Tsify))]
#[serde(rename_all = "snake_case")]
pub enum TrajectoryFormat {
    /// `timestamp tx ty tz qx qy qz qw`.
    Tum,
    /// The upper three rows of the pose's matrix in one line.
    Kitti,
    /// `timestamp [ns], x, y, z, qw, qx, qy, qz`, separated by commas.
    Euroc,
    /// Columns that the first line names, or `x, y, z, qw, qx, qy, qz`.
    PoseTable,
    /// 4 x 4 matrices.
    Matrices,
    /// A NumPy array.
    Npy,
    /// `x y z` or `x y`.
    Positions,
    /// `number x y theta`.
    Planar,
}

/// A trajectory with what reading it showed.
#[derive(Debug, Clone, PartialEq)]
pub struct Contents {
    /// The poses.
    pub trajectory: Trajectory,
    /// The form that the file has.
    pub format: TrajectoryFormat,
    /// What was mended, in whole sentences: quaternions that were not of unit length, times that were not seconds.
    pub notes: Vec<String>,
}

/// Reads a trajectory of any form that the [module's documentation](self) lists.
///
/// # Errors
/// No line at all; a line that differs from the first in its columns; a value that is no finite number; a quaternion
/// that is none of unit length, a matrix that is no rotation. The error names line and column.
pub fn read(bytes: &[u8]) -> Result<Trajectory> {
    let (builder, _) = parse(bytes, None)?;
    builder.into_strict()
}

/// Reads a trajectory as [`read`] does, of the given form where one is given. Quaternions of any length but zero are
/// normalised, as evo does, and rows whose positions have no finite value are left out, unless no pose is left; notes say so.
///
/// # Errors
/// As [`read`], but for the length of quaternions and for such rows.
pub fn read_lenient(bytes: &[u8], format: Option<TrajectoryFormat>) -> Result<Contents> {
    let (builder, format) = parse(bytes, format)?;
    let (trajectory, notes) = builder.into_lenient()?;
    Ok(Contents { trajectory, format, notes })
}

/// Reads a recording's poses from one file each, in the order given: 4 x 4 matrices, or any other form of one pose. Files whose
/// values are not finite hold none and are left out, with a note.
///
/// # Errors
/// As [`read`], and when a file holds several poses, or one holds orientations and another does not. The error names the
/// file.
pub fn read_frames(files: &[(&str, &[u8])]) -> Result<Contents> {
    let mut all = Trajectory::default();
    let (mut notes, mut format) = (Vec::new(), TrajectoryFormat::Matrices);
    for &(name, bytes) in files {
        if parse(bytes, None).is_ok_and(|(builder, _)| builder.is_one_undefined()) {
            all.undefined.push(all.num_rows());
            continue;
        }
        let read = |format| read_lenient(bytes, format).map_err(|error| error.in_file(name));
        let one = match read(None)? {
            // In the file of a single frame, rows of four numbers are those of a matrix, even if its last row is missing.
            planar if planar.format == TrajectoryFormat::Planar => read(Some(TrajectoryFormat::Matrices))?,
            other => other,
        };
        if one.trajectory.len() != 1 {
            let problem = format!("The file has {} poses", one.trajectory.len());
            return Err(Error::whole(problem, "Of several files, each holds the pose of one frame").in_file(name));
        }
        let Trajectory { positions, orientations, rotation_matrices, quaternion_columns, .. } = one.trajectory;
        all.quaternion_columns = quaternion_columns;
        all.positions.extend(positions);
        if let Some(orientations) = orientations {
            all.orientations.get_or_insert_default().extend(orientations);
        }
        if let Some(matrices) = rotation_matrices {
            all.rotation_matrices.get_or_insert_default().extend(matrices);
        }
        let lengths = [all.orientations.as_ref().map(Vec::len), all.rotation_matrices.as_ref().map(Vec::len)];
        if lengths.into_iter().flatten().any(|length| length != all.len()) {
            let remedy = "Give the poses of all frames in the same form";
            return Err(Error::whole("The file differs in its form from those before", remedy).in_file(name));
        }
        notes.extend(one.notes.into_iter().map(|note| format!("{name}: {note}")));
        format = one.format;
    }
    notes.extend(left_out(&all));
    if all.is_empty() { Err(nothing()) } else { Ok(Contents { trajectory: all, format, notes }) }
}

/// Reads times, one a line (s), as KITTI keeps them beside its poses.
///
/// # Errors
/// A line of several columns or of what is no finite number; no line at all.
pub fn read_times(bytes: &[u8]) -> Result<Vec<f64>> {
    let mut numbers = Vec::new();
    let mut time = |row: Row| {
        row.exactly(1, &mut numbers)?;
        let fault = |problem: String, remedy: &str| row.fault(problem, remedy);
        if numbers[0].is_finite() { Ok(numbers[0]) } else { Err(not_finite(0, numbers[0], &fault)) }
    };
    let times: Result<Vec<f64>> = rows(bytes).map(&mut time).collect();
    times.and_then(|times| if times.is_empty() { Err(nothing()) } else { Ok(times) })
}

/// Writes a trajectory. Numbers have the fewest digits that read back as the same. Where the form has times and the trajectory
/// has none, the numbers of the poses from 0 take their place.
///
/// # Errors
/// When the form needs orientations and the trajectory has none.
pub fn write(trajectory: &Trajectory, format: TrajectoryFormat) -> Result<Vec<u8>> {
    let poses = || {
        trajectory.poses().ok_or_else(|| {
            let problem = "The trajectory has positions alone, and this form needs orientations as well";
            Error::whole(problem, "Write it as positions")
        })
    };
    Ok(match format {
        TrajectoryFormat::Tum => tum_text(trajectory.stamps.as_deref(), &poses()?).into_bytes(),
        TrajectoryFormat::Kitti => kitti::text(&matrix_poses(trajectory, &poses()?)).into_bytes(),
        TrajectoryFormat::Euroc => euroc::text(trajectory.stamps.as_deref(), &poses()?).into_bytes(),
        TrajectoryFormat::PoseTable => columns::pose_table_text(trajectory.stamps.as_deref(), &poses()?).into_bytes(),
        TrajectoryFormat::Matrices => matrices::text(&matrix_poses(trajectory, &poses()?)).into_bytes(),
        TrajectoryFormat::Npy => npy::write(&poses()?),
        TrajectoryFormat::Positions => positions_text(&trajectory.positions).into_bytes(),
        TrajectoryFormat::Planar => planar_text(&poses()?).into_bytes(),
    })
}

/// A pose of the plane as one of space: z = 0, turned about the z axis.
pub fn in_space(pose: &Pose2) -> Pose3 {
    pose.in_space()
}

/// A rotation matrix and a translation (m), the matrix as the file wrote it.
type MatrixPose = (Matrix3<f64>, Vector3<f64>);

fn matrix_poses(trajectory: &Trajectory, poses: &[Pose3]) -> Vec<MatrixPose> {
    let rotation = |index: usize, pose: &Pose3| match &trajectory.rotation_matrices {
        Some(matrices) => matrices[index],
        None => pose.rotation.to_rotation_matrix().into_inner(),
    };
    poses.iter().enumerate().map(|(index, pose)| (rotation(index, pose), pose.translation.vector)).collect()
}

fn positions_text(positions: &[Vector3<f64>]) -> String {
    positions.iter().fold(String::new(), |mut text, p| {
        let _ = writeln!(text, "{:?} {:?} {:?}", p.x, p.y, p.z);
        text
    })
}

/// What leaves the plane is lost.
fn planar_text(poses: &[Pose3]) -> String {
    let mut text = String::from("# number x y theta\n");
    for (index, pose) in poses.iter().enumerate() {
        let (t, q) = (pose.translation.vector, pose.rotation);
        let heading = (q * Vector3::x()).xy();
        let _ = writeln!(text, "{index} {:?} {:?} {:?}", t.x, t.y, heading.y.atan2(heading.x));
    }
    text
}

fn nothing() -> Error {
    Error::whole("The file has no line with numbers", "A trajectory has one pose or position a line")
}

/// Reads the poses and finds out, where it is not given, which form they have.
fn parse(bytes: &[u8], format: Option<TrajectoryFormat>) -> Result<(Builder, TrajectoryFormat)> {
    refuse_pointer_and_utf16(bytes)?;
    if format == Some(TrajectoryFormat::Npy) || (format.is_none() && npy::is_npy(bytes)) {
        return Ok((npy::read(bytes)?, TrajectoryFormat::Npy));
    }
    if format.is_none() && messages::is_table(bytes) {
        return Ok((messages::read(bytes)?, TrajectoryFormat::Tum));
    }
    let mut lines = rows(bytes).peekable();
    let first = lines.peek().ok_or_else(nothing)?.clone();
    let names = rows::column_names(bytes);
    let (layout, format) = match format {
        None => detect(&first, names.as_deref(), bytes)?,
        Some(format) => (layout_of(format, &first, names.as_deref())?, format),
    };
    let builder = match layout {
        Layout::MatrixLines => matrices::read(lines)?,
        Layout::Table(table) => {
            let mut builder = Builder::new();
            let mut numbers = Vec::new();
            for row in lines {
                table.numbers_of(&row, &mut numbers)?;
                builder.push_table(&table, &numbers, &|problem, remedy| row.fault(problem, remedy))?;
            }
            if let Some(column) = table.seconds() {
                builder.mend_fractions(|| times::with_padded_fractions(bytes, column));
            }
            builder
        }
        Layout::MatrixRow { num_columns } => {
            let mut builder = Builder::new();
            let mut numbers = Vec::new();
            for row in lines {
                row.exactly(num_columns, &mut numbers)?;
                builder.push_matrix_row(&numbers, &|problem, remedy| row.fault(problem, remedy))?;
            }
            builder
        }
    };
    Ok((builder, format))
}

/// The form that the names and the number of columns tell of.
fn detect(first: &Row, names: Option<&[String]>, bytes: &[u8]) -> Result<(Layout, TrajectoryFormat)> {
    let columns = first.columns().count();
    // Comments may speak of anything: names count where there is one for each column.
    if let Some(table) =
        names.filter(|names| [columns, first.fields().len()].contains(&names.len())).and_then(Table::from_names)
    {
        let format = if table.is_tum() {
            TrajectoryFormat::Tum
        } else if table.is_euroc() {
            TrajectoryFormat::Euroc
        } else if table.has_orientations() {
            TrajectoryFormat::PoseTable
        } else {
            TrajectoryFormat::Positions
        };
        return Ok((Layout::Table(table), format));
    }
    let format = match columns {
        3 if matrices::has_counts(bytes) => TrajectoryFormat::Matrices,
        2 | 3 => TrajectoryFormat::Positions,
        4 if matrices::has_last_rows(bytes) => TrajectoryFormat::Matrices,
        4 if first.begins_with_count() => TrajectoryFormat::Planar,
        4 if rows::has_ascending_times(bytes) => {
            return Ok((Layout::Table(columns::timed_planar()), TrajectoryFormat::Planar));
        }
        7 => TrajectoryFormat::PoseTable,
        8.. if euroc::is_euroc(first) => TrajectoryFormat::Euroc,
        8 => TrajectoryFormat::Tum,
        12 | 13 => TrajectoryFormat::Kitti,
        4 | 16 | 17 => TrajectoryFormat::Matrices,
        _ => {
            let problem = format!("The line has {columns} columns");
            let remedy = "A trajectory has 8 (t x y z qx qy qz qw), 7 (x y z qw qx qy qz), 12 or 16 (a matrix, with a number or \
                          time before it 13 or 17), 3 (x y z) or 2 (x y) on every line";
            return Err(first.fault(problem, remedy));
        }
    };
    Ok((layout_of(format, first, names)?, format))
}

fn layout_of(format: TrajectoryFormat, first: &Row, names: Option<&[String]>) -> Result<Layout> {
    let columns = first.columns().count();
    Ok(match format {
        TrajectoryFormat::Tum => Layout::Table(tum::table()),
        TrajectoryFormat::Kitti => Layout::MatrixRow { num_columns: if columns == 13 { 13 } else { 12 } },
        TrajectoryFormat::Euroc => Layout::Table(euroc::table()),
        TrajectoryFormat::PoseTable => {
            Layout::Table(names.and_then(Table::from_names).unwrap_or_else(columns::pose_table))
        }
        TrajectoryFormat::Matrices if matches!(columns, 16 | 17) => Layout::MatrixRow { num_columns: columns },
        TrajectoryFormat::Matrices => Layout::MatrixLines,
        TrajectoryFormat::Positions if columns == 2 => Layout::Table(Table::positions(2)),
        TrajectoryFormat::Positions => Layout::Table(Table::positions(3)),
        TrajectoryFormat::Planar => Layout::Table(columns::planar()),
        TrajectoryFormat::Npy => return Err(Error::whole("The file is no NumPy array", "Save it with numpy.save")),
    })
}
