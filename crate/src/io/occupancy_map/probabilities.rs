//! CMU 16-831's map: a header that names the side of a cell in centimetres, then the probabilities of all cells.
//!
//! The rows of the file go along x, the values of a row along y, as the course's reader `bee-map.c` has it. Its description says that 1 is
//! occupied; in the file that was given out, 1 is free. What is inside rooms tells: rooms are wider than walls.

use nalgebra::Vector2;

use super::OccupancyMap;
use super::yaml::checked_resolution;
use crate::error::{Error, Result};
use crate::geometry::Pose2;
use crate::io::length_unit::CENTIMETRE;
use crate::io::limits::MAX_PIXELS;
use crate::io::text::{lines, number, quote, without_byte_order_mark};

const REMEDY: &str = "Give the file of CMU's course 16-831 as it is";
/// A cell is free or occupied where it is so with this probability: between, the file has what its maker assumed of cells that no beam
/// reached.
const SURE: f32 = 0.9;

/// Whether a file that begins like this is such a map.
pub fn looks_like_probabilities(head: &[u8]) -> bool {
    without_byte_order_mark(head).starts_with(b"robot_specifications->")
}

/// Reads such a map.
///
/// # Errors
/// A header without size or resolution; a value that is no probability and not -1; fewer values than announced.
pub fn read_probabilities(bytes: &[u8]) -> Result<OccupancyMap> {
    let mut resolution = None;
    let mut cells: Option<Cells> = None;
    for (line, text) in lines(without_byte_order_mark(bytes)) {
        let mut words = text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        if let Some(cells) = &mut cells {
            words.try_for_each(|word| cells.push(word, line))?;
            continue;
        }
        let key = words.next().unwrap_or_default();
        let mut value = || words.next().and_then(number);
        if key.ends_with(b"->resolution") {
            resolution = value().map(|centimetres| CENTIMETRE.metres * centimetres);
        } else if key.starts_with(b"global_map") {
            cells = Some(Cells::new([value(), value()], bytes.len() as u64)?);
        }
    }
    let missing = |what: &str| Error::whole(format!("The header has no {what}"), REMEDY);
    let resolution = checked_resolution(resolution.ok_or_else(|| missing("robot_specifications->resolution"))?)?;
    cells.ok_or_else(|| missing("global_map"))?.map(resolution)
}

/// The cells read so far, in the order of the file.
struct Cells {
    size: [usize; 2],
    values: Vec<f32>,
}

impl Cells {
    fn new(size: [Option<f64>; 2], num_bytes: u64) -> Result<Self> {
        let [Some(rows), Some(columns)] = size else {
            return Err(Error::whole("global_map has no size", REMEDY));
        };
        let cells = rows * columns;
        // A value takes a digit and a blank at least.
        if !(rows >= 1.0 && columns >= 1.0 && cells <= (num_bytes / 2).min(MAX_PIXELS) as f64) {
            let problem =
                format!("The header announces {rows} x {columns} cells, more than the file can hold, or none");
            return Err(Error::whole(problem, "Copy the file again"));
        }
        Ok(Self { size: [rows as usize, columns as usize], values: Vec::with_capacity(cells as usize) })
    }

    fn push(&mut self, word: &[u8], line: usize) -> Result<()> {
        let value = number(word).filter(|value| *value == -1.0 || (0.0..=1.0).contains(value));
        let value =
            value.ok_or_else(|| Error::line(line, format!("{} is no probability and not -1", quote(word)), REMEDY))?;
        if self.values.len() == self.size[0] * self.size[1] {
            return Err(Error::line(
                line,
                format!("More values than {} x {} cells", self.size[0], self.size[1]),
                REMEDY,
            ));
        }
        self.values.push(if value < 0.0 { f32::NAN } else { value as f32 });
        Ok(())
    }

    fn map(self, resolution: f64) -> Result<OccupancyMap> {
        let [width, height] = self.size;
        if self.values.len() < width * height {
            let problem = format!("The map is cut off: it has {} of {} cells", self.values.len(), width * height);
            return Err(Error::whole(problem, "Copy the file again"));
        }
        let is_inverted = self.num_inside(|value| value >= SURE) > self.num_inside(|value| value <= 1.0 - SURE);
        let occupancy = |value: f32| if is_inverted { 1.0 - value } else { value };
        let at = |index: usize| occupancy(self.values[index % width * height + index / width]);
        let note = "The values were read as probabilities of being free: where they are 1 there is room for a robot, where they are 0 \
                    there are walls.";
        Ok(OccupancyMap {
            resolution,
            T_world_grid: Pose2::new(Vector2::zeros(), 0.0),
            width,
            height,
            occupancy: (0..width * height).map(at).map(sure).collect(),
            notes: if is_inverted { vec![note.to_owned()] } else { Vec::new() },
        })
    }

    /// Cells that are so, and all eight around them.
    fn num_inside(&self, is_so: impl Fn(f32) -> bool) -> usize {
        let [rows, columns] = self.size;
        let around = |row: usize, column: usize| {
            (row - 1..=row + 1).all(|r| self.values[r * columns + column - 1..][..3].iter().all(|&value| is_so(value)))
        };
        (1..rows.saturating_sub(1))
            .map(|row| (1..columns.saturating_sub(1)).filter(|&column| around(row, column)).count())
            .sum()
    }
}

/// The value where it is sure, else unknown.
fn sure(occupancy: f32) -> f32 {
    if occupancy >= SURE || occupancy <= 1.0 - SURE { occupancy } else { f32::NAN }
}
