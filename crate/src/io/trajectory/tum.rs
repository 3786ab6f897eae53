//! TUM's form: `timestamp tx ty tz qx qy qz qw` a line (s, m), the quaternion with its real part last.

use std::fmt::Write as _;

use super::columns::Table;
use super::{Trajectory, TrajectoryFormat, parse};
use crate::Result;
use crate::geometry::Pose3;

pub(super) fn table() -> Table {
    Table::stamped(1.0, [7, 4, 5, 6], false, "t x y z qx qy qz qw")
}

/// Reads a trajectory in TUM format.
///
/// # Errors
/// As [`read`](super::read).
pub fn read_tum(bytes: &[u8]) -> Result<Trajectory> {
    parse(bytes, Some(TrajectoryFormat::Tum))?.0.into_strict()
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
