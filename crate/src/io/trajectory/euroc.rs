//! EuRoC's form: `timestamp, x, y, z, qw, qx, qy, qz` a line, separated by commas, the time in nanoseconds. The velocities
//! and biases that the data set's ground truth has in further columns are not read.

use std::fmt::Write as _;

use super::columns::Table;
use super::rows::Row;
use crate::geometry::Pose3;
use crate::io::text::number;
use crate::io::time_unit::{NANOSECOND, unit_since_1970};

pub(super) fn table() -> Table {
    Table::stamped(1e9, [4, 5, 6, 7], true, "timestamp [ns], x, y, z, qw, qx, qy, qz")
}

/// Whether a line of eight columns or more is EuRoC's and not TUM's: commas, and a time that can only be nanoseconds since 1970.
pub(super) fn is_euroc(row: &Row) -> bool {
    let stamp = row.columns().next().and_then(number);
    row.has_commas() && stamp.and_then(unit_since_1970) == Some(NANOSECOND)
}

/// Times are rounded to nanoseconds; where there are none, the numbers of the poses are seconds.
pub(super) fn text(stamps: Option<&[f64]>, poses: &[Pose3]) -> String {
    let mut text = String::from(
        "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n",
    );
    for (index, pose) in poses.iter().enumerate() {
        let stamp = stamps.and_then(|stamps| stamps.get(index).copied()).unwrap_or(index as f64);
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        let nanoseconds = stamp * 1e9;
        let _ =
            writeln!(text, "{nanoseconds:.0},{:?},{:?},{:?},{:?},{:?},{:?},{:?}", t.x, t.y, t.z, q.w, q.x, q.y, q.z);
    }
    text
}
