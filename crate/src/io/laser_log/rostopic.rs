//! Laser scans as a [table of messages](crate::io::message_table): `sensor_msgs/LaserScan`, a scan a row.

use super::table::series_of_names;
use super::{Bearings, LaserLog, LaserScan};
use crate::io::limits::MAX_BEAMS;
use crate::io::message_table::{MessageTable, Row, with_a_cell_for_each_element};
use crate::{Error, Result};

/// Whether the beginning of a file names the columns of laser scans.
pub(super) fn looks_like_rostopic(head: &[u8]) -> bool {
    let table = MessageTable::from_head(head);
    table.column("angle_min").is_some() && table.column("angle_increment").is_some()
}

#[inline(never)]
pub(super) fn read(bytes: &[u8]) -> Result<LaserLog> {
    let bytes = &with_a_cell_for_each_element(bytes);
    let table = MessageTable::from_head(bytes);
    let ranges = range_columns(&table)?;
    let (rows, cut) = table.rows(bytes)?;
    let scans =
        rows.iter().enumerate().map(|(number, row)| scan(&table, &ranges, row, number)).collect::<Result<_>>()?;
    let losses = cut.map(|line| format!("Line {line}, the last one, is cut off and was left out."));
    Ok(LaserLog { scans, losses: losses.into_iter().collect(), ..LaserLog::default() })
}

/// The columns `ranges0`, `ranges_1`, `ranges[2]`, ... in their order; where none are called so, the longest run of numbered names.
fn range_columns(table: &MessageTable) -> Result<Vec<usize>> {
    let numbered = |(column, name): (usize, &String)| {
        let number = name.strip_prefix("ranges")?.trim_matches(['_', '[', ']', '.']);
        Some((number.parse().ok()?, column as u32))
    };
    let mut ranges: Vec<(u64, u32)> = table.names.iter().enumerate().filter_map(numbered).collect();
    ranges.sort_unstable();
    if ranges.is_empty()
        && let Some(columns) = series_of_names(&table.names)
    {
        return Ok(columns.collect());
    }
    if !(2..=MAX_BEAMS).contains(&ranges.len()) {
        let problem = format!("{} columns are named as ranges (ranges0, ranges1, ...)", ranges.len());
        return Err(Error::line(
            1,
            problem,
            "Export each range as a column of its own: rostopic echo -p -b FILE.bag /scan",
        ));
    }
    Ok(ranges.into_iter().map(|(_, column)| column as usize).collect())
}

fn scan(table: &MessageTable, ranges: &[usize], row: &Row, number: usize) -> Result<LaserScan> {
    let optional = |name: &str| table.column(name).map(|column| row.value(column)).transpose();
    let (start, step) = (optional("angle_min")?.unwrap_or(f64::NAN), optional("angle_increment")?.unwrap_or(f64::NAN));
    if !(start.is_finite() && step.is_finite() && step != 0.0) {
        let problem = format!("The readings lie {step} rad apart, from {start} rad on");
        return Err(Error::line(row.line, problem, "Correct the line or remove it"));
    }
    let nearest = optional("range_min")?.unwrap_or(0.0).max(0.0);
    // Drivers that leave the limit unset write 0.
    let farthest = optional("range_max")?.filter(|farthest| *farthest > nearest).unwrap_or(f64::INFINITY);
    let is_valid = |range: f64| range.is_finite() && range >= nearest && range <= farthest;
    let range = |&column: &usize| row.value(column).map(|range| if is_valid(range) { range as f32 } else { f32::NAN });
    Ok(LaserScan {
        number,
        line: row.line,
        bearings: Bearings::Even { start, step },
        ranges: ranges.iter().map(range).collect::<Result<_>>()?,
        max_range: f64::INFINITY,
        time: table.time(row)?,
        reference: None,
        odometry: None,
    })
}
