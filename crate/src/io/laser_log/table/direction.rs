//! Which way the angles of a table grow, as far as it tells.

use std::f64::consts::PI;

use super::rows::Table;
use super::{AngleColumn, Layout, TableFormat, format};

/// That angles were taken to grow counter-clockwise: the other way round, the readings give the mirror image of the same map, whose
/// scans agree as well, so that nothing in the table tells which it is.
pub(super) fn note_on_direction(table: &Table, format: &TableFormat) -> Option<String> {
    let remedy = match format.layout {
        Layout::ReadingPerLine { angle: Some(AngleColumn { column, unit }), .. } if unit > 0.0 => {
            format!("angle={}:-{}deg", column + 1, format::degrees_of_unit(unit))
        }
        Layout::ScanPerLine { first, .. } if !is_named_as_ros(table, first) && format.step > 0.0 => {
            let [start, step] = [-format.start, -format.step].map(format::degrees);
            format!("step={step}deg,start={start}deg")
        }
        _ => return None,
    };
    Some(format!(
        "Its angles are taken to grow counter-clockwise. Of a laser that turns clockwise, as RPLIDAR, YDLIDAR and LDROBOT \
         do, the map is mirrored: give {remedy}."
    ))
}

/// Whether the angles may as well grow clockwise: those from 0 to beyond 180 degrees, as lasers count them that turn all round, of
/// columns or of readings. Those of ROS (columns `ranges`) and of lasers that look ahead grow counter-clockwise.
pub(super) fn is_direction_open(table: &Table, format: &TableFormat) -> bool {
    match format.layout {
        Layout::ReadingPerLine { angle: Some(AngleColumn { column, unit }), .. } => {
            let angles = || table.rows.iter().filter_map(|row| row.values.get(column));
            unit > 0.0 && angles().all(|&angle| angle >= 0.0) && angles().any(|&angle| unit * angle > PI)
        }
        Layout::ScanPerLine { first, end } => {
            let last = format.start + format.step * (end - first - 1) as f64;
            let is_beyond_half = format.start.min(last) >= 0.0 && format.start.max(last) > PI;
            is_beyond_half && !is_named_as_ros(table, first)
        }
        Layout::ReadingPerLine { .. } => false,
    }
}

/// Whether the first range is called as ROS calls them, whose angles grow counter-clockwise.
fn is_named_as_ros(table: &Table, first: usize) -> bool {
    table.names.get(first).is_some_and(|name| name.contains("ranges"))
}
