//! A grid that is there without the scans it was made of, edited by steps.

use super::edit_faults::check_alone;
use super::edits::{Edit, RefusedEdit};
use super::map_edits::MapEdits;
use crate::error::Result;
use crate::map::occupancy_grid::OccupancyGrid;

/// Paints and crops a grid. Returns the steps that had no effect, with the reason: those outside the grid, and those that need the
/// scans.
///
/// # Errors
/// When a step is not valid; the grid stays as it is.
pub fn edit_grid(grid: &mut OccupancyGrid, steps: &[Edit]) -> Result<Vec<RefusedEdit>> {
    (1..).zip(steps).try_for_each(|(number, step)| check_alone(number, step))?;
    let (edits, mut unused) = MapEdits::of_grid(steps);
    unused.extend(edits.edit(grid));
    unused.sort_by_key(|refused| refused.index);
    Ok(unused)
}
