//! Occupancy grids from files for JavaScript.

use tsify::Ts;
use wasm_bindgen::prelude::*;

use crate::thrown::Thrown;

use crate::mending::{Edits, edits};
use crate::occupancy_grid::OccupancyGrid;
use crate::plain;
use scanstitch::error::Result as EngineResult;
use scanstitch::io::occupancy_map::{self, MapYaml, OccupancyMap};
use scanstitch::map::occupancy_grid::OccupancyGrid as Grid;
use scanstitch::pipeline::planar::{RefusedEdit, edit_grid};

/// Name of the picture that a YAML file of ROS's map_server belongs to.
///
/// # Errors
/// When the file is not such a file.
#[wasm_bindgen]
pub fn map_image_name(name: &str, yaml: &[u8]) -> Result<String, Thrown> {
    Ok(MapYaml::read(yaml).map_err(|error| error.in_file(name))?.image)
}

#[wasm_bindgen]
impl OccupancyGrid {
    /// The map of a YAML file of ROS's map_server and its picture: PGM, PNG, PPM or JPEG.
    ///
    /// # Errors
    /// When one of them is not valid.
    pub fn of_yaml(name: &str, yaml: &[u8], picture_name: &str, picture: &[u8]) -> Result<OccupancyGrid, Thrown> {
        let yaml = MapYaml::read(yaml).map_err(|error| error.in_file(name))?;
        of_map(picture_name, occupancy_map::of_picture(&yaml, picture))
    }

    /// The map of a picture whose pixels have this side (m): black is occupied, white is free, its lower left corner is the origin.
    ///
    /// # Errors
    /// When the picture is not valid or the side is not positive.
    pub fn of_picture(name: &str, picture: &[u8], resolution: f64) -> Result<OccupancyGrid, Thrown> {
        let yaml = MapYaml::of_scale(resolution).map_err(|error| error.in_file(name))?;
        of_map(name, occupancy_map::of_picture(&yaml, picture))
    }

    /// The map of CMU 16-831, `wean.dat`, unpacked.
    ///
    /// # Errors
    /// When the file is not such a map.
    pub fn of_probabilities(name: &str, bytes: &[u8]) -> Result<OccupancyGrid, Thrown> {
        of_map(name, occupancy_map::read_probabilities(bytes))
    }

    /// Paints and crops the map by these steps. Returns those that had no effect, with the reason: those outside the map, and those that
    /// need the scans it was made of.
    ///
    /// # Errors
    /// When a step is not valid; the map stays as it is.
    #[wasm_bindgen(unchecked_return_type = "RefusedEdit[]")]
    pub fn edit(&mut self, steps: Edits) -> Result<Vec<Ts<RefusedEdit>>, Thrown> {
        Ok(edit_grid(&mut self.grid, &edits(steps)?)?.iter().map(plain).collect())
    }

    /// What is worth knowing of the map, in whole sentences; empty where there is nothing.
    #[wasm_bindgen(getter)]
    pub fn remark(&self) -> String {
        self.grid.remark.clone()
    }

    /// Turn of the grid's x axis from the world's (rad).
    #[wasm_bindgen(getter)]
    pub fn yaw(&self) -> f64 {
        self.grid.yaw
    }
}

fn of_map(name: &str, map: EngineResult<OccupancyMap>) -> Result<OccupancyGrid, Thrown> {
    Ok(OccupancyGrid { grid: Grid::of_map(&map.map_err(|error| error.in_file(name))?) })
}
