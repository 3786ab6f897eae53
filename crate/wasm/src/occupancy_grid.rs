//! Occupancy grids for JavaScript.

use wasm_bindgen::prelude::*;

use scanstitch::map::occupancy_grid::OccupancyGrid as Grid;

/// A grid of free, occupied and unknown cells. Call `free()` when it is no longer used.
#[wasm_bindgen]
pub struct OccupancyGrid {
    pub(crate) grid: Grid,
}

#[wasm_bindgen]
impl OccupancyGrid {
    /// Cells along x.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> usize {
        self.grid.width
    }

    /// Cells along y.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> usize {
        self.grid.height
    }

    /// Side of a cell (m).
    #[wasm_bindgen(getter)]
    pub fn resolution(&self) -> f64 {
        self.grid.resolution
    }

    /// x and y of the grid's corner with the smallest x and y, in the world frame (m).
    #[wasm_bindgen(getter)]
    pub fn origin(&self) -> Vec<f64> {
        vec![self.grid.origin.x, self.grid.origin.y]
    }

    /// Grey values of the cells, row by row from the largest y down: 0 occupied, 254 free, 205 unknown.
    pub fn grey_values(&self) -> Vec<u8> {
        self.grid.grey_values()
    }

    /// The picture as a PGM file.
    pub fn pgm(&self) -> Vec<u8> {
        self.grid.pgm()
    }

    /// The YAML file of ROS's map_server for the picture of this name.
    pub fn yaml(&self, image: &str) -> String {
        self.grid.yaml(image)
    }
}
