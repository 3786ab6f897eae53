//! Which column holds what, and poses from columns.

use std::fmt::Write as _;

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::times::in_seconds;
use super::{QuaternionColumns, QuaternionOrder, Trajectory, nothing};
use crate::geometry::Pose3;
use crate::geometry::rotation::{ROTATION_TOLERANCE, nearest_rotation, rotation_defect};
use crate::io::text::quote;
use crate::io::trajectory::rows::Row;
use crate::{Error, Result};

/// Below this length a quaternion is zero: the length squared drowns in rounding.
const MIN_QUATERNION_NORM: f64 = 1e-8;

/// Where the numbers of a pose stand.
pub(super) enum Layout {
    Table(Table),
    /// The rows of its matrix in one line: 12 or 16 numbers, after its number or time where the line has one more.
    MatrixRow {
        num_columns: usize,
    },
    /// A line a row of its matrix.
    MatrixLines,
}

/// Columns of a table of poses, counted from 0.
#[derive(Debug, Clone, Default)]
pub(super) struct Table {
    /// Columns that every line has.
    num_columns: usize,
    /// Whether lines may have more.
    more: bool,
    /// The time's column, and what it is divided by to give seconds.
    stamp: Option<(usize, f64)>,
    /// The column that counts the poses.
    number: Option<usize>,
    x: usize,
    y: usize,
    z: Option<usize>,
    /// w, x, y, z.
    quaternion: Option<[usize; 4]>,
    heading: Option<usize>,
    /// Whether a first line names the columns: those that are not used may then hold anything, or nothing.
    is_named: bool,
    /// The columns in words, for messages.
    words: &'static str,
}

impl Table {
    /// `x y` or `x y z`.
    pub(super) fn positions(num_columns: usize) -> Self {
        let words = if num_columns == 2 { "x y" } else { "x y z" };
        let z = (num_columns > 2).then_some(2);
        Self { num_columns, x: 0, y: 1, z, words, ..Self::default() }
    }

    /// `t x y z` and the quaternion at these columns.
    pub(super) fn stamped(divisor: f64, quaternion_wxyz: [usize; 4], more: bool, words: &'static str) -> Self {
        let (stamp, quaternion) = (Some((0, divisor)), Some(quaternion_wxyz));
        Self { num_columns: 8, more, stamp, x: 1, y: 2, z: Some(3), quaternion, words, ..Self::default() }
    }

    /// The table that these names describe, if they name a position at least.
    pub(super) fn from_names(names: &[String]) -> Option<Self> {
        let find = |spellings: &[&str]| names.iter().position(|name| spellings.contains(&name.as_str()));
        let axis = |axis: &str| {
            let prefixes = ["", "t", "p", "t_", "p_", "pos_", "position_", "position.", "p_rs_r_"];
            names.iter().position(|name| prefixes.iter().any(|prefix| *name == format!("{prefix}{axis}")))
        };
        let component = |component: &str| {
            let prefixes = ["q", "q_", "r", "r_", "quat_", "quaternion_", "orientation_", "orientation.", "q_rs_"];
            names.iter().position(|name| prefixes.iter().any(|prefix| *name == format!("{prefix}{component}")))
        };
        let nanoseconds = find(&["timestamp_ns", "time_ns", "stamp_ns", "t_ns"]).map(|column| (column, 1e9));
        let seconds = find(&["t", "time", "timestamp", "stamp", "timestamp_s", "time_s"]).map(|column| (column, 1.0));
        let (x, y) = (axis("x")?, axis("y")?);
        let quaternion = match ["w", "x", "y", "z"].map(component) {
            [Some(w), Some(x), Some(y), Some(z)] => Some([w, x, y, z]),
            _ => None,
        };
        let heading = find(&["theta", "yaw", "heading"]).filter(|_| quaternion.is_none());
        Some(Self {
            num_columns: names.len(),
            stamp: nanoseconds.or(seconds),
            number: find(&["id", "index", "number", "frame"]),
            x,
            y,
            z: axis("z"),
            quaternion,
            heading,
            is_named: true,
            words: "as its first line names them",
            ..Self::default()
        })
    }

    /// The column of times in seconds.
    pub(super) fn seconds(&self) -> Option<usize> {
        self.stamp.and_then(|(column, divisor)| (divisor == 1.0).then_some(column))
    }

    /// Whether these are TUM's columns.
    pub(super) fn is_tum(&self) -> bool {
        self.stamp == Some((0, 1.0)) && self.x == 1 && self.quaternion == Some([7, 4, 5, 6]) && self.num_columns == 8
    }

    /// Whether it is known how the sensor is turned.
    pub(super) fn has_orientations(&self) -> bool {
        self.quaternion.is_some() || self.heading.is_some()
    }

    /// Whether the times are nanoseconds and the quaternion's real part comes first, right after the position.
    pub(super) fn is_euroc(&self) -> bool {
        self.stamp == Some((0, 1e9)) && self.x == 1 && self.quaternion == Some([4, 5, 6, 7])
    }

    pub(super) fn numbers_of(&self, row: &Row, numbers: &mut Vec<f64>) -> Result<()> {
        if self.is_named {
            let position = [self.x, self.y].into_iter().chain(self.z).chain(self.heading).chain(self.number);
            let used =
                position.chain(self.stamp.map(|(column, _)| column)).chain(self.quaternion.into_iter().flatten());
            return row.named(self.num_columns, |column| used.clone().any(|other| other == column), numbers);
        }
        if self.more { row.at_least(self.num_columns, numbers) } else { row.exactly(self.num_columns, numbers) }
    }
}

/// The homework's `x y z qw qx qy qz`.
pub(super) fn pose_table() -> Table {
    Table { quaternion: Some([3, 4, 5, 6]), num_columns: 7, words: "x y z qw qx qy qz", ..Table::positions(3) }
}

/// `number x y theta`.
pub(super) fn planar() -> Table {
    let words = "number x y theta";
    Table { num_columns: 4, number: Some(0), x: 1, y: 2, heading: Some(3), words, ..Table::default() }
}

/// `t x y theta`.
pub(super) fn timed_planar() -> Table {
    Table { num_columns: 4, number: None, stamp: Some((0, 1.0)), words: "t x y theta", ..planar() }
}

/// Poses with named columns, with their times (s) where there are any.
pub(super) fn pose_table_text(stamps: Option<&[f64]>, poses: &[Pose3]) -> String {
    let mut text = String::from(if stamps.is_some() { "timestamp," } else { "" }) + "x,y,z,qw,qx,qy,qz\n";
    for (index, pose) in poses.iter().enumerate() {
        if let Some(stamp) = stamps.and_then(|stamps| stamps.get(index)) {
            let _ = write!(text, "{stamp:?},");
        }
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        let _ = writeln!(text, "{:?},{:?},{:?},{:?},{:?},{:?},{:?}", t.x, t.y, t.z, q.w, q.x, q.y, q.z);
    }
    text
}

/// Makes the error at the place that is being read.
pub(super) type Fault<'a> = &'a dyn Fn(String, &str) -> Error;

/// Where the position stands in a matrix, row by row.
pub(super) const POSITION_OF_MATRIX: [usize; 3] = [3, 7, 11];

/// The error about a value that is not finite, its column counted from 0.
pub(super) fn not_finite(column: usize, value: f64, fault: Fault) -> Error {
    let word = value.to_string().to_ascii_lowercase();
    let problem = format!("Column {} is {}, not a finite number", column + 1, quote(word.as_bytes()));
    fault(problem, "Write decimal numbers, or remove the line")
}

/// The error about columns w x y z that hold a quaternion of this length.
fn off_length(length: f64, columns: [usize; 4], words: &str, fault: Fault) -> Error {
    let (low, high) = columns.iter().fold((usize::MAX, 0), |(low, high), &c| (low.min(c), high.max(c)));
    let (low, high) = (low + 1, high + 1);
    let problem =
        format!("Columns {low} to {high} are not a rotation: a quaternion has length 1, and theirs is {length}");
    fault(problem, &format!("The columns are {words}"))
}

/// The error about the last row of a matrix.
fn last_row(last: &[f64], fault: Fault) -> Error {
    fault(format!("The last row of the matrix is {last:?}"), "The last row of a pose is 0 0 0 1")
}

/// How many rows without a pose were left out, in a sentence.
pub(super) fn left_out(trajectory: &Trajectory) -> Option<String> {
    let first = trajectory.undefined.first()?;
    Some(format!(
        "{} of its {} poses have nan or inf in place of numbers (first pose {first}, counted from 0) or a \
         quaternion of zeros, as trackers write where they are lost; these are left out.",
        trajectory.undefined.len(),
        trajectory.num_rows()
    ))
}

/// A trajectory in the making.
pub(super) struct Builder {
    trajectory: Trajectory,
    /// The first quaternion whose length is off, and how many there are.
    off_length: Option<(Error, usize)>,
    /// What is wrong with the first matrix that was written column by column, and how many there are.
    transposed: Option<(Error, usize)>,
    /// Times whose fractions were given the leading zeros that they lacked.
    num_padded: usize,
    /// What is wrong with the first row that holds no pose.
    undefined: Option<Error>,
}

impl Builder {
    pub(super) fn new() -> Self {
        Self { trajectory: Trajectory::default(), off_length: None, transposed: None, num_padded: 0, undefined: None }
    }

    /// Adds the pose of a row of a table.
    pub(super) fn push_table(&mut self, table: &Table, numbers: &[f64], fault: Fault) -> Result<()> {
        let value = |column: usize| numbers.get(column).copied().unwrap_or_default();
        let labels: Vec<usize> = table.number.into_iter().chain(table.stamp.map(|(column, _)| column)).collect();
        let position: Vec<usize> = [table.x, table.y].into_iter().chain(table.z).collect();
        if self.is_undefined(numbers, &labels, &position, fault)? {
            return Ok(());
        }
        let is_zero = |columns: [usize; 4]| columns.iter().all(|&column| value(column).abs() < MIN_QUATERNION_NORM);
        if let Some(columns) = table.quaternion.filter(|&columns| is_zero(columns)) {
            self.push_undefined(|| off_length(0.0, columns, table.words, fault));
            return Ok(());
        }
        self.trajectory.positions.push(Vector3::new(value(table.x), value(table.y), table.z.map_or(0.0, value)));
        if let Some((column, divisor)) = table.stamp {
            self.trajectory.stamps.get_or_insert_default().push(value(column) / divisor);
        }
        if let Some(column) = table.number {
            self.trajectory.numbers.get_or_insert_default().push(value(column));
        }
        if let Some([w, x, y, z]) = table.quaternion {
            let quaternion = Quaternion::new(value(w), value(x), value(y), value(z));
            let order = if w < x { QuaternionOrder::RealPartFirst } else { QuaternionOrder::RealPartLast };
            self.trajectory.quaternion_columns = Some(QuaternionColumns { order, is_named: table.is_named });
            self.push_quaternion(quaternion, |length| off_length(length, [w, x, y, z], table.words, fault));
        } else if let Some(column) = table.heading {
            self.trajectory.headings.get_or_insert_default().push(value(column));
            let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), value(column));
            self.trajectory.orientations.get_or_insert_default().push(rotation);
        }
        Ok(())
    }

    /// The length of a quaternion in the file is rounded; larger deviations are noted.
    fn push_quaternion(&mut self, quaternion: Quaternion<f64>, error: impl FnOnce(f64) -> Error) {
        // Of a huge quaternion the square is infinite: it is scaled first.
        let scale = if quaternion.norm_squared().is_finite() { 1.0 } else { quaternion.coords.amax() };
        let quaternion = quaternion / scale;
        let length = quaternion.norm() * scale;
        if (length - 1.0).abs() > ROTATION_TOLERANCE {
            self.off_length =
                Some(self.off_length.take().map_or_else(|| (error(length), 1), |(first, count)| (first, count + 1)));
        }
        let rotation = UnitQuaternion::new_normalize(quaternion);
        self.trajectory.orientations.get_or_insert_default().push(rotation);
    }

    /// Whether the row holds no pose, as no value of its position is finite; it is then counted. Where only some values are not
    /// finite, or a label (time or number) is not, that is an error.
    fn is_undefined(&mut self, numbers: &[f64], labels: &[usize], position: &[usize], fault: Fault) -> Result<bool> {
        let is_finite = |column: usize| numbers.get(column).is_some_and(|value| value.is_finite());
        let Some(first) = (0..numbers.len()).find(|&column| !is_finite(column)) else { return Ok(false) };
        let error = |column: usize| not_finite(column, numbers[column], fault);
        if let Some(&label) = labels.iter().find(|&&label| !is_finite(label)) {
            return Err(error(label));
        }
        if position.iter().any(|&column| is_finite(column)) {
            return Err(error(first));
        }
        self.push_undefined(|| error(first));
        Ok(true)
    }

    /// Counts a row that holds no pose.
    pub(super) fn push_undefined(&mut self, error: impl FnOnce() -> Error) {
        self.trajectory.undefined.push(self.trajectory.num_rows());
        self.undefined.get_or_insert_with(error);
    }

    /// Takes the times that `padded` gives all rows, where those that were read go back and these do not: seconds and a count of
    /// micro- or nanoseconds with a point between, whose leading zeros were not written.
    pub(super) fn mend_fractions(&mut self, padded: impl FnOnce() -> Option<Vec<f64>>) {
        let Some(stamps) = self.trajectory.stamps.as_ref().filter(|stamps| !stamps.is_sorted()) else { return };
        let Some(padded) = padded() else { return };
        let of_poses: Vec<f64> =
            (0..).zip(padded).filter_map(|(row, time)| self.trajectory.index_of_row(row).map(|_| time)).collect();
        if of_poses.len() == stamps.len() && of_poses.is_sorted() {
            self.num_padded = stamps.iter().zip(&of_poses).filter(|(read, padded)| read != padded).count();
            self.trajectory.stamps = Some(of_poses);
        }
    }

    /// Whether there is one row, and it holds no pose.
    pub(super) fn is_one_undefined(&self) -> bool {
        self.trajectory.undefined == [0] && self.trajectory.is_empty()
    }

    /// Adds the pose of a line of a matrix, after its number or time where there is one.
    pub(super) fn push_matrix_row(&mut self, numbers: &[f64], fault: Fault) -> Result<()> {
        let (labels, matrix) = numbers.split_at(numbers.len() % 4);
        if let Some(label) = labels.iter().find(|label| !label.is_finite()) {
            return Err(not_finite(0, *label, fault));
        }
        let before = self.trajectory.len();
        self.push_matrix(matrix, fault)?;
        if let [label] = labels
            && self.trajectory.len() > before
        {
            self.trajectory.stamps.get_or_insert_default().push(*label);
        }
        Ok(())
    }

    /// Adds the pose of a matrix of three or four rows of four.
    pub(super) fn push_matrix(&mut self, numbers: &[f64], fault: Fault) -> Result<()> {
        if self.is_undefined(numbers, &[], &POSITION_OF_MATRIX, fault)? {
            return Ok(());
        }
        // Programs that multiply rows by matrices, and those that keep matrices column by column, have the translation in the last row.
        let is_transposed =
            matches!(numbers, [_, _, _, 0.0, _, _, _, 0.0, _, _, _, 0.0, x, y, z, 1.0] if [*x, *y, *z] != [0.0; 3]);
        if is_transposed {
            let first = self.transposed.take();
            self.transposed =
                Some(first.map_or_else(|| (last_row(&numbers[12..], fault), 1), |(first, count)| (first, count + 1)));
        }
        let row_by_row: Vec<f64> =
            (0..numbers.len()).map(|at| numbers[if is_transposed { at % 4 * 4 + at / 4 } else { at }]).collect();
        let [a, b, c, x, d, e, f, y, g, h, i, z, last @ ..] = &row_by_row[..] else {
            return Err(fault(format!("A matrix of {} numbers is not a pose", numbers.len()), "Give 12 or 16"));
        };
        if !(last.is_empty() || last == [0.0, 0.0, 0.0, 1.0]) {
            return Err(last_row(last, fault));
        }
        let R = Matrix3::new(*a, *b, *c, *d, *e, *f, *g, *h, *i);
        let deviation = rotation_defect(&R);
        let rotation = nearest_rotation(&R).filter(|_| deviation <= ROTATION_TOLERANCE).ok_or_else(|| {
            let problem = if R.determinant() < 0.0 && deviation <= ROTATION_TOLERANCE {
                "The matrix mirrors: its determinant is -1".to_owned()
            } else {
                format!("The matrix is not a rotation: R^T R is off the identity by {deviation}")
            };
            fault(problem, "A pose is a rotation and a translation, without scale and in one handedness")
        })?;
        self.trajectory.positions.push(Vector3::new(*x, *y, *z));
        self.trajectory.orientations.get_or_insert_default().push(rotation);
        self.trajectory.rotation_matrices.get_or_insert_default().push(R);
        Ok(())
    }

    /// With times in seconds, about which there may be a note. Whole labels of matrices are the poses' numbers.
    fn with_times(mut self) -> (Self, Option<String>) {
        let Trajectory { stamps, numbers, rotation_matrices, .. } = &mut self.trajectory;
        let note = stamps.as_mut().and_then(|stamps| in_seconds(stamps));
        let are_numbers = |stamps: &mut Vec<f64>| stamps.iter().all(|stamp| *stamp >= 0.0 && stamp.fract() == 0.0);
        if rotation_matrices.is_some() && note.is_none() {
            *numbers = stamps.take_if(are_numbers);
        }
        (self, note)
    }

    /// The trajectory, unless a quaternion's length is off, a matrix is written column by column or a row holds no pose.
    pub(super) fn into_strict(self) -> Result<Trajectory> {
        let (builder, _) = self.with_times();
        let of_first = |found: Option<(Error, usize)>| found.map(|(error, _)| error);
        match builder.undefined.or(of_first(builder.off_length)).or(of_first(builder.transposed)) {
            Some(error) => Err(error),
            None if builder.trajectory.is_empty() => Err(nothing()),
            None => Ok(builder.trajectory),
        }
    }

    /// The trajectory, with notes where quaternions were normalised and rows left out; an error where no row holds a pose.
    pub(super) fn into_lenient(self) -> Result<(Trajectory, Vec<String>)> {
        let (builder, unit) = self.with_times();
        let padded = (builder.num_padded > 0).then(|| {
            let count = builder.num_padded;
            format!(
                "Its times go back as they are written. {count} of them lack the leading zeros of their fractions (1.75 for 1.000075, \
                 as where seconds and microseconds are written with a point between), and were read with them: then none goes back."
            )
        });
        let transposed = builder.transposed.map(|(_, count)| {
            format!("{count} matrices have their translation in the last row: they were read column by column.")
        });
        let note = builder.off_length.map(|(error, count)| {
            let them = if count == 1 { "It was" } else { &format!("{count} quaternions were") };
            format!("{error} {them} made of length 1.")
        });
        let left_out = match builder.undefined {
            Some(error) if builder.trajectory.is_empty() => return Err(error),
            _ => left_out(&builder.trajectory),
        };
        Ok((builder.trajectory, [unit, padded, transposed, note, left_out].into_iter().flatten().collect()))
    }
}
