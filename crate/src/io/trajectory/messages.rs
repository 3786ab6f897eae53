//! Poses as a [table of messages](crate::io::message_table): `nav_msgs/Odometry` or `geometry_msgs/PoseStamped`, a pose a
//! row.

use super::columns::Builder;
use super::tum;
use crate::io::message_table::MessageTable;
use crate::{Error, Result};

const COLUMNS: [&str; 7] =
    ["position.x", "position.y", "position.z", "orientation.x", "orientation.y", "orientation.z", "orientation.w"];

/// Whether the first line names the fields of a message with a pose.
pub(super) fn is_table(bytes: &[u8]) -> bool {
    let head = &bytes[..bytes.len().min(2000)];
    let has_header = head.starts_with(b"%time") || head.windows(13).any(|window| window == b"header.stamp.");
    let table = MessageTable::from_head(head);
    has_header && COLUMNS.iter().all(|column| table.column_ending(column).is_some())
}

pub(super) fn read(bytes: &[u8]) -> Result<Builder> {
    let table = MessageTable::from_head(bytes);
    let columns = COLUMNS.map(|column| table.column_ending(column).unwrap_or_default());
    let tum = tum::table();
    let mut builder = Builder::new();
    // A last row that is cut off is left out without a note.
    for row in &table.rows(bytes)?.0 {
        let mut numbers = vec![table.time(row)?.unwrap_or_default()];
        for column in columns {
            numbers.push(row.value(column)?);
        }
        builder.push_table(&tum, &numbers, &|problem, remedy| Error::line(row.line, problem, remedy))?;
    }
    Ok(builder)
}
